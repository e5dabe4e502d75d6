"""Sources of an error in the order of their shares, and reactions along the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result, blame, is_of_variance

from .figures import check_size, from_zero, words_of
from .style import Style, canvas, series, theme
from .words import along, labelled, legend, single, title, whole_numbers

if TYPE_CHECKING:
    import xarray as xr

#: sources that have a bar of their own; the others are one bar
MOST_BARS = 15
#: joints that have a curve of their own: those with the largest reactions
MOST_JOINTS = 8


@typed
def pareto(
    result: Result | xr.Dataset,
    quantity: str = "position",
    configuration: int = 0,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the sources of the first-order error in one configuration in the order of their shares, and their sums.

    Parameters
    ----------
    result : Dataset
        Of `worst`, `loaded`, `given` or `random`.
    quantity : {"position", "rotation"}
    configuration : int
        Which, counted from 0.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    check_size(quantity)
    part = single(result)
    found = blame(part)
    every = found.position if quantity == "position" else found.rotation
    if not 0 <= configuration < len(every):
        raise InputError(f"there is no configuration {configuration}; they go from 0 to {len(every) - 1}")
    shares = 100.0 * np.nan_to_num(every[configuration])
    order = np.argsort(-np.abs(shares), kind="stable")
    kept = [int(k) for k in order[:MOST_BARS] if abs(shares[k]) > 0.05]
    names, values = [str(found.causes[k]) for k in kept], [float(shares[k]) for k in kept]
    rest = float(shares.sum() - sum(values))
    if len(kept) < np.count_nonzero(np.abs(shares) > 0.05):
        names, values = [*names, "others"], [*values, rest]
    where = np.arange(len(values))
    sums = np.cumsum(values)
    with canvas(axes, style, 6.0, 0.9 + 0.28 * max(len(values), 3)) as (figure, axes):
        axes.barh(where, values, 0.7, color=series(0)["color"], label="share")
        axes.plot(sums, where, color=series(3)["color"], marker="o", label="sum of these and all above")
        axes.axvline(100.0, color=theme().grey, linewidth=0.8, linestyle="--")
        axes.set_yticks(where, names)
        axes.invert_yaxis()
        whole = "variance of the " if is_of_variance(part) else ""
        axes.set_xlabel(f"share in the {whole}{words_of(quantity)} [%]")
        low = min([0.0, *values])
        axes.set_xlim(1.05 * low, max(105.0, 1.05 * float(sums.max(initial=0.0))))
        legend(axes)
    return figure


@typed
def reactions(result: Result | xr.Dataset, *, axes: Axes | None = None, style: Style | str | None = None) -> Figure:
    """Draw the forces in the joints along the path, those of the joints with the largest ones.

    Parameters
    ----------
    result : Dataset
        Of `loaded`.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = single(result)
    if "reaction" not in part.data:
        raise InputError("has no reactions; `loaded` gives them with its details", key="result")
    forces = [name for name in part.labels("wrench") if name.startswith("f")]
    size = np.linalg.norm([part.get("reaction", wrench=name) for name in forces], axis=0)
    joints = part.labels("joint")
    order = np.argsort(-np.nan_to_num(size).max(axis=0, initial=0.0), kind="stable")[:MOST_JOINTS]
    with canvas(axes, style) as (figure, axes):
        x, words = along(part)
        for number, k in enumerate(order.tolist()):
            axes.plot(x, size[:, k], label=str(joints[k]), **series(number))
        axes.set(xlabel=words, ylabel=labelled("force in the joint", part.unit("reaction", wrench=forces[0])))
        from_zero(axes, [size])
        whole_numbers(axes.xaxis, words, len(x))
        if len(joints) > MOST_JOINTS:
            title(axes, f"the {MOST_JOINTS} largest of {len(joints)}")
        legend(axes)
    return figure
