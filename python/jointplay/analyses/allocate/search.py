"""The cheapest plan that keeps to the limits on the exact closure.

1. First order. Solve the program, look at its plan, add the rows of the directions in which a limit is missed; again,
   until none is. The optimum of the program is `first_order_bound`: what nothing can cost less than, to first order.
2. Exact closure. The right sides are divided by exact / first order of the last look, and so on until the limits hold
   there and the cost stays.
3. Where all decisions are choices, every cheaper plan whose rows are within what that ratio was seen to vary is looked
   at, the cheapest first. Sets are nested: where a plan misses a limit, all plans with no smaller size miss it too.

Every loop is bounded; the plan that is given held on the exact closure when it was looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Progress
from jointplay.result import STATUSES

from .items import Item
from .looks import ROUNDING, Look, Looking
from .program import Formula, Plan, Prices, Program

Floats = NDArray[np.float64]

#: plans that are looked at to first order, on the exact closure, and among the choices that could be cheaper
MOST_FIRST, MOST_EXACT, MOST_CHEAPER = 60, 40, 200
#: excess of a row that counts, and from where on a row is kept that is not exceeded
EXCESS, NEAR = 1e-6, 0.95
#: by how much numbers stay away from a limit, so that rounding does not take them beyond
MARGIN = 5e-7
#: share by which the cost of a plan may still change
SETTLED = 1e-6
#: looks after which the ratio exact / first order only grows, so that choices do not alternate
PATIENCE = 8
#: looks that a search usually takes, for the bar
EXPECTED = 20
#: share of the deviation of that ratio from 1 by which cheaper choices may differ in it
BAND = 0.25


@dataclass(frozen=True)
class Outcome:
    """What a search found.

    Attributes
    ----------
    status : str
        ``ok``; ``infeasible``: the tightest sizes miss a limit; ``unfinished``: the search reached its limit of steps,
        and the plan holds but may not be the cheapest; or that of the exact closure, with the tightest sizes.
    values : tuple of float
        Sizes of formulas and numbers of choices; the tightest ones where nothing holds.
    cost : float
    bound : float
        Least cost to first order.
    look : Look
        At the plan.
    """

    status: str
    values: tuple[float, ...]
    cost: float
    bound: float
    look: Look


@dataclass
class Search:
    """Searches for one set of items after another with limits times some factors; what was seen is kept.

    Parameters
    ----------
    items : sequence of Item
    looking : Looking
    """

    items: Sequence[Item]
    looking: Looking
    progress: Progress | None = None
    best: Outcome | None = None
    _looks: dict[tuple[float, ...], Look] = field(default_factory=dict)
    _rows: dict[tuple[int, int, bytes], tuple[Floats, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.program = Program([_decision(item, self.looking.power) for item in self.items])
        self.is_discrete = not self.program.formulas
        self.tightest = tuple(_extreme(item, loosest=False) for item in self.items)
        self.cheapest = tuple(_extreme(item, loosest=True) for item in self.items)

    def run(self, factors: Floats) -> Outcome:
        """The cheapest plan whose limits hold, each limit times its factor.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C; `best` is the cheapest plan that was seen to hold.
        """
        self.best = None
        tight = self.look(self.tightest)
        # The sets of all other plans contain the tightest ones.
        if not _holds(tight, factors):
            # Where even the tightest sizes reach a singular pose, its status says more.
            status = str(STATUSES[tight.status.max()]) if tight.status.any() else "infeasible"
            return Outcome(status, self.tightest, self._cost(self.tightest), np.nan, tight)
        self._keep(self.tightest, tight, np.nan)
        loose = self.look(self.cheapest)
        if _holds(loose, factors):
            cost = self._cost(self.cheapest)
            return Outcome("ok", self.cheapest, cost, cost, loose)
        self._add(loose, np.ones_like(loose.used), factors, every=True)
        # The quantiles of a scatter are not known to first order, but their ratio to the standard deviation.
        ratio = _ratio(loose) if self.looking.power > 1 else np.ones_like(loose.used)
        bound, last = self._first_order(factors, ratio)
        settled = self._correct(last or loose, factors, bound)
        if self.is_discrete:
            settled = self._cheaper(factors, bound) and settled
        best = self._best()
        if self.looking.power > 1:
            bound = self._first_order(factors, _ratio(best.look))[0]
        return Outcome("ok" if settled else "unfinished", best.values, best.cost, bound, best.look)

    def _best(self) -> Outcome:
        """The cheapest plan that was seen to hold; the tightest one held."""
        assert self.best is not None
        return self.best

    def saving(self, outcome: Outcome, limits: NDArray[np.bool_], step: float) -> float:
        """By how much the cost falls where limits are loosened by a share, with exact / first order as it is."""
        ratio = _ratio(outcome.look)
        if self.cheapest == outcome.values:
            return 0.0
        before = self._first_order(np.ones(len(ratio)), ratio)[0]
        saved = before - self._first_order(np.where(limits, 1.0 + step, 1.0), ratio)[0]
        return saved if saved > SETTLED * (1.0 + abs(before)) else 0.0

    def _first_order(self, factors: Floats, ratio: Floats) -> tuple[float, Look | None]:
        """Least cost of the rows with right sides divided by a ratio, and the look at the plan that has it."""
        bound, look = np.nan, None
        for _ in range(MOST_FIRST):
            plan = self._solve(factors, ratio)
            if plan is None:
                return bound, look
            bound = plan.bound
            look = self.look(self._values(plan))
            if _holds(look, factors):
                self._keep(self._values(plan), look, bound)
            if not self._add(look, ratio, factors):
                break
        return bound, look

    def _correct(self, look: Look, factors: Floats, bound: float) -> bool:
        """Divide right sides by exact / first order until the limits hold; whether the cost settled."""
        aim, before, ratio = 1.0 if self.is_discrete else 1.0 - MARGIN, np.inf, _ratio(look)
        for number in range(MOST_EXACT):
            plan = self._solve(factors, ratio / aim)
            if plan is None:
                return False
            values = self._values(plan)
            look = self.look(values)
            added = self._add(look, ratio / aim, factors)
            most = float((look.used / factors[:, None]).max())
            if _holds(look, factors):
                self._keep(values, look, bound)
                if not added and abs(plan.cost - before) <= SETTLED * (1.0 + abs(plan.cost)):
                    return True
            elif not added and most < 1.0 + 10.0 * EXCESS:
                aim *= 2.0 - most - EXCESS / 10.0
            before = plan.cost
            ratio = np.maximum(ratio, _ratio(look)) if number >= PATIENCE else _ratio(look)
        return False

    def _cheaper(self, factors: Floats, bound: float) -> bool:
        """Look for choices that are cheaper and hold; whether there are none left."""
        ratio = self._least_ratio(factors)
        beyond = [values for values, look in self._looks.items() if not _holds(look, factors)]
        for _ in range(MOST_CHEAPER):
            plan = self._solve(factors, ratio, beyond)
            if plan is None or plan.cost >= self._best().cost - ROUNDING * (1.0 + abs(plan.cost)):
                return True
            values = self._values(plan)
            look = self.look(values)
            self._add(look, ratio, factors)
            if _holds(look, factors):
                self._keep(values, look, bound)
            else:
                beyond.append(values)
        return False

    def _least_ratio(self, factors: Floats) -> Floats:
        """The least exact / first order near the limits, with room below for plans that nobody has looked at."""
        near = [_ratio(look) for look in self._looks.values() if 0.8 < (look.used / factors[:, None]).max() < 1.25]
        seen = np.array(near or [_ratio(look) for look in self._looks.values()])
        least, most = seen.min(axis=0), seen.max(axis=0)
        return np.asarray(least - np.maximum(BAND * np.abs(least - 1.0), (most - least) / 2.0))

    def look(self, values: tuple[float, ...]) -> Look:
        """The look at a plan, taken once."""
        if values not in self._looks:
            self._looks[values] = self.looking.look(values)
            if self.progress is not None:
                self.progress(len(self._looks), max(EXPECTED, len(self._looks) + 1))
        return self._looks[values]

    def _keep(self, values: tuple[float, ...], look: Look, bound: float) -> None:
        cost = self._cost(values)
        if self.best is None or cost < self.best.cost:
            self.best = Outcome("unfinished", values, cost, bound, look)

    def _cost(self, values: Sequence[float]) -> float:
        return float(sum(item.price(value) for item, value in zip(self.items, values, strict=True)))

    def _values(self, plan: Plan) -> tuple[float, ...]:
        """Sizes and choices of a plan."""
        pairs = zip(self.items, plan.values, strict=True)
        return tuple(v ** (1.0 / self.looking.power) if item.is_formula else v for item, v in pairs)

    def _add(self, look: Look, ratio: Floats, factors: Floats, *, every: bool = False) -> bool:
        """Keep the rows of a look that say something; whether one is exceeded that was not known."""
        load = look.first * ratio / factors[:, None]
        news = False
        for limit, configuration in np.argwhere(load > (-np.inf if every else NEAR)).tolist():
            parts = look.parts[limit, configuration]
            size = max(float(np.abs(parts).max()), 1e-300)
            key = limit, configuration, np.round(parts / size, 9).tobytes()
            if key not in self._rows:
                self._rows[key] = parts, float(look.rest[limit, configuration])
                news |= load[limit, configuration] > 1.0 + EXCESS
        return news

    def _solve(self, factors: Floats, ratio: Floats, beyond: Sequence[tuple[float, ...]] = ()) -> Plan | None:
        """The cheapest plan that keeps to the rows, and is tighter somewhere than each of those beyond the limits."""
        power = self.looking.power
        places = np.array([key[:2] for key in self._rows])
        parts = np.array([row for row, _ in self._rows.values()])
        rest = np.array([rest for _, rest in self._rows.values()])
        allowed = (factors[places[:, 0]] / np.maximum(ratio[places[:, 0], places[:, 1]], ROUNDING)) ** power
        size = np.maximum(allowed, ROUNDING)
        rows, right = parts / size[:, None], (allowed - rest) / size
        if beyond:
            cuts = np.array([self._tighter(values) for values in beyond])
            rows, right = np.vstack([rows, -cuts]), np.append(right, -np.ones(len(cuts)))
        return self.program.solve(rows, right)

    def _tighter(self, values: tuple[float, ...]) -> Floats:
        """Ones for the choices that are tighter than those of a plan."""
        found = []
        for item, value in zip(self.items, values, strict=True):
            now = item.play(value)
            found += [float(o.play.scale < now.scale or o.play.axial < now.axial) for o in item.options]
        return np.array(found)


def _holds(look: Look, factors: Floats) -> bool:
    return bool((look.used <= (1.0 + ROUNDING) * factors[:, None]).all()) and not look.status.any()


def _ratio(look: Look) -> Floats:
    """Exact over first order; 1 where nothing is off."""
    some = look.first > ROUNDING
    return np.divide(look.used, look.first, out=np.ones_like(look.used), where=some)


def _extreme(item: Item, *, loosest: bool) -> float:
    """The tightest value of an item; the loosest one of the cheapest."""
    if item.is_formula:
        return item.options[loosest].size
    sizes = [(o.size, -k) for k, o in enumerate(item.options)]
    if not loosest:
        return float(-min(sizes, key=lambda pair: pair[0])[1])
    least = min(option.cost for option in item.options)
    return float(-min((pair for pair in sizes if item.options[-pair[1]].cost == least), key=lambda pair: pair[0])[1])


def _decision(item: Item, power: int) -> Formula | Prices:
    if not item.is_formula:
        return Prices(tuple(option.cost for option in item.options))
    cost = item.cost
    low, high = (option.size for option in item.options)
    return Formula(
        low**power,
        high**power,
        lambda z: cost.at(z ** (1.0 / power)),
        lambda z: cost.slope(z ** (1.0 / power)) * _root(z, power)[0],
        lambda z: (
            cost.bend(z ** (1.0 / power)) * _root(z, power)[0] ** 2
            + cost.slope(z ** (1.0 / power)) * _root(z, power)[1]
        ),
    )


def _root(z: float, power: int) -> tuple[float, float]:
    """First and second derivative of the size by the variable that is a power of it."""
    p = 1.0 / power
    return p * z ** (p - 1.0), p * (p - 1.0) * z ** (p - 2.0)
