"""`allow`: the largest size of every source with which the limits hold, and which fit one may order.

    allowed = the largest size up to which limits hold from the size that is there on, all other sources as they are;
              where they are missed with that, the largest one up to which they hold at every smaller one, too
    slack   = allowed - size
    allowed_factor: the same of the sizes of all sources times one factor

Every size that is tried is a copy of the mechanism, which is asked the question as anybody would ask it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.nominal import Interrupted, Progress
from jointplay.analyses.questions import check
from jointplay.analyses.recorded import recorded
from jointplay.analyses.running import add_largest_rate, loses_contact, speeds
from jointplay.basics.typed import typed
from jointplay.errors import InputError, shown
from jointplay.model.gaps import known_deviations
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings, times
from jointplay.result import Result, ResultBuilder, Variable, to_dataset

from .asked import ASSEMBLY, Asked, Use
from .needed import Needed
from .order import loosest, why_none
from .search import AllowSearch, Found

if TYPE_CHECKING:
    import xarray as xr

#: three sigma to both sides of a normal law
PROBABILITY = 0.9973
#: specimens per configuration and size
SAMPLES = 20_000
TOLERANCE = 1e-4
FINEST, COARSEST = 1e-10, 0.1
#: no factor of all sizes is larger
MOST_TIMES = 1000.0
#: kelvin; no larger tolerance of the temperature is tried
HOTTEST = 1000.0
#: relative change of a size by which the slope of a share is found
STEP = 0.05


@typed
def allow(
    m: Mechanism,
    question: str = "worst",
    *,
    probability: float | None = None,
    tolerance: float = TOLERANCE,
    **options: Any,
) -> xr.Dataset:
    """Find the largest size of every source with which the limits of the file hold.

    Parameters
    ----------
    m : Mechanism
        With limits of the error, or of forces.
    question : {"worst", "loaded", "random", "forces"}
        In which limits have to hold, at every configuration: those of the error in the worst case, where the loads push
        the mechanism, or for a share of the specimens; or those of forces in the worst case, see `forces`.
    probability : float, optional
        random: the share of the specimens that has to keep to all limits of an output, at every configuration;
        that of the file if left out, else 0.9973.
    tolerance : float
        Relative: limits hold at `allowed`, and are missed at `allowed * (1 + 2 * tolerance)`.
    **options
        Of the question, such as ``samples`` and ``seed``. Of random there are 20,000 samples if left out; without a
        ``contact`` it is the one that the file names, and where the file has loads and names none, the share has to
        keep to the limits both ways: with clearances that scatter, and where the load decides where they are.

    Returns
    -------
    xarray.Dataset
        Over `source`, in the units of the file (`source_unit`): `size` (of a clearance the largest play, as the file
        measures it, see `source_measure`), `allowed` (the largest size up to which the limits hold, all other sources
        as they are), `smallest` (the smallest size from which on they do, zero for most), `too_small` (the largest
        size below it that was found to be too small), `too_small_not_assembled` (the share of the specimens that
        cannot be assembled there), `slack` (allowed - size), `used_without` (what is used of the limits with this
        source at zero), `fit` (the loosest preferred fit, or group of ball bearings, with which the limits hold),
        `without_fit` (why none is named: ``no_diameter``; ``not_in_standard``; ``no_fit_holds`` or ``no_group_holds``,
        where the limits do not hold with the tightest),
        `binding_quantity` and `binding_configuration` (what misses its limit first beyond `allowed`), `status`: ``ok``;
        ``unlimited``, where the limits hold up to `allowed`, the largest size that was tried; ``no_effect``, where that
        size changes nothing of what is limited; ``not_enough``, where they are missed at size zero as well;
        ``needs_play``, where they hold with the size as it is and are missed at size zero; ``fixed``, where the size
        cannot be changed. Of an over-constrained mechanism `needed`: the smallest size with which all specimens within
        the tolerances can be assembled without strain. With `random` `allowed_standard_error`, from the number of
        samples.

        And `allowed_factor`, by which all sizes may be multiplied, with `factor_status`, `factor_binding_quantity` and
        `factor_binding_configuration`; `used`, the largest part of a limit that is used as it is (of `random` of the
        share that may be outside), with `used_not_assembled`, the share of the specimens that cannot be assembled
        there. With loads and `random`, `used_contact` and `binding_contact` say with which contact that is; with
        several outputs `used_output`, `factor_binding_output` and `binding_output` which one it is. Of a
        machine that runs `contact_rate`, the largest with the sizes as they are, with `contact`, `contact_source` and
        `contact_configuration`, see `loaded`.

    Raises
    ------
    InputError
        When the file has no such limits, nothing is off, the question has no such option, or so few samples
        are asked for that one of them is more than may be outside.

    Notes
    -----
    In the worst case more play never makes the error smaller where nothing is strained, be it that bodies are rigid or
    that the mechanism is determinate, so that the limits hold at every size up to `allowed`. Elsewhere sizes are tried
    in equal steps, so that a smaller size at which limits are missed is found unless it lies between two of them.
    Smaller sizes that are too small to be assembled do not count: teeth that jam, parts of an over-constrained
    mechanism that do not fit together. Nor do any that are smaller than the size as it is, where that holds: `smallest`
    tells them.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 4.0})
    >>> result = jp.allow(m)
    >>> result.allowed.sel(source="J3").item()  # doctest: +ELLIPSIS
    1.1...
    """
    return to_dataset(compute(m, question, probability=probability, tolerance=tolerance, **options))


@recorded
def compute(
    m: Mechanism,
    question: str = "worst",
    *,
    probability: float | None = None,
    tolerance: float = TOLERANCE,
    looks: int | None = None,
    first: Sequence[str] = (),
    progress: Progress | None = None,
    **options: Any,
) -> Result:
    """The light form of `allow`.

    `looks` says after how many sizes no other source is begun, `first` in which order: those first whose names, or
    those of a part of them, stand there first.
    """
    share, options = prepared(m, question, probability, tolerance, options, "allow")
    base, sources = sizings(m)
    if not sources:
        raise InputError("nothing is off: give a joint a clearance, or a dimension a tolerance", file=m.file)
    asked = Asked(base, question, share, options)
    every = _Every(asked, sources, tolerance)
    done: list[_One] = []
    rank = {name: k for k, name in enumerate(first)}
    in_turn = sorted(sources, key=lambda one: min(rank.get(name, len(rank)) for name in one.sources))
    try:
        every.find()
        for k, source in enumerate(in_turn):
            if looks is not None and asked.looks >= looks:
                break
            if progress is not None:
                progress(k + 1, len(sources) + 1)
            done.append(every.one(source))
        if progress is not None:
            progress(len(sources) + 1, len(sources) + 1)
    except KeyboardInterrupt:
        if not done:
            # Part of one source is no answer.
            raise KeyboardInterrupt from None
        result = _result(every, done, question, share, options)
        words = f"interrupted after {len(done)} of {len(sources)} sources"
        raise Interrupted(Result(result.coords, result.data, {**result.attrs, "incomplete": words})) from None
    result = _result(every, sorted(done, key=lambda one: sources.index(one.source)), question, share, options)
    if len(done) == len(sources):
        return result
    return replace(result, attrs={**result.attrs, "incomplete": f"found of {len(done)} of {len(sources)} sources"})


def keeps(result: Result) -> bool:
    """Whether every configuration can be assembled, and the limits hold with the sizes as they are."""
    return not loses_contact(result) and "without_pose" not in result.attrs and bool(result.get("used") <= 1.0)


def prepared(
    m: Mechanism, question: str, probability: float | None, tolerance: float, options: dict[str, Any], asker: str
) -> tuple[float, dict[str, Any]]:
    """The share of the specimens that has to keep to the limits, and the options with the number of samples.

    Raises
    ------
    InputError
        When there is no such question, option, share or tolerance, or too few samples.
    """
    check(question, options, asker)
    if not FINEST <= tolerance <= COARSEST:
        problem = f"a relative tolerance from {FINEST:g} to {COARSEST:g} is needed, not {shown(tolerance)}"
        raise InputError(problem, key="tolerance")
    share = _share(m, question, probability)
    if question == "random":
        options = {"samples": SAMPLES, **options}
        if not options.get("rare"):
            _require_enough(options["samples"], share)
    return share, options


def _share(m: Mechanism, question: str, given: float | None) -> float:
    """As given, that of the file, or three sigma."""
    if given is None:
        own = m.limits.probability
        return PROBABILITY if math.isnan(own) else own
    if question != "random":
        raise InputError(f"goes with the question random; {question} has no shares", key="probability")
    if not 0.0 < given < 1.0:
        raise InputError(f"a number between 0 and 1 is needed, not {shown(given)}", key="probability")
    return given


def _require_enough(samples: int, share: float) -> None:
    """Refuse so few samples that one of them is more than the share that may be outside."""
    # The difference from 1 is rounded.
    least = math.ceil((1.0 - 1e-12) / (1.0 - share))
    if samples < least:
        problem = f"{shown(samples)} are too few to tell that {share:g} of the specimens keep to the limits; at least"
        raise InputError(f"{problem} {least:,} are needed", key="samples")


class _One:
    """What was found of one source."""

    def __init__(self, source: Sizing, found: Found, needed: float, fit: str, without_fit: str, error: float) -> None:
        self.source, self.found, self.needed, self.error = source, found, needed, error
        self.fit, self.without_fit = fit, without_fit


class _Every:
    """All sources, one after the other and all by one factor."""

    def __init__(self, asked: Asked, sources: Sequence[Sizing], tolerance: float) -> None:
        self.asked, self.sources, self.tolerance = asked, sources, tolerance
        self.now = asked.use_of(asked.parts(asked.m))
        self.factor: Found | None = None
        self.needed = None if asked.m.core.isostatic else Needed(asked.m, asked.at[0])

    def find(self) -> None:
        """The factor of all sizes."""
        self.factor = self._search(self._times, 1.0, MOST_TIMES, 1.0)

    def one(self, source: Sizing) -> _One:
        """The sizes of one source."""
        fit = loosest(self.asked, source)
        fits = fit, why_none(self.asked, source, fit)
        if source.fixed:
            nothing = Found("fixed", math.nan, Use(math.nan, "", -1), Use(math.nan, "", -1))
            return _One(source, nothing, math.nan, *fits, math.nan)
        largest = self._largest(source.kind)
        found = self._search(source.resized, source.size, largest, 1e-3 * largest)
        smallest = math.nan
        if self.needed is not None and source.key.endswith("clearance"):
            smallest = self.needed.of(source, largest, self.tolerance)
        return _One(source, found, smallest, *fits, self._error(source, found))

    def _search(self, changes: Any, size: float, largest: float, guess: float) -> Found:
        def use(new: float, near: Any) -> Use:
            return self.asked.use(changes(new), near)

        return AllowSearch(
            use,
            size,
            self.now,
            largest,
            guess,
            tolerance=self.tolerance,
            is_monotone=self.asked.is_monotone,
        ).found()

    def _times(self, factor: float) -> dict[str, object]:
        """All sizes times a factor."""
        return times(self.sources, factor)

    def _largest(self, kind: str) -> float:
        """The largest size that is tried: the mechanism's own, a quarter of a turn."""
        m = self.asked.m
        return {"length": m.length / m.units.length, "angle": 0.5 * math.pi / m.units.angle}.get(kind, HOTTEST)

    def _error(self, source: Sizing, found: Found) -> float:
        """Standard error of an allowed size that is found from samples."""
        if self.asked.question != "random" or found.status != "ok" or not found.allowed > 0.0:
            return math.nan
        low, high = (self.asked.use(source.resized(found.allowed * (1.0 + s))).used for s in (-STEP, STEP))
        slope = (high - low) * (1.0 - self.asked.probability) / (2.0 * STEP * found.allowed)
        if not (math.isfinite(slope) and slope > 0.0):
            return math.nan
        p = self.asked.probability
        return math.sqrt(p * (1.0 - p) / self.asked.options["samples"]) / slope


