"""The answer of `life`: for how many cycles the limits hold, and the wear of which joint counts most."""

import math
from collections.abc import Iterator

import numpy as np

from jointplay.errors import listed
from jointplay.questions import QUESTIONS
from jointplay.result import Result
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, configurations

from .running import loose, of_running
from .sizes import MOST_NAMES, comes_first, share_of
from .words import Conclusion, Sentence, say

#: sources that wear as much of the limits away are named together
ALIKE = 0.01
#: digits of numbers of cycles, which are rounded down; rates are known to less
DIGITS = 3
CYCLES = {
    "closed": "once along the path, which ends where it began",
    "back-and-forth": "along the path and back",
    "one-way": "along the path, one way",
}
#: statuses with an answer that depends on contact
SAID = ("ok", "unlimited")
#: cycles by which growth is told
MANY = 1_000_000


def of_life(result: Result) -> Conclusion:
    """How long the limits hold, what ends it, and what a cycle is."""
    answer = list(_answer(result))
    if (contact := loose(result)) and str(result.get("status")) not in SAID:
        answer.append(Sentence(f"Contact {contact}; impacts are left out.", is_alarm=True))
    return Conclusion((*answer, *_about_ages(result), *_about_cycle(result), *of_running(result)))


def rounded_down(cycles: float) -> str:
    """A number of cycles with few digits that is not above the given one.

    Examples
    --------
    >>> rounded_down(112_503.6), rounded_down(0.5)
    ('112,000', '0')
    """
    if not math.isfinite(cycles) or cycles < 1.0:
        return "0"
    step = 10.0 ** max(0, math.floor(math.log10(cycles)) + 1 - DIGITS)
    return f"{math.floor(cycles / step * (1.0 + 1e-12)) * step:,.0f}"


def judged(result: Result) -> str:
    """``in the worst case``: where limits have to hold."""
    share = share_of(float(result.attrs.get("probability", 1.0)))
    words = QUESTIONS[str(result.attrs["asked"])].judged
    return words.replace("the required {}", share).replace("the specimens", "specimens")


def _answer(result: Result) -> Iterator[Sentence]:
    status, life = str(result.get("status")), float(result.get("life"))
    limits = f"The limits hold {judged(result)}"
    match status:
        case "ok" | "unlimited" if contact := loose(result):
            text = f"Not shown: for how long the limits hold; contact {contact}"
            without = f"Without impacts they would hold {judged(result)} for {rounded_down(life)} cycles"
            yield Sentence(f"{text}. {without}.", is_alarm=True, state=NOT_SHOWN)
        case "ok":
            low, high = (rounded_down(float(result.get(name))) for name in ("life_low", "life_high"))
            spread = f"{low} to {high} with wear rates twice or half as large"
            yield Sentence(
                f"{limits} for {rounded_down(life)} cycles ({spread}); {comes_first(result, 'binding')}.", state=HELD
            )
            yield from map(Sentence, _wears_out(result))
        case "missed":
            text = f"The limits are missed {judged(result)} before anything wears; {comes_first(result, 'binding')}."
            yield Sentence(text, is_alarm=True, state=MISSED)
        case "unlimited":
            yield Sentence(f"{limits} for more than {rounded_down(life)} cycles; no more were tried.", state=HELD)
        case "undetermined" if math.isfinite(life):
            text = f"{limits} for {rounded_down(life)} cycles; how the clearances wear from then on is not known"
            yield Sentence(f"{text}: the loads do not say how joints share them.", is_alarm=True, state=NOT_SHOWN)
        case "undetermined":
            names = np.array(result.labels("source"), dtype=str)[~np.isfinite(result.get("growth"))]
            text = "Not shown: for how long the limits hold; the loads do not say what is carried by"
            yield Sentence(f"{text} {listed(names.tolist())}.", is_alarm=True, state=NOT_SHOWN)
        case "no_limit":
            yield Sentence("No limit is set, so that there is no life: [limits] of the file says what is acceptable.")
            yield from map(Sentence, _fastest(result))
        case "no_wear":
            yield Sentence("Nothing wears: no joint with `wear` slides under a force.")
        case "no_pose":
            places = [int(place) for place in str(result.attrs["without_pose"]).split(", ")]
            why = str(result.attrs["without_pose_status"]).replace("_", " ")
            text = "Not shown: for how long the limits hold; a cycle needs all configurations, and"
            verb = "are" if len(places) > 1 else "is"
            yield Sentence(f"{text} {configurations(places)} {verb} {why}.", is_alarm=True, state=NOT_SHOWN)


def _wears_out(result: Result) -> Iterator[str]:
    """Which clearance takes most of the limits."""
    names, without = result.labels("source"), result.get("used_without")
    if len(names) == 1:
        return
    least, of = float(np.nanmin(without)), _used(result)
    if not least < 1.0 - ALIKE:
        shares = f"{share_of(least, 3)} {of} would be used then"
        yield f"The wear of no joint decides alone: without that of any one of them {shares}."
        return
    best = [name for name, share in zip(names, without, strict=True) if share <= least + ALIKE]
    it = "it" if len(best) == 1 else "that of one of them"
    said = listed(best) if len(best) <= MOST_NAMES else f"{len(best)} clearances, such as {best[0]},"
    yield f"The wear of {said} counts most: without {it} {share_of(least, 3)} {of} would be used then."


def _used(result: Result) -> str:
    """Of what a part is used."""
    return "of the share that may be outside" if "probability" in result.attrs else "of the limits"


def _fastest(result: Result) -> Iterator[str]:
    growth = result.get("growth")
    k = int(np.argmax(growth))
    unit = result.unit("growth")
    yield f"{result.labels('source')[k]} grows fastest: by {say(MANY * float(growth[k]), unit)} in {MANY:,} cycles."


def _about_ages(result: Result) -> Iterator[Sentence]:
    """Ages that were asked for and are beyond the life."""
    if "used" not in result.data or str(result.get("status")) not in ("ok", "unlimited"):
        return
    ages, used = np.array(result.labels("age"), dtype=float), result.get("used")
    beyond = np.flatnonzero((used > 1.0) & (ages > float(result.get("life"))))
    if beyond.size:
        k = int(beyond[0])
        text = f"After {ages[k]:,.0f} cycles {share_of(float(used[k]), 3)} {_used(result)} are used."
        yield Sentence(text, is_alarm=True, state=MISSED)


def _about_cycle(result: Result) -> Iterator[Sentence]:
    if "cycle" in result.attrs and str(result.get("status")) != "no_wear":
        cases = ", as often in each of the load cases" if "load_cases" in result.attrs else ""
        yield Sentence(f"A cycle is {CYCLES[str(result.attrs['cycle'])]}{cases}.")
