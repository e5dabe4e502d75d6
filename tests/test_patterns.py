"""Patterns: a part of the mechanism that the file has once is there several times."""

from __future__ import annotations

import copy
import math
import pickle
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import jointplay as jp
from jointplay.cli import run
from jointplay.model import changed
from jointplay.schema import json_schema

RRR = """
format = 1
title  = "3-RRR"
units  = { length = "mm", angle = "deg", force = "N" }

[patterns.leg]
count = 3
about = { point = [0, 0] }
shared = ["platform"]

[patterns.leg.joints.A]
type = "revolute"
on   = { ground = [-260, -150], upper = [0, 0] }
clearance = { radial = 0.01 }

[patterns.leg.joints.B]
type = "revolute"
on   = { upper = [150, 0], lower = [0, 0] }
clearance = { radial = 0.01 }

[patterns.leg.joints.C]
type = "revolute"
on   = { lower = [150, 0], platform = [-69.282, -40] }
clearance = { radial = 0.01 }

[patterns.leg.start]
upper = { angle = 73 }
lower = { angle = -13 }

[patterns.leg.dimensions.lower]
body = "lower"
between = ["B", "C"]
tolerance = 0.015

[start]
platform = { x = 0, y = 0, angle = 0 }

[drives]
a = { joint = "A_1", values = [73, 76, 79, 76, 73, 70, 67, 70], error = 0.01 }
b = { joint = "A_2", values = [193, 195, 193, 191, 189, 191, 193, 195], error = 0.01 }
c = { joint = "A_3", values = [313, 310, 313, 316, 313, 310, 313, 316], error = 0.01 }

[output]
body = "platform"
at   = [0, 0]

[[loads]]
force = [8, -20]
moment = 300
"""

UPU = """
format = 1
space  = "spatial"
units  = { length = "mm", angle = "deg", force = "N" }

[variables]
base = 300
top  = 150
height = 400
slope = "hypot(base - top, height)"

[patterns.leg]
count  = 3
about  = { axis = [0, 0, 1] }
shared = ["platform"]

[patterns.leg.joints.base]
type   = "universal"
bodies = ["ground", "lower"]
at     = ["base", 0, 0]
axes   = [[0, 1, 0], ["height / slope", 0, "(base - top) / slope"]]
clearance = { radial = 0.01, axial = 0.02, length = 40 }

[patterns.leg.joints.leg]
type = "prismatic"
clearance = { gap = 0.01, length = 80, width = 30 }

[patterns.leg.joints.leg.on]
lower = { at = ["base", 0, 0], axis = ["top - base", 0, "height"], side = ["height", 0, "base - top"] }
upper = { at = ["top", 0, "height"], axis = ["top - base", 0, "height"], side = ["height", 0, "base - top"] }

[patterns.leg.joints.top]
type   = "universal"
bodies = ["upper", "platform"]
at     = ["top", 0, "height"]
axes   = [["height", 0, "base - top"], [0, 1, 0]]
clearance = { radial = 0.01, axial = 0.02, length = 40 }

[patterns.leg.drives.l]
joint = "leg"

[path]
x = [0, 50]
y = [0, -30]
z = [400, 400]

[output]
body = "platform"
at   = [0, 0, "height"]

[[loads]]
force  = [0, 0, -100]
"""


def numbers(spec: Any) -> list[Any]:
    """Everything in a compiled mechanism, in order."""
    if isinstance(spec, dict):
        return [item for key in sorted(spec) for item in [key, *numbers(spec[key])]]
    if isinstance(spec, list | tuple):
        return [item for value in spec for item in numbers(value)]
    return [spec]


def assert_same_spec(found: jp.Mechanism, expected: jp.Mechanism, atol: float) -> None:
    a, b = numbers(found.spec()), numbers(expected.spec())
    assert len(a) == len(b)
    for x, y in zip(a, b, strict=True):
        assert x == y or abs(x - y) <= atol, (x, y)


@pytest.mark.parametrize(("name", "text", "rounded"), [("3-rrr", RRR, 1e-6), ("3-upu", UPU, 1e-11)])
def test_a_bundled_mechanism_as_a_pattern_is_the_same(name: str, text: str, rounded: float) -> None:
    """The numbers of the bundled files are rounded: to micrometres, and to twelve digits."""
    found, expected = jp.loads(text), jp.loads(jp.examples.text(name))
    assert found.joints[:2] == (("A_1", "B_1") if name == "3-rrr" else ("base_1.first", "base_1.second"))
    assert_same_spec(found, expected, rounded)
    for ask in (jp.worst, jp.loaded):
        a, b = ask(found), ask(expected)
        np.testing.assert_allclose(a.nominal, b.nominal, atol=2e-3)
        for variable in ("worst_position", "worst_rotation", "error"):
            if variable in a:
                np.testing.assert_allclose(a[variable], b[variable], rtol=1e-4, atol=1e-9)


