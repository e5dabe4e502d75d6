"""Where joints and drives are, and which of them leaves its range in the file."""

from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Flags, Floats, Texts
from jointplay.core.compile import ANGULAR, DRIVABLE
from jointplay.model.mechanism import Mechanism
from jointplay.result import SIDES

TURN = 2.0 * np.pi


def coordinates(m: Mechanism, drives: Floats, placed: Floats) -> tuple[Floats, Flags]:
    """The coordinate of every joint, SI, (configuration, joint), nan for joints that have none; and which are angles.

    In space an angle is continued from one configuration to the next, and a driven one is that of its drive.
    """
    values, angular = _raw(m, placed)
    if m.pose_size == poses.SPATIAL:
        for k in np.flatnonzero(angular).tolist():
            known = np.isfinite(values[:, k])
            if m.joint_kinds[k] != "screw":
                # What a screw has gone says how often it has turned.
                values[known, k] = np.unwrap(values[known, k])
        for k, near in _driven(m, drives):
            if angular[k]:
                values[:, k] += TURN * np.round((near - values[:, k]) / TURN)
    return values, angular


def leaving(m: Mechanism, drives: Floats, placed: Floats, *, path: bool) -> Texts:
    """The drive or joint that leaves its range, by its name, for every configuration; empty where none does.

    Parameters
    ----------
    path : bool
        Whether the configurations follow one another. Where they do not, an angle in space counts by the turn that is
        nearest to its range.
    """
    ends, room = rooms(m, drives, placed, path=path)
    found = np.array(["", *(end.name for end in ends)])
    beyond = room < 0.0
    return found[np.where(beyond.any(axis=1), beyond.argmax(axis=1) + 1, 0)]


@dataclass(frozen=True)
class RangeEnd:
    """An end of the range of a drive or a joint."""

    #: ``drives`` or ``joints``, as in the file
    kind: str
    name: str
    #: ``low`` or ``high``
    side: str

    def __str__(self) -> str:
        return f"{self.kind}.{self.name}.{self.side}"


def rooms(m: Mechanism, drives: Floats, placed: Floats, *, path: bool) -> tuple[list[RangeEnd], Floats]:
    """How far drives and joints are from the ends of their ranges, SI, (configuration, end); negative beyond them.

    What is beyond an end by rounding only is at it. `path` is that of `leaving`.
    """
    values, angular = coordinates(m, drives, placed)
    if not path and m.pose_size == poses.SPATIAL:
        driven = {k for k, _ in _driven(m, drives)}
        for name, (low, high) in m.limits.joints.items():
            k = m.joints.index(name)
            if angular[k] and k not in driven and m.joint_kinds[k] != "screw":
                values[:, k] += TURN * np.round((0.5 * (low + high) - values[:, k]) / TURN)
    ranges = [("drives", name, drives[:, m.drives.index(name)], span) for name, span in m.limits.drives.items()]
    ranges += [("joints", name, values[:, m.joints.index(name)], span) for name, span in m.limits.joints.items()]
    ends, found = [], np.empty((len(drives), 2 * len(ranges)))
    for k, (kind, name, value, (low, high)) in enumerate(ranges):
        slack = 1e-9 * max(abs(low), abs(high), m.length)
        ends += [RangeEnd(kind, name, side) for side in SIDES]
        found[:, 2 * k], found[:, 2 * k + 1] = value - low + slack, high + slack - value
    return ends, found


def _raw(m: Mechanism, placed: Floats) -> tuple[Floats, Flags]:
    values = np.stack([m.coordinate(k, placed) for k in range(len(m.joints))], axis=-1)
    return values, np.array([kind in ANGULAR or kind not in DRIVABLE for kind in m.joint_kinds])


def _driven(m: Mechanism, drives: Floats) -> list[tuple[int, Floats]]:
    """Every driven joint, and the coordinate that its drive commands."""
    return [(k, coefficient * drives[:, d]) for d, moves in enumerate(m.drive_moves) for k, coefficient in moves]
