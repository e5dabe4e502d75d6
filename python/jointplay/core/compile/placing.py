"""The axes of a joint on two of its bodies, from what the file says and from what it leaves out."""

import math
from collections.abc import Callable

from jointplay.basics.units import Units
from jointplay.errors import InputError
from jointplay.file.schema import JointTable, Mesh, PlacementKeys, SpatialJoint, SpatialPlacementTable

from .frames import AxisAndSide, Vector3, X, across, default_side, unit

#: makes the error for a key of the joint
Refuse = Callable[[str, str], InputError]


def frames(joint: JointTable, first: str, second: str, units: Units, refuse: Refuse) -> tuple[AxisAndSide, AxisAndSide]:
    """Axis and side of a joint on two of its bodies, each in body axes.

    A guide's axis has the same numbers on both bodies; a mounting angle is that of the second body's x axis. In the
    plane only the rack of a gearing has an axis; directions on wheels are those of the body's axes.
    """
    on_first, on_second = joint.placements[first], joint.placements[second]
    locked = joint.kind == "fixed" and not joint.is_drawn_assembled
    if not isinstance(joint, SpatialJoint):
        angle = _angle(on_first, 0.0, units)
        alone = locked or isinstance(joint, Mesh)
        return _planar(angle), _planar(_angle(on_second, 0.0 if alone else angle, units))
    frame = _spatial(on_first, X, f"on.{first}.side" if joint.on else "side", refuse)
    assert isinstance(on_second, SpatialPlacementTable)
    if on_second.axis is None and on_second.side is None and not locked:
        return frame, frame
    return frame, _spatial(on_second, X if locked else frame[0], f"on.{second}.side" if joint.on else "side", refuse)


def _angle(place: PlacementKeys, default: float, units: Units) -> float:
    match place.axis:
        case None:
            return default
        case (ux, uy):
            return math.atan2(uy, ux)
        case angle:
            assert isinstance(angle, float)
            return angle * units.angle


def _planar(angle: float) -> AxisAndSide:
    c, s = math.cos(angle), math.sin(angle)
    return (c, s, 0.0), (-s, c, 0.0)


def _spatial(place: PlacementKeys, default: Vector3, key: str, refuse: Refuse) -> AxisAndSide:
    assert isinstance(place, SpatialPlacementTable)
    axis = default if place.axis is None else unit(place.axis)
    if place.side is None:
        return axis, default_side(axis)
    side = across(place.side, axis)
    if side is None:
        raise refuse("lies along the axis; a side is across it", key)
    return axis, side
