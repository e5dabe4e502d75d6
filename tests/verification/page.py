"""docs/verification.md: written from rows, and read again by the test that holds it to them."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import jointplay as jp

from . import contact, coupled, elastic, first_order, monte_carlo, planar, record_page, spatial
from .random_mechanisms import Family, RandomRow
from .subject import FIGURES, Check, Found, Subject, subjects

PAGE = Path(__file__).resolve().parents[2] / "docs" / "verification.md"
CHECKS: tuple[Check, ...] = (
    *planar.CHECKS,
    *monte_carlo.CHECKS,
    *spatial.CHECKS,
    *coupled.CHECKS,
    *elastic.CHECKS,
    *contact.CHECKS,
    *first_order.CHECKS,
)
HEAD = ("example", "engine", "version", "numbers", "largest difference", "tolerance", "reason for the tolerance")
#: the section after the published figures
DIFFERENCES = "Known differences"
RANDOM_HEAD = ("mechanisms", "figure", *HEAD[1:])
OUTSIDE = "**outside**"

INTRODUCTION = """\
# Verification

<!-- Written by `make verify`; changes by hand are lost. -->

Every bundled example is computed a second time, by engines that share no code with jointplay's core. Each row says what
was compared, with which engine, how many numbers, the largest difference and the tolerance. The last sections list
known differences and what no engine covers. [How it is checked](checks.md) has further measurements.

* An engine gets the mechanism as numbers: points, axes, sizes of clearances, loads. jointplay reads them from the file;
  that reading has tests of its own.
* Where the engine is `numpy`, the equations are written a second time in `tests/oracles`, with nothing of
  jointplay.
* pinocchio and the strings follow the path from the start of the file. The other engines begin at jointplay's nominal
  poses, so that they take the same assembly; the first order is taken at these poses.
* Lengths are compared with the size of the mechanism. An angle counts as the arc at that size.
* Of several outputs or load cases the first is taken. Poses are compared in all configurations. Other figures are
  compared in the first, the middle and the last one. The exact worst case and the Monte Carlo take the middle one, the
  loaded pose of planar linkages all.
