"""The linear algebra of a fit: weights of readings that have errors in common, least squares with priors.

    minimise |W (y - h(x))|^2 + |w|^2,   x = m + s R w,   W' W = (noise + play)^-1,   R R' = correlation of the priors

What is left of a reading when all others predict it follows without another fit: with the residuals r of the fit,
A = W dh/dw and Q = W' (I - A (A' A + I)^-1 A') W, the rows S of a reading are missed by (Q_SS)^-1 (W' W r)_S, which
has the covariance (Q_SS)^-1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.readings import Readings
from jointplay.basics.arrays import Floats

#: part of the largest singular value below which a direction changes no reading; of derivatives by differences
EXACT, OF_DIFFERENCES = 1e-9, 1e-8
#: part of the largest eigenvalue of correlations that is rounding
ROUNDING = 1e-7
#: weight of an equation that holds an unknown at its bound
STIFF = 1e6
#: residuals, as parts of their standard deviations, from which on a reading counts less at the start
HUBER = 1.345


@dataclass(frozen=True, eq=False)
class Weights:
    """Cells that were read, one after the other, and what makes their errors independent.

    Attributes
    ----------
    rows, columns : ndarray of int
        Of every cell, those of one approach together.
    blocks : tuple of slice
        The cells of every approach.
    factors : tuple of ndarray
        Of every block what whitens it: lower triangular.
    covariance : ndarray
        Of every cell by itself.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    blocks: tuple[slice, ...]
    factors: tuple[Floats, ...]
    variance: Floats

    def __len__(self) -> int:
        return len(self.rows)

    def whitened(self, values: Floats) -> Floats:
        """Values of all cells, or rows of them, with independent errors of one."""
        found = np.empty_like(values)
        for block, factor in zip(self.blocks, self.factors, strict=True):
            found[block] = factor @ values[block]
        return found

    def back(self, values: Floats) -> Floats:
        """The transposed of `whitened`."""
        found = np.empty_like(values)
        for block, factor in zip(self.blocks, self.factors, strict=True):
            found[block] = factor.T @ values[block]
        return found


def weights(readings: Readings, play: Floats, used: NDArray[np.bool_]) -> Weights:
    """Weights of the readings of some rows.

    Parameters
    ----------
    play : ndarray
        Covariance that the play adds in each row, (row, channel, channel); rows of one approach have it in common.
    used : ndarray of bool
        Which rows count.
    """
    given = readings.given & used[:, None]
    order = np.argsort(readings.approaches, kind="stable")
    rows, columns = (np.concatenate(parts) for parts in zip(*_cells(order, given), strict=True))
    owners = readings.approaches[rows]
    ends = np.flatnonzero(np.diff(owners)) + 1
    blocks = tuple(slice(a, b) for a, b in zip([0, *ends.tolist()], [*ends.tolist(), len(rows)], strict=True))
    noise = readings.sigma[rows, columns] ** 2
    factors: list[Floats] = []
    variance = np.empty(len(rows))
    for block in blocks:
        own = columns[block]
        covariance = play[rows[block][0]][np.ix_(own, own)] + np.diag(noise[block])
        variance[block] = np.diagonal(covariance)
        try:
            factors.append(np.linalg.inv(np.linalg.cholesky(covariance)))
        except np.linalg.LinAlgError:
            problem = "standard deviations of readings, drives and play are too far apart to count with"
            raise readings.sheet.refuse(problem, row=int(rows[block][0])) from None
    return Weights(rows, columns, blocks, tuple(factors), variance)


def _cells(order: NDArray[np.int64], given: NDArray[np.bool_]) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    return [(np.full(int(given[row].sum()), row), np.flatnonzero(given[row])) for row in order]


@dataclass(frozen=True, eq=False)
class Missed:
    """How far every row is from what all others predict."""

    rows: NDArray[np.int64]
    #: squared, by its covariance
    distance: Floats
    #: cells of the row: the degrees of freedom of the distance
    count: NDArray[np.int64]
    #: of every cell, SI
    cells: Floats


