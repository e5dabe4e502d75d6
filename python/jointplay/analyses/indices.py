"""Sobol' indices: the share of every source in the variance, alone and with all that it does together with others.

    first   S_g = V(E(f | x_g)) / V(f)          what would be gone if the source did not scatter, at least
    total   T_g = E(V(f | x_~g)) / V(f)         what would be left if it alone scattered, at most

from two independent matrices of specimens, A and B, and A_B, which is A with the columns of the source from B:

    V S_g ~ mean (f(B) - f0) (f(A_B) - f(A))        Saltelli et al. 2010, Table 2 (b), about the mean f0
    V T_g ~ mean (f(A) - f(A_B))^2 / 2              Jansen 1999; the same table, (f)

For a linear f both are the first-order share. T_g > S_g where the source acts together with others. The standard errors
are by independent replicates, for the ratio of numerator and variance.

The inputs have to be independent. The offset of a clearance whose size scatters is drawn within the gap of its sizes:
its independent part is the offset divided by the gap. Sources that are correlated are one group.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.cluster import Here, Workers
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.gaps import core_at
from jointplay.model.mechanism import Mechanism

from .nominal import Nominal
from .yields import with_sizes

#: specimens of each matrix at most
POINTS = 16_384
#: independent replicates
REPLICATES = 16
#: B has the seed of the specimens plus this
STRIDE = 0xD1B5_4A32_D192_ED03


@dataclass(frozen=True)
class Indices:
    """First and total index with their standard errors, nan where nothing scatters."""

    #: `first`, `first_error`, `total`, `total_error`: shape (group, quantity)
    first: Floats
    first_error: Floats
    total: Floats
    total_error: Floats
    #: share of the points that are left out because one of their specimens has no pose
    left_out: float


def estimate(a: Floats, b: Floats, mixed: Floats, replicates: int, rounding: Floats | float = 0.0) -> Indices:
    """The indices from the values of a function.

    Parameters
    ----------
    a, b : ndarray
        Values at A and at B, shape (point, quantity), one replicate after the other.
    mixed : ndarray
        Values at A_B of every group, shape (group, point, quantity).
    replicates : int
        Independent ones of equal size.
    rounding : ndarray or float
        Standard deviation of every quantity that is rounding.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> a, b = rng.normal(size=(2, 100_000, 2))
    >>> f = lambda x: x @ np.array([[3.0], [4.0]])
    >>> mixed = np.stack([f(np.where([True, False], b, a)), f(np.where([False, True], b, a))])
    >>> found = estimate(f(a), f(b), mixed, 16)
    >>> found.first[:, 0].round(2), found.total[:, 0].round(2)
    (array([0.36, 0.64]), array([0.36, 0.64]))
    """
    whole = np.isfinite(np.concatenate([a[None], b[None], mixed])).all(axis=2).all(axis=0)
    count = int(whole.sum())
    # What is left out adds nothing to any sum.
    a, b, mixed = (np.where(whole[:, None], values, 0.0) for values in (a, b, mixed))
    mean = (a.sum(axis=0) + b.sum(axis=0)) / max(2 * count, 1)
    a, b, mixed = (np.where(whole[:, None], values - mean, 0.0) for values in (a, b, mixed))

    def sums(values: Floats) -> Floats:
        """By replicate, which comes last."""
        parts = values.reshape(*values.shape[:-2], replicates, -1, values.shape[-1]).sum(axis=-2)
        return np.moveaxis(parts, -2, -1)

    variance = sums(0.5 * (a * a + b * b))
    scatters = variance.sum(axis=-1) > count * np.square(rounding)

    def ratio(parts: Floats) -> tuple[Floats, Floats]:
        below = np.where(scatters, variance.sum(axis=-1), np.nan)
        value = parts.sum(axis=-1) / below
        rest = parts - value[..., None] * variance
        freedom = replicates / (replicates - 1) if replicates > 1 else np.nan
        return value, np.sqrt(freedom * np.square(rest).sum(axis=-1)) / below

    first, total = ratio(sums(b * (mixed - a))), ratio(sums(0.5 * np.square(a - mixed)))
    return Indices(*first, *total, 1.0 - count / len(whole))


def groups(m: Mechanism) -> list[list[int]]:
    """The sources that are drawn together, by index."""
    together = m.correlated
    taken = {s for group in together for s in group}
    return sorted([*together, *([s] for s in range(len(m.sources)) if s not in taken)])


def require_determinate_scatter(m: Mechanism, loaded: bool) -> None:
    """Refuse what has no independent inputs.

    Raises
    ------
    InputError
        When compatibility ties offsets to one another, or the load decides where they are.
    """
    if loaded:
        problem = "with contact 'loaded' the load decides where the offsets are; the indices are of contact 'scattered'"
        raise InputError(problem, file=m.file, key="indices")
    if not m.core.isostatic:
        problem = (
            "Sobol' indices are of independent sources; in an over-constrained or elastic mechanism compatibility or"
            " deformation ties the offsets to one another. Without `indices`, `contribution` has the first-order shares"
        )
        raise InputError(problem, file=m.file, key="indices")


def indices(
    m: Mechanism,
    at: Nominal,
    samples: int,
    seed: int,
    law: str | None,
    sampling: str,
    rounding: Floats,
    workers: Here | Workers,
) -> list[Indices]:
    """The indices at every configuration of a determinate mechanism, of every source and quantity.

    Parameters
    ----------
    rounding : ndarray
        Standard deviation of every quantity that is rounding, SI.
    workers : Here or Workers
        Who finds them, configuration by configuration.
    """
    points = _Points(m, samples, seed, law, sampling, rounding)
    return list(workers.each(_Points.indices, (points,), (at.at(k) for k in range(len(at)))))


@dataclass(frozen=True)
class _Points:
    """The points at which the function is needed, the same at all configurations."""

    m: Mechanism
    samples: int
    seed: int
    law: str | None
    sampling: str
    rounding: Floats

    @cached_property
    def replicates(self) -> int:
        return min(REPLICATES, min(self.samples, POINTS) // 2)

    @cached_property
    def drawn(self) -> tuple[_PartDraws, _PartDraws]:
        """A and B."""
        count = min(self.samples, POINTS)
        count -= count % self.replicates
        # Otherwise replicates of Sobol points would not be of equal size.
        sampling = self.sampling if count >= 2 * REPLICATES else "plain"
        a = _PartDraws.of(self.m, count, self.seed, self.law, sampling)
        b = _PartDraws.of(self.m, count, (self.seed + STRIDE) % 2**64, self.law, sampling)
        # Point k of B has the net of point k of A, differently scrambled: together they would fill the space in
        # stripes.
        return a, b.shuffled(np.random.default_rng(self.seed), self.replicates)

    @cached_property
    def starts(self) -> list[Floats]:
        """The parameters of A and of B."""
        return [draws.parameters(self.m) for draws in self.drawn]

    def indices(self, at: Nominal) -> Indices:
        """The indices at one configuration."""
        m = self.m
        if not np.isfinite(at.poses).all():
            unknown = np.full((len(m.sources), len(self.rounding)), np.nan)
            return Indices(unknown, unknown, unknown, unknown, np.nan)

        def errors(u: Floats) -> Floats:
            return with_sizes(m, m.core.errors_of(at.drives, at.poses, u))

        by_source = groups(m)
        columns = [np.isin(m.parameter_source, group) for group in by_source]
        a, b = self.drawn
        mixed = np.stack([errors(a.mixed(b, which).parameters(m)) for which in columns])
        of = estimate(errors(self.starts[0]), errors(self.starts[1]), mixed, self.replicates, self.rounding)
        # Of each source the row of its group.
        row = np.empty(len(m.sources), dtype=int)
        for g, group in enumerate(by_source):
            row[group] = g
        return Indices(of.first[row], of.first_error[row], of.total[row], of.total_error[row], of.left_out)


@dataclass(frozen=True)
class _PartDraws:
    """Specimens by their independent parts."""

    #: parameters, of which all but the offsets count
    drawn: Floats
    #: parameters with the offsets of the same specimens in gaps that are the same for all
    offsets: Floats

    @classmethod
    def of(cls, m: Mechanism, count: int, seed: int, law: str | None, sampling: str) -> _PartDraws:
        drawn = m.core.specimens(count, seed, law, sampling)
        sized = _with_play(m)
        if sized is None:
            return cls(drawn, drawn)
        # The same random numbers where all pairs have play: those with interference have lost their offsets.
        within = core_at(m, sized).specimens(count, seed, law, sampling)
        return cls(drawn, m.core.with_offsets_of(np.tile(sized, (count, 1)), within))

    def shuffled(self, rng: np.random.Generator, replicates: int) -> _PartDraws:
        """In another order within every replicate."""
        size = len(self.drawn) // replicates
        order = np.concatenate([k * size + rng.permutation(size) for k in range(replicates)])
        return _PartDraws(self.drawn[order], self.offsets[order])

    def mixed(self, other: _PartDraws, columns: NDArray[np.bool_]) -> _PartDraws:
        """With some of the parameters of others."""
        drawn = np.where(columns, other.drawn, self.drawn)
        return _PartDraws(drawn, np.where(columns, other.offsets, self.offsets))

    def parameters(self, m: Mechanism) -> Floats:
        """Every offset in the gap of its own sizes."""
        return m.core.with_offsets_of(self.drawn, self.offsets)


def _with_play(m: Mechanism) -> Floats | None:
    """Parameters with which every clearance has play, whatever is drawn; None where no gap scatters."""
    sized = m.centre.copy()
    for k, source in enumerate(m.compiled_sources):
        if source.kind == "size":
            sized[m.parameter_source == k] += np.copysign(m.length, source.spec["factor"])
    return None if np.array_equal(sized, m.centre) else sized
