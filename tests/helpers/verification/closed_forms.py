"""Friction and wear beside closed forms, and beside programs that were written apart from jointplay.

Each row is a machine of `machines` or `crossed`, what is compared of it, and by what its numbers are known.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import jointplay as jp
from helpers import crossed
from helpers.machines import (
    BUSH,
    GEAR,
    GROWTH,
    LIFE,
    SIZES,
    TURN,
    WEAR,
    drawer,
    four_bar,
    lever,
    planetary,
    screw,
    wedge,
    wheels,
)
from helpers.machines import PAPER as FOUR_BAR
from helpers.rubbing import SLIDER_CRANK
from helpers.slider_crank import slider_crank

from .subject import Array, Found

SIDES = {"forward": 1.0, "backward": -1.0}
OWN = "independent program"
DIGITS = "the digits to which the program's values are known"
EXACT = "rounding of the equilibrium"


@dataclass(frozen=True)
class Form:
    """What is compared of one machine; differences are parts of the largest number."""

    machine: str
    figure: str
    #: the closed form, or the kind of program
    known: str
    tolerance: float
    why: str
    compare: Callable[[], tuple[Any, Any]]

    @property
    def found(self) -> Found:
        ours, theirs = (np.asarray(values, dtype=float).ravel() for values in self.compare())
        return Found.of(ours, theirs, np.abs(theirs).max())


def _torques(m: jp.Mechanism) -> Array:
    return np.array([float(jp.loaded(m, approach=side).drive_torque[0, 0]) for side in SIDES])


def _efficiencies(m: jp.Mechanism) -> Array:
    return np.sort([float(jp.loaded(m, approach=side).efficiency[0]) for side in SIDES])


def _crank(part: str) -> tuple[Any, Any]:
    known = {
        "x": [[-0.08074864, -0.07779778, -0.07491610], [-0.08036635, -0.07749702, -0.08377731]],
        "torque": [[-3628.24407, -7375.18904, -5469.24482], [-5211.37594, -9213.64924, -6841.65592]],
    }
    results = [jp.loaded(jp.loads(SLIDER_CRANK), approach=side) for side in SIDES]
    return [r.error.sel(component="x") if part == "x" else r.drive_torque[:, 0] for r in results], known[part]


def _at_rest() -> tuple[Any, Any]:
    m = jp.loads(SLIDER_CRANK).with_({"drives.q.values": [30, 120]})
    result = jp.loaded(m, approach="rest").sel(component="x")
    return [result.friction_low, result.friction_high], [[-0.08174597, -0.08446948], [-0.07941743, -0.07422536]]


def _four_bar() -> tuple[Any, Any]:
    kinds = ("second", "first")
    found = [
        [jp.loaded(four_bar(holes=kind), approach=side).error.sel(component="angle") for side in SIDES]
        for kind in kinds
    ]
    return np.moveaxis(found, 2, 0), list(FOUR_BAR.values())


def _lever() -> tuple[Any, Any]:
    circle = 50.0 * 20.0 * math.sin(math.atan(0.2))
    return _torques(lever(0.5, 0.2, 7.0)), [5007.0 + circle, 4993.0 - circle]


def _drawer() -> tuple[Any, Any]:
    some = (0.05, 0.2, 0.39)
    found = [jp.loaded(drawer(mu, push=100, load=0), approach="forward") for mu in some]
    return [r.drive_torque[0, 0] for r in found], [10.0 / (1.0 - 2.5 * mu) for mu in some]


def _jam() -> tuple[Any, Any]:
    result = jp.loaded(drawer(0.6, push=100, load=0), approach="forward")
    return result.jam_coefficient[0], 80.0 / 200.0


def _wedge() -> tuple[Any, Any]:
    some, slope = (0.05, 0.1, 0.15), math.radians(20.0)
    ours = [_torques(wedge(20.0, mu)) for mu in some]
    both = [[math.tan(slope - math.atan(mu)) - mu, math.tan(slope + math.atan(mu)) + mu] for mu in some]
    ends = [[1.0 + mu * math.tan(slope - math.atan(mu)), 1.0 - mu * math.tan(slope + math.atan(mu))] for mu in some]
    return ours, -100.0 * np.array(both) / ends


def _screw() -> tuple[Any, Any]:
    some, slope = (0.05, 0.12), math.atan(4.0 / (18.0 * math.pi))
    thread = {"mean_diameter": 18, "flank_angle": 15}
    ours = [_torques(screw(4.0, -1000.0, friction={"coefficient": mu, **thread})) for mu in some]
    angles = [math.atan(mu / math.cos(math.radians(15.0))) for mu in some]
    return ours, [[9000.0 * math.tan(slope + rho), 9000.0 * math.tan(slope - rho)] for rho in angles]


def _worm() -> tuple[Any, Any]:
    slope, cosine, mu = math.atan(36.0 * 2.0 / (4.0 * 40.0)), math.cos(math.radians(20.0)), 0.1
    m = jp.loads(crossed.worm(teeth=(2, 40), more=f"friction = {mu}", torque=500.0, values="[5]"))
    tangent = math.tan(slope)
    drives = tangent * (cosine - mu * tangent) / (cosine * tangent + mu)
    return _efficiencies(m), sorted([drives, (cosine - mu / tangent) / (cosine + mu * tangent)])


def _gears() -> tuple[Any, Any]:
    m = wheels(GEAR | {"efficiency": 0.97}, apart=70.0)
    return _torques(m), [280.0 / 0.97, 280.0 * 0.97]


def _planetary() -> tuple[Any, Any]:
    i, e = 52.0 / 20.0, 0.95**2
    return _efficiencies(planetary(0.95)), sorted([(1.0 + i * e) / (1.0 + i), (1.0 + i) / (1.0 + i / e)])


def _bush() -> tuple[Any, Any]:
    return jp.life(BUSH, "loaded").growth, math.pi * 1e-4 * 1e-3 * 100.0 / 20.0


def _growth() -> tuple[Any, Any]:
    joints = {name: {"wear": wear} for name, wear in WEAR.items()}
    plays = {f"joints.{name}.clearance.{'gap' if name == 'guide' else 'radial'}": 1e-9 for name in GROWTH}
    m = slider_crank(joints).mechanism().with_(TURN | plays)
    return 1e6 * jp.life(m, "loaded").growth.values, list(GROWTH.values())


def _life() -> tuple[Any, Any]:
    m = slider_crank().mechanism().with_({"limits.position": 0.2})
    worn = {f"joints.{name}.wear": {"growth": nanometres * 1e-6} for name, nanometres in GROWTH.items()}
    result = jp.life(m.with_(worn), "loaded", tolerance=1e-9)
    return [result.life.item() * 1e-6, *result.size_worn.values], [LIFE * 1e-6, *SIZES]


FORMS = (
    Form("slider-crank", "error from both sides", OWN, 1e-7, DIGITS, lambda: _crank("x")),
    Form("slider-crank", "torque from both sides", OWN, 1e-9, DIGITS, lambda: _crank("torque")),
    Form("slider-crank", "range at rest", OWN, 1e-7, DIGITS, _at_rest),
    Form("four-bar, also with exchanged pins and holes", "rotation from both sides", OWN, 6e-7, DIGITS, _four_bar),
    Form("lever on a pin", "torque from both sides", "W a +- (W r sin phi + M)", 1e-12, EXACT, _lever),
    Form("drawer pushed beside its line", "force", "F / (1 - 2 mu e / L)", 1e-9, EXACT, _drawer),
    Form(
        "drawer pushed beside its line", "coefficient where it jams", "L / 2e", 1e-4, "steps of the coefficient", _jam
    ),
    Form(
        "wedge of three faces",
        "force from both sides",
        "W (tan(a +- p) +- mu) / (1 -+ mu tan(a +- p))",
        1e-9,
        EXACT,
        _wedge,
    ),
    Form("screw", "torque from both sides", "F d/2 tan(lead angle +- rho)", 1e-9, EXACT, _screw),
    Form("worm", "efficiency both ways", "tan g (cos a - mu tan g) / (cos a tan g + mu)", 1e-9, EXACT, _worm),
    Form("gear pair", "torque from both sides", "T r1 / r2 / e, and times e", 1e-9, EXACT, _gears),
    Form(
        "planetary gear", "efficiency both ways", "(1 + i e) / (1 + i), (1 + i) / (1 + i / e)", 1e-9, EXACT, _planetary
    ),
    Form("bush", "growth per turn", "pi k F / w", 1e-9, "sliding of a path by its chords", _bush),
    Form("slider-crank", "growth per turn", OWN, 2e-5, "midpoints and trapezoids of 720 parts", _growth),
    Form("slider-crank", "life, and sizes then", OWN, 1e-6, DIGITS, _life),
)


def rows() -> list[dict[str, Any]]:
    """A row of the page for each."""
    return [
        {
            "machine": form.machine,
            "figure": form.figure,
            "known": form.known,
            "numbers": found.numbers,
            "difference": float(f"{found.difference:.2g}"),
            "tolerance": form.tolerance,
            "why": form.why,
        }
        for form in FORMS
        for found in [form.found]
    ]
