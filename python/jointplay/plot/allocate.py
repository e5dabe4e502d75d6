"""What sizes cost: the sizes before and after with their costs, and the least cost against the limits."""

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
from .words import legend, light, of_unit

if TYPE_CHECKING:
    import xarray as xr


@typed
def allocate(
    result: Result | xr.Dataset,
    unit: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the size of every source as it was and as it is allocated, with its choice and its cost.

    Parameters
    ----------
    result : Dataset
        Of `allocate`.
    unit : str, optional
        Which sources: lengths and angles have axes of their own. That of the first source if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _allocated(result)
    own, names, unit = of_unit(part.labels("source"), part.labels("source_unit"), unit, "source")
    before, size, cost, choice = (part.get(name)[own] for name in ("size_before", "size", "cost", "choice"))
    notes = [" ".join(filter(None, (str(c), f"cost {paid:.4g}"))) for c, paid in zip(choice, cost, strict=True)]
    return pairs(axes, style, names, {"before": before, "allocated": size}, None, notes, 1.25, unit)


@typed
def cost_curve(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw the least cost against the factor on all limits.

    Parameters
    ----------
    result : Dataset
        Of `allocate` with `curve`.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = _allocated(result)
    if "curve_cost" not in part.data:
        raise InputError("has no curve: allocate(m, curve=[0.5, 1, 2])", key="result")
    factors, costs = np.array(part.labels("limit"), dtype=float), part.get("curve_cost")
    own = float(part.get("total_cost"))
    if 1.0 not in factors:
        # What the limits as they are cost is a point of the curve, too.
        factors, costs = np.append(factors, 1.0), np.append(costs, own)
    order = np.argsort(factors)
    with canvas(axes, style) as (figure, axes):
        axes.plot(factors[order], costs[order], label="least cost", **series(0))
        here = series(3) | {"linestyle": "none"}
        axes.plot(1.0, own, label="these limits", **here)
        axes.set(xlabel="limits times", ylabel="total cost")
        legend(axes)
    return figure


def _allocated(result: Result | xr.Dataset) -> Result:
    part = light(result)
    if part.attrs.get("question") != "allocate" or "size" not in part.data:
        raise InputError("is not the result of allocate with sizes", key="result")
    return part
