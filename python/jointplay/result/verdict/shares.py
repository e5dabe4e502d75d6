"""The verdict on specimens: the shares outside the limits, and the yield that is required.

Where the file has loads there are two assumptions on where clearances are, and each has shares of its own.
"""

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import LOAD, Result, in_words

from .judging import play_alone
from .outcome import HELD, MISSED, NOT_SHOWN, Rows, Verdict, worst_of
from .words import cause, percent, there

#: how a share was found where nothing else is said
COUNTED = "counted"
#: where clearances are, in words
CONTACTS = {"scattered": " where offsets scatter", "loaded": " where the load decides the offsets"}
#: why more is not known of a yield
MORE = "more specimens decide"


@dataclass(frozen=True)
class _Contact:
    """The shares outside under one assumption on where clearances are."""

    #: the assumption; empty where there is one only
    words: str
    #: `outside`, `low`, `high`: by configuration, nan where it is not known
    outside: Array
    low: Array
    high: Array
    #: how each was found where they were searched for
    method: Array | None
    #: load cases that the shares are of
    case: Array | None
    #: whether all other variables are of it as well
    is_own: bool

    @property
    def at(self) -> int:
        """The configuration with the largest share.

        Where nothing was found there may be a wide interval, which says less than a specimen that is outside elsewhere.
        """
        return int(np.nanargmax(np.where(np.isfinite(self.outside), self.high + (self.outside > 0.0), -1.0)))

    def yields(self, required: float) -> tuple[Array, Array]:
        """Where a required yield is missed, and where the specimens leave it open."""
        return yields(self.outside, self.low, self.high, required)

    def outcome(self, required: float) -> str:
        """What becomes of a required yield where it is known."""
        missed, is_open = self.yields(required)
        return MISSED if missed.any() else NOT_SHOWN if is_open.any() else HELD

    def place(self, result: Result) -> str:
        """Where the largest share is; nothing where all are nothing."""
        if not self.outside[self.at] > 0.0:
            return ""
        place = there(result, self.at)
        case = f" in load case {self.case[self.at]}" if self.case is not None else ""
        return f"{',' * bool((place or case) and self.words)}{case}{place}"


def yields(outside: Array, low: Array, high: Array, required: float) -> tuple[Array, Array]:
    """Where a yield is missed, and where it is neither missed nor met, by the ends of confidence intervals."""
    known = np.isfinite(outside)
    missed = known & ~(1.0 - low >= required)
    return missed, known & ~missed & ~(1.0 - high >= required)


def of_shares(result: Result) -> Verdict:
    """The verdict on a result that has shares outside."""
    rows = Rows.of(result)
    pressed = rows.following(result.get("contact_loaded")) if "contact_loaded" in result.data else rows
    contacts = _contacts(result, rows, pressed)
    rows = pressed.but(np.logical_and.reduce([np.isfinite(one.outside) for one in contacts]))
    required = float(result.attrs.get("required_yield", np.nan))
    is_required = bool(np.isfinite(required))
    seen = [one for one in contacts if np.isfinite(one.outside).any()]
    alone = play_alone(result)
    nothing = ("",) * len(result.get("outside"))
    basis = " and".join(one.words for one in contacts)
    if not seen:
        if not is_required:
            return Verdict((f"Outside the limits{alone}: not known; {rows.why()}{rows.left_out()}.",), nothing)
        text = f"Required yield {percent(required)}{alone}: not shown; {rows.why()}{rows.left_out()}."
        return Verdict((text,), nothing, NOT_SHOWN, basis=basis, gist=rows.why())
    seen.sort(key=lambda one: (is_required and one.outcome(required) == MISSED, one.outside[one.at]), reverse=True)
    used = max(float(one.high[one.at]) for one in seen)
    sentences = [_outside(result, one) for one in seen]
    sentences[0] = f"{sentences[0][:-1]}{rows.left_out() * (not is_required)}."
    sentences += _of_path(result)
    if not is_required:
        unknown = [f"Not known: {rows.why()}."] if rows.unknown else []
        return Verdict((*sentences, *unknown), nothing, answers=len(seen), used=used)
    known = worst_of([one.outcome(required) for one in seen])
    outcome = known if known == MISSED or rows.are_all_known else NOT_SHOWN
    reasons = [MORE] * (known == NOT_SHOWN) + ([rows.why()] if not rows.are_all_known else [])
    answer = {HELD: "met", MISSED: MISSED}.get(outcome) or f"{NOT_SHOWN}, {' and '.join(reasons)}"
    first, *others = seen
    least = "; ".join([_within(result, first), *(_shortly(result, one) for one in others)])
    sentences.insert(0, f"Required yield {percent(required)}{alone}: {answer}; {least}{rows.left_out()}.")
    if outcome == MISSED and rows.unknown:
        sentences.append(f"Not known: {rows.why()}.")
    missed = np.logical_or.reduce([one.yields(required)[0] for one in contacts])
    gist = f"{percent(1.0 - first.outside[first.at])}{first.words}" if outcome == MISSED else " and ".join(reasons)
    marks = tuple("yield" if bad else "" for bad in missed.tolist())
    alarms = int(outcome == MISSED)
    return Verdict(tuple(sentences), marks, outcome, 1, alarms, used, basis=basis, gist=gist)


