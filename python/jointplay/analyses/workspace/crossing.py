"""Where the ways from nodes inside a region to nodes outside leave it, all of them at once.

Each way is halved until its ends are closer than the tolerance; where both ends have a distance to the nearest end of a
range, its root on the straight line is tried instead, moved by half the tolerance towards the farther end of the way,
so that the bracket shrinks from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats, Ints, Texts

from .holding import OneOrientation

#: after so many tries by roots a way is halved
ROOTS = 4
#: halvings at most
MOST = 60


@dataclass(frozen=True)
class Ways:
    """Straight ways between nodes, the first of which is inside.

    Attributes
    ----------
    inner, outer : ndarray
        Places of the nodes in the grid.
    length : ndarray
        In the unit of the tolerance.
    why : ndarray
        What keeps the mechanism from the outer node.
    """

    inner: Ints
    outer: Ints
    length: Floats
    why: Texts


def leave(of: OneOrientation, ways: Ways, rooms: Floats, tolerance: float) -> tuple[Floats, Texts]:
    """The part of every way that is inside, less than the tolerance too short; and what ends it.

    Parameters
    ----------
    of : OneOrientation
        Its nodes are solved.
    ways : Ways
    rooms : ndarray
        Distances to ends of ranges at all nodes, as `HeldPlaces` has them.
    tolerance : float
        In the unit of the lengths.
    """
    first, last = of.rows[ways.inner], of.rows[ways.outer]
    poses, why = of.poses[ways.inner].copy(), ways.why.copy()
    low, high = np.zeros(len(first)), np.ones(len(first))
    room = rooms[np.stack([ways.inner, ways.outer])]
    for number in range(MOST):
        k = np.flatnonzero((high - low) * ways.length > tolerance)
        if not k.size:
            break
        to = _tried(low[k], high[k], room[:, k], 0.5 * tolerance / ways.length[k], by_roots=number < ROOTS)
        from_, target = (first[k] + part[:, None] * (last[k] - first[k]) for part in (low[k], to))
        held, there = of.on_the_way(from_, poses[k], target)
        ok = held.inside
        low[k[ok]], poses[k[ok]], room[0, k[ok]] = to[ok], there[ok], held.room[ok]
        high[k[~ok]], why[k[~ok]], room[1, k[~ok]] = to[~ok], held.why[~ok], held.room[~ok]
    return low, why


def _tried(low: Floats, high: Floats, room: Floats, step: Floats, *, by_roots: bool) -> Floats:
    """Where on the ways is looked next."""
    middle = 0.5 * (low + high)
    if not by_roots:
        return middle
    with np.errstate(invalid="ignore", divide="ignore"):
        root = low + (high - low) * room[0] / (room[0] - room[1])
        moved = root + np.where(root > middle, -step, step)
    is_known = (room[0] > 0.0) & (room[1] < 0.0) & (moved > low) & (moved < high)
    return np.where(is_known, moved, middle)
