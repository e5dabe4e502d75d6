"""A mechanism's file read into a `Linkage`: only what the tests write, and nothing is checked.

Formula: none; the file format is that of the manual. Lengths stay in the file's unit, angles become
radians, forces stay.
"""

import math
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np

from .linkage import GROUND, Joint, Linkage, Point
from .sets import Source


def read(text: str) -> Linkage:
    """Read the TOML text of a mechanism (the parts that the tests use)."""
    data = tomllib.loads(text)
    degrees = data.get("units", {}).get("angle", "deg") == "deg"
    to_rad = math.radians(1.0) if degrees else 1.0
    bodies: list[str] = []
    placements: dict[tuple[str, str], tuple[float, float]] = {}
    joints: list[Joint] = []
    sources: list[Source] = []
    shifts = _dimensions(data, sources)

    for name, entry in data["joints"].items():
        kind = entry["type"]
        made = []
        for body, placement in entry["on"].items():
            spec = placement if isinstance(placement, dict) else {"at": placement}
            axis = spec.get("axis")
            if axis is not None:
                axis = math.atan2(axis[1], axis[0]) if isinstance(axis, list) else axis * to_rad
            at = (float(spec["at"][0]), float(spec["at"][1]))
            placements[body, name] = at
            made.append(Point(body, at, axis))
            if body != GROUND and body not in bodies:
                bodies.append(body)
        first, riders = made[0], made[1:]
        default = 0.0 if kind == "fixed" else first.axis
        first = Point(first.body, first.at, first.axis if first.axis is not None else 0.0)
        for second in riders:
            second = Point(second.body, second.at, second.axis if second.axis is not None else default)
            label = name if len(riders) == 1 else f"{name}/{second.body}"
            joints.append(Joint(label, kind, first, second))
            _play(entry, label, kind, sources, to_rad)

    def moves(body: str, name: str) -> tuple[tuple[float, float, str], ...]:
        out = []
        for dim, (b, a, z) in shifts.items():
            if b == body and z == name:
                at = placements | {(b, "output"): tuple(_at(data["output"], placements))}
                (x0, y0), (x1, y1) = at[b, a], at[b, z]
                norm = math.hypot(x1 - x0, y1 - y0)
                out.append(((x1 - x0) / norm, (y1 - y0) / norm, f"{dim}.length"))
        return tuple(out)

    def moved(p: Point, name: str) -> Point:
        return Point(p.body, p.at, p.axis, moves(p.body, name.split("/")[0]))

    joints = [Joint(j.name, j.kind, moved(j.first, j.name), moved(j.second, j.name)) for j in joints]

    out = data["output"]
    place = out["at"] if isinstance(out["at"], str) else "output"
    output = Point(out["body"], tuple(_at(out, placements)), None, moves(out["body"], place))
    loads = []
    for load in data.get("loads", []):
        if "at" in load or load.get("body", out["body"]) != out["body"]:
            body = load.get("body", out["body"])
            at = load.get("at", [0.0, 0.0])
            shift = moves(body, at) if isinstance(at, str) else ()
            point = Point(body, tuple(_at({"body": body, "at": at}, placements)), None, shift)
        else:
            point = output
        fx, fy = load.get("force", [0.0, 0.0])
        loads.append((point, fx, fy, load.get("moment", 0.0)))

    names = [j.name for j in joints]
    drives, angular = [], []
    for name, d in data.get("drives", {}).items():
        joint = names.index(d["joint"])
        angle = joints[joint].kind == "revolute"
        unit = to_rad if angle else 1.0
        values = d["values"] if "values" in d else np.linspace(d["from"], d["to"], d["count"]).tolist()
        drives.append((name, joint, [v * unit for v in values]))
        angular.append(angle)
        _interval(name if name not in names else f"drive {name}", "value", d.get("error", 0.0), 0.0, sources, unit)
        lost = d.get("backlash", 0.0)
        lost = lost if isinstance(lost, dict) else lost / 2.0
        _interval(f"{name}.backlash", "value", lost, 0.0, sources, unit)

    start = np.zeros(3 * len(bodies))
    for i, body in enumerate(bodies):
        s = data.get("start", {}).get(body, {})
        start[3 * i : 3 * i + 3] = [s.get("x", 0.0), s.get("y", 0.0), s.get("angle", 0.0) * to_rad]
    spans = [math.dist(a, b) for (body, j), a in placements.items() for (c, k), b in placements.items() if body == c]
    link = Linkage(bodies, joints, drives, sources, output, loads, start, max(spans) or 1.0, degrees, angular)
    for i, j in enumerate(joints):
        if j.kind in (
            "prismatic",
            "fixed",
        ):  # a direction is known up to whole turns: the start picks the turn
            turns = round(float(link.relative(list(start), j, {}, np)[2]) / math.tau)
            joints[i] = replace(j, second=replace(j.second, axis=j.second.axis - turns * math.tau))
    return link


def _at(entry: dict[str, Any], placements: dict[tuple[str, str], tuple[float, float]]) -> tuple[float, float]:
    at = entry["at"]
    return placements[entry["body"], at] if isinstance(at, str) else (float(at[0]), float(at[1]))


def _interval(name: str, component: str, spec: Any, centre: float, sources: list[Source], unit: float = 1.0) -> None:
    if isinstance(spec, dict):
        low, high = (-3 * spec["sigma"], 3 * spec["sigma"]) if "sigma" in spec else (-spec["minus"], spec["plus"])
    else:
        low, high = -spec, spec
    if high > low or centre:
        sources.append(Source(name, "interval", (f"{name}.{component}",), (low * unit, high * unit), (centre * unit,)))


def _dimensions(data: dict[str, Any], sources: list[Source]) -> dict[str, tuple[str, str, str]]:
    shifts = {}
    for name, d in data.get("dimensions", {}).items():
        shifts[name] = (d["body"], *d["between"])
        _interval(name, "length", d.get("tolerance", 0.0), d.get("deviation", 0.0), sources)
    return shifts


def _play(entry: dict[str, Any], label: str, kind: str, sources: list[Source], to_rad: float) -> None:
    c = entry.get("clearance", {})
    if kind == "revolute" and c:
        radius = c["radial"] if "radial" in c else c["diametral"] / 2
        sources.append(Source(label, "disc", (f"{label}.x", f"{label}.y"), (radius,), (0.0, 0.0)))
    elif kind == "prismatic" and c:
        labels = (f"{label}.normal", f"{label}.angle")
        sources.append(Source(label, "diamond", labels, (c["gap"], c["length"] / 2), (0.0, 0.0)))
    elif kind == "pin_in_slot" and c:
        sources.append(Source(label, "interval", (f"{label}.normal",), (-c["gap"], c["gap"]), (0.0,)))
    elif kind == "fixed" and "angle" in entry:
        a = entry["angle"]
        _interval(label, "angle", a.get("tolerance", 0.0), a.get("deviation", 0.0), sources, to_rad)
