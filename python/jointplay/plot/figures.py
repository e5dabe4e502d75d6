"""Errors over configurations and specimens: how large they are, and what causes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from jointplay.basics.arrays import Array, Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range, not_known
from jointplay.questions import QUESTIONS, asked_by
from jointplay.result import SIZES, Result, bounds, figure, figures, parts, rounding, size, split, typical, unit_of
from jointplay.result import blame as shares_of
from jointplay.result.verdict import LOOSE

from .style import HATCHES, Style, canvas, limit_line, series, theme
from .words import along, labelled, legend, light, room, single, title, which, whole_numbers, width_of

if TYPE_CHECKING:
    import xarray as xr

Results = Mapping[str, "Result | xr.Dataset"]
#: quantities of questions that are no errors have the words of their declarations
NAMES = {name: one.words for question in QUESTIONS.values() for name, one in question.figures.items()}
NAMES |= {"position": "position error", "rotation": "rotation"}
#: more sources than this are not distinguished by eye; the smaller ones become one
MOST_SOURCES = 7
#: width of a bar, steps of the axis
BROAD = 0.85
#: width of a bar with an edge, points, at least
NARROWEST = 3.0


@dataclass(frozen=True)
class Curve:
    """A quantity over the configurations, and between what it can be where the load leaves something open."""

    name: str
    values: Floats
    unit: str
    low: Floats | None = None
    high: Floats | None = None


@typed
def error(
    results: Results | Result | xr.Dataset,
    quantity: str = "position",
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw an error against the drive, or the number of the configuration, with its limits.

    A band around `loaded` is what the load leaves open.

    Parameters
    ----------
    results : Dataset, or mapping of label to Dataset
        Of `worst`, `loaded`, `given`, `random` (the 95 % quantile) or `compensate`; a comparison of two mechanisms.
    quantity : {"position", "rotation"} or a component
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    every = [
        (" ".join(word for word in (label, name) if word), part)
        for label, result in _named(results).items()
        for name, part in mechanisms(result)
    ]
    found = [(name, part, curve) for name, part in every for curve in curves(part, quantity)]
    with canvas(axes, style) as (figure, axes):
        words = {along(part)[1] for _, part, _ in found}
        axis = words.pop() if len(words) == 1 else "configuration"
        for (name, part, curve), look in zip(found, _looks(found), strict=True):
            x = np.arange(len(curve.values)) if axis == "configuration" else along(part)[0]
            text = " ".join(dict.fromkeys(word for word in f"{name} {curve.name}".split(" ") if word))
            if curve.low is not None and curve.high is not None:
                _left_open_beside(axes, x, curve.low, curve.high, look["color"])
            axes.plot(x, curve.values, label=text, **look)
            if "contact" in part.data:
                mark_contact(axes, part.get("contact"), x, curve.values)
        bounds = draw_limits(axes.axhline, [part for _, part in every], quantity)
        axes.set(xlabel=axis, ylabel=labelled(words_of(quantity), found[0][2].unit))
        whole_numbers(axes.xaxis, axis, max(len(curve.values) for *_, curve in found))
        if len(x) == 1:
            axes.set_xticks(x)
        if quantity in SIZES:
            ends = [end for *_, curve in found for end in (curve.values, curve.high) if end is not None]
            from_zero(axes, [*ends, np.array(bounds)])
        else:
            axes.axhline(0.0, color=theme().ink, linewidth=0.6)
        legend(axes)
    return figure


def _looks(found: Sequence[tuple[str, Result, Curve]]) -> list[dict[str, Any]]:
    """How curves are drawn: each question in its colour; where one is there twice they are numbered."""
    asked = {id(part): str(part.attrs.get("question", "")) for _, part, _ in found}
    order = asked_by("error")
    if len({*asked.values()} & {*order}) < len(asked):
        return [series(k) for k in range(len(found))]
    looks = []
    for k, (_, part, _) in enumerate(found):
        number = order.index(asked[id(part)])
        again = sum(other is part for _, other, _ in found[:k])
        looks.append({**series(number + again * len(order)), "color": series(number)["color"]})
    return looks


def _left_open_beside(axes: Axes, x: Array, low: Floats, high: Floats, colour: str) -> None:
    """What the load leaves open: a bar where it is computed, and a band between two of them."""
    is_open = high - low > 1e-9 * np.nanmax(np.abs([low, high]), initial=0.0)
    look: dict[str, Any] = {"color": colour, "alpha": 0.2}
    axes.vlines(x[is_open], low[is_open], high[is_open], label="left open by the load", linewidth=6, **look)
    axes.fill_between(x, low, high, where=is_open, linewidth=0, **look)


def mark_contact(axes: Axes, states: Array, x: Array, values: Floats) -> None:
    """Mark values of a running machine at which contact may be lost, or is; states of shape (value, source)."""
    left = np.ones(len(values), dtype=bool)
    for state, marker in zip(LOOSE, ("X", "o"), strict=True):
        here = left & (states == state).any(axis=1)
        left &= ~here
        if here.any():
            look: dict[str, Any] = {"marker": marker, "s": 46, "facecolor": "none" if marker == "o" else theme().ink}
            axes.scatter(x[here], values[here], label=f"contact {state}", edgecolor=theme().ink, zorder=5, **look)


@typed
def blame(
    result: Result | xr.Dataset,
    quantity: str = "position",
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw the share of every source in the first-order error, configuration by configuration.

    Parameters
    ----------
    result : Dataset
        Of `worst`, `loaded`, `given` or `random`.
    quantity : {"position", "rotation"}
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    check_size(quantity)
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
    with canvas(axes, style) as (figure, axes):
        is_dense = len(where) * NARROWEST > room(axes)
        for k, (name, values) in enumerate(bars):
            bottom = np.where(values >= 0, above, below)
            colours = theme().colours
            colour = theme().grey if rest and k == len(bars) - 1 else colours[k % len(colours)]
            look: dict[str, Any] = {"hatch": HATCHES[k % len(HATCHES)], "edgecolor": theme().paper, "linewidth": 0.5}
            if is_dense:
                # Edges would hide bars that are as narrow as they are.
                axes.fill_between(where, bottom, bottom + values, step="mid", label=name, facecolor=colour, **look)
            else:
                axes.add_patch(PathPatch(bars_of(where, bottom, bottom + values), label=name, facecolor=colour, **look))
            above, below = above + np.maximum(values, 0), below + np.minimum(values, 0)
        axes.autoscale_view()
        if below.min(initial=0.0) < 0:
            axes.axhline(0, color=theme().ink, linewidth=0.8)
        else:
            axes.set_ylim(0.0, 100.0)
        _ticks(axes, part)
        axes.set_ylabel("share [%]; below 0: makes it smaller" if below.min(initial=0.0) < -0.05 else "share [%]")
        asked = str(part.attrs.get("question", ""))
        title(axes, f"{asked}: sources of the {words_of(quantity)}")
        if bars:
            legend(axes)
        else:
            axes.annotate("no error", (0.5, 0.5), xycoords="axes fraction", ha="center", color=theme().grey)
            axes.set(xlim=(-0.5, len(where) - 0.5), ylim=(0, 100))
    return figure


def bars_of(where: Array, ends: Floats, others: Floats) -> Path:
    """Bars, all of them as one shape."""
    left, right = where - BROAD / 2.0, where + BROAD / 2.0
    corners = [(left, ends), (right, ends), (right, others), (left, others), (left, ends)]
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    return Path(np.array(corners).transpose(2, 0, 1).reshape(-1, 2), np.tile(codes, len(where)))


@typed
def histogram(
    result: Result | xr.Dataset,
    quantity: str = "position",
    configuration: int | None = None,
    *,
    axes: Axes | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw how a quantity scatters in one configuration, with its quantiles.

    Parameters
    ----------
    result : Dataset
        Of `random`.
    quantity : {"position", "rotation"} or a component
    configuration : int, optional
        Which, counted from 0; that of the largest quantile if left out.
    axes : matplotlib axes, optional
    style : Style or {"light", "dark", "print"}, optional
    """
    part = single(result)
    if "histogram" not in part.data:
        raise InputError("has no histogram; it is the question random that has one", key="result")
    known = part.labels("quantity")
    if quantity not in known:
        raise InputError(not_known(quantity, "a quantity", known), key="quantity")
    worst = configuration is None
    chosen = worst_of(part, quantity) if configuration is None else configuration
    in_range(chosen, "configuration", "a configuration", 0, part.sizes["configuration"] - 1)
    counts = part.get("histogram", quantity=quantity)[chosen]
    edges = part.get("edge", quantity=quantity)[chosen]
    unit = part.unit("error_quantile", quantity=quantity)
    share = 100.0 * counts / max(1, counts.sum())
    top = float(share.max(initial=0.0))
    with canvas(axes, style) as (figure, axes):
        colours = theme().colours
        # Where no specimen has a pose there is nothing to draw but the limits.
        posed = bool(np.isfinite(edges).all())
        off = posed and np.abs(edges).max() > rounding(part, unit)
        if posed and not off:
            axes.annotate("no error", (0.5, 0.5), xycoords="axes fraction", ha="center", color=theme().grey)
        if off:
            axes.stairs(share, edges, fill=True, color=colours[0], alpha=0.5)
            axes.stairs(share, edges, color=colours[0])
        levels = part.labels("probability") if off else []
        values = [float(part.get("error_quantile", probability=k, quantity=quantity)[chosen]) for k in levels]
        # A median that is nothing beside the other quantiles is written as 0.
        least = 1e-3 * max(map(abs, values), default=0.0)
        for k, (level, value) in enumerate(zip(levels, values, strict=True)):
            dash = (0, (3, 1 + k))
            text = f"{100 * level:g} %: {value if abs(value) >= least else 0.0:.3g} {unit}"
            axes.axvline(value, color=colours[3 % len(colours)], linestyle=dash, linewidth=1.2, label=text)
        axes.set_ylim(0, 1.05 * top if top > 0 else 1.0)
        bounds = draw_limits(axes.axvline, [part], quantity)
        if off:
            _around_histogram(axes, counts, edges, bounds)
        else:
            axes.set_xlim(*_around([0.0, *bounds]))
        axes.set(xlabel=labelled(words_of(quantity), unit), ylabel="specimens per bin [%]")
        said = f"random: {which(part, chosen)}" + (" (the worst one)" if worst else "")
        title(axes, f"{said}, " + (f"{part.attrs['samples']} specimens" if posed else "no specimen has a pose"))
        legend(axes)
    return figure


