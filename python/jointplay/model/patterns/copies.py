"""The entries of one copy of a pattern, as a file without patterns has them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from jointplay.file.schema import PatternTable
from jointplay.file.schema.values import as_data

from .names import GROUND, OF_BODY, PatternNames
from .turn import (
    Data,
    Turn,
    check_link,
    open_start,
    turned_angle,
    turned_body,
    turned_follower,
    turned_joint,
    turned_load,
    turned_spring,
    turned_start,
)


@dataclass(frozen=True)
class CopiedEntry:
    """What a copy puts into a section of the file: name (none in a list), value, and its key within the pattern."""

    section: tuple[str, ...]
    name: str
    value: Any
    written: str


@dataclass(frozen=True)
class Copy:
    """A copy of a pattern, with the names of the pattern."""

    #: counted from 1
    number: int
    #: checked, with the numbers of this copy
    table: PatternTable
    #: how it is turned; not at all if None
    turn: Turn | None

    @cached_property
    def data(self) -> Data:
        """The same as data, with numbers for its expressions."""
        data: Data = as_data(self.table)
        return data

    @cached_property
    def drawn(self) -> set[str]:
        """Bodies that are drawn assembled."""
        return {body for joint in self.table.joints.values() if joint.is_drawn_assembled for body in joint.names}

    @cached_property
    def turning(self) -> set[str]:
        """Bodies whose axes do not turn with the copy, so that what is on them does."""
        return {GROUND, *self.table.shared, *self.drawn}

    def shift(self, joint: str) -> float:
        """What is added to the coordinate of a joint: in the plane an angle counts from the axes of its bodies."""
        name, _, rider = joint.partition("/")
        if self.turn is None or not self.turn.is_planar or name not in self.table.joints:
            return 0.0
        entry = self.table.joints[name]
        if entry.coordinate != "angle":
            return 0.0
        first, second = entry.names[0], rider or entry.names[1]
        return self.turn.angle * ((first in self.turning) - (second in self.turning))


def entries(copy: Copy, names: PatternNames) -> Iterator[CopiedEntry]:
    """What one copy puts into the file."""
    data, turn = copy.data, copy.turn
    name_of = names.of(copy.number)
    for name, joint in data.get("joints", {}).items():
        turned = joint
        if turn is not None:
            refuse = names.refusing(f"joints.{name}.position")
            turned = turned_joint(joint, copy.table.joints[name], copy.turning, turn, refuse)
        yield CopiedEntry(("joints",), name_of.own(name), name_of.in_joint(turned, f"joints.{name}"), f"joints.{name}")
    for name, body in data.get("bodies", {}).items():
        key = f"bodies.{name}"
        if turn is not None and name in copy.turning:
            body = turned_body(body, turn, names.refusing(key))
        yield CopiedEntry(("bodies",), name_of.own(name), body, key)
    for name, start in _starts(copy, names).items():
        yield CopiedEntry(("start",), name_of.own(name), start, f"start.{name}")
    for name, drive in data.get("drives", {}).items():
        shift = _motor_shift(copy, name, names)
        turned = {**drive, **{key: turned_angle(drive[key], shift) for key in ("values", "from", "to") if key in drive}}
        yield CopiedEntry(("drives",), name_of.own(name), name_of.in_drive(turned, f"drives.{name}"), f"drives.{name}")
    for name, follower in data.get("followers", {}).items():
        key = f"followers.{name}"
        turned = turned_follower(follower, copy.shift(follower["follows"]), copy.shift(follower["joint"]))
        yield CopiedEntry(("followers",), name_of.own(name), name_of.in_follower(turned, key), key)
    for number, load in enumerate(data.get("loads", [])):
        if turn is not None:
            place = _is_own(load.get("body"), copy, names)
            axes = load.get("axes", GROUND)
            force = place if axes == OF_BODY else _is_own(axes, copy, names)
            load = turned_load(load, not place, not force, turn)
        yield CopiedEntry(("loads",), "", name_of.in_table(load, f"loads.{number}"), f"loads.{number}")
    for name, spring in data.get("springs", {}).items():
        key = f"springs.{name}"
        if turn is not None:
            shift = copy.shift(spring.get("joint", ""))
            spring = turned_spring(spring, lambda body: _is_own(body, copy, names), shift, turn)
        yield CopiedEntry(("springs",), name_of.own(name), name_of.in_spring(spring, key), key)
    for section in ("dimensions", "links"):
        for name, table in data.get(section, {}).items():
            key = f"{section}.{name}"
            if turn is not None and section == "links" and table["body"] in copy.turning:
                check_link(copy.table.links[name], names.refusing(key))
            yield CopiedEntry((section,), name_of.own(name), name_of.in_table(table, key), key)
    for kind in ("drives", "joints"):
        for name, limits in data.get("limits", {}).get(kind, {}).items():
            key = f"limits.{kind}.{name}"
            shift = _motor_shift(copy, name, names) if kind == "drives" else copy.shift(name)
            own = name_of.drive(name, key) if kind == "drives" else name_of.joint(name, key)
            yield CopiedEntry(("limits", kind), own, turned_angle(limits, shift), key)


def _is_own(body: str | None, copy: Copy, names: PatternNames) -> bool:
    """Whether a body turns with the copy, with all that is in its axes."""
    return body in names.bodies and body not in copy.turning


def _starts(copy: Copy, names: PatternNames) -> dict[str, Data]:
    """The starts of the bodies of a copy, with what its turn adds to what the file leaves open."""
    given: dict[str, Data] = copy.data.get("start", {})
    if copy.turn is None:
        return given
    turned = {
        name: turned_start(start, name in copy.drawn, copy.turn, names.refusing(f"start.{name}"))
        for name, start in given.items()
    }
    for body in names.bodies:
        if body not in copy.turning:
            joints = [joint for joint in copy.table.joints.values() if body in joint.names]
            turned[body] = {**open_start(joints, copy.turn), **turned.get(body, {})}
    return {name: start for name, start in turned.items() if start}


def _motor_shift(copy: Copy, name: str, names: PatternNames) -> float:
    """What is added to the values of a drive.

    Raises
    ------
    InputError
        When its joints would need different ones.
    """
    if name not in copy.table.drives:
        return 0.0
    shifts = {copy.shift(joint) / coefficient for joint, coefficient in copy.table.drives[name].moves.items()}
    if len(shifts) > 1:
        raise names.refusing(f"drives.{name}")(
            "a motor of several joints is not turned where some of their angles count from the axes of a body that is"
            " not; write the drives of the copies outside the pattern"
        )
    return shifts.pop()
