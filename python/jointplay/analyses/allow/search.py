"""The largest size up to which limits hold, by bracket and false position.

    lo holds, hi does not, hi - lo <= tolerance * hi          allowed = lo

In the worst case a larger size never uses less of the limits, because the sets of offsets are nested. Otherwise, and
where members are strained into place, sizes below hi are scanned for one at which limits are missed
already. The first points are the size that is there and zero; to first order the worst case is linear in between, so
that few more are needed.

A size may be too small as well: teeth jam where runout takes all of their backlash, and parts of an over-constrained
mechanism do not fit together. Such sizes have no error; the limits have to hold at those above them. Where the limits
hold with the size that is there, they are looked for from it on: what is missed below it is told, and does not count.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .asked import ASSEMBLY, REFUSED, Use

#: evaluations after which a search ends with the bracket that it has; halving alone would reach any tolerance by then
MOST_STEPS = 80
#: relative difference of what is used that is rounding
SAME = 1e-9
#: equal steps in which sizes below a missed one are scanned
SCANNED = 16
#: halves of a size that holds at which smaller ones are looked at
HALVED = 4
#: by how much more a size is tried where nothing says more
GROWTH = 8.0
#: steps of false position within which a bracket has to be halved
ROUNDS = 3
#: share of the largest size below which an allowed size is none
NOTHING = 1e-9
#: relative width within which the smallest size is known
FLOOR = 0.02


@dataclass(frozen=True)
class Found:
    """What a search found."""

    #: ``ok``; ``unlimited``: limits hold up to the largest size that was tried, or that the file can have;
    #: ``no_effect``: they do, and that size changes nothing of what is limited; ``not_enough``: they are missed with a
    #: size of zero as well, or with the smallest one that can be assembled; ``needs_play``: they hold with the size
    #: that is there, and are missed with a size of zero
    status: str
    #: the largest size up to which limits hold; nan where there is none
    allowed: float
    #: what is used at the smallest size that was found to be too large, or at the largest one
    use: Use
    #: what is used with a size of zero
    without: Use
    #: the smallest size from which on they hold up to `allowed`; nan where there is none
    smallest: float = np.nan
    #: the largest size below it that was found to be too small; nan where zero is none
    too_small: float = np.nan
    #: what is used with that
    below: Use | None = None


class AllowSearch:
    """One source and its sizes.

    Parameters
    ----------
    use : callable
        What is used with a size, at given configurations or at all of them.
    size : float
        The size that is there.
    now : Use
        What is used with it.
    largest : float
        No larger size is tried.
    guess : float
        A size to begin with where there is none.
    tolerance : float
        Relative width of the bracket in the end.
    is_monotone : bool
        Whether a larger size never uses less of the limits.
    """

    def __init__(
        self,
        use: Callable[..., Use],
        size: float,
        now: Use,
        largest: float,
        guess: float,
        *,
        tolerance: float,
        is_monotone: bool,
    ) -> None:
        self.use, self.tolerance, self.is_monotone = use, tolerance, is_monotone
        self.largest = max(largest, GROWTH * size)
        self.now, self.size = now, size
        self.known: dict[float, Use] = {size: now}
        self.near = now.near
        self.start = size or min(guess, self.largest)

    def found(self) -> Found:
        """Search."""
        without = self.at(0.0)
        found = self._bracketed(without)
        if np.isfinite(found.allowed) and not self.use_everywhere(found.allowed).holds:
            # Another configuration than those that were near is the one that binds.
            self.near = None
            self.known = {size: use for size, use in self.known.items() if not use.holds or size == 0.0}
            self.known[found.allowed] = self.use_everywhere(found.allowed)
            found = self._bracketed(without)
        return self._with_smallest(found) if np.isfinite(found.allowed) else found

    def _with_smallest(self, found: Found) -> Found:
        """With the smallest size from which on limits hold."""
        end = self.size if self.now.holds and self.size > 0.0 else found.allowed
        missed = [size for size, use in self.known.items() if size < end and not use.holds]
        if not missed:
            return replace(found, smallest=0.0)
        low = max(missed)
        high = min(size for size, use in self.known.items() if size > low and use.holds)
        while high - low > FLOOR * high and high > NOTHING * self.largest:
            middle = (low + high) / 2.0
            low, high = (low, middle) if self.at(middle).holds else (middle, high)
        return replace(found, smallest=high, too_small=low, below=self.at(low))

    def use_everywhere(self, size: float) -> Use:
        """What is used with a size at all configurations."""
        if self.near is None:
            return self.at(size)
        return self.use(size, None)

    def at(self, size: float) -> Use:
        """What is used with a size."""
        if size not in self.known:
            # Zero is a place from which nothing can be said of what is near.
            self.known[size] = self.use(size, None if size == 0.0 else self.near)
        return self.known[size]

    def _bracketed(self, without: Use) -> Found:
        low = self._smallest(without)
        if low is None:
            return Found("needs_play" if self.now.holds else "not_enough", np.nan, without, without)
        first, low = low, max(low, self.size) if self.now.holds else low
        high = self._missed(low)
        if not self.is_monotone:
            low, high = self._scanned(first, low, high)
        if high is None:
            low = max(size for size, use in self.known.items() if use.holds)
            used = [use.used for use in self.known.values()]
            same = np.isfinite(used).all() and max(used) - min(used) <= SAME * max(used)
            return Found("no_effect" if same else "unlimited", low, self.at(low), without)
        low, high = self._narrowed(low, high)
        if self.at(high).quantity == ASSEMBLY and (beyond := self._between()) is not None:
            # What was found to be missed is too small, not too large.
            low, high = self._narrowed(*beyond)
        last = self.at(high).since(without)
        return Found("unlimited" if last.quantity == REFUSED else "ok", low, last, without)

    def _smallest(self, without: Use) -> float | None:
        """A size with which limits hold: zero, or where that or the size that is there is too small, a larger one."""
        if without.holds and self.at(self.start).quantity != ASSEMBLY:
            return 0.0
        if without.quantity not in (ASSEMBLY, REFUSED) and not without.holds:
            return None
        tried = [self.start, *(self.start * 2.0**k for n in range(1, 13) for k in (-n, n))]
        found = next((s for s in tried if s <= self.largest and self.at(s).holds), None)
        if found is None and (between := self._between()) is not None:
            found, _ = between
        if without.holds and (found is None or found < self.start):
            return 0.0
        return found

    def _between(self) -> tuple[float, float] | None:
        """A size that holds, above one that is too small to be assembled, and the one above it that misses a limit."""
        missed = (s for s, use in self.known.items() if not use.holds and use.quantity not in (ASSEMBLY, REFUSED))
        high = min(missed, default=0.0)
        low = max((s for s, use in self.known.items() if s < high and use.quantity == ASSEMBLY), default=high)
        for _ in range(MOST_STEPS):
            if high - low <= self.tolerance * high:
                return None
            middle = (low + high) / 2.0
            if self.at(middle).holds:
                return middle, high
            low, high = (middle, high) if self.at(middle).quantity == ASSEMBLY else (low, middle)
        return None

    def _missed(self, low: float) -> float | None:
        """A size with which limits are missed; None where they hold up to the largest."""
        missed = [size for size, use in self.known.items() if size > low and not use.holds]
        size = max(self.start, low)
        for _ in range(MOST_STEPS):
            if missed:
                return min(missed)
            if not self.at(size).holds:
                return size
            if size >= self.largest:
                return None
            size = min(self._farther(size), self.largest)
        return None

    def _farther(self, size: float) -> float:
        """Where the line through the two largest sizes reaches the limit, and a little more."""
        held = sorted((s, use.used) for s, use in self.known.items() if use.holds)
        if len(held) < 2:
            return GROWTH * size
        (a, fa), (b, fb) = held[-2:]
        if not fb - fa > 1e-6 * (1.0 - fb):
            return GROWTH * size
        aim = b + (1.0 - fb) * (b - a) / (fb - fa)
        return float(min(max(aim * (1.0 + self.tolerance / 2.0), b * (1.0 + self.tolerance)), GROWTH * size))

    def _scanned(self, first: float, low: float, high: float | None) -> tuple[float, float | None]:
        """The first of equal steps above a size that holds within which limits are missed."""
        if first < low:
            # What is missed below the size that is there is told.
            for k in range(1, HALVED + 1):
                self.at(first + (low - first) * 0.5**k)
        held = max((s for s, use in self.known.items() if use.holds), default=low)
        top, below = held if high is None else high, low
        for k in range(1, SCANNED + 1):
            size = first + (top - first) * k / SCANNED
            if size <= below or (size < held and self.at(size).quantity == ASSEMBLY):
                continue
            if not self.at(size).holds:
                return below, size
            below = size
        return below, high

    def _narrowed(self, low: float, high: float) -> tuple[float, float]:
        """A bracket that is narrow enough; false position, and halves where that does not help."""
        low = max((s for s, use in self.known.items() if low <= s < high and use.holds), default=low)
        weight, kept, before = 1.0, "", np.inf
        for step in range(MOST_STEPS):
            reach = self.tolerance * high
            if high - low <= reach or high <= NOTHING * self.largest:
                break
            below, above = 1.0 - self.at(low).used, self.at(high).used - 1.0
            if step % ROUNDS == 0:
                is_slow, before = high - low > before / 2.0, high - low
            if is_slow or not np.isfinite(above) or below + above <= 0.0:
                size, is_slow = (low + high) / 2.0, False
            else:
                below, above = (weight * below, above) if kept == "low" else (below, weight * above)
                size = low + (high - low) * below / (below + above)
            # Near an end the other side of it is tried, which closes the bracket.
            size = min(max(size, low + 0.9 * reach), high - 0.9 * reach)
            end = "high" if self.at(size).holds else "low"
            # An end that is kept twice counts half (Illinois).
            weight, kept = (weight / 2.0 if end == kept else 1.0), end
            low, high = (size, high) if end == "high" else (low, size)
        return low, high
