"""Where the ways from nodes inside a region to places outside leave it, all of them at once.

Each way is halved until its ends are closer than the tolerance. Where both ends have a distance to the nearest end of a
range, its root on the straight line is tried instead, and where a mechanism did not follow, the place up to which it
did: each moved by somewhat less than half the tolerance towards the farther end of the way, so that the bracket shrinks
from both sides.
"""

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
    """Straight ways from nodes that are inside to places that are not."""

    #: places of the nodes in the grid
    inner: Ints
    #: commands at the ends
    last: Floats
    #: in the unit of the tolerance
    length: Floats
    #: what keeps the mechanism from the ends; empty where that is not known
    why: Texts
    #: distances of the nodes and of the ends to ends of ranges, as `HeldPlaces` has them, shape (2, way)
    room: Floats


def leave(of: OneOrientation, ways: Ways, tolerance: float) -> tuple[Floats, Texts]:
    """The part of every way that is inside, less than the tolerance too short; and what ends it.

    Parameters
    ----------
    of : OneOrientation
        Its nodes are solved.
    tolerance : float
        In the unit of the lengths.
    """
    first, last = of.rows[ways.inner], ways.last
    poses, why = of.poses[ways.inner].copy(), ways.why.copy()
    low, high = np.zeros(len(first)), np.ones(len(first))
    room = ways.room.copy()
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
