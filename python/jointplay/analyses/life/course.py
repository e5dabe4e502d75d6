"""How clearances grow with the number of cycles: dc/dN = g(c), by Heun's method.

    predicted = c + h g(c),    c(N + h) = c + h (g(c) + g(predicted)) / 2

In determinate mechanisms reactions hardly depend on the clearances, and steps are long. In over-constrained ones the
tightest joint carries most until it has worn: a step is halved until both slopes agree. Where the load jumps from one
joint to another with less play they never do; the steps then have a floor, and the growth is their mean.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats

#: difference of both ends of a step that is allowed, as a part of what has grown or of the clearance
TOLERANCE = 1e-3
#: the shortest step, as such a part
FLOOR = 1.0 / 128.0
#: by how much a step may be longer than the one before
LONGER = 8.0


@dataclass(frozen=True)
class CourseStep:
    """A step."""

    #: `begin`, `length`: cycles
    begin: float
    length: float
    #: `grown`, `first`, `last`: what has grown at its begin, and the growth per cycle there and at its end
    grown: Floats
    first: Floats
    last: Floats

    def at(self, cycles: float) -> Floats:
        """What has grown within the step."""
        s = cycles - self.begin
        return self.grown + s * self.first + (self.last - self.first) * (s * s / (2.0 * self.length))


class Course:
    """Grown clearances over the cycles, found as far as somebody asks.

    Parameters
    ----------
    slope : callable
        Growth per cycle of every clearance that has grown by so much.
    first : ndarray
        The growth per cycle at the start, not zero for all.
    scale : float
        A typical clearance.
    """

    def __init__(self, slope: Callable[[Floats], Floats], first: Floats, scale: float) -> None:
        self.slope, self.scale = slope, scale
        self.steps: list[CourseStep] = []
        self.end, self.grown, self.first = 0.0, np.zeros(len(first)), first
        self.next = scale / float(first.max())
        #: whether the growth is not known from `end` on, and whether steps were as short as they may be
        self.is_lost, self.is_floored = False, False

    def at(self, cycles: float) -> Floats:
        """By how much every clearance has grown; nan beyond the end of what can be known."""
        while self.end < cycles and not self.is_lost:
            self._extend()
        if cycles > self.end:
            return np.full(len(self.grown), np.nan)
        for step in self.steps:
            if cycles <= step.begin + step.length:
                return step.at(cycles)
        return np.zeros(len(self.grown))

    def rate(self, cycles: float) -> Floats:
        """Growth per cycle of every clearance by then; nan beyond the end of what can be known."""
        grown = self.at(cycles)
        return self.slope(grown) if np.isfinite(grown).all() else grown

    def _extend(self) -> None:
        """One step more."""
        size = max(self.scale, float(self.grown.max()))
        fastest = float(self.first.max())
        floor = FLOOR * size / fastest if fastest > 0.0 else self.next
        length = max(self.next, floor)
        while True:
            last = self.slope(self.grown + length * self.first)
            known = bool(np.isfinite(last).all())
            error = 0.5 * length * float(np.abs(last - self.first).max()) / size if known else np.inf
            if error <= TOLERANCE or length <= floor:
                break
            length = max(0.5 * length if not known else length * max(0.1, 0.9 * (TOLERANCE / error) ** 0.5), floor)
        if not known:
            self.is_lost = True
            return
        self.is_floored |= error > TOLERANCE
        step = CourseStep(self.end, length, self.grown, self.first, last)
        self.steps.append(step)
        self.end += length
        self.grown = step.at(self.end)
        self.first = self.slope(self.grown) if error > 0.0 else last
        if not np.isfinite(self.first).all():
            self.is_lost = True
        self.next = length * min(LONGER, 0.9 * (TOLERANCE / error) ** 0.5 if error > 0.0 else LONGER)
