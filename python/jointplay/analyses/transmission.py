"""Transmission angles: between the lines along two bodies of a mechanism in the plane."""

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism

from .nominal import Nominal


def lines(m: Mechanism, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """Of both bodies of a joint the points between which their lines go.

    Raises
    ------
    InputError
        When there is no such joint, or one of its bodies has not two joints.
    """
    key = f"design.transmission.{name}"
    if m.pose_size == poses.SPATIAL:
        raise InputError("transmission angles are of mechanisms in the plane", file=m.file, key=key)
    if name not in m.joints:
        raise InputError(not_known(name, "a joint", m.joints), file=m.file, key=key)
    k = m.joints.index(name)
    found = []
    for own, body in zip(m.joint_points[k], m.joint_bodies[k], strict=True):
        others = [
            point
            for j, (points, bodies) in enumerate(zip(m.joint_points, m.joint_bodies, strict=True))
            for point, other in zip(points, bodies, strict=True)
            if j != k and other == body
        ]
        if body < 0 or len(others) != 1:
            what = "the ground" if body < 0 else f"body '{m.bodies[body]}' with {len(others) + 1} joints"
            problem = f"a transmission angle is between two bodies with two joints each; here is {what}"
            raise InputError(problem, file=m.file, key=key)
        found.append((own, others[0]))
    return found[0], found[1]


def angle(m: Mechanism, at: Nominal, crossing: tuple[tuple[int, int], tuple[int, int]]) -> Floats:
    """The acute angle between two lines at every configuration."""
    ways = [place_of(m, at, far) - place_of(m, at, near) for near, far in crossing]
    cross = ways[0][:, 0] * ways[1][:, 1] - ways[0][:, 1] * ways[1][:, 0]
    return np.asarray(np.arctan2(np.abs(cross), np.abs(np.sum(ways[0] * ways[1], axis=1))))


def place_of(m: Mechanism, at: Nominal, point: int) -> Floats:
    """Where a point of a body is at every configuration, SI."""
    one = m.points[point]
    if one.body < 0:
        return np.tile(np.array(one.at), (len(at), 1))
    return poses.place(at.poses[:, one.body], one.at)
