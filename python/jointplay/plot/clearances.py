"""What clearances allow, as points around the place of their joint.

disc, ball    the circle or sphere of the radial clearance
journal       two circles across the axis, the axial play apart
sleeve        a circle across the axis
guide         a rectangle across the axis; in the plane a line
plate         a line along the normal
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import AXIS_ON, SIDE_ON
from jointplay.model.gaps import clearance_of

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism

#: corners of a circle, and circles of latitude of a sphere
AROUND, ACROSS = 48, 9
#: how much thicker than nothing a line is drawn, as a share of its length
THIN = 0.04


@dataclass(frozen=True)
class DrawnClearance:
    """A clearance.

    Attributes
    ----------
    source : int
        Its index among the sources.
    middle : ndarray
        Place of the joint on its first body, file units.
    points : ndarray
        Of its boundary, from there, metres, ground axes; shape (point, 3).
    """

    source: int
    middle: Floats
    points: Floats


def shapes(m: Mechanism, at: Floats, places: Floats) -> Iterator[DrawnClearance]:
    """The clearances of all joints that have some; poses and places as a `Scene` has them."""
    spec = m.core_spec
    for k, source in enumerate(spec["sources"]):
        if source["kind"] != "clearance":
            continue
        joint = spec["joints"][source["joint"]]
        turn = poses.matrix(at[spec["points"][joint["first"]]["body"]])
        axis = turn @ np.array(joint[AXIS_ON["first"]])
        if m.pose_size == poses.SPATIAL:
            side = turn @ np.array(joint[SIDE_ON["first"]])
        else:
            side = np.array([-axis[1], axis[0], 0.0])
        name, sizes = clearance_of(m, k)
        points = boundary(name, sizes, np.array([axis, side, np.cross(axis, side)]))
        if len(points) and np.abs(points).max() > 0.0:
            yield DrawnClearance(k, places[joint["first"]], points)


def boundary(name: str, size: dict[str, float], frame: Floats) -> Floats:
    """Points of the boundary of a set of offsets; none of one that moves no point.

    Parameters
    ----------
    name : str
        Of the set, as the core has it.
    size : dict
        Its sizes, metres.
    frame : ndarray
        Axis, side and normal of the joint in its rows.
    """
    turns = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    round_ = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    axis, side, normal = frame
    if name == "disc":
        return np.column_stack([size["radius"] * round_, np.zeros(AROUND)])
    if name == "ball":
        heights = np.linspace(-0.5 * np.pi, 0.5 * np.pi, ACROSS)[:, None]
        points = [np.cos(heights) * round_[:, 0], np.cos(heights) * round_[:, 1], np.sin(heights) + 0.0 * turns]
        return np.asarray(size["radius"] * np.stack(points, axis=-1).reshape(-1, 3))
    if name in ("journal", "sleeve"):
        ends = size.get("axial", 0.0) * np.array([[-1.0], [1.0]])
        circle = size["radius"] * round_ @ np.stack([side, normal])
        return np.asarray((circle[None] + (ends * axis)[:, None]).reshape(-1, 3))
    if name == "guide":
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return np.asarray(size["gap"] * corners @ np.stack([side, normal]))
    if name in ("diamond", "plate"):
        across, thin = (side, axis) if name == "diamond" else (axis, side)
        corners = np.array([[-1.0, -THIN], [1.0, -THIN], [1.0, THIN], [-1.0, THIN]])
        return np.asarray(size["gap"] * corners @ np.stack([across, thin]))
    return np.zeros((0, 3))
