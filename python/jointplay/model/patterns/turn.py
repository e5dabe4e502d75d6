"""A part of a mechanism turned about an axis: x' = c + A (x - c), with A = exp(angle [u]).

What is given in the axes of the ground, of a shared body, or of a body that is drawn assembled turns with the copy;
a body with axes of its own stays as it is, and its start turns instead. A coordinate that counts from a turned body to
one with axes of its own, or back, has the angle added; in space angles count from sides, which turn as well. What a
joint leaves out and would take from its neighbour, or from the axes of the body, is written out before it is turned.
"""

import math
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from jointplay.basics import poses
from jointplay.core.compile.frames import X, default_side, unit
from jointplay.file.schema import DH, CrossedGear, JointTable, LinkTable, Mesh, SpatialJoint, Universal, Zone

Data = dict[str, Any]
#: multiples of half a cosine are met exactly, so that quarters and sixths of a turn leave no rounding behind
ROUNDED = 1e-15
#: kinds of joint in the plane whose second body takes the axis of the first
GUIDES = ("prismatic",)
#: kinds of joint, in the plane and in space, that leave open how a body is turned when they place it
OPEN = {True: ("revolute", "pin_in_slot"), False: ("spherical",)}


@dataclass(frozen=True)
class Turn:
    """The turn of one copy: its angle in units of the file, and its matrix about a point."""

    angle: float
    unit: float
    centre: tuple[float, ...]
    axis: tuple[float, float, float]

    @property
    def is_planar(self) -> bool:
        """Whether it is in the plane."""
        return len(self.centre) == 2

    @cached_property
    def _matrix(self) -> list[list[float]]:
        angle = self.angle * self.unit
        c, s = _tidy(math.cos(angle)), _tidy(math.sin(angle))
        if self.is_planar:
            return [[c, -s], [s, c]]
        x, y, z = unit(self.axis)
        return [
            [c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)],
        ]

    def direction(self, of: Sequence[float]) -> list[float]:
        """A free vector, turned."""
        return [sum(a * x for a, x in zip(row, of, strict=True)) for row in self._matrix]

    def point(self, at: Sequence[float]) -> list[float]:
        """A point, turned about the centre."""
        turned = self.direction([x - c for x, c in zip(at, self.centre, strict=True)])
        return [c + x for c, x in zip(self.centre, turned, strict=True)]

    def along(self, axis: float | Sequence[float]) -> float | list[float]:
        """A direction, turned; in the plane it may be an angle."""
        return axis + self.angle if isinstance(axis, int | float) else self.direction(axis)

    @property
    def vector(self) -> list[float]:
        """Its rotation vector in units of the file."""
        return [self.angle * u for u in unit(self.axis)]

    def after(self, rotation: Sequence[float]) -> list[float]:
        """Rotation vector of a rotation followed by the turn, units of the file."""
        turn, first = (poses.quaternion([self.unit * v for v in of]) for of in (self.vector, rotation))
        return [float(v) / self.unit for v in poses.rotation_vector(poses.product(turn, first))]


def _tidy(value: float) -> float:
    near = round(2.0 * value) / 2.0
    return near if abs(value - near) < ROUNDED else value


def turned_joint(data: Data, joint: JointTable, turning: Set[str], turn: Turn, refuse: Any) -> Data:
    """A joint of the copy.

    Parameters
    ----------
    data : dict
        The joint with numbers for its expressions.
    joint : JointTable
        The same, checked.
    turning : set of str
        Bodies whose axes do not turn with the copy, so that what is on them does.
    refuse : callable
        Makes the error for its position.
    """
    if not turning & set(joint.names):
        return data
    new = dict(data)
    if joint.position:
        new["position"] = {
            body: _off(data["position"][body], zone, turn, refuse) if body in turning else data["position"][body]
            for body, zone in joint.position.items()
        }
    if joint.on is None:
        new |= _drawn(joint, turn)
    else:
        new["on"] = {body: _placed(joint, body, body in turning, turn) for body in joint.names}
    if isinstance(joint, Mesh):
        if joint.directions is not None:
            new["marks"] = {
                body: turn.along(mark) if body in turning else mark for body, mark in joint.directions.items()
            }
        if turn.is_planar and joint.runout:
            new["runout"] = {body: _eccentric(data["runout"][body], body in turning, turn) for body in joint.runout}
    return new


