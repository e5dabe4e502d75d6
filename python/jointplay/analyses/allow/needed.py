"""The smallest size of a clearance with which an over-constrained mechanism can be assembled without strain.

    clearance factor(u) <= 1 for all deviations u within their tolerances

The clearance factor is convex in the deviations, so that it is largest at a corner of their box. Clearances whose size
scatters have their smallest play.
"""

import math

import numpy as np

from jointplay.analyses.assemble.specimens import FITS
from jointplay.analyses.assemble.worst import corners_of
from jointplay.analyses.nominal import Nominal
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.gaps import centre
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing

#: halvings, more than any tolerance needs
MOST_STEPS = 60
#: share of the largest size below which a size is none
NOTHING = 1e-9


class Needed:
    """Looks for the smallest sizes.

    Parameters
    ----------
    m : Mechanism
        Over-constrained.
    at : Nominal
        Its configurations.
    """

    def __init__(self, m: Mechanism, at: Nominal) -> None:
        self.m = m
        self.places = [k for k in range(len(at)) if at.status[k] == 0]
        self.at = at

    def of(self, source: Sizing, largest: float, tolerance: float) -> float:
        """The smallest size of a clearance; nan where none is enough."""
        if self._fits(source, 0.0):
            return 0.0
        high = source.size or NOTHING * largest
        while not self._fits(source, high):
            if high >= largest:
                return math.nan
            high = min(8.0 * high, largest)
        low = 0.0
        for _ in range(MOST_STEPS):
            if high - low <= tolerance * high or high <= NOTHING * largest:
                break
            middle = (low + high) / 2.0
            low, high = (low, middle) if self._fits(source, middle) else (middle, high)
        return high

    def _fits(self, source: Sizing, size: float) -> bool:
        """Whether every specimen can be assembled without strain."""
        try:
            copy = self.m.with_(source.resized(size))
            return all(self._factor(copy, k) <= FITS for k in self.places)
        except InputError:
            return False

    def _factor(self, m: Mechanism, k: int) -> float:
        """The largest clearance factor at a configuration."""

        def factors(u: Floats) -> Floats:
            found = m.core.loaded_specimens(self.at.drives[k : k + 1], self.at.poses[k : k + 1], u)
            return found["clearance_factor"]

        largest = factors(corners_of(m, centre(m, "smallest"), range(len(m.sources)), factors)).max()
        return float(np.inf if np.isnan(largest) else largest)
