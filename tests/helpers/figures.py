"""What a reader sees of a figure: what lies on one another, and what its edge cuts."""

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
    """Titles, labels of axes, legends and names that the edge of the figure or of their axes cuts."""
    FigureCanvasAgg(figure).draw()
    room = figure.dpi / 72.0
    parts: list[Any] = []
    cut: list[str] = []
    for axes in figure.axes:
        frame = axes.get_window_extent()
        for text in axes.texts:
            box = text.get_window_extent()
            if text.get_clip_on() and frame.overlaps(box) and not _is_within(box, frame, room):
                cut.append(f"{text.get_text()} {box}")
        parts += [axes.title, axes._left_title, axes.get_legend(), *axes.texts]
        parts += [axes.xaxis.label, axes.yaxis.label] if axes.axison else []
    boxes = [part.get_window_extent() for part in parts if part is not None and getattr(part, "get_text", bool)() != ""]
    return cut + [str(box) for box in boxes if not _is_within(box, figure.bbox, room)]


def too_wide(figure: Figure) -> list[str]:
    """Legends above axes that are wider than these: in a layout they would take their room from what is drawn."""
    FigureCanvasAgg(figure).draw()
    return [
        f"{legend.get_texts()[0].get_text()} {box.width:.0f} > {axes.get_window_extent().width:.0f}"
        for axes in figure.axes
        if (legend := axes.get_legend()) is not None
        and (box := legend.get_window_extent()).x1 > axes.get_window_extent().x1 + figure.dpi / 72.0
    ]


def _is_within(box: Any, frame: Any, room: float) -> bool:
    return bool(
        box.x0 >= frame.x0 - room
        and box.y0 >= frame.y0 - room
        and box.x1 <= frame.x1 + room
        and box.y1 <= frame.y1 + room
    )
