"""How near to a singularity a mechanism is along its path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result

from .style import Logarithmic, Style, canvas, limit_line, series
from .words import along, labelled, legend, single, whole_numbers

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("constraint", "actuation", "output")
#: how far the axis goes below the limit; smaller values are drawn at its end
BELOW = 0.1


@typed
def nearness(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw the singular values of the three kinds of singularities over the configurations.

    Parameters
    ----------
    result : Dataset
        Of `singularities`.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _singular(result)
    limit = float(part.attrs["limit"])
    least = BELOW * limit
    with canvas(axes, style) as (figure, axes):
        x, words = along(part)
        # Only a logarithmic axis shows how near the nearest one is.
        axes.set_yscale("log")
        for k, kind in enumerate(KINDS):
            axes.plot(x, np.maximum(part.get(f"{kind}_singular_value"), least), label=kind, **series(k))
        axes.axhline(limit, **limit_line(), label="singular below this")
        axes.set_ylim(bottom=0.8 * least)
        axes.yaxis.set_major_formatter(Logarithmic())
        axes.set(xlabel=words, ylabel="singular value")
        whole_numbers(axes.xaxis, words, len(x))
        legend(axes)
    return figure


@typed
def distance(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw how far the output travels from each configuration to the nearest singularity of the path.

    Parameters
    ----------
    result : Dataset
        Of `singularities` with its path.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _singular(result)
    if "singularity_distance" not in part.data:
        raise InputError("the path between the configurations was not searched", key="result")
    values = part.get("singularity_distance")
    with canvas(axes, style) as (figure, axes):
        x, words = along(part)
        if np.isfinite(values).any():
            axes.plot(x, np.where(np.isfinite(values), values, np.nan), **series(0))
            axes.set_ylim(bottom=0.0)
        else:
            axes.annotate("no singularity on the path", (0.5, 0.5), xycoords="axes fraction", ha="center")
            axes.set_xlim(float(np.min(x)) - 0.5, float(np.max(x)) + 0.5)
            axes.set_yticks([])
        unit = part.unit("singularity_distance")
        axes.set(xlabel=words, ylabel=labelled("travel to the nearest singularity", unit))
        whole_numbers(axes.xaxis, words, len(x))
    return figure


def _singular(result: Result | xr.Dataset) -> Result:
    part = single(result)
    if "constraint_singular_value" not in part.data:
        raise InputError("is not the result of singularities", key="result")
    return part
