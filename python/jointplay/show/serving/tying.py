"""Gestures that tie things which are there: welds, gear pairs, springs, dimensions; locks, copies and load cases."""

import math
from collections.abc import Mapping
from typing import Any

from jointplay.errors import InputError

from .board import GROUND, XY, Json, bodies_of, free_of, locked_in, numbers, place_on, placed_at
from .hand import Hand, number_of, point_of, tidy
from .removing import drop, drop_where

#: teeth of a wheel that nobody has counted yet
TEETH = 20
#: the tolerance of a new dimension, as a part of it
TOLERANCE = 1e-3


def weld(hand: Hand, told: Json) -> None:
    """A weld in place of a pin, a pin in place of a weld; a point of a body is welded to the ground."""
    ref = dict(told["at"])
    if "joint" not in ref:
        hand.pin([GROUND, hand.held(ref)], hand.where(ref), "fixed")
        return hand.used(ref)
    name = str(ref["joint"])
    table = hand.joint(name)
    kind, bodies = table.get("type"), bodies_of(table)
    if kind not in ("revolute", "fixed") or len(bodies) != 2:
        raise InputError(f"'{name}' is no pin of two bodies that could be welded")
    drop_where(hand, "drives", lambda own: own.get("joint") == name or name in own.get("joints", ()))
    for key in ("clearance", "angle", "friction", "wear"):
        if key in table:
            hand.put(("joints", name, key), None)
    drop(hand, "costs", name)
    if "on" in table:
        # A weld keeps the bodies as they are shown: one direction of the drawing, seen from each.
        for body in bodies:
            at, turn = place_on(table, body), -hand.pose(body)[2]
            axis = [tidy(math.cos(turn)), tidy(math.sin(turn))]
            hand.put(("joints", name, "on", body), {"at": at, "axis": axis} if kind == "revolute" else at)
    return hand.put(("joints", name, "type"), "fixed" if kind == "revolute" else "revolute")


def gear(hand: Hand, told: Json) -> None:
    """Two wheels that mesh, each about a pin that carries it."""
    names = [str(dict(told[key])["joint"]) for key in ("from", "to") if "joint" in dict(told[key])]
    if len(names) != 2 or any(hand.joint(name).get("type") != "revolute" for name in names):
        raise InputError("wheels turn about pins: click on one pin and on another one")
    bodies = _apart(*([b for b in reversed(bodies_of(hand.joint(name))) if b != GROUND] for name in names))
    if bodies is None:
        raise InputError(f"'{names[0]}' and '{names[1]}' carry the same body; wheels are two")
    places = [hand.place_of(name) for name in names]
    _mesh(hand, hand.new("mesh", hand.joints), bodies, places, (TEETH, TEETH))


def teeth(hand: Hand, told: Json) -> None:
    """Other tooth counts of a gear pair, whose centres stay where they are."""
    name = str(told["joint"])
    counts = tuple(int(number_of(v, "a number of teeth")) for v in told["teeth"])
    if hand.joint(name).get("type") != "gear" or len(counts) != 2 or min(counts) < 1:
        raise InputError(f"'{name}' is no gear pair, or these are no tooth counts")
    bodies = bodies_of(hand.joint(name))
    _mesh(hand, name, (bodies[0], bodies[1]), _centres(hand, name), counts)


def meshed(hand: Hand, before: XY, after: XY) -> None:
    """Gear pairs about a pin that has moved, with the radii that mesh."""
    for name, table in hand.joints.items():
        if table.get("type") != "gear":
            continue
        centres = _centres(hand, name)
        moved = [after if math.dist(centre, before) < 1e-6 * math.hypot(*before, 1.0) else centre for centre in centres]
        if moved != centres:
            bodies, counts = bodies_of(table), table["teeth"]
            _mesh(hand, name, (bodies[0], bodies[1]), moved, (counts[0], counts[1]))


