"""Friction: where the load holds a mechanism that moves, coming from one side or the other.

Which way each joint slides follows from the nominal motion; see `laws` for the friction of joints, `balance` for
equilibrium, and `states` for what follows from it.
"""

from __future__ import annotations

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.basics.arrays import Floats
from jointplay.core.answers import Loaded
from jointplay.core.compile import DriveMotion
from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.result import ResultBuilder

from .states import SIDES, Sliding, directions, sliding

__all__ = ["add", "both", "directions", "require", "sliding", "told"]


def told(m: Mechanism, approach: str | None) -> dict[str, str]:
    """What a result says of friction; nothing where the file has none."""
    return {"approach": approach or "none"} if _rubs(m) else {}


def _rubs(m: Mechanism) -> bool:
    """Whether the file has friction."""
    return any(joint.loses for joint in m.data.joints.values())


def require(m: Mechanism, approach: str, *, exact: bool) -> None:
    """Refuse a mechanism whose friction is not computed.

    Raises
    ------
    InputError
        When there is no such direction, nothing rubs, or more than statics shares its loads.
    """
    if approach not in SIDES:
        raise InputError(not_known(approach, "a direction of approach", SIDES), key="approach")
    if not exact:
        raise InputError("friction is found on the exact closure, not to first order", key="approach")
    if not _rubs(m):
        problem = "no joint has `friction` or `efficiency`, so that it makes no difference from which side one comes"
        raise InputError(problem, file=m.file, key="joints")
    if not m.core.isostatic:
        problem = (
            "friction is computed where statics alone decides the reactions; here joints are elastic or"
            " over-constrained, and the friction of each depends on how the loads came to act"
        )
        raise InputError(problem, file=m.file, key="joints")


def both(
    m: Mechanism, at: Nominal, motion: DriveMotion | None, without: Loaded, sizes: str, loads: Floats | None
) -> dict[str, Sliding]:
    """The sliding states from both sides.

    Parameters
    ----------
    m : Mechanism
    at : Nominal
    motion : DriveMotion or None
        How the drives move there; None where the file does not say.
    without : Loaded
        The columns of `loaded` without friction, with details.
    sizes : str
        As `loaded` has it.
    loads : ndarray or None
        As `sliding` has them.
    """
    return {side: sliding(m, at, motion, without, side, sizes, loads) for side in SIDES}


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
