"""Least cost with a required yield, beside all plans tried one by one.

`python tests/verify_allocations.py [COUNT]` takes COUNT problems (60) by choices, half as many in which one source has
a cost by a formula, and a sixth in which two have; of 60 or more it writes the table of docs/checks.md. It ends with 1
where a plan that holds is more than a hundredth cheaper than the one that was found.
"""

import sys
from dataclasses import dataclass

import jointplay as jp
from helpers.allocations import SAMPLES, cheaper, problem
from helpers.cores import on_all_cores
from helpers.pages import put_table

#: problems from which on a table is one to publish
WHOLE = 60
#: share of the cost by which a plan may be dearer than the best one
WITHIN = 0.01
HELD = ("ok", "unfinished")
ROWS = {0: "choices", 1: "choices, one formula", 2: "choices, two formulas"}


@dataclass(frozen=True)
class Comparison:
    """One problem: what was found, and what the best plan saves beside it as a share of its cost."""

    formulas: int
    seed: int
    contact: str
    status: str
    dearer: float


def compare(place: tuple[int, int]) -> Comparison:
    formulas, seed = place
    at = problem(seed, formulas)
    result = jp.allocate(at.m, "random", contact=at.contact, samples=SAMPLES)
    status, cost = str(result.status.item()), float(result.total_cost)
    held = status in HELD
    # Where nothing was found, nothing that costs less than the dearest plan may hold.
    best = cheaper(at, cost if held else cost * (1.0 + 1e-6))
    dearer = cost / best - 1.0 if held else float("inf") if best <= cost else 0.0
    return Comparison(formulas, seed, at.contact, status, dearer)


def main(count: int) -> int:
    places = [(0, s) for s in range(count)] + [(1, s) for s in range(count // 2)] + [(2, s) for s in range(count // 6)]
    found = list(on_all_cores(compare, places))
    rows = []
    for formulas, name in ROWS.items():
        for contact in ("scattered", "loaded"):
            some = [one for one in found if one.formulas == formulas and one.contact == contact]
            off = [one.dearer for one in some]
            rows.append(
                (
                    name,
                    contact,
                    len(some),
                    sum(one.status in HELD for one in some),
                    sum(d <= 1e-9 for d in off),
                    sum(d <= WITHIN for d in off),
                    f"{100.0 * max(off, default=0.0):.2g} %",
                )
            )
    header = ("sources", "contact", "problems", "with a plan", "as cheap as the best", "within 1 %", "dearest by")
    if count >= WHOLE:
        put_table("allocations", header, rows)
    for row in (header, *rows):
        print(*row, sep=" | ")
    bad = [one for one in found if one.dearer > WITHIN]
    for one in bad:
        print(one)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else WHOLE))
