"""Verdicts: whether the errors keep to the limits of the file, where not, by how much, and which source to tighten.

    held        every configuration that counts is known and keeps to all limits
    missed      a known one does not
    not shown   none is known to miss a limit, and some are not known

`random` has shares of specimens outside the limits instead of margins; a required yield is met where the lower end of
its confidence interval reaches it, and missed where the upper end does not. Configurations where the machine cannot be
do not count. What a verdict rests on, such as sizes that were taken, stands in its first sentence.
"""

import numpy as np

from jointplay.result import FORCES_JUDGED, Result, parts

from .judging import (
    PLAY_ALONE,
    PLAYS,
    add_limits,
    add_play,
    ends,
    ends_of_plays,
    judge,
    of_sizes,
    play_alone,
    reached,
    room,
)
from .margins import ANY_SIZE, TAKEN, of_margins
from .nodes import of_nodes
from .outcome import HELD, LOOSE, MISSED, NOT_SHOWN, RANK, READABLE, Verdict, worst_of
from .shares import COUNTED, of_shares
from .structural import of_tolerance
from .words import (
    cause,
    caused,
    configurations,
    left_out,
    limits_in_words,
    percent,
    place,
    there,
)

__all__ = [
    "ANY_SIZE",
    "COUNTED",
    "HELD",
    "LOOSE",
    "MISSED",
    "NOT_SHOWN",
    "PLAYS",
    "PLAY_ALONE",
    "RANK",
    "READABLE",
    "TAKEN",
    "Verdict",
    "add_limits",
    "add_play",
    "cause",
    "caused",
    "configurations",
    "ends",
    "ends_of_plays",
    "is_good",
    "judge",
    "left_out",
    "limits_in_words",
    "of_nodes",
    "of_sizes",
    "outcome",
    "percent",
    "place",
    "play_alone",
    "reached",
    "room",
    "there",
    "verdict",
    "worst_of",
]


def outcome(result: Result) -> str:
    """What becomes of the limits that a question was asked about, over all outputs and load cases; see `Verdict`.

    Sweeps, maps and comparisons show what might be; they do not judge.
    """
    if "sweep" in result.attrs or "grid" in result.attrs or "mechanism" in result.sizes:
        return ""
    of_forces = [str(result.get(FORCES_JUDGED))] if FORCES_JUDGED in result.data else []
    return worst_of([*of_forces, *(verdict(part).outcome for _, part in parts(result))])


def is_good(result: Result) -> bool:
    """Whether every configuration is ok, and the limits hold where there are some."""
    return bool((result.get("status") == "ok").all()) and outcome(result) in ("", HELD)


def verdict(result: Result) -> Verdict:
    """The verdict on a result of one output in one load case, over configurations.

    Parameters
    ----------
    result : Result
        Of any question; of those that have no limits to keep to it says nothing.
    """
    if "structural_error" in result.data:
        return of_tolerance(result)
    if "limit" not in result.data or not np.isfinite(result.get("limit")).any():
        return Verdict()
    if "outside" in result.data:
        return of_shares(result)
    return of_margins(result) if "margin" in result.data else Verdict()
