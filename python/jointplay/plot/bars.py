"""Two sizes of every source side by side, those of one unit."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jointplay.errors import InputError
from jointplay.result import Result

from .style import COLOURS, HATCHES, canvas, labelled

Floats = NDArray[np.float64]

#: heights of a pair of bars and of what is around all of them, inches
BAR, AROUND = 0.42, 0.8
#: from the middle of a pair to that of a bar, and the height of a bar, parts of a pair
APART, HIGH = 0.2, 0.36


def of_unit(part: Result, unit: str | None) -> tuple[NDArray[np.bool_], str]:
    """Which sources have sizes in a unit; in that of the first one if none is named."""
    units = part.labels("source_unit")
    unit = units[0] if unit is None else unit
    if unit not in units:
        known = ", ".join(dict.fromkeys(units))
        raise InputError(f"'{unit}' is not the unit of a source; known: {known}", key="unit")
    return np.array([one == unit for one in units]), unit


def pairs(
    axes: Axes | None, names: list[str], sizes: dict[str, Floats], colour: str, notes: list[str], room: float, unit: str
) -> Figure:
    """Draw two sizes of every source, the second with a note behind it.

    Parameters
    ----------
    axes : Axes, optional
    names : list of str
        Of the sources.
    sizes : dict
        The two sizes by what the legend calls them.
    colour : str
        Of the first.
    notes : list of str
        Beside the second.
    room : float
        Length of the axis over the largest size.
    unit : str
        Of the sizes.
    """
    figure, axes = canvas(axes, 6.0, AROUND + BAR * len(names))
    where = np.arange(len(names))
    (first, before), (second, after) = sizes.items()
    hatched: dict[str, Any] = {"color": COLOURS[1], "hatch": HATCHES[1], "edgecolor": "white"}
    axes.barh(where - APART, before, HIGH, label=first, color=colour)
    axes.barh(where + APART, after, HIGH, label=second, **hatched)
    for k, note in enumerate(notes):
        at = (after[k], k + APART)
        axes.annotate(note, at, xytext=(3, 0), textcoords="offset points", va="center", fontsize=7)
    axes.set_yticks(where, names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(0, room * max(float(before.max(initial=0.0)), float(after.max(initial=0.0))) or 1.0)
    axes.set_xlabel(labelled("size", unit))
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