def _around(values: Sequence[float]) -> tuple[float, float]:
    """The part of an axis that has some values, with room beside them."""
    low, high = min(values), max(values)
    beside = 0.05 * (high - low) or 1.0
    return low - beside, high + beside


def _around_histogram(axes: Axes, counts: Floats, edges: Floats, bounds: Sequence[float]) -> None:
    """The part of the axis that has specimens, and limits that are near."""
    filled = np.flatnonzero(counts)
    if not len(filled):
        return
    ends = [edges[max(0, filled[0] - 2)], edges[min(len(edges) - 1, filled[-1] + 3)]]
    # A limit that is near is shown; one far away would leave nothing of the histogram.
    near = [value for value in bounds if ends[0] - (ends[1] - ends[0]) < value < ends[1] + (ends[1] - ends[0])]
    low, high = min([ends[0], *near]), max([ends[1], *near])
    # A line at the frame would not be seen.
    edge = 0.02 * (high - low)
    axes.set_xlim(low - edge * (low in near), high + edge * (high in near))
    if not near:
        for line in axes.lines:
            if line.get_label() == "limit":
                line.set_label("_limit")


def worst_of(result: Result, quantity: str) -> int:
    """The configuration in which a quantity is largest; the first one where none is known."""
    if "error_std" in result.data and quantity in _components(result):
        # Quantiles near 1 say nothing of specimens that are off in the negative direction.
        mean, std = (result.get(name, component=quantity) for name in ("error_mean", "error_std"))
        sizes = np.abs(mean) + 2.0 * std
    else:
        sizes = np.max([np.abs(curve.values) for curve in curves(result, quantity)], axis=0)
    return int(np.nanargmax(sizes)) if np.isfinite(sizes).any() else 0


