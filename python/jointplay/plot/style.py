"""How drawings look: the style, and what all of them have in common."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from threading import RLock
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import is_color_like, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import Formatter, LogFormatter, ScalarFormatter
from matplotlib.transforms import Bbox

from jointplay.errors import InputError, in_range, not_known, one_line, shown

#: Okabe and Ito, ordered so that neighbours differ in lightness as well
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442", "#000000")
#: the same hues, light enough for a dark ground
LIGHTER = ("#4BA3DB", "#F0B23A", "#2FC39B", "#F0803C", "#9AD4F7", "#E3A3C6", "#F5EC7A", "#F2F2F2")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES = ("-", "--", "-.", ":", "-", "--", "-.", ":")
#: of lines: dots and rings are a hundred times as much in a file of vectors
HATCHES = ("", "///", "|||", "\\\\\\", "xxx", "---", "++", "//")
#: millimetres per inch, and per unit in which a size can be given
INCH = 25.4
UNITS = {"mm": 1.0, "cm": 10.0, "in": INCH, "pt": INCH / 72.0}
SIZE = re.compile(r"\s*(?P<width>[\d.]+)\s*(?:x\s*(?P<height>[\d.]+)\s*)?(?P<unit>[a-z]*)\s*")
#: shortest and longest side of a figure (mm), most dots per inch, and sizes of letters (points)
SIDES, DPI, LETTERS = (20.0, 2000.0), (30, 2400), (3.0, 72.0)
#: figures narrower than this (mm) are one column of a page
NARROW = 120.0
#: size of letters (points) in figures narrower than so many mm, and in others
SMALLER, USUAL = ((NARROW, 7.0), (200.0, 8.0)), 9.0
#: even steps of lightness: it survives colour blindness and a black-and-white printer
COLOUR_MAP = "cividis"
#: where a legend can stand
LEGENDS = ("above", "none", *Legend.codes)
#: levels of a scale of colours, at most
MOST_LEVELS = 100
#: what configurations can be drawn against besides a drive
AGAINST = ("configuration", "length", "time")
#: axes whose largest number is from the first of these to below the second have no powers of ten
WRITTEN_OUT = (1e-4, 1e6)
MOST_DECIMALS = 10
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: dots of a figure along a side beyond which it would not fit into memory
MOST_DOTS = 30_000


class Theme(NamedTuple):
    """The colours of a style, and how axes look."""

    paper: str
    ink: str
    grey: str
    faint: str
    #: what stays open, what is missed
    alarm: str
    #: nodes of a map without a trusted number
    unreached: str
    colours: tuple[str, ...]
    #: axes have a frame and ticks inside it in place of a grid
    framed: bool = False


THEMES = {
    "light": Theme("#ffffff", "#000000", "#6b6b6b", "#dddddd", "#d00000", "#d9d9d9", COLOURS),
    "dark": Theme("#14171c", "#e8e8e8", "#9aa0a8", "#343a42", "#ff5c5c", "#3c424b", LIGHTER),
    "print": Theme("#ffffff", "#000000", "#6b6b6b", "#dddddd", "#d00000", "#d9d9d9", COLOURS, framed=True),
}


@dataclass(frozen=True)
class Style:
    """How a drawing looks.

    Parameters
    ----------
    theme : {"light", "dark", "print"}
        ``"print"`` has frames with ticks inside in place of grids, as in journals.
    width, height : float, optional
        Of the figure, millimetres. What is left out follows from what is drawn.
    dpi : int
        Dots per inch, of `.png` and of the shaded surfaces in `.svg` and `.pdf`.
    font_size : float, optional
        Points; 9 if left out, 8 in figures that are narrower than 200 mm, 7 in those narrower than 120 mm.
    colours : tuple of str
        Of bodies and series, in turn; if left out, those of Okabe and Ito, which colour-blind readers can distinguish.
    font : str, optional
        Name of the letters, such as ``"Times New Roman"``.
    title : bool
        Whether a figure has titles.
    legend : str
        Where legends stand: ``"above"`` the axes, a place in them such as ``"upper right"`` or ``"best"`` (as
        matplotlib names it), or ``"none"``.
    against : str, optional
        What configurations are drawn against: a drive, ``"configuration"`` (their number), ``"length"`` (of the
        output's nominal path) or ``"time"`` (of a machine that runs). The only drive, or else the number if left out.
    colour_map : str
        Of maps and surfaces; a name of matplotlib.
    scale : tuple of float, optional
        Where the colours of maps begin and end, in the unit of what is drawn.
    log : bool
        Whether the colours of maps have a logarithmic scale.
    levels : int or tuple of float, optional
        Maps have colours in steps with labelled lines between: how many about, or at which values.

    Raises
    ------
    InputError
        When one of them is not valid.

    Examples
    --------
    >>> Style("print", width=85, height=60).font_size_used
    7.0
    """

    theme: str = "light"
    width: float | None = None
    height: float | None = None
    dpi: int = 160
    font_size: float | None = None
    colours: tuple[str, ...] = ()
    font: str = ""
    title: bool = True
    legend: str = "above"
    against: str = ""
    colour_map: str = COLOUR_MAP
    scale: tuple[float, float] | None = None
    log: bool = False
    levels: int | tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.theme not in THEMES:
            raise InputError(not_known(str(self.theme), "a style", THEMES), key="style")
        in_range(self.dpi, "dpi", "a number of dots per inch", *DPI)
        for name, value, (low, high), unit in (
            ("width", self.width, SIDES, "mm"),
            ("height", self.height, SIDES, "mm"),
            ("font_size", self.font_size, LETTERS, "points"),
        ):
            if value is not None and not low <= value <= high:
                raise InputError(f"{shown(value)} is not a number of {unit} from {low:g} to {high:g}", key=name)
            if value is not None and unit == "mm" and value / INCH * self.dpi > MOST_DOTS:
                problem = f"{value:g} mm at {self.dpi} dots per inch are more than {MOST_DOTS} dots"
                raise InputError(problem, key=name)
        for colour in self.colours:
            if not is_color_like(colour):
                raise InputError(f"{shown(colour)} is not a colour such as '#0072B2'", key="colours")
        if self.legend not in LEGENDS:
            raise InputError(not_known(self.legend, "a place of a legend", LEGENDS), key="legend")
        self._check_font()
        self._check_map()

    def _check_font(self) -> None:
        if self.font:
            try:
                findfont(FontProperties(family=self.font), fallback_to_default=False)
            except ValueError:
                raise InputError(f"{shown(self.font)} is not a font of this machine", key="font") from None

    def _check_map(self) -> None:
        if self.colour_map not in mpl.colormaps:
            raise InputError(not_known(self.colour_map, "a colour map", mpl.colormaps), key="colour_map")
        if self.scale is not None and not (all(map(math.isfinite, self.scale)) and self.scale[0] < self.scale[1]):
            raise InputError(f"goes from a number to a larger one, not {shown(list(self.scale))}", key="scale")
        if self.scale is not None and self.log and self.scale[0] <= 0.0:
            raise InputError(f"is logarithmic and begins above zero, not at {self.scale[0]:g}", key="scale")
        if isinstance(self.levels, int):
            in_range(self.levels, "levels", "a number of levels", 1, MOST_LEVELS)
        elif self.levels is not None:
            rise = all(low < high for low, high in pairwise(self.levels))
            if not (1 <= len(self.levels) <= MOST_LEVELS and all(map(math.isfinite, self.levels)) and rise):
                problem = f"are 1 to {MOST_LEVELS} numbers that rise, not {shown(list(self.levels))}"
                raise InputError(problem, key="levels")
            if self.log and self.levels[0] <= 0.0:
                raise InputError(f"of a logarithmic scale are above zero, not {self.levels[0]:g}", key="levels")

    @property
    def of(self) -> Theme:
        """The colours."""
        theme = THEMES[self.theme]
        return theme._replace(colours=self.colours) if self.colours else theme

    @property
    def font_size_used(self) -> float:
        """Size of the letters, points."""
        width = float("inf") if self.width is None else self.width
        return self.font_size or next((size for limit, size in SMALLER if width < limit), USUAL)

    def figure(self, width: float, height: float) -> StyledFigure:
        """A figure of this style.

        Parameters
        ----------
        width, height : float
            Inches, where the style leaves them open; with only a width the height keeps its share of it.
        """
        wide = width if self.width is None else self.width / INCH
        high = height * min(1.0, wide / width) if self.height is None else self.height / INCH
        return StyledFigure(self, (wide, high))

    @property
    def rc(self) -> Any:
        """The settings of matplotlib."""
        theme, size = self.of, self.font_size_used
        return {
            "font.size": size,
            # What a font lacks, such as raised digits, is taken from the usual one.
            **({"font.family": [self.font, "DejaVu Sans"]} if self.font else {}),
            "axes.titlesize": size + 1.0,
            "axes.titlelocation": "left",
            "axes.labelsize": size,
            "xtick.labelsize": size,
            "ytick.labelsize": size,
            "axes.grid": not theme.framed,
            "axes.axisbelow": True,
            "grid.color": theme.faint,
            "grid.linewidth": 0.6,
            "axes.spines.top": theme.framed,
            "axes.spines.right": theme.framed,
            "xtick.direction": "in" if theme.framed else "out",
            "ytick.direction": "in" if theme.framed else "out",
            "legend.frameon": False,
            "legend.fontsize": size - 1.0,
            "lines.markersize": 4.0 * size / USUAL,
            "text.color": theme.ink,
            "axes.labelcolor": theme.ink,
            "axes.edgecolor": theme.ink,
            "xtick.color": theme.ink,
            "ytick.color": theme.ink,
            "axes.facecolor": theme.paper,
            "figure.facecolor": theme.paper,
            "figure.constrained_layout.use": True,
            # Text stays text, which can be searched and edited.
            "svg.fonttype": "none",
            "pdf.fonttype": 42,
            "ps.fonttype": 42,
            "svg.hashsalt": "jointplay",
            # A title may have two dollar signs in it.
            "text.parse_math": False,
        }


@contextmanager
def as_far_as_it_goes() -> Iterator[None]:
    """Say nothing of what the drawing shows itself.

    A box for a letter that a font lacks says as much, and is as wide as one. On a page that is too small for its labels
    they lie over one another.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="(?s)Glyph .* missing from font")
        warnings.filterwarnings("ignore", message="constrained_layout not applied")
        yield


