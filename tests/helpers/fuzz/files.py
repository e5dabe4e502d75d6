"""Mechanism files that are damaged byte by byte, or say something else than they did."""

import copy
import tomllib
from random import Random
from typing import Any

from jointplay import examples
from jointplay.file.document import texts

TEXTS = {name: examples.text(name) for name in examples.names()}
TOKENS = [
    b"0", b"-", b"9", b".", b"e", b'"', b"'", b"[", b"]", b"{", b"}", b"=", b",", b"\n", b"\r", b"\0", b"#", b"\xff",
    b"\xef\xbb\xbf", b"\xe2\x80\xae", b"\x1b[31m", b"[[", b'"' * 3, b"inf", b"nan", b"true", b"1979-05-27", b"0x",
    b"a.a.",
]  # fmt: skip
SCALARS: list[Any] = [
    0, -1, 1, 2, 1e-300, 1e-9, 1e9, 1e12, -1e12, 1e13, 1e300, 2**63, 2**100, float("nan"), float("inf"),
    float("-inf"), -0.0,
    "2 * 0.1", "a / 2", "sqrt(-1)", "9**9**9", "copy",
    True, False, "", "ground", "output", "J1", "H7/g6", "a\nb", "\x1b[31m", "{}", "$x_$", "<b>", "é漢\u202e", "n" * 300,
]  # fmt: skip
TABLES: list[Any] = [
    [], [0], [0, 0], [0, 0, 0], [[0, 0]], [1, "x"], [1e12, -1e12], [0] * 300, {}, {"at": [0, 0]}, {"x": 1},
    {"sigma": 0.1}, {"radial": 0.1}, {"plus": 0.1, "minus": 0}, {"a": {"b": {"c": 1}}},
    {"a": 2, "b": "a / 3"}, {"a": "b", "b": "a"}, {"a": [1, 2], "b": "copy / 2"}, {"leg": {"count": 2}},
    {"point": [0, 0], "angle": 90},
    {"fit": "H7/g6", "diameter": 12}, {"fit": "M6/s7", "diameter": 3}, {"fit": "K9/zz", "diameter": 1e3},
    {"hole": {"diameter": 12, "class": "H7"}, "pin": {"diameter": 12, "class": "k6"}}, {"bearing": "C3", "bore": 10},
    {"pert": 0.1}, {"triangular": 0}, {"beta": [0.5, 2]}, {"measured": [0, 0.1]}, {"csv": "x.csv", "column": "d"},
    {"normal": {"cpk": 1.33, "shift": 1.5, "drift": 0.5, "sorted": False}}, {"normal": {"sigma": 0.1}},
    [{"sources": ["l2", "J1.hole"], "rank": 1}], [{"sources": ["theta1", "l2"], "ranks": [[1, 0.5], [0.5, 1]]}],
    {"radial": 0.1, "tolerance": 0.2}, {"gap": 0.1, "tolerance": 0.05, "length": 40}, {"diameter": 12, "tolerance": 1},
    {"on": {"ground": [0, 0], "crank": "J2"}, "stiffness": 2, "free_length": 1}, {"joint": "J1", "stiffness": 1e-3},
    {"s": {"joint": "theta", "stiffness": 5, "preload": -1e12}}, {"deviation": 40, "tolerance": 15},
    {"expansion": 1e-5}, {"*": {"choices": [{"size": 0.1, "cost": 2}, {"size": 0.2, "cost": 1}]}},
    {"J1": {"model": "reciprocal", "b": 1, "from": 1e-3, "to": 1}},
    [{"fit": "H7/g6", "cost": 1}, {"size": 0, "cost": 9}],
    {"model": "exponential", "b": 2, "k": 1e9, "from": 1e-9, "to": 1e9},
    [{"force": [0, -10], "axes": "body"}], [{"moment": [0, 1, 2]}], [[0, -10], [0, -12]],
]  # fmt: skip
#: deviations of a joint on a body, of place or direction
DEVIATIONS: list[Any] = [
    0.05, {"x": 0.02}, {"x": {"tolerance": 0.1, "deviation": 0.05}, "y": 0.01}, {"z": 0.01}, {"diameter": 0.1},
    {"diameter": 0.1, "length": 30}, {"diameter": 0.1, "spherical": True}, {"diameter": 0.1, "deviation": [0.01, 0]},
    {"angle": 0.1}, {"side": 0.1, "normal": {"tolerance": {"sigma": 0.1}}}, {"diameter": 1e9, "length": 1e-9}, {},
    {"x": 1, "diameter": 1}, {"angle": 1e3},
]  # fmt: skip
COMPONENTS = ["x", "y", "z", "angle", "rx", "ry", "rz", "a", "alpha", "d", "theta"]
#: names that results, files and formats have a use of their own for
NAMES = [
    "x", "y", "angle", "error", "status", "configuration", "component", "nominal", "source", "sources", "worst_offset",
    "output", "ground", "type", "at", "title", "units", "bin", "step", "mechanism", "joint", "parameter", "grid",
    "side", "spring", "springs", "temperature", "expansion", "axes",
    "Ω", "漢", "a b", "a/b", "a.b", "*", "", "n" * 100, "n" * 101, "CON", "..", "_ARRAY_DIMENSIONS", "coordinates",
    "across",
    "string5", "fingerprint", "\u009b31m", "$a$", "dtype", "drive_theta1", "theta1_unit",
]  # fmt: skip
#: as often as this a configuration is asked for: more is only slow
MOST = 30


