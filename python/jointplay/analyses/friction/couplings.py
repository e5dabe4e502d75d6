"""Friction of couplings: what flanks, belts and threads do to their bodies beside what moves them.

The row of a coupling is a length. Its rate has two parts that cancel, by the motions of each body against what carries
both; that of the first is v. At the multiplier l the power l v goes from the first body to the second. Friction is a
wrench on the second body at its point, and its opposite on the first, in proportion to |l|:

    efficiency e          the driven body gets the part e of its moment, and the driving one all of its own: a force
                          through the axis of the driving wheel; of a rack a force along it, or a couple; of axes that
                          cross a couple across the driving axis; of a screw a force or a couple along its axis
    thread                flank angle b, mean diameter d, lead h: with m = mu / cos b a force m |l| h / (pi d) and a
                          couple m |l| d / 2 along the axis, both against the motion
    teeth that slide      mu N against the sliding at the pitch point, N = |l| n / cos(pressure angle), n the normal of
                          the flanks by which l pushes

All is taken at the nominal pose, as the directions of motion are.
"""

import math

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.units import Units
from jointplay.core.answers import EquilibriumTerms
from jointplay.file.schema import BeltKeys, Coupling, CrossedGear, GearKeys, Screw
from jointplay.model.mechanism import Mechanism

from .places import ends, motions

#: where the wrenches for positive and negative multipliers are, and that of a moment of its own
POSITIVE, NEGATIVE, OWN = range(3)


def wrenches(
    m: Mechanism,
    joint: int,
    entry: Coupling,
    at: EquilibriumTerms,
    placed: Floats,
    velocity: Floats,
    least: Floats,
) -> Floats:
    """Friction on the second body at its point, ground axes, by the multiplier and the coefficient of the joint.

    Shape (configuration, 3, 6): for a positive and for a negative multiplier, and for a moment of its own; nothing
    where nothing moves.

    Parameters
    ----------
    entry : Coupling
        What the file says of it.
    at : EquilibriumTerms
        At the nominal poses.
    placed : ndarray
        These poses.
    velocity : ndarray
        Of the core's origins, then angular, shape (configuration, body, 6).
    least : ndarray
        Speed below which nothing moves, shape (configuration,).
    """
    pair = _Pair(m, joint, entry, at, placed, velocity)
    found = np.zeros((len(placed), 3, 6))
    rate, lost = pair.at_flank()
    moves = np.sign(np.where(np.abs(rate) > least, rate, 0.0))[:, None]
    if entry.efficiency is not None:
        most = loss(entry)
        for which, sign in ((POSITIVE, 1.0), (NEGATIVE, -1.0)):
            # The first body is driven where power comes to it.
            by = [sign * (1.0 - entry.efficiency[1 - end]) / most * lost[end] for end in (0, 1)]
            found[:, which] = np.where(sign * moves < 0.0, by[0], np.where(moves == 0.0, 0.0, by[1]))
    elif isinstance(entry, Screw):
        found[:] = pair.of_thread(entry, m.units) * -np.sign(entry.lead) * moves[..., None]
    else:
        found[:, [POSITIVE, NEGATIVE]] = np.where(moves == 0.0, 0.0, pair.of_teeth())[:, None]
    return found


def loss(entry: Coupling) -> float:
    """The part of the power that a coupling loses at most, or its coefficient; both grow in proportion to others."""
    if entry.efficiency is not None:
        return 1.0 - min(entry.efficiency)
    return entry.rubs.coefficient if entry.rubs is not None else 0.0


