"""Where the path of the drives meets a singularity, and how far along the path that is.

Between two configurations the drives go straight. The branch is followed in steps small enough that two singularities
seldom share one, and a singularity shows in one of four ways: the determinant of the closure changes sign, its smallest
singular value has a minimum below the limit, it stays below the limit, or the branch ends (which, by the implicit
function theorem, it only does where the closure is singular). Each is then closed in upon, a bounded number of times.
"""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Flags, Floats
from jointplay.core.compile import ANGULAR

from .bracketing import edge, minimum
from .nominal import Nominal
from .singular_values import Scaled, kind

#: called with how many more steps of the path have been looked at
Advance = Callable[[int], None]

#: what a drive moves in one step along the path, in radians and characteristic lengths
STEP = 0.03
#: steps between two configurations at most
MOST_STEPS = 5_000
#: steps that are followed at once
RUN = 1_024
#: a singular value below it is zero as far as one can tell: so large are the last steps of Newton's method
ZERO = 1e-9
#: the same for the square of the singular value at the end of a branch, which is as small as the way that is left
LEFT = sys.float_info.epsilon


@dataclass(frozen=True)
class SingularPlace:
    """A singular place on the path."""

    #: number of the configuration, with its fraction on the way to the next one
    along: float
    #: position of the output point
    output: Floats
    #: which singularity
    kind: str


@dataclass(frozen=True)
class Nearest:
    """The nearest singular place of every configuration."""

    #: travel of the output point up to it; inf where the path has none, nan where the configuration is not assembled
    distance: Floats
    #: drive values there, shape (configuration, drive)
    drives: Floats
    #: which singularity it is; empty where there is none
    kind: list[str]


@dataclass(frozen=True)
class _State:
    """The poses of all bodies somewhere on the path; nan where the mechanism does not close."""

    along: float
    pose: Floats

    @property
    def is_closed(self) -> bool:
        return bool(np.isfinite(self.pose).all())


@dataclass(frozen=True)
class _Track:
    """The steps of one stretch of the path, in order; nan where the mechanism does not close."""

    along: Floats
    output: Floats
    value: Floats
    sign: Floats


