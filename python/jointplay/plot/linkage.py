"""The mechanism itself, with its clearances as large as one wants to see them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.analyses.nominal import Nominal, nominal, report
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known, shown
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import Attempt, attempt
from jointplay.result import Result

from .plan import DrawingPlan
from .scene import PLAN, Scene, Sight
from .sketch import FRONT, SIDE, TOP, Sketch
from .solid import OBLIQUE, Solid
from .style import Style, StyledFigure, canvas
from .words import check_exaggeration, legend, single, title, which

if TYPE_CHECKING:
    import xarray as xr

#: the drawings of a mechanism in space by the name of their view; the first one is drawn if none is named
VIEWS: dict[str, tuple[Sight, type[Scene]]] = {
    "solid": (OBLIQUE, Solid),
    "front": (FRONT, Sketch),
    "top": (TOP, Sketch),
    "side": (SIDE, Sketch),
}


@typed
def mechanism(
    m: Mechanism,
    configuration: int = 0,
    *,
    exaggerate: float = 0.0,
    result: Result | xr.Dataset | None = None,
    path: bool = True,
    names: bool = True,
    view: str | None = None,
    behind: Sequence[int] = (),
    beside: Sequence[int] = (),
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw a mechanism in one of its configurations.

    Parameters
    ----------
    m : Mechanism
    configuration : int
        Which, counted from 0.
    exaggerate : float
        Factor on the drawn clearances and errors; 0: they are not drawn.
    result : Dataset, optional
        Of `given` or `loaded`: the pins are drawn where they lie in their clearances (in the plane), and the error of
        the output as an arrow.
    path : bool
        Draw the path of the output over all configurations.
    names : bool
        Write the names of the joints.
    view : {"solid", "front", "top", "side"}, optional
        Of a mechanism in space: shaded from obliquely above, or projected along an axis. Solid if left out.
    behind : sequence of int
        Further configurations, drawn light behind this one.
    beside : sequence of int
        Further configurations, drawn as strong as this one.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional

    Raises
    ------
    InputError
        When there is no such configuration or view.
    """
    check_exaggeration(exaggerate)
    direction, drawing = kind_of(m, view)
    at = nominal(m)
    for number in (configuration, *behind, *beside):
        if not 0 <= number < len(at):
            problem = f"there is no configuration {shown(number)}; they go from 0 to {len(at) - 1}"
            raise InputError(problem, file=m.file)
    found = None
    if not np.isfinite(at.poses[configuration]).all():
        at, found = _attempted(m, at, configuration)
    with canvas(axes, style, 7.0, 5.2) as (figure, axes):
        for number in behind:
            if np.isfinite(at.poses[number]).all():
                drawing(m, at, number, axes, direction).ghost()
        for number in beside:
            other = drawing(m, at, number, axes, direction)
            other.bodies()
            other.joints()
        scene = drawing(m, at, configuration, axes, direction)
        draw(scene, exaggerate, None if result is None else single(result), found, path and len(at) > 1)
        # Of many poses the first and the last one give the title.
        ends = [configuration, *beside][:: max(len(beside), 1)] if len(at) > 1 else []
        said = [which(report(m, "", at).result(), number) for number in ends]
        title(axes, ": ".join(filter(None, [m.title, f"{' (with names)' * names} to ".join(said)])))
        legend(axes)
        if names and isinstance(figure, StyledFigure):
            # Names keep clear of what is around them when that has its place.
            figure.late.append(scene.names)
        elif names:
            scene.names()
    return figure


def kind_of(m: Mechanism, view: str | None) -> tuple[Sight, type[Scene]]:
    """How a mechanism is drawn.

    Raises
    ------
    InputError
        When there is no such view.
    """
    if m.pose_size != poses.SPATIAL:
        if view is not None:
            raise InputError("is for mechanisms in space", file=m.file, key="view")
        return PLAN, DrawingPlan
    if view is not None and view not in VIEWS:
        raise InputError(not_known(view, "a view", VIEWS), key="view")
    return VIEWS[view or next(iter(VIEWS))]


def draw(scene: Scene, exaggerate: float, result: Result | None, found: Attempt | None, path: bool) -> None:
    """All parts of a drawing, the names apart, which need the legend in its place."""
    if found is not None:
        # The nearest attempt is not on the path.
        scene.path[scene.configuration] = np.nan
    if path:
        scene.trace()
    scene.bodies()
    scene.joints()
    scene.output()
    scene.springs()
    if found is not None:
        scene.gap(found)
    if exaggerate > 0:
        scene.clearances(exaggerate)
        if result is not None:
            scene.pins(exaggerate, result)
            scene.error(exaggerate, result)
    scene.frame()


def _attempted(m: Mechanism, at: Nominal, configuration: int) -> tuple[Nominal, Attempt]:
    """The nearest attempt to assemble a configuration in the place of its poses."""
    missing = ~np.isfinite(at.poses).all(axis=(1, 2))
    before = [int(missing.argmax()) - 1] if missing.argmax() else []
    chosen = [*before, configuration]
    found = attempt(m, at.drives[chosen], at.poses[chosen])
    if found is None:
        raise InputError(f"configuration {configuration} is not assembled and cannot be drawn", file=m.file)
    placed: Floats = at.poses.copy()
    placed[configuration] = found.poses
    return replace(at, poses=placed), found
