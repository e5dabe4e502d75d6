"""Where the ways from nodes inside a region to nodes outside leave it, all of them at once.

Each way is halved until its ends are closer than the tolerance. Where both ends have a distance to the nearest end of a
range, its root on the straight line is tried instead, and where a mechanism did not follow, the place up to which it
did: each moved by somewhat less than half the tolerance towards the farther end of the way, so that the bracket shrinks
from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats, Ints, Texts

from .holding import OneOrientation

#: after so many tries by roots a way is halved
ROOTS = 6
#: of the tolerance, by how much a try is off the root
NEARER = 0.45
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
    end = np.full(len(first), np.nan)
    for number in range(MOST):
        k = np.flatnonzero((high - low) * ways.length > tolerance)
        if not k.size:
            break
        step = NEARER * tolerance / ways.length[k]
        to = 0.5 * (low[k] + high[k])
        for known in (_root(low[k], high[k], room[:, k]), end[k]) if number < ROOTS else ():
            to = _towards(known, low[k], high[k], step, to)
        from_, target = (first[k] + part[:, None] * (last[k] - first[k]) for part in (low[k], to))
        held, there = of.on_the_way(from_, poses[k], target)
        ok = held.inside
        low[k[ok]], poses[k[ok]], room[0, k[ok]] = to[ok], there[ok], held.room[ok]
        assert held.ends is not None
        part = held.ends[~ok] * (to[~ok] - low[k[~ok]])
        end[k[~ok]] = np.where(np.isnan(part), end[k[~ok]], low[k[~ok]] + part)
        high[k[~ok]], why[k[~ok]], room[1, k[~ok]] = to[~ok], held.why[~ok], held.room[~ok]
    return low, why


def _root(low: Floats, high: Floats, room: Floats) -> Floats:
    """Where the distance to the nearest end of a range vanishes on a straight line; nan where it need not."""
    with np.errstate(invalid="ignore", divide="ignore"):
        root = low + (high - low) * room[0] / (room[0] - room[1])
    return np.where((room[0] > 0.0) & (room[1] < 0.0), root, np.nan)


def _towards(place: Floats, low: Floats, high: Floats, step: Floats, else_: Floats) -> Floats:
    """A place, moved by a step to the farther end; another one where it is not between the ends."""
    moved = place + np.where(place > 0.5 * (low + high), -step, step)
    return np.where((moved > low) & (moved < high), moved, else_)
