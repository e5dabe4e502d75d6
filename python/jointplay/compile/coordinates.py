"""Coordinates of joints, from the poses of bodies.

revolute                               angle of the second body relative to the first, about the axis
prismatic, cylindrical, pin_in_slot    distance along the first body's axis from the first point to the second
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay import poses

from .graph import ANGULAR, SLIDING

Floats = NDArray[np.float64]


def coordinate(spec: Mapping[str, Any], index: int, at: Floats) -> Floats:
    """Coordinate of a joint, SI and radians; nan for joints that have none.

    Parameters
    ----------
    spec : mapping
        The mechanism as the core reads it.
    index : int
        Which joint.
    at : ndarray
        Poses of all bodies, shape (..., body, pose).
    """
    joint = spec["joints"][index]
    ground = np.broadcast_to(poses.ground(at.shape[-1]), (*at.shape[:-2], 1, at.shape[-1]))
    placed = np.concatenate([at, ground], axis=-2)  # the ground has index -1
    ends = [spec["points"][joint[end]] for end in ("first", "second")]
    first, second = (placed[..., end["body"], :] for end in ends)
    if joint["kind"] in ANGULAR and at.shape[-1] != poses.SPATIAL:
        # Not taken apart into full turns: a crank may go round.
        return np.asarray(second[..., 2] - first[..., 2])
    if joint["kind"] in ANGULAR:
        a, b = (poses.joint_axes(joint[f"axis_{end}"], joint[f"side_{end}"]) for end in ("first", "second"))
        return poses.twist_angle((poses.matrix(first) @ a).swapaxes(-1, -2) @ poses.matrix(second) @ b)
    if joint["kind"] in SLIDING:
        axis = poses.matrix(first) @ np.array(joint["axis_first"])
        gap = poses.place(second, ends[1]["at"]) - poses.place(first, ends[0]["at"])
        return np.asarray((gap * axis).sum(axis=-1))
    return np.full(at.shape[:-2], np.nan)