def _result(every: _Every, done: Sequence[_One], question: str, share: float, options: Mapping[str, Any]) -> Result:
    m, now, factor = every.asked.m, every.now, every.factor
    assert factor is not None
    builder = ResultBuilder(m, "allow", asked=question, tolerance=every.tolerance)
    if question == "random":
        builder.attrs |= {"probability": share, "samples": options["samples"], "seed": options.get("seed", 0)}
        if m.has_loads:
            builder.attrs["contact"] = ", ".join(every.asked.contacts)
    if question == "loaded" or "loaded" in str(builder.attrs.get("contact", "")):
        builder.attrs |= speeds(m)
        add_largest_rate(builder, every.asked.pressed(every.asked.parts(m)), "with the sizes as they are")
    if question == "loaded" and "size" in m.source_kinds:
        builder.attrs["sizes"] = options.get("sizes", "middle")
    if without := every.asked.without_error:
        builder.attrs["without_pose"] = ", ".join(map(str, without))
        builder.attrs["without_pose_status"] = ", ".join(dict.fromkeys(without.values()))
    if left_out := every.asked.left_out:
        builder.attrs["left_out"] = ", ".join(map(str, left_out))
    if fixed := [one.source.name for one in done if one.source.fixed]:
        builder.attrs["fixed"] = ", ".join(fixed)
    sources = [one.source for one in done]
    units = [builder.name(s.kind) if s.kind != "temperature" else "K" for s in sources]
    unit = units[0] if len(set(units)) == 1 else "see source_unit"
    builder.labels("source", [s.name for s in sources], "source")
    builder.attrs |= known_deviations(m)
    kinds = [m.source_kinds[m.sources.index(s.sources[0])] for s in sources]
    for name, values, words in (
        ("source_unit", units, "unit along source"),
        ("source_kind", kinds, "what the source is"),
        ("source_measure", [s.measure for s in sources], "what its size is"),
        ("source_key", [s.key for s in sources], "where the file has its size"),
    ):
        builder.coords[name] = Variable(("source",), np.array(values, dtype=str), "", words)

    def add(name: str, values: Sequence[float], words: str, units: str = unit) -> None:
        builder.data[name] = Variable(("source",), np.array(values, dtype=np.float64), units, words)

    allowed = [one.found.allowed for one in done]
    add("size", [s.size for s in sources], "size as it is")
    add("allowed", allowed, "largest size up to which the limits hold")
    add("smallest", [one.found.smallest for one in done], "smallest size from which on the limits hold")
    add("too_small", [one.found.too_small for one in done], "largest size below it that was found to be too small")
    add("slack", [a - s.size for a, s in zip(allowed, sources, strict=True)], "allowed - size")
    if every.needed is not None:
        words = "smallest size with which all specimens can be assembled without strain"
        add("needed", [one.needed for one in done], words)
    if question == "random":
        add("allowed_standard_error", [one.error for one in done], "standard error of allowed, from the samples")
    add("used_without", [one.found.without.used for one in done], "what is used of the limits without the source", "")
    below = [one.found.below for one in done]
    lost = [math.nan if use is None else max(use.not_assembled, use.quantity == ASSEMBLY) for use in below]
    if question == "random":
        lost = [math.nan if use is None else use.not_assembled for use in below]
    add("too_small_not_assembled", lost, "share of the specimens that cannot be assembled there", "")
    _words(builder, done)
    _of_all(builder, now, factor)
    statuses = np.array([one.found.status for one in done], dtype=str)
    builder.data["status"] = Variable(("source",), statuses, "", "what allowed is")
    return builder.result()


