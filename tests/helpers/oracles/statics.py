"""Equilibrium of every body from its free-body diagram.

Formula (Newton's first law and the principle of action and reaction): with F_j, M_j the force and the
moment that joint j exerts on its second body, at that body's joint point P_j, and the opposite on its first
body along the same line,

    sum of loads + sum over joints of +-F_j = 0,
    sum of (r - o) x force + moments = 0   about the body's origin o.
"""

from typing import Any

import numpy as np

from .linkage import GROUND, Linkage


def imbalance(link: Linkage, q: np.ndarray, u: dict[str, Any], reactions: np.ndarray) -> np.ndarray:
    """Resultant force and moment about its origin that is left on every body, shape (bodies, 3)."""
    poses = list(q)
    left = np.zeros((len(link.bodies), 3))

    def push(body: str, x: float, y: float, fx: float, fy: float, moment: float) -> None:
        if body != GROUND:
            i = link.bodies.index(body)
            left[i] += fx, fy, (x - q[3 * i]) * fy - (y - q[3 * i + 1]) * fx + moment

    for point, fx, fy, moment in link.loads:
        push(point.body, *link.place(poses, point, u, np), fx, fy, moment)
    for joint, (fx, fy, moment) in zip(link.joints, reactions, strict=True):
        x, y = link.place(poses, joint.second, u, np)
        push(joint.second.body, x, y, fx, fy, moment)
        push(joint.first.body, x, y, -fx, -fy, -moment)
    return left


def passive_parts(link: Linkage, q: np.ndarray, reactions: np.ndarray) -> list[float]:
    """What no frictionless joint without a drive transmits: moment of a pin, force along a guide."""
    driven = {joint for _, joint, _ in link.drives}
    parts: list[float] = []
    for k, (joint, (fx, fy, moment)) in enumerate(zip(link.joints, reactions, strict=True)):
        if joint.kind in ("revolute", "pin_in_slot") and not (joint.kind == "revolute" and k in driven):
            parts.append(moment)
        if joint.kind in ("prismatic", "pin_in_slot") and k not in driven:
            phi = link.angle(list(q), joint.first.body) + joint.first.axis
            parts.append(fx * np.cos(phi) + fy * np.sin(phi))
    return parts
