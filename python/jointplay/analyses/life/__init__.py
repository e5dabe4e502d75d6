"""`life`: how long the limits hold while the clearances wear.

    clearance[age] = clearance + growth over the cycles        see `sliding`, `rates` and `course`
    life = the number of cycles up to which the limits hold

All that wears is proportional to the rates, so that the same clearances are reached after half of the cycles where all
rates are twice as large. Every age is a copy of the mechanism, which is asked the question as anybody would ask it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.allow import prepared
from jointplay.analyses.allow.asked import REFUSED, Asked, Use
from jointplay.analyses.allow.search import AllowSearch
from jointplay.analyses.beside import judged, with_forces
from jointplay.analyses.contacts import Assumed
from jointplay.analyses.nominal import Interrupted, Progress
from jointplay.analyses.recorded import recorded
from jointplay.analyses.running import add_largest_rate, loses_contact, speeds
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.errors import InputError, shown
from jointplay.file.schema.values import LARGEST
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import sizings
from jointplay.model.wearing import Wearing, wearings
from jointplay.result import FORCES_JUDGED, Result, ResultBuilder, Variable, figure, to_dataset
from jointplay.result.verdict import HELD

from .course import Course
from .rates import Duty, Rates, changes, require_cycle

if TYPE_CHECKING:
    import xarray as xr

TOLERANCE = 1e-4
#: rates that are known to a factor: the life with rates that are so many times as large, and as small
FACTOR = 2.0
#: ages of which clearances and errors are told where nobody names any
AGES = 11
#: most ages that anybody looks at
MOST_AGES = 100_000
#: no clearance is followed until it has grown by a larger part of the mechanism's length
FARTHEST = 0.1
#: part of the mechanism's length that stands for a clearance where all are zero
SMALLEST = 1e-6
#: evaluations that a search takes about
EVALUATIONS = 12


@typed
def life(
    m: Mechanism,
    question: str = "worst",
    *,
    cycles: float | Iterable[float] | None = None,
    cycle: str | None = None,
    probability: float | None = None,
    tolerance: float = TOLERANCE,
    **options: Any,
) -> xr.Dataset:
    """Find for how many cycles the limits of the file hold while the clearances wear.

    Parameters
    ----------
    m : Mechanism
        With `wear` of some joints.
    question : {"worst", "loaded", "random"}
        In which limits have to hold, at every configuration: in the worst case; where the loads push the mechanism; or
        for a share of the specimens.
    cycles : float or iterable of float, optional
        Ages, in cycles, at which clearances and errors are given; eleven equal steps up to the life if left out, or up
        to twice the largest clearance where there is no life.
    cycle : {"closed", "back-and-forth", "one-way"}, optional
        What a cycle is: once along a path that ends where it began; along the path and back; or along the path only. If
        left out, it is closed where the path is, and otherwise back and forth.
    probability : float, optional
        random: the share of the specimens that has to keep to all limits, as for `allow`.
    tolerance : float
        Relative, of the life.
    **options
        Of the question, as for `allow`.

    Returns
    -------
    xarray.Dataset
        Over `source`, the clearances that wear: `growth` (per cycle with the clearances as they are, in the measure of
        the file, see `source_measure`), `growth_coarse` (the same with every second configuration: how far both differ
        says whether the path has enough of them), `sliding` (distance per cycle), `pressure` (largest mean pressure),
        `size` (clearance in the middle of its limits), `size_worn` (the same at the end of the life) and
        `used_without` (what would be used of the limits then if this one had not worn). Over `age`, in cycles, and
        `source`: `clearance`; over `age` and `configuration`: `position` and `rotation` (the largest over outputs and
        load cases); over `age`: `used` (the largest part of a limit that is used).

        And `life` (cycles; a lower bound where `status` is ``unlimited`` or ``undetermined``), `life_low` and
        `life_high` (with rates twice and half as large), `binding_quantity` and `binding_configuration` (what misses
        its limit first), with `binding_output`, `binding_load_case` and `binding_contact` where the file has several,
        and `status`: ``ok``; ``missed``, where the limits are missed with new clearances already; ``unlimited``, where
        they hold with all that was tried; ``undetermined``, where from there on the loads do not say how joints share
        them; ``no_limit``, where the file has none; ``no_wear``, where nothing grows; ``no_pose``, where some
        configuration has no pose, so that the cycle is not known. The attribute `cycle` says what a cycle is.
        Where the file limits forces, `forces_outcome` at the end of the life, as of `compare`.
        Of a machine that runs `contact_rate`, the largest at the end of the life, with `contact`, `contact_source` and
        `contact_configuration`, see `loaded`.

    Raises
    ------
    InputError
        When no joint has `wear`, nothing loads the mechanism, the path is no cycle, or the question has no such option.

    Notes
    -----
    Growth follows from the reactions at the displaced poses, with the clearances in the middle of their limits, as they
    are by then. A rate of twice the size halves all numbers of cycles, whatever the mechanism.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.life(jp.loads(jp.examples.text("press-running")))
    >>> result.attrs["cycle"], result.status.item(), f"{result.life.item():.2g}"
    ('closed', 'ok', '7.4e+06')
    """
    given = None if cycles is None else [cycles] if isinstance(cycles, int | float) else [*cycles]
    return to_dataset(
        compute(m, question, cycles=given, cycle=cycle, probability=probability, tolerance=tolerance, **options)
    )


@recorded
def compute(
    m: Mechanism,
    question: str = "worst",
    *,
    cycles: Sequence[float] | None = None,
    cycle: str | None = None,
    probability: float | None = None,
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
    **options: Any,
) -> Result:
    """The light form of `life`."""
    share, options = prepared(m, question, probability, tolerance, options, "life")
    ages = _ages(cycles)
    base, sources = sizings(m)
    worn = wearings(base, sources)
    duty = Duty(base, worn, cycle)
    require_cycle(duty)
    asked = Asked(base, question, share, options, asker="life", needs_limits=False)
    return _Life(asked, duty, tolerance, progress).result(ages)


def holds(result: Result) -> bool:
    """Whether the limits hold at all ages that were asked for, and how the clearances wear is known.

    Limits of forces have to hold at the end of the life.
    """
    if loses_contact(result):
        return False
    status = str(result.get("status"))
    if FORCES_JUDGED in result.data and str(result.get(FORCES_JUDGED)) != HELD:
        return False
    if status in ("no_pose", "missed") or (status == "undetermined" and not np.isfinite(result.get("life"))):
        return False
    return "used" not in result.data or bool((result.get("used") <= 1.0).all())


def _ages(cycles: Sequence[float] | None) -> list[float] | None:
    """Ages that were named, rising."""
    if cycles is None:
        return None
    for age in cycles:
        if isinstance(age, bool) or not isinstance(age, int | float) or not 0.0 <= age <= LARGEST:
            raise InputError(f"ages are numbers of cycles from 0 to {LARGEST:.0e}, not {shown(age)}", key="cycles")
    if not 1 <= len(cycles) <= MOST_AGES:
        raise InputError(f"from 1 to {MOST_AGES:,} ages are needed, not {len(cycles):,}", key="cycles")
    return sorted({float(age) for age in cycles})


def _without_wear(m: Mechanism, worn: Sequence[Wearing]) -> list[str]:
    """Clearances that stay as they are."""
    own = {k for one in worn for k in one.sources}
    return [m.sources[k] for k, kind in enumerate(m.source_kinds) if kind == "clearance" and k not in own]


@dataclass(frozen=True)
class _Found:
    """What a search found: the life, why it ends, and what binds."""

    status: str
    life: float = math.nan
    use: Use | None = None


class _Life:
    """A mechanism that wears, and a question that is asked of it at one age after the other."""

    def __init__(self, asked: Asked, duty: Duty, tolerance: float, progress: Progress | None) -> None:
        self.asked, self.duty, self.tolerance, self.progress = asked, duty, tolerance, progress
        self.m, self.worn = duty.m, duty.worn
        self.sizes = np.array([one.clearance(self.m) for one in self.worn])
        self.done, self.total = 0, EVALUATIONS
        nothing = np.full(len(self.worn), np.nan)
        self.now = Rates(nothing, nothing, nothing, nothing)
        self.course: Course | None = None
        self.forces: dict[str, Variable] = {}
        #: configurations that keep the life from being known, with their outcome
        self.without: dict[int, str] = {}

    def result(self, ages: list[float] | None) -> Result:
        """Search, then ask at all ages."""
        self.total = EVALUATIONS + (AGES if ages is None else len(ages))
        found = self._found()
        if ages is None:
            ages = self._usual_ages(found)
        return self._told(found, ages)

    def _found(self) -> _Found:
        if not self.duty.without:
            self.now = self.duty.rates(np.zeros(len(self.worn)))
        self.without = self.duty.without or ({} if self.duty.by_load else self.asked.without_error)
        growth = self.now.growth
        if self.without:
            return _Found("no_pose")
        if not np.isfinite(growth).all():
            return _Found("undetermined")
        if not growth.max() > 0.0:
            return _Found("no_wear", math.inf)
        scale = max(float(self.sizes.max()), SMALLEST * self.m.length)
        self.course = Course(lambda grown: self.duty.rates(grown).growth, growth, scale)
        if not self.asked.has_limits:
            return _Found("no_limit")
        now = self._use(0.0, None)
        if not now.holds:
            return _Found("missed", 0.0, now)
        fastest = float(growth.max())
        search = AllowSearch(
            self._use,
            0.0,
            now,
            FARTHEST * self.m.length / fastest,
            scale / fastest,
            tolerance=self.tolerance,
            is_monotone=self.asked.is_monotone,
        )
        found = search.found()
        status = "ok" if found.status == "ok" else "unlimited"
        if found.use.quantity == REFUSED:
            status = "undetermined"
        return _Found(status, found.allowed, found.use)

    def _usual_ages(self, found: _Found) -> list[float]:
        """Equal steps up to the life, or until the largest clearance has doubled."""
        if self.course is None:
            return [0.0] if found.status == "no_wear" else []
        end = found.life
        if not (math.isfinite(end) and end > 0.0) or found.status == "unlimited":
            end = self.course.scale / float(self.now.growth.max())
        return [float(age) for age in np.linspace(0.0, end, AGES)]

    def _step(self) -> None:
        self.done += 1
        if self.progress is not None:
            self.progress(min(self.done, self.total), self.total)

    def _grown(self, cycles: float) -> Floats:
        if self.course is None:
            return np.zeros(len(self.worn)) if np.isfinite(self.now.growth).all() else self.now.growth
        return self.course.at(cycles)

    def _worn(self, part: Mechanism, grown: Floats) -> Mechanism:
        """A part of the mechanism with clearances that have grown."""
        return part.worn(changes(part, self.m, self.worn, grown))

    def _parts(self, grown: Floats) -> list[Assumed]:
        """The parts of the mechanism with clearances that have grown."""
        return [replace(one, part=self._worn(one.part, grown)) for one in self.asked.parts(self.m)]

    def _use(self, cycles: float, near: Any) -> Use:
        """What is used of the limits after so many cycles."""
        grown = self._grown(cycles)
        self._step()
        if not np.isfinite(grown).all():
            return Use(np.inf, REFUSED, -1)
        return self.asked.use_of(self._parts(grown), near)

    def _without(self, found: _Found) -> Floats:
        """What would be used at the end of the life if one of the clearances had not worn."""
        used = np.full(len(self.worn), np.nan)
        if found.status != "ok":
            return used
        grown = self._grown(found.life)
        for k in range(len(self.worn)) if len(self.worn) > 1 else ():
            used[k] = self.asked.use_of(self._parts(np.where(np.arange(len(grown)) == k, 0.0, grown))).used
        return used

    def _told(self, found: _Found, ages: list[float]) -> Result:
        without = self._without(found)
        self.forces = self._forces(found)
        uses: list[Use] = []
        sizes: list[list[Floats]] = []
        clearances: list[Floats] = []
        try:
            for age in ages:
                grown = self._grown(age)
                self._step()
                # An age is told as a whole.
                use, errors = self._errors(grown)
                uses.append(use)
                sizes.append(errors)
                clearances.append(self.sizes + grown)
        except KeyboardInterrupt:
            if not clearances:
                raise KeyboardInterrupt from None
            done = len(clearances)
            told = self._built(found, without, ages[:done], uses[:done], sizes[:done], clearances)
            words = f"interrupted after {done} of {len(ages)} ages"
            raise Interrupted(Result(told.coords, told.data, {**told.attrs, "incomplete": words})) from None
        return self._built(found, without, ages, uses, sizes, clearances)

    def _forces(self, found: _Found) -> dict[str, Variable]:
        """What is to be said of the limits of forces at the end of the life; nothing where there is no end."""
        grown = self._grown(found.life) if math.isfinite(found.life) else np.array([np.nan])
        first = self.m.only(output=self.m.outputs[0]) if self.m.outputs else self.m
        known = np.isfinite(grown).all()
        return judged(*(self._worn(part, grown) for part in first.every_part)) if known else {}

    def _errors(self, grown: Floats) -> tuple[Use, list[Floats]]:
        """What is used of the limits, and position and rotation of every configuration."""
        count = len(self.asked.at[0])
        if not np.isfinite(grown).all():
            return Use(np.nan, "", -1), [np.full(count, np.nan)] * 2
        both = np.full((2, count), -np.inf)

        def seen(result: Result, places: NDArray[np.intp]) -> None:
            for largest, name in zip(both, ("position", "rotation"), strict=True):
                largest[places] = np.maximum(largest[places], figure(result, name)[0])

        use = self.asked.use_of(self._parts(grown), seen=seen)
        return use, [*np.where(np.isneginf(both), np.nan, both)]

    def _built(
        self,
        found: _Found,
        without: Floats,
        ages: list[float],
        uses: list[Use],
        sizes: list[list[Floats]],
        clearances: list[Floats],
    ) -> Result:
        m, asked = self.m, self.asked
        builder = ResultBuilder(m, "life", asked=asked.question, tolerance=self.tolerance, rate_factor=FACTOR)
        builder.attrs |= speeds(m)
        if self.duty.by_load or asked.by_load:
            grown = self._grown(found.life) if math.isfinite(found.life) else np.zeros(len(self.worn))
            when = "at the end of the life; where there is none, with the clearances as they are"
            add_largest_rate(builder, self.duty.worn_at(np.nan_to_num(grown)), when)
        if self.duty.cycle is not None:
            builder.attrs["cycle"] = self.duty.cycle.name
        if m.load_cases and self.duty.by_load:
            builder.attrs["load_cases"] = ", ".join(m.load_cases)
        if asked.question == "random":
            builder.attrs |= {"probability": asked.probability, "samples": asked.options["samples"]}
            builder.attrs["seed"] = asked.options.get("seed", 0)
            if m.has_loads:
                builder.attrs["contact"] = ", ".join(asked.contacts)
        if asked.question == "loaded" and "size" in m.source_kinds:
            builder.attrs["sizes"] = asked.options.get("sizes", "middle")
        if self.without:
            builder.attrs["without_pose"] = ", ".join(map(str, self.without))
            builder.attrs["without_pose_status"] = ", ".join(dict.fromkeys(self.without.values()))
        if rest := _without_wear(m, self.duty.worn):
            builder.attrs["without_wear"] = ", ".join(rest)
        if self.course is not None and self.course.is_floored:
            builder.attrs["steps"] = "shortest"
        self._sources(builder, found, without)
        builder.labels("age", np.array(ages), "age, in cycles", "cycles")
        factors = np.array([one.factor for one in self.worn])
        if ages:
            builder.add("clearance", ("age", "source"), np.array(clearances) * factors, "clearance by then", "length")
            length, angle = builder.name("length"), builder.name("angle")
            for k, (name, unit) in enumerate((("position", length), ("rotation", angle))):
                values = np.array([errors[k] for errors in sizes])
                words = f"{'position error' if name == 'position' else name} by then, {asked.question}"
                builder.data[name] = Variable(("age", "configuration"), values, unit, words)
            if asked.has_limits:
                used = np.array([use.used for use in uses])
                builder.data["used"] = Variable(("age",), used, "", "largest part of a limit that is used by then")
        self._life(builder, found)
        return with_forces(builder.result(), self.forces)

    def _sources(self, builder: ResultBuilder, found: _Found, without: Floats) -> None:
        """What is told of every clearance."""
        builder.labels("source", [one.name for one in self.worn], "source")
        measures = np.array([one.measure for one in self.worn], dtype=str)
        builder.coords["source_measure"] = Variable(("source",), measures, "", "what its size is")
        factors, now = np.array([one.factor for one in self.worn]), self.now
        for name, values, words, unit in (
            ("growth", now.growth * factors, "growth of the clearance per cycle", "length"),
            ("growth_coarse", now.coarse * factors, "the same with every second configuration", "length"),
            ("sliding", now.sliding, "sliding distance per cycle", "length"),
            ("pressure", now.pressure, "largest mean pressure", "pressure"),
            ("size", self.sizes * factors, "clearance in the middle of its limits", "length"),
        ):
            builder.add(name, "source", values, words, unit)
        grown = self._grown(found.life) if math.isfinite(found.life) else np.full(len(self.worn), np.nan)
        builder.add("size_worn", "source", (self.sizes + grown) * factors, "clearance at the end of the life", "length")
        words = "what would be used of the limits then if this one had not worn"
        builder.data["used_without"] = Variable(("source",), without, "", words)

    def _life(self, builder: ResultBuilder, found: _Found) -> None:
        use = found.use or Use(math.nan, "", -1)
        for name, value, words, unit in (
            ("life", found.life, "cycles for which the limits hold", "cycles"),
            ("life_low", found.life / FACTOR, "the same with rates twice as large", "cycles"),
            ("life_high", found.life * FACTOR, "the same with rates half as large", "cycles"),
            ("binding_quantity", use.quantity, "what misses its limit first", ""),
            ("binding_configuration", use.configuration, "where it does; -1 where nowhere", ""),
            *((("binding_output", use.output, "at which output", ""),) if self.m.outputs else ()),
            *((("binding_load_case", use.load_case, "in which load case", ""),) if self.m.load_cases else ()),
            *((("binding_contact", use.contact, "with which contact", ""),) if "contact" in builder.attrs else ()),
            ("status", found.status, "what life is", ""),
        ):
            builder.data[name] = Variable((), np.array(value), unit, words)
