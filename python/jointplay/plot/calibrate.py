"""Readings of a built machine before and after they were fitted, and the error that is left along the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known
from jointplay.result import Result, split

from .style import Style, canvas, limit_line, series, theme
from .words import labelled, legend, light

if TYPE_CHECKING:
    import xarray as xr

RESIDUALS, REMAINING = "residuals", "remaining"


@typed
def calibrate(
    result: Result | xr.Dataset,
    panel: str = RESIDUALS,
    channel: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the residuals of readings before and after a fit, or the error of the output that it leaves.

    Parameters
    ----------
    result : Dataset
        Of `calibrate`.
    panel : {"residuals", "remaining"}
        Residuals by row of the table, with twice the standard deviation of noise and play; or the standard deviation of
        the position along the path.
    channel : str, optional
        Which column; the first one if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = light(result)
    if "residual_after" not in part.data:
        raise InputError("is not the result of calibrate", key="result")
    if panel not in (RESIDUALS, REMAINING):
        raise InputError(not_known(panel, "a panel", (RESIDUALS, REMAINING)), key="panel")
    with canvas(axes, style) as (figure, axes):
        if panel == RESIDUALS:
            _residuals(axes, part, channel)
        else:
            _remaining(axes, part)
        legend(axes)
    return figure


def _residuals(axes: Axes, part: Result, channel: str | None) -> None:
    names = part.labels("channel")
    if channel is not None and channel not in names:
        raise InputError(not_known(channel, "a measured column", names), key="channel")
    k = names.index(channel) if channel is not None else 0
    rows, unit = np.array(part.labels("reading")), part.labels("channel_unit")[k]
    before, after, expected = (part.get(name)[:, k] for name in ("residual_before", "residual_after", "expected"))
    axes.fill_between(rows, -2.0 * expected, 2.0 * expected, alpha=0.2, linewidth=0.0, label="noise and play, 95 %")
    for number, (values, name) in enumerate(((before, "before"), (after, "after"))):
        axes.plot(rows, values, label=name, **{**series(number), "linestyle": "none"})
    out = part.get("left_out")
    if out.any():
        axes.plot(rows[out], after[out], "x", color=theme().alarm, label="left out")
    axes.axhline(0.0, **limit_line())
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="row of the table", ylabel=labelled(f"residual of {names[k]}", unit))


def _remaining(axes: Axes, part: Result) -> None:
    lengths = [k for k, name in enumerate(part.labels("component")) if name in split(part.labels("component"))[0]]
    outputs = part.labels("each_output") if "each_output" in part.coords else [""]
    for number, name in enumerate(("before", "after")):
        values = part.get(f"output_{name}")
        for k, output in enumerate(outputs):
            own = values[k] if output else values
            size: Floats = np.sqrt((own[:, lengths] ** 2).sum(axis=1))
            if (size > 0.0).any():
                axes.set_yscale("log")
                axes.plot(size, label=f"{output} {name}".strip(), **series(len(outputs) * number + k))
    if axes.get_yscale() == "log":
        # Over a decade or two, plain numbers.
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="configuration", ylabel=labelled("position, std", part.unit("position_after")))
