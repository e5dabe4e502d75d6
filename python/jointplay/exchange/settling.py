"""A drawing whose joints are closed, outward from the ground, where it was saved before they were.

A solver stops at a tolerance, and people save drawings that it could not solve. Every body is moved by the smallest
rotation that brings its joint's axis to that of the body before it, and by the smallest shift that closes the joint.
Joints that close loops stay as open as they are: the mechanism closes them itself.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .driving import spanning
from .rotations import aligning
from .skeleton import Attachment, Frame, Joint, Skeleton, Vector

#: joints that hold no body by themselves
LOOSE = ("gear", "belt", "rack")
#: how far apart places are that are one, m
SAME = 1e-12
#: what joints let slide: along their axis, across it
ALONG, ACROSS = ("prismatic", "cylindrical", "screw"), ("planar",)


def settled(skeleton: Skeleton, frames: Mapping[str, tuple[Frame, Frame]]) -> Skeleton:
    """The same, with closed joints, and their coordinates as they are then.

    Parameters
    ----------
    frames : mapping
        Frames of joints on both bodies, in the drawing. Those of fixed joints coincide.
    """
    moves = {skeleton.ground: Frame()}
    #: what is fixed has the name of the body that is nearer to the ground
    outward: dict[str, tuple[str, str]] = {}
    holding = replace(skeleton, joints=tuple(joint for joint in skeleton.joints if joint.kind not in LOOSE))
    for joint, inner, outer, sign in spanning(holding, skeleton.ground):
        move = moves[inner]
        ends = (joint.place, joint.second or joint.place)
        if joint.kind == "fixed":
            own, other = frames.get(joint.name, (Frame(), Frame()))[:: int(sign)]
            moves[outer] = move @ own @ other.inverse()
            outward[joint.name] = (inner, outer)
        else:
            own_end, other_end = (end.within(move) for end in ends[:: int(sign)])
            moves[outer] = _closing(joint, own_end, other_end) @ move

    def moved(old: Joint) -> Joint:
        first, second = (moves[name] for name in old.bodies)
        side = None if old.side is None else np.asarray(first.axes @ old.side)
        place, there = old.place.within(first), (old.second or old.place).within(second)
        other: Attachment | None = there
        coordinate = old.coordinate
        if old.second is None:
            # One place of both bodies, which may be apart now.
            if old.kind in ALONG and place.axis is not None:
                coordinate += float(place.axis @ (there.at - place.at))
            other = None if _are_one(place, there) else there
        if old.name in frames:
            one, two = frames[old.name]
            coordinate = measured(old.kind, first @ one, second @ two)
        bodies = outward.get(old.name, old.bodies)
        return replace(old, bodies=bodies, place=place, second=other, side=side, coordinate=coordinate)

    return replace(
        skeleton,
        bodies={name: body.within(moves[name]) for name, body in skeleton.bodies.items()},
        joints=tuple(moved(old) for old in skeleton.joints),
    )


def _are_one(one: Attachment, other: Attachment) -> bool:
    """Whether two places are the same but for rounding."""
    axes = (one.axis, other.axis) if one.axis is not None and other.axis is not None else (np.zeros(3), np.zeros(3))
    return bool(np.abs([one.at - other.at, axes[0] - axes[1]]).max() < SAME)


def measured(kind: str, one: Frame, other: Frame) -> float:
    """The coordinate of a joint between two frames: angle or travel of the second one in the first one."""
    if kind in ALONG[:2]:
        return float(one.axes[:, 2] @ (other.at - one.at))
    if kind not in ("revolute", "screw"):
        return 0.0
    seen = one.axes.T @ other.axes[:, 0]
    return math.atan2(seen[1], seen[0])


def _closing(joint: Joint, own: Attachment, other: Attachment) -> Frame:
    """How the outer body moves in the drawing."""
    turn = np.eye(3) if own.axis is None or other.axis is None else aligning(other.axis, own.axis)
    shift: Vector = own.at - other.at
    if own.axis is not None:
        along = own.axis * (own.axis @ shift)
        if joint.kind in ALONG:
            shift = shift - along
        elif joint.kind in ACROSS:
            shift = along
    return Frame(other.at - turn @ other.at + shift, turn)
