"""The mechanism drawn in a CAD sketch and solved by SolveSpace's constraint solver.

Formula: none of ours. A body is a rigid figure: two base points at a fixed distance and every other point
at its two distances from them; pins are coincident points, guides are points on lines and parallel lines,
drives are parallel to construction lines. Clearance is drawn as the CAD user of Jaiswal et al. draws it: an
extra link of the offset's length, parallel to a construction line in its direction (a radial link), or a
guide line moved or turned by its offset. SolveSpace: Westhues, solvespace.com.
"""

import math
from typing import Any

import numpy as np
from python_solvespace import ResultFlag, SolverSystem

from .linkage import GROUND, Joint, Linkage, Point


class Sketch:
    """Draws a linkage with given offsets; `solve` returns the pose of the output (x, y, angle)."""

    def __init__(self, link: Linkage, q: np.ndarray, drives: Any, u: dict[str, float]) -> None:
        self.link, self.q, self.u = link, q, u
        self.system = SolverSystem()
        self.plane = self.system.create_2d_base()
        self.size = link.length
        # Base points in body axes, off every line that a mechanism is likely to be drawn along.
        self.base = [complex(-0.37, -0.83) * self.size, complex(0.71, -0.59) * self.size]
        self.figures = {GROUND: self._ground_base()}
        for body in link.bodies:
            a, b = (self._free(self._guess(body, p)) for p in self.base)
            self.system.distance(a, b, abs(self.base[1] - self.base[0]), self.plane)
            self.figures[body] = (a, b)
        driven = {joint: value for (_, joint, _), value in zip(link.drives, drives, strict=True)}
        for k, joint in enumerate(link.joints):
            self._join(joint, driven.get(k))
        x, y = link.output.at
        self.output = self._on(link.output.body, complex(x, y) + self._shift(link.output))

    def solve(self) -> np.ndarray:
        # The solver stops at 1e-8; started again from there it takes one more Newton step, down to rounding.
        for _ in range(3):
            if self.system.solve() != ResultFlag.OKAY:
                raise ArithmeticError(f"the sketch does not solve: {self.system.failures()}")
        output = complex(*self.system.params(self.output.params))
        body = self.link.output.body
        a, b = (complex(*self.system.params(p.params)) for p in self.figures[body])
        turn = np.angle((b - a) / (self.base[1] - self.base[0]))
        return np.array([output.real, output.imag, turn])

    # -- drawing ------------------------------------------------------

    def _guess(self, body: str, p: complex) -> complex:
        if body == GROUND:
            return p
        i = 3 * self.link.bodies.index(body)
        return complex(self.q[i], self.q[i + 1]) + p * np.exp(1j * self.q[i + 2])

    def _free(self, p: complex) -> Any:
        return self.system.add_point_2d(float(p.real), float(p.imag), self.plane)

    def _fixed(self, p: complex) -> Any:
        point = self._free(p)
        self.system.dragged(point, self.plane)
        return point

    def _ground_base(self) -> tuple[Any, Any]:
        return self._fixed(self.base[0]), self._fixed(self.base[1])

    def _on(self, body: str, p: complex) -> Any:
        """A point of a body at p in its axes."""
        if body == GROUND:
            return self._fixed(p)
        point = self._free(self._guess(body, p))
        for base, place in zip(self.figures[body], self.base, strict=True):
            self.system.distance(point, base, abs(p - place), self.plane)
        return point

    def _line(self, a: Any, b: Any) -> Any:
        return self.system.add_line_2d(a, b, self.plane)

    def _shift(self, p: Point) -> complex:
        return sum((complex(x, y) * self.u.get(label, 0.0) for x, y, label in p.moves), 0j)

    def _turn(self, first: str, second: str, angle: float) -> None:
        """The base line of `second` is at `angle` to that of `first`: parallel to a line drawn on `first`."""
        start = self.base[0] * 0.9
        direction = (self.base[1] - self.base[0]) * np.exp(1j * angle)
        guide = self._line(self._on(first, start), self._on(first, start + direction))
        self.system.parallel(guide, self._line(*self.figures[second]), self.plane)

    def _join(self, j: Joint, value: float | None) -> None:
        first, second = j.first.body, j.second.body
        a = complex(*j.first.at) + self._shift(j.first)
        pin = self._on(second, complex(*j.second.at) + self._shift(j.second))
        u = {k: self.u.get(f"{j.name}.{k}", 0.0) for k in ("x", "y", "normal", "angle")}
        if j.kind in ("revolute", "fixed"):
            self._radial_link(self._on(first, a), pin, complex(u["x"], u["y"]))
        else:
            s = np.exp(1j * j.first.axis)
            a = a + u["normal"] * 1j * s
            if value is not None:
                self.system.coincident(pin, self._on(first, a + value * s), self.plane)
            else:
                ends = (self._on(first, a - 1.3 * self.size * s), self._on(first, a + 1.7 * self.size * s))
                self.system.coincident(pin, self._line(*ends), self.plane)
        if j.kind in ("prismatic", "fixed"):
            self._turn(first, second, j.first.axis - j.second.axis + u["angle"])
        elif j.kind == "revolute" and value is not None:
            self._turn(first, second, value)

    def _radial_link(self, a: Any, pin: Any, offset: complex) -> None:
        if abs(offset) == 0.0:
            self.system.coincident(a, pin, self.plane)
            return
        # The link's far end is drawn where it belongs, or the solver may turn so short a link right round.
        tip = self._free(complex(*self.system.params(a.params)) + offset)
        corner = complex(-1.9, -1.7) * self.size
        direction = self._line(self._fixed(corner), self._fixed(corner + self.size * offset / abs(offset)))
        self.system.parallel(direction, self._line(a, tip), self.plane)
        self.system.distance(a, tip, abs(offset), self.plane)
        self.system.coincident(tip, pin, self.plane)


def output_pose(link: Linkage, q: np.ndarray, drives: Any, u: dict[str, float] | None = None) -> np.ndarray:
    """Output pose (x, y, angle in (-pi, pi]) of the sketch, drawn near the poses q, with offsets u."""
    pose = Sketch(link, q, drives, u or {}).solve()
    assert math.isfinite(float(pose.sum()))
    return pose
