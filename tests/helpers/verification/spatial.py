"""Mechanisms in space: pinocchio, cone programs, geometry at the poses, free-body diagrams."""

import json
from typing import Any

import numpy as np

from helpers.oracles.cones import COORDINATES, Linearised
from helpers.oracles.loops import LOCKED, matrices, offsets
from helpers.oracles.pin import CHAINS, Tree
from jointplay import _core

from .subject import OK, Array, Check, Found, Subject

#: clearances so much smaller that reactions are those of the nominal pose
SMALL = 1e-6
SETS = ("journal", "sleeve", "guide", "plate", "ball")


def by_pinocchio(s: Subject) -> Found:
    """Joints of all bodies and the output along the whole path; how a rod turns about its own line is left open."""
    parts, tree = [], Tree(s.spec)
    points = [s.spec["points"][joint[end]] for joint in s.spec["joints"] for end in ("first", "second")]
    points = [p for p in points if p["body"] >= 0] + [s.spec["points"][s.spec["output"]["point"]]]
    q = tree.close(tree.start, s.at.drives[0])
    for k, drives in enumerate(s.at.drives):
        before = s.at.drives[max(k - 1, 0)]
        for part in np.linspace(0, 1, 9)[1:]:
            q = tree.close(q, (1 - part) * before + part * drives)
        bodies = tree.bodies()
        theirs = [bodies[p["body"]].act(np.array(p["at"])) for p in points]
        poses = s.at.poses[k]
        turned = matrices(poses)
        ours = [poses[p["body"], :3] + turned[p["body"]] @ p["at"] for p in points]
        parts.append(Found.of(ours, theirs, s.size))
        output = s.spec["points"][s.spec["output"]["point"]]["body"]
        parts.append(Found.of(turned[output], bodies[output].rotation))
    return Found.all(parts)


def drives_by_pinocchio(s: Subject) -> Found:
    parts, tree = [], Tree(s.spec)
    q = tree.close(tree.start, s.at.drives[0])
    for k, drives in enumerate(s.at.drives):
        before = s.at.drives[max(k - 1, 0)]
        for part in np.linspace(0, 1, 9)[1:]:
            q = tree.close(q, (1 - part) * before + part * drives)
        theirs = tree.jacobian(q)
        parts.append(Found.of(s.core.sensitivity(*s.one(k))["drive"][0], theirs, np.abs(theirs).max()))
    return Found.all(parts)


def measured(s: Subject) -> Found:
    """Displacements of all joints, measured at the poses of `given`, against the offsets that were given."""
    parts, rng = [], np.random.default_rng(1)
    for k in s.few:
        for _ in range(3):
            u, wanted, moved = _specimen(s.spec, rng)
            found = s.core.given(*s.one(k), u[None])
            poses = found["poses"][0]
            for got, want, joint in zip(offsets(s.spec, poses, moved), wanted, s.spec["joints"], strict=True):
                scale = [1.0 if name.startswith(("tilt", "roll")) else s.size for name in LOCKED[joint["kind"]]]
                parts.append(Found.of(got, want, scale))
            parts.append(_of_drives(s, k, poses, moved, u))
            point = s.spec["output"]["point"]
            body, at = s.spec["points"][point]["body"], moved.get(point, np.array(s.spec["points"][point]["at"]))
            place = poses[body, :3] + matrices(poses)[body] @ at
            parts.append(Found.of(s.at.output[k, :3] + found["error"][0, :3], place, s.size))
    return Found.all(parts)


