"""The colours of maps and surfaces: where they begin and end, in steps or not, as the style says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, LogNorm, Normalize, to_hex
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator
from numpy.typing import NDArray

from .style import current

#: near a singularity errors grow without bound; colours end at this quantile where it is far below the largest
CUT, FAR = 0.98, 2.0
#: colours of a scale that a page gets
STOPS = 33

Extend = Literal["neither", "min", "max", "both"]


@dataclass(frozen=True)
class Shades:
    """Colours for values.

    Attributes
    ----------
    low, high : float
        Where colours begin and end.
    levels : tuple of float
        Values at which lines are drawn.
    extend : {"neither", "min", "max", "both"}
        Where there are values beyond.
    """

    low: float
    high: float
    levels: tuple[float, ...]
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
        locator = LogLocator(subs="all", numticks=asked + 1) if style.log else MaxNLocator(asked or 1)
        # A range without a width has no level inside.
        found = locator.tick_values(low, high) if asked and low < high else ()
        asked = tuple(float(level) for level in found if low < level < high)
    beyond: dict[tuple[bool, bool], Extend] = {
        (False, False): "neither",
        (True, False): "min",
        (False, True): "max",
        (True, True): "both",
    }
    with np.errstate(invalid="ignore"):
        return Shades(low, high, asked, beyond[bool((values < low).any()), bool((values > high).any())])


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
    for text in axes.clabel(lines, fontsize=size):
        text.set_path_effects([withStroke(linewidth=1.2, foreground="#000000a0")])


def stops() -> list[list[Any]]:
    """The colours of a scale as a page names them."""
    colours = mpl.colormaps[current().colour_map]
    return [[float(at), to_hex(colours(at))] for at in np.linspace(0.0, 1.0, STOPS)]
