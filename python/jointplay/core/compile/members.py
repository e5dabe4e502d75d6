"""Elastic bodies: straight members, made of rigid pieces that are joined elastically.

Every joint of an elastic body, and every point of it that the output, a load or its weight refers to, has its foot on
the member's axis, the line through the joints. There is a rigid piece at each foot, which holds all points over it;
between neighbours a `fixed` joint at the farther one has the compliance of the piece of the member between them. All
pieces have the body's own axes, so that coordinates stay what they were. The piece at the first joint of the file is
the body as results know it; the others are called after what sits on them, ``BODY.JOINT``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import listed
from jointplay.file.schema import BodyTable, MechanismFile, SpatialBody

from .compliance import member as compliance
from .frames import AxisAndSide, Vector3, across, default_side, dot, unit, vector
from .graph import CompiledJoint, Graph, Point

#: feet on a member's axis that are nearer than this share of its length are one, and so far may joints be off the axis
NEAR = 1e-6


@dataclass(frozen=True)
class Member:
    """A piece of an elastic body between two places where something acts on it."""

    #: the body, or ``BODY.FROM-TO`` where the body has several
    name: str
    #: the elastic body of the file
    body: str
    #: what sits at its ends: joints, or ``output``, ``load0``, ``centre``
    between: tuple[str, str]
    #: index of the fixed joint that gives as the member does. Its axis points from the first end to the second, so that
    #: its displacement along is the elongation and its reaction along the axis is minus the tension.
    joint: int
    #: in metres
    length: float


@dataclass(frozen=True)
class Pieces:
    """What the elastic bodies of a mechanism add to it."""

    #: names of the further pieces
    bodies: tuple[str, ...]
    #: index of the body that each of them is a piece of
    owners: tuple[int, ...]
    #: the elastic parts
    members: tuple[Member, ...]

    def guess(self, guess: NDArray[np.float64]) -> NDArray[np.float64]:
        """Poses of all bodies, pieces among them, from those of the bodies of the file."""
        return np.concatenate([guess, guess[list(self.owners)]]) if self.owners else guess


def split(data: MechanismFile, graph: Graph, labels: Mapping[int, str]) -> Pieces:
    """Take the elastic bodies to pieces, in place.

    Parameters
    ----------
    data : MechanismFile
        The file.
    graph : Graph
        Its bodies, joints and points, all of them; joints are added and points move to the pieces.
    labels : mapping
        What points are that no joint sits on.

    Raises
    ------
    InputError
        When an elastic body is no straight member.
    """
    names: list[str] = []
    owners: list[int] = []
    members: list[Member] = []
    moving = len(graph.bodies)
    for name, body in data.bodies.items():
        if not body.is_elastic:
            continue
        axis = _Axis(graph, name, labels)
        owner = graph.bodies.index(name)
        pieces: list[int] = []
        for stop in axis.stops:
            if axis.first in stop.points:
                pieces.append(owner)
                continue
            pieces.append(moving + len(names))
            names.append(f"{name}.{stop.label}")
            owners.append(owner)
        for stop, piece in zip(axis.stops, pieces, strict=True):
            for point in stop.points:
                graph.points[point] = Point(piece, graph.points[point].at)
        members.extend(_join(graph, name, body, axis, pieces))
    return Pieces(tuple(names), tuple(owners), tuple(members))


@dataclass(frozen=True)
class _Stop:
    """A foot on a member's axis: how far along, what it is called, the points over it."""

    along: float
    label: str
    points: tuple[int, ...]


