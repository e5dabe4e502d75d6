"""The poses in which a load does the most work, and how far the output goes over them.

Formula: with the work W of the load, o a component of the output, q the poses and u the play,

    W* = max W(q, u)                           subject to  closure(q, u) = 0,  u in the sets,
    extent(eps) = max o - min o                subject to  the same and W >= W* - eps.

Where the maximum is strict the extent goes to zero with the root of eps; where offsets are open it does not:
from eps and eps / 100 the root is taken out, `(10 extent(eps / 100) - extent(eps)) / 9`. The maximum is searched by
IPOPT from offsets at random, corners and the middle; the closure is that of `linkage`.
"""

import math
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from . import brute
from .linkage import Linkage

#: what W may lack, beside the largest work of the load within the play to first order
LEVELS = (1e-6, 1e-8)
OPTIONS = {
    "print_time": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11, "max_iter": 300, "bound_relax_factor": 0.0,
              "constr_viol_tol": 1e-12, "acceptable_tol": 1e-8, "acceptable_iter": 8},
}  # fmt: skip
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


#: work below this part of the load's size times the largest play counts as none
UNFELT = 1e-6


@dataclass(frozen=True)
class Best:
    """Poses, offsets and error of the output where the work is largest."""

    poses: np.ndarray
    offsets: np.ndarray
    error: np.ndarray
    work: float


