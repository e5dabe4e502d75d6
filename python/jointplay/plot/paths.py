"""The path of the output, and where errors move it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result, split, unit_of

from .figures import Results, mechanisms
from .style import Style, canvas, series, theme
from .words import automatic, check_exaggeration, labelled, legend, light

#: how large the largest displacement is drawn, as a part of the path
VISIBLE = 0.15


@typed
def displaced_path(
    results: Results,
    *,
    exaggerate: float | None = None,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the nominal path of the output, and the places that errors displace it to, configuration by configuration.

    Parameters
    ----------
    results : mapping of Dataset
        Of `loaded`, `given` or `worst`, by what they are called in the legend. Of the worst case the farthest place is
        shown.
    exaggerate : float, optional
        Factor on the displacements; a round one that makes them visible if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional

    Raises
    ------
    InputError
        When no result has a displacement.
    """
    check_exaggeration(exaggerate)
    every = [(f"{name} {label}".strip(), one) for name, r in results.items() for label, one in mechanisms(light(r))]
    each = [(label, one, shift) for label, one in every if (shift := _shift(one)) is not None]
    if not each:
        raise InputError("has no displacement to draw; loaded, given and worst have one", key="result")
    first = each[0][1]
    known = _places(first)[np.isfinite(_places(first)).all(axis=1)]
    if not len(known):
        raise InputError("no configuration is assembled, so there is nothing to draw", key="result")
    spread = np.ptp(known, axis=0)
    # The plane in which the path is largest.
    shown = np.sort(np.argsort(-spread, kind="stable")[:2])
    if exaggerate is None:
        largest = max(float(np.nanmax(np.linalg.norm(shift, axis=1), initial=0.0)) for *_, shift in each)
        exaggerate = automatic(VISIBLE * float(spread.max()), largest) or 1.0
    times = f", errors {exaggerate:g} times as large" if exaggerate != 1.0 else ""
    lengths, unit = split(first.labels("component"))[0], unit_of(first, "position")
    with canvas(axes, style) as (figure, axes):
        # All questions on one mechanism have one nominal path, and two that are compared nearly so.
        axes.plot(*_places(first)[:, shown].T, color=theme().ink, linestyle="--", marker=".", label="nominal path")
        for k, (label, one, shift) in enumerate(each):
            moved = _places(one) + exaggerate * shift
            axes.plot(*moved[:, shown].T, label=f"{label}{times}", **series(k))
        axes.set(xlabel=labelled(lengths[shown[0]], unit), ylabel=labelled(lengths[shown[-1]], unit))
        axes.set_aspect("equal", adjustable="datalim")
        legend(axes)
    return figure


def _places(result: Result) -> Any:
    lengths = split(result.labels("component"))[0]
    return np.stack([result.get("nominal", component=name) for name in lengths], axis=1)


def _shift(result: Result) -> Any:
    """The displacement of the output, (configuration, axis); None where a result has none."""
    lengths = split(result.labels("component"))[0]
    if "worst_direction" in result.data:
        return result.get("worst_position")[:, None] * result.get("worst_direction")
    if "error" in result.data:
        return np.stack([result.get("error", component=name) for name in lengths], axis=1)
    return None
