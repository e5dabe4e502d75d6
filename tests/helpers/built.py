"""Machines that are built with known deviations, and readings of them.

Poses are those of `given` and `loaded` with offsets that are drawn anew for every approach; what instruments show of
them is computed here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import jointplay as jp
from jointplay.analyses.nominal import at_drives, nominal
from jointplay.basics import poses

DATA = Path(__file__).parents[1] / "data" / "calibrate"


@dataclass(frozen=True)
class Machine:
    """A mechanism, drive values of its readings in SI, and what is read."""

    m: jp.Mechanism
    #: shape (row, drive)
    drives: np.ndarray
    #: components of the output that are read
    components: tuple[str, ...]
    #: standard deviations in units of the file, of lengths and angles
    sigma: Mapping[str, float]


def four_bar() -> Machine:
    """A crank, a coupler and a rocker."""
    m = jp.load(DATA / "four-bar.toml")
    return Machine(m, nominal(m).drives, ("x", "y"), {"length": 0.001})


def five_bar() -> Machine:
    """Two cranks and two rods."""
    m = jp.load(DATA / "five-bar-reversal.toml").with_({"load_cases": None})
    return Machine(m, nominal(m).drives, ("x", "y"), {"length": 0.002})


def three_rrr() -> Machine:
    """A platform on three legs in the plane."""
    m = jp.load(DATA / "3-rrr.toml")
    return Machine(m, nominal(m).drives, ("x", "y", "angle"), {"length": 0.001, "angle": 0.001})


def six_axes() -> Machine:
    """An arm whose links are off by the parameters of Denavit and Hartenberg."""
    m = jp.loads(jp.examples.text("serial-6r"))
    joints = ["waist", "shoulder", "elbow", "roll", "pitch", "flange"]
    bodies = ["column", "upper_arm", "forearm", "wrist", "hand"]
    off = {"a": 0.05, "alpha": 0.02, "d": 0.05, "theta": 0.02}
    changes: dict[str, Any] = dict.fromkeys(("loads", "gravity", "bodies", "dimensions"))
    for k, body in enumerate(bodies):
        # Axes on one line have no common normal: the shoulder and the elbow are parallel, the others cross.
        changes[f"links.L{k + 1}"] = {"body": body, "between": joints[k : k + 2], **off}
    m = m.with_(changes)
    rng = np.random.default_rng(4)
    low, high = (np.radians(side) for side in ([-60, -20, -30, -60, 20, -60], [60, 40, 40, 60, 80, 60]))
    drives = low + (high - low) * rng.random((24, 6))
    return Machine(m, drives, m.components, {"length": 0.01, "angle": 0.003})


def delta() -> Machine:
    """A printer with the errors of a builder: towers, arms, rods and zeros of the motors."""
    m = jp.loads(jp.examples.text("delta-by-hand"))
    arm = "patterns.arm"
    at = [(x, y, z) for x in (-60, 0, 60) for y in (-60, 0, 60) for z in (-400, -440)]
    m = m.with_(
        {
            "loads": None,
            f"{arm}.drives.q.error": 0.5,
            f"{arm}.joints.shaft.position": {"ground": {"diameter": 0.6}},
            f"{arm}.dimensions.arm": {"body": "arm", "between": ["shaft", "elbowa"], "tolerance": 0.3},
            f"{arm}.dimensions.roda": {"body": "roda", "between": ["elbowa", "wrista"], "tolerance": 0.3},
            "path": {axis: [one[k] for one in at] for k, axis in enumerate("xyz")},
        }
    )
    return Machine(m, nominal(m).drives, ("x", "y", "z"), {"length": 0.005})


def three_upu() -> Machine:
    """A platform on three telescopic legs with unknown zeros and places of the lower joints."""
    m = jp.loads(jp.examples.text("3-upu"))
    changes: dict[str, Any] = dict.fromkeys(("loads", "limits"))
    for k in (1, 2, 3):
        changes[f"drives.l{k}.error"] = 0.3
        changes[f"joints.base{k}.position"] = {"ground": {"x": 0.2, "z": 0.2}}
    at = [(x, y, z) for x in (-40, 0, 50) for y in (-50, 0, 40) for z in (380, 430)]
    unit = 1.0 if m.units.length == 1e-3 else 1e-3 / m.units.length
    changes["path"] = {axis: [one[k] * unit for one in at] for k, axis in enumerate("xyz")}
    m = m.with_(changes)
    return Machine(m, nominal(m).drives, m.components, {"length": 0.005 * unit, "angle": 0.002})


def three_cranks() -> Machine:
    """A coupler on three cranks, one more than it needs: their lengths have to agree within the play."""
    pins = {"A": (0, 0), "B": (60, 0), "C": (120, 20)}
    crank = 50
    joints: dict[str, Any] = {}
    for name, at in pins.items():
        body = name.lower()
        play = {"clearance": {"radial": 0.02}}
        joints[f"{name}0"] = {"type": "revolute", "on": {"ground": [*at], body: [0, 0]}, **play}
        joints[f"{name}1"] = {"type": "revolute", "on": {body: [crank, 0], "rod": [*at]}, **play}
    tolerance = {"sigma": 0.004}
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": joints,
        "start": {**{name.lower(): {"angle": 30} for name in pins}, "rod": {"angle": 0}},
        "drives": {"q": {"joint": "A0", "from": 30, "to": 150, "count": 13, "error": 0.05}},
        "dimensions": {
            name.lower() + "l": {"body": name.lower(), "between": [f"{name}0", f"{name}1"], "tolerance": tolerance}
            for name in pins
        },
        "output": {"body": "rod", "at": [60, 40]},
    }
    m = jp.Mechanism(raw)
    return Machine(m, nominal(m).drives, ("x", "y", "angle"), {"length": 0.002, "angle": 0.002})


def belt_arm() -> Machine:
    """An arm whose elbow a belt drives: transmission error, and a pulley that runs out."""
    m = jp.loads(jp.examples.text("belt-arm")).with_({"loads": None, "gravity": None})
    return Machine(m, nominal(m).drives, m.components, {"length": 0.005, "angle": 0.002})


MACHINES: dict[str, Callable[[], Machine]] = {
    "four-bar": cache(four_bar),
    "five-bar": cache(five_bar),
    "3-rrr": cache(three_rrr),
    "6r": cache(six_axes),
    "delta": cache(delta),
    "3-upu": cache(three_upu),
    "belt-arm": cache(belt_arm),
    "three-cranks": cache(three_cranks),
}


def specimen(m: jp.Mechanism, seed: int) -> np.ndarray:
    """All parameters of a random machine, SI; its play is in the middle."""
    u = m.core.specimens(1, seed, None, "plain")
    return m.core.with_offsets_of(u, m.centre[None])[0]


def actual(m: jp.Mechanism, drives: np.ndarray, u: np.ndarray, seed: int) -> np.ndarray:
    """Poses of the output of a machine, one approach for each row of drive values."""
    at = at_drives(m, drives)
    assert (at.status == 0).all()
    if m.core.isostatic:
        drawn = m.core.specimens(len(drives), seed, None, "plain")
        rows = m.core.with_offsets_of(np.tile(u, (len(drives), 1)), drawn)
        found = m.core.given(at.drives, at.poses, rows)
        assert (found["status"] == 0).all()
        error = found["error"]
    else:
        error = np.array([_fitting(m, at.at(k), u, seed + k) for k in range(len(drives))])
    return displaced(at.output, error)


def _fitting(m: jp.Mechanism, at: Any, u: np.ndarray, seed: int) -> np.ndarray:
    """The error of one machine whose play is wherever it can be assembled."""
    sources = []
    for k, source in enumerate(m.compiled_sources):
        told = {**source.as_spec}
        if source.kind != "clearance":
            told |= {"set": {"interval": {"low": -1e-15, "high": 1e-15}}, "law": "uniform"}
            told["centre"] = u[m.parameter_source == k].tolist()
        sources.append(told)
    core = m.varied(sources=sources, correlations=[])
    kept = core.random(at.drives, at.poses, 2, seed, np.array([0.5]), keep=True, sampling="plain")["kept_errors"]
    assert np.isfinite(kept).all()
    return kept[0]


def displaced(nominal_poses: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Nominal poses after errors."""
    if nominal_poses.shape[1] == 3:
        return nominal_poses + error
    turned = poses.product(poses.quaternion(error[:, 3:]), poses.quaternion(nominal_poses[:, 3:]))
    return np.column_stack([nominal_poses[:, :3] + error[:, :3], poses.rotation_vector(turned)])


def readings(machine: Machine, u: np.ndarray, seed: int) -> dict[str, Any]:
    """A table of readings of a machine, with noise, in units of the file."""
    m, rng = machine.m, np.random.default_rng([11, seed])
    found = actual(m, machine.drives, u, 1000 + 1000 * seed)
    table: dict[str, Any] = {name: machine.drives[:, k] / m.drive_factors[k] for k, name in enumerate(m.drives)}
    noise = np.array([machine.sigma.get("length" if c in "xyz" else "angle", 0.0) for c in m.components])
    noise *= m.component_factors
    turned = displaced(found, rng.standard_normal(found.shape) * noise)
    for name in machine.components:
        k = m.components.index(name)
        table[name] = turned[:, k] / m.component_factors[k]
    return table
