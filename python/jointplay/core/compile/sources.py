"""The sources of error in the order of results: those of joints, then dimensions, links, drives and heat.

A source that the file declares stays one when its size is zero, so that results keep their shape in a sweep.
"""

import math
from collections.abc import Iterator, Mapping

from jointplay.core.sets import between, of_clearance
from jointplay.core.spec import GrowthSpec, SourcePart
from jointplay.errors import InputError
from jointplay.file.schema import (
    Coupling,
    Drive,
    LawTable,
    LockedAngle,
    MechanismFile,
    Mesh,
    SizedClearance,
    law_in_core,
)

from .couplings import play_at_rim
from .drives import Commands, coordinate_factor
from .followers import of_followers
from .graph import TURNS, CompiledJoint, Graph
from .places import of_links, of_places, of_wheel
from .sizes import Size, sizes_of
from .source import COINCIDENT, CompiledSource, interval
from .thermal import Growth, growth


def compile_sources(
    data: MechanismFile,
    graph: Graph,
    commands: Commands,
    outputs: Mapping[str, tuple[str, int]],
    length: float,
    owners: tuple[int, ...],
) -> list[CompiledSource]:
    """All sources of a mechanism, in SI; of the outputs body and point by name, of further pieces their bodies."""
    sources: list[CompiledSource] = []
    grown = growth(data, graph, owners)
    last_of_pin = {joint.pin: index for index, joint in enumerate(graph.joints)}
    for index, joint in enumerate(graph.joints):
        sources.extend(_of_joint(data, graph, index, joint, length))
        if grown is not None and joint.pin in data.joints:
            _grow(sources, grown, data, graph, index)
        if index == last_of_pin[joint.pin] and joint.pin in data.joints:
            sources.extend(of_places(data, graph, joint.pin))
    sources.extend(of_followers(data, graph))
    sources.extend(_of_dimension(data, graph, name, outputs, length) for name in data.dimensions)
    sources.extend(of_links(data, graph, outputs, length))
    taken = {source.name for source in sources} | {joint.name for joint in graph.joints}
    for index, (name, drive) in enumerate(data.drives.items()):
        if drive.error is not None or drive.deviation:
            label = f"drive {name}" if name in taken else name
            factor = float(commands.factors[index])
            spec = interval(drive.error, drive.law or "uniform", factor) | {"drive": index}
            known = (drive.deviation * factor,)
            sources.append(CompiledSource(label, "drive", ("value",), (factor,), known, spec))
        sources.extend(_of_backlash(graph, name, drive, index))
    if grown is not None:
        sources.append(_of_temperature(data, grown.moves(graph), {source.name for source in sources}))
    return sources


def _grow(sources: list[CompiledSource], grown: Growth, data: MechanismFile, graph: Graph, joint: int) -> None:
    """Lets the play of a joint grow; where its sizes scatter, the radius is that in the middle and may be negative."""
    own = [source for source in sources if source.spec.get("joint") == joint]
    for source in own:
        ((_, size),) = source.spec["set"].items()
        if source.kind == "clearance" and "radius" in size:
            radius = size["radius"] + grown.of_play(data, graph, joint)
            if radius < 0.0 and not any(other.kind == "size" for other in own):
                raise grown.too_tight(graph, joint, radius)
            size["radius"] = radius


def _of_temperature(data: MechanismFile, moves: list[GrowthSpec], taken: set[str]) -> CompiledSource:
    assert data.temperature is not None
    given = data.temperature
    name = "temperature" if "temperature" not in taken else "thermal growth"
    spec = interval(given.tolerance, given.law or "normal", 1.0) | {"kind": "growth", "moves": moves}
    return CompiledSource(name, "thermal", ("difference",), (1.0,), (given.deviation,), spec)


def _of_joint(
    data: MechanismFile, graph: Graph, index: int, joint: CompiledJoint, length: float
) -> list[CompiledSource]:
    # Pieces of an elastic body are joined without the file saying so.
    entry, units = data.joints.get(joint.pin), graph.units
    locked, play = getattr(entry, "angle", None), getattr(entry, "clearance", None)
    sources: list[CompiledSource] = []
    if play is not None:
        gap, sizes = _sizes(graph, joint, play)
        if isinstance(entry, Mesh):
            components, shape = entry.held, between(*play_at_rim(entry, units))
        else:
            components, shape = of_clearance(play, gap, units.length, length)
        if joint.kind == "fixed":
            # The pin of a locked hinge is given in the joint's own axes, as its angle is.
            components = ("along", "normal")
        factors = tuple(units.angle if component in TURNS else units.length for component in components)
        spec: SourcePart = {"joint": index, "set": shape, "law": play.law}
        sources.append(CompiledSource(joint.name, "clearance", components, factors, (0.0,) * len(components), spec))
        sources.extend(_of_sizes(graph, index, joint, play, sizes))
    if isinstance(locked, LockedAngle):
        spec = interval(locked.tolerance, locked.law or "normal", units.angle) | {"joint": index}
        name = f"{joint.name}.lock" if sources else joint.name
        sources.append(
            CompiledSource(name, "angle", ("angle",), (units.angle,), (locked.deviation * units.angle,), spec)
        )
    if isinstance(entry, Coupling):
        sources.extend(_of_coupling(entry, graph, joint, index))
    return sources


