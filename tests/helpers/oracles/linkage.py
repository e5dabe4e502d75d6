"""Loop closure of a planar mechanism, written afresh from its file.

Formula (body coordinates; Nikravesh, *Computer-Aided Analysis of Mechanical Systems*, ch. 4): a body has
the pose q = (x, y, theta) and carries a point r to q + R(theta) r. A joint between a first body with point
A and axis s and a second body with point B asks, with n = s turned by +90 deg and d, psi the play in the
joint:

    revolute      B - A = d                                       coordinate theta_2 - theta_1
    prismatic     n.(B - A) = d_n,   angle of s_2 - angle of s_1 = psi     coordinate s.(B - A)
    pin_in_slot   n.(B - A) = d_n                                coordinate s.(B - A)
    fixed         B = A,             angle of s_2 - angle of s_1 = psi

A drive adds  coordinate = value + error + lost motion;  a dimension moves its second point along the line from its
first.
Units: those of the file for lengths, radians for angles. The expressions are scalar, so that the same text
is evaluated by numpy (also for whole batches, and for the complex steps that give exact derivatives) and by
casadi.
"""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from .sets import Source

STEP = 1e-30
GROUND = "ground"


@dataclass(frozen=True)
class Point:
    """A point on a body; `moves` lists the (unit direction, parameter label) that shift it in body axes."""

    body: str
    at: tuple[float, float]
    axis: float | None = None
    moves: tuple[tuple[float, float, str], ...] = ()


@dataclass(frozen=True)
class Joint:
    name: str
    kind: str
    first: Point
    second: Point


