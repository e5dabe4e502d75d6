"""The figures of the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

import jointplay as jp

from .study import Study, support

STEPS, BAND = "paper-2-steps.svg", "paper-2-dead-band.svg"
FIGURES = (STEPS, BAND)
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
    for name, draw in ((STEPS, steps), (BAND, dead_band)):
        with mpl.rc_context({"svg.hashsalt": "paper-2"}):
            draw(study).savefig(folder / name, metadata={"Date": None})
