"""What a person does on the board, as edits of the file: places of values in it, and what stands there then.

A bar is a body with two ends. An end that is at no joint stands in ``[board]``; with a pin it becomes one.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema.keys import Steps

from .board import GROUND, XY, BodyPose, Json, bodies_of, free_of, locked_in, numbers, placed_at, seen_from
from .hand import Edit, Hand, number_in, number_of, point_of, tidy
from .keeping import keep_lengths
from .removing import delete
from .tying import case, circle, dimension, duplicate, gear, line, lock, meshed, spring, teeth, weld

#: what a drive turns through to both sides of where it is drawn, in degrees, and how many configurations it has
REACH, COUNT = 20.0, 9
#: the same of a drive that slides, as a part of the drawing
SLIDE = 0.1
#: size of a force that is put on a point, in units of the file
FORCE = 10.0


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
    driven = [own.get("joint") for own in hand.raw.get("drives", {}).values() if isinstance(own, Mapping)]
    # Of several joints on one pin the first that has none.
    names = {name: bodies[1]} if len(bodies) == 2 else {f"{name}/{body}": body for body in bodies[1:]}
    free = [one for one in names if one not in driven]
    if not free:
        raise InputError(f"'{name}' has a drive already")
    bodies = [bodies[0], names[free[0]]]
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
    own = {"joint": free[0], "from": tidy(here - reach), "to": tidy(here + reach), "count": _count(hand)}
    hand.put(("drives", hand.new("drive", hand.raw.get("drives", {}))), own)


def _count(hand: Hand) -> int:
    """How many values drives have, which run together; a single one is held."""
    drives = [own for own in hand.raw.get("drives", {}).values() if isinstance(own, Mapping)]
    counts = [len(v) if isinstance(v := own.get("values"), list) else own.get("count", 1) for own in drives]
    return next((count for count in counts if isinstance(count, int) and count > 1), COUNT)


def _extent(hand: Hand) -> float:
    places = [hand.place_of(name) for name, table in hand.joints.items() if table.get("type") != "gear"]
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
    """Another place of a joint or of a free point; all other points stay where they are shown, or bars keep lengths."""
    ref = dict(told["at"])
    place = _typed_place(hand, told["to"])
    if "joint" not in ref:
        points = hand.points(ref)
        hand.where(ref)
        body = str(ref["body"])
        points[int(ref["index"])] = seen_from(hand.pose(body), place)
        return hand.free(body, points)
    name = str(ref["joint"])
    table = hand.joint(name)
    if name in locked_in(hand.raw):
        raise InputError(f"'{name}' is locked")
    if told.get("keeps") == "lengths":
        for one, there in keep_lengths(hand, name, place).items():
            move(hand, {"at": {"joint": one}, "to": list(there)})
        return None
    before = hand.place_of(name)
    if "on" not in table:
        hand.require_drawn(name)
        for old, new in zip(table["at"], told["to"], strict=True):
            if isinstance(old, str) and old != new:
                _note_expression(hand, name, new)
        hand.put(("joints", name, "at"), [v if isinstance(v, str) else tidy(v) for v in told["to"]])
        return meshed(hand, before, place)
    if any(isinstance(v, str) for v in told["to"]):
        raise InputError(f"'{name}' has its place in the axes of its bodies; write expressions of it in the text")
    for body, own in table["on"].items():
        at = own.get("at") if isinstance(own, Mapping) else own
        if numbers(at) is None:
            _note_expression(hand, name, None)
        # Both points of a guide are moved alike, so that its coordinate stays what it is.
        own_place = numbers(at, hand.variables)
        here = before if own_place is None else placed_at(hand.pose(body), own_place)
        steps: Steps = ("joints", name, "on", body)
        local = hand.local(body, (here[0] + place[0] - before[0], here[1] + place[1] - before[1]))
        hand.put((*steps, "at") if isinstance(own, Mapping) else steps, local)
    return meshed(hand, before, place)


def _typed_place(hand: Hand, value: Any) -> XY:
    """A place that may have expressions, as numbers."""
    if isinstance(value, list) and any(isinstance(v, str) for v in value):
        value = [number_in(hand, v) for v in value]
    return point_of(value)


def _note_expression(hand: Hand, name: str, new: Any) -> None:
    if not isinstance(new, str):
        hand.notes.append(f"The place of '{name}' was an expression and is a number now.")


def length(hand: Hand, told: Json) -> None:
    """The distance between two joints: the second one moves along the line, the first one where that is locked."""
    names = [str(told["from"]), str(told["to"])]
    if names[1] in locked_in(hand.raw):
        names.reverse()
    start, end = map(hand.place_of, names)
    before, after = math.dist(start, end), number_in(hand, told["value"], "a length")
    if not before or after <= 0.0:
        raise InputError(f"{shown(told['value'])} is not a length; it is greater than zero")
    to = [a + (b - a) * after / before for a, b in zip(start, end, strict=True)]
    move(hand, {"at": {"joint": names[1]}, "to": to})


#: what a page can do, by name
GESTURES: Mapping[str, Callable[[Hand, Json], None]] = {
    one.__name__: one
    for one in (
        *(bar, ground, point, slider, slot, drive, output, load, move, length, delete),
        *(weld, gear, teeth, spring, dimension, lock, duplicate, case, line, circle),
    )
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
