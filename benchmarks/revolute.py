"""The closure of any planar mechanism of revolute joints, as a NumPy user would write it for many samples at a time.

Unknowns: x, y, angle of every body. Rows: `P2 - P1 - offset` of every joint (ground axes), then the drives. It is read
from the same mechanism as jointplay's own, so that all peers solve the same equations.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: samples whose matrices stay in the cache
CHUNK = 1024
#: Newton steps at most
STEPS = 8
#: a step below this is the last: the next would be its square
LAST = 1e-9


@dataclass(frozen=True)
class Revolute:
    """A mechanism in arrays; body -1 is the ground."""

    bodies: int
    body: NDArray[np.int64]  # of every point
    at: Array  # place of every point on its body
    first: NDArray[np.int64]  # points of the joints
    second: NDArray[np.int64]
    driven: NDArray[np.int64]
    moved: NDArray[np.int64]  # point that a dimension moves
    direction: Array
    output: int
    nominal: Array  # poses
    drives: Array
    nominal_output: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 3 * self.bodies

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.first)

    def points(self, u: Array) -> Array:
        """Places of all points on their bodies, [samples, point, 2], for offsets [samples, 2 joints + dimensions]."""
        at = np.repeat(self.at[None], len(u), axis=0)
        for k, point in enumerate(self.moved):
            at[:, point] += u[:, 2 * self.joints + k, None] * self.direction[k]
        return at

    def system(self, poses: Array, at: Array, u: Array, drives: Array | None = None) -> tuple[Array, Array]:
        """Residuals [samples, rows] and Jacobians [samples, rows, unknowns]; drive values of one sample or of all."""
        n, j = len(poses), self.joints
        drives = self.drives if drives is None else drives
        c, s = np.cos(poses[:, :, 2]), np.sin(poses[:, :, 2])
        residual = -u[:, : 2 * j].reshape(n, j, 2)
        jacobian = np.zeros((n, self.size, self.size))
        for sign, points in ((-1.0, self.first), (1.0, self.second)):
            for k, p in enumerate(points):
                b, (x, y) = self.body[p], at[:, p].T
                if b < 0:
                    residual[:, k] += sign * at[:, p]
                    continue
                rx, ry = c[:, b] * x - s[:, b] * y, s[:, b] * x + c[:, b] * y
                residual[:, k, 0] += sign * (poses[:, b, 0] + rx)
                residual[:, k, 1] += sign * (poses[:, b, 1] + ry)
                jacobian[:, 2 * k, 3 * b] = jacobian[:, 2 * k + 1, 3 * b + 1] = sign
                jacobian[:, 2 * k, 3 * b + 2] = -sign * ry
                jacobian[:, 2 * k + 1, 3 * b + 2] = sign * rx
        angles = np.empty((n, len(self.driven)))
        for d, k in enumerate(self.driven):
            a, b = self.body[self.first[k]], self.body[self.second[k]]
            angles[:, d] = poses[:, b, 2] - drives[..., d]
            jacobian[:, 2 * j + d, 3 * b + 2] = 1.0
            if a >= 0:
                angles[:, d] -= poses[:, a, 2]
                jacobian[:, 2 * j + d, 3 * a + 2] = -1.0
        return np.concatenate([residual.reshape(n, 2 * j), angles], axis=1), jacobian

    def error(self, poses: Array, at: Array) -> Array:
        """Error of the output [samples, 3]."""
        body = self.body[self.output]
        c, s, (x, y) = np.cos(poses[:, body, 2]), np.sin(poses[:, body, 2]), at[:, self.output].T
        place = poses[:, body] + np.stack([c * x - s * y, s * x + c * y, np.zeros_like(c)], axis=1)
        return place - self.nominal_output

    def newton(self, u: Array) -> Array:
        """Errors by Newton's method on dense Jacobians, chunk by chunk."""
        return np.concatenate([self._newton(u[k : k + CHUNK]) for k in range(0, len(u), CHUNK)])

    def nominal_poses(self, drives: Array) -> Array:
        """Poses at drive values [samples, drives] with neither play nor deviation."""
        at = np.broadcast_to(self.at, (len(drives), *self.at.shape))
        return self._poses(at, np.zeros((len(drives), 2 * self.joints)), drives)

    def _newton(self, u: Array) -> Array:
        at = self.points(u)
        return self.error(self._poses(at, u, self.drives), at)

    def _poses(self, at: Array, u: Array, drives: Array) -> Array:
        poses = np.repeat(self.nominal[None], len(u), axis=0)
        for _ in range(STEPS):
            residual, jacobian = self.system(poses, at, u, drives)
            step = np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
            poses -= step.reshape(poses.shape)
            if np.abs(step).max() < LAST:
                break
        return poses


def revolute(mechanism: Any, configuration: int = 0) -> Revolute:
    """A mechanism of revolute joints whose sources are all joints in order, then dimensions."""
    spec, core = mechanism.spec(), mechanism.core
    solved = core.trace(mechanism.drive_values)
    points, joints = spec["points"], spec["joints"]
    kinds = [s["kind"] for s in spec["sources"]]
    dimensions = [s for s in spec["sources"] if s["kind"] == "dimension"]
    loose = [s["joint"] for s in spec["sources"] if s["kind"] == "clearance"]
    if loose != list(range(len(joints))) or {j["kind"] for j in joints} != {"revolute"}:
        raise ValueError("the peers need revolute joints, all with play")
    if kinds[len(joints) : len(joints) + len(dimensions)] != ["dimension"] * len(dimensions):
        raise ValueError("the peers need the dimensions right after the joints")
    at = np.array([p["at"][:2] for p in points])
    lines = [at[s["to"]] - at[s["from"]] for s in dimensions]
    return Revolute(
        bodies=spec["n_bodies"],
        body=np.array([p["body"] for p in points]),
        at=at,
        first=np.array([j["first"] for j in joints]),
        second=np.array([j["second"] for j in joints]),
        driven=np.array([d["joint"] for d in spec["drives"]]),
        moved=np.array([s["to"] for s in dimensions], dtype=np.int64),
        direction=np.array([v / np.hypot(*v) for v in lines]).reshape(-1, 2),
        output=spec["output"]["point"],
        nominal=solved["poses"][configuration],
        drives=mechanism.drive_values[configuration],
        nominal_output=solved["output"][configuration],
    )
