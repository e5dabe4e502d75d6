"""Random elastic structures that are over-constrained: trusses, frames, platforms on legs. Files as plain tables.

All are drawn as assembled. Dimensions have known deviations, pins and balls have clearance. Every redundant
constraint is held by something elastic.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Tables = dict[str, Any]
Structure = Callable[[int], Tables]
#: N/mm^2
E, G = 210000.0, 80000.0


def truss(seed: int) -> Tables:
    """Nodes on two bars each, and one to three bars more; some of those that hold the nodes are rigid."""
    rng = np.random.default_rng([seed, 1])
    nodes = {f"G{k}": np.array([120.0 * k, 0.0]) + rng.uniform(-20, 20, 2) for k in range(int(rng.integers(2, 4)))}
    bars: list[tuple[str, str]] = []
    for k in range(int(rng.integers(2, 5))):
        a, b = (str(name) for name in rng.choice([*nodes], 2, replace=False))
        nodes[f"N{k}"] = _third(rng, nodes[a], nodes[b])
        bars += [(a, f"N{k}"), (b, f"N{k}")]
    others = [(a, b) for a in nodes for b in nodes if a < b and "N" in a + b and not {(a, b), (b, a)} & {*bars}]
    more = [others[k] for k in rng.permutation(len(others))[: int(rng.integers(1, 4))]]
    bodies = {f"{a}{b}": (a, b) for a, b in bars + more}
    data = _head("planar")
    for name, at in nodes.items():
        on = ["ground"] * (name[0] == "G") + [body for body, ends in bodies.items() if name in ends]
        if len(on) > 1:
            data["joints"][name] = {"type": "revolute", "bodies": on, "at": at.tolist()} | _clearance(rng)
    for body, (a, b) in bodies.items():
        if (a, b) in more or rng.random() < 0.8:
            by_area = {"E": E, "area": float(rng.uniform(5, 80))}
            data["bodies"][body] = by_area if rng.random() < 0.5 else {"stiffness": float(10 ** rng.uniform(3, 5))}
        if rng.random() < 0.6:
            data["dimensions"][body] = _deviation(rng, body, (a, b))
    at = str(rng.choice([name for name in nodes if name[0] == "N"]))
    data["output"] = {"body": data["joints"][at]["bodies"][0], "at": at}
    data["loads"] = [{"force": rng.normal(0, 300, 2).tolist()}]
    return data


def frame(seed: int) -> Tables:
    """Beams in the plane, clamped to each other and to the ground at both ends of their row; up to two pins."""
    rng = np.random.default_rng([seed, 2])
    count = int(rng.integers(3, 6))
    places = [np.array([100.0 * k, 0.0]) + rng.uniform(-35, 35, 2) for k in range(count + 1)]
    data = _row("planar", places, rng, pins=int(rng.integers(0, 3)))
    for k in range(count):
        inertia = {"inertia": float(rng.uniform(20, 2000))}
        data["bodies"][f"b{k}"] = {"E": E, "area": float(rng.uniform(10, 200))} | inertia
    data["loads"] = [{"force": rng.normal(0, 20, 2).tolist(), "moment": float(rng.normal(0, 500))}]
    data["loads"] += [_within(rng, places) | {"force": rng.normal(0, 20, 2).tolist()}]
    return data


def space_frame(seed: int) -> Tables:
    """Beams in space in a row, clamped to each other and to the ground at both ends."""
    rng = np.random.default_rng([seed, 3])
    count = int(rng.integers(2, 5))
    places = [np.array([100.0 * k, 0.0, 0.0]) + rng.uniform(-35, 35, 3) for k in range(count + 1)]
    data = _row("spatial", places, rng, pins=0)
    for k in range(count):
        bent = {"inertia": float(rng.uniform(20, 2000)), "G": G, "torsion": float(rng.uniform(20, 2000))}
        data["bodies"][f"b{k}"] = {"E": E, "area": float(rng.uniform(10, 200))} | bent
    data["loads"] = [{"force": rng.normal(0, 20, 3).tolist(), "moment": rng.normal(0, 500, 3).tolist()}]
    data["loads"] += [_within(rng, places) | {"force": rng.normal(0, 20, 3).tolist()}]
    return data


def legs(seed: int) -> Tables:
    """A rigid platform on seven to nine elastic legs, each on a universal joint and under a ball."""
    rng = np.random.default_rng([seed, 4])
    data = _head("spatial")
    for k in range(int(rng.integers(7, 10))):
        turn = 2.4 * k + rng.uniform(-0.3, 0.3)
        foot = np.array([200 * np.cos(turn), 200 * np.sin(turn), 0.0]) + rng.uniform(-30, 30, 3)
        top = np.array([100 * np.cos(turn + 1), 100 * np.sin(turn + 1), 250.0]) + rng.uniform(-30, 30, 3)
        along = (top - foot) / np.linalg.norm(top - foot)
        side = np.cross(along, rng.normal(size=3))
        side /= np.linalg.norm(side)
        axes = [side.tolist(), np.cross(along, side).tolist()]
        joint = {"type": "universal", "bodies": ["ground", f"leg{k}"], "at": foot.tolist(), "axes": axes}
        data["joints"][f"foot{k}"] = joint
        joint = {"type": "spherical", "bodies": [f"leg{k}", "platform"], "at": top.tolist()} | _clearance(rng)
        data["joints"][f"top{k}"] = joint
        data["bodies"][f"leg{k}"] = {"E": E, "area": float(rng.uniform(20, 80))}
        data["dimensions"][f"leg{k}"] = _deviation(rng, f"leg{k}", (f"foot{k}", f"top{k}"))
    data["output"] = {"body": "platform", "at": [0, 0, 260]}
    data["loads"] = [{"force": rng.normal(0, 300, 3).tolist(), "moment": rng.normal(0, 2e4, 3).tolist()}]
    return data


def _head(space: str) -> Tables:
    units = {"length": "mm", "angle": "deg", "force": "N"}
    return {"format": 1, "space": space, "units": units, "joints": {}, "bodies": {}, "dimensions": {}}


def _third(rng: np.random.Generator, a: Floats, b: Floats) -> Floats:
    """A place that is seen from two others under a good angle, well away from both."""
    middle, across = (a + b) / 2, np.array([a[1] - b[1], b[0] - a[0]])
    return np.asarray(middle + rng.choice([-1, 1]) * rng.uniform(0.4, 1.2) * across + rng.uniform(-0.2, 0.2) * (b - a))


def _clearance(rng: np.random.Generator) -> Tables:
    return {"clearance": {"radial": float(rng.uniform(0.005, 0.05))}} if rng.random() < 0.8 else {}


def _deviation(rng: np.random.Generator, body: str, between: tuple[str, str]) -> Tables:
    return {"body": body, "between": list(between), "deviation": float(rng.normal(0, 0.1))}


def _row(space: str, places: list[Floats], rng: np.random.Generator, pins: int) -> Tables:
    """Bodies b0, b1, ... from place to place; the output is within one of the first two."""
    data, count = _head(space), len(places) - 1
    pinned = rng.permutation(np.arange(1, count))[:pins]
    for k, at in enumerate(places):
        bodies = ["ground", "b0"] if k == 0 else [f"b{k - 1}", f"b{k}" if k < count else "ground"]
        joint = {"type": "revolute" if k in pinned else "fixed", "bodies": bodies, "at": at.tolist()}
        if k in pinned:
            joint |= _clearance(rng)
        elif space == "planar" and rng.random() < 0.5:
            joint["angle"] = {"deviation": float(rng.normal(0, 0.05))}
        data["joints"][f"J{k}"] = joint
    for k in range(count):
        data["dimensions"][f"b{k}"] = _deviation(rng, f"b{k}", (f"J{k}", f"J{k + 1}"))
    data["output"] = _within(rng, places[:3])
    return data


def _within(rng: np.random.Generator, places: list[Floats]) -> Tables:
    """A place within one of the bodies of a row."""
    k, part = int(rng.integers(len(places) - 1)), rng.uniform(0.2, 0.8)
    return {"body": f"b{k}", "at": ((1 - part) * places[k] + part * places[k + 1]).tolist()}


#: what there is of each, and what makes it
KINDS: dict[str, tuple[str, Structure]] = {
    "elastic trusses": ("with bars that are too long or too short and clearance in their pins", truss),
    "elastic frames": ("beams in a row, clamped at both ends, with up to two pins", frame),
    "elastic frames in space": ("beams in a row, clamped at both ends", space_frame),
    "elastic legs": ("seven to nine under a rigid platform, of odd lengths, with clearance in their balls", legs),
}
