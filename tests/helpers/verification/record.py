"""Published cases: figures as they are printed, what gives them, and what jointplay gives.

`tests/published` has the data, and its README the keys of a case.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

import jointplay as jp

from . import record_formulas
from .record_formulas import rows
from .subject import Array

FOLDER = Path(__file__).resolve().parents[2] / "published"
ROOT = FOLDER.parents[1]
#: the half unit by which rounding changes a printed figure
ROUNDED = 0.5
#: a difference at the very end of its tolerance is within it, by the rounding of the subtraction
SLACK = 1e-9
#: what a printed figure may agree with: by the method of its source, by jointplay
AGREES = ("neither", "method", "jointplay", "both")


@dataclass(frozen=True, eq=False)
class Case:
    """One file of the folder."""

    name: str
    raw: dict[str, Any]

    @cached_property
    def mechanism(self) -> jp.Mechanism:
        if "example" in self.raw:
            return jp.loads(jp.examples.text(self.raw["example"]), self.raw["example"])
        return jp.Mechanism(self.raw["mechanism"])

    @cached_property
    def figures(self) -> list[Figure]:
        return [Figure(self, raw) for raw in self.raw["figures"]]


@dataclass(frozen=True)
class Figure:
    """One printed figure, or a column of them."""

    case: Case
    raw: dict[str, Any]

    @property
    def what(self) -> str:
        return str(self.raw["what"])

    @property
    def agrees(self) -> str:
        return str(self.raw.get("agrees", "jointplay"))

    @cached_property
    def texts(self) -> list[str]:
        """As printed; zeros at the end may be missing in tables."""
        given = self.raw["printed"]
        return self._only(list(given) if isinstance(given, list) else _column(**given))

    @cached_property
    def printed(self) -> Array:
        return np.array([float(text) for text in self.texts])

    @property
    def decimals(self) -> int:
        """Of the last printed digit: those of the whole column, because zeros at the end may be missing in one row."""
        given = self.raw["printed"]
        column = given if isinstance(given, list) else _column(**given)
        return int(self.raw.get("decimals", max(len(text.partition(".")[2]) for text in column)))

    @property
    def tolerance(self) -> float:
        """Half a unit of the last printed digit, or what the case says and why."""
        return float(self.raw.get("within", ROUNDED)) * 10.0**-self.decimals

    @cached_property
    def jointplay(self) -> Array:
        return self._only(self._values(self.raw["answer"]))

    @cached_property
    def method(self) -> Array | None:
        """By the method of the source, where this is not jointplay's."""
        return self._only(_formula(**self.raw["method"])) if "method" in self.raw else None

    @property
    def remark(self) -> str:
        """Why it differs, and why its tolerance is more than the rounding."""
        return "; ".join(str(self.raw[key]) for key in ("why", "because") if key in self.raw)

    def off(self, values: Array | None) -> float:
        """The largest difference from what is printed."""
        if values is None:
            return np.inf
        if values.shape != self.printed.shape:
            raise ValueError(f"{self.case.name}, {self.what}: {values.size} values, {self.printed.size} printed")
        return float(np.max(np.abs(values - self.printed)))

    @property
    def found(self) -> str:
        """What the printed figures agree with."""
        near = self.tolerance * (1.0 + SLACK)
        ours, method = self.off(self.jointplay) <= near, self.off(self.method) <= near
        return AGREES[2 * ours + method]

    def _values(self, answer: Any) -> Array:
        if isinstance(answer, dict):
            return _formula(**answer)
        return np.sum([self._term(**term) for term in answer], axis=0)

    def _term(
        self, question: str, variable: str, at: dict[str, Any] | None = None, times: float = 1.0, **options: Any
    ) -> Array:
        found = _asked(self.case, question, tuple(sorted(options.items())))[variable]
        for dimension, label in (at or {}).items():
            found = found.sel({dimension: label})
        return times * np.atleast_1d(np.asarray(found.values, dtype=float)).ravel()

    def _only(self, values: Any) -> Any:
        """The rows of a table that this figure is about."""
        rows, without = self.raw.get("rows"), self.raw.get("without", [])
        chosen = [k - 1 for k in rows] if rows else [k for k in range(len(values)) if k + 1 not in without]
        return [values[k] for k in chosen] if isinstance(values, list) else values[chosen]


@cache
def cases() -> dict[str, Case]:
    """All cases of the folder, by name."""
    files = sorted(FOLDER.glob("*.toml"))
    return {file.stem: Case(file.stem, tomllib.loads(file.read_text(encoding="utf-8"))) for file in files}


def figures() -> list[Figure]:
    """Those of all cases."""
    return [figure for case in cases().values() for figure in case.figures]


@cache
def _asked(case: Case, question: str, options: tuple[tuple[str, Any], ...]) -> Any:
    return getattr(jp, question)(case.mechanism, **dict(options))


def _formula(by: str, **arguments: Any) -> Array:
    """One of the functions of `record_formulas`."""
    return np.atleast_1d(getattr(record_formulas, by)(**arguments))


def _column(table: str, columns: list[str], minus: str = "") -> list[str]:
    """Row by row; less another column, with as many digits."""
    found = [row[column] for row in rows(ROOT / table) for column in columns]
    if not minus:
        return found
    less = [row[minus] for row in rows(ROOT / table)]
    return [str(Decimal(a) - Decimal(b)) for a, b in zip(found, less, strict=True)]
