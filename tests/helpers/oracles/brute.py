"""Worst case by dense search: no support functions, no gradients of the closure, only poses.

Formula: max over the admissible sets of g(pose(u) - pose(0)), the pose from the non-linear closure; g is
the distance, the absolute turn or one signed component. For the four-bar the pose is a circle intersection
and the search is a grid over the directions of the play, refined around its best node. For any other
linkage it is (1) random points of the sets, in them, on their boundaries and at their corners, (2) from the
best of these and from random ones IPOPT on the non-linear closure. The value that counts is always that of
an admissible point. Points that do not close and starts that end at no maximum are counted.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from .fourbar import FourBar
from .linkage import Linkage
from .optimiser import NoOptimumError, Optimiser


def four_bar_extreme(
    four_bar: FourBar, theta1: float, radii: Any, measure: Callable[[Any, Any], Any], n: int = 181
) -> tuple[float, np.ndarray]:
    """Largest measure(pin displacement, turn) over the play of the joints; and the offsets d1 .. d4.

    The plays of J1, J2, J3 enter only through their sum, which fills a disc of radius r1 + r2 + r3: two discs
    are searched, each over its direction and its radius.
    """
    r = np.array([sum(radii[:3]), radii[3]], dtype=float)
    P0, th0 = four_bar.rocker_pin(theta1), four_bar.rocker_angle(theta1)

    def value(angle_a: Any, angle_b: Any, fa: Any = 1.0, fb: Any = 1.0) -> Any:
        d = (r[0] * fa * np.exp(1j * angle_a), 0j, 0j, r[1] * fb * np.exp(1j * angle_b))
        turn = np.angle(np.exp(1j * (four_bar.rocker_angle(theta1, d) - th0)))
        return measure(four_bar.rocker_pin(theta1, d) - P0, turn)

    best, where = -math.inf, (0.0, 0.0, 1.0, 1.0)
    grid = np.linspace(0, math.tau, n)
    for fa in (0.5, 1.0):  # inside as well: nothing is assumed about the maximum lying on the boundary
        for fb in (0.5, 1.0):
            values = value(grid[:, None], grid[None, :], fa, fb)
            i, j = np.unravel_index(np.nanargmax(values), values.shape)
            if values[i, j] > best:
                best, where = float(values[i, j]), (grid[i], grid[j], fa, fb)
    width = math.tau / n
    a, b, fa, fb = where
    for _ in range(12):
        local = np.linspace(-width, width, 41)
        values = value(a + local[:, None], b + local[None, :], fa, fb)
        i, j = np.unravel_index(np.nanargmax(values), values.shape)
        a, b, best, width = a + local[i], b + local[j], float(values[i, j]), width / 8
    share = np.asarray(radii[:3]) / (sum(radii[:3]) or 1.0)
    d123 = r[0] * fa * np.exp(1j * a) * share
    return best, np.array([*d123, r[1] * fb * np.exp(1j * b)])


def errors(link: Linkage, q0: np.ndarray, drives: Any, u: np.ndarray) -> np.ndarray:
    """Output error of every row of u; rows that do not close are not numbers."""
    q, good = link.solve(np.broadcast_to(q0, (*u.shape[:-1], q0.size)), drives, u)
    zero = dict.fromkeys(link.labels, 0.0)
    error = link.out(q, u) - link.out(q0, zero)
    return np.where(good[..., None], error, np.nan)


def draw(link: Linkage, rng: np.random.Generator, n: int, boundary: bool = True) -> np.ndarray:
    """Random points of the product of all sets, shape (n, parameters)."""
    return np.concatenate([s.sample(rng, n, boundary) for s in link.sources], axis=-1)


def vertices(link: Linkage, rng: np.random.Generator, n: int) -> np.ndarray:
    """Random combinations of corners of the sets."""
    picks = []
    for s in link.sources:
        corners = s.corners()
        picks.append(corners[rng.integers(0, len(corners), n)])
    return np.concatenate(picks, axis=-1)


MEASURES: dict[str, Callable[[np.ndarray], Any]] = {
    "position": lambda e: np.hypot(e[..., 0], e[..., 1]),
    "rotation": lambda e: np.abs(e[..., 2]),
    "x low": lambda e: -e[..., 0],
    "x high": lambda e: e[..., 0],
    "y low": lambda e: -e[..., 1],
    "y high": lambda e: e[..., 1],
    "angle low": lambda e: -e[..., 2],
    "angle high": lambda e: e[..., 2],
}


@dataclass(frozen=True)
class Found:
    """Largest value of one extreme, and how much of the search came to nothing."""

    value: float
    where: np.ndarray
    points: int
    open: int
    """Of the points, those that do not close."""
    starts: int
    lost: tuple[str, ...]
    """Why a start ended at no maximum, one for each that did."""


def worst(
    link: Linkage,
    q0: np.ndarray,
    drives: Any,
    extreme: str,
    rng: np.random.Generator,
    n: int = 300,
    starts: int = 6,
) -> Found:
    """Largest value of one extreme: random points, corners, and IPOPT from the best and from random ones."""
    measure = MEASURES[extreme]
    u = np.concatenate([draw(link, rng, n), draw(link, rng, n // 4, boundary=False), vertices(link, rng, n)])
    found = errors(link, q0, drives, u)
    values = measure(found)
    unclosed = int(np.isnan(values).sum())
    values = np.nan_to_num(values, nan=-np.inf)
    best, where = float(values.max()), u[int(values.argmax())]
    picks = [*np.argsort(-values)[: starts // 2], *rng.integers(0, len(u), starts - starts // 2)]
    nominal = link.out(q0, dict.fromkeys(link.labels, 0.0))

    # Rotation is the larger of two smooth problems; distance is smooth once squared.
    parts = {"rotation": ["angle low", "angle high"]}.get(extreme, [extreme])
    lost = []
    for part in parts:

        def objective(q: list[Any], v: dict[str, Any], part: str = part) -> Any:
            x, y, angle = link.output_pose(q, v, casadi)
            error = (x - nominal[0], y - nominal[1], angle - nominal[2])
            if part == "position":
                return error[0] ** 2 + error[1] ** 2
            component, side = part.split()
            return error[("x", "y", "angle").index(component)] * (1 if side == "high" else -1)

        size = max(best, 1e-9) ** (2 if part == "position" else 1)
        search = Optimiser(link, q0, drives, link.sources, objective, size)
        for k in picks:
            try:
                optimum = search.maximise(link.solve(q0, drives, u[k])[0], u[k])
            except NoOptimumError as reason:
                lost.append(f"{part}: {reason}")
                continue
            reached = np.array([optimum.offsets[label] for label in link.labels])
            value = float(measure(errors(link, q0, drives, reached[None])[0]))
            if value > best:
                best, where = value, reached
    return Found(best, where, len(u), unclosed, len(parts) * len(picks), tuple(lost))


def first_order(link: Linkage, q0: np.ndarray, drives: Any) -> dict[str, float]:
    """The eight extremes of the linearised error set (theory B.4); position by a sweep of directions."""
    source, _ = link.sensitivity(q0, drives)
    shift = source @ np.array([c for s in link.sources for c in s.centre])

    def h(w: np.ndarray) -> Any:
        total, k = 0.0, 0
        for s in link.sources:
            total = total + s.support(source[:, k : k + len(s.labels)].T @ w)
            k += len(s.labels)
        return total + shift @ w

    figures = {}
    for i, component in enumerate(("x", "y", "angle")):
        axis = np.eye(3)[i]
        figures[f"{component} high"], figures[f"{component} low"] = float(h(axis)), float(h(-axis))
    figures["rotation"] = max(figures["angle high"], figures["angle low"])
    angles, width = np.linspace(0, math.tau, 7201), math.tau / 7200
    for _ in range(4):
        values = h(np.stack([np.cos(angles), np.sin(angles), 0 * angles]))
        best = angles[int(np.argmax(values))]
        angles, width = np.linspace(best - width, best + width, 2001), width / 1000
    figures["position"] = float(values.max())
    return figures
