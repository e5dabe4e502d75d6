"""How mechanisms move and what that takes, without jointplay's derivatives.

Velocities and accelerations are differences of closed poses. Joint forces and drive torques of a crank with a rod and a
slider are those of Pinocchio: the mechanism is cut open at the last pin or ball, the recursive Newton-Euler algorithm
gives what the tree needs, and the force at the cut is the one that leaves nothing for joints without a motor.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import jointplay as jp
from jointplay.basics import poses

Floats = NDArray[np.float64]
#: singular value of the closure below which the steps of differences are smaller
NEAR = 0.2


def differenced(
    m: jp.Mechanism, drives: Floats, placed: Floats, speeds: Floats, accelerations: Floats
) -> tuple[Floats, Floats]:
    """Velocities and accelerations of all bodies at the core's origins, from poses a little before and after.

    Fourth order in the time step: the poses of five instants.
    """
    # About a thousandth of a radian, or of the characteristic length, from one to the next.
    unit = np.array([1.0 if m.coordinate_kind(j) == "angle" else m.length for j in m.drive_joints])
    # Near a singularity bodies move so much faster than the drives.
    near = min(1.0, float(m.core.measure(drives, placed)["singular_value"][0]) / NEAR)
    h = 2e-3 * near / max(float(np.abs(speeds / unit).max()), float(np.sqrt(np.abs(accelerations / unit).max())))
    around = []
    for k in (-2, -1, 1, 2):
        aim = drives + k * h * speeds + (k * h) ** 2 / 2 * accelerations
        (_, there) = m.core.trace(np.concatenate([drives, aim]), placed[0])["poses"]
        around.append(_moved(placed[0], there, m.core.origins))
    a, b, c, d = around
    velocity = (8.0 * (c - b) - (d - a)) / (12.0 * h)
    second = (16.0 * (b + c) - (a + d)) / (12.0 * h * h)
    return velocity, second


def _moved(placed: Floats, there: Floats, origins: Floats) -> Floats:
    """Displacement of the origins and rotation vector, six numbers a body.

    To second order the derivatives of a rotation vector from zero are angular velocity and angular acceleration.
    """
    one, other = (poses.position(at) + (poses.matrix(at) @ origins[..., None])[..., 0] for at in (placed, there))
    shift = other - one
    turn = poses.matrix(there) @ np.swapaxes(poses.matrix(placed), -1, -2)
    vectors = Rotation.from_matrix(turn).as_rotvec()
    return np.concatenate([shift, vectors], axis=-1)


@dataclass(frozen=True)
class Part:
    """A body: mass, centre and moments of inertia about it, in the axes of the body, SI."""

    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float]

    def of_pinocchio(self) -> pin.Inertia:
        return pin.Inertia(self.mass, np.array(self.centre), np.diag(self.inertia))


class CutOpen:
    """A crank about z, a rod on it, and a slider along x, cut open between rod and slider.

    Parameters
    ----------
    crank, rod, slider : Part
    arm, length : ndarray
        From the crank's axis to the rod, in the axes of the crank; from there to the slider, in those of the rod.
    line : ndarray
        A point of the slider's line.
    ball : bool
        Whether the rod hangs on a ball; on a pin if not.
    gravity : ndarray
    """

    def __init__(
        self,
        crank: Part,
        rod: Part,
        slider: Part,
        arm: Floats,
        length: Floats,
        line: Floats,
        *,
        ball: bool,
        gravity: Floats,
    ) -> None:
        self.model = pin.Model()
        self.model.gravity.linear = gravity
        one = self.model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "crank")
        kind = pin.JointModelSpherical() if ball else pin.JointModelRZ()
        two = self.model.addJoint(one, kind, pin.SE3(np.eye(3), arm), "rod")
        three = self.model.addJoint(0, pin.JointModelPX(), pin.SE3(np.eye(3), line), "slider")
        for joint, part in ((one, crank), (two, rod), (three, slider)):
            self.model.appendBodyToJoint(joint, part.of_pinocchio(), pin.SE3.Identity())
        frame = pin.Frame("end", two, pin.SE3(np.eye(3), length), pin.FrameType.OP_FRAME)
        self.end = self.model.addFrame(frame)
        frame = pin.Frame("socket", three, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
        self.socket = self.model.addFrame(frame)
        self.data = self.model.createData()
        self.axes = [0, 1, 2] if ball else [0, 1]

    def _gap(self, q: Floats) -> tuple[Floats, Floats]:
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        one, two = (
            pin.getFrameJacobian(self.model, self.data, f, world)[:3][self.axes] for f in (self.socket, self.end)
        )
        gap = self.data.oMf[self.socket].translation - self.data.oMf[self.end].translation
        return gap[self.axes], one - two

    def solve(
        self, theta: float, speed: float, acceleration: float, load: Floats, start: Floats
    ) -> tuple[float, Floats]:
        """Torque on the crank, and force of the rod on the slider, with a load on the slider."""
        q = pin.neutral(self.model)
        q = pin.integrate(self.model, q, start)
        q[0] = theta
        free = list(range(1, self.model.nv))
        for _ in range(50):
            gap, jacobian = self._gap(q)
            step = np.zeros(self.model.nv)
            # Of all spins of a rod between balls the smallest step has none.
            step[free] = np.linalg.lstsq(jacobian[:, free], -gap, rcond=1e-9)[0]
            q = pin.integrate(self.model, q, step)
        _, jacobian = self._gap(q)
        v = np.zeros(self.model.nv)
        v[0] = speed
        v[free] = self._without_spin(q, jacobian[:, free], -jacobian[:, 0] * speed)
        a = np.zeros(self.model.nv)
        a[0] = acceleration
        pin.forwardKinematics(self.model, self.data, q, v, a)
        pin.updateFramePlacements(self.model, self.data)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        one, two = (
            pin.getFrameClassicalAcceleration(self.model, self.data, f, world).linear for f in (self.socket, self.end)
        )
        a[free] = self._without_spin(q, jacobian[:, free], -(one - two)[self.axes])
        needed = pin.rnea(self.model, self.data, q, v, a)
        needed[-1] -= load[0]
        # What the joints of the tree have to give is that of the motor alone: the force f on the slider does the rest.
        force = np.linalg.lstsq(jacobian[:, free].T, needed[free], rcond=1e-9)[0]
        return float(needed[0] - jacobian[:, 0] @ force), force

    def _without_spin(self, q: Floats, jacobian: Floats, right: Floats) -> Floats:
        """The motion of the free joints; of a rod on a ball that which does not turn it about its line."""
        found: Floats = np.linalg.lstsq(jacobian, right, rcond=1e-9)[0]
        return found
