"""Largest value of an objective over all poses and offsets that close, by IPOPT through casadi.

Formula:   max over q and u of  g(q, u)   subject to   closure(q, u) = 0,   u_j in C_j   for the chosen
sources,

with |u_j|^2 <= 1 for a disc, the four faces of a diamond, bounds for an interval, all in units of the set's
own size. The closure is the text of linkage.py, which casadi differentiates twice. Sources that are not
chosen stay at their centres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from .linkage import Linkage
from .sets import Source

OPTIONS = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-12,
        "max_iter": 400,
        "bound_relax_factor": 0.0,
        "constr_viol_tol": 1e-13,
        "dual_inf_tol": 1e-9,
        "acceptable_iter": 0,
        "mu_target": 0.0,
    },
}


@dataclass(frozen=True)
class Optimum:
    poses: np.ndarray
    offsets: dict[str, float]
    value: float
    multipliers: np.ndarray
    """Of the closure rows, in units of the objective per row: the wrenches, if the objective is a work."""


class Optimiser:
    """One objective of one linkage; started as often as one likes.

    Parameters
    ----------
    objective : callable
        `objective(q, u)` of a list of scalars and a dict by label, casadi or float.
    size : float
        About how large the objective gets.
    """

    def __init__(
        self,
        link: Linkage,
        q0: np.ndarray,
        drives: Any,
        sources: list[Source],
        objective: Callable[[list[Any], dict[str, Any]], Any],
        size: float,
    ) -> None:
        self.link, self.q0, self.drives, self.sources, self.size = link, q0, drives, sources, size
        self.labels = [label for s in sources for label in s.labels]
        self.centre = np.array([c for s in sources for c in s.centre])
        widths = [_half_widths(s) for s in sources]
        self.widths = np.concatenate(widths) if widths else np.zeros(0)
        q, d = casadi.SX.sym("q", q0.size), casadi.SX.sym("d", len(self.labels))
        # Lengths in units of the play, so that IPOPT sees numbers around one.
        lengths = [float(max(w[0], 1e-9 * link.length)) for s, w in zip(sources, widths, strict=True) if _long(s)]
        self.step = max(lengths, default=1e-3 * link.length)
        self.unit = np.where(np.arange(q0.size) % 3 == 2, self.step / link.length, self.step)
        poses = [q0[i] + q[i] * self.unit[i] for i in range(q0.size)]
        u: dict[str, Any] = dict(link.centre)
        u |= {label: self.centre[k] + d[k] * self.widths[k] for k, label in enumerate(self.labels)}
        closure = casadi.vertcat(*link.residual(poses, drives, u, casadi))
        self.rows = closure.numel()
        g, self.low, self.high = [closure / self.step], [0.0] * self.rows, [0.0] * self.rows
        self.bounds_low, self.bounds_high = [-np.inf] * q0.size, [np.inf] * q0.size
        k = 0
        for s in sources:
            n = len(s.labels)
            if s.kind == "disc":
                g, self.low, self.high = (
                    [*g, casadi.sumsqr(d[k : k + 2])],
                    [*self.low, -np.inf],
                    [*self.high, 1.0],
                )
            elif s.kind == "diamond":
                g += [d[k] + d[k + 1], d[k] - d[k + 1]]
                self.low, self.high = [*self.low, -1.0, -1.0], [*self.high, 1.0, 1.0]
            self.bounds_low += [s.size[0] / self.widths[k] if s.kind == "interval" else -1.0] * n
            self.bounds_high += [s.size[1] / self.widths[k] if s.kind == "interval" else 1.0] * n
            k += n
        problem = {"x": casadi.vertcat(q, d), "f": -objective(poses, u) / size, "g": casadi.vertcat(*g)}
        self.solver = casadi.nlpsol("optimiser", "ipopt", problem, OPTIONS)

    def maximise(self, q: np.ndarray | None = None, u: np.ndarray | None = None) -> Optimum:
        """The (local) maximum reached from poses q and offsets u; by default from the nominal pose."""
        start = np.zeros(self.q0.size + len(self.labels))
        if q is not None:
            start[: self.q0.size] = (q - self.q0) / self.unit
        if u is not None:
            start[self.q0.size :] = (u - self.centre) / self.widths
        solution = self.solver(x0=start, lbx=self.bounds_low, ubx=self.bounds_high, lbg=self.low, ubg=self.high)
        status = self.solver.stats()["return_status"]
        if status not in ("Solve_Succeeded", "Solved_To_Acceptable_Level"):
            raise ArithmeticError(f"IPOPT stopped: {status}")
        x = np.array(solution["x"]).ravel()
        found = self.centre + x[self.q0.size :] * self.widths
        offsets = {**self.link.centre, **dict(zip(self.labels, map(float, found), strict=True))}
        # The offsets are at the optimum to the optimiser's tolerance; the poses follow from them to rounding.
        poses, good = self.link.solve(self.q0 + x[: self.q0.size] * self.unit, self.drives, offsets)
        if not good:
            raise ArithmeticError("the optimum does not close")
        multipliers = np.array(solution["lam_g"]).ravel()[: self.rows] * self.size / self.step
        return Optimum(poses, offsets, -float(solution["f"]) * self.size, multipliers)


def _long(s: Source) -> bool:
    return not s.labels[0].endswith((".angle", ".value"))


def _half_widths(s: Source) -> np.ndarray:
    if s.kind == "diamond":
        return np.array([s.size[0], s.size[0] / s.size[1]])
    if s.kind == "disc":
        return np.full(2, s.size[0])
    return np.array([max(abs(s.size[0]), abs(s.size[1]))])
