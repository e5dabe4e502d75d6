"""The answers about many mechanisms or places: `sweep`, `compare` and `map`."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from jointplay.basics.arrays import Array, Flags
from jointplay.result import (
    FORCES_JUDGED,
    HIGHER,
    SIZES,
    Result,
    figure,
    figures,
    first_largest,
    in_words,
    judged_alone,
    largest,
    parts_by_cause,
    quantity,
    rounding,
    split,
    untold_part,
)
from jointplay.result.verdict import (
    HELD,
    LOOSE,
    MISSED,
    NOT_SHOWN,
    RANK,
    READABLE,
    Verdict,
    of_nodes,
    percent,
    there,
    verdict,
    worst_of,
)
from jointplay.result.verdict.shares import CONTACTS

from .errors import WORDS, blamed, proved
from .motion import largest_change
from .running import of_speeds
from .words import OUTSIDE, Conclusion, Sentence, farthest, leaving, off_path, plural, say, strung, without_path


def judged(result: Result) -> list[Verdict]:
    """The verdicts on every mechanism of a comparison, or value of a sweep."""
    return [verdict(part) for part in each(result)]


def beyond(result: Result) -> list[tuple[str, ...]]:
    """For every mechanism of a comparison, or value of a sweep, what each configuration misses."""
    return [found.marks for found in judged(result)]


def each(result: Result) -> list[Result]:
    """The results of every mechanism of a comparison, or of every value of a sweep."""
    dim = "mechanism" if "mechanism" in result.sizes else str(result.attrs["sweep"])
    # Of a sweep that was interrupted every value that is there is finished.
    attrs = {key: value for key, value in result.attrs.items() if key not in ("sweep", "incomplete")}
    found = (result.isel(dim, k) for k in range(result.sizes[dim]))
    return [judged_alone(Result(part.coords, part.data, attrs)) for part in found]


def of_sweep(result: Result) -> Conclusion:
    """Where the largest error over the motion is least and largest, and at which values limits are missed."""
    dim = str(result.attrs["sweep"])
    along = result.coords[dim]
    key = name_of(result, dim)

    def value(k: int) -> str:
        one = along.values[k]
        return f"{key} = {say(float(one), along.units) if along.values.dtype.kind in 'fiu' else one}"

    verdicts = judged(result)
    sentences = [*_missed_values(result, verdicts, value), *_bad(result)]
    severity = 0.0
    for name, declared in figures(result).items():
        values, unit = rounded_figure(result, name)
        alone = np.abs(values)
        sizes = _farthest_open(result, name, alone)
        # Of nearness to a singularity the smallest counts.
        sign = -1.0 if name == "singular_value" else 1.0
        worst = np.where(np.isfinite(sizes), sign * sizes, -np.inf)
        tops, known = sign * worst.max(axis=1), np.isfinite(worst).any(axis=1)
        if not known.any() or not tops[known].any():
            continue
        low, high = (int(np.where(known, part, np.inf).argmin()) for part in (sign * tops, -sign * tops))
        severity = max(severity, float(sign * tops[high])) if name == "position" else severity
        k = int(first_largest(worst[high]))
        part = each(result)[high]
        cause = blamed(part, name, k) if name in WORDS else ""
        words = extreme(declared.words)
        if any(say(sizes[n].max()) != say(alone[n].max()) for n in (low, high)):
            words = f"{words} with what the load leaves open"
        span, where = f"{say(tops[high], unit)} with {value(high)}", there(part, k)
        if known.all() and tops.size > 1 and np.ptp(tops) <= rounding(result, unit):
            span = f"{say(tops[high], unit)} whatever {key} is{',' * bool(where)}"
        elif say(tops[low]) != say(tops[high]):
            span = f"{say(tops[low], unit)} with {value(low)}, {span}"
        sentences.append(Sentence(f"{words[0].upper()}{words[1:]}: {span}{where}{cause}."))
    used = max((one.used for one in verdicts), default=0.0)
    return Conclusion(tuple(sentences), (*ranked(sentences), used, severity))


def name_of(result: Result, dim: str) -> str:
    """What is swept, as it was asked for; only its last part where that says it."""
    key = result.coords[dim].long_name or dim
    return dim if key.rpartition(".")[2] == dim else key


def rounded_figure(result: Result, name: str) -> tuple[Array, str]:
    """The values of a quantity, with zeros for what is rounding, and their unit."""
    values, unit = figure(result, name)
    return (np.where(np.abs(values) <= rounding(result, unit), 0.0, values) if name in WORDS else values), unit


def extreme(words: str) -> str:
    """Some names say already that it is the smallest or the largest one."""
    return words if words.startswith(("largest", "smallest")) else f"largest {words}"


def ranked(sentences: Sequence[Sentence]) -> tuple[float, float]:
    """How bad the verdict among some sentences is, and whether any of them is an alarm."""
    worst = max((RANK[sentence.state] for sentence in sentences), default=0)
    return float(worst), float(any(sentence.is_alarm for sentence in sentences))


def _missed_values(result: Result, found: Sequence[Verdict], value: Callable[[int], str]) -> Iterator[Sentence]:
    def first(k: int) -> str:
        return f"{value(k)} ({found[k].gist})" if found[k].outcome == NOT_SHOWN else value(k)

    if any(outcomes := [one.outcome for one in found]):
        yield summed_up(result, outcomes, plural(len(outcomes), "value"), found[0].basis, first)
    else:
        yield from _loose(result, value)


def _loose(result: Result, value: Callable[[int], str]) -> Iterator[Sentence]:
    """At which values contact may be lost."""
    if "contact" not in result.data:
        return
    places = np.flatnonzero(np.isin(result.get("contact"), LOOSE).any(axis=(1, 2)))
    if places.size:
        total = plural(len(result.get("contact")), "value")
        yield Sentence(f"Contact may be lost at {places.size} of {total}, first at {value(int(places[0]))}.", True)


def summed_up(
    result: Result, outcomes: Sequence[str], total: str, basis: str, value: Callable[[int], str] | None = None
) -> Sentence:
    """At how many values, pairs or nodes limits hold, are missed, or are not shown to hold.

    Parameters
    ----------
    total : str
        How many there are, and what.
    basis : str
        What the verdicts rest on.
    value : callable, optional
        Which one it is, by its number.
    """
    rest = "; the rest is not computed" if {"sweep", "incomplete"} <= result.attrs.keys() else ""
    end = f"{',' * bool(basis)}{basis}{rest}."
    bad, unknown = ([k for k, one in enumerate(outcomes) if one == which] for which in (MISSED, NOT_SHOWN))
    noun, verb, holds = _of_limits(result)
    first = f", first at {value((bad or unknown)[0])}" if value is not None and (bad or unknown) else ""
    if bad:
        rest = f"; not shown at {len(unknown)}" if unknown else ""
        return Sentence(f"{noun} {verb} missed at {len(bad)} of {total}{first}{rest}{end}", True, True, state=MISSED)
    if unknown:
        others = len(outcomes) - len(unknown)
        rest = f"; {'it' if verb == 'is' else 'they'} {holds} at the others" if others else ""
        whether = f"whether {noun[:1].lower()}{noun[1:]} {holds}"
        text = f"Not shown: {whether} at {len(unknown)} of {total}{first}{rest}{end}"
        return Sentence(text, True, True, state=NOT_SHOWN)
    every = f"all {total.removeprefix('the ')}" if len(outcomes) > 1 else total
    return Sentence(f"{noun} {holds} at {every}{end}", is_answer=True, state=HELD)


def _of_limits(result: Result) -> tuple[str, str, str]:
    """What is kept to, with its verbs."""
    if "tolerance" in result.data:
        return "The tolerance of the target", "is", "holds"
    if result.attrs["question"] != "random":
        return "Limits", "are", "hold"
    share = result.attrs.get("required_yield")
    of = f" of {percent(float(share))}" if share is not None else ""
    return f"The required yield{of}", "is", "is met"


def _bad(result: Result) -> Iterator[Sentence]:
    bad = int((result.get("status") != "ok").sum())
    if bad:
        status = result.get("status")
        total, outside = plural(status.size, "configuration"), int((status == OUTSIDE).sum())
        told = f", {outside} of them outside limits ({leaving(result)})" if outside else ""
        yield Sentence(f"Not ok are {bad} of {total} at all values together{told}.", True, is_first=outside > 0)


def of_compare(result: Result) -> Conclusion:
    """Which of the mechanisms keep to the limits, which has the least of every largest error, and by how much."""
    names, is_corrected = result.labels("mechanism"), "correction" in result.data
    every = each(result)
    sentences = []
    verdicts = judged(result)
    held = [name for name, found in zip(names, verdicts, strict=True) if found.outcome == HELD]
    if held:
        whole = "both" if len(names) == 2 else f"all {len(names)}"
        where = whole if len(held) == len(names) else strung(held)
        none = [name for name, found in zip(names, verdicts, strict=True) if not found.outcome]
        rest = f"; {strung(none)} {'has' if len(none) == 1 else 'have'} none" if none else ""
        forces = result.get(FORCES_JUDGED).tolist() if FORCES_JUDGED in result.data else []
        state = worst_of([HELD, *forces])
        bad = {
            how: strung([name for name, one in zip(names, forces, strict=True) if one == what])
            for what, how in ((MISSED, "are missed"), (NOT_SHOWN, "are not shown to hold"))
            if what in forces
        }
        others = f"; those of forces {' and '.join(f'{how} in {those}' for how, those in bad.items())}" if bad else ""
        basis = verdicts[names.index(held[0])].basis
        text = f"Limits{' of errors' * bool(bad)} hold in {where}{basis}{rest}{others}."
        sentences.append(Sentence(text, is_alarm=bool(bad), state=state))
    for name, found in zip(names, verdicts, strict=True):
        count, total = sum(map(bool, found.marks)), plural(len(found.marks), "configuration")
        if found.outcome == MISSED:
            text = f"Limit missed: {name}, at {count} of {total}."
            sentences.append(Sentence(text, is_alarm=True, state=MISSED))
    unknown: dict[str, list[str]] = {}
    for name, found in zip(names, verdicts, strict=True):
        if found.outcome == NOT_SHOWN:
            unknown.setdefault(found.gist, []).append(name)
    for gist, those in unknown.items():
        text = f"Not shown: whether limits hold in {strung(those)}; {gist}."
        sentences.append(Sentence(text, is_alarm=True, state=NOT_SHOWN))
    sentences += _best(result)
    for kind, declared in figures(result).items():
        values, unit = rounded_figure(result, kind)
        known = np.isfinite(values)
        if not known.any(axis=1).all() or not np.nan_to_num(values).any():
            continue
        tops = []
        for one, row, part in zip(names, values, every, strict=True):
            k = farthest(row, part.get("status"))
            if k is None:
                continue
            tops.append(
                f"{one} {say(float(row[k]), unit)}{there(part, k)}{blamed(part, kind, k).replace('; ', ', ', 1)}"
            )
        if tops:
            said = declared.words if is_corrected else WORDS[kind]
            sentences.append(Sentence(f"Largest {said}: {'; '.join(tops)}."))
    for name, part in zip(names, every, strict=True) if is_corrected else ():
        sentences.append(Sentence(f"Largest change in {name}{largest_change(part)}."))
    for name, part, lost in zip(names, every, without_path(result), strict=True):
        bad = part.get("status") != "ok"
        if bad.any():
            told = np.where(lost, f"{names[0]} has no pose there", part.get("status"))[bad]
            words = ", ".join(dict.fromkeys(s.replace("_", " ") for s in told.tolist()))
            outside = bool((part.get("status") == OUTSIDE).any())
            words = f"{words}; {leaving(part)}" if outside else words
            text = f"Not ok in {name}: {int(bad.sum())} of {plural(len(bad), 'configuration')} ({words})."
            sentences.append(Sentence(text, is_alarm=True, is_first=outside))
    return Conclusion(tuple(sentences), ranked(sentences))


def _best(result: Result) -> Iterator[Sentence]:
    """Which mechanism has the least of every largest error, of those that have one at every configuration."""
    names, lost = result.labels("mechanism"), without_path(result)
    is_whole = np.asarray((np.isin(result.get("status"), READABLE) | lost).all(axis=1))
    won: dict[str, list[str]] = {}
    for kind, declared in figures(result).items():
        values, unit = rounded_figure(result, kind)
        ranked_ = [k for k in np.flatnonzero(is_whole).tolist() if np.isfinite(values[k, ~lost[-1]]).all()]
        far = _farthest_open(result, kind, np.abs(values))
        tops, alone = (
            {names[k]: float(part[k, ~lost[-1]].max(initial=0.0)) for k in ranked_} for part in (far, np.abs(values))
        )
        least = sorted(tops, key=tops.__getitem__)[:2]
        if len(least) < 2 or say(tops[least[0]]) == say(tops[least[1]]):
            continue
        first, second = (tops[name] for name in least)
        said = declared.words if "correction" in result.data else WORDS[kind]
        if any(say(tops[name]) != say(alone[name]) for name in least):
            said = f"{said}, with what the load leaves open,"
        text = f"largest {said} {say(first, unit)}, {100.0 * (1.0 - first / second):.3g} % below {least[1]}"
        won.setdefault(least[0], []).append(text)
    if won:
        off = {name: off_path(result, name) for name in won}
        told = "; ".join(
            f"{name}{f', which {off[name]},' * bool(off[name])} is best: {'; '.join(found)}"
            for name, found in won.items()
        )
        out = [name for name, is_ranked in zip(names, is_whole.tolist(), strict=True) if not is_ranked]
        rest = f"; not ranked: {strung(out)}, which is not ok everywhere" if out else ""
        yield Sentence(f"{told}{rest}.")


def _farthest_open(result: Result, kind: str, values: Array) -> Array:
    """Sizes with what a load leaves open of them: in the middle of it nothing holds the machine."""
    source = figures(result)[kind].variable
    half = {"error": "undetermined", "residual": "residual_undetermined"}.get(source, "")
    if half not in result.data:
        return values
    chosen = split(result.labels("component"))[kind == "rotation"]
    parts = [[np.abs(result.get(name, component=one)) for one in chosen] for name in (source, half)]
    far = np.linalg.norm(np.array(parts[0]) + np.nan_to_num(parts[1]), axis=0)
    return np.asarray(np.maximum(values, far))


def of_map(result: Result) -> Conclusion:
    """The largest error over the nodes, where, what is to blame, and how many nodes miss a limit or are not ok."""
    good = np.isin(result.get("status"), READABLE)
    sizes = list(_over_nodes(result, good)) if good.any() else []
    judged = list(_beyond_nodes(result))
    shares = [] if judged else _outside_nodes(result, good)
    speeds = of_speeds(result)
    sentences = (*judged, *shares, *sizes[:1], *_not_ok_nodes(result), *sizes[1:], *proved(result, "node"), *speeds)
    severity = [float(RANK[sentence.state]) for sentence in judged]
    return Conclusion(sentences, (*severity, _used_over_nodes(result, good)) if judged else ())


def _used_over_nodes(result: Result, good: Flags) -> float:
    """The largest used part of a limit, of two limits as a part of the farther one, or share of specimens outside."""
    if "margin" in result.data and "used" not in result.data:
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = 1.0 - result.get("margin") / np.fmax(*np.abs(result.get("limit").T))
        parts = np.fmax.reduce(parts, axis=-1)
    else:
        name = next((one for one in ("used", "outside", "structural_error") if one in result.data), None)
        parts = result.get(name) if name else np.zeros(good.shape)
    return float(np.max(parts, where=good & ~np.isnan(parts), initial=0.0))


def _over_nodes(result: Result, good: Flags) -> Iterator[Sentence]:
    """The worst value of every quantity, and where it is."""
    for name in figures(result):
        variable = quantity(result, name)
        sign = -1.0 if name == "singular_value" else 1.0
        bad = np.where(good, sign * variable.values, -np.inf)
        node = np.unravel_index(int(np.argmax(bad)), bad.shape)
        if not np.isfinite(bad[node]) or variable.values[node] == 0.0:
            continue
        if name in WORDS and variable.values[node] <= rounding(result, variable.units):
            continue
        where = _node(result, node)
        head = variable.long_name if sign < 0.0 else extreme(variable.long_name)
        text = f"{head[0].upper()}{head[1:]}: {say(float(variable.values[node]), variable.units)} at {where}"
        yield Sentence(f"{text}{_blamed_over_nodes(result, good, name)}.")


def _node(result: Result, node: Sequence[np.intp]) -> str:
    """``q1 = 20 deg, q2 = 5 mm``."""
    axes = str(result.attrs["grid"]).split(", ")
    at = zip(axes, node, strict=True)
    return ", ".join(
        f"{axis} = {say(float(result.coords[axis].values[k]), result.coords[axis].units)}" for axis, k in at
    )


def _outside_nodes(result: Result, good: Flags) -> Iterator[Sentence]:
    """The largest share of the specimens outside, where no yield is required."""
    own = CONTACTS.get(str(result.attrs.get("contact", "")), "")
    for name, words in (("outside", own), ("outside_loaded", CONTACTS["loaded"])):
        known = good & np.isfinite(result.get(name)) if name in result.data else np.zeros(1, dtype=bool)
        if not known.any():
            continue
        share, low, high = (np.where(known, result.get(f"{name}{end}"), -1.0) for end in ("", "_low", "_high"))
        node = np.unravel_index(int(np.argmax(share)), share.shape)
        where = f" at {_node(result, node)}" if share[node] > 0.0 else ""
        most, least = percent(float(high[node])), percent(float(low[node]))
        text = f"Outside the limits{words}: at most {percent(float(share[node]))} of the specimens{where}"
        yield Sentence(f"{text}; between {least} and {most} with 95 % confidence.")


def _not_ok_nodes(result: Result) -> Iterator[Sentence]:
    status = result.get("status")
    if (status == "ok").all():
        return
    names, counts = np.unique(status[status != "ok"], return_counts=True)
    words = {name: str(name).replace("_", " ") or "not computed" for name in names.tolist()}
    if OUTSIDE in words:
        words[OUTSIDE] = f"outside limits ({leaving(result)})"
    told = ", ".join(f"{count} {word}" for word, count in zip(words.values(), counts, strict=True))
    yield Sentence(f"Not ok of {status.size} nodes: {told}.", is_alarm=True, is_first=OUTSIDE in words)


def _beyond_nodes(result: Result) -> Iterator[Sentence]:
    """The verdict over the nodes that have a pose."""
    found = of_nodes(result)
    if found is None:
        return
    outcomes, basis = found
    known = outcomes[outcomes != ""].tolist()
    if known:
        yield summed_up(result, known, f"the {plural(len(known), 'node')} with a pose", basis)
    else:
        text = "Not shown: whether limits hold; the machine can be at none of the nodes."
        yield Sentence(text, is_alarm=True, is_answer=True, state=NOT_SHOWN)


def _blamed_over_nodes(result: Result, good: Flags, name: str) -> str:
    if "contribution" not in result.data or name not in WORDS:
        return ""
    causes, found = shares_over_nodes(result, good)
    if name not in found or not found[name].sum() > 0.0:
        return ""
    shares = found[name] / found[name].sum()
    top = largest(causes, shares)
    return f"; to blame, over all nodes: {in_words(*top)}" if top is not None else ""


def shares_over_nodes(result: Result, good: Flags) -> tuple[tuple[str, ...], dict[str, Array]]:
    """The causes, and what each adds to the first-order error, summed over the nodes: (cause)."""
    if "extreme" in result.data["contribution"].dims:
        causes = tuple(result.labels("source"))
        found = {which: result.get("contribution", extreme=which)[good].sum(axis=0) for which in SIZES}
    else:
        causes, values = parts_by_cause(result)
        values = values[good]
        # Of an error, its part along the whole: the squares add up. A variance adds up as it is.
        along = values if result.attrs["question"] == "random" else values * values.sum(axis=1, keepdims=True)
        components = result.labels("component")
        moves = np.isin(components, split(components)[0])
        sums = along.sum(axis=0)
        found = {"position": sums[:, moves].sum(axis=1), "rotation": sums[:, ~moves].sum(axis=1)}
    untold = {which: untold_part(result, which)[1][good].sum() for which in SIZES}
    if not any(untold.values()):
        return causes, found
    return (*causes, HIGHER), {which: np.append(parts, untold[which]) for which, parts in found.items()}
