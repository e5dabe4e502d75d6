"""The cheapest plan that keeps to the limits in the exact worst case.

1. First order. Solve the program, look at its plan, add the rows of the directions in which a limit is missed; again,
   until none is. The optimum of the program is `first_order_bound`: what nothing can cost less than, to first order.
2. Exact closure. The right sides are divided by exact / first order of the last look, and so on until the limits hold
   there and the cost stays.
3. Where all decisions are choices, every cheaper plan whose rows are within what that ratio was seen to vary is looked
   at, the cheapest first. Sets are nested: where a plan misses a limit, all plans with no smaller size miss it too.
4. Sizes by formula are rounded down to what can be ordered, and one after the other made larger by a step where the
   limits still hold.

Every loop is bounded; the plan that is given held on the exact closure when it was looked at.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats

from .items import Item
from .looks import ROUNDING
from .plans import Outcome, Plans, Values
from .program import Formula, Plan, Prices, Program
from .worst_case import WorstLook

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
#: share of the deviation of that ratio from 1 by which cheaper choices may differ in it
BAND = 0.25


@dataclass
class AllocateSearch(Plans):
    """Searches for one set of limits after another, each times a factor; what was seen is kept.

    Parameters
    ----------
    items : sequence of Item
    looking : WorstCase
    """

    _rows: dict[tuple[int, int, bytes], tuple[Floats, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.program = Program([_decision(item) for item in self.items])
        self.is_discrete = not self.program.formulas

    def run(self, factors: Floats) -> Outcome:
        """The cheapest plan whose limits hold, each limit times its factor.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C; `best` is the cheapest plan that was seen to hold.
        """
        self.look_at_ends()
        if self.look(self.cheapest).holds(factors):
            return self.best(factors, "ok", self.cost(self.cheapest)) or self.none()
        # The sets of all other plans contain the tightest ones; but teeth that jam there may have room elsewhere.
        if self.best(factors, "ok") is None:
            return self.none()
        loose = self._seen(self.cheapest)
        self._add(loose, np.ones_like(loose.used), factors, every=True)
        bound, last = self._first_order(factors, np.ones_like(loose.used))
        settled = self._correct(last or loose, factors)
        if self.is_discrete:
            settled = self._cheaper(factors) and settled
        else:
            self._order(factors)
        return self.best(factors, "ok" if settled else "unfinished", bound) or self.none()

    def _seen(self, values: Values) -> WorstLook:
        look = self.look(values)
        assert isinstance(look, WorstLook)
        return look

    def _order(self, factors: Floats) -> None:
        """Round the cheapest plan that holds down to what can be ordered, and use what room is left then."""
        held = [values for values, look in self.looks.items() if look.holds(factors)]
        values = self.ordered(min(held, key=self.cost))
        if not self.look(values).holds(factors):
            return
        gains = [
            item.price(value) - item.price(_up(item, value)) for item, value in zip(self.items, values, strict=True)
        ]
        for k in sorted(self.program.formulas, key=lambda k: -gains[k]):
            larger = (*values[:k], _up(self.items[k], values[k]), *values[k + 1 :])
            if larger != values and self.look(larger).holds(factors):
                values = larger

    def saving(self, outcome: Outcome, limits: NDArray[np.bool_], step: float) -> float:
        """By how much the cost falls where limits are loosened by a share, with exact / first order as it is."""
        ratio = _ratio(self._seen(outcome.values))
        if self.cheapest == outcome.values:
            return 0.0
        before = self._first_order(np.ones(len(ratio)), ratio)[0]
        saved = before - self._first_order(np.where(limits, 1.0 + step, 1.0), ratio)[0]
        return saved if saved > SETTLED * (1.0 + abs(before)) else 0.0

    def _first_order(self, factors: Floats, ratio: Floats) -> tuple[float, WorstLook | None]:
        """Least cost of the rows with right sides divided by a ratio, and the look at the plan that has it."""
        bound, look = np.nan, None
        for _ in range(MOST_FIRST):
            plan = self._solve(factors, ratio)
            if plan is None:
                return bound, look
            bound = plan.bound
            look = self._seen(plan.values)
            if not self._add(look, ratio, factors):
                break
        return bound, look

    def _correct(self, look: WorstLook, factors: Floats) -> bool:
        """Divide right sides by exact / first order until the limits hold; whether the cost settled."""
        aim, before, ratio = 1.0 if self.is_discrete else 1.0 - MARGIN, np.inf, _ratio(look)
        for number in range(MOST_EXACT):
            plan = self._solve(factors, ratio / aim)
            if plan is None:
                return False
            look = self._seen(plan.values)
            added = self._add(look, ratio / aim, factors)
            most = float((look.used / factors[:, None]).max())
            if look.holds(factors):
                if not added and abs(plan.cost - before) <= SETTLED * (1.0 + abs(plan.cost)):
                    return True
            elif not added and most < 1.0 + 10.0 * EXCESS:
                aim *= 2.0 - most - EXCESS / 10.0
            before = plan.cost
            ratio = np.maximum(ratio, _ratio(look)) if number >= PATIENCE else _ratio(look)
        return False

    def _cheaper(self, factors: Floats) -> bool:
        """Look for choices that are cheaper and hold; whether there are none left."""
        ratio = self._least_ratio(factors)
        beyond = [values for values, look in self.looks.items() if not (look.failed or look.holds(factors))]
        for _ in range(MOST_CHEAPER):
            plan, held = self._solve(factors, ratio, beyond), self.best(factors, "ok")
            if plan is None or held is None or plan.cost >= held.cost - ROUNDING * (1.0 + abs(plan.cost)):
                return True
            look = self._seen(plan.values)
            self._add(look, ratio, factors)
            if not look.holds(factors):
                beyond.append(plan.values)
        return False

    def _least_ratio(self, factors: Floats) -> Floats:
        """The least exact / first order near the limits, with room below for plans that nobody has looked at."""
        looks = [self._seen(values) for values in self.looks]
        near = [_ratio(look) for look in looks if 0.8 < (look.used / factors[:, None]).max() < 1.25]
        seen = np.array(near or [_ratio(look) for look in looks])
        least, most = seen.min(axis=0), seen.max(axis=0)
        return np.asarray(least - np.maximum(BAND * np.abs(least - 1.0), (most - least) / 2.0))

    def _add(self, look: WorstLook, ratio: Floats, factors: Floats, *, every: bool = False) -> bool:
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
        places = np.array([key[:2] for key in self._rows])
        parts = np.array([row for row, _ in self._rows.values()])
        rest = np.array([rest for _, rest in self._rows.values()])
        allowed = factors[places[:, 0]] / np.maximum(ratio[places[:, 0], places[:, 1]], ROUNDING)
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


def _ratio(look: WorstLook) -> Floats:
    """Exact over first order; 1 where nothing is off."""
    some = look.first > ROUNDING
    return np.divide(look.used, look.first, out=np.ones_like(look.used), where=some)


def _up(item: Item, value: float) -> float:
    """The next size by formula that can be ordered."""
    return item.next_ordered(value) if item.is_formula else value


def _decision(item: Item) -> Formula | Prices:
    if not item.is_formula:
        return Prices(tuple(option.cost for option in item.options))
    low, high = (option.size for option in item.options)
    return Formula(low, high, item.cost.at, item.cost.slope, item.cost.bend)
