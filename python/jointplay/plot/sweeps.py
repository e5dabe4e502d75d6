"""What questions compare their answers by, against a swept value."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known
from jointplay.result import SIZES, Result, figures, typical
from jointplay.result.conclusions import extreme, tops

from .figures import curves, draw_limits, from_zero, limits_of, mark_contact, words_of
from .shades import level_lines, put_bar, shades
from .style import Style, canvas, current, limit_line, series, theme
from .words import along, brief, labelled, legend, single, title, whole_numbers

if TYPE_CHECKING:
    import xarray as xr

#: curves of a sweep beyond which a surface says more
MOST_CURVES = 6
#: lines of equal error on a surface, about
LEVELS = 6


@typed
def sweep(
    result: Result | xr.Dataset,
    quantity: str | None = None,
    *,
    surface: bool = False,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the answer against the swept value: a curve for some configurations, or a surface over both.

    On a surface, lines of equal value have it beside them, and the limit is dashed. A sweep over two keys is a surface
    over both of them, of the worst value over the configurations.

    Parameters
    ----------
    result : Dataset
        Of `sweep`.
    quantity : str, optional
        ``position`` or ``rotation`` of an error, ``used`` of limits of forces, ``structural``, ``singular_value``; the
        first one that the question has if left out.
    surface : bool
        A map over value and configuration in place of curves.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = single(result)
    dim = str(part.attrs.get("sweep", ""))
    if not dim:
        raise InputError("is not the result of a sweep", key="result")
    quantity = quantity or next(iter(figures(part)))
    if quantity not in figures(part):
        raise InputError(not_known(quantity, "a quantity", figures(part)), key="quantity")
    if "sweep_by" in part.attrs:
        return _pairs(part, quantity, axes, style)
    numeric = part.coords[dim].values.dtype.kind in "fiu"
    steps = part.sizes[dim]
    x: Any = part.coords[dim].values if numeric else np.arange(steps)
    first = curves(part.isel(dim, 0), quantity)[0]
    values = np.stack([curves(part.isel(dim, k), quantity)[0].values for k in range(steps)])
    # Of a limit of nothing any part is used without end.
    values = np.where(np.isfinite(values), values, np.nan)
    words = labelled(words_of(quantity), first.unit)
    with canvas(axes, style) as (figure, axes):
        title(axes, asked(part))
        if surface:
            where, axis = along(part)
            _surface(figure, axes, part, (x if numeric else None), where, values, words, quantity)
            whole_numbers(axes.yaxis, axis, len(where))
            axes.set_ylabel(axis)
        else:
            _lines(axes, part, part.isel(dim, 0), x, values, words, quantity)
        if not surface:
            legend(axes)
        axes.set_xlabel(_key(part, dim))
        if not numeric:
            axes.set_xticks(x, [str(v) for v in part.coords[dim].values.tolist()])
    return figure


def _pairs(part: Result, quantity: str, axes: Axes | None, style: Style | str | None) -> Figure:
    """A sweep over two keys."""
    top = next(one for one in tops(part) if one.name == quantity.replace("_", " "))
    words = extreme(words_of(quantity)) if part.sizes["configuration"] > 1 else words_of(quantity)
    dims = [str(part.attrs[name]) for name in ("sweep", "sweep_by")]
    x, y = (part.coords[dim].values if part.coords[dim].values.dtype.kind in "fiu" else None for dim in dims)
    with canvas(axes, style) as (figure, axes):
        title(axes, asked(part))
        _surface(figure, axes, part, x, y, top.values.T, labelled(words, top.unit), quantity)
        axes.set(xlabel=_key(part, dims[0]), ylabel=_key(part, dims[1]))
        for axis, values, dim in ((axes.xaxis, x, dims[0]), (axes.yaxis, y, dims[1])):
            if values is None:
                axis.set_ticks(np.arange(part.sizes[dim]), [str(value) for value in part.labels(dim)])
    return figure


def _key(part: Result, dim: str) -> str:
    """What is swept, as the file calls it, with its unit."""
    own = part.coords[dim]
    return labelled(brief(own.long_name or dim), own.units)


def asked(result: Result) -> str:
    """The question of a sweep; of a scatter also which quantile stands for it."""
    if "error_quantile" not in result.data:
        return str(result.attrs.get("question", ""))
    return f"random: {100 * typical(result):g} % of the specimens are below"


def _lines(axes: Axes, whole: Result, part: Result, x: Any, values: Any, words: str, quantity: str) -> None:
    where, axis = along(part)
    count = values.shape[1]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_CURVES)).round().astype(int))
    name, _, unit = axis.partition(" [")
    for k, c in enumerate(chosen.tolist()):
        axes.plot(x, values[:, c], label=f"{name} = {where[c]:.4g} {unit.rstrip(']')}".rstrip(), **series(k))
    if "contact" in whole.data:
        states = whole.get("contact")[:, chosen]
        mark_contact(axes, states.reshape(-1, states.shape[-1]), np.repeat(x, len(chosen)), values[:, chosen].ravel())
    axes.set_ylabel(words)
    bounds = draw_limits(axes.axhline, [part], quantity)
    from_zero(axes, [values, np.array(bounds)])


def _surface(figure: Figure, axes: Axes, part: Result, x: Any, y: Any, values: Any, words: str, quantity: str) -> None:
    """Colours of values over x and y, shape (x, y), with lines of equal value; x or y is None where it is of words."""
    if np.isfinite(values).any() and not np.nan_to_num(values).any():
        axes.annotate(
            "no error" if quantity in SIZES else "all are zero",
            (0.5, 0.5),
            xycoords="axes fraction",
            ha="center",
            color=theme().grey,
        )
        spans = (("xlim", x), ("ylim", y))
        axes.set(**{name: (min(one), max(one)) for name, one in spans if one is not None and min(one) < max(one)})
        return
    small = max(5.0, float(mpl.rcParams["legend.fontsize"]) - 1.0)
    # Between texts, such as fits, there are no values.
    colours = shades(values, LEVELS)
    if x is None or y is None or min(values.shape) < 2:
        at, up = (np.arange(n) if one is None else one for one, n in zip((x, y), values.shape, strict=True))
        mesh: Any = axes.pcolormesh(at, up, values.T, shading="nearest", rasterized=True, **colours.look)
    else:
        mesh = axes.pcolormesh(x, y, values.T, shading="gouraud", rasterized=True, **colours.look)
        level_lines(axes, x, y, values, colours, small)
        least, most = np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf)
        bounds = [b for b in limits_of([part], quantity) if least < b < most]
        if bounds:
            axes.contour(x, y, values.T, bounds, colors=theme().alarm, linewidths=1.6, linestyles=[(0, (6, 2))])
            handle = Line2D([], [], **{**limit_line(), "color": theme().alarm})
            legend(axes, ([handle], ["limit"]))
    axes.grid(visible=False)
    bar = put_bar(figure, mesh, axes, words, colours)
    if current().levels is None and not current().log:
        bar.locator = mpl.ticker.MaxNLocator(LEVELS)
        bar.update_ticks()
