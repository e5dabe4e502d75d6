"""Mechanism files that are mostly valid, so that questions see them: other sizes, laws, drives, places, loads, limits.

They begin with an example, or with a random mechanism of the tests, and go where such files do not: lengths of zero,
points in a row or at one place, sizes that fill the mechanism, values that do not matter.
"""

import copy
import math
import tomllib
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

from helpers import strategies, structures

from .files import TEXTS, deviate, written

Tables = dict[str, Any]
#: as many configurations a file has: more are only slow
MOST = 3
FACTORS = (0.0, 1e-9, 1e-3, 0.1, 0.5, 0.9, 1.0, 2.0, 10.0)
STRUCTURES = (structures.truss, structures.frame, structures.space_frame, structures.legs)
LAWS: tuple[Callable[[float], Any], ...] = (
    lambda _: "uniform",
    lambda _: "normal",
    lambda _: "triangular",
    lambda size: {"triangular": 0.9 * size},
    lambda _: {"beta": [0.5, 2]},
    lambda size: {"pert": size},
    lambda size: {"measured": [-size, 0, size / 3, size / 3, size]},
    lambda _: {"normal": {"cpk": 1.33, "shift": 1.5, "drift": 0.5, "sorted": False}},
)
FITS = ("H7/g6", "H7/f7", "H7/h6", "H7/p6", "H9/e8")
COMPONENTS = {"planar": ("x", "y", "angle"), "spatial": ("x", "y", "z", "rx", "ry", "rz")}


def begun(random: Random) -> Tables:
    """A valid file."""
    draw = random.random()
    if draw < 0.6:
        return tomllib.loads(TEXTS[random.choice(sorted(TEXTS))])
    if draw < 0.85:
        kind = random.choice(sorted(strategies.KINDS))
        return tomllib.loads(strategies.mechanism(kind, random.randrange(1000), well_conditioned=1e-6))
    return copy.deepcopy(random.choice(STRUCTURES)(random.randrange(1000)))


def space(raw: Tables) -> str:
    """In the plane or in space."""
    return str(raw.get("space", "planar"))


def length(raw: Tables) -> float:
    """About how large it is."""
    found = [abs(x) for place in _places(raw) for x in place if isinstance(x, int | float)]
    return max(found, default=0.0) or 100.0


def _places(raw: Tables) -> Iterator[list[Any]]:
    """Places of joints, where they stand as lists of numbers."""
    for joint in raw.get("joints", {}).values():
        for holder, key in [(joint, "at"), *((joint.get("on", {}), body) for body in joint.get("on", {}))]:
            value = holder.get(key)
            value = value.get("at") if isinstance(value, dict) else value
            if isinstance(value, list) and all(isinstance(x, int | float) for x in value):
                yield value


def bodies(raw: Tables) -> list[str]:
    """The bodies that joints name, the ground apart."""
    joints = raw.get("joints", {}).values()
    found = [body for joint in joints for body in joint.get("on", joint.get("bodies", ()))]
    return [body for body in dict.fromkeys(found) if body != "ground"]


def _point(raw: Tables, random: Random) -> list[float]:
    """A place: the origin, one that a joint has, or any."""
    axes, size = (3, length(raw)) if space(raw) == "spatial" else (2, length(raw))
    choices: list[list[float]] = [[0.0] * axes, [random.uniform(-size, size) for _ in range(axes)]]
    choices += [[float(x) for x in place] for place in _places(raw) if len(place) == axes]
    return list(random.choice(choices))


def _tolerated(raw: Tables) -> list[Tables]:
    """Tables that may have a tolerance and a law."""
    return [table for key in ("dimensions", "drives") for table in raw.get(key, {}).values()]