class InPowers(Formatter):
    """Numbers as multiples of a power of ten that stands in the label: beside the axis it would lie under a legend."""

    def __init__(self, power: int) -> None:
        self.power = power
        self.decimals = 0

    def set_locs(self, locs: Any) -> None:
        """All marks have as many decimals as the one with most."""
        found = np.asarray(locs, dtype=float) / 10.0**self.power
        least = 1e-6 * float(np.ptp(found)) if len(found) else 0.0
        enough = (k for k in range(MOST_DECIMALS) if np.abs(found - found.round(k)).max(initial=0.0) <= least)
        self.decimals = next(enough, MOST_DECIMALS)

    def __call__(self, x: float, pos: int | None = None) -> str:  # noqa: ARG002
        """The number at a mark."""
        return self.fix_minus(f"{x / 10.0**self.power + 0.0:.{self.decimals}f}")


class Logarithmic(LogFormatter):
    """Numbers of a logarithmic axis, which usually are formulas: here a text is what it says."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The number at a mark; nothing at marks that have none."""
        if not super().__call__(x, pos):
            return ""
        if WRITTEN_OUT[0] <= x < WRITTEN_OUT[1]:
            return f"{x:.3g}" if x < 100.0 else f"{x:.0f}"
        digits, _, power = f"{x:.2e}".partition("e")
        raised = "10" + str(int(power)).translate(RAISED)
        return raised if float(digits) == 1.0 else f"{float(digits):g}·{raised}"


