"""The cheapest plan with a required yield.

1. First order. The plans are asked, the cheapest first, how many of the specimens are outside to first order; the first
   that holds is the optimum there, `first_order_bound`.
2. Exact closure. The plan is looked at; the ratio of its quantile to that of the first order corrects the shares, and
   sizes by formula are found again, until they stay.
3. Every cheaper plan that holds with the least ratio that was seen, and some room, is looked at, the cheapest first.

With few choices all plans are asked. With many, the tightest completion of some choices rules out all others, which
is so where sets are nested and offsets scatter, and the search may end at its limit of steps.
"""

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations, count, product

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.questions import SAMPLES

from .plans import Outcome, Plans, Values
from .scatter import Scatter, YieldLook
from .sizes import Sizes
from .specimens import OutsideSpecimens

Choices = tuple[int, ...]

#: plans by choice up to which all are asked, and plans that are asked at most
ENUMERATED, MOST_ASKED = 5_000, 15_000
#: choices whose plans are looked at on the exact closure, and looks at each
MOST_LOOKED, MOST_LOOKS = 40, 10
#: by how much shares count more where a plan misses its limits and nothing says by how much
STEP = 1.1
#: plans that are asked where sizes by formula are looked for, about
ASKED = 100
#: share of the cost that is rounding
SAME = 1e-9
#: share of the cost that a cheaper plan has to save to be looked for beside sizes by formula
WORTH = 1e-3
#: share of the deviation of exact / first order from 1 by which others may differ in it, and what they may at least
BAND, ROOM = 0.6, 0.003
#: where exact / first order is compared: shares of a limit that are used
NEAR = (0.7, 1.5)
#: share of a limit up to which more specimens may show that a plan holds
CLOSE = 1.1
#: share of a limit to first order below which nobody looks before the end
FAR = 0.75