def draw_limits(line: Callable[..., object], results: Sequence[Result], quantity: str) -> list[float]:
    """Draw the limits of a quantity, each once, as lines across; one entry of a legend stands for all."""
    bounds = limits_of(results, quantity)
    for k, value in enumerate(bounds):
        line(value, **limit_line(), label=None if k else "limit")
    return bounds


def limits_of(results: Sequence[Result], quantity: str) -> list[float]:
    """The limits of a quantity, each once."""
    if quantity not in SIZES and any(quantity in figures(result) for result in results):
        return sorted({value for result in results for value in bounds(result, quantity)})
    known = [result.get("limit", quantity=quantity) for result in results if "limit" in result.data]
    return sorted({float(value) for limit in known for value in limit.ravel() if np.isfinite(value)})


def from_zero(axes: Axes, values: Sequence[Floats]) -> None:
    """The error axis begins at no error, so that heights compare."""
    top = max((float(np.nanmax(each, initial=0.0)) for each in values), default=0.0)
    # A mark on the axis is seen as a whole.
    axes.set_ylim(-0.015 * top, 1.05 * top if top > 0 else 1.0)
    if not top:
        # Where nothing is off there is nothing to scale.
        axes.set_yticks([0.0])


def check_size(quantity: str) -> None:
    """Refuse what is not the size of an error.

    Raises
    ------
    InputError
    """
    if quantity not in SIZES:
        raise InputError(not_known(quantity, "a quantity", SIZES), key="quantity")


