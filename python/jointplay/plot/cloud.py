"""Specimens as a cloud of points around no error, with the region that worst cases reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range, not_known
from jointplay.result import Result, split

from .figures import limits_of, words_of, worst_of
from .style import Style, canvas, limit_line, scaled, series, theme
from .words import labelled, legend, light, single, title, which

if TYPE_CHECKING:
    import xarray as xr


@typed
def cloud(
    result: Result | xr.Dataset,
    configuration: int | None = None,
    *,
    components: tuple[str, str] | None = None,
    region: Result | xr.Dataset | None = None,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the errors of specimens in one configuration, two components against each other.

    Specimens outside the limits are crosses. Limits are dashed: lines, and a circle for the position.

    Parameters
    ----------
    result : Dataset
        Of `random` with `keep`.
    configuration : int, optional
        Which, counted from 0; that of the largest quantile of the position if left out.
    components : tuple of str, optional
        Across and up; the first two lengths of the output if left out.
    region : Dataset, optional
        Of `region` for the same mechanism in the plane: where the output can be at all, drawn around the specimens.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional

    Raises
    ------
    InputError
        When there are no specimens, components or configuration of that name, or the region is in space.
    """
    part = single(result)
    if "specimen_error" not in part.data:
        raise InputError("has no specimens; jointplay.random(keep=N) keeps them", key="result")
    names = part.labels("component")
    across, up = components or [*split(names)[0], *names][:2]
    for name in (across, up):
        if name not in names:
            raise InputError(not_known(name, "a component", names), key="components")
    chosen = worst_of(part, "position") if configuration is None else configuration
    in_range(chosen, "configuration", "a configuration", 0, part.sizes["configuration"] - 1)
    x, y = (part.get("specimen_error", component=name)[chosen] for name in (across, up))
    is_outside = _is_outside(part, chosen)
    with canvas(axes, style, 4.6, 4.2) as (figure, axes):
        size = scaled(6.0)
        look = series(0)["color"]
        axes.scatter(
            x[~is_outside],
            y[~is_outside],
            size,
            color=look,
            alpha=0.6,
            linewidths=0,
            label="specimens",
            rasterized=True,
        )
        if is_outside.any():
            axes.scatter(
                x[is_outside], y[is_outside], 2.5 * size, color=theme().alarm, marker="x", label="outside the limits",
                linewidths=0.8, rasterized=True,
            )  # fmt: skip
        if region is not None:
            _outline(axes, region, chosen, (across, up))
        _limits(axes, part, (across, up))
        units = [part.unit("specimen_error", component=name) for name in (across, up)]
        axes.set(xlabel=labelled(words_of(across), units[0]), ylabel=labelled(words_of(up), units[1]))
        if units[0] == units[1]:
            axes.set_aspect("equal", adjustable="datalim")
        title(axes, f"{which(part, chosen)}, {len(x)} specimens")
        legend(axes)
    return figure


def _is_outside(part: Result, configuration: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which specimens miss a limit of a component or of a size."""
    lengths, angles = split(part.labels("component"))
    found = np.zeros(part.sizes["specimen"], bool)
    known = part.labels("quantity") if "limit" in part.data else []
    sizes = {"position": lengths, "rotation": angles}
    for quantity, names in (sizes | {name: [name] for name in (*lengths, *angles)}).items():
        each = [part.get("specimen_error", component=name)[configuration] for name in names]
        if quantity in known:
            value = np.linalg.norm(each, axis=0) if quantity in sizes else each[0]
            low, high = part.get("limit", quantity=quantity)
            # Of a limit that there is not, both ends are nan.
            found |= (value < low) | (value > high)
    return found


def _limits(axes: Axes, part: Result, components: tuple[str, str]) -> None:
    """Those of both components and of the position that are near; far ones would leave nothing of the specimens."""
    ends = axes.dataLim.frozen().get_points().T
    named = False
    for name, line, (low, high) in zip(components, (axes.axvline, axes.axhline), ends, strict=True):
        for value in limits_of([part], name):
            if 2.0 * low - high < value < 2.0 * high - low:
                line(value, **limit_line(), label=None if named else "limit")
                named = True
    if [*components] == split(part.labels("component"))[0]:
        for bound in limits_of([part], "position"):
            if bound < 2.0 * float(np.hypot(*np.abs(ends).max(axis=1))):
                look = limit_line()
                edge = {"edgecolor": look["color"], "linestyle": look["linestyle"], "linewidth": look["linewidth"]}
                axes.add_patch(Circle((0.0, 0.0), bound, fill=False, **edge))
                axes.plot([], [], **look, label=None if named else "limit")
                named = True
    axes.autoscale_view()


def _outline(axes: Axes, region: Result | xr.Dataset, configuration: int, components: tuple[str, str]) -> None:
    """Where the output can be."""
    own = light(region)
    known = own.labels("axis") if "region" in own.data else []
    if sorted(known) != sorted(components):
        raise InputError(f"is the result of region for {components[0]} and {components[1]}, in the plane", key="region")
    points = np.stack([own.get("region", axis=name)[configuration] for name in components], axis=1)
    axes.plot(*np.vstack([points, points[:1]]).T, color=theme().ink, linewidth=1.0, label="all that is possible")
