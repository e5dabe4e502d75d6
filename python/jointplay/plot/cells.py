"""The cells of a grid: each node has one, which ends in the middle between it and the next."""

from __future__ import annotations

from typing import Any

import numpy as np

Floats = np.ndarray[Any, np.dtype[np.float64]]
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
