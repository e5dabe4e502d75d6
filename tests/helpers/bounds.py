"""What `worst` attains against what its bounds exclude, on the core's own arrays."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay import _core

Array = NDArray[np.float64]
#: by which part a value may be above its bound: the climbs end at offsets that are in their sets to rounding
ROUNDING = 1e-12
#: metres or radians that computed values are off by: `worst` and `given` differ by 1.2e-14 m on mechanisms of 0.3 m,
#: and a rotation of a gear train by 6.6e-14 from its value with 40 digits
CLOSED = 2e-13
#: metres or radians below which nothing moves
RESTING = 1e-9


@dataclass(frozen=True)
class Bounded:
    """Of some configurations: what is attained, the bounds, and where there are any."""

    attained: Array
    bounds: Array
    certified: NDArray[np.bool_]
    reasons: list[int]
    parts: int

    @property
    def gaps(self) -> Array:
        """By which part of the largest value of its kind every bound is above its value; a row per configuration."""
        moves = self._sizes > RESTING
        return np.where(moves, (self.bounds - self.attained) / np.where(moves, self._sizes, 1.0), 0.0)

    @property
    def excluded(self) -> bool:
        """Whether some value is beyond a bound that is said to hold."""
        beyond = self.attained > self.bounds + ROUNDING * self._sizes + CLOSED
        return bool(beyond[self.certified].any())

    @property
    def _sizes(self) -> Array:
        half = self.attained.shape[1] // 2 - 1
        lengths, angles = (2, 1) if half == 3 else (3, 3)
        kinds = np.repeat([0, 1], [2 * lengths, 2 * angles])
        return np.concatenate([self.attained[:, :2], self.attained[:, kinds]], axis=1)


def bounded(core: _core.Mechanism, drives: Array, poses: Array, parts: int = 100, starts: int = 24) -> Bounded:
    """Bounds of position, rotation and both ends of every component; all positive the way they grow."""

    def figures(found: Any) -> Array:
        ends = found["component"] * [-1.0, 1.0]
        return np.column_stack([found["position"], found["rotation"], ends.reshape(len(ends), -1)])

    found = core.worst(drives, poses, starts)
    attained = found["position"], found["rotation"], found["component"]
    bounds = core.certificate(drives, poses, *attained, parts)
    reasons = bounds["reason"].tolist()
    return Bounded(figures(found), figures(bounds), bounds["reason"] == 0, reasons, int(bounds["parts"].sum()))


def of_spec(spec: dict[str, Any], parts: int = 100, starts: int = 24) -> Bounded:
    """The same of a mechanism of the core at drive values of zero."""
    core = _core.Mechanism(json.dumps(spec))
    drives = np.zeros((1, len(spec["drives"])))
    solved = core.trace(drives)
    return bounded(core, drives, solved["poses"], parts, starts)
