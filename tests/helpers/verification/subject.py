"""A mechanism with what the comparisons need of it, and what a comparison is."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import jointplay as jp
from helpers.answers import example
from helpers.oracles import core_spec
from helpers.oracles.linkage import Linkage
from jointplay import _core
from jointplay.analyses.nominal import nominal

Array = NDArray[np.float64]
OK = _core.STATUSES.index("ok")
#: kinds of joints that only the closure by strings has
COUPLINGS = ("gear", "rack", "belt")


class Path(NamedTuple):
    """The nominal mechanism configuration by configuration: drive values, poses and pose of the output, SI."""

    drives: Array
    poses: Array
    output: Array


class Subject:
    """A mechanism as the core has it."""

    def __init__(
        self,
        name: str,
        spec: Mapping[str, Any],
        core: _core.Mechanism,
        path: Callable[[], Path],
        mechanism: jp.Mechanism | None = None,
    ) -> None:
        self.name, self.spec, self.core, self._path = name, dict(spec), core, path
        #: where it has a file
        self.mechanism = mechanism

    @classmethod
    def of(cls, name: str, m: jp.Mechanism) -> Subject:
        def path() -> Path:
            at = nominal(m)
            return Path(at.drives, at.poses, at.output)

        return cls(name, m.spec(), m.core, path, m)

    @classmethod
    def of_spec(cls, name: str, spec: dict[str, Any], drives: Array) -> Subject:
        core = _core.Mechanism(json.dumps(spec))
        solved = core.trace(drives)
        return cls(name, spec, core, lambda: Path(drives, solved["poses"], solved["output"]))

    @cached_property
    def at(self) -> Path:
        return self._path()

    @property
    def count(self) -> int:
        """Number of configurations."""
        return len(self.at.poses)

    @property
    def few(self) -> list[int]:
        """The first, the middle and the last configuration."""
        return sorted({0, self.count // 2, self.count - 1})

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
        return float(self.spec["length"])


@cache
def subject(name: str) -> Subject:
    """A bundled example: of several outputs and load cases the first."""
    return Subject.of(name, example(name))


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
    "reactions, first order",
    "worst case, first order",
    "worst case",
    "standard deviation, first order",
    "standard deviation",
)