def _turn(space: str, angle: float, axis: list[float]) -> np.ndarray:
    matrix = Rotation.from_rotvec(np.radians(angle) * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    return matrix[:2, :2] if space == "planar" else matrix


#: those that have no output of one body, or in which an order of assembly names bodies
EVERY = [name for name in jp.examples.names() if "patterns" not in jp.examples.text(name)]


@pytest.mark.parametrize("name", EVERY)
def test_a_turned_copy_of_any_mechanism_has_the_turned_errors(name: str) -> None:
    """Two copies of a bundled mechanism beside each other: the errors of the second are those of the first, turned.

    What a file leaves out, such as sides and second axes, would be taken from axes that do not turn.
    """
    plain = jp.loads(jp.examples.text(name)).with_({"assembly": None, "gravity": None, "limits": None})
    solved = jp.solve(plain)
    raw = copy.deepcopy(dict(plain.raw))
    space, angle, axis, point = raw.get("space", "planar"), 50.0, [1.0, -2.0, 3.0], [30.0, -40.0, 20.0]
    if space == "planar":
        axis, point = [0.0, 0.0, 1.0], point[:2]
    raw.pop("path", None)
    raw.pop("grid", None)
    for number, drive in enumerate(plain.drives):
        values = solved[drive].values[:2].tolist()
        raw["drives"][plain.drives[number]] |= {"values": values}
        for key in ("from", "to", "count"):
            raw["drives"][drive].pop(key, None)
    drawn = {body for joint in raw["joints"].values() for body in joint.get("bodies", ())}
    factor = 1e3 if raw["units"]["length"] == "mm" else 1.0
    assert raw["units"]["length"] in ("mm", "m")
    for body in raw.get("start", {}):
        pose = plain.spec()["guess"][plain.bodies.index(body)]
        words = ("x", "y") if space == "planar" else ("x", "y", "z")
        raw["start"][body] = dict(zip(words, (factor * v for v in pose), strict=False))
        if space == "planar":
            raw["start"][body]["angle"] = math.degrees(pose[2])
        else:
            rotation = Rotation.from_quat(pose[3:], scalar_first=True).as_rotvec(degrees=True)
            raw["start"][body]["rotation"] = rotation.tolist()
    output = raw.pop("output")
    for load in raw.get("loads", []):
        if "body" not in load:
            load |= {"body": output["body"], "at": load.get("at", output["at"])}
    head = {key: raw.pop(key) for key in ("format", "units", "space", "title") if key in raw}
    alone = jp.Mechanism({**head, **copy.deepcopy(raw), "output": output})
    about = {"point": point, "angle": angle} | ({} if space == "planar" else {"axis": axis})
    at = output["at"]
    matrix = _turn(space, angle, axis)
    if isinstance(at, str):
        at = f"{at}_2"
    elif output["body"] in drawn:
        at = (point + matrix @ (np.array(at) - point)).tolist()
    both = jp.Mechanism(
        {
            **head,
            "patterns": {"part": {"count": 2, "about": about, **raw}},
            "output": {"body": f"{output['body']}_2", "at": at},
        }
    )
    for question in ("loaded", "worst") if alone.has_loads else ("worst",):
        found, expected = getattr(jp, question)(both), getattr(jp, question)(alone)
        assert found.status.values.tolist() == expected.status.values.tolist()
        size = len(point)
        place = expected.nominal.values[:, :size]
        np.testing.assert_allclose(found.nominal[:, :size], point + (place - point) @ matrix.T, atol=1e-7)
        if question == "loaded":
            error = expected.error.values
            turned = [error[:, :size] @ matrix.T, error[:, 2:] if size == 2 else error[:, 3:] @ matrix.T]
            # What a load leaves open is given as one of its poses.
            if not expected.undetermined.values.any():
                np.testing.assert_allclose(found.error, np.hstack(turned), rtol=1e-5, atol=1e-8)
        else:
            for variable in ("worst_position_first_order", "worst_rotation_first_order"):
                if variable in expected:
                    np.testing.assert_allclose(found[variable], expected[variable], rtol=1e-5, atol=1e-9)