@dataclass
class Linkage:
    """A mechanism read from its file, with its closure."""

    bodies: list[str]
    joints: list[Joint]
    drives: list[tuple[str, int, list[float]]]  # name, joint, values (radians or length)
    sources: list[Source]
    output: Point
    loads: list[tuple[Point, float, float, float]]
    start: np.ndarray
    length: float
    degrees: bool
    driven_angle: list[bool] = field(default_factory=list)

    @property
    def labels(self) -> list[str]:
        return [label for s in self.sources for label in s.labels]

    @property
    def centre(self) -> dict[str, float]:
        return {label: c for s in self.sources for label, c in zip(s.labels, s.centre, strict=True)}

    @property
    def configurations(self) -> np.ndarray:
        """Drive values, shape (configurations, drives)."""
        return np.array([values for _, _, values in self.drives], dtype=float).T

    def scale(self, label: str) -> float:
        """What one file unit of a parameter is in the units used here."""
        name, component = label.rsplit(".", 1)
        angular = component == "angle"
        if component == "value":
            own = name.removeprefix("drive ").removesuffix(".backlash")
            angular = self.driven_angle[[d[0] == own for d in self.drives].index(True)]
        return math.radians(1.0) if angular and self.degrees else 1.0

    # -- closure ------------------------------------------------------

    def place(self, q: list[Any], p: Point, u: dict[str, Any], ops: Any) -> tuple[Any, Any]:
        x, y = p.at
        for dx, dy, label in p.moves:
            s = u.get(label, 0.0)
            x, y = x + dx * s, y + dy * s
        if p.body == GROUND:
            return x, y
        i = 3 * self.bodies.index(p.body)
        c, s = ops.cos(q[i + 2]), ops.sin(q[i + 2])
        return q[i] + c * x - s * y, q[i + 1] + s * x + c * y

    def angle(self, q: list[Any], body: str) -> Any:
        return 0.0 if body == GROUND else q[3 * self.bodies.index(body) + 2]

    def relative(self, q: list[Any], j: Joint, u: dict[str, Any], ops: Any) -> tuple[Any, Any, Any]:
        """(along, normal, angle) of the second placement seen from the first; (x, y, angle) for pins."""
        ax, ay = self.place(q, j.first, u, ops)
        bx, by = self.place(q, j.second, u, ops)
        turn = self.angle(q, j.second.body) - self.angle(q, j.first.body)
        if j.kind == "revolute":
            return bx - ax, by - ay, turn
        if j.kind == "fixed":
            return bx - ax, by - ay, turn + j.second.axis - j.first.axis
        phi = self.angle(q, j.first.body) + j.first.axis
        c, s = ops.cos(phi), ops.sin(phi)
        turn = turn + (0.0 if j.kind == "pin_in_slot" else j.second.axis - j.first.axis)
        return c * (bx - ax) + s * (by - ay), -s * (bx - ax) + c * (by - ay), turn

    def coordinate(self, q: list[Any], joint: int, u: dict[str, Any], ops: Any = np) -> Any:
        along, _, turn = self.relative(q, self.joints[joint], u, ops)
        return turn if self.joints[joint].kind == "revolute" else along

    def residual(self, q: list[Any], drives: Any, u: dict[str, Any], ops: Any = np) -> list[Any]:
        rows = []
        for j in self.joints:
            a, b, turn = self.relative(q, j, u, ops)
            if j.kind in ("revolute", "fixed"):
                rows += [a - u.get(f"{j.name}.x", 0.0), b - u.get(f"{j.name}.y", 0.0)]
            else:
                rows += [b - u.get(f"{j.name}.normal", 0.0)]
            if j.kind in ("prismatic", "fixed"):
                rows += [turn - u.get(f"{j.name}.angle", 0.0)]
        for k, (name, joint, _) in enumerate(self.drives):
            error = sum(u.get(f"{label}.value", 0.0) for label in (name, f"drive {name}", f"{name}.backlash"))
            rows += [self.coordinate(q, joint, u, ops) - drives[k] - error]
        return rows

    def output_pose(self, q: list[Any], u: dict[str, Any], ops: Any = np) -> list[Any]:
        return [*self.place(q, self.output, u, ops), self.angle(q, self.output.body)]

    def work(self, q: list[Any], u: dict[str, Any], ops: Any = np) -> Any:
        """Force . position + moment * angle of all loads."""
        total = 0.0
        for p, fx, fy, moment in self.loads:
            x, y = self.place(q, p, u, ops)
            total = total + fx * x + fy * y + moment * self.angle(q, p.body)
        return total

    # -- numbers ------------------------------------------------------

    def as_dict(self, u: np.ndarray | dict[str, Any] | None) -> dict[str, Any]:
        """Parameters given as the last axis of an array, by label; none: the centres."""
        if u is None:
            return dict(self.centre)
        if isinstance(u, dict):
            return {**self.centre, **u}
        return {label: np.asarray(u)[..., k] for k, label in enumerate(self.labels)}

    def rows(self, q: np.ndarray, drives: Any, u: Any) -> np.ndarray:
        columns = [q[..., i] for i in range(q.shape[-1])]
        rows = self.residual(columns, drives, self.as_dict(u))
        return np.stack(np.broadcast_arrays(*rows), axis=-1)

    def jacobian(self, q: np.ndarray, drives: Any, u: Any = None) -> np.ndarray:
        """d(rows)/d(poses) by complex steps: exact to rounding."""
        n = q.shape[-1]
        out = []
        for k in range(n):
            z = q.astype(complex)
            z[..., k] += STEP * 1j
            out.append(self.rows(z, drives, u).imag / STEP)
        return np.stack(out, axis=-1)

    def solve(self, q: np.ndarray, drives: Any, u: Any = None, iterations: int = 40) -> tuple[np.ndarray, np.ndarray]:
        """Newton from q, for a whole batch at once; returns poses and whether each has converged."""
        q = np.array(q, dtype=float)
        scale = self.length
        good = np.zeros(q.shape[:-1], dtype=bool)
        for _ in range(iterations):
            r = self.rows(q, drives, u)
            jac = self.jacobian(q, drives, u)
            with np.errstate(all="ignore"):
                try:
                    step = np.linalg.solve(jac, r[..., None])[..., 0]
                except np.linalg.LinAlgError:
                    step = (np.linalg.pinv(jac) @ r[..., None])[..., 0]
            size = np.abs(step[..., 2::3]).max(axis=-1, initial=0.0)
            q = q - step * (0.5 / np.maximum(size, 0.5))[..., None]
            # Near a singularity the rounding of the closure makes longer steps than that.
            reach = np.maximum(scale, np.abs(q).max(axis=-1))
            rounded = np.abs(r).max(axis=-1) < 64 * np.finfo(float).eps * reach
            good = (np.abs(step).max(axis=-1) < 1e-12 * scale) | rounded
            if good.all():
                break
        return q, good & np.isfinite(q).all(axis=-1)

    def out(self, q: np.ndarray, u: Any = None) -> np.ndarray:
        pose = self.output_pose([q[..., i] for i in range(q.shape[-1])], self.as_dict(u))
        return np.stack(np.broadcast_arrays(*pose), axis=-1)

    def nominal(self, drives: Any, q: np.ndarray | None = None) -> np.ndarray:
        """Poses with every source at its centre set to zero (the perfect mechanism)."""
        zero = dict.fromkeys(self.labels, 0.0)
        q, good = self.solve(self.start if q is None else q, drives, zero)
        if not np.all(good):
            raise ArithmeticError("the perfect mechanism does not assemble from here")
        return q

    def follow(self, n: int = 8) -> np.ndarray:
        """Nominal poses of every configuration, reached in small steps from the first."""
        values = self.configurations
        q = self.nominal(values[0])
        poses = [q]
        for a, b in pairwise(values):
            for t in np.linspace(0, 1, n + 1)[1:]:
                q = self.nominal(a + t * (b - a), q)
            poses.append(q)
        return np.array(poses)

    def smallest_singular_value(self, q: np.ndarray, drives: Any) -> float:
        """Of the Jacobian with every length divided by the characteristic one."""
        jac = self.jacobian(q, drives)
        jac[:, 2::3] /= self.length
        for row in range(jac.shape[0]):
            if not np.abs(jac[row, [i for i in range(jac.shape[1]) if i % 3 != 2]]).any():
                jac[row] *= self.length
        return float(np.linalg.svd(jac, compute_uv=False)[-1])

    def sensitivity(self, q: np.ndarray, drives: Any) -> tuple[np.ndarray, np.ndarray]:
        """d(output)/d(parameters) and d(output)/d(drives) at nominal: implicit function theorem."""
        jac = self.jacobian(q, drives, dict.fromkeys(self.labels, 0.0))
        zero = dict.fromkeys(self.labels, 0.0)
        dout = []
        for k in range(q.size):
            z = q.astype(complex)
            z[k] += STEP * 1j
            dout.append(self.out(z, zero).imag / STEP)
        adjoint = np.linalg.solve(jac.T, np.array(dout)).T
        columns = []
        for label in self.labels:
            u = {**zero, label: STEP * 1j}
            direct = np.array(self.out(q.astype(complex), u)).imag / STEP
            columns.append(direct - adjoint @ (self.rows(q.astype(complex), drives, u).imag / STEP))
        by_drive = []
        for k in range(len(self.drives)):
            z = np.array(drives, dtype=complex)
            z[k] += STEP * 1j
            by_drive.append(-adjoint @ (self.rows(q.astype(complex), z, zero).imag / STEP))
        return np.array(columns).T, np.array(by_drive).T
