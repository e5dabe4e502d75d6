"""Corners of a region in the plane, which the lines between points of its boundary cut off.

Where two neighbours on the boundary are bounded by different things, the boundary goes on along the lines through each
of them and others of the same bound, up to where these lines meet; as far as the way from the node inside to that
place is inside, which is found as on edges of the grid (`crossing`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats, Ints, Texts

#: a line goes through points that are so far apart at least, and a corner is at most so far from them, in spacings
APART, FAR = 0.5, 3.0
#: points that are looked at for one that is far enough, and the least sine of the angle between two lines
MOST, LEAST = 4, 1e-2


@dataclass(frozen=True)
class Cuts:
    """Segments of a boundary that cut corners off, and where the corners ought to be."""

    #: numbers of the segments
    facet: Ints
    #: places, shape (segment, axis)
    to: Floats


def cuts(points: Floats, bound: Texts, facets: Ints) -> Cuts:
    """Where the lines on both sides of a segment meet outside of it, or at its end.

    Parameters
    ----------
    points, bound, facets : ndarray
        The boundary, its segments counterclockwise; coordinates in spacings.
    """
    before, after = dict(facets[:, ::-1].tolist()), dict(facets.tolist())
    found: list[int] = []
    places: list[Floats] = []
    for k in np.flatnonzero(bound[facets[:, 0]] != bound[facets[:, 1]]).tolist():
        a, b = facets[k].tolist()
        u = _way_to(points, bound, a, before, APART)
        v = _way_to(points, bound, b, after, APART)
        if u is None or v is None or abs(across := _cross(u, v)) < LEAST:
            continue
        gap = points[b] - points[a]
        s, t = _cross(gap, v) / across, _cross(gap, u) / across
        if all(-APART < far < FAR for far in (s, t)) and s + t > 0.0:
            found.append(k)
            places.append(points[a] + s * u)
    return Cuts(np.array(found, dtype=np.int64), np.array(places).reshape(-1, 2))


def _way_to(points: Floats, bound: Texts, a: int, following: Mapping[int, int], apart: float) -> Floats | None:
    """The direction in which a boundary comes to a point, from the next point of the same bound that is far enough."""
    p = a
    for _ in range(MOST):
        p = following[p]
        if bound[p] != bound[a]:
            break
        way = points[a] - points[p]
        if (length := float(np.linalg.norm(way))) >= apart:
            return np.asarray(way / length)
    return None


def outside(points: Floats, facet: Ints, place: Floats) -> float:
    """How far a place is on the outer side of a segment."""
    side = points[facet[1]] - points[facet[0]]
    return -_cross(side, place - points[facet[0]]) / max(float(np.linalg.norm(side)), 1e-300)


def _cross(a: Floats, b: Floats) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