def raw(random: Random) -> bytes:
    """An example with bytes flipped, put in, deleted, repeated, or the end cut off; at times any bytes at all."""
    if random.random() < 0.03:
        return random.randbytes(random.randrange(300))
    content = bytearray(TEXTS[random.choice(sorted(TEXTS))].encode())
    for _ in range(random.randint(1, 6)):
        at, length = random.randrange(len(content) + 1), random.randint(1, 30)
        match random.choice(["flip", "put", "put", "delete", "repeat", "move", "cut"]):
            case "flip" if at < len(content):
                content[at] ^= 1 << random.randrange(8)
            case "put":
                content[at:at] = random.choice(TOKENS) * random.choice([1, 1, 1, 2, 500])
            case "delete":
                del content[at : at + length]
            case "repeat":
                content[at:at] = content[at : at + length] * random.choice([1, 1, 20])
            case "move":
                piece = content[at : at + length]
                del content[at : at + length]
                to = random.randrange(len(content) + 1)
                content[to:to] = piece
            case "cut" if random.random() < 0.3:
                del content[at:]
    return bytes(content)


def places(node: Any, above: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Where there is a value."""
    below = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [p for key, value in below for p in [(*above, key), *places(value, (*above, key))]]


def at(node: Any, steps: tuple[str | int, ...]) -> Any:
    """The value at a place."""
    for step in steps:
        node = node[step]
    return node


def deviate(raw: Any, random: Random) -> None:
    """Let a joint deviate on one of its bodies, or against another one."""
    joints = raw.get("joints")
    if not isinstance(joints, dict) or not joints:
        return
    name = random.choice(sorted(joints))
    bodies = joints[name].get("on", joints[name].get("bodies", ())) if isinstance(joints[name], dict) else ()
    bodies = [body for body in bodies if isinstance(body, str)] or ["ground"]
    if random.random() < 0.7 and isinstance(joints[name], dict):
        off = {random.choice(bodies): copy.deepcopy(random.choice(DEVIATIONS))}
        joints[name][random.choice(["position", "direction"])] = off
        return
    link = {"body": random.choice(bodies), "between": [name, random.choice([*sorted(joints), "output"])]}
    raw["links"] = {"l": link | dict.fromkeys(random.sample(COMPONENTS, random.randint(1, 3)), 0.01)}


def renamed(node: Any, old: str, new: str) -> Any:
    """With another name, wherever it is."""
    if isinstance(node, dict):
        return {new if key == old else key: renamed(value, old, new) for key, value in node.items()}
    if isinstance(node, list):
        return [renamed(value, old, new) for value in node]
    return new if node == old else node


def structured(random: Random) -> bytes:
    """An example whose keys, values, names and tables are others."""
    raw: Any = tomllib.loads(TEXTS[random.choice(sorted(TEXTS))])
    other = tomllib.loads(TEXTS[random.choice(sorted(TEXTS))])
    for _ in range(random.choice([1, 1, 1, 2, 3])):
        spots = places(raw)
        if not spots:
            break
        spot = random.choice(spots)
        table, key = at(raw, spot[:-1]), spot[-1]
        match random.choice(
            ["number", "weird", "table", "swap", "foreign", "remove", "rename", "name", "repeat", "deviate"]
        ):
            case "number" if isinstance(table[key], int | float):
                table[key] = random.choice([-table[key], 1e-6 * table[key], 1e6 * table[key], 0, random.gauss(0, 100)])
            case "weird" | "number":
                table[key] = random.choice(SCALARS)
            case "table":
                table[key] = copy.deepcopy(random.choice(TABLES))
            case "swap":
                table[key] = copy.deepcopy(at(raw, random.choice(spots)))
            case "foreign":
                table[key] = copy.deepcopy(at(other, random.choice(places(other))))
            case "remove":
                del table[key]
            case "rename" if isinstance(key, str):
                table[random.choice(NAMES)] = table.pop(key)
            case "name":
                section = raw.get(random.choice(["joints", "drives", "dimensions", "bodies", "start"]))
                if isinstance(section, dict) and section:
                    raw = renamed(raw, random.choice(sorted(section)), random.choice(NAMES))
            case "deviate":
                deviate(raw, random)
            case "repeat" if isinstance(table, list):
                table += [copy.deepcopy(table[key])] * random.choice([1, MOST])
    _shorten(raw)
    try:
        return written(raw)
    except (TypeError, ValueError, AttributeError):
        return structured(random)


def written(raw: Any) -> bytes:
    """The text of a file, in which bodies keep their order, which has a meaning."""
    return next(iter(texts(None, raw))).encode()


def _shorten(node: Any) -> None:
    for value in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        _shorten(value)
    if isinstance(node, dict) and isinstance(node.get("count"), int) and MOST < node["count"] <= 1_000_000:
        node["count"] = MOST
