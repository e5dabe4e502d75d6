"""Forces along members, tension positive.

A rigid body with joints at two points is a member between them: its force is the mean of what pulls it outwards at
both ends,

    N = (F_b . e - F_a . e) / 2 ,    e from a to b,  F on the body

which are equal where nothing else loads it. Bodies with joints at more points have no force of their own.
"""

from __future__ import annotations

import numpy as np

from jointplay import poses
from jointplay.model import Mechanism

from .part import Floats, Part
from .state import State

#: two ends nearer than this share of the characteristic length have no direction between them
COINCIDENT = 1e-9


class Members:
    """The members of a mechanism: its links between two points.

    Attributes
    ----------
    names : list of str
    """

    def __init__(self, m: Mechanism) -> None:
        spec = m.core_spec
        #: of every body with two ends: joints by point, each with the sign of its reaction on the body
        self.ends: dict[int, dict[int, list[tuple[int, float]]]] = {}
        for body in range(len(m.bodies)):
            ends: dict[int, list[tuple[int, float]]] = {}
            for k, joint in enumerate(spec["joints"]):
                for end, sign in (("first", -1.0), ("second", 1.0)):
                    if spec["points"][joint[end]]["body"] == body:
                        ends.setdefault(joint[end], []).append((k, sign))
            if len(ends) == 2 and body not in m.crosses and self._span(m, *ends) > COINCIDENT * m.length:
                self.ends[body] = ends
        self.names = [m.bodies[body] for body in self.ends]

    @staticmethod
    def _span(m: Mechanism, a: int, b: int) -> float:
        first, second = (np.array(m.core_spec["points"][point]["at"]) for point in (a, b))
        return float(np.linalg.norm(second - first))

    def forces(self, part: Part, found: State) -> Floats:
        """Force along every member, N; nan where a member is not there or hangs on one end."""
        return np.array([self._force(part, found, body, ends) for body, ends in self.ends.items()])

    def _force(self, part: Part, found: State, body: int, ends: dict[int, list[tuple[int, float]]]) -> float:
        there = {point: [on for on in joints if on[0] in part.joints] for point, joints in ends.items()}
        if not all(there.values()):
            return np.nan
        places = [poses.place(part.nominal[body], part.m.core_spec["points"][point]["at"]) for point in there]
        pulls = [sum(sign * found.reaction[k] for k, sign in joints)[: part.lengths] for joints in there.values()]
        along = (places[1] - places[0])[: part.lengths]
        return float((pulls[1] - pulls[0]) @ along / np.linalg.norm(along) / 2.0)
