"""Maps: the error over a grid as a line, a heat map, or slices of one; what cannot be reached is hatched."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke

from jointplay.basics import files
from jointplay.basics.typed import typed
from jointplay.basics.units import ANGLES, LENGTHS
from jointplay.errors import InputError
from jointplay.result import SEVERAL, Result, Variable, bounds, origin_label, quantity, rounding

from .cells import boundaries, cell_edges, crossings
from .interactive import SINGULAR, VALUELESS, page, require_plotly, singular_places, valueless
from .layers import Field, Layers
from .layout import columns_of
from .put import check_path as check_drawing
from .put import put
from .shades import Shades, colour_range, level_lines, put_bar, shades
from .style import (
    INCH,
    USUAL,
    Style,
    StyledFigure,
    as_style,
    current,
    limit_line,
    series,
    singular_line,
    theme,
    using,
)
from .words import beside, headline, is_plan, labelled, legend, room, title, wrapped

if TYPE_CHECKING:
    import xarray as xr

#: how nodes are hatched that have no trusted number
HATCHED = {
    "not_assembled": "",
    "other_branch": "////",
    "outside_limits": "\\\\\\\\",
    "singular": "xxxx",
    "underconstrained": "----",
    "not_assemblable": "++++",
}
CROSSING = "singular_crossing"
#: slices of a map with three axes
SLICES = 4
#: height and largest width of a plan, width of a slice, height of a line of letters, inches
PLAN, MOST_WIDE, SLICE, LINE = 3.7, 8.0, 3.2, 0.25
#: what labels and colours take of the width, labels and title of the height, colours alone, and labels on the left
AROUND, ABOVE, BAR, LEFT = 2.0, 0.9, 1.2, 0.7


@typed
def map(
    result: Result | xr.Dataset,
    variable: str | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw a map: a line over one axis, colours over two, slices over three.

    Parameters
    ----------
    result : xarray.Dataset
        Of `map`.
    variable : str, optional
        ``position``, ``rotation``, ``singular_value``, or a variable with labels such as ``undetermined.angle``. The
        first of these that the question has if left out.
    axes : matplotlib.axes.Axes, optional
        Where to draw a map of one or two axes; a new figure if left out.
    style : Style or {"light", "dark", "print"}, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        When it is not a map, or has no such variable.
    """
    shown = layers(result, variable)
    dims = len(shown.value.dims)
    if axes is not None and dims == 3:
        raise InputError("slices need a figure of their own; leave axes out", key="axes")
    with using(style) as chosen:
        columns = min(SLICES, max(2, columns_of(chosen, SLICE)))
        scale = _scale(shown) if dims == 2 and is_plan(*shown.value.axes) else None
        size = (6.4, 3.6) if dims == 1 else _of_slices(shown, columns) if dims == 3 else _fitting(shown, scale)
        figure = chosen.figure(*size) if axes is None else axes.get_figure()
        assert isinstance(figure, Figure)
        if dims == 3:
            _slices(shown, figure, columns)
        elif dims == 1:
            _line(shown, axes or figure.add_subplot())
        else:
            own = axes or figure.add_subplot()
            handles = _heat(shown, own, bar=True)
            wide = room(own) - 72.0 * BAR * chosen.font_size_used / USUAL
            if axes is None and scale is not None:
                wide = min(wide, 72.0 * scale * _sides(shown)[0])
            lines = legend(own, (handles, [str(handle.get_label()) for handle in handles]), wide)
            if axes is None and scale is not None and chosen.height is None:
                # Lines of a legend make the figure higher, not the plan smaller.
                figure.set_figheight(size[1] + lines / 72.0)
        if axes is None and isinstance(figure, StyledFigure):
            figure.finish()
    return figure


