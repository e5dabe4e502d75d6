"""Verdicts: whether the errors keep to the limits of the file, where not, by how much, and which source to tighten.

    margin = min(high - largest value, lowest value - low)      negative where a limit is missed

`random` has shares of specimens outside the limits instead of margins; a required yield is met where the lower end of
its confidence interval reaches it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from jointplay.compile import LENGTHS
from jointplay.result import (
    LOAD,
    SIDES,
    Array,
    Builder,
    Result,
    Variable,
    blame,
    commanded,
    first_largest,
    in_words,
    largest,
    parts,
    parts_by_cause,
    shares,
)

#: quantities that are the sizes of others
SIZES = ("position", "rotation")
#: shares of the mechanism's length, and radians, that are rounding: an error of that size misses no limit
ROUNDING = 1e-10
#: significant digits of what a sentence names
DIGITS = 4
#: how a share was found where nothing else is said
COUNTED = "counted"
#: drives whose values are named beside the number of a configuration
FEW = 2
#: as many configurations are named one by one
MOST = 8


@dataclass(frozen=True)
class Verdict:
    """What is to be said of a result and of its limits.

    Attributes
    ----------
    sentences : tuple of str
        The answer first; none where the file has no limits.
    marks : tuple of str
        For every configuration what it misses, ``""`` where it keeps to all limits.
    missed : bool
        Whether a limit is missed, or a required yield.
    alarms : int
        How many of the sentences, from the first, say what is missed.
    used : float
        Largest share of a limit that is used, more than one where it is missed; of `random` the share outside.
    named : tuple of str
        The quantities whose errors the sentences name.
    """

    sentences: tuple[str, ...] = ()
    marks: tuple[str, ...] = ()
    missed: bool = False
    alarms: int = 0
    used: float = 0.0
    named: tuple[str, ...] = ()


def add_limits(builder: Builder) -> None:
    """Add the limits of the file to a result: `limit`, nan where there is none."""
    m = builder.m
    bounds = m.limits.bounds(m.quantities)
    words = "lowest and highest acceptable value"
    builder.add("limit", ("quantity", "side"), np.where(np.isfinite(bounds), bounds, np.nan), words, "quantity")


def judge(builder: Builder) -> None:
    """Add the limits to a result of errors, and whether and by how much they are kept: `limit_met`, `margin`."""
    add_limits(builder)
    limit = builder.data["limit"]
    low, high = limit.values.T
    lowest, highest = ends(Result(builder.coords, builder.data))
    limited = np.isfinite(low) | np.isfinite(high)
    below, above = (np.where(np.isfinite(end), end, sign * np.inf) for end, sign in ((low, -1.0), (high, 1.0)))
    room = np.minimum(above - highest, lowest - below)
    margin = np.where(limited & np.isfinite(room), room, np.nan)
    met = ~limited | (margin >= -roundings(builder))
    per = ("configuration", "quantity")
    builder.data["limit_met"] = Variable(per, met, "", "whether the quantity keeps to its limits")
    words = "how far the quantity is from its limits, negative where it is beyond one"
    builder.data["margin"] = Variable(per, margin, limit.units, words)


def roundings(builder: Builder) -> Array:
    """What of every quantity is rounding, in the units of the result."""
    sizes = {"length": builder.m.length / builder.units.length, "angle": 1.0 / builder.units.angle}
    return ROUNDING * np.array([sizes[kind] for kind in builder.axes["quantity"].kinds])


def rounding(result: Result, unit: str) -> float:
    """What of a length or an angle is rounding, in its unit."""
    if unit == "rad":
        return ROUNDING
    return ROUNDING * (57.3 if unit == "deg" else float(result.attrs.get("length", 0.0)))


def ends(result: Result) -> tuple[Array, Array]:
    """Lowest and highest value of every quantity, each (configuration, quantity).

    What a load leaves open counts: a component may be anywhere within its half-width, and a size is at most that of
    the farthest corner.
    """
    if "worst_component" in result.data:
        low, high = (result.get("worst_component", side=side) for side in SIDES)
        sizes = [result.get(f"worst_{which}") for which in SIZES]
    else:
        error = result.get("error")
        half = result.get("undetermined") if "undetermined" in result.data else np.zeros_like(error)
        low, high = error - half, error + half
        moves = np.array([name in LENGTHS for name in result.labels("component")])
        sizes = [np.linalg.norm((np.abs(error) + half)[:, which], axis=1) for which in (moves, ~moves)]
    return np.column_stack([low, *map(np.zeros_like, sizes)]), np.column_stack([high, *sizes])


def misses(result: Result) -> bool:
    """Whether a limit is missed that the question was asked about, at any configuration of any output or load case.

    Sweeps, maps and comparisons show what might be; they do not judge.
    """
    if "sweep" in result.attrs or "grid" in result.attrs or "mechanism" in result.sizes:
        return False
    return any(verdict(part).missed for _, part in parts(result))


def verdict(result: Result) -> Verdict:
    """The verdict on a result of one output in one load case, over configurations.

    Parameters
    ----------
    result : Result
        Of any question; of those that have no limits to keep to it says nothing.
    """
    if "limit" not in result.data or not np.isfinite(result.get("limit")).any():
        return Verdict()
    if "outside" in result.data:
        return _of_shares(result)
    return _of_margins(result) if "margin" in result.data else Verdict()


def _of_margins(result: Result) -> Verdict:
    names = result.labels("quantity")
    margin, met = result.get("margin"), result.get("limit_met").astype(bool)
    known = np.isfinite(margin)
    missed = ~met & known
    unknown = np.flatnonzero((~met & ~known).any(axis=1)).tolist()
    marks = tuple(", ".join(name for name, bad in zip(names, row, strict=True) if bad) for row in missed.tolist())
    found = [_Extreme(result, q) for q in range(len(names)) if known[:, q].any()]
    worse = sorted((one for one in found if missed[:, one.quantity].any()), key=lambda one: one.part, reverse=True)
    held = [one for one in found if not missed[:, one.quantity].any()]
    sentences = [f"Limit missed: {one.beyond(int(missed[:, one.quantity].sum()))}." for one in worse]
    if held:
        head = "Held" if worse else "Limits hold"
        sentences.append(f"{head}: {'; '.join(one.within() for one in held)}.")
    if unknown:
        sentences.append(f"Not known: whether limits hold at {_configurations(unknown)}.")
    used = max((1.0 + one.part for one in found), default=0.0)
    named = tuple(one.name for one in found)
    return Verdict(tuple(sentences), marks, bool(missed.any()), len(worse), used, named)


def _of_shares(result: Result) -> Verdict:
    outside, low, high = (result.get(name) for name in ("outside", "outside_low", "outside_high"))
    known = np.isfinite(outside)
    if not known.any():
        return Verdict(("Not known: no specimen has a pose.",), ("",) * len(outside))
    # Where nothing was found there may be a wide interval, which says less than a specimen that is outside elsewhere.
    at = int(np.nanargmax(np.where(known, high + (outside > 0.0), -1.0)))
    where = f" at {place(result, at)}"
    method = str(result.get("outside_method")[at]) if "outside_method" in result.data else COUNTED
    how = "" if method == COUNTED else f", {method}"
    interval = f"{percent(low[at])} to {percent(high[at])} with 95 % confidence{how}"
    if outside[at] > 0.0:
        every = result.get("outside_quantity")[at]
        most = int(np.nanargmax(every))
        name = str(result.labels("quantity")[most])
        whose = f", most beyond {name}" if np.isfinite(every).sum() > 1 and every[most] > 0.0 else ""
        found = cause(result, name, "high", at)
        blamed = f"; {in_words(*found)} of the variance" if found is not None and found[0] != [LOAD] else ""
        said = f"Outside the limits: {percent(outside[at])} of the specimens{where} ({interval}){whose}{blamed}."
    elif high[at] <= 0.0:
        said = "Outside the limits: none of the specimens; the worst case keeps to the limits."
    else:
        said = f"Outside the limits: none of the specimens; less than {percent(high[at])} with 95 % confidence{how}."
    sentences = [said]
    sentences += _of_path(result)
    required = float(result.attrs.get("required_yield", np.nan))
    missed = known & ~(1.0 - high >= required) if np.isfinite(required) else np.zeros(len(outside), bool)
    if np.isfinite(required):
        least = f"{percent(1.0 - outside[at])} are within{where}, {percent(1.0 - high[at])} to {percent(1.0 - low[at])}"
        if not missed.any():
            answer = "met"
        elif 1.0 - low[at] < required:
            answer = "missed"
        else:
            answer = "not shown, more specimens decide"
        sentences.insert(0, f"Required yield {percent(required)}: {answer}; {least} with 95 % confidence.")
    marks = tuple("yield" if bad else "" for bad in missed.tolist())
    return Verdict(tuple(sentences), marks, bool(missed.any()), int(missed.any()), float(high[at]))


def _of_path(result: Result) -> list[str]:
    """The yields over all configurations."""
    if "yield_path" not in result.data or not np.isfinite(result.get("yield_path")):
        return []
    found = []
    for name, how in (("path", "with offsets drawn anew at each"), ("specimen", "wherever the play lies")):
        share, low, high = (float(result.get(f"yield_{name}{end}")) for end in ("", "_low", "_high"))
        found.append(f"{percent(share)} {how} ({percent(low)} to {percent(high)})")
    count = len(result.get("outside"))
    return [f"Within the limits at all {count} configurations: {found[0]}; {found[1]}."]


def limits_in_words(result: Result) -> str:
    """``position 0.3 mm or x from -0.1 to 0.2 mm``."""
    told = []
    for name, (low, high) in zip(result.labels("quantity"), result.get("limit").tolist(), strict=True):
        unit = result.unit("limit", quantity=name)
        if low == low and high == high:
            told.append(f"{name} from {low:g} to {high:g} {unit}")
        elif low == low or high == high:
            told.append(f"{name} {high if high == high else low:g} {unit}")
    return " or ".join(told)


def percent(share: float) -> str:
    """A share in per cent, ppm or ppb, with the digits that tell it from nothing, or from all.

    Examples
    --------
    >>> [percent(share) for share in (0.0134, 0.00012, 2e-9, 0.9973, 0.999998, 0.0, 1.0)]
    ['1.34 %', '120 ppm', '2 ppb', '99.73 %', '99.9998 %', '0 %', '100 %']
    """
    if 0.0 < share < 1e-7:
        return f"{1e9 * share:.3g} ppb"
    if 0.0 < share < 1e-3:
        return f"{1e6 * share:.3g} ppm"
    if 0.99 < share < 1.0:
        digits = 1 - math.floor(math.log10(100.0 * (1.0 - share)))
        return f"{100.0 * share:.{min(digits, 10)}f}".rstrip("0").rstrip(".") + " %"
    return f"{100.0 * share:.3g} %"


class _Extreme:
    """The configuration at which a quantity is nearest to its limit, or farthest beyond it."""

    def __init__(self, result: Result, quantity: int) -> None:
        self.result, self.quantity = result, quantity
        self.name = str(result.labels("quantity")[quantity])
        self.unit = result.unit("limit", quantity=self.name)
        limits, margin = result.get("limit")[quantity], result.get("margin")[:, quantity]
        # Margins are alike to the rounding of what they are left of.
        whole = np.abs(limits[np.isfinite(limits)]).max()
        self.at = int(first_largest(np.where(np.isfinite(margin), whole - margin, -np.inf)))
        self.margin = float(margin[self.at])
        low, high = limits.tolist()
        lowest, highest = (float(end[self.at, quantity]) for end in ends(result))
        above = np.isfinite(high) and not (np.isfinite(low) and lowest - low < high - highest)
        self.side = "high" if above else "low"
        self.value, self.limit = (highest, high) if above else (lowest, low)

    @property
    def part(self) -> float:
        """How far it is beyond the limit, as a part of the limit: what lengths and angles are compared by."""
        return -self.margin / abs(self.limit) if self.limit else np.inf

    def beyond(self, count: int) -> str:
        """What is missed where, by how much, and what is to be made smaller."""
        word = "above" if self.side == "high" else "below"
        size = f"{self.name} {self._shown(self.value)}, {self._shown(-self.margin)} {word} {self._shown(self.limit)}"
        total = len(self.result.get("margin"))
        often = f" (missed at {count} of {total} configurations)" if total > 1 else ""
        return f"{size}, at {place(self.result, self.at)}{often}{self._cause('; to tighten first')}"

    def within(self) -> str:
        """How near it comes."""
        near = f"{self.name} {self._shown(self.value)} of {self._shown(self.limit)}"
        margin = f"margin {self._shown(max(self.margin, 0.0))}"
        blamed = self._cause(", to blame") if self._is_there(self.value) else ""
        return f"{near} at {place(self.result, self.at)}, {margin}{blamed}"

    def _is_there(self, value: float) -> bool:
        return abs(value) > rounding(self.result, self.unit)

    def _shown(self, value: float) -> str:
        return f"{value if self._is_there(value) else 0.0:.{DIGITS}g} {self.unit}".rstrip()

    def _cause(self, head: str) -> str:
        found = cause(self.result, self.name, self.side, self.at)
        if found is None:
            return ""
        sources, share = found
        if sources == [LOAD]:
            return f"{head[0]} most of it is the deformation under the load, {100 * share:.0f} %"
        return f"{head}: {in_words(sources, share)}"


def cause(result: Result, quantity: str, side: str, at: int) -> tuple[list[str], float] | None:
    """The sources with the largest share in a quantity, and that share; None where nothing is known of it.

    Parameters
    ----------
    quantity : str
    side : {"low", "high"}
        The end of a component.
    at : int
        The configuration.
    """
    if "contribution" not in result.data:
        return None
    if quantity in SIZES:
        return blame(result).largest(quantity, at)
    if "extreme" in result.data["contribution"].dims:
        causes = tuple(result.labels("source"))
        values = result.get("contribution", extreme=f"{quantity} {side}")[at]
    else:
        causes, every = parts_by_cause(result)
        values = every[at, :, result.labels("component").index(quantity)]
    return largest(causes, shares(values[None])[0])


def place(result: Result, at: int) -> str:
    """``configuration 3 (theta = 40 deg)``."""
    drives = result.drives
    if not 0 < len(drives) <= FEW:
        return f"configuration {at}"
    told = (f"{name} = {commanded(drive, at):g} {drive.units}".rstrip() for name, drive in drives.items())
    return f"configuration {at} ({', '.join(told)})"


def _configurations(places: list[int]) -> str:
    if len(places) > MOST:
        return f"{len(places)} configurations (the first is {places[0]})"
    return f"configuration{'s' * (len(places) > 1)} {', '.join(map(str, places))}"