def _contacts(result: Result, rows: Rows, pressed: Rows) -> list[_Contact]:
    """The assumptions that count, that of the other variables first; `pressed` are the rows where the load decides."""

    def shares(name: str, rows: Rows) -> tuple[Array, Array, Array, Array | None]:
        outside, low, high = (np.where(rows.known, result.get(f"{name}{end}"), np.nan) for end in ("", "_low", "_high"))
        return outside, low, high, result.get(f"{name}_method") if f"{name}_method" in result.data else None

    words = CONTACTS.get(str(result.attrs.get("contact", "")), "")
    found = [_Contact(words, *shares("outside", rows), None, True)]
    # Where nothing acts on the mechanism of one value of a sweep, no load decides.
    if "outside_loaded" in result.data and np.isfinite(result.get("outside_loaded")).any():
        case = result.get("outside_loaded_case") if "outside_loaded_case" in result.data else None
        found.append(_Contact(CONTACTS["loaded"], *shares("outside_loaded", pressed), case, False))
    return found


def _within(result: Result, one: _Contact) -> str:
    at = one.at
    interval = f"{percent(1.0 - one.high[at])} to {percent(1.0 - one.low[at])} with 95 % confidence"
    return f"{percent(1.0 - one.outside[at])} are within{one.words}{one.place(result)}, {interval}"


def _shortly(result: Result, one: _Contact) -> str:
    return f"{percent(1.0 - one.outside[one.at])}{one.words}{one.place(result)}"


def _outside(result: Result, one: _Contact) -> str:
    at, head = one.at, f"Outside the limits{play_alone(result)}{one.words}"
    share, low, high = (float(values[at]) for values in (one.outside, one.low, one.high))
    method = COUNTED if one.method is None else str(one.method[at])
    how = "" if method == COUNTED else f", {method}"
    if share > 0.0:
        interval = f"{percent(low)} to {percent(high)} with 95 % confidence{how}"
        place = one.place(result).lstrip(",")
        return f"{head}: {percent(share)} of the specimens{place} ({interval}){_most(result, one)}."
    if high <= 0.0:
        why = "nothing scatters" if method == COUNTED else "the worst case keeps to the limits"
        return f"{head}: none of the specimens; {why}."
    return f"{head}: none of the specimens; less than {percent(high)} with 95 % confidence{how}."


def _most(result: Result, one: _Contact) -> str:
    """Beyond which limit most specimens are, and what scatters most."""
    if not one.is_own:
        return ""
    every = result.get("outside_quantity")[one.at]
    most = int(np.nanargmax(every))
    name = str(result.labels("quantity")[most])
    whose = f", most beyond {name}" if np.isfinite(every).sum() > 1 and every[most] > 0.0 else ""
    found = cause(result, name, "high", one.at)
    blamed = f"; {in_words(*found)} of the variance" if found is not None and found[0] != [LOAD] else ""
    return f"{whose}{blamed}"


def _of_path(result: Result) -> list[str]:
    """The yields over all configurations."""
    if "yield_path" not in result.data or not np.isfinite(result.get("yield_path")):
        return []
    found = []
    for name, how in (("path", "with offsets drawn anew at each"), ("specimen", "wherever the play lies")):
        share, low, high = (float(result.get(f"yield_{name}{end}")) for end in ("", "_low", "_high"))
        found.append(f"{percent(share)} {how} ({percent(low)} to {percent(high)})")
    count = len(result.get("outside"))
    where = f" at all {count} configurations" if count > 1 else ""
    return [f"Within the limits{where}: {found[0]}; {found[1]}."]