def layers(result: Result | xr.Dataset, variable: str | None = None) -> Layers:
    """What is drawn of a map."""
    if "grid" not in result.attrs:
        raise InputError("this is not a map; jointplay.map makes one", key="map")
    title = str(result.attrs["title"])
    for dim in (dim for dim in SEVERAL if dim in result.sizes):
        # The first one; another is drawn of a result in which it is chosen.
        label = str(_values(result, dim)[0])
        result = result.isel(dim, 0) if isinstance(result, Result) else result.isel({dim: 0})
        title = f"{title} | {dim.replace('_', ' ')} {label}"
    found = quantity(result, variable)
    status = _values(result, "status").astype(str)
    dims = str(result.attrs["grid"]).split(", ")
    between = (*status.shape, status.ndim)
    variables = result.data if isinstance(result, Result) else result.data_vars
    changes, singular = np.zeros(between, bool), np.full(between, np.nan)
    if "contact_change" in variables:
        changes = _values(result, "contact_change").astype(bool)
    if CROSSING in variables:
        singular = _values(result, CROSSING)
    trusted = np.isin(status, [*HATCHED, ""], invert=True)
    values = np.where(trusted, found.values, np.nan)
    if found.units in (*LENGTHS, *ANGLES) and np.nanmax(np.abs(values), initial=0.0) <= rounding(result, found.units):
        # Errors of which all are rounding are none.
        values = np.where(np.isfinite(values), 0.0, values)
    axes = tuple(_coordinate(result, dim) for dim in dims)
    value = Field(tuple(dims), values, found.units, found.long_name, axes)
    return Layers(value, status, changes, singular, title, bounds(result, variable))


