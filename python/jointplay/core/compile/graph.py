"""Bodies, points and joints of a mechanism: names become indices, a pin with several riders becomes several joints."""

import statistics
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.units import Units
from jointplay.core.spec import DisplacementSpec
from jointplay.errors import InputError, listed, nearest, not_known
from jointplay.file.schema import JointTable, MechanismFile, Mesh, Universal, with_coordinate

from .compliance import compliance_of
from .frames import AxisAndSide, Vector3, X, Y, cross_axes, in_axes, vector
from .placing import frames

GROUND = "ground"
#: index of the ground among the bodies, in the interface of the core
GROUND_INDEX = -1
ORIGIN: Vector3 = (0.0, 0.0, 0.0)
#: whose coordinate is an angle, and whose is a distance along the axis
ANGULAR = with_coordinate("angle")
SLIDING = with_coordinate("along")
DRIVABLE = (*ANGULAR, *SLIDING)
#: on one of these alone a body hangs loose
LOOSE = (*DRIVABLE, "spherical", "planar")
#: directions in which joints hold, and coordinates, that are angles; the others are lengths
TURNS = ("angle", "roll", "tilt_side", "tilt_normal")


@dataclass(frozen=True)
class Point:
    """A point fixed to a body; metres, body axes."""

    body: int
    at: Vector3


@dataclass(frozen=True)
class CompiledJoint:
    """A joint between two points. Axes and sides in the axes of each body; in the plane the side is not used."""

    name: str
    pin: str
    kind: str
    first: int
    second: int
    axis_first: Vector3
    axis_second: Vector3
    side_first: Vector3
    side_second: Vector3
    #: displacement per force of the directions that it holds, one row after the other, SI; None where it is rigid
    compliance: tuple[float, ...] | None = None
    #: whether one of its bodies can be placed beside the other by it
    places: bool = True

    @property
    def is_angular(self) -> bool:
        """Whether its coordinate is an angle."""
        return self.kind in ANGULAR

    @property
    def can_be_driven(self) -> bool:
        """Whether it has a coordinate."""
        return self.kind in DRIVABLE


