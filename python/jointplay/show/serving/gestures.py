"""What a person does on the board, as edits of the file: places of values in it, and what stands there then.

A bar is a body with two ends. An end that is at no joint stands in ``[board]``; with a pin it becomes one. New parts
are drawn assembled (``bodies`` and ``at``), and where bodies of the file have axes of their own that are turned at the
poses that are shown, each gets the place in its own axes (``on``).
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema.keys import Steps, assign
from jointplay.file.schema.values import NAME, is_number

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
)

#: what a drive turns through to both sides of where it is drawn, in degrees, and how many configurations it has
REACH, COUNT = 20.0, 9
#: the same of a drive that slides, as a part of the drawing
SLIDE = 0.1
#: decimals of a coordinate; what is behind them is rounding
DECIMALS = 9
#: size of a force that is put on a point, in units of the file
FORCE = 10.0

Edit = tuple[Steps, Any]


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
        found = numbers(place_on(table, first))
        if found is None:
            raise InputError("its place is an expression; change it in the text", key=f"joints.{name}")
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
        if body in bodies_of(table):
            raise InputError(f"'{name}' is on '{body}' already")
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
        if points:
            self.put(("board", "free", body), [[tidy(v) for v in point] for point in points])
        elif list(free_of(self.raw)) == [body]:
            self.put(("board",), None)
        elif body in free_of(self.raw):
            self.put(("board", "free", body), None)

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


def bar(hand: Hand, told: Json) -> None:
    """A bar between two places, each a joint, the end of a bar, a point of a body, or free."""
    ends = [dict(told["from"]), dict(told["to"])]
    places = [hand.where(end) for end in ends]
    if math.dist(*places) < 1e-9:
        raise InputError("both ends of the bar are at one place")
    name = hand.new("bar", hand.bodies())
    # The later point of a body first, so that the number of the other one stays.
    order = sorted(range(2), key=lambda k: -int(ends[k].get("index", -1)))
    for k in order:
        if "joint" in ends[k] or "body" in ends[k]:
            hand.at(ends[k], name)
    hand.free(
        name, [place for end, place in zip(ends, places, strict=True) if "joint" not in end and "body" not in end]
    )


def ground(hand: Hand, told: Json) -> None:
    """A pin to the ground."""
    ref = dict(told["at"])
    if "joint" in ref:
        return hand.join(str(ref["joint"]), GROUND, first=True)
    place = hand.where(ref)
    hand.pin([GROUND, hand.held(ref)], place)
    return hand.used(ref)


def point(hand: Hand, told: Json) -> None:
    """A further point of a body, for a pin, the output or a load."""
    ref = dict(told["at"])
    body = hand.held(ref)
    local = seen_from(hand.pose(body), hand.where(ref))
    hand.free(body, [*free_of(hand.raw).get(body, []), local])


def slider(hand: Hand, told: Json) -> None:
    """A block in a guide of the ground, with a pin to what is there."""
    ref = dict(told["at"])
    place = hand.where(ref)
    block = hand.new("slider", hand.bodies())
    hand.at(ref, block)
    hand.pin([GROUND, block], place, "prismatic", axis=_axis(told))


def slot(hand: Hand, told: Json) -> None:
    """A slot of the ground, in which a point of a body slides."""
    ref = dict(told["at"])
    place = hand.where(ref)
    hand.pin([GROUND, hand.held(ref)], place, "pin_in_slot", axis=_axis(told))
    hand.used(ref)


def _axis(told: Json) -> list[int | float]:
    angle = math.radians(number_of(told.get("angle", 0), "an angle"))
    return [tidy(math.cos(angle)), tidy(math.sin(angle))]


def drive(hand: Hand, told: Json) -> None:
    """A drive of a joint, to both sides of where it is shown."""
    name = str(told["joint"])
    table = hand.joint(name)
    kind, bodies = table.get("type"), bodies_of(table)
    if any(isinstance(own, Mapping) and own.get("joint") == name for own in hand.raw.get("drives", {}).values()):
        raise InputError(f"'{name}' has a drive already")
    if kind == "revolute":
        unit = 1.0 if hand.raw.get("units", {}).get("angle") == "rad" else 180.0 / math.pi
        here = (hand.pose(bodies[1])[2] - hand.pose(bodies[0])[2]) * unit
        reach = math.radians(REACH) * unit
    elif kind in ("prismatic", "pin_in_slot"):
        here, reach = 0.0, SLIDE * _extent(hand)
        if "on" in table:
            raise InputError(f"'{name}' has axes of its own bodies; write its drive in the text")
    else:
        raise InputError(f"'{name}' has no motion that can be driven")
    own = {"joint": name, "from": tidy(here - reach), "to": tidy(here + reach), "count": COUNT}
    hand.put(("drives", hand.new("drive", hand.raw.get("drives", {}))), own)


def _extent(hand: Hand) -> float:
    places = [hand.place_of(name) for name in hand.joints]
    size = max(max(p[k] for p in places) - min(p[k] for p in places) for k in range(2))
    return float(f"{size or 1.0:.1g}")


def output(hand: Hand, told: Json) -> None:
    """The point whose error is asked."""
    if hand.raw.get("outputs"):
        raise InputError("the file has several outputs; add one in the text")
    before = hand.raw.get("output", {})
    point = _point_on_body(hand, dict(told["at"]))
    hand.put(("output",), {**{key: one for key, one in before.items() if key not in ("body", "at")}, **point})


def load(hand: Hand, told: Json) -> None:
    """A force on a point, downwards where a page does not say more."""
    force = point_of(told.get("force", [0.0, -FORCE]))
    entry = {"force": [tidy(v) for v in force], **_point_on_body(hand, dict(told["at"]))}
    loads = hand.raw.get("loads", [])
    hand.put(("loads", len(loads)) if loads else ("loads",), entry if loads else [entry])


def _point_on_body(hand: Hand, ref: Json) -> Json:
    if "joint" in ref:
        bodies = [body for body in bodies_of(hand.joint(ref["joint"])) if body != GROUND]
        return {"body": bodies[-1], "at": str(ref["joint"])}
    body = hand.held(ref)
    return {"body": body, "at": hand.local(body, hand.where(ref))}


def move(hand: Hand, told: Json) -> None:
    """Another place of a joint or of a free point; all other points stay where they are shown."""
    ref, place = dict(told["at"]), point_of(told["to"])
    if "joint" not in ref:
        points = hand.points(ref)
        hand.where(ref)
        body = str(ref["body"])
        points[int(ref["index"])] = seen_from(hand.pose(body), place)
        return hand.free(body, points)
    name = str(ref["joint"])
    table = hand.joint(name)
    if "on" not in table:
        hand.require_drawn(name)
        _note_expressions(hand, name, table["at"])
        return hand.put(("joints", name, "at"), [tidy(v) for v in place])
    before = hand.place_of(name)
    for body, own in table["on"].items():
        at = own.get("at") if isinstance(own, Mapping) else own
        _note_expressions(hand, name, at)
        # Both points of a guide are moved alike, so that its coordinate stays what it is.
        own_place = numbers(at)
        here = before if own_place is None else placed_at(hand.pose(body), own_place)
        steps: Steps = ("joints", name, "on", body)
        local = hand.local(body, (here[0] + place[0] - before[0], here[1] + place[1] - before[1]))
        hand.put((*steps, "at") if isinstance(own, Mapping) else steps, local)
    return None


def _note_expressions(hand: Hand, name: str, place: Any) -> None:
    if numbers(place) is None:
        hand.notes.append(f"The place of '{name}' was an expression and is a number now.")


def length(hand: Hand, told: Json) -> None:
    """The distance between two joints: the second one moves along the line."""
    start, end = hand.place_of(str(told["from"])), hand.place_of(str(told["to"]))
    before, after = math.dist(start, end), number_of(told["value"], "a length")
    if not before or after <= 0.0:
        raise InputError(f"{shown(told['value'])} is not a length; it is greater than zero")
    to = [a + (b - a) * after / before for a, b in zip(start, end, strict=True)]
    move(hand, {"at": {"joint": told["to"]}, "to": to})


def delete(hand: Hand, told: Json) -> None:
    """Take a joint, a body, a free point, a drive, a load, the output or a limit away."""
    what = dict(told["what"])
    if "joint" in what:
        _without_joint(hand, str(what["joint"]), kept=bodies_of(hand.joint(what["joint"])))
    elif "index" in what:
        hand.where(what)
        hand.used(what)
    elif "body" in what:
        _without_body(hand, str(what["body"]))
    elif "drive" in what:
        _drop(hand, "drives", str(what["drive"]))
    elif "load" in what:
        _without_load(hand, int(what["load"]))
    elif "output" in what:
        hand.put(("output",), None)
    else:
        raise InputError("there is nothing that could be deleted")


def _without_joint(hand: Hand, name: str, kept: list[str]) -> None:
    """Take a joint away; bodies keep their end there if they have another point."""
    table, place = hand.joint(name), None
    with suppress(InputError):
        place = hand.place_of(name)
    bodies = [body for body in bodies_of(table) if body != GROUND and body in kept]
    hand.put(("joints", name), None)
    # In space, and where its place is an expression, no free end is left.
    for body in bodies:
        others = any(body in bodies_of(table) for table in hand.joints.values()) or body in free_of(hand.raw)
        if others and place is not None:
            own = numbers(place_on(table, body)) or seen_from(hand.pose(body), place)
            hand.free(body, [*free_of(hand.raw).get(body, []), own])
    _drop_where(hand, "drives", lambda own: own.get("joint") == name or name in own.get("joints", ()))
    _drop_where(hand, "springs", lambda own: own.get("joint") == name or name in own.get("on", {}).values())
    _drop_where(hand, "followers", lambda own: name in (own.get("joint"), own.get("follows")))
    _drop_where(hand, "dimensions", lambda own: name in own.get("between", ()))
    _without_range(hand, "joints", name)
    _at_places(hand, name, place)


def _without_range(hand: Hand, section: str, name: str) -> None:
    """The range of a joint or a drive goes with it."""
    if name in hand.raw.get("limits", {}).get(section, {}):
        hand.put(("limits", section, name), None)


def _at_places(hand: Hand, name: str, place: XY | None) -> None:
    """What was at a joint that goes stands at its place."""
    entries: list[tuple[Steps, Any]] = [(("output",), hand.raw.get("output"))]
    entries += [(("outputs", key), own) for key, own in hand.raw.get("outputs", {}).items()]
    entries += [(("loads", k), own) for k, own in enumerate(hand.raw.get("loads", ()))]
    entries += [(("load_cases", case, k), own) for case, loads in _cases(hand).items() for k, own in enumerate(loads)]
    for steps, own in entries:
        if isinstance(own, Mapping) and own.get("at") == name:
            if place is None:
                problem = (
                    f"{'.'.join(map(str, steps))} is at {name}, whose place is not known here; change it in the text"
                )
                raise InputError(problem)
            body = own.get("body", hand.raw.get("output", {}).get("body", GROUND))
            hand.put((*steps, "at"), hand.local(str(body), place))


def _cases(hand: Hand) -> dict[str, list[Mapping[str, Any]]]:
    """The loads of every load case that is written as a list of them."""
    return {name: own for name, own in hand.raw.get("load_cases", {}).items() if isinstance(own, list)}


def _without_body(hand: Hand, body: str) -> None:
    if body not in hand.bodies():
        raise InputError(not_known(body, "a body", hand.bodies()))
    for name, table in hand.joints.items():
        bodies = bodies_of(table)
        if body not in bodies:
            continue
        if len(bodies) > 2:
            steps: Steps = ("joints", name, "on", body) if "on" in table else ("joints", name, "bodies")
            hand.put(steps, None if "on" in table else [one for one in bodies if one != body])
        else:
            _without_joint(hand, name, kept=[one for one in bodies if one != body])
    hand.free(body, [])
    for section in ("start", "bodies", "links"):
        if body in hand.raw.get(section, {}):
            hand.put((section, body), None)
    _drop_where(hand, "dimensions", lambda own: own.get("body") == body)
    _drop_where(hand, "outputs", lambda own: own.get("body") == body)
    _drop_where(hand, "springs", lambda own: body in own.get("on", {}))
    for case, loads in _cases(hand).items():
        gone = [k for k, load in enumerate(loads) if load.get("body") == body]
        if len(gone) == len(loads) > 0:
            _drop(hand, "load_cases", case)
            hand.notes.append(f"The load case {case} had no other load and went with it.")
        else:
            for k in reversed(gone):
                hand.put(("load_cases", case, k), None)
    _without_step(hand, body)
    if isinstance(own := hand.raw.get("output"), Mapping) and own.get("body") == body:
        hand.put(("output",), None)
        hand.notes.append("The output was on it, too.")
    for k in reversed(range(len(hand.raw.get("loads", ())))):
        if hand.raw["loads"][k].get("body") == body:
            _without_load(hand, k)


def _without_step(hand: Hand, body: str) -> None:
    """A body that goes is not put in; an order of assembly without its base, or of nothing, is none."""
    order = hand.raw.get("assembly", {})
    steps = [[step] if isinstance(step, str) else step for step in order.get("steps", ())]
    left = [kept for step in steps if (kept := [name for name in step if name != body])]
    if order.get("base") == body or (steps and not left):
        hand.put(("assembly",), None)
        hand.notes.append("The order of assembly went with it.")
    elif left != steps:
        hand.put(("assembly", "steps"), left)


def _without_load(hand: Hand, index: int) -> None:
    if not 0 <= index < len(hand.raw.get("loads", ())):
        raise InputError("this load is not there any more")
    hand.put(("loads", index) if len(hand.raw["loads"]) > 1 else ("loads",), None)


def _drop(hand: Hand, section: str, name: str) -> None:
    if name in hand.raw.get(section, {}):
        hand.put((section, name) if len(hand.raw[section]) > 1 else (section,), None)
    _without_range(hand, section, name)


def _drop_where(hand: Hand, section: str, is_of: Callable[[Mapping[str, Any]], bool]) -> None:
    for name, own in [*hand.raw.get(section, {}).items()]:
        if isinstance(own, Mapping) and is_of(own):
            _drop(hand, section, name)
            hand.notes.append(f"{section}.{name} went with it.")


#: what a page can do, by name
GESTURES: Mapping[str, Callable[[Hand, Json], None]] = {
    one.__name__: one for one in (bar, ground, point, slider, slot, drive, output, load, move, length, delete)
}


def edits(raw: Mapping[str, Any], poses: Mapping[str, BodyPose], told: Json) -> tuple[list[Edit], list[str]]:
    """The edits of a gesture, and what has to be said of them.

    Raises
    ------
    InputError
        When there is no such gesture, or it is not possible.
    """
    name = str(told.get("gesture"))
    if name not in GESTURES:
        raise InputError(not_known(name, "something that the board can do", GESTURES))
    hand = Hand(raw, poses)
    try:
        GESTURES[name](hand, told)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        raise InputError("this is not what the page asks") from None
    return hand.edits, hand.notes


def renamed(raw: Mapping[str, Any], kind: str, old: str, new: str) -> dict[str, Any]:
    """The tables of a file with another name of a joint or of a body, wherever they speak of it.

    Raises
    ------
    InputError
        When the name is none, or is taken.
    """
    hand = Hand(raw, {})
    known = [*hand.joints] if kind == "joint" else [*hand.bodies(), GROUND]
    if old not in known or old == GROUND:
        raise InputError(not_known(old, f"a {kind} of this file that can be renamed", known))
    if new in known or not re.match(NAME, new):
        problem = "is taken" if new in known else "is not a name: no blanks and none of . / * = [ ] or quotes"
        raise InputError(f"{shown(new)} {problem}")
    is_key, is_value = (_joint_key, _joint_value) if kind == "joint" else (_body_key, _body_value)

    def source(text: str) -> str:
        """The name of a source, which begins with that of its joint."""
        begins = kind == "joint" and (text == old or text.startswith((f"{old}.", f"{old}/")))
        return new + text[len(old) :] if begins else text

    def key_of(key: str, path: Steps) -> str:
        if path == ("costs",):
            return source(key)
        if path == ("design", "vary"):
            # Each is the way to a value of the file.
            steps = key.split(".")
            return ".".join(new if step == old and is_key((*steps[:k],)) else step for k, step in enumerate(steps))
        return new if key == old and is_key(path) else key

    def walked(value: Any, path: Steps) -> Any:
        if isinstance(value, Mapping):
            named = {key_of(k, path): (k, one) for k, one in value.items()}
            return {key: walked(one, (*path, k)) for key, (k, one) in named.items()}
        if isinstance(value, list):
            return [walked(one, (*path, k)) for k, one in enumerate(value)]
        if isinstance(value, str) and path[:1] == ("correlations",):
            return source(value)
        return new if value == old and is_value(path) else value

    found: dict[str, Any] = walked(raw, ())
    return found


def _words(path: Steps) -> list[str]:
    return [step for step in path if isinstance(step, str)]


def _joint_key(path: Steps) -> bool:
    return path in (("joints",), ("limits", "joints"), ("design", "transmission")) or (
        path[:1] == ("drives",) and path[2:] in (("joints",), ("backlash",))
    )


def _joint_value(path: Steps) -> bool:
    return bool(_words(path)) and (
        _words(path)[-1] in ("joint", "joints", "follows", "at", "between")
        or "between" in path
        or path[-2:-1] == ("joints",)
        or (path[:1] == ("springs",) and "on" in path[:-1])
    )


def _body_key(path: Steps) -> bool:
    if path in (("start",), ("bodies",), ("links",), ("board", "free")):
        return True
    return path[:1] in (("joints",), ("springs",)) and path[-1] in ("on", "position", "direction", "runout", "between")


def _body_value(path: Steps) -> bool:
    return bool(_words(path)) and _words(path)[-1] in ("body", "bodies", "relative_to", "base", "axes", "steps")
