"""The guess from which a mechanism in space is assembled.

Bodies that are described in one drawing of the assembled mechanism are as drawn, moved on by the first values of the
drives on the way to the ground. The others follow by walking the joints outwards: a joint puts the body's point on its
neighbour's and lines up their axes and sides, so that its coordinate is zero, or that of its drive. Loops need not
close.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.file.schema import SpatialFile, SpatialStart

from .drives import Commands
from .frames import cross_axes
from .graph import GROUND_INDEX, CompiledJoint, Graph, Outward


@dataclass(frozen=True)
class _Place:
    """Rotation matrix and position of a body."""

    turn: Floats
    at: Floats

    def point(self, at: tuple[float, ...]) -> Floats:
        return np.asarray(self.at + self.turn @ np.array(at))

    def then(self, other: _Place) -> _Place:
        return _Place(self.turn @ other.turn, self.at + self.turn @ other.at)

    def back(self) -> _Place:
        return _Place(self.turn.T, -self.turn.T @ self.at)


GROUND = _Place(np.eye(3), np.zeros(3))


def spatial_start(data: SpatialFile, graph: Graph, commands: Commands) -> Floats:
    """Guess (position, quaternion) of every body in SI, ground axes; shape (body, 7)."""
    asked = {graph.bodies.index(name): start for name, start in data.start.items()}
    whole = (b for b, s in asked.items() if None not in (s.x, s.y, s.z) and s.rotation is not None)
    places = {body: _as_asked(graph, GROUND, asked[body]) for body in whole}
    places[GROUND_INDEX] = GROUND
    drawn = {body: _drawn(graph, body) for body in graph.drawn_assembled}
    first = commands.first_values(data)
    outward = Outward(graph, places)
    while len(places) <= len(graph.bodies):
        # Level by level, so that a body is placed from the neighbour that is nearest to the ground.
        level: dict[int, _Place] = {}
        waiting: dict[int, _Place] = {}
        for index, joint in outward.joints():
            a, b = graph.ends(joint)
            known, new = (a, b) if a in places else (b, a)
            if not joint.places or known not in places or new in places or new in level or new in waiting:
                continue
            between = _cross_between(graph, new, places)
            found = between or _beside(graph, joint, places, drawn, first.get(index))
            # A cross takes up how its two bodies stand to each other, if both can be had without it.
            later = new in graph.crosses and between is None
            (waiting if later else level)[new] = _as_asked(graph, found, asked[new]) if new in asked else found
        if not (level or waiting):
            raise graph.nowhere(places, "x, y, z and rotation")
        places |= level or waiting
        outward.add(level or waiting)
    ordered = (places[body] for body in range(len(graph.bodies)))
    return np.array([[*place.at, *poses.from_axes(place.turn)] for place in ordered]).reshape(-1, poses.SPATIAL)


def _as_asked(graph: Graph, place: _Place, start: SpatialStart) -> _Place:
    """The place, with what the file says of it."""
    at = [
        old if new is None else new * graph.units.length
        for old, new in zip(place.at, (start.x, start.y, start.z), strict=True)
    ]
    turn = place.turn
    if start.rotation is not None:
        vector = np.array(start.rotation) * graph.units.angle
        turn = poses.turned_by(vector)
    return _Place(turn, np.array(at))


def _drawn(graph: Graph, body: int) -> _Place:
    """Where a body is in the drawing: its axes are those of the ground, those of a cross along its pins."""
    axes = graph.crosses.get(body)
    if axes is None:
        return GROUND
    pin = next(joint for joint in graph.joints if graph.points[joint.second].body == body)
    return _Place(np.array(cross_axes(*axes)).T, np.array(graph.points[pin.first].at))


def _cross_between(graph: Graph, body: int, places: dict[int, _Place]) -> _Place | None:
    """The cross of a universal joint whose two bodies are placed: along both of its pins."""
    if body not in graph.crosses:
        return None
    first = next(joint for joint in graph.joints if graph.points[joint.second].body == body)
    second = next(joint for joint in graph.joints if graph.points[joint.first].body == body)
    ends = graph.points[first.first], graph.points[second.second]
    if any(end.body not in places for end in ends):
        return None
    a, b = (places[end.body] for end in ends)
    x, y = a.turn @ np.array(first.axis_first), b.turn @ np.array(second.axis_second)
    axes = cross_axes((float(x[0]), float(x[1]), float(x[2])), (float(y[0]), float(y[1]), float(y[2])))
    return _Place(np.array(axes).T, a.point(ends[0].at))


def _beside(
    graph: Graph, joint: CompiledJoint, places: dict[int, _Place], drawn: dict[int, _Place], value: float | None
) -> _Place:
    """Where the body on the other side of a joint is, when its coordinate has a value."""
    first, second = graph.points[joint.first], graph.points[joint.second]
    frame = _Place(poses.joint_axes(joint.axis_first, joint.side_first), np.array(first.at))
    other = _Place(poses.joint_axes(joint.axis_second, joint.side_second), np.array(second.at))
    if first.body in drawn and second.body in drawn:
        a, b = drawn[first.body].then(frame), drawn[second.body].then(other)
        rest = a.back().then(b)
        reference = float(poses.twist_angle(rest.turn) if joint.is_angular else rest.at[0])
        moved = _along(joint, 0.0 if value is None else value - reference).then(rest)
    else:
        moved = _along(joint, value or 0.0)
    forward = first.body in places
    if forward:
        found = places[first.body].then(frame).then(moved).then(other.back())
    else:
        found = places[second.body].then(other).then(moved.back()).then(frame.back())
    if joint.kind != "spherical":
        return found
    # A ball leaves every angle open; one that nobody gives is zero.
    here, there, known = (first, second, first.body) if forward else (second, first, second.body)
    return _Place(np.eye(3), places[known].point(here.at) - np.array(there.at))


def _along(joint: CompiledJoint, value: float) -> _Place:
    """The motion of a joint's coordinate, in its own axes."""
    if joint.is_angular:
        return _Place(poses.turned_by([value, 0.0, 0.0]), np.zeros(3))
    return _Place(np.eye(3), np.array([value, 0.0, 0.0]))
