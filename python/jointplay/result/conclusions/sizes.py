"""The answers about sizes: `allow` and `allocate`."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result, first_largest
from jointplay.result.verdict import ANY_SIZE, HELD, MISSED, NOT_SHOWN, TAKEN, configurations, left_out, play_alone

from .running import loose, of_running
from .words import Conclusion, Sentence

#: what misses its limit, in words
QUANTITIES = {"position": "the position error", "rotation": "the rotation"}
#: where clearances are in the specimens of a yield
CONTACTS = {"scattered": "offsets that scatter", "loaded": "offsets that the load decides"}
#: sources that bring as much to this share are named together
ALIKE = 0.01
#: a factor of all sizes that leaves nothing of them
NONE = 1e-4
#: with several outputs
EACH_OUTPUT = "Each output is judged by itself: up to the sum of their shares may be outside some limit."
#: as many names stand in a sentence
MOST_NAMES = 4


def of_allow(result: Result) -> Conclusion:
    """Whether the limits hold, how much larger all sizes may be, and which source to tighten."""
    used = float(result.get("used"))
    running = of_running(result)
    return Conclusion(
        (*_hold(result, used), Sentence(_factor(result)), *map(Sentence, _tighten(result, used)), *running)
    )


def _hold(result: Result, used: float) -> Iterator[Sentence]:
    """Whether the limits hold with the sizes as they are; not shown where a configuration is not known."""
    said, place = _said(result, used), int(result.get("used_configuration"))
    without, out = (_numbers(str(result.attrs.get(name, ""))) for name in ("without_pose", "left_out"))
    end = left_out(out)
    basis, contact = _contacts(result), loose(result)
    limits = "The limits of forces" if result.attrs["asked"] == "forces" else "The limits"
    match str(result.attrs.get("sizes", "")):
        case "largest" | "smallest" as play:
            basis += f" {TAKEN[play]}"
        case "middle" if not used > 1.0:
            # Those with the largest and the smallest play are judged as well; one of the three is enough to miss.
            basis += f" {ANY_SIZE}"
    if used > 1.0:
        at = f", at configuration {place}" if np.isfinite(used) or "probability" in result.attrs else ""
        yield Sentence(f"{limits} are missed{basis}: {said}{at}{end}.", is_alarm=True, state=MISSED)
        if contact:
            yield Sentence(f"Contact {contact}; impacts are left out.", is_alarm=True)
    elif contact:
        text = f"Not shown: whether {limits.lower()} hold{basis}; contact {contact}{end}."
        yield Sentence(text, is_alarm=True, state=NOT_SHOWN)
        yield Sentence(f"Where each reaction presses, they hold: {said}, at configuration {place}.")
    elif without:
        status = str(result.attrs["without_pose_status"]).replace("_", " ")
        verb = "are" if len(without) > 1 else "is"
        why = "cannot be assembled" if status == "not assembled" else f"{verb} {status}"
        text = f"Not shown: whether {limits.lower()} hold{basis}; {configurations(without)} {why}{end}."
        yield Sentence(text, is_alarm=True, state=NOT_SHOWN)
        yield Sentence(f"They hold at the others: {said}, at configuration {place}.")
    else:
        yield Sentence(f"{limits} hold{basis}: {said}, at configuration {place}{end}.", state=HELD)


def _numbers(places: str) -> list[int]:
    """Those of an attribute such as ``1, 3``."""
    return [int(place) for place in places.split(", ") if place]


def _said(result: Result, used: float) -> str:
    """What is used of the limits, where most of it is."""
    quantity, place = str(result.get("used_quantity")), int(result.get("used_configuration"))
    output = _of_output(result, "used")
    if "probability" in result.attrs:
        allowed = 1.0 - float(result.attrs["probability"])
        lost = float(result.get("used_not_assembled"))
        outside = min(used * allowed, 1.0) if np.isfinite(used) else 1.0
        by = _decided(str(result.get("used_contact"))) if "used_contact" in result.data else ""
        if quantity == "assembly":
            return f"{share_of(lost)} of the specimens cannot be assembled, {share_of(allowed)} may be outside{by}"
        limits = f" the limits{output}" if output else ""
        return f"{share_of(outside)} of the specimens are outside{limits}, {share_of(allowed)} may be{by}"
    if not np.isfinite(used):
        return f"configuration {place} cannot be assembled" if quantity == "assembly" else "a limit of zero is missed"
    return f"{QUANTITIES.get(quantity, quantity)}{output} uses {share_of(used)} of its limit"


def _contacts(result: Result) -> str:
    """By which assumption a yield is told; nothing where there is no load, so that there is one only."""
    names = str(result.attrs.get("contact", ""))
    return " " + " and ".join(f"with {CONTACTS[name]}" for name in names.split(", ")) if names else ""


def _decided(contact: str, load_case: str = "") -> str:
    """Which assumption it is of."""
    where = f", load case {load_case}" if load_case else ""
    return f", with {CONTACTS[contact]}{where}" if contact else ""


def _factor(result: Result) -> str:
    status, factor = str(result.get("factor_status")), float(result.get("allowed_factor"))
    if status == "not_enough":
        known = str(result.attrs.get("known_deviations", ""))
        rest = f"; {known}: known and without a tolerance, to be corrected first" if known else ""
        return f"All sizes together: the limits are missed however small they are made{rest}."
    if status == "needs_play":
        return "All sizes together: the limits hold as they are, and are missed with sizes of zero."
    if status in ("unlimited", "no_effect"):
        return f"All sizes together: the limits hold up to {factor:.4g} times the sizes; no larger factor was tried."
    if factor < NONE:
        return "All sizes together: the limits hold with none of them only."
    verb = "may be" if factor >= 1.0 else "have to be"
    return f"All sizes together {verb} {_down(factor)} times as large; {comes_first(result, 'factor_binding')}."


def _down(value: float) -> str:
    """Four digits of a number, rounded down, so that what is said still holds."""
    if not value > 0.0:
        return "0"
    places = 3 - int(np.floor(np.log10(value)))
    return f"{np.floor(value * 10.0**places * (1.0 + 1e-12)) / 10.0**places:.4g}"


def _tighten(result: Result, used: float) -> Iterator[str]:
    """Which source brings most."""
    without = result.get("used_without")
    if not np.isfinite(without).any():
        return
    least = float(np.nanmin(without))
    if not least < used * (1.0 - ALIKE):
        return
    best = [name for name, share in zip(result.labels("source"), without, strict=True) if share <= least + ALIKE * used]
    names = " or ".join(best) if len(best) <= MOST_NAMES else f"one of {len(best)} sources, such as {best[0]},"
    among = ", of those that were looked at" if "incomplete" in result.attrs else ""
    yield f"To tighten {names} brings most{among}: without it {share_of(least)} would be used."


def first_missed(result: Result, what: str, k: int) -> str:
    """``position #10``: what misses its limit first when a size grows, and at which configuration."""
    text = f"{result.get(f'{what}_quantity')[k]} #{int(result.get(f'{what}_configuration')[k])}"
    for name in ("output", "load_case"):
        if f"{what}_{name}" in result.data and (label := result.get(f"{what}_{name}")[k]):
            text += f" {label}"
    return text


