"""Shares of specimens outside the limits where hardly any specimen is outside, by subset simulation.

A specimen is a function of independent standard normal scores z, its excess the largest of its distances beyond the
limits, each in standard deviations of its quantity, infinite where it cannot be assembled:

    P(g > 0) = P(g > g_1) P(g > g_2 | g > g_1) ... P(g > 0 | g > g_n),    g_1 < ... < g_n < 0

Specimens with g > g_k are moved by z' = sqrt(1 - s^2) z + s xi, xi standard normal, wherever g(z') > g_k, which keeps
their law (Au and Beck, Probab. Eng. Mech. 16, 2001, 263; the moves are those of Papaioannou, Betz, Zwirglmaier and
Straub, Probab. Eng. Mech. 41, 2015, 89). Levels g_k and sizes s of moves are chosen by a run of their own. With fixed
ones the product of the shares is unbiased, and independent replicates give its standard error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay import confidence
from jointplay.cluster import Here, Workers
from jointplay.errors import InputError
from jointplay.model import Mechanism
from jointplay.result import Builder
from jointplay.verdict import COUNTED

from .nominal import Floats, Nominal
from .yields import with_sizes

#: specimens outside below which their share is not counted but searched for
FEWEST = 1000
#: specimens solved for one share at most, but for those of the run that chooses the levels
SAMPLES = 400_000
#: specimens of the run that chooses the levels
PILOT = 1_000
REPLICATES = 10
#: share of the specimens that go on from one level to the next
PART = 0.2
#: moves at every level, and where the levels are chosen
MOVES, FIRST_MOVES = 3, 4
#: share of the moves that succeed at a good size
ACCEPTED = 0.4
#: a share below it is not searched for
LEAST = 1e-13
#: what is said of such a share: it is below
NEGLIGIBLE = 1e-12
#: relative standard error above which replicates disagree
DISAGREE = 0.3
#: part of a limit, beyond the worst case, from which on the worst case excludes that it is missed
MARGIN = 0.01
#: draws of specimens whose normal scores are truncated together
DRAWS = 10_000
#: keeps the random numbers apart from those of other analyses with the same seed
APART = 0x7A11
SEARCHED, EXCLUDED = "by subset simulation", "excluded by the worst case"
NEGLECTED, UNCERTAIN = "none found", "by subset simulation whose replicates disagree"


@dataclass(frozen=True)
class Tail:
    """A share outside the limits, of all (first) and of every limited quantity, with standard error and interval."""

    share: Floats
    error: Floats
    low: Floats
    high: Floats
    method: str


class Search:
    """Specimens of one configuration and how far they are beyond the limits.

    Parameters
    ----------
    drives, poses : ndarray
        Of one configuration, as a row.
    limits : ndarray
        Lowest and highest acceptable value of every quantity, infinite where there is none, shape (quantity, 2).
    """

    def __init__(self, m: Mechanism, drives: Floats, poses: Floats, law: str | None, limits: Floats) -> None:
        self.m, self.drives, self.poses, self.law = m, drives, poses, law
        #: the quantities that have limits, and these
        self.limited = np.flatnonzero(np.isfinite(limits).any(axis=1))
        self.limits = limits[self.limited]
        self.scores = m.core.count_scores(law)
        self.scale = np.ones(len(self.limits))

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

    def beyond(self, u: Floats) -> Floats:
        """How far every limited quantity is beyond its limits; infinite without a pose, shape (specimen, quantity)."""
        values = self.values(u)
        excess = np.maximum(values - self.limits[:, 1], self.limits[:, 0] - values) / self.scale
        excess[np.isnan(excess).any(axis=1)] = np.inf
        return excess

    def values(self, u: Floats) -> Floats:
        """The limited quantities of specimens."""
        return with_sizes(self.m, self.m.core.errors_of(self.drives, self.poses, u))[:, self.limited]

    def moved(
        self, z: Floats, excess: Floats, level: float, size: float, rng: np.random.Generator
    ) -> tuple[Floats, Floats, float]:
        """Specimens beyond a level after a move, and the share of the moves that succeeded."""
        there = math.sqrt(1.0 - size * size) * z + size * rng.standard_normal(z.shape)
        u = self.m.core.specimens_of_scores(there, self.law)
        valid = np.flatnonzero(~np.isnan(u).any(axis=1))
        found = self.beyond(u[valid])
        far = found.max(axis=1) > level
        z, excess = z.copy(), excess.copy()
        z[valid[far]], excess[valid[far]] = there[valid[far]], found[far]
        return z, excess, len(valid[far]) / len(z)


def tail(m: Mechanism, drives: Floats, poses: Floats, seed: int, law: str | None, limits: Floats) -> Tail:
    """The share of the specimens outside the limits at one configuration of a determinate mechanism."""
    search = Search(m, drives, poses, law, limits)
    nothing = np.zeros(1 + len(search.limits))
    if not search.scores:
        # Nothing scatters.
        is_out = np.append(search.beyond(m.centre[None])[0].max(), search.beyond(m.centre[None])[0]) > 0.0
        return Tail(is_out.astype(float), nothing, is_out.astype(float), is_out.astype(float), COUNTED)
    if is_excluded(m, drives, poses, law, limits):
        return Tail(nothing, nothing, nothing, nothing, EXCLUDED)
    first, second = np.random.SeedSequence([seed, APART]).spawn(2)
    levels = _levels(search, _generator(first))
    if levels is None:
        return Tail(nothing, np.full_like(nothing, np.nan), nothing, np.full_like(nothing, NEGLIGIBLE), NEGLECTED)
    count = SAMPLES // (REPLICATES * (1 + MOVES * len(levels)))
    return _estimate(_shares(search, levels, count, _generator(second)))


def _tail_at(m: Mechanism, seed: int, law: str | None, limits: Floats, at: Nominal) -> Tail:
    return tail(m, at.drives, at.poses, seed, law, limits)


def _generator(seed: np.random.SeedSequence) -> np.random.Generator:
    """The quickest of NumPy's generators: half of the work is normal numbers."""
    return np.random.Generator(np.random.SFC64(seed))


