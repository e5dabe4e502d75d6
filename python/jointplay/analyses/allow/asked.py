"""How much of its limits a mechanism uses.

    used = largest value / limit                       worst, loaded, forces
    used = share outside the limits / share allowed    random

each the largest over configurations, quantities, outputs and load cases; of `loaded` over the middle, the largest and
the smallest play, and of `random` over the assumptions on where clearances are. Limits hold where `used` is 1 or less.
A configuration that cannot be assembled as drawn has no error and does not count; where it is the size of a source that
prevents the assembly, limits do not hold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.contacts import Assumed, assumptions, contacts
from jointplay.analyses.nominal import Nominal, within_another
from jointplay.analyses.questions import computation
from jointplay.analyses.several import places_of
from jointplay.basics.arrays import Array, Floats
from jointplay.core.compile import FORCE_LIMITS, LENGTHS
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism, looked_at
from jointplay.model.mobility import examine
from jointplay.questions import QUESTIONS
from jointplay.result import ROUNDING, STATUSES, Result, first_largest
from jointplay.result.verdict import READABLE, ends, ends_of_plays

#: configurations of each part of the mechanism
PlacesByPart = list[NDArray[np.intp]]

#: specimens under a load take ten times as long as others and scatter by fewer sources: as many are enough, ...
PRESSED = 4096
#: ... or as many as have so many outside
OUTSIDE = 10
#: what binds where not an error does: no pose, and a size that the file cannot have
ASSEMBLY, REFUSED = "assembly", "refused"
#: configurations that use less than this share of the most that one uses are looked at in the end only; and where
#: larger sizes never use less, so that hardly another one binds
NEAR, NEARER = 0.6, 0.95


@dataclass(frozen=True)
class Use:
    """How much of the limits is used, and where most of it."""

    #: 1 or less where limits hold; infinite where there is no pose
    used: float
    #: component, ``position`` or ``rotation``; ``assembly`` where a configuration has no pose, or where most of the
    #: specimens that are outside have none
    quantity: str
    #: its number; -1 where the size itself is refused
    configuration: int
    #: `output`, `load_case`: empty where the file has none
    output: str = ""
    load_case: str = ""
    #: where the clearances are; empty where that is not asked
    contact: str = ""
    #: share of the specimens that cannot be assembled there
    not_assembled: float = 0.0
    #: of every part of the mechanism the configurations that come near; None where all of them do
    near: PlacesByPart | None = None
    #: what every limit alone uses there, where it is how often any is missed that counts
    alone: Mapping[str, float] = field(default_factory=dict)

    @property
    def holds(self) -> bool:
        """Whether the limits hold."""
        return self.used <= 1.0

    def since(self, before: Use) -> Use:
        """Named by the limit that is missed more often than before: others may be missed as often whatever the size."""
        if not self.alone or self.quantity in (ASSEMBLY, REFUSED):
            return self
        grown = {name: share - before.alone.get(name, 0.0) for name, share in self.alone.items()}
        return replace(self, quantity=max(grown, key=grown.__getitem__))


class Asked:
    """A question that is asked again and again of a mechanism with other sizes.

    Parameters
    ----------
    m : Mechanism
    question : {"worst", "loaded", "random", "forces"}
    probability : float
        Share of the specimens that must keep to the limits.
    options : mapping
        Of the question.
    asker : str
        Who asks.
    needs_limits : bool
        Whether a file that says of no error what is acceptable is refused.
    """

    def __init__(
        self,
        m: Mechanism,
        question: str,
        probability: float,
        options: Mapping[str, Any],
        *,
        asker: str = "allow",
        needs_limits: bool = True,
    ) -> None:
        self.m, self.question, self.probability, self.asker = m, question, probability, asker
        self.options = {**QUESTIONS[question].asked_by[asker], **options}
        self.contacts = contacts(m, self.options.pop("contact", None)) if question == "random" else ()
        #: sizes that were tried
        self.looks = 0
        #: no force depends on which point is the output
        self.is_of_forces = not QUESTIONS[question].is_of_errors
        # A strained specimen takes up its clearances as its energy is least; of a determinate mechanism none is.
        is_rigid = not m.core.deformations
        self.is_monotone = is_rigid and self.is_of_forces
        if question == "worst":
            self.is_monotone = is_rigid or examine(m).is_determinate
        self.is_under_load = question == "loaded" or self.is_of_forces
        self.by_load = self.is_under_load or "loaded" in self.contacts
        parts = self.parts(m)
        self.has_limits = any(self._is_limited(one.part) for one in parts)
        if needs_limits and not self.has_limits:
            of_error = ("the error", ("position", "rotation", *m.components))
            what, names = ("forces", FORCE_LIMITS.values()) if self.is_of_forces else of_error
            problem = f"the file has no limits of {what}; say what is acceptable: [limits] with one of"
            raise InputError(f"{problem} {', '.join(names)}", file=m.file, key="limits")
        self.at = places_of([one.part for one in parts])
        self.every: PlacesByPart = [np.flatnonzero(_has_error(at.status)) for at in self.at]
        if not any(len(places) for places in self.every):
            raise InputError("no configuration can be assembled; `jointplay solve` says why", file=m.file, key="drives")

    def _is_limited(self, part: Mechanism) -> bool:
        return bool(part.limits.forces if self.is_of_forces else part.limits.errors)

    def parts(self, m: Mechanism) -> list[Assumed]:
        """The mechanism with each of its outputs, in each of its load cases where loads count."""
        if self.contacts:
            return assumptions(m, self.contacts)
        whole = m if self.is_under_load else m.without_load_cases()
        if self.is_of_forces and m.outputs:
            whole = m.only(output=m.outputs[0])
        return [Assumed("", part.of[1], part) for part in whole.every_part]

    def pressed(self, parts: Sequence[Assumed]) -> list[tuple[Mechanism, Nominal]]:
        """Parts in which the load decides where clearances are, with their configurations."""
        each = zip(parts, self.at, strict=True)
        return [(one.part, at) for one, at in each if one.is_loaded or self.question == "loaded"]

    @property
    def without_error(self) -> dict[int, str]:
        """Configurations that count and have no error as drawn, and why."""
        every = ((at, k) for at in self.at for k in np.flatnonzero(~_has_error(at.status) & at.counts).tolist())
        return dict(sorted((k, str(STATUSES[at.status[k]])) for at, k in every))

    @property
    def left_out(self) -> list[int]:
        """Configurations at which the machine cannot be."""
        return sorted({k for at in self.at for k in np.flatnonzero(~at.counts).tolist()})

    def use(self, changes: Mapping[str, object], near: PlacesByPart | None = None) -> Use:
        """How much of the limits is used with changes, at all configurations or at some of them."""
        self.looks += 1
        try:
            copy = looked_at(self.m, changes)
            for one in self.parts(copy):
                _ = one.part.core
        except InputError:
            return Use(np.inf, REFUSED, -1)
        return self.use_of(self.parts(copy), near)

    def use_of(
        self,
        parts: Sequence[Assumed],
        near: PlacesByPart | None = None,
        seen: Callable[[Result, NDArray[np.intp]], None] | None = None,
    ) -> Use:
        """How much of the limits the parts of a mechanism use, at all configurations or at some of them.

        At all of them every part is asked, else until one says that the limits are missed. With `seen`, which is
        handed the answers and their configurations, also those without limits are.
        """
        every = near is None
        near = self.every if near is None or self.is_under_load else near
        best = Use(-np.inf, "", -1)
        columns: list[Floats] = []
        for one, at, places in zip(parts, self.at, near, strict=True):
            limited = self._is_limited(one.part) or seen is not None
            if not limited or not len(places) or (best.used > 1.0 and not every):
                columns.append(np.full(len(places), np.inf if best.used > 1.0 else 0.0))
                continue
            names, used, alone, failed, lost = self._asked(one, at, places, seen)
            most = np.where(failed, np.inf, used)
            columns.append(most)
            k = int(first_largest(most))
            if most[k] > best.used:
                allowed = 1.0 - self.probability
                jammed = most[k] > 1.0 and lost[k] > max(allowed, 0.5 * most[k] * allowed)
                quantity = ASSEMBLY if failed[k] or jammed else names[int(np.argmax(alone[k]))]
                output = "" if self.is_of_forces else one.part.of[0]
                case = one.load_case if self.by_load else ""
                where = int(places[k]), output, case, one.contact, float(lost[k])
                each = zip(names, alone[k].tolist(), strict=True) if self.question == "random" else ()
                shares = {name: share for name, share in each if share >= 0.0}
                best = Use(float(most[k]), quantity, *where, alone=shares)
        largest = max((c.max(initial=0.0, where=np.isfinite(c)) for c in columns), default=0.0)
        least = (NEARER if self.is_monotone else NEAR) * largest
        kept = [p[c >= least] for p, c in zip(near, columns, strict=True)] if np.isfinite(best.used) else near
        # Where all of them count, there is none to be looked at in the end.
        is_whole = self.is_under_load or sum(map(len, kept)) == sum(map(len, self.every))
        return replace(best, near=None if len(parts) == 1 and is_whole else kept)

    def _asked(
        self,
        one: Assumed,
        at: Nominal,
        places: NDArray[np.intp],
        seen: Callable[[Result, NDArray[np.intp]], None] | None,
    ) -> tuple[Sequence[str], Floats, Floats, Array, Floats]:
        """The quantities, what is used of all limits and of each, where that is not known, and which share is lost."""
        # Loads may go by the number of the configuration.
        whole = len(places) == len(at) or (one.is_loaded and one.part.loads.vary) or self.is_under_load
        options = self.options | ({"contact": one.contact} if one.contact else {})
        if one.is_loaded:
            options["samples"] = min(options["samples"], max(PRESSED, math.ceil(OUTSIDE / (1.0 - self.probability))))
        with within_another():
            result = computation(self.question, self.asker)(one.part, at=at if whole else at.chosen(places), **options)
        if seen is not None:
            seen(result, np.arange(len(at)) if whole else places)
        (used, alone), failed = self._of(one.part, result), ~np.isin(result.get("status"), READABLE)
        for _, low, _ in ends_of_plays(result):
            failed |= np.isnan(low).any(axis=1)
        lost = np.zeros(len(failed))
        if self.question == "random":
            failures = result.get("failures")
            lost = failures[:, ~np.isin(STATUSES, READABLE)].sum(axis=1) / failures.sum(axis=1)
        names = result.labels("quantity")
        # What has no limit binds nowhere, not even where nothing is used of any.
        of_forces = "limit_used" in result.data
        limits = result.get("limit_used").T if of_forces else result.get("limit")
        alone = np.where(~np.isnan(limits).all(axis=1), alone, -1.0)
        chosen = places if whole else slice(None)
        return names, used[chosen], alone[chosen], failed[chosen], lost[chosen]

    def _of(self, part: Mechanism, result: Result) -> tuple[Floats, Floats]:
        """What is used of all limits, by configuration, and of each alone, shape (configuration, quantity)."""
        if self.question != "random":
            used = used_of_limits(part, result)
            return used.max(axis=1), used
        limited = np.isfinite(part.limits.bounds(part.quantities)).any(axis=1)
        shares = np.where(limited, np.nan_to_num(result.get("outside_quantity")), 0.0)
        # How often any is missed decides.
        return result.get("outside") / (1.0 - self.probability), shares / (1.0 - self.probability)


def used_of_limits(part: Mechanism, result: Result) -> Floats:
    """What errors or forces use of every limit, shape (configuration, quantity); none of what has no limit."""
    if "limit_used" in result.data:
        return np.maximum(np.nan_to_num(result.get("limit_used"), nan=0.0, posinf=np.inf) - ROUNDING, 0.0)
    below, above = result.get("limit").T
    lengths = np.array([name in (*LENGTHS, "position") for name in part.quantities])
    slack = ROUNDING * np.where(lengths, part.length / part.units.length, 1.0 / part.units.angle)
    every_end = [ends(result), *((low, high) for _, low, high in ends_of_plays(result))]
    used = [np.maximum(_share(high - slack, above), _share(-low - slack, -below)) for low, high in every_end]
    return np.asarray(np.max(used, axis=0))


def _share(values: Floats, limit: Floats) -> Floats:
    """Values by their limits, nan where there is none; a limit of zero is kept by no more than rounding."""
    size = np.where(limit > 0.0, limit, 1.0)
    shares = np.where(limit > 0.0, values / size, np.where(values > 0.0, np.inf, 0.0))
    known = np.where(np.isnan(shares), np.inf, shares)
    return np.asarray(np.where(np.isfinite(limit), np.maximum(known, 0.0), 0.0))


def _has_error(codes: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return np.isin(STATUSES[codes], READABLE)