def _apart(first: list[str], second: list[str]) -> tuple[str, str] | None:
    """One body of each list that are not the same, early ones first."""
    return next(((a, b) for a in first for b in second if a != b), None)


def _centres(hand: Hand, name: str) -> list[XY]:
    table = hand.joint(name)
    if "on" in table:
        places = [(body, numbers(place_on(table, body), hand.variables)) for body in bodies_of(table)]
        found = [placed_at(hand.pose(body), place) for body, place in places if place is not None]
    else:
        found = [place for one in table["at"] if (place := numbers(one, hand.variables)) is not None]
    if len(found) != 2:
        raise InputError(f"the centres of '{name}' are not known here; change them in the text")
    return found


def _mesh(hand: Hand, name: str, bodies: tuple[str, str], places: list[XY], counts: tuple[int, ...]) -> None:
    """A gear pair with centres at two places; its pitch circles touch."""
    before = hand.joints.get(name, {"type": "gear"})
    first, second = counts
    around = -1 if before.get("internal") else 1
    unit = math.dist(*places) / abs(first + around * second) if first + around * second else 0.0
    if not unit:
        raise InputError(f"'{name}' has no room for its wheels")
    where: Json = {"bodies": list(bodies), "at": [[tidy(v) for v in place] for place in places]}
    if not all(map(hand.is_drawn, bodies)) or "on" in before:
        where = {"on": {body: hand.local(body, place) for body, place in zip(bodies, places, strict=True)}}
    sizes = {"teeth": [first, second], "radii": [tidy(first * unit), tidy(second * unit)]}
    if name in hand.joints:
        for key, value in {**where, **sizes}.items():
            if before.get(key) != value:
                hand.put(("joints", name, key), value)
    else:
        hand.put(("joints", name), {"type": "gear", **where, **sizes})


def spring(hand: Hand, told: Json) -> None:
    """A spring between two places, or about a pin; it has no force where it is drawn."""
    name = hand.new("spring", hand.raw.get("springs", {}))
    if "joint" in told:
        joint = str(told["joint"])
        if hand.joint(joint).get("type") != "revolute":
            raise InputError(f"'{joint}' is no pin about which a spring could turn")
        unit = 1.0 if hand.raw.get("units", {}).get("angle") == "rad" else 180.0 / math.pi
        first, second, *more = bodies_of(hand.joint(joint))
        here = (hand.pose(second)[2] - hand.pose(first)[2]) * unit
        return hand.put(
            ("springs", name),
            {"joint": f"{joint}/{second}" if more else joint, "stiffness": 1, "free_angle": tidy(here)},
        )
    refs = [dict(told[key]) for key in ("from", "to")]
    bodies = _apart(*(_carriers(hand, ref) for ref in refs))
    if bodies is None:
        raise InputError("both ends of the spring are on one body")
    places = [hand.where(ref) for ref in refs]
    if math.dist(*places) < 1e-9:
        raise InputError("both ends of the spring are at one place")
    ends = {
        body: str(ref["joint"]) if "joint" in ref else hand.local(body, place)
        for body, ref, place in zip(bodies, refs, places, strict=True)
    }
    hand.put(("springs", name), {"on": ends, "stiffness": 1, "free_length": tidy(math.dist(*places))})
    return None


def _carriers(hand: Hand, ref: Mapping[str, Any]) -> list[str]:
    """The bodies on which an end could be, moving ones first."""
    if "joint" in ref:
        bodies = bodies_of(hand.joint(str(ref["joint"])))
        return [*reversed([b for b in bodies if b != GROUND]), *[b for b in bodies if b == GROUND]]
    return [str(ref.get("body", GROUND))]