def size_behind(quantity: str) -> str:
    """The size that a component belongs to; a size itself."""
    return quantity if quantity in SIZES else SIZES[0] if split([quantity])[0] else SIZES[1]


def words_of(quantity: str) -> str:
    """What a quantity is called on an axis."""
    return NAMES.get(quantity, f"error in {quantity}")


def _named(results: Results | Result | xr.Dataset) -> dict[str, Result]:
    # A Dataset is a mapping as well: of its variables.
    if isinstance(results, Mapping) and not hasattr(results, "data_vars"):
        return {str(label): light(result) for label, result in results.items()}
    return {"": light(results)}  # type: ignore[arg-type]


def mechanisms(result: Result) -> list[tuple[str, Result]]:
    """The results of every mechanism of a comparison, of every output and load case, each with its label."""
    whole = [("", result)]
    if "mechanism" in result.sizes:
        whole = [(str(label), result.isel("mechanism", k)) for k, label in enumerate(result.labels("mechanism"))]
    return [
        (" ".join(filter(None, (name, _lower(heading)))), part) for name, each in whole for heading, part in parts(each)
    ]


def _lower(heading: str) -> str:
    """A heading within a label; names stay as they are."""
    return heading[:1].lower() + heading[1:]


def curves(result: Result, quantity: str) -> list[Curve]:
    """The curves that a result has to show of a size or of a component of its error; what is rounding is nothing.

    Raises
    ------
    InputError
        When it has no such quantity, or no error.
    """
    found = _curves(result, quantity)
    is_error = quantity in SIZES or quantity in _components(result)
    return [_without_rounding(result, one) for one in found] if is_error else found


