"""Planar linkages: a sketch solver, an optimiser, cone programs, free-body diagrams."""

from dataclasses import replace
from typing import Any

import casadi
import numpy as np

from helpers.oracles import brute
from helpers.oracles.core_spec import MM, in_core
from helpers.oracles.linkage import Linkage
from helpers.oracles.optimiser import Optimiser
from helpers.oracles.primal import Primal
from helpers.oracles.sets import Source
from helpers.oracles.sketch import output_pose
from helpers.oracles.statics import imbalance

from .subject import OK, Array, Check, Found, Subject

#: work that an optimiser may find beyond that of `loaded` by rounding, as a part
MORE = 1e-8
#: poses of the core in the units of a linkage
IN_MM = np.array([MM, MM, 1.0])


def _scale(link: Linkage) -> Array:
    """An angle counts as the arc at the size of the mechanism."""
    return np.array([link.length, link.length, 1.0])


def _wrapped(pose: Array, near: Array) -> Array:
    """The pose with the whole turns of another one."""
    turns = np.round((near[2] - pose[2]) / (2 * np.pi))
    return pose + np.array([0.0, 0.0, 2 * np.pi * turns])


def drawn_poses(s: Subject) -> Found:
    parts = []
    for k in range(s.count):
        link, q, drives = s.linkage(k)
        ours = s.at.output[k] * IN_MM
        theirs = output_pose(link, q, drives, {})
        parts.append(Found.of(ours, _wrapped(theirs, ours), _scale(link)))
    return Found.all(parts)


def drawn_offsets(s: Subject) -> Found:
    """Three specimens at the limits of their clearances and tolerances.

    A sketch knows the direction of a clearance up to its sign. It is drawn near the poses of a closure of its own.
    """
    parts, rng = [], np.random.default_rng(1)
    for k in s.few:
        link, q, drives = s.linkage(k)
        for u in brute.draw(link, rng, 3):
            offsets = dict(zip(link.labels, u.tolist(), strict=True))
            near, closes = link.solve(q, drives, u)
            assert closes
            # Errors of drives are part of what a sketch is drawn with.
            off = [offsets.get(f"d{d}.value", 0.0) for d in range(len(drives))]
            theirs = output_pose(link, near, drives + off, offsets)
            found = s.core.given(*s.one(k), in_core(link, s.spec, u[None]))
            ours = (s.at.output[k] + found["error"][0]) * IN_MM
            parts.append(Found.of(ours, _wrapped(theirs, ours), _scale(link)))
    return Found.all(parts)


def largest_work(s: Subject) -> Found:
    """The pose of most work along the whole path; configurations with more work at another pose are a remark."""
    parts, remarks = [], []
    for k in range(s.count):
        link, q, drives = s.linkage(k)
        found = s.core.loaded(*s.one(k))
        if found["status"][0] != OK:
            continue
        u = _offsets(s, link, found["offset"][0])
        poses, _ = link.solve(q, drives, u)
        start = float(link.work(list(q), link.centre))
        work = float(link.work(list(poses), u)) - start
        play = [source for source in link.sources if source.gives_way]

        def done(p: list[Any], v: dict[str, Any], link: Linkage = link, start: float = start) -> Any:
            return link.work(p, v, casadi) - start

        search = Optimiser(link, q, drives, play, done, work)
        best = search.maximise()
        if best.value > work * (1.0 + MORE):
            share = 100 * (best.value / work - 1.0)
            remarks.append(f"in configuration {k} the load would do {share:.2g} % more work at another pose")
            continue
        error = link.out(best.poses, best.offsets) - link.out(q, dict.fromkeys(link.labels, 0.0))
        parts.append(Found.of(found["error"][0] * IN_MM, error, _scale(link)))
    return Found.all(parts, "; ".join(remarks))


def free_bodies(s: Subject) -> Found:
    """What is left of force and moment on every body at the loaded pose."""
    parts = []
    for k in s.few:
        link, q, drives = s.linkage(k)
        found = s.core.loaded(*s.one(k))
        u = _offsets(s, link, found["offset"][0])
        poses, closes = link.solve(q, drives, u)
        assert closes
        reactions = found["reaction"][0] * [1.0, 1.0, MM]
        left = imbalance(link, poses, u, reactions) / [1.0, 1.0, link.length]
        parts.append(Found.of(left, 0.0, np.abs(reactions[:, :2]).max()))
    return Found.all(parts)