def _write_out(axis: Axis) -> None:
    """Write the numbers of a logarithmic axis without formulas."""
    for formatter, put in (
        (axis.get_major_formatter(), axis.set_major_formatter),
        (axis.get_minor_formatter(), axis.set_minor_formatter),
    ):
        if isinstance(formatter, LogFormatter) and not isinstance(formatter, Logarithmic):
            thresholds = formatter.minor_thresholds
            put(Logarithmic(labelOnlyBase=formatter.labelOnlyBase, minor_thresholds=thresholds))


def power_of(values: Iterable[float]) -> int:
    """The power of ten with which numbers of an axis are written; 0 where they are neither very large nor small."""
    largest = max(map(abs, values))
    return 0 if not largest or WRITTEN_OUT[0] <= largest < WRITTEN_OUT[1] else 3 * math.floor(math.log10(largest) / 3.0)


def _scale(axis: Axis) -> None:
    """Write the numbers of an axis without offset, very large and small ones with their power of ten in the label."""
    if type(axis.get_major_formatter()) not in (ScalarFormatter, InPowers):
        return
    power = power_of(axis.get_view_interval())
    # That of the last time that it was drawn.
    words = re.sub(r"\[10[⁻⁰¹²³⁴-⁹]+ ", "[", re.sub(r" \[10[⁻⁰¹²³⁴-⁹]+\]$", "", axis.get_label_text()))
    name, mark, unit = words.rpartition(" [")
    factor = "10" + str(power).translate(RAISED)
    axis.set_major_formatter(InPowers(power))
    if not power:
        axis.set_label_text(words)
    elif mark:
        axis.set_label_text(f"{name} [{factor} {unit}")
    elif words:
        axis.set_label_text(f"{words} [{factor}]")


