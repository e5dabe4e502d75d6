"""What a gesture changes of a file, one edit after the other, and what it took hold of.

New parts are drawn assembled (``bodies`` and ``at``), and where bodies of the file have axes of their own that are
turned at the poses that are shown, each gets the place in its own axes (``on``).
"""

import copy
import math
from collections.abc import Mapping
from typing import Any

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema import NotAnExpression
from jointplay.file.schema.keys import Steps, assign
from jointplay.file.schema.values import is_number
from jointplay.model.patterns import written_out

from .board import (
    DRAWN,
    GROUND,
    XY,
    BodyPose,
    Json,
    bodies_of,
    free_of,
    numbers,
    place_on,
    placed_at,
    seen_from,
    variables_in,
)

#: decimals of a coordinate; what is behind them is rounding
DECIMALS = 9

#: sections that speak of the coordinate of a joint, and in which keys
COORDINATES: Mapping[str, tuple[str, ...]] = {
    "drives": ("joint",),
    "springs": ("joint",),
    "followers": ("joint", "follows"),
}

#: tables of ranges and limits whose keys are joints, and those whose keys are drives
RANGES: Mapping[str, tuple[Steps, ...]] = {
    "joints": (("limits", "joints"), ("limits", "reactions"), ("design", "transmission")),
    "drives": (("limits", "drives"), ("limits", "drive_torques"), ("grid",)),
}

Edit = tuple[Steps, Any]


def found_at(raw: Any, steps: Steps) -> Any:
    """What a file has at a place; None where it has nothing."""
    for step in steps:
        if isinstance(raw, Mapping):
            raw = raw.get(step)
        elif isinstance(raw, list) and isinstance(step, int) and step < len(raw):
            raw = raw[step]
        else:
            return None
    return raw


def table_at(raw: Any, *steps: str | int) -> Mapping[str, Any]:
    """The table of a file at a place; an empty one where there is none."""
    found = found_at(raw, steps)
    return found if isinstance(found, Mapping) else {}


def with_tables(raw: Any, steps: Steps) -> Steps:
    """The place of a value, or of the largest table or list that has nothing else in it."""
    while len(steps) > 1 and isinstance(above := found_at(raw, steps[:-1]), Mapping | list) and len(above) == 1:
        steps = steps[:-1]
    return steps


def is_of(value: object, joint: str) -> bool:
    """Whether a name is that of a joint, or of one of several on its pin."""
    return isinstance(value, str) and (value == joint or value.startswith(f"{joint}/"))


def tidy(value: float) -> int | float:
    """A number without what rounding has left, whole where it is."""
    found = round(value, DECIMALS) + 0.0
    return int(found) if found == int(found) and abs(found) < 1e15 else found


