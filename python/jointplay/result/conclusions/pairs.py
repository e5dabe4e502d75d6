"""The answer about a sweep over two things: the worst and the best pair of values, and where limits are missed."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import Result, figures, first_largest
from jointplay.result.verdict import Verdict, there, verdict

from .errors import WORDS, blamed
from .series import each, extreme, ranked, rounded_figure, summed_up
from .words import Conclusion, Sentence, plural, say


class Tops(NamedTuple):
    """The figure of every pair of values that is worst over the configurations."""

    #: ``position``, ``rotation``, or ``singular value``
    name: str
    #: what it is
    words: str
    unit: str
    #: shape (value of the second key, value of the first one); nan where none is known
    values: Array
    #: the configuration of each
    where: Array
    #: whether the smallest is the worst
    is_least: bool


def rows_of(result: Result) -> list[Result]:
    """The sweep over the first key for every value of the second one."""
    dim = str(result.attrs["sweep_by"])
    attrs = {key: value for key, value in result.attrs.items() if key != "sweep_by"}
    found = (result.isel(dim, k) for k in range(result.sizes[dim]))
    return [Result(part.coords, part.data, attrs) for part in found]


def tops(result: Result) -> list[Tops]:
    """The worst figures over the configurations."""
    found = []
    for name, declared in figures(result).items():
        values, unit = rounded_figure(result, name)
        # Of nearness to a singularity the smallest counts.
        is_least = name == "singular_value"
        sign = -1.0 if is_least else 1.0
        sizes = np.where(np.isfinite(values), sign * np.abs(values), -np.inf)
        largest = sizes.max(axis=2)
        worst = np.where(np.isfinite(largest), sign * largest, np.nan)
        found.append(Tops(name.replace("_", " "), declared.words, unit, worst, first_largest(sizes), is_least))
    return found


def judged(result: Result) -> list[list[Verdict]]:
    """The verdicts on every pair of values."""
    return [[verdict(one) for one in each(row)] for row in rows_of(result)]


def missed(result: Result) -> Array:
    """At how many configurations of every pair a limit is missed."""
    return np.array([[sum(map(bool, one.marks)) for one in row] for row in judged(result)])


def pair_in_words(result: Result, place: tuple[int, int]) -> str:
    """``radial = 0.2 mm, tolerance = 0.01 mm``: the first key first."""
    said = []
    for dim, k in ((str(result.attrs["sweep"]), place[1]), (str(result.attrs["sweep_by"]), place[0])):
        along = result.coords[dim]
        one = along.values[k]
        said.append(f"{dim} = {say(float(one), along.units) if along.values.dtype.kind in 'fiu' else one}")
    return ", ".join(said)


def of_pairs(result: Result) -> Conclusion:
    """Where the worst figure over the motion is least and largest, and at how many pairs limits are missed."""
    verdicts = [one for row in judged(result) for one in row]
    sentences = [*_limits(result, verdicts), *_bad(result)]
    severity = 0.0
    for found in tops(result):
        if not np.nan_to_num(found.values).any():
            continue
        sign = -1.0 if found.is_least else 1.0
        low, high = (_place(np.where(np.isfinite(found.values), s * found.values, np.inf)) for s in (sign, -sign))
        severity = max(severity, float(found.values[high])) if found.name == "position" else severity
        part = each(rows_of(result)[high[0]])[high[1]]
        k = int(found.where[high])
        cause = blamed(part, found.name, k) if found.name in WORDS else ""
        words = extreme(found.words)
        span = f"{say(found.values[high], found.unit)} with {pair_in_words(result, high)}"
        if say(found.values[low]) != say(found.values[high]):
            span = f"{say(found.values[low], found.unit)} with {pair_in_words(result, low)}; {span}"
        sentences.append(Sentence(f"{words[0].upper()}{words[1:]}: {span}{there(part, k)}{cause}."))
    used = max((one.used for one in verdicts), default=0.0)
    return Conclusion(tuple(sentences), (*ranked(sentences), used, severity))


def _place(values: Array) -> tuple[int, int]:
    row, column = np.unravel_index(int(values.argmin()), values.shape)
    return int(row), int(column)


def _limits(result: Result, found: list[Verdict]) -> Iterator[Sentence]:
    if any(outcomes := [one.outcome for one in found]):
        yield summed_up(result, outcomes, f"{plural(len(found), 'pair')} of values", found[0].basis)


def _bad(result: Result) -> Iterator[Sentence]:
    status = result.get("status")
    bad = int((status != "ok").sum())
    if bad:
        total = plural(status.size, "configuration")
        yield Sentence(f"Not ok are {bad} of {total} at all pairs together.", is_alarm=True)