def _thin_out(line: Line2D, wide: float) -> None:
    """Leave markers out that would lie on one another; the ends of a line and places alone keep theirs."""
    known = np.isfinite(np.column_stack(line.get_data(orig=False)).astype(float)).all(axis=1)
    count = len(known)
    every = math.ceil(1.5 * line.get_markersize() * count / max(wide, 1.0))
    if line.get_marker() in ("None", "", " ", None) or line.get_markevery() is not None or every < 2:
        return
    before, after = np.append(False, known[:-1]), np.append(known[1:], False)
    line.set_markevery(sorted({*range(0, count, every), *np.flatnonzero(known & ~(before & after)).tolist()}))


class LayoutEngine(ConstrainedLayoutEngine):
    """Constrained layout, which measures axes that stand alone once where it would measure them twice.

    It measures once more after the axes have been moved, because they may have other ticks then. To measure is half of
    what a figure costs, and seldom have they.
    """

    def execute(self, fig: Figure) -> None:
        """Give the axes of a figure their places; as `matplotlib.layout_engine.LayoutEngine.execute`."""
        axes = _alone(fig)
        if axes is None:
            super().execute(fig)
            return
        for _ in range(2):
            measured = axes.get_tightbbox(for_layout_only=True)
            own = axes.get_position(original=True)
            around = own if measured is None else measured.transformed(fig.transFigure.inverted())
            low, high = np.array([around.min, around.max])
            pad = np.array([self.get()["w_pad"], self.get()["h_pad"]]) / fig.get_size_inches()
            ends = np.maximum(own.min - low, 0.0) + pad, 1.0 - pad - np.maximum(high - own.max, 0.0)
            if not (ends[0] < ends[1]).all():
                # On a page that is too small all stays as it is, with a warning.
                super().execute(fig)
                return
            narrower = min(own.width, ends[1][0] - ends[0][0]) * fig.bbox.width
            axes.set_position(Bbox(ends))
            axes.set_in_layout(True)
            if _keeps_within(axes, narrower) and _has_ticks_as_measured(axes):
                return