class MostWork:
    """The load of one mechanism at one configuration.

    Errors are x, y in the file's unit and the angle in radians; work is counted from the nominal pose.
    """

    def __init__(self, link: Linkage, q0: np.ndarray, drives: Any) -> None:
        self.link, self.q0, self.drives = link, q0, drives
        self.zero = dict.fromkeys(link.labels, 0.0)
        self.nominal = link.out(q0, self.zero)
        self.start = float(link.work(list(q0), self.zero))
        self.widths = np.concatenate([np.abs(s.corners() - np.array(s.centre)).max(axis=0) for s in link.sources])
        #: lowest and highest offsets in units of their widths: lost motion may be on one side
        self.ends = np.stack([-np.ones(self.widths.size), np.ones(self.widths.size)])
        for s in link.sources:
            if s.kind == "interval":
                k = list(link.labels).index(s.labels[0])
                self.ends[:, k] = np.array(s.size) / self.widths[k]
        gradient = self.gradient()
        support = [float(s.support(gradient[list(map(link.labels.index, s.labels))])) for s in link.sources]
        # A load on a body that no play moves does no work, and differences give that to rounding.
        pressing = sum(math.hypot(fx, fy) + abs(moment) / link.length for _, fx, fy, moment in link.loads)
        self.play = max(s.play for s in link.sources)
        self.unit = max(sum(support), UNFELT * pressing * self.play)
        self.solver = self._program()

    def gradient(self) -> np.ndarray:
        """d(work)/d(offsets) at the nominal pose, by differences."""
        out = []
        for k, label in enumerate(self.link.labels):
            moved = [self.pose({**self.zero, label: sign * 1e-4 * self.widths[k]}) for sign in (1.0, -1.0)]
            work = [float(self.link.work(list(q), self.zero)) for q in moved]
            out.append((work[0] - work[1]) / (2e-4 * self.widths[k]))
        return np.array(out)

    def pose(self, u: Any) -> np.ndarray:
        """The poses at offsets, followed from the nominal ones."""
        q, u = self.q0, self.link.as_dict(u)
        for part in (0.5, 1.0):
            q, good = self.link.solve(q, self.drives, {label: part * value for label, value in u.items()})
            if not good:
                raise ArithmeticError("cannot be assembled")
        return q

    def work(self, u: Any) -> float:
        u = self.link.as_dict(u)
        return float(self.link.work(list(self.pose(u)), u)) - self.start

    def error(self, u: Any) -> np.ndarray:
        return self.link.out(self.pose(u), self.link.as_dict(u)) - self.nominal

    def _program(self) -> Any:
        link, n, play = self.link, self.q0.size, self.play
        q, d, weight = casadi.SX.sym("q", n), casadi.SX.sym("d", self.widths.size), casadi.SX.sym("w", 4)
        self.step = np.where(np.arange(n) % 3 == 2, play / link.length, play)
        poses = [self.q0[i] + q[i] * self.step[i] for i in range(n)]
        u = {label: d[k] * self.widths[k] for k, label in enumerate(link.labels)}
        work = (link.work(poses, u, casadi) - self.start) / self.unit
        out = [(o - o0) for o, o0 in zip(link.output_pose(poses, u, casadi), self.nominal, strict=True)]
        self.sizes = np.array([play, play, play / link.length])
        goal = weight[0] * work + sum(weight[1 + k] * out[k] / self.sizes[k] for k in range(3))
        g, low, high = [casadi.vertcat(*link.residual(poses, self.drives, u, casadi)) / play], [0.0] * n, [0.0] * n
        k = 0
        for s in link.sources:
            if s.kind == "disc":
                g, low, high = [*g, casadi.sumsqr(d[k : k + 2])], [*low, -np.inf], [*high, 1.0]
            elif s.kind == "diamond":
                g, low, high = [*g, d[k] + d[k + 1], d[k] - d[k + 1]], [*low, -1.0, -1.0], [*high, 1.0, 1.0]
            k += len(s.labels)
        self.low, self.high = np.array(low), np.array(high)
        problem = {"x": casadi.vertcat(q, d), "p": weight, "f": -goal, "g": casadi.vertcat(*g, work)}
        return casadi.nlpsol("most_work", "ipopt", problem, OPTIONS)

    def _solve(self, weight: list[float], start: np.ndarray, least: float) -> np.ndarray | None:
        n = self.q0.size
        free = np.full(n, np.inf)
        bounds = [np.concatenate([sign * free, ends]) for sign, ends in zip((-1.0, 1.0), self.ends, strict=True)]
        low, high = np.append(self.low, least), np.append(self.high, np.inf)
        found = self.solver(x0=start, p=weight, lbx=bounds[0], ubx=bounds[1], lbg=low, ubg=high)
        good = self.solver.stats()["return_status"] in SOLVED
        return np.array(found["x"]).ravel() if good else None

    def _from(self, u: np.ndarray) -> np.ndarray:
        return np.concatenate([(self.pose(u) - self.q0) / self.step, u / self.widths])

    def maxima(self, starts: int, seed: int = 0) -> list[Best]:
        """Local maxima of the work, the highest one first, each on the branch of the nominal pose."""
        rng = np.random.default_rng(seed)
        corners, inner = brute.vertices(self.link, rng, starts), brute.draw(self.link, rng, starts)
        drawn = np.concatenate([np.zeros((1, self.widths.size)), corners, inner])
        found = []
        for u in drawn:
            try:
                x = self._solve([1.0, 0, 0, 0], self._from(0.95 * u), -np.inf)
            except ArithmeticError:
                continue
            best = None if x is None else self.at(x)
            if best is not None:
                found.append(best)
        return sorted(found, key=lambda best: -best.work)

    def at(self, x: np.ndarray) -> Best | None:
        """What a solution of the program is, if it lies on the branch of the nominal pose."""
        u = x[self.q0.size :] * self.widths
        try:
            q = self.pose(u)
        except ArithmeticError:
            return None
        if np.abs((q - self.q0) / self.step - x[: self.q0.size]).max() > 1e-3:
            return None
        error = self.link.out(q, self.link.as_dict(u)) - self.nominal
        return Best(q, u, error, float(self.link.work(list(q), self.link.as_dict(u))) - self.start)

    def half_widths(self, best: Best) -> np.ndarray:
        """Half of the extent of every component."""
        ends = [self.extent(best, direction) for direction in np.eye(3)]
        return np.array([0.5 * (high - low) for low, high in ends])

    def extent(self, best: Best, direction: np.ndarray) -> tuple[float, float]:
        """Lowest and highest value of `direction . error` over the poses of largest work; nan if not found."""
        ends = []
        size = float(np.abs(direction) @ self.sizes)
        middle = np.concatenate([(best.poses - self.q0) / self.step, best.offsets / self.widths])
        for sign in (-1.0, 1.0):
            weight = [0.0, *(sign * direction * self.sizes / size)]
            starts, values = [middle], [np.nan, np.nan]
            # Where one level does not succeed from the middle it is tried again from the end of the other one.
            for k in (0, 1, 0, 1):
                if np.isfinite(values[k]):
                    continue
                x = self._solve(weight, starts[-1], best.work / self.unit - LEVELS[k])
                end = None if x is None else self.at(x)
                if end is not None:
                    values[k] = float(direction @ end.error)
                    starts.append(x)
            ends.append((10 * values[1] - values[0]) / 9)
        return ends[0], ends[1]