def dimension(hand: Hand, told: Json) -> None:
    """A dimension with a tolerance between two joints of one body."""
    names = [str(dict(told[key]).get("joint", "")) for key in ("from", "to")]
    if not all(names) or names[0] == names[1]:
        raise InputError("a dimension is between two joints of one body")
    common = [b for b in bodies_of(hand.joint(names[0])) if b in bodies_of(hand.joint(names[1]))]
    if not common:
        raise InputError(f"no body has both '{names[0]}' and '{names[1]}': measured, and nothing to tolerate")
    body = next((b for b in common if b != GROUND), GROUND)
    size = math.dist(*map(hand.place_of, names))
    for own in hand.raw.get("dimensions", {}).values():
        if own.get("body") == body and set(own.get("between", ())) == set(names):
            raise InputError(f"'{names[0]}' and '{names[1]}' have a dimension already")
    own = {"body": body, "between": names, "tolerance": tidy(float(f"{TOLERANCE * size:.1g}"))}
    hand.put(("dimensions", hand.new("l", hand.raw.get("dimensions", {}))), own)


def lock(hand: Hand, told: Json) -> None:
    """Keep a joint where it is, or let it go again."""
    name = str(dict(told["at"]).get("joint", ""))
    hand.joint(name)
    before = locked_in(hand.raw)
    hand.lock([one for one in before if one != name] if name in before else [*before, name])


def duplicate(hand: Hand, told: Json) -> None:
    """A bar like another one, beside it; its points are free."""
    body = str(told["body"])
    by = point_of(told.get("by", [0, 0]))
    places = [
        place
        for name, table in hand.joints.items()
        if body in bodies_of(table) and table.get("type") != "gear"
        for place in [hand.place_of(name)]
    ]
    places += [placed_at(hand.pose(body), point) for point in free_of(hand.raw).get(body, [])]
    if len(places) < 2:
        raise InputError(f"'{body}' has no two points that could be copied")
    hand.free(hand.new("bar", hand.bodies()), [(x + by[0], y + by[1]) for x, y in places])


def case(hand: Hand, told: Json) -> None:
    """The load case in which a load acts: in all of them where it is empty."""
    before, after, index = str(told.get("from", "")), str(told.get("to", "")), int(told["load"])
    cases = hand.raw.get("load_cases", {})
    loads = cases.get(before, []) if before else hand.raw.get("loads", [])
    if not isinstance(loads, list) or not 0 <= index < len(loads):
        raise InputError("this load is not there any more")
    if before == after:
        return None
    entry = dict(loads[index])
    if after:
        here = cases.get(after, [])
        hand.put(("load_cases", after, len(here)) if here else ("load_cases", after), entry if here else [entry])
    else:
        here = hand.raw.get("loads", [])
        hand.put(("loads", len(here)) if here else ("loads",), entry if here else [entry])
    if before and len(loads) == 1:
        return drop(hand, "load_cases", before)
    steps = ("load_cases", before) if before else ("loads",)
    return hand.put((*steps, index) if len(loads) > 1 else steps, None)


def line(hand: Hand, told: Json) -> None:
    """The straight line on which the output ought to be, through two places."""
    places = [hand.where(dict(told[key])) for key in ("from", "to")]
    if math.dist(*places) < 1e-9:
        raise InputError("both points of the line are at one place")
    through, to = ([tidy(v) for v in place] for place in places)
    _aim(hand, {"line": {"through": through, "to": to}})


def circle(hand: Hand, told: Json) -> None:
    """The circle on which the output ought to be, about a place and through another one."""
    centre, place = (hand.where(dict(told[key])) for key in ("from", "to"))
    radius = tidy(math.dist(centre, place))
    if radius <= 0.0:
        raise InputError("the circle has no radius; its second point is away from its centre")
    _aim(hand, {"circle": {"centre": [tidy(v) for v in centre], "radius": radius}})


def _aim(hand: Hand, target: Json) -> None:
    """Another target, with the tolerance of the one before."""
    if hand.raw.get("outputs"):
        raise InputError("the file has several outputs; write the target of one of them in the text")
    before = hand.raw.get("target", {})
    hand.put(("target",), {**target, **({"tolerance": before["tolerance"]} if "tolerance" in before else {})})
