"""Planar mechanisms with gears, racks and belts, closed by strings around base circles."""

import copy
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from helpers.oracles.sets import Source
from helpers.oracles.trains import Train

from .subject import OK, Array, Check, Found, Subject, subject


def is_coupled(s: Subject) -> bool:
    return s.planar and s.coupled


def is_determinate(s: Subject) -> bool:
    return is_coupled(s) and s.determinate


@cache
def followed(name: str, k: int) -> tuple[Train, Array]:
    """The independent closure, followed along the path of an example as far as configuration k; its poses."""
    s = subject(name)
    spec = copy.deepcopy(s.spec)
    machine: Any = SimpleNamespace(
        guess=spec["guess"],
        points=spec["points"],
        joints=spec["joints"],
        drives=[{"coefficient": 1.0, "also": [], **drive} for drive in spec["drives"]],
        loads=spec["loads"],
        sources=spec["sources"],
        displacements=spec["displacements"],
        length=spec["length"],
        output_point=spec["output"]["point"],
    )
    train = Train(machine)
    return train, train.follow(s.at.drives[: k + 1])


def at(s: Subject, k: int) -> tuple[Train, Array]:
    """The closure at a configuration, and its nominal poses there."""
    train, path = followed(s.name, k)
    return train, path[k]


def _scale(s: Subject) -> Array:
    return np.array([s.size, s.size, 1.0])


def by_strings(s: Subject) -> Found:
    _, theirs = followed(s.name, s.count - 1)
    gaps = s.at.poses - theirs
    gaps[..., 2] = (gaps[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return Found.of(gaps, 0.0, _scale(s))


def sets(s: Subject) -> list[tuple[Source, slice]]:
    """The sources as sets, and where their parameters are."""
    train, _ = at(s, 0)
    found = []
    for number, (source, first) in enumerate(zip(s.spec["sources"], train.first, strict=True)):
        ((kind, size),) = source["set"].items()
        part = slice(first, first + len(source["centre"]))
        found.append((Source(str(number), kind, (), tuple(size.values()), tuple(source["centre"])), part))
    return found


def given(s: Subject) -> Found:
    """Three specimens well within their clearances and tolerances, so that no teeth jam."""
    parts, rng = [], np.random.default_rng(1)
    for k in s.few:
        train, nominal = at(s, k)
        u = 0.5 * np.concatenate([kind.sample(rng, 3, boundary=False) for kind, _ in sets(s)], axis=-1)
        drives = np.repeat(s.at.drives[k : k + 1], 3, 0)
        poses, closes = train.close(np.repeat(nominal[None], 3, 0), drives, u)
        assert closes.all()
        found = s.core.given(drives, np.repeat(s.at.poses[k : k + 1], 3, 0), u)
        parts.append(Found.of(found["error"], train.output(poses) - train.output(nominal), _scale(s)))
    return Found.all(parts)


def pressed(s: Subject) -> Found:
    """The error at the offsets of `loaded`, and the work that the load could still do by any offset."""
    parts = []
    for k in s.few:
        train, nominal = at(s, k)
        found = s.core.loaded(*s.one(k))
        if found["status"][0] != OK:
            continue
        u = found["offset"][0]
        poses, closes = train.close(nominal, s.at.drives[k], u)
        assert closes
        parts.append(Found.of(found["error"][0], train.output(poses) - train.output(nominal), _scale(s)))
        slope = train.gradient(train.work, poses, s.at.drives[k], u)
        clearances = [pair for pair, x in zip(sets(s), s.spec["sources"], strict=True) if x["kind"] == "clearance"]
        most = [float(kind.support(slope[part])) for kind, part in clearances]
        done = [float(slope[part] @ (u[part] - kind.centre)) for kind, part in clearances]
        parts.append(Found.of(most, done, sum(most)))
    return Found.all(parts)


CHECKS = [
    Check(
        "poses",
        "strings on circles",
        ("numpy",),
        "of the size",
        1e-9,
        "Newton steps by differences",
        is_coupled,
        by_strings,
    ),
    Check(
        "error at given offsets",
        "strings on circles",
        ("numpy",),
        "of the size",
        1e-8,
        "Newton steps by differences",
        is_determinate,
        given,
    ),
    Check(
        "loaded pose",
        "strings on circles",
        ("numpy",),
        "of the size or the work",
        1e-6,
        "differences of the work",
        is_determinate,
        pressed,
    ),
]