@dataclass
class SampledSearch(Plans):
    """Searches for one set of limits after another, each times a factor; what was seen is kept.

    Parameters
    ----------
    items : sequence of Item
    looking : Scatter
    least : float
        The smallest factor on the limits that will be asked for.
    """

    least: float = 1.0
    _specimens: OutsideSpecimens | None = None
    _ratios: dict[Values, Floats] = field(default_factory=dict)
    _most: Floats = field(default_factory=lambda: np.ones(0))

    def run(self, factors: Floats) -> Outcome:
        """The cheapest plan that was found whose limits hold, each limit times its factor.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C; `best` is the cheapest plan that was seen to hold.
        """
        if self.look(self.cheapest).holds(factors):
            return self.best(factors, "ok", self.cost(self.cheapest)) or self.none()
        self.look_at_ends()
        ones = np.ones(len(self.specimens.tails))
        first = _Enumeration(self, ones, factors)
        tried = set[Choices]()
        if not first.are_few and (start := first.exchanged()) is not None:
            tried.add(start)
            self._settle(start, ones, factors)
        bound, best_choices = next(iter(first), (math.nan, None))
        if best_choices is not None:
            tried.add(best_choices)
            self._settle(best_choices, ones, factors)
        rest = _Enumeration(self, self._least_ratio(), factors, only_cheaper=True)
        finished = True
        for number, (_, choices) in enumerate(rest):
            if choices in tried:
                continue
            if number >= MOST_LOOKED:
                finished = False
                break
            tried.add(choices)
            self._settle(choices, self._last_ratio(), factors)
        finished = finished and not (first.gave_up or rest.gave_up)
        self._look_closer(factors)
        while (best := self.best(factors, "ok" if finished else "unfinished", bound)) is not None:
            if self._whole(best.values).holds(factors):
                return replace(best, look=self.looks[best.values])
        self._whole(self.tightest)
        return self.none()

    def look(self, values: Values) -> YieldLook:
        """The look at a plan; where the first order says that little of the limits is used, it is not taken yet."""
        if values not in self.looks:
            assert isinstance(self.looking, Scatter)
            far = None
            if values != self.cheapest:
                tails = self.specimens
                far = np.ones_like(self._whole(self.cheapest).quantile, dtype=bool)
                quantiles = tails.quantiles(values, tails.ones * self.least) * self._most
                for tail, quantile in zip(tails.tails, quantiles.tolist(), strict=True):
                    far[tail.place] = quantile < FAR
            self._keep(values, self.looking.look(values, far=far))
        look = self.looks[values]
        assert isinstance(look, YieldLook)
        return look

    def _look_closer(self, factors: Floats) -> None:
        """Look at the sizes in the file with as many specimens as `random` has, where these may show that they hold.

        What it says to hold must not be called too loose here.
        """
        best, values = self.best(factors, "ok"), self.before
        if values is None or (best is not None and best.cost <= self.cost(values)):
            return
        look, looking = self._whole(values), self.looking
        assert isinstance(looking, Scatter)
        near = 1.0 < float((look.used / factors[:, None]).max()) < CLOSE
        if (
            near
            and looking.required.samples < SAMPLES
            and (closer := looking.with_samples(SAMPLES).look(values)).holds(factors)
        ):
            self._keep(values, closer)

    def _whole(self, values: Values) -> YieldLook:
        """The look at a plan with all specimens."""
        look = self.look(values)
        if not look.is_whole:
            assert isinstance(self.looking, Scatter)
            look = self.looking.look(values, known=look)
            self._keep(values, look)
        return look

    @property
    def specimens(self) -> OutsideSpecimens:
        """The specimens to first order, drawn when they are first needed."""
        if self._specimens is None:
            assert isinstance(self.looking, Scatter)
            self._specimens = OutsideSpecimens(self.looking, self.look(self.cheapest).quantile, self.least)
            self._most = np.ones(len(self._specimens.tails))
            self._ratio(self.cheapest)
        return self._specimens

    def saving(self, outcome: Outcome, limits: NDArray[np.bool_], step: float) -> float:
        """By how much the cost falls where limits are loosened by a share, with exact / first order as it is."""
        if self.cheapest == outcome.values:
            return 0.0
        ratio, ones = self._ratio(outcome.values), np.ones(len(limits))
        costs = [
            next(iter(_Enumeration(self, ratio, factors)), (math.inf, ()))[0]
            for factors in (ones, np.where(limits, 1.0 + step, 1.0))
        ]
        saved = costs[0] - costs[1]
        return saved if math.isfinite(saved) and saved > SAME * (1.0 + abs(costs[0])) else 0.0

    def ceiling(self, factors: Floats) -> float:
        """What a plan has to cost less than to be of interest."""
        held = self.best(factors, "ok")
        if held is None:
            return math.inf
        has_sizes = any(item.is_formula for item in self.items)
        return held.cost - (WORTH if has_sizes else SAME) * abs(held.cost)

    def _settle(self, choices: Choices, ratio: Floats, factors: Floats) -> None:
        """Look at the best plan with some choices, and find its sizes again with exact / first order there.

        Where that does not settle it, the ratio is halved between one with which the plan holds and one with which it
        does not.
        """
        sizes = Sizes(self.specimens, choices, factors)
        missed: Floats | None = None
        held: Floats | None = None
        cost = dear = math.inf
        cheap = 0.0
        for _ in range(MOST_LOOKS):
            values = sizes.least(ratio)
            if values is None or (missed is not None and self.cost(values) >= self.ceiling(factors)):
                return
            look = self.look(values)
            if not any(item.is_formula for item in self.items):
                return
            if look.holds(factors):
                held, dear = ratio, self.cost(values)
            else:
                missed, cheap = ratio, self.cost(values)
            now = self._ratio(values)
            if held is None:
                # A ratio that is known says how much less is needed, at least a little; else a part of it.
                ratio = np.maximum(now, ratio * (1.0 + ROOM)) if (now > ratio).any() else ratio * STEP
            elif missed is None:
                if not self.cost(values) < (1.0 - WORTH) * cost:
                    return
                cost, ratio = self.cost(values), np.minimum(now, ratio)
            else:
                if dear < (1.0 + ROOM) * cheap:
                    return
                ratio = np.sqrt(held * missed)

    def _ratio(self, values: Values) -> Floats:
        """Exact over first order at a plan, of every tail; 1 where it is far from its limit."""
        if values not in self._ratios:
            look = self.look(values)
            tails = self.specimens.tails
            first = self.specimens.quantiles(values, np.ones(len(look.used)))
            exact = np.array([look.quantile[tail.place] for tail in tails])
            near = (first > NEAR[0]) & (first < NEAR[1]) & np.isfinite(exact)
            self._ratios[values] = np.where(near, exact / np.where(near, first, 1.0), 1.0)
            self._most = np.maximum(self._most, self._ratios[values])
        return self._ratios[values]

    def _last_ratio(self) -> Floats:
        """Exact over first order at the plan that was looked at last."""
        return self._ratio(next(reversed(self.looks)))

    def _least_ratio(self) -> Floats:
        """The least exact / first order that was seen, with room below for plans that nobody has looked at."""
        seen = np.array([self._ratio(values) for values in self.looks])
        least, most = seen.min(axis=0), seen.max(axis=0)
        away = np.maximum(np.abs(least - 1.0), np.abs(most - 1.0))
        return np.asarray(least - np.maximum(BAND * away, ROOM))


