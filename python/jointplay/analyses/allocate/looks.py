"""What the exact closure says of a plan, and the rows that its first order gives.

    used       error / limit at the plan, of every limit in every configuration; it holds where used <= 1
    first      the same to first order
    rows       parts @ x + rest = first^power at the plan; at every other plan a bound from below (worst case)

A look is taken at a plan; the rows hold for all plans.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Nominal
from jointplay.errors import InputError
from jointplay.model import Mechanism

from .items import TINY, Item, Play

Floats = NDArray[np.float64]
#: share of the mechanism's size, or radians, that stands for a limit of zero
NOTHING = 1e-12


@dataclass(frozen=True)
class Limit:
    """A limit of one output.

    Attributes
    ----------
    output : str or None
        One of several outputs.
    quantity : str
        A component of the error, ``position`` or ``rotation``.
    side : str
        ``low`` or ``high``.
    value : float
        How far the error may be to that side, positive, SI.
    """

    output: str | None
    quantity: str
    side: str
    value: float

    @property
    def extreme(self) -> str:
        """The extreme of `worst` that it limits."""
        return self.quantity if self.quantity in ("position", "rotation") else f"{self.quantity} {self.side}"

    @property
    def words(self) -> str:
        """The limit in words."""
        return f"{self.extreme} of output {self.output}" if self.output else self.extreme


def limits_of(m: Mechanism) -> list[Limit]:
    """All limits of the errors of a mechanism.

    Raises
    ------
    InputError
        When it has none.
    """
    found = []
    for output in m.outputs or (None,):
        part = m.only(output)
        for quantity, (low, high) in part.limits.errors.items():
            sides = (("low", -low), ("high", high)) if quantity in m.components else (("high", high),)
            floor = NOTHING * (part.length if quantity in (*"xyz", "position") else 1.0)
            found += [Limit(output, quantity, side, max(v, floor)) for side, v in sides if math.isfinite(v)]
    if not found:
        problem = "no limit of the error is given; without one the loosest sizes are the cheapest: position = 0.1"
        raise InputError(problem, file=m.file, key="limits")
    return found


@dataclass(frozen=True)
class Look:
    """What was found at a plan.

    Attributes
    ----------
    used, first : ndarray
        Shape (limit, configuration).
    parts : ndarray
        Shape (limit, configuration, column).
    rest : ndarray
        Shape (limit, configuration).
    status : ndarray
        Outcome of every configuration, by the core's codes; the worst over the outputs.
    direction : ndarray
        Of the largest position error, shape (limit, configuration, axis).
    """

    used: Floats
    first: Floats
    parts: Floats
    rest: Floats
    status: NDArray[np.uint8]
    direction: Floats

    @property
    def holds(self) -> bool:
        """Whether every limit holds."""
        return bool((self.used <= 1.0 + ROUNDING).all())

    def where_counted(self, places: Mapping[str | None, Nominal]) -> Look:
        """The same with nothing used of any limit where the machine cannot stand."""
        away = ~np.all([place.counts for place in places.values()], axis=0)
        for values in (self.used, self.first, self.parts, self.rest, self.direction):
            values[:, away] = 0.0
        self.status[away] = 0
        return self


#: what of a limit is rounding
ROUNDING = 1e-9


class Looking(Protocol):
    """The question that decides: the worst case, or the scatter."""

    #: of the size that a formula's variable is, and of the right side of the rows
    power: int

    def look(self, values: Sequence[float]) -> Look:
        """What a plan brings; values as `Item` takes them: sizes, or numbers of choices."""


def merged(items: Sequence[Item], values: Sequence[float], *, probe: bool = False) -> dict[str, object]:
    """The changes of the file that a plan makes."""
    changes = [(item.probe if probe else item.changes)(value) for item, value in zip(items, values, strict=True)]
    return reduce(lambda all_of_them, one: {**all_of_them, **one}, changes, {})


def sources_of(m: Mechanism, item: Item) -> list[int]:
    """The sources of results that an item is, with the sizes that make a clearance."""
    names, joint = item.sizing.sources, item.sizing.key.split(".")[1]
    sized = item.sizing.key == f"joints.{joint}.clearance"
    return [
        k
        for k, (name, kind) in enumerate(zip(m.sources, m.source_kinds, strict=True))
        if name in names or (sized and kind == "size" and name.partition("/")[0].partition(".")[0] == joint)
    ]


def columns_of(item: Item) -> list[float]:
    """The values of an item's columns: of a formula both ends of its range."""
    return [option.size for option in item.options] if item.is_formula else [float(k) for k in range(len(item.options))]


def scaled(item: Item, value: float, part: Floats, axial: Floats) -> list[Floats]:
    """What an item adds to the error with each of the values of its columns.

    Parameters
    ----------
    item : Item
    value : float
        The value at which it adds `part`.
    part : ndarray
        What it adds.
    axial : ndarray
        What a unit of axial play adds, where that is part of it.
    """
    now = probed(item, value)
    radial = part - now.axial * axial
    plays = [item.play(column) for column in columns_of(item)]
    return [radial * (play.scale / now.scale if now.scale else 0.0) + play.axial * axial for play in plays]


def probed(item: Item, value: float) -> Play:
    """How large its set is where directions are looked for; not zero."""
    if item.is_formula or item.options[round(value)].size > 0.0:
        return item.play(value)
    largest = max(item.options, key=lambda option: option.size)
    return Play(largest.play.scale * TINY, largest.play.axial * TINY)
