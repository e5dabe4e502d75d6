"""Friction at rest: how far apart the poses are in which friction can hold a mechanism under its load.

At rest a joint holds any part q of its friction, from -1 to 1 (of a ball, a vector across its force, not longer than
1). With the equilibrium of the sliding state for every q, each component of the error, and each torque of a drive, is
as low and as high as q can make it. The search begins at all corners, or at some where they are many, and at some
points inside, where contacts that change sides can have an extreme. From the best of both it goes on along the
derivatives by Newton's steps of each q by itself, within the bounds. What it ends at is an extreme nearby; that there
is none beyond is not proved. Play that nothing pushes in a state lies anywhere on top of it.
"""

from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS

from .balance import Equilibrium, EquilibriumAt, SlidingTask, equilibrium, solve
from .laws import FLANK
from .states import Setting, open_widths, torque

#: corners at which the search begins, in opposite pairs where there are more, and points inside
CORNERS = 32
#: steps of the search; changes of q, parts of a value, and of a step, below which it ends
STEPS, STILL, GAIN, SHORT = 40, 1e-9, 1e-11, 1e-2
#: equilibria that are solved together
TOGETHER = 1024


@dataclass(frozen=True)
class RestRange:
    """What friction can hold at rest, nan where the mechanism is not in equilibrium without it."""

    #: `low`, `high`: of every component of the error, shape (configuration, component)
    low: Floats
    high: Floats
    #: `position`, `rotation`: largest sizes, shape (configuration,)
    position: Floats
    rotation: Floats
    #: `torque_low`, `torque_high`: of every drive, shape (configuration, drive)
    torque_low: Floats
    torque_high: Floats


