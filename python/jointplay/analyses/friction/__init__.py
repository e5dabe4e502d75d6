"""Friction: where the load holds a mechanism that moves, coming from one side or the other, or at rest.

Which way each joint slides follows from the nominal motion; see `laws` for the friction of joints, `balance` for
equilibrium, `states` for what follows from it, and `rest` for one at rest.
"""

import numpy as np

from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.result import ResultBuilder

from .rest import RestRange, held
from .states import SIDES, Setting, Sliding, directions, setting, sliding

__all__ = [
    "REST",
    "SIDES",
    "add",
    "add_rest",
    "both",
    "directions",
    "held",
    "require",
    "rubs",
    "setting",
    "sliding",
    "told",
]

#: instead of a side: where friction can hold the mechanism
REST = "rest"


def told(m: Mechanism, approach: str | None) -> dict[str, str]:
    """What a result says of friction; nothing where the file has none."""
    return {"approach": approach or "none"} if rubs(m) else {}


def rubs(m: Mechanism) -> bool:
    """Whether the file has friction."""
    return any(joint.loses for joint in m.data.joints.values())


def require(m: Mechanism, approach: str, *, exact: bool) -> None:
    """Refuse a mechanism whose friction is not computed.

    Raises
    ------
    InputError
        When there is no such direction, nothing rubs, or more than statics shares its loads.
    """
    if approach not in (*SIDES, REST):
        raise InputError(not_known(approach, "a direction of approach", (*SIDES, REST)), key="approach")
    if not exact:
        raise InputError("friction is found on the exact closure, not to first order", key="approach")
    if not rubs(m):
        problem = "no joint has `friction` or `efficiency`, so that it makes no difference from which side one comes"
        raise InputError(problem, file=m.file, key="joints")
    if not m.core.isostatic:
        problem = (
            "friction is computed where statics alone decides the reactions; here joints are elastic or"
            " over-constrained, and the friction of each depends on how the loads came to act"
        )
        raise InputError(problem, file=m.file, key="joints")


def both(asked: Setting) -> dict[str, Sliding]:
    """The sliding states from both sides."""
    return {side: sliding(asked, side) for side in SIDES}


def add(builder: ResultBuilder, sides: dict[str, Sliding], approach: str, *, details: bool) -> None:
    """Add what friction makes of a result, beside its columns."""
    forward, backward = (sides[side].found["error"] for side in SIDES)
    words = "error coming forward minus error coming backward, at the same drive values (reversal error)"
    builder.add("reversal", ("configuration", "component"), forward - backward, words, "component")
    own = sides[approach]
    words = "power that comes out over power that goes in; negative where the load cannot drive the motor"
    builder.add("efficiency", "configuration", own.efficiency, words)
    if details:
        total = own.friction.sum(axis=1, keepdims=True)
        share = own.friction / np.where(total < 0.0, total, np.nan)
        builder.add("friction_share", ("configuration", "joint"), share, "share of the joint in what friction takes")
        other = sides[next(side for side in SIDES if side != approach)]
        words = "moment or force of the drive coming from the other side"
        builder.add("drive_torque_other", ("configuration", "drive"), other.found["drive_force"], words, "work:drive")
    builder.add("jam_joint", "configuration", own.jams, "joint that takes most where it jams; empty: it does not jam")
    words = "coefficient of that joint (loss of a coupling) from which it jams, those of all others in proportion"
    builder.add("jam_coefficient", "configuration", own.jam, words)


def add_rest(builder: ResultBuilder, found: RestRange) -> None:
    """Add where friction can hold the mechanism, beside the columns without friction."""
    pose, drive = ("configuration", "component"), ("configuration", "drive")
    for which, errors, torques in (
        ("lowest", found.low, found.torque_low),
        ("highest", found.high, found.torque_high),
    ):
        end = {"lowest": "low", "highest": "high"}[which]
        builder.add(f"friction_{end}", pose, errors, f"{which} error that friction can hold at rest", "component")
        words = f"{which} moment or force of the drive with which friction holds it"
        builder.add(f"drive_torque_{end}", drive, torques, words, "work:drive")
    words = "largest {} that friction can hold at rest"
    builder.add("friction_position", "configuration", found.position, words.format("position error"), "length")
    builder.add("friction_rotation", "configuration", found.rotation, words.format("rotation"), "angle")
