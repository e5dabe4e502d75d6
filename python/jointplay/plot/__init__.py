"""Drawings of mechanisms and results; needs matplotlib, pages of maps plotly (`pip install 'jointplay[plot]'`).

Every function returns a `matplotlib.figure.Figure`, or draws into the axes it is given. A `Style` says how it looks.
Colours are those of Okabe and Ito, and series differ in marker and dash as well, so that a drawing survives colour
blindness and a black-and-white printer.
"""

# ruff: noqa: E402 - a package that is missing is said before its import fails

from jointplay.errors import require

require("matplotlib", "plot", "drawing")

from .allocate import allocate, cost_curve
from .allow import allow
from .assembly import assembly
from .calibrate import calibrate
from .cloud import cloud
from .corrections import correction
from .design import front, held
from .figures import blame, error, histogram
from .life import life
from .linkage import mechanism
from .map import draw as draw_map
from .map import map
from .pareto import pareto, reactions
from .paths import displaced_path
from .put import check_path
from .sheet import Drawn, draw
from .singular import distance, nearness
from .structural import structural
from .style import Style
from .sweeps import sweep
from .workspace import workspace

__all__ = [
    "Drawn",
    "Style",
    "allocate",
    "allow",
    "assembly",
    "blame",
    "calibrate",
    "check_path",
    "cloud",
    "correction",
    "cost_curve",
    "displaced_path",
    "distance",
    "draw",
    "draw_map",
    "error",
    "front",
    "held",
    "histogram",
    "life",
    "map",
    "mechanism",
    "nearness",
    "pareto",
    "reactions",
    "structural",
    "sweep",
    "workspace",
]


def __dir__() -> list[str]:
    # What --plot calls is not for users.
    return sorted({*__all__} - {"Drawn", "check_path", "draw", "draw_map"})
