"""The answer of `calibrate`: what readings tell about one machine, what they leave open, and whether they fit."""

import math
from collections.abc import Iterator

import numpy as np

from jointplay.errors import listed
from jointplay.result import Result
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, percent

from .words import FEW, Conclusion, Sentence, plural, say

#: part of its prior variance that readings have to take away from an unknown that counts as determined
TOLD = 0.5
#: probability of a smaller sum of squares from which on it is named
SMALL = 1e-3
#: a risk below which the digits say nothing
NO_RISK = 1e-9
#: what ISO 230-2 calls the figures of readings from both sides
BOTH_SIDES = {
    "B": "reversal",
    "R": "bidirectional_repeatability",
    "E": "systematic_deviation",
    "M": "mean_deviation",
    "A": "bidirectional_accuracy",
}
#: standard errors that are not exceeded to one side, 95 %
ONE_SIDED = 1.645
#: a coefficient this near to a whole number is that
WHOLE = 1e-4


def of_calibrate(result: Result) -> Conclusion:
    """What is determined, the error that is left, how well the readings fit, and which of them do not.

    What puts all of it in doubt comes first. Of a fit that does not settle nothing else is known.
    """
    if str(result.get("status")) == "not_settled":
        text = "The fit does not settle: its steps stay large, and the values that it broke off at mean nothing."
        return Conclusion((Sentence(text, is_alarm=True, state=NOT_SHOWN),))
    parts = (_determined, _left, _fit, _rows, _together, _held_out, _beyond)
    said = [sentence for part in parts for sentence in part(result)]
    return Conclusion(tuple(sorted(said, key=lambda sentence: sentence.state != NOT_SHOWN)))


def is_determined(result: Result) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Of which unknowns the readings leave less than half of the variance that they had beforehand."""
    return np.asarray(result.get("determined") & (result.get("share_determined") > TOLD))


def _determined(result: Result) -> Iterator[Sentence]:
    names, determined = result.labels("unknown"), is_determined(result)
    kinds = np.array([_kind(key) for key in result.labels("unknown_key")])
    sums = [row for row in _sums(result) if not determined[np.flatnonzero(row)].all()]
    for kind in dict.fromkeys(kinds.tolist()):
        which = kinds == kind
        count, every = int((determined & which).sum()), int(which.sum())
        own = [row for row in sums if which[np.flatnonzero(row)].all()]
        summed = np.any(own, axis=0) if own else np.zeros(len(names), dtype=bool)
        rest = [name for name, here in zip(names, which & ~determined & ~summed, strict=True) if here]
        verb = "is" if 1 in (count, every) else "are"
        text = f"{count} of {plural(every, kind)} {verb} determined (less than half of the variance is left)"
        text += f"; not {_some(rest)}" if rest else ""
        if own:
            said = [_sum([names[k] for k in np.flatnonzero(row)], row[row != 0.0]) for row in own]
            text += f"; only together: {_some(said)}"
        yield Sentence(f"{text}.")


def _kind(key: str) -> str:
    """What an unknown is, by its key."""
    if key.endswith(".deviation"):
        return "deviation"
    return "size" if ".clearance" in key or ".backlash" in key else "number"


def _sums(result: Result) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Coefficients of the sums of which only the sum is determined."""
    if "alike" not in result.data:
        return np.zeros((0, len(result.labels("unknown"))))
    return np.asarray(result.get("together")[result.get("alike")])


def _together(result: Result) -> Iterator[Sentence]:
    names = result.labels("unknown")
    for row, parts in enumerate(result.get("together") if "together" in result.data else ()):
        places = np.flatnonzero(parts).tolist()
        own = [names[k] for k in places]
        if is_determined(result)[places].all():
            # Their tolerances hang together, which says the rest.
            continue
        if not result.get("alike")[row]:
            if len(own) == 1:
                yield Sentence(f"{own[0]} changes no reading.")
            else:
                yield Sentence(
                    f"{listed(own)} are not determined by themselves: a common step of all of them changes no reading."
                )
            continue
        value, error = (float(result.get(f"combination_{name}")[row]) for name in ("estimate", "standard_error"))
        unit = result.labels("combination_unit")[row]
        found = f", {_about(value, error)} {unit}" if math.isfinite(value) else ""
        yield Sentence(f"{listed(own)} act alike: only {_sum(own, parts[places])} is determined{found}.")


