"""The search: differential evolution over the whole box, then sequential quadratic programming from the best.

minimise    sum_i w_i t_i           over x and t
subject to  f_i,k(x) <= t_i         every aim at every configuration
            used_j,k(x) <= 1        everything that has to hold

The largest value over configurations has edges where another configuration becomes the largest one; with t for it all
functions are smooth again, and the optimum is met to rounding. Differential evolution (Storn and Price 1997) goes by
Deb's rules: what holds is better than what does not, what is nearer to holding is better than what is not. It sees only
the order of attempts, so they are mapped to [0, 1) where everything holds and above 1 where it does not.
"""

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.analyses.processes import Processes
from jointplay.basics.arrays import Floats

from .attempts import Attempts, Candidate

#: attempts of a generation, per variable and at least
CROWD, FEWEST = 8, 16
#: a generation whose attempts are as alike is the last one: the search that follows finds the bottom of a valley
ALIKE = 1e-2
#: starts of the search that follows, steps of each, and of the last one on the exact closure
STARTS, STEPS, LAST = 3, 40, 12
#: part of a range by which slopes are found
STEP = 1e-6
#: limits are kept by this part of them, so that they hold in spite of rounding
KEPT = 1e-7
#: a row with this ceiling is free
FREE = 1e3
Objective = Callable[[Candidate], float]


