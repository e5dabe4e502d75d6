"""A bundled example with what the comparisons need of it, and what a comparison is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import jointplay as jp
from answers import example
from jointplay import _core
from jointplay.analyses.nominal import Nominal, nominal
from oracles import core_spec
from oracles.linkage import Linkage

Array = NDArray[np.float64]
OK = _core.STATUSES.index("ok")
#: kinds of joints that only the closure by strings has
COUPLINGS = ("gear", "rack", "belt")


class Subject:
    """A bundled example: of several outputs and load cases the first."""

    def __init__(self, name: str) -> None:
        self.name, self.m = name, example(name)
        self.spec: dict[str, Any] = dict(self.m.spec())

    @property
    def core(self) -> _core.Mechanism:
        return self.m.core

    @cached_property
    def at(self) -> Nominal:
        return nominal(self.m)

    @property
    def few(self) -> list[int]:
        """The first, the middle and the last configuration."""
        return sorted({0, len(self.at) // 2, len(self.at) - 1})

    def one(self, k: int) -> tuple[Array, Array]:
        """Drive values and poses of one configuration, as the core takes them."""
        return self.at.drives[k : k + 1], self.at.poses[k : k + 1]

    @property
    def planar(self) -> bool:
        return bool(self.spec["space"] == "planar")

    @property
    def determinate(self) -> bool:
        return bool(self.core.isostatic)

    @property
    def coupled(self) -> bool:
        return any(joint["kind"] in COUPLINGS for joint in self.spec["joints"])

    @cached_property
    def is_linkage(self) -> bool:
        return core_spec.is_expressible(self.spec)

    @property
    def has_sizes(self) -> bool:
        return any(source["kind"] == "size" for source in self.spec["sources"])

    def linkage(self, k: int, widest: bool = False) -> tuple[Linkage, Array, Array]:
        """The independent closure at a configuration, its poses and its drives; millimetres and radians."""
        return core_spec.linkage(self.spec, self.at.poses[k], self.at.drives[k], widest)

    @property
    def size(self) -> float:
        return float(self.m.length)


@lru_cache(maxsize=None)
def subject(name: str) -> Subject:
    return Subject(name)


def subjects() -> list[Subject]:
    return [subject(name) for name in jp.examples.names()]


@dataclass(frozen=True)
class Found:
    """How many numbers were compared, and the largest difference."""

    numbers: int
    difference: float
    #: what the page says beside the row
    remark: str = ""

    @classmethod
    def of(cls, ours: Any, theirs: Any, scale: Any = 1.0) -> Found:
        """The largest difference of two arrays in units of `scale`; what is not a number differs without limit."""
        gaps = np.abs((np.asarray(ours, dtype=float) - np.asarray(theirs, dtype=float)) / scale)
        return cls(gaps.size, float(np.where(np.isnan(gaps), math.inf, gaps).max(initial=0.0)))

    @classmethod
    def all(cls, parts: list[Found], remark: str = "") -> Found:
        numbers = sum(part.numbers for part in parts)
        return cls(numbers, max((part.difference for part in parts), default=math.inf), remark)


@dataclass(frozen=True)
class Check:
    """One question, answered by one engine, for all examples that the engine can express."""

    figure: str
    engine: str
    packages: tuple[str, ...]
    #: what the difference is a part of
    unit: str
    tolerance: float
    #: where the tolerance comes from
    why: str
    applies: Callable[[Subject], bool]
    compare: Callable[[Subject], Found]


#: what is compared, in the order of the page
FIGURES = (
    "poses",
    "sensitivities",
    "error at given offsets",
    "loaded pose, first order",
    "loaded pose",
    "reactions",
    "worst case, first order",
    "worst case",
    "standard deviation, first order",
    "standard deviation",
)
