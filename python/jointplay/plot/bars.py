"""Two sizes of every source side by side, those of one unit."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.arrays import Floats

from .style import HATCHES, Style, canvas, current, theme
from .words import brief, labelled, legend

#: heights of a pair of bars and of what is around all of them, inches
BAR, AROUND = 0.42, 0.8
#: from the middle of a pair to that of a bar, and the height of a bar, parts of a pair
APART, HIGH = 0.2, 0.36


def pairs(
    axes: Axes | None,
    style: Style | str | None,
    names: list[str],
    sizes: dict[str, Floats],
    colour: int | None,
    notes: list[str],
    room: float,
    unit: str,
    what: str = "size",
) -> Figure:
    """Draw two sizes of every source, the second with a note behind it.

    Parameters
    ----------
    axes : Axes, optional
    style : Style or str, optional
    names : list of str
        Of the sources.
    sizes : dict
        The two sizes by what the legend calls them.
    colour : int, optional
        Which one the first has; grey if left out.
    notes : list of str
        Beside the second.
    room : float
        Length of the axis over the largest size.
    unit : str
        Of the sizes.
    what : str, optional
        What they are, along the axis.
    """
    where = np.arange(len(names))
    (first, before), (second, after) = sizes.items()
    with canvas(axes, style, 6.0, AROUND + BAR * len(names)) as (figure, axes):
        colours = theme().colours
        hatched: dict[str, Any] = {"color": colours[1 % len(colours)], "hatch": HATCHES[1], "edgecolor": theme().paper}
        axes.barh(where - APART, before, HIGH, label=first, color=theme().grey if colour is None else colours[colour])
        axes.barh(where + APART, after, HIGH, label=second, **hatched)
        small = current().font_size_used - 2.0
        for k, note in enumerate(notes):
            at = (after[k], k + APART)
            axes.annotate(note, at, xytext=(3, 0), textcoords="offset points", va="center", fontsize=small)
        axes.set_yticks(where, list(map(brief, names)))
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlim(0, room * max(float(before.max(initial=0.0)), float(after.max(initial=0.0))) or 1.0)
        axes.set_xlabel(labelled(what, unit))
        legend(axes)
    return figure
