"""The figures of the page."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import jointplay as jp

from .fivebar import PLACES, REDUNDANT, middle
from .study import Study, support

STEPS, BAND = "paper-2-steps.svg", "paper-2-dead-band.svg"
FREELY, FIVE = "paper-2-determinate.svg", "paper-2-five-bar.svg"
FIGURES = (STEPS, BAND, FREELY, FIVE)
#: the bars of the first, second, ... step of a way
SHADES = ("#9ecae1", "#4292c6", "#084594", "#D55E00")
SERIES = (("DF", "#0072B2", "o", "-"), ("DI", "#D55E00", "s", "--"))
STYLE: Any = {
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "paper-2",
    "figure.constrained_layout.use": True,
}


def steps(study: Study) -> Figure:
    """The assembly, a panel for every step."""
    return jp.plot.assembly(support(), study.unit)


def freely(study: Study) -> Figure:
    """The determinate structure, a panel for every step."""
    return jp.plot.assembly(support(locked=False), study.freely.unit)


def five_bar(study: Study) -> Figure:
    """The four ways of figure 1: bars by step, locked joints as squares."""
    with mpl.rc_context(STYLE | {"axes.grid": False}):
        figure = Figure(figsize=(9.2, 2.7))
        for k, (letter, loop) in enumerate(study.loops.items()):
            axes = figure.add_subplot(1, len(study.loops), k + 1)
            way = loop.way
            axes.plot(*np.transpose([PLACES[end] for end in "AB"]), color="#6b6b6b", linestyle=":", zorder=1)
            for shade, bars in zip(SHADES, way.steps, strict=False):
                for bar in bars:
                    ends = [middle(bar) for bar in REDUNDANT] if bar == "KM" else [PLACES[end] for end in bar]
                    axes.plot(*np.transpose(ends), color=shade, linewidth=2.5, solid_capstyle="round", zorder=2)
            places = dict(PLACES)
            if ("KM",) in way.steps:
                places |= {name: tuple(middle(bar)) for name, bar in zip("KM", REDUNDANT, strict=True)}
            centre = np.mean([*PLACES.values()], axis=0)
            for name, at in places.items():
                locked = name in way.locked
                axes.plot(*at, "s" if locked else "o", color="black", markerfacecolor="black" if locked else "white",
                          markersize=6, zorder=3)  # fmt: skip
                outwards = (at - centre) / np.linalg.norm(at - centre)
                axes.annotate(name, at, xytext=11 * outwards, textcoords="offset points", fontsize=8, ha="center",
                              va="center")  # fmt: skip
            axes.set_title(f"({letter}) {', '.join(loop.unit.kind.values.tolist())}", fontsize=8)
            axes.set_aspect("equal")
            axes.margins(0.15)
            axes.set_axis_off()
    return figure


def dead_band(study: Study) -> Figure:
    """Forces of the redundant links in the finished structure over the clearance of all joints."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 3.4))
        axes = figure.add_subplot()
        for name, colour, marker, dash in SERIES:
            axes.plot(study.clearances, study.forces[name], color=colour, marker=marker, linestyle=dash, label=name)
        for step in (3, 5):
            needed = study.needed[step - 1]
            axes.axvline(needed, color="#6b6b6b", linestyle=":", linewidth=1.0)
            axes.annotate(f"step {step} fits from here", (needed, 0.98), xycoords=("data", "axes fraction"),
                          rotation=90, ha="right", va="top", fontsize=7)  # fmt: skip
        axes.set(xlabel="radial clearance of every joint [mm]", ylabel="force after step 5 [N], tension positive")
        axes.legend()
    return figure


def draw_all(study: Study, folder: Path) -> None:
    """Write all figures."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in ((STEPS, steps), (BAND, dead_band), (FREELY, freely), (FIVE, five_bar)):
        with mpl.rc_context({"svg.hashsalt": "paper-2"}):
            draw(study).savefig(folder / name, metadata={"Date": None})
