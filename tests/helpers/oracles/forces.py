"""Springs and thermal growth, independent of the package: potential energy, and points that move away from origins."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from .linkage import Linkage, Point


@dataclass
class SprungLinkage(Linkage):
    """A linkage whose loads include springs: the work lacks the energy that they store.

    Formula:

        W = sum_k f_k . p_k + m_k theta_k - sum_j (F_j e + k_j e^2 / 2),   e elongation or deflection, F_j preload
    """

    springs: list[tuple[Point, Point, float, float, float]] = field(default_factory=list)
    torsions: list[tuple[int, float, float, float]] = field(default_factory=list)

    @classmethod
    def of(cls, link: Linkage, **more: Any) -> SprungLinkage:
        """The linkage with springs (points, stiffness, free length, preload), or torsion springs by joint."""
        return cls(**{f.name: getattr(link, f.name) for f in fields(Linkage)}, **more)

    def work(self, q: list[Any], u: dict[str, Any], ops: Any = np) -> Any:
        total = super().work(q, u, ops)
        for first, second, stiffness, free, preload in self.springs:
            (ax, ay), (bx, by) = self.place(q, first, u, ops), self.place(q, second, u, ops)
            longer = ops.sqrt((bx - ax) ** 2 + (by - ay) ** 2) - free
            total = total - preload * longer - stiffness * longer**2 / 2
        for joint, stiffness, free, preload in self.torsions:
            turned = self.coordinate(q, joint, u, ops) - free
            total = total - preload * turned - stiffness * turned**2 / 2
        return total


def grown(link: Linkage, difference: float, expansion: dict[str, float]) -> Linkage:
    """The linkage with all points of every body farther from its origin, by expansion x difference."""

    def warm(p: Point) -> Point:
        factor = 1.0 + expansion.get(p.body, 0.0) * difference
        return replace(p, at=(p.at[0] * factor, p.at[1] * factor))

    joints = [replace(j, first=warm(j.first), second=warm(j.second)) for j in link.joints]
    return replace(link, joints=joints, output=warm(link.output), loads=[(warm(p), *f) for p, *f in link.loads])
