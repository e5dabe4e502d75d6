"""Couplings in numbers: their geometry as the core takes it, the play between their flanks, and what cannot mesh.

With z teeth on a pitch radius r the pitch is p = 2 pi r / z. Play is less than half of it, so that in every pose the
nearest tooth is the one that is meant. Wheels mesh when their pitch circles touch, to within the height of their teeth.
"""

import math
from collections.abc import Iterator

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.units import Units
from jointplay.core.spec import CouplingSpec
from jointplay.errors import InputError
from jointplay.file.schema import (
    BeltClearance,
    BeltKeys,
    CrossedGear,
    FlankClearance,
    GearKeys,
    MechanismFile,
    Mesh,
    Screw,
)

from .contact import Contact, Wheels, touching, turned
from .frames import AxisAndSide, Vector3, across, cross_product, default_side, dot, in_axes
from .graph import GROUND, CompiledJoint, Graph
from .spacing import MeshPair, mismatches

#: degrees; where the file says nothing
PRESSURE_ANGLE = 20.0
#: degrees by which axes of wheels may differ in the start, which is rough
PARALLEL = 5.0
#: degrees up to which teeth have a width at their tips; those of racks and gears end in points beyond about 38 degrees,
#: the short ones of splines have up to 45
STEEPEST = 45.0
#: modules by which pitch circles may miss each other: the height of a tooth is 2.25 of them
TOOTH = 2.25
#: modules by which pitch circles of crossed gears may miss each other: what is rounded in a file
TOUCHING = 0.1
#: degrees by which the axes of a wheel and of its bearing may differ: what is rounded in a file
ALONG = 1.0
#: kinds of joint that let bodies turn about one axis, and those that do not hold a wheel
ABOUT = ("revolute", "cylindrical", "screw")
NO_BEARING = ("prismatic", "gear", "crossed_gear", "rack", "belt", "follower")
#: what directions of one line differ by
ROUNDED = 1e-9
#: pitch radii by which centres are apart that have a line between them
APART = 1e-6


def compile_couplings(data: MechanismFile, graph: Graph, guess: Floats) -> dict[int, CouplingSpec]:
    """What the core is told of every coupling, by the index of its joint; refuses wheels that cannot mesh.

    Parameters
    ----------
    graph : Graph
        With all points on the pieces of elastic bodies.
    guess : ndarray
        Pose of every body at the start, SI.
    """
    found: dict[int, CouplingSpec] = {}
    gears: list[_Wheels] = []
    for index, joint in enumerate(graph.joints):
        entry = data.joints.get(joint.pin)
        if isinstance(entry, Mesh):
            kind = _Crossed if isinstance(entry, CrossedGear) else _Wheels
            wheels = kind(graph, joint, entry, guess)
            found[index] = wheels.spec()
            gears += [wheels] if isinstance(entry, GearKeys | CrossedGear) else []
        elif isinstance(entry, Screw):
            _check_thread(graph, joint, entry)
            found[index] = {"lead": entry.lead * graph.units.length}
    for number, off in mismatches([wheels.toothed() for wheels in gears]):
        first, second = (repr(name) for name in gears[number].entry.names)
        raise gears[number].refuse(
            f"the teeth of {first} and {second} miss each other by {off:.2g} of a tooth where the other wheels of their"
            " loop mesh; planets between a sun and a ring are apart by multiples of 360 degrees / (teeth of the sun +"
            " teeth of the ring)"
        )
    return found


def _check_thread(graph: Graph, joint: CompiledJoint, entry: Screw) -> None:
    axial = 0.0 if entry.clearance is None else entry.clearance.axial
    if axial >= 0.25 * abs(entry.lead):
        name = graph.units.length_name
        problem = (
            f"an axial play of {axial:.6g} {name} to each side is a quarter of the lead of {abs(entry.lead):.6g} {name}"
            " or more: it could not be said which thread is meant"
        )
        raise graph.refuse(problem, f"joints.{joint.pin}.clearance")


def play_at_rim(entry: Mesh, units: Units) -> tuple[float, float]:
    """How far the second body's rim can go to either side of the middle, metres."""
    match getattr(entry, "clearance", None):
        case FlankClearance(backlash=None, backlash_angle=angle):
            half = 0.5 * (angle or 0.0) * units.angle * entry.radii[-1] * units.length
            return -half, half
        case FlankClearance(backlash=backlash):
            half = 0.5 * (backlash or 0.0) * units.length
            return -half, half
        case BeltClearance(slack=(minus, plus)):
            return -minus * units.length, plus * units.length
    return 0.0, 0.0


