"""The closure Jacobian of joints in relative coordinates: what the joints of a spanning tree leave free.

A joint of the tree has rows A v(inner) + B v(outer) of the twists of its bodies, so that

    v(outer) = -B+ A v(inner) + Z z        with  B Z = 0 .

Twists of all bodies are T z then. The other joints close loops and leave equations L z = 0 for the free coordinates
alone: nothing is left of an open chain, however long, and a loop is no worse conditioned at the end of an arm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats

#: directions in which the rows of a joint, of length one, move its outer body by less are free
FREE = 1e-6
#: entries of a row below this are rounding, beside its largest one
ROUNDING = 1e-11
#: singular values above this, with rows and directions of length one, are not zero
FIRM = 1e-3
#: what is below is zero. A value between the two is zero if it is farther from the next larger one than from this: then
#: a drawing with few digits, or a pose beside a special one, has made it of zero
ZERO = 1e-7


@dataclass(frozen=True)
class _Branch:
    """A joint of the tree: its rows, its bodies, and how the outer one follows."""

    numbers: NDArray[np.intp]
    inner: int
    outer: int
    #: B+, -B+ A and Z
    back: Floats
    carried: Floats
    free: Floats
    #: the first of its coordinates
    first: int


class Relative:
    """Relative coordinates at one configuration.

    Parameters
    ----------
    rows : ndarray
        Length-scaled rows of the joints over the twists of all bodies.
    joints : ndarray of int
        The joint of every row.
    ends : sequence of tuple
        The two bodies of every joint; -1 is the ground.
    size : int
        Components of a twist.
    """

    def __init__(self, rows: Floats, joints: NDArray[np.intp], ends: Sequence[tuple[int, int]], size: int) -> None:
        self.rows, self.size = rows, size
        bodies = rows.shape[1] // size
        order = np.argsort(joints, kind="stable")
        bounds = np.searchsorted(joints[order], np.arange(len(ends) + 1))
        own = [order[a:b] for a, b in pairwise(bounds)]
        self.branches: list[_Branch] = []
        #: combinations of rows of the tree that say nothing of the outer body
        self.rest: list[tuple[NDArray[np.intp], Floats]] = []
        self.count = 0
        loose: list[tuple[int, int]] = []
        in_tree = np.zeros(len(rows), dtype=bool)
        for inner, outer, joint in _spanning(ends, own, bodies):
            if joint < 0:
                loose.append((outer, self.count))
                self.count += size
                continue
            in_tree[own[joint]] = True
            self.branches.append(self._branch(own[joint], inner, outer))
            self.count += self.branches[-1].free.shape[1]
        self.loops = np.flatnonzero(~in_tree)
        self.twists = np.zeros((size * bodies, self.count))
        for body, first in loose:
            self.twists[self._of(body), first : first + size] = np.eye(size)
        for branch in self.branches:
            outer_rows = self._of(branch.outer)
            if branch.inner >= 0:
                self.twists[outer_rows] = branch.carried @ self.twists[self._of(branch.inner)]
            self.twists[outer_rows, branch.first : branch.first + branch.free.shape[1]] = branch.free
        #: L, the equations of the loops
        self.closing = self.of(self._of_loops(rows))

    def _of(self, body: int) -> slice:
        return slice(body * self.size, (body + 1) * self.size)

    def _branch(self, numbers: NDArray[np.intp], inner: int, outer: int) -> _Branch:
        rows = self.rows[numbers]
        along, values, across = np.linalg.svd(rows[:, self._of(outer)])
        rank = int((values > FREE * max(1.0, float(values.max(initial=0.0)))).sum())
        if rank < len(rows):
            self.rest.append((numbers, along[:, rank:]))
        back = across[:rank].T @ (along[:, :rank].T / values[:rank, None])
        carried = -back @ rows[:, self._of(inner)] if inner >= 0 else np.zeros((self.size, 0))
        return _Branch(numbers, inner, outer, back, carried, across[rank:].T, self.count)

    def _of_loops(self, values: Floats) -> Floats:
        """What the loops have of values, or rows, of all joints."""
        return np.concatenate([values[self.loops], *(part.T @ values[numbers] for numbers, part in self.rest)])

    def of(self, rows: Floats) -> Floats:
        """Rows over the twists of all bodies as rows over the relative coordinates."""
        found = rows @ self.twists
        # A joint of the tree is moved by its own coordinates only: with nothing instead of rounding, parts come apart.
        found[np.abs(found) < ROUNDING * np.maximum(np.abs(found).max(axis=1, initial=0.0, keepdims=True), 1.0)] = 0.0
        return np.asarray(found)

    def step(self, residual: Floats, share: float) -> Floats:
        """Twists that take the residuals of the joints away, to first order; directions that close little are left out.

        Parameters
        ----------
        residual : ndarray
            Of every row.
        share : float
            Singular values of the loops' equations up to this are left out.
        """
        twists = np.zeros(len(self.twists))
        for branch in self.branches:
            found = -branch.back @ residual[branch.numbers]
            if branch.inner >= 0:
                found += branch.carried @ twists[self._of(branch.inner)]
            twists[self._of(branch.outer)] = found
        if not self.closing.size:
            return twists
        left, values, right = np.linalg.svd(self.closing, full_matrices=False)
        kept = values > share * max(1.0, float(values[0]))
        missing = self._of_loops(residual + self.rows @ twists)
        rates = right[kept].T @ ((left[:, kept].T @ missing) / values[kept])
        return np.asarray(twists - self.twists @ rates)

    def dependences(self, multipliers: Floats, further: Floats) -> Floats:
        """Left null vectors of all rows, by column, from those of the loops' equations with further rows below them.

        Parameters
        ----------
        multipliers : ndarray
            Left null vectors of the equations in relative coordinates.
        further : ndarray
            The further rows, over the twists of all bodies.
        """
        parts = np.split(multipliers, np.cumsum([len(self.loops), *(part.shape[1] for _, part in self.rest)]))
        found = np.zeros((len(self.rows), multipliers.shape[1]))
        found[self.loops] = parts[0]
        for (numbers, part), own in zip(self.rest, parts[1:-1], strict=True):
            found[numbers] += part @ own
        forces = self.rows.T @ found + further.T @ parts[-1]
        for branch in reversed(self.branches):
            own = -branch.back.T @ forces[self._of(branch.outer)]
            found[branch.numbers] += own
            if branch.inner >= 0:
                forces[self._of(branch.inner)] += self.rows[branch.numbers, self._of(branch.inner)].T @ own
        return np.vstack([found, parts[-1]])


def _spanning(
    ends: Sequence[tuple[int, int]], rows: Sequence[NDArray[np.intp]], bodies: int
) -> list[tuple[int, int, int]]:
    """Inner body, outer body and joint of the joints of a tree, outward from the ground; joint -1 where none holds."""
    at: dict[int, list[int]] = {}
    # What holds most is in the tree.
    for joint in sorted((joint for joint in range(len(ends)) if len(rows[joint])), key=lambda k: -len(rows[k])):
        for body in set(ends[joint]):
            at.setdefault(body, []).append(joint)
    found, reached = [], {-1}
    for start in (-1, *range(bodies)):
        if start >= 0 and start not in reached:
            reached.add(start)
            found.append((-1, start, -1))
        elif start >= 0:
            continue
        waiting = [start]
        for inner in waiting:
            for joint in at.get(inner, ()):
                one, other = ends[joint]
                outer = other if one == inner else one
                if outer not in reached:
                    reached.add(outer)
                    waiting.append(outer)
                    found.append((inner, outer, joint))
    return found


def rank(matrix: Floats, tolerance: float = 0.0) -> int:
    """Number of singular values that are not zero; with a tolerance, that are above it."""
    inside = matrix[:, np.any(matrix, axis=0)]
    return _rank(np.asarray(np.linalg.svd(inside, compute_uv=False)), tolerance) if inside.size else 0


def null(matrix: Floats, tolerance: float = 0.0) -> Floats:
    """Orthonormal null space, one column per dimension; unknowns that are in no row have one each."""
    used: NDArray[np.bool_] = np.asarray(np.any(matrix, axis=0))
    inside = matrix[:, used]
    if inside.size:
        _, values, directions = np.linalg.svd(inside)
        inside = directions[_rank(values, tolerance) :].T
    else:
        inside = np.zeros((0, 0))
    found = np.zeros((len(used), inside.shape[1] + int((~used).sum())))
    found[np.ix_(used, np.arange(inside.shape[1]))] = inside
    found[~used, inside.shape[1] :] = np.eye(int((~used).sum()))
    return found


def _rank(values: Floats, tolerance: float) -> int:
    sizes = values / max(float(values.max(initial=0.0)), 1.0)
    if tolerance:
        return int((sizes > tolerance).sum())
    firm = int((sizes > FIRM).sum())
    # The largest step from a value to the next smaller one ends the rank.
    doubtful = np.maximum([sizes[firm - 1] if firm else 1.0, *sizes[firm:], ZERO], ZERO)
    return firm + int(np.argmax(doubtful[:-1] / doubtful[1:]))
