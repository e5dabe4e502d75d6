"""A map as an interactive page: values under the pointer, a slider through slices, iso-surfaces in space.

The page carries all that it needs and works without a network.
"""

from __future__ import annotations

from html import escape
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.errors import JointplayError, one_line

from .isosurface import isosurface
from .layers import Layers
from .style import is_plan

if TYPE_CHECKING:
    import xarray as xr

COLOUR_SCALE = "Cividis"
#: quantiles of the nodes through which iso-surfaces are drawn
LEVELS = (0.25, 0.5, 0.75)
#: how a limit is drawn
LIMIT = {"color": "black", "width": 2, "dash": "dash"}
#: slices that a slider goes through
MOST_SLICES = 101


def page(shown: Layers, span: tuple[float, float]) -> str:
    """The page as HTML.

    Parameters
    ----------
    shown : Layers
        Over one to three axes.
    span : pair of float
        Range of the colours.

    Raises
    ------
    JointplayError
        When plotly is not installed.
    """
    text: str = figure_of(shown, span).to_html(include_plotlyjs=True, full_html=True)
    return text


def figure_of(shown: Layers, span: tuple[float, float]) -> Any:
    """The plotly figure of a page."""
    if find_spec("plotly") is None:
        raise JointplayError("an interactive page needs plotly: pip install 'jointplay[plot]'")
    value, title = _escaped(shown.value), escape(one_line(shown.title))
    words = shown.status.astype(object)
    words[shown.contact_change.any(axis=-1)] += ", a contact changes sides next to it"
    if value.ndim == 1:
        return _line(value, words, title, shown.bounds)
    return (_heat if value.ndim == 2 else _slices)(value, words, span, title, shown.bounds)


def _escaped(value: xr.DataArray) -> xr.DataArray:
    """With names that say themselves: in a page `<` begins a tag."""
    names = {dim: escape(one_line(str(dim))) for dim in value.dims}
    value = value.rename({dim: name for dim, name in names.items() if dim != name})
    for array in (value, *value.coords.values()):
        for key in ("long_name", "units"):
            array.attrs[key] = escape(one_line(str(array.attrs[key])))
    return value


def _named(array: xr.DataArray) -> str:
    unit = str(array.attrs["units"])
    return f"{array.attrs['long_name']} [{unit}]" if unit else str(array.attrs["long_name"])


def _hover(value: xr.DataArray, names: list[str]) -> str:
    lines = [f"{name} = %{{{letter}:.6g}}" for name, letter in zip(names, "xyz", strict=False)]
    number = "y" if value.ndim == 1 else "z"
    lines[len(lines) if value.ndim > 1 else 1 :] = [
        f"{value.attrs['long_name']}: %{{{number}:.5g}} {value.attrs['units']}"
    ]
    return "<br>".join([*lines, "%{customdata}"]) + "<extra></extra>"


def _line(value: xr.DataArray, words: Any, title: str, bounds: tuple[float, ...]) -> Any:
    import plotly.graph_objects as go

    along = value[value.dims[0]]
    hover = _hover(value, [str(along.name)])
    line = go.Scatter(x=along.values, y=value.values, customdata=words, hovertemplate=hover, mode="lines+markers")
    figure = go.Figure(line, {"title": title, "xaxis_title": _named(along), "yaxis_title": _named(value)})
    for bound in bounds:
        figure.add_hline(bound, line=LIMIT, annotation_text=_limit(value, bound))
    return figure


def _heat(value: xr.DataArray, words: Any, span: tuple[float, float], title: str, bounds: tuple[float, ...]) -> Any:
    import plotly.graph_objects as go

    figure = go.Figure([_plane(value, words, span, _named(value)), *_contours(value, bounds)], {"title": title})
    # Beside the title of the colours.
    figure.update_layout(legend={"orientation": "h", "y": 1.0, "yanchor": "bottom"})
    _label(figure, value)
    return figure


def _limit(value: xr.DataArray, bound: float) -> str:
    return f"limit {bound:g} {value.attrs['units']}".rstrip()


def _contours(value: xr.DataArray, bounds: tuple[float, ...]) -> list[Any]:
    """Lines where the value of a plane is at a limit."""
    import plotly.graph_objects as go

    across, up = (value[dim].values for dim in value.dims)
    return [
        go.Contour(
            x=across,
            y=up,
            z=value.values.T,
            contours={"start": bound, "end": bound, "size": 1.0, "coloring": "none"},
            line=LIMIT,
            name=_limit(value, bound),
            showlegend=True,
            showscale=False,
            hoverinfo="skip",
        )
        for bound in bounds
    ]