class _Wheels:
    """The two bodies of a coupling at the rims of wheels, where they start."""

    def __init__(self, graph: Graph, joint: CompiledJoint, entry: Mesh, guess: Floats) -> None:
        self.graph, self.joint, self.entry = graph, joint, entry
        self.units = graph.units
        self.radii = [radius * graph.units.length for radius in entry.radii]
        every = np.vstack([guess, poses.ground(guess.shape[-1])])  # the ground has index -1
        self.ends = [graph.points[joint.first], graph.points[joint.second]]
        self.turns = [poses.matrix(every[end.body]) for end in self.ends]
        first, second = (poses.place(every[end.body], end.at) for end in self.ends)
        self.frames: list[AxisAndSide] = [(joint.axis_first, joint.side_first), (joint.axis_second, joint.side_second)]
        self.in_space = guess.shape[-1] == poses.SPATIAL
        #: from the first centre to the second, ground axes; in the plane that the first wheel turns in along its two
        #: directions
        self.line = second - first
        apart = self.turns[0].T @ self.line
        self.apart = [dot(tuple(apart), direction) for direction in self._plane(0)]

    def spec(self) -> CouplingSpec:
        """Its geometry as the core takes it."""
        entry = self.entry
        if self.in_space:
            self._check_parallel()
            self._check_bearings()
        self._check_play()
        self._check_runout()
        first, second = self.radii[0], self.radii[-1]
        told: CouplingSpec
        counts = [entry.counts[0], entry.counts[-1]]
        if isinstance(entry, BeltKeys):
            distance = self._distance_of_pulleys(entry)
            told = {"radii": [first, second], "teeth": counts, "crossed": entry.crossed, "distance": distance}
        elif isinstance(entry, GearKeys):
            self._check_centres(entry.internal)
            told = {"radii": [first, second], "teeth": counts, "internal": entry.internal}
        else:
            self._check_rack()
            told = {"radii": [first, first], "teeth": [getattr(entry, "teeth", None) or 0, 0]}
        if not isinstance(entry, BeltKeys):
            told["pressure_angle"] = self._pressure_angle()
        if entry.directions is not None:
            told["marks"] = [self._mark(k, name) for k, name in enumerate(entry.names)]
        return told

    def toothed(self) -> MeshPair:
        """A gear pair with the directions in which its wheels see the mesh."""
        entry = self.entry
        seen, same_way = self._seen()
        low, high = play_at_rim(entry, self.units)
        pitch = math.tau * self.radii[-1] / entry.counts[-1]
        ends = ((end.body, end.at, z) for end, z in zip(self.ends, entry.counts, strict=True))
        wheels = tuple(ends)
        return MeshPair(
            (wheels[0], wheels[1]),
            (entry.counts[0], entry.counts[1]),
            (seen[0], seen[1]),
            same_way,
            (high - low) / pitch,
        )

    def _seen(self) -> tuple[list[float], bool]:
        """Where each wheel sees the mesh, and whether both turn the same way."""
        entry = self.entry
        assert isinstance(entry, GearKeys)
        seen = []
        for k, name in enumerate(entry.names):
            if entry.directions is not None:
                towards = self._mark(k, name)
            else:
                x, y = (float(self.turns[k] @ np.array(direction) @ self.line) for direction in self._plane(k))
                towards = math.atan2(y, x)
            # The line goes from the first centre to the second; inside a ring the mesh is behind the first.
            seen.append(towards + math.pi if k == 1 or entry.internal else towards)
        return seen, entry.internal

    def refuse(self, problem: str, key: str = "") -> InputError:
        return self.graph.refuse(problem, f"joints.{self.joint.pin}{key}")

    def _plane(self, end: int) -> tuple[Vector3, Vector3]:
        """The two directions of the plane that a wheel turns in, body axes."""
        axis, side = self.frames[end]
        return (side, cross_product(axis, side)) if self.in_space else (axis, (-axis[1], axis[0], 0.0))

    def _mark(self, end: int, name: str) -> float:
        """The angle of a marked direction in the plane that a wheel turns in."""
        given = (self.entry.directions or {})[name]
        x, y = self._plane(end)
        if isinstance(given, float):
            given = (math.cos(given * self.units.angle), math.sin(given * self.units.angle), 0.0)
        direction: Vector3 = (*given, 0.0)[:3]
        if self.in_space and across(direction, self.frames[end][0]) is None:
            raise self.refuse("lies along the axis; the wheel turns across it", f".marks.{name}")
        return math.atan2(dot(direction, y), dot(direction, x))

    def _pressure_angle(self) -> float:
        given = getattr(self.entry, "pressure_angle", None)
        if given is None:
            return math.radians(PRESSURE_ANGLE)
        angle = float(given * self.units.angle)
        limit = math.radians(STEEPEST)
        if angle > limit * (1.0 + ROUNDED):
            most, name = limit / self.units.angle, self.units.angle_name
            problem = f"a pressure angle is at most {most:.4g} {name}, beyond which teeth have no tips; not {given:g}"
            raise self.refuse(problem, ".pressure_angle")
        return angle

    def _check_parallel(self) -> None:
        first, second = (turn @ np.array(frame[0]) for turn, frame in zip(self.turns, self.frames, strict=True))
        angle = math.degrees(math.acos(max(-1.0, min(1.0, float(first @ second)))))
        if angle > PARALLEL:
            names = " and ".join(f"'{name}'" for name in self.entry.names)
            turned = "; turn the axis of one of them round" if angle > 180.0 - PARALLEL else ""
            problem = (
                f"the axes of {names} are parallel and point the same way in a {self.entry.kind} joint; at the start"
                f" they are {angle:.4g} deg apart{turned}"
            )
            raise self.refuse(problem)

    def _check_play(self) -> None:
        low, high = play_at_rim(self.entry, self.units)
        counts = self.entry.counts
        belt = isinstance(self.entry, BeltKeys)
        # The radii of belts without teeth repeat after as many turns as their whole numbers say.
        teeth = counts[-1] // math.gcd(*counts) if belt else counts[-1]
        pitch = 2.0 * math.pi * self.radii[-1] / teeth
        if high - low >= 0.5 * pitch:
            unit, name = self.units.length, self.units.length_name
            what = "slack to both sides" if belt else "backlash"
            problem = (
                f"{(high - low) / unit:.4g} {name} of {what} is half of {pitch / unit:.4g} {name} or more, after which"
                f" {'pulleys' if belt else 'teeth'} are where others were: it could not be said which are meant"
            )
            raise self.refuse(problem, ".clearance")

    def _check_runout(self) -> None:
        """Refuse wheels that are further out of their centres than their teeth are high, or round the centre."""
        unit, name = self.units.length, self.units.length_name
        for body, runout in self.entry.runout.items():
            off = math.hypot(*runout.deviation) + (runout.tolerance or 0.0)
            if getattr(self.entry, "teeth", None) is None or isinstance(self.entry, BeltKeys):
                limit = self.radii[self.entry.wheels.index(self.entry.names.index(body))] / unit
                what = f"its pitch radius, {limit:.4g} {name}"
            else:
                limit = self._height() / unit
                what = f"the height of its teeth, {limit:.4g} {name}"
            if off > limit:
                raise self.refuse(f"is off its centre by up to {off:.4g} {name}, more than {what}", f".runout.{body}")

    def _height(self) -> float:
        """How high teeth are, metres."""
        return TOOTH * 2.0 * self.radii[-1] / self.entry.counts[-1]

    def _check_bearings(self) -> None:
        """Refuse a wheel that turns about other axes only, in joints that let it turn about nothing else."""
        for end, body in enumerate(self.entry.names):
            joints = [joint for joint in self.graph.joints if self.ends[end].body in self._bodies(joint)]
            # One of an unknown kind, or the cross of a universal joint, may let it turn about any axis.
            if any(joint.kind not in (*ABOUT, *NO_BEARING) for joint in joints):
                continue
            if any(self.graph.crosses.keys() & self._bodies(joint) for joint in joints):
                continue
            found = [(joint, at, axis) for joint in joints for at, axis in self._turning(end, joint)]
            if found and not any(self._carries(end, at, axis) for _, at, axis in found):
                own = self._line(self.ends[end].at, self.frames[end][0])
                others = " and ".join(f"in '{joint.name}' about {self._line(at, axis)}" for joint, at, axis in found)
                raise self.refuse(
                    f"the teeth of '{body}' are about {own}, and it turns {others}; a wheel has a bearing along its own"
                    " axis"
                )

    def _line(self, at: Vector3, axis: Vector3) -> str:
        """A line in words, body axes and file units."""
        place = ", ".join(f"{x / self.units.length:.6g}" for x in at)
        return f"[{', '.join(f'{x:.6g}' for x in axis)}] through [{place}]"

    def _carries(self, end: int, at: Vector3, axis: Vector3) -> bool:
        """Whether a wheel that turns about a line turns about its own axis; eccentric ones need parallel axes."""
        off = np.linalg.norm(np.cross(axis, np.array(self.ends[end].at) - np.array(at)))
        along = abs(dot(axis, self.frames[end][0])) >= math.cos(math.radians(ALONG))
        return along and (not isinstance(self.entry, CrossedGear) or float(off) <= self._height())

    def _turning(self, end: int, joint: CompiledJoint) -> Iterator[tuple[Vector3, Vector3]]:
        """Where and about which axis a joint lets the body of a wheel turn, body axes."""
        if joint.kind in ABOUT:
            for number, axis in ((joint.first, joint.axis_first), (joint.second, joint.axis_second)):
                point = self.graph.points[number]
                if point.body == self.ends[end].body:
                    yield point.at, axis

    def _bodies(self, joint: CompiledJoint) -> set[int]:
        return {self.graph.points[joint.first].body, self.graph.points[joint.second].body}

    def _check_centres(self, internal: bool) -> None:
        apart = self._held_apart()
        first, second = self.radii
        wanted = second - first if internal else first + second
        if apart is None:
            return self._check_line()
        unit, name = self.units.length, self.units.length_name
        a, b = self.entry.names
        problem = (
            f"the centres of '{a}' and '{b}' are {apart / unit:.6g} {name} apart; with pitch radii of"
            f" {first / unit:.6g} and {second / unit:.6g} {name} they mesh at {wanted / unit:.6g} {name}"
        )
        if abs(apart - wanted) > self._height():
            raise self.refuse(problem)
        low, high = play_at_rim(self.entry, self.units)
        taken = -2.0 * self._opening(apart, wanted, internal)
        if 0.0 < high - low <= taken:
            raise self.refuse(
                f"{problem}, and here their teeth overlap: more than {taken / unit:.4g} {name} of backlash is needed"
            )
        return self._check_line()

    def _check_line(self) -> None:
        """Refuse wheels whose centres are at one place: no direction says there how they mesh."""
        a, b = self.entry.names
        held, least = self._held_apart(), APART * max(self.radii)
        problem = f"the centres of '{a}' and '{b}' are at one place"
        if held is not None and held <= least:
            raise self.refuse(f"{problem} in every pose; a {self.entry.kind} is between two places")
        if math.hypot(*self.apart) <= least:
            told = a if b == GROUND else b
            keys = "x, y and z" if self.in_space else "x and y"
            raise self.refuse(
                f"{problem} in the start, where a {self.entry.kind} has no direction; say with {keys} in start.{told}"
                f" roughly where '{told}' is"
            )

    def _opening(self, apart: float, wanted: float, internal: bool) -> float:
        """By how much each flank has gone from the other at a distance of the centres, at the pitch circle.

        With the base radii together b and rho^2 = c^2 - b^2 of the distance c, the involutes open by
        [rho - b atan(rho / b)] / cos(alpha), less its value at the pitch radii; inside a ring the other way.
        """
        cosine = math.cos(self._pressure_angle())
        base = wanted * cosine

        def involute(distance: float) -> float:
            rho = math.sqrt(max(distance * distance - base * base, 0.0))
            return rho - base * math.atan2(rho, base)

        opened = (involute(apart) - involute(wanted)) / cosine
        return -opened if internal else opened

    def _held_apart(self) -> float | None:
        """Distance of the centres where one body carries both, by pins or itself; None where none does."""
        carriers = [self._carriers(end) for end in (0, 1)]
        for body in carriers[0].keys() & carriers[1].keys():
            (at, axis), (other, _) = carriers[0][body], carriers[1][body]
            away = np.array(other) - np.array(at)
            return float(np.linalg.norm(away - (away @ axis) * axis))
        return None

    def _carriers(self, end: int) -> dict[int, tuple[Vector3, Floats]]:
        """Bodies that hold the centre of a wheel, with its place and axis on them."""
        out = np.array([0.0, 0.0, 1.0])
        point = self.ends[end]
        found = {point.body: (point.at, np.array(self.frames[end][0]) if self.in_space else out)}
        for joint in self.graph.joints:
            first, second = self.graph.points[joint.first], self.graph.points[joint.second]
            for own, other, axis in ((first, second, joint.axis_second), (second, first, joint.axis_first)):
                if joint.kind == "revolute" and own == point:
                    found[other.body] = (other.at, np.array(axis) if self.in_space else out)
        return found

    def _check_rack(self) -> None:
        height, radius = abs(self.apart[1]), self.radii[0]
        if abs(height - radius) > 0.5 * radius:
            unit, name = self.units.length, self.units.length_name
            problem = (
                f"the centre of '{self.entry.names[1]}' starts {height / unit:.6g} {name} from the pitch line of the"
                f" rack; its pitch radius is {radius / unit:.6g} {name}"
            )
            raise self.refuse(problem)
        held = self._held_height()
        low, high = play_at_rim(self.entry, self.units)
        taken = 0.0 if held is None else 2.0 * math.tan(self._pressure_angle()) * (radius - held)
        if held is not None and 0.0 < high - low <= taken:
            unit, name = self.units.length, self.units.length_name
            raise self.refuse(
                f"a guide holds the centre of '{self.entry.names[1]}' {held / unit:.6g} {name} from the pitch line of"
                f" the rack; with a pitch radius of {radius / unit:.6g} {name} their teeth overlap: more than"
                f" {taken / unit:.4g} {name} of backlash is needed"
            )

    def _held_height(self) -> float | None:
        """Distance of a pinion from its pitch line where a guide along the rack holds it; None where none does."""
        line, normal = self._plane(0)
        rack, carriers = self.ends[0], self._carriers(1)
        for joint in self.graph.joints:
            first, second = self.graph.points[joint.first], self.graph.points[joint.second]
            ends = [(first, joint.axis_first, joint.side_first), (second, joint.axis_second, joint.side_second)]
            for (own, along, side), (other, axis, other_side) in (ends, ends[::-1]):
                guides = joint.kind == "prismatic" and own.body == rack.body and other.body in carriers
                if not guides or abs(dot(along, line)) < 1.0 - ROUNDED:
                    continue
                out = in_axes(normal, self._triad(along, side))
                away = np.array(out) @ np.array(self._triad(axis, other_side))
                centre = np.array(carriers[other.body][0]) - np.array(other.at)
                return abs(float(centre @ away) - dot(normal, tuple(np.array(rack.at) - np.array(own.at))))
        return None

    def _triad(self, axis: Vector3, side: Vector3) -> tuple[Vector3, Vector3, Vector3]:
        """The axes of a joint; in the plane its side is the direction out of it."""
        side = side if self.in_space else (0.0, 0.0, 1.0)
        return axis, side, cross_product(axis, side)

    def _distance_of_pulleys(self, entry: BeltKeys) -> float:
        """The distance at which a belt has its slack, metres."""
        self._check_line()
        given = entry.distance
        distance = math.hypot(*self.apart) if given is None else given * self.units.length
        first, second = self.radii
        least = first + second if entry.crossed else abs(first - second)
        if distance <= least:
            unit, name = self.units.length, self.units.length_name
            a, b = entry.names
            where = " at the start" if given is None else ""
            problem = (
                f"the centres of '{a}' and '{b}' are {distance / unit:.6g} {name} apart{where}; a belt around both"
                f" needs more than {least / unit:.6g} {name}"
            )
            raise self.refuse(problem, "" if given is None else ".distance")
        return distance


