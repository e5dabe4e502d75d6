"""The worst that an assembly can be, step by step, over all clearances and tolerances.

In over-constrained steps every corner of the box of tolerances is a specimen; where there are too many corners, a
search chooses them.
The clearance factor is a convex function of the deviations, so that its largest value is at a corner; forces
are the largest met there. Errors are the exact extremes of `worst` for every centre, strained specimens included.
The deformation of specimens that fit under the loads is added at its full size. Where the specimen of a corner has a
larger error than this sum, its error is taken.
"""

import itertools
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Progress
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.core.spec import ENDS
from jointplay.model.mechanism import Mechanism
from jointplay.result import STATUSES, Result

from .forces import Members
from .report import Configuration, each, finished, report
from .specimens import FITS, bent_at_most, solve
from .state import SERIOUS, Held
from .steps import Step, steps

#: places from which the worst of the output, and that of every other centre, is climbed
STARTS, FEWER_STARTS = 24, 8
#: tolerances up to which every corner of their box is tried
EVERY_CORNER = 8
#: rounds of the search among more corners
ROUNDS = 6


def compute(m: Mechanism, at: Configuration, progress: Progress | None = None) -> Result:
    """The largest errors, forces and clearance factors after every step."""
    every, members = list(steps(m, at.poses)), Members(m)
    found = each(every, lambda step: _Extremes(step, members), progress)
    builder = report(m, every[: len(found)], at, "worst")
    for k, (end, body) in enumerate((("shaft", "first"), ("bearing", "second"))):
        words = f"largest position error of the centre on the {body} body of the joint"
        builder.add(f"worst_{end}", ("step", "joint"), np.stack([f.centres[k] for f in found]), words, "length")
    words = "largest position error of the output"
    builder.add("worst_position", "step", np.array([f.output for f in found]), words, "length")
    builder.labels("member", members.names, "link between two points")
    forces = np.stack([f.force for f in found])
    builder.add("worst_force", ("step", "member"), forces, "largest size of the force along the member", "force")
    words = "largest clearance scale factor required for assembly of the rigid bodies"
    builder.add("worst_clearance_factor", "step", np.array([f.factor for f in found]), words)
    builder.add("status", "step", np.array([f.status for f in found], dtype=str), "outcome")
    return finished(builder, len(every))


class _Extremes:
    """The extremes after one step; SI."""

    def __init__(self, step: Step, members: Members) -> None:
        self.held = Held(step)
        m = step.part.m
        tried = m.centre[None]
        if self.held.redundant:
            tried = np.vstack([tried, corners(self.held, members)])
        self.specimens = solve(self.held, members, tried)
        self.force = np.max(np.abs(self.specimens.force), axis=1)
        self.factor = float(self.specimens.clearance_factor.max())
        self.statuses = {"ok", *self.specimens.status.tolist()}
        self.bent = bent_at_most(self.held, tried)
        sizes = {point: self._largest(point) for point in self.held.points()}
        self.centres = np.full((2, len(m.joints)), np.nan)
        for k, ends in self.held.centres().items():
            for end, point in ends.items():
                self.centres[ENDS.index(end), k] = sizes[point]
        self.output = np.nan if self.held.output is None else sizes[self.held.output]
        # What play leaves open is what the worst case is over.
        self.statuses -= {"undetermined"}
        self.status = max([*self.statuses, "underconstrained" if self.held.free else "ok"], key=SERIOUS.index)

    def _largest(self, point: int) -> float:
        """Largest position error of a point: over all offsets, with the deformation under loads at its full size."""
        strained = self.factor > FITS
        # As long as no specimen is strained, nothing but loads deforms it.
        core = self.held.core(point) if strained else self.held.core(point, joints=self.held.rigid_joints)
        starts = STARTS if point == self.held.output else FEWER_STARTS
        worst = core.worst(self.held.drives, self.held.poses, starts)
        exact = float(worst["position"][0]) + self.bent[point]
        if not np.isfinite(exact):
            self.statuses.add(str(STATUSES[worst["status"][0]]))
        met = np.append(self.specimens.points[point], exact) if self.held.redundant else np.array([exact])
        return float(np.nanmax(met)) if np.isfinite(met).any() else np.nan


def corners(held: Held, members: Members) -> Floats:
    """Corners of the box of tolerances of a part, as specimens of the whole mechanism; shape (specimen, parameter)."""
    part = held.part
    return corners_of(part.m, part.m.centre, part.sources, lambda u: solve(held, members, u).clearance_factor)


def corners_of(m: Mechanism, u0: Floats, sources: Iterable[int], factor: Callable[[Floats], Floats]) -> Floats:
    """Corners of the box of the tolerances of some sources, about u0; among many those with the largest factor."""
    wide: dict[int, tuple[float, float]] = {}
    for s in sources:
        limits = m.compiled_sources[s].limits
        if m.source_kinds[s] not in (*LOOSE, "size") and limits is not None and limits[1] > limits[0]:
            wide[int(np.flatnonzero(m.parameter_source == s)[0])] = limits

    def specimens(high: NDArray[np.bool_]) -> Floats:
        u = np.repeat(u0[None], len(high), 0)
        u[:, [*wide]] += np.where(high, [b for _, b in wide.values()], [a for a, _ in wide.values()])
        return u

    if len(wide) <= EVERY_CORNER:
        return specimens(np.array(list(itertools.product((False, True), repeat=len(wide))), dtype=bool))
    return _climbed(len(wide), specimens, factor)


def _climbed(
    count: int, specimens: Callable[[NDArray[np.bool_]], Floats], factor: Callable[[Floats], Floats]
) -> Floats:
    """The corners that one passes when the best of all flips of one tolerance is taken, from some corners on."""
    passed = []
    for start in np.vstack([np.zeros((1, count), dtype=bool), np.eye(count, dtype=bool)]):
        best, here = -np.inf, start[None]
        for _ in range(ROUNDS):
            values = factor(specimens(here))
            k = int(np.nanargmax(np.where(np.isnan(values), np.inf, values)))
            passed.append(here[k])
            if not values[k] > best:
                break
            best, here = values[k], here[k] ^ np.eye(count, dtype=bool)
    return specimens(np.unique(passed, axis=0))