def _plane(value: xr.DataArray, words: Any, span: tuple[float, float], label: str) -> Any:
    import plotly.graph_objects as go

    across, up = (value[dim] for dim in value.dims)
    return go.Heatmap(
        x=across.values,
        y=up.values,
        z=value.values.T,
        customdata=words.T,
        zmin=span[0],
        zmax=span[1],
        colorscale=COLOUR_SCALE,
        colorbar={"title": label, "x": 0.46 if value.coords.get("slice") is not None else None},
        hovertemplate=_hover(value, [str(across.name), str(up.name)]),
        hoverongaps=True,
    )


def _label(figure: Any, value: xr.DataArray) -> None:
    across, up = (value[dim] for dim in value.dims[:2])
    # The grey of what cannot be reached ends where the map ends.
    figure.update_xaxes(title=_named(across), constrain="domain")
    figure.update_yaxes(title=_named(up), constrain="domain", **({"scaleanchor": "x"} if is_plan(value) else {}))
    figure.update_layout(plot_bgcolor="#d9d9d9")
    figure.update_xaxes(showgrid=False, zeroline=False)
    figure.update_yaxes(showgrid=False, zeroline=False)


def _slices(value: xr.DataArray, words: Any, span: tuple[float, float], title: str, bounds: tuple[float, ...]) -> Any:
    """A slice with its slider on the left, iso-surfaces on the right."""
    from plotly.subplots import make_subplots

    third = value[value.dims[2]]
    picks = np.unique(np.linspace(0, third.size - 1, min(third.size, MOST_SLICES)).round().astype(int)).tolist()
    figure = make_subplots(1, 2, specs=[[{"type": "heatmap"}, {"type": "scene"}]], column_widths=[0.45, 0.55])
    for k in picks:
        cut = value[:, :, k].assign_coords(slice=k)
        for trace in (_plane(cut, words[:, :, k], span, ""), *_contours(cut, bounds)):
            figure.add_trace(trace.update(visible=k == picks[len(picks) // 2]), 1, 1)
    surfaces = list(_surfaces(value, span, bounds))
    for surface in surfaces:
        figure.add_trace(surface, 1, 2)
    unit = str(third.attrs["units"])
    steps = [
        {
            "method": "update",
            "label": f"{float(third[k]):g}",
            "args": [{"visible": [j == k for j in picks for _ in (None, *bounds)] + [True] * len(surfaces)}],
        }
        for k in picks
    ]
    prefix = {"prefix": f"{third.name} = ", "suffix": f" {unit}"}
    figure.update_layout(
        title=f"{title}: {_named(value)}",
        sliders=[{"active": len(picks) // 2, "steps": steps, "currentvalue": prefix, "len": 0.45}],
        scene={f"{letter}axis_title": _named(value[dim]) for letter, dim in zip("xyz", value.dims, strict=True)},
        legend={"x": 1.0, "xanchor": "right"},
    )
    _label(figure, value)
    return figure


def _surfaces(value: xr.DataArray, span: tuple[float, float], bounds: tuple[float, ...]) -> Any:
    """Iso-surfaces at quantiles, in their colours, and at the limits."""
    import plotly.graph_objects as go

    known = value.values[np.isfinite(value.values)]
    axes = tuple(value[dim].values for dim in value.dims)
    quantiles = np.quantile(known, LEVELS).tolist() if known.size else []
    names = {level: f"{level:.4g} {value.attrs['units']}" for level in quantiles}
    for level, name in (names | {bound: _limit(value, bound) for bound in bounds}).items():
        points, triangles = isosurface(axes, value.values, level)
        if not len(triangles):
            continue
        yield go.Mesh3d(
            x=points[:, 0],
            y=points[:, 1],
            z=points[:, 2],
            i=triangles[:, 0],
            j=triangles[:, 1],
            k=triangles[:, 2],
            intensity=np.full(len(points), level),
            cmin=span[0],
            cmax=span[1],
            colorscale=COLOUR_SCALE,
            showscale=False,
            opacity=0.5,
            name=name,
            showlegend=True,
        )
