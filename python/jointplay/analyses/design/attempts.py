"""What becomes of a mechanism with other values: its aims, and what it uses of everything that has to hold.

used = value / limit, or limit / value where the value has to be at least the limit; it holds where used <= 1

Every attempt is a copy of the mechanism, which is asked as anybody would ask it. Before it is judged every
configuration needs a pose: the share of those without one is what a search goes down by until there are none.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jointplay.analyses import allocate, forces
from jointplay.analyses.allocate.items import items_of
from jointplay.analyses.allocate.looks import limits_of
from jointplay.analyses.allocate.report import FOUND
from jointplay.analyses.allow.asked import used_of_limits
from jointplay.analyses.ideal import compared, strays
from jointplay.analyses.nominal import OK, OUTSIDE, Nominal, within_another
from jointplay.analyses.processes import Processes
from jointplay.analyses.questions import computation
from jointplay.analyses.ranges import coordinates
from jointplay.analyses.several import places_of
from jointplay.analyses.transmission import angle, lines, place_of
from jointplay.basics.arrays import Floats
from jointplay.core.compile import limit_key
from jointplay.errors import InputError, listed
from jointplay.file.schema import DesignTable, NotAnExpression, Variables, Variation, variables_of
from jointplay.model.mechanism import Mechanism
from jointplay.questions import QUESTIONS
from jointplay.result import Result, figure, parts
from jointplay.result.verdict import READABLE, ends, reached

ASSEMBLY = "assembly"
TURN = 2.0 * np.pi
#: by aim the question that is asked for it; none needs only the nominal mechanism
ASKS: Mapping[str, str] = {
    "worst_position": "worst",
    "worst_rotation": "worst",
    "structural_worst": "worst",
    "loaded_position": "loaded",
    "loaded_rotation": "loaded",
    "drive_force": "loaded",
    "outside": "random",
}
WORDS: Mapping[str, str] = {
    "worst_position": "the largest worst position error",
    "worst_rotation": "the largest worst rotation",
    "loaded_position": "the largest position error under the loads",
    "loaded_rotation": "the largest rotation under the loads",
    "structural": "the largest structural error",
    "structural_worst": "the largest sum of structural and worst error",
    "outside": "the largest share of the specimens outside the limits",
    "drive_force": "the largest force or moment of a drive",
    "size": "the diagonal of the box around all joints and outputs, wherever they go",
    "cost": "the least cost of clearances and tolerances with which the limits hold in the worst case",
}
#: what is said to be used of limits that sizes are chosen for: they use them as a whole
CHOSEN = 1.0 - 1e-6


@dataclass(frozen=True)
class DesignVariable:
    """A value that may be chosen anew."""

    key: str
    #: in the file
    before: float
    low: float
    high: float
    #: the values of a catalogue; none between bounds
    choices: tuple[float, ...]

    @property
    def span(self) -> float:
        """From bound to bound; never zero."""
        return (self.high - self.low) or 1.0


@dataclass(frozen=True)
class Candidate:
    """What was found with some values."""

    #: in the order of the variables
    values: tuple[float, ...]
    #: by aim its values, of which the largest counts
    aims: Mapping[str, Floats] = field(default_factory=dict)
    #: by what has to hold what is used of it
    used: Mapping[str, Floats] = field(default_factory=dict)
    #: share of the configurations without a pose or an error; infinite where the file would be refused
    lost: float = 0.0
    #: what refuses it
    why: str = ""

    def aim(self, name: str) -> float:
        """The largest value of an aim; nan where it is not known."""
        return float(self.aims[name].max()) if name in self.aims else np.nan

    @property
    def largest(self) -> dict[str, float]:
        """By what has to hold the most that is used of it anywhere."""
        most = {ASSEMBLY: 1.0 + self.lost} if self.lost else {}
        return most | {name: float(values.max()) for name, values in self.used.items()}

    @property
    def beyond(self) -> float:
        """How far it is from holding everything; zero where it does."""
        if self.lost:
            # Anything with a pose is nearer.
            return 1e3 * (1.0 + self.lost)
        return float(sum(min(max(most - 1.0, 0.0), 1e3 / len(self.used)) for most in self.largest.values()))

    @property
    def holds(self) -> bool:
        """Whether everything has a pose and holds."""
        return self.beyond <= 0.0


class Attempts:
    """All that was tried.

    Parameters
    ----------
    m : Mechanism
    table : DesignTable
    aims : sequence of str
    samples, seed : int
        Of random specimens.
    """

    def __init__(self, m: Mechanism, table: DesignTable, aims: Sequence[str], samples: int, seed: int) -> None:
        self.m, self.table, self.aims = m, table, tuple(aims)
        self.variables = [_variable(m, key, variation) for key, variation in table.vary.items()]
        self.random = {"samples": samples, "seed": seed}
        self.known: dict[tuple[tuple[float, ...], bool], Candidate] = {}
        self._check()

    def _check(self) -> None:
        m, every = self.m, self.m.every_part
        targets = {"structural", "structural_worst"} & {*self.aims}
        if targets and not m.has_target:
            problem = f"{listed(sorted(targets))} needs a [target] of every output, from which it is measured"
            raise InputError(problem, file=m.file, key="design.aim")
        wanted = [part.ideal.wanted for part in every if part.ideal is not None and part.ideal.wanted is not None]
        if "structural_worst" in self.aims and any(one.joint is not None for one in wanted):
            problem = "structural_worst: the target is of a joint, whose error is none of the output; take structural"
            raise InputError(problem, file=m.file, key="design.aim")
        loaded = [name for name in self.aims if ASKS.get(name) == "loaded"]
        loaded += ["question = 'loaded'"] * (self.table.question == "loaded")
        if loaded and not m.has_loads:
            raise InputError(f"{listed(loaded)}: nothing loads the mechanism", file=m.file, key="design.aim")
        if "outside" in self.aims and not any(part.limits.errors for part in every):
            raise InputError("outside counts specimens outside limits: say [limits]", file=m.file, key="design.aim")
        for part in every if m.limits.forces else ():
            # Refuses what has no forces, and no attempt changes.
            forces.check(part)
        if "cost" in self.aims and self.table.question != "worst":
            problem = "cost: sizes are chosen for the worst case; leave out question"
            raise InputError(problem, file=m.file, key="design.question")
        if "cost" in self.aims:
            # Refuses what has no limits or no costs, and what sizes cannot be chosen for.
            items_of(m.without_load_cases(), allocate.MOST_DIGITS)
            limits_of(m)
        if "drive_force" in self.aims and len({m.coordinate_kind(k) for k in m.drive_joints}) > 1:
            problem = "drive_force: some drives have forces and some moments, of which none is the larger"
            raise InputError(problem, file=m.file, key="design.aim")
        self.crossings = {name: lines(m, name) for name in self.table.transmission}

    def at(self, values: Sequence[float], *, exact: bool = False) -> Candidate:
        """What becomes of some values; to first order unless `exact`."""
        key = (tuple(float(value) for value in values), exact)
        if key not in self.known:
            self.known[key] = self._try(key[0], exact)
        return self.known[key]

    def ahead(self, every: Sequence[tuple[Sequence[float], bool]], processes: Processes) -> None:
        """Try values, each exactly or not, side by side; they are known then."""
        keys = dict.fromkeys((tuple(float(value) for value in values), exact) for values, exact in every)
        unknown = [key for key in keys if key not in self.known]
        self.known.update(zip(unknown, processes.each(unknown), strict=True))

    def changes(self, values: Sequence[float]) -> dict[str, float]:
        """Values by key."""
        return {one.key: float(value) for one, value in zip(self.variables, values, strict=True)}

    def _try(self, values: tuple[float, ...], exact: bool) -> Candidate:
        try:
            copy = self.m.with_(self.changes(values))
            outputs = [copy.only(output).without_load_cases() for output in copy.outputs or (None,)]
            places = places_of(outputs)
        except InputError as problem:
            return Candidate(values, lost=np.inf, why=str(problem))
        lost = np.mean([~np.isin(at.status, (OK, OUTSIDE)) for at in places])
        if lost > 0.0:
            return Candidate(values, lost=float(lost))
        try:
            return self._asked(values, copy, [*zip(outputs, places, strict=True)], exact)
        except InputError as problem:
            return Candidate(values, lost=np.inf, why=str(problem))

    def _asked(
        self, values: tuple[float, ...], m: Mechanism, nominals: list[tuple[Mechanism, Nominal]], exact: bool
    ) -> Candidate:
        used, aims = self._of_nominal(nominals)
        limited = any(part.limits.errors for part in m.every_part) and "cost" not in self.aims
        if "cost" in self.aims:
            with within_another():
                chosen = allocate.compute(m, digits=allocate.MOST_DIGITS)
            most = float(chosen.get("used").max())
            aims["cost"] = [chosen.get("total_cost")]
            used["limits"] = [np.array(CHOSEN if chosen.get("status") in FOUND else max(most, 1.0 / CHOSEN))]
        questions = {ASKS[name] for name in self.aims if name in ASKS} | ({self.table.question} if limited else set())
        unreliable: list[float] = []
        options: dict[str, Any]
        for question in sorted(questions):
            options = {**QUESTIONS[question].asked_by["design"]}
            options |= self.random if question == "random" else {"exact": exact}
            if "drive_force" in self.aims and question == "loaded":
                options["details"] = True
            with within_another():
                result = computation(question, "design")(m, at=nominals[0][1], **options)
            for (_, each), part in zip(parts(result), self._parts(m, question), strict=True):
                unreliable.append(_unreliable(each))
                for name in self.aims:
                    if ASKS.get(name) == question:
                        aims.setdefault(name, []).append(_figure(each, name, compared(part)[1]))
                if question == self.table.question and part.limits.errors:
                    for k, name in enumerate(part.quantities):
                        if name in part.limits.errors:
                            used.setdefault(limit_key(name), []).append(used_of_limits(part, each)[:, k])
        if m.limits.forces:
            with within_another():
                result = forces.compute(m, self.table.question, at=nominals[0][1])
            for _, each in parts(result):
                unreliable.append(_unreliable(each))
                for name, share in zip(each.labels("quantity"), used_of_limits(m, each).T, strict=True):
                    if name in m.limits.forces:
                        used.setdefault(limit_key(name), []).append(share)
        if lost := max(unreliable, default=0.0):
            return Candidate(values, lost=lost)
        return Candidate(values, _joined(aims), _joined(used))

    @staticmethod
    def _parts(m: Mechanism, question: str) -> list[Mechanism]:
        """The parts of a mechanism in the order of the answers."""
        return (m if question == "loaded" else m.without_load_cases()).every_part

    def _of_nominal(
        self, nominals: list[tuple[Mechanism, Nominal]]
    ) -> tuple[dict[str, list[Floats]], dict[str, list[Floats]]]:
        """What the nominal mechanism uses of its ranges, and its aims."""
        used: dict[str, list[Floats]] = {}
        aims: dict[str, list[Floats]] = {}
        part, at = nominals[0]
        values, angular = coordinates(part, at.drives, at.poses)
        for name, span in part.limits.joints.items():
            k = part.joints.index(name)
            used[f"limits.joints.{name}"] = [_of_range(values[:, k], span, turns=bool(angular[k]))]
        for name, span in part.limits.drives.items():
            used[f"limits.drives.{name}"] = [_of_range(at.drives[:, part.drives.index(name)], span, turns=False)]
        near = part.core.measure(at.drives, at.poses)["singular_value"]
        used["limits.singular_value"] = [part.limits.singular_value / np.maximum(near, 1e-300)]
        for name, crossing in self.crossings.items():
            least = self.table.transmission[name] * part.units.angle
            used[f"design.transmission.{name}"] = [least / np.maximum(angle(part, at, crossing), 1e-9)]
        for part, at in nominals:
            off = strays(part, at.drives, at.poses, at.output, at.status == OK)
            if off is not None and part.ideal is not None and np.isfinite(off.size).any():
                far = np.nan_to_num(off.size)
                wanted = part.ideal.wanted
                factor = part.units.length if wanted is None else wanted.factor
                if "structural" in self.aims:
                    aims.setdefault("structural", []).append(far / factor)
                if np.isfinite(part.ideal.tolerance):
                    used.setdefault("target.tolerance", []).append(far / part.ideal.tolerance)
        if "size" in self.aims:
            aims["size"] = [np.array([_diagonal(nominals) / nominals[0][0].units.length])]
        return used, aims


def _unreliable(result: Result) -> float:
    """The share of the configurations without numbers that can be relied on."""
    return float(np.mean(~np.isin(result.get("status"), (*READABLE, "outside_limits"))))


def _joined(parts: Mapping[str, Sequence[Floats]]) -> dict[str, Floats]:
    """By name the values of all outputs and load cases."""
    return {name: np.concatenate([*map(np.atleast_1d, each)]) for name, each in parts.items()}


def _variable(m: Mechanism, key: str, variation: Variation) -> DesignVariable:
    value = m.value(key)
    if isinstance(value, str):
        # A text that has no value is a name.
        with suppress(NotAnExpression):
            value = Variables(*variables_of(m.raw)).number(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError("is not a number; only numbers can be varied", file=m.file, key=key)
    return DesignVariable(key, float(value), *variation.bounds, variation.choices)


def _figure(result: Result, name: str, kind: str) -> Floats:
    """Values of an aim, in units of the file; those of a target are lengths or angles."""
    if name == "structural_worst":
        # Of a target of an angle the rotation.
        return np.asarray(ends(result)[1][:, -2 if kind == "length" else -1])
    if name == "outside":
        return np.asarray(result.get("outside"))
    if name == "drive_force":
        return np.asarray(np.abs(result.get("drive_torque")).max(axis=1))
    if name in ("loaded_position", "loaded_rotation"):
        # What the load leaves open counts: in the middle of its play nothing holds the machine.
        _, high = reached([result.get("error")], result.get("undetermined"), result.labels("component"))
        return np.asarray(high[:, -2 if name == "loaded_position" else -1])
    return figure(result, name.rpartition("_")[2])[0]


def _of_range(values: Floats, span: tuple[float, float], *, turns: bool) -> Floats:
    """What a coordinate uses of its range, from the middle to either end."""
    low, high = span
    off = values - 0.5 * (low + high)
    if turns:
        off = off - TURN * np.round(off / TURN)
    return np.asarray(np.abs(off) / max(0.5 * (high - low), 1e-12))


def _diagonal(nominals: list[tuple[Mechanism, Nominal]]) -> float:
    """Of the box around all joints and outputs."""
    part, at = nominals[0]
    points = {point for pair in part.joint_points for point in pair} | {one.output_point for one, _ in nominals}
    every = np.concatenate([place_of(part, at, point) for point in sorted(points)])
    return float(np.linalg.norm(np.ptp(every, axis=0)))
