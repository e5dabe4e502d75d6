"""Poses of robots by MuJoCo and Pinocchio: given values of drives, all other coordinates close the loops.

Both solve g(q) = 0 with their own constraints and Jacobians by the method of Gauss and Newton, with the driven
coordinates held; jointplay is asked for none of it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointplay.exchange import mujoco_child
from jointplay.exchange.shaping import legal

Floats = NDArray[np.float64]
#: a loop is closed; in how many steps drives go from the reference pose to their values
CLOSED, STEPS, ITERATIONS = 1e-12, 8, 40
#: m by which loops of a drawing do not fit one another
OPEN = 1e-5
#: singular values smaller than this part of the largest one are none
RANK = 1e-6


def _solved(residual: Any, move: Any, free: list[int]) -> float:
    """Close what is open with the free coordinates; what stays open where closed loops do not fit one another."""
    for _ in range(ITERATIONS):
        open_, jacobian = residual()
        if not len(open_) or not free or np.abs(open_).max() < CLOSED:
            break
        step = np.linalg.lstsq(jacobian[:, free], -open_, rcond=1e-7)[0]
        move(free, step)
        if np.abs(step).max() < CLOSED:
            break
    return float(np.abs(residual()[0]).max(initial=0.0))


class MuJoCo:
    """A robot in MJCF.

    Parameters
    ----------
    path : Path
    fixed : mapping
        Joints that are not moved, with their values: lost motion and wind-up.
    """

    open = 0.0

    def __init__(self, path: Path, fixed: Mapping[str, float]) -> None:
        self.model = mujoco_child._compiled(mujoco, path)[0]
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        self.data = mujoco.MjData(self.model)
        names = [self.model.joint(j).name or f"joint{j}" for j in range(self.model.njnt)]
        self.joints = {legal(name): j for j, name in enumerate(names)}
        self.fixed = {self.joints[legal(name)]: value for name, value in fixed.items()}
        for joint, value in self.fixed.items():
            self.data.qpos[self.model.jnt_qposadr[joint]] = value

    def _dofs(self) -> list[int]:
        """All that can move: what hangs on a free joint is held by it."""
        frees = mujoco.mjtJoint.mjJNT_FREE
        return [
            d
            for d in range(self.model.nv)
            if self.model.jnt_type[self.model.dof_jntid[d]] != frees and self.model.dof_jntid[d] not in self.fixed
        ]

    def scatter(self, random: np.random.Generator) -> None:
        """Begin somewhere else: loops may close in another way from there."""
        mujoco.mj_resetData(self.model, self.data)
        for joint, value in self.fixed.items():
            self.data.qpos[self.model.jnt_qposadr[joint]] = value
        dofs = self._dofs()
        self._move(dofs, random.normal(0.0, 0.7, len(dofs)))

    def _residual(self) -> tuple[Floats, Floats]:
        mujoco.mj_forward(self.model, self.data)
        rows = self.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        jacobian = np.array(self.data.efc_J).reshape(-1, self.model.nv)[: len(rows)]
        return np.array(self.data.efc_pos[rows]), jacobian[rows]

    def _move(self, dofs: list[int], step: Floats) -> None:
        change = np.zeros(self.model.nv)
        change[dofs] = step
        mujoco.mj_integratePos(self.model, self.data.qpos, change, 1.0)

    def poses(self, values: Mapping[str, float]) -> dict[str, tuple[Floats, Floats]] | None:
        """Origins and axes of the bodies, in m; None where the loops stay open."""
        driven = {self.joints[name]: value for name, value in values.items()}
        start = {j: self.data.qpos[self.model.jnt_qposadr[j]] for j in driven}
        free = [d for d in self._dofs() if self.model.dof_jntid[d] not in driven]
        for part in np.linspace(1 / STEPS, 1, STEPS):
            for joint, value in driven.items():
                self.data.qpos[self.model.jnt_qposadr[joint]] = start[joint] + part * (value - start[joint])
            self.open = _solved(self._residual, self._move, free)
        if self.open > OPEN:
            return None
        return {
            legal(self.model.body(b).name or f"body{b}"): (
                self.data.xpos[b].copy(),
                self.data.xmat[b].reshape(3, 3).copy(),
            )
            for b in range(1, self.model.nbody)
        }

    def freedoms(self) -> int:
        """Degrees of freedom in the pose that was asked for last."""
        dofs = self._dofs()
        return len(dofs) - _rank(self._residual()[1][:, dofs], self.open)


class Pinocchio:
    """A robot in URDF.

    Parameters
    ----------
    path : Path
    balls : sequence of pairs
        Links whose origins coincide.
    """

    open = 0.0

    def __init__(self, path: Path, balls: Sequence[tuple[str, str]]) -> None:
        self.model = pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        self.q = pin.neutral(self.model)
        self.joints = {legal(name): joint for name, joint in zip(self.model.names, self.model.joints, strict=True)}
        self.links = {f.name: k for k, f in enumerate(self.model.frames) if f.type == pin.FrameType.BODY}
        self.laws = []
        for joint in ElementTree.parse(path).getroot().iter("joint"):
            law = joint.find("mimic")
            if law is not None:
                follower, leader = (self.joints[legal(name)] for name in (joint.get("name"), law.get("joint")))
                self.laws.append((follower, leader, float(law.get("multiplier", 1)), float(law.get("offset", 0))))
        self.balls = [(self.links[one], self.links[other]) for one, other in balls]

    def scatter(self, random: np.random.Generator) -> None:
        """Begin somewhere else: loops may close in another way from there."""
        self.q = pin.integrate(self.model, pin.neutral(self.model), random.normal(0.0, 0.7, self.model.nv))

    def _residual(self) -> tuple[Floats, Floats]:
        pin.computeJointJacobians(self.model, self.data, self.q)
        pin.updateFramePlacements(self.model, self.data)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        gaps = [self.data.oMf[one].translation - self.data.oMf[other].translation for one, other in self.balls]
        rows = [
            pin.getFrameJacobian(self.model, self.data, one, axes)[:3]
            - pin.getFrameJacobian(self.model, self.data, other, axes)[:3]
            for one, other in self.balls
        ]
        for follower, leader, factor, offset in self.laws:
            gaps.append(np.array([self._value(follower) - factor * self._value(leader) - offset]))
            row = np.zeros((1, self.model.nv))
            row[0, follower.idx_v], row[0, leader.idx_v] = 1.0, -factor
            rows.append(row)
        return np.concatenate([np.zeros(0), *gaps]), np.vstack([np.zeros((0, self.model.nv)), *rows])

    def _move(self, dofs: list[int], step: Floats) -> None:
        change = np.zeros(self.model.nv)
        change[dofs] = step
        self.q = pin.integrate(self.model, self.q, change)

    def _value(self, joint: Any) -> float:
        own = self.q[joint.idx_q : joint.idx_q + joint.nq]
        return math.atan2(own[1], own[0]) if joint.nq == 2 else float(own[0])

    def poses(self, values: Mapping[str, float]) -> dict[str, tuple[Floats, Floats]] | None:
        """Origins and axes of the links, in m; None where the loops stay open."""
        driven = {name: (self.joints[name], value) for name, value in values.items()}
        start = {name: self._value(joint) for name, (joint, _) in driven.items()}
        moved = {joint.idx_v for joint, _ in driven.values()}
        free = [d for d in range(self.model.nv) if d not in moved]
        for part in np.linspace(1 / STEPS, 1, STEPS):
            for name, (joint, value) in driven.items():
                at = start[name] + part * (value - start[name])
                self.q[joint.idx_q : joint.idx_q + joint.nq] = (math.cos(at), math.sin(at)) if joint.nq == 2 else at
            self.open = _solved(self._residual, self._move, free)
        if self.open > OPEN:
            return None
        frames = {legal(name): self.data.oMf[k] for name, k in self.links.items()}
        return {name: (frame.translation.copy(), frame.rotation.copy()) for name, frame in frames.items()}

    def freedoms(self) -> int:
        """Degrees of freedom in the pose that was asked for last."""
        return self.model.nv - _rank(self._residual()[1], self.open)


def _rank(jacobian: Floats, open_: float) -> int:
    """Rank; loops that do not quite fit have small singular values."""
    if not jacobian.size:
        return 0
    found = np.linalg.svd(jacobian, compute_uv=False)
    return int((found > (RANK + 1e3 * open_) * found[0]).sum())


def coordinates(m: Any, values: Floats) -> Iterator[tuple[str, float]]:
    """Coordinates of joints that drives move first; what follows them is the engine's own."""
    for moves, value in zip(m.drive_moves, values, strict=True):
        joint, coefficient = moves[0]
        yield m.joints[joint], float(value * coefficient)
