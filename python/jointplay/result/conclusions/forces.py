"""The answer of `forces`: the verdict on limits, then the largest drive forces and the largest reaction."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.questions import QUESTIONS
from jointplay.result import FORCES_APART, FORCES_JUDGED, SIDES, Result, blamed_for, first_largest
from jointplay.result.verdict import MISSED, NOT_SHOWN, RANK, caused, ends, there, verdict

from .errors import judged_in
from .sizes import share_of
from .wear import judged
from .words import Conclusion, Sentence, of_statuses, say

#: what is said of limits of forces where nobody has judged them
APART = Sentence("Limits of forces do not count here; `forces` judges them.", is_answer=True, is_common=True)
#: of what is found they are judged
WHEN = {
    "allocate": " with these sizes",
    "life": " with the clearances that have worn by then",
    "workspace": " everywhere in it",
}
#: more drives are not named one by one
MOST_DRIVES = 4
#: part of the largest force that is rounding
ROUNDED = 1e-9


@dataclass(frozen=True)
class Change:
    """How far a force gets from its nominal value at most."""

    #: the configuration
    at: int
    #: ``low`` or ``high``
    side: str
    #: `value`, `nominal`: the force there
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


def beside(result: Result) -> Iterator[Sentence]:
    """What is said of the limits of forces beside an answer about errors, mechanism by mechanism."""
    if FORCES_JUDGED not in result.data:
        yield from [APART] if FORCES_APART in result.attrs else []
    elif "mechanism" in result.sizes:
        for k, name in enumerate(result.labels("mechanism")):
            yield from _beside(result.isel("mechanism", k), f" in {name}")
    else:
        yield from _beside(result, WHEN.get(str(result.attrs["question"]), ""))


def _beside(result: Result, where: str) -> Iterator[Sentence]:
    outcome, used = str(result.get(FORCES_JUDGED)), float(result.get("forces_used"))
    words, case = f"{QUESTIONS['worst'].judged}{where}", str(result.get("forces_load_case"))
    part = f"uses {share_of(used)} of its limit" if math.isfinite(used) else "misses a limit of zero"
    at = f", at configuration {float(result.get('forces_configuration')):.0f}{f' of load case {case}' * bool(case)}"
    told = f": {result.get('forces_quantity')} {part}{at}" if used == used else ""
    if outcome == NOT_SHOWN:
        text = f"Not shown: whether the limits of forces hold {words}; {result.get('forces_unknown')}."
        yield Sentence(text, is_alarm=True, is_answer=True, state=NOT_SHOWN)
    elif outcome:
        is_missed = outcome == MISSED
        verb = "are missed" if is_missed else "hold"
        yield Sentence(f"The limits of forces {verb} {words}{told}.", is_missed, is_answer=True, state=outcome)


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
    blamed = caused(result, name, one.side, one.at, f"; {blamed_for(result)}")
    far = f"up to {say(abs(one.size), unit)}{part} off its nominal {say(one.nominal, unit)}"
    return f"{name} {how}: {far}{place}{blamed}."