class _Axis:
    """The axis of a member and what sits along it.

    Parameters
    ----------
    graph : Graph
    name : str
        The body.
    labels : mapping
        What points are that no joint sits on.
    """

    def __init__(self, graph: Graph, name: str, labels: Mapping[int, str]) -> None:
        index = graph.bodies.index(name)
        joints: dict[int, str] = {}
        for (body, joint), point in graph.places.items():
            if body == name:
                joints.setdefault(point, joint)
        others = [k for k, point in enumerate(graph.points) if point.body == index and k not in joints]
        points = {k: graph.points[k].at for k in (*joints, *others)}
        #: the point of the first joint of the file
        self.first = next(iter(joints))
        self.origin = points[self.first]
        # The joints give the line; a body on a single one is a cantilever to the next best point.
        end = max(joints, key=lambda k: math.dist(points[k], self.origin))
        size = max(math.dist(at, self.origin) for at in points.values())
        if math.dist(points[end], self.origin) <= NEAR * size:
            end = next((k for k in others if math.dist(points[k], self.origin) > NEAR * size), end)
        span = math.dist(points[end], self.origin)
        if span <= NEAR * graph.units.length:
            problem = "an elastic body reaches from a joint to another joint, a load or the output; this has no length"
            raise graph.refuse(problem, f"bodies.{name}")
        self.direction: Vector3 = unit(_difference(points[end], self.origin))
        order = list(joints)
        low, high = (choose(order, key=lambda k: self.along(points[k])) for choose in (min, max))
        if end in joints and order.index(high) < order.index(low):
            # A member begins at the one of its outermost joints that the file has first.
            self.direction = unit(_difference(self.origin, points[end]))
        off = [joints[k] for k in joints if self._distance(points[k]) > NEAR * span]
        if off:
            between = f"'{joints[self.first]}' and '{joints.get(end, labels.get(end, ''))}'"
            problem = (
                f"an elastic body is a straight member, but {listed(off)} is not on the line through {between}; "
                "split the body and lock its straight parts together with fixed joints"
            )
            raise graph.refuse(problem, f"bodies.{name}")
        held = [self.along(points[k]) for k in joints]
        self.stops = self._stops(points, {**labels, **joints}, NEAR * span)
        #: between the outermost joints, or, on a single one, all of it
        self.whole = max(held) - min(held) if end in joints else self.stops[-1].along - self.stops[0].along

    def along(self, at: Vector3) -> float:
        """How far along the axis a point is."""
        return dot(self.direction, _difference(at, self.origin))

    def foot(self, along: float) -> Vector3:
        """The point of the axis that is so far along."""
        x, y, z = (o + along * d for o, d in zip(self.origin, self.direction, strict=True))
        return (x, y, z)

    def _distance(self, at: Vector3) -> float:
        return math.dist(at, self.foot(self.along(at)))

    def _stops(self, points: Mapping[int, Vector3], labels: Mapping[int, str], near: float) -> list[_Stop]:
        """Points by their feet, in the order along the axis; joints come first and give their name."""
        stops: list[_Stop] = []
        for k, at in points.items():
            along = self.along(at)
            here = next((stop for stop in stops if abs(stop.along - along) <= near), None)
            if here is None:
                stops.append(_Stop(along, labels.get(k, f"point{k}"), (k,)))
            else:
                stops[stops.index(here)] = replace(here, points=(*here.points, k))
        return sorted(stops, key=lambda stop: stop.along)


def _join(graph: Graph, name: str, body: BodyTable, axis: _Axis, pieces: list[int]) -> list[Member]:
    """The elastic joints between neighbouring pieces."""
    frame = _frame(graph, name, body, axis.direction)
    members: list[Member] = []
    neighbours = list(zip(axis.stops, axis.stops[1:], strict=False))
    for k, (near, far) in enumerate(neighbours):
        ends = []
        for piece in pieces[k : k + 2]:
            graph.points.append(Point(piece, axis.foot(far.along)))
            ends.append(len(graph.points) - 1)
        length = far.along - near.along
        gives = compliance(body, length, axis.whole, graph.units)
        joint = f"{name}.{near.label}-{far.label}"
        members.append(
            Member(
                name=name if len(neighbours) == 1 else joint,
                body=name,
                between=(near.label, far.label),
                joint=len(graph.joints),
                length=length,
            )
        )
        graph.joints.append(
            CompiledJoint(joint, joint, "fixed", ends[0], ends[1], frame[0], frame[0], frame[1], frame[1], gives)
        )
    return members


def _frame(graph: Graph, name: str, body: BodyTable, direction: Vector3) -> AxisAndSide:
    """Axis and side of a member, body axes."""
    if not isinstance(body, SpatialBody):
        return direction, (-direction[1], direction[0], 0.0)
    if body.side is None:
        return direction, default_side(direction)
    side = across(body.side, direction)
    if side is None:
        raise graph.refuse("lies along the member; a side is across it", f"bodies.{name}.side")
    return direction, side


def _difference(a: Vector3, b: Vector3) -> Vector3:
    return vector([p - q for p, q in zip(a, b, strict=True)])