def is_excluded(m: Mechanism, drives: Floats, poses: Floats, law: str | None, limits: Floats) -> bool:
    """Whether no specimen can be outside: laws are bounded, and the worst case keeps to the limits with a margin."""
    specs = m.core_spec["sources"]
    kinds = zip(specs, m.source_kinds, strict=True)
    if not all(_is_bounded(law if law is not None and kind == "clearance" else spec["law"]) for spec, kind in kinds):
        return False
    worst = m.core.worst(drives, poses)
    exact = np.vstack([worst["component"][0], _from_zero(worst["position"]), _from_zero(worst["rotation"])])
    sizes = _from_zero(worst["position_bound"]), _from_zero(worst["rotation_bound"])
    linear = np.vstack([worst["component_first_order"][0], *sizes])
    low, high = np.minimum(exact[:, 0], linear[:, 0]), np.maximum(exact[:, 1], linear[:, 1])
    margin = MARGIN * np.maximum(np.abs(low), np.abs(high))
    return bool(worst["status"][0] == 0 and ((high + margin <= limits[:, 1]) & (low - margin >= limits[:, 0])).all())


def _from_zero(size: Floats) -> Floats:
    return np.array([[0.0, size[0]]])


def _is_bounded(law: object) -> bool:
    if isinstance(law, dict):
        process = law.get("process")
        return process is None or bool(process["sorted"])
    return law != "gauss"


def _levels(search: Search, rng: np.random.Generator) -> list[tuple[float, float]] | None:
    """Levels and sizes of the moves at each; None where a share is below the least."""
    z, u = search.first(PILOT, rng)
    values = search.values(u)
    spread = np.nanstd(values, axis=0) if np.isfinite(values).any() else np.zeros(values.shape[1])
    search.scale = np.where(spread > 0.0, spread, 1.0)
    excess = search.beyond(u)
    found: list[tuple[float, float]] = []
    size, share = 0.5, 1.0
    while True:
        g = excess.max(axis=1)
        level = float(np.quantile(g, 1.0 - PART, method="lower"))
        if level >= 0.0 or np.mean(g > 0.0) >= PART:
            return found
        if not (g > level).any():
            # Many specimens are equally far.
            below = g[g < level]
            if not len(below):
                return None
            level = float(below.max())
        alive = g > level
        share *= float(alive.mean())
        if share < LEAST:
            return None
        chosen = _going_on(alive, rng)
        z, excess = z[chosen], excess[chosen]
        for _ in range(FIRST_MOVES):
            z, excess, accepted = search.moved(z, excess, level, size, rng)
            size = min(max(size * math.exp(accepted - ACCEPTED), 1e-3), 1.0)
        found.append((level, size))