def _values(result: Result | xr.Dataset, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    return np.asarray(result.get(name) if isinstance(result, Result) else result[name].values)


def _coordinate(result: Result | xr.Dataset, dim: str) -> Variable:
    unit = result.coords[dim].units if isinstance(result, Result) else str(result[dim].attrs.get("units", ""))
    return Variable((dim,), _values(result, dim), unit, dim)


def _fitting(shown: Layers, scale: float | None) -> tuple[float, float]:
    """Size of a figure without empty margins, inches: of a plan as wide as it has to be, or as high."""
    if scale is None:
        return 6.4, 4.6
    (wide, high), given = _sides(shown), current().width
    whole = scale * wide + _beside_plan(shown) if given is None else given / INCH
    return whole, scale * high + ABOVE * current().font_size_used / USUAL


def _scale(shown: Layers) -> float:
    """Of a plan: inches for a unit of its axes."""
    (wide, high), given = _sides(shown), current().width
    most = MOST_WIDE if given is None else max(given / INCH - _beside_plan(shown), 0.5)
    return min(PLAN / high, most / wide)


def _sides(shown: Layers) -> tuple[float, float]:
    """How far the first two axes go."""
    wide, high = (float(np.ptp(cell_edges(axis.values))) for axis in shown.value.axes[:2])
    return wide, high


def _beside_plan(shown: Layers) -> float:
    """What labels and colours take of the width of a plan, inches."""
    more_lines = beside(PLAN, _words(shown.value)).count("\n")
    return (AROUND + LINE * more_lines) * current().font_size_used / USUAL


def _of_slices(shown: Layers, columns: int) -> tuple[float, float]:
    """Size of a figure of slices, inches."""
    letters, given = current().font_size_used / USUAL, current().width
    whole = SLICE * columns if given is None else given / INCH
    wide, high = _sides(shown)
    each = max((whole - BAR * letters) / columns - LEFT * letters, 0.5)
    share = high / wide if is_plan(*shown.value.axes[:2]) else 0.8
    return whole, -(-SLICES // columns) * (share * each + ABOVE * letters) + ABOVE * letters


def _words(value: Variable) -> str:
    """What the colours mean."""
    return labelled(value.long_name, value.units)


def _heat(shown: Layers, axes: Axes, *, bar: bool, colours: Shades | None = None) -> list[Any]:
    value = shown.value
    colours = colours or shades(value.values)
    x, y = (axis.values for axis in value.axes)
    # What a logarithm cannot show is below its scale.
    drawn = np.where(value.values <= 0.0, 0.5 * colours.low, value.values) if current().log else value.values
    mesh = axes.pcolormesh(cell_edges(x), cell_edges(y), drawn.T, rasterized=True, **colours.look)
    xlabel, ylabel = (_words(axis) for axis in value.axes)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    if bar:
        _bar(axes.get_figure(), mesh, axes, value, colours)
    axes.grid(False)
    if current().levels is not None:
        level_lines(axes, x, y, value.values, colours, max(5.0, current().font_size_used - 2.0))
    handles: list[Any] = []
    for status, hatch in HATCHED.items():
        there = shown.status == status
        if there.any():
            # Node by node: contours of hatches would end between them.
            nodes, colour = np.ma.masked_where(~there, there).T, ListedColormap([theme().unreached])
            cells = axes.pcolor(cell_edges(x), cell_edges(y), nodes, cmap=colour, rasterized=True, antialiased=False)
            cells.set(hatch=hatch, edgecolor=theme().grey, linewidth=0.0)
            handles.append(
                Patch(facecolor=theme().unreached, edgecolor=theme().grey, hatch=hatch, label=status.replace("_", " "))
            )
    if valueless(value, shown.status).any():
        handles.append(Patch(facecolor=theme().paper, edgecolor=theme().grey, label=VALUELESS))
    if shown.contact_change.any():
        axes.add_collection(LineCollection(boundaries(x, y, shown.contact_change), colors=theme().ink, linewidths=1.4))
        handles.append(Line2D([], [], color=theme().ink, label="a contact changes sides"))
    if lines := crossings(x, y, shown.singular):
        look, behind = singular_line(), _behind()
        style = {"colors": look["color"], "linewidths": look["linewidth"], "linestyles": [look["linestyle"]]}
        axes.add_collection(LineCollection(lines, path_effects=behind, **style))
        handles.append(Line2D([], [], **look, path_effects=behind, label=SINGULAR))
    handles += _limits(shown, axes)
    if is_plan(*value.axes):
        axes.set_aspect("equal")
        if isinstance(figure := axes.get_figure(), StyledFigure):
            # The colours stand beside the plan, and not beside the room that it might have.
            figure.set_layout_engine("compressed")
    if bar:
        title(axes, shown.title)
    return handles


def _bar(figure: Any, mesh: Any, axes: Any, value: Variable, colours: Shades) -> None:
    """What the colours mean, beside axes."""
    assert isinstance(figure, Figure)
    put_bar(figure, mesh, axes, beside(figure.get_figheight(), _words(value)), colours)


def _limits(shown: Layers, axes: Axes) -> list[Line2D]:
    """Draw where the quantity is at a limit; the entry of a legend for it."""
    x, y = (axis.values for axis in shown.value.axes)
    known = shown.value.values[np.isfinite(shown.value.values)]
    levels = [bound for bound in shown.bounds if known.min(initial=np.inf) < bound < known.max(initial=-np.inf)]
    if not levels:
        return []
    look, behind = limit_line(), _behind()
    style = {"colors": look["color"], "linewidths": look["linewidth"], "linestyles": [look["linestyle"]]}
    axes.contour(x, y, shown.value.values.T, levels=levels, **style).set_path_effects(behind)
    return [Line2D([], [], **look, path_effects=behind, label=shown.limit)]


def _behind() -> list[AbstractPathEffect]:
    """What the dashes of a limit stand on, so that they are seen on light and dark colours."""
    return [withStroke(linewidth=3.2, foreground=theme().paper)]


def _line(shown: Layers, axes: Axes) -> None:
    value = shown.value
    (along,) = value.axes
    x = along.values
    axes.plot(x, value.values, color=series(0)["color"], marker="o" if x.size <= 60 else None)
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    edges = cell_edges(x)
    if current().log:
        axes.set_yscale("log")
    scale, levels = current().scale, current().levels
    if scale is not None:
        axes.set_ylim(*scale)
    for level in levels if isinstance(levels, tuple) else ():
        axes.axhline(level, color=theme().grey, linewidth=0.8)
    axes.set(
        xlim=(edges.min(), edges.max()), xlabel=_words(along), ylabel=beside(figure.get_figheight(), _words(value))
    )
    for k in np.flatnonzero(np.isin(shown.status, list(HATCHED))):
        axes.axvspan(
            edges[k],
            edges[k + 1],
            facecolor=theme().unreached,
            hatch=HATCHED[str(shown.status[k])],
            edgecolor=theme().grey,
            lw=0,
        )
    for k in np.flatnonzero(shown.contact_change[:-1, 0]):
        axes.axvline(edges[k + 1], color=theme().ink, linestyle=":", linewidth=1.0)
    places = singular_places(x, shown.singular)
    for place in places:
        axes.axvline(place, **singular_line())
    handles: list[Any] = [
        Patch(facecolor=theme().unreached, edgecolor=theme().grey, hatch=hatch, label=status.replace("_", " "))
        for status, hatch in HATCHED.items()
        if (shown.status == status).any()
    ]
    if shown.contact_change.any():
        handles.append(Line2D([], [], color=theme().ink, linestyle=":", label="a contact changes sides"))
    if places:
        handles.append(Line2D([], [], **singular_line(), label=SINGULAR))
    for bound in shown.bounds:
        axes.axhline(bound, **limit_line())
    if shown.bounds:
        handles.append(Line2D([], [], **limit_line(), label=shown.limit))
    title(axes, shown.title)
    legend(axes, (handles, [str(handle.get_label()) for handle in handles]))


def _slices(shown: Layers, figure: Figure, columns: int) -> None:
    """Slices along the last axis, with one scale of colours."""
    value = shown.value
    third = value.axes[2]
    picks = np.unique(np.linspace(0, third.values.size - 1, SLICES).round().astype(int))
    colours = shades(value.values)
    handles: dict[Any, Any] = {}
    rows = -(-len(picks) // columns)
    every = [figure.add_subplot(rows, columns, k + 1) for k in range(len(picks))]
    for axes, k in zip(every, picks.tolist(), strict=True):
        between = (shown.contact_change[:, :, k], shown.singular[:, :, k])
        cut = Layers(value.slice(k), shown.status[:, :, k], *between, "", shown.bounds)
        handles |= {handle.get_label(): handle for handle in _heat(cut, axes, bar=False, colours=colours)}
        said, size = f"{third.long_name} = {third.values[k]:g} {third.units}".rstrip(), current().font_size_used
        # A title takes no room in a layout.
        wide = 72.0 * (figure.get_figwidth() - BAR * size / USUAL) / columns - size
        axes.set_title(wrapped(said, wide, size), fontsize=size)
    _bar(figure, every[-1].collections[0], every, value, colours)
    if handles and current().legend != "none":
        figure.legend(handles=list(handles.values()), loc="outside lower left", ncols=columns)
    headline(figure, shown.title)


def check_path(path: Path) -> None:
    """Refuse before the work a path that no drawing of a map can be written to.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() == ".html":
        require_plotly()
        files.require_writable(path)
    else:
        check_drawing(path, more=(".html",))


@typed
def draw(
    result: Result | xr.Dataset, path: Path, variable: str | None = None, *, style: Style | str | None = None
) -> None:
    """Draw a map and write it.

    Parameters
    ----------
    result : Result or xarray.Dataset
        Of `map`.
    path : Path
        Ending in `.png`, `.svg` or `.pdf`, or in `.html` for an interactive page.
    variable : str, optional
        As for `map`.
    style : Style or {"light", "dark", "print"}, optional
    """
    check_path(path)
    if path.suffix.lower() == ".html":
        look = as_style(style or current())
        for name in (name for name in ("levels", "log") if getattr(look, name)):
            raise InputError("is for .png, .svg and .pdf; a page has neither levels nor a logarithmic scale", key=name)
        shown = layers(result, variable)
        shown = replace(shown, title=" | ".join(filter(None, (shown.title, origin_label(result)))))
        with using(style):
            text = page(shown, colour_range(shown.value.values))
        files.put(text.encode(), path)
        return
    with using(style):
        put(map(result, variable, style=style), path, result)
