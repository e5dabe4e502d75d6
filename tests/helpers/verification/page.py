"""docs/verification.json: written from rows, shown by the page of verification, and held to them by a test."""

import json
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jointplay as jp

from . import closed_forms, contact, coupled, elastic, first_order, monte_carlo, planar, record_page, spatial
from .random_mechanisms import RandomRow
from .subject import FIGURES, Check, Found, Subject, subjects

NUMBERS = Path(__file__).resolve().parents[3] / "docs" / "verification.json"
CHECKS: tuple[Check, ...] = (
    *planar.CHECKS,
    *monte_carlo.CHECKS,
    *spatial.CHECKS,
    *coupled.CHECKS,
    *elastic.CHECKS,
    *contact.CHECKS,
    *first_order.CHECKS,
)


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
    """What there are rows of: every example and every check that its engine can express."""
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
    """The numbers of all rows."""
    packages = sorted({package for check in CHECKS for package in check.packages})
    return dumped(
        {
            "made": [
                *(f"{package} {version(package)}" for package in ("jointplay", *packages)),
                f"{platform.system()} on {platform.machine()}",
                f"Python {platform.python_version()}",
            ],
            "figures": list(FIGURES),
            "examples": [{"mechanisms": row.example, **_cells(row.check, row.found)} for row in rows],
            "random": [
                {"mechanisms": f"{row.mechanisms} {row.family.name}", **_cells(row.check, row.found)} for row in random
            ],
            "uncovered": [{"figure": figure, "examples": names} for figure, names in uncovered().items() if names],
            **_without_engines(),
        }
    )


def with_record(text: str) -> str:
    """The numbers with the published figures and the closed forms computed again, and nothing else."""
    return dumped(json.loads(text) | _without_engines())


def _without_engines() -> dict[str, list[Any]]:
    return {**record_page.numbers(), "forms": closed_forms.rows()}


def dumped(numbers: dict[str, list[Any]]) -> str:
    """As JSON, one row a line."""
    parts = (
        f"{json.dumps(key)}: [\n" + ",\n".join(f"  {json.dumps(row, ensure_ascii=False)}" for row in rows) + "\n]"
        for key, rows in numbers.items()
    )
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _cells(check: Check, found: Found) -> dict[str, Any]:
    return {
        "figure": check.figure,
        "engine": check.engine,
        "version": ", ".join(f"{package} {version(package)}" for package in check.packages),
        "numbers": found.numbers,
        "difference": float(f"{found.difference:.2g}"),
        "unit": check.unit,
        "tolerance": check.tolerance,
        "why": check.why,
        "remark": found.remark,
    }
