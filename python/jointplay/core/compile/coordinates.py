"""Coordinates of joints, from the poses of bodies.

revolute, screw                        angle of the second body relative to the first, about the axis
prismatic, cylindrical, pin_in_slot    distance along the first body's axis from the first point to the second
"""

from __future__ import annotations

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import Spec

from .graph import ANGULAR, SLIDING


def coordinate(spec: Spec, index: int, at: Floats) -> Floats:
    """Coordinate of a joint, SI and radians; nan for joints that have none.

    Parameters
    ----------
    spec : Spec
        The mechanism as the core reads it.
    index : int
        Which joint.
    at : ndarray
        Poses of all bodies, shape (..., body, pose).
    """
    joint = spec["joints"][index]
    if joint["kind"] in ANGULAR and at.shape[-1] != poses.SPATIAL:
        first, second = bodies_of(spec, index, at)
        # Not taken apart into full turns: a crank may go round.
        return np.asarray(second[..., 2] - first[..., 2])
    if joint["kind"] == "screw":
        return _screwed(spec, index, at)
    if joint["kind"] in ANGULAR:
        return _about(spec, index, at)
    if joint["kind"] in SLIDING:
        return _along(spec, index, at)
    return np.full(at.shape[:-2], np.nan)


def bodies_of(spec: Spec, index: int, at: Floats) -> tuple[Floats, Floats]:
    """Poses of the two bodies of a joint, at poses of all bodies of shape (..., body, pose)."""
    ground = np.broadcast_to(poses.ground(at.shape[-1]), (*at.shape[:-2], 1, at.shape[-1]))
    placed = np.concatenate([at, ground], axis=-2)  # the ground has index -1
    ends = (spec["points"][spec["joints"][index][end]] for end in ("first", "second"))
    first, second = (placed[..., end["body"], :] for end in ends)
    return first, second


def _along(spec: Spec, index: int, at: Floats) -> Floats:
    joint = spec["joints"][index]
    first, second = bodies_of(spec, index, at)
    axis = poses.matrix(first) @ np.array(joint["axis_first"])
    ends = [spec["points"][joint[end]]["at"] for end in ("first", "second")]
    return np.asarray(((poses.place(second, ends[1]) - poses.place(first, ends[0])) * axis).sum(axis=-1))


def _about(spec: Spec, index: int, at: Floats) -> Floats:
    """Angle about a joint's axis in space, within half a turn."""
    joint = spec["joints"][index]
    a = poses.joint_axes(joint["axis_first"], joint["side_first"])
    b = poses.joint_axes(joint["axis_second"], joint["side_second"])
    first, second = bodies_of(spec, index, at)
    return poses.twist_angle((poses.matrix(first) @ a).swapaxes(-1, -2) @ poses.matrix(second) @ b)


def _screwed(spec: Spec, index: int, at: Floats) -> Floats:
    """Angle of a screw, its full turns since the start counted by how far it has gone."""
    turn, lead = 2.0 * np.pi, spec["joints"][index]["coupling"]["lead"]
    start, angle = np.array(spec["guess"]), _about(spec, index, at)
    gone = (_along(spec, index, at) - _along(spec, index, start)) / lead * turn
    return np.asarray(angle + turn * np.round((_about(spec, index, start) + gone - angle) / turn))
