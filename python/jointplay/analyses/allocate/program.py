"""The program that is solved again and again: least cost under linear limits.

    minimise   sum over decisions of cost
    subject to sum over columns of part * x <= right,  for every row a limit in one direction at one configuration
               one choice of each decision

A decision by a formula has one column, its variable z between its ends, the size; its cost is convex in z. A decision
by choices has a column for each, 0 or 1.

Formulas alone are a convex program, which `convex` solves. Choices alone are a mixed-integer one, which HiGHS solves
to proven optimality; it comes with scipy. With both, choices are found with tangents in place of the formulas, then
sizes for these choices, and tangents there: when choices come again, they are the optimum (outer approximation, Duran
and Grossmann, Mathematical Programming 36, 1986).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats

from .convex import least

#: tangents of a formula from the beginning, and choices that are tried with it
FIRST_TANGENTS, MOST_ROUNDS = 8, 60
#: factor on rows of whole and other numbers
DAMPED = 0.05
#: share of the cost by which a bound may be below it
GAP = 1e-7


@dataclass(frozen=True)
class Formula:
    """The cost of a decision whose variable is a number."""

    #: `low`, `high`: ends of the variable
    low: float
    high: float
    #: `cost`, `slope`, `bend`: the cost, convex and falling, and its derivatives
    cost: Callable[[float], float]
    slope: Callable[[float], float]
    bend: Callable[[float], float]


@dataclass(frozen=True)
class Prices:
    """The costs of the choices of a decision."""

    costs: tuple[float, ...]


Decision = Formula | Prices


@dataclass(frozen=True)
class Plan:
    """What is decided."""

    #: of every decision the variable of its formula, or the number of its choice
    values: tuple[float, ...]
    #: what it costs
    cost: float
    #: what nothing that keeps to the rows can cost less than
    bound: float


class Program:
    """Decisions with their costs.

    Parameters
    ----------
    decisions : sequence of Formula or Prices
    """

    def __init__(self, decisions: Sequence[Decision]) -> None:
        self.decisions = decisions
        counts = [len(d.costs) if isinstance(d, Prices) else 1 for d in decisions]
        #: the columns of every decision
        self.places = [slice(end - count, end) for count, end in zip(counts, np.cumsum(counts).tolist(), strict=True)]
        self.columns = sum(counts)
        self.formulas = {k: d for k, d in enumerate(decisions) if isinstance(d, Formula)}
        self.prices = {k: d for k, d in enumerate(decisions) if isinstance(d, Prices)}
        self._tangents = {k: np.geomspace(f.low, f.high, FIRST_TANGENTS).tolist() for k, f in self.formulas.items()}

    def solve(self, rows: Floats, right: Floats) -> Plan | None:
        """The cheapest plan with ``rows @ x <= right``; None where there is none.

        Parameters
        ----------
        rows : ndarray
            Shape (row, column).
        """
        if not self.prices:
            return self._sizes({}, rows, right)
        best: Plan | None = None
        tried: set[tuple[int, ...]] = set()
        bound = -math.inf
        for _ in range(MOST_ROUNDS):
            found = self._choices(rows, right)
            if found is None:
                break
            chosen, below = found
            bound = max(bound, below)
            if not self.formulas:
                plan = self._sizes(chosen, rows, right)
                return None if plan is None else Plan(plan.values, plan.cost, min(bound, plan.cost))
            if tuple(chosen.values()) in tried:
                # With tangents at the sizes that are best beside them these choices cost what they did.
                assert best is not None
                bound = best.bound
                break
            tried.add(tuple(chosen.values()))
            plan = self._sizes(chosen, rows, right)
            if plan is None:
                # Rounding: the choices keep to the rows as HiGHS counts them.
                break
            for k in self.formulas:
                self._tangents[k].append(plan.values[k])
            if best is None or plan.cost < best.cost:
                best = plan
        return None if best is None else Plan(best.values, best.cost, min(bound, best.cost))

    def _sizes(self, chosen: dict[int, int], rows: Floats, right: Floats) -> Plan | None:
        """The cheapest sizes by formula beside given choices."""
        values = [float(chosen.get(k, 0)) for k in range(len(self.decisions))]
        fixed = math.fsum(self.prices[k].costs[choice] for k, choice in chosen.items())
        cost = bound = fixed
        if self.formulas:
            taken = sum((rows[:, self.places[k].start + choice] for k, choice in chosen.items()), np.zeros(len(rows)))
            own = rows[:, [self.places[k].start for k in self.formulas]]
            found = least(list(self.formulas.values()), own, right - taken)
            if found is None:
                return None
            for k, value in zip(self.formulas, found.values.tolist(), strict=True):
                values[k] = value
            cost, bound = fixed + found.cost, fixed + found.bound
        return Plan(tuple(values), cost, bound)

    def _choices(self, rows: Floats, right: Floats) -> tuple[dict[int, int], float] | None:
        """The best choices with tangents in place of the formulas, and what they cost at least.

        Variables of formulas are counted in their upper ends, costs from the lowest ones and in their range, so that
        all numbers are of one size. Behind the columns is the cost of each formula.
        """
        from scipy.optimize import Bounds, LinearConstraint, milp

        n, width = self.columns, self.columns + len(self.formulas)
        scale, objective, fixed = self._scale(), np.zeros(width), 0.0
        whole, low, high, unit = np.zeros(width), np.zeros(width), np.ones(width), np.ones(n)
        one = np.zeros((len(self.prices), width))
        for row, (k, prices) in enumerate(self.prices.items()):
            place = self.places[k]
            objective[place] = (np.array(prices.costs) - min(prices.costs)) / scale
            whole[place] = one[row, place] = 1.0
            fixed += min(prices.costs)
        for number, (k, formula) in enumerate(self.formulas.items()):
            place = self.places[k]
            unit[place], low[place] = formula.high, formula.low / formula.high
            objective[n + number], high[n + number] = 1.0, np.inf
            fixed += formula.cost(formula.high)
        high[:n] = np.where(self._possible(rows, right), high[:n], 0.0)
        constraints = [LinearConstraint(one, 1.0, 1.0)]
        if len(rows):
            constraints.append(LinearConstraint(np.pad(rows * unit, ((0, 0), (0, width - n))), -np.inf, right))
        if self.formulas:
            constraints.append(LinearConstraint(*self._above(width, scale), np.inf))
        if self.formulas:
            # HiGHS rounds whole numbers; where that took a row beyond its tolerance it would print so.
            constraints = [LinearConstraint(DAMPED * c.A, DAMPED * c.lb, DAMPED * c.ub) for c in constraints]
        options = {"mip_rel_gap": 0.0 if not self.formulas else GAP}
        found = milp(objective, integrality=whole, bounds=Bounds(low, high), constraints=constraints, options=options)
        if found.x is None:
            return None
        bound = found.fun if found.mip_dual_bound is None else min(found.fun, found.mip_dual_bound)
        return {k: int(np.argmax(found.x[self.places[k]])) for k in self.prices}, fixed + scale * float(bound)

    def _possible(self, rows: Floats, right: Floats) -> NDArray[np.bool_]:
        """Which columns keep to all rows where every other decision is as tight as it can be."""
        least_of = np.zeros((len(rows), len(self.decisions)))
        for k, place in enumerate(self.places):
            part = rows[:, place] if k in self.prices else rows[:, place] * self.formulas[k].low
            least_of[:, k] = part.min(axis=1)
        room = right - least_of.sum(axis=1)
        possible = np.ones(self.columns, bool)
        for k in self.prices:
            more = rows[:, self.places[k]] - least_of[:, [k]]
            possible[self.places[k]] = (more <= room[:, None] + GAP).all(axis=0)
        return possible

    def _scale(self) -> float:
        """The largest range of a cost."""
        spans = [
            max(d.costs) - min(d.costs) if isinstance(d, Prices) else d.cost(d.low) - d.cost(d.high)
            for d in self.decisions
        ]
        return max(spans, default=0.0) or 1.0

    def _above(self, width: int, scale: float) -> tuple[Floats, Floats]:
        """Rows and left sides that keep costs above the tangents: cost - slope * variable >= tangent at zero."""
        rows, left = [], []
        for number, (k, formula) in enumerate(self.formulas.items()):
            for z in self._tangents[k]:
                slope, row = formula.slope(z), np.zeros(width)
                row[self.columns + number], row[self.places[k].start] = 1.0, -slope * formula.high / scale
                # Steep tangents do not set the size of the numbers.
                size = max(1.0, float(np.abs(row).max()))
                rows.append(row / size)
                left.append((formula.cost(z) - slope * z - formula.cost(formula.high)) / scale / size)
        return np.array(rows), np.array(left)
