"""Where the names of joints are written: beside their places, on the side where least is in the way.

Of the eight directions around a place, those that look away from the middle of the drawing come first. A direction
costs the area that it shares with other names, with places, and with the outside of the axes; the first of the cheapest
is taken, near its place if that is free and farther away if not.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.transforms import ScaledTranslation

from jointplay.basics.arrays import Floats

from .style import current, theme
from .words import HIGH, fitted, width_of

#: distances of a name from its place, half the size of a place, and what keeps names apart, points
AWAY, MARK, GAP = (6.0, 10.0, 16.0, 28.0), 4.0, 2.0
#: from the frame of the axes, points
LATER = 6.0
#: share of the axes that a name takes at most
WIDEST = 0.45

ACROSS = {-1: "right", 0: "center", 1: "left"}
UP = {-1: "top", 0: "center", 1: "bottom"}

#: a direction (-1, 0 or 1 to the right and upwards) and a distance
Corner = tuple[int, int, float]
NOTHING: Floats = np.zeros((0, 2))


def corners(
    places: Floats, texts: Sequence[str], frame: Floats, obstacles: Floats = NOTHING, letters: float = 8.0
) -> list[Corner]:
    """Where the name of each place is written: to the right (1) or left (-1), above (1) or below (-1), and how far.

    Parameters
    ----------
    places : ndarray
        In points, shape (name, 2).
    texts : sequence of str
    frame : ndarray
        Left, lower, right and upper end of the axes, in points.
    obstacles : ndarray
        Further places that should stay free, in points.
    letters : float
        Their size, points.

    Examples
    --------
    Two places above one another have their names on both sides of the line through them.

    >>> corners(np.array([[50.0, 50.0], [50.0, 45.0]]), ["A", "B"], np.array([0.0, 0.0, 100.0, 100.0]))
    [(1, 1, 6.0), (1, -1, 6.0)]
    """
    spots = np.vstack([places, obstacles])
    marks = np.column_stack([spots - MARK, spots + MARK])
    middle = places.mean(axis=0)
    taken = np.empty((len(texts), 4))
    chosen: list[Corner] = []
    for k, (place, text) in enumerate(zip(places, texts, strict=True)):
        x, y = (1 if away else -1 for away in place >= middle)
        ways = ((x, y), (x, -y), (-x, y), (-x, -y), (0, y), (0, -y), (x, 0), (-x, 0))
        tried = [(*way, away) for away in AWAY for way in ways]
        boxes = _boxes(place, np.array(tried), text, letters)
        others = np.concatenate([taken[:k], np.delete(marks, k, axis=0)])
        outside = _areas(boxes) - _shared(boxes, frame)
        best = int(np.round(outside + _shared(boxes[:, None], others).sum(axis=1), 6).argmin())
        chosen.append(tried[best])
        taken[k] = boxes[best]
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
    # What is written at the foot or head later takes room from the axes.
    frame = points * np.array([window.x0, window.y0, window.x1, window.y1]) + LATER * np.array([1, 1, -1, -1])
    box: dict[str, Any] = {"facecolor": theme().paper, "edgecolor": "none", "alpha": 0.6, "pad": 0.5}
    flat, obstacles = (points * axes.transData.transform(each) for each in (flat, obstacles))
    letters = current().font_size_used - 1.0
    texts = [fitted(text, WIDEST * (frame[2] - frame[0]), letters) for text in at.values()]
    found = corners(flat, texts, frame, obstacles, letters)
    for place, text, (x, y, away) in zip(at, texts, found, strict=True):
        moved = ScaledTranslation(away * x / 72.0, away * y / 72.0, figure.dpi_scale_trans)
        axes.text(
            *place, text, fontsize=letters, zorder=6, bbox=box, transform=axes.transData + moved,
            ha=ACROSS[x], va=UP[y],
        )  # fmt: skip


def _boxes(place: Floats, corners: Floats, text: str, letters: float) -> Floats:
    """Left, lower, right and upper ends of a name at some corners."""
    size = np.array([width_of(text, letters) + GAP, HIGH * letters])
    middle = place + corners[:, 2:] * corners[:, :2] + 0.5 * size * corners[:, :2]
    return np.column_stack([middle - 0.5 * size, middle + 0.5 * size])


def _areas(boxes: Floats) -> Floats:
    areas: Floats = np.maximum(boxes[..., 2:] - boxes[..., :2], 0.0).prod(axis=-1)
    return areas


def _shared(boxes: Floats, others: Floats) -> Floats:
    low, high = np.maximum(boxes[..., :2], others[..., :2]), np.minimum(boxes[..., 2:], others[..., 2:])
    return _areas(np.concatenate([low, high], axis=-1))
