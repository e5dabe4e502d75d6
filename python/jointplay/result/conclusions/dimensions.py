"""The answer about dimensions: `design`."""

from collections.abc import Iterator

import numpy as np

from jointplay.errors import listed
from jointplay.result import Result

from .sizes import share_of
from .words import Conclusion, Sentence, say

#: in which question limits hold, as the end of a sentence
HOLDS = {"worst": "in the worst case", "loaded": "under the loads"}


def of_design(result: Result) -> Conclusion:
    """How small the aim becomes, what it was before, and what binds."""
    if str(result.get("status")) != "ok":
        return Conclusion(tuple(_nothing(result)))
    if "front_aim" in result.data:
        return Conclusion((*_front(result), *_binds(result), *_unfinished(result)))
    return Conclusion((*_aims(result), *_binds(result), *_flat(result), *_unfinished(result)))


def _nothing(result: Result) -> Iterator[Sentence]:
    """What the nearest attempt misses."""
    if "refused" in result.attrs:
        yield Sentence(f"No design is found: the file would be refused; {result.attrs['refused']}.", is_alarm=True)
        return
    used, names = np.nan_to_num(result.get("used")), result.labels("held")
    worst = int(used.argmax())
    far = "more than all" if not np.isfinite(used[worst]) else share_of(float(used[worst]) - 1.0, 3)
    if names[worst] == "assembly":
        what = f"{far} of its configurations have no pose"
    else:
        what = f"it misses {names[worst]} by {far} of the limit"
        others = [name for k, name in enumerate(names) if used[k] > 1.0 and k != worst]
        what += f", and {listed(others)} by less" if others else ""
    yield Sentence(f"No design is found that holds everything: of the nearest one {what}.", is_alarm=True)
    yield from _unfinished(result)


def _aims(result: Result) -> Iterator[Sentence]:
    words, units = result.coords["aim_words"].values.tolist(), result.coords["aim_unit"].values.tolist()
    before, found = result.get("aim_before"), result.get("aim_found")
    told = []
    for word, unit, old, new in zip(words, units, before.tolist(), found.tolist(), strict=True):
        was = f"instead of {say(old, unit)}" if np.isfinite(old) else "where the file has no pose or no error"
        told.append(f"{word} is {say(new, unit)} {was}")
    text = "; ".join(told)
    yield Sentence(f"{text[:1].upper()}{text[1:]}.", is_answer=True)
    if not result.attrs.get("changes"):
        yield Sentence("No values are found that are better than those of the file.")


def _front(result: Result) -> Iterator[Sentence]:
    words, units = result.coords["aim_words"].values.tolist(), result.coords["aim_unit"].values.tolist()
    aims = result.get("front_aim")
    spans = [
        f"{word} from {say(float(low), unit)} to {say(float(high), unit)}"
        for word, unit, low, high in zip(words, units, aims.min(axis=0), aims.max(axis=0), strict=True)
    ]
    count = len(aims)
    yield Sentence(
        f"{count} design{'s' * (count != 1)} of which none is better in both: {' and '.join(spans)}.", is_answer=True
    )
    found = ", ".join(say(value, unit) for value, unit in zip(result.get("aim_found").tolist(), units, strict=True))
    yield Sentence(f"The one nearest to the least of both, each as a part of its largest, has {found}.")


def _binds(result: Result) -> Iterator[Sentence]:
    names = np.array(result.labels("held"))[result.get("binding").astype(bool)].tolist()
    bounds = result.get("at_bound")
    at = [f"{key} at its {bound} value" for key, bound in zip(result.labels("variable"), bounds, strict=True) if bound]
    if names or at:
        yield Sentence(f"What binds: {listed([*names, *at])}.")
    else:
        yield Sentence("Nothing binds: neither a limit nor a bound of a value.")
    held = result.labels("held")
    of_error = any(name.startswith("limits.") and name.count(".") == 1 and "singular" not in name for name in held)
    of_forces = any(name.startswith(("limits.drive_torques.", "limits.reactions.")) for name in held)
    if of_error or of_forces:
        which = " and ".join(["the error"] * of_error + ["forces"] * of_forces)
        yield Sentence(f"The limits of {which} hold {HOLDS[str(result.attrs['asked'])]}.")


def _flat(result: Result) -> Iterator[Sentence]:
    """The value that has to be met best, beside what it may vary by."""
    if "tolerated" not in result.data:
        return
    far = result.get("tolerated")[:, 0]
    width = (far[:, 1] - far[:, 0]) / (result.get("highest") - result.get("lowest"))
    if not np.isfinite(width).any():
        return
    k = int(np.nanargmin(width))
    loss, (low, high) = float(result.labels("loss")[0]), far[k]
    yield Sentence(
        f"For {share_of(loss)} more of the aim {result.labels('variable')[k]} may be from {low:.5g} to {high:.5g}, the"
        " narrowest of them."
    )


def _unfinished(result: Result) -> Iterator[Sentence]:
    if "incomplete" in result.attrs:
        yield Sentence(f"{str(result.attrs['incomplete']).capitalize()}.")
