"""Friction: how far apart the output is coming from both sides, what friction takes, and where it jams."""

from collections.abc import Iterator

import numpy as np

from jointplay.core.compile import LENGTHS
from jointplay.result import Result, rounding, size, unit_of
from jointplay.result.verdict import there

from .words import Sentence, say

#: what of the output is meant, in words
WORDS = {"position": "", "rotation": " in rotation"}


def of_friction(result: Result) -> Iterator[Sentence]:
    """What is said where the file has friction; nothing of other results."""
    approach = result.attrs.get("approach")
    if approach is None:
        return
    if approach == "none":
        yield Sentence("Without friction; `--approach forward` counts that of the file.", is_common=True)
        return
    if approach == "rest":
        yield from _at_rest(result)
        return
    apart = []
    for quantity, words in WORDS.items():
        values, unit = size(result, "reversal", quantity), unit_of(result, quantity)
        if np.nanmax(values, initial=0.0) > rounding(result, unit):
            k = int(np.nanargmax(values))
            apart.append(f"{say(float(values[k]), unit)}{words}{there(result, k)}")
    if apart:
        yield Sentence(
            f"Coming from the other side, the output differs by up to {' and '.join(apart)} (reversal error)."
        )
    elif np.isfinite(result.get("reversal")).any():
        yield Sentence("Coming from the other side, the output is at the same place.")
    yield from _of_power(result)
    jams = result.get("jam_joint")
    for k in np.flatnonzero(jams != "")[:1].tolist():
        coefficient = float(result.get("jam_coefficient")[k])
        text = f"It jams{there(result, k)}: friction in {jams[k]} and beyond leaves no force that moves it"
        if coefficient:
            text += f", from a coefficient or loss of {coefficient:.2g} there on"
        yield Sentence(f"{text}.", is_alarm=True)


def _at_rest(result: Result) -> Iterator[Sentence]:
    """How wide the range of a length and of an angle is at most."""
    width, names = result.get("friction_high") - result.get("friction_low"), result.labels("component")
    wide = []
    for quantity in WORDS:
        own = [k for k, name in enumerate(names) if (name in LENGTHS) == (quantity == "position")]
        values, unit = width[:, own], unit_of(result, quantity)
        if np.nanmax(values, initial=0.0) > rounding(result, unit):
            k, component = np.unravel_index(np.nanargmax(values), values.shape)
            wide.append(f"{say(float(values[k, component]), unit)} in {names[own[component]]}{there(result, int(k))}")
    if wide:
        text = f"At rest friction can hold the output anywhere in a range of up to {' and '.join(wide)}"
        yield Sentence(f"{text}; by a local search, which does not prove that nothing is beyond.")
    elif np.isfinite(width).any():
        yield Sentence("At rest friction holds the output at one place.")


def _of_power(result: Result) -> Iterator[Sentence]:
    efficiency = result.get("efficiency")
    known = np.isfinite(efficiency)
    if not known.any():
        return
    k = int(np.nanargmin(efficiency))
    least = float(efficiency[k])
    if least < 0.0:
        yield Sentence(f"Self-locking{there(result, k)}: the load alone does not move it back.")
    else:
        yield Sentence(f"Friction takes at most {100.0 * (1.0 - least):.2g} % of the power{there(result, k)}.")
