"""The sources of error in the order of results: clearances and locked angles by joint, then dimensions, then drives.

A source that the file declares stays one when its size is zero, so that results keep their shape in a sweep.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from jointplay.schema import (
    Fixed,
    MechanismFile,
    PinInSlot,
    Prismatic,
    Revolute,
    ToleranceLaw,
    ToleranceTable,
)

from .drives import Commands
from .graph import CompiledJoint, Graph

#: two points closer than this share of the mechanism's length have no direction between them
COINCIDENT = 1e-9


@dataclass(frozen=True)
class Source:
    """One thing that can be off.

    Parameters
    ----------
    name : str
    kind : str
        ``clearance``, ``angle``, ``dimension`` or ``drive``.
    components : tuple of str
        What each of its parameters is called.
    factors : tuple of float
        SI per file unit of each parameter.
    centre : tuple of float
        Known deviation of each parameter, SI.
    spec : dict
        The rest of it as the core wants it.
    """

    name: str
    kind: str
    components: tuple[str, ...]
    factors: tuple[float, ...]
    centre: tuple[float, ...]
    spec: dict[str, Any] = field(repr=False)


def compile_sources(data: MechanismFile, graph: Graph, commands: Commands, output: int, length: float) -> list[Source]:
    """All sources of a mechanism, in SI."""
    sources: list[Source] = []
    for index, joint in enumerate(graph.joints):
        source = _of_joint(data, graph, index, joint)
        if source is not None:
            sources.append(source)
    sources.extend(_of_dimension(data, graph, name, output, length) for name in data.dimensions)
    taken = {source.name for source in sources} | {joint.name for joint in graph.joints}
    for index, (name, drive) in enumerate(data.drives.items()):
        if drive.error is not None:
            label = f"drive {name}" if name in taken else name
            factor = float(commands.factors[index])
            spec = _interval(drive.error, drive.law or "uniform", factor)
            sources.append(Source(label, "drive", ("value",), (factor,), (0.0,), {"drive": index, **spec}))
    return sources


def _of_joint(data: MechanismFile, graph: Graph, index: int, joint: CompiledJoint) -> Source | None:
    length, angle = graph.units.length, graph.units.angle
    entry = data.joints[joint.pin]
    spec: dict[str, Any] = {"joint": index}
    match entry:
        case Revolute(clearance=play) if play is not None:
            spec |= {"set": {"disc": {"radius": play.radius * length}}, "law": play.law}
            return Source(joint.name, "clearance", ("x", "y"), (length, length), (0.0, 0.0), spec)
        case Prismatic(clearance=guide) if guide is not None:
            spec |= {"set": {"diamond": {"gap": guide.gap * length, "half_length": guide.length / 2.0 * length}}}
            spec |= {"law": guide.law}
            return Source(joint.name, "clearance", ("normal", "angle"), (length, angle), (0.0, 0.0), spec)
        case PinInSlot(clearance=slot) if slot is not None:
            gap = slot.gap * length
            spec |= {"set": {"interval": {"low": -gap, "high": gap}}, "law": slot.law}
            return Source(joint.name, "clearance", ("normal",), (length,), (0.0,), spec)
        case Fixed(angle=locked) if locked is not None:
            spec |= _interval(locked.tolerance, locked.law or "normal", angle)
            return Source(joint.name, "angle", ("angle",), (angle,), (locked.deviation * angle,), spec)
    return None


def _of_dimension(data: MechanismFile, graph: Graph, name: str, output: int, length: float) -> Source:
    dimension, key = data.dimensions[name], f"dimensions.{name}"
    if any(name in (joint.name, joint.pin) for joint in graph.joints):
        raise graph.refuse(f"'{name}' is the name of a joint; give the dimension another one", key)
    graph.body_index(dimension.body, f"{key}.body")
    ends: list[int] = []
    for k, place in enumerate(dimension.between):
        if place != "output":
            ends.append(graph.joint_point(dimension.body, place, f"{key}.between.{k}"))
        elif data.output.body == dimension.body:
            ends.append(output)
        else:
            problem = f"the output is on '{data.output.body}', not on '{dimension.body}'"
            raise graph.refuse(problem, f"{key}.between.{k}")
    start, end = (graph.points[p].at for p in ends)
    if math.dist(start, end) <= COINCIDENT * length:
        problem = f"{' and '.join(dimension.between)} are at the same point of '{dimension.body}'"
        raise graph.refuse(problem, f"{key}.between")
    unit = graph.units.length
    spec = {"from": ends[0], "to": ends[1], **_interval(dimension.tolerance, dimension.law or "normal", unit)}
    return Source(name, "dimension", ("length",), (unit,), (dimension.deviation * unit,), spec)


def _interval(tolerance: ToleranceTable | None, law: ToleranceLaw, factor: float) -> dict[str, Any]:
    if tolerance is None:
        return {"set": {"interval": {"low": 0.0, "high": 0.0}}, "law": law}
    interval = {"low": tolerance.low * factor, "high": tolerance.high * factor}
    if tolerance.sigma is not None:
        return {"set": {"interval": interval}, "law": "gauss", "sigma": tolerance.sigma * factor}
    return {"set": {"interval": interval}, "law": law}
