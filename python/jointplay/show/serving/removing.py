"""What goes when something is deleted on the board: it, and all that speaks of it."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from jointplay.errors import InputError, not_known
from jointplay.file.schema.keys import Steps

from .board import GROUND, XY, Json, bodies_of, free_of, locked_in, numbers, place_on, seen_from
from .hand import COORDINATES, RANGES, Hand, is_of, table_at


def delete(hand: Hand, told: Json) -> None:
    """Take a joint, a body, a free point, a drive, a load, a spring, a dimension, the output or its target away."""
    what = dict(told["what"])
    if "joint" in what:
        _without_joint(hand, str(what["joint"]), kept=bodies_of(hand.joint(what["joint"])))
    elif "index" in what:
        hand.where(what)
        hand.used(what)
        _forget(hand, str(what["body"]))
    elif "body" in what:
        _without_body(hand, str(what["body"]))
    elif "drive" in what:
        drop(hand, "drives", str(what["drive"]))
    elif "load" in what:
        _without_load(hand, int(what["load"]), str(what.get("case", "")))
    elif "spring" in what:
        drop(hand, "springs", str(what["spring"]))
    elif "dimension" in what:
        drop(hand, "dimensions", str(what["dimension"]))
    elif "output" in what:
        hand.put(("output",), None)
    elif "target" in what and "target" in hand.raw:
        hand.put(("target",), None)
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
            own = numbers(place_on(table, body), hand.variables) or seen_from(hand.pose(body), place)
            hand.free(body, [*free_of(hand.raw).get(body, []), own])
        _forget(hand, body)
    _without_coordinate(hand, name)
    drop_where(hand, "springs", lambda own: name in own.get("on", {}).values())
    drop_where(hand, "dimensions", lambda own: name in own.get("between", ()))
    _without_range(hand, "joints", name)
    if name in locked_in(hand.raw):
        hand.lock([one for one in locked_in(hand.raw) if one != name])
    if name in hand.raw.get("costs", {}):
        drop(hand, "costs", name)
    _at_places(hand, name, place)


def _without_coordinate(hand: Hand, name: str) -> None:
    """What drives a joint, follows it or turns about it goes with it."""
    drop_where(hand, "drives", lambda own: any(is_of(one, name) for one in own.get("joints", ())))
    for section, keys in COORDINATES.items():
        drop_where(hand, section, lambda own, keys=keys: any(is_of(own.get(key), name) for key in keys))  # type: ignore[misc]


def _without_range(hand: Hand, section: str, name: str) -> None:
    """The ranges and limits of a joint or a drive go with it."""
    for steps in RANGES.get(section, ()):
        for key in [key for key in table_at(hand.raw, *steps) if is_of(key, name)]:
            hand.take((*steps, key))


def _at_places(hand: Hand, name: str, place: XY | None) -> None:
    """What was at a joint that goes stands at its place."""
    for steps, own in points_of(hand):
        if own.get("at") == name:
            if place is None:
                problem = (
                    f"{'.'.join(map(str, steps))} is at {name}, whose place is not known here; change it in the text"
                )
                raise InputError(problem)
            body = own.get("body", hand.raw.get("output", {}).get("body", GROUND))
            hand.put((*steps, "at"), hand.local(str(body), place))


def points_of(hand: Hand) -> list[tuple[Steps, Mapping[str, Any]]]:
    """What is at a point of a body, and where it stands: outputs and loads."""
    entries: list[tuple[Steps, Any]] = [(("output",), hand.raw.get("output"))]
    entries += [(("outputs", key), own) for key, own in hand.raw.get("outputs", {}).items()]
    entries += [(("loads", k), own) for k, own in enumerate(hand.raw.get("loads", ()))]
    entries += [(("load_cases", case, k), own) for case, loads in _cases(hand).items() for k, own in enumerate(loads)]
    return [(steps, own) for steps, own in entries if isinstance(own, Mapping)]


def _cases(hand: Hand) -> dict[str, list[Mapping[str, Any]]]:
    """The loads of every load case that is written as a list of them."""
    return {name: own for name, own in hand.raw.get("load_cases", {}).items() if isinstance(own, list)}


def _without_body(hand: Hand, body: str) -> None:
    if body not in hand.bodies():
        raise InputError(not_known(body, "a body", hand.bodies()))
    hand.require_own(body)
    for name, table in hand.joints.items():
        bodies = bodies_of(table)
        if body not in bodies:
            continue
        if len(bodies) > 2:
            steps: Steps = ("joints", name, "on", body) if "on" in table else ("joints", name, "bodies")
            hand.put(steps, None if "on" in table else [one for one in bodies if one != body])
            # All others on a pin turn about its first body.
            _without_coordinate(hand, name if body == bodies[0] else f"{name}/{body}")
            if len(bodies) == 3 and body != bodies[0]:
                hand.rename(f"{name}/{next(one for one in bodies[1:] if one != body)}", name)
        else:
            _without_joint(hand, name, kept=[one for one in bodies if one != body])
    hand.free(body, [])
    _forget(hand, body)


def _forget(hand: Hand, body: str) -> None:
    """What speaks of a body goes with it, where it has no joint and no point any more."""
    if body in hand.bodies():
        return
    for section in ("start", "bodies", "links"):
        if body in hand.raw.get(section, {}):
            hand.put((section, body), None)
    for section in ("dimensions", "links"):
        drop_where(hand, section, lambda own: own.get("body") == body)
    drop_where(hand, "outputs", lambda own: own.get("body") == body)
    drop_where(hand, "springs", lambda own: body in own.get("on", {}))
    for case, loads in _cases(hand).items():
        gone = [k for k, load in enumerate(loads) if load.get("body") == body]
        if len(gone) == len(loads) > 0:
            drop(hand, "load_cases", case)
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


def _without_load(hand: Hand, index: int, case: str = "") -> None:
    loads = hand.raw.get("load_cases", {}).get(case, ()) if case else hand.raw.get("loads", ())
    if not isinstance(loads, list) or not 0 <= index < len(loads):
        raise InputError("this load is not there any more")
    if case and len(loads) == 1:
        return drop(hand, "load_cases", case)
    steps: Steps = ("load_cases", case) if case else ("loads",)
    return hand.put((*steps, index) if len(loads) > 1 else steps, None)


def drop(hand: Hand, section: str, name: str) -> None:
    """Take a table of a section away, and the section with its last one."""
    if name in hand.raw.get(section, {}):
        hand.put((section, name) if len(hand.raw[section]) > 1 else (section,), None)
    _without_range(hand, section, name)


def drop_where(hand: Hand, section: str, is_of: Callable[[Mapping[str, Any]], bool]) -> None:
    """Take those tables of a section away that speak of something."""
    for name, own in [*hand.raw.get(section, {}).items()]:
        if isinstance(own, Mapping) and is_of(own):
            drop(hand, section, name)
            hand.notes.append(f"{section}.{name} went with it.")