def sizes(raw: Tables, random: Random) -> None:
    """A clearance of another size, from none to one as large as the mechanism."""
    joint = random.choice([*raw["joints"].values()])
    clearance = joint.get("clearance")
    if isinstance(clearance, dict):
        for key, value in clearance.items():
            if isinstance(value, int | float) and not isinstance(value, bool):
                clearance[key] = value * random.choice(FACTORS)
    else:
        size = length(raw) * random.choice((0.0, 1e-6, 1e-3, 1e-2))
        joint["clearance"] = _clearance(str(joint.get("type")), size, length(raw))


def _clearance(kind: str, size: float, long: float) -> Tables:
    if kind in ("prismatic", "pin_in_slot", "planar"):
        return {"gap": size} | ({} if kind == "pin_in_slot" else {"length": 0.3 * long, "width": 0.2 * long})
    if kind in ("gear", "rack", "belt"):
        return {"backlash": size}
    if kind == "universal":
        return {"radial": size, "length": 0.2 * long}
    return {"radial": size}


def fits(raw: Tables, random: Random) -> None:
    """A fit, some of them with interference."""
    pins = [joint for joint in raw["joints"].values() if joint.get("type") == "revolute"]
    if pins and space(raw) == "planar":
        fit: Tables = {"fit": random.choice(FITS), "diameter": random.choice((6, 12, 40))}
        random.choice(pins)["clearance"] = fit | random.choice(({}, {"law": "uniform"}))


def laws(raw: Tables, random: Random) -> None:
    """A tolerance and how it scatters."""
    for table in random.sample(_tolerated(raw), min(2, len(_tolerated(raw)))):
        size = length(raw) * random.choice((0.0, 1e-7, 1e-4, 1e-2))
        word = "tolerance" if "between" in table else "error"
        table[word] = random.choice((size, {"plus": size, "minus": 0.0}, {"plus": size, "minus": 3 * size}))
        if size:
            table["law"] = random.choice(LAWS)(size)
        if random.random() < 0.2:
            table[word] = {"sigma": size}
            table.pop("law", None)


def dimensions(raw: Tables, random: Random) -> None:
    """A dimension between two joints of a body."""
    body = random.choice(bodies(raw))
    own = [name for name, joint in raw["joints"].items() if body in joint.get("on", joint.get("bodies", ()))]
    if len(own) > 1:
        between = random.sample(own, 2)
        size = length(raw) * random.choice((0.0, 1e-4, 1e-2))
        entry = {
            "body": body,
            "between": between,
            "tolerance": size,
            "deviation": random.choice((0.0, size, -2 * size)),
        }
        raw.setdefault("dimensions", {})["added"] = entry


def drives(raw: Tables, random: Random) -> None:
    """Other drive values: one, the same again, backwards, far away."""
    # With a path drives have no values.
    for drive in raw.get("drives", {}).values() if "path" not in raw else ():
        values = drive.get("values") or [drive.get("from", 0.0), drive.get("to", 0.0)]
        if not all(isinstance(value, int | float) for value in values):
            continue
        for key in ("from", "to", "count"):
            drive.pop(key, None)
        first = float(values[0])
        drive["values"] = random.choice(
            (
                [first],
                [first, first],
                [*values[::-1]][:MOST],
                [first, first + random.uniform(-1, 1) * (abs(first) + 1)],
                [first, -first],
                [first, first + 1e-9],
                [first, random.choice((0.0, 90.0, 180.0, 360.0, 720.0, 1e6))],
            )
        )


def layouts(raw: Tables, random: Random) -> None:
    """Points that coincide, lie in a row or at the origin of their body, or are a little beside their place."""
    places = list(_places(raw))
    if len(places) < 2:
        return
    for one in random.sample(places, random.choice((1, 1, 2))):
        other = random.choice([place for place in places if len(place) == len(one)])
        match random.choice(("there", "origin", "row", "beside", "mirror", "flat")):
            case "there":
                one[:] = other
            case "origin":
                one[:] = [0.0] * len(one)
            case "row":
                one[:] = [random.choice((0.5, 2.0, -1.0)) * x for x in other]
            case "beside":
                size = length(raw) * random.choice((1e-12, 1e-9, 1e-6, 1e-3, 0.05))
                one[:] = [x + random.gauss(0, size) for x in one]
            case "mirror":
                one[0] = -one[0]
            case "flat":
                one[random.randrange(len(one))] = 0.0


