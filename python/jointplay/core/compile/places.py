"""Deviations of where joints are on their bodies: of position and direction, of wheels that run out, and of links.

Each source is a part of a rigid displacement of points with the axes there. Its components shift by `along` and turn by
the rotation vector `about`, body axes. The order in which a point goes through its displacements is that of the file:
what a joint deviates by itself first, then the links that end at it.

A link after Denavit and Hartenberg, from joint axis z1 to joint axis z2 with common normal n, has the pose

    Rot(z1, theta + dtheta) Trans(z1, d + dd) Trans(n, a + da) Rot(n, alpha + dalpha)

so that its deviations are a screw displacement about the drawn common normal, and then one about the first axis.
"""

import math
from collections.abc import Iterator, Mapping

from jointplay.core.sets import SHIFTS_ACROSS, TILTS, cylinder, within
from jointplay.core.spec import SetSpec, SourcePart
from jointplay.file.schema import (
    DH,
    AxisDeviation,
    ComponentDeviation,
    JointTable,
    LinkTable,
    MechanismFile,
    Mesh,
    PlanarPosition,
    RunOut,
    SpatialJoint,
    SpatialPosition,
)

from .frames import PARALLEL, Vector3, X, Y, Z, across, cross_product, dot, unit, vector
from .graph import CompiledJoint, Graph
from .source import COINCIDENT, CompiledSource, interval

NOTHING: Vector3 = (0.0, 0.0, 0.0)
BODY_AXES = {"x": X, "y": Y, "z": Z}

#: what a component does per unit of it: shift and rotation vector
Twist = tuple[Vector3, Vector3]


def of_wheel(graph: Graph, joint: CompiledJoint, entry: Mesh, body: str, runout: RunOut) -> CompiledSource:
    """The run-out of a wheel, in its plane."""
    point, length = graph.places[body, joint.pin], graph.units.length
    axis, side, normal = _axes(graph, joint.pin, point)
    plane = {"side": side, "normal": normal} if isinstance(entry, SpatialJoint) else {"x": axis, "y": side}
    where: SourcePart = {"set": within((runout.tolerance or 0.0) * length, 2), "law": runout.law}
    displacement = graph.displacement([point], graph.points[point].at)
    spec = _part(displacement, tuple(plane), [(way, NOTHING) for way in plane.values()], where)
    x, y = runout.deviation
    centre = (x * length, y * length)
    return CompiledSource(f"{joint.name}.runout.{body}", "runout", tuple(plane), (length, length), centre, spec)


def of_places(data: MechanismFile, graph: Graph, name: str) -> Iterator[CompiledSource]:
    """How far a joint of the file is off its place and its direction, body by body."""
    entry = data.joints[name]
    for body in entry.names:
        if body not in entry.position and body not in entry.direction:
            continue
        point = graph.places[body, name]
        place = _Seat(graph, name, point)
        if isinstance(position := entry.position.get(body), PlanarPosition | SpatialPosition):
            yield from place.position(f"{name}.position.{body}", f"position.{body}", position)
        if isinstance(direction := entry.direction.get(body), AxisDeviation | ComponentDeviation):
            yield from place.direction(f"{name}.direction.{body}", f"direction.{body}", direction)


