"""A planar mechanism as it is handed to the core, as a `Linkage` in millimetres, radians and newtons.

The numbers of a spec are in SI units. A clearance whose size scatters takes the size that is asked for.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .linkage import GROUND, Joint, Linkage, Point
from .sets import Source

Array = NDArray[np.float64]
#: millimetres in a metre
MM = 1e3
KINDS = ("revolute", "prismatic", "pin_in_slot", "fixed")
OFFSETS = {"revolute": ("x", "y"), "fixed": ("x", "y"), "prismatic": ("normal", "angle"), "pin_in_slot": ("normal",)}


def is_expressible(spec: dict[str, Any]) -> bool:
    """Whether a `Linkage` has all that the spec has."""
    return bool(
        spec["space"] == "planar"
        and all(joint["kind"] in KINDS for joint in spec["joints"])
        and all(s["kind"] in ("clearance", "size", "dimension", "angle", "drive", "backlash") for s in spec["sources"])
        and all(set(drive) <= {"joint"} for drive in spec["drives"])
        and all(set(load) <= {"point", "force", "moment"} for load in spec["loads"])
        and set(spec["output"]) <= {"point"}
        and not (spec["springs"] or spec["torsions"] or spec["displacements"] or spec["correlations"])
    )


def largest_growth(spec: dict[str, Any], joint: int) -> float:
    """By how much the sizes of its parts can widen a clearance, in metres."""
    total = 0.0
    for source in spec["sources"]:
        if source["kind"] == "size":
            bounds, parts = source["set"]["interval"], [source, *source.get("also", [])]
            factor = sum(part["factor"] for part in parts if part["joint"] == joint)
            total += max(factor * bounds["low"], factor * bounds["high"])
    return total


def columns(spec: dict[str, Any]) -> dict[str, int]:
    """Where the core has the parameter of every label."""
    found, at = {}, 0
    for source in spec["sources"]:
        found |= {label: at + k for k, label in enumerate(_labels(spec, source))}
        at += len(source["centre"])
    return found


def in_core(link: Linkage, spec: dict[str, Any], u: Array) -> Array:
    """Parameters in the core's order and units, from those of a linkage as the last axis of `u`."""
    where, n = columns(spec), sum(len(source["centre"]) for source in spec["sources"])
    full = np.zeros((*u.shape[:-1], n))
    for k, label in enumerate(link.labels):
        full[..., where[label]] = u[..., k] / unit(link, label)
    return full


def unit(link: Linkage, label: str) -> float:
    """What one SI unit of a parameter is in a linkage."""
    name, component = label.rsplit(".", 1)
    is_angle = link.driven_angle[int(name.partition(".")[0][1:])] if component == "value" else component == "angle"
    return 1.0 if is_angle else MM


def linkage(spec: dict[str, Any], poses: Array, drives: Array, widest: bool = False) -> tuple[Linkage, Array, Array]:
    """The linkage near `poses` [body, 3] (SI) with its poses and drive values; `widest`: clearances at their largest.

    Angles count from the poses: directions and drives are known up to whole turns.
    """
    q = (poses * [MM, MM, 1.0]).ravel()
    moves = _moves(spec)
    names = [f"b{k}" for k in range(spec["n_bodies"])]

    def point(index: int, axis: Any = None) -> Point:
        at, body = spec["points"][index]["at"], spec["points"][index]["body"]
        turn = None if axis is None else math.atan2(axis[1], axis[0])
        return Point(GROUND if body < 0 else names[body], (MM * at[0], MM * at[1]), turn, moves.get(index, ()))

    joints = [
        Joint(f"j{k}", j["kind"], point(j["first"], j["axis_first"]), point(j["second"], j["axis_second"]))
        for k, j in enumerate(spec["joints"])
    ]
    loads = [(point(d["point"]), d["force"][0], d["force"][1], MM * d["moment"][2]) for d in spec["loads"]]
    driven = [(f"d{k}", d["joint"]) for k, d in enumerate(spec["drives"])]
    is_angle = [spec["joints"][joint]["kind"] == "revolute" for _, joint in driven]
    values = np.asarray(drives) * np.where(is_angle, 1.0, MM)
    sources = [s for source in spec["sources"] for s in _source(spec, source, is_angle, widest)]
    link = Linkage(
        bodies=names,
        joints=joints,
        drives=[(name, joint, [value]) for (name, joint), value in zip(driven, values.tolist(), strict=True)],
        sources=sources,
        output=point(spec["output"]["point"]),
        loads=loads,
        start=q,
        length=MM * spec["length"],
        degrees=False,
        driven_angle=is_angle,
    )
    for k, j in enumerate(joints):
        if j.kind in ("prismatic", "fixed"):
            turns = round(float(link.relative(list(q), j, {}, np)[2]) / math.tau)
            second = Point(j.second.body, j.second.at, j.second.axis - turns * math.tau, j.second.moves)
            joints[k] = Joint(j.name, j.kind, j.first, second)
    now = np.array([link.coordinate(list(q), joint, {}) for _, joint in driven])
    values = values + np.where(is_angle, math.tau * np.round((now - values) / math.tau), 0.0)
    return link, q, values


def _labels(spec: dict[str, Any], source: dict[str, Any]) -> list[str]:
    if source["kind"] == "clearance":
        return [f"j{source['joint']}.{name}" for name in OFFSETS[spec["joints"][source["joint"]]["kind"]]]
    if source["kind"] == "angle":
        return [f"j{source['joint']}.angle"]
    if source["kind"] == "drive":
        return [f"d{source['drive']}.value"]
    if source["kind"] == "backlash":
        return [f"d{source['drive']}.backlash.value"]
    number = spec["sources"].index(source)
    return [f"s{number}.{'length' if source['kind'] == 'dimension' else 'size'}"]


def _moves(spec: dict[str, Any]) -> dict[int, tuple[tuple[float, float, str], ...]]:
    """What dimensions shift, by point."""
    found: dict[int, tuple[tuple[float, float, str], ...]] = {}
    for source in spec["sources"]:
        if source["kind"] == "dimension":
            ends = [np.array(spec["points"][source[end]]["at"][:2]) for end in ("from", "to")]
            along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            (label,) = _labels(spec, source)
            for moved in (source["to"], *source.get("together", [])):
                found[moved] = (*found.get(moved, ()), (float(along[0]), float(along[1]), label))
    return found


def _source(spec: dict[str, Any], source: dict[str, Any], is_angle: list[bool], widest: bool) -> list[Source]:
    """The source as a set; nothing for a size, and for what is exact."""
    ((kind, size),) = source["set"].items()
    labels = tuple(_labels(spec, source))
    name = labels[0].rsplit(".", 1)[0]
    angular = source["kind"] == "angle" or ("drive" in source and is_angle[source["drive"]])
    factor = 1.0 if angular else MM
    if source["kind"] == "size":
        return []
    if source["kind"] == "clearance":
        growth = largest_growth(spec, source["joint"]) if widest else 0.0
        if kind == "disc":
            return [Source(name, kind, labels, (MM * (size["radius"] + growth),), (0.0, 0.0))]
        if kind == "diamond":
            return [Source(name, kind, labels, (MM * (size["gap"] + growth), MM * size["half_length"]), (0.0, 0.0))]
    bounds = (factor * size["low"], factor * size["high"])
    centre = factor * source["centre"][0]
    exact = bounds[1] <= bounds[0] and centre == 0.0
    return [] if exact else [Source(name, "interval", labels, bounds, (centre,))]