* MuJoCo gets the model that [`jointplay export`](exchange.md#models-for-mujoco) writes, with 720 boxes in a ring, and
  comes to rest under its load without friction. Its contacts are made stiffer in three steps and extrapolated to rigid
  ones. The position of the output is compared.
* Pynite is a finite-element program for frames. It gets joints, stiffnesses, deviations and loads from the file itself.
  What is rigid is made stiffer in four steps and extrapolated to rigid. Without clearance Pynite answers alone. With
  clearance it gives the forces in the joints and how they change with each offset, and Clarabel finds the offsets of
  least energy. It is checked that every force then points against its offset. Reactions have the tensions of elastic
  bodies among them.
* "First order" is the linear theory at the nominal pose. The other figures are on the exact loop closure.
* [Published figures](#published-figures) are compared with their printed digits.

`make verify` computes all rows and writes this page. `make test` checks that the page has every example and that every
row is within its tolerance, and it computes some rows again. Last digits depend on the processor and on the versions.
"""

OTHER = """\
The other commands (`compensate`, `map`, `singularities`, `assembly`, `allow`, `allocate`, `screen`) have no rows here.
Their tests compare them with closed forms, finite differences and brute force. Models of MuJoCo are compared at rest;
their dynamics have not been. No row has springs, elastic bearings or beams with two different inertias; their tests
compare them with textbook formulas. How far an elastic structure moves beyond the first order has no row either.
"""


@dataclass(frozen=True)
class Row:
    """One comparison of one example."""

    example: str
    check: Check
    found: Found

    @property
    def good(self) -> bool:
        return self.found.difference <= self.check.tolerance


def wanted() -> Iterator[tuple[Subject, Check]]:
    """What the page has rows of: every example and every check that its engine can express."""
    for check in CHECKS:
        for s in subjects():
            if check.applies(s):
                yield s, check


def uncovered() -> dict[str, list[str]]:
    """Examples without any row, by figure."""
    covered = {(s.name, check.figure) for s, check in wanted()}
    names = jp.examples.names()
    return {figure: [name for name in names if (name, figure) not in covered] for figure in FIGURES}


def written(rows: list[Row], random: list[RandomRow]) -> str:
    """The page."""
    parts = [INTRODUCTION, _versions(), f"{_numbers(rows)}\n"]
    for figure in FIGURES:
        some = [row for row in rows if row.check.figure == figure]
        parts.append(f"## {figure[0].upper()}{figure[1:]}\n")
        parts.append(_table(HEAD, ([row.example, *_cells(row.check, row.found)] for row in some)))
    parts.append("## Random mechanisms\n")
    parts.append(_families(random))
    cells = ([f"{row.mechanisms} {row.family.name}", row.check.figure, *_cells(row.check, row.found)] for row in random)
    parts.append(_table(RANDOM_HEAD, cells))
    parts.append(record_page.section())
    parts.append(f"## {DIFFERENCES}\n")
    parts.append(_remarks(rows, random))
    parts.append("## What is not covered\n")
    parts.append("These figures of these examples have no independent engine yet.\n")
    missing = ([figure, ", ".join(names)] for figure, names in uncovered().items() if names)
    parts.append(_table(("figure", "examples"), missing))
    parts.append(OTHER)
    return "\n".join(parts)


def with_record(text: str) -> str:
    """The page with its published figures computed again, and nothing else."""
    return record_page.replaced(text, DIFFERENCES)


def read(text: str) -> list[dict[str, str]]:
    """The rows of the examples, by column; `figure` is their section."""
    found, figure, head = [], "", ()
    for line in text.splitlines():
        if line.startswith("## "):
            figure, head = line[3:].lower(), ()
        elif line.startswith("| "):
            cells = tuple(cell.strip() for cell in line.strip("|").split(" | "))
            if not head:
                head = cells
            elif head == HEAD and cells[0] != "---":
                found.append({"figure": figure} | dict(zip(head, cells, strict=True)))
    return found


def read_uncovered(text: str) -> dict[str, list[str]]:
    """What the page says is not covered."""
    _, _, section = text.partition("## What is not covered\n")
    lines = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return {figure: names.split(", ") for figure, names in lines[2:]}


def _versions() -> str:
    packages = sorted({package for check in CHECKS for package in check.packages})
    with_ = ", ".join(f"{package} {version(package)}" for package in packages)
    machine = f"{platform.system()} on {platform.machine()}, Python {platform.python_version()}"
    return f"This page was written with jointplay {jp.__version__}, {with_}; {machine}.\n"


def _numbers(rows: list[Row]) -> str:
    total = sum(row.found.numbers for row in rows)
    good = sum(row.good for row in rows)
    examples = len(jp.examples.names())
    return f"{len(rows)} rows compare {total:,} numbers of {examples} examples. {good} are within their tolerances."


def _cells(check: Check, found: Found) -> list[str]:
    versions = ", ".join(f"{package} {version(package)}" for package in check.packages)
    outside = "" if found.difference <= check.tolerance else f" {OUTSIDE}"
    return [
        check.engine,
        versions,
        str(found.numbers),
        f"{found.difference:.2g} {check.unit}{outside}",
        f"{check.tolerance:g}",
        check.why,
    ]


def _table(head: Iterable[str], rows: Iterable[list[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def _families(random: list[RandomRow]) -> str:
    families: list[Family] = list(dict.fromkeys(row.family for row in random))
    return "\n".join(f"* {family.name}: {family.what}" for family in families) + "\n"


def _remarks(rows: list[Row], random: list[RandomRow]) -> str:
    said = [f"* {row.example}, {row.check.figure}: {row.found.remark}." for row in rows if row.found.remark]
    said += [f"* {row.family.name}, {row.check.figure}: {row.found.remark}." for row in random if row.found.remark]
    reason = "In these configurations the optimiser ends at another pose than `loaded`, with more work of the load."
    reason += " They are not among the numbers of the rows. [loaded](checks.md#loaded) says more.\n"
    return "\n".join([reason, *said]) + "\n" if said else "None.\n"
