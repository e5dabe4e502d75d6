"""The answers about many mechanisms or places: `sweep`, `compare` and `map`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from jointplay.result import (
    Array,
    Result,
    first_largest,
    in_words,
    largest,
    parts_by_cause,
    quantities,
    quantity,
    split,
)
from jointplay.verdict import verdict

from .errors import WORDS, blamed, figure, figures, proved
from .words import OUTSIDE, READABLE, Conclusion, Sentence, at, farthest, leaving, plural, say

Nodes = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


def beyond(result: Result) -> list[tuple[str, ...]]:
    """For every mechanism of a comparison, or value of a sweep, what each configuration misses."""
    return [verdict(part).marks for part in each(result)]


def each(result: Result) -> list[Result]:
    """The results of every mechanism of a comparison, or of every value of a sweep."""
    dim = "mechanism" if "mechanism" in result.sizes else str(result.attrs["sweep"])
    attrs = {key: value for key, value in result.attrs.items() if key != "sweep"}
    found = (result.isel(dim, k) for k in range(result.sizes[dim]))
    return [Result(part.coords, part.data, attrs) for part in found]


def of_sweep(result: Result) -> Conclusion:
    """Where the largest error over the motion is least and largest, and at which values limits are missed."""
    dim, question = str(result.attrs["sweep"]), str(result.attrs["question"])
    along = result.coords[dim]

    def value(k: int) -> str:
        one = along.values[k]
        return f"{dim} = {say(float(one), along.units) if along.values.dtype.kind in 'fiu' else one}"

    sentences = [*_missed_values(result, value), *_bad(result)]
    severity = 0.0
    for name, which, words in figures(question):
        values, unit = figure(result, name, which)
        sizes = np.abs(values)
        # Of nearness to a singularity the smallest counts.
        sign = -1.0 if name == "singular_value" else 1.0
        worst = np.where(np.isfinite(sizes), sign * sizes, -np.inf)
        tops, known = sign * worst.max(axis=1), np.isfinite(worst).any(axis=1)
        if not known.any() or not tops[known].any():
            continue
        low, high = (int(np.where(known, part, np.inf).argmin()) for part in (sign * tops, -sign * tops))
        severity = max(severity, float(sign * tops[high])) if "position" in words else severity
        k = int(first_largest(worst[high]))
        part = each(result)[high]
        kind = "position" if "position" in words else "rotation"
        cause = blamed(part, kind, k) if question != "solve" else ""
        words = words if words.startswith(("largest", "smallest")) else f"largest {words}"
        span = f"{say(tops[high], unit)} with {value(high)}"
        if say(tops[low]) != say(tops[high]):
            span = f"{say(tops[low], unit)} with {value(low)}, {span}"
        sentences.append(Sentence(f"{words[0].upper()}{words[1:]}: {span}{at(part, k)}{cause}."))
    return Conclusion(tuple(sentences), (float(any(sentence.is_alarm for sentence in sentences)), severity))


def _missed_values(result: Result, value: Callable[[int], str]) -> Iterator[Sentence]:
    marks = beyond(result)
    if not any(marks):
        return
    bad = [k for k, mark in enumerate(marks) if any(mark)]
    if not bad:
        yield Sentence(f"Limits hold at all {len(marks)} values.")
        return
    text = f"Limits are missed at {len(bad)} of {plural(len(marks), 'value')}, first at {value(bad[0])}."
    yield Sentence(text, is_alarm=True)


def _bad(result: Result) -> Iterator[Sentence]:
    bad = int((result.get("status") != "ok").sum())
    if bad:
        status = result.get("status")
        total, outside = plural(status.size, "configuration"), int((status == OUTSIDE).sum())
        told = f", {outside} of them outside limits ({leaving(result)})" if outside else ""
        yield Sentence(f"Not ok are {bad} of {total} at all values together{told}.", True, is_first=outside > 0)


def of_compare(result: Result) -> Conclusion:
    """How the errors of the second mechanism compare with those of the first."""
    names, question = result.labels("mechanism"), str(result.attrs["question"])
    two = each(result)
    sentences = []
    marks = beyond(result)
    for name, missed in zip(names, marks, strict=True):
        if any(missed):
            count = sum(map(bool, missed))
            text = f"Limit missed: {name}, at {count} of {plural(len(missed), 'configuration')}."
            sentences.append(Sentence(text, is_alarm=True))
    for name, which, words in figures(question):
        values, unit = figure(result, name, which)
        kind = "position" if "position" in words else "rotation"
        known = np.isfinite(values)
        if not known.any(axis=1).all() or not np.nan_to_num(values).any():
            continue
        tops = []
        for one, row, part in zip(names, values, two, strict=True):
            k = farthest(row, part.get("status"))
            if k is None:
                continue
            tops.append(f"{one} {say(float(row[k]), unit)}{at(part, k)}{blamed(part, kind, k).replace('; ', ', ', 1)}")
        if tops:
            sentences.append(Sentence(f"Largest {WORDS[kind]}: {'; '.join(tops)}."))
    for name, part in zip(names, two, strict=True):
        bad = part.get("status") != "ok"
        if bad.any():
            words = ", ".join(dict.fromkeys(s.replace("_", " ") for s in part.get("status")[bad].tolist()))
            outside = bool((part.get("status") == OUTSIDE).any())
            words = f"{words}; {leaving(part)}" if outside else words
            text = f"Not ok in {name}: {int(bad.sum())} of {plural(len(bad), 'configuration')} ({words})."
            sentences.append(Sentence(text, is_alarm=True, is_first=outside))
    return Conclusion(tuple(sentences))


def of_map(result: Result) -> Conclusion:
    """The largest error over the nodes, where, what is to blame, and how many nodes miss a limit or are not ok."""
    good = np.isin(result.get("status"), READABLE)
    sizes = list(_over_nodes(result, good)) if good.any() else []
    return Conclusion(
        (*_beyond_nodes(result, good), *sizes[:1], *_not_ok_nodes(result), *sizes[1:], *proved(result, "node"))
    )


def _over_nodes(result: Result, good: Nodes) -> Iterator[Sentence]:
    """The worst value of every quantity, and where it is."""
    axes = str(result.attrs["grid"]).split(", ")
    for name in quantities(str(result.attrs["question"])):
        variable = quantity(result, name)
        sign = -1.0 if name == "singular_value" else 1.0
        bad = np.where(good, sign * variable.values, -np.inf)
        node = np.unravel_index(int(np.argmax(bad)), bad.shape)
        if not np.isfinite(bad[node]) or variable.values[node] == 0.0:
            continue
        where = ", ".join(
            f"{axis} = {say(float(result.coords[axis].values[k]), result.coords[axis].units)}"
            for axis, k in zip(axes, node, strict=True)
        )
        # Some names say already that it is the smallest or the largest one.
        is_extreme = name == "singular_value" or variable.long_name.startswith("largest")
        head = variable.long_name if is_extreme else f"largest {variable.long_name}"
        text = f"{head[0].upper()}{head[1:]}: {say(float(variable.values[node]), variable.units)} at {where}"
        yield Sentence(f"{text}{_blamed_over_nodes(result, good, name)}.")


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


def _beyond_nodes(result: Result, good: Nodes) -> Iterator[Sentence]:
    if "limit_met" not in result.data or not np.isfinite(result.get("limit")).any():
        return
    missed = ~result.get("limit_met").astype(bool) & good[..., None]
    count, total = int(missed.any(axis=-1).sum()), int(good.sum())
    if count:
        yield Sentence(f"Limits are missed at {count} of the {total} nodes with a pose.", is_alarm=True)
    else:
        yield Sentence(f"Limits hold at all {total} nodes with a pose.")


def _blamed_over_nodes(result: Result, good: Nodes, name: str) -> str:
    if "contribution" not in result.data:
        return ""
    causes, found = shares_over_nodes(result, good)
    if name not in found or not found[name].sum() > 0.0:
        return ""
    shares = found[name] / found[name].sum()
    top = largest(causes, shares)
    return f"; to blame, over all nodes: {in_words(*top)}" if top is not None else ""


def shares_over_nodes(result: Result, good: Nodes) -> tuple[tuple[str, ...], dict[str, Array]]:
    """The causes, and what each adds to the first-order error, summed over the nodes: (cause)."""
    if "extreme" in result.data["contribution"].dims:
        extremes = {which: result.get("contribution", extreme=which)[good] for which in ("position", "rotation")}
        return tuple(result.labels("source")), {which: parts.sum(axis=0) for which, parts in extremes.items()}
    causes, values = parts_by_cause(result)
    values = values[good]
    # Of an error, its part along the whole: the squares add up. A variance adds up as it is.
    along = values if result.attrs["question"] == "random" else values * values.sum(axis=1, keepdims=True)
    components = result.labels("component")
    moves = np.isin(components, split(components)[0])
    sums = along.sum(axis=0)
    return causes, {"position": sums[:, moves].sum(axis=1), "rotation": sums[:, ~moves].sum(axis=1)}