def comes_first(result: Result, what: str) -> str:
    """The same in words, where it is one for the whole result."""
    quantity, place = str(result.get(f"{what}_quantity")), int(result.get(f"{what}_configuration"))
    if quantity == "assembly":
        return f"configuration {place} has no pose then"
    return f"the limit of {quantity}{_of_output(result, what)} at configuration {place} comes first"


def _of_output(result: Result, what: str) -> str:
    """Which output it is about, where the file has several: each is judged by itself."""
    name = str(result.get(f"{what}_output")) if f"{what}_output" in result.data else ""
    return f" of output {name}" if name else ""


def share_of(part: float, digits: int = 4) -> str:
    """A share in per cent; `more than all` where there is no end to it.

    Examples
    --------
    >>> [share_of(part, 2) for part in (0.0123, 1.0, 25.3, float("inf"))]
    ['1.2 %', '100 %', '2500 %', 'more than all']
    """
    if not np.isfinite(part):
        return "more than all"
    # Rounded first, so that all of it is not 1e+02.
    return f"{float(f'{100.0 * part:.{digits}g}'):.12g} %"


def of_allocate(result: Result) -> Conclusion:
    """The least cost, and which limit binds."""
    status = str(result.get("status"))
    if "size" not in result.data:
        text = f"No sizes are found: configuration {result.attrs['without_pose']} is {status.replace('_', ' ')}."
        return Conclusion((Sentence(text, is_alarm=True),))
    used = result.get("used")
    limit, configuration = np.unravel_index(int(first_largest(used.reshape(-1))), used.shape)
    name, share = result.labels("limited")[limit], float(used[limit, configuration])
    place = f"{name} at configuration {configuration}"
    by = ""
    if ", " in str(result.attrs.get("contact", "")):
        contact, _, load_case = str(result.get("decided_by")[limit, configuration]).partition(" ")
        by = _decided(contact, load_case)
    if status == "infeasible":
        lost = float(result.get("not_assembled")) if "not_assembled" in result.data else 0.0
        allowed = 1.0 - float(result.attrs.get("probability", 1.0))
        what = f"use {share_of(share)} of {place}{by}"
        if lost > allowed:
            what = f"cannot be assembled with {share_of(lost)} of the specimens"
        elif not np.isfinite(share):
            what = f"miss {place}{by}"
        text = f"No sizes hold the limits{_contacts(result)}: even the tightest ones {what}."
        return Conclusion((Sentence(text, is_alarm=True),))
    if status not in ("ok", "unfinished"):
        text = f"No sizes are found: even with the tightest ones the mechanism is {status.replace('_', ' ')}."
        return Conclusion((Sentence(text, is_alarm=True),))
    cost, before = float(result.get("total_cost")), float(result.get("total_cost_before"))
    now = f"; the sizes in the file cost {before:.5g}" if np.isfinite(before) else ""
    if now and "before" in result.attrs:
        now += ", and hold them too" if result.attrs["before"] == "holds" else ", and miss them"
    if not result.attrs.get("changes"):
        now = f", that of the sizes in the file{'; none is found that is cheaper' if status == 'ok' else ''}"
    sentences = [
        Sentence(f"The limits hold{play_alone(result)}{_contacts(result)} for a cost of {cost:.5g}{now}."),
        Sentence(f"What binds is {place}{by}: {share_of(share)} of the limit is used.{_direction(result)}"),
    ]
    if status == "unfinished":
        sentences.append(Sentence("The search reached its limit of steps: there may be cheaper sizes.", is_alarm=True))
    if "cheapest" in result.attrs:
        sentences.append(Sentence("All sources have their cheapest size; looser limits save nothing."))
    return Conclusion(tuple(sentences))


def _direction(result: Result) -> str:
    if "binding_direction" not in result.data:
        return ""
    parts = ", ".join(f"{value:.3g}" for value in result.get("binding_direction"))
    return f" Direction: [{parts}]."
