"""How far off is the output of a mechanism with joint clearance, and which joint is to blame?

    import jointplay as jp

    m = jp.load("four-bar.toml")
    worst = jp.worst(m)                      # an xarray.Dataset over the configurations
    worst.worst_position, worst.contribution

Everything is imported when it is first used, so that the command starts fast.
"""

import importlib
from typing import TYPE_CHECKING, Any

from .questions import QUESTIONS

if TYPE_CHECKING:
    from . import examples, plot
    from .analyses.allocate import allocate
    from .analyses.allow import allow
    from .analyses.assemble import assemble, best_order
    from .analyses.calibrate import as_built, calibrate
    from .analyses.check import check
    from .analyses.compare import compare
    from .analyses.compensate import compensate
    from .analyses.design import design
    from .analyses.diagnose import diagnose
    from .analyses.forces import forces
    from .analyses.given import given
    from .analyses.life import life
    from .analyses.loaded import loaded
    from .analyses.map import map
    from .analyses.plan import plan
    from .analyses.random import random
    from .analyses.region import region
    from .analyses.sensitivity import sensitivity
    from .analyses.singularities import singularities
    from .analyses.solve import solve
    from .analyses.structural import structural
    from .analyses.sweep import sweep
    from .analyses.verify import verify
    from .analyses.workspace import workspace
    from .analyses.worst import worst
    from .basics.progress import progress
    from .errors import InputError, JointplayError
    from .exchange.exporting import export
    from .exchange.reading import read
    from .exchange.saving import save
    from .model.builder.build import Builder
    from .model.builder.sizes import backlash, bearing, diametral, fit, gap, radial
    from .model.mechanism import Mechanism, load, loads
    from .plot.animation import animate
    from .result.spreadsheets import frame, table
    from .show.reporting import report
    from .show.reporting.notebook import view

    __version__: str

__all__ = [
    "Builder",
    "InputError",
    "JointplayError",
    "Mechanism",
    "__version__",
    "allocate",
    "allow",
    "animate",
    "as_built",
    "assemble",
    "backlash",
    "bearing",
    "best_order",
    "calibrate",
    "check",
    "compare",
    "compensate",
    "design",
    "diagnose",
    "diametral",
    "examples",
    "export",
    "fit",
    "forces",
    "frame",
    "gap",
    "given",
    "life",
    "load",
    "loaded",
    "loads",
    "map",
    "plan",
    "plot",
    "progress",
    "radial",
    "random",
    "read",
    "region",
    "report",
    "save",
    "sensitivity",
    "singularities",
    "solve",
    "structural",
    "sweep",
    "table",
    "verify",
    "view",
    "workspace",
    "worst",
]

_HOMES = {name: f"analyses.{name}" for name in QUESTIONS} | {
    **dict.fromkeys(("backlash", "bearing", "diametral", "fit", "gap", "radial"), "model.builder.sizes"),
    "Builder": "model.builder.build",
    "InputError": "errors",
    "JointplayError": "errors",
    "Mechanism": "model.mechanism",
    "animate": "plot.animation",
    "as_built": "analyses.calibrate",
    "best_order": "analyses.assemble.order",
    "export": "exchange.exporting",
    "frame": "result.spreadsheets",
    "progress": "basics.progress",
    "load": "model.mechanism",
    "loads": "model.mechanism",
    "read": "exchange.reading",
    "report": "show.reporting",
    "view": "show.reporting.notebook",
    "save": "exchange.saving",
    "table": "result.spreadsheets",
}


def __getattr__(name: str) -> Any:
    if name in ("examples", "plot"):
        return importlib.import_module(f"{__name__}.{name}")
    if name == "__version__":
        return importlib.import_module(f"{__name__}.result").version()
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
