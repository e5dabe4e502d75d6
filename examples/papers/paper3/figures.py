"""The figures of the page.

Series have the colours of Okabe and Ito and each its own marker or dash; maps have even steps of lightness. Both
survive colour blindness and a black-and-white printer.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .closed_form import Floats, Upu
from .maps import LEVELS, REACH, Level, Maps
from .robot import sizes_of
from .study import ASIDE, CLEARANCES, FACTORS, FORCE, HEIGHTS, LENGTHS, MOMENT, RATIOS, Study

BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#6b6b6b"
SERIES = ((BLUE, "o", "-"), (ORANGE, "s", "--"), (GREEN, "^", "-."))
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.markersize": 4,
    "svg.hashsalt": "paper-3",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.08,
}
COLOUR_MAP = "cividis"
#: nodes along the edge of the closed form's map, and where it ends short of the singular cylinder, as a part of it
FINE, INSIDE = 161, 0.97
WORDS = {
    "radial": "radial play of the pins",
    "axial": "axial play of the pins",
    "gap": "gap of the guides",
    "pin_length": "length of the pins",
    "guide_length": "length of the guides",
    "guide_width": "width of the guides",
}


def _grid(axes: Axes) -> None:
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)


def _circle(axes: Axes) -> None:
    """The singular cylinder."""
    turn = np.linspace(0, 2 * np.pi, 361)
    radius = 2 * Upu().difference
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=RED, ls="--", lw=1.4)


def _heat(axes: Axes, x: Floats, y: Floats, values: Floats, norm: Any, lines: Any) -> Any:
    drawn = axes.pcolormesh(x, y, values.T, cmap=COLOUR_MAP, norm=norm, shading="nearest", rasterized=True)
    contours = axes.contour(x, y, values.T, levels=lines, colors="white", linewidths=0.7)
    axes.clabel(contours, fmt="%g", fontsize=7)
    axes.set(aspect="equal")
    return drawn


def _bar(figure: Figure, drawn: Any, axes: Any, label: str, extend: str) -> None:
    low, high = drawn.norm.vmin, drawn.norm.vmax
    steps = [digit * 10.0**power for power in range(-2, 3) for digit in (1, 1.5, 2, 3, 4, 5, 7)]
    ticks = [step for step in steps if low <= step <= high]
    bar = figure.colorbar(drawn, ax=axes, label=label, extend=extend, shrink=0.9, ticks=ticks)
    bar.minorticks_off()
    bar.set_ticklabels([f"{tick:g}" for tick in ticks])


def _edges(nodes: Floats) -> Floats:
    step = nodes[1] - nodes[0]
    return np.concatenate([nodes - step / 2, nodes[-1:] + step / 2])


def _changes(axes: Axes, level: Level) -> None:
    """The sides of the cells between nodes whose contacts differ."""
    x, y = _edges(level.x), _edges(level.y)
    lines = [[(x[i + 1], y[j]), (x[i + 1], y[j + 1])] for i, j in np.argwhere(level.changes[..., 0])]
    lines += [[(x[i], y[j + 1]), (x[i + 1], y[j + 1])] for i, j in np.argwhere(level.changes[..., 1])]
    axes.add_collection(LineCollection(lines, colors="black", linewidths=1.3))


def workspace(study: Study, maps: Maps) -> Figure:
    """Displacement and rotation under the load: closed form up to the cylinder, and the exact closure at z = 400 mm."""
    figure = Figure(figsize=(9.4, 8.6))
    axes_of: Any = figure.subplots(2, 2)
    level = maps.level(400.0)
    limit = 2 * Upu().difference
    line = np.linspace(-limit, limit, FINE)
    x, y = np.meshgrid(line, line, indexing="ij")
    inside = np.hypot(x, y) < INSIDE * limit
    places = np.column_stack([x[inside], y[inside], np.full(inside.sum(), level.z)])
    position, rotation = sizes_of(Upu().error(places, FORCE, MOMENT))
    for row, (wide, near, word, unit, lines) in enumerate(
        (
            (position, level.position, "displacement", "mm", (1, 2, 3, 5, 10, 20, 50)),
            (np.degrees(rotation), level.rotation, "rotation", "°", (0.2, 0.3, 0.5, 1, 2, 5)),
        )
    ):
        shown = np.full(x.shape, np.nan)
        shown[inside] = wide
        norm = LogNorm(float(near.min()), 1.2 * float(near.max()))
        left, right = axes_of[row]
        _heat(left, line, line, shown, norm, lines)
        left.plot(REACH * np.array([-1, 1, 1, -1, -1]), REACH * np.array([-1, -1, 1, 1, -1]), color="white", lw=1.2)
        left.set(title=f"{word}, closed form, first order [{unit}]", ylabel="y [mm]")
        drawn = _heat(right, level.x, level.y, near, norm, lines)
        _changes(right, level)
        right.set_title(f"{word}, general engine, exact closure [{unit}]")
        for axes in (left, right):
            _circle(axes)
            axes.set(xlabel="x [mm]", xlim=(-1.04 * limit, 1.04 * limit), ylim=(-1.04 * limit, 1.04 * limit))
        right.set(xlim=(-REACH - 5, REACH + 5), ylim=(-REACH - 5, REACH + 5))
        _bar(figure, drawn, axes_of[row], f"{word} [{unit}]", "max")
    return figure


def heights(study: Study, maps: Maps) -> Figure:
    """The same on three levels, one scale of colours for all."""
    # Labels of contours at the edges would upset the automatic layout.
    figure = Figure(figsize=(9.6, 6.0), layout="none")
    room = {"left": 0.08, "right": 0.98, "bottom": 0.09, "top": 0.94, "wspace": 0.1, "hspace": 0.2}
    axes_of: Any = figure.subplots(2, len(LEVELS), sharex=True, sharey=True, gridspec_kw=room)
    for row, (name, word, unit, lines) in enumerate(
        (("position", "displacement", "mm", (1, 2, 3, 5, 10)), ("rotation", "rotation", "°", (0.2, 0.3, 0.5, 1, 2)))
    ):
        values = [getattr(level, name) for level in maps.levels]
        norm = LogNorm(min(np.nanmin(v) for v in values), max(float(np.nanquantile(v, 0.99)) for v in values))
        for axes, level, value in zip(axes_of[row], maps.levels, values, strict=True):
            drawn = _heat(axes, level.x, level.y, value, norm, lines)
            _changes(axes, level)
            singular = np.argwhere(level.status == "singular")
            axes.plot(level.x[singular[:, 0]], level.y[singular[:, 1]], "x", color=RED, ms=7, mew=1.5, clip_on=False)
            axes.set_title(f"{word}, z = {level.z:g} mm")
        axes_of[row, 0].set_ylabel("y [mm]")
        _bar(figure, drawn, axes_of[row], f"{word} [{unit}]", "max")
    for axes in axes_of[1]:
        axes.set(xlabel="x [mm]", xlim=(-REACH, REACH), ylim=(-REACH, REACH))
    return figure


def worst(study: Study, maps: Maps) -> Figure:
    """The largest displacement and rotation that the play allows, whatever the load."""
    figure = Figure(figsize=(9.0, 3.9))
    axes_of: Any = figure.subplots(1, 2, sharey=True)
    for axes, values, word, unit, lines in (
        (axes_of[0], maps.largest.position, "largest displacement", "mm", (5, 7, 10, 15)),
        (axes_of[1], maps.largest.rotation, "largest rotation", "°", (0.7, 1, 1.5, 2)),
    ):
        norm = LogNorm(float(values.min()), float(values.max()))
        drawn = _heat(axes, maps.largest.x, maps.largest.y, values, norm, lines)
        axes.set(title=f"{word}, z = {maps.largest.z:g} mm", xlabel="x [mm]")
        _bar(figure, drawn, axes, f"{word} [{unit}]", "neither")
    axes_of[0].set_ylabel("y [mm]")
    return figure


def dependence(study: Study, maps: Maps) -> Figure:
    """Displacement and rotation over every clearance and every length of the joints."""
    figure = Figure(figsize=(9.2, 6.2))
    axes_of: Any = figure.subplots(2, 2, sharey="row", sharex="col")
    groups: tuple[tuple[str, Mapping[str, Any]], ...] = (("clearances", CLEARANCES), ("lengths", LENGTHS))
    for col, (group, names) in enumerate(groups):
        for name, (colour, marker, dash) in zip(names, SERIES, strict=True):
            usual = f"{getattr(Upu(), name):g} mm"
            exact, first = study.swept[name][:2], study.swept[name][2:]
            for row in range(2):
                axes = axes_of[row, col]
                axes.plot(
                    FACTORS[group],
                    exact[row],
                    color=colour,
                    marker=marker,
                    ls=dash,
                    label=f"{WORDS[name]} (1 = {usual})",
                )
                axes.plot(FACTORS[group], first[row], color=colour, lw=0.8, ls=":")
        axes_of[1, col].set_xlabel(f"{'clearance' if col == 0 else 'length'}, as a multiple of the example's")
        axes_of[0, col].legend(loc="upper left" if col == 0 else "upper right")
    for row, label in enumerate(("displacement [mm]", "rotation [°]")):
        axes_of[row, 0].set_ylabel(label)
        for axes in axes_of[row]:
            axes.set_ylim(0, None)
            axes.axvline(1, color=GREY, lw=0.8)
            _grid(axes)
    return figure


def structure(study: Study, maps: Maps) -> Figure:
    """Displacement and rotation over the radius of the platform and over the height."""
    figure = Figure(figsize=(9.2, 5.8))
    axes_of: Any = figure.subplots(2, 2, sharey="row", sharex="col")
    for col, (where, series, label) in enumerate(
        (
            (RATIOS, study.by_ratio, "radius of the platform / radius of the base"),
            (HEIGHTS, study.by_height, "height z of the platform [mm]"),
        )
    ):
        for row in range(2):
            axes = axes_of[row, col]
            axes.plot(where, series[row], color=BLUE, marker="o", label="exact closure")
            axes.plot(where, series[row + 2], color=ORANGE, marker="x", ls="--", label="first order")
            axes.set_yscale("log")
            axes.axvline((0.5, ASIDE[2])[col], color=GREY, lw=0.8)
            _grid(axes)
        axes_of[1, col].set_xlabel(label)
    axes_of[0, 0].set_ylabel("displacement [mm]")
    axes_of[1, 0].set_ylabel("rotation [°]")
    axes_of[0, 0].legend()
    return figure


def scatter(study: Study, maps: Maps) -> Figure:
    """How displacement and rotation scatter from unit to unit, beside the largest there can be."""
    figure = Figure(figsize=(9.2, 3.6))
    axes_of: Any = figure.subplots(1, 2, sharey=True)
    for k, (axes, label, unit) in enumerate(zip(axes_of, ("displacement", "rotation"), ("mm", "°"), strict=True)):
        edges, counts = study.scatter.edges[k], study.scatter.counts[k]
        share = 100 * counts / counts.sum()
        axes.stairs(share, edges, fill=True, color=BLUE, alpha=0.35)
        axes.stairs(share, edges, color=BLUE)
        for value, colour, dash, word in (
            (study.scatter.quantiles[0.99][k], GREEN, "-.", "99 % stay below"),
            (float(np.linalg.norm(study.poses[1].exact[3 * k : 3 * k + 3])), ORANGE, "--", "under the load"),
            (study.worst[1].exact[k], RED, "-", "worst case"),
        ):
            axes.axvline(value, color=colour, ls=dash, label=f"{word}: {value:.2f} {unit}")
        axes.set(xlabel=f"{label} [{unit}]", xlim=(0, 1.08 * study.worst[1].exact[k]))
        axes.legend(loc="upper center")
        _grid(axes)
    axes_of[0].set_ylabel("share of the specimens per bin [%]")
    return figure


FIGURES: dict[str, Callable[[Study, Maps], Figure]] = {
    "workspace": workspace,
    "heights": heights,
    "worst": worst,
    "dependence": dependence,
    "structure": structure,
    "scatter": scatter,
}


def draw_all(study: Study, maps: Maps, folder: Path, suffix: str = ".svg") -> None:
    """Write every figure; the same numbers give the same bytes with the same matplotlib."""
    folder.mkdir(parents=True, exist_ok=True)
    metadata = {"Date": None} if suffix == ".svg" else None
    with mpl.rc_context(STYLE):
        for name, draw in FIGURES.items():
            draw(study, maps).savefig(folder / f"paper-3-{name}{suffix}", dpi=130, metadata=metadata)
