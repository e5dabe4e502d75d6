"""What a reader sees of a figure: what lies on one another, and what its edge cuts."""

from __future__ import annotations

from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of titles, legends and labels of axes that lie on one another or on the curves of other axes."""
    FigureCanvasAgg(figure).draw()
    boxes = []
    for k, axes in enumerate(figure.axes):
        if not axes.get_visible():
            continue
        parts: list[Any] = [axes.title, axes._left_title, axes.get_legend()]
        if axes.axison:
            parts += [axes.xaxis.label, axes.yaxis.label, axes.xaxis.get_offset_text(), axes.yaxis.get_offset_text()]
        named = [part for part in parts if part is not None and getattr(part, "get_text", lambda: "legend")()]
        boxes += [
            (f"{k} {type(part).__name__} {getattr(part, 'get_text', str)()}", part.get_window_extent())
            for part in named
        ]
        boxes.append((f"{k} axes", axes.get_window_extent()))
    # Half a point of rounding where boxes touch.
    room = figure.dpi / 72.0 / 2.0
    return [
        (one, other)
        for k, (one, a) in enumerate(boxes)
        for other, b in boxes[:k]
        if min(a.x1, b.x1) - max(a.x0, b.x0) > room and min(a.y1, b.y1) - max(a.y0, b.y0) > room
    ]


def outside(figure: Figure) -> list[str]:
    """Titles, labels of axes, legends and names that the edge of the figure cuts."""
    FigureCanvasAgg(figure).draw()
    room = figure.dpi / 72.0
    parts: list[Any] = []
    for axes in figure.axes:
        parts += [axes.title, axes._left_title, axes.get_legend(), *axes.texts]
        parts += [axes.xaxis.label, axes.yaxis.label] if axes.axison else []
    boxes = [part.get_window_extent() for part in parts if part is not None and getattr(part, "get_text", bool)() != ""]
    within = figure.bbox
    return [
        str(box)
        for box in boxes
        if box.x0 < -room or box.y0 < -room or box.x1 > within.width + room or box.y1 > within.height + room
    ]