def _sum(names: list[str], parts: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    """``A + B - 2 C``."""
    words: list[str] = []
    for name, part in zip(names, parts.tolist(), strict=True):
        size = abs(part)
        near = round(size) if round(size) and abs(size / round(size) - 1.0) < WHOLE else None
        factor = "" if near == 1 else f"{near or f'{size:.4g}'} "
        sign = ("- " if part < 0.0 else "+ ") if words else ("-" if part < 0.0 else "")
        words.append(f"{sign}{factor}{name}")
    return " ".join(words)


def _about(value: float, error: float) -> str:
    """A number with its standard error: two digits of it."""
    places = min(12, max(0, 1 - math.floor(math.log10(error)))) if error > 0.0 else 4
    return f"{round(value, places) + 0.0:.{places}f} +- {error:.{places}f}"


def _left(result: Result) -> Iterator[Sentence]:
    before, after, most = (np.atleast_1d(result.get(f"position_{name}")) for name in ("before", "after", "after_95"))
    unit = result.unit("position_after")
    outputs = result.labels("each_output") if "each_output" in result.coords else [""]
    for k, name in enumerate(outputs):
        of = f"'{name}'" if name else "the output"
        first = f"{before[k]:.3g} -> " if math.isfinite(before[k]) else ""
        best = float(np.atleast_1d(result.get("best_fit_after"))[k])
        # An unknown frame leaves the place open, which another fit of it takes away.
        fitted = f"; {best:.3g} {unit} after the best fit of its frame" if str(result.attrs["frame"]) != "known" else ""
        yield Sentence(
            f"Error of {of} by what is unknown, rms on the path: {first}{after[k]:.3g} {unit} (95 %: {most[k]:.3g})"
            f"{fitted}."
        )


def _fit(result: Result) -> Iterator[Sentence]:
    attrs = result.attrs
    chi, free, p = (float(attrs[name]) for name in ("chi_square", "degrees_of_freedom", "p_value"))
    used = ~(result.get("left_out") | result.get("held_out"))
    kinds: dict[str, list[int]] = {}
    for k, unit in enumerate(result.labels("channel_unit")):
        kinds.setdefault(unit, []).append(k)
    parts = []
    for unit, own in kinds.items():
        after, expected = (result.get(name)[used][:, own] for name in ("residual_after", "expected"))
        parts.append(f"{_rms(after):.3g} {unit}, expected {_rms(expected):.3g} {unit}")
    said = f"Residuals {'; '.join(parts)} (chi square {chi:.4g} of {free:.0f}, p = {p:.2g})"
    status = str(result.get("status"))
    if status == "doubtful":
        why = "the file lacks something that this machine has, or readings are less exact than was said"
        yield Sentence(f"{said}: {why}.", is_alarm=True, state=NOT_SHOWN)
    elif status == "many_missed":
        why = "more than 10 % of the rows are missed by the others, and none is left out"
        yield Sentence(f"{said}: {why}.", is_alarm=True, state=NOT_SHOWN)
    elif p > 1.0 - SMALL:
        yield Sentence(f"{said}: less than expected. Was the play pressed to one side? Then name the load.")
    else:
        yield Sentence(f"{said}.")


def _rms(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def _rows(result: Result) -> Iterator[Sentence]:
    rows = np.flatnonzero(result.get("left_out")).tolist()
    lines, names = result.labels("reading"), result.labels("channel")
    units = result.labels("channel_unit")
    for row in rows[:FEW]:
        missed = result.get("residual_without")[row]
        worst = int(np.nanargmax(np.abs(missed / result.get("expected")[row])))
        away = say(float(missed[worst]), units[worst])
        text = f"Row {lines[row]} is left out: it misses what all others say, {names[worst]} by {away}."
        yield Sentence(text, is_alarm=True)
    if len(rows) > FEW:
        yield Sentence(f"{len(rows) - FEW} more rows are left out.", is_alarm=True)


def _held_out(result: Result) -> Iterator[Sentence]:
    if "held_out_chi_square" in result.attrs:
        chi, free = (float(result.attrs[f"held_out_{name}"]) for name in ("chi_square", "degrees_of_freedom"))
        held = int(result.get("held_out").sum())
        yield Sentence(f"{plural(held, 'row')} held out and predicted: chi square {chi:.4g} of {free:.0f}.")


def _beyond(result: Result) -> Iterator[Sentence]:
    names = result.labels("unknown")
    for k, key in enumerate(result.labels("unknown_key")):
        if _kind(key) == "size" and result.get("determined")[k] and result.get("estimate")[k] <= 0.0:
            most = say(ONE_SIDED * float(result.get("standard_error")[k]), result.labels("unknown_unit")[k])
            yield Sentence(f"{names[k]} is below {most} (95 %).")
    beyond = [name for name, within in zip(names, result.get("within_tolerance"), strict=True) if not within]
    if beyond:
        yield Sentence(f"Beyond the tolerance: {_some(beyond)}.")


def _some(names: list[str]) -> str:
    more = len(names) - FEW
    return listed(names) if more <= 0 else f"{', '.join(names[:FEW])} and {more} more"


def of_plan(result: Result) -> Conclusion:
    """What the planned readings leave open, beside others, and from which on more of them hardly help."""
    return Conclusion(tuple(_planned(result)))


def _planned(result: Result) -> Iterator[Sentence]:
    after, enough = result.get("position_after"), int(result.get("enough"))
    unit, count = result.unit("position_after"), len(after)
    before, evenly, all_ = (float(result.get(f"position_{name}")) for name in ("before", "evenly", "all"))
    yield Sentence(
        f"{plural(count, 'reading')} of {result.attrs['columns']} leave{'s' * (count == 1)} {after[-1]:.3g} of"
        f" {before:.3g} {unit}, the rms over the path of the position error by what is unknown."
    )
    rows = plural(int(result.attrs["rows"]), "row")
    yield Sentence(f"As many spread evenly leave {evenly:.3g} {unit}, all {rows} once {all_:.3g} {unit}.")
    if enough < count:
        yield Sentence(f"From reading {enough + 1} on each takes less than 2 % away.")


def of_diagnose(result: Result) -> Conclusion:
    """Which clearances are worn, which the readings do not distinguish, and whether the readings fit."""
    return Conclusion(tuple(_diagnosed(result)))


def _diagnosed(result: Result) -> Iterator[Sentence]:
    states, names = result.get("state"), result.labels("clearance")
    units = result.labels("group_unit")
    is_sure = str(result.get("status")) == "ok"
    if not is_sure:
        chi, free = (float(result.attrs[name]) for name in ("chi_square", "degrees_of_freedom"))
        text = f"Not shown: which joints are worn; the readings do not fit (chi square {chi:.4g} of {free:.0f})"
        yield Sentence(f"{text}: the file lacks something, or they are less exact.", is_alarm=True, state=NOT_SHOWN)
    sizes, errors, lows, highs = (
        result.get(f"group_{name}") for name in ("size", "standard_error", "lowest", "highest")
    )

    def told(row: int) -> tuple[str, str]:
        """A sum, and what is known of it."""
        parts = result.get("part")[row]
        low, high = float(lows[row]), float(highs[row])
        allowed = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        own = [names[k] for k in np.flatnonzero(parts).tolist()]
        size = f"{_about(float(sizes[row]), float(errors[row]))} {units[row]}"
        return _sum(own, parts[np.flatnonzero(parts)]), f"{size}, {allowed} by the file"

    for word in ("worn", "tight"):
        for row in np.flatnonzero(states == word).tolist():
            several = np.count_nonzero(result.get("part")[row]) > 1
            apart = "; these readings do not show which of them" if several else ""
            sum_, known = told(row)
            yield Sentence(f"{sum_} is {word}: {known}{apart}.", is_alarm=is_sure, state=MISSED * is_sure)
    for row in np.flatnonzero(states == "not exact enough").tolist():
        sum_, known = told(row)
        text = f"Not shown: whether {sum_} is worn: {known}, and twice as much would not be seen."
        yield Sentence(text, is_alarm=True, state=NOT_SHOWN)
    same = np.flatnonzero(states == "as in the file")
    if same.size and not np.isin(states, ("worn", "tight", "not exact enough")).any():
        near = float(result.attrs["coverage_factor"]) * errors[same]
        text = "Every clearance that is determined is within the file's limits."
        if not ((sizes[same] - near >= lows[same]) & (sizes[same] + near <= highs[same])).all():
            sum_, known = told(int(same[(near / np.fmax(np.abs(highs[same]), near)).argmax()]))
            text = f"No clearance that is determined is found to be worn; least is known of {sum_}: {known}."
        yield Sentence(text, state=HELD * is_sure)
    blind = [
        names[k] for row in np.flatnonzero(states == "not determined") for k in np.flatnonzero(result.get("part")[row])
    ]
    if blind:
        yield Sentence(f"Not determined: {_some(blind)}. A load elsewhere than at the output may determine it.")
    for kind, words in (("left_out", "left out: they do not fit"), ("alone", "of places that are read under one load")):
        rows = np.flatnonzero(result.get(kind))
        if rows.size:
            lines = [str(result.labels("reading")[k]) for k in rows.tolist()]
            yield Sentence(f"Rows {words}: {_some(lines)}.", is_alarm=kind == "left_out")


def of_verify(result: Result) -> Conclusion:
    """Whether the limits are accepted, with which risk, and how well the machine repeats."""
    return Conclusion((*_accepted(result), *_repeats(result)))


def _accepted(result: Result) -> Iterator[Sentence]:
    status, allowed = str(result.get("status")), float(result.attrs["risk"])
    if status == "no_limit":
        yield Sentence("No limit is set, so that nothing is accepted or rejected.")
        return
    total, used = float(result.get("total_risk")), result.get("used")
    # What was read in part may reject, and shows nothing else.
    shown = used if status == "rejected" else np.where(result.get("judged"), used, np.nan)
    visit, which = np.unravel_index(int(np.nanargmax(shown)), used.shape)
    row, name = result.labels("visit")[visit], result.labels("limited")[which]
    most = f"{name} uses {100.0 * float(used[visit, which]):.4g} % of its limit in row {row}"
    judged = result.get("judged").all(axis=1)
    where = f"all {plural(len(used), 'reading')}" if judged.all() else f"{judged.sum()} of {len(used)} readings"
    match status:
        case "accepted":
            most_risk = f"at most {percent(total)}" if total > NO_RISK else f"less than {percent(NO_RISK)}"
            text = f"Accepted: the limits hold in {where}, with a risk of {most_risk} that one is missed"
            yield Sentence(f"{text} ({percent(allowed)} is allowed); {most}.", state=HELD)
        case "rejected":
            yield Sentence(f"Rejected: {most}.", is_alarm=True, state=MISSED)
        case _:
            text = (
                f"Undecided: the risk that a limit is missed is up to {percent(total)}, {percent(allowed)} is allowed"
            )
            yield Sentence(f"{text}; {most}. More readings there decide.", is_alarm=True, state=NOT_SHOWN)
    if "not_read" in result.attrs:
        yield Sentence(f"Not judged, because it is not read: {result.attrs['not_read']}.", is_alarm=True)
    yield Sentence("It holds for the poses that were read.")


def _repeats(result: Result) -> Iterator[Sentence]:
    visits = result.get("visits")
    if "accuracy" in result.data:
        of = "" if int(visits.max()) > 1 else "; nothing is read twice, so that repeatability is not known"
        for k, point in enumerate(result.labels("point")):
            values = [result.get(name)[:, k] for name in ("accuracy", "repeatability")]
            told = [
                f"{name} {say(float(np.nanmax(own)), result.unit('accuracy'))}"
                for name, own in zip(("AP", "RP"), values, strict=True)
                if np.isfinite(own).any()
            ]
            whose = "" if point == "output" else f"{point}: "
            if "best_fit_rms" in result.data and math.isfinite(best := float(result.get("best_fit_rms")[k])):
                rms, unit = float(result.get("position_rms")[k]), result.unit("position_rms")
                text = f"{whose}position error {say(rms, unit)} rms, {say(best, unit)} after the best fit of a frame."
                yield Sentence(text[:1].upper() + text[1:] if not whose else text)
            least, most = int(visits.min()), int(visits.max())
            times = f", {least if least == most else f'{least} to {most}'} visits each" if not of else ""
            yield Sentence(f"{whose}{', '.join(told)} at most (ISO 9283{times}){of}.")
    if "reversal" in result.data:
        for k, (name, unit) in enumerate(zip(result.labels("channel"), result.labels("channel_unit"), strict=True)):
            told = [f"{letter} {say(float(result.get(what)[k]), unit)}" for letter, what in BOTH_SIDES.items()]
            yield Sentence(f"{name} from both sides: {', '.join(told)} (ISO 230-2).")