class _Seat:
    """A joint on one of its bodies."""

    def __init__(self, graph: Graph, name: str, point: int) -> None:
        self.graph, self.key = graph, f"joints.{name}"
        self.displacement = graph.displacement([point], graph.points[point].at)
        self.axes = _axes(graph, name, point)

    def position(self, name: str, key: str, off: PlanarPosition | SpatialPosition) -> Iterator[CompiledSource]:
        """Deviations of the place."""
        length, angle = self.graph.units.length, self.graph.units.angle
        for component, one in off.by_component.items():
            yield self._single(name, key, "position", component, one, (BODY_AXES[component], NOTHING))
        if off.diameter is None:
            return
        radius = off.diameter / 2.0 * length
        _, side, normal = self.axes
        if isinstance(off, PlanarPosition) or off.spherical:
            components: tuple[str, ...] = ("x", "y") if isinstance(off, PlanarPosition) else ("x", "y", "z")
            shape = within(radius, len(components))
            ways = [(BODY_AXES[component], NOTHING) for component in components]
        else:
            components, ways = SHIFTS_ACROSS, [(side, NOTHING), (normal, NOTHING)]
            shape = within(radius, 2)
            if off.length is not None:
                components = (*SHIFTS_ACROSS, *TILTS)
                ways += [(NOTHING, side), (NOTHING, normal)]
                shape = cylinder(radius, off.length / 2.0 * length)
        known = off.deviation if isinstance(off, PlanarPosition) else off.centre
        factors = tuple(angle if component in TILTS else length for component in components)
        centre = tuple(value * length for value in known) + (0.0,) * (len(components) - len(known))
        yield self._zone(name, key, "position", components, factors, centre, ways, shape, off.law)

    def direction(self, name: str, key: str, off: AxisDeviation | ComponentDeviation) -> Iterator[CompiledSource]:
        """Deviations of the axis."""
        angle, (_, side, normal) = self.graph.units.angle, self.axes
        if isinstance(off, ComponentDeviation):
            yield _single(self.graph, name, f"{self.key}.{key}", "direction", off, self.displacement, (NOTHING, Z))
            return
        for component, one in off.by_component.items():
            about = side if component == "side" else normal
            yield self._single(name, key, "direction", component, one, (NOTHING, about))
        if off.has_zone:
            if off.diameter is not None and off.length is not None:
                largest = math.atan2(off.diameter, off.length)
            else:
                largest = (off.angle or 0.0) * angle
            first, second = off.deviation
            ways = [(NOTHING, side), (NOTHING, normal)]
            centre = (first * angle, second * angle)
            zone = within(largest, 2)
            yield self._zone(name, key, "direction", TILTS, (angle, angle), centre, ways, zone, off.law)

    def _single(
        self, name: str, key: str, kind: str, component: str, off: ComponentDeviation, way: Twist
    ) -> CompiledSource:
        place = f"{self.key}.{key}.{component}"
        return _single(self.graph, f"{name}.{component}", place, kind, off, self.displacement, way)

    def _zone(
        self,
        name: str,
        key: str,
        kind: str,
        components: tuple[str, ...],
        factors: tuple[float, ...],
        centre: tuple[float, ...],
        ways: list[Twist],
        shape: SetSpec,
        law: str | None,
    ) -> CompiledSource:
        spec = _part(self.displacement, components, ways, {"set": shape, "law": law or "normal"})
        return CompiledSource(name, kind, components, factors, centre, spec, f"{self.key}.{key}")


def _single(
    graph: Graph, name: str, key: str, kind: str, off: ComponentDeviation, displacement: int, way: Twist
) -> CompiledSource:
    """One component with its own tolerance and law."""
    turns = way[1] != NOTHING
    factor = graph.units.angle if turns else graph.units.length
    component = "angle" if turns else "length"
    spec = _part(displacement, (component,), [way], interval(off.tolerance, off.law or "normal", factor))
    return CompiledSource(name, kind, (component,), (factor,), (off.deviation * factor,), spec, key)


def of_links(
    data: MechanismFile, graph: Graph, outputs: Mapping[str, tuple[str, int]], length: float
) -> Iterator[CompiledSource]:
    """How far the second joint of every link is off against the first."""
    for name, link in data.links.items():
        if name in data.dimensions or any(name in (joint.name, joint.pin) for joint in graph.joints):
            what = "dimension" if name in data.dimensions else "joint"
            raise graph.refuse(f"'{name}' is the name of a {what}; give the link another one", f"links.{name}")
        yield from _of_link(data, graph, name, link, outputs, length)


def _of_link(
    data: MechanismFile,
    graph: Graph,
    name: str,
    link: LinkTable,
    outputs: Mapping[str, tuple[str, int]],
    length: float,
) -> Iterator[CompiledSource]:
    key, (first, second), components = f"links.{name}", link.between, link.by_component
    graph.body_index(link.body, f"{key}.body")
    if first == second:
        raise graph.refuse(f"'{first}' is given twice; a link is between two joints", f"{key}.between")
    start = graph.joint_point(link.body, first, f"{key}.between.0")
    turning = [component for component in components if component not in BODY_AXES]
    if second in outputs:
        body, output = outputs[second]
        if body != link.body:
            what = "the output" if second == "output" else f"output '{second}'"
            raise graph.refuse(f"{what} is on '{body}', not on '{link.body}'", f"{key}.between.1")
        if turning:
            problem = (
                f"the output turns with its body and has {', '.join(BODY_AXES)} only, not {', '.join(turning)}; lock a"
                " body of its own to it with a fixed joint, and give the link to that joint"
            )
            raise graph.refuse(problem, f"{key}.{turning[0]}")
        points = [output]
    else:
        end = graph.joint_point(link.body, second, f"{key}.between.1")
        points = [end, *graph.linked_with(end, start)]
        if turning and not _turns(data.joints[second], link.body):
            axes = [axis for axis in BODY_AXES if data.space == "spatial" or axis != "z"]
            problem = f"'{second}' has no direction on '{link.body}' that could deviate; valid here: {', '.join(axes)}"
            raise graph.refuse(problem, f"{key}.{turning[0]}")
    if any(component in DH for component in components):
        for joint in link.between:
            if not data.joints[joint].has_direction(link.body):
                raise graph.refuse(f"'{joint}' has no axis; valid here: x, y, z, rx, ry, rz", f"{key}.between")
        yield from _of_dh_link(graph, name, link, start, points, length)
        return
    displacement = graph.displacement(points, graph.points[points[0]].at)
    for component, off in components.items():
        if component in BODY_AXES:
            way = (BODY_AXES[component], NOTHING)
        else:
            way = (NOTHING, {"rx": X, "ry": Y}.get(component, Z))
        yield _single(graph, f"{name}.{component}", f"{key}.{component}", "link", off, displacement, way)


