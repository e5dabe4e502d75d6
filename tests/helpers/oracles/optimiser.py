"""Largest value of an objective over all poses and offsets that close, by IPOPT through casadi.

Formula:   max over q and u of  g(q, u)   subject to   closure(q, u) = 0,   u_j in C_j   for the chosen
sources,

with |u_j|^2 <= 1 for a disc, the four faces of a diamond, bounds for an interval, all in units of the set's
own size. The closure is the text of linkage.py, which casadi differentiates twice. Sources that are not
chosen stay at their centres.

What IPOPT says of its end is not asked, because that depends on the last bits of the processor. Its point is pulled
into the sets and closed, and counts if the conditions of a maximum hold there: with A_q^T lambda = g_q and
w = g_u - A_u^T lambda, A the Jacobian of the closure and h the support function of a set,

    gap = sum_j ( h_j(w_j) - w_j.(u_j - centre_j) )  =  0,

which says that no source can move to where the objective is larger to first order.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from .linkage import Linkage
from .sets import Source

#: what the gap may be, in units of the objective's size: a pin is then within 1e-5 of its clearance of its place
GAP = 1e-10


def options(noise: float) -> dict[str, Any]:
    """IPOPT's, for a closure that rounding leaves uncertain by `noise` in the units that IPOPT sees."""
    return {
        "print_time": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            # The violation of the constraints counts against both.
            "tol": max(1e-12, noise),
            "constr_viol_tol": max(1e-12, noise),
            "max_iter": 400,
            "bound_relax_factor": 0.0,
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
    slope: np.ndarray
    """Derivative of the value by the offsets of the sources, with the poses following."""
    gap: float
    """By how much a change of the offsets within their sets raises the value, to first order."""


class NoOptimumError(ArithmeticError):
    """The optimiser stopped at a point that is no local maximum."""


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
        g, self.low, self.high = [closure / self.step], [0.0] * closure.numel(), [0.0] * closure.numel()
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
        noise = 64 * np.finfo(float).eps * max(link.length, float(np.abs(q0).max())) / self.step
        # What rounding leaves of the closure counts where clearances are that small against the mechanism.
        self.limit = max(GAP, noise) * size
        self.solver = casadi.nlpsol("optimiser", "ipopt", problem, options(noise))
        slopes = [casadi.jacobian(row, x) for row in (problem["f"], closure) for x in (q, d)]
        self.slopes = casadi.Function("slopes", [q, d], [-problem["f"] * size, *slopes])

    def maximise(self, q: np.ndarray | None = None, u: np.ndarray | None = None) -> Optimum:
        """The (local) maximum reached from poses q and offsets u; by default from the nominal pose."""
        start = np.zeros(self.q0.size + len(self.labels))
        if q is not None:
            start[: self.q0.size] = (q - self.q0) / self.unit
        if u is not None:
            start[self.q0.size :] = (u - self.centre) / self.widths
        solution = self.solver(x0=start, lbx=self.bounds_low, ubx=self.bounds_high, lbg=self.low, ubg=self.high)
        x = np.array(solution["x"]).ravel()
        best = self.certify(
            self.q0 + x[: self.q0.size] * self.unit,
            pulled_in(self.sources, self.centre + x[self.q0.size :] * self.widths),
        )
        # Rounding of the closure keeps IPOPT from its end by more, the smaller the play. Where the objective is all but
        # linear, the points that its slope asks for are it.
        for _ in range(20):
            moved = self.certify(best.poses, np.concatenate([self._asked(best, s, part) for s, part in self.parts()]))
            if not moved.gap < best.gap:
                break
            best = moved
        if not best.gap <= self.limit:
            status = self.solver.stats()["return_status"]
            raise NoOptimumError(f"no maximum: gap {best.gap} of {self.size}; IPOPT: {status}")
        return best

    def _asked(self, best: Optimum, s: Source, part: slice) -> np.ndarray:
        """The point of a set that the slope asks for; a source that is worth nothing anywhere in its set stays."""
        worth = float(s.support(best.slope[part]))
        here = np.array([best.offsets[label] for label in s.labels])
        return here if worth < self.limit else s.support_point(best.slope[part])

    def parts(self) -> Iterator[tuple[Source, slice]]:
        """Every source, and where its offsets are."""
        k = 0
        for s in self.sources:
            yield s, slice(k, k + len(s.labels))
            k += len(s.labels)

    def certify(self, near: np.ndarray, found: np.ndarray) -> Optimum:
        """The point that closes with these offsets, its value and its gap."""
        offsets = {**self.link.centre, **dict(zip(self.labels, map(float, found), strict=True))}
        poses, good = self.link.solve(near, self.drives, offsets)
        if not good:
            raise NoOptimumError("the end does not close")
        at = self.slopes((poses - self.q0) / self.unit, (found - self.centre) / self.widths)
        value, f_q, f_d, a_q, a_d = (np.array(part) for part in at)
        w = (f_d.T - a_d.T @ np.linalg.solve(a_q.T, f_q.T)).ravel() * -self.size / self.widths
        gaps = [float(s.support(w[part]) - w[part] @ (found - self.centre)[part]) for s, part in self.parts()]
        return Optimum(poses, offsets, float(value.item()), w, sum(gaps))


def pulled_in(sources: list[Source], u: np.ndarray) -> np.ndarray:
    """u pulled back into its sets by what an optimiser leaves it outside."""
    u, k = u.copy(), 0
    for s in sources:
        part = slice(k, k + len(s.labels))
        away = u[part] - s.centre
        if s.kind == "disc":
            away /= max(1.0, float(np.hypot(*away)) / s.size[0])
        elif s.kind == "diamond":
            away /= max(1.0, (abs(away[0]) + s.size[1] * abs(away[1])) / s.size[0])
        else:
            away = np.clip(away, *s.size)
        u[part] = away + s.centre
        k += len(s.labels)
    return u


def _long(s: Source) -> bool:
    return not s.labels[0].endswith((".angle", ".value"))


def _half_widths(s: Source) -> np.ndarray:
    if s.kind == "diamond":
        return np.array([s.size[0], s.size[0] / s.size[1]])
    if s.kind == "disc":
        return np.full(2, s.size[0])
    return np.array([max(abs(s.size[0]), abs(s.size[1]))])
