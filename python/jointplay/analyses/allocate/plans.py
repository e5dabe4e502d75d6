"""Plans that were looked at: none twice, and the cheapest of those that hold is the answer.

A plan has a value for every source with a cost: its size, or the number of its choice. The sizes in the file are one,
so that an answer is never dearer than a file whose limits hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.basics.arrays import Floats
from jointplay.basics.progress import counting

from .items import Item
from .looks import Look, Looking

Values = tuple[float, ...]
#: looks that a search usually takes, for the bar
EXPECTED = 20


@dataclass(frozen=True)
class Outcome:
    """What a search found."""

    #: ``ok``; ``infeasible``: no plan was found whose limits hold; ``unfinished``: the search reached its limit of
    #: steps, and the plan holds but may not be the cheapest; or that of the exact closure, with the tightest sizes
    status: str
    #: sizes of formulas and numbers of choices; the tightest ones where nothing holds
    values: Values
    cost: float
    #: least cost to first order
    bound: float
    #: at the plan
    look: Look


@dataclass
class Plans:
    """Looks at plans, each taken once."""

    items: Sequence[Item]
    looking: Looking
    progress: Progress | None = None
    looks: dict[Values, Look] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.step = counting(self.progress, EXPECTED)
        self.tightest = tuple(_extreme(item, loosest=False) for item in self.items)
        self.cheapest = tuple(_extreme(item, loosest=True) for item in self.items)
        before = [item.before for item in self.items]
        #: the sizes in the file; None where one of them has no cost
        self.before = None if None in before else tuple(value for value in before if value is not None)

    def look(self, values: Values) -> Look:
        """The look at a plan."""
        if values not in self.looks:
            self._keep(values, self.looking.look(values))
        return self.looks[values]

    def _keep(self, values: Values, look: Look) -> None:
        self.looks[values] = look
        self.step()

    def look_at_ends(self) -> None:
        """Look at the sizes in the file, at the tightest and at the cheapest ones."""
        for values in (self.before, self.tightest, self.cheapest):
            if values is not None:
                self.look(values)

    def best(self, factors: Floats, status: str, bound: float = np.nan, *, whole: bool = False) -> Outcome | None:
        """The cheapest plan of all that were looked at that holds and can be ordered.

        Parameters
        ----------
        factors : ndarray
            On the limits.
        status, bound
            Of the outcome.
        whole : bool
            Only of those that were looked at as a whole.
        """
        held = [
            values
            for values, look in self.looks.items()
            if look.holds(factors) and self.ordered(values) == values and (look.is_whole or not whole)
        ]
        if not held:
            return None
        values = min(held, key=self.cost)
        return Outcome(status, values, self.cost(values), bound, self.looks[values])

    def none(self) -> Outcome:
        """The outcome where nothing holds."""
        look = self.look(self.tightest)
        return Outcome(look.failed or "infeasible", self.tightest, self.cost(self.tightest), np.nan, look)

    def cost(self, values: Sequence[float]) -> float:
        """What a plan costs."""
        return float(sum(item.price(value) for item, value in zip(self.items, values, strict=True)))

    def ordered(self, values: Sequence[float]) -> Values:
        """A plan with sizes that can be ordered, none of them larger."""
        return tuple(item.ordered(value) for item, value in zip(self.items, values, strict=True))


def _extreme(item: Item, *, loosest: bool) -> float:
    """The tightest value of an item; the loosest one of the cheapest."""
    if item.is_formula:
        return item.options[loosest].size
    sizes = [(o.size, -k) for k, o in enumerate(item.options)]
    if not loosest:
        return float(-min(sizes, key=lambda pair: pair[0])[1])
    least = min(option.cost for option in item.options)
    return float(-min((pair for pair in sizes if item.options[-pair[1]].cost == least), key=lambda pair: pair[0])[1])
