"""The guess from which a mechanism in the plane is assembled.

The file says roughly where bodies are, often only their angles. The rest follows by walking the joints outwards
from the ground: a pin joint puts the body's point on its neighbour's, a guide also lends its direction. Loops need not
close.
"""

import math

import numpy as np
from numpy.typing import NDArray

from jointplay.file.schema import PlanarFile

from .drives import Commands
from .frames import Vector3
from .graph import GROUND_INDEX, SLIDING, CompiledJoint, Graph, Outward

Pose = tuple[float, float, float]


def planar_start(data: PlanarFile, graph: Graph, commands: Commands) -> NDArray[np.float64]:
    """Guess (x, y, angle) of every body in SI, ground axes; shape (body, 3)."""
    given = {graph.bodies.index(name): start for name, start in data.start.items()}
    units = graph.units
    asked: dict[int, list[float | None]] = {
        body: [_si(s.x, units.length), _si(s.y, units.length), _si(s.angle, units.angle)] for body, s in given.items()
    }
    poses: dict[int, Pose] = {
        body: (x, y, angle)
        for body, (x, y, angle) in asked.items()
        if x is not None and y is not None and angle is not None
    }
    poses[GROUND_INDEX] = (0.0, 0.0, 0.0)
    first = commands.first_values(data)
    outward = Outward(graph, poses)
    while len(poses) <= len(graph.bodies):
        # Level by level, so that a body is placed from the neighbour that is nearest to the ground.
        level: dict[int, Pose] = {}
        for index, joint in outward.joints():
            a, b = graph.ends(joint)
            known, new = (a, b) if a in poses else (b, a)
            if not joint.places or known not in poses or new in poses or new in level:
                continue
            level[new] = _beside(graph, joint, poses[known], new, asked.get(new, [None] * 3), first.get(index, 0.0))
        if not level:
            raise graph.nowhere(poses, "x, y and angle")
        poses |= level
        outward.add(level)
    return np.array([poses[body] for body in range(len(graph.bodies))])


def _si(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _beside(
    graph: Graph, joint: CompiledJoint, pose: Pose, new: int, asked: list[float | None], coordinate: float
) -> Pose:
    """Pose of a body next to a placed one, keeping what the file says of it."""
    first, second = graph.points[joint.first], graph.points[joint.second]
    forward = new == second.body
    here, there = (first, second) if forward else (second, first)
    # Pins leave the angle open; an angle that nobody gives is zero.
    angle = 0.0
    if joint.kind in ("prismatic", "fixed"):
        turn = _angle(joint.axis_first) - _angle(joint.axis_second)
        angle = pose[2] + turn if forward else pose[2] - turn
    x, y, angle_asked = asked
    angle = angle if angle_asked is None else angle_asked
    px, py = _turned(here.at, pose[2])
    qx, qy = _turned(there.at, angle)
    along = (0.0, 0.0)
    if joint.kind in SLIDING:
        distance = coordinate if forward else -coordinate
        along = _turned((distance, 0.0, 0.0), _angle(joint.axis_first) + (pose[2] if forward else angle))
    return (
        pose[0] + px + along[0] - qx if x is None else x,
        pose[1] + py + along[1] - qy if y is None else y,
        angle,
    )


def _angle(axis: Vector3) -> float:
    return math.atan2(axis[1], axis[0])


def _turned(at: Vector3, angle: float) -> tuple[float, float]:
    c, s = math.cos(angle), math.sin(angle)
    return (c * at[0] - s * at[1], s * at[0] + c * at[1])
