"""A spatial mechanism as a tree of pinocchio's joints, its loops closed by Newton's method on frame coincidences.

Every joint that closes a loop is in the tree, too, with a frame at its end; the loop is closed where that frame lies on
the other body's: six equations a loop, whatever the joint. The axis of a joint is x of its frame, its side is y.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
GROUND = -1
ENDS = ("first", "second")
#: the elementary joints of every kind, and how each reads its coordinates off the placement that it makes
SLIDE = (pin.JointModelPX, lambda m: [m.translation[0]])
TURN = (pin.JointModelRX, lambda m: [np.arctan2(m.rotation[2, 1], m.rotation[1, 1])])
BALL = (pin.JointModelSpherical, lambda m: pin.Quaternion(m.rotation).coeffs())
CHAINS = {"revolute": [TURN], "prismatic": [SLIDE], "cylindrical": [SLIDE, TURN], "spherical": [BALL], "fixed": []}


@dataclass(frozen=True)
class Place:
    """A frame fixed to a joint of the tree."""

    joint: int
    offset: pin.SE3


class Tree:
    """The mechanism of a spec; joint coordinates count from the frame of the first body to that of the second."""

    def __init__(self, spec: dict[str, Any]) -> None:
        self.spec, self.model = spec, pin.Model()
        self.places = {GROUND: Place(0, pin.SE3.Identity())}
        self.loops: list[tuple[Place, Place]] = []
        self.start = np.zeros(0)
        self.numbers: dict[int, list[int]] = {}
        self.backwards: set[int] = set()
        guess = {
            b: pin.SE3(pin.Quaternion(*pose[3:]).matrix(), np.array(pose[:3])) for b, pose in enumerate(spec["guess"])
        }
        guess[GROUND] = pin.SE3.Identity()
        waiting = dict(enumerate(spec["joints"]))
        while waiting:
            index = next(
                k for k, joint in waiting.items() if {self.body(joint[end]) for end in ENDS} & set(self.places)
            )
            self._add(index, waiting.pop(index), guess)
        self.data = self.model.createData()
        out = spec["output"]["point"]
        self.output = self._on(self.body(out), pin.SE3(np.eye(3), np.array(spec["points"][out]["at"])))
        # Only joints of one freedom are driven.
        driven = [self.model.joints[self.numbers[drive["joint"]][0]] for drive in spec["drives"]]
        self.driven, self.commands = [joint.idx_v for joint in driven], [joint.idx_q for joint in driven]
        self.signs = np.array([-1.0 if drive["joint"] in self.backwards else 1.0 for drive in spec["drives"]])
        self.free = np.setdiff1d(np.arange(self.model.nv), self.driven)

    def body(self, point: int) -> int:
        return int(self.spec["points"][point]["body"])

    def _on(self, body: int, frame: pin.SE3) -> Place:
        return Place(self.places[body].joint, self.places[body].offset * frame)

    def _frame(self, joint: dict[str, Any], end: str) -> pin.SE3:
        x, y = np.array(joint[f"axis_{end}"]), np.array(joint[f"side_{end}"])
        y = (y - (x @ y) * x) / np.linalg.norm(y - (x @ y) * x)
        return pin.SE3(np.column_stack([x, y, np.cross(x, y)]), np.array(self.spec["points"][joint[end]]["at"]))

    def _add(self, index: int, joint: dict[str, Any], guess: dict[int, pin.SE3]) -> None:
        near, far = ENDS if self.body(joint["first"]) in self.places else ENDS[::-1]
        chain = [] if joint["kind"] == "screw" else CHAINS[joint["kind"]]
        if near == "second":
            self.backwards.add(index)
            chain = chain[::-1]
        frames = [self._frame(joint, end) for end in (near, far)]
        bodies = [self.body(joint[end]) for end in (near, far)]
        between = (guess[bodies[0]] * frames[0]).inverse() * (guess[bodies[1]] * frames[1])
        place = self._on(bodies[0], frames[0])
        if joint["kind"] == "screw":
            pitch = joint["coupling"]["lead"] / (2.0 * np.pi)
            # The thread is where the start has it: so far along at this angle.
            begun = between.translation[0] - pitch * TURN[1](between)[0]
            place = Place(place.joint, place.offset * pin.SE3(np.eye(3), np.array([begun, 0.0, 0.0])))
            chain = [(lambda: pin.JointModelHX(pitch), TURN[1])]
        self.numbers[index] = []
        for kind, coordinates in chain:
            number = self.model.addJoint(place.joint, kind(), place.offset, f"{index} {len(self.numbers[index])}")
            self.numbers[index].append(number)
            self.start = np.concatenate([self.start, coordinates(between)])
            place = Place(number, pin.SE3.Identity())
        reached = Place(place.joint, place.offset * frames[1].inverse())
        if bodies[1] in self.places:
            self.loops.append((reached, self.places[bodies[1]]))
        else:
            self.places[bodies[1]] = reached

    def at(self, place: Place) -> pin.SE3:
        """The frame in ground axes, where the loops were last looked at."""
        return self.data.oMi[place.joint] * place.offset

    def _moves(self, place: Place) -> Array:
        """Twist of the frame in its own axes per joint velocity."""
        if place.joint == 0:
            return np.zeros((6, self.model.nv))
        jacobian = pin.getJointJacobian(self.model, self.data, place.joint, pin.ReferenceFrame.LOCAL)
        return np.asarray(place.offset.inverse().action @ jacobian)

    def gaps(self, q: Array) -> tuple[Array, Array]:
        """What is missing in every loop, and its slope."""
        pin.computeJointJacobians(self.model, self.data, q)
        residual, slope = [np.zeros(0)], [np.zeros((0, self.model.nv))]
        for one, other in self.loops:
            gap = self.at(one).inverse() * self.at(other)
            residual.append(pin.log6(gap).vector)
            slope.append(pin.Jlog6(gap) @ (self._moves(other) - gap.inverse().action @ self._moves(one)))
        return np.concatenate(residual), np.concatenate(slope)

    def close(self, q: Array, drives: Array) -> Array:
        """Joint coordinates near q that close the loops at drive values."""
        q = q.copy()
        q[self.commands] = self.signs * drives
        for _ in range(100):
            residual, slope = self.gaps(q)
            if not self.loops:
                break
            step = np.zeros(self.model.nv)
            step[self.free] = -np.linalg.lstsq(slope[:, self.free], residual, rcond=1e-9)[0]
            size = np.abs(step).max()
            q = pin.integrate(self.model, q, step * min(1.0, 0.3 / max(size, 1e-300)))
            if size < 1e-14:
                break
        residual, _ = self.gaps(q)
        assert np.abs(residual).max(initial=0.0) < 1e-12
        return q

    def bodies(self) -> list[pin.SE3]:
        """Where all bodies are."""
        return [self.at(self.places[body]) for body in range(self.spec["n_bodies"])]

    def jacobian(self, q: Array) -> Array:
        """Velocity of the output point and angular velocity of its body, ground axes, per drive; [6, drive]."""
        _, slope = self.gaps(q)
        passive = -np.linalg.lstsq(slope[:, self.free], slope[:, self.driven], rcond=1e-9)[0]
        all_ = np.zeros((self.model.nv, len(self.driven)))
        all_[self.driven], all_[self.free] = np.eye(len(self.driven)), passive
        local = self._moves(self.output) @ all_ * self.signs
        turn = self.at(self.output).rotation
        return np.concatenate([turn @ local[:3], turn @ local[3:]])