def _of_drives(s: Subject, k: int, poses: Array, moved: dict[int, Array], u: Array) -> Found:
    """By how much driven coordinates are off their values: what a fixed joint at their place would hold."""
    kinds = [joint["kind"] for joint in s.spec["joints"]]
    driven = [(d["joint"], d.get("component") or COORDINATES[kinds[d["joint"]]]) for d in s.spec["drives"]]
    joints = [{**x, "kind": "fixed"} if j in dict(driven) else x for j, x in enumerate(s.spec["joints"])]
    held = {**s.spec, "joints": joints}
    now, nominal = offsets(held, poses, moved), offsets(held, s.at.poses[k], {})
    errors, first = np.zeros(len(driven)), 0
    for source in s.spec["sources"]:
        if source["kind"] == "drive":
            errors[source["drive"]] = u[first]
        first += len(source["centre"])
    parts = []
    for (j, coordinate), error in zip(driven, errors, strict=True):
        at = LOCKED["fixed"].index("roll" if coordinate == "angle" else coordinate)
        off = now[j][at] - nominal[j][at] - error
        off = (off + np.pi) % (2 * np.pi) - np.pi if coordinate == "angle" else off / s.size
        parts.append(Found.of(off, 0.0))
    return Found.all(parts)


def _specimen(spec: dict[str, Any], rng: np.random.Generator) -> tuple[Array, list[Array], dict[int, Array]]:
    """Parameters at random within their sets, the displacement of every joint, and the points that are moved."""
    values: list[Array] = []
    wanted = [np.zeros(len(LOCKED[joint["kind"]])) for joint in spec["joints"]]
    moved: dict[int, Array] = {}
    for source in spec["sources"]:
        ((kind, size),) = source["set"].items()
        u = rng.uniform(-1, 1, len(source["centre"]))
        if kind == "interval":
            u = np.array([rng.uniform(size["low"], size["high"])])
        else:
            length = size.get("radius", size.get("gap"))
            arm = max(float(v) for key, v in size.items() if key.startswith("half")) if kind != "ball" else 1.0
            names = LOCKED[spec["joints"][source["joint"]]["kind"]]
            is_angle = np.array([name.startswith(("tilt", "roll")) for name in names])
            u = 0.3 * u * length / np.where(is_angle, arm, 1.0)
        if source["kind"] == "clearance":
            wanted[source["joint"]] = u
        elif source["kind"] == "angle":
            wanted[source["joint"]][LOCKED["fixed"].index("roll")] = u[0]
        elif source["kind"] == "dimension":
            ends = [np.array(spec["points"][source[end]]["at"]) for end in ("from", "to")]
            along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            for point in (source["to"], *source.get("together", [])):
                moved[point] = moved.get(point, np.array(spec["points"][point]["at"])) + u[0] * along
        values.append(u)
    return np.concatenate(values), wanted, moved


def by_cone_program(s: Subject) -> Found:
    """Work of the load, and the pose as far as the load decides it."""
    parts = []
    for k in s.few:
        found = s.core.loaded(*s.one(k), False)
        closure = Linearised(s.spec, s.at.poses[k])
        best = closure.maximise(closure.load())
        want = closure.output() @ best.twists.ravel()
        gap = np.abs(found["error"][0] - want) - found["undetermined"][0]
        size = np.repeat([np.linalg.norm(want[:3]), np.linalg.norm(want[3:])], 3)
        size = np.maximum(size, 1e-3 * np.repeat([size.max(), size.max() / s.size], 3))
        parts.append(Found.of(np.maximum(gap, 0.0), 0.0, size))
    return Found.all(parts)


def multipliers(s: Subject) -> Found:
    """Reactions as the multipliers of the cone program; clearances are small, so that poses are the nominal ones."""
    spec = json.loads(json.dumps(s.spec))
    for source in spec["sources"]:
        ((_, size),) = source["set"].items()
        size |= {key: SMALL * size[key] for key in ("radius", "axial", "gap") if key in size}
    core, parts = _core.Mechanism(json.dumps(spec)), []
    for k in s.few:
        found = core.loaded(*s.one(k))
        if found["status"][0] != OK:
            continue
        closure = Linearised(s.spec, s.at.poses[k])
        best = closure.maximise(closure.load())
        force = np.linalg.norm(best.reactions[:, :3], axis=1).max()
        parts.append(Found.of(found["reaction"][0], best.reactions, np.repeat([force, force * s.size], 3)))
    return Found.all(parts)


