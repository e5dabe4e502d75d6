"""The answers of the four questions: the verdict on limits, then the largest errors, where, and what is to blame."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import SIZES, Result, blamed_for, figure, rounding, typical
from jointplay.result.verdict import MISSED, NOT_SHOWN, RANK, Verdict, caused, ends, there, verdict

from .rubbing import of_friction
from .running import of_running
from .words import BOUND_DIGITS, Conclusion, Sentence, farthest, of_statuses, plural, rounded_up, say, which

#: what of the output is meant, in words
WORDS = {"position": "position error", "rotation": "rotation"}


def of_errors(result: Result) -> Conclusion:
    """The answer of `loaded`, `given`, `worst` or `random`, of one output in one load case."""
    found = verdict(result)
    judged = list(judged_in(found))
    sizes = list(_sizes(result, found))
    if sizes and not found.named:
        sizes[0] = replace(sizes[0], is_answer=True)
    nothing = Sentence("The file has no limits of the error to judge it by.", is_common=True)
    limits = [] if found.sentences else [nothing]
    # Without limits the largest error is the answer.
    first = 0 if judged else 1
    sentences = (
        *judged,
        *sizes[:first],
        *of_statuses(result),
        *of_friction(result),
        *of_running(result),
        *sizes[first:],
        *proved(result),
        *_without_loads(result),
        *limits,
    )
    largest = [_largest(result, quantity) for quantity in WORDS]
    severity = (float(RANK[found.outcome]), found.used, *(0.0 if value is None else value[0] for value in largest))
    return Conclusion(sentences, severity)


def judged_in(found: Verdict) -> Iterator[Sentence]:
    """The sentences of a verdict, the answer first."""
    for k, text in enumerate(found.sentences):
        is_alarm = k < found.alarms or (k == 0 and found.outcome == NOT_SHOWN)
        state = found.outcome if k == 0 else MISSED if k < found.alarms else ""
        yield Sentence(text, is_alarm, is_answer=k < found.answers, state=state)


def _largest(result: Result, quantity: str) -> tuple[float, str, int] | None:
    """The largest value of a quantity, its unit, and the configuration."""
    values, unit = figure(result, quantity)
    configuration = farthest(values, result.get("status"))
    return None if configuration is None else (float(values[configuration]), unit, configuration)


def _sizes(result: Result, judged: Verdict) -> Iterator[Sentence]:
    """The largest position error and the largest rotation, unless the verdict has named them."""
    for quantity, words in WORDS.items():
        found = _largest(result, quantity)
        if found is None or quantity in judged.named:
            continue
        value, unit, configuration = found
        if value <= rounding(result, unit):
            if _is_open(result, quantity, unit):
                continue
            yield Sentence(f"No {words} at any configuration." if result.sizes["configuration"] > 1 else f"No {words}.")
            continue
        where = there(result, configuration)
        at_rest = "friction_low" in result.data
        words += " that friction can hold" if at_rest else ""
        if result.attrs["question"] == "random":
            text = f"{100 * typical(result):g} % of the specimens have a {words} below {say(value, unit)}{where}"
        else:
            more = _left_open(result, quantity, (value, unit), configuration)
            text = f"Largest {words}: {say(value, unit)}{where}{more}"
        # Shares are those without friction.
        yield Sentence(f"{text}{'' if at_rest else blamed(result, quantity, configuration)}.")


def proved(result: Result, place: str = "configuration") -> Iterator[Sentence]:
    """What the bounds of the worst case prove, and where there are none."""
    if "certified" not in result.data:
        return
    certified = result.get("certified")
    count = int(certified.sum())
    if count:
        parts = []
        for quantity, words in WORDS.items():
            bounds, unit = (
                result.get(f"worst_{quantity}_certified")[certified],
                result.unit(f"worst_{quantity}_certified"),
            )
            if np.nanmax(bounds, initial=0.0) > rounding(result, unit):
                highest = f"{rounded_up(bounds).max():.{BOUND_DIGITS}g} {unit}"
                parts.append(f"a {words} above {highest} ({_close(result.get(f'worst_{quantity}_gap')[certified])})")
        these = f" at {count} of {plural(certified.size, place)}" if count < certified.size else ""
        if parts:
            yield Sentence(f"Proved{these}: no offsets within the sets make {' or '.join(parts)}.")
    if count < certified.size:
        reasons = "; ".join(dict.fromkeys(result.get("certified_reason")[~certified].tolist()))
        missing = np.flatnonzero(~certified).tolist()
        # Configurations have numbers, nodes of a map have not.
        where = which(missing) if place == "configuration" else plural(len(missing), place)
        text = f"No {place} has a bound" if certified.size == 1 else f"{where} without a bound"
        yield Sentence(f"{text}: {reasons}.")


def _without_loads(result: Result) -> Iterator[Sentence]:
    """What the worst case of an elastic mechanism leaves out."""
    if result.attrs["question"] == "worst" and "contribution_elastic" in result.data:
        yield Sentence("Deformation under loads is not part of the worst case; `loaded` has it.")


def _close(gaps: Array) -> str:
    """The largest gap in percent, raised to three digits or thousandths; there is none where nothing is attained."""
    attained = np.isfinite(gaps)
    if not attained.any():
        return "nothing is attained"
    percent = max(100.0 * float(gaps[attained].max()), 1e-3)
    step = max(1e-3, 10.0 ** (math.floor(math.log10(percent)) - 2))
    where = "" if attained.all() else ", where anything is attained"
    return f"at most {math.ceil(percent / step - 1e-9) * step:.4g} % above what is attained{where}"


def _is_open(result: Result, quantity: str, unit: str) -> bool:
    """Whether a load leaves open how large a quantity is of which it makes nothing."""
    return bool(np.nanmax(_farthest(result, quantity), initial=0.0) > rounding(result, unit))


def _farthest(result: Result, quantity: str) -> Array:
    """The largest size of a quantity at each configuration with what a load leaves open; empty where it decides all."""
    if "undetermined" not in result.data:
        return np.empty(0)
    _, highest = ends(result)
    return np.asarray(highest[:, SIZES.index(quantity) - len(SIZES)])


def _left_open(result: Result, quantity: str, said: tuple[float, str], configuration: int) -> str:
    """How large a quantity may be with what a load leaves open, where that is more than what is said."""
    (value, unit), every = said, _farthest(result, quantity)
    at = farthest(every, result.get("status")) if every.size else None
    if at is None or say(float(every[at]), unit) == say(value, unit):
        return ""
    where = there(result, at) if at != configuration else ""
    return f", up to {say(float(every[at]), unit)}{where} with what the load leaves open"


def blamed(result: Result, quantity: str, configuration: int) -> str:
    """What has the largest share, as the end of a sentence."""
    return caused(result, quantity, "high", configuration, f"; {blamed_for(result)}")


def quantile(result: Result, quantity: str, probability: float) -> Array:
    """What a share of the specimens stays below, the one of the result that is nearest to it."""
    return np.asarray(result.get("error_quantile", probability=typical(result, probability), quantity=quantity))


def of_structural(result: Result) -> Conclusion:
    """The answer of `structural`: how far the nominal mechanism is from its target at most, and what was fitted."""
    found = verdict(result)
    error, unit = result.get("structural_error"), result.unit("structural_error")
    configuration = farthest(error, result.get("status"))
    sentences = [*judged_in(found)]
    if configuration is None:
        sentences.append(Sentence("The target asks for nothing where the mechanism can be.", is_answer=True))
    elif not found.sentences:
        of = f" of {result.attrs['of']}" if "of" in result.attrs else ""
        largest = f"{say(float(error[configuration]), unit)}{there(result, configuration)}"
        sentences.append(Sentence(f"Structural error{of} at most {largest}, without play.", is_answer=True))
    if "fitted" in result.attrs:
        sentences.append(Sentence(f"Nearest by the largest distance: {result.attrs['fitted']}."))
    severity = (float(RANK[found.outcome]), found.used, 0.0 if configuration is None else float(error[configuration]))
    return Conclusion((*sentences, *of_statuses(result)), severity)
