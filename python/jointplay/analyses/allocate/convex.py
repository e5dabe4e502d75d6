"""Least cost of sizes by formula under linear limits: an interior-point method with a logarithmic barrier.

    minimise   sum of f_k(z_k)   subject to   G z <= h,  low <= z <= high

f convex and falling, G >= 0. With the rows A z <= b of all three, Newton's method follows the minimum of

    sum of f_k(z_k) - mu sum of log (b - A z)_i,    mu -> 0,    multipliers y_i = mu / (b - A z)_i

The bound comes from the multipliers of G alone and holds wherever the iteration stands: the least value of
``sum of f_k(z_k) + y . (G z - h)`` over the box, each z_k by itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from jointplay.basics.arrays import Floats

#: values of mu, and the one at which the iteration ends, per row as a share of the cost
MOST_ROUNDS, SETTLED, CENTRING = 60, 1e-9, 0.1
#: steps of Newton's method for each mu, its decrement that is small enough, and the shortest part of a step
MOST_STEPS, NEWTON, SHORTEST = 100, 1e-10, 1e-10
#: halvings of an interval of sizes
MOST_HALVINGS = 200


class Falling(Protocol):
    """A convex, falling cost of a variable between its ends, with its derivatives."""

    @property
    def low(self) -> float:
        """Lower end of the variable."""

    @property
    def high(self) -> float:
        """Upper end."""

    def cost(self, z: float) -> float:
        """The cost."""

    def slope(self, z: float) -> float:
        """Its derivative."""

    def bend(self, z: float) -> float:
        """Its second derivative."""


@dataclass(frozen=True)
class Least:
    """The optimum: variables, cost, and what nothing can cost less than."""

    values: Floats
    cost: float
    bound: float


def least(costs: Sequence[Falling], rows: Floats, right: Floats) -> Least | None:
    """The optimum; None where even the lower ends do not keep to a row.

    Parameters
    ----------
    rows : ndarray
        G, shape (row, variable), not negative.
    right : ndarray
        h.
    """
    low, high = np.array([f.low for f in costs]), np.array([f.high for f in costs])
    span = high - low
    room = right - rows @ low
    if (room < 0.0).any():
        return None
    # Counted in the box: 0 at the lower ends, 1 at the upper ones; every row in its room, and those that no size in
    # the box exceeds left out.
    reach = rows * span
    counts = reach.sum(axis=1) > room
    full = counts & (room <= 0.0)
    held = (reach[full] > 0.0).any(axis=0)
    free = [k for k in range(len(costs)) if not held[k]]
    g = reach[np.ix_(counts & ~full, free)] / room[counts & ~full][:, None]
    x = np.zeros(len(costs))
    y = np.zeros(len(g))
    if free:
        x[free], y = _interior([costs[k] for k in free], g)
    z = low + x * span
    cost = float(sum(f.cost(v) for f, v in zip(costs, z.tolist(), strict=True)))
    fixed = float(sum(f.cost(f.low) for f, at_end in zip(costs, held.tolist(), strict=True) if at_end))
    return Least(z, cost, min(cost, fixed + _dual([costs[k] for k in free], g, y)))


def _interior(costs: Sequence[Falling], g: Floats) -> tuple[Floats, Floats]:
    """Optimum in the unit box under g x <= 1, and the multipliers of the rows."""
    n, m = len(costs), len(g)
    a = np.vstack([g, np.eye(n), -np.eye(n)])
    b = np.concatenate([np.ones(m), np.ones(n), np.zeros(n)])
    span = np.array([f.high - f.low for f in costs])

    def each(what: Callable[[Falling, float], float], x: Floats) -> Floats:
        return np.array([what(f, f.low + v * (f.high - f.low)) for f, v in zip(costs, x.tolist(), strict=True)])

    def gradient(x: Floats, mu: float) -> Floats | None:
        s = b - a @ x
        return each(_slope, x) * span / mu + a.T @ (1.0 / s) if (s > 0.0).all() else None

    x = np.full(n, 0.5 / max(1.0, float(g.sum(axis=1).max(initial=0.0))))
    mu = max(float(each(_above, x).sum()) / len(b), 1e-300)
    for _ in range(MOST_ROUNDS):
        for _ in range(MOST_STEPS):
            s, slope = b - a @ x, gradient(x, mu)
            assert slope is not None
            matrix = np.diag(each(_bend, x) * span**2 / mu) + (a.T / s**2) @ a
            # Curvatures differ by many powers of ten; scaled, the diagonal is one.
            unit = 1.0 / np.sqrt(np.diagonal(matrix))
            step = -unit * np.linalg.solve(matrix * np.outer(unit, unit), unit * slope)
            decrement = -float(slope @ step)
            if decrement <= NEWTON:
                break
            length = 1.0 if decrement < 0.1 else 1.0 / (1.0 + decrement**0.5)
            # Along a line the barrier is convex: where it does not rise steeply, the step was not too long. The
            # barrier itself would be rounded where mu is small.
            while length > SHORTEST and _rises(gradient(x + length * step, mu), step) > 0.5 * decrement:
                length /= 2.0
            x = x + length * step
        if len(b) * mu <= SETTLED * (1.0 + abs(float(each(_cost, x).sum()))):
            break
        mu *= CENTRING
    return x, mu / (b - a @ x)[:m]


def _rises(gradient: Floats | None, step: Floats) -> float:
    """How steeply it rises along a step; infinite where the step leaves the rows."""
    return np.inf if gradient is None else float(gradient @ step)


def _cost(f: Falling, z: float) -> float:
    return f.cost(z)


def _above(f: Falling, z: float) -> float:
    """The cost from the lowest one, in which no digits are lost."""
    return f.cost(z) - f.cost(f.high)


def _slope(f: Falling, z: float) -> float:
    return f.slope(z)


def _bend(f: Falling, z: float) -> float:
    return f.bend(z)


def _dual(costs: Sequence[Falling], g: Floats, y: Floats) -> float:
    """The least value of the Lagrangian over the box."""
    prices = g.T @ y
    total = -float(y.sum())
    for f, price in zip(costs, prices.tolist(), strict=True):
        span = f.high - f.low
        low, high = 0.0, 1.0
        if f.slope(f.high) * span + price <= 0.0:
            low = 1.0
        elif f.slope(f.low) * span + price >= 0.0:
            high = 0.0
        for _ in range(MOST_HALVINGS):
            middle = (low + high) / 2.0
            if not low < middle < high:
                break
            if f.slope(f.low + middle * span) * span + price < 0.0:
                low = middle
            else:
                high = middle
        total += f.cost(f.low + low * span) + price * low
    return total
