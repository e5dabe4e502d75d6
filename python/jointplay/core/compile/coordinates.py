"""Coordinates of joints, from the poses of bodies.

revolute, screw                        angle of the second body relative to the first, about the axis
prismatic, cylindrical, pin_in_slot    distance along the first body's axis from the first point to the second
"""

from dataclasses import dataclass

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
        first, second = _bodies(spec, index, at)
        # Not taken apart into full turns: a crank may go round.
        return np.asarray(second[..., 2] - first[..., 2])
    if joint["kind"] == "screw":
        return _screwed(spec, index, at)
    if joint["kind"] in ANGULAR:
        return _about(spec, index, at)
    if joint["kind"] in SLIDING:
        return _along(spec, index, at)
    return np.full(at.shape[:-2], np.nan)


@dataclass(frozen=True)
class RelativePose:
    """How the second body of a joint is seen from the first, SI."""

    #: axes of the first body as rotation matrices, shape (..., 3, 3)
    axes: Floats
    #: from the first body's point to the second's, axes of the first, shape (..., 3)
    apart: Floats
    #: quaternion of the second body in the first, shape (..., 4)
    turned: Floats
    #: the joint's axis, side and normal on the first body, its rows; in the plane the side is across the plane
    directions: Floats


def relative(spec: Spec, index: int, at: Floats) -> RelativePose:
    """How the second body of a joint is seen from the first.

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
    first, second = _bodies(spec, index, at)
    axes = poses.matrix(first)
    ends = [_in_space(spec["points"][joint[end]]["at"]) for end in ("first", "second")]
    apart = poses.seen_from(first, poses.place(second, ends[1]) - poses.place(first, ends[0]))
    along = _in_space(joint["axis_first"])
    if at.shape[-1] == poses.SPATIAL:
        turned = poses.product(poses.inverse(first[..., 3:]), second[..., 3:])
        side = np.array(joint["side_first"])
    else:
        angle = second[..., 2] - first[..., 2]
        turned = poses.quaternion(np.stack([np.zeros_like(angle), np.zeros_like(angle), angle], axis=-1))
        side = np.array([0.0, 0.0, -1.0])
    return RelativePose(axes, apart, turned, np.stack([along, side, np.cross(along, side)]))


def on_body(spec: Spec, point: int, u: Floats) -> Floats:
    """Where a point is on its body, body axes; shape (specimen, axis)."""
    at: Floats = np.tile(spec["points"][point]["at"], (len(u), 1))
    first = np.cumsum([0, *(len(source["centre"]) for source in spec["sources"])])
    for number, displacement in enumerate(spec["displacements"]):
        if point not in displacement["points"]:
            continue
        along, about = np.zeros_like(at), np.zeros_like(at)
        for source, begin in zip(spec["sources"], first, strict=False):
            if source.get("displacement") == number:
                ways = np.array(source["ways"])
                values = u[:, begin : begin + len(ways)]
                along += values @ ways[:, 0]
                about += values @ ways[:, 1]
        arm = at - displacement["about"]
        at = at + along + (poses.turned_by(about) @ arm[..., None])[..., 0] - arm
    for source, begin in zip(spec["sources"], first, strict=False):
        if source["kind"] == "dimension" and point in (source["to"], *source.get("together", ())):
            way = np.subtract(spec["points"][source["to"]]["at"], spec["points"][source["from"]]["at"])
            at = at + u[:, [begin]] * way / np.linalg.norm(way)
        for move in source.get("moves", ()):
            if move["point"] == point:
                at = at + u[:, [begin]] * np.array(move["rate"])
    return at


def _in_space(vector: list[float]) -> Floats:
    """A point or a direction with three components."""
    return np.array([*vector, 0.0])[:3]


def _bodies(spec: Spec, index: int, at: Floats) -> tuple[Floats, Floats]:
    """Poses of the two bodies of a joint."""
    ground = np.broadcast_to(poses.ground(at.shape[-1]), (*at.shape[:-2], 1, at.shape[-1]))
    placed = np.concatenate([at, ground], axis=-2)  # the ground has index -1
    ends = (spec["points"][spec["joints"][index][end]] for end in ("first", "second"))
    first, second = (placed[..., end["body"], :] for end in ends)
    return first, second


def _along(spec: Spec, index: int, at: Floats) -> Floats:
    joint = spec["joints"][index]
    first, second = _bodies(spec, index, at)
    axis = poses.matrix(first) @ np.array(joint["axis_first"])
    ends = [spec["points"][joint[end]]["at"] for end in ("first", "second")]
    return np.asarray(((poses.place(second, ends[1]) - poses.place(first, ends[0])) * axis).sum(axis=-1))


def _about(spec: Spec, index: int, at: Floats) -> Floats:
    """Angle about a joint's axis in space, within half a turn."""
    joint = spec["joints"][index]
    a = poses.joint_axes(joint["axis_first"], joint["side_first"])
    b = poses.joint_axes(joint["axis_second"], joint["side_second"])
    first, second = _bodies(spec, index, at)
    return poses.twist_angle((poses.matrix(first) @ a).swapaxes(-1, -2) @ poses.matrix(second) @ b)


def _screwed(spec: Spec, index: int, at: Floats) -> Floats:
    """Angle of a screw, its full turns since the start counted by how far it has gone."""
    turn, lead = 2.0 * np.pi, spec["joints"][index]["coupling"]["lead"]
    start, angle = np.array(spec["guess"]), _about(spec, index, at)
    gone = (_along(spec, index, at) - _along(spec, index, start)) / lead * turn
    return np.asarray(angle + turn * np.round((_about(spec, index, start) + gone - angle) / turn))