def _shares(search: Search, levels: list[tuple[float, float]], count: int, rng: np.random.Generator) -> Floats:
    """The share of the specimens beyond any limit, and beyond those of every quantity, a row for each replicate.

    Replicates go side by side. Each has its own specimens, which go on among themselves.
    """
    z, u = search.first(REPLICATES * count, rng)
    excess, share = search.beyond(u), np.ones(REPLICATES)
    for level, size in levels:
        alive = (excess.max(axis=1) > level).reshape(REPLICATES, count)
        share *= alive.mean(axis=1)
        chosen = np.concatenate([k * count + _going_on(one, rng) for k, one in enumerate(alive)])
        z, excess = z[chosen], excess[chosen]
        for _ in range(MOVES):
            z, excess, _ = search.moved(z, excess, level, size, rng)
    outside = np.column_stack([excess.max(axis=1), excess]) > 0.0
    shares: Floats = share[:, None] * outside.reshape(REPLICATES, count, -1).mean(axis=1)
    return shares


def _going_on(alive: NDArray[np.bool_], rng: np.random.Generator) -> NDArray[np.intp]:
    """The specimens that go on, each as often as any other, but for a remainder by lot; all where none is alive."""
    places = np.flatnonzero(alive)
    return np.resize(rng.permutation(places), len(alive)) if len(places) else np.arange(len(alive))


def _estimate(shares: Floats) -> Tail:
    """Of the shares in independent replicates, a row each. They are positive, so the interval is one of logarithms."""
    mean = shares.mean(axis=0)
    error = shares.std(axis=0, ddof=1) / math.sqrt(len(shares))
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(mean > 0.0, error / mean, np.inf)
        factor = np.exp(np.minimum(confidence.student(len(shares) - 1) * relative, 700.0))
    known = relative <= DISAGREE
    low, high = np.where(known, mean / factor, 0.0), np.minimum(mean * np.where(known, factor, 1.0), 1.0)
    if not known[0]:
        high[0] = min(max(mean[0] * factor[0], shares[:, 0].max() * len(shares)), 1.0)
    # A quantity that is hardly ever outside is so at most as often as all together.
    high = np.where(known, np.minimum(high, high[0]), high[0])
    return Tail(mean, error, low, high, SEARCHED if known[0] else UNCERTAIN)


def require_rare(m: Mechanism, is_loaded: bool) -> None:
    """Refuse the search for rare specimens where it is not possible, or where nothing says which they are."""
    if is_loaded:
        raise InputError("rare specimens are searched for with contact 'scattered', not 'loaded'", key="rare")
    if not m.core.isostatic:
        problem = "rare specimens are searched for in determinate mechanisms; this one is over-constrained or elastic"
        raise InputError(problem, file=m.file, key="rare")
    if not m.limits.errors:
        raise InputError(
            "rare specimens are those outside the limits, and the file has none", file=m.file, key="limits"
        )


def search_rare(
    builder: Builder,
    m: Mechanism,
    at: Nominal,
    counts: Floats,
    seed: int,
    law: str | None,
    limits: Floats,
    workers: Here | Workers,
) -> None:
    """Put the shares of rare specimens in the place of the counted ones, and say how each was found.

    Parameters
    ----------
    counts : ndarray
        Specimens outside among those drawn, by configuration.
    workers : Here or Workers
        Who searches, configuration by configuration.
    """
    methods = [COUNTED] * len(at)
    names = {
        f"outside{of}{end}": (of, attribute)
        for of in ("", "_quantity")
        for end, attribute in (("", "share"), ("_standard_error", "error"), ("_low", "low"), ("_high", "high"))
    }
    values = {name: builder.data[name].values.copy() for name in names}
    limited = np.isfinite(limits).any(axis=1)
    rare = np.flatnonzero((counts < FEWEST) & np.isfinite(at.poses).all(axis=(1, 2))).tolist()
    tails = workers.each(_tail_at, (m, seed, law, limits), (at.at(k) for k in rare))
    for k, found in zip(rare, tails, strict=True):
        methods[k] = found.method
        for name, (of, attribute) in names.items():
            value = getattr(found, attribute)
            if of:
                values[name][k, limited] = value[1:]
            else:
                values[name][k] = value[0]
    for name, array in values.items():
        builder.data[name] = replace(builder.data[name], values=array)
    builder.add("outside_method", "configuration", np.array(methods), "how the share outside the limits was found")
