"""Rotations as formats of robots write them."""

from __future__ import annotations

import numpy as np

from .skeleton import Matrix, Vector


def from_rpy(rpy: Vector) -> Matrix:
    """Rotation matrix of roll, pitch and yaw in radians: about the fixed x, then y, then z axis, as in URDF and SDF.

    Examples
    --------
    >>> from_rpy(np.array([0.0, 0.0, np.pi / 2])).round(12)[:, 0]
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


def from_wxyz(q: Vector) -> Matrix:
    """Rotation matrix of a quaternion of any length but zero.

    Examples
    --------
    >>> from_wxyz(np.array([2.0, 2.0, 0.0, 0.0])).round(12)[:, 1]
    array([0., 0., 1.])
    """
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def about(axis: Vector, angle: float) -> Matrix:
    """Rotation matrix of an angle about a unit vector."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


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
        return np.eye(3) if cosine > 0 else about(across(one), np.pi)
    return about(cross / sine, float(np.arctan2(sine, cosine)))