def held(asked: Setting) -> RestRange:
    """What friction can hold at rest."""
    m, count = asked.m, len(asked.at)
    components, drives = len(m.components), len(m.drives)
    low, high = np.full((2, count, components + 2 + drives), np.nan)
    dims = sum(_size(contact.kind) for contact in asked.contacts if contact.rubs)
    many = max(1, TOGETHER // max(4 * low.shape[1], min(2**dims, CORNERS) + CORNERS))
    for places in asked.parts(many):
        low[places], high[places] = Search(asked, places).extremes()
    position, rotation = high[:, components : components + 2].T
    torques = slice(components + 2, None)
    return RestRange(low[:, :components], high[:, :components], position, rotation, low[:, torques], high[:, torques])


def _size(kind: str) -> int:
    return 2 if kind == "ball" else 1


class Search:
    """The search in some configurations."""

    def __init__(self, asked: Setting, places: NDArray[np.intp]) -> None:
        self.m = asked.m
        self.of, _ = asked.task(1.0, places)
        self.back = asked.task(-1.0, places)[0].motions
        self.rubs = [k for k, contact in enumerate(self.of.contacts) if contact.rubs]
        sizes = [_size(self.of.contacts[k].kind) for k in self.rubs]
        ends = np.cumsum([0, *sizes]).tolist()
        self.columns = [slice(a, b) for a, b in pairwise(ends)]
        self.dims = ends[-1]
        self.across = {k: self._across(k) for k in self.rubs if self.of.contacts[k].kind == "ball"}
        maps = self.m.core.sensitivity(self.of.drives, self.of.nominal)["source"]
        self.widths = [(row, width) for _, row, width in open_widths(self.of, maps)]

    def _across(self, k: int) -> Floats:
        """Two directions across the force of a ball without friction, shape (configuration, 2, 3)."""
        force = self.of.multipliers[:, self.of.contacts[k].rows]
        return np.asarray(np.linalg.svd(force[:, None])[2][:, 1:])

    def extremes(self) -> tuple[Floats, Floats]:
        """Lowest and highest values, each (configuration, value)."""
        count = len(self.of.scale)
        corners = self._corners()
        inside = np.random.default_rng(1).uniform(-1.0, 1.0, (CORNERS, self.dims))
        inside[0] = 0.0
        starts = np.vstack([corners, inside])
        which, q = np.repeat(np.arange(count), len(starts)), self.inside(np.tile(starts, (count, 1)))
        solved = equilibrium(self.task(which, q))
        at, is_good = self._at(which, q, solved), solved.part == 1.0
        n = len(self.m.components) + 2 + len(self.m.drives)
        farthest = self._farthest(which, at, is_good).reshape(count, len(starts), 2 * n).max(axis=1)
        if self.dims:
            signs = np.repeat([-1.0, 1.0], n)
            reached = _of_good(signs * np.tile(self._values(at), 2), is_good).reshape(count, len(starts), 2 * n)
            kinds = np.split(np.arange(len(starts)), [len(corners)])
            best = np.stack([kind[reached[:, kind].argmax(axis=1)] for kind in kinds], axis=1)
            rows = (np.arange(count)[:, None, None] * len(starts) + best).ravel()
            value, each = np.tile(np.arange(2 * n) % n, 2 * count), np.repeat(np.arange(count), 4 * n)
            climb = _Climb(self, each, value, np.tile(signs, 2 * count))
            state, begun = q[rows], solved.chosen(rows)
            ends = climb.best(state, begun, np.take_along_axis(reached, best, axis=1).ravel())
            # Where the climb of one value ends may be better for another one than where its own has.
            at, is_good = self._at(each, state, begun), np.isfinite(ends)
            farthest = np.fmax(farthest, self._farthest(each, at, is_good).reshape(count, 4 * n, 2 * n).max(axis=1))
            others = _of_good(signs * np.tile(self._values(at), 2), is_good).reshape(count, 4 * n, 2 * n)
            rows = (np.arange(count)[:, None] * 4 * n + others.argmax(axis=1)).ravel()
            value, each = np.tile(np.arange(2 * n) % n, count), np.repeat(np.arange(count), 2 * n)
            again = _Climb(self, each, value, np.tile(signs, count))
            state, begun = state[rows], begun.chosen(rows)
            last = again.best(state, begun, others.max(axis=1).ravel())
            at = self._at(each, state, begun)
            ended = self._farthest(each, at, np.isfinite(last)).reshape(count, 2 * n, 2 * n)
            farthest = np.fmax(farthest, ended.max(axis=1))
        low, high = np.split(np.where(np.isfinite(farthest), farthest, np.nan), 2, axis=1)
        return -low, high

    def _farthest(self, which: NDArray[np.intp], at: EquilibriumAt, is_good: NDArray[np.bool_]) -> Floats:
        """How far down and up all values go in some states, with what nothing pushes there; none in those that fail."""
        half = np.zeros(at.error.shape)
        for row, width in self.widths:
            half += np.where(at.held[:, [row]], width[which], 0.0)
        sizes = [np.linalg.norm(np.abs(at.error[:, part]) + half[:, part], axis=1) for part in self._parts()]
        torques = torque(self.m, at.multipliers)
        low, high = at.error - half, at.error + half
        found = np.column_stack([-low, *sizes, -torques, high, *sizes, torques])
        return _of_good(found, is_good)

    def _at(self, which: NDArray[np.intp], q: Floats, solved: Equilibrium) -> EquilibriumAt:
        """Equilibrium of some states that was found."""
        return EquilibriumAt(self.task(which, q), solved.y, solved.held, solved.offset, solved.part)

    def _corners(self) -> Floats:
        if 2**self.dims <= CORNERS:
            return np.array(list(product((-1.0, 1.0), repeat=self.dims)))
        half = np.random.default_rng(0).choice((-1.0, 1.0), (CORNERS // 2, self.dims))
        return np.vstack([half, -half])

    def look(self, which: NDArray[np.intp], q: Floats, solved: Equilibrium) -> tuple[Floats, Floats]:
        """All values at some states, and their derivatives by q, (state, value, q)."""
        at = self._at(which, q, solved)
        changes = []
        for k, own in zip(self.rubs, self.columns, strict=True):
            motion = self.of.motions[k][which]
            if k in self.across:
                changes += [(k, self.across[k][which, way]) for way in (0, 1)]
            elif self.of.contacts[k].kind == FLANK:
                changes.append((k, np.where(q[:, own, None] < 0.0, -self.back[k][which], motion)))
            else:
                changes.append((k, np.ones(len(q))))
        offset, multiplier = at.by_motions(changes)
        error = self.m.core.sensitivity(at.of.drives, at.poses)["source"] @ offset
        sizes = []
        for part in self._parts():
            size = np.linalg.norm(at.error[:, part], axis=1)[:, None]
            along = np.einsum("nc,ncd->nd", at.error[:, part], error[:, part])
            sizes.append(along / np.where(size > 0.0, size, 1.0))
        torques = np.stack([torque(self.m, column) for column in np.moveaxis(multiplier, 2, 0)], axis=2)
        return self._values(at), np.concatenate([error, np.stack(sizes, axis=1), torques], axis=1)

    def task(self, which: NDArray[np.intp], q: Floats) -> SlidingTask:
        """What is solved for some q in some configurations."""
        task = self.of.chosen(which)
        motions = list(task.motions)
        for k, own in zip(self.rubs, self.columns, strict=True):
            if k in self.across:
                motions[k] = np.einsum("nd,ndi->ni", q[:, own], self.across[k][which])
            elif self.of.contacts[k].kind == FLANK:
                part = q[:, own, None]
                motions[k] = np.where(part < 0.0, -part * self.back[k][which], part * motions[k])
            else:
                motions[k] = q[:, own.start]
        return replace(task, motions=motions)

    def inside(self, q: Floats) -> Floats:
        """The nearest q that can be."""
        found = np.clip(q, -1.0, 1.0)
        for k, own in zip(self.rubs, self.columns, strict=True):
            if k in self.across:
                found[:, own] /= np.maximum(np.linalg.norm(found[:, own], axis=1, keepdims=True), 1.0)
        return found

    def farthest(self, slope: Floats) -> Floats:
        """The q that is best where values are straight."""
        found = np.sign(slope)
        for k, own in zip(self.rubs, self.columns, strict=True):
            if k in self.across:
                size = np.linalg.norm(slope[:, own], axis=1, keepdims=True)
                found[:, own] = slope[:, own] / np.where(size > 0.0, size, 1.0)
        return found

    def _parts(self) -> tuple[list[int], list[int]]:
        """The components of the position and of the rotation."""
        names = list(self.m.components)
        moves = [k for k, name in enumerate(names) if name in LENGTHS]
        return moves, [k for k in range(len(names)) if k not in moves]

    def _values(self, at: EquilibriumAt) -> Floats:
        sizes = [np.linalg.norm(at.error[:, part], axis=1) for part in self._parts()]
        return np.column_stack([at.error, *sizes, torque(self.m, at.multipliers)])


def _of_good(values: Floats, is_good: NDArray[np.bool_]) -> Floats:
    """Values of states, those of states that fail, and unknown ones, below all others."""
    return np.where(is_good[:, None] & ~np.isnan(values), values, -np.inf)


class _Climb:
    """The search for one value from one state each."""

    def __init__(self, of: Search, which: NDArray[np.intp], value: NDArray[np.intp], sign: Floats) -> None:
        self.of, self.which, self.value, self.sign = of, which, value, sign

    def best(self, q: Floats, solved: Equilibrium, reached: Floats) -> Floats:
        """The best values that are found from some states."""
        slope, curve, length = np.zeros(q.shape), np.full(q.shape, np.nan), np.ones(len(q))
        active = np.flatnonzero(np.isfinite(reached))
        reached = np.where(np.isfinite(reached), reached, np.nan)
        slope[active] = self._look(active, q[active], solved.chosen(active))[1]
        for _ in range(STEPS):
            straight = self.of.farthest(slope[active])
            bent = self.of.inside(q[active] - slope[active] / np.where(curve[active] < 0.0, curve[active], -1.0))
            step = length[active, None] * (np.where(curve[active] < 0.0, bent, straight) - q[active])
            gains = np.sum(slope[active] * step, axis=1) > GAIN * np.abs(reached[active])
            moves = gains & (np.abs(step).max(axis=1, initial=0.0) > STILL) & (length[active] > SHORT)
            active, step = active[moves], step[moves]
            if not len(active):
                break
            there, trial = self.of.inside(q[active] + step), solved.chosen(active)
            step = there - q[active]
            ended = solve(self.of.task(self.which[active], there), trial, np.arange(len(active)), np.ones(len(active)))
            value, turned = self._look(active, there, trial)
            good = ended.good & np.isfinite(value)
            bends = good[:, None] & (np.abs(step) > STILL)
            new = (turned - slope[active]) / np.where(bends, step, 1.0)
            curve[active] = np.where(bends, new, curve[active])
            better = good & (value > reached[active])
            length[active] = np.where(better, 1.0, length[active] / 2.0)
            kept = active[better]
            q[kept], slope[kept], reached[kept] = there[better], turned[better], value[better]
            for name in ("y", "held", "offset"):
                getattr(solved, name)[kept] = getattr(trial, name)[better]
        return reached

    def _look(self, places: NDArray[np.intp], q: Floats, solved: Equilibrium) -> tuple[Floats, Floats]:
        values, slopes = self.of.look(self.which[places], q, solved)
        each, own, sign = np.arange(len(places)), self.value[places], self.sign[places]
        return sign * values[each, own], sign[:, None] * slopes[each, own]
