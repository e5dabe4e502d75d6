"""`design`: which dimensions make the error small, with everything that has to hold.

minimise   the largest value of an aim over all configurations, or a weighted sum of several
subject to the limits of the file, every configuration with a pose, transmission angles, the tolerance of the target

over the values of the file that may vary. Of two aims the front is found: the designs of which none is better in both.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.nominal import Interrupted, Progress
from jointplay.analyses.processes import Processes, cores
from jointplay.analyses.recorded import recorded
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range
from jointplay.file.schema import DesignTable
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, to_dataset

from .attempts import Attempts, Candidate
from .report import AT_BOUND, Designed, report
from .search import LAST, DesignSearch, rank, tolerated, weighted, worked

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["compute", "design"]

#: attempts of a global search, points of a front, random specimens of an attempt
EVALUATIONS, POINTS, SAMPLES = 1000, 9, 4096
MOST_EVALUATIONS, MOST_POINTS, MOST_SAMPLES = 1_000_000, 100, 1_000_000
#: seconds of work for which further processes are started
WORTH = 5.0
#: losses of the aim for which it is said how far values may move
LOSSES = (0.01, 0.05)
#: values are rounded to this part of what they may vary by, or to up to so many digits more, so that it costs no more
#: than this part of the aim
ROUND, MORE_DIGITS, COST = 1e-5, 4, 1e-5
#: part of an aim by which nobody tells two designs apart
TOLD_APART = 1e-3


@typed
def design(
    m: Mechanism,
    vary: Mapping[str, Any] | None = None,
    aim: str | Sequence[str] | Mapping[str, float] | None = None,
    *,
    question: str | None = None,
    evaluations: int = EVALUATIONS,
    points: int = POINTS,
    samples: int = SAMPLES,
    seed: int = 0,
) -> xr.Dataset:
    """Choose dimensions that make an error small.

    Parameters
    ----------
    m : Mechanism
    vary : mapping, optional
        By key, as `Mechanism.with_` takes it, what a number of the file may become: two bounds, or a table with
        ``values`` or with ``from``, ``to`` and ``step``. As ``[design]`` of the file says if left out. To vary an entry
        of ``[variables]`` keeps the relations that expressions make.
    aim : str, two of them, or mapping, optional
        What is to be small where it is largest: ``worst_position``, ``worst_rotation``, ``loaded_position``,
        ``loaded_rotation``, ``structural``, ``structural_worst`` (structural error + worst position error),
        ``outside`` (share of the specimens outside the limits), ``drive_force``, ``size`` (diagonal of the box around
        all joints and outputs), ``cost`` (the least one that `allocate` finds for the worst case: with its sizes the
        limits hold, whatever those of the file are). Of two the front is found; of a mapping the sum of the aims times
        their weights.
    question : {"worst", "loaded"}, optional
        In which the limits of the error and of forces have to hold; ``worst`` if left out.
    evaluations : int
        Attempts of the global search at most; of a front for each of both ends.
    points : int
        Of a front.
    samples : int
        Random specimens of an attempt, for ``outside``.
    seed : int
        Of the search and of the specimens.

    Returns
    -------
    xarray.Dataset
        Over `variable`, by their keys and in units of the file: `value_before`, `value_found`, `lowest`, `highest`,
        `at_bound` (``lowest`` or ``highest`` where a bound is what stops it), and over `loss` (parts of the aim) and
        `side` `tolerated`: how far each may move alone until the aim is larger by this part, or something does not
        hold. Over `aim`: `aim_before`, `aim_found`. Over `held`, what has to hold: `used_before`, `used` (value /
        limit; 1 is the limit), `binding`. Of two aims over `front`: `front_aim`, `front_value`; `value_found` is then
        the one of them that is nearest to the least of both. `status` is ``ok``; or ``infeasible``: nothing was found
        that holds everything, and the nearest attempt is given. The attribute `changes` has the changed values, one
        ``KEY=VALUE`` a line. What is found is judged on the exact closure.

    Raises
    ------
    InputError
        When nothing may vary, a key is no number of the file, there is no aim, or what it needs is not in the file.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("p3r"))
    >>> found = jp.design(m, {"joints.J3.on.ground.0": [-200, 0]}, "worst_position", evaluations=100)
    >>> found.aim_before.item(), found.aim_found.item()  # doctest: +ELLIPSIS
    (4.43..., 2.40...)
    """
    return to_dataset(
        compute(
            m,
            vary,
            aim,
            question=question,
            evaluations=evaluations,
            points=points,
            samples=samples,
            seed=seed,
        )
    )


@recorded
def compute(
    m: Mechanism,
    vary: Mapping[str, Any] | None = None,
    aim: str | Sequence[str] | Mapping[str, float] | None = None,
    *,
    question: str | None = None,
    evaluations: int = EVALUATIONS,
    points: int = POINTS,
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> Result:
    """The light form of `design`."""
    in_range(evaluations, "evaluations", "a number of attempts", 1, MOST_EVALUATIONS)
    in_range(points, "points", "a number of points", 2, MOST_POINTS)
    in_range(samples, "samples", "a number of samples", 2, MOST_SAMPLES)
    in_range(seed, "seed", "a seed", 0, 2**64 - 1)
    table = _table(m, vary, aim, question)
    weights = dict(table.weights) or dict.fromkeys(table.aim or (), 1.0)
    attempts = Attempts(m, table, tuple(weights), samples, seed)
    is_front = table.aim is not None and len(table.aim) > 1
    rounds = 2 if is_front else 1
    before = tuple(one.before for one in attempts.variables)
    begun = time.process_time()
    answer = Designed(m, attempts, weights, attempts.at(before, exact=True), seed, LOSSES)
    lasts = (time.process_time() - begun) * rounds * evaluations
    processes = Processes(worked, (attempts,), cores() if lasts > WORTH else 1)
    search = DesignSearch(attempts, processes, evaluations, seed, progress, total=rounds * evaluations)
    objective = weighted(weights)
    try:
        if is_front:
            _front(search, answer, list(weights), points)
        else:
            best = _least(search, weights)
            if best.holds:
                best = _rounded(search, best, objective)
                answer.best = best
                answer.tolerated = tolerated(search, attempts.at(best.values), objective, LOSSES)
            answer.best = best
    except KeyboardInterrupt:
        known = [*search.exact, *([answer.best] if answer.best else [])]
        light = search.best(objective)
        if light is None:
            raise KeyboardInterrupt from None
        answer.best = min(known, key=lambda one: rank(one, objective), default=None) or attempts.at(
            light.values, exact=True
        )
        answer.incomplete = f"interrupted after {search.done} attempts; this is the best of them"
        answer.done = search.done
        raise Interrupted(report(answer)) from None
    finally:
        processes.close()
    answer.done = search.done
    return report(answer)


def _table(
    m: Mechanism,
    vary: Mapping[str, Any] | None,
    aim: str | Sequence[str] | Mapping[str, float] | None,
    question: str | None,
) -> DesignTable:
    """What the file says, with what is given in its place; checked as the file is."""
    changes: dict[str, object] = {} if vary is None else {"vary": vary}
    if isinstance(aim, Mapping):
        changes |= {"weights": aim, "aim": None}
    elif aim is not None:
        changes |= {"aim": [aim] if isinstance(aim, str) else [*aim], "weights": None}
    if question is not None:
        changes["question"] = question
    table = (m.with_({"design": {**m.raw.get("design", {}), **changes}}) if changes else m).data.design
    if table is None or not table.vary:
        problem = (
            'nothing may vary: say which values of the file, such as vary = { "joints.J3.on.ground.0" = [-200, 0] }'
        )
        raise InputError(problem, file=m.file, key="design.vary")
    if table.aim is None and not table.weights:
        raise InputError('say what is to be small, such as aim = "worst_position"', file=m.file, key="design.aim")
    return table


def _least(search: DesignSearch, weights: Mapping[str, float]) -> Candidate:
    """The best design for a weighted sum, judged on the exact closure."""
    objective = weighted(weights)
    search.everywhere(objective)
    search.nearby_each(search.starts(objective), weights)
    # What held nothing at first may do so now.
    light = search.best(objective)
    assert light is not None
    search.nearby(light, weights)
    light = search.best(objective)
    assert light is not None
    return _exactly(search, light.values, weights)


def _exactly(
    search: DesignSearch,
    values: Sequence[float],
    weights: Mapping[str, float],
    bounds: Mapping[str, float] | None = None,
) -> Candidate:
    """The best design near some values on the exact closure, with aims within bounds."""
    objective, start = weighted(weights), search.attempt(values, exact=True)
    # What holds to first order alone first comes back to what holds.
    for _ in range(1 if start.holds else 2):
        search.nearby(start, weights, bounds, exact=True, steps=LAST)
        inside = [one for one in search.exact if all(one.aim(n) <= most for n, most in (bounds or {}).items())]
        start = min(inside, key=lambda one: rank(one, objective), default=start)
    return start


def _rounded(search: DesignSearch, best: Candidate, objective: Any) -> Candidate:
    """The same with values of the fewest digits with which it is as good."""
    most = objective(best) * (1.0 + COST)
    for more in range(MORE_DIGITS + 1):
        values = []
        for one, value in zip(search.attempts.variables, best.values, strict=True):
            places = more - int(np.floor(np.log10(ROUND * one.span)))
            # What is at a bound stays there, whatever the digits of the bound.
            end = one.low if value - one.low < one.high - value else one.high
            at_end = abs(end - value) <= AT_BOUND * one.span
            short = end if at_end else min(max(round(value, places), one.low), one.high)
            values.append(value if one.choices else short)
        found = search.attempt(values, exact=True)
        if found.holds and objective(found) <= most:
            return found
    return best


def _front(search: DesignSearch, answer: Designed, names: Sequence[str], points: int) -> None:
    """The front of two aims: its ends, then one aim for bounds on the other in between."""
    first, second = names
    ends = [_least(search, {first: 1.0}), _least(search, {second: 1.0})]
    if not all(end.holds for end in ends):
        answer.best = ends[0]
        return
    # Among designs with the least of one the other one counts.
    for name, other, end in ((first, second, ends[0]), (second, first, ends[1])):
        ends.append(_exactly(search, end.values, {other: 1.0}, {name: end.aim(name) * (1.0 + ROUND)}))
    low, high = sorted(end.aim(second) for end in ends[2:])
    bounds = np.linspace(low, high, points).tolist()
    for bound in bounds[1:-1]:
        inside = [one for one in search.every if one.holds and one.aim(second) <= bound]
        start = min(inside, key=lambda one: one.aim(first), default=None)
        if start is not None:
            search.nearby(start, {first: 1.0}, {second: bound})
    chosen: dict[tuple[float, ...], float] = {}
    for bound in bounds:
        inside = [one for one in search.every if one.holds and one.aim(second) <= bound * (1.0 + 2.0 * ROUND)]
        if inside:
            least = min(inside, key=lambda one: (one.aim(first), one.aim(second)))
            chosen.setdefault(least.values, bound)
    exact = [search.attempt(values, exact=True) for values in chosen]
    exact = [
        one if one.holds else _exactly(search, one.values, {first: 1.0}, {second: bound})
        for one, bound in zip(exact, chosen.values(), strict=True)
    ]
    every = [one for one in (*exact, *ends) if one.holds]
    best = sorted(
        (one for one in every if not any(_beats(other, one, names) for other in every)),
        key=lambda one: (one.aim(first), one.aim(second)),
    )
    sizes = [max(one.aim(name) for one in best) or 1.0 for name in names]
    leasts = [min(one.aim(name) for one in best) for name in names]
    for one in best:
        if not any(_is_alike(one, other, names, sizes) for other in answer.front):
            answer.front.append(one)
    answer.best = min(
        answer.front,
        key=lambda one: sum(
            ((one.aim(n) - least) / size) ** 2 for n, least, size in zip(names, leasts, sizes, strict=True)
        ),
    )


def _is_alike(one: Candidate, other: Candidate, names: Sequence[str], sizes: Sequence[float]) -> bool:
    """Whether nobody tells the aims of two designs apart."""
    return all(
        abs(one.aim(name) - other.aim(name)) <= TOLD_APART * size for name, size in zip(names, sizes, strict=True)
    )


def _beats(one: Candidate, other: Candidate, names: Sequence[str]) -> bool:
    """Whether one is no worse in both aims and better in one; where it is much better, rounded values are no worse."""
    pairs = [(one.aim(name), other.aim(name)) for name in names]
    return any(
        all(a <= b * (1.0 + worse) for a, b in pairs) and any(a < b * (1.0 - better) for a, b in pairs)
        for worse, better in ((1e-9, 1e-9), (2.0 * ROUND, TOLD_APART))
    )
