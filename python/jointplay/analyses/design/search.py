"""The search: differential evolution over the whole box, then sequential quadratic programming from the best.

minimise    sum_i w_i t_i           over x and t
subject to  f_i,k(x) <= t_i         every aim at every configuration
            used_j,k(x) <= 1        everything that has to hold

The largest value over configurations has edges where another configuration becomes the largest one; with t for it all
functions are smooth again, and the optimum is met to rounding. Differential evolution (Storn and Price 1997) goes by
Deb's rules: what holds is better than what does not, what is nearer to holding is better than what is not. It sees only
the order of attempts, so they are mapped to [0, 1) where everything holds and above 1 where it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.basics.arrays import Floats

from .attempts import Attempt, Attempts

#: attempts of a generation, per variable and at least
CROWD, FEWEST = 8, 16
#: a generation whose attempts are as alike is the last one
ALIKE = 1e-4
#: starts of the search that follows, steps of each, and of the last one on the exact closure
STARTS, STEPS, LAST = 3, 40, 12
#: part of a range by which slopes are found
STEP = 1e-6
#: limits are kept by this part of them, so that they hold in spite of rounding
KEPT = 1e-7
#: attempts of the whole are counted as so many for the progress
Objective = Callable[[Attempt], float]


@dataclass
class Search:
    """A search among attempts.

    Parameters
    ----------
    attempts : Attempts
    evaluations : int
        Attempts of the global search.
    seed : int
    progress : Progress or None
    done, total : int
        Attempts that are made, and those that may be.
    """

    attempts: Attempts
    evaluations: int
    seed: int
    progress: Progress | None = None
    done: int = 0
    total: int = 0
    every: list[Attempt] = field(default_factory=list)
    exact: list[Attempt] = field(default_factory=list)

    def attempt(self, x: Sequence[float] | Floats, *, exact: bool = False) -> Attempt:
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

    def best(self, objective: Objective, *, exact: bool = False) -> Attempt | None:
        """The best attempt so far: of those that hold the one with the least objective, else the nearest to holding."""
        known = self.exact if exact else self.every
        return min(known, key=lambda one: rank(one, objective), default=None)

    def everywhere(self, objective: Objective) -> None:
        """Search the whole box."""
        from scipy.optimize import differential_evolution

        variables = self.attempts.variables
        free = sum(not one.choices or len(one.choices) > 1 for one in variables)
        crowd = max(FEWEST, CROWD * max(free, 1))
        bounds = [(0, len(one.choices) - 1) if one.choices else (one.low, one.high) for one in variables]
        integers = [bool(one.choices) for one in variables]

        def values(z: Floats) -> list[float]:
            return [
                one.choices[round(float(at))] if one.choices else float(at)
                for one, at in zip(variables, z, strict=True)
            ]

        def height(z: Floats) -> float:
            place, value = rank(self.attempt(values(z)), objective)
            part = value / (1.0 + abs(value)) if np.isfinite(value) else 1.0
            return place + 0.5 * (1.0 + part)

        # Somewhere in the box the design of the file is a start as well, if it is there.
        now = [one.before for one in variables]
        inside = all(one.low <= v <= one.high and not one.choices for one, v in zip(variables, now, strict=True))
        differential_evolution(
            height,
            bounds,
            maxiter=max(self.evaluations // crowd - 1, 1),
            popsize=max(round(crowd / max(free, 1)), 5),
            init="sobol",
            tol=ALIKE,
            seed=self.seed,
            polish=False,
            integrality=integers,
            x0=now if inside else None,
        )

    def nearby(
        self,
        start: Attempt,
        weights: Mapping[str, float],
        bounds: Mapping[str, float] | None = None,
        *,
        exact: bool = False,
        steps: int = STEPS,
    ) -> None:
        """Search near an attempt; what is found is among the attempts.

        Parameters
        ----------
        start : Attempt
            Which has aims.
        weights : mapping
            Of the aims whose sum is to be small.
        bounds : mapping, optional
            Largest acceptable values of aims.
        exact : bool
            Whether on the exact closure.
        """
        from scipy.optimize import minimize

        free = [k for k, one in enumerate(self.attempts.variables) if not one.choices and one.high > one.low]
        if not free or not start.aims:
            return
        variables = [self.attempts.variables[k] for k in free]
        names = list(weights)
        sizes = {name: max(abs(start.aim(name)), 1e-12) for name in start.aims}
        shapes = {name: len(values) for name, values in (*start.aims.items(), *start.used.items())}
        total = sum(weights[name] * sizes[name] for name in names)
        slopes = np.append(np.zeros(len(free)), [weights[name] * sizes[name] / total for name in names])

        def point(z: Floats) -> list[float]:
            x = [*start.values]
            for k, one, part in zip(free, variables, z, strict=False):
                x[k] = one.low + float(np.clip(part, 0.0, 1.0)) * one.span
            return x

        def rows(x: Floats) -> Floats:
            """Aims in parts of those of the start, and what is used; shorter where there is no pose."""
            found = self.attempt(point(x), exact=exact)
            if found.lost:
                return np.full(sum(shapes.values()), 1e3)
            parts = [values / sizes[name] for name, values in found.aims.items()]
            return np.concatenate([*parts, *(np.minimum(values, 1e3) for values in found.used.values())])

        def spare(z: Floats) -> Floats:
            return ceilings(z) - rows(z[: len(free)])

        caps = {name: value / sizes[name] * (1.0 - KEPT) for name, value in (bounds or {}).items()}

        def ceilings(z: Floats) -> Floats:
            """What every row has to stay below: t of its aim, a bound, or the whole of a limit."""
            own = dict(zip(names, z[len(free) :], strict=True))
            each = []
            for name in start.aims:
                each.append(np.full(shapes[name], own.get(name, caps.get(name, np.inf))))
            each += [np.full(shapes[name], 1.0 - KEPT) for name in start.used]
            return np.minimum(np.concatenate(each), 1e6)

        def jacobian(z: Floats) -> Floats:
            here = rows(z[: len(free)])
            found = np.zeros((len(here), len(z)))
            for k in range(len(free)):
                # Towards the inside of the box.
                step = STEP if z[k] < 0.5 else -STEP
                moved = z[: len(free)].copy()
                moved[k] += step
                found[:, k] = -(rows(moved) - here) / step
            for k in range(len(names)):
                found[:, len(free) + k] = ceilings(z + np.eye(len(z))[len(free) + k]) - ceilings(z)
            return found

        x0 = [(start.values[k] - one.low) / one.span for k, one in zip(free, variables, strict=True)]
        minimize(
            lambda z: float(slopes @ z),
            np.array([*x0, *(1.0 for _ in names)]),
            jac=lambda _: slopes,
            bounds=[(0.0, 1.0)] * len(free) + [(None, None)] * len(names),
            constraints=[{"type": "ineq", "fun": spare, "jac": jacobian}],
            method="SLSQP",
            options={"maxiter": steps, "ftol": 1e-10},
        )

    def starts(self, objective: Objective) -> list[Attempt]:
        """The best attempts that are not near one another, from which it is worth going on."""
        spans = np.array([one.span for one in self.attempts.variables])
        found: list[Attempt] = []
        for one in sorted(self.every, key=lambda one: rank(one, objective)):
            if not one.aims or len(found) == STARTS:
                break
            if all(np.abs((np.array(one.values) - other.values) / spans).max() > 0.05 for other in found):
                found.append(one)
        return found


def rank(one: Attempt, objective: Objective) -> tuple[int, float]:
    """By which attempts are compared: whether all holds, then the objective; else how far it is from holding."""
    return (0, objective(one)) if one.holds else (1, one.beyond)


def weighted(weights: Mapping[str, float]) -> Objective:
    """The sum of aims, each at its largest, times their weights."""
    return lambda one: sum(weight * one.aim(name) for name, weight in weights.items())


def tolerated(search: Search, best: Attempt, objective: Objective, losses: Sequence[float]) -> Floats:
    """How far each variable may move alone until the objective is larger by a part, or something does not hold.

    Returns
    -------
    ndarray
        Shape (variable, loss, side).
    """
    variables = search.attempts.variables
    found = np.full((len(variables), len(losses), 2), np.nan)
    base = objective(best)
    for k, one in enumerate(variables):
        if one.choices:
            continue
        for j, loss in enumerate(losses):
            for side, end in enumerate((one.low, one.high)):
                found[k, j, side] = _far(search, best, objective, base * (1.0 + loss), k, end)
    return found


def _far(search: Search, best: Attempt, objective: Objective, most: float, k: int, end: float) -> float:
    """How far a variable may go towards an end: outwards in growing steps, then by halves."""
    start = best.values[k]

    def keeps(part: float) -> bool:
        values = [*best.values]
        values[k] = start + part * (end - start)
        one = search.attempt(values)
        # At the optimum limits are used as a whole; what rounding takes is not missed.
        return not one.lost and all(v <= 1.0 + 1e-6 for v in one.largest.values()) and objective(one) <= most

    if end == start:
        return start
    inside, part = 0.0, 1.0 / 1024.0
    while part < 1.0 and keeps(part):
        inside, part = part, 2.0 * part
    if part >= 1.0 and keeps(1.0):
        return end
    outside = min(part, 1.0)
    for _ in range(9):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if keeps(middle) else (inside, middle)
    return start + inside * (end - start)
