"""What is decided: every source that has a cost, its choices or its range, and how the file says each of them.

`[costs.SOURCE]` names a source as results do, with `*` for any part of a name; a source that is named itself has that
cost, whatever patterns match it. Copies of a pattern of the mechanism are sources of their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from itertools import pairwise
from typing import Any

from jointplay.core.sets import PLAY, furthest
from jointplay.errors import InputError, not_known
from jointplay.file.schema import Choice, Cost
from jointplay.model.gaps import travel
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings

#: share of its largest size that stands for a choice of size zero where directions are looked for
TINY = 1e-6
#: significant digits of a size that can be ordered, and how many further decimals what follows from it has
DIGITS, MORE = 3, 1
#: digits of a double
ALL = 17
#: relative rounding of a number
NOISE = 1e-12


@dataclass(frozen=True)
class Item:
    """A source with a cost."""

    #: the source in the file
    sizing: Sizing
    #: where its cost is in the file
    key: str
    cost: Cost
    #: its choices as the file has them; of a formula both ends of its range
    options: tuple[Option, ...]
    #: significant digits of a size by formula that can be ordered
    digits: int = DIGITS

    @property
    def name(self) -> str:
        """The source, as results name it."""
        return self.sizing.name

    @property
    def is_formula(self) -> bool:
        """Whether its size is any number of a range."""
        return self.cost.model is not None

    def changes(self, value: float) -> dict[str, object]:
        """What gives it a size, or one of its choices by number, in the file; nothing where the file has that."""
        if value == self.before:
            return {}
        if not self.is_formula:
            return dict(self.options[round(value)].changes)
        made = self.sizing.resized(value)
        return tidy(made, value, self.digits) if self.ordered(value) == value else made

    def probe(self, value: float) -> dict[str, object]:
        """The same, with a tiny size in place of zero."""
        if self.is_formula or self.options[round(value)].size > 0.0:
            return self.changes(value)
        return self.sizing.resized(TINY * max(option.size for option in self.options))

    def ordered(self, value: float) -> float:
        """The largest size that can be ordered and is not larger: rounded down, at least the smallest of the range.

        Choices can be ordered as they are, and so can the size that the file has.
        """
        if not self.is_formula or value == self.before:
            return value
        low, high = (option.size for option in self.options)
        if value >= high * (1.0 - NOISE):
            return high
        return max(low, down(value, self.digits))

    def next_ordered(self, value: float) -> float:
        """The next larger size that can be ordered, up to the largest of the range."""
        step = 10.0 ** (math.floor(math.log10(value) + NOISE) - self.digits + 1)
        return self.ordered(min(value + step * (1.0 + 1e-6), self.options[-1].size))

    def size(self, value: float) -> float:
        """Its size in units of the file."""
        return value if self.is_formula else self.options[round(value)].size

    def word(self, value: float) -> str:
        """What is ordered, in words; none of a size by formula."""
        return "" if self.is_formula else self.options[round(value)].word

    def price(self, value: float) -> float:
        """What it costs."""
        return self.cost.at(value) if self.is_formula else self.options[round(value)].cost

    def play(self, value: float) -> Play:
        """How large its set is."""
        if not self.is_formula:
            return self.options[round(value)].play
        low, high = self.options
        part = (value - low.size) / (high.size - low.size)
        ends = zip((low.play.scale, low.play.axial), (high.play.scale, high.play.axial), strict=True)
        return Play(*(a + part * (b - a) for a, b in ends))

    @cached_property
    def before(self) -> float | None:
        """The value that the file has now; None where it is not among those with a cost."""
        size = self.sizing.size
        if self.is_formula:
            ends = [option.size for option in self.options]
            return size if ends[0] <= size <= ends[1] else None
        near = (k for k, option in enumerate(self.options) if math.isclose(option.size, size, rel_tol=1e-9))
        return next(map(float, near), None)


def down(value: float, digits: int) -> float:
    """A positive number rounded down to some significant digits.

    Examples
    --------
    >>> down(0.0480685221, 3)
    0.048
    """
    places = digits - 1 - math.floor(math.log10(value) + NOISE)
    return _decimal(math.floor(value * 10.0**places * (1.0 + NOISE)) / 10.0**places, places)


def tidy(changes: Mapping[str, object], size: float, digits: int) -> dict[str, object]:
    """Changes of the file with as many decimals as a size of so many digits needs, and one more.

    Examples
    --------
    >>> tidy({"dimensions.l2": {"tolerance": {"plus": 0.006666666666666666, "minus": -0.01}}}, 0.01, 3)
    {'dimensions.l2': {'tolerance': {'plus': 0.00667, 'minus': -0.01}}}
    """
    if not size > 0.0:
        return dict(changes)
    places = digits - 1 - math.floor(math.log10(size) + NOISE) + MORE
    return {key: _short(value, places) for key, value in changes.items()}


def _digits(value: float) -> int:
    """How many significant digits a number has as it is written."""
    return next((n for n in range(1, ALL) if float(f"{value:.{n - 1}e}") == value), ALL)


def _short(value: Any, places: int) -> Any:
    if isinstance(value, Mapping):
        return {key: _short(one, places) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_short(one, places) for one in value]
    return _decimal(value, places) if isinstance(value, float) else value


def _decimal(value: float, places: int) -> float:
    return float(f"{value:.{places}f}") if places > 0 else float(round(value, places))


@dataclass(frozen=True)
class Play:
    """How large the set of a source is, SI: what all of it is proportional to, and the axial play beside it."""

    scale: float
    axial: float


@dataclass(frozen=True)
class Option:
    """One choice."""

    #: as the file has it, such as ``H7/g6``; empty where it is a size
    word: str
    #: its size in units of the file, of a fit or a bearing the largest play
    size: float
    cost: float
    #: what makes it of the mechanism, for `Mechanism.with_`
    changes: Mapping[str, object] = field(repr=False)
    play: Play


def items_of(m: Mechanism, digits: int = DIGITS) -> tuple[Mechanism, list[Item], list[str]]:
    """The mechanism with its patterns written out, what is decided, and the sources that have no cost.

    Parameters
    ----------
    digits : int
        Significant digits of sizes by formula.

    Raises
    ------
    InputError
        When a cost is of no source, or does not fit to it.
    """
    base, sources = sizings(m)
    if not base.data.costs:
        problem = "no source has a cost: [costs.J1] with choices = [{ size = 0.02, cost = 3 }, ...] or a model"
        raise InputError(problem, file=m.file, key="costs")
    found: dict[str, tuple[str, Cost]] = {}
    names = [sizing.name for sizing in sources]
    for name, cost in base.data.costs.items():
        key = f"costs.{name}"
        exact = "*" not in name
        hits = [name] if exact and name in names else [n for n in names if not exact and fnmatchcase(n, name)]
        if not hits:
            what = "a source that can be larger or smaller" if exact else "a pattern that any source has"
            raise InputError(not_known(name, what, names), file=m.file, key=key)
        for hit in hits:
            if exact or hit not in found:
                found[hit] = key, cost
            elif "*" in found[hit][0]:
                raise InputError(f"'{hit}' is matched by {found[hit][0]} already", file=m.file, key=key)
    chosen = [sizing for sizing in sources if sizing.name in found]
    items = [_item(base, sizing, *found[sizing.name], digits) for sizing in chosen]
    return base, items, [sizing.name for sizing in sources if sizing.name not in found]


def _item(m: Mechanism, sizing: Sizing, key: str, cost: Cost, digits: int) -> Item:
    if cost.choices is None:
        return Item(sizing, key, cost, _ends(m, sizing, key, cost), digits)
    options = [_option(m, sizing, f"{key}.choices.{k}", choice, digits) for k, choice in enumerate(cost.choices)]
    by_size = sorted(options, key=lambda option: (option.size, -option.cost))
    for tighter, looser in pairwise(by_size):
        if looser.cost > tighter.cost:
            pair = [f"{option.word or f'size {option.size:g}'} ({option.cost:g})" for option in (tighter, looser)]
            problem = f"the cost would rise with the size, from {pair[0]} to {pair[1]}; what is looser costs no more"
            raise InputError(problem, file=m.file, key=f"{key}.choices")
    return Item(sizing, key, cost, tuple(options), digits)


def _ends(m: Mechanism, sizing: Sizing, key: str, cost: Cost) -> tuple[Option, ...]:
    assert cost.from_ is not None
    assert cost.to is not None
    if sizing.fixed:
        raise InputError(f"'{sizing.name}': {sizing.fixed}", file=m.file, key=key)
    changes = [(size, sizing.resized(size)) for size in (cost.from_, cost.to)]
    return tuple(Option("", size, cost.at(size), made, _play(m, sizing, made, key)[1]) for size, made in changes)


def _option(m: Mechanism, sizing: Sizing, key: str, choice: Choice, digits: int) -> Option:
    value = choice.value
    if isinstance(value, float):
        if sizing.fixed:
            raise InputError(f"'{sizing.name}': {sizing.fixed}", file=m.file, key=key)
        made = tidy(sizing.resized(value), value, max(digits, _digits(value)))
    elif choice.way == "bearing":
        if not sizing.bearing:
            problem = (
                f"'{sizing.name}' is not a ball bearing: its clearance needs bearing and bore; here a size or a fit"
            )
            raise InputError(problem, file=m.file, key=f"{key}.bearing")
        made = sizing.of_bearing(value)
    else:
        if not sizing.can_have_fit:
            problem = f"'{sizing.name}' has no hole and pin, or slot and slider, that a fit could be of; give a size"
            raise InputError(problem, file=m.file, key=f"{key}.fit")
        if sizing.diameter is None:
            problem = (
                f"the nominal size of '{sizing.name}' is not known: give {sizing.key} a diameter, or nominal width"
            )
            raise InputError(problem, file=m.file, key=f"{key}.fit")
        made = sizing.of_fit(value)
    size, play = _play(m, sizing, made, key)
    return Option("" if isinstance(value, float) else value, size, choice.cost, made, play)


def _play(m: Mechanism, sizing: Sizing, changes: Mapping[str, object], key: str) -> tuple[float, Play]:
    """Size in the file and set of a source with changes.

    Raises
    ------
    InputError
        When the mechanism cannot have them, by the key of the cost.
    """
    try:
        changed = m.with_(changes)
    except InputError as problem:
        raise InputError(f"{problem.key}: {problem.problem}", file=m.file, key=key) from None
    now = next(one for one in sizings(changed)[1] if one.key == sizing.key)
    size = now.size * (2.0 if (sizing.measure, now.measure) == ("diametral", "radial") else 1.0)
    index = changed.sources.index(sizing.sources[0])
    source = changed.compiled_sources[index]
    limits = travel(changed, index)
    scale = furthest(source.size, PLAY) if limits is None else limits[1]
    return size, Play(max(scale, 0.0), source.size.get("axial", 0.0))
