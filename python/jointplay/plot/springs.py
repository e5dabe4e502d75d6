"""Springs as zigzags between their ends, torsion springs as spirals around their joints."""

from __future__ import annotations

from typing import Any

import numpy as np

#: width of a zigzag and radius of a spiral, as shares of the drawing's extent
WIDTH, RADIUS = 0.025, 0.03
#: bends of a zigzag, the part of it that is straight at each end, turns of a spiral
BENDS, STRAIGHT, TURNS = 10, 0.15, 2.5
STYLE: Any = {"linewidth": 1.0, "solid_joinstyle": "round"}

Points = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def zigzag(first: Points, second: Points, extent: float) -> Points:
    """The line of a spring from one place to another, in the plane or in space; shape (point, axis).

    Examples
    --------
    >>> line = zigzag(np.zeros(2), np.array([10.0, 0.0]), 10.0)
    >>> line[[0, -1]].tolist(), float(abs(line[:, 1]).max())
    ([[0.0, 0.0], [10.0, 0.0]], 0.125)
    """
    along = second - first
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return np.stack([first, second])
    # Across the line: in space across the ground axis that is least aligned with it as well.
    other = np.eye(len(along))[np.argmin(np.abs(along))]
    across = np.array([-along[1], along[0]]) if len(along) == 2 else np.cross(along, other)
    across = across / np.linalg.norm(across) * WIDTH * extent / 2.0
    parts = np.linspace(STRAIGHT, 1.0 - STRAIGHT, BENDS + 2)
    sides = np.array([0.0, *(1.0 if k % 2 else -1.0 for k in range(BENDS)), 0.0])
    bends = first + parts[:, None] * along + sides[:, None] * across
    return np.asarray(np.vstack([first, bends, second]))


def spiral(centre: Points, x: Points, y: Points, extent: float) -> Points:
    """The line of a torsion spring around a place, in the plane of two directions; shape (point, axis)."""
    angles = np.linspace(0.0, 2.0 * np.pi * TURNS, 80)
    radii = RADIUS * extent * (0.4 + 0.6 * angles / angles[-1])
    return np.asarray(centre + (radii * np.cos(angles))[:, None] * x + (radii * np.sin(angles))[:, None] * y)