class Graph:
    """Bodies in order of appearance, joints, and the points that everything refers to."""

    def __init__(self, data: MechanismFile, units: Units, file: str) -> None:
        self.file = file
        self.units = units
        self.bodies: list[str] = []
        self.points: list[Point] = []
        self.joints: list[CompiledJoint] = []
        #: point of every joint of the file on each of its bodies
        self.places: dict[tuple[str, str], int] = {}
        self._joint_points: dict[Point, int] = {}
        self._body_numbers: dict[str, int] = {}
        self._joint_numbers: dict[str, int] = {}
        #: rigid displacements of points, for sources
        self.displacements: list[DisplacementSpec] = []
        #: bodies that are described in one assembled reference configuration
        self.drawn_assembled: set[int] = {GROUND_INDEX}
        #: bodies that are the cross of a universal joint, with its axes in the drawing where it has one
        self.crosses: dict[int, tuple[Vector3, Vector3] | None] = {}
        #: centre and pitch radius of every wheel, in metres
        self.wheels: list[tuple[Point, float]] = []
        #: joints with their bodies between which a link lies although they are at one place
        self._linked = _linked_in_place(data)
        for name, joint in data.joints.items():
            self._add(name, joint)
        self._check_bodies(data)
        self._check_connected()

    def refuse(self, problem: str, key: str) -> InputError:
        """The error for a mistake at a key."""
        return InputError(problem, file=self.file, key=key)

    def body_index(self, name: str, key: str) -> int:
        """Index of a body that must exist."""
        if name == GROUND:
            return GROUND_INDEX
        number = _numbered(self._body_numbers, self.bodies).get(name)
        if number is None:
            raise self.refuse(not_known(name, "a body of any joint", [*self.bodies, GROUND]), key)
        return number

    def joint_index(self, name: str, key: str) -> int:
        """Index of a joint that must exist."""
        if len(self._joint_numbers) < len(self.joints):
            _numbered(self._joint_numbers, [joint.name for joint in self.joints])
        if name in self._joint_numbers:
            return self._joint_numbers[name]
        parts = [joint.name for joint in self.joints if joint.pin == name]
        if parts:
            raise self.refuse(f"'{name}' consists of several joints; name one of {listed(parts)}", key)
        raise self.refuse(not_known(name, "a joint", [*self._joint_numbers]), key)

    def add_point(self, body: int, at: tuple[float, ...]) -> int:
        """A new point, given in file units."""
        self.points.append(Point(body, vector(at, self.units.length)))
        return len(self.points) - 1

    def on_the_piece_of(self, other: int, point: int) -> int:
        """The point, or a new one at the same place on the piece of its elastic body that has the other point."""
        piece, at = self.points[other].body, self.points[point].at
        if self.points[point].body == piece:
            return point
        self.points.append(Point(piece, at))
        return len(self.points) - 1

    def joint_point(self, body: str, joint: str, key: str) -> int:
        """The point of a joint on a body that must carry it."""
        if (body, joint) not in self.places:
            there = [name for on, name in self.places if on == body]
            raise self.refuse(not_known(joint, f"a joint on '{body}'", there), key)
        return self.places[body, joint]

    def _add(self, name: str, joint: JointTable) -> None:
        if name == "output":
            raise self.refuse("'output' has its own meaning in dimensions; rename the joint", f"joints.{name}")
        for body, place in joint.placements.items():
            index = self._body(body)
            # A joint that deviates by itself is not where the others are that are drawn there.
            is_apart = body in joint.displaced or (body, name) in self._linked
            put = self.add_point if is_apart else self._joint_place
            self.places[body, name] = put(index, place.at)
            if joint.is_drawn_assembled:
                self.drawn_assembled.add(index)
            if isinstance(joint, Universal) and body == joint.names[0]:
                self.bodies.append(f"{name}.cross")
        if isinstance(joint, Mesh):
            centres = (self.points[self.places[joint.names[k], name]] for k in joint.wheels)
            radii = (radius * self.units.length for radius in joint.radii)
            self.wheels += zip(centres, radii, strict=True)

        def refuse(problem: str, key: str) -> InputError:
            return self.refuse(problem, f"joints.{name}.{key}")

        carrier, *riders = joint.names
        for body in riders:
            first, second = frames(joint, carrier, body, self.units, refuse)
            if isinstance(joint, Universal):
                self._add_universal(name, joint, first, second)
                continue
            own = name if len(riders) == 1 else f"{name}/{body}"
            ends = (self.places[carrier, name], self.places[body, name])
            gives = compliance_of(joint, self.units)
            self.joints.append(
                CompiledJoint(
                    own, name, joint.kind, *ends, first[0], second[0], first[1], second[1], gives, joint.places
                )
            )

    def together_with(self, point: int) -> list[int]:
        """The points of other joints at the place of a joint on the same body."""
        there = self.points[point]
        return sorted({k for k in self.places.values() if k != point and self.points[k] == there})

    def linked_with(self, point: int, start: int) -> list[int]:
        """The same for a link that ends there; of one that begins there, too, without the ends of all such links."""
        together = self.together_with(point)
        if start not in together:
            return together
        ends = {self.places[end] for end in self._linked}
        return [k for k in together if k not in ends]

    def displacement(self, points: list[int], about: Vector3) -> int:
        """Index of a new rigid displacement of points, which turns about a place of their body."""
        self.displacements.append({"points": points, "about": list(about)})
        return len(self.displacements) - 1

    def _joint_place(self, body: int, at: tuple[float, ...]) -> int:
        """The point of a joint; joints at one place of a body share it, so that a dimension moves them together."""
        point = Point(body, vector(at, self.units.length))
        if point not in self._joint_points:
            self._joint_points[point] = self.add_point(body, at)
        return self._joint_points[point]

    def _body(self, name: str) -> int:
        if name == GROUND:
            return GROUND_INDEX
        if name not in _numbered(self._body_numbers, self.bodies):
            self.bodies.append(name)
        return _numbered(self._body_numbers, self.bodies)[name]

    def _add_universal(self, name: str, joint: Universal, first: AxisAndSide, second: AxisAndSide) -> None:
        """Two pins on a cross, whose x axis is the first pin and whose y axis is the second one."""
        a, b = joint.names
        cross = self.bodies.index(f"{name}.cross")
        centre = self.add_point(cross, ORIGIN)
        # Angles count from where the side of the body points along the cross's other pin ...
        side_of_first, side_of_second = Y, X
        self.crosses[cross] = None
        if joint.is_drawn_assembled:
            # ... or from the drawing.
            axes = cross_axes(first[0], second[0])
            side_of_first, side_of_second = (in_axes(frame[1], axes) for frame in (first, second))
            self.drawn_assembled.add(cross)
            self.crosses[cross] = (first[0], second[0])
        at_first, at_second = self.places[a, name], self.places[b, name]
        sides = (first[1], side_of_first), (side_of_second, second[1])
        gives = compliance_of(joint, self.units)
        pins = (
            CompiledJoint(f"{name}.first", name, "revolute", at_first, centre, first[0], X, *sides[0], gives),
            CompiledJoint(f"{name}.second", name, "revolute", centre, at_second, Y, second[0], *sides[1], gives),
        )
        self.joints.extend(pins)

    def ends(self, joint: CompiledJoint) -> tuple[int, int]:
        """The two bodies of a joint."""
        return self.points[joint.first].body, self.points[joint.second].body

    def joints_on(self) -> dict[int, list[int]]:
        """The joints on every body, by their numbers."""
        found: dict[int, list[int]] = {body: [] for body in (GROUND_INDEX, *range(len(self.bodies)))}
        for number, joint in enumerate(self.joints):
            for body in set(self.ends(joint)):
                found[body].append(number)
        return found

    def _check_bodies(self, data: MechanismFile) -> None:
        if not any(body == GROUND for body, _ in self.places):
            near = nearest(GROUND, self.bodies)
            meant = f" ('{near}' is a body like any other)" if near else ""
            raise self.refuse(f"no joint is on '{GROUND}', the fixed body{meant}", "joints")
        for section, names in (("bodies", data.bodies), ("start", data.start)):
            for name in names:
                if name == GROUND:
                    if section == "bodies" and data.bodies[name].model_fields_set <= {"expansion", "outline"}:
                        continue
                    only = "; it has no key but expansion and outline" if section == "bodies" else "; leave it out"
                    raise self.refuse(f"'{GROUND}' is fixed{only}", f"{section}.{name}")
                self.body_index(name, f"{section}.{name}")
        self._check_strays(data)

    def _check_strays(self, data: MechanismFile) -> None:
        """A body on a single loose joint that nothing else speaks of, with a name almost like another one's."""
        driven = {joint for drive in data.drives.values() for joint in drive.moves}
        driven |= {joint for follower in data.followers.values() for joint in (follower.joint, follower.follows)}
        outputs = [data.output, *data.outputs.values()]
        loads = [load for loads in (data.loads, *data.load_cases.values()) for load in loads]
        named = {place.body for place in (*outputs, *loads) if place} | {*data.start, *data.bodies}
        named |= {output.relative_to for output in outputs if output}
        named |= {dimension.body for dimension in data.dimensions.values()}
        named |= {link.body for link in data.links.values()}
        named |= {body for spring in data.springs.values() for body in spring.on or ()}
        on = self.joints_on()
        for index, body in enumerate(self.bodies):
            joints = [self.joints[number] for number in on[index]]
            if body in named or len(joints) > 1 or joints[0].name in driven or joints[0].kind not in LOOSE:
                continue
            near = nearest(body, [name for name in (*self.bodies, GROUND) if name != body], slips_only=True)
            if near:
                key = f"joints.{joints[0].pin}"
                both = near != GROUND and len(on[self.bodies.index(near)]) == 1
                also = f" '{near}' is on one joint as well: are they one body?" if both else ""
                raise self.refuse(f"'{body}' is on no other joint; did you mean '{near}'?{also}", key)

    def _check_connected(self) -> None:
        on, reached, waiting = self.joints_on(), {GROUND_INDEX}, [GROUND_INDEX]
        for body in waiting:
            more = {end for number in on[body] for end in self.ends(self.joints[number])} - reached
            reached |= more
            waiting += more
        lost = [body for index, body in enumerate(self.bodies) if index not in reached]
        if lost:
            names = listed(f"'{body}'" for body in lost)
            raise self.refuse(f"{names}: no chain of joints connects this to '{GROUND}'", "joints")

    def nowhere(self, placed: Container[int], keys: str) -> InputError:
        """The error for a body that no joint places."""
        body = next(name for index, name in enumerate(self.bodies) if index not in placed)
        problem = (
            f"only gears, racks or belts connect '{body}' to the rest, and they place nothing: a joint that carries it"
            f" is missing (such as a revolute), or start.{body} with {keys}"
        )
        return self.refuse(problem, "joints")

    def placed(self, guess: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where all points are while the bodies are where they are guessed to be, in ground axes."""
        every = np.vstack([guess, poses.ground(guess.shape[-1])])  # the ground has index -1
        return np.array([poses.place(every[point.body], point.at) for point in self.points])

    def span(self) -> float:
        """The median size of the bodies and the ground, in metres; zero if none has two points apart.

        The median, because angles are compared with lengths of single bodies: a long chain is no large mechanism.
        """
        places: dict[int, list[tuple[float, ...]]] = {}
        for point in self.points:
            places.setdefault(point.body, []).append(point.at)
        for point, radius in self.wheels:
            x, y, z = point.at
            places[point.body] += [(x + radius, y, z), (x - radius, y, z)]
        sizes: list[float] = [max(max(at) - min(at) for at in zip(*body, strict=True)) for body in places.values()]
        return statistics.median([size for size in sizes if size > 0.0] or [0.0])


def _linked_in_place(data: MechanismFile) -> set[tuple[str, str]]:
    """Bodies and joints that links join to other joints at the very same place."""
    found: set[tuple[str, str]] = set()
    for link in data.links.values():
        ends = [(link.body, name) for name in link.between if link.body in _placements(data, name)]
        places = [_placements(data, name)[body].at for body, name in ends]
        if len(ends) == 2 and places[0] == places[1]:
            found |= {*ends}
    return found


def _placements(data: MechanismFile, joint: str) -> Mapping[str, Any]:
    return data.joints[joint].placements if joint in data.joints else {}


class Outward:
    """Joints that have a placed body, and another one that is not: bodies are placed from the ground outwards."""

    def __init__(self, graph: Graph, placed: Iterable[int]) -> None:
        self.graph, self.on = graph, graph.joints_on()
        self.placed: set[int] = set()
        self.waiting: set[int] = set()
        self.add(placed)

    def add(self, placed: Iterable[int]) -> None:
        """Further bodies that are placed."""
        for body in placed:
            self.placed.add(body)
            self.waiting.update(self.on[body])
        done = {number for number in self.waiting if {*self.graph.ends(self.graph.joints[number])} <= self.placed}
        self.waiting -= done

    def joints(self) -> list[tuple[int, CompiledJoint]]:
        """These joints with their numbers, in the order of the file."""
        return [(number, self.graph.joints[number]) for number in sorted(self.waiting)]


def _numbered(known: dict[str, int], names: Sequence[str]) -> dict[str, int]:
    """The number of every name, kept up with names that have been added behind the others."""
    for number in range(len(known), len(names)):
        known.setdefault(names[number], number)
    return known
