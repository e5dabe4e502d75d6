"""Planar mechanisms with gears, racks and belts, closed by strings: an independent solution of what a Machine is told.

The flanks of two involutes touch where a string that leaves one base circle and winds up on the other is as long as it
was (crossed between wheels that turn against each other, straight inside a ring), and a belt is such a string on its
pitch circles:

    T1 = c1 + b1 e(phi),   T2 = c2 - b2 e(phi),   phi = beta -+ acos((b1 + b2) / a)      b2 < 0: ring, open belt
    b1 (theta1 - phi) + b2 (theta2 - phi) -+ |T2 - T1| = what it is at the pitch point, at either end of the play

Between its ends the play divides what lies between both strings. Angles are those that the bodies have turned by, not
modulo a turn. Poses are solved by Newton's method with central differences.
"""

from typing import Any

import numpy as np

Array = np.ndarray
TURN = 2 * np.pi


def _unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _turned(angle: Array, at: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * at[..., 0] - s * at[..., 1], s * at[..., 0] + c * at[..., 1]], axis=-1)


class Train:
    """What `couplings.Machine` holds of a planar mechanism, closed independently; arrays of poses and offsets."""

    def __init__(self, machine: Any):
        self.m = machine
        self.n = len(machine.guess)
        self.start = np.array(machine.guess)
        firsts = np.cumsum([0] + [len(s["centre"]) for s in machine.sources])
        self.first = [int(k) for k in firsts[:-1]]
        self.n_parameters = int(firsts[-1])
        self.centre = np.concatenate([np.array(s["centre"], float) for s in machine.sources] or [np.zeros(0)])
        self.bearings: dict[int, Array] = {}
        zero = np.zeros(self.n_parameters)
        self.begun = {k: self._slid(k, j, self.start, zero) for k, j in enumerate(machine.joints) if "coupling" in j}

    # geometry

    def _source(self, kind: str, **target: Any) -> int | None:
        for first, source in zip(self.first, self.m.sources, strict=True):
            if source["kind"] == kind and all(source.get(k) == v for k, v in target.items()):
                return first
        return None

    def _value(self, u: Array, kind: str, size: int = 1, **target: Any) -> Array:
        first = self._source(kind, **target)
        return np.zeros((*u.shape[:-1], size)) if first is None else u[..., first : first + size]

    def _end(self, k: int, second: bool, poses: Array, u: Array) -> tuple[Array, Array]:
        """Place of a joint's point on one of its bodies, and the angle of that."""
        joint = self.m.joints[k]
        point = self.m.points[joint["second" if second else "first"]]
        at = np.array(point["at"][:2])
        for number, displacement in enumerate(self.m.displacements):
            if joint["second" if second else "first"] in displacement["points"]:
                at = at + self._value(u, "place", 2, displacement=number)
        if point["body"] < 0:
            at = np.broadcast_to(at, (*u.shape[:-1], 2))
            return at, np.zeros(at.shape[:-1])
        pose = poses[..., point["body"], :]
        return pose[..., :2] + _turned(pose[..., 2], at), pose[..., 2]

    def place(self, k: int, second: bool, poses: Array, u: Array) -> Array:
        """Place of a joint's point as one of its bodies carries it."""
        return self._end(k, second, poses, u)[0]

    @staticmethod
    def carried(point: dict[str, Any], poses: Array) -> Array:
        """Place of a point of a body."""
        pose = poses[..., point["body"], :]
        return pose[..., :2] + _turned(pose[..., 2], np.array(point["at"][:2]))

    def _bearing(self, k: int, apart: Array) -> Array:
        told = np.arctan2(apart[..., 1], apart[..., 0])
        near = self.bearings.setdefault(k, told if told.ndim == 0 else told.ravel()[0])
        return near + (told - near + np.pi) % TURN - np.pi

    def _signed(self, k: int) -> tuple[float, float, float]:
        """Radii of the string's circles and the cosine by which they are smaller than the pitch circles."""
        joint = self.m.joints[k]
        told = joint["coupling"]
        r1, r2 = told["radii"]
        if joint["kind"] == "belt":
            return r1, r2 if told.get("crossed") else -r2, 1.0
        cosine = float(np.cos(told["pressure_angle"]))
        return r1 * cosine, (-r2 if told.get("internal") else r2) * cosine, cosine

    @staticmethod
    def _axis(joint: dict[str, Any], end: str = "axis_first") -> float:
        x, y, _ = joint[end]
        return float(np.arctan2(y, x))

    def _slid(self, k: int, joint: dict[str, Any], poses: Array, u: Array) -> Array:
        """By what arc the pitch circles have slid on each other, or a pinion on its rack."""
        (p1, a1), (p2, a2) = self._end(k, False, poses, u), self._end(k, True, poses, u)
        if joint["kind"] == "rack":
            x, y = np.moveaxis(_turned(-a1 - self._axis(joint), p2 - p1), -1, 0)
            if np.ndim(x) == 0:
                joint["side"] = float(np.sign(y))
            return x + joint["side"] * joint["coupling"]["radii"][0] * (a2 - a1)
        b1, b2, cosine = self._signed(k)
        beta = self._bearing(k, p2 - p1)
        return (b1 * (a1 - beta) + b2 * (a2 - beta)) / cosine

    def play(self, k: int) -> tuple[float, float]:
        """Middle and half of the play of a coupling."""
        first = self._source("clearance", joint=k)
        if first is None:
            return 0.0, 0.0
        bounds = self.m.sources[self.first.index(first)]["set"]["interval"]
        return self.centre[first] + 0.5 * (bounds["low"] + bounds["high"]), 0.5 * (bounds["high"] - bounds["low"])

    def _flank(self, k: int, side: int, poses: Array, u: Array) -> Array:
        """How far the arc is beyond the end of the play at which this flank or strand carries."""
        joint = self.m.joints[k]
        middle, half = self.play(k)
        end = middle + side * half
        (p1, a1), (p2, a2) = self._end(k, False, poses, u), self._end(k, True, poses, u)
        if joint["kind"] == "rack":
            # The flank of a rack is straight, and an involute lies at a distance from its centre that turns with it.
            radius, angle = joint["coupling"]["radii"][0], joint["coupling"]["pressure_angle"]
            way = joint["side"]
            normal = np.array([np.cos(angle), -side * way * np.sin(angle)])
            x = _turned(-a1 - self._axis(joint), p2 - p1) @ normal + way * radius * np.cos(angle) * (a2 - a1)
            at_pitch = np.array([0.0, way * radius]) @ normal
            return (x - at_pitch) / np.cos(angle) - self.begun[k] - end
        b1, b2, cosine = self._signed(k)
        total = b1 + b2
        belt = joint["kind"] == "belt"
        way = 1 if belt else -1
        if not belt and b2 < 0:
            way = 1

        def string(c1: Array, c2: Array, beta: Array, turned: Array) -> Array:
            apart = np.linalg.norm(c2 - c1, axis=-1)
            phi = beta + way * side * np.arccos(total / apart)
            length = np.linalg.norm(c2 - b2 * _unit(phi) - c1 - b1 * _unit(phi), axis=-1)
            return turned - total * phi + way * side * length

        if belt:
            begun, _ = self._end(k, False, self.start, 0 * self.centre)
            ended, _ = self._end(k, True, self.start, 0 * self.centre)
            distance = joint["coupling"].get("distance") or float(np.linalg.norm(ended - begun))
        else:
            distance = abs(total) / cosine
        beta = self._bearing(k, p2 - p1)
        now = string(p1, p2, beta, b1 * a1 + b2 * a2)
        then = string(np.zeros(2), np.array([distance, 0.0]), np.zeros(()), np.zeros(()))
        return (now - then) / cosine - self.begun[k] - end

    def overlap(self, poses: Array, u: Array) -> Array:
        """By what part of its play each coupling with play is narrower than none: negative where it jams."""
        gaps = [np.ones(u.shape[:-1])]
        for k in self.begun:
            half = self.play(k)[1]
            if half:
                gaps.append((self._flank(k, -1, poses, u) - self._flank(k, 1, poses, u)) / (2 * half))
        return np.min(gaps, axis=0)

    def residual(self, poses: Array, drives: Array, u: Array) -> Array:
        rows = []
        for k, joint in enumerate(self.m.joints):
            (p1, a1), (p2, a2) = self._end(k, False, poses, u), self._end(k, True, poses, u)
            kind, axis = joint["kind"], np.array(joint["axis_first"][:2])
            if kind in ("revolute", "prismatic", "pin_in_slot"):
                apart = p2 - p1
                if kind == "revolute":
                    rows += list(np.moveaxis(apart - self._value(u, "clearance", 2, joint=k), -1, 0))
                else:
                    local = _turned(-a1, apart)
                    play = self._value(u, "clearance", 2 if kind == "prismatic" else 1, joint=k)
                    rows.append(local[..., 1] * axis[0] - local[..., 0] * axis[1] - play[..., 0])
                    if kind == "prismatic":
                        turned = self._axis(joint, "axis_second") - self._axis(joint)
                        rows.append((a2 - a1 + turned - play[..., 1] + np.pi) % TURN - np.pi)
            elif kind == "fixed":
                rows += [*np.moveaxis(p2 - p1, -1, 0), a2 - a1]
            else:
                error = self._value(u, "ratio", 1, joint=k)[..., 0]
                middle, half = self.play(k)
                if half:
                    part = (self._value(u, "clearance", 1, joint=k)[..., 0] - middle) / half
                    ahead, behind = self._flank(k, 1, poses, u), self._flank(k, -1, poses, u)
                    rows.append(0.5 * (1 + part) * ahead + 0.5 * (1 - part) * behind - error)
                else:
                    rows.append(self._slid(k, joint, poses, u) - self.begun[k] - error - middle)
        for number, drive in enumerate(self.m.drives):
            value = drives[..., number] + self._value(u, "drive", 1, drive=number)[..., 0]
            parts = [(drive["joint"], drive["coefficient"]), *((d["joint"], d["coefficient"]) for d in drive["also"])]
            for k, coefficient in parts:
                (p1, a1), (p2, a2) = self._end(k, False, poses, u), self._end(k, True, poses, u)
                if self.m.joints[k]["kind"] == "revolute":
                    rows.append((a2 - a1 - coefficient * value) * self.m.length)
                else:
                    axis = np.array(self.m.joints[k]["axis_first"][:2])
                    rows.append(_turned(-a1, p2 - p1) @ axis - coefficient * value)
        return np.stack(np.broadcast_arrays(*rows), axis=-1)

    def jacobian(self, poses: Array, drives: Array, u: Array) -> Array:
        """Derivatives along x / length, y / length and the angle of every body."""
        step = 1e-6
        scale = np.tile([self.m.length, self.m.length, 1.0], self.n)
        moves = (np.eye(3 * self.n) * step * scale).reshape(3 * self.n, self.n, 3)
        many, q, v = poses[..., None, :, :], drives[..., None, :], u[..., None, :]
        ends = [self.residual(many + way * moves, q, v) for way in (1.0, -1.0)]
        return np.swapaxes((ends[0] - ends[1]) / (2 * step), -1, -2)

    def close(self, poses: Array, drives: Array, u: Array, steps: int = 30) -> tuple[Array, Array]:
        """Poses near those given, and whether they close."""
        poses = np.array(poses)
        scale = np.tile([self.m.length, self.m.length, 1.0], self.n)
        for _ in range(steps):
            with np.errstate(invalid="ignore"):
                residual, jacobian = self.residual(poses, drives, u), self.jacobian(poses, drives, u)
            wrong = ~np.isfinite(jacobian).all(axis=(-2, -1)) | ~np.isfinite(residual).all(axis=-1)
            jacobian, residual = (
                np.where(wrong[..., None, None], 0.0, jacobian),
                np.where(wrong[..., None], 0.0, residual),
            )
            step = (np.linalg.pinv(jacobian) @ residual[..., None])[..., 0]
            poses -= (step * scale).reshape(poses.shape)
            if np.abs(step).max() < 1e-13:
                break
        with np.errstate(invalid="ignore"):
            residual = self.residual(poses, drives, u)
        return poses, (np.abs(residual).max(axis=-1) < 1e-10 * self.m.length) & ~wrong

    def follow(self, path: Array, most: float = 0.01) -> Array:
        """Nominal poses along a path, from the start, with what the known deviations do left out."""
        poses, at = self.start, self._begin()
        zero, out = np.zeros(self.n_parameters), []
        for to in path:
            parts = max(1, int(np.ceil(np.abs(to - at).max() / most)))
            for drives in np.linspace(at, to, parts + 1)[1:]:
                poses, closed = self.close(poses, drives, zero)
                assert closed, "the path cannot be followed"
                for k, joint in enumerate(self.m.joints):
                    if k in self.begun and joint["kind"] != "rack":
                        (p1, _), (p2, _) = (self._end(k, s, poses, zero) for s in (False, True))
                        self.bearings[k] = self._bearing(k, p2 - p1)
            at = to
            out.append(poses)
        return np.array(out)

    def _begin(self) -> Array:
        """Drive values of the start."""
        zero = np.zeros(self.n_parameters)
        values = []
        for drive in self.m.drives:
            k = drive["joint"]
            (p1, a1), (p2, a2) = (self._end(k, s, self.start, zero) for s in (False, True))
            turned = a2 - a1
            if self.m.joints[k]["kind"] != "revolute":
                turned = _turned(-a1, p2 - p1) @ np.array(self.m.joints[k]["axis_first"][:2])
            values.append(turned / drive["coefficient"])
        return np.array(values)

    # what is asked

    def output(self, poses: Array) -> Array:
        point = self.m.points[self.m.output_point]
        turned = poses[..., point["body"], 2:]
        return np.concatenate([self.carried(point, poses), turned], axis=-1)

    def work(self, poses: Array) -> Array:
        """Work of the loads, whose directions stay: what forces and moments have done from the origin on."""
        work = np.zeros(poses.shape[:-2])
        for load in self.m.loads:
            point = self.m.points[load["point"]]
            turned = poses[..., point["body"], 2]
            work = work + self.carried(point, poses) @ np.array(load["force"][:2]) + load["moment"][2] * turned
        return work

    def gradient(self, of: Any, poses: Array, drives: Array, u: Array) -> Array:
        """Derivatives along the offsets by central differences of the closure."""
        step = 1e-6 * self.m.length
        moves = step * np.eye(self.n_parameters)
        many = np.repeat(poses[None], 2 * self.n_parameters, 0)
        ends, closed = self.close(many, drives, np.concatenate([u + moves, u - moves]))
        assert closed.all()
        values = of(ends)
        return (values[: self.n_parameters] - values[self.n_parameters :]) / (2 * step)
