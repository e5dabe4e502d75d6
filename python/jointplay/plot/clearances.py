"""What clearances allow without tilting, as points around the place of their joint.

Something round is in a circle or a sphere, and a pin with shoulders in two circles, the axial play apart; what is
between faces is in a rectangle, or a line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.sets import SETS, SHIFTS_ACROSS, SINGLE
from jointplay.model.gaps import clearance_of

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism

#: corners of a circle, and circles of latitude of a sphere
AROUND, ACROSS = 48, 9
#: how much thicker than nothing a line is drawn, as a share of its length
THIN = 0.04
TURNS, HEIGHTS = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False), np.linspace(-0.5 * np.pi, 0.5 * np.pi, ACROSS)
CIRCLE = np.stack([np.cos(TURNS), np.sin(TURNS)], axis=-1)
#: points of the boundary of what is round, with a radius of one, by its dimensions
EDGES = {
    1: np.array([[-1.0], [1.0]]),
    2: CIRCLE,
    3: np.concatenate([np.insert(np.cos(h) * CIRCLE, 2, np.sin(h), axis=1) for h in HEIGHTS]),
}


@dataclass(frozen=True)
class DrawnClearance:
    """A clearance."""

    #: its index among the sources
    source: int
    #: place of the joint on its first body, file units
    middle: Floats
    #: of its boundary, from there, metres, ground axes; shape (point, 3)
    points: Floats


def shapes(m: Mechanism, at: Floats, places: Floats) -> Iterator[DrawnClearance]:
    """The clearances of all joints that have some; poses and places as a `Scene` has them."""
    for k, source in enumerate(m.compiled_sources):
        if source.kind == "clearance":
            seen = m.relative(source.spec["joint"], at)
            ways = dict(zip(("along", *SHIFTS_ACROSS), seen.directions @ seen.axes.T, strict=True))
            points = _boundary(*clearance_of(m, k), ways | dict(zip("xyz", np.eye(3), strict=True)))
            if np.abs(points).max(initial=0.0) > 0.0:
                yield DrawnClearance(k, places[m.joint_points[source.spec["joint"]][0]], points)


def _boundary(name: str, size: dict[str, float], ways: dict[str, Floats]) -> Floats:
    """Points of the boundary of a set, from the directions in which components shift; none of one number."""
    kind, points = SETS[name], np.zeros((1, 3))
    for one in () if kind is SINGLE else kind.conditions(size):
        bounded = [kind.components[k] for k in np.flatnonzero(one.rows.any(axis=0))]
        # The other end of a pin, which does not tilt here, is where the first is.
        if own := [ways.pop(component) for component in bounded if component in ways]:
            points = (points[:, None] + one.high * EDGES[len(own)] @ np.array(own)).reshape(-1, 3)
    if len(points) == 2:
        # A line, which is a little wider than nothing.
        across = size["gap"] * THIN * ways.get("along", ways["side"])
        points = np.concatenate([points - across, points + across])
    return points
