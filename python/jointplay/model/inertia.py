"""Forces of inertia: what the nominal motion of the bodies does to a mechanism.

With velocities and accelerations of the origins from the core, a point at r from the origin of its body has

    v = v_O + w x r,    a = a_O + w' x r + w x (w x r)

and inertia loads a body of mass m and moments of inertia I with -m a at its centre of mass and -(I w' + w x I w) about
it, all in ground axes. A rod between two balls, with the same moment of inertia about every direction across its line
e, has no spin about it, since nothing turns it. Without its moment about the line, `I - (e.I e) e e^T`, the two terms
are those of a rod that does not spin, whatever w is along e.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import Spin

if TYPE_CHECKING:
    from .mechanism import Mechanism


@dataclass(frozen=True)
class Kinematics:
    """How bodies move in some configurations, SI, ground axes; nan where a configuration is not assembled."""

    #: shape (configuration, body, pose)
    poses: Floats
    #: `velocity`, `acceleration`: of the core's origins, then angular; shape (configuration, body, 6)
    velocity: Floats
    acceleration: Floats
    #: where these origins are, body axes, shape (body, 3)
    origins: Floats

    def first(self, count: int) -> Kinematics:
        """The first configurations only."""
        return Kinematics(self.poses[:count], self.velocity[:count], self.acceleration[:count], self.origins)

    def arm(self, body: int, at: tuple[float, ...]) -> Floats:
        """From the origin of a body to a point of it, shape (configuration, 3)."""
        turn = poses.matrix(self.poses[:, body])
        return np.asarray(np.einsum("nij,j->ni", turn, np.array(at) - self.origins[body]))

    def of_point(self, body: int, at: tuple[float, ...]) -> tuple[Floats, Floats]:
        """Velocity and acceleration of a point of a body, the angular one behind; shape (configuration, 6)."""
        arm = self.arm(body, at)
        (v, w), (a, turning) = (np.split(of[:, body], 2, axis=1) for of in (self.velocity, self.acceleration))
        spun = np.cross(w, arm)
        return (
            np.concatenate([v + spun, w], axis=1),
            np.concatenate([a + np.cross(turning, arm) + np.cross(w, spun), turning], axis=1),
        )


def kinematics(m: Mechanism, drives: Floats, placed: Floats, rates: Floats) -> Kinematics:
    """How the bodies move.

    Parameters
    ----------
    drives : ndarray
        Drive values, SI, shape (configuration, drive).
    placed : ndarray
        Nominal poses there.
    rates : ndarray
        Speeds and accelerations of the drives, shape (2 or more, configuration or 1, drive).
    """
    speeds, accelerations = (np.ascontiguousarray(np.broadcast_to(rate, drives.shape)) for rate in rates[:2])
    found = m.core.moving(drives, placed, speeds, accelerations)
    velocity, acceleration = (_in_space(found[name]) for name in ("velocity", "acceleration"))
    return Kinematics(placed, velocity, acceleration, m.core.origins)


def _in_space(twists: Floats) -> Floats:
    """Velocities as six numbers, in the plane as in space."""
    if twists.shape[-1] == 6:
        return twists
    whole = np.zeros((*twists.shape[:-1], 6))
    whole[..., [0, 1, 5]] = twists
    return whole


def components(m: Mechanism, values: Floats) -> Floats:
    """Six numbers of a velocity or force as the components of a pose."""
    return values if m.pose_size == poses.SPATIAL else values[..., [0, 1, 5]]


def matrices(m: Mechanism, placed: Floats) -> Floats:
    """Moments of inertia of what inertia loads, about the centres of mass in ground axes.

    Shape (configuration, body, 3, 3). Bodies that can spin about a line between two balls are without that about the
    line, which they do not turn.

    Parameters
    ----------
    placed : ndarray
        Poses of all bodies, shape (configuration, body, pose).
    """
    found = np.zeros((len(placed), len(m.loads.inertial), 3, 3))
    lines = {body: line_of(m, spin, placed)[1] for spin in m.spins if spin.load is None for body in spin.bodies}
    for k, inertial in enumerate(m.loads.inertial):
        body = m.points[m.loads.first[inertial.load]["point"]].body
        turn = poses.matrix(placed[:, body])
        found[:, k] = turn @ inertial.matrix @ np.swapaxes(turn, 1, 2)
        if body in lines:
            line = lines[body]
            about = np.einsum("ni,nij,nj->n", line, found[:, k], line)
            found[:, k] -= np.einsum("n,ni,nj->nij", about, line, line)
    return found


def line_of(m: Mechanism, spin: Spin, placed: Floats) -> tuple[Floats, Floats]:
    """The line through the two balls of a spin, its start and its direction, ground axes, shape (configuration, 3)."""
    own = [next(p for p in m.joint_points[joint] if m.points[p].body in spin.bodies) for joint in spin.joints]
    start, end = (poses.place(placed[:, m.points[p].body], m.points[p].at) for p in own)
    return start, np.asarray((end - start) / np.linalg.norm(end - start, axis=1, keepdims=True))


def wrenches(m: Mechanism, motion: Kinematics) -> Floats:
    """Force and moment of inertia on every body that has any, at its centre of mass; shape (configuration, body, 6)."""
    found = np.zeros((len(motion.poses), len(m.loads.inertial), 6))
    matrix = matrices(m, motion.poses)
    for k, inertial in enumerate(m.loads.inertial):
        point = m.points[m.loads.first[inertial.load]["point"]]
        velocity, acceleration = motion.of_point(point.body, point.at)
        w, turning = velocity[:, 3:], acceleration[:, 3:]
        found[:, k, :3] = -inertial.mass * acceleration[:, :3]
        swing = np.cross(w, np.einsum("nij,nj->ni", matrix[:, k], w))
        found[:, k, 3:] = -(np.einsum("nij,nj->ni", matrix[:, k], turning) + swing)
    # Where nothing is assembled no load decides anything.
    return np.nan_to_num(found)


def acting(m: Mechanism, motion: Kinematics | None, numbers: Sequence[int]) -> Floats:
    """Force and moment of every load, inertia included, shape (configuration, load, 6).

    Parameters
    ----------
    motion : Kinematics or None
        How the bodies move; None where they are at rest.
    numbers : sequence of int
        Numbers of the configurations of the file whose loads act.
    """
    found = np.empty((len(numbers), len(m.loads.first), 6))
    for k, load in enumerate(m.loads.first):
        each = m.loads.along.get(k, [load])
        values = np.array([[*one["force"], *one["moment"]] for one in each])
        found[:, k] = values[list(numbers)] if k in m.loads.along else values
    if motion is not None:
        found[:, [inertial.load for inertial in m.loads.inertial]] += wrenches(m, motion)
    return found