def check_link(link: LinkTable, refuse: Any) -> None:
    """Refuse a link that deviates along axes of a body, which do not turn; those between two axes turn with them."""
    along = [word for word in link.by_component if word not in (*DH, "angle")]
    if along:
        raise refuse(
            f"{', '.join(along)}: axes of this body do not turn with the copies; describe the body in axes of its own"
        )


def _off(data: Data, zone: Zone, turn: Turn, refuse: Any) -> Data:
    """The position of a joint on a body whose axes do not turn; direction and cylinder are in the axes of the joint."""
    if zone.by_component:
        problem = (
            f"{', '.join(zone.by_component)}: axes of this body do not turn with the copies; give a zone (diameter), or"
            " describe the body in axes of its own"
        )
        raise refuse(problem)
    if "deviation" in data and (turn.is_planar or getattr(zone, "spherical", False)):
        return {**data, "deviation": turn.direction(data["deviation"])}
    return data


def _eccentric(runout: Any, turns: bool, turn: Turn) -> Any:
    if not (turns and isinstance(runout, Mapping) and "deviation" in runout):
        return runout
    return {**runout, "deviation": turn.direction(runout["deviation"])}


def _drawn(joint: JointTable, turn: Turn) -> Data:
    at: Any = joint.at
    new: Data = {"at": [turn.point(p) for p in at] if isinstance(joint, Mesh) else turn.point(at)}
    if isinstance(joint, Universal | CrossedGear):
        return new | {"axes": [turn.direction(axis) for axis in joint.axes or ()]}
    axis, side = _frame(joint, joint.names[0])
    return new | _axes(axis, side, True, turn)


def _placed(joint: JointTable, body: str, turns: bool, turn: Turn) -> Data:
    at = joint.placements[body].at
    axis, side = _frame(joint, body)
    return {"at": turn.point(at) if turns else list(at)} | _axes(axis, side, turns, turn)


def _axes(axis: Any, side: Any, turns: bool, turn: Turn) -> Data:
    given = {key: value for key, value in (("axis", axis), ("side", side)) if value is not None}
    return {key: turn.along(value) if turns else value for key, value in given.items()}


def _frame(joint: JointTable, body: str) -> tuple[Any, Any]:
    """Axis and side of a joint on a body with what the file leaves out; None where it has none."""
    first, here = joint.placements[joint.names[0]], joint.placements[body]
    is_first, locked = body == joint.names[0], joint.kind == "fixed"
    if not isinstance(joint, SpatialJoint):
        default: Any = 0.0 if locked else first.axis if joint.kind in GUIDES else None
        return default if here.axis is None else here.axis, None
    if not joint.has_axis:
        return None, None
    side: Any = getattr(here, "side", None)
    if not is_first and here.axis is None and side is None and not (locked and joint.on is not None):
        return _frame(joint, joint.names[0])
    axis: Any = here.axis or (None if locked else first.axis) or X
    return list(axis), list(side or default_side(unit(axis)))


