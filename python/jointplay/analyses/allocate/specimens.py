"""The specimens of a yield to first order: what every source adds to the error of every one of them.

    e_s(plan) = rest_s + sum over items of part_s(value)          the error of specimen s
    part_s(t) = part_s(from) + (t - from) / (to - from) (part_s(to) - part_s(from))          of a size by formula

The parts are those of the specimens that are drawn for the exact closure, so that both differ by the second order
alone, and thousands of plans are asked in the time of one on the closure. What counts is how many are outside, as it
does there: no law is assumed. Only specimens that may come near a limit with some plan are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.contacts import Assumed
from jointplay.analyses.nominal import Nominal
from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.result import split

from .items import Item
from .looks import Limit, sources_of
from .required import Required
from .scatter import Scatter

SizeValues = Sequence[float]

#: share of a limit that a specimen may reach with some plan from where on it is kept
NEAR = 0.6
#: numbers that are kept at most; beyond that, fewer specimens
MOST_NUMBERS = 40_000_000
#: ranks on each side of the last specimen inside, as a share of those that may be outside, that say how it moves
WINDOW, FEWEST = 0.3, 15


@dataclass
class CaseTail:
    """The specimens under one assumption at one configuration."""

    #: number of the assumption, and of the configuration
    place: tuple[int, int]
    required: Required
    #: the replicate of every specimen
    labels: NDArray[np.intp]
    #: every limit with its components and the factor by which they are shares of it: signed for one component
    rows: list[tuple[int, slice | int, float]]
    #: what sources without a cost add, shape (component, specimen)
    rest: Floats
    #: what each item adds with the values of its columns, shape (column, component, specimen)
    parts: list[Floats]

    def errors(self, items: Sequence[Item], values: SizeValues) -> Floats:
        """The errors with a plan, shape (component, specimen)."""
        errors = self.rest.copy()
        for item, part, value in zip(items, self.parts, values, strict=True):
            errors += _at(item, part, value)
        return errors

    def shares(self, errors: Floats, factors: Floats) -> Floats:
        """The largest share of a limit that each uses, shape (specimen,)."""
        shares: Floats | None = None
        for limit, which, scale in self.rows:
            own = errors[which] * scale if isinstance(which, int) else scale * _norm(errors[which])
            own = own / factors[limit]
            shares = own if shares is None else np.maximum(shares, own)
        assert shares is not None
        return shares

    def last(self, shares: Floats) -> float:
        """The share that as many exceed as may."""
        return self.required.last(shares, self.labels)


class OutsideSpecimens:
    """All specimens that may be outside.

    Parameters
    ----------
    scatter : Scatter
        Who draws them.
    loosest : ndarray
        The share of the limits that is used with the loosest plan, of every assumption and configuration.
    least : float
        The smallest factor on the limits that will be asked for.
    """

    def __init__(self, scatter: Scatter, loosest: Floats, least: float) -> None:
        self.scatter, self.items = scatter, scatter.items
        self.widths = [2 if item.is_formula else len(item.options) for item in self.items]
        near = np.argwhere(~(loosest < NEAR * least)).tolist()
        components = len(scatter.m.components)
        numbers = len(near) * components * (1 + sum(self.widths)) * scatter.required.samples
        stride = -(-numbers // MOST_NUMBERS)
        self.tails = [tail for a, c in near for tail in [self._tail(a, c, least, stride)] if tail.rest.shape[1]]
        self.order = list(range(len(self.tails)))
        self.ones = np.ones(len(scatter.limits))

    def quantiles(self, values: SizeValues, factors: Floats) -> Floats:
        """The share that as many specimens exceed as may, of every tail."""
        return np.array([tail.last(tail.shares(tail.errors(self.items, values), factors)) for tail in self.tails])

    def holds(self, values: SizeValues, ratio: Floats, factors: Floats, *, sure: bool = True) -> bool:
        """Whether no tail has more specimens outside than may be, with shares times a ratio.

        If it need not be `sure`, their share itself counts, and not how well it is known, which differs by chance.
        """
        for k in self.order:
            tail = self.tails[k]
            outside = tail.shares(tail.errors(self.items, values), factors) * ratio[k] > 1.0
            few = tail.required.holds(outside, tail.labels) if sure else outside.sum() <= tail.required.most
            if not few:
                # What missed last is asked first.
                self.order.remove(k)
                self.order.insert(0, k)
                return False
        return True

    def slopes(self, values: SizeValues, factors: Floats) -> tuple[Floats, Floats]:
        """The quantiles and how they grow with the sizes by formula, shape (tail, formula): the mean of how the
        specimens there do."""
        formulas = [k for k, item in enumerate(self.items) if item.is_formula]
        quantiles, slopes = np.zeros(len(self.tails)), np.zeros((len(self.tails), len(formulas)))
        for row, tail in enumerate(self.tails):
            errors = tail.errors(self.items, values)
            shares = tail.shares(errors, factors)
            last, outside = tail.required.ranked(shares, tail.labels)
            quantiles[row] = shares[last]
            width = max(FEWEST, int(WINDOW * len(outside)))
            place = len(outside)
            chosen = np.argsort(-shares)[max(0, place - width) : place + width + 1]
            here = errors[:, chosen]
            for column, k in enumerate(formulas):
                item, part = self.items[k], tail.parts[k][:, :, chosen]
                span = item.options[1].size - item.options[0].size
                slopes[row, column] = _growth(tail, here, (part[1] - part[0]) / span, factors)
        return quantiles, slopes

    def _tail(self, a: int, c: int, least: float, stride: int) -> CaseTail:
        """The specimens under an assumption at a configuration."""
        scatter, at = self.scatter, self.scatter.places[a]
        parts: list[list[Floats]] = [[] for _ in self.items]
        rest = np.empty(0)
        rows, needed = _rows(
            scatter.assumed[a].part, [(k, scatter.limits[k]) for k in scatter.rows_of(scatter.assumed[a])]
        )
        for depth in range(max(self.widths)):
            one = scatter.changed([self._value(item, depth) for item in self.items])[a]
            drawn = scatter.drawn(one, at, c)[0][::stride]
            slopes, shift = (values[needed] for values in _first_order(one, at, c))
            own = [_columns(one.part, item) for item in self.items]
            if depth == 0:
                others = np.setdiff1d(np.arange(drawn.shape[1]), np.concatenate(own))
                rest = (drawn[:, others] @ slopes[:, others].T + shift).T
            for k, columns in enumerate(own):
                if depth < self.widths[k]:
                    parts[k].append((drawn[:, columns] @ slopes[:, columns].T).T)
        stacked = [np.stack(part) for part in parts]
        # No plan takes a specimen farther than all parts together do.
        reach = np.abs(rest) + sum(np.abs(part).max(axis=0) for part in stacked)
        labels = scatter.labels[::stride]
        required = replace(scatter.required, samples=len(labels))
        tail = CaseTail((a, c), required, labels, rows, reach, stacked)
        tail.rows = [(k, which, abs(scale)) for k, which, scale in rows]
        kept = tail.shares(reach, np.full(len(scatter.limits), least)) > NEAR
        tail.rows = rows
        tail.labels = labels[kept]
        tail.rest = np.ascontiguousarray(rest[:, kept])
        tail.parts = [np.ascontiguousarray(part[:, :, kept]) for part in stacked]
        return tail

    def _value(self, item: Item, depth: int) -> float:
        """A value of an item, by the number of its column."""
        if item.is_formula:
            return item.options[min(depth, 1)].size
        return float(min(depth, len(item.options) - 1))


def _at(item: Item, part: Floats, value: float) -> Floats:
    """What an item adds with a value."""
    if not item.is_formula:
        return np.asarray(part[round(value)])
    low, high = (option.size for option in item.options)
    if value == high:
        return np.asarray(part[1])
    weight = (value - low) / (high - low)
    return np.asarray((1.0 - weight) * part[0] + weight * part[1])


def _norm(rows: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", rows, rows)))


def _rows(m: Mechanism, limits: Sequence[tuple[int, Limit]]) -> tuple[list[tuple[int, slice | int, float]], list[int]]:
    """The limits by their components, and which components they need."""
    names = list(m.components)
    n = len(split(names)[0])
    whole = {"position": list(range(n)), "rotation": list(range(n, len(names)))}
    of = {limit.quantity: whole.get(limit.quantity) or [names.index(limit.quantity)] for _, limit in limits}
    needed = sorted({component for components in of.values() for component in components})
    found: list[tuple[int, slice | int, float]] = []
    for k, limit in limits:
        first = needed.index(of[limit.quantity][0])
        if limit.quantity in whole:
            found.append((k, slice(first, first + len(of[limit.quantity])), 1.0 / limit.value))
        else:
            found.append((k, first, (-1.0 if limit.side == "low" else 1.0) / limit.value))
    return found, needed


def _columns(m: Mechanism, item: Item) -> NDArray[np.intp]:
    """The parameters of an item."""
    return np.concatenate([np.flatnonzero(m.parameter_source == s) for s in sources_of(m, item)])


def _first_order(one: Assumed, at: Nominal, c: int) -> tuple[Floats, Floats]:
    """The slopes of the error along all parameters, and what it is beside them."""
    drives, poses = at.drives[c : c + 1], at.poses[c : c + 1]
    slopes = one.part.core.sensitivity(drives, poses)["source"][0]
    known = one.part.core.given(drives, poses, one.part.centre[None])["error_first_order"][0]
    return slopes, known - slopes @ one.part.centre


def _growth(tail: CaseTail, errors: Floats, change: Floats, factors: Floats) -> float:
    """By how much the shares of some specimens grow where their errors change, on average."""
    best = np.full(errors.shape[1], -np.inf)
    rate = np.zeros(errors.shape[1])
    for limit, which, scale in tail.rows:
        scale = scale / factors[limit]
        if isinstance(which, int):
            own, grows = errors[which] * scale, change[which] * scale
        else:
            size = np.maximum(_norm(errors[which]), 1e-300)
            own, grows = size * scale, np.einsum("ij,ij->j", errors[which], change[which]) / size * scale
        rate = np.where(own > best, grows, rate)
        best = np.maximum(best, own)
    return float(rate.mean())