def _alone(figure: Figure) -> Axes | None:
    """The axes of a figure that has nothing else."""
    others = (figure.get_suptitle(), figure.get_supxlabel(), figure.get_supylabel(), figure.legends, figure.subfigs)
    if len(figure.axes) != 1 or any(others):
        return None
    axes = figure.axes[0]
    spec = axes.get_subplotspec()
    return axes if spec is not None and spec.get_gridspec().get_geometry() == (1, 1) and axes.get_in_layout() else None


def _keeps_within(axes: Axes, width: float) -> bool:
    """Whether nothing but ticks and labels sticks out of axes of a width: how far it does depends on the width."""
    legend = axes.get_legend()
    return not axes.texts and (legend is None or bool(legend.get_window_extent().width <= width))


def _has_ticks_as_measured(axes: Axes) -> bool:
    """Whether axes that were moved have the ticks that they had before; what is turned in space never has."""
    for axis in (axes.xaxis, axes.yaxis):
        words = axis.get_major_formatter().format_ticks(axis.get_majorticklocs().tolist())
        measured = getattr(axis, "words", None)
        if measured is None:
            measured = [tick.label1.get_text() for tick in axis.get_major_ticks(len(words))]
        if words != measured:
            return False
    return not hasattr(axes, "zaxis")


#: matplotlib has one set of settings for all threads
_SETTINGS = RLock()
#: those with which the thread that has them draws; none while nothing is drawn
_in_force: Mapping[str, Any] | None = None


@contextmanager
def settings(rc: Mapping[str, Any]) -> Iterator[None]:
    """Draw with settings of matplotlib; one thread at a time, which finds and leaves the others as they were."""
    global _in_force
    with _SETTINGS:
        before, _in_force = _in_force, rc
        try:
            # To make them again takes as long as to draw a curve.
            chosen: Any = dict(rc)
            with nullcontext() if rc == before else mpl.rc_context(chosen):
                yield
        finally:
            _in_force = before


class StyledFigure(Figure):
    """A figure that is written and shown as its style says, whatever matplotlib is set to."""

    def __init__(self, style: Style, size: tuple[float, float]) -> None:
        with settings(style.rc):
            super().__init__(figsize=size, dpi=style.dpi, layout=LayoutEngine())
        self.style = style
        #: what is drawn when everything else has its place
        self.late: list[Callable[[], None]] = []
        #: whether everything has its place, which what was drawn late stands by
        self.is_laid_out = False

    def finish(self) -> None:
        """Lay out what is drawn, then draw what depends on where that is."""
        if self.late:
            escape_texts(self)
            self._write_numbers()
            engine = self.get_layout_engine()
            assert engine is not None
            with settings(self.style.rc), as_far_as_it_goes():
                engine.execute(self)
            for axes in self.axes:
                axes.apply_aspect()
        while self.late:
            self.late.pop(0)()
            self.is_laid_out = True

    def _write_numbers(self) -> None:
        for axes in self.axes:
            for axis in (axes.xaxis, axes.yaxis):
                _scale(axis)
                _write_out(axis)

    def draw(self, renderer: Any) -> None:
        """Draw; as `matplotlib.figure.Figure.draw`."""
        self._write_numbers()
        for axes in self.axes:
            for line in axes.lines:
                _thin_out(line, 72.0 * self.get_figwidth() * axes.get_position().width)
        with as_far_as_it_goes():
            super().draw(renderer)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        """Write the figure; as `matplotlib.figure.Figure.savefig`."""
        with settings(self.style.rc), as_far_as_it_goes():
            super().savefig(*args, **kwargs)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        content = BytesIO()
        self.savefig(content, format="png")
        return content.getvalue()


USUAL_STYLE = Style()
_CURRENT: ContextVar[Style] = ContextVar("style")


def current() -> Style:
    """The style in which something is being drawn."""
    return _CURRENT.get(USUAL_STYLE)


def theme() -> Theme:
    """The colours of the style in which something is being drawn."""
    return current().of


