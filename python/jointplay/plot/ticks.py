"""Axes of figures that nobody changes any more: ticks are drawn at once, where matplotlib has five objects for each.

These objects, and to measure each of them again and again, are half of what a small figure costs.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.ticker import NullLocator
from matplotlib.transforms import Bbox, IdentityTransform

from jointplay.basics.arrays import Floats

from .measure import extent_of

#: versions of matplotlib whose insides are known; pages made with another take twice as long
KNOWN = ("3.11.",)
#: part of an axis by which a tick may be beyond its end: rounding
BEYOND = 1e-10

#: the settings in force, by names that are put together here
RC: Any = mpl.rcParams

_ONCE: ContextVar[bool] = ContextVar("once", default=False)


@contextmanager
def once() -> Iterator[None]:
    """Draw figures that are written at once, and that nobody changes."""
    token = _ONCE.set(True)
    try:
        yield
    finally:
        _ONCE.reset(token)


def subplot(figure: Figure, *place: Any) -> Axes:
    """Axes of a figure, of the sort that costs least."""
    if _ONCE.get() and mpl.__version__.startswith(KNOWN):
        return figure.add_subplot(*place, axes_class=OnceAxes)
    return figure.add_subplot(*place)


class _Ticks:
    """The ticks of an axis that are in view, large or small ones, with their numbers, in dots."""

    def __init__(self, axis: Any, kind: str, look: dict[str, Any], locator: Any, formatter: Any) -> None:
        self._axis, self._look, self._is_x = axis, look, axis.axis_name == "x"
        self._name = f"{axis.axis_name}tick"
        self._rc = {key: RC[f"{self._name}.{kind}.{key}"] for key in ("size", "width", "pad")}
        places = np.asarray(locator(), dtype=float)
        words = formatter.format_ticks(places)
        low, high = np.sort(self._dots(np.asarray(axis.get_view_interval(), dtype=float))).tolist()
        dots = self._dots(places)
        slack = BEYOND * (high - low)
        there = (low - slack <= dots) & (dots <= high + slack)
        self.places = dots[there]
        self.words = [word for word, seen in zip(words, there.tolist(), strict=True) if seen]
        self.every_word = words

    def _dots(self, places: Floats) -> Floats:
        """Places of the axis, in dots."""
        nothing = np.zeros_like(places)
        pairs = np.column_stack([places, nothing] if self._is_x else [nothing, places])
        axes = self._axis.axes
        transform = axes.get_xaxis_transform("grid") if self._is_x else axes.get_yaxis_transform("grid")
        return np.asarray(transform.transform(pairs)[:, 0 if self._is_x else 1])

    def _font(self) -> FontProperties:
        return FontProperties(size=RC[f"{self._name}.labelsize"])

    def boxes(self, renderer: Any) -> list[Bbox]:
        """Where the numbers are."""
        return [
            Bbox.from_extents(x, y - low, x + wide, y + high) for _, x, y, wide, high, low in self._written(renderer)
        ]

    def _written(self, renderer: Any) -> Iterator[tuple[str, float, float, float, float, float]]:
        """Every number with the left end of its line, its width, and its height above and below the line."""
        box = self._axis.axes.bbox
        outside = {"out": 1.0, "inout": 0.5, "in": 0.0}[RC[f"{self._name}.direction"]]
        away = renderer.points_to_pixels(self._rc["pad"] + outside * self._rc["size"])
        scale = renderer.points_to_pixels(1.0)
        for place, word in zip(self.places.tolist(), self.words, strict=True):
            if word:
                wide, high, low = (scale * part for part in self._extent(word))
                if self._is_x:
                    yield word, place - wide / 2.0, box.y0 - away - high, wide, high, low
                else:
                    yield word, box.x0 - away - wide, place - high / 2.0, wide, high, low

    def _extent(self, word: str) -> tuple[float, float, float]:
        """Width of a number, and its height above and below the line, points; each is as high as any."""
        size = self._font().get_size_in_points()
        (wide, high, low), (_, usual, below) = extent_of(word, size), extent_of("lp", size)
        return wide, max(high - low, usual - below), max(low, below)

    def draw(self, renderer: Any) -> None:
        """Draw the grid, the ticks and their numbers."""
        box = self._axis.axes.bbox
        begin, end = (box.y0, box.y1) if self._is_x else (box.x0, box.x1)
        if self._look.get("gridOn"):
            self._lines(renderer, begin, end, RC["grid.color"], RC["grid.linewidth"], RC["grid.alpha"])
        size = renderer.points_to_pixels(self._rc["size"])
        inner, outer = {"out": (0.0, size), "in": (size, 0.0), "inout": (size / 2.0, size / 2.0)}[
            RC[f"{self._name}.direction"]
        ]
        self._lines(renderer, begin - outer, begin + inner, RC[f"{self._name}.color"], self._rc["width"], 1.0)
        gc = renderer.new_gc()
        colour = RC[f"{self._name}.labelcolor"]
        gc.set_foreground(to_rgba(RC[f"{self._name}.color"] if colour == "inherit" else colour), isRGBA=True)
        font = self._font()
        height = self._axis.axes.figure.bbox.height
        for word, x, y, *_ in self._written(renderer):
            renderer.draw_text(gc, x, height - y if renderer.flipy() else y, word, font, 0.0, ismath=False)
        gc.restore()

    def _lines(self, renderer: Any, begin: float, end: float, colour: Any, width: float, alpha: float) -> None:
        """A line across the axis at every tick."""
        if not len(self.places) or begin == end:
            return
        across = np.tile([begin, end], len(self.places))
        along = np.repeat(self.places, 2)
        points = np.column_stack([along, across] if self._is_x else [across, along])
        gc = renderer.new_gc()
        gc.set_foreground(to_rgba(colour, alpha), isRGBA=True)
        gc.set_linewidth(renderer.points_to_pixels(width))
        gc.set_snap(True)
        renderer.draw_path(gc, Path(points, np.tile([Path.MOVETO, Path.LINETO], len(self.places))), IdentityTransform())
        gc.restore()


class Once:
    """An axis that has no objects for its ticks."""

    # Those of matplotlib.
    axes: Any
    axis_name: Any
    major: Any
    minor: Any
    get_view_interval: Any
    get_major_locator: Any
    get_majorticklocs: Any
    get_minorticklocs: Any
    _major_tick_kw: Any
    _minor_tick_kw: Any
    majorTicks: Any = ()
    minorTicks: Any = ()

    #: the ticks, and what they are of: the ends of the axis, its place and its numbers
    _of: tuple[Any, ...] = ()
    _found: list[_Ticks] = []  # noqa: RUF012

    def _update_ticks(self) -> list[_Ticks]:
        of = (*self.get_view_interval(), *self.axes.bbox.bounds, self.get_major_locator(), self.major.formatter)
        if of != self._of:
            for spine in self.axes.spines.values():
                # Lines along the axes get their place by the first one who asks for it.
                spine.get_spine_transform()
            self._of, self._found = of, [*self._made()]
        return self._found

    def _made(self) -> Iterator[_Ticks]:
        """Large and small ticks, where there are any."""
        for kind, look, part, places in (
            ("major", self._major_tick_kw, self.major, self.get_majorticklocs),
            ("minor", self._minor_tick_kw, self.minor, self.get_minorticklocs),
        ):
            if not isinstance(part.locator, NullLocator):
                yield _Ticks(self, kind, look, places, part.formatter)

    @property
    def words(self) -> list[str]:
        """What the large ticks said when they were measured, those beyond the ends as well."""
        return self._found[0].every_word if self._found else []

    def _get_ticklabel_bboxes(self, ticks: list[_Ticks], renderer: Any) -> tuple[list[Bbox], list[Bbox]]:
        return [box for one in ticks for box in one.boxes(renderer)], []

    def get_major_ticks(self, numticks: int | None = None) -> list[Any]:  # noqa: ARG002
        """None; as `matplotlib.axis.Axis.get_major_ticks`."""
        return []

    def get_minor_ticks(self, numticks: int | None = None) -> list[Any]:  # noqa: ARG002
        """None; as `matplotlib.axis.Axis.get_minor_ticks`."""
        return []

    def get_ticks_position(self) -> Any:
        """Below, and to the left; as `matplotlib.axis.XAxis.get_ticks_position`."""
        return "bottom" if self.axis_name == "x" else "left"


class _OnceX(Once, XAxis):
    pass


class _OnceY(Once, YAxis):
    pass


class OnceAxes(Axes):
    """Axes whose ticks cannot be changed one by one."""

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = _OnceX(self, clear=False), _OnceY(self, clear=False)
        self.spines.bottom.register_axis(self.xaxis)
        self.spines.top.register_axis(self.xaxis)
        self.spines.left.register_axis(self.yaxis)
        self.spines.right.register_axis(self.yaxis)
