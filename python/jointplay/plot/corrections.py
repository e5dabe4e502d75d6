"""Corrections of drives over the configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result

from .figures import mechanisms
from .style import Style, canvas, series, theme
from .words import along, labelled, legend, light, of_unit, title, whole_numbers

if TYPE_CHECKING:
    import xarray as xr


@typed
def correction(
    result: Result | xr.Dataset,
    unit: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw by how much the drives are corrected. Drives that are held by their range are marked.

    Parameters
    ----------
    result : Dataset
        Of `compensate`, or of `compare` that asked for it; a line for each output and load case.
    unit : str, optional
        Which drives: lengths and angles have axes of their own. That of the first drive if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = light(result)
    if "correction" not in part.data:
        raise InputError("is not the result of compensate", key="result")
    drives = [str(name) for name in part.labels("drive")]
    _, wanted, unit = of_unit(drives, [part.unit("correction", drive=name) for name in drives], unit, "drive")
    with canvas(axes, style) as (figure, axes):
        x, words = along(part)
        axes.axhline(0.0, color=theme().ink, linewidth=0.6)
        held = False
        each = [(f"{label} {name}".strip(), name, one) for label, one in mechanisms(part) for name in wanted]
        # Of two mechanisms each has drives that the other one has not.
        each = [entry for entry in each if np.isfinite(entry[2].get("correction", drive=entry[1])).any()]
        for k, (label, name, one) in enumerate(each):
            values, stays = one.get("correction", drive=name), one.get("at_limit", drive=name).astype(bool)
            axes.plot(x, values, label=label, **series(k))
            look: dict[str, Any] = {"marker": "o", "markersize": 10, "markerfacecolor": "none", "color": theme().alarm}
            if stays.any():
                said = None if held else "held by its range"
                axes.plot(np.asarray(x)[stays], values[stays], linestyle="", label=said, **look)
                held = True
        axes.set(xlabel=words, ylabel=labelled("correction of the drive", unit))
        whole_numbers(axes.xaxis, words, len(x))
        title(axes, f"corrects: {part.attrs.get('corrects', '')}")
        legend(axes)
    return figure
