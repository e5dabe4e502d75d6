"""Four-bar linkage by circle intersection.

Formula (any textbook, e.g. Norton, *Design of Machinery*, ch. 4): with the ends of the moving links known,
B of the crank and D of the rocker pivot, the rocker pin P is a common point of the circles |P - B| = l2 and
|P - D| = l3,

    P = B + a e + s h e_perp,   e = (D - B)/|D - B|,
    a = (l2^2 - l3^2 + |D - B|^2) / (2 |D - B|),   h = sqrt(l2^2 - a^2),

s = +-1 being the branch. With play d1 .. d4 in the joints J1 (ground, crank), J2 (crank, coupler), J3
(coupler, rocker) and J4 (ground, rocker), each the second body's point minus the first's in ground axes,
the circles are moved and nothing else: B = A + d1 + l1 e(theta1) + d2 + d3 and D + d4.

Points are complex numbers; everything broadcasts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class FourBar:
    """Link lengths l1 (crank), l2 (coupler), l3 (rocker), the ground pivots A and D, and the branch s."""

    l1: Any
    l2: Any
    l3: Any
    A: complex = 0j
    D: complex = 0j
    branch: int = 1

    def crank_pin(self, theta1: Any) -> Any:
        return self.A + self.l1 * np.exp(1j * np.asarray(theta1))

    def rocker_pin(self, theta1: Any, d: Any = (0j, 0j, 0j, 0j)) -> Any:
        """P; not a number where the links do not reach."""
        d1, d2, d3, d4 = d
        B, D = self.crank_pin(theta1) + d1 + d2 + d3, self.D + d4
        e = (D - B) / np.abs(D - B)
        a = (self.l2**2 - self.l3**2 + np.abs(D - B) ** 2) / (2 * np.abs(D - B))
        with np.errstate(invalid="ignore"):
            h = np.sqrt(self.l2**2 - a**2)
        return B + a * e + self.branch * h * 1j * e

    def rocker_angle(self, theta1: Any, d: Any = (0j, 0j, 0j, 0j)) -> Any:
        return np.angle(self.rocker_pin(theta1, d) - self.D - d[3])

    def coupler_angle(self, theta1: Any, d: Any = (0j, 0j, 0j, 0j)) -> Any:
        return np.angle(self.rocker_pin(theta1, d) - self.crank_pin(theta1) - d[0] - d[1] - d[2])

    def with_coupler(self, l2: Any) -> FourBar:
        return replace(self, l2=l2)


def paper_four_bar() -> FourBar:
    """The 4R of Jaiswal et al.: crank 75, coupler 75, rocker 150, pivots 100 apart, in mm."""
    four_bar = FourBar(75.0, 75.0, 150.0, 0j, -100 + 0j)
    # The published first position of the rocker pin, (22.015, 87.248), tells the branch.
    near = abs(four_bar.rocker_pin(np.deg2rad(22.7)) - (22.015 + 87.248j)) < 0.02
    return four_bar if near else replace(four_bar, branch=-1)
