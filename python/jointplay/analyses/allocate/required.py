"""The required share of the specimens, as `random` judges it.

    holds      1 - high >= required,      high the upper end of the 95 % confidence interval of the share outside
    last       the share of a limit that as many specimens exceed as may:  the limits times it, the yield just holds

The interval is that of the replicates of Sobol points, so that what is found here is what `random` says of the same
points.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.scatter import REPLICATES
from jointplay.basics import confidence
from jointplay.basics.arrays import Floats

#: specimens of a replicate that the core draws one after the other
CHUNK = 8192


@dataclass(frozen=True)
class Required:
    """A share that is required of so many specimens."""

    samples: int
    probability: float

    @property
    def most(self) -> int:
        """No more can be outside, however sure the share is."""
        return int(self.samples * (1.0 - self.probability))

    @property
    def is_possible(self) -> bool:
        """Whether so many specimens can show it at all.

        Examples
        --------
        >>> Required(1000, 0.9973).is_possible, Required(2000, 0.9973).is_possible
        (False, True)
        """
        return self.met(np.zeros(self.replicates))

    @property
    def replicates(self) -> int:
        """How many there are."""
        return min(self.samples, REPLICATES)

    def labels(self) -> NDArray[np.intp]:
        """The replicate of every specimen, in the order in which the core keeps them."""
        least, more = divmod(self.samples, self.replicates)
        found, left = [], np.array([least + (r < more) for r in range(self.replicates)])
        while left.any():
            taken = np.minimum(left, CHUNK)
            found.append(np.repeat(np.arange(self.replicates), taken))
            left = left - taken
        return np.concatenate(found)

    def met(self, counts: NDArray[Any]) -> bool:
        """Whether the yield holds with so many specimens outside in every replicate."""
        total = float(counts.sum())
        if total > self.most:
            return False
        n = self.samples / self.replicates
        mean = total / self.samples
        error = np.sqrt(((counts / n - mean) ** 2).sum() / (self.replicates * (self.replicates - 1.0)))
        _, high = confidence.of_errors(
            np.array([mean]), np.array([error]), self.replicates, np.array([float(self.samples)])
        )
        return bool(high[0] <= 1.0 - self.probability)

    def holds(self, outside: NDArray[np.bool_], labels: NDArray[np.intp]) -> bool:
        """Whether the yield holds with these specimens outside; those that are not among them are inside."""
        if np.count_nonzero(outside) > self.most:
            return False
        return self.met(np.bincount(labels[outside], minlength=self.replicates))

    def last(self, shares: Floats, labels: NDArray[np.intp]) -> float:
        """The share of a limit that as many exceed as may."""
        return float(shares[self.ranked(shares, labels)[0]])

    def ranked(self, shares: Floats, labels: NDArray[np.intp]) -> tuple[int, NDArray[np.intp]]:
        """The last specimen that is inside, and those that are outside before it, the farthest first."""
        count = min(self.most + 1, len(shares))
        top = np.argpartition(-shares, count - 1)[:count]
        top = top[np.argsort(-shares[top], kind="stable")]
        low, high = 0, count - 1
        while low < high:
            middle = (low + high + 1) // 2
            if self.met(np.bincount(labels[top[:middle]], minlength=self.replicates)):
                low = middle
            else:
                high = middle - 1
        return int(top[low]), top[:low]