class _Pair:
    """Both bodies of a coupling at their nominal poses, in ground axes."""

    def __init__(
        self, m: Mechanism, joint: int, entry: Coupling, at: EquilibriumTerms, placed: Floats, velocity: Floats
    ) -> None:
        self.entry = entry
        self.spec = m.core_spec["joints"][joint]
        bodies = [m.points[p].body for p in m.joint_points[joint]]
        turns = [poses.matrix(placed[:, body]) if body >= 0 else np.eye(3)[None] for body in bodies]
        in_space = m.pose_size == poses.SPATIAL

        def carried(end: int, key: str) -> Floats:
            return np.broadcast_to(turns[end] @ np.array(self.spec[key]), (len(placed), 3))  # type: ignore[literal-required]

        upwards = np.broadcast_to([0.0, 0.0, 1.0], (len(placed), 3))
        self.axes = [carried(0, "axis_first"), carried(1, "axis_second")] if in_space else [upwards, upwards]
        #: of a rack
        self.along = carried(0, "side_first" if in_space else "axis_first")
        first, second = ends(m, joint, at, placed)
        #: from the first centre to the second
        self.apart = second - first
        (self.v1, self.w1), (self.v2, self.w2) = motions(m, joint, at, velocity)

    def at_flank(self) -> tuple[Floats, tuple[Floats, Floats]]:
        """The rate v, and wrenches on the second body that take from each what a multiplier of 1 does to it."""
        entry, coupling = self.entry, self.spec["coupling"]
        (a1, a2), c = self.axes, self.apart
        rate: Floats
        if isinstance(entry, Screw):
            pitch = coupling["lead"] / math.tau
            return -pitch * _dot(self.w2 - self.w1, a1), (_wrench(moment=-pitch * a1), _wrench(force=a1))
        if isinstance(entry, CrossedGear):
            contact = coupling["contact"]
            assert contact is not None
            normal, place = np.array(contact["normal"]), np.array(contact["at"])
            r1 = -float(normal @ np.cross(contact["axes"][0], place))
            r2 = float(normal @ np.cross(contact["axes"][1], place - contact["apart"]))
            rate = -r1 * _turning(a1, self.w1, a2, np.cross(self.w2, a2))
            cosine = _dot(a1, a2)[:, None]
            square = 1.0 - cosine**2
            b1, b2 = (a1 - cosine * a2) / square, (a2 - cosine * a1) / square
            return rate, (_wrench(moment=-r1 * b1), _wrench(moment=r2 * b2))
        r1, r2 = coupling["radii"]
        if not isinstance(entry, GearKeys | BeltKeys):
            rate = _dot(self.v2 - self.v1 - np.cross(self.w1, c), self.along)
            side = np.sign(_dot(c, np.cross(a1, self.along)))[:, None]
            return rate, (_wrench(force=self.along), _wrench(moment=side * r1 * a1))
        same_way = not entry.crossed if isinstance(entry, BeltKeys) else entry.internal
        r2 = -r2 if same_way else r2
        c = c - _dot(c, a1)[:, None] * a1
        across = np.cross(a1, c) / _dot(c, c)[:, None]
        rate = -r1 * _turning(a1, self.w1, self.apart, self.v2 - self.v1)
        return rate, (_wrench(force=-r1 * across), _wrench(force=-r2 * across, moment=r2 * a1))

    def of_thread(self, screw: Screw, units: Units) -> Floats:
        """Friction of a thread where the second body turns forward: for any multiplier, and of a moment of its own."""
        friction, axis = screw.friction, self.axes[0]
        assert friction is not None
        found = np.zeros((len(axis), 3, 6))
        found[:, OWN] = _wrench(moment=-axis)
        if friction.mean_diameter is not None:
            radius = friction.mean_diameter * units.length / 2.0
            steep = 1.0 / math.cos(friction.flank_angle * units.angle)
            slope = self.spec["coupling"]["lead"] / (math.tau * radius)
            rubs = _wrench(force=-steep * slope * axis, moment=-steep * radius * axis)
            found[:, [POSITIVE, NEGATIVE]] = rubs[:, None]
        return found

    def of_teeth(self) -> Floats:
        """Friction of teeth at their pitch point, for any multiplier."""
        contact = self.spec["coupling"]["contact"]
        assert contact is not None
        axes = np.array(contact["axes"])
        own = np.array([*axes, np.cross(axes[0], axes[1])])
        normal = math.hypot(*contact["normal"], *contact["opening"])
        (a1, a2), basis = self.axes, np.linalg.solve(own.T, contact["at"])
        to_point = np.einsum("k,kni->ni", basis, np.array([a1, a2, np.cross(a1, a2)]))
        beyond = to_point - self.apart
        sliding = self.v2 + np.cross(self.w2, beyond) - self.v1 - np.cross(self.w1, to_point)
        speed = np.linalg.norm(sliding, axis=1, keepdims=True)
        force = -normal * sliding / np.where(speed > 0.0, speed, 1.0)
        return _wrench(force=force, moment=np.cross(beyond, force))


def _turning(axis: Floats, w: Floats, line: Floats, rate: Floats) -> Floats:
    """How fast a line turns about an axis as seen from a body."""
    across = line - _dot(line, axis)[:, None] * axis
    return np.asarray(_dot(axis, np.cross(across, rate - np.cross(w, line))) / _dot(across, across))


def _wrench(force: Floats | None = None, moment: Floats | None = None) -> Floats:
    nothing = np.zeros_like(force if moment is None else moment)
    return np.concatenate([nothing if part is None else part for part in (force, moment)], axis=1)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=1))
