"""Which joints are driven: as many as the mechanism has free motions, independent of one another.

To first order in the drawing. The joints of a spanning tree move freely, and the unknowns are their rates. Every other
joint closes a loop: for each direction that it locks, a row of the unknowns says that its bodies do not move there
against each other. Couplings and screws are rows as well. What is left, the null space N, are the free motions. Joints
are taken in turn while the rates of their coordinates, rows c of the unknowns, are independent in c N.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from jointplay.errors import InputError, listed, not_known

from .rotations import across
from .skeleton import GROUND, Joint, Matrix, Skeleton, Vector

#: kinds with one coordinate
ANGULAR, LINEAR = ("revolute", "screw"), ("prismatic", "cylindrical", "pin_in_slot")
#: directions that a kind leaves free, of shifts and of turns: along the axis (a) and the two across it (s, n)
FREE: Mapping[str, tuple[str, str]] = {
    "revolute": ("", "a"),
    "prismatic": ("a", ""),
    "cylindrical": ("a", "a"),
    "spherical": ("", "asn"),
    "planar": ("sn", "a"),
    "pin_in_slot": ("a", "s"),
    # Both are tied by its lead.
    "screw": ("a", "a"),
}
#: largest part of a motion, of length 1, that counts as none
SMALL = 1e-6


@dataclass(frozen=True)
class Driven:
    """What drives the mechanism.

    Attributes
    ----------
    joints : tuple of str
        One for each drive.
    free : int
        How many free motions are left.
    """

    joints: tuple[str, ...]
    free: int


def choose(skeleton: Skeleton, wanted: Iterable[str] | None) -> Driven:
    """The driven joints.

    Parameters
    ----------
    skeleton : Skeleton
    wanted : iterable of str or None
        Names that were asked for; None for a choice of ours: joints with a motor first, then those that are nearest
        to the ground.

    Raises
    ------
    InputError
        When a name is no joint that can be driven, or a drive is redundant.
    """
    joints = {joint.name: joint for joint in skeleton.joints}
    can = [name for name, joint in joints.items() if joint.kind in (*ANGULAR, *LINEAR) and not joint.follows]
    if wanted is None:
        far = distances(skeleton)
        near = {name: min(far.get(body, len(far)) for body in joints[name].bodies) for name in can}
        # What follows a joint does so by its drive.
        leaders = {joint.follows[0] for joint in joints.values() if joint.follows}
        order = sorted(can, key=lambda name: (not joints[name].is_driven, name not in leaders, near[name]))
    else:
        order = list(wanted)
        for name in order:
            _check(name, joints, can)
    rates = _Rates(skeleton)
    motions = _null(np.array(list(rates.rows())).reshape(-1, rates.count))
    taken: list[str] = []
    for name in order:
        rate = rates.coordinate(joints[name]) @ motions
        length = float(np.linalg.norm(rate))
        if length > SMALL:
            taken.append(name)
            motions = motions @ _across(rate / length)
        elif wanted is not None:
            others = f"what {listed(taken)} already move" if taken else "nothing: the joint cannot move"
            raise InputError(f"the drive of '{name}' is redundant: it would move {others}", key="drives")
    return Driven(tuple(name for name in can if name in taken), motions.shape[1])


def _check(name: str, joints: Mapping[str, Joint], can: list[str]) -> None:
    """Refuse what cannot be driven."""
    if name not in can:
        follows = joints[name].follows if name in joints else None
        if follows:
            raise InputError(f"'{name}' follows '{follows[0]}', which can be driven", key="drives")
        raise InputError(not_known(name, "a joint that can be driven", can), key="drives")


def _null(rows: Matrix) -> Matrix:
    """An orthonormal basis of what all rows leave, as columns."""
    _, singular, right = np.linalg.svd(rows)
    return np.asarray(right[int(np.sum(singular > SMALL * singular.max(initial=1.0))) :].T)


def _across(unit: Vector) -> Matrix:
    """An orthonormal basis of what is across a unit vector: the columns of a Householder reflection but one."""
    first = int(np.argmax(np.abs(unit)))
    mirror = unit.copy()
    mirror[first] += np.copysign(1.0, unit[first])
    reflection = np.eye(len(unit)) - 2.0 * np.outer(mirror, mirror) / (mirror @ mirror)
    return np.asarray(np.delete(reflection, first, axis=1))


def distances(skeleton: Skeleton) -> dict[str, int]:
    """How many joints away from the ground every body is; what hangs on nothing is not there."""
    far = {GROUND: 0}
    for _, one, other, _ in spanning(skeleton):
        far[other] = far[one] + 1
    return far


def spanning(skeleton: Skeleton) -> Iterator[tuple[Joint, str, str, float]]:
    """Joints of the spanning tree with the fewest joints to every body, outward from the ground.

    Yields
    ------
    tuple
        The joint, its inner and its outer body, and 1 where the outer one is its second body, else -1.
    """
    at: dict[str, list[tuple[Joint, str, str, float]]] = {}
    for joint in skeleton.joints:
        first, second = joint.bodies
        at.setdefault(first, []).append((joint, first, second, 1.0))
        at.setdefault(second, []).append((joint, second, first, -1.0))
    reached, waiting = {GROUND}, [GROUND]
    for body in waiting:
        for step in at.get(body, ()):
            if step[2] not in reached:
                reached.add(step[2])
                waiting.append(step[2])
                yield step


class _Rates:
    """Rates of the joints of the spanning tree: the unknowns. Lengths are in units of the mechanism."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.joints = skeleton.joints
        points = np.array([joint.place.at for joint in self.joints]).reshape(-1, 3)
        self.size = float(np.ptp(points, axis=0).max()) or 1.0 if len(points) else 1.0
        #: of every body the twists (v at the origin, w) of the rates that move it, by the number of the rate
        self.twists: dict[str, dict[int, Vector]] = {GROUND: {}}
        self.tree: dict[str, int] = {}
        self.count = 0
        for joint, one, other, sign in spanning(skeleton):
            self.tree[joint.name] = self.count
            own = dict(self.twists[one])
            for twist in self._free(joint):
                own[self.count] = sign * twist
                self.count += 1
            self.twists[other] = own

    def _directions(self, joint: Joint) -> dict[str, Vector]:
        a = joint.place.axis if joint.place.axis is not None else np.array([0.0, 0.0, 1.0])
        # A pin turns in its slot about the normal of the plane.
        s = np.array([0.0, 0.0, 1.0]) if joint.kind == "pin_in_slot" else across(a)
        return {"a": a, "s": s, "n": np.cross(a, s)}

    def _free(self, joint: Joint) -> list[Vector]:
        """Twists of the second body against the first."""
        directions, (shifts, turns) = self._directions(joint), FREE[joint.kind]
        at = joint.place.at / self.size
        along = [np.concatenate([directions[d], np.zeros(3)]) for d in shifts]
        return along + [np.concatenate([np.cross(at, directions[d]), directions[d]]) for d in turns]

    def _moves(self, joint: Joint, shift: Vector, turn: Vector) -> Vector:
        """The row of a motion of the second body against the first: along a direction at the joint, and about one."""
        measure = np.concatenate([shift, np.cross(joint.place.at / self.size, shift) + turn])
        row = np.zeros(self.count)
        for body, sign in zip(joint.bodies, (-1.0, 1.0), strict=True):
            for number, twist in self.twists.get(body, {}).items():
                row[number] += sign * (measure @ twist)
        return row

    def coordinate(self, joint: Joint, *, travel: bool = False) -> Vector:
        """The row of the rate of a joint's coordinate, of a screw its angle or its travel."""
        axis, zero = self._directions(joint)["a"], np.zeros(3)
        return self._moves(joint, axis, zero) if travel or joint.kind in LINEAR else self._moves(joint, zero, axis)

    def rows(self) -> Iterator[Vector]:
        """What has to be zero."""
        named = {joint.name: joint for joint in self.joints}
        zero = np.zeros(3)
        for joint in self.joints:
            if joint.name not in self.tree:
                shifts, turns = FREE[joint.kind]
                for name, direction in self._directions(joint).items():
                    if name not in shifts:
                        yield self._moves(joint, direction, zero)
                    if name not in turns:
                        yield self._moves(joint, zero, direction)
            if joint.kind == "screw":
                lead = joint.lead / (2 * np.pi) / self.size
                yield self.coordinate(joint, travel=True) - lead * self.coordinate(joint)
            if joint.follows:
                leader, factor, _ = joint.follows
                yield self.coordinate(joint) - factor * self.coordinate(named[leader])
