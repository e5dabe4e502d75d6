"""Load-determined pose of an over-constrained or elastic planar mechanism, without a basis and without self-stresses.

    minimise  1/2 sum k e^2 - <w, dq>   over displacements dq of all bodies, offsets u of the joints, elongations e,
    subject to  R_q dq + R_u u + R_e e = 0  for every row of every joint,   u in its sets

with the derivatives of the rows R by complex steps (`Linkage`), solved by Clarabel. Elongations are those of dimensions
of the file that are given a stiffness here.
"""

from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .linkage import STEP, Linkage

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Optimum:
    """Value of the program, displacements of the bodies and of the output, elongation by label."""

    value: float
    moved: Array
    error: Array
    elongation: dict[str, float]
    solved: bool


class Primal:
    """A linkage at poses q, to first order. Lengths are counted in `unit`, which keeps numbers near one."""

    def __init__(self, link: Linkage, q: Array, drives: Any, stiffness: dict[str, float], unit: float) -> None:
        self.link, self.q, self.unit, self.stiffness = link, q, unit, stiffness
        zero = dict.fromkeys(link.labels, 0.0)
        self.labels = link.labels

        def along(label: str) -> Array:
            return link.rows(q.astype(complex), drives, zero | {label: STEP * 1j}).imag / STEP

        self.rows = np.hstack([link.jacobian(q, drives, zero), np.stack([along(c) for c in self.labels], axis=-1)])
        # Lengths by lengths, angles by angles: a turn counts as the arc at the length of the linkage.
        self.scale = np.tile([1.0, 1.0, 1.0 / link.length], q.size // 3)
        self.rows[:, : q.size] *= self.scale
        self.cost = self._gradient(link.work)
        self.output = [self._gradient(lambda q, u, k=k: link.output_pose(q, u)[k]) for k in range(3)]

    def _gradient(self, f: Any) -> Array:
        """Along displacements and parameters, which move points, too."""
        zero = dict.fromkeys(self.labels, 0.0)
        found = []
        for k in range(self.q.size):
            z = self.q.astype(complex)
            z[k] += STEP * 1j
            found.append(np.imag(f(list(z), zero)) / STEP * self.scale[k])
        q = list(self.q.astype(complex))
        return np.array(found + [np.imag(f(q, zero | {label: STEP * 1j})) / STEP for label in self.labels])

    def solve(self, weights: Array | None = None, at_least: float | None = None) -> Optimum:
        """Minimise; or maximise weights . (displacements, parameters) among poses of that much work and more."""
        m, n = self.rows.shape
        a, b, cones = [self.rows], [np.zeros(m)], [clarabel.ZeroConeT(m)]
        quadratic = np.zeros(n)
        for source in self.link.sources:
            columns = [self.q.size + self.labels.index(label) for label in source.labels]
            pick = np.eye(n)[columns]
            centre = np.array(source.centre) / self.unit
            if source.labels[0] in self.stiffness:
                # The rest of a dimension is its known deviation; what it gives way to the load is elastic.
                quadratic[columns[0]] = self.stiffness[source.labels[0]]
            elif source.kind == "disc" and source.size[0] > 0:
                a.append(np.vstack([np.zeros(n), -pick]))
                b.append(np.concatenate([[source.size[0] / self.unit], -centre]))
                cones.append(clarabel.SecondOrderConeT(3))
            elif source.kind == "diamond":
                signs = np.array([[s, t] for s in (1, -1) for t in (1, -1)]) * [1.0, source.size[1]]
                a.append(signs @ pick)
                b.append(np.full(4, source.size[0] / self.unit) + signs @ centre)
                cones.append(clarabel.NonnegativeConeT(4))
            elif source.kind == "interval" and source.size[1] > source.size[0] and "." in source.labels[0]:
                a.append(np.vstack([pick, -pick]))
                b.append(np.array([source.size[1], -source.size[0]]) / self.unit + np.array([1.0, -1.0]) * centre)
                cones.append(clarabel.NonnegativeConeT(2))
            else:
                a.append(pick)
                b.append(centre)
                cones.append(clarabel.ZeroConeT(len(columns)))
        elastic = np.flatnonzero(quadratic)
        rest = np.zeros(n)
        for column in elastic:
            label = self.labels[column - self.q.size]
            rest[column] = self.link.centre[label] / self.unit
        # 1/2 k (u - rest)^2 - <w, dq>, energies in units of the largest force.
        force = np.abs(self.cost).max() or 1.0
        curve = quadratic * self.unit / force
        cost = -self.cost / force - curve * rest
        if at_least is not None:
            a.append(-self.cost[None] / force)
            b.append(np.array([-at_least / force / self.unit]))
            cones.append(clarabel.NonnegativeConeT(1))
        if weights is not None:
            cost, curve = -weights, np.zeros(n)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
        found = clarabel.DefaultSolver(
            sparse.csc_matrix(np.diag(curve)), cost, sparse.csc_matrix(np.vstack(a)), np.concatenate(b), cones, settings
        ).solve()
        status = str(found.status)
        x = np.array(found.x)
        moved = self.unit * x[: self.q.size] * self.scale
        error = np.array([self.unit * row @ x for row in self.output])
        return Optimum(
            value=self.unit * (0.5 * x @ (curve * x) + cost @ x + 0.5 * rest @ (curve * rest)) * force,
            moved=moved,
            error=error,
            elongation={self.labels[c - self.q.size]: self.unit * float(x[c] - rest[c]) for c in elastic},
            solved=status in ("Solved", "AlmostSolved", "InsufficientProgress"),
        )

    def extremes(self, component: int, work: float | None = None) -> tuple[float, float]:
        """Lowest and highest value of a component of the output over all poses, or those of at least that much work."""
        ends = [self.solve(sign * self.output[component], work).error[component] for sign in (-1.0, 1.0)]
        return float(ends[0]), float(ends[1])