class _Enumeration:
    """Choices whose plans hold to first order, with the cost of the best of them, the cheapest first.

    They wait in a queue by a bound of their cost: what the choices cost and all sizes by formula at their largest, then
    each size as large as it can be alone, then the best sizes.

    Parameters
    ----------
    search : SampledSearch
    ratio : ndarray
        On the shares of every tail.
    factors : ndarray
        On the limits.
    only_cheaper : bool
        Whether the search ends at the cost of the best plan that holds.

    Attributes
    ----------
    gave_up : bool
        Whether there may be others.
    """

    def __init__(self, search: SampledSearch, ratio: Floats, factors: Floats, *, only_cheaper: bool = False) -> None:
        self.search, self.ratio, self.factors, self.only_cheaper = search, ratio, factors, only_cheaper
        self.items, self.specimens = search.items, search.specimens
        self.has_sizes = any(item.is_formula for item in self.items)
        self.discrete = [k for k, item in enumerate(self.items) if not item.is_formula]
        self.gave_up, self.asked = False, 0
        self._number = count()
        self._queue: list[tuple[float, int, int, Choices]] = []
        counts = [range(len(self.items[k].options)) for k in self.discrete]
        self.costs = [[option.cost for option in self.items[k].options] for k in self.discrete]
        self.left = [0.0] * (len(counts) + 1)
        self.are_few = math.prod(map(len, counts)) <= ENUMERATED
        if self.are_few:
            for choices in product(*counts):
                self._put(choices, 0)
        else:
            # What one choice needs with all others at their tightest, none can do without.
            for j in range(len(counts)):
                self.costs[j] = [
                    cost if self._holds(self._completed((o,), j)) else math.inf for o, cost in enumerate(self.costs[j])
                ]
            for j in reversed(range(len(counts))):
                self.left[j] = self.left[j + 1] + min(self.costs[j])
            self._put((), 0)

    def __iter__(self) -> Iterator[tuple[float, Choices]]:
        while self._queue:
            bound, _, stage, choices = heapq.heappop(self._queue)
            if self.only_cheaper and bound >= self.search.ceiling(self.factors):
                return
            if self.asked > MOST_ASKED:
                self.gave_up = True
                return
            if len(choices) < len(self.discrete):
                for option, cost in enumerate(self.costs[len(choices)]):
                    longer = (*choices, option)
                    if math.isfinite(cost) and self._holds(self._completed(longer)):
                        self._put(longer, 0)
            elif not self.has_sizes:
                if self._holds(self._completed(choices)):
                    yield bound, choices
            elif stage == 0:
                sizes = self._sizes(choices)
                if sizes.anchor(self.ratio) is not None:
                    self._put(choices, 1, sizes.alone(self.ratio))
            elif stage == 1:
                values = self._sizes(choices).least(self.ratio)
                if values is not None:
                    self._put(choices, 2, self.search.cost(values))
            else:
                yield bound, choices

    def exchanged(self) -> Choices | None:
        """Choices that hold and that no change of one or two makes cheaper; None where the tightest ones miss."""
        now = tuple(round(self.search.tightest[k]) for k in self.discrete)
        if not self._holds(self._completed(now)):
            return None
        for width in (1, 2, 1, 2):
            while (cheaper := self._cheaper(now, width)) is not None:
                now = cheaper
        return now

    def _cheaper(self, now: Choices, width: int) -> Choices | None:
        """The choices that save most, of those that differ in one or two places and hold."""
        found = []
        for places in combinations(range(len(now)), width):
            for options in product(*(range(len(self.costs[j])) for j in places)):
                saved = sum(self.costs[j][now[j]] - self.costs[j][o] for j, o in zip(places, options, strict=True))
                if saved > SAME:
                    found.append((saved, places, options))
        for _, places, options in sorted(found, reverse=True):
            new = list(now)
            for j, option in zip(places, options, strict=True):
                new[j] = option
            if self.asked <= MOST_ASKED and self._holds(self._completed(tuple(new))):
                return tuple(new)
        return None

    def _sizes(self, choices: Choices) -> Sizes:
        self.asked += ASKED
        return Sizes(self.specimens, choices, self.factors)

    def _put(self, choices: Choices, stage: int, cost: float | None = None) -> None:
        if cost is None:
            cost = self._bound(choices)
        if math.isfinite(cost):
            heapq.heappush(self._queue, (cost, next(self._number), stage, choices))

    def _bound(self, choices: Choices) -> float:
        fixed = sum(self.costs[j][option] for j, option in enumerate(choices))
        return fixed + self.left[len(choices)] + sum(item.options[1].cost for item in self.items if item.is_formula)

    def _completed(self, choices: Choices, first: int = 0) -> Values:
        """A plan with some choices, and the rest as tight as can be."""
        values = list(self.search.tightest)
        for k, option in zip(self.discrete[first:], choices, strict=False):
            values[k] = float(option)
        return tuple(values)

    def _holds(self, values: Values) -> bool:
        self.asked += 1
        # Of few plans all that may hold are looked at.
        sure = not (self.only_cheaper and self.are_few) or self.has_sizes
        return self.specimens.holds(values, self.ratio, self.factors, sure=sure)