class _Crossed(_Wheels):
    """Two wheels whose axes are not parallel."""

    def spec(self) -> CouplingSpec:
        self._check_play()
        contact = self._contact()
        if self.entry.rubs is not None and not contact.slides:
            problem = (
                "the teeth roll where the pitch circles touch, so that a coefficient says nothing; give efficiency"
            )
            raise self.refuse(problem, ".friction")
        self._check_bearings()
        self._check_runout()
        told: CouplingSpec = {
            "radii": self.radii,
            "teeth": list(self.entry.counts),
            "contact": contact.spec(),
        }
        if self.entry.directions is not None:
            told["marks"] = [self._mark(k, name) + contact.ahead(k) for k, name in enumerate(self.entry.names)]
        return told

    def _contact(self) -> Contact:
        entry = self.entry
        assert isinstance(entry, CrossedGear)
        (at, first), (other, second) = self._placed()
        angle = math.degrees(math.acos(min(1.0, abs(float(first @ second)))))
        if angle < PARALLEL:
            names = " and ".join(f"'{name}'" for name in entry.names)
            raise self.refuse(
                f'the axes of {names} are parallel within {angle:.2g} deg; wheels of parallel axes are type = "gear"'
            )
        unit, name = self.units.length, self.units.length_name
        spiral = None if entry.spiral_angle is None else entry.spiral_angle * self.units.angle
        if spiral is not None and spiral >= math.pi / 2.0:
            raise self.refuse(
                f"a spiral angle is below {math.pi / 2.0 / self.units.angle:.4g} {self.units.angle_name}, not"
                f" {entry.spiral_angle:g}",
                ".spiral_angle",
            )
        wheels = Wheels(
            names=(entry.names[0], entry.names[1]),
            axes=(first, second),
            apart=other - at,
            radii=(self.radii[0], self.radii[1]),
            teeth=entry.teeth,
            pressure_angle=self._pressure_angle(),
            hand=None if entry.hand is None else 1 if entry.hand == "right" else -1,
            spiral_angle=spiral,
            tolerance=TOUCHING * 2.0 * self.radii[1] / entry.teeth[1],
            length=lambda value: f"{value / unit:.6g} {name}",
        )
        return touching(wheels, self.refuse)

    def _placed(self) -> list[tuple[Floats, Floats]]:
        """Centre and axis of both wheels, on a body that carries both, else in the start."""
        carriers = [self._bearings(end) for end in (0, 1)]
        for body in carriers[0].keys() & carriers[1].keys():
            return [carried[body] for carried in carriers]
        places = (np.zeros(3), self.line)
        return [(places[k], self.turns[k] @ np.array(self.frames[k][0])) for k in (0, 1)]

    def _bearings(self, end: int) -> dict[int, tuple[Floats, Floats]]:
        """Bodies in which a wheel turns about its axis, with its centre and axis on them."""
        point, mesh_axis = self.ends[end], np.array(self.frames[end][0])
        centre = np.array(point.at)
        found = {point.body: (centre, mesh_axis)}
        for joint in self.graph.joints:
            if joint.kind != "revolute":
                continue
            first, second = self.graph.points[joint.first], self.graph.points[joint.second]
            ends = ((first, joint.axis_first), (second, joint.axis_second))
            for (own, along), (other, axis) in (ends, ends[::-1]):
                offset = centre - np.array(own.at)
                height = float(offset @ along)
                same = float(mesh_axis @ along)
                is_off = np.linalg.norm(offset - height * np.array(along)) > ROUNDED * (self.radii[end] + abs(height))
                if own.body == point.body and abs(same) > 1.0 - ROUNDED and not is_off:
                    found[other.body] = (
                        np.array(other.at) + height * np.array(axis),
                        math.copysign(1.0, same) * np.array(axis),
                    )
        return found

    def _seen(self) -> tuple[list[float], bool]:
        contact, entry = self._contact(), self.entry
        seen, same_way = [], contact.sense > 0
        for k, name in enumerate(entry.names):
            axis = np.array(self.frames[k][0])
            side, across_side = (np.array(direction) for direction in self._plane(k))
            if entry.directions is not None:
                towards = self._mark(k, name)
            else:
                other = self.turns[k].T @ self.turns[1 - k] @ np.array(self.frames[1 - k][0])
                towards = math.atan2(float(across_side @ other), float(side @ other)) - contact.ahead(k)
            # Whichever way its axis points, a wheel counts from one direction one way round.
            one_way = tuple(axis * np.sign(axis[np.argmax(np.abs(axis) > ROUNDED)]))
            there = math.cos(towards) * side + math.sin(towards) * across_side
            same_way ^= float(axis @ one_way) < 0.0
            seen.append(turned(np.array(one_way), np.array(default_side(one_way)), there))
        return seen, bool(same_way)