class System:
    """Whitened and scaled equations at a fixed linearisation.

    Parameters
    ----------
    weights : Weights
    jacobian : ndarray
        Derivatives of every cell, shape (cell, unknown), SI; flat unknowns last.
    scale : ndarray
        Of every unknown: the standard deviation of its prior, infinite without one.
    correlation : ndarray
        Of those with a prior, which are the first.
    before : System, optional
        The same equations at an earlier linearisation: directions without a prior that no reading told there stay open,
        because what tells them now is rounding or second order.
    """

    def __init__(
        self, weights: Weights, jacobian: Floats, scale: Floats, correlation: Floats, before: System | None = None
    ) -> None:
        self.weights = weights
        whitened = weights.whitened(jacobian)
        sizes = np.linalg.norm(whitened, axis=0)
        known = np.isfinite(scale)
        self.known = known
        self.scale: Floats = np.where(known, scale, 1.0 / np.where(sizes > 0.0, sizes, 1.0))
        if before is not None:
            self.scale = before.scale
        self._before = before
        self.a = whitened * self.scale
        # Of sources that scatter as one, fewer numbers are independent than there are sources.
        values, vectors = np.linalg.eigh(correlation)
        kept = values > ROUNDING * max(float(values.max(initial=0.0)), 1e-300)
        self.root = vectors[:, kept] * np.sqrt(values[kept])
        self.inverse = (vectors[:, kept] / np.sqrt(values[kept])).T

    @cached_property
    def flat(self) -> tuple[Floats, Floats]:
        """Of the unknowns without a prior: directions that the readings tell, and those that they do not; columns."""
        if self._before is not None:
            return self._before.flat
        own = self.a[:, ~self.known]
        if not own.shape[1]:
            return np.zeros((0, 0)), np.zeros((0, 0))
        _, singular, right = np.linalg.svd(own, full_matrices=True)
        singular = np.concatenate([singular, np.zeros(right.shape[0] - len(singular))])
        determined = singular > EXACT * max(float(singular.max(initial=0.0)), 1e-300)
        return right[determined].T, right[~determined].T

    @cached_property
    def basis(self) -> Floats:
        """What is solved for: all unknowns with a prior, and the determined directions of the others."""
        determined, count = self.flat[0], self.root.shape[1]
        basis = np.zeros((len(self.scale), count + determined.shape[1]))
        basis[self.known, :count] = self.root
        basis[~self.known, count:] = determined
        return basis

    @cached_property
    def prior(self) -> Floats:
        """Equations of the priors: the independent numbers that make the unknowns are of size one."""
        count = self.root.shape[1]
        return np.eye(count, self.basis.shape[1])

    def step(
        self, residual: Floats, away: Floats, counts: Floats | None = None, lowest: Mapping[int, float] | None = None
    ) -> Floats:
        """The change of all unknowns, SI.

        Parameters
        ----------
        residual : ndarray
            Whitened.
        away : ndarray
            How far unknowns are from the middle of their priors, as parts of their standard deviations.
        counts : ndarray, optional
            Of every cell how much it counts.
        lowest : mapping, optional
            By the number of an unknown how far down it may go, SI: to zero where it is a size.
        """
        root = np.ones(len(residual)) if counts is None else np.sqrt(counts)
        left = np.concatenate([root[:, None] * (self.a @ self.basis), self.prior])
        right = np.concatenate([root * residual, -self.inverse @ away])
        held: dict[int, float] = {}
        while True:
            # What is at its bound is held there by equations that outweigh all others.
            rows = self.basis[np.array([*held], dtype=int)] * STIFF
            ends = np.array([end * STIFF / self.scale[k] for k, end in held.items()])
            both = np.concatenate([left, rows]), np.concatenate([right, ends])
            found = np.linalg.lstsq(*both, rcond=None)[0]
            step = np.asarray(self.scale * (self.basis @ found))
            below = {k: end for k, end in (lowest or {}).items() if k not in held and step[k] < end}
            if not below:
                return step
            held |= below

    @cached_property
    def _root(self) -> Floats:
        """R of the stacked equations, so that the covariance is (R' R)^-1."""
        return np.asarray(np.linalg.qr(np.concatenate([self.a @ self.basis, self.prior]), mode="r"))

    @cached_property
    def covariance(self) -> Floats:
        """Covariance of all unknowns, SI; what flat directions leave open is not in it."""
        half = np.linalg.solve(self._root.T, (self.scale[:, None] * self.basis).T)
        return np.asarray(half.T @ half)

    @cached_property
    def is_determined(self) -> NDArray[np.bool_]:
        """Whether an unknown has a prior or the readings tell it by itself."""
        determined = self.known.copy()
        undetermined = self.flat[1]
        if undetermined.size:
            determined[~self.known] = np.linalg.norm(undetermined, axis=1) <= 1e-6
        else:
            determined[:] = True
        return determined

    @property
    def flats(self) -> int:
        """How many directions have no prior and are determined by readings."""
        return int(self.flat[0].shape[1])

    def without_flat(self) -> Floats:
        """Equations of the unknowns with a prior, with what the others can make up for taken away."""
        own, rest = self.a[:, self.known], self.a[:, ~self.known] @ self.flat[0] if self.flats else None
        if rest is None:
            return own
        basis = np.linalg.qr(rest)[0]
        return np.asarray(own - basis @ (basis.T @ own))

    def missed(self, residual: Floats) -> Missed:
        """How every row is missed by the others, from the whitened residuals of the fit."""
        hat = np.linalg.solve(self._root.T, (self.a @ self.basis).T).T
        forces = self.weights.back(residual)
        rows: list[int] = []
        distance: list[float] = []
        count: list[int] = []
        cells = np.full(len(residual), np.nan)
        for block, factor in zip(self.weights.blocks, self.weights.factors, strict=True):
            part = hat[block]
            precision = factor.T @ (np.eye(len(part)) - part @ part.T) @ factor
            own = self.weights.rows[block]
            for row in np.unique(own).tolist():
                places = np.flatnonzero(own == row)
                force = forces[block][places]
                # A cell that alone decides something cannot be missed by the others.
                away = np.linalg.lstsq(precision[np.ix_(places, places)], force, rcond=EXACT)[0]
                rows.append(row)
                distance.append(float(force @ away))
                count.append(len(places))
                cells[np.arange(len(residual))[block][places]] = away
        return Missed(np.array(rows), np.array(distance), np.array(count), cells)

    def huber(self, residual: Floats) -> Floats:
        """How much every cell counts: cells of one approach alike."""
        counts = np.ones(len(residual))
        for block in self.weights.blocks:
            size = float(np.linalg.norm(residual[block]))
            bound = HUBER * np.sqrt(block.stop - block.start)
            counts[block] = min(1.0, bound / size) if size > 0.0 else 1.0
        return counts


