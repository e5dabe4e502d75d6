"""Bodies, points and joints of a mechanism: names become indices, a pin with several riders becomes several joints."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass

from jointplay.errors import InputError, listed, nearest, not_known
from jointplay.schema import Fixed, Joint, MechanismFile, PlacementTable
from jointplay.units import Units

GROUND = "ground"
#: index of the ground among the bodies, in the interface of the core
GROUND_INDEX = -1


@dataclass(frozen=True)
class Point:
    """A point fixed to a body; metres, body axes."""

    body: int
    at: tuple[float, float]


@dataclass(frozen=True)
class CompiledJoint:
    """A joint between two points. Axes are angles in the axes of each body."""

    name: str
    pin: str
    kind: str
    first: int
    second: int
    axis_first: float
    axis_second: float

    @property
    def is_angular(self) -> bool:
        """Whether its coordinate is an angle."""
        return self.kind == "revolute"

    @property
    def can_be_driven(self) -> bool:
        """Whether it has a coordinate."""
        return self.kind != "fixed"


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
        if name not in self.bodies:
            raise self.refuse(not_known(name, "a body of any joint", [*self.bodies, GROUND]), key)
        return self.bodies.index(name)

    def joint_index(self, name: str, key: str) -> int:
        """Index of a joint that must exist."""
        names = [joint.name for joint in self.joints]
        if name in names:
            return names.index(name)
        riders = [joint.name for joint in self.joints if joint.pin == name]
        if riders:
            raise self.refuse(f"'{name}' carries several bodies; name one of {listed(riders)}", key)
        raise self.refuse(not_known(name, "a joint", names), key)

    def add_point(self, body: int, at: tuple[float, float]) -> int:
        """A new point, given in file units."""
        self.points.append(Point(body, (at[0] * self.units.length, at[1] * self.units.length)))
        return len(self.points) - 1

    def joint_point(self, body: str, joint: str, key: str) -> int:
        """The point of a joint on a body that must carry it."""
        if (body, joint) not in self.places:
            there = [name for on, name in self.places if on == body]
            raise self.refuse(not_known(joint, f"a joint on '{body}'", there), key)
        return self.places[body, joint]

    def _add(self, name: str, joint: Joint) -> None:
        if name == "output":
            raise self.refuse("'output' has its own meaning in dimensions; rename the joint", f"joints.{name}")
        placements = joint.placements
        for body in placements:
            if body != GROUND and body not in self.bodies:
                self.bodies.append(body)
            index = GROUND_INDEX if body == GROUND else self.bodies.index(body)
            self.places[body, name] = self.add_point(index, placements[body].at)
        (carrier, seat), *riders = placements.items()
        for body, placement in riders:
            # A guide's axis has the same numbers on both bodies; a mounting angle is that of the second body's x axis.
            default = 0.0 if isinstance(joint, Fixed) and joint.on else self._axis(seat, 0.0)
            self.joints.append(
                CompiledJoint(
                    name=name if len(riders) == 1 else f"{name}/{body}",
                    pin=name,
                    kind=joint.kind,
                    first=self.places[carrier, name],
                    second=self.places[body, name],
                    axis_first=self._axis(seat, 0.0),
                    axis_second=self._axis(placement, default),
                )
            )

    def _axis(self, placement: PlacementTable, default: float) -> float:
        match placement.axis:
            case None:
                return default
            case (ux, uy):
                return math.atan2(uy, ux)
            case angle:
                return angle * self.units.angle

    def joints_of(self, body: int) -> list[CompiledJoint]:
        """The joints on a body."""
        return [j for j in self.joints if body in (self.points[j.first].body, self.points[j.second].body)]

    def _check_bodies(self, data: MechanismFile) -> None:
        if not any(body == GROUND for body, _ in self.places):
            near = nearest(GROUND, self.bodies)
            meant = f" ('{near}' is a body like any other)" if near else ""
            raise self.refuse(f"no joint is on '{GROUND}', the fixed body{meant}", "joints")
        for section, names in (("bodies", data.bodies), ("start", data.start)):
            for name in names:
                if name == GROUND:
                    raise self.refuse(f"'{GROUND}' is fixed; leave it out", f"{section}.{name}")
                self.body_index(name, f"{section}.{name}")
        self._check_strays(data)

    def _check_strays(self, data: MechanismFile) -> None:
        """A body on a single loose joint that nothing else speaks of, with a name almost like another one's."""
        driven = {drive.joint for drive in data.drives.values()}
        named = {data.output.body, *data.start, *data.bodies, *(load.body for load in data.loads)}
        named |= {dimension.body for dimension in data.dimensions.values()}
        for index, body in enumerate(self.bodies):
            joints = self.joints_of(index)
            if body in named or len(joints) > 1 or joints[0].name in driven or not joints[0].can_be_driven:
                continue
            near = nearest(body, [name for name in (*self.bodies, GROUND) if name != body], slips_only=True)
            if near:
                key = f"joints.{joints[0].pin}"
                raise self.refuse(f"'{body}' is on no other joint; did you mean '{near}'?", key)

    def _check_connected(self) -> None:
        reached = {GROUND_INDEX}
        while True:
            ends = [{self.points[j.first].body, self.points[j.second].body} for j in self.joints]
            more = {body for pair in ends if pair & reached for body in pair} - reached
            if not more:
                break
            reached |= more
        lost = [body for index, body in enumerate(self.bodies) if index not in reached]
        if lost:
            names = listed(f"'{body}'" for body in lost)
            raise self.refuse(f"{names}: no chain of joints connects this to '{GROUND}'", "joints")

    def span(self) -> float:
        """The median size of the bodies and the ground, in metres; zero if none has two points apart.

        The median, because angles are compared with lengths of single bodies: a long chain is no large mechanism.
        """
        places: dict[int, list[tuple[float, ...]]] = {}
        for point in self.points:
            places.setdefault(point.body, []).append(point.at)
        sizes: list[float] = [max(max(at) - min(at) for at in zip(*body, strict=True)) for body in places.values()]
        return statistics.median([size for size in sizes if size > 0.0] or [0.0])
