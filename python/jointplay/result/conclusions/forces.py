"""The answer of `forces`: the verdict on limits, then the largest drive forces and the largest reaction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import SIDES, Result, first_largest
from jointplay.result.verdict import RANK, caused, ends, there, verdict

from .errors import judged_in
from .wear import judged
from .words import Conclusion, Sentence, of_statuses, say

#: more drives are not named one by one
MOST_DRIVES = 4
#: part of the largest force that is rounding
ROUNDED = 1e-9


@dataclass(frozen=True)
class Change:
    """How far a force gets from its nominal value at most.

    Attributes
    ----------
    at : int
        The configuration.
    side : str
        ``low`` or ``high``.
    value, nominal : float
        The force there.
    """

    at: int
    side: str
    value: float
    nominal: float

    @property
    def size(self) -> float:
        """The difference."""
        return self.value - self.nominal


def change(result: Result, quantity: str) -> Change | None:
    """Where a force differs most from its nominal value; None where it is nowhere known."""
    k = result.labels("quantity").index(quantity)
    nominal = result.get("nominal_force")[:, k]
    both = np.stack([end[:, k] for end in ends(result)], axis=1)
    off = np.abs(both - nominal[:, None])
    if not np.isfinite(off).any():
        return None
    place = int(first_largest(np.where(np.isfinite(off), off, -1.0).reshape(-1)))
    at, side = divmod(place, 2)
    return Change(at, SIDES[side], float(both[at, side]), float(nominal[at]))


def of_forces(result: Result) -> Conclusion:
    """What is asked of one load case."""
    found = verdict(result)
    named = list(_named(result))
    told = [text for name in named if (text := _told(result, name))]
    sentences = [
        *judged_in(found),
        *(Sentence(text, is_answer=not (found.sentences or k)) for k, text in enumerate(told)),
    ]
    if not found.sentences:
        words = "The file has no limits to judge them by: limits.drive_torques, limits.reactions."
        sentences.append(Sentence(words, is_common=True))
    used = [one.size for name in named if (one := change(result, name)) is not None]
    severity = (float(RANK[found.outcome]), found.used, max(map(abs, used), default=0.0))
    return Conclusion((*sentences, *of_statuses(result)), severity)


def _named(result: Result) -> Iterator[str]:
    """The drives, if they are few, and the joint whose reaction changes most."""
    names = result.labels("quantity")
    drives = [name for name in names if name.startswith("drives.")]
    yield from drives[:MOST_DRIVES]
    joints = [name for name in names if name.startswith("joints.")]
    changes: list[Array | float] = [0.0 if (one := change(result, name)) is None else abs(one.size) for name in joints]
    if joints:
        yield joints[int(first_largest(np.array(changes)))]


def _told(result: Result, name: str) -> str:
    """How far a force gets from its nominal value, where, and what is to blame."""
    one = change(result, name)
    if one is None:
        return ""
    unit, how = result.unit("force", quantity=name), judged(result)
    place = there(result, one.at)
    if abs(one.size) <= ROUNDED * max(abs(one.value), abs(one.nominal)):
        return f"Play and tolerances do not change {name} {how}."
    part = f" ({100.0 * abs(one.size / one.nominal):.2g} %)" if one.nominal else ""
    blamed = caused(result, name, one.side, one.at, "; to blame")
    far = f"up to {say(abs(one.size), unit)}{part} off its nominal {say(one.nominal, unit)}"
    return f"{name} {how}: {far}{place}{blamed}."
