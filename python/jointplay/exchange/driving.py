"""Which joints are driven: as many as the mechanism has free motions, independent of one another.

To first order in the drawing. The unknowns are the twists (v, w) of all bodies about the origin; every joint gives a
row for each direction that it locks, and what is left, the null space N, are the free motions. A joint with a
coordinate has a row c as well, whose product with the twists is the rate of the coordinate. Joints are taken in turn
while their rows c N are independent.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from jointplay.errors import InputError, listed, not_known

from .rotations import across
from .skeleton import GROUND, Joint, Matrix, Skeleton, Vector

#: kinds with one coordinate
ANGULAR, LINEAR = ("revolute", "screw"), ("prismatic", "cylindrical", "pin_in_slot")
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
    motions = _free_motions(skeleton)
    if wanted is None:
        far = _distances(skeleton)
        order = sorted(can, key=lambda name: (not joints[name].is_driven, far[name]))
    else:
        order = list(wanted)
        for name in order:
            if name not in can:
                what = "a joint that can be driven"
                if name in joints and joints[name].follows:
                    raise InputError(f"'{name}' follows '{joints[name].follows[0]}'", key="drives")  # type: ignore[index]
                raise InputError(not_known(name, what, can), key="drives")
    taken = []
    for name in order:
        row = _coordinate(skeleton, joints[name]) @ motions
        if np.linalg.norm(row) > SMALL:
            taken.append(name)
            motions = motions @ _null(row[None])
        elif wanted is not None:
            others = f"what {listed(taken)} already move" if taken else "nothing: the joint cannot move"
            raise InputError(f"the drive of '{name}' is redundant: it would move {others}", key="drives")
    return Driven(tuple(name for name in can if name in taken), motions.shape[1])


def _bodies(skeleton: Skeleton) -> dict[str, int]:
    names = [name for name in skeleton.bodies if name != GROUND]
    return {name: 6 * k for k, name in enumerate(names)}


def _free_motions(skeleton: Skeleton) -> Matrix:
    """Twists that no joint locks, as columns."""
    rows = [row for joint in skeleton.joints for row in _locked(skeleton, joint)]
    named = {joint.name: joint for joint in skeleton.joints}
    for joint in skeleton.joints:
        if joint.follows:
            leader, factor, _ = joint.follows
            rows.append(_coordinate(skeleton, joint) - factor * _coordinate(skeleton, named[leader]))
    size = 6 * len(_bodies(skeleton))
    return _null(np.array(rows)) if rows else np.eye(size)


def _null(rows: Matrix) -> Matrix:
    _, singular, right = np.linalg.svd(rows)
    rank = int(np.sum(singular > SMALL * max(1.0, singular[0] if len(singular) else 1.0)))
    return np.asarray(right[rank:].T)


def _relative(skeleton: Skeleton, joint: Joint, force: Vector, moment: Vector) -> Vector:
    """The row of a motion of the second body against the first: along a force through the joint, and about a moment."""
    index = _bodies(skeleton)
    # Lengths in units of the mechanism, so that angles and lengths compare.
    arm = np.cross(joint.place.at / _size(skeleton), force) + moment
    row = np.zeros(6 * len(index))
    for name, sign in zip(joint.bodies, (-1.0, 1.0), strict=True):
        if name in index:
            row[index[name] : index[name] + 3] += sign * force
            row[index[name] + 3 : index[name] + 6] += sign * arm
    return row


def _size(skeleton: Skeleton) -> float:
    points = np.array([joint.place.at for joint in skeleton.joints])
    return float(np.ptp(points, axis=0).max()) or 1.0 if len(points) else 1.0


def _locked(skeleton: Skeleton, joint: Joint) -> list[Vector]:
    """Rows of the directions that a joint locks."""
    zero = np.zeros(3)
    a = joint.place.axis if joint.place.axis is not None else np.array([0.0, 0.0, 1.0])
    # A pin turns in its slot about the normal of the plane.
    s = np.array([0.0, 0.0, 1.0]) if joint.kind == "pin_in_slot" else across(a)
    n = np.cross(a, s)
    shifts, turns = _LOCKED[joint.kind]
    directions = {"a": a, "s": s, "n": n}
    rows = [_relative(skeleton, joint, directions[d], zero) for d in shifts]
    rows += [_relative(skeleton, joint, zero, directions[d]) for d in turns]
    if joint.kind == "screw":
        lead = joint.lead / (2 * np.pi) / _size(skeleton)
        rows.append(_coordinate(skeleton, joint, along=True) - lead * _coordinate(skeleton, joint))
    return rows


#: directions that are locked, of shifts and of turns: along the axis and the two across it
_LOCKED: Mapping[str, tuple[str, str]] = {
    "revolute": ("asn", "sn"),
    "prismatic": ("sn", "asn"),
    "cylindrical": ("sn", "sn"),
    "spherical": ("asn", ""),
    "planar": ("a", "sn"),
    "screw": ("sn", "sn"),
    "pin_in_slot": ("sn", "an"),
}


def _coordinate(skeleton: Skeleton, joint: Joint, *, along: bool = False) -> Vector:
    """The row of the rate of a joint's coordinate."""
    assert joint.place.axis is not None
    zero = np.zeros(3)
    if joint.kind in LINEAR or along:
        return _relative(skeleton, joint, joint.place.axis, zero)
    return _relative(skeleton, joint, zero, joint.place.axis)


def _distances(skeleton: Skeleton) -> dict[str, int]:
    """How many joints away from the ground every joint is."""
    far = distances(skeleton)
    last = len(skeleton.bodies)
    return {joint.name: min(far.get(name, last) for name in joint.bodies) for joint in skeleton.joints}


def distances(skeleton: Skeleton) -> dict[str, int]:
    """How many joints away from the ground every body is; what hangs on nothing is not there."""
    far = {GROUND: 0}
    waiting = [GROUND]
    while waiting:
        body = waiting.pop(0)
        for joint in skeleton.joints:
            for one, other in (joint.bodies, joint.bodies[::-1]):
                if one == body and other not in far:
                    far[other] = far[body] + 1
                    waiting.append(other)
    return far
