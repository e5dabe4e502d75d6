"""Random mechanisms in space: closed loops of seven joints with one freedom each, and parallel robots.

All bodies are described in one assembled reference configuration, so that every mechanism closes by construction. The
displacement of a joint is told here a second time, from poses alone.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: locked components of every kind, in the order of the core
LOCKED = {
    "revolute": ("along", "side", "normal", "tilt_side", "tilt_normal"),
    "cylindrical": ("side", "normal", "tilt_side", "tilt_normal"),
    "prismatic": ("side", "normal", "roll", "tilt_side", "tilt_normal"),
    "spherical": ("x", "y", "z"),
    "planar": ("along", "tilt_side", "tilt_normal"),
    "fixed": ("along", "side", "normal", "roll", "tilt_side", "tilt_normal"),
}


def set_of(kind: str, rng: np.random.Generator, size: float) -> dict[str, Any]:
    """A clearance set of random proportions; `size` is the order of its translations in metres."""
    a, b, c = size * rng.uniform(0.3, 1.0, 3)
    arms = rng.uniform(0.02, 0.08, 3)
    return {
        "revolute": {"journal": {"radius": a, "half_length": arms[0], "axial": b}},
        "cylindrical": {"sleeve": {"radius": a, "half_length": arms[0]}},
        "prismatic": {"guide": {"gap": c, "half_length": arms[0], "half_width": arms[1], "half_height": arms[2]}},
        "spherical": {"ball": {"radius": a}},
        "planar": {"plate": {"gap": c, "half_normal": arms[1], "half_side": arms[2]}},
    }[kind]


def unit(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


class Builder:
    """Collects a mechanism whose bodies have ground axes in the reference configuration."""

    def __init__(self, bodies: int, rng: np.random.Generator) -> None:
        self.bodies, self.rng = bodies, rng
        self.points: list[dict[str, Any]] = []
        self.joints: list[dict[str, Any]] = []
        self.drives: list[dict[str, Any]] = []
        self.sources: list[dict[str, Any]] = []

    def point(self, body: int, at: Array) -> int:
        self.points.append({"body": body, "at": [float(x) for x in at]})
        return len(self.points) - 1

    def joint(self, kind: str, first: int, second: int, at: Array, clearance: float = 0.0, axis: Any = None) -> int:
        """A joint at a place of the reference configuration, its axis there, loosened if asked."""
        axis = unit(self.rng) if axis is None else axis
        side = np.cross(axis, unit(self.rng))
        axes = {
            "axis_first": list(axis),
            "axis_second": list(axis),
            "side_first": list(side),
            "side_second": list(side),
        }
        ends = {"first": self.point(first, at), "second": self.point(second, at)}
        self.joints.append({"kind": kind, **ends, **axes})
        if clearance:
            self.sources.append(
                {
                    "kind": "clearance",
                    "joint": len(self.joints) - 1,
                    "set": set_of(kind, self.rng, clearance),
                    "centre": [0.0] * len(LOCKED[kind]),
                    "law": "uniform",
                }
            )
        return len(self.joints) - 1

    def lost_motion(self, drive: int, joint: int, size: float) -> None:
        """Of a drive, more to one side than to the other."""
        sides = {"interval": {"low": -size, "high": 0.3 * size}}
        self.sources.append(
            {"kind": "backlash", "drive": drive, "joint": joint, "set": sides, "centre": [0.0], "law": "uniform"}
        )

    def spec(self, body: int, at: Array, load: tuple[Array, Array] | None = None) -> dict[str, Any]:
        """The mechanism as the core reads it, its output at a place of the reference configuration."""
        output = self.point(body, at)
        loads = [{"point": output, "force": list(load[0]), "moment": list(load[1])}] if load else []
        return {
            "space": "spatial",
            "n_bodies": self.bodies,
            "guess": [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]] * self.bodies,
            "length": 0.3,
            "singular_value": 1e-6,
            "points": self.points,
            "joints": self.joints,
            "drives": self.drives,
            "output": {"point": output},
            "loads": loads,
            "sources": self.sources,
        }


def loop(seed: int, clearance: float = 1e-4, lost: bool = False) -> dict[str, Any]:
    """Seven joints in a loop, one of them driven, play in all of them and, if asked, in the drive; a dimension."""
    rng = np.random.default_rng(seed)
    b = Builder(6, rng)
    places = rng.uniform(-0.3, 0.3, (7, 3))
    kinds = [str(rng.choice(["revolute", "revolute", "prismatic"])) for _ in range(7)]
    if kinds.count("prismatic") > 2:
        kinds = ["revolute"] * 5 + kinds[5:]
    for k, kind in enumerate(kinds):
        b.joint(kind, k - 1, k if k < 6 else -1, places[k], clearance)
    b.drives.append({"joint": 0})
    tolerance = {"interval": {"low": -clearance, "high": clearance}}
    points = {"from": b.joints[2]["second"], "to": b.joints[3]["first"]}
    b.sources.append({"kind": "dimension", **points, "set": tolerance, "centre": [0.0], "law": "uniform"})
    b.sources.append({"kind": "drive", "drive": 0, "set": tolerance, "centre": [0.0], "law": "uniform"})
    if lost:
        b.lost_motion(0, 0, clearance)
    return b.spec(2, rng.uniform(-0.3, 0.3, 3), (100 * rng.normal(size=3), rng.normal(size=3)))


def platform(seed: int, clearance: float = 1e-4, lost: bool = False) -> dict[str, Any]:
    """Six legs from the ground to a platform, with joints of every kind; five drives have lost motion if asked."""
    rng = np.random.default_rng(seed)
    b = Builder(20, rng)
    top = 0
    for leg in range(6):
        cross, lower, upper = 1 + 3 * leg, 2 + 3 * leg, 3 + 3 * leg
        angle = leg * np.pi / 3
        foot = np.array([0.3 * np.cos(angle + 0.2), 0.3 * np.sin(angle + 0.2), 0.0]) + rng.uniform(-0.03, 0.03, 3)
        head = np.array([0.15 * np.cos(angle - 0.2), 0.15 * np.sin(angle - 0.2), 0.4]) + rng.uniform(-0.03, 0.03, 3)
        along = (head - foot) / np.linalg.norm(head - foot)
        first = np.cross(along, unit(rng))
        first /= np.linalg.norm(first)
        b.joint("revolute", -1, cross, foot, clearance, first)
        b.joint("revolute", cross, lower, foot, clearance, np.cross(along, first))
        slide = b.joint("prismatic" if leg else "cylindrical", lower, upper, foot, clearance, along)
        b.joint("spherical" if leg else "planar", upper, top, head, clearance, along if not leg else None)
        b.drives.append({"joint": slide})
        if not leg:
            # A plane holds less than a ball, a cylinder less than a slide.
            b.drives.append({"joint": slide, "component": "angle"})
        elif lost:
            b.lost_motion(leg + 1, slide, clearance)
    b.joint("fixed", top, 19, np.array([0.0, 0.0, 0.5]))
    angle = {"interval": {"low": -1e-3, "high": 1e-3}}
    b.sources.append({"kind": "angle", "joint": len(b.joints) - 1, "set": angle, "centre": [0.0], "law": "uniform"})
    return b.spec(19, np.array([0.05, 0.1, 0.6]), (100 * rng.normal(size=3), rng.normal(size=3)))


def matrices(poses: Array) -> Array:
    """Rotation matrices [body, 3, 3] of poses [body, 7]."""
    w, x, y, z = poses[:, 3:].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def offsets(spec: dict[str, Any], poses: Array, moved: dict[int, Array]) -> list[Array]:
    """Displacement of every joint's locked components at poses [body, 7]; `moved` points are off their place."""
    position = np.vstack([poses[:, :3], np.zeros(3)])  # the ground has index -1
    rotation = np.concatenate([matrices(poses), np.eye(3)[None]])
    found = []
    for joint in spec["joints"]:
        ends, axes = [], []
        for end in ("first", "second"):
            body = spec["points"][joint[end]]["body"]
            ends.append(position[body] + rotation[body] @ moved.get(joint[end], spec["points"][joint[end]]["at"]))
            along = np.array(joint[f"axis_{end}"])
            side = np.array(joint[f"side_{end}"])
            side = side - (side @ along) * along
            side /= np.linalg.norm(side)
            axes.append(rotation[body] @ np.column_stack([along, side, np.cross(along, side)]))
        gap, (a, b) = ends[1] - ends[0], axes
        tilt = np.cross(a[:, 0], b[:, 0])
        values = dict(zip(("x", "y", "z"), gap, strict=True))
        values |= dict(zip(("along", "side", "normal"), a.T @ gap, strict=True))
        values |= {"tilt_side": tilt @ a[:, 1], "tilt_normal": tilt @ a[:, 2]}
        values["roll"] = np.arctan2(a[:, 2] @ b[:, 1], a[:, 1] @ b[:, 1])
        found.append(np.array([values[name] for name in LOCKED[joint["kind"]]]))
    return found