def starts(raw: Tables, random: Random) -> None:
    """No start, or one that is off."""
    for entry in raw.get("start", {}).values():
        if isinstance(entry, dict) and isinstance(entry.get("angle"), int | float):
            entry["angle"] += random.choice((0.0, 1.0, 20.0, 180.0, 360.0))
    if random.random() < 0.3:
        raw.pop("start", None)


def loads(raw: Tables, random: Random) -> None:
    """No load, one more, or one without a size; masses; gravity."""
    axes = 2 if space(raw) == "planar" else 3
    force = [random.choice((0.0, 1e-9, -10.0, 1e6)) for _ in range(axes)]
    body = random.choice(bodies(raw))
    match random.choice(("none", "more", "more", "moment", "mass", "cases")):
        case "none":
            raw.pop("loads", None)
        case "more":
            raw.setdefault("loads", []).append({"body": body, "at": _point(raw, random), "force": force})
        case "moment":
            moment: Any = random.choice((0.0, 5.0, -1e6)) if axes == 2 else force
            raw.setdefault("loads", []).append({"body": body, "at": _point(raw, random), "moment": moment})
        case "mass":
            entry = raw.setdefault("bodies", {}).setdefault(body, {})
            entry |= {"mass": random.choice((0.0, 1.5, 1e6)), "centre": _point(raw, random)}
            raw["gravity"] = [0.0, -9.81] if axes == 2 else [0.0, 0.0, -9.81]
        case "cases":
            cases = {"one": [{"body": body, "at": _point(raw, random), "force": force}], "none": []}
            raw["load_cases"] = cases if random.random() < 0.3 else {"one": cases["one"], "two": cases["one"]}


def limits(raw: Tables, random: Random) -> None:
    """Limits of nothing, of anything, and shares."""
    names = ("position", "rotation", *COMPONENTS[space(raw)])
    raw["limits"] = {
        name: length(raw) * random.choice((0.0, 1e-9, 1e-3, 1.0))
        for name in random.sample(names, random.choice((1, 2)))
    }
    if random.random() < 0.5:
        raw["limits"]["probability"] = random.choice((0.5, 0.99, 0.9973))


def outputs(raw: Tables, random: Random) -> None:
    """An output on another body or at another place, and several of them."""
    entry: Tables = {"body": random.choice(bodies(raw)), "at": _point(raw, random)}
    others = [body for body in bodies(raw) if body != entry["body"]]
    if others and random.random() < 0.3:
        entry["relative_to"] = random.choice(others)
    if isinstance(raw.get("output"), dict) and random.random() < 0.3 and "path" not in raw and "grid" not in raw:
        raw["outputs"] = {"first": raw.pop("output"), "second": entry}
        # Loads without a body act on the one output.
        raw["loads"] = [{"body": entry["body"], "at": entry["at"], **load} for load in raw.get("loads", [])]
    elif "output" in raw:
        raw["output"] = entry


def springs(raw: Tables, random: Random) -> None:
    """Springs: between points at one place, without stiffness, about a joint."""
    stiffness = random.choice((0.0, 1e-6, 2.0, 1e9))
    added: Tables = {"stiffness": stiffness, "preload": random.choice((0.0, -5.0, 1e6))}
    if random.random() < 0.3:
        turning = [name for name, joint in raw["joints"].items() if joint.get("type") == "revolute"]
        if turning:
            raw.setdefault("springs", {})["turn"] = added | {"joint": random.choice(turning)}
        return
    one, other = random.sample(["ground", *bodies(raw)], 2) if bodies(raw) else ("ground", "ground")
    shared = [
        name for name, joint in raw["joints"].items() if {one, other} <= set(joint.get("on", joint.get("bodies", ())))
    ]
    # The ends of one that is on a joint of both bodies are at one place.
    at: Any = random.choice(shared) if shared and random.random() < 0.7 else None
    ends = {one: at or _point(raw, random), other: at or _point(raw, random)}
    raw.setdefault("springs", {})["s"] = added | {"on": ends, "free_length": random.choice((0.0, length(raw)))}