def _offsets(s: Subject, link: Linkage, offset: Array) -> dict[str, float]:
    unit = in_core(link, s.spec, np.eye(len(link.labels)))
    return {label: float(offset[row > 0][0] / row.max()) for label, row in zip(link.labels, unit, strict=True)}


def by_optimiser(s: Subject) -> Found:
    """All eight extremes in the middle of the path, by random points, corners and IPOPT."""
    k = s.count // 2
    link, q, drives = s.linkage(k, widest=True)
    found = s.core.worst(*s.one(k))
    unit = np.array([MM, MM, 1.0])[:, None]
    low, high = (found["component"][0] * unit * [-1.0, 1.0]).T
    ours = {"position": MM * found["position"][0], "rotation": found["rotation"][0]}
    for i, name in enumerate(("x", "y", "angle")):
        ours |= {f"{name} low": low[i], f"{name} high": high[i]}
    # A distance has more local maxima than a component.
    starts = {"position": 12}
    theirs = {
        name: brute.worst(link, q, drives, name, np.random.default_rng(3), starts=starts.get(name, 6)).value
        for name in ours
    }
    # A component that hardly moves counts as a part of the largest.
    lengths = max(value for name, value in ours.items() if not name.startswith(("rotation", "angle")))
    scale = [ours["rotation"] or 1.0 if name.startswith(("rotation", "angle")) else lengths for name in ours]
    return Found.of([*ours.values()], [theirs[name] for name in ours], scale)


def least_energy(s: Subject) -> Found:
    """Work of a rigid mechanism, energy of an elastic one: its pose, as far as the load decides it."""
    link, q, drives = s.linkage(0)
    link, stiffness = _for_energy(s, link)
    best = Primal(link, q, drives, stiffness, 1e-4 * link.length).solve()
    assert best.solved
    found = s.core.loaded(*s.one(0), False)
    gap = np.abs(found["error"][0] * IN_MM - best.error) - found["undetermined"][0] * IN_MM
    size = np.abs(best.error[:2]).max()
    return Found.of(np.maximum(gap, 0.0), 0.0, [size, size, size / link.length])


def _for_energy(s: Subject, link: Linkage) -> tuple[Linkage, dict[str, float]]:
    """Tolerances at their known deviations; a joint that yields along its axis lets its second point move along it."""
    stays = [x if x.gives_way else replace(x, size=(0.0, 0.0)) for x in link.sources]
    joints, stiffness = list(link.joints), {}
    for k, joint in enumerate(s.spec["joints"]):
        along, *others = joint.get("compliance", [0.0])
        assert not any(others), "only bars that are stretched"
        if along:
            label, (x, y, _) = f"j{k}.stretch", joint["axis_second"]
            second = joints[k].second
            joints[k] = replace(joints[k], second=replace(second, moves=(*second.moves, (x, y, label))))
            stays.append(Source(label, "interval", (label,), (0.0, 0.0), (0.0,)))
            stiffness[label] = 1.0 / (MM * along)
    return replace(link, joints=joints, sources=stays), stiffness


def is_rigid(s: Subject) -> bool:
    return s.is_linkage and s.determinate


CHECKS = [
    Check(
        "poses",
        "SolveSpace, a sketch",
        ("python-solvespace",),
        "of the size",
        1e-9,
        "the solver stops at 1e-8 mm",
        is_rigid,
        drawn_poses,
    ),
    Check(
        "error at given offsets",
        "SolveSpace, a sketch",
        ("python-solvespace",),
        "of the size",
        1e-9,
        "the solver stops at 1e-8 mm",
        is_rigid,
        drawn_offsets,
    ),
    Check(
        "loaded pose",
        "IPOPT by casadi",
        ("casadi",),
        "of the size",
        1e-7,
        "the optimiser's gap of 1e-10 of the work",
        is_rigid,
        largest_work,
    ),
    Check(
        "reactions",
        "free-body diagrams",
        ("numpy",),
        "of the largest force",
        1e-8,
        "the tolerance of the equilibrium",
        is_rigid,
        free_bodies,
    ),
    Check(
        "worst case",
        "IPOPT by casadi",
        ("casadi",),
        "of the value",
        1e-6,
        "what counts as missed in checks.md",
        is_rigid,
        by_optimiser,
    ),
    Check(
        "loaded pose, first order",
        "Clarabel, all bodies",
        ("clarabel",),
        "of the value",
        1e-5,
        "a cone program to 1e-12 in energy",
        lambda s: s.is_linkage and not s.determinate,
        least_energy,
    ),
]