def _without_rounding(result: Result, curve: Curve) -> Curve:
    """A curve of errors of which all are rounding is one of zeros; else small ones stand for what they are."""
    if np.nanmax(np.abs(curve.values), initial=0.0) > rounding(result, curve.unit):
        return curve
    return replace(curve, values=np.where(np.isfinite(curve.values), 0.0, curve.values))


def _curves(result: Result, quantity: str) -> list[Curve]:
    known = tuple(dict.fromkeys((*SIZES, *figures(result), *_components(result))))
    if quantity not in known:
        raise InputError(not_known(quantity, "a quantity", known), key="quantity")
    asked = str(result.attrs.get("question", ""))
    if quantity in figures(result) and quantity not in SIZES:
        return [Curve(asked, *figure(result, quantity))]
    if "worst_position" in result.data:
        if quantity in SIZES:
            return [Curve("worst", result.get(f"worst_{quantity}"), unit_of(result, quantity))]
        unit = result.unit("worst_component", component=quantity)
        ends = (result.get("worst_component", component=quantity, side=side) for side in ("low", "high"))
        return [Curve(f"worst {side}", values, unit) for side, values in zip(("low", "high"), ends, strict=True)]
    if "error_quantile" in result.data:
        level = typical(result)
        values = result.get("error_quantile", probability=level, quantity=quantity)
        return [Curve(f"{100 * level:g} %", values, result.unit("error_quantile", quantity=quantity))]
    if "correction" in result.data:
        pairs = (("as commanded", "error"), ("corrected", "residual"))
        if quantity in SIZES:
            unit = unit_of(result, quantity)
            return [Curve(words, result.get(f"{name}_{quantity}"), unit) for words, name in pairs]
        if "residual_component" in result.data:
            raise InputError("of the worst case only its sizes are drawn", key="quantity")
        return [Curve(words, *_of_error(result, name, quantity)) for words, name in pairs]
    if "error" in result.data:
        return [Curve(asked, *_of_error(result, "error", quantity), *_left_open(result, quantity))]
    raise InputError("has no error to draw", key="result")


def _components(result: Result) -> list[str]:
    return result.labels("component") if "component" in result.coords else []


def _of_error(result: Result, name: str, quantity: str) -> tuple[Floats, str]:
    """Values of an error, and their unit."""
    if quantity in SIZES:
        return size(result, name, quantity), unit_of(result, quantity)
    return result.get(name, component=quantity), result.unit(name, component=quantity)


def _left_open(result: Result, quantity: str) -> tuple[Floats | None, Floats | None]:
    """Between what an error can be where the load leaves offsets open; nothing where it leaves none."""
    if "undetermined" not in result.data:
        return None, None
    lengths, angles = split(result.labels("component"))
    names = {"position": lengths, "rotation": angles}.get(quantity, [quantity])
    error, half = (
        np.stack([result.get(name, component=c) for c in names], axis=-1) for name in ("error", "undetermined")
    )
    if not np.nanmax(np.abs(half), initial=0.0) > 1e-9 * np.nanmax(np.abs(error), initial=0.0):
        return None, None
    if quantity not in SIZES:
        return (error - half)[..., 0], (error + half)[..., 0]
    # Components are bounded one by one: the nearest and the farthest point of the box.
    least, most = np.maximum(np.abs(error) - half, 0.0), np.abs(error) + half
    return np.linalg.norm(least, axis=-1), np.linalg.norm(most, axis=-1)


def _ticks(axes: Axes, result: Result) -> None:
    """Configurations on the axis by their drive value, not more than can be read."""
    values, words = along(result)
    texts = [f"{value:.4g}" for value in values]
    letters = float(axes.xaxis.get_label().get_fontsize())
    most = max(2, int(room(axes) / (letters + max(width_of(text, letters) for text in texts))))
    where = np.arange(0, len(values), max(1, -(-len(values) // most)))
    axes.set_xticks(where, [texts[k] for k in where])
    axes.set_xlabel(words)
