"""A map as an interactive page: values under the pointer, a slider through slices, iso-surfaces in space.

Nodes without a trusted number have a colour of their own by their status; outside of the grid there is none. Lines
between nodes show where a contact changes sides. The legend names both. The page carries all that it needs and works
without a network.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from jointplay.basics import pages
from jointplay.basics.arrays import Flags, Floats, Texts
from jointplay.errors import one_line, require
from jointplay.result import Variable

from .cells import boundaries, cell_edges, crossings
from .isosurface import isosurface
from .layers import Field, Layers
from .shades import stops
from .style import mixed, theme
from .words import is_plan

#: nodes without a trusted number: how much of the grey their colour has, the rest is paper
UNTRUSTED = {
    "not_assembled": 0.35,
    "other_branch": 0.2,
    "outside_limits": 0.5,
    "singular": 0.6,
    "underconstrained": 0.8,
    "not_assemblable": 1.0,
}
#: nodes that the machine cannot reach are strewn with strokes, so that no shade of grey has to tell them
STROKES = {"other_branch": "line-ne-open", "outside_limits": "line-nw-open"}
#: along an axis so many of these nodes have a stroke, at most
MOST_STROKES = 40
#: nodes that are in order and have no value all the same, such as those without a bound
VALUELESS = "no value"
CONTACT = "a contact changes sides"
SINGULAR = "singular pose"
#: quantiles of the nodes through which iso-surfaces are drawn
LEVELS = (0.25, 0.5, 0.75)
#: slices that a slider goes through
MOST_SLICES = 101


def require_plotly() -> None:
    """Refuse pages where what draws them is not installed.

    Raises
    ------
    InputError
    """
    require("plotly", "plot", "an interactive page")


def page(layers: Layers, span: tuple[float, float]) -> str:
    """The page as HTML.

    Parameters
    ----------
    layers : Layers
        Over one to three axes.
    span : pair of float
        Range of the colours.

    Raises
    ------
    InputError
        When plotly is not installed.
    """
    figure = figure_of(layers, span)
    style = f"html, body {{ height: 100%; margin: 0; background: {theme().paper} }}"
    content = figure.to_html(include_plotlyjs=True, full_html=False, default_height="100%")
    return f"{pages.head(layers.title, style)}<body>{content}</body></html>\n"


def figure_of(layers: Layers, span: tuple[float, float]) -> Any:
    """The plotly figure of a page."""
    require_plotly()
    between = (layers.contact_change, layers.singular)
    shown = Shown(_escaped(layers.value), layers.status, *between, span, layers.bounds)
    title, value = escape(one_line(layers.title)), shown.value
    figure = (_line, _heat, _slices)[len(value.dims) - 1](shown, title)
    look = theme()
    figure.update_layout(paper_bgcolor=look.paper, plot_bgcolor=look.paper, font={"color": look.ink})
    figure.update_xaxes(gridcolor=look.faint, linecolor=look.ink, showline=True, zeroline=False)
    figure.update_yaxes(gridcolor=look.faint, linecolor=look.ink, showline=True, zeroline=False)
    return figure


@dataclass(frozen=True)
class Shown:
    """What is drawn over a grid, or over a slice of one."""

    value: Field
    status: Texts
    contact_change: Flags
    singular: Floats
    span: tuple[float, float]
    #: limits of the quantity
    bounds: tuple[float, ...]

    @property
    def words(self) -> Any:
        """What the pointer says of every node."""
        words = self.status.astype(object)
        words[self.contact_change.any(axis=-1)] += ", a contact changes sides next to it"
        return words

    def slice(self, k: int) -> Shown:
        """A slice across the last axis."""
        between = (self.contact_change[:, :, k, :2], self.singular[:, :, k, :2])
        return Shown(self.value.slice(k), self.status[:, :, k], *between, self.span, self.bounds)


def valueless(value: Field, status: Texts) -> Flags:
    """The nodes that are in order, or only strained, and have no value."""
    lacking: Flags = np.isnan(value.values) & ~np.isin(status, [*UNTRUSTED, ""])
    return lacking


def _escaped(value: Field) -> Field:
    """With names that say themselves: in a page `<` begins a tag."""
    axes = tuple(Variable(axis.dims, axis.values, *_words(axis)) for axis in value.axes)
    return Field(value.dims, value.values, *_words(value), axes)


def _words(array: Variable) -> tuple[str, str]:
    """Unit and name."""
    return escape(one_line(array.units)), escape(one_line(array.long_name))


def _named(array: Variable) -> str:
    return f"{array.long_name} [{array.units}]" if array.units else array.long_name


def _hover(value: Field) -> str:
    names = [axis.long_name for axis in value.axes]
    lines = [f"{name} = %{{{letter}:.6g}}" for name, letter in zip(names, "xyz", strict=False)]
    number = "y" if len(names) == 1 else "z"
    lines.append(f"{value.long_name}: %{{{number}:.5g}} {value.units}")
    return "<br>".join([*lines, "%{customdata}"]) + "<extra></extra>"


def _line(shown: Shown, title: str) -> Any:
    import plotly.graph_objects as go

    value = shown.value
    (along,) = value.axes
    hover = _hover(value)
    colour = {"color": theme().colours[0]}
    line = go.Scatter(
        x=along.values, y=value.values, customdata=shown.words, hovertemplate=hover, mode="lines+markers",
        line=colour, showlegend=False,
    )  # fmt: skip
    figure = go.Figure(line, {"title": title, "xaxis_title": _named(along), "yaxis_title": _named(value)})
    edges = cell_edges(along.values)
    for name, colour_, there in _statuses(shown):
        look = {"fillcolor": colour_, "line_width": 0, "layer": "below"}
        for k in np.flatnonzero(there).tolist():
            figure.add_vrect(edges[k], edges[k + 1], name=name, legendgroup=name, **look)
        figure.add_trace(_key(name, colour_))
    for k in np.flatnonzero(shown.contact_change[:-1, 0]).tolist():
        figure.add_vline(edges[k + 1], line={"color": theme().ink, "dash": "dot", "width": 1})
    if shown.contact_change.any():
        figure.add_trace(
            go.Scatter(x=[None], y=[None], mode="lines", name=CONTACT, line={"color": theme().ink, "dash": "dot"})
        )
    places = singular_places(along.values, shown.singular)
    for place in places:
        figure.add_vline(place, line=_dots())
    if places:
        figure.add_trace(go.Scatter(x=[None], y=[None], mode="lines", name=SINGULAR, line=_dots()))
    for bound in shown.bounds:
        figure.add_hline(bound, line=_dashes(), annotation_text=_limit(value, bound))
    return figure


def _dashes() -> dict[str, Any]:
    """How a limit is drawn."""
    return {"color": theme().ink, "width": 2, "dash": "dash"}


def _dots() -> dict[str, Any]:
    """How a line of singular poses is drawn."""
    return {"color": theme().alarm, "width": 2.5, "dash": "dashdot"}


def singular_places(x: Floats, parts: Floats) -> list[float]:
    """Where a map along one axis becomes singular between nodes."""
    known = np.flatnonzero(np.isfinite(parts[:-1, 0]))
    return [float(x[k] + parts[k, 0] * (x[k + 1] - x[k])) for k in known.tolist()]


def _limit(value: Field, bound: float) -> str:
    return f"limit {bound:g} {value.units}".rstrip()


def _key(name: str, colour: str) -> Any:
    """An entry of the legend for an area."""
    import plotly.graph_objects as go

    marker = {"color": colour, "symbol": "square", "size": 12, "line": {"color": theme().grey, "width": 0.5}}
    if symbol := STROKES.get(name.replace(" ", "_")):
        marker = _stroke(symbol)
    return go.Scatter(x=[None], y=[None], mode="markers", name=name, marker=marker, showlegend=True)


def _stroke(symbol: str) -> dict[str, Any]:
    return {"symbol": symbol, "size": 9, "line": {"color": theme().ink, "width": 1.2}}


def _strewn(x: Floats, y: Floats, there: Flags, name: str) -> Any:
    """Strokes on the nodes of a status."""
    import plotly.graph_objects as go

    every = tuple(-(-size // MOST_STROKES) for size in there.shape)
    i, j = (np.flatnonzero(np.arange(size) % step == 0) for size, step in zip(there.shape, every, strict=True))
    some = there[np.ix_(i, j)]
    # Of a status on few nodes all have one.
    places = np.argwhere(some) * every if some.sum() * every[0] * every[1] > there.sum() / 2 else np.argwhere(there)
    look = {"mode": "markers", "name": name, "marker": _stroke(STROKES[name.replace(" ", "_")])}
    return go.Scatter(x=x[places[:, 0]], y=y[places[:, 1]], **look, showlegend=False, hoverinfo="skip")


def _statuses(shown: Shown) -> Iterator[tuple[str, str, Flags]]:
    """Every status without a trusted number: its name, its colour, and where it is; then what has no value else."""
    for name, share in UNTRUSTED.items():
        there = np.asarray(shown.status == name)
        if there.any():
            yield name.replace("_", " "), mixed(theme().grey, theme().paper, share), there
    there = valueless(shown.value, shown.status)
    if there.any():
        yield VALUELESS, theme().paper, there


def _heat(shown: Shown, title: str) -> Any:
    import plotly.graph_objects as go

    figure = go.Figure(_plane(shown, _named(shown.value), bar=None), {"title": title})
    for name, colour, _ in _statuses(shown):
        figure.add_trace(_key(name, colour))
    _label(figure, shown.value)
    figure.update_layout(legend={"orientation": "h", "y": 1.0, "yanchor": "bottom"})
    return figure


def _plane(shown: Shown, label: str, *, bar: float | None) -> list[Any]:
    """A slice: its values, the nodes of each status, and the lines where a contact changes sides."""
    import plotly.graph_objects as go

    value = shown.value
    across, up = value.axes
    names = [across.long_name, up.long_name]
    low, high = shown.span
    if bool((value.values > high).any()):
        # As the arrow at the end of the colours does on paper.
        label = f"{label}<br>{high:.3g} and more" if label else f"{high:.3g} and more"
    traces: list[Any] = [
        go.Heatmap(
            x=across.values, y=up.values, z=value.values.T, customdata=shown.words.T, zmin=low, zmax=high,
            colorscale=stops(), colorbar={"title": {"text": label, "side": "right"}, "x": bar},
            hovertemplate=_hover(value), hoverongaps=False, name=value.long_name,
        )
    ]  # fmt: skip
    hover = "<br>".join(f"{name} = %{{{letter}:.6g}}" for name, letter in zip(names, "xy", strict=True))
    for name, colour, there in _statuses(shown):
        traces.append(
            go.Heatmap(
                x=across.values, y=up.values, z=np.where(there, 1.0, np.nan).T, showscale=False, name=name,
                colorscale=[[0.0, colour], [1.0, colour]], hoverongaps=False,
                hovertemplate=f"{hover}<br>{name}<extra></extra>",
            )
        )  # fmt: skip
        if name.replace(" ", "_") in STROKES:
            traces.append(_strewn(across.values, up.values, there, name))
    if shown.contact_change.any():
        lines = boundaries(across.values, up.values, shown.contact_change)
        x, y = (np.array([[*(point[axis] for point in line), np.nan] for line in lines]).ravel() for axis in (0, 1))
        look = {"color": theme().ink, "width": 1.5}
        traces.append(go.Scatter(x=x, y=y, mode="lines", name=CONTACT, line=look, hoverinfo="skip", showlegend=True))
    if lines := crossings(across.values, up.values, shown.singular):
        x, y = (np.array([[*(point[axis] for point in line), np.nan] for line in lines]).ravel() for axis in (0, 1))
        line = {"x": x, "y": y, "mode": "lines", "name": SINGULAR, "line": _dots()}
        traces.append(go.Scatter(**line, hoverinfo="skip", showlegend=True))
    for bound in shown.bounds:
        only = {"start": bound, "end": bound, "size": 1.0, "coloring": "none"}
        traces.append(
            go.Contour(
                x=across.values, y=up.values, z=value.values.T, contours=only, line=_dashes(),
                name=_limit(value, bound), showlegend=True, showscale=False, hoverinfo="skip",
            )
        )  # fmt: skip
    return traces


def _label(figure: Any, value: Field) -> None:
    across, up = value.axes[:2]
    figure.update_xaxes(title=_named(across), constrain="domain", showgrid=False)
    figure.update_yaxes(title=_named(up), constrain="domain", showgrid=False)
    if is_plan(across, up):
        figure.update_yaxes(scaleanchor="x")


def _slices(shown: Shown, title: str) -> Any:
    """A slice with its slider on the left, iso-surfaces on the right."""
    from plotly.subplots import make_subplots

    value = shown.value
    third = value.axes[2]
    count = third.values.size
    picks = np.unique(np.linspace(0, count - 1, min(count, MOST_SLICES)).round().astype(int)).tolist()
    figure = make_subplots(
        1, 2, specs=[[{"type": "heatmap"}, {"type": "scene"}]], column_widths=[0.42, 0.58], horizontal_spacing=0.12
    )
    owner: list[int] = []
    for k in picks:
        for trace in _plane(shown.slice(k), "", bar=0.44):
            figure.add_trace(trace.update(visible=k == picks[len(picks) // 2]), 1, 1)
            owner.append(k)
    rest = [_key(name, colour) for name, colour, _ in _statuses(shown)]
    for key in rest:
        figure.add_trace(key, 1, 1)
    surfaces = list(_surfaces(shown))
    for surface in surfaces:
        figure.add_trace(surface, 1, 2)
    always = [True] * (len(rest) + len(surfaces))
    steps = [
        {
            "method": "update",
            "label": f"{third.values[k]:g}",
            "args": [{"visible": [own == k for own in owner] + always}],
        }
        for k in picks
    ]
    prefix = {"prefix": f"{third.long_name} = ", "suffix": f" {third.units}"}
    axis = {"backgroundcolor": theme().paper, "gridcolor": theme().faint, "color": theme().ink}
    figure.update_layout(
        title=f"{title}: {_named(value)}",
        sliders=[{"active": len(picks) // 2, "steps": steps, "currentvalue": prefix, "len": 0.42}],
        scene={
            f"{letter}axis": {"title": {"text": _named(along)}, **axis}
            for letter, along in zip("xyz", value.axes, strict=True)
        },
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom"},
    )
    _label(figure, value)
    return figure


def _surfaces(shown: Shown) -> Any:
    """Iso-surfaces at quantiles, in their colours, and at the limits."""
    import plotly.graph_objects as go

    value, (low, high) = shown.value, shown.span
    known = value.values[np.isfinite(value.values)]
    axes = tuple(axis.values for axis in value.axes)
    quantiles = np.quantile(known, LEVELS).tolist() if known.size else []
    names = {level: f"{level:.4g} {value.units}" for level in quantiles}
    for level, name in (names | {bound: _limit(value, bound) for bound in shown.bounds}).items():
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
            cmin=low,
            cmax=high,
            colorscale=stops(),
            showscale=False,
            opacity=0.5,
            name=name,
            showlegend=True,
        )
