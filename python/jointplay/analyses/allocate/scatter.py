"""A required yield as a question of allocation.

At a plan specimens are drawn, closed exactly, and each gets the largest share of a limit that its error uses:

    used    the share that so many specimens exceed as may, for the required yield to hold with `CONFIDENCE`
    first   standard deviation / limit, to first order;  its square is linear in the squares of the sizes

The quantile of the samples over the standard deviation corrects the right side of the rows: no law is assumed. The
same random numbers are drawn for all plans, so that plans differ by their sizes alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Nominal
from jointplay.model import Mechanism
from jointplay.result import split

from .items import Item
from .looks import Limit, Look, merged, sources_of

Floats = NDArray[np.float64]
#: how sure it is that the yield is reached, from the samples that were drawn
CONFIDENCE = 0.975


def most_outside(samples: int, probability: float) -> int:
    """How many of the samples may be outside; -1 where there are too few samples to know.

    The share that is outside is below ``1 - probability`` with `CONFIDENCE` (Clopper and Pearson).

    Examples
    --------
    >>> most_outside(10_000, 0.99)
    80
    """
    from scipy.stats import beta

    low, high = -1, int(samples * (1.0 - probability))
    while low < high:
        middle = (low + high + 1) // 2
        if beta.ppf(CONFIDENCE, middle + 1, samples - middle) <= 1.0 - probability:
            low = middle
        else:
            high = middle - 1
    return low


class Scatter:
    """Looks at plans by the scatter of the error.

    Parameters
    ----------
    m, items, limits, places
        As of `WorstCase`.
    samples, seed : int
    probability : float
        The required yield, in every configuration.
    """

    power = 2

    def __init__(
        self,
        m: Mechanism,
        items: Sequence[Item],
        limits: Sequence[Limit],
        places: dict[str | None, Nominal],
        samples: int,
        seed: int,
        probability: float,
    ) -> None:
        self.m, self.items, self.limits, self.places = m, items, limits, places
        self.samples, self.seed = samples, seed
        self.outside = most_outside(samples, probability)
        self._table = self._variances()

    def look(self, values: Sequence[float]) -> Look:
        """What a plan brings."""
        changed = self.m.with_(merged(self.items, values))
        count = len(next(iter(self.places.values())))
        shape = (len(self.limits), count)
        used, status = np.zeros(shape), np.zeros(count, np.uint8)
        first = np.zeros(shape)
        for output, at in self.places.items():
            part = changed.only(output)
            rows = [k for k, limit in enumerate(self.limits) if limit.output == output]
            for c in range(count):
                found = part.core.random(
                    at.drives[c : c + 1],
                    at.poses[c : c + 1],
                    self.samples,
                    self.seed,
                    np.array([0.5]),
                    keep=True,
                    sampling="plain",
                )
                status[c] = max(status[c], at.worse(found["status"], slice(c, c + 1))[0])
                shares = np.stack([self._share(part, found["kept_errors"], self.limits[row]) for row in rows])
                # A specimen that cannot be assembled keeps to no limit.
                shares[:, ~np.isfinite(shares).all(axis=0)] = np.inf
                # One specimen is lost once, whichever limits it misses.
                used[rows, c] = np.sort(shares.max(axis=0))[self.samples - 1 - self.outside]
                variance = np.diagonal(found["covariance_first_order"], axis1=1, axis2=2)
                for row in rows:
                    first[row, c] = np.sqrt(self._of(part, variance, self.limits[row])[0])
        # What of the limits is used is known of all of one output together, and shared out as their deviations are.
        for output in self.places:
            rows = [k for k, limit in enumerate(self.limits) if limit.output == output]
            largest = first[rows].max(axis=0)
            used[rows] *= np.divide(first[rows], largest, out=np.ones_like(first[rows]), where=largest > 0.0)
        parts, rest = self._table
        directions = np.zeros((*shape, 2 if self.m.data.space == "planar" else 3))
        return Look(used, first, parts, rest, status, directions).where_counted(self.places)

    def _share(self, m: Mechanism, errors: Floats, limit: Limit) -> Floats:
        lengths, _ = split(list(m.components))
        n = len(lengths)
        if limit.quantity in ("position", "rotation"):
            part = errors[:, :n] if limit.quantity == "position" else errors[:, n:]
            return np.asarray(np.linalg.norm(part, axis=1) / limit.value)
        sign = -1.0 if limit.side == "low" else 1.0
        return np.asarray(sign * errors[:, m.components.index(limit.quantity)] / limit.value)

    def _of(self, m: Mechanism, variance: Floats, limit: Limit) -> Floats:
        """The variance of what is limited, over the square of the limit; the last axis is the component."""
        n = len(split(list(m.components))[0])
        if limit.quantity in ("position", "rotation"):
            own = variance[..., :n] if limit.quantity == "position" else variance[..., n:]
            return np.asarray(own.sum(axis=-1) / limit.value**2)
        return np.asarray(variance[..., m.components.index(limit.quantity)] / limit.value**2)

    def _variances(self) -> tuple[Floats, Floats]:
        """What every column adds to the squares of `first`, and what the sources without a cost do."""
        deepest = max(1 if item.is_formula else len(item.options) for item in self.items)
        count = len(next(iter(self.places.values())))
        columns = [1 if item.is_formula else len(item.options) for item in self.items]
        first = np.cumsum([0, *columns])
        parts = np.zeros((len(self.limits), count, int(first[-1])))
        rest = np.zeros((len(self.limits), count))
        for depth in range(deepest):
            values = [self._value(item, min(depth, n - 1)) for item, n in zip(self.items, columns, strict=True)]
            changed = self.m.with_(merged(self.items, values))
            for output, at in self.places.items():
                part = changed.only(output)
                found = part.core.random(at.drives, at.poses, 2, self.seed, np.array([0.5]))
                for row, limit in enumerate(self.limits):
                    if limit.output != output:
                        continue
                    shares = self._of(part, found["contribution"], limit)
                    others = shares.sum(axis=1)
                    for k, item in enumerate(self.items):
                        own = shares[:, sources_of(part, item)].sum(axis=1)
                        others = others - own
                        if depth < columns[k]:
                            scale = item.options[-1].size ** -2 if item.is_formula else 1.0
                            parts[row, :, first[k] + depth] = own * scale
                    rest[row] = others
        return parts, rest

    def _value(self, item: Item, depth: int) -> float:
        return item.options[-1].size if item.is_formula else float(depth)