def _words(builder: ResultBuilder, done: Sequence[_One]) -> None:
    """What is no number over the sources, and where limits are missed first."""
    fits = np.array([one.fit for one in done], dtype=str)
    builder.data["fit"] = Variable(("source",), fits, "", "loosest preferred fit, or group of bearings, that holds")
    without = np.array([one.without_fit for one in done], dtype=str)
    builder.data["without_fit"] = Variable(("source",), without, "", "why no fit is named; empty where none is asked")
    uses = [one.found.use for one in done]
    for name, values, words in (
        ("quantity", [use.quantity for use in uses], "what misses its limit first"),
        ("configuration", [use.configuration for use in uses], "where it does; -1 where nowhere"),
        *((("output", [use.output for use in uses], "at which output"),) if builder.m.outputs else ()),
        *((("load_case", [use.load_case for use in uses], "in which load case"),) if builder.m.load_cases else ()),
        *((("contact", [use.contact for use in uses], "with which contact"),) if "contact" in builder.attrs else ()),
    ):
        builder.data[f"binding_{name}"] = Variable(("source",), np.array(values), "", words)


def _of_all(builder: ResultBuilder, now: Use, factor: Found) -> None:
    """Figures of all sources together."""
    for name, value, words in (
        ("used", now.used, "largest part of a limit that is used"),
        ("used_quantity", now.quantity, "of which quantity"),
        ("used_configuration", now.configuration, "at which configuration"),
        *((("used_output", now.output, "of which output"),) if builder.m.outputs else ()),
        ("used_not_assembled", now.not_assembled, "share of the specimens that cannot be assembled there"),
        *((("used_contact", now.contact, "with which contact"),) if "contact" in builder.attrs else ()),
        ("allowed_factor", factor.allowed, "factor of all sizes up to which the limits hold"),
        ("factor_status", factor.status, "what allowed_factor is"),
        ("factor_binding_quantity", factor.use.quantity, "what misses its limit first"),
        ("factor_binding_configuration", factor.use.configuration, "where it does"),
        *((("factor_binding_output", factor.use.output, "at which output"),) if builder.m.outputs else ()),
    ):
        builder.data[name] = Variable((), np.array(value), "", words)
