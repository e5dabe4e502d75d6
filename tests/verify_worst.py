"""How often `worst` misses: its default against many starts, and against an independent optimiser.

    python tests/verify_worst.py                     30,000 figures against 400 starts, 200 mechanisms against IPOPT
    python tests/verify_worst.py --seeds 100 102     two mechanisms of every kind

A figure is the largest position error or rotation, or one end of a component, of one mechanism of `wide`. It is missed
where more starts find one that is larger by more than 1e-6 of it. Mechanisms are counted apart whose status is not
`ok`: part of their range lies behind a singular pose, and what can be reached this side of it has no largest value
that a climb could end at.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import jointplay as jp
from helpers.cores import on_all_cores
from helpers.oracles import brute
from helpers.oracles.reading import read
from helpers.strategies import given_offsets
from helpers.wide import KINDS, mechanism
from jointplay.analyses.worst import compute
from jointplay.model.mechanism import Mechanism

#: a figure that is larger by this part of it has been missed
MISSED = 1e-6
#: what rounding makes of a figure that is zero, in the units of the file
ROUNDING = 1e-9
#: one miss in so many figures is allowed
ALLOWED = 10_000
REFERENCE = 400
NAMES = ("position", "rotation", "x low", "x high", "y low", "y high", "angle low", "angle high")


@dataclass(frozen=True)
class Answer:
    """The figures of one mechanism, positive the way they grow, in the order of `NAMES`."""

    figures: np.ndarray
    ok: bool
    seconds: float


@dataclass(frozen=True)
class Miss:
    kind: str
    seed: int
    name: str
    found: float
    larger: float
    ok: bool


def answer(m: Mechanism, starts: int = 24) -> Answer:
    begin = time.process_time()
    result = compute(m, starts=starts)
    seconds = time.process_time() - begin
    ends = np.asarray(result.get("worst_component"))[0] * [-1.0, 1.0]
    figures = [result.get("worst_position")[0], result.get("worst_rotation")[0], *ends.ravel()]
    return Answer(np.array(figures, dtype=float), str(result.get("status")[0]) == "ok", seconds)


def is_missed(found: float, other: float) -> bool:
    return bool(other > found + MISSED * abs(other) + ROUNDING) or (np.isnan(found) and not np.isnan(other))


def misses(kind: str, seed: int, found: Answer, other: Answer) -> Iterator[Miss]:
    for name, low, high in zip(NAMES, found.figures, other.figures, strict=True):
        if is_missed(low, high):
            yield Miss(kind, seed, name, float(low), float(high), found.ok)


def against_many_starts(drawn: tuple[str, int]) -> tuple[Answer, list[Miss]]:
    """Of a mechanism, by its kind and seed: its answer and what more starts find beyond it."""
    m = jp.loads(mechanism(*drawn))
    found = answer(m)
    return found, list(misses(*drawn, found, answer(m, REFERENCE)))


def against_optimiser(drawn: tuple[str, int]) -> tuple[Answer, list[Miss]]:
    """What IPOPT on a closure of its own finds beyond the answer, where `given` confirms it."""
    kind, seed = drawn
    text = mechanism(kind, seed)
    m, link = jp.loads(text), read(text)
    found = answer(m)
    drives = link.configurations[0]
    q, rng = link.nominal(drives), np.random.default_rng(seed)
    beyond = []
    for name, value in zip(NAMES, found.figures, strict=True):
        unit = np.rad2deg(1.0) if name.startswith(("rotation", "angle")) else 1.0
        u = brute.worst(link, q, drives, name, rng).where
        again = jp.given(m, given_offsets(link, dict(zip(link.labels, u.tolist(), strict=True))))
        if str(again.status.item()) != "ok":
            continue  # behind a singular pose, or on another branch
        error = again.error[0].values * [1, 1, np.deg2rad(1.0)]
        larger = float(brute.MEASURES[name](error)) * unit
        if is_missed(value, larger):
            beyond.append(Miss(kind, seed, name, float(value), larger, found.ok))
    return found, beyond


def report(title: str, answers: list[tuple[str, Answer]], missed: list[Miss]) -> bool:
    """Prints the rates by class; whether they are as low as they are to be."""
    figures, seen = Counter[str](), Counter[str]()
    for kind, found in answers:
        figures[f"{kind.split()[0]}, {'ok' if found.ok else 'singular'}"] += len(NAMES)
    for miss in missed:
        seen[f"{miss.kind.split()[0]}, {'ok' if miss.ok else 'singular'}"] += 1
        print(f"missed: {miss.kind} {miss.seed} {miss.name}: {miss.found!r}, but {miss.larger!r}")
    seconds = np.array([found.seconds for _, found in answers])
    print(f"{title}: {len(answers)} mechanisms, median {1e3 * np.median(seconds):.1f} ms, most {seconds.max():.2f} s")
    for name in sorted(figures):
        print(f"  {name:24}{figures[name]:8} figures{seen[name]:6} missed")
    ok = sum(n for name, n in figures.items() if name.endswith("ok"))
    return sum(miss.ok for miss in missed) <= ok / ALLOWED


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(1000, 1084), metavar=("FIRST", "END"))
    parser.add_argument("--optimised", type=int, default=200, metavar="MECHANISMS")
    options = parser.parse_args()
    starts = [(kind, seed) for seed in range(*options.seeds) for kind in KINDS]
    optimised = [(KINDS[k % len(KINDS)], k // len(KINDS)) for k in range(options.optimised)]
    good = True
    for title, compare, drawn in (
        (f"against {REFERENCE} starts", against_many_starts, starts),
        ("against IPOPT", against_optimiser, optimised),
    ):
        answers, missed = [], []
        for (kind, _), (found, beyond) in zip(drawn, on_all_cores(compare, drawn), strict=True):
            answers.append((kind, found))
            missed += beyond
        good &= not answers or report(title, answers, missed)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
