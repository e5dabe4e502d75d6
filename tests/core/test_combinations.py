"""All that a file can say of a mechanism at once, against a closure and statics that share nothing with it.

Several outputs, load cases, followers, loads along the path, springs, thermal growth, places, directions and links
that deviate, sizes that scatter, elastic bearings: each is tested by itself elsewhere. Here random mechanisms have any
of them together.
"""

import json
import math
from itertools import product
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.oracles.device import OFFSETS, RADIUS, Device

Raw = dict[str, Any]
CONFIGURATIONS = 3
#: what the smallest singular value of a mechanism has to exceed, angles as arcs
LEAST = 0.03


def toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list | tuple | np.ndarray):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value if isinstance(value, str | int) else float(value))


class Draft:
    """A random mechanism, drawn assembled: bodies hang on others by a driven joint, or on two by a pair of rods."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.play = 10 ** rng.uniform(-3.0, -0.7)
        self.frames = {"ground": np.zeros(3)}
        self.places = {"ground": [np.zeros(2)]}
        self.joints: Raw = {}
        self.driven: list[str] = []

    def maybe(self, chance: float = 0.5) -> bool:
        return bool(self.rng.uniform() < chance)

    def pick(self, names: Any) -> str:
        return str(self.rng.choice(list(names)))

    def away(self, at: Any) -> Any:
        angle = self.rng.uniform(0, 2 * np.pi)
        return at + self.rng.uniform(50, 120) * np.array([np.cos(angle), np.sin(angle)])

    def body(self, *places: Any) -> str:
        name = f"body{len(self.frames)}"
        self.frames[name] = np.array([*self.rng.uniform(-60, 60, 2), self.rng.uniform(-180, 180)])
        self.places[name] = list(places)
        return name

    def local(self, body: str, at: Any) -> list[float]:
        (x, y, angle), (u, v) = self.frames[body], at
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        return [c * (u - x) + s * (v - y), c * (v - y) - s * (u - x)]

    def join(self, kind: str, a: str, b: str, at: Any) -> str:
        name, axis = f"J{len(self.joints)}", self.rng.uniform(-180, 180)
        on: Raw = {body: self.local(body, at) for body in (a, b)}
        for body in (a, b) if kind in ("prismatic", "fixed") else (a,) if kind == "pin_in_slot" else ():
            on[body] = {"at": on[body], "axis": axis - self.frames[body][2]}
        self.joints[name] = {"type": kind, "on": on}
        return name

    def grow(self) -> None:
        base = self.pick(self.frames)
        at = self.places[base][-1]
        moving = [body for body in self.frames if body != "ground"]
        kind = self.pick(("crank", "slider", "fixed", "dyad", "slot")) if moving else "crank"
        if kind in ("crank", "slider"):
            body = self.body(at, self.away(at))
            self.driven.append(self.join("revolute" if kind == "crank" else "prismatic", base, body, at))
        elif kind == "fixed":
            self.join("fixed", base, self.body(at, self.away(at)), at)
        else:
            base, other = self.pick(moving), "ground"
            at = self.places[base][-1]
            end = self.away(at)
            if kind == "slot":
                rod = self.body(at, end)
                self.join("revolute", base, rod, at)
                self.join("pin_in_slot", other, rod, end)
            else:
                middle = self.away((at + end) / 2)
                rods = self.body(at, middle), self.body(middle, end)
                kinds = ["revolute"] * 3
                kinds[self.rng.integers(3)] = self.pick(("revolute", "prismatic"))
                self.join(kinds[0], base, rods[0], at)
                self.join(kinds[1], *rods, middle)
                self.join(kinds[2], rods[1], other, end)

    def off(self, size: float) -> Raw:
        tolerance, deviation = size * self.rng.uniform(0.1, 1.0), size * self.rng.uniform(-1.0, 1.0)
        return {"tolerance": tolerance, "deviation": deviation}

    def clearance(self, kind: str, *, sizes: bool) -> Raw:
        gap = self.play * self.rng.uniform(0.5, 1.0)
        if kind == "revolute" and sizes and self.maybe():
            hole = {"diameter": 12 + 2 * gap, "tolerance": 0.3 * gap}
            return {"hole": hole, "pin": {"diameter": 12, "tolerance": 0.2 * gap}}
        clearance = {"radial" if kind == "revolute" else "gap": gap}
        if kind == "prismatic":
            clearance["length"] = self.rng.uniform(20, 60)
        if sizes:
            clearance["tolerance"] = 0.3 * gap
        return clearance

    def load(self, moving: list[str], body: str) -> Raw:
        force = self.rng.uniform(-50, 50, (CONFIGURATIONS, 2)).tolist()
        load = {"body": body, "at": self.somewhere(body), "moment": self.rng.uniform(-3000, 3000)}
        load["force"] = force if self.maybe() else force[0]
        return load | ({"axes": "body" if self.maybe() else self.pick(moving)} if self.maybe() else {})

    def lead(self, raw: Raw) -> None:
        """Let some drives follow the first one, along curves through where both are."""
        first, *others = raw["drives"].items()
        for name, drive in others:
            if not self.maybe(0.6):
                continue
            del raw["drives"][name]
            x, y = first[1]["values"][0], drive["values"][0]
            law: Raw = {"origin": x, "polynomial": [y, *self.rng.uniform(-1, 1, 2) * (0.6, 0.01)]}
            if self.maybe(0.3):
                at = x + np.array([-40, -12, 3, 20, 45])
                law = {"at": at, "values": y + 0.3 * (at - x) + self.rng.uniform(-1, 1, 5) * [1, 1, 0, 1, 1]}
            law |= {"joint": drive["joint"], "follows": first[1]["joint"]}
            law |= {"backlash": self.rng.uniform(0.1, 1.0), "error": 0.02}
            raw.setdefault("followers", {})[f"f{name}"] = {
                k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in law.items()
            }

    def somewhere(self, body: str) -> Any:
        joints = [name for name, joint in self.joints.items() if body in joint["on"]]
        return self.pick(joints) if self.maybe(0.4) else self.rng.uniform(-50, 50, 2).tolist()

    def data(self, *, elastic: bool) -> Raw:
        for _ in range(self.rng.integers(2, 5)):
            self.grow()
        moving = [body for body in self.frames if body != "ground"]
        sizes, thermal, places, links = (self.maybe() for _ in range(4))
        on: dict[str, list[str]] = {}
        for name, joint in self.joints.items():
            kind = joint["type"]
            if kind in OFFSETS and self.maybe(0.9):
                joint["clearance"] = self.clearance(kind, sizes=sizes)
            if places:
                zone = {"diameter": self.play, "deviation": [0.2 * self.play, -0.3 * self.play]}
                sides = {c: self.off(self.play) for c in "xy"}
                joint["position"] = dict(zip(joint["on"], (zone, sides), strict=True))
            if places and kind in ("prismatic", "pin_in_slot"):
                joint["direction"] = {next(iter(joint["on"])): self.off(0.02)}
            if elastic and kind in OFFSETS:
                directions = {"revolute": ["radial"], "prismatic": ["normal", "tilt"], "pin_in_slot": ["normal"]}[kind]
                joint["stiffness"] = {d: 10 ** self.rng.uniform(3, 5) for d in directions}
            for body in joint["on"]:
                on.setdefault(body, []).append(name)
        raw: Raw = {"format": 1, "units": {"length": "mm", "angle": "deg", "force": "N"}, "joints": self.joints}
        raw["start"] = {body: dict(zip(("x", "y", "angle"), self.frames[body], strict=True)) for body in moving}
        raw["drives"], drawn = {}, Device(raw | {"drives": {}})
        poses = np.array([[*self.frames[b][:2], np.radians(self.frames[b][2])] for b in drawn.bodies]).ravel()
        for k, name in enumerate(self.driven):
            value = drawn.coordinate(poses, name, {})
            value = np.degrees(value) if self.joints[name]["type"] == "revolute" else value
            values = value + np.linspace(0, 10, CONFIGURATIONS) * self.rng.choice([-1, 1])
            raw["drives"][f"q{k}"] = {"joint": name, "values": values.tolist(), "error": 0.02}
        self.lead(raw)
        for drive in raw["drives"].values():
            if self.maybe(0.4):
                drive["backlash"] = self.rng.uniform(0.1, 1.0)
            if elastic and self.maybe():
                drive["stiffness"] = 10 ** self.rng.uniform(2.3, 5)
        for body, names in on.items():
            if links and len(names) > 1 and self.joints[names[1]]["type"] not in ("fixed", "pin_in_slot"):
                link = {"body": body, "between": names[:2], **{c: self.off(self.play) for c in "xy"}}
                raw.setdefault("links", {})[f"link_{body}"] = link | {"angle": self.off(0.02)}
            elif len(names) > 1 and self.maybe() and np.ptp([drawn.at[body, n] for n in names[:2]], axis=0).max() > 5:
                dimension = {"body": body, "between": names[:2], **self.off(self.play)}
                raw.setdefault("dimensions", {})[f"length_{body}"] = dimension
        if thermal:
            raw |= {"temperature": {"deviation": self.rng.uniform(-2, 2)}, "expansion": 12e-6}
            raw["bodies"] = {self.pick(self.frames): {"expansion": 23e-6}}
        raw["outputs"] = {f"out{k}": {"body": b, "at": self.somewhere(b)} for k, b in enumerate(moving[-2:])}
        if len(moving) > 1:
            raw["outputs"]["out0"]["relative_to"] = moving[-1]
        # What bears no load is open.
        raw["loads"] = [self.load(moving, body) for body in moving]
        raw["load_cases"] = {name: [self.load(moving, self.pick(moving))] for name in ("one", "two")}
        if self.maybe():
            ends = {body: self.rng.uniform(-100, 100, 2).tolist() for body in ("ground", self.pick(moving))}
            spring = {"on": ends, "stiffness": self.rng.uniform(0.1, 5), "preload": self.rng.uniform(-10, 10)}
            raw["springs"] = {"spring": spring | {"free_length": self.rng.uniform(10, 100)}}
        return raw


def well_conditioned(raw: Raw) -> bool:
    device = Device(raw)
    try:
        path = device.path()
    except (ArithmeticError, np.linalg.LinAlgError):
        return False
    for k, q in enumerate(path):
        slope = device.slope(lambda p, k=k: device.rows(p, device.drives(k), {}), q)
        arcs = slope / np.tile([1.0, 1.0, RADIUS], len(q) // 3)
        if slope.shape[0] != slope.shape[1] or np.linalg.svd(arcs, compute_uv=False)[-1] < LEAST:
            return False
    return True


def drawn(seed: int, *, elastic: bool = False) -> tuple[Raw, jp.Mechanism]:
    rng = np.random.default_rng([seed, elastic])
    for _ in range(100):
        raw = Draft(rng).data(elastic=elastic)
        if well_conditioned(raw):
            return raw, jp.loads("\n".join(f"{key} = {toml(value)}" for key, value in raw.items() if value))
    raise AssertionError(f"no well-conditioned mechanism from seed {seed}")


def deviations(raw: Raw, result: xr.Dataset, k: int) -> Raw:
    """What deviates in a configuration of a result, by label."""
    known = dict(zip(result.parameter.values.tolist(), result.offset.values[k].tolist(), strict=True))
    return {"temperature.difference": raw.get("temperature", {}).get("deviation", 0.0)} | known


def error(device: Device, name: str, q: Any, nominal: Any, u: Raw) -> Any:
    output = device.raw["outputs"][name]
    found = device.output(q, output, u) - device.output(nominal, output, {})
    found[2] = (found[2] + 180.0) % 360.0 - 180.0
    return found


def assert_pressed(device: Device, u: Raw, forces: dict[str, float], decided: xr.DataArray) -> None:
    """Every offset is where its force has done all the work that it can, and within its clearance."""
    most = max(map(abs, forces.values()))
    for name, joint in device.raw["joints"].items():
        own = [abs(forces[f"{name}.{c}"]) for c in OFFSETS.get(joint["type"], ())]
        if "clearance" in joint and bool(decided.sel(source=name)) and max(own) > 1e-6 * most:
            missing, outside = device.missing(name, forces, u)
            assert missing < 1e-6
            assert outside < 1e-9
    for label, half in device.lost():
        if half and abs(forces[label]) > 1e-6 * most:
            assert u[label] == pytest.approx(math.copysign(half, forces[label]), rel=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_given_offsets_move_every_output_as_an_independent_closure_says(seed: int) -> None:
    raw, m = drawn(seed)
    device, rng = Device(raw), np.random.default_rng(seed)
    path, known = device.path(), jp.given(m).isel(output=0)
    offsets = {
        label: value + rng.uniform(-0.05, 0.05) * (0.2 if label.endswith("angle") else 1.0)
        for label, value in zip(known.parameter.values.tolist(), known.offset.values[0].tolist(), strict=True)
        if label != "temperature.difference"
    }
    for result in (jp.given(m), jp.given(m, offsets)):
        for name in raw["outputs"]:
            own = result.sel(output=name)
            for k, nominal in enumerate(path):
                u = deviations(raw, own, k)
                q = device.closed(nominal, device.drives(k), u)
                np.testing.assert_allclose(own.error.values[k], error(device, name, q, nominal, u), atol=1e-9)


@pytest.mark.parametrize(("seed", "elastic"), [*product(range(8), [False, True])])
def test_loads_of_every_case_press_all_offsets_as_independent_statics_say(seed: int, elastic: bool) -> None:
    raw, m = drawn(seed, elastic=elastic)
    device, result = Device(raw), jp.loaded(m)
    path, settled = device.path(), 0
    for name in raw["outputs"]:
        for case, loads in raw["load_cases"].items():
            own = result.sel(output=name, load_case=case)
            for k, nominal in enumerate(path):
                # Where the load can hold it at several places, the statics by hand end at any of them.
                if str(own.status.values[k]) != "ok" or own.equilibria.values[k] > 1:
                    continue
                u, drives = deviations(raw, own, k), device.drives(k)
                q, moved = pressed(device, nominal, drives, u, [*raw["loads"], *loads], k)
                np.testing.assert_allclose(own.error.values[k], error(device, name, q, nominal, u), atol=1e-8)
                assert_pressed(device, u, moved, own.decided.isel(configuration=k))
                settled += 1
    assert settled


def pressed(device: Device, q: Any, drives: Raw, u: Raw, loads: list[Raw], k: int) -> tuple[Any, dict[str, float]]:
    """Pose and forces, with elastic bearings that yield by force over stiffness."""
    yielded: Raw = {}
    for _ in range(60):
        inside = u | {label: u.get(label, 0.0) + by for label, by in yielded.items()}
        q = device.closed(q, drives, inside)
        forces = device.forces(q, drives, inside, device.pull(q, loads, k, u))
        before, yielded = yielded, {}
        for name, joint in device.raw["joints"].items():
            for component in OFFSETS.get(joint["type"], ()) if "stiffness" in joint else ():
                label, is_angle = f"{name}.{component}", component == "angle"
                stiffness = joint["stiffness"]
                # The file has moments per degree; the force along an angle is work per degree.
                by = np.degrees(1.0) / stiffness["tilt"] if is_angle else 1.0 / next(iter(stiffness.values()))
                yielded[label] = forces[label] * by
        for name, drive in device.raw["drives"].items():
            if "stiffness" in drive:
                label, is_angle = f"{name}.backlash.value", device.raw["joints"][drive["joint"]]["type"] == "revolute"
                yielded[label] = forces[label] * (np.degrees(1.0) if is_angle else 1.0) / drive["stiffness"]
        if all(abs(value - before.get(label, np.inf)) < 1e-11 for label, value in yielded.items()):
            return q, forces
    raise AssertionError("the bearings do not settle")