class Hand:
    """What a gesture changes, one edit after the other.

    Parameters
    ----------
    raw : mapping
        Tables of the file.
    poses : mapping
        Of the bodies as they are shown.
    """

    def __init__(self, raw: Mapping[str, Any], poses: Mapping[str, BodyPose]) -> None:
        self.raw: dict[str, Any] = copy.deepcopy(dict(raw))
        self.poses = poses
        self.edits: list[Edit] = []
        self.notes: list[str] = []
        self.variables = variables_in(raw)

    def put(self, steps: Steps, value: Any) -> None:
        """Set a value, or take it away."""
        self.edits.append((steps, value))
        parent: Any = self.raw
        for step in steps[:-1]:
            parent = parent.setdefault(step, {}) if isinstance(parent, dict) else parent[step]
        if isinstance(parent, list) and steps[-1] == len(parent):
            parent.append(copy.deepcopy(value))
        else:
            assign(self.raw, steps, copy.deepcopy(value))

    def take(self, steps: Steps) -> None:
        """Take a value away, and the tables that nothing else is in."""
        self.put(with_tables(self.raw, steps), None)

    @property
    def joints(self) -> dict[str, Any]:
        """The joints that the file itself has."""
        return dict(self.raw.get("joints", {}))

    def joint(self, name: object) -> dict[str, Any]:
        """A joint that the file itself has."""
        if name not in self.joints:
            raise InputError(not_known(str(name), "a joint of this file that can be drawn with", self.joints))
        return dict(self.joints[name])

    def pose(self, body: str) -> BodyPose:
        """How a body is shown."""
        return DRAWN if body == GROUND else self.poses.get(body, DRAWN)

    def is_drawn(self, body: str) -> bool:
        """Whether the axes of a body are those of the drawing."""
        return max(map(abs, self.pose(body))) < 1e-9

    def bodies(self) -> list[str]:
        """All bodies but the ground."""
        every = [body for table in self.joints.values() for body in bodies_of(table)]
        return [body for body in dict.fromkeys((*every, *free_of(self.raw))) if body != GROUND]

    def require_own(self, body: str) -> None:
        """Refuse to take away, or to call otherwise, a body that copies of a pattern have."""
        try:
            every = written_out(self.raw, "").data.get("joints", {})
        except InputError:
            return
        if any(body in bodies_of(table) for name, table in every.items() if name not in self.joints):
            raise InputError(f"'{body}' is in a pattern; change it in the text")

    def new(self, stem: str, taken: Any) -> str:
        """A name that nothing has."""
        number = 1
        while f"{stem}{number}" in taken:
            number += 1
        return f"{stem}{number}"

    def local(self, body: str, place: XY) -> list[int | float]:
        """A place of the drawing in the axes of a body."""
        return [tidy(v) for v in seen_from(self.pose(body), place)]

    def place_of(self, name: str) -> XY:
        """Where a joint is in the drawing."""
        table = self.joint(name)
        first = bodies_of(table)[0]
        found = numbers(place_on(table, first), self.variables)
        if found is None:
            raise InputError("its place is not known here; change it in the text", key=f"joints.{name}")
        return placed_at(self.pose(first), found)

    def where(self, ref: Mapping[str, Any]) -> XY:
        """The place of what a page took hold of."""
        if "joint" in ref:
            return self.place_of(str(ref["joint"]))
        if "index" in ref:
            points = free_of(self.raw).get(str(ref["body"]), [])
            if not 0 <= int(ref["index"]) < len(points):
                raise InputError("this point is not there any more")
            return placed_at(self.pose(str(ref["body"])), points[int(ref["index"])])
        return point_of(ref.get("at"))

    def pin(self, bodies: list[str], place: XY, kind: str = "revolute", **more: Any) -> str:
        """A new joint between bodies at a place; gives its name."""
        name = self.new("J", self.joints)
        if all(map(self.is_drawn, bodies)):
            where: Json = {"bodies": bodies, "at": [tidy(v) for v in place], **more}
        else:
            # The axis of a guide is that of its first body.
            on: Json = {body: self.local(body, place) for body in bodies}
            if "axis" in more:
                angle = math.atan2(more["axis"][1], more["axis"][0]) - self.pose(bodies[0])[2]
                on[bodies[0]] = {"at": on[bodies[0]], "axis": [tidy(math.cos(angle)), tidy(math.sin(angle))]}
            where = {"on": on}
        self.put(("joints", name), {"type": kind, **where})
        return name

    def join(self, name: str, body: str, *, first: bool = False) -> None:
        """Put one more body on a pin."""
        table = self.joint(name)
        if table.get("type") != "revolute":
            raise InputError(f"'{name}' is no pin, and has its two bodies already; draw beside it")
        bodies = bodies_of(table)
        if body in bodies:
            raise InputError(f"'{name}' is on '{body}' already")
        if len(bodies) == 2:
            # What speaks of a pin of two bodies speaks of one of several now.
            if first and self.named(name):
                raise InputError(f"'{name}' is driven or sprung between its two bodies; delete that first")
            self.rename(name, f"{name}/{bodies[1]}")
        if "on" in table:
            own = self.local(body, self.place_of(name))
            on = {body: own, **table["on"]} if first else {**table["on"], body: own}
            if first:
                # Taken away first, so that the order is that of the pin.
                self.put(("joints", name, "on"), None)
            self.put(("joints", name, "on"), on)
        else:
            self.require_drawn(name)
            bodies = [str(one) for one in table["bodies"]]
            self.put(("joints", name, "bodies"), [body, *bodies] if first else [*bodies, body])

    def named(self, joint: str) -> list[tuple[Steps, str]]:
        """Where the file speaks of the coordinate of a joint, and as what."""
        found: list[tuple[Steps, str]] = []
        for section, keys in COORDINATES.items():
            for name, own in self.raw.get(section, {}).items():
                if isinstance(own, Mapping):
                    found += [((section, name, key), own[key]) for key in keys if is_of(own.get(key), joint)]
        return found

    def rename(self, old: str, new: str) -> None:
        """Another name of a joint that has become one of several on a pin, or is alone on it again."""
        for steps, value in self.named(old):
            if value == old:
                self.put(steps, new)
        for steps in [*RANGES["joints"], *(("drives", name, "joints") for name in self.raw.get("drives", {}))]:
            if old in (here := table_at(self.raw, *steps)):
                self.put(steps, {new if key == old else key: value for key, value in here.items()})

    def require_drawn(self, name: str) -> None:
        """Refuse to change the place of a joint that is drawn assembled where its bodies are elsewhere."""
        if not all(map(self.is_drawn, bodies_of(self.joint(name)))):
            raise InputError(f"'{name}' is drawn assembled: show the mechanism as it is drawn first (Home)")

    def held(self, ref: Mapping[str, Any]) -> str:
        """The body that carries a point that is no joint."""
        if "body" not in ref:
            raise InputError("there is no body at this place; take a joint, the end of a bar, or a bar")
        return str(ref["body"])

    def used(self, ref: Mapping[str, Any]) -> None:
        """Take the point of a bar away that has become a joint."""
        if "index" in ref:
            self.free(str(ref["body"]), [p for k, p in enumerate(self.points(ref)) if k != int(ref["index"])])

    def points(self, ref: Mapping[str, Any]) -> list[XY]:
        """The points of a body that no joint is at."""
        return free_of(self.raw).get(str(ref["body"]), [])

    def free(self, body: str, points: list[XY]) -> None:
        """Say which points of a body no joint is at."""
        others = {name: own for name, own in free_of(self.raw).items() if name != body}
        if points:
            self.put(("board", "free", body), [[tidy(v) for v in point] for point in points])
        elif others and body in free_of(self.raw):
            self.put(("board", "free", body), None)
        elif not others:
            self.drop("free")

    def lock(self, names: list[str]) -> None:
        """Say which joints stay where they are."""
        if names:
            self.put(("board", "locked"), names)
        else:
            self.drop("locked")

    def drop(self, key: str) -> None:
        """Take something away that the board keeps; its table goes with the last."""
        board = self.raw.get("board", {})
        if key in board:
            self.put(("board", key) if len(board) > 1 else ("board",), None)

    def at(self, ref: Mapping[str, Any], body: str) -> str:
        """A pin at what a page took hold of, with one more body; gives its name."""
        place = self.where(ref)
        if "joint" in ref:
            self.join(str(ref["joint"]), body)
            return str(ref["joint"])
        name = self.pin([self.held(ref), body], place)
        self.used(ref)
        return name


def point_of(value: Any) -> XY:
    """A place that a page sends."""
    found = numbers(value)
    if found is None or not all(abs(v) <= 1e9 for v in found):
        raise InputError(f"{shown(value)} is not a place [x, y]")
    return found


def number_of(value: Any, what: str) -> float:
    """A number that a page sends."""
    if not is_number(value) or not abs(value) <= 1e12:
        raise InputError(f"{shown(value)} is not {what}")
    return float(value)


def number_in(hand: Hand, value: Any, what: str = "a number") -> float:
    """A number that a page sends, or the value of an expression."""
    if isinstance(value, str) and hand.variables is not None:
        try:
            return hand.variables.number(value)
        except NotAnExpression as problem:
            raise InputError(str(problem)) from None
    return number_of(value, what)