def _sizes(graph: Graph, joint: CompiledJoint, play: object) -> tuple[float, list[Size]]:
    """Radius or gap of a clearance that has one, and the sizes that make it."""
    if not isinstance(play, SizedClearance):
        return 0.0, []

    def refuse(problem: str, key: str) -> InputError:
        return graph.refuse(problem, ".".join(part for part in (f"joints.{joint.pin}.clearance", key) if part))

    return sizes_of(play, graph.units, refuse)


def _of_sizes(
    graph: Graph, index: int, joint: CompiledJoint, play: object, sizes: list[Size]
) -> Iterator[CompiledSource]:
    """Sizes that scatter about the middle of their limits; several bodies on one pin have it in common."""
    if not sizes:
        return
    unit = graph.units.length
    riders = [k for k, other in enumerate(graph.joints) if other.pin == joint.pin and other.name != joint.pin]
    several = joint.name.startswith(f"{joint.pin}/")
    for size in sizes:
        if isinstance(size.law, LawTable) and (wrong := size.law.mistake(size.low / unit, size.high / unit)):
            raise graph.refuse(f"the law of {size.name}: {wrong}", f"joints.{joint.pin}.clearance")
        spec: SourcePart = {
            "joint": index,
            "factor": size.factor,
            "set": between(-size.half, size.half),
            "law": law_in_core(size.law, size.low, size.high, unit, size.middle),
        }
        name = joint.name
        if several and isinstance(play, SizedClearance) and size.name == play.carried:
            if index != riders[0]:
                continue
            name = joint.pin
            spec["also"] = [{"joint": k, "factor": size.factor} for k in riders[1:]]
        yield CompiledSource(f"{name}.{size.name}", "size", ("size",), (unit,), (size.centre,), spec)


def _of_coupling(entry: Coupling, graph: Graph, joint: CompiledJoint, index: int) -> Iterator[CompiledSource]:
    """Transmission error and eccentric wheels."""
    error, unit = entry.ratio_error, graph.units.length
    if error is not None:
        spec = interval(error.tolerance, error.law or "normal", unit) | {"joint": index}
        yield CompiledSource(f"{joint.name}.ratio", "ratio", ("length",), (unit,), (error.deviation * unit,), spec)
    if not isinstance(entry, Mesh):
        return
    for body, runout in entry.runout.items():
        yield of_wheel(graph, joint, entry, body, runout)


def _of_backlash(graph: Graph, name: str, drive: Drive, index: int) -> Iterator[CompiledSource]:
    """Lost motion between a drive and every joint that it moves."""
    for joint, play in drive.backlashes.items():
        driven = graph.joint_index(joint, f"drives.{name}.backlash")
        factor = coordinate_factor(graph, graph.joints[driven])
        spec: SourcePart = {
            "drive": index,
            "joint": driven,
            "set": between(-play.minus * factor, play.plus * factor),
            "law": drive.backlash_law,
        }
        at = f"{name}.backlash" + ("" if drive.joint else f".{joint}")
        yield CompiledSource(at, "backlash", ("value",), (factor,), (0.0,), spec, f"drives.{at}")


def _of_dimension(
    data: MechanismFile, graph: Graph, name: str, outputs: Mapping[str, tuple[str, int]], length: float
) -> CompiledSource:
    dimension, key = data.dimensions[name], f"dimensions.{name}"
    if any(name in (joint.name, joint.pin) for joint in graph.joints):
        raise graph.refuse(f"'{name}' is the name of a joint; give the dimension another one", key)
    graph.body_index(dimension.body, f"{key}.body")
    ends: list[int] = []
    for k, place in enumerate(dimension.between):
        if place not in outputs:
            ends.append(graph.joint_point(dimension.body, place, f"{key}.between.{k}"))
            continue
        body, point = outputs[place]
        if body != dimension.body:
            what = "the output" if place == "output" else f"output '{place}'"
            raise graph.refuse(f"{what} is on '{body}', not on '{dimension.body}'", f"{key}.between.{k}")
        ends.append(point)
    together = graph.together_with(ends[1]) if dimension.between[1] not in outputs else []
    start, end = (graph.points[p].at for p in ends)
    ends[0] = graph.on_the_piece_of(ends[1], ends[0])
    if math.dist(start, end) <= COINCIDENT * length:
        problem = f"{' and '.join(dimension.between)} are at the same point of '{dimension.body}'"
        raise graph.refuse(problem, f"{key}.between")
    unit = graph.units.length
    spec = interval(dimension.tolerance, dimension.law or "normal", unit) | {"from": ends[0], "to": ends[1]}
    if together:
        spec["together"] = together
    return CompiledSource(name, "dimension", ("length",), (unit,), (dimension.deviation * unit,), spec)