def _of_dh_link(
    graph: Graph, name: str, link: LinkTable, start: int, points: list[int], length: float
) -> Iterator[CompiledSource]:
    """Two screw displacements: about the common normal, and about the first axis."""
    key, components = f"links.{name}", link.by_component
    (z1, _, _), (z2, _, _) = (
        _axes(graph, joint, point) for joint, point in zip(link.between, (start, points[0]), strict=True)
    )
    p1, p2 = graph.points[start].at, graph.points[points[0]].at
    screws: list[tuple[tuple[str, str], Vector3, Vector3]] = []
    if any(component in components for component in ("a", "alpha")):
        normal, foot = _common_normal(p1, z1, p2, z2, length)
        if normal is None:
            problem = (
                f"the axes of '{link.between[0]}' and '{link.between[1]}' are one line, which has no common normal;"
                " valid here: d, theta, or x, y, z, rx, ry, rz"
            )
            raise graph.refuse(problem, f"{key}.{'a' if 'a' in components else 'alpha'}")
        screws.append((("a", "alpha"), normal, foot))
    if any(component in components for component in ("d", "theta")):
        screws.append((("d", "theta"), z1, p1))
    for (shift, turn), axis, foot in screws:
        displacement = graph.displacement(points, foot)
        for component, way in ((shift, (axis, NOTHING)), (turn, (NOTHING, axis))):
            if component in components:
                off, place = components[component], f"{key}.{component}"
                yield _single(graph, f"{name}.{component}", place, "link", off, displacement, way)


def _common_normal(p1: Vector3, z1: Vector3, p2: Vector3, z2: Vector3, length: float) -> tuple[Vector3 | None, Vector3]:
    """Direction of the common normal of two lines, from the first to the second, and its foot on the second.

    Of parallel lines it goes through the second point; of lines that meet it is the vector product of their directions.
    """
    between = vector([b - a for a, b in zip(p1, p2, strict=True)])
    normal = cross_product(z1, z2)
    size = math.hypot(*normal)
    if size <= PARALLEL:
        along = dot(between, z1)
        away = vector([b - along * z for b, z in zip(between, z1, strict=True)])
        return (unit(away) if math.hypot(*away) > COINCIDENT * length else None), p2
    normal = unit(normal)
    if dot(between, normal) < -COINCIDENT * length:
        normal = vector(normal, -1.0)
    # Along the second axis to where the rest of the way lies along the first axis and the normal.
    back = dot(cross_product(between, z1), cross_product(z1, z2)) / size**2
    return normal, vector([p + back * z for p, z in zip(p2, z2, strict=True)])


def _turns(entry: JointTable, body: str) -> bool:
    """Whether anything of a joint turns with its axes on a body; in the plane, pins count angles from them."""
    return entry.has_direction(body) or not (isinstance(entry, SpatialJoint) or entry.kind == "pin_in_slot")


def _axes(graph: Graph, name: str, point: int) -> tuple[Vector3, Vector3, Vector3]:
    """Axis, side and normal of a joint of the file at its point on a body; in the plane the side is across the axis."""
    joint = next(joint for joint in graph.joints if joint.pin == name and point in (joint.first, joint.second))
    axis, side = (
        (joint.axis_first, joint.side_first) if joint.first == point else (joint.axis_second, joint.side_second)
    )
    axis = unit(axis)
    side = across(side, axis) or side
    return axis, side, cross_product(axis, side)


def _part(displacement: int, components: tuple[str, ...], ways: list[Twist], where: SourcePart) -> SourcePart:
    """A part of a displacement, with the set and the law of its components."""
    told = [[list(along), list(about)] for along, about in ways]
    return {**where, "kind": "place", "displacement": displacement, "components": [*components], "ways": told}
