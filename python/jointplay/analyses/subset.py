"""Subset simulation: the share of the specimens that are outside in one way.

A specimen is a function of independent standard normal scores z, and f how far it has come along the way:

    P(f > 0) = P(f > f_1) P(f > f_2 | f > f_1) ... P(f > 0 | f > f_n),    f_1 < ... < f_n < 0

Specimens with f > f_k are moved by z' = sqrt(1 - s^2) z + s xi, xi standard normal, wherever f(z') > f_k, which keeps
their law (Au and Beck, Probab. Eng. Mech. 16, 2001, 263; the moves are those of Papaioannou, Betz, Zwirglmaier and
Straub, Probab. Eng. Mech. 41, 2015, 89). Levels f_k and sizes s of moves are chosen by a run of their own. With fixed
ones the product of the shares is unbiased, and independent replicates give its standard error.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.model.mechanism import Mechanism

from .ways import Way

REPLICATES = 16
#: specimens of the run that chooses the levels, among which the first level is chosen, and a second time with more
PILOT, PLAIN_PILOT, SECOND = 1_000, 20_000, 4
#: share of the specimens that go on from the first level, which many are drawn for, and from every other one
FIRST_PART, PART = 0.05, 0.2
#: moves at every level, and where the levels are chosen
MOVES, FIRST_MOVES = 3, 4
#: share of the moves that succeed at a good size, and one at which nothing moves any more
ACCEPTED, STALLED = 0.4, 0.02
#: a size of moves below which they are not made smaller
SMALLEST = 1e-9
#: a share below it is not searched for
LEAST = 1e-13
#: draws of specimens whose normal scores are truncated together
DRAWS = 10_000
#: a specimen under load takes some hundred times as long as another one: so many times fewer are solved
FEWER = 4


class Specimens:
    """Specimens of one configuration.

    Parameters
    ----------
    drives, poses : ndarray
        Of one configuration, as a row.
    is_loaded : bool
        Whether the load decides the offsets; scores of offsets then change nothing.
    """

    def __init__(self, m: Mechanism, drives: Floats, poses: Floats, law: str | None, is_loaded: bool = False) -> None:
        self.m, self.drives, self.poses, self.law = m, drives, poses, law
        self.scores = m.core.count_scores(law)
        self.is_loaded, self.fewer = is_loaded, FEWER if is_loaded else 1
        self._offsets = np.array([m.source_kinds[s] in LOOSE for s, _ in m.core.parameters], dtype=bool)

    @property
    def scatter(self) -> bool:
        """Whether one specimen differs from another."""
        return bool(self.scores) and not (self.is_loaded and self._offsets.all())

    def first(self, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Scores of random specimens, and their parameters."""
        z = rng.standard_normal((count, self.scores))
        u = self.m.core.specimens_of_scores(z, self.law)
        for _ in range(DRAWS):
            again = np.flatnonzero(np.isnan(u).any(axis=1))
            if not len(again):
                break
            z[again] = rng.standard_normal((len(again), self.scores))
            u[again] = self.m.core.specimens_of_scores(z[again], self.law)
        return z, u

    def drawn(self, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Scores and errors of random specimens."""
        z, u = self.first(count, rng)
        return z, self.errors(u)

    def errors(self, u: Floats) -> Floats:
        """Errors of specimens by component, nan without a pose."""
        core = self.m.core
        if self.is_loaded:
            u = core.loaded_specimens(self.drives, self.poses, np.where(self._offsets, self.m.centre, u))["offset"]
        return core.errors_of(self.drives, self.poses, u)

    def moved(
        self, way: Way, z: Floats, errors: Floats, level: float, size: float, rng: np.random.Generator
    ) -> tuple[Floats, Floats, float]:
        """Specimens beyond a level after a move, and the share of the moves that succeeded."""
        there = math.sqrt(1.0 - size * size) * z + size * rng.standard_normal(z.shape)
        u = self.m.core.specimens_of_scores(there, self.law)
        valid = np.flatnonzero(~np.isnan(u).any(axis=1))
        found = self.errors(u[valid])
        far = way.beyond(found) > level
        z, errors = z.copy(), errors.copy()
        z[valid[far]], errors[valid[far]] = there[valid[far]], found[far]
        return z, errors, float(np.count_nonzero(far)) / len(z)


@dataclass(frozen=True)
class Climb:
    """Levels along a way with the sizes of the moves at each; whether they lead to its end, and the share there."""

    levels: tuple[tuple[float, float], ...]
    share: float
    is_there: bool
    is_stalled: bool = False


def climb(specimens: Specimens, way: Way, z: Floats, errors: Floats, count: int, rng: np.random.Generator) -> Climb:
    """Choose levels along a way, from random specimens on, with so many of them at every other level."""
    found: list[tuple[float, float]] = []
    size, share, part = 0.5, 1.0, FIRST_PART
    while True:
        f = way.beyond(errors)
        level = float(np.quantile(f, 1.0 - part, method="lower"))
        there = float(np.mean(f > way.target))
        if level >= way.target or there >= part:
            return Climb(tuple(found), share * there, True)
        if not (f > level).any():
            # Many specimens are equally far.
            below = f[f < level]
            if not len(below):
                return Climb(tuple(found), share, False, True)
            level = float(below.max())
        alive = f > level
        share *= float(alive.mean())
        if share < LEAST:
            return Climb(tuple(found), share, False)
        chosen = going_on(alive, count, rng)
        z, errors = z[chosen], errors[chosen]
        succeeded = 0.0
        for _ in range(FIRST_MOVES):
            z, errors, accepted = specimens.moved(way, z, errors, level, size, rng)
            size = min(max(size * math.exp(accepted - ACCEPTED), SMALLEST), 1.0)
            succeeded = max(succeeded, accepted)
        if succeeded < STALLED:
            return Climb(tuple(found), share, False, True)
        found.append((level, size))
        part = PART


def ascend(
    specimens: Specimens,
    way: Way,
    levels: tuple[tuple[float, float], ...],
    z: Floats,
    errors: Floats,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Specimens beyond the first level, replicate after replicate, brought beyond all others.

    Replicates go side by side. Each has its own specimens, which go on among themselves.

    Returns
    -------
    ndarray
        Share of the specimens of the first level that are beyond the last, of every replicate.
    ndarray
        Errors of the specimens at the last level, in the same order.
    """
    share, count = np.ones(REPLICATES), len(z) // REPLICATES
    for k, (level, size) in enumerate(levels):
        if k:
            alive = (way.beyond(errors) > level).reshape(REPLICATES, count)
            share *= alive.mean(axis=1)
            chosen = np.concatenate([r * count + going_on(one, count, rng) for r, one in enumerate(alive)])
            z, errors = z[chosen], errors[chosen]
        for _ in range(MOVES):
            z, errors, _ = specimens.moved(way, z, errors, level, size, rng)
    return share, errors


def going_on(alive: NDArray[np.bool_], count: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """So many of the specimens that go on, each as often as any other, but for a remainder by lot; any if none does."""
    places = np.flatnonzero(alive)
    return np.resize(rng.permutation(places if len(places) else len(alive)), count)
