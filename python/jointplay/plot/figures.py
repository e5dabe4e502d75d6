"""Results over configurations, sweeps and specimens."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from jointplay.errors import InputError, in_range
from jointplay.result import Result, parts, size, typical, unit_of
from jointplay.result import blame as shares_of
from jointplay.typed import typed

from .style import COLOURS, GREY, HATCHES, LIMIT, along, canvas, labelled, light, series, single

if TYPE_CHECKING:
    import xarray as xr

Results = Mapping[str, "Result | xr.Dataset"]
Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
QUANTITIES = ("position", "rotation")
#: more sources than this are not distinguished by eye; the smaller ones become one
MOST_SOURCES = 7
#: curves of a sweep beyond which a surface says more
MOST_CURVES = 6


@typed
def error(results: Results | Result | xr.Dataset, quantity: str = "position", *, axes: Axes | None = None) -> Figure:
    """Draw the size of the error against the drive, or the number of the configuration.

    Parameters
    ----------
    results : Dataset, or mapping of label to Dataset
        Of `worst`, `loaded`, `given`, `random` (the 95 % quantile) or `compensate`; a comparison of two mechanisms.
    quantity : {"position", "rotation"}
    axes : matplotlib axes, optional
    """
    _check_quantity(quantity)
    figure, axes = canvas(axes)
    curves: list[tuple[str, Any, Floats, str, str]] = []
    for label, result in _named(results).items():
        for name, part in _mechanisms(result):
            x, words = along(part)
            for curve, values, unit in _sizes(part, quantity):
                text = " ".join(dict.fromkeys(word for word in (label, name, curve) if word))
                curves.append((text, x, values, words, unit))
    if len({words for *_, words, _ in curves}) > 1:
        curves = [(text, np.arange(len(values)), values, "configuration", unit) for text, _, values, _, unit in curves]
    for k, (text, x, values, _, _) in enumerate(curves):
        axes.plot(x, values, label=text, **series(k))
    every = [part for result in _named(results).values() for _, part in _mechanisms(result)]
    bounds = _draw_limits(axes.axhline, every, quantity)
    words, unit = curves[0][3:]
    axes.set(xlabel=words, ylabel=labelled(f"{quantity} error" if quantity == "position" else "rotation", unit))
    if words == "configuration":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _from_zero(axes, [*(values for _, _, values, _, _ in curves), np.array(bounds)])
    axes.legend()
    return figure


@typed
def blame(result: Result | xr.Dataset, quantity: str = "position", *, axes: Axes | None = None) -> Figure:
    """Draw the share of every source in the first-order error, configuration by configuration.

    Parameters
    ----------
    result : Dataset
        Of `worst`, `loaded`, `given` or `random`.
    quantity : {"position", "rotation"}
    axes : matplotlib axes, optional
    """
    _check_quantity(quantity)
    figure, axes = canvas(axes)
    part = single(result)
    found = shares_of(part)
    shares = 100.0 * np.nan_to_num(found.position if quantity == "position" else found.rotation)
    order = np.argsort(-np.abs(shares).sum(axis=0), kind="stable")
    kept = [int(s) for s in order if np.abs(shares[:, s]).max(initial=0.0) > 0.05]
    shown, rest = (kept, []) if len(kept) <= MOST_SOURCES else (kept[: MOST_SOURCES - 1], kept[MOST_SOURCES - 1 :])
    bars = [(found.causes[s], shares[:, s]) for s in shown]
    if rest:
        bars.append((f"{len(rest)} others", shares[:, rest].sum(axis=1)))
    where = np.arange(len(shares))
    above, below = np.zeros(len(shares)), np.zeros(len(shares))
    for k, (name, values) in enumerate(bars):
        bottom = np.where(values >= 0, above, below)
        colour = GREY if rest and k == len(bars) - 1 else COLOURS[k % len(COLOURS)]
        hatch = HATCHES[k % len(HATCHES)]
        axes.bar(where, values, 0.85, bottom, label=name, color=colour, edgecolor="white", hatch=hatch, linewidth=0.5)
        above, below = above + np.maximum(values, 0), below + np.minimum(values, 0)
    if below.min(initial=0.0) < 0:
        axes.axhline(0, color="black", linewidth=0.8)
    _ticks(axes, part)
    axes.set_ylabel(f"share in the {quantity} error [%]" if quantity == "position" else "share in the rotation [%]")
    axes.set_title(str(part.attrs.get("question", "")))
    if bars:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    else:
        axes.annotate("no error", (0.5, 0.5), xycoords="axes fraction", ha="center", color=GREY)
        axes.set(xlim=(-0.5, len(where) - 0.5), ylim=(0, 100))
    return figure


@typed
def sweep(
    result: Result | xr.Dataset, quantity: str = "position", *, surface: bool = False, axes: Axes | None = None
) -> Figure:
    """Draw the error against the swept value: a curve for some configurations, or a surface over both.

    Parameters
    ----------
    result : Dataset
        Of `sweep`.
    quantity : {"position", "rotation"}
    surface : bool
        A map over value and configuration in place of curves.
    axes : matplotlib axes, optional
    """
    _check_quantity(quantity)
    part = single(result)
    dim = str(part.attrs.get("sweep", ""))
    if not dim:
        raise InputError("is not the result of a sweep", key="result")
    figure, axes = canvas(axes)
    steps = part.sizes[dim]
    numeric = part.coords[dim].values.dtype.kind in "fiu"
    x: Any = part.coords[dim].values if numeric else np.arange(steps)
    parts = [_sizes(part.isel(dim, k), quantity)[0] for k in range(steps)]
    values, unit = np.stack([values for _, values, _ in parts]), parts[0][2]
    where, words = along(part.isel(dim, 0))
    title = labelled(f"{quantity} error" if quantity == "position" else "rotation", unit)
    if surface:
        mesh = axes.pcolormesh(x, where, values.T, cmap="cividis", shading="nearest")
        axes.grid(visible=False)
        # Between texts, such as fits, there are no values.
        if numeric and min(values.shape) > 1:
            lines = axes.contour(x, where, values.T, colors="white", linewidths=0.7)
            axes.clabel(lines, fontsize=7)
        figure.colorbar(mesh, ax=axes, label=title)
        axes.set_ylabel(words)
    else:
        count = values.shape[1]
        chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_CURVES)).round().astype(int))
        name, _, unit = words.partition(" [")
        for k, c in enumerate(chosen.tolist()):
            axes.plot(x, values[:, c], label=f"{name} = {where[c]:g} {unit.rstrip(']')}".rstrip(), **series(k))
        axes.set_ylabel(title)
        bounds = _draw_limits(axes.axhline, [part], quantity)
        _from_zero(axes, [values, np.array(bounds)])
        axes.legend()
    axes.set_xlabel(labelled(dim, part.coords[dim].units))
    if not numeric:
        axes.set_xticks(x, [str(v) for v in part.coords[dim].values.tolist()])
    return figure


@typed
def histogram(
    result: Result | xr.Dataset, quantity: str = "position", configuration: int = 0, *, axes: Axes | None = None
) -> Figure:
    """Draw how a quantity scatters in one configuration, with its quantiles.

    Parameters
    ----------
    result : Dataset
        Of `random`.
    quantity : {"position", "rotation"} or a component
    configuration : int
    axes : matplotlib axes, optional
    """
    part = single(result)
    if "histogram" not in part.data:
        raise InputError("has no histogram; it is the question random that has one", key="result")
    known = part.labels("quantity")
    if quantity not in known:
        raise InputError(f"'{quantity}' is not one of {', '.join(known)}", key="quantity")
    in_range(configuration, "configuration", "a configuration", 0, part.sizes["configuration"] - 1)
    figure, axes = canvas(axes)
    counts = part.get("histogram", quantity=quantity)[configuration]
    edges = part.get("edge", quantity=quantity)[configuration]
    unit = part.unit("error_quantile", quantity=quantity)
    share = 100.0 * counts / max(1, counts.sum())
    axes.stairs(share, edges, fill=True, color=COLOURS[0], alpha=0.5)
    axes.stairs(share, edges, color=COLOURS[0])
    top = float(share.max(initial=0.0))
    for k, level in enumerate(part.labels("probability")):
        value = float(part.get("error_quantile", probability=level, quantity=quantity)[configuration])
        axes.axvline(value, color=COLOURS[3], linestyle=(0, (3, 1 + k)), linewidth=1.0)
        text = f"{100 * level:g} %"
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
        axes.annotate(
            text, (value, 1.06 * top), xytext=(-2, 0), textcoords="offset points", rotation=90, ha="right", va="top",
            fontsize=7, bbox=box,
        )  # fmt: skip
    axes.set_ylim(0, 1.1 * top if top > 0 else 1.0)
    filled = np.flatnonzero(counts)
    bounds = _draw_limits(axes.axvline, [part], quantity)
    if len(filled):
        ends = [edges[max(0, filled[0] - 2)], edges[min(len(edges) - 1, filled[-1] + 3)]]
        # A limit that is near is shown; one far away would leave nothing of the histogram.
        near = [value for value in bounds if ends[0] - (ends[1] - ends[0]) < value < ends[1] + (ends[1] - ends[0])]
        low, high = min([ends[0], *near]), max([ends[1], *near])
        # A line at the frame would not be seen.
        room = 0.02 * (high - low)
        axes.set_xlim(low - room * (low in near), high + room * (high in near))
    if any(axes.get_xlim()[0] <= value <= axes.get_xlim()[1] for value in bounds):
        axes.legend()
    axes.set(
        xlabel=labelled(f"{quantity} error" if quantity != "rotation" else "rotation", unit),
        ylabel="specimens per bin [%]",
    )
    axes.set_title(f"random: configuration {configuration}, {part.attrs['samples']} specimens")
    return figure


def _draw_limits(line: Callable[..., object], results: Sequence[Result], quantity: str) -> list[float]:
    """Draw the limits of a quantity, each once, as lines across; one entry of a legend stands for all."""
    known = [result.get("limit", quantity=quantity) for result in results if "limit" in result.data]
    bounds = sorted({float(value) for limit in known for value in limit.ravel() if np.isfinite(value)})
    for k, value in enumerate(bounds):
        line(value, **LIMIT, label=None if k else "limit")
    return bounds


def _from_zero(axes: Axes, curves: Sequence[Floats]) -> None:
    """The error axis begins at no error, so that heights compare."""
    top = max((float(np.nanmax(values, initial=0.0)) for values in curves), default=0.0)
    axes.set_ylim(0, 1.1 * top if top > 0 else 1.0)


def _check_quantity(quantity: str) -> None:
    if quantity not in QUANTITIES:
        raise InputError(f"'{quantity}' is not one of {', '.join(QUANTITIES)}", key="quantity")


def _named(results: Results | Result | xr.Dataset) -> dict[str, Result]:
    # A Dataset is a mapping as well: of its variables.
    if isinstance(results, Mapping) and not hasattr(results, "data_vars"):
        return {str(label): light(result) for label, result in results.items()}
    return {"": light(results)}  # type: ignore[arg-type]


def _mechanisms(result: Result) -> list[tuple[str, Result]]:
    whole = [("", result)]
    if "mechanism" in result.sizes:
        whole = [(str(label), result.isel("mechanism", k)) for k, label in enumerate(result.labels("mechanism"))]
    return [
        (" ".join(filter(None, (name, _lower(heading)))), part) for name, each in whole for heading, part in parts(each)
    ]


def _lower(heading: str) -> str:
    """A heading within a label; names stay as they are."""
    return heading[:1].lower() + heading[1:]


def _sizes(result: Result, quantity: str) -> list[tuple[str, Floats, str]]:
    """The curves that a result has to show: name, sizes over configurations, unit."""
    unit = unit_of(result, quantity)
    if f"worst_{quantity}" in result.data:
        return [("worst", result.get(f"worst_{quantity}"), unit)]
    if "error_quantile" in result.data:
        level = typical(result)
        return [(f"{100 * level:g} %", result.get("error_quantile", probability=level, quantity=quantity), unit)]
    if "residual" in result.data:
        return [
            ("as commanded", size(result, "error", quantity), unit),
            ("corrected", size(result, "residual", quantity), unit),
        ]
    if "error" in result.data:
        return [(str(result.attrs.get("question", "")), size(result, "error", quantity), unit)]
    raise InputError("has no error to draw", key="result")


def _ticks(axes: Axes, result: Result) -> None:
    """Configurations on the axis by their drive value, not more than can be read."""
    values, words = along(result)
    every = max(1, -(-len(values) // 12))
    where = np.arange(0, len(values), every)
    axes.set_xticks(where, [f"{values[k]:g}" for k in where])
    axes.set_xlabel(words)
