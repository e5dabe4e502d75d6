"""Springs as zigzags between their ends, as rings where both ends are at one place; torsion springs as spirals."""

from typing import Any

import numpy as np

from jointplay.basics.arrays import Floats

#: width of a zigzag and radius of a spiral, as shares of the drawing's extent
WIDTH, RADIUS = 0.025, 0.03
#: bends of a zigzag, the part of it that is straight at each end, turns of a spiral
BENDS, STRAIGHT, TURNS = 10, 0.15, 2.5
#: points of a zigzag, and of the ring in its place
POINTS = BENDS + 4
#: a spring that is shorter than this share of the drawing's extent has no direction that could be seen
SHORTEST = 1e-9
STYLE: Any = {"linewidth": 1.0, "solid_joinstyle": "round"}


def zigzag(first: Floats, second: Floats, extent: float) -> Floats:
    """The line of a spring from one place to another, in the plane or in space; shape (point, axis).

    It has the same number of points in every configuration. A spring without length is a ring, as wide as a zigzag.

    Examples
    --------
    >>> line = zigzag(np.zeros(2), np.array([10.0, 0.0]), 10.0)
    >>> line[[0, -1]].tolist(), float(abs(line[:, 1]).max())
    ([[0.0, 0.0], [10.0, 0.0]], 0.125)
    >>> ring = zigzag(np.zeros(3), np.zeros(3), 10.0)
    >>> len(ring) == len(line), np.linalg.norm(ring, axis=1).round(3).max().item()
    (True, 0.125)
    """
    along = second - first
    if float(np.abs(along).max()) <= SHORTEST * extent:
        return _ring(first, extent)
    # Across the line: in space across the ground axis that is least aligned with it as well.
    other = np.eye(len(along))[np.argmin(np.abs(along))]
    across = np.array([-along[1], along[0]]) if len(along) == 2 else np.cross(along, other)
    across = across / np.linalg.norm(across) * WIDTH * extent / 2.0
    parts = np.linspace(STRAIGHT, 1.0 - STRAIGHT, BENDS + 2)
    sides = np.array([0.0, *(1.0 if k % 2 else -1.0 for k in range(BENDS)), 0.0])
    bends = first + parts[:, None] * along + sides[:, None] * across
    return np.asarray(np.vstack([first, bends, second]))


def _ring(centre: Floats, extent: float) -> Floats:
    """A circle around a place; in space oblique to all axes, so that no view has it as a line."""
    turns = np.linspace(0.0, 2.0 * np.pi, POINTS)[:, None]
    x, y = np.eye(2) if len(centre) == 2 else np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
    return np.asarray(centre + WIDTH * extent / 2.0 * (np.cos(turns) * x + np.sin(turns) * y))


def spiral(centre: Floats, x: Floats, y: Floats, extent: float) -> Floats:
    """The line of a torsion spring around a place, in the plane of two directions; shape (point, axis)."""
    angles = np.linspace(0.0, 2.0 * np.pi * TURNS, 80)
    radii = RADIUS * extent * (0.4 + 0.6 * angles / angles[-1])
    return np.asarray(centre + (radii * np.cos(angles))[:, None] * x + (radii * np.sin(angles))[:, None] * y)
