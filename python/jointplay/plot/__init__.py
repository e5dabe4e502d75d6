"""Drawings of mechanisms and results; needs matplotlib, pages of maps plotly (`pip install 'jointplay[plot]'`).

Every function returns a `matplotlib.figure.Figure`, or draws into the axes it is given. Colours are those of Okabe and
Ito, and series differ in marker and dash as well, so that a drawing survives colour blindness and a black-and-white
printer.
"""

from importlib.util import find_spec

from jointplay.errors import JointplayError

if find_spec("matplotlib") is None:
    raise JointplayError("drawing needs matplotlib: pip install 'jointplay[plot]'")

from .allocate import allocate, cost_curve
from .allow import allow
from .assembly import assembly
from .figures import blame, error, histogram, sweep
from .linkage import mechanism
from .map import draw as draw_map
from .map import map
from .pareto import pareto, reactions
from .sheet import check_path, draw

__all__ = [
    "allocate",
    "allow",
    "assembly",
    "blame",
    "check_path",
    "cost_curve",
    "draw",
    "draw_map",
    "error",
    "histogram",
    "map",
    "mechanism",
    "pareto",
    "reactions",
    "sweep",
]


def __dir__() -> list[str]:
    # What --plot calls is not for users.
    return sorted({*__all__} - {"check_path", "draw", "draw_map"})
