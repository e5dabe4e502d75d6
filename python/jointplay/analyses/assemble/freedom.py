"""What a step of an assembly is, by how it changes mobility and over-constraint; and what has to be held.

With J the closure Jacobian of the part at its nominal pose (joints and drives over the twists of its bodies):

    mobility = columns - rank J          freedoms that are left with the drives held
    redundancy = rows - rank J           constraints that are held already

Where a freedom is left, coordinates are held at their nominal values, as hands or a jig would, until none is: first
coordinates of joints as the file has them, then ground coordinates of bodies that hang on no joint that could be held.
"""

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import DRIVABLE, LENGTHS, TURNS
from jointplay.core.spec import Changes, DriveSpec, JointSpec, PointSpec

from .part import GROUND, Part

#: singular values and what is left of rows below this share of the largest count as zero
RANK = 1e-7
#: how a joint that holds a point of a body to the ground is written for the core
TARGET: JointSpec = {
    "kind": "target",
    "first": -1,
    "second": -1,
    "axis_first": [1.0, 0.0, 0.0],
    "axis_second": [1.0, 0.0, 0.0],
    "side_first": [0.0, 1.0, 0.0],
    "side_second": [0.0, 1.0, 0.0],
}


@dataclass(frozen=True)
class Freedom:
    """How a part can move, and its redundant constraints."""

    #: freedoms that are left with the drives held
    mobility: int
    #: constraints that are held already by others
    redundancy: int
    #: joints and bodies that are held at their nominal place
    held: tuple[str, ...]
    #: `points`, `joints`, `drives`: what the specification of the part needs besides, so that they are held
    points: tuple[PointSpec, ...]
    joints: tuple[JointSpec, ...]
    drives: tuple[DriveSpec, ...]

    def holding(self, part: Part) -> Changes:
        """The changes of the part's specification that hold what is free."""
        own = part.spec
        return {
            "points": [*own["points"], *self.points],
            "joints": [*own["joints"], *self.joints],
            "drives": [*own["drives"], *self.drives],
        }


def examine(part: Part) -> Freedom:
    """Find what is free in a part and what is redundant, and hold what is free."""
    own, m = len(part.spec["joints"]), part.m
    drivable = [k for k, j in enumerate(part.joints) if m.joint_kinds[j] in DRIVABLE and k not in part.driven]
    points, joints, places = _targets(part)
    drives: list[DriveSpec] = [{"joint": k} for k in drivable]
    owners = [m.joints[part.joints[k]] for k in drivable]
    for k, body in enumerate(places):
        drives += [{"joint": own + k, "component": name} for name in m.components if name in LENGTHS]
        owners += [m.owners[part.bodies[body]] if part.bodies[body] != GROUND else "ground"] * part.lengths

    everything = Freedom(0, 0, (), tuple(points), tuple(joints), tuple(drives))
    core = part.core(**everything.holding(part))
    jacobian = _scaled(core.jacobian(part.poses), core.rows, part)
    split = len(jacobian) - len(drives)
    span = _Span(jacobian.shape[1])
    rank = sum(span.add(row) for row in jacobian[:split])
    chosen = [k for k in range(len(drives)) if span.add(jacobian[split + k])]
    anywhere = any(k >= len(drivable) for k in chosen)
    return Freedom(
        mobility=jacobian.shape[1] - rank,
        redundancy=split - rank,
        held=tuple(dict.fromkeys(owners[k] for k in chosen)),
        # A target that is not driven holds nothing.
        points=tuple(points) if anywhere else (),
        joints=tuple(joints) if anywhere else (),
        drives=tuple(drives[k] for k in chosen),
    )


def _targets(part: Part) -> tuple[list[PointSpec], list[JointSpec], list[int]]:
    """Points that could be held to the ground, the joints that would, and the body of each joint.

    As many points of a body as hold it when it is free: two in the plane, three in space.
    """
    first = len(part.spec["points"])
    points: list[PointSpec] = [{"body": GROUND, "at": [0.0, 0.0, 0.0]}]
    joints: list[JointSpec] = []
    bodies: list[int] = []
    for body in range(len(part.bodies)):
        for corner in np.vstack([np.zeros(3), part.m.length * np.eye(3)])[: part.lengths]:
            points.append({"body": body, "at": corner.tolist()})
            joints.append(TARGET | {"first": first, "second": first + len(points) - 1})
            bodies.append(body)
    return points, joints, bodies


def _scaled(jacobian: Floats, rows: list[tuple[int, str]], part: Part) -> Floats:
    """The Jacobian with lengths over the characteristic one, and rows of comparable size."""
    unit = np.where(np.isin(part.m.components, LENGTHS), part.m.length, 1.0)
    lengths = np.array([component not in TURNS for _, component in rows])
    scaled = np.where(lengths[:, None], jacobian / part.m.length, jacobian) * np.tile(unit, len(part.bodies))
    return np.asarray(scaled)


class _Span:
    """The space that rows span, which grows row by row (Gram-Schmidt, twice for rounding)."""

    def __init__(self, width: int) -> None:
        self.rows: Floats = np.zeros((0, width))

    def add(self, row: Floats) -> bool:
        """Add a row; False where it lies in the span already."""
        size = float(np.linalg.norm(row))
        left = row
        for _ in range(2):
            left = left - self.rows.T @ (self.rows @ left)
        rest = float(np.linalg.norm(left))
        if rest <= RANK * max(size, np.finfo(float).tiny):
            return False
        self.rows = np.vstack([self.rows, left / rest])
        return True
