"""Where the names of joints are written: beside their places, on the side where least is in the way.

Of the four corners around a place, the one that looks away from the middle of the drawing comes first. A corner costs
the area that it shares with other names, with places, and with the outside of the axes; the first of the cheapest is
taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.transforms import ScaledTranslation

#: distance of a name from its place, size of its letters, half the size of a place, points
AWAY, LETTERS, MARK = 6.0, 8.0, 4.0
#: width of a letter on average, and height of a line, as shares of the size
WIDE, HIGH = 0.62, 1.2

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Corner = tuple[int, int]
NOTHING: Floats = np.zeros((0, 2))


def corners(places: Floats, texts: Sequence[str], frame: Floats, obstacles: Floats = NOTHING) -> list[Corner]:
    """The corner of each place where its name is written, to the right (1) or left (-1), above (1) or below (-1).

    Parameters
    ----------
    places : ndarray
        In points, shape (name, 2).
    texts : sequence of str
    frame : ndarray
        Left, lower, right and upper end of the axes, in points.
    obstacles : ndarray
        Further places that should stay free, in points.

    Examples
    --------
    Two places above one another have their names on both sides of the line through them.

    >>> corners(np.array([[50.0, 50.0], [50.0, 45.0]]), ["A", "B"], np.array([0.0, 0.0, 100.0, 100.0]))
    [(1, 1), (1, -1)]
    """
    marks = [np.concatenate([place - MARK, place + MARK]) for place in (*places, *obstacles)]
    middle = places.mean(axis=0)
    taken: list[Floats] = []
    chosen: list[Corner] = []
    for k, (place, text) in enumerate(zip(places, texts, strict=True)):
        x, y = (1 if away else -1 for away in place >= middle)
        others = [mark for j, mark in enumerate(marks) if j != k]

        def cost(corner: Corner, place: Floats = place, text: str = text, others: list[Floats] = others) -> float:
            box = _box(place, corner, text)
            outside = _area(box) - _shared(box, frame)
            return round(outside + sum(_shared(box, other) for other in (*taken, *others)), 6)

        best = min(((x, y), (x, -y), (-x, y), (-x, -y)), key=cost)
        chosen.append(best)
        taken.append(_box(place, best, text))
    return chosen


def write(axes: Any, at: Mapping[tuple[float, ...], str], flat: Floats, obstacles: Floats = NOTHING) -> None:
    """Write names beside their places.

    Parameters
    ----------
    axes : matplotlib axes
        With its limits; in the plane or in space.
    at : mapping
        Names by place, data coordinates.
    flat : ndarray
        The places as seen on the axes, data coordinates, shape (name, 2).
    obstacles : ndarray
        Further places that should stay free, the same way.
    """
    figure = axes.get_figure()
    if not at or figure is None:
        return
    points = 72.0 / figure.dpi
    window = axes.get_window_extent()
    frame = points * np.array([window.x0, window.y0, window.x1, window.y1])
    box: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.6, "pad": 0.5}
    flat, obstacles = (points * axes.transData.transform(each) for each in (flat, obstacles))
    found = corners(flat, list(at.values()), frame, obstacles)
    for (place, text), (x, y) in zip(at.items(), found, strict=True):
        moved = ScaledTranslation(AWAY * x / 72.0, AWAY * y / 72.0, figure.dpi_scale_trans)
        axes.text(
            *place, text, fontsize=LETTERS, zorder=6, bbox=box, transform=axes.transData + moved,
            ha="left" if x > 0 else "right", va="bottom" if y > 0 else "top",
        )  # fmt: skip


def _box(place: Floats, corner: Corner, text: str) -> Floats:
    size = np.array([WIDE * LETTERS * len(text), HIGH * LETTERS])
    near = place + AWAY * np.array(corner)
    far = near + size * corner
    return np.concatenate([np.minimum(near, far), np.maximum(near, far)])


def _area(box: Floats) -> float:
    return float(np.prod(np.maximum(box[2:] - box[:2], 0.0)))


def _shared(one: Floats, other: Floats) -> float:
    return _area(np.concatenate([np.maximum(one[:2], other[:2]), np.minimum(one[2:], other[2:])]))
