"""Dimensions that were found: the front of two aims, and what is used of everything that has to hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result

from .bars import pairs
from .style import Style, canvas, series
from .words import labelled, legend, light

if TYPE_CHECKING:
    import xarray as xr


@typed
def front(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw the designs of which none is better in both of two aims, and that of the file.

    Parameters
    ----------
    result : Dataset
        Of `design` with two aims.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _designed(result)
    if "front_aim" not in part.data:
        raise InputError("has no front: design(m, aim=['worst_position', 'size'])", key="result")
    names, units = part.labels("aim"), part.coords["aim_unit"].values.tolist()
    x, y = part.get("front_aim").T
    with canvas(axes, style) as (figure, axes):
        axes.plot(x, y, label="front", **series(0))
        for k, (values, words) in enumerate(((part.get("aim_found"), "chosen"), (part.get("aim_before"), "file"))):
            if np.isfinite(values).all():
                axes.plot(*values, label=words, **(series(k + 2) | {"linestyle": "none"}))
        axes.set_xlabel(labelled(names[0].replace("_", " "), units[0]))
        axes.set_ylabel(labelled(names[1].replace("_", " "), units[1]))
        legend(axes)
    return figure


@typed
def held(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw what is used of everything that has to hold, with the values of the file and with those that are found.

    Parameters
    ----------
    result : Dataset
        Of `design`.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _designed(result)
    before, used = (np.nan_to_num(100.0 * part.get(name), posinf=0.0) for name in ("used_before", "used"))
    notes = ["binds" if one else "" for one in part.get("binding").astype(bool).tolist()]
    return pairs(
        axes, style, list(part.labels("held")), {"before": before, "found": used}, None, notes, 1.25, "%", "used"
    )


def _designed(result: Result | xr.Dataset) -> Result:
    part = light(result)
    if part.attrs.get("question") != "design":
        raise InputError("is not the result of design", key="result")
    return part
