"""The most work that a force does within the play, by ascents from many starts.

Formula: with the error e(u) of the point on which the force f acts, and the moment m of a planar load,

    W(u) = f . e_position(u) + m e_angle(u),    u <- argmax over the sets of  grad W(u) . u

from starts all over the sets, with the known deviations of everything else. Gradients are differences of W, support
points those of support functions (`supports`). Only poses at given offsets are asked of the core.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import supports

Array = NDArray[np.float64]

#: of a difference, as a part of a set
STEP = 1e-3
#: an ascent ends where no offset moves by more than this part of its set
STILL = 1e-5
#: a force that does less over its set, as a part of what all do, pushes nothing: differences leave more than rounding
UNFELT = 1e-7
#: rounds of an ascent
ROUNDS = 12


@dataclass(frozen=True)
class Press:
    """The play of one mechanism at one configuration, and the force on its output; `spec` is what the core reads."""

    core: Any
    spec: dict[str, Any]
    drives: Array
    poses: Array
    load: Array

    @property
    def clearances(self) -> Array:
        """Which parameters are offsets within a clearance."""
        kinds = [[s["kind"] in ("clearance", "backlash")] * len(s["centre"]) for s in self.spec["sources"]]
        return np.array([flag for flags in kinds for flag in flags])

    @property
    def centre(self) -> Array:
        """The known deviations."""
        return np.concatenate([np.asarray(source["centre"], dtype=float) for source in self.spec["sources"]])

    def work(self, offsets: Array) -> Array:
        """Of rows of offsets; nan where there is no pose."""
        count = len(offsets)
        given = self.core.given(np.repeat(self.drives, count, 0), np.repeat(self.poses, count, 0), offsets)
        error = np.asarray(given["error"])
        return np.where(np.asarray(given["status"]) == 0, error @ self.load, np.nan)

    def support_points(self, w: Array) -> Array:
        """Where every row of w has its support point: the gradient of the support function."""
        n, own = w.shape[1], self.widths()
        step = np.maximum(1e-6 * (np.abs(w) * own).max(axis=1, keepdims=True), 1e-300) / own
        ends = [(w[:, None] + sign * step[:, None] * np.eye(n)).reshape(-1, n) for sign in (1.0, -1.0)]
        high, low = (supports.support(self.spec, end).reshape(-1, n) for end in ends)
        return np.asarray((high - low) / (2 * step))

    def widths(self) -> Array:
        """The largest value of every parameter."""
        return np.asarray(np.maximum(supports.support(self.spec, np.eye(len(self.clearances))), 1e-12))

    def by_source(self, values: Array) -> Array:
        """Sums over the parameters of every source."""
        sizes = [len(source["centre"]) for source in self.spec["sources"]]
        return np.asarray(np.add.reduceat(values, np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)))

    def own_supports(self, w: Array) -> Array:
        """What every source by itself allows a force to do."""
        found, at = [], 0
        for source in self.spec["sources"]:
            size = len(source["centre"])
            found.append(float(supports.support({"sources": [source]}, w[None, at : at + size])[0]))
            at += size
        return np.array(found)

    def gradient(self, offsets: Array) -> Array:
        own, n = self.widths(), offsets.shape[1]
        steps = STEP * own * np.eye(n)
        ends = [self.work((offsets[:, None] + sign * steps).reshape(-1, n)).reshape(-1, n) for sign in (1.0, -1.0)]
        return np.asarray(np.where(self.clearances, (ends[0] - ends[1]) / (2 * STEP * own), 0.0))

    def silent(self, offsets: Array) -> Array:
        """Which clearances nothing pushes at offsets where the load holds the mechanism: those stay in the middle."""
        felt = np.abs(self.gradient(offsets[None])[0]) * self.widths()
        return np.asarray(felt < UNFELT * felt.sum())

    def most(self, starts: int, seed: int = 0, silent: Array | bool = False) -> tuple[float, float]:
        """The most work where an ascent ends, and what the load does within the play to first order.

        `silent` stays in the middle. Ascents that lead to where the mechanism cannot be assembled have no end.
        """
        rng = np.random.default_rng(seed)
        gives_way = self.clearances & ~np.asarray(silent)
        slope, own = self.gradient(self.centre[None]), self.widths()

        def pressed(w: Array) -> Array:
            return np.where(gives_way, self.support_points(np.where(gives_way, w, 0.0)), self.centre)

        rests: list[Array] = []
        u = pressed(np.concatenate([slope, rng.normal(size=(starts, len(own))) / own]))
        for _ in range(ROUNDS):
            w = self.gradient(u)
            alive = np.isfinite(w).all(axis=1)
            before, u = u[alive], pressed(w[alive])
            moved = (np.abs(u - before) > STILL * own).any(axis=1)
            rests.append(u[~moved])
            u = u[moved]
            if not len(u):
                break
        best = float(np.nanmax(self.work(np.concatenate([*rests, u])), initial=-np.inf))
        return best, float((supports.support(self.spec, slope) - slope @ self.centre)[0])
