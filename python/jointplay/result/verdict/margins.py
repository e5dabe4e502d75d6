"""The verdict on errors: the margins of every limit at every configuration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.core.compile import LENGTHS
from jointplay.result import SIZES, Result, first_largest, rounding

from .judging import PLAYS, TOGETHER, ends, ends_of_plays, has_strays, judged, room
from .outcome import HELD, MISSED, NOT_SHOWN, Rows, Verdict
from .words import TIGHTEN, caused, configurations, rounded, shown, there

#: which sizes were taken, in words
TAKEN = {"middle": "with clearances of middle size"} | {play: f"with the {play} play" for play in PLAYS}
#: which sizes were judged where a limit has to hold with those in the middle and with both others
ANY_SIZE = "with clearances of any size in their limits"
#: what can make a value another one than the pose of the result has
FRICTION, OTHER, OPEN = "friction", "coming from the other side", "what the load leaves open"


@dataclass(frozen=True)
class _Case:
    """What quantities reach with clearances of some size, and by how much they keep to their limits."""

    #: which sizes; empty where none scatter
    words: str
    #: `low`, `high`, `margin`: shape (configuration, quantity)
    low: Array
    high: Array
    margin: Array
    #: `known`, `missed`: where a margin is known, and where a limit is missed
    known: Array
    missed: Array
    is_own: bool


def of_margins(result: Result) -> Verdict:
    """The verdict on a result that has margins."""
    limited = np.asarray(np.isfinite(result.get("limit")).any(axis=1))
    rows = Rows.of(result)
    cases = list(_cases(result, rows, limited))
    rows = rows.but(np.logical_and.reduce([case.known[:, limited].all(axis=1) for case in cases]))
    own, *others = cases
    worse, held = [], []
    for q in np.flatnonzero(limited).tolist():
        found = [_Extreme(result, q, case) for case in cases if case.known[:, q].any()]
        bad = [one for one in found if one.is_missed]
        # What is missed with the sizes that the table has is told of these.
        if bad and bad[0].case.is_own:
            worse.append(bad[0])
        elif bad:
            worse.append(max(bad, key=lambda one: one.part))
        elif found:
            held.append(found[0])
    worse.sort(key=lambda one: one.part, reverse=True)
    after = " after the correction" if "correction" in result.data else ""
    if has_strays(result):
        is_bound = "worst_component" in result.data or "friction_low" in result.data
        after += f"{TOGETHER}{', whose sizes are added' * is_bound}"
    basis = f"{after} {own.words}" if own.words else after
    near = "; ".join(one.within() for one in held)
    end = f"{rows.left_out()}."
    if worse:
        sentences = [f"{one.head(after)}: {one.beyond()}." for one in worse]
        sentences[0] = f"{sentences[0][:-1]}{end}"
        sentences += [f"Held{f' {own.words}' * bool(own.words)}: {near}."] if held else []
        sentences += [f"Not known: whether limits hold at {configurations(rows.unknown)}."] if rows.unknown else []
        outcome, gist = MISSED, worse[0].gist()
    elif rows.are_all_known:
        plays = "; with the largest and the smallest play as well" if others else ""
        sentences, outcome, gist = [f"Limits hold{basis}: {near}{plays}{end}"], HELD, ""
    else:
        elsewhere = f"; elsewhere {near}" if held else ""
        sentences, outcome, gist = (
            [f"Not shown: whether limits hold{basis}; {rows.why()}{elsewhere}{end}"],
            NOT_SHOWN,
            rows.why(),
        )
    every = [*worse, *held]
    return Verdict(
        tuple(sentences),
        tuple(_marks(result, cases)),
        outcome,
        alarms=len(worse),
        used=max((1.0 + one.part for one in every), default=0.0),
        named=tuple(one.name for one in every if one.case.is_own),
        basis=_basis(basis, worse, has_plays=bool(others)),
        gist=gist,
    )


def _basis(basis: str, worse: list[_Extreme], *, has_plays: bool) -> str:
    """What the verdict as a whole rests on."""
    if not has_plays:
        return basis
    if worse:
        return basis if worse[0].case.is_own else ""
    return f" {ANY_SIZE}"


def _cases(result: Result, rows: Rows, limited: Array) -> list[_Case]:
    limit, least = result.get("limit"), rounded(result)
    # Offsets of another result bring their sizes.
    sizes = "" if "offsets_of" in result.attrs else str(result.attrs.get("sizes", ""))

    def case(words: str, low: Array, high: Array, margin: Array, met: Array, *, is_own: bool) -> _Case:
        known = rows.known[:, None] & limited & np.isfinite(margin)
        return _Case(words, low, high, margin, known, known & ~met, is_own)

    met = result.get("limit_met").astype(bool)
    found = [case(TAKEN.get(sizes, ""), *ends(result), result.get("margin"), met, is_own=True)]
    for play, low, high in ends_of_plays(result):
        margin = room(limit, low, high)
        found.append(case(TAKEN[play], low, high, margin, margin >= -least, is_own=False))
    return found


def _marks(result: Result, cases: list[_Case]) -> list[str]:
    own, *others = cases
    names = result.labels("quantity")
    marks = []
    for k in range(len(own.margin)):
        told = [name for q, name in enumerate(names) if own.missed[k, q]]
        # The row shows the sizes in the middle.
        plays = [f"{play} play" for play, case in zip(PLAYS, others, strict=False) if case.missed[k].any()]
        marks.append(", ".join(told or plays))
    return marks


class _Extreme:
    """The configuration at which a quantity is nearest to its limit, or farthest beyond it."""

    def __init__(self, result: Result, quantity: int, case: _Case) -> None:
        self.result, self.quantity, self.case = result, quantity, case
        self.name = str(result.labels("quantity")[quantity])
        self.unit = result.unit("limit", quantity=self.name)
        limits, known = result.get("limit")[quantity], case.known[:, quantity]
        # Margins are alike to the rounding of what they are left of.
        whole = np.abs(limits[np.isfinite(limits)]).max()
        self.at = int(first_largest(np.where(known, whole - case.margin[:, quantity], -np.inf)))
        self.margin = float(case.margin[self.at, quantity])
        low, high = limits.tolist()
        lowest, highest = (float(end[self.at, quantity]) for end in (case.low, case.high))
        above = np.isfinite(high) and not (np.isfinite(low) and lowest - low < high - highest)
        self.side = "high" if above else "low"
        self.value, self.limit = (highest, high) if above else (lowest, low)

    @property
    def is_missed(self) -> bool:
        """Whether its limit is missed anywhere."""
        return bool(self.case.missed[:, self.quantity].any())

    @property
    def part(self) -> float:
        """How far it is beyond the limit, as a part of the limit: what lengths and angles are compared by."""
        return -self.margin / abs(self.limit) if self.limit else np.inf

    def head(self, after: str) -> str:
        """The first words of a sentence on a limit that is missed."""
        return f"Limit missed{after}{f' {self.case.words}' * bool(self.case.words)}"

    def gist(self) -> str:
        """What is missed, in few words."""
        sizes = "" if self.case.is_own else f" {self.case.words}"
        return f"{self.name} {self._shown(self.value)} of {self._shown(self.limit)}{sizes}"

    def beyond(self) -> str:
        """What is missed where, by how much, and what is to be made smaller."""
        word = "above" if self.side == "high" else "below"
        size = f"{self.name} {self._shown(self.value)}{self._open()}"
        far = f"{self._shown(-self.margin)} {word} {self._shown(self.limit)}"
        count, total = int(self.case.missed[:, self.quantity].sum()), int(self.case.known[:, self.quantity].sum())
        place = there(self.result, self.at)
        often = f" (missed at {count} of {total} configurations)" if total > 1 else ""
        text = f"{size}, {far}{f',{place}' * bool(place)}{often}"
        if self.case.is_own:
            return f"{text}{self._caused(TIGHTEN)}"
        lowest, highest = (float(end[self.at, self.quantity]) for end in ends(self.result))
        value = highest if self.side == "high" else lowest
        return f"{text}; {TAKEN['middle']} {self._shown(value)}"

    def within(self) -> str:
        """How near it comes."""
        near = f"{self.name} {self._shown(self.value)}{self._open()} of {self._shown(self.limit)}"
        margin = f"margin {self._shown(max(self.margin, 0.0))}"
        is_there = abs(self.value) > rounding(self.result, self.unit)
        blamed = self._caused(", to blame") if is_there else ""
        return f"{near}{there(self.result, self.at)}, {margin}{blamed}"

    def _open(self) -> str:
        """What of a value is left open by the load, or is that of the other side."""
        beside = self._beside()
        if not beside:
            return ""
        plain = self._shown(self._plain())
        words = {FRICTION: f"(without friction {plain})", OTHER: OTHER, OPEN: f"({plain} and {OPEN})"}
        return f" {words[beside]}"

    def _plain(self) -> float:
        """The value at the pose that the result is of."""
        error = judged(self.result)[0][self.at]
        if self.name not in SIZES:
            return float(error[self.quantity])
        is_length = np.array([name in LENGTHS for name in self.result.labels("component")])
        return float(np.linalg.norm(error[is_length == (self.name == "position")]))

    def _beside(self) -> str:
        """What makes the value another one than that pose has, if anything does."""
        if not self.case.is_own or not {"worst_component", "nominal_force"}.isdisjoint(self.result.data):
            return ""
        if abs(self.value - self._plain()) <= rounding(self.result, self.unit):
            return ""
        if "friction_low" in self.result.data:
            return FRICTION
        if "reversal" in self.result.data and not self.result.get("undetermined")[self.at].any():
            return OTHER
        # Of the worst case corrected it is the size over all offsets.
        return OPEN if {"undetermined", "residual_undetermined"} & set(self.result.data) else ""

    def _caused(self, head: str) -> str:
        """What causes the value; nothing where it is not known of that pose."""
        beside = self._beside()
        if beside in (FRICTION, OTHER):
            return ""
        return caused(self.result, self.name, self.side, self.at, head, is_open=beside == OPEN)

    def _shown(self, value: float) -> str:
        return shown(self.result, value, self.unit)
