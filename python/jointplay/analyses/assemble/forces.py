"""Forces and elongations of members, tension positive.

The force of an elastic member is that of the joint which gives as the member does. A rigid body with joints at two
points is a member between them: its force is the mean of what pulls it outwards at both ends,

    N = (F_b . e - F_a . e) / 2 ,    e from a to b,  F on the body, loads at that end among them

which are equal where nothing loads it in between. Rigid bodies with joints at more points have no force of their own.
"""

import numpy as np

from jointplay import _core
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.answers import Loaded
from jointplay.core.spec import ENDS, End, SpringSpec
from jointplay.model.mechanism import Mechanism

from .part import Part

#: two ends nearer than this share of the characteristic length have no direction between them
COINCIDENT = 1e-9


class Members:
    """The members of a mechanism: the elastic ones, and its rigid links between two points.

    Attributes
    ----------
    names : list of str
    """

    def __init__(self, m: Mechanism) -> None:
        elastic = {member.body for member in m.members}
        #: of every rigid body with two ends: joints by point, each with the sign of its reaction on the body
        self.ends: dict[int, dict[int, list[tuple[int, float]]]] = {}
        for body, owner in enumerate(m.owners):
            ends: dict[int, list[tuple[int, float]]] = {}
            for k, points in enumerate(m.joint_points):
                for point, sign in zip(points, (-1.0, 1.0), strict=True):
                    if m.points[point].body == body:
                        ends.setdefault(point, []).append((k, sign))
            is_link = len(ends) == 2 and body not in m.crosses and owner not in elastic
            if is_link and self._span(m, *ends) > COINCIDENT * m.length:
                self.ends[body] = ends
        self.elastic = [member.joint for member in m.members]
        self.names = [*(member.name for member in m.members), *(m.bodies[body] for body in self.ends)]

    @staticmethod
    def _span(m: Mechanism, a: int, b: int) -> float:
        return float(np.linalg.norm(np.subtract(m.points[b].at, m.points[a].at)))

    def forces(self, part: Part, core: _core.Mechanism, reaction: Floats, force: Floats | None) -> Floats:
        """Force along every member, N; nan where a member is not there or hangs on one end."""
        elastic = self._along(part, core.rows, force, np.nan)
        rigid = [self._force(part, reaction[0], body, ends) for body, ends in self.ends.items()]
        return np.array([*elastic, *rigid])

    def elongations(self, part: Part, core: _core.Mechanism, answer: Loaded) -> Floats:
        """Elastic elongation of every member, m; zero where it is rigid or only bends, nan where it is not there."""
        elastic = self._along(part, core.deformations, answer.get("deformation"), 0.0)
        return np.array([*elastic, *(0.0 if body in part.bodies else np.nan for body in self.ends)])

    def _along(self, part: Part, names: list[tuple[int, str]], values: Floats | None, missing: float) -> list[float]:
        """What an answer has for the elastic members along their axes."""
        found = []
        for joint in self.elastic:
            if joint not in part.joints or values is None:
                found.append(np.nan)
                continue
            name = (part.joints.index(joint), "along")
            found.append(float(values[0][names.index(name)]) if name in names else missing)
        return found

    def _force(self, part: Part, reaction: Floats, body: int, ends: dict[int, list[tuple[int, float]]]) -> float:
        there = {point: [on for on in joints if on[0] in part.joints] for point, joints in ends.items()}
        if not all(there.values()):
            return np.nan
        places = [poses.place(part.nominal[body], part.m.points[point].at) for point in there]
        pulls = [sum(sign * reaction[part.joints.index(k)] for k, sign in joints) for joints in there.values()]
        pulls = [pull[: part.lengths] + self._load(part, body, at) for pull, at in zip(pulls, places, strict=True)]
        along = (places[1] - places[0])[: part.lengths]
        return float((pulls[1] - pulls[0]) @ along / np.linalg.norm(along) / 2.0)

    def _load(self, part: Part, body: int, place: Floats) -> Floats:
        """The force of the loads and springs on a body at one of its ends."""
        total = np.zeros(part.lengths)

        def is_here(point: int) -> bool:
            away = poses.place(part.nominal[body], part.m.points[point].at) - place
            on_body = part.m.points[point].body == body
            return bool(on_body and body != part.base and np.linalg.norm(away) <= COINCIDENT * part.m.length)

        for load in part.m.loads.first:
            if is_here(load["point"]):
                turn = poses.matrix(part.nominal[load["axes"]]) if "axes" in load else np.eye(3)
                total += (turn @ load["force"])[: part.lengths]
        for spring in part.m.springs:
            if {spring["first"], spring["second"]} <= {*part.points}:
                for end, other in (ENDS, ENDS[::-1]):
                    if is_here(spring[end]):
                        total += self._pull(part, spring, end, other)[: part.lengths]
        return total

    @staticmethod
    def _pull(part: Part, spring: SpringSpec, end: End, other: End) -> Floats:
        """The force of a spring on one of its ends, at the nominal pose."""
        points = [part.m.points[spring[on]] for on in (end, other)]
        here, there = (poses.place(part.nominal[point.body], point.at) for point in points)
        length = float(np.linalg.norm(there - here))
        tension = spring["preload"] + spring["stiffness"] * (length - spring["free_length"])
        return np.asarray(tension * (there - here) / length) if length else np.zeros(3)
