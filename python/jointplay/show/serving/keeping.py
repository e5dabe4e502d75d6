"""An edit drag that keeps the lengths of the bars on a joint: who stays, who goes along, and where to."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from jointplay.errors import InputError, listed

from .board import GROUND, XY, bodies_of, free_of, locked_in, numbers, placed_at, seen_from
from .hand import Hand, tidy
from .removing import points_of

#: places that are one, in units of the file
SAME = 1e-9


def keep_lengths(hand: Hand, name: str, to: XY) -> dict[str, XY]:
    """Where a joint is dragged to when the bars on it keep their lengths, and the joints that go along.

    Locked joints and pins of the ground stay: about one of them the joint turns. Without one it pulls its bars behind
    it. A guide of the ground stays a guide. What bodies carry is turned with them.
    """
    here, places = hand.place_of(name), _places(hand)
    bars = {
        body: [one for one in places if one != name and body in bodies_of(hand.joint(one))]
        for body in bodies_of(hand.joint(name))
        if body != GROUND
    }
    stay = {one: places[one] for own in bars.values() for one in own if _stays(hand, one) and places[one] != here}
    guide = _guide(hand, name)
    if len({*stay.values()}) + (guide is not None) > 1:
        why = f"the lengths to {listed([*stay])}" + (" and a guide" if guide else "")
        raise InputError(f"{why} hold '{name}' where it is; a drag that keeps positions changes them")
    if guide is not None:
        along = guide[0] * (to[0] - here[0]) + guide[1] * (to[1] - here[1])
        to = (here[0] + along * guide[0], here[1] + along * guide[1])
    for centre in stay.values():
        to = _towards(centre, to, math.dist(centre, here))
    found = {name: to}
    for body, own in bars.items():
        lead = next((one for one in own if one in stay), next((one for one in own if places[one] != here), None))
        angle = 0.0
        if lead is not None:
            end = places[lead] if lead in stay else _pulled(hand, lead, to, math.dist(here, places[lead]))
            angle = _direction(to, end) - _direction(here, places[lead])

        def turned(place: XY, angle: float = angle) -> XY:
            return placed_at((*to, angle), (place[0] - here[0], place[1] - here[1]))

        found |= {one: turned(places[one]) for one in own if one not in found and one not in stay}
        _carry(hand, body, turned, angle)
    for one, at in [*found.items()]:
        found |= {guide: at for guide in _guides(hand, one) if guide not in found}
    return found


def _places(hand: Hand) -> dict[str, XY]:
    found = {}
    for name in hand.joints:
        with suppress(InputError):
            found[name] = tuple(round(v, 9) for v in hand.place_of(name))
    return found  # type: ignore[return-value]


def _stays(hand: Hand, name: str) -> bool:
    table = hand.joint(name)
    return name in locked_in(hand.raw) or (GROUND in bodies_of(table) and table.get("type") in ("revolute", "fixed"))


def _guides(hand: Hand, name: str) -> list[str]:
    """The guides of the ground in which a joint slides, at its place."""
    here, bodies = hand.place_of(name), {*bodies_of(hand.joint(name))} - {GROUND}
    return [
        one
        for one, table in hand.joints.items()
        if table.get("type") in ("prismatic", "pin_in_slot")
        and bodies_of(table)[0] == GROUND
        and bodies & {*bodies_of(table)}
        and math.dist(hand.place_of(one), here) < SAME
    ]


def _guide(hand: Hand, name: str) -> XY | None:
    """The direction in which a joint slides in a guide of the ground."""
    for one in _guides(hand, name):
        table = hand.joint(one)
        own = table["on"][GROUND] if "on" in table else table
        axis = numbers(own.get("axis"), hand.variables)
        if axis is not None:
            return axis[0] / math.hypot(*axis), axis[1] / math.hypot(*axis)
    return None


def _pulled(hand: Hand, name: str, to: XY, length: float) -> XY:
    """Where a joint comes to be that is pulled behind a place, at a length from it."""
    here, guide = hand.place_of(name), _guide(hand, name)
    if guide is None:
        return _towards(to, here, length)
    x, y = here[0] - to[0], here[1] - to[1]
    half, rest = guide[0] * x + guide[1] * y, x * x + y * y - length**2
    if half**2 < rest:
        raise InputError(f"the bar does not reach from there to the guide of '{name}'")
    root = math.sqrt(half**2 - rest)
    by = min(-half - root, -half + root, key=abs)
    return here[0] + by * guide[0], here[1] + by * guide[1]


def _towards(centre: XY, place: XY, length: float) -> XY:
    """The place at a length from a centre in the direction of another place."""
    far = math.dist(centre, place)
    if far < SAME:
        raise InputError("a bar has no direction where both of its ends are")
    return centre[0] + (place[0] - centre[0]) * length / far, centre[1] + (place[1] - centre[1]) * length / far


def _direction(start: XY, end: XY) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _carry(hand: Hand, body: str, turned: Callable[[XY], XY], angle: float) -> None:
    """Turn what a body carries beside its joints: free points, output, loads, springs, centre of mass, its guides."""
    pose = hand.pose(body)

    def local(place: Any) -> XY | None:
        own = numbers(place, hand.variables)
        return None if own is None else seen_from(pose, turned(placed_at(pose, own)))

    if body in free_of(hand.raw):
        hand.free(body, [seen_from(pose, turned(placed_at(pose, point))) for point in free_of(hand.raw)[body]])
    entries = [((*steps, "at"), own.get("at", [0, 0])) for steps, own in points_of(hand) if own.get("body") == body]
    entries += [
        (("springs", k, "on", body), own.get("on", {}).get(body)) for k, own in hand.raw.get("springs", {}).items()
    ]
    entries += [(("bodies", body, "centre"), hand.raw.get("bodies", {}).get(body, {}).get("centre"))]
    for steps, place in entries:
        if (found := local(place)) is not None:
            hand.put(steps, [tidy(v) for v in found])
    for name, table in hand.joints.items():
        own = table["on"].get(body) if "on" in table else table
        if bodies_of(table)[0] == body and isinstance(own, dict) and (axis := numbers(own.get("axis"), hand.variables)):
            steps = ("joints", name, "on", body, "axis") if "on" in table else ("joints", name, "axis")
            hand.put(steps, [tidy(v) for v in placed_at((0.0, 0.0, angle), axis)])
