"""Rotations as formats of robots write them."""

import numpy as np

from jointplay.basics.poses import turned_by

from .skeleton import Matrix, Vector


def from_rpy(rpy: Vector) -> Matrix:
    """Rotation matrix of roll, pitch and yaw in radians: about the fixed x, then y, then z axis, as in URDF and SDF.

    Examples
    --------
    >>> from_rpy(np.array([0.0, 0.0, np.pi / 2]))[:, 0].round(12) + 0.0
    array([0., 1., 0.])
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def across(axis: Vector) -> Vector:
    """A unit vector across a unit vector: the coordinate axis that is least aligned with it, projected.

    Examples
    --------
    >>> across(np.array([0.0, 0.0, 1.0]))
    array([1., 0., 0.])
    """
    nearest = np.eye(3)[np.argmin(np.abs(axis).round(9))]
    side = nearest - axis * (axis @ nearest)
    return np.asarray(side / np.linalg.norm(side))


def aligning(one: Vector, other: Vector) -> Matrix:
    """The smallest rotation that turns a unit vector into another one."""
    cross, cosine = np.cross(one, other), float(one @ other)
    sine = float(np.linalg.norm(cross))
    if sine < 1e-12:
        return np.eye(3) if cosine > 0 else turned_by(np.pi * across(one))
    return turned_by(cross / sine * np.arctan2(sine, cosine))