@dataclass(frozen=True)
class Combination:
    """Unknowns of which the readings tell only one combination, or none of what they do together."""

    #: index of each unknown, with its coefficient in the sum that is determined, or in a step that changes nothing
    parts: tuple[tuple[int, float], ...]
    #: whether they act alike, so that only this combination of them is determined
    alike: bool


def combinations(columns: Floats, exact: float = EXACT) -> list[Combination]:
    """What columns of derivatives do not distinguish, in few unknowns each.

    Parameters
    ----------
    columns : ndarray
        Shape (equation, unknown).
    exact : float
        Part of the largest that is nothing.
    """
    sizes = np.linalg.norm(columns, axis=0)
    largest = float(sizes.max(initial=0.0))
    found = [Combination(((k, 1.0),), alike=False) for k in np.flatnonzero(sizes <= exact * largest).tolist()]
    left = [k for k in range(len(sizes)) if sizes[k] > exact * largest]
    heads: list[int] = []
    groups: dict[int, list[tuple[int, float]]] = {}
    for k in left:
        for head in heads:
            ratio = float(columns[:, head] @ columns[:, k]) / sizes[head] ** 2
            if np.linalg.norm(columns[:, k] - ratio * columns[:, head]) <= 1e-6 * sizes[k]:
                groups[head].append((k, ratio))
                break
        else:
            heads.append(k)
            groups[k] = [(k, 1.0)]
    found += [Combination(tuple(group), alike=True) for group in groups.values() if len(group) > 1]
    return found + [
        Combination(parts, alike=False) for parts in _null(columns / np.maximum(sizes, 1e-300), heads, sizes, exact)
    ]


def _null(columns: Floats, chosen: Sequence[int], sizes: Floats, exact: float) -> list[tuple[tuple[int, float], ...]]:
    """Directions that change nothing, of columns of length one, by elimination: few unknowns in each."""
    own = columns[:, list(chosen)]
    if own.shape[1] < 2:
        return []
    _, singular, right = np.linalg.svd(own, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(right.shape[0] - len(singular))])
    null = right[singular <= exact * singular.max()]
    for row in range(len(null)):
        # As in Gauss and Jordan's elimination, with the largest number as the pivot.
        pivot = int(np.abs(null[row]).argmax())
        null[row] /= null[row, pivot]
        for other in range(len(null)):
            if other != row:
                null[other] -= null[other, pivot] * null[row]
    parts = []
    for vector in null:
        vector = vector / np.abs(vector).max()
        kept = np.flatnonzero(np.abs(vector) > 1e-6)
        parts.append(tuple((int(chosen[k]), float(vector[k] / sizes[chosen[k]])) for k in kept.tolist()))
    return parts
