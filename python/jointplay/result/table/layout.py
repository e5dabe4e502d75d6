"""Columns of numbers that are easy to compare: as many decimals as the column needs, the same in every row."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jointplay.errors import listed, one_line
from jointplay.result.conclusions import MOST_NAMES, Sentence

#: significant digits of the largest number of a column
DIGITS = 4
MOST_DECIMALS = 12
#: times the median from which a number does not decide the decimals of its column
OUTLIER = 1e4
#: what stands for a number that there is none of
NOTHING = "–"


@dataclass(frozen=True)
class Column:
    """One column."""

    #: `name`, `unit`: lines of its header
    name: str
    unit: str
    #: one per row
    cells: tuple[str, ...]
    #: text, aligned to the left
    left: bool = False
    #: how readily it is left out where there is no room for all columns; 0: never
    spare: int = 0
    #: whether it says which row it is
    is_key: bool = False
    #: rows whose cell says that something is not ok
    alarms: tuple[int, ...] = ()
    #: what one must know to read it
    legend: str = ""

    def __post_init__(self) -> None:
        # Names come from files; the class is frozen.
        vars(self).update(
            name="\n".join(map(one_line, self.name.split("\n"))),
            unit=one_line(self.unit),
            cells=tuple(map(one_line, self.cells)),
        )

    @property
    def width(self) -> int:
        """Characters that the column needs."""
        return max(len(text) for text in (*self.name.split("\n"), self.unit, *self.cells))


@dataclass(frozen=True)
class ResultTable:
    """A table with what it is, what follows from it, and what one must know to read it."""

    title: str
    columns: tuple[Column, ...]
    #: below the columns
    notes: tuple[str, ...] = field(default=())
    #: the answer, above the columns
    lead: tuple[Sentence, ...] = field(default=())
    #: the rows to show where there are too many for a screen; the first ones if left out
    rows: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        vars(self).update(title=one_line(self.title), notes=tuple(map(one_line, self.notes)))


def some(names: Sequence[str]) -> str:
    """Names in a sentence; of many the first and how many more there are."""
    more = len(names) - MOST_NAMES
    return listed(names) if more <= 0 else f"{', '.join(names[:MOST_NAMES])} and {more} more"


def decimals(values: Sequence[float] | np.ndarray[Any, Any], digits: int = DIGITS) -> int:
    """Decimals that give the largest of the values this many significant digits.

    Examples
    --------
    >>> decimals([0.0123, 2.5])
    3
    >>> decimals([1234.5])
    0
    """
    sizes = np.abs(np.asarray(values, dtype=float))
    sizes = sizes[np.isfinite(sizes)]
    largest = float(sizes.max(initial=0.0))
    if largest == 0.0:
        return 0
    return min(MOST_DECIMALS, max(0, digits - 1 - math.floor(math.log10(largest))))


def sentence(text: str) -> str:
    """A sentence of words; names in it keep their case."""
    return f"{text[:1].upper()}{text[1:]}."


def fixed(value: float, places: int) -> str:
    """A number with fixed decimals; no negative zero."""
    if not math.isfinite(value):
        return NOTHING
    text = f"{value:.{places}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def change(before: float, after: float) -> str:
    """By how much a number has changed, in per cent.

    Examples
    --------
    >>> change(0.2, 0.15), change(0.2, 0.2 + 1e-15)
    ('-25 %', '0 %')
    """
    part = 100.0 * (after / before - 1.0)
    return "0 %" if abs(part) < 0.5 * 10.0**-DIGITS else f"{part:+.3g} %"


def numbers(name: str, unit: str, values: Any, noise: float = 0.0, digits: int = DIGITS) -> Column:
    """A column of numbers; sizes below `noise` are rounding and shown as zero."""
    array = np.asarray(values, dtype=float)
    array = np.where(np.abs(array) <= noise, 0.0, array)
    # What a singular configuration blows up does not take the digits of all the others.
    sizes = np.abs(array[np.isfinite(array) & (array != 0.0)])
    # `numpy.median` imports `numpy.ma`, which takes longer than all tables.
    typical = sizes[sizes <= OUTLIER * statistics.median(sizes.tolist())] if sizes.size else sizes
    places = decimals(typical, digits)
    return Column(name, unit, tuple(fixed(float(v), places) for v in array))


def commands(name: str, unit: str, values: Any) -> Column:
    """A column of values that somebody chose: as short as they are, with at most six digits."""
    array = np.asarray(values, dtype=float)
    most = decimals(array, 6)
    rounded = [fixed(float(v), most) for v in array]
    needed = max((len(text.rstrip("0").partition(".")[2]) for text in rounded if text != NOTHING), default=0)
    return Column(name, unit, tuple(fixed(float(v), min(most, needed)) for v in array))


def words(name: str, cells: Sequence[str], *, is_key: bool = False) -> Column:
    """A column of text."""
    return Column(name, "", tuple(cells), left=True, is_key=is_key)


def statuses(name: str, status: Sequence[str]) -> Column:
    """A column of outcomes; what is not ok stands out."""
    alarms = tuple(k for k, outcome in enumerate(status) if outcome != "ok")
    return replace(words(name, [outcome.replace("_", " ") for outcome in status]), alarms=alarms)


def missed(name: str, marks: Sequence[str]) -> Column:
    """A column of what is beyond a limit, which stands out."""
    alarms = tuple(k for k, mark in enumerate(marks) if mark)
    return replace(words(name, [mark or NOTHING for mark in marks]), alarms=alarms)


def in_one_unit(columns: Sequence[Column], units: Sequence[str]) -> list[Column]:
    """Columns of one unit have it in their heading; of several ones there is a column of units in front of them."""
    if len(set(units)) == 1:
        return [replace(column, unit=units[0]) for column in columns]
    return [words("unit", units), *columns]
