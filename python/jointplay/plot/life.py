"""Clearances and errors against the age of a mechanism that wears."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known
from jointplay.result import Result

from .figures import from_zero, words_of
from .style import Style, canvas, limit_line, series, theme
from .words import labelled, legend, light

if TYPE_CHECKING:
    import xarray as xr

#: what is drawn against the age
AGEING = ("used", "position", "rotation", "clearance")


@typed
def life(
    result: Result | xr.Dataset,
    quantity: str = "clearance",
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw clearances or errors against the age, with the life and its range.

    Parameters
    ----------
    result : Dataset
        Of `life`.
    quantity : {"clearance", "position", "rotation", "used"}
        Every clearance; the largest error over the configurations; or the largest part of a limit that is used.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = light(result)
    if "life" not in part.data or "age" not in part.coords:
        raise InputError("is not the result of life", key="result")
    known = [name for name in AGEING if name in part.data]
    if quantity not in known:
        raise InputError(not_known(quantity, "a quantity", known), key="quantity")
    ages, values = np.array(part.labels("age"), dtype=float), part.get(quantity)
    with canvas(axes, style) as (figure, axes):
        if quantity == "clearance":
            for k, name in enumerate(part.labels("source")):
                axes.plot(ages, values[:, k], label=name, **series(k))
            from_zero(axes, [values])
            words = labelled("clearance", part.unit("clearance"))
        elif quantity == "used":
            axes.plot(ages, 100.0 * values, label="used", **series(0))
            axes.axhline(100.0, label="limit", **limit_line())
            from_zero(axes, [100.0 * values, np.array([100.0])])
            words = "part of the limits used [%]"
        else:
            largest = np.max(values, axis=1)
            axes.plot(ages, largest, label=f"largest, {part.attrs['asked']}", **series(0))
            from_zero(axes, [largest])
            words = labelled(words_of(quantity), part.unit(quantity))
        _mark_life(axes, part, ages)
        axes.set(xlabel="age [cycles]", ylabel=words)
        legend(axes)
    return figure


def _mark_life(axes: Axes, part: Result, ages: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
    """The life, and how early it ends with rates twice as large."""
    if str(part.get("status")) != "ok":
        return
    end, early = float(part.get("life")), float(part.get("life_low"))
    if end <= 1.001 * float(ages.max(initial=0.0)):
        axes.axvline(end, color=theme().alarm, linewidth=1.2, label="life")
    if early <= float(ages.max(initial=0.0)):
        dotted: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (1, 2)), "color": theme().alarm}
        axes.axvline(early, label="with rates twice as large", **dotted)