def costs(raw: Tables, random: Random) -> None:
    """Prices, and limits that they are paid for."""
    size = 1e-3 * length(raw)
    formula = {"model": "reciprocal", "a": 1, "b": size, "k": 1, "from": 0.01 * size, "to": 100 * size}
    choices = {"choices": [{"size": 0.1 * size, "cost": 9}, {"size": size, "cost": 4}, {"size": 5 * size, "cost": 4}]}
    raw["costs"] = {name: random.choice((formula, choices)) for name in _sized(raw)}
    limits(raw, random)


def _sized(raw: Tables) -> list[str]:
    """Sources that have a size of one number."""
    joints = [
        name
        for name, joint in raw["joints"].items()
        if isinstance(joint.get("clearance"), dict) and {"radial", "gap", "diametral"} & set(joint["clearance"])
    ]
    return [*joints, *(name for name, one in raw.get("dimensions", {}).items() if one.get("tolerance"))]


def elastic(raw: Tables, random: Random) -> None:
    """Members and joints that give."""
    body = random.choice(bodies(raw))
    raw.setdefault("bodies", {}).setdefault(body, {}).update({"E": 2.1e5, "area": random.choice((1e-3, 80.0))})
    joint = random.choice([*raw["joints"].values()])
    if joint.get("type") == "revolute":
        joint["stiffness"] = {"radial": random.choice((1e-3, 1e5, 1e12))}


def warmth(raw: Tables, random: Random) -> None:
    """A temperature."""
    raw["temperature"] = random.choice((0.0, 40.0, {"deviation": -40.0, "tolerance": 10.0}, {"tolerance": 1.0}))
    raw["expansion"] = random.choice((0.0, 1.2e-5))


def together(raw: Tables, random: Random) -> None:
    """Sources that scatter together."""
    named = [name for name, one in raw.get("dimensions", {}).items() if one.get("tolerance")]
    named += [name for name, one in raw.get("drives", {}).items() if one.get("error")]
    if len(named) > 1:
        raw["correlations"] = [{"sources": random.sample(named, 2), "rank": random.choice((-1, -0.5, 0, 0.7, 1))}]


def strays(raw: Tables, random: Random) -> None:
    """A joint that is off on its body."""
    deviate(raw, random)


MUTATIONS: tuple[Callable[[Tables, Random], None], ...] = (
    sizes, sizes, fits, laws, laws, dimensions, drives, drives, layouts, layouts, starts, loads, loads, limits, outputs,
    springs, costs, elastic, warmth, together, strays,
)  # fmt: skip


def shortened(raw: Tables) -> None:
    """With few configurations."""
    for table in [*raw.get("drives", {}).values(), raw.get("path", {}), *raw.get("grid", {}).values()]:
        if not isinstance(table, dict):
            continue
        for key, value in table.items():
            if isinstance(value, list):
                table[key] = value[:MOST]
        if isinstance(table.get("count"), int):
            table["count"] = min(table["count"], MOST)


def valid(random: Random) -> bytes:
    """A file that most often can be read."""
    raw = begun(random)
    shortened(raw)
    if "joints" in raw and bodies(raw):
        for change in random.choices(MUTATIONS, k=random.choice((1, 1, 2, 2, 3, 4))):
            change(raw, random)
    return written(_finite(raw))


def _finite(node: Any) -> Any:
    """Without numbers that no file has."""
    if isinstance(node, dict):
        return {key: _finite(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_finite(value) for value in node]
    return 0.0 if isinstance(node, float) and not math.isfinite(node) else node
