"""Sizes by formula beside given choices, with a required share of the specimens to first order.

    minimise   sum over formulas of cost(t)      subject to   quantile(t) <= 1  of every tail,   from <= t <= to

The quantile is that of the specimens, whatever their laws. Its square is linearised in the squares of the sizes, in
which it is linear for a normal law; the convex program of these rows is solved, its sizes are taken back to where all
tails hold, and so on until the cost stays. In the end sizes are rounded down to what can be ordered, and each of them
made as large again as the others leave it.
"""

from collections.abc import Callable

import numpy as np

from jointplay.basics.arrays import Floats

from .convex import least
from .items import Item
from .plans import Values
from .program import Formula
from .specimens import OutsideSpecimens

#: linearisations, and the share of the cost that they have to save
MOST_ROUNDS, SETTLED = 12, 1e-4
#: halvings of a way from sizes that hold to others
HALVINGS = 14
#: from which share of a limit on a tail is linearised
NEAR = 0.5
#: places between the smallest and the largest sizes at which sizes that hold are looked for
PLACES = 9


class Sizes:
    """The search beside some choices.

    Parameters
    ----------
    specimens : OutsideSpecimens
    choices : tuple of int
        Of the items that are not formulas, in their order.
    factors : ndarray
        On the limits.
    """

    def __init__(self, specimens: OutsideSpecimens, choices: tuple[int, ...], factors: Floats) -> None:
        self.specimens, self.factors = specimens, factors
        chosen = iter(choices)
        self.fixed = [None if item.is_formula else float(next(chosen)) for item in specimens.items]
        self.items = [item for item in specimens.items if item.is_formula]
        self.low, self.high = (np.array([item.options[end].size for item in self.items]) for end in (0, 1))

    def least(self, ratio: Floats) -> Values | None:
        """The cheapest sizes that can be ordered with which all tails hold, as a plan; None where none were found.

        Parameters
        ----------
        ratio : ndarray
            On the shares of every tail.
        """
        t = self.anchor(ratio)
        if t is None or not self.items:
            return None if t is None else self._plan(t)
        t = self._towards(t, self.high, ratio)
        cost = self._cost(t)
        for _ in range(MOST_ROUNDS):
            aim = self._linearised(t, ratio)
            if aim is None:
                break
            new = self._towards(t, aim, ratio)
            for _ in range(2):
                new = self._towards(new, self.high, ratio)
            saved, now = cost - self._cost(new), self._cost(new)
            if saved > 0.0:
                t, cost = new, now
            if saved <= SETTLED * abs(cost):
                break
        return self._plan(self._ordered(t, ratio))

    def anchor(self, ratio: Floats) -> Floats | None:
        """Sizes with which all tails hold: the smallest ones, or where the load decides perhaps larger ones."""
        for share in np.linspace(0.0, 1.0, PLACES if self.items else 1):
            t: Floats = self.low + share * (self.high - self.low)
            if self._holds(t, ratio):
                return t
        return None

    def alone(self, ratio: Floats) -> float:
        """What the choices cost, and each size as large as it can be with all others at their smallest."""
        if not self._holds(self.low, ratio):
            return self._cost(self.high)
        best = [self._farthest(self.low, k, ratio) for k in range(len(self.items))]
        return self._cost(np.array(best))

    def _farthest(self, t: Floats, k: int, ratio: Floats) -> float:
        aim = t.copy()
        aim[k] = self.high[k]
        return float(self._towards(t, aim, ratio, beyond=True)[k])

    def _linearised(self, t: Floats, ratio: Floats) -> Floats | None:
        """The optimum with the tails as they are about some sizes."""
        quantile, slope = self.specimens.slopes(self._plan(t), self.factors)
        near = quantile * ratio > NEAR
        q = quantile[near]
        # d(q^2) / d(t^2); more play where the load decides may bring less: that is no room to count on.
        rows = np.maximum(q[:, None] * slope[near] / t, 0.0)
        right = ratio[near] ** -2 - q**2 + rows @ t**2
        found = least([_squared(item) for item in self.items], rows, right)
        return None if found is None else np.asarray(np.sqrt(found.values))

    def _towards(self, t: Floats, aim: Floats, ratio: Floats, *, beyond: bool = False) -> Floats:
        """As far from sizes that hold towards others as all tails hold; or the first place where they do not."""
        if self._holds(aim, ratio):
            return aim
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            low, high = (middle, high) if self._holds(t + middle * (aim - t), ratio) else (low, middle)
        return t + (high if beyond else low) * (aim - t)

    def _ordered(self, t: Floats, ratio: Floats) -> Floats:
        """Sizes rounded down to what can be ordered, and each as large again as the others leave it."""
        sizes = np.array([item.ordered(value) for item, value in zip(self.items, t.tolist(), strict=True)])
        if not self._holds(sizes, ratio):
            # Where the load decides, less may be too little.
            return t
        gains = [-item.cost.slope(value) * value for item, value in zip(self.items, sizes.tolist(), strict=True)]
        for k in np.argsort(gains)[::-1].tolist():
            while True:
                larger = sizes.copy()
                larger[k] = self.items[k].next_ordered(float(sizes[k]))
                if larger[k] <= sizes[k] or not self._holds(larger, ratio):
                    break
                sizes = larger
        return sizes

    def _plan(self, t: Floats) -> Values:
        sizes = iter(t.tolist())
        return tuple(next(sizes) if value is None else value for value in self.fixed)

    def _holds(self, t: Floats, ratio: Floats) -> bool:
        return self.specimens.holds(self._plan(t), ratio, self.factors)

    def _cost(self, t: Floats) -> float:
        plan = zip(self.specimens.items, self._plan(t), strict=True)
        return float(sum(item.price(value) for item, value in plan))


def _squared(item: Item) -> Formula:
    """The cost as a function of the square of the size: convex where that of the size is convex and falls."""
    cost = item.cost
    low, high = (option.size for option in item.options)

    def of_size(rate: Callable[[float], float]) -> Callable[[float], float]:
        return lambda z: rate(z**0.5)

    return Formula(
        low**2,
        high**2,
        of_size(cost.at),
        of_size(lambda t: cost.slope(t) / (2.0 * t)),
        of_size(lambda t: (cost.bend(t) - cost.slope(t) / t) / (4.0 * t**2)),
    )
