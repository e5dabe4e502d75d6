"""How far the nominal mechanism is from its target along the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result

from .style import Style, canvas, series
from .words import along, labelled, legend, single, whole_numbers

if TYPE_CHECKING:
    import xarray as xr


@typed
def structural(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw the structural error at every configuration, and the tolerance of the target.

    Parameters
    ----------
    result : Dataset
        Of `structural`.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = single(result)
    if "structural_error" not in part.data:
        raise InputError("is not the result of structural", key="result")
    with canvas(axes, style) as (figure, axes):
        x, words = along(part)
        axes.plot(x, part.get("structural_error"), label="without play", **series(0))
        tolerance = float(part.get("tolerance"))
        if np.isfinite(tolerance):
            axes.axhline(tolerance, label="tolerance", **(series(3) | {"marker": None}))
        axes.set(xlabel=words, ylabel=labelled("structural error", part.unit("structural_error")))
        axes.set_ylim(bottom=0.0)
        whole_numbers(axes.xaxis, words, len(x))
        legend(axes)
    return figure
