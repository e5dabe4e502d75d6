"""Surfaces of equal value through a grid, by marching tetrahedra; cells with a missing value are left out.

Every cell is cut into six tetrahedra along its diagonal from the first to the last corner, in the same way in all
cells, so that the pieces of neighbours fit.
"""

import itertools
from typing import Any

import numpy as np

from jointplay.basics.arrays import Floats

GridIndices = np.ndarray[Any, np.dtype[np.int64]]

#: corners of a cell as steps along the axes
CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
#: the tetrahedra: ways from the first corner to the last along one axis after the other
TETRAHEDRA = np.array(
    [np.concatenate([[0], np.cumsum([4 >> axis for axis in order])]) for order in itertools.permutations(range(3))]
)
#: corners above the level, as bits, to edges (pairs of corners) in triangles
_ALONE = {1: (0, (1, 2, 3)), 2: (1, (0, 2, 3)), 4: (2, (0, 1, 3)), 8: (3, (0, 1, 2))}
_PAIRS = {3: ((0, 1), (2, 3)), 5: ((0, 2), (1, 3)), 6: ((1, 2), (0, 3))}


def _triangles() -> dict[int, list[list[tuple[int, int]]]]:
    table = {}
    for bits, (one, others) in _ALONE.items():
        table[bits] = table[15 - bits] = [[(one, other) for other in others]]
    for bits, ((a, b), (c, d)) in _PAIRS.items():
        table[bits] = table[15 - bits] = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    return table


TRIANGLES = _triangles()


def isosurface(axes: tuple[Floats, ...], values: Floats, level: float) -> tuple[Floats, GridIndices]:
    """Points and triangles where the values pass through a level.

    Parameters
    ----------
    axes : tuple of ndarray
        Positions along each of the three axes.
    values : ndarray
        At the nodes; nan where there is none.
    level : float

    Returns
    -------
    points : ndarray
        Shape (3 n, 3).
    triangles : ndarray
        Shape (n, 3), numbers of points.
    """
    shape = tuple(n - 1 for n in values.shape)
    cells = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    corners = cells + CORNERS
    at = values[corners[..., 0], corners[..., 1], corners[..., 2]]
    crossed = np.isfinite(at).all(axis=1) & (at.min(axis=1) < level) & (at.max(axis=1) >= level)
    at = at[crossed][:, TETRAHEDRA].reshape(-1, 4)
    corners = corners[crossed][:, TETRAHEDRA].reshape(-1, 4, 3)
    places = np.stack([axis[corners[..., k]] for k, axis in enumerate(axes)], axis=-1)
    bits = ((at >= level) * np.array([1, 2, 4, 8])).sum(axis=1)
    found = []
    for case, triangles in TRIANGLES.items():
        own = bits == case
        found += [
            np.stack([_between(at[own], places[own], edge, level) for edge in edges], axis=1) for edges in triangles
        ]
    points = np.concatenate(found).reshape(-1, 3)
    return points, np.arange(len(points)).reshape(-1, 3)


def _between(at: Floats, places: Floats, edge: tuple[int, int], level: float) -> Floats:
    a, b = edge
    part = ((level - at[:, a]) / (at[:, b] - at[:, a]))[:, None]
    point: Floats = places[:, a] + part * (places[:, b] - places[:, a])
    return point