class DrivePath:
    """The path of a mechanism's drives through its configurations.

    Parameters
    ----------
    scaled : Scaled
        The mechanism and its characteristic length.
    at : Nominal
        Its configurations.
    values : ndarray
        Smallest singular value of the closure of each; nan where it is not assembled.
    limit : float
        Singular values below it count as zero.
    """

    def __init__(self, scaled: Scaled, at: Nominal, values: Floats, limit: float) -> None:
        self.scaled = scaled
        self.m = scaled.m
        self.at = at
        self.values = values
        self.limit = limit
        steps = np.abs(np.diff(at.drives, axis=0)) / [self._unit(moves) for moves in self.m.drive_moves] / STEP
        largest = np.max(steps, axis=1, initial=0.0) if steps.size else np.zeros(max(0, len(at) - 1))
        #: steps of every segment; 0 where a drive value is not known
        self.counts = np.where(np.isfinite(largest), np.clip(np.ceil(np.nan_to_num(largest)), 1, MOST_STEPS), 0)
        known = np.isfinite(values)
        #: segments that can be followed from one of their ends at least
        self.open = (self.counts > 0) & (known[:-1] | known[1:])

    def _unit(self, moves: Sequence[tuple[int, float]]) -> float:
        """The motion of a drive that moves one of its joints by a radian or a characteristic length."""
        units = (1.0 if self.m.joint_kinds[joint] in ANGULAR else self.scaled.length for joint, _ in moves)
        return float(min(unit / abs(coefficient) for unit, (_, coefficient) in zip(units, moves, strict=True)))

    @property
    def steps(self) -> int:
        """Steps of the whole path."""
        return int(self.counts[self.open].sum())

    def nearest(self, advance: Advance) -> Nearest:
        """Find the nearest singular place of every configuration."""
        count = len(self.at)
        found = Nearest(np.full(count, np.nan), np.full(self.at.drives.shape, np.nan), [""] * count)
        known = np.isfinite(self.values)
        found.distance[known] = np.inf
        for first, last in _runs(known):
            left = [k for k in range(first, last + 1) if self.values[k] >= self.limit]
            while left:
                track = self._track(first, last, left[0], advance)
                self._assign(found, track, self._places(track))
                left = [k for k in left[1:] if k not in track.along[np.isfinite(track.value)]]
        for k in np.flatnonzero(self.values < self.limit):
            found.distance[k], found.drives[k] = 0.0, self.at.drives[k]
            found.kind[k] = self._kind(self.at.poses[k])
        return found

    def drives(self, along: Floats) -> Floats:
        """Drive values at places along the path, shape (place, drive)."""
        numbers = np.arange(len(self.at))
        columns = [np.interp(along, numbers, column) for column in self.at.drives.T]
        return np.array(columns).reshape(len(columns), len(along)).T

    def _steps(self, segment: int) -> Floats:
        """The places of a segment's steps, its two ends included."""
        return segment + np.linspace(0.0, 1.0, int(self.counts[segment]) + 1)

    def _track(self, first: int, last: int, anchor: int, advance: Advance) -> _Track:
        """Follow the branch from a regular configuration to both ends of its stretch, and one segment beyond."""
        ahead = [k for k in range(anchor, min(last + 1, len(self.counts))) if self.open[k]]
        behind = [k for k in range(anchor - 1, max(first - 2, -1), -1) if self.open[k]]
        start = np.array([float(anchor)])
        forward = np.concatenate([start, *(self._steps(k)[1:] for k in ahead)])
        backward = np.concatenate([start, *(self._steps(k)[-2::-1] for k in behind)])
        parts = [self._followed(anchor, places, advance) for places in (backward, forward)]
        ordered = [np.concatenate([a[:0:-1], b]) for a, b in zip(*parts, strict=True)]
        return _Track(np.concatenate([backward[:0:-1], forward]), *ordered)

    def _followed(self, anchor: int, along: Floats, advance: Advance) -> tuple[Floats, Floats, Floats]:
        """Position of the output, singular value and sign at places that begin at a configuration.

        What closes again behind a gap is another branch and does not count.
        """
        output, value, sign = np.full((len(along), 3), np.nan), np.full(len(along), np.nan), np.zeros(len(along))
        start = 0
        for states in self._states(self.at.poses[anchor], along):
            closed = np.isfinite(states).all(axis=(1, 2))
            count = len(states) if closed.all() else int(closed.argmin())
            part = slice(start, start + count)
            output[part] = self._output(states[:count])
            value[part], sign[part] = self.scaled.closure(states[:count])
            start += len(states)
            advance(len(states))
            if count < len(states):
                break
        return output, value, sign

    def _states(self, pose: Floats, along: Floats) -> Iterator[Floats]:
        """Poses of all bodies at places along the path, each reached from the one before; the first is known."""
        regular = along[0]
        for start in range(0, len(along), RUN):
            part = along[start : start + RUN]
            states = self._trace(pose, np.concatenate([[regular], part]))[1:]
            yield states
            # The next run starts from the last state that is not itself singular.
            for k in range(len(states) - 1, -1, -1):
                if self.scaled.closure(states[k : k + 1])[0][0] >= self.limit:
                    pose, regular = states[k], part[k]
                    break

    def _trace(self, pose: Floats, along: Floats) -> Floats:
        """Poses along the path, from the pose at the first of the places."""
        return self.m.core.trace(np.ascontiguousarray(self.drives(along)), pose)["poses"]

    def _state(self, anchor: _State, along: float) -> _State:
        """The state at a place, followed from another one."""
        return _State(along, self._trace(anchor.pose, np.array([anchor.along, along]))[1])

    def _value(self, state: _State) -> float:
        """Smallest singular value; a gap in the branch counts as zero."""
        return float(self.scaled.closure(state.pose[None])[0][0]) if state.is_closed else 0.0

    def _output(self, states: Floats) -> Floats:
        """Position of the output point, three coordinates, in the axes in which it is measured."""
        point = self.m.points[self.m.output_point]
        place = poses.place(states[:, point.body], point.at)
        if self.m.seen_from is None:
            return place
        other = states[:, self.m.seen_from]
        return poses.seen_from(other, place - poses.position(other))

    def _kind(self, pose: Floats) -> str:
        values = self.scaled.measure(pose[None], range(len(self.scaled.units)))["values"][0]
        return kind(values[:2], self.limit)

    def _places(self, track: _Track) -> list[SingularPlace]:
        """The singular places of a stretch."""
        value, sign, closed = track.value, track.sign, np.isfinite(track.value)
        with np.errstate(invalid="ignore"):
            below = value < self.limit
        clear = closed & ~below
        crossed = np.flatnonzero(clear[:-1] & clear[1:] & (sign[:-1] != sign[1:])).tolist()
        found = [self._crossing(track, k, k + 1) for k in crossed]
        found += [self._end(track, k, k + 1) for k in np.flatnonzero(clear[:-1] & ~closed[1:]).tolist()]
        found += [self._end(track, k + 1, k) for k in np.flatnonzero(~closed[:-1] & clear[1:]).tolist()]
        for first, last in _runs(below):
            found += self._singular_run(track, first, last, clear)
        lowest = [self._lowest(track, k - 1, k + 1) for k in self._dips(track, clear)]
        found += [state for state in lowest if self._value(state) < self.limit]
        return [SingularPlace(s.along, self._output(s.pose[None])[0], self._kind(s.pose)) for s in found if s.is_closed]

    def _dips(self, track: _Track, clear: Flags) -> list[int]:
        """Steps around which the singular value, going on as steeply as it comes, could fall below the limit."""
        v, g = track.value, track.sign
        middle = clear[:-2] & clear[1:-1] & clear[2:] & (g[:-2] == g[1:-1]) & (g[1:-1] == g[2:])
        with np.errstate(invalid="ignore"):
            lowest = (v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:])
            steep = v[1:-1] - np.maximum(v[:-2] - v[1:-1], v[2:] - v[1:-1]) < self.limit
        return [int(k) + 1 for k in np.flatnonzero(middle & lowest & steep)]

    def _singular_run(self, track: _Track, first: int, last: int, clear: Flags) -> list[_State]:
        """Singular places of steps below the limit: the one between its neighbours, or all of them and their edges."""
        left, right = first - 1, last + 1
        has_left, has_right = bool(left >= 0 and clear[left]), bool(right < len(clear) and clear[right])
        if first == last and has_left and has_right:
            crossed = track.sign[left] != track.sign[right]
            return [self._crossing(track, left, right) if crossed else self._lowest(track, left, right)]
        if first == last and has_left and right < len(clear):
            return [self._end(track, left, right)]
        if first == last and has_right and left >= 0:
            return [self._end(track, right, left)]
        if first == last:
            found = []
        else:
            edges = [pair for pair, there in (((left, first), has_left), ((right, last), has_right)) if there]
            found = [self._closed_in(track, a, b, lambda s: self._value(s) - self.limit, ZERO) for a, b in edges]
        return found + [self._at_step(track, k) for k in range(first, last + 1)]

    def _crossing(self, track: _Track, near: int, far: int) -> _State:
        """Where the determinant changes its sign: the singular value of that sign goes through zero."""
        sign = track.sign[near]

        def height(state: _State) -> float:
            if not state.is_closed:
                return math.nan
            value, its = self.scaled.closure(state.pose[None])
            return float(value[0] * its[0] * sign)

        return self._closed_in(track, near, far, height, ZERO, -float(track.value[far]))

    def _end(self, track: _Track, near: int, far: int) -> _State:
        """Where the branch ends: the square of the singular value goes to zero there as the way that is left."""

        def left(state: _State) -> float:
            return self._value(state) ** 2 if state.is_closed else math.nan

        return self._closed_in(track, near, far, left, LEFT)

    def _closed_in(
        self,
        track: _Track,
        near: int,
        far: int,
        height: Callable[[_State], float],
        zero: float,
        at_far: float = math.nan,
    ) -> _State:
        """Where, between two steps, a figure ends to be positive that is so at the first."""
        anchor = self._at_step(track, near)
        found = {anchor.along: anchor}
        if not anchor.is_closed:
            return anchor

        def tried(along: float) -> float:
            found[along] = self._state(anchor, along)
            return height(found[along])

        return found[edge(tried, anchor.along, float(track.along[far]), height(anchor), at_far, zero)]

    def _lowest(self, track: _Track, near: int, far: int) -> _State:
        """Where the singular value is smallest between two steps; its square has the form of a parabola."""
        anchor = self._at_step(track, near)
        found = {anchor.along: anchor}

        def tried(along: float) -> float:
            found[along] = self._state(anchor, along)
            return self._value(found[along]) ** 2

        if not anchor.is_closed:
            return anchor
        minimum(tried, anchor.along, float(track.along[far]))
        return min((state for state in found.values() if state.is_closed), key=self._value)

    def _at_step(self, track: _Track, step: int) -> _State:
        """A step of the path with its poses, which are not kept: followed anew from its regular configuration."""
        along = track.along[step]
        # A configuration behind a gap of the branch is on another one.
        there = np.intersect1d(np.flatnonzero(self.values >= self.limit), track.along[np.isfinite(track.value)])
        anchor = int(there[np.abs(there - along).argmin()])
        between = track.along[(track.along > min(anchor, along)) & (track.along < max(anchor, along))]
        way = np.concatenate([[anchor], between if along > anchor else between[::-1], [along]])
        return _State(float(along), self._trace(self.at.poses[anchor], way)[-1])

    def _assign(self, found: Nearest, track: _Track, places: list[SingularPlace]) -> None:
        """Give every configuration of a stretch its nearest place, by the travel of the output point."""
        if not places:
            return
        closed = np.isfinite(track.value)
        along = np.concatenate([track.along[closed], [place.along for place in places]])
        output = np.concatenate([track.output[closed], [place.output for place in places]])
        order = np.argsort(along, kind="stable")
        steps = np.linalg.norm(np.diff(output[order], axis=0), axis=1)
        travel = np.empty(len(along))
        travel[order] = np.concatenate([[0.0], np.cumsum(steps)])
        there = travel[closed.sum() :]
        for step, place in enumerate(track.along[closed].tolist()):
            k = int(place)
            if k != place or not np.isfinite(self.values[k]):
                continue
            distances = np.abs(there - travel[step])
            # Where the output point does not move, the drives decide.
            nearest = min(range(len(places)), key=lambda p: (distances[p], abs(places[p].along - place)))
            found.distance[k] = distances[nearest]
            found.drives[k] = self.drives(np.array([places[nearest].along]))[0]
            found.kind[k] = places[nearest].kind


def _runs(flags: Flags) -> list[tuple[int, int]]:
    """First and last place of every run of true ones.

    Examples
    --------
    >>> _runs(np.array([True, True, False, True]))
    [(0, 1), (3, 3)]
    """
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return [(int(a), int(b) - 1) for a, b in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)]
