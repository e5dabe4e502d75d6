"""The answer to every question in a few sentences: the worst value, where, what is to blame, whether limits hold.

Tables, reports and the command line say the same sentences.
"""

from dataclasses import replace

from jointplay.questions import QUESTIONS, named
from jointplay.result import Result, parts

from .building import FITS, VERDICTS
from .errors import quantile
from .forces import beside
from .motion import KINDS, motion
from .pairs import Tops, missed, of_pairs, tops
from .series import beyond, each, extreme, judged, name_of, of_compare, of_map, of_sweep, shares_over_nodes
from .sizes import EACH_OUTPUT, MOST_NAMES, first_missed, share_of
from .whole import decide, rests
from .words import (
    BOUND_DIGITS,
    Conclusion,
    Sentence,
    farthest,
    leaving,
    off_path,
    owners,
    plural,
    rounded_up,
    strung,
    which,
    without_path,
)

__all__ = [
    "BOUND_DIGITS",
    "EACH_OUTPUT",
    "FITS",
    "KINDS",
    "MOST_NAMES",
    "VERDICTS",
    "Conclusion",
    "Sentence",
    "Tops",
    "beyond",
    "conclude",
    "decide",
    "each",
    "extreme",
    "farthest",
    "first_missed",
    "judged",
    "leaving",
    "missed",
    "motion",
    "name_of",
    "off_path",
    "owners",
    "plural",
    "quantile",
    "rests",
    "rounded_up",
    "share_of",
    "shares_over_nodes",
    "strung",
    "tops",
    "which",
    "without_path",
]


def conclude(result: Result) -> Conclusion:
    """The answer that a result gives.

    Parameters
    ----------
    result : Result
        Of any question. Of several outputs and load cases the answer is that for the worst of them, which it names.
    """
    several = parts(result)
    if len(several) > 1 or several[0][0]:
        heading, worst = max(((name, conclude(part)) for name, part in several), key=lambda one: one[1].severity)
        return replace(worst, sentences=_of_the_worst(heading, worst, len(several)))
    return _of_one(result)


def _of_one(result: Result) -> Conclusion:
    found = _answer(result)
    if QUESTIONS[str(result.attrs["question"])].is_of_errors:
        first, rest = found.sentences[:1], found.sentences[1:]
        found = replace(found, sentences=(*first, *beside(result), *rest))
    return replace(found, sentences=tuple(sorted(found.sentences, key=lambda sentence: not sentence.is_first)))


def _answer(result: Result) -> Conclusion:
    if "mechanism" in result.sizes:
        return of_compare(result)
    if "sweep_by" in result.attrs:
        return of_pairs(result)
    if "sweep" in result.attrs:
        return of_sweep(result)
    if "grid" in result.attrs:
        return of_map(result)
    said: Conclusion = named(__package__, QUESTIONS[str(result.attrs["question"])].conclusion)(result)
    return said


def _of_the_worst(heading: str, worst: Conclusion, count: int) -> tuple[Sentence, ...]:
    first, *rest = worst.sentences
    # Another one may have a larger error, and a larger limit.
    by = " by their limits" if first.state else ""
    of = f"{heading}, the worst of {count}{by}" if count > 1 and worst.severity else heading
    return (replace(first, text=f"{of}: {first.text[:1].lower()}{first.text[1:]}"), *rest)
