"""Plane trusses, and what is known of them without any program: direct stiffness, self-stress, linear programs.

A bar from a to b has the unit vector n and, when it is e longer than the drawing has it, asks of its nodes

    n . (u_b - u_a) = e

    stiffness      N = k (n . (u_b - u_a) - g)  for a bar made too long by g;  sum of the forces on a node = -load
    self-stress    S with  sum over the bars at a free node  S n = 0
    assembly       rigid bars on pins with radial clearance r go together when |sum S g| <= sum of r |S| over loose ends

One bar at every free node carries its pin and the ground those of the fixed ones; all others ride on them with the
clearance. A bar that rides is a two-force member, so that only the clearance along it counts.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Truss:
    """Nodes and bars in mm; deviations of length and stiffness (N/mm) by bar, clearance by node."""

    nodes: dict[str, tuple[float, float]]
    fixed: tuple[str, ...]
    bars: tuple[tuple[str, str], ...]
    radial: dict[str, float] = field(default_factory=dict)
    deviation: dict[str, float] = field(default_factory=dict)
    stiffness: dict[str, float] = field(default_factory=dict)
    load: tuple[float, float] = (0.0, 0.0)
    loaded: str = ""

    @property
    def free(self) -> list[str]:
        return [node for node in self.nodes if node not in self.fixed]

    @property
    def names(self) -> list[str]:
        return [a + b for a, b in self.bars]

    def carrier(self, node: str) -> str:
        return "ground" if node in self.fixed else next(name for name, bar in self._named() if node in bar)

    def _named(self) -> list[tuple[str, tuple[str, str]]]:
        return list(zip(self.names, self.bars, strict=True))

    def vector(self, bar: tuple[str, str]) -> Array:
        return np.subtract(self.nodes[bar[1]], self.nodes[bar[0]])

    def text(self) -> str:
        """The mechanism file."""
        lines = ['format = 1\nspace = "planar"\nunits = { length = "mm", angle = "deg", force = "N" }']
        for node, place in self.nodes.items():
            on = {"ground": place} if node in self.fixed else {}
            for name, bar in self._named():
                if node in bar:
                    on[name] = (0.0, 0.0) if node == bar[0] else (float(np.linalg.norm(self.vector(bar))), 0.0)
            seats = ", ".join(f"{body} = [{x!r}, {y!r}]" for body, (x, y) in on.items())
            lines.append(f'[joints.{node}]\ntype = "revolute"\non = {{ {seats} }}')
            if node in self.radial:
                lines.append(f"clearance = {{ radial = {float(self.radial[node])!r} }}")
        lines.append("[start]")
        for name, bar in self._named():
            x, y = self.nodes[bar[0]]
            angle = math.degrees(math.atan2(*self.vector(bar)[::-1]))
            lines.append(f"{name} = {{ x = {x!r}, y = {y!r}, angle = {angle!r} }}")
        for name, bar in self._named():
            if name in self.deviation:
                lines.append(f'[dimensions.long_{name}]\nbody = "{name}"\nbetween = ["{bar[0]}", "{bar[1]}"]')
                lines.append(f"deviation = {float(self.deviation[name])!r}")
            if name in self.stiffness:
                lines.append(f"[bodies.{name}]\nstiffness = {float(self.stiffness[name])!r}")
        node = self.loaded or (self.free or list(self.nodes))[0]
        body = next(name for name, bar in self._named() if node in bar) if node in self.fixed else self.carrier(node)
        lines.append(f'[output]\nbody = "{body}"\nat = "{node}"')
        if any(self.load):
            lines.append(f"[[loads]]\nforce = [{self.load[0]!r}, {self.load[1]!r}]")
        return "\n".join(lines) + "\n"

    def compatibility(self) -> Array:
        """Elongation of every bar by displacement of the free nodes."""
        matrix = np.zeros((len(self.bars), 2 * len(self.free)))
        for k, bar in enumerate(self.bars):
            n = self.vector(bar) / np.linalg.norm(self.vector(bar))
            for node, sign in zip(bar, (-1.0, 1.0), strict=True):
                if node in self.free:
                    i = 2 * self.free.index(node)
                    matrix[k, i : i + 2] += sign * n
        return matrix

    def gaps(self) -> Array:
        return np.array([self.deviation.get(name, 0.0) for name in self.names])

    def forces(self) -> Array:
        """External forces on the free nodes."""
        f = np.zeros(2 * len(self.free))
        if any(self.load):
            i = 2 * self.free.index(self.loaded)
            f[i : i + 2] = self.load
        return f

    def direct_stiffness(self) -> tuple[Array, Array]:
        """Displacements of the free nodes and tension of the bars, without clearance."""
        b, g = self.compatibility(), self.gaps()
        k = np.array([self.stiffness[name] for name in self.names])
        u = np.linalg.solve(b.T @ (k[:, None] * b), self.forces() + b.T @ (k * g))
        return u, k * (b @ u - g)

    def self_stresses(self) -> Array:
        """Tensions in equilibrium without load, one system per row."""
        b = self.compatibility()
        return np.linalg.svd(b.T)[2][np.linalg.matrix_rank(b) :]

    def loose(self) -> Array:
        """Clearance that every bar has along itself, of its loose ends together."""
        return np.array(
            [
                sum(self.radial.get(node, 0.0) for node in bar if self.carrier(node) != name)
                for name, bar in self._named()
            ]
        )

    def factor(self) -> float:
        """The smallest factor on all clearances with which the rigid truss goes together, by a linear program."""
        b, g, r = self.compatibility(), self.gaps(), self.loose()
        n = b.shape[1]
        cost = np.zeros(n + 1)
        cost[-1] = 1.0
        upper = np.block([[b, -r[:, None]], [-b, -r[:, None]]])
        bounds = [(None, None)] * n + [(0.0, None)]
        scale = np.abs(g).max() or 1.0
        found = linprog(cost, A_ub=upper, b_ub=np.concatenate([g, -g]) / scale, bounds=bounds, method="highs-ds")
        return float(found.fun) * scale if found.status == 0 else math.inf


def square(**more: object) -> Truss:
    """Square with both diagonals; its base is the ground, so that five bars hold two nodes with one too many."""
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "C": (100.0, 90.0), "D": (0.0, 100.0)}
    bars = (("A", "D"), ("D", "C"), ("B", "C"), ("A", "C"), ("B", "D"))
    return Truss(nodes, ("A", "B"), bars, **more)  # type: ignore[arg-type]