def free_bodies(s: Subject) -> Found:
    """What is left of force and moment on every body at the loaded pose."""
    parts = []
    for k in s.few:
        found = s.core.loaded(*s.one(k))
        if found["status"][0] != OK:
            continue
        poses = s.core.given(*s.one(k), found["offset"])["poses"][0]
        turned, left = matrices(poses), np.zeros((len(poses), 6))

        def act(point: int, at: Array, wrench: Array, poses: Array = poses, left: Array = left) -> None:
            body = s.spec["points"][point]["body"]
            if body >= 0:
                lever = np.cross(at - poses[body, :3], wrench[:3])
                left[body] += np.concatenate([wrench[:3], wrench[3:] + lever])

        def place(point: int, poses: Array = poses, turned: Array = turned) -> Array:
            body, at = s.spec["points"][point]["body"], np.array(s.spec["points"][point]["at"])
            return at if body < 0 else poses[body, :3] + turned[body] @ at

        for load in s.spec["loads"]:
            act(load["point"], place(load["point"]), np.concatenate([load["force"], load["moment"]]))
        for joint, wrench in zip(s.spec["joints"], found["reaction"][0], strict=True):
            at = place(joint["second"])
            act(joint["second"], at, wrench)
            act(joint["first"], at, -wrench)
        force = np.abs(found["reaction"][0, :, :3]).max()
        parts.append(Found.of(left, 0.0, force * np.repeat([1.0, s.size], 3)))
    return Found.all(parts)


def is_in_pinocchio(s: Subject) -> bool:
    """Whether a tree of pinocchio's joints has all joints and drives of it."""
    kinds = all(joint["kind"] in (*CHAINS, "screw") for joint in s.spec["joints"])
    # Of the nominal pose, which no stiffness changes.
    return not s.planar and kinds and all(set(drive) <= {"joint", "compliance"} for drive in s.spec["drives"])


def is_known(s: Subject) -> bool:
    """Whether the cone programs and the geometry have all joints and sources of it."""
    kinds = all(joint["kind"] in LOCKED and not joint.get("compliance") for joint in s.spec["joints"])
    known = ("clearance", "dimension", "angle", "drive")
    simple = all(source["kind"] in known and not any(source["centre"]) for source in s.spec["sources"])
    plain = all(set(load) <= {"point", "force", "moment"} for load in s.spec["loads"])
    return not s.planar and kinds and simple and plain and set(s.spec["output"]) <= {"point"}


def is_determinate(s: Subject) -> bool:
    return is_known(s) and s.determinate


CHECKS = [
    Check(
        "poses",
        "pinocchio",
        ("pin",),
        "of the size",
        1e-10,
        "both are solved to rounding",
        is_in_pinocchio,
        by_pinocchio,
    ),
    Check(
        "sensitivities",
        "pinocchio, drives",
        ("pin",),
        "of the largest one",
        1e-10,
        "both are solved to rounding",
        lambda s: is_in_pinocchio(s) and s.determinate,
        drives_by_pinocchio,
    ),
    Check(
        "error at given offsets",
        "geometry at the poses",
        ("numpy",),
        "of the size",
        1e-10,
        "the closure is solved to rounding",
        is_determinate,
        measured,
    ),
    Check(
        "loaded pose, first order",
        "Clarabel, all bodies",
        ("clarabel",),
        "of the value",
        1e-5,
        "a cone program to 1e-12 in energy",
        is_known,
        by_cone_program,
    ),
    Check(
        "reactions",
        "Clarabel, multipliers",
        ("clarabel",),
        "of the largest force",
        1e-5,
        "clearances of 1e-6 of their size move lines of action",
        is_determinate,
        multipliers,
    ),
    Check(
        "reactions",
        "free-body diagrams",
        ("numpy",),
        "of the largest force",
        1e-8,
        "the tolerance of the equilibrium",
        is_determinate,
        free_bodies,
    ),
]
