"""What a step of an assembly is, by how it changes mobility and over-constraint; and what has to be held.

With J the closure Jacobian of the part at its nominal pose (joints and drives over the twists of its bodies):

    mobility = columns - rank J          freedoms that are left with the drives held
    redundancy = rows - rank J           constraints that are held already

Where a freedom is left, coordinates are held at their nominal values, as hands or a jig would, until none is: first
coordinates of joints as the file has them, then ground coordinates of bodies that hang on no joint that could be held.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.compile import DRIVABLE, LENGTHS, TURNS

from .part import GROUND, Floats, Part

#: singular values and what is left of rows below this share of the largest count as zero
RANK = 1e-7
#: how a joint that holds a point of a body to the ground is written for the core
TARGET = {"kind": "target", "axis_first": [1.0, 0.0, 0.0], "axis_second": [1.0, 0.0, 0.0]}
TARGET |= {"side_first": [0.0, 1.0, 0.0], "side_second": [0.0, 1.0, 0.0]}


@dataclass(frozen=True)
class Freedom:
    """How a part can move, and what holds it more than once.

    Attributes
    ----------
    mobility : int
        Freedoms that are left with the drives held.
    redundancy : int
        Constraints that are held already by others.
    held : tuple of str
        Joints and bodies that are held at their nominal place.
    points, joints, drives : tuple of dict
        What the specification of the part needs besides, so that they are held.
    """

    mobility: int
    redundancy: int
    held: tuple[str, ...]
    points: tuple[dict[str, Any], ...]
    joints: tuple[dict[str, Any], ...]
    drives: tuple[dict[str, Any], ...]

    def holding(self, part: Part) -> dict[str, Any]:
        """The changes of the part's specification that hold what is free."""
        own = part.spec
        return {
            "points": [*own["points"], *self.points],
            "joints": [*own["joints"], *self.joints],
            "drives": [*own["drives"], *self.drives],
        }


def examine(part: Part) -> Freedom:
    """Find what is free in a part and what is redundant, and hold what is free."""
    count, own = len(part.spec["points"]), len(part.driven)
    drivable = [
        k for k, joint in enumerate(part.joints) if part.m.joint_kinds[joint] in DRIVABLE and k not in part.driven
    ]
    lengths = [name for name in part.m.components if name in LENGTHS]
    points: list[dict[str, Any]] = [{"body": GROUND, "at": [0.0, 0.0, 0.0]}]
    targets: list[tuple[int, dict[str, Any]]] = []
    for body in range(len(part.bodies)):
        # As many points as fix a body that is free: two in the plane, three in space.
        for corner in np.vstack([np.zeros(3), part.m.length * np.eye(3)])[: len(lengths)]:
            points.append({"body": body, "at": corner.tolist()})
            targets.append((body, TARGET | {"first": count, "second": count + len(points) - 1}))
    joints = [joint for _, joint in targets]
    drives = [{"joint": k} for k in drivable]
    first = len(part.spec["joints"])
    drives += [{"joint": first + k, "component": name} for k in range(len(targets)) for name in lengths]
    owners = [part.m.joints[part.joints[k]] for k in drivable]
    owners += [part.m.bodies[part.bodies[body]] if part.bodies[body] >= 0 else "ground" for body, _ in targets for _ in lengths]

    everything = Freedom(0, 0, (), tuple(points), tuple(joints), tuple(drives))
    core = part.core(**everything.holding(part))
    jacobian = _scaled(core.jacobian(part.poses), core.rows, part)
    split = len(jacobian) - len(drives)
    basis = _Span(jacobian.shape[1])
    rank = sum(basis.add(row) for row in jacobian[:split])
    chosen = [k for k in range(len(drives)) if basis.add(jacobian[split + k])]
    used = sorted({int(drives[k]["joint"]) - first for k in chosen if drives[k]["joint"] >= first})
    ends = sorted({0} | {int(joints[k]["second"]) - count for k in used}) if used else []
    return Freedom(
        mobility=jacobian.shape[1] - rank,
        redundancy=split - rank,
        held=tuple(dict.fromkeys(owners[k] for k in chosen)),
        points=tuple(points[k] for k in ends),
        joints=tuple(
            joints[k] | {"first": count, "second": count + ends.index(int(joints[k]["second"]) - count)} for k in used
        ),
        drives=tuple(
            drives[k] if drives[k]["joint"] < first else drives[k] | {"joint": first + used.index(drives[k]["joint"] - first)}
            for k in chosen
        ),
    )
    

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