def as_style(style: Style | str) -> Style:
    """A style, or the name of its theme."""
    return Style(style) if isinstance(style, str) else style


@contextmanager
def using(style: Style | str | None) -> Iterator[Style]:
    """Draw in a style; in the one in use where none is named."""
    chosen = current() if style is None else as_style(style)
    token = _CURRENT.set(chosen)
    try:
        with settings(chosen.rc):
            yield chosen
    finally:
        _CURRENT.reset(token)


@contextmanager
def canvas(
    axes: Axes | None, style: Style | str | None = None, width: float = 6.0, height: float = 4.0
) -> Iterator[tuple[Figure, Axes]]:
    """The figure and axes to draw in: those given, or new ones; inches where the style leaves the size open."""
    figure = None if axes is None else axes.get_figure()
    if style is None and isinstance(figure, StyledFigure):
        style = figure.style
    with using(style) as chosen:
        if axes is not None:
            assert isinstance(figure, Figure)
            yield figure, axes
        else:
            figure = chosen.figure(width, height)
            yield figure, figure.add_subplot()
            figure.finish()


def size_of(text: str) -> tuple[float, float | None]:
    """Width and height in millimetres, the height only if there is one.

    Raises
    ------
    InputError
        When it is no size.

    Examples
    --------
    >>> size_of("85x60mm"), size_of("8.5cm"), size_of("3 x 2 in")
    ((85.0, 60.0), (85.0, None), (76.19999999999999, 50.8))
    """
    found = SIZE.fullmatch(text.lower())
    try:
        if found is None or (found["unit"] or "mm") not in UNITS:
            raise ValueError
        unit = UNITS[found["unit"] or "mm"]
        height = None if found["height"] is None else float(found["height"]) * unit
        return float(found["width"]) * unit, height
    except ValueError:
        problem = f"{shown(text)} is not a size such as 85x60mm or 85mm; units are {', '.join(UNITS)}"
        raise InputError(problem, key="size") from None


def scaled(points: float) -> float:
    """A width or the size of a mark, less where letters are smaller."""
    return points * current().font_size_used / USUAL


def mixed(colour: str, paper: str, share: float) -> str:
    """A colour of which a share is left on a paper."""
    pairs = zip(to_rgb(colour), to_rgb(paper), strict=True)
    red, green, blue = (share * part + (1.0 - share) * ground for part, ground in pairs)
    return to_hex((red, green, blue))


def alarm() -> dict[str, Any]:
    """How what stays open is drawn."""
    return {
        "color": theme().alarm, "linewidth": 2.4, "linestyle": (0, (2, 1)), "marker": "o", "markersize": 12,
        "markerfacecolor": "none", "markeredgewidth": 2.0, "zorder": 10,
    }  # fmt: skip


def limit_line() -> dict[str, Any]:
    """How a limit is drawn."""
    return {"color": theme().ink, "linewidth": 1.2, "linestyle": (0, (6, 2))}


def singular_line() -> dict[str, Any]:
    """How a line of singular poses is drawn."""
    return {"color": theme().alarm, "linewidth": 1.8, "linestyle": (0, (5, 1.5, 1, 1.5))}


def series(number: int) -> dict[str, Any]:
    """Colour, marker and dash of a series."""
    colours = theme().colours
    k = number % len(MARKERS)
    return {"color": colours[number % len(colours)], "marker": MARKERS[k], "linestyle": DASHES[k]}


def texts_of(part: Artist) -> Iterator[Text]:
    """All texts of a figure, but for those of ticks, which are written anew whenever they are drawn."""
    for child in part.get_children():
        if isinstance(child, Text):
            yield child
        # To ask an axis for its ticks makes them, for a place that it has not got yet.
        yield from (child.label, child.offsetText) if isinstance(child, Axis) else texts_of(child)


def escape_texts(figure: Figure) -> None:
    """Escape in all texts what a reader of the file could obey; files of drawings are read by other programs, too."""
    for text in texts_of(figure):
        text.set_text("\n".join(map(one_line, text.get_text().split("\n"))))