@dataclass
class DesignSearch:
    """A search among attempts."""

    attempts: Attempts
    #: where attempts that do not depend on one another are made
    processes: Processes
    #: attempts of the global search
    evaluations: int
    seed: int
    progress: Progress | None = None
    #: `done`, `total`: attempts that are made, and those that may be
    done: int = 0
    total: int = 0
    every: list[Candidate] = field(default_factory=list)
    exact: list[Candidate] = field(default_factory=list)

    def ahead(self, every: Sequence[Sequence[float] | Floats], *, exact: bool = False) -> None:
        """Make attempts that are asked for next side by side."""
        self.attempts.ahead([(self.settled(x), exact) for x in every], self.processes)

    def attempt(self, x: Sequence[float] | Floats, *, exact: bool = False) -> Candidate:
        """What becomes of values, which are settled to those that can be had."""
        found = self.attempts.at(self.settled(x), exact=exact)
        (self.exact if exact else self.every).append(found)
        self.done += 1
        if self.progress is not None:
            self.progress(min(self.done, self.total), self.total)
        return found

    def settled(self, x: Sequence[float] | Floats) -> tuple[float, ...]:
        """Values within bounds; of a catalogue the nearest one."""
        found = []
        for one, value in zip(self.attempts.variables, x, strict=True):
            if one.choices:
                found.append(min(one.choices, key=lambda choice, value=value: abs(choice - value)))  # type: ignore[misc]
            else:
                found.append(float(min(max(value, one.low), one.high)))
        return tuple(found)

    def best(self, objective: Objective, *, exact: bool = False) -> Candidate | None:
        """The best attempt so far: of those that hold the one with the least objective, else the nearest to holding."""
        known = self.exact if exact else self.every
        return min(known, key=lambda one: rank(one, objective), default=None)

    def everywhere(self, objective: Objective) -> None:
        """Search the whole box."""
        from scipy.optimize import differential_evolution

        variables = self.attempts.variables
        free = sum(not one.choices or len(one.choices) > 1 for one in variables)
        crowd = max(FEWEST, CROWD * max(free, 1))
        # In parts of their ranges, where rounding takes no bound for a value beyond it.
        bounds = [(0, len(one.choices) - 1 if one.choices else 1) for one in variables]
        integers = [bool(one.choices) for one in variables]

        def values(z: Floats) -> list[float]:
            return [
                one.choices[round(float(at))] if one.choices else one.low + float(at) * one.span
                for one, at in zip(variables, z, strict=True)
            ]

        def height(x: Sequence[float]) -> float:
            place, value = rank(self.attempt(x), objective)
            part = value / (1.0 + abs(value)) if np.isfinite(value) else 1.0
            return place + 0.5 * (1.0 + part)

        def generation(_: object, every: Iterable[Floats]) -> list[float]:
            chosen = [values(z) for z in every]
            self.ahead(chosen)
            return [height(x) for x in chosen]

        # Somewhere in the box the design of the file is a start as well, if it is there.
        now = [one.before for one in variables]
        inside = all(one.low <= v <= one.high and not one.choices for one, v in zip(variables, now, strict=True))
        differential_evolution(
            height,
            bounds,
            # A generation is as a whole that of the one before, however many are tried at a time.
            updating="deferred",
            workers=generation,
            maxiter=max(self.evaluations // crowd - 1, 1),
            popsize=max(round(crowd / max(free, 1)), 5),
            init="sobol",
            tol=ALIKE,
            seed=self.seed,
            polish=False,
            integrality=integers,
            x0=[(v - one.low) / one.span for one, v in zip(variables, now, strict=True)] if inside else None,
        )

    def nearby_each(self, starts: Sequence[Candidate], weights: Mapping[str, float]) -> None:
        """Search near each of several attempts, of which no search needs another one."""
        if self.processes.count < 2:
            for start in starts:
                self.nearby(start, weights)
            return
        for made in self.processes.each([(start, dict(weights)) for start in starts]):
            for one in made:
                self.attempts.known[one.values, False] = one
                self.attempt(one.values)

    def nearby(
        self,
        start: Candidate,
        weights: Mapping[str, float],
        bounds: Mapping[str, float] | None = None,
        *,
        exact: bool = False,
        steps: int = STEPS,
    ) -> None:
        """Search near an attempt; what is found is among the attempts.

        Where it does not hold everything, the largest part that is used of anything is to be small.

        Parameters
        ----------
        start : Candidate
            Which has aims.
        weights : mapping
            Of the aims whose sum is to be small.
        bounds : mapping, optional
            Largest acceptable values of aims.
        exact : bool
            Whether on the exact closure.
        """
        from scipy.optimize import minimize

        variables = self.attempts.variables
        free = [k for k, one in enumerate(variables) if not one.choices and one.high > one.low]
        # Least costs are found by a search of their own, whose end is no smooth function of the dimensions.
        if not free or not start.aims or "cost" in start.aims:
            return
        count = len(free)
        layout = _Rows(start, weights if start.holds else {}, bounds or {})

        def placed(x: Floats) -> list[float]:
            values = [*start.values]
            for k, part in zip(free, x, strict=True):
                values[k] = variables[k].low + float(np.clip(part, 0.0, 1.0)) * variables[k].span
            return values

        def rows(x: Floats) -> Floats:
            return layout.of(self.attempt(placed(x), exact=exact))

        def jacobian(z: Floats) -> Floats:
            # Towards the inside of the box.
            steps = np.where(z[:count] < 0.5, STEP, -STEP)
            moved = z[:count] + np.diag(steps)
            self.ahead([placed(x) for x in (z[:count], *moved)], exact=exact)
            here = rows(z[:count])
            slopes = np.array([(rows(x) - here) / step for x, step in zip(moved, steps, strict=True)]).T
            return np.hstack([-slopes, layout.raises])

        descent = np.concatenate([np.zeros(count), layout.weights])
        minimize(
            lambda z: float(descent @ z),
            np.array([*((start.values[k] - variables[k].low) / variables[k].span for k in free), *layout.tops]),
            jac=lambda _: descent,
            bounds=[(0.0, 1.0)] * count + [(None, None)] * len(layout.weights),
            constraints=[{"type": "ineq", "fun": lambda z: layout.room(z[count:]) - rows(z[:count]), "jac": jacobian}],
            method="SLSQP",
            options={"maxiter": steps, "ftol": 1e-10},
        )

    def starts(self, objective: Objective) -> list[Candidate]:
        """The best attempts that are not near one another, from which it is worth going on."""
        spans = np.array([one.span for one in self.attempts.variables])
        found: list[Candidate] = []
        for one in sorted(self.every, key=lambda one: rank(one, objective)):
            if not one.aims or len(found) == STARTS:
                break
            if all(np.abs((np.array(one.values) - other.values) / spans).max() > 0.05 for other in found):
                found.append(one)
        return found


def worked(attempts: Attempts, item: tuple[Any, Any]) -> Candidate | list[Candidate]:
    """What further processes do: an attempt with some values, exactly or not; or a search near an attempt."""
    first, second = item
    if not isinstance(first, Candidate):
        return attempts.at(first, exact=second)
    search = DesignSearch(attempts, Processes(worked, (attempts,), 1), 0, 0)
    search.nearby(first, second)
    return search.every


class _Rows:
    """What a search keeps below ceilings: aims in parts of those of the start, and what is used.

    Parameters
    ----------
    start : Candidate
    weights : mapping
        Of the aims that are to be small; if there are none, what is used is.
    bounds : mapping
        Largest acceptable values of aims.
    """

    def __init__(self, start: Candidate, weights: Mapping[str, float], bounds: Mapping[str, float]) -> None:
        names = [*weights]
        self.sizes = {name: max(abs(start.aim(name)), 1e-12) for name in start.aims}
        parts = [weights[name] * self.sizes[name] for name in names] or [1.0]
        self.weights = np.array(parts) / sum(parts)
        self.tops = np.ones(len(names)) if names else np.array([max(start.largest.values())])
        aims = [(name, len(values)) for name, values in start.aims.items()]
        held = sum(map(len, start.used.values()))
        self.count = sum(count for _, count in aims) + held
        #: by how much every row's ceiling rises with those that are searched for
        self.raises = np.zeros((self.count, len(self.weights)))
        self.fixed = np.full(self.count, FREE)
        row = 0
        for name, count in aims:
            here = slice(row, row := row + count)
            if name in weights:
                self.raises[here, names.index(name)], self.fixed[here] = 1.0, 0.0
            elif name in bounds:
                self.fixed[here] = bounds[name] / self.sizes[name] * (1.0 - KEPT)
        if names:
            self.fixed[row:] = 1.0 - KEPT
        else:
            self.raises[row:, 0], self.fixed[row:] = 1.0, 0.0

    def of(self, found: Candidate) -> Floats:
        """The rows of an attempt; far above all ceilings where there is no pose."""
        if found.lost:
            return np.full(self.count, FREE)
        parts = [values / self.sizes[name] for name, values in found.aims.items()]
        return np.concatenate([*parts, *(np.minimum(values, FREE) for values in found.used.values())])

    def room(self, tops: Floats) -> Floats:
        """The ceilings."""
        return np.asarray(self.fixed + self.raises @ tops)


def rank(one: Candidate, objective: Objective) -> tuple[int, float]:
    """By which attempts are compared: whether all holds, then the objective; else how far it is from holding."""
    return (0, objective(one)) if one.holds else (1, one.beyond)


def weighted(weights: Mapping[str, float]) -> Objective:
    """The sum of aims, each at its largest, times their weights."""
    return lambda one: sum(weight * one.aim(name) for name, weight in weights.items())


def tolerated(search: DesignSearch, best: Candidate, objective: Objective, losses: Sequence[float]) -> Floats:
    """How far each variable may move alone until the objective is larger by a part, or something does not hold.

    Returns
    -------
    ndarray
        Shape (variable, loss, side).
    """
    variables = search.attempts.variables
    found = np.full((len(variables), len(losses), 2), np.nan)
    base = objective(best)
    waiting = {
        (k, j, side): _far(best.values[k], end)
        for k, one in enumerate(variables)
        for j in range(0 if one.choices else len(losses))
        for side, end in enumerate((one.low, one.high))
    }
    answers: dict[tuple[int, int, int], bool | None] = dict.fromkeys(waiting)
    while waiting:
        asked: dict[tuple[int, int, int], list[float]] = {}
        for place, way in [*waiting.items()]:
            try:
                asked[place] = [*best.values]
                asked[place][place[0]] = way.send(answers[place])  # type: ignore[arg-type]
            except StopIteration as end:
                found[place] = end.value
                del waiting[place], asked[place]
        search.ahead([*asked.values()])
        answers = {
            place: _keeps(search.attempt(values), objective, base * (1.0 + losses[place[1]]))
            for place, values in asked.items()
        }
    return found


def _keeps(one: Candidate, objective: Objective, most: float) -> bool:
    """Whether an attempt is good enough; at the optimum limits are used as a whole, and what rounding takes is kept."""
    return not one.lost and all(v <= 1.0 + 1e-6 for v in one.largest.values()) and objective(one) <= most


def _far(start: float, end: float) -> Generator[float, bool, float]:
    """How far a variable may go towards an end: outwards in growing steps, then by halves.

    Asks for values, and is told whether they are good enough.
    """
    if end == start:
        return start

    def at(part: float) -> float:
        return start + part * (end - start)

    inside, part = 0.0, 1.0 / 1024.0
    while part < 1.0 and (yield at(part)):
        inside, part = part, 2.0 * part
    if part >= 1.0 and (yield at(1.0)):
        return end
    outside = min(part, 1.0)
    for _ in range(9):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if (yield at(middle)) else (inside, middle)
    return at(inside)
