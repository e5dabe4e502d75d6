"""Poses of bodies as the core has them, and rotations.

In the plane a pose is (x, y, angle), in space (x, y, z, w, i, j, k): position and unit quaternion, body axes to ground
axes. A rotation vector lies along the axis of the rotation and is as long as its angle.

All functions take arrays of any leading shape; the last axis holds one pose, quaternion or vector.
"""

import numpy as np
from numpy.typing import ArrayLike

from jointplay.basics.arrays import Floats

#: numbers of a pose in space
SPATIAL = 7
#: squared sine below which the series of an angle over its sine is exact to rounding
SMALL = 1e-20


def quaternion(vector: ArrayLike) -> Floats:
    """Unit quaternion of a rotation vector.

    Examples
    --------
    >>> quaternion([np.pi, 0, 0]).round(12)
    array([0., 1., 0., 0.])
    """
    v = np.asarray(vector, dtype=np.float64)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # sin(half) / (2 half), finite at zero.
    scale = 0.5 * np.sinc(half / np.pi)
    return np.concatenate([np.cos(half), scale * v], axis=-1)


def rotation_vector(q: ArrayLike) -> Floats:
    """Rotation vector, of length up to pi, of a unit quaternion.

    Examples
    --------
    >>> rotation_vector(quaternion([0.1, -2, 0.3])).round(12)
    array([ 0.1, -2. ,  0.3])
    """
    q = np.asarray(q, dtype=np.float64)
    q = np.where(q[..., :1] < 0, -q, q)
    w, v = q[..., :1], q[..., 1:]
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    known = sine * sine > SMALL
    scale = np.divide(2.0 * np.arctan2(sine, w), sine, out=np.full_like(sine, 2.0), where=known)
    return np.asarray(scale * v)


def product(a: ArrayLike, b: ArrayLike) -> Floats:
    """Quaternion of the rotation b followed by the rotation a."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    w = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([w, v], axis=-1)


def inverse(q: ArrayLike) -> Floats:
    """Quaternion of the inverse rotation."""
    return np.asarray(np.asarray(q, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0]))


def from_axes(axes: ArrayLike) -> Floats:
    """Unit quaternion of a rotation matrix, whose columns are the turned axes; one matrix.

    Examples
    --------
    >>> from_axes(np.eye(3))
    array([1., 0., 0., 0.])
    """
    m = np.asarray(axes, dtype=np.float64)
    # The largest of the four numbers is found first, so that nothing is divided by what rounding left of zero.
    diagonal = np.diagonal(m)
    squares = np.array([1 + diagonal.sum(), *(1 + 2 * diagonal - diagonal.sum())])
    k = int(squares.argmax())
    turned = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    q = np.empty(4)
    if k == 0:
        q[0], q[1:] = squares[0], turned
    else:
        q[0], q[1:] = turned[k - 1], (m + m.T)[k - 1]
        q[k] = squares[k]
    q = q if q[0] >= 0 else -q
    return np.asarray(q / np.linalg.norm(q))


def turned_by(vector: ArrayLike) -> Floats:
    """Rotation matrices of rotation vectors; shape (..., 3, 3).

    Examples
    --------
    >>> turned_by([0, 0, np.pi / 2]).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    q = quaternion(vector)
    return matrix(np.concatenate([np.zeros((*q.shape[:-1], 3)), q], axis=-1))


def matrix(poses: ArrayLike) -> Floats:
    """Rotation matrices of poses, body axes to ground axes; shape (..., 3, 3)."""
    poses = np.asarray(poses, dtype=np.float64)
    if poses.shape[-1] == SPATIAL:
        w, x, y, z = np.moveaxis(poses[..., 3:], -1, 0)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    else:
        c, s = np.cos(poses[..., 2]), np.sin(poses[..., 2])
        zero, one = np.zeros_like(c), np.ones_like(c)
        rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    return np.asarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))


def position(poses: ArrayLike) -> Floats:
    """Positions of the origins, with z = 0 in the plane; shape (..., 3)."""
    poses = np.asarray(poses, dtype=np.float64)
    if poses.shape[-1] == SPATIAL:
        return poses[..., :3]
    return np.concatenate([poses[..., :2], np.zeros_like(poses[..., :1])], axis=-1)


def place(poses: ArrayLike, at: ArrayLike) -> Floats:
    """Where a point of a body (body axes, three coordinates) is in ground axes."""
    return position(poses) + matrix(poses) @ np.asarray(at, dtype=np.float64)


def seen_from(poses: ArrayLike, vectors: ArrayLike) -> Floats:
    """Vectors in the axes of bodies from those in ground axes."""
    return np.asarray((np.swapaxes(matrix(poses), -1, -2) @ np.asarray(vectors)[..., None])[..., 0])


def ground(size: int) -> Floats:
    """The pose of the ground, which has so many numbers."""
    pose = np.zeros(size)
    if size == SPATIAL:
        pose[3] = 1.0
    return pose


def components(poses: ArrayLike) -> Floats:
    """Poses as results have them: (x, y, angle), or position and rotation vector."""
    poses = np.asarray(poses, dtype=np.float64)
    if poses.shape[-1] != SPATIAL:
        return poses
    return np.concatenate([poses[..., :3], rotation_vector(poses[..., 3:])], axis=-1)


def difference(actual: ArrayLike, nominal: ArrayLike) -> Floats:
    """Actual - nominal, both as results have them; the rotation in space is that of R_actual R_nominal'."""
    actual, nominal = np.asarray(actual, dtype=np.float64), np.asarray(nominal, dtype=np.float64)
    if actual.shape[-1] != 6:
        return np.asarray(actual - nominal)
    turn = rotation_vector(product(quaternion(actual[..., 3:]), inverse(quaternion(nominal[..., 3:]))))
    return np.concatenate([actual[..., :3] - nominal[..., :3], turn], axis=-1)


def moved(poses: ArrayLike, twists: ArrayLike, about: ArrayLike) -> Floats:
    """Poses after points of the bodies (body axes) have moved and the bodies have turned by twists in ground axes."""
    poses, twists = np.asarray(poses, dtype=np.float64), np.asarray(twists, dtype=np.float64)
    if poses.shape[-1] != SPATIAL:
        found = np.asarray(poses + twists)
    else:
        turned = product(quaternion(twists[..., 3:]), poses[..., 3:])
        found = np.concatenate([poses[..., :3] + twists[..., :3], turned], axis=-1)
    before, after = (matrix(at) @ np.asarray(about, dtype=np.float64)[..., None] for at in (poses, found))
    axes = 3 if poses.shape[-1] == SPATIAL else 2
    found[..., :axes] += (before - after)[..., :axes, 0]
    return found


def joint_axes(axis: ArrayLike, side: ArrayLike) -> Floats:
    """Axes of a joint on one of its bodies as the columns of a matrix: along, side, normal."""
    along, across = np.asarray(axis, dtype=np.float64), np.asarray(side, dtype=np.float64)
    return np.stack([along, across, np.cross(along, across)], axis=-1)


def twist_angle(turned: Floats) -> Floats:
    """The part of rotations about the first axis, of what remains when their swing is taken away; (-pi, pi]."""
    # tr and the antisymmetric part give w and i of the quaternion up to a common factor.
    sine = turned[..., 2, 1] - turned[..., 1, 2]
    cosine = turned[..., 1, 1] + turned[..., 2, 2]
    return np.asarray(np.arctan2(sine, cosine))
