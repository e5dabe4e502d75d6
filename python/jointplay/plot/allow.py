"""Sizes of the sources beside those that are allowed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result

from .bars import pairs
from .style import Style
from .words import light, of_unit

if TYPE_CHECKING:
    import xarray as xr

#: an allowed size that many times the largest size is cut off: it says no more than that there is no limit
CUT = 8.0


@typed
def allow(
    result: Result | xr.Dataset,
    unit: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the size of every source beside the largest one with which the limits hold.

    Parameters
    ----------
    result : Dataset
        Of `allow`.
    unit : str, optional
        Which sources: lengths and angles have axes of their own. That of the first source if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = light(result)
    if "allowed" not in part.data:
        raise InputError("is not the result of allow", key="result")
    own, names, unit = of_unit(part.labels("source"), part.labels("source_unit"), unit, "source")
    size, allowed, status, fit = (part.get(name)[own] for name in ("size", "allowed", "status", "fit"))
    largest = float(max(size.max(initial=0.0), _typical(allowed)))
    end = CUT * largest if largest > 0.0 else 1.0
    cut = [f"{value:.4g}" if value > end else "" for value in allowed]
    words = ["" if one == "ok" else str(one).replace("_", " ") for one in status]
    notes = [" ".join(filter(None, map(str, parts))) for parts in zip(fit, words, cut, strict=True)]
    shown = np.minimum(np.nan_to_num(allowed), end)
    return pairs(axes, style, names, {"size": size, "allowed": shown}, 0, notes, 1.15, unit)


def _typical(allowed: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """The median of the sizes that are allowed."""
    known = allowed[np.isfinite(allowed)]
    return float(np.median(known)) if known.size else 0.0
