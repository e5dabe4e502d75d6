"""The colours of maps and surfaces: where they begin and end, in steps or not, as the style says."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats

from .style import MOST_LEVELS, InPowers, StyledFigure, current, power_of
from .words import HIGH, width_of

#: near a singularity errors grow without bound; colours end at this quantile where it is far below the largest
CUT, FAR = 0.98, 2.0
#: colours of a scale that a page gets
STOPS = 33
#: a number stands on a line where it is as straight as this: the distance of its ends, as a share of its length
STRAIGHT = 0.9
#: how often a logarithmic scale has levels in a decade
PARTS = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), tuple(range(1, 10)))

Extend = Literal["neither", "min", "max", "both"]


@dataclass(frozen=True)
class Shades:
    """Colours for values."""

    #: `low`, `high`: where colours begin and end
    low: float
    high: float
    #: values at which lines are drawn
    levels: tuple[float, ...]
    #: where there are values beyond; {"neither", "min", "max", "both"}
    extend: Extend

    @property
    def steps(self) -> list[float]:
        """Where colours change that come in steps."""
        return [self.low, *(level for level in self.levels if self.low < level < self.high), self.high]

    @property
    def norm(self) -> Normalize:
        """What turns values into colours."""
        if current().levels is not None:
            return BoundaryNorm(self.steps, mpl.colormaps[current().colour_map].N, extend=self.extend)
        return (LogNorm if current().log else Normalize)(self.low, self.high)

    @property
    def look(self) -> dict[str, Any]:
        """What matplotlib is given for them."""
        return {"cmap": current().colour_map, "norm": self.norm}


def colour_range(values: NDArray[np.float64]) -> tuple[float, float]:
    """Where colours begin and end: as the style says, else at the ends of the values, or before a few far ones."""
    style = current()
    if style.scale is not None:
        return style.scale
    known = values[np.isfinite(values)]
    if style.log:
        known = known[known > 0.0]
    if not known.size:
        return (1.0, 10.0) if style.log else (0.0, 1.0)
    low, cut, high = float(known.min()), float(np.quantile(known, CUT)), float(known.max())
    if low == high == 0.0:
        return 0.0, 1.0
    return low, cut if high > FAR * cut and not style.log else high


def shades(values: NDArray[np.float64], usual: int = 0) -> Shades:
    """The colours for values.

    Parameters
    ----------
    values : ndarray
        Nan where there is none.
    usual : int
        About how many levels have lines where the style does not say.
    """
    low, high = colour_range(values)
    style = current()
    asked = style.levels or usual
    if isinstance(asked, int):
        asked = _round_levels(asked, low, high) if asked and low < high else ()
    beyond: dict[tuple[bool, bool], Extend] = {
        (False, False): "neither",
        (True, False): "min",
        (False, True): "max",
        (True, True): "both",
    }
    with np.errstate(invalid="ignore"):
        return Shades(low, high, asked, beyond[bool((values < low).any()), bool((values > high).any())])


def _round_levels(count: int, low: float, high: float) -> tuple[float, ...]:
    """About so many round values inside a range."""
    locators: list[Any] = [MaxNLocator(count)]
    if current().log:
        locators = [*(LogLocator(subs=parts, numticks=MOST_LEVELS) for parts in PARTS), *locators]
    each = [tuple(float(v) for v in locator.tick_values(low, high) if low < v < high) for locator in locators]
    return min(each, key=lambda levels: abs(len(levels) - count))


def level_lines(axes: Axes, x: Any, y: Any, values: NDArray[np.float64], shades: Shades, size: float) -> None:
    """Lines of equal value over x and y, values of shape (x, y), each with its value.

    Parameters
    ----------
    axes : matplotlib axes
    x, y : array_like
    values : ndarray
    shades : Shades
    size : float
        Of the letters, points.
    """
    least, most = np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf)
    levels = [level for level in shades.levels if least < level < most]
    if not levels or min(values.shape) < 2:
        return
    if current().levels is not None:
        # Between nodes colours end where the lines are.
        axes.contourf(x, y, values.T, shades.steps, extend=shades.extend, **shades.look)
    # White with a dark edge is seen on every colour.
    lines = axes.contour(x, y, values.T, levels, colors="white", linewidths=0.8)
    lines.set_path_effects([withStroke(linewidth=1.8, foreground="#00000090")])
    formatter = InPowers(power_of((shades.low, shades.high)))

    def write() -> None:
        words = dict(zip(levels, formatter.format_ticks(levels), strict=True))
        places = _free_places(axes, lines, words, size)
        if places:
            for text in axes.clabel(lines, fontsize=size, fmt=words, manual=places):
                text.set_path_effects([withStroke(linewidth=1.2, foreground="#000000a0")])

    figure = axes.get_figure()
    if isinstance(figure, StyledFigure):
        # Which numbers have room is known when the axes have their place.
        figure.late.append(write)
    else:
        write()


def _free_places(axes: Axes, lines: Any, words: Mapping[float, str], size: float) -> list[tuple[float, float]]:
    """Where lines get their numbers: each piece once, as near to its middle as nothing is cut or lies on another."""
    figure = axes.get_figure()
    assert figure is not None
    points, window = figure.dpi / 72.0, axes.get_window_extent()
    low, high = np.array([window.min, window.max])
    half = 0.5 * HIGH * size * points
    taken: list[Floats] = [np.full((1, 2), np.inf)]
    chosen: list[tuple[float, float]] = []
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        reach = 0.5 * points * width_of(words[float(level)], size)
        for piece in path.to_polygons(axes.transData, closed_only=False):
            along = np.append(0.0, np.linalg.norm(np.diff(piece, axis=0), axis=1).cumsum())
            middles = np.arange(reach + half, along[-1] - reach - half, half)
            for at in middles[np.argsort(np.abs(middles - 0.5 * along[-1]), kind="stable")]:
                # The number as circles in a row, straight where the line is nearly so.
                start, middle, end = (_on(piece, along, place) for place in (at - reach, at, at + reach))
                chord = float(np.linalg.norm(end - start))
                if chord < STRAIGHT * 2.0 * reach:
                    continue
                row = middle + np.outer(np.linspace(-reach, reach, 9), (end - start) / chord)
                apart = np.linalg.norm(row[:, None] - np.concatenate(taken), axis=-1).min()
                if apart > 2.0 * half and (row > low + half).all() and (row < high - half).all():
                    taken.append(row)
                    chosen.append(tuple(axes.transData.inverted().transform(middle).tolist()))
                    break
    return chosen


def _on(piece: Floats, along: Floats, at: float) -> Floats:
    """The place on a line at a length."""
    return np.array([np.interp(at, along, piece[:, k]) for k in (0, 1)])


def put_bar(figure: Figure, mesh: Any, axes: Any, words: str, shades: Shades) -> Colorbar:
    """What the colours mean, beside axes; colours in steps have numbers where they change."""
    bar = figure.colorbar(mesh, ax=axes, label=words, extend=shades.extend)
    low, *inside, high = shades.steps
    if current().levels is not None and inside:
        # Ends that are where the values end would be numbers of many digits.
        ends = [end for end in (low, high) if float(f"{end:.3g}") == end]
        bar.locator = FixedLocator(sorted([*inside, *ends]), nbins=10)
        bar.update_ticks()
    return bar


def stops() -> list[list[Any]]:
    """The colours of a scale as a page names them."""
    colours = mpl.colormaps[current().colour_map]
    return [[float(at), to_hex(colours(at))] for at in np.linspace(0.0, 1.0, STOPS)]
