"""Exact largest rotation of a four-bar's rocker under play in all joints, drive held, and the rocker pin's
exact region.

Formula (Ting, Zhu and Watkins, Mech. Mach. Theory 35 (2000) 391): the play of one loop can be moved to one
place without turning any link, so with the crank held the rocker angle theta3 is admissible if and only if

    | |D + l3 e(theta3) - B| - l2 | <= R,      R = sum of the radial clearances of the loop;

its extremes are those of two four-bars with couplers l2 - R and l2 + R. In the same way the rocker pin P (a
point of the rocker) is admissible if and only if  | |P - B| - l2 | <= r1 + r2 + r3  and  | |P - D| - l3 |
<= r4: a region between four arcs, the farthest point of which from anywhere is one of its corners or lies
on one of the arcs.
"""

from typing import Any

import numpy as np

from .fourbar import FourBar


def rotation_range(four_bar: FourBar, theta1: Any, R: float) -> tuple[Any, Any]:
    """Lowest and highest rocker angle minus nominal (radians)."""
    nominal = four_bar.rocker_angle(theta1)
    turns = [
        np.angle(np.exp(1j * (four_bar.with_coupler(four_bar.l2 + s * R).rocker_angle(theta1) - nominal)))
        for s in (-1, 1)
    ]
    return np.minimum(*turns), np.maximum(*turns)


def pin_boundary(four_bar: FourBar, theta1: float, radii: Any, n: int = 20001) -> np.ndarray:
    """Points of the boundary of the rocker pin's region, dense along its four arcs, corners included."""
    r123, r4 = float(sum(radii[:3])), float(radii[3])
    B, D = complex(four_bar.crank_pin(theta1)), four_bar.D

    def corner(s: int, t: int) -> complex:
        moved = FourBar(
            four_bar.l1, four_bar.l2 + s * r123, four_bar.l3 + t * r4, four_bar.A, four_bar.D, four_bar.branch
        )
        return complex(moved.rocker_pin(theta1))

    arcs = []
    for s in (-1, 1):
        arcs.append(_arc(B, corner(s, -1), corner(s, 1), n))
        arcs.append(_arc(D, corner(-1, s), corner(1, s), n))
    return np.concatenate(arcs)


def _arc(centre: complex, start: complex, end: complex, n: int) -> np.ndarray:
    turn = np.angle((end - centre) / (start - centre))
    arc: np.ndarray = centre + (start - centre) * np.exp(1j * turn * np.linspace(0, 1, n))
    return arc
