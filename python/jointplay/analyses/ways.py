"""Ways in which a specimen can be outside the limits, each searched by itself.

A component e_c has a way to each limited side, f = e_c - high or low - e_c, and is outside where f > 0. The size of a
vector e has a way along each axis to each side,

    f = |e| - L - (max_k |e_k| - s e_c),    s = 1 or -1

and is outside in that of its largest component where |e| is beyond its limit L. No pose is a way of its own, f = s e_c,
infinite where there is none. What is reached along one way says nothing of another: specimens that are moved towards
the nearest limit never see a farther one that alone can be missed.
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.model.mechanism import Mechanism

from .yields import rows_of, size_of

#: part of a limit, beyond the worst case, from which on the worst case excludes that it is missed
MARGIN = 0.01
#: specimens by which is seen which components depend on sources without bounds, and what is rounding of their scatter
LOOKED, UNMOVED = 1_000, 1e-9
#: quantity of a way to have no pose
NO_POSE = -1


@dataclass(frozen=True)
class Way:
    """A way to be outside."""

    #: among components and sizes; `NO_POSE`
    quantity: int
    #: components of the quantity
    rows: tuple[int, ...]
    #: `component`, `sign`: along which component, to which side
    component: int
    sign: int
    limit: float

    @property
    def target(self) -> float:
        """What `beyond` exceeds outside."""
        return sys.float_info.max if self.quantity == NO_POSE else 0.0

    def beyond(self, errors: Floats) -> Floats:
        """How far specimens have come along this way; those without a pose are outside by that alone."""
        own = self.sign * errors[:, self.component]
        if self.quantity == NO_POSE:
            found = own
        elif self.quantity == self.component:
            found = own - self.sign * self.limit
        else:
            vector = errors[:, list(self.rows)]
            found = size_of(vector) - self.limit - (np.abs(vector).max(axis=1) - own)
        nothing = np.isnan(errors).any(axis=1)
        return np.where(nothing, np.inf if self.quantity == NO_POSE else -np.inf, found)

    def is_out(self, errors: Floats) -> NDArray[np.bool_]:
        """Which specimens are outside in this way."""
        out: NDArray[np.bool_] = self.beyond(errors) > self.target
        return out


def ways_out(m: Mechanism, limits: Floats) -> list[Way]:
    """All ways beyond the limits.

    Parameters
    ----------
    limits : ndarray
        Lowest and highest acceptable value of every quantity, infinite where there is none, shape (quantity, 2).
    """
    count = len(m.components)
    found = []
    for k, bounds in enumerate(limits.tolist()):
        rows = (k,) if k < count else tuple(rows_of(m)[k - count])
        if k < count:
            found += [
                Way(k, rows, k, sign, bound) for sign, bound in zip((-1, 1), bounds, strict=True) if np.isfinite(bound)
            ]
        elif np.isfinite(bounds[1]):
            found += [Way(k, rows, c, sign, bounds[1]) for c in rows for sign in (-1, 1)]
    return found


def ways_apart(m: Mechanism) -> list[Way]:
    """Ways on which specimens without a pose may be found; none where no loop is closed."""
    if len(m.joints) <= len(m.bodies):
        return []
    return [Way(NO_POSE, (), c, sign, np.inf) for c in range(len(m.components)) for sign in (-1, 1)]


class Reach:
    """How far bounded laws let a mechanism come at one configuration."""

    def __init__(self, m: Mechanism, drives: Floats, poses: Floats, law: str | None) -> None:
        count = len(m.components)
        self.endless = [
            s
            for s, source in enumerate(m.compiled_sources)
            if not _is_bounded(law if law is not None and source.kind in LOOSE else source.spec["law"])
        ]
        #: whether a component is the same wherever sources without bounds are
        self.bounded = np.ones(count, dtype=bool)
        if any(m.source_kinds[s] == "size" for s in self.endless):
            # Offsets follow the sizes of their clearances.
            self.bounded[:] = False
        elif self.endless:
            self.bounded = self._unmoved(m, drives, poses, law)
        worst = m.core.worst(drives, poses)
        self.known = bool(worst["status"][0] == 0)
        exact = np.vstack([worst["component"][0], _from_zero(worst["position"]), _from_zero(worst["rotation"])])
        sizes = _from_zero(worst["position_bound"]), _from_zero(worst["rotation_bound"])
        linear = np.vstack([worst["component_first_order"][0], *sizes])
        #: lowest and highest value of every quantity
        self.ends = np.column_stack([np.minimum(exact[:, 0], linear[:, 0]), np.maximum(exact[:, 1], linear[:, 1])])

    def _unmoved(self, m: Mechanism, drives: Floats, poses: Floats, law: str | None) -> NDArray[np.bool_]:
        u = m.core.specimens(LOOKED, 0, law, "plain")
        moved = u.copy()
        columns = [p for p, (source, _) in enumerate(m.core.parameters) if source in self.endless]
        moved[:, columns] = np.roll(u[:, columns], 1, axis=0)
        errors, others = (m.core.errors_of(drives, poses, rows) for rows in (u, moved))
        scale = np.nanmax(np.abs(errors), axis=0, initial=0.0)
        same: NDArray[np.bool_] = (np.abs(errors - others) <= UNMOVED * scale).all(axis=0)
        return same

    def is_bounded(self, way: Way) -> bool:
        """Whether only bounded sources lead along a way."""
        if way.quantity == NO_POSE:
            return not self.endless
        return bool(self.bounded[list(way.rows)].all())

    def excludes(self, way: Way) -> bool:
        """Whether the worst case keeps to the limit with a margin."""
        if not (self.known and self.is_bounded(way)):
            return False
        if way.quantity == NO_POSE:
            # There are poses at the ends of all components.
            return True
        largest = self._largest(way) + MARGIN * float(np.abs(self.ends[way.component]).max())
        if way.quantity == way.component:
            return largest <= way.sign * way.limit
        # The largest component of a vector is at least its size by the root of their number.
        size = (1.0 + MARGIN) * self.ends[way.quantity, 1]
        return bool(size <= way.limit or largest <= way.limit / np.sqrt(len(way.rows)))

    def ends_before(self, way: Way) -> bool:
        """Whether the worst case keeps to the limit at all."""
        if not (self.known and self.is_bounded(way)) or way.quantity == NO_POSE:
            return False
        if way.quantity == way.component:
            return self._largest(way) <= way.sign * way.limit
        return bool(self.ends[way.quantity, 1] <= way.limit)

    def _largest(self, way: Way) -> float:
        """The farthest that its component comes to its side."""
        return float(way.sign * self.ends[way.component, 1 if way.sign > 0 else 0])


def _from_zero(size: Floats) -> Floats:
    return np.array([[0.0, size[0]]])


def _is_bounded(law: object) -> bool:
    if isinstance(law, dict):
        process = law.get("process")
        return process is None or bool(process["sorted"])
    return law != "gauss"
