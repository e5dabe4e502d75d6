"""Generalised links: members locked into one, and how long they can be between two of their outer joints.

One end is held at the origin and the other on the x axis, so that the x component of the far end is the length,
whatever the offsets: its extremes are those of `worst`, exact on the non-linear closure.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import Changes, DriveSpec
from jointplay.model.mechanism import Mechanism

from .freedom import TARGET
from .part import GROUND, Part, cut, rigid
from .steps import body_of

#: two ends nearer than this share of the characteristic length have no direction between them
COINCIDENT = 1e-9


@dataclass(frozen=True)
class Span:
    """A generalised link between two of its outer joints; lengths in metres."""

    #: the bodies that are locked together
    members: tuple[int, ...]
    #: the joints at its ends
    ends: tuple[int, int]
    #: `nominal`, `actual`: its length with perfect parts, and with the known deviations and every clearance in its
    #: middle
    nominal: float
    actual: float
    #: `shortest`, `longest`: over all clearances and tolerances
    shortest: float
    longest: float


def spans(m: Mechanism, nominal: Floats, members: Sequence[int]) -> Iterator[Span]:
    """The spans of members that are locked together, between every two outer joints on different members."""
    assert m.assembly is not None
    part = cut(m, nominal, m.assembly.base, members, attached=False)
    for (k, a), (n, b) in combinations(_outer(part), 2):
        far = part.spec["points"]
        if body_of(part, a) == body_of(part, b):
            continue
        start, end = (poses.place(part.poses[far[p]["body"]], far[p]["at"]) for p in (a, b))
        if float(np.linalg.norm(end - start)) > COINCIDENT * m.length:
            gauge = _Gauge(part, a, b, end - start)
            if gauge.is_rigid:
                yield Span(tuple(members), (k, n), *gauge.lengths())


def _outer(part: Part) -> list[tuple[int, int]]:
    """Joints with bodies outside, each with its point on the part."""
    m, own = part.m, {*part.bodies}
    there = [k for k, point in enumerate(m.points) if point.body in (*part.bodies, part.base)]
    found: dict[int, tuple[int, int]] = {}
    for k, points in enumerate(m.joint_points):
        inside = [point for point in points if m.points[point].body in own]
        if len(inside) == 1:
            # Several riders on one pin are one end.
            found.setdefault(inside[0], (k, there.index(inside[0])))
    return list(found.values())


class _Gauge:
    """A part between two of its points: the first at the origin, the second on the x axis."""

    def __init__(self, part: Part, a: int, b: int, between: Floats) -> None:
        self.part, self.output = part, b
        self.length = float(np.linalg.norm(between))
        turn = _along(between)
        points = part.spec["points"]
        body = points[a]["body"]
        origin = poses.place(part.poses[body], points[a]["at"])
        self.poses = np.ascontiguousarray([_moved(pose, turn, origin) for pose in part.poses])[None]
        # Off the x axis, so that it shows a turn about it.
        aside = points[a]["at"] + poses.matrix(self.poses[0, body]).T @ [0.0, part.m.length, 0.0]
        first, own = len(points), len(part.spec["joints"])
        held = {a: "xyz"[: part.lengths], b: "yz"[: part.lengths - 1], first + 1: "z" if part.lengths == 3 else ""}
        self.changes: Changes = {
            "points": [*points, {"body": GROUND, "at": [0.0] * 3}, {"body": body, "at": aside.tolist()}],
            # How long it is by itself does not depend on how it gives.
            "joints": [
                *(rigid(joint) for joint in part.spec["joints"]),
                *(TARGET | {"first": first, "second": point} for point in held),
            ],
            "drives": [
                *part.spec["drives"],
                *(DriveSpec(joint=own + k, component=c) for k, names in enumerate(held.values()) for c in names),
            ],
            "guess": self.poses[0].tolist(),
            "loads": [],
            "springs": [],
            "torsions": [],
        }

    @property
    def is_rigid(self) -> bool:
        """Whether the members are locked to one another just once."""
        core = self.part.core(self.output, **self.changes)
        return len(core.rows) == len(self.part.bodies) * len(self.part.m.components)

    def lengths(self) -> tuple[float, float, float, float]:
        """Nominal, actual, shortest and longest."""
        core = self.part.core(self.output, **self.changes)
        drives = core.drive_values(self.poses, np.zeros(len(self.changes["drives"])))
        u = np.ascontiguousarray(self.part.m.centre[self.part.parameters][None])
        along = core.given(drives, self.poses, u)["error"][0, 0]
        shortest, longest = core.worst(drives, self.poses)["component"][0, 0]
        return self.length, self.length + float(along), self.length + float(shortest), self.length + float(longest)


def _moved(pose: Floats, turn: Floats, origin: Floats) -> Floats:
    """A pose after a point has gone to the origin and everything has turned about it."""
    at = turn @ (poses.position(pose) - origin)
    if pose.shape[-1] == poses.SPATIAL:
        return np.concatenate([at, poses.product(poses.from_axes(turn), pose[3:])])
    return np.array([at[0], at[1], pose[2] + np.arctan2(turn[1, 0], turn[0, 0])])


def _along(direction: Floats) -> Floats:
    """The rotation that turns a direction into the x axis."""
    e = direction / np.linalg.norm(direction)
    if abs(e[2]) < 1e-12:
        return np.array([[e[0], e[1], 0.0], [-e[1], e[0], 0.0], [0.0, 0.0, 1.0]])
    across = np.cross(e, np.eye(3)[int(np.abs(e).argmin())])
    across /= np.linalg.norm(across)
    return np.array([e, across, np.cross(e, across)])
