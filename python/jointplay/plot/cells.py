"""The cells of a grid: each node has one, which ends in the middle between it and the next."""

from typing import Any

import numpy as np

from jointplay.basics.arrays import Floats

Line = list[tuple[float, float]]


def cell_edges(nodes: Floats) -> Floats:
    """Where the cells around the nodes begin and end.

    Examples
    --------
    >>> cell_edges(np.array([0.0, 1.0, 3.0]))
    array([-0.5,  0.5,  2. ,  4. ])
    """
    middles = (nodes[:-1] + nodes[1:]) / 2.0
    return np.concatenate([[2.0 * nodes[0] - middles[0]], middles, [2.0 * nodes[-1] - middles[-1]]])


def boundaries(x: Floats, y: Floats, changes: np.ndarray[Any, np.dtype[np.bool_]]) -> list[Line]:
    """The sides of the cells between nodes whose contacts differ."""
    (xs, ys), lines = (cell_edges(x), cell_edges(y)), []
    for i, j in np.argwhere(changes[..., 0]).tolist():
        lines.append([(xs[i + 1], ys[j]), (xs[i + 1], ys[j + 1])])
    for i, j in np.argwhere(changes[..., 1]).tolist():
        lines.append([(xs[i], ys[j + 1]), (xs[i + 1], ys[j + 1])])
    return lines


def crossings(x: Floats, y: Floats, parts: Floats) -> list[Line]:
    """Lines through the places between nodes where something crosses the sides of the grid.

    Parameters
    ----------
    parts : ndarray
        Part of the way to the next node along each axis, shape (x, y, axis); nan where nothing is crossed.

    Examples
    --------
    >>> nodes, parts = np.arange(2.0), np.full((2, 2, 2), np.nan)
    >>> parts[0, :, 0] = 0.25, 0.75
    >>> crossings(nodes, nodes, parts)
    [[(0.25, 0.0), (0.75, 1.0)]]
    """
    lines: list[Line] = []
    known = np.isfinite(parts)
    some = known[:-1, :-1, 0] | known[:-1, 1:, 0] | known[:-1, :-1, 1] | known[1:, :-1, 1]
    for i, j in np.argwhere(some).tolist():
        wide, high = x[i + 1] - x[i], y[j + 1] - y[j]
        # Once around the square between four nodes.
        around = [
            (x[i] + parts[i, j, 0] * wide, y[j]),
            (x[i + 1], y[j] + parts[i + 1, j, 1] * high),
            (x[i] + parts[i, j + 1, 0] * wide, y[j + 1]),
            (x[i], y[j] + parts[i, j, 1] * high),
        ]
        there = [(float(a), float(b)) for a, b in around if np.isfinite(a) and np.isfinite(b)]
        # One alone is where the line ends; of four, neighbours belong together.
        lines += [there[k : k + 2] for k in ((0, 2) if len(there) == 4 else range(len(there) - 1))]
    return lines
