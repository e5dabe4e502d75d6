"""What the exact closure says of a plan.

used       error / limit at the plan, of every limit in every configuration; it holds where used <= 1
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.result import STATUSES
from jointplay.result.verdict import READABLE

from .items import Item

#: share of the mechanism's size, or radians, that stands for a limit of zero
NOTHING = 1e-12


@dataclass(frozen=True)
class Limit:
    """A limit of one output."""

    #: one of several outputs
    output: str | None
    #: a component of the error, ``position`` or ``rotation``
    quantity: str
    #: ``low`` or ``high``
    side: str
    #: how far the error may be to that side, positive, SI
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
    """What was found at a plan."""

    #: shape (limit, configuration)
    used: Floats
    #: outcome of every configuration, by the core's codes; the worst over the outputs
    status: NDArray[np.uint8]

    @property
    def is_whole(self) -> bool:
        """Whether all that can be looked at was."""
        return True

    @property
    def failed(self) -> str:
        """The worst outcome of a configuration that has no error; empty where all have one."""
        bad = self.status[~np.isin(STATUSES[self.status], READABLE)]
        return str(STATUSES[bad.max()]) if len(bad) else ""

    def holds(self, factors: Floats) -> bool:
        """Whether every limit holds, each times its factor, in every configuration."""
        return not self.failed and bool((self.used <= (1.0 + ROUNDING) * factors[:, None]).all())


#: what of a limit is rounding
ROUNDING = 1e-9


class Looking(Protocol):
    """The question that decides: the worst case, or the scatter."""

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