def turned_start(data: Mapping[str, Any], drawn: bool, turn: Turn, refuse: Any) -> Data:
    """The start of a body of the copy; of one that is drawn assembled the axes stay those of the ground.

    Raises
    ------
    InputError
        When a position is given in part.
    """
    words = ("x", "y") if turn.is_planar else ("x", "y", "z")
    given = [word for word in words if word in data]
    if given and len(given) < len(words):
        missing = ", ".join(word for word in words if word not in data)
        raise refuse(f"a position that is turned is given as a whole; missing: {missing}")
    new = dict(data)
    key = "angle" if turn.is_planar else "rotation"
    rotation = data.get(key)
    if given:
        at = [data[word] for word in words]
        if drawn:
            # The body is turned back, moved as it was, and turned on: its own axes stay as drawn.
            back = Turn(-turn.angle, turn.unit, turn.centre, turn.axis).point([0.0] * len(words))
            if turn.is_planar:
                own = Turn(rotation or 0.0, turn.unit, (0.0, 0.0), turn.axis)
                moved = own.point(back)
            else:
                matrix = poses.turned_by([turn.unit * v for v in rotation or (0.0, 0.0, 0.0)])
                moved = [float(v) for v in matrix @ back]
            at = [a + m for a, m in zip(at, moved, strict=True)]
        new |= dict(zip(words, turn.point(at), strict=True))
    if rotation is not None:
        if turn.is_planar:
            new[key] = rotation if drawn else rotation + turn.angle
        else:
            new[key] = turn.direction(rotation) if drawn else turn.after(rotation)
    return new


def open_start(joints: Sequence[JointTable], turn: Turn) -> Data:
    """The start of a body with axes of its own of which the file says nothing: the turn, where no joint aligns it."""
    if any(joint.kind not in OPEN[turn.is_planar] for joint in joints if joint.places):
        return {}
    return {"angle": turn.angle} if turn.is_planar else {"rotation": turn.vector}


def turned_load(data: Data, place_turns: bool, force_turns: bool, turn: Turn) -> Data:
    """A load of the copy; its point and its force are each in axes that turn with the copy, or do not."""
    new = dict(data)
    if place_turns and isinstance(data.get("at"), list):
        new["at"] = turn.point(data["at"])
    for key in ("force", "moment") if force_turns else ():
        of = data.get(key)
        if isinstance(of, list) and not (turn.is_planar and key == "moment"):
            # One for each configuration, or one for all.
            new[key] = [turn.direction(one) for one in of] if isinstance(of[0], list) else turn.direction(of)
    return new


def turned_spring(data: Data, is_own: Callable[[str], bool], shift: float, turn: Turn) -> Data:
    """A spring of the copy, whose ends turn on bodies that do not; the shift is that of a torsion spring's joint."""
    new = dict(data)
    if "on" in data:
        new["on"] = {
            body: turn.point(at) if isinstance(at, list) and not is_own(body) else at for body, at in data["on"].items()
        }
    if shift:
        new["free_angle"] = data.get("free_angle", 0.0) + shift
    return new


def turned_body(data: Data, turn: Turn, refuse: Any) -> Data:
    """A body of the copy that is described in axes that do not turn.

    Raises
    ------
    InputError
        When the direction of its section follows from axes that do not turn.
    """
    new = dict(data)
    if "centre" in data:
        new["centre"] = turn.point(data["centre"])
    if "outline" in data:
        new["outline"] = [[turn.point(corner) for corner in line] for line in data["outline"]]
    if "side" in data:
        new["side"] = turn.direction(data["side"])
    elif isinstance(data.get("inertia"), list) and len(set(data["inertia"])) > 1:
        raise refuse("'side' is missing (the direction to which two inertias refer, which turns with the copy)")
    return new


def turned_follower(data: Data, leading: float, following: float) -> Data:
    """A follower of the copy, whose leading and following coordinates have angles added."""
    new = dict(data)
    if "polynomial" in data:
        first, *rest = data["polynomial"]
        new["polynomial"] = [first + following, *rest]
        if leading:
            new["origin"] = data.get("origin", 0.0) + leading
        return new
    return new | {"at": turned_angle(data["at"], leading), "values": turned_angle(data["values"], following)}


def turned_angle(values: Any, shift: float) -> Any:
    """A coordinate, or a list of them, with the angle added."""
    return [value + shift for value in values] if isinstance(values, list) else values + shift
