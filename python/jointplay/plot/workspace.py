"""The region of a workspace, its boundary coloured by what bounds it; in space sections through the largest ball."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch, Rectangle
from matplotlib.path import Path

from jointplay.analyses.workspace.lines import lines, loops
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known
from jointplay.result import Result

from .style import Style, canvas, mixed, series, theme
from .words import labelled, legend, light

if TYPE_CHECKING:
    import xarray as xr

#: of the region
SHADE = 0.12
#: bounds that have a colour of their own
MOST_BOUNDS = 8


@typed
def workspace(
    result: Result | xr.Dataset,
    plane: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw a workspace: its boundary by what bounds it, the largest disc and the largest box.

    Parameters
    ----------
    result : Dataset
        Of `workspace`.
    plane : str, optional
        Of a volume, the axes of the section through the middle of the largest ball, such as ``xz``; the first two if
        left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = light(result)
    if part.attrs.get("question") != "workspace":
        raise InputError("is not the result of workspace", key="result")
    known = planes(part)
    if plane is not None and plane not in known:
        raise InputError(not_known(plane, "a plane of its axes", known), key="plane")
    with canvas(axes, style, 6.2, 5.0) as (figure, axes):
        _section(part, plane or known[0], axes)
    return figure


def planes(result: Result) -> list[str]:
    """The planes of the axes."""
    return ["".join(pair) for pair in itertools.combinations(result.labels("along"), 2)]


def _section(result: Result, plane: str, axes: Axes) -> None:
    names, unit = result.labels("along"), result.unit("vertex")
    shown = [names.index(name) for name in plane]
    bounds = result.labels("bound")
    pieces = [*(lines(result) if len(names) == 2 else _cut(result, shown))]
    grey = mixed(theme().grey, theme().paper, SHADE)
    for k, word in enumerate(bounds):
        own = [line[:, shown] for name, line in pieces if name == word]
        look = series(min(k, MOST_BOUNDS))
        axes.add_collection(LineCollection(own, colors=str(look["color"]), linewidths=2.0, zorder=3))
    if len(names) == 2:
        # Outer lines run counterclockwise and those of holes clockwise, so that holes stay open.
        rings = [Path(result.get("vertex")[loop], closed=False) for loop in loops(result.get("facet"))]
        if rings:
            axes.add_patch(PathPatch(Path.make_compound_path(*rings), facecolor=grey, edgecolor="none", zorder=1))
    _inscribed(result, shown, axes)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    middle = result.get("disc_centre")
    across = [f" at {name} = {middle[k]:.4g} {unit}" for k, name in enumerate(names) if k not in shown]
    axes.set(xlabel="".join([labelled(plane[0], unit), *across]), ylabel=labelled(plane[1], unit))
    handles = [
        Line2D([], [], color=str(series(min(k, MOST_BOUNDS))["color"]), linewidth=2.0) for k in range(len(bounds))
    ]
    shares = result.get("share")
    words = [
        f"{word.replace('_', ' ').removeprefix('drives.').removeprefix('joints.')} {float(f'{100.0 * share:.2g}'):g} %"
        for word, share in zip(bounds, shares.tolist(), strict=True)
    ]
    legend(axes, (handles, words))


def _inscribed(result: Result, shown: list[int], axes: Axes) -> None:
    """The disc or ball and the box, in a plane through the middle of the ball."""
    centre, radius = result.get("disc_centre"), float(result.get("disc_radius"))
    if not np.isfinite(radius):
        return
    low, high = (result.get(name) for name in ("box_low", "box_high"))
    look: dict[str, Any] = {"fill": False, "edgecolor": theme().ink, "linewidth": 1.0, "zorder": 4}
    axes.add_patch(Circle(tuple(centre[shown].tolist()), radius, linestyle="--", **look))
    if all(low[k] <= centre[k] <= high[k] for k in range(len(centre)) if k not in shown):
        sides = (high - low)[shown].tolist()
        axes.add_patch(Rectangle(tuple(low[shown].tolist()), *sides, linestyle=":", **look))


def _cut(result: Result, shown: list[int]) -> Iterator[tuple[str, Floats]]:
    """The lines in which a plane through the middle of the ball cuts the triangles of a boundary, by what bounds it."""
    across = next(k for k in range(3) if k not in shown)
    facets, points, bounds = result.get("facet"), result.get("vertex"), result.get("vertex_bound")
    middle = float(result.get("disc_centre")[across])
    above = points[facets][..., across] - middle
    cut = (above >= 0.0).any(axis=1) & (above < 0.0).any(axis=1)
    for facet, heights in zip(facets[cut], above[cut], strict=True):
        ends = []
        for i, j in ((0, 1), (1, 2), (2, 0)):
            if (heights[i] >= 0.0) != (heights[j] >= 0.0):
                part = heights[i] / (heights[i] - heights[j])
                ends.append(points[facet[i]] + part * (points[facet[j]] - points[facet[i]]))
        yield str(bounds[facet[0]]), np.array(ends)
