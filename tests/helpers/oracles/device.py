"""A planar mechanism with all that scatters or loads it, closed from the data of its file and nothing else.

Every body carries its axes to (x, y) and turns them by an angle; the point of a joint on a body is

    p = R(link's angle) (position) + p0 + thermal growth + link's shift + dimension,    p0 as drawn

and a joint between a first body with point A and axis s and a second one with point B and axis t has
(n is s turned by 90 degrees)

    revolute      B - A = (x, y)                                drive: angle of the second body less that of the first
    prismatic     n . (B - A) = normal,  t - s = angle          drive: s . (B - A)
    pin_in_slot   n . (B - A) = normal
    fixed         B = A,                 t - s = angle

A follower has the row of a drive whose value is a polynomial or a natural cubic spline of its leader's coordinate.

Forces along what a label means follow from virtual work. Lengths are in mm, angles in degrees, forces in N.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[Any]
Raw = dict[str, Any]
#: offsets of every type of joint
OFFSETS = {"revolute": ("x", "y"), "prismatic": ("normal", "angle"), "pin_in_slot": ("normal",)}
#: an angle counts as an arc at this radius
RADIUS = 100.0
STEP = 1e-30


def turned(angle: Any, at: Any) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * at[0] - s * at[1], s * at[0] + c * at[1]])


class Device:
    """The mechanism of a file's data; `u` holds what deviates, by label, in the units of the file."""

    def __init__(self, raw: Raw) -> None:
        self.raw = raw
        names = [body for joint in raw["joints"].values() for body in joint["on"] if body != "ground"]
        self.bodies = list(dict.fromkeys(names))
        self.at: dict[tuple[str, str], Array] = {}
        self.axis: dict[tuple[str, str], float] = {}
        for name, joint in raw["joints"].items():
            for body, place in joint["on"].items():
                self.at[body, name] = np.array(place["at"] if isinstance(place, dict) else place, dtype=float)
                self.axis[body, name] = np.radians(place["axis"]) if isinstance(place, dict) else 0.0

    # places

    def growth(self, body: str, u: Raw) -> Any:
        own = self.raw.get("bodies", {}).get(body, {}).get("expansion", self.raw.get("expansion", 0.0))
        return own * u.get("temperature.difference", 0.0)

    def _deviations(self, key: str, body: str, joint: str) -> list[tuple[str, Raw]]:
        """Of the joint itself and of those at the same place of the body; where one begins, it moves nothing."""
        own = [(name, d) for name, d in self.raw.get(key, {}).items() if d["body"] == body]
        found = [(name, d) for name, d in own if d["between"][0] != joint]
        return [
            (n, d) for n, d in found if np.allclose(self.at[body, d["between"][1]], self.at[body, joint], atol=1e-9)
        ]

    def place(self, body: str, at: Any, u: Raw) -> Array:
        """A point of a body in its axes: a joint by name, or a place."""
        if not isinstance(at, str):
            return np.array(at) * (1.0 + self.growth(body, u))
        drawn, turn = self.at[body, at], self.turn_of_links(body, at, u)
        zone = "diameter" in self.raw["joints"][at].get("position", {}).get(body, {})
        off = [u.get(f"{at}.position.{body}.{c}{'' if zone else '.length'}", 0.0) for c in "xy"]
        point = drawn * (1.0 + self.growth(body, u)) + turned(turn, off)
        for name, _ in self._deviations("links", body, at):
            point = point + np.array([u.get(f"{name}.{c}.length", 0.0) for c in "xy"])
        for name, dimension in self._deviations("dimensions", body, at):
            along = drawn - self.at[body, dimension["between"][0]]
            point = point + along / np.linalg.norm(along) * u.get(f"{name}.length", 0.0)
        return point

    def turn_of_links(self, body: str, joint: str, u: Raw) -> Any:
        found = self._deviations("links", body, joint)
        return sum(np.radians(u.get(f"{name}.angle.angle", 0.0)) for name, _ in found)

    def direction(self, body: str, joint: str, u: Raw) -> Any:
        off = np.radians(u.get(f"{joint}.direction.{body}.angle", 0.0))
        return self.axis[body, joint] + off + self.turn_of_links(body, joint, u)

    def pose(self, q: Array, body: str) -> Array:
        k = 3 * self.bodies.index(body) if body != "ground" else None
        return np.zeros(3) if k is None else q[k : k + 3]

    def world(self, q: Array, body: str, at: Any, u: Raw) -> Array:
        x, y, angle = self.pose(q, body)
        return np.array([x, y]) + turned(angle, self.place(body, at, u))

    # closure

    def rows(self, q: Array, drives: Raw, u: Raw) -> Array:
        rows = []
        for name, joint in self.raw["joints"].items():
            (a, b), kind = joint["on"], joint["type"]
            apart = self.world(q, b, name, u) - self.world(q, a, name, u)
            along = self.pose(q, a)[2] + self.direction(a, name, u)
            if kind in ("revolute", "fixed"):
                rows += [apart[k] - u.get(f"{name}.{c}", 0.0) for k, c in enumerate("xy")]
            else:
                rows += [turned(-along, apart)[1] - u.get(f"{name}.normal", 0.0)]
            if kind in ("prismatic", "fixed"):
                turn = self.pose(q, b)[2] + self.direction(b, name, u) - along
                rows += [RADIUS * (turn - np.radians(u.get(f"{name}.angle", 0.0)))]
        for name, drive in self.raw["drives"].items():
            value = drives[name] + u.get(f"{name}.value", 0.0) + u.get(f"{name}.backlash.value", 0.0)
            rows += [self.commanded(q, drive["joint"], value, u)]
        for name, follower in self.raw.get("followers", {}).items():
            is_angle = self.raw["joints"][follower["joint"]]["type"] == "revolute"
            off = sum(u.get(f"{name}.{what}.{'angle' if is_angle else 'along'}", 0.0) for what in ("backlash", "error"))
            rows += [self.commanded(q, follower["joint"], self.curve(q, follower, u) + off, u)]
        return np.array(rows)

    def commanded(self, q: Array, joint: str, value: Any, u: Raw) -> Any:
        coordinate = self.coordinate(q, joint, u)
        if self.raw["joints"][joint]["type"] != "revolute":
            return coordinate - value
        return RADIUS * (coordinate - np.pi / 180.0 * value)

    def curve(self, q: Array, follower: Raw, u: Raw) -> Any:
        """Where a follower is led, in units of the file."""
        x, leader = self.coordinate(q, follower["follows"], u), follower["follows"]
        middle = (
            follower.get("origin", 0.0)
            if "polynomial" in follower
            else np.mean(follower["at"][:: len(follower["at"]) - 1])
        )
        if self.raw["joints"][leader]["type"] == "revolute":
            x = 180.0 / np.pi * x
            x = x - 360.0 * np.round((x.real - middle) / 360.0)
        if "polynomial" in follower:
            s, coefficients = x - middle, follower["polynomial"]
        else:
            at = np.array(follower["at"])
            k = int(np.clip(np.searchsorted(at, x.real) - 1, 0, len(at) - 2))
            s, coefficients = x - at[k], CubicSpline(at, follower["values"], bc_type="natural").c[::-1, k]
        return sum(c * s**k for k, c in enumerate(coefficients))

    def coordinate(self, q: Array, joint: str, u: Raw) -> Any:
        a, b = self.raw["joints"][joint]["on"]
        if self.raw["joints"][joint]["type"] == "revolute":
            links = self.turn_of_links(b, joint, u) - self.turn_of_links(a, joint, u)
            return self.pose(q, b)[2] - self.pose(q, a)[2] + links
        apart = self.world(q, b, joint, u) - self.world(q, a, joint, u)
        return turned(-self.pose(q, a)[2] - self.direction(a, joint, u), apart)[0]

    def slope(self, function: Any, q: Array) -> Array:
        """Derivatives along the poses by complex steps."""
        steps = STEP * 1j * np.eye(len(q))
        return np.stack([np.asarray(function(q + step)).imag / STEP for step in steps], axis=-1)

    def closed(self, q: Array, drives: Raw, u: Raw) -> Array:
        for _ in range(40):
            rows = self.rows(q, drives, u)
            if np.abs(rows).max() < 1e-11:
                return q
            step = np.linalg.solve(self.slope(lambda p: self.rows(p, drives, u), q), rows)
            q = q - step * min(1.0, 0.3 / max(np.abs(step[2::3]).max(), 1e-9))
        raise ArithmeticError("the loops do not close")

    def drives(self, k: int) -> Raw:
        return {name: drive["values"][k] for name, drive in self.raw["drives"].items()}

    def path(self) -> list[Array]:
        """The perfect mechanism along its drive values."""
        start = self.raw["start"]
        poses = [[start[b]["x"], start[b]["y"], np.radians(start[b]["angle"])] for b in self.bodies]
        q, found = np.array(poses, dtype=float).ravel(), []
        for k in range(len(next(iter(self.raw["drives"].values()))["values"])):
            before, now = self.drives(max(k - 1, 0)), self.drives(k)
            for part in np.linspace(0.0, 1.0, 5)[1:]:
                q = self.closed(q, {name: before[name] + part * (now[name] - before[name]) for name in now}, {})
            found.append(q)
        return found

    def output(self, q: Array, output: Raw, u: Raw) -> Array:
        at, angle = self.world(q, output["body"], output["at"], u), self.pose(q, output["body"])[2]
        if "relative_to" in output:
            x, y, turn = self.pose(q, output["relative_to"])
            at, angle = turned(-turn, at - np.array([x, y])), angle - turn
        return np.array([*at, np.degrees(angle)])

    # statics

    def pull(self, q: Array, loads: list[Raw], k: int, u: Raw) -> Array:
        """Work of loads and springs per displacement of the poses, in configuration k."""
        total = np.zeros(len(q))
        for load in loads:
            axes = {"body": load["body"]}.get(load.get("axes", "ground"), load.get("axes", "ground"))
            force = load["force"][k] if isinstance(load["force"][0], list) else load["force"]
            force, place = (
                turned(self.pose(q, axes)[2], force),
                lambda p, at=load: self.world(p, at["body"], at["at"], u),
            )
            total += force @ self.slope(place, q)
            total[3 * self.bodies.index(load["body"]) + 2] += load["moment"]
        for spring in self.raw.get("springs", {}).values():
            (a, at), (b, other) = spring["on"].items()

            def length(p: Array, a: str = a, at: Any = at, b: str = b, other: Any = other) -> Any:
                apart = self.world(p, b, other, u) - self.world(p, a, at, u)
                return np.sqrt(apart[0] ** 2 + apart[1] ** 2)

            tension = spring["preload"] + spring["stiffness"] * (length(q) - spring["free_length"])
            total -= tension * self.slope(length, q)
        return total

    def forces(self, q: Array, drives: Raw, u: Raw, pull: Array) -> dict[str, float]:
        """The force along every offset: per millimetre and per degree."""
        multipliers = np.linalg.solve(self.slope(lambda p: self.rows(p, drives, u), q).T, pull)
        labels = [f"{n}.{c}" for n, joint in self.raw["joints"].items() for c in OFFSETS.get(joint["type"], ())]
        labels += [label for label, _ in self.lost()]

        def row_rate(label: str) -> Array:
            ends = [self.rows(q, drives, {**u, label: u.get(label, 0.0) + step}) for step in (0.5, -0.5)]
            return ends[0] - ends[1]  # rows are linear in offsets

        return {label: -float(multipliers @ row_rate(label)) for label in labels}

    # clearances

    def lost(self) -> list[tuple[str, float]]:
        """Lost motion of drives and followers: its label, and half of it."""
        found = [(f"{name}.backlash.value", drive.get("backlash", 0.0)) for name, drive in self.raw["drives"].items()]
        for name, follower in self.raw.get("followers", {}).items():
            component = "angle" if self.raw["joints"][follower["joint"]]["type"] == "revolute" else "along"
            found.append((f"{name}.backlash.{component}", follower["backlash"]))
        return [(label, backlash / 2.0) for label, backlash in found]

    def play(self, joint: str, u: Raw) -> float:
        """Radius or gap at the sizes of the parts and the temperature."""
        clearance, (a, b) = self.raw["joints"][joint]["clearance"], self.raw["joints"][joint]["on"]
        if "hole" in clearance:
            diametral = clearance["hole"]["diameter"] - clearance["pin"]["diameter"]
            play = (diametral + u[f"{joint}.hole.size"] - u[f"{joint}.pin.size"]) / 2.0
        else:
            play = clearance.get("radial", clearance.get("gap")) + u.get(f"{joint}.size.size", 0.0)
        diameter = clearance.get("diameter", clearance.get("hole", {}).get("diameter", 0.0))
        return float(play + (self.growth(b, u) - self.growth(a, u)) * diameter / 2.0)

    def missing(self, joint: str, forces: dict[str, float], u: Raw) -> tuple[float, float]:
        """Work that a force could still do, as a share of the most that it can; how far the offset is outside."""
        entry = self.raw["joints"][joint]
        labels = [f"{joint}.{c}" for c in OFFSETS[entry["type"]]]
        scales = [1.0, np.radians(entry["clearance"]["length"]) / 2.0] if entry["type"] == "prismatic" else [1.0, 1.0]
        scaled = list(zip(labels, scales, strict=False))
        force = np.array([forces[label] / scale for label, scale in scaled])
        offset = np.array([u[label] * scale for label, scale in scaled])
        play = self.play(joint, u)
        if entry["type"] == "revolute":
            most, outside = play * np.linalg.norm(force), np.linalg.norm(offset) - play
        else:
            most, outside = play * np.abs(force).max(), np.abs(offset).sum() - play
        return float(1.0 - force @ offset / most), float(outside)
