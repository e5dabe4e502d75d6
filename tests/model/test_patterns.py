"""Patterns: a part of the mechanism that the file has once is there several times."""

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
from helpers.answers import OVER_CONSTRAINED
from helpers.builders import planar
from jointplay.cli import run
from jointplay.file.schema import json_schema
from jointplay.model.mechanism import changed
from jointplay.model.patterns import written_out

RRR = """
format = 1
title  = "3-RRR"
units  = { length = "mm", angle = "deg", force = "N" }

[patterns.leg]
shared = ["platform"]

[patterns.leg.values]
x = [-260, 260, 0]
y = [-150, -150, 300]
px = [-69.282, 69.282, 0]
py = [-40, -40, 80]
turned = "120 * (copy - 1)"

[patterns.leg.joints.A]
type = "revolute"
on   = { ground = ["x", "y"], upper = [0, 0] }
clearance = { radial = 0.01 }

[patterns.leg.joints.B]
type = "revolute"
on   = { upper = [150, 0], lower = [0, 0] }
clearance = { radial = 0.01 }

[patterns.leg.joints.C]
type = "revolute"
on   = { lower = [150, 0], platform = ["px", "py"] }
clearance = { radial = 0.01 }

[patterns.leg.start]
upper = { angle = "73 + turned" }
lower = { angle = "turned - 13" }

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


@pytest.mark.parametrize(("name", "text", "rounded"), [("3-rrr", RRR, 1e-15), ("3-upu", UPU, 1e-11)])
def test_a_bundled_mechanism_as_a_pattern_is_the_same(name: str, text: str, rounded: float) -> None:
    """The numbers of the second file are rounded to twelve digits."""
    found, expected = jp.loads(text), jp.loads(jp.examples.text(name))
    assert found.joints[:2] == (("A_1", "B_1") if name == "3-rrr" else ("base_1.first", "base_1.second"))
    assert_same_spec(found, expected, rounded)
    for ask in (jp.worst, jp.loaded):
        a, b = ask(found), ask(expected)
        np.testing.assert_allclose(a.nominal, b.nominal, atol=1e-8)
        for variable in ("worst_position", "worst_rotation", "error"):
            if variable in a:
                np.testing.assert_allclose(a[variable], b[variable], rtol=1e-7, atol=1e-10)


def _turn(space: str, angle: float, axis: list[float]) -> np.ndarray:
    matrix = Rotation.from_rotvec(np.radians(angle) * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    return matrix[:2, :2] if space == "planar" else matrix


def _is_plain(name: str) -> bool:
    """Whether an example has one output, and nothing in it is repeated already."""
    tables = tomllib.loads(jp.examples.text(name))
    return "output" in tables and "patterns" not in tables


EVERY = [name for name in jp.examples.names() if _is_plain(name)]
#: one motor moves two joints, one of which counts from the ground
MOTOR_OF_SEVERAL = "belt-arm"


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
    for key in ("path", "grid", "target", "design"):
        raw.pop(key, None)
    for number, drive in enumerate(plain.drives):
        values = solved[drive].values[:2].tolist()
        raw["drives"][plain.drives[number]] |= {"values": values}
        for key in ("from", "to", "count"):
            raw["drives"][drive].pop(key, None)
    for load in raw.get("loads", ()):
        if isinstance(load.get("force", [0])[0], list):
            load["force"] = load["force"][:2]
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
    head = {key: raw.pop(key) for key in ("format", "units", "space", "title", "variables") if key in raw}
    alone = jp.Mechanism({**head, **copy.deepcopy(raw), "output": output})
    about = {"point": point, "angle": angle} | ({} if space == "planar" else {"axis": axis})
    at = output["at"]
    matrix = _turn(space, angle, axis)
    if isinstance(at, str):
        at = f"{at}_2"
    elif output["body"] in drawn:
        at = (point + matrix @ (np.array(at) - point)).tolist()
    # Costs name sources of the file as a whole.
    part = {"count": 2, "about": about, **{key: value for key, value in raw.items() if key != "costs"}}
    both_raw = {**head, "patterns": {"part": part}, "output": {"body": f"{output['body']}_2", "at": at}}
    if name == MOTOR_OF_SEVERAL:
        with pytest.raises(jp.InputError, match=r"part.drives.extend: a motor of several joints is not turned"):
            jp.Mechanism(both_raw)
        return
    both = jp.Mechanism(both_raw)
    questions = ["loaded"] * alone.has_loads + ["worst"] * (name not in OVER_CONSTRAINED)
    for question in questions or ["worst"]:
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


def _numbers(draw: st.DrawFn, size: int, low: float = -100.0, high: float = 100.0) -> list[float]:
    return [draw(st.floats(low, high).map(lambda x: round(x, 3))) for _ in range(size)]


def _direction(draw: st.DrawFn) -> list[float]:
    return [draw(st.sampled_from([-2.0, -1.0, 1.0, 3.0])) for _ in range(3)]


@st.composite
def planar_legs(draw: st.DrawFn) -> tuple[dict[str, Any], dict[str, Any]]:
    """A file with legs as a pattern, and the same with every leg written by hand."""
    count = draw(st.integers(1, 4))
    point, given = _numbers(draw, 2), draw(st.booleans())
    step = _numbers(draw, 1, -170, 170)[0] if given else 360 / count
    kinds = [draw(st.sampled_from(["revolute", "prismatic"])) for _ in range(2)]
    # No two joints of a body are at one place.
    at = [[x + 300 * k, y] for k, (x, y) in enumerate(_numbers(draw, 2) for _ in range(6))]
    axes = [_numbers(draw, 1, -180, 180)[0] for _ in range(4)]
    starts, centre, force = [_numbers(draw, 3) for _ in range(2)], _numbers(draw, 2), _numbers(draw, 2, 1, 9)
    values = sorted(_numbers(draw, 2))
    law, table = _numbers(draw, 3), [-101, *_numbers(draw, 1), 101]
    common: dict[str, Any] = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {"hold": {"type": "revolute", "on": {"ground": [0, 0], "platform": [7, 7]}}},
        "output": {"body": "platform", "at": [1, 2]},
    }

    def leg(k: int, suffix: str) -> dict[str, Any]:
        angle = k * step
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        turned = lambda p: [c * p[0] - s * p[1], s * p[0] + c * p[1]]  # noqa: E731
        moved = lambda p: [a + b for a, b in zip(turned([p[0] - point[0], p[1] - point[1]]), point, strict=True)]  # noqa: E731
        a, b, hip, knee, foot = (f"{name}{suffix}" for name in ("a", "b", "hip", "knee", "foot"))

        def on(kind: str, place: list[float], axis: float) -> Any:
            return place if kind == "revolute" else {"at": place, "axis": axis}

        joints = {
            hip: {
                "type": kinds[0],
                "on": {"ground": on(kinds[0], moved(at[0]), axes[0] + angle), a: on(kinds[0], at[1], axes[1])},
                "clearance": {"radial": 0.01} if kinds[0] == "revolute" else {"gap": 0.01, "length": 20},
            },
            knee: {"type": kinds[1], "on": {a: on(kinds[1], at[2], axes[2]), b: on(kinds[1], at[3], axes[3])}},
            foot: {"type": "revolute", "on": {b: at[4], "platform": moved(at[5])}, "clearance": {"diametral": 0.04}},
        }
        first = angle if kinds[0] == "revolute" else 0.0
        return {
            "joints": joints,
            "start": {
                body: dict(zip(("x", "y", "angle"), [*moved(start), start[2] + angle], strict=True))
                for body, start in zip((a, b), starts, strict=True)
            },
            "bodies": {a: {"mass": 2, "centre": centre}},
            "drives": {f"q{suffix}": {"joint": hip, "values": [v + first for v in values], "error": 0.1}},
            "followers": {
                f"f{suffix}": {"joint": knee, "follows": hip, "polynomial": [*law, 1], "origin": 5 + first},
                f"g{suffix}": {
                    "joint": foot,
                    "follows": "hold",
                    "at": table,
                    "values": [k * k - angle for k in range(3)],
                    "backlash": 0.1,
                },
            },
            "loads": [
                {"body": b, "at": knee, "force": turned(force), "moment": 3},
                {"body": b, "axes": "body", "force": force},
                {"body": b, "axes": "platform", "at": [5, 6], "force": turned(force)},
                {"body": "platform", "at": moved(at[5]), "force": [turned(force), turned(centre)], "moment": [1, 2]},
            ],
            "springs": {
                f"s{suffix}": {"on": {"ground": moved(centre), b: at[3]}, "stiffness": 2, "free_length": 40},
                f"p{suffix}": {"on": {a: hip, b: knee}, "stiffness": 2, "free_length": 40},
                f"t{suffix}": {"joint": foot, "stiffness": 3, "free_angle": 10 - angle},
            },
            "dimensions": {f"l{suffix}": {"body": b, "between": [knee, foot], "tolerance": 0.01}},
            "limits": {
                "joints": {hip: [first - 500, first + 500]},
                "drives": {f"q{suffix}": [first - 400, first + 400]},
            },
        }

    about = {"point": point} | ({"angle": step} if given else {})
    pattern = {**common, "patterns": {"leg": {"count": count, "about": about, "shared": ["platform"], **leg(0, "")}}}
    return pattern, _joined(common, [leg(k, f"_{k + 1}") for k in range(count)])


@st.composite
def spatial_legs(draw: st.DrawFn) -> tuple[dict[str, Any], dict[str, Any]]:
    """The same in space, with a leg whose upper body is drawn assembled, about any axis."""
    count = draw(st.integers(1, 4))
    point, about_axis = _numbers(draw, 3), _direction(draw)
    step = 360 / count
    kind = draw(st.sampled_from(["revolute", "cylindrical", "prismatic"]))
    at = [[x + 300 * k, y, z] for k, (x, y, z) in enumerate(_numbers(draw, 3) for _ in range(5))]
    dirs = [_direction(draw) for _ in range(4)]
    sides = [np.cross(d, [0.3, 1.7, -0.4]).tolist() for d in dirs]
    start, centre, force = [_numbers(draw, 3) for _ in range(2)], _numbers(draw, 3), _numbers(draw, 3, 1, 9)
    values = sorted(_numbers(draw, 2))
    common: dict[str, Any] = {
        "format": 1,
        "space": "spatial",
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {"hold": {"type": "spherical", "on": {"ground": [0, 0, 0], "platform": [7, 7, 7]}}},
        "output": {"body": "platform", "at": [1, 2, 3]},
    }

    def leg(k: int, suffix: str) -> dict[str, Any]:
        turn = Rotation.from_rotvec(k * step * np.array(about_axis) / np.linalg.norm(about_axis), degrees=True)
        turned = lambda v: turn.apply(v).tolist()  # noqa: E731
        moved = lambda p: (point + turn.apply(np.subtract(p, point))).tolist()  # noqa: E731
        a, b, hip, knee, foot = (f"{name}{suffix}" for name in ("a", "b", "hip", "knee", "foot"))
        play = {"gap": 0.01, "length": 20, "width": 10} if kind == "prismatic" else {"radial": 0.01, "length": 20}
        joints = {
            hip: {
                "type": kind,
                "on": {
                    "ground": {"at": moved(at[0]), "axis": turned(dirs[0]), "side": turned(sides[0])},
                    a: {"at": at[1], "axis": dirs[1], "side": sides[1]},
                },
                "clearance": play,
            },
            knee: {
                "type": "universal",
                "on": {
                    a: {"at": at[2], "axis": dirs[2], "side": sides[2]},
                    b: {"at": moved(at[3]), "axis": turned(dirs[3]), "side": turned(sides[3])},
                },
            },
            foot: {"type": "spherical", "bodies": [b, "platform"], "at": moved(at[4]), "clearance": {"radial": 0.02}},
        }
        rotation = turn * Rotation.from_rotvec(start[1], degrees=True)
        return {
            "joints": joints,
            "start": {
                a: dict(zip("xyz", moved(start[0]), strict=True)) | {"rotation": rotation.as_rotvec(True).tolist()}
            },
            "bodies": {a: {"mass": 2, "centre": centre}, b: {"mass": 1, "centre": moved(centre)}},
            "drives": {f"q{suffix}": {"joint": hip, "from": values[0], "to": values[1], "count": 3}},
            "loads": [
                {"body": b, "at": moved(at[4]), "force": turned(force), "moment": turned(force)},
                {"body": b, "axes": "body", "force": turned(force)},
                {"body": a, "axes": "body", "force": force},
                {"body": a, "axes": b, "force": [turned(force), turned(centre), turned(start[0])]},
            ],
            "springs": {f"s{suffix}": {"on": {b: moved(centre), a: centre}, "stiffness": 2, "free_length": 40}},
            "dimensions": {f"l{suffix}": {"body": a, "between": [hip, knee], "tolerance": 0.01}},
        }

    about = {"point": point, "axis": about_axis}
    pattern = {**common, "patterns": {"leg": {"count": count, "about": about, "shared": ["platform"], **leg(0, "")}}}
    return pattern, _joined(common, [leg(k, f"_{k + 1}") for k in range(count)])


def _joined(common: dict[str, Any], legs: list[dict[str, Any]]) -> dict[str, Any]:
    whole = copy.deepcopy(common)
    for leg in legs:
        for section, entries in leg.items():
            if section == "loads":
                whole.setdefault(section, []).extend(entries)
            elif section == "limits":
                for kind, ranges in entries.items():
                    whole.setdefault(section, {}).setdefault(kind, {}).update(ranges)
            else:
                whole.setdefault(section, {}).update(entries)
    return whole


@settings(max_examples=100, deadline=None)
@given(st.one_of(planar_legs(), spatial_legs()))
def test_a_pattern_is_the_file_that_is_written_out_by_hand(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    pattern, written = both
    found, expected = jp.Mechanism(pattern), jp.Mechanism(written)
    assert found.joints == expected.joints
    assert found.sources == expected.sources
    assert found.drives == expected.drives
    np.testing.assert_allclose(found.drive_values, expected.drive_values, atol=1e-12)
    # Rotation vectors of half a turn have two signs; poses and points are of the order of a metre.
    assert_same_spec(found, expected, 1e-9)
    for mine, other in zip(found.data.limits.joints.items(), expected.data.limits.joints.items(), strict=True):
        assert mine[0] == other[0]
        np.testing.assert_allclose(mine[1], other[1])


LEG = "patterns.leg"


@pytest.mark.parametrize(
    ("changes", "key", "said"),
    [
        ({"joints.A.clearance.radial": -1}, "joints.A.clearance.radial", "must not be negative: -1"),
        ({"joints.A.clearance.radial": "2 - copy"}, "joints.A.clearance.radial", "negative: -1.0 (copy 3)"),
        ({"joints.A.clearance.radial": "2 * ttl"}, "joints.A.clearance.radial", "is not one of [variables]"),
        ({"joints.A.clearance.lenght": 1}, "joints.A.clearance", "'lenght' is not a key here"),
        ({"joints.A.clearance.radial": 5000}, "joints.A.clearance", "is off by up to 5000 mm"),
        ({"joints.A.type": "prismatic"}, "joints.A.clearance", "'radial' is not a key"),
        ({"shared": ["platfrom"]}, "shared.0", "did you mean 'platform'?"),
        ({"shared": []}, "joints.C", "'platform' is a body outside the pattern, too"),
        ({"shared": ["upper"]}, "start.upper", "'upper' is shared by all copies"),
        ({"count": 2}, "", "here are x 3, y 3, px 3, py 3"),
        ({"count": 0}, "count", "must be at least 1: 0"),
        ({"count": "3"}, "count", "a whole number is needed"),
        ({"values": None}, "", "'count' is missing"),
        ({"values.x": [1, 2]}, "", "x 2, y 3"),
        ({"values.copy": [1, 2, 3]}, "", "'copy' is the number of the copy already"),
        ({"values.gap": 3}, "values.gap", "is a variable of the file already"),
        ({"values.x": ["a", 2, 3]}, "values.x", "'a' is not one of"),
        ({"values.pi": [1, 2, 3]}, "values", "has a meaning in expressions already"),
        ({"cuont": 3}, "", "did you mean 'count'?"),
        ({"patterns": {}}, "", "what is copied is not copied again"),
        ({"output": {}}, "", "'output' is a key of the file as a whole"),
        ({"about": {"axis": [0, 0, 1]}}, "about", "'axis' is a key in space"),
        ({"about": {"point": [0]}}, "about.point", "two values are needed"),
        ({"limits": {"position": 1}}, "limits", "'position' is a key of the file as a whole"),
        ({"limits": {"joints": {"D": [0, 1]}}}, "limits.joints.D", "'D' is not a joint of the pattern"),
        ({"limits": {"drives": {"a": [0, 1]}}}, "limits.drives.a", "'a' is not a drive of the pattern"),
        ({"dimensions.lower.between": ["B", "D"]}, "dimensions.lower.between.1", "'D' is not a joint"),
        ({"dimensions.lower.body": "lowre"}, "dimensions.lower.body", "did you mean 'lower'?"),
        ({"drives": {"q": {"joint": "D", "values": [0]}}}, "drives.q.joint", "'D' is not a joint"),
        ({"loads": [{"body": "uper", "force": [0, 1]}]}, "loads.0.body", "did you mean 'upper'?"),
        ({"bodies": {"platform": {"mass": 1}}}, "bodies.platform", "'platform' is shared by all copies"),
        ({"start.uper": {"angle": 1}}, "start.uper", "did you mean 'upper'?"),
    ],
)
def test_a_mistake_in_a_pattern_is_refused_where_it_was_written(changes: dict[str, Any], key: str, said: str) -> None:
    m = jp.loads(RRR.replace("[patterns.leg]", "[variables]\ngap = 1\n[patterns.leg]", 1))
    with pytest.raises(jp.InputError) as refused:
        m.with_({f"{LEG}.{k}": value for k, value in changes.items()})
    assert refused.value.key == (f"{LEG}.{key}" if key else LEG)
    assert said in refused.value.problem


def test_the_position_of_a_start_turns_as_a_whole() -> None:
    m = jp.loads(RRR)
    with pytest.raises(jp.InputError, match=r"patterns.leg.start.upper: .* given as a whole; missing: y"):
        m.with_({f"{LEG}.start.upper.x": 3, f"{LEG}.about": {}})


@pytest.mark.parametrize(
    ("outside", "key", "said"),
    [
        ({"joints.A_2": {"type": "revolute", "on": {"ground": [9, 9], "arm": [0, 0]}}}, "joints.A", "called 'A_2'"),
        ({"joints.A": {"type": "revolute", "on": {"ground": [9, 9], "arm": [0, 0]}}}, "joints.A", "given outside"),
        ({"joints.X": {"type": "revolute", "on": {"ground": [9, 9], "lower": [0, 0]}}}, "joints.B", "shared = "),
        ({"dimensions.lower_1": {"body": "platform", "between": ["C_1", "C_2"]}}, "dimensions.lower", "'lower_1'"),
        ({"patterns.arm": {"count": 1, "joints": {"A": {"type": "revolute", "on": {"ground": [0, 0], "x": [1, 1]}}}}},
         "joints.A", "which pattern arm has already"),
    ],
)  # fmt: skip
def test_a_name_means_one_thing(outside: dict[str, Any], key: str, said: str) -> None:
    with pytest.raises(jp.InputError) as refused:
        jp.loads(RRR).with_(outside)
    assert refused.value.key == f"{LEG}.{key}"
    assert said in refused.value.problem


def test_what_is_said_outside_of_one_copy() -> None:
    """Sections whose entries are bodies or joints of one copy need not be in the pattern."""
    tool = {"type": "fixed", "on": {"lower_3": [0, 9], "tool": [0, 0]}}
    m = jp.loads(RRR).with_({"bodies.lower_2.mass": 0.3, "gravity": [0, -9.81], "joints.tool": tool})
    assert m.data.bodies["lower_2"].mass == 0.3
    assert "lower_3" in m.data.joints["tool"].names


def test_all_copies_are_set_and_swept_at_once() -> None:
    m = jp.loads(RRR)
    key = f"{LEG}.joints.A.clearance.radial"
    assert m.value(key) == 0.01
    again = m.with_({key: 0.05})
    assert [again.data.joints[f"A_{k}"].clearance.radial for k in (1, 2, 3)] == [0.05] * 3
    swept = jp.sweep(m, key, [0.01, 0.05])
    assert swept.radial.attrs["units"] == "mm"
    np.testing.assert_array_equal(swept.worst_position[1], jp.worst(again).worst_position)
    again = m.with_({f"{LEG}.values.play": [0.01, 0.05, 0.01], f"{LEG}.joints.A.clearance.radial": "play"})
    assert again.with_({f"{LEG}.values.play.1": 0.02}).data.joints["A_2"].clearance.radial == 0.02
    assert pickle.loads(pickle.dumps(again)) == again
    assert changed(m, {"joints.*.clearance.radial": 0.02})[1] == ["joints.*.clearance.radial: 9 of 9 joints"]
    assert m.value("joints.*.clearance.radial") == 0.01
    assert m.with_({f"{LEG}.values.x": None, f"{LEG}.values.y": None, f"{LEG}.joints.A.on.ground": ["copy * 100", 0],
                    f"{LEG}.count": 3}).value(f"{LEG}.values.px") == [-69.282, 69.282, 0]  # fmt: skip


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("joints.A_2.clearance.radial", "'A_2' is a copy: patterns.leg.joints.A is for all copies"),
        ("joints.A.clearance.radial", "'A' is in a pattern: patterns.leg.joints.A"),
        ("patterns.leg.joints.E.clearance.radial", "'E' is not a joint"),
        ("patterns.log.count", "did you mean 'leg'?"),
    ],
)
def test_a_key_of_a_copy_is_that_of_its_pattern(key: str, said: str) -> None:
    with pytest.raises(jp.InputError) as refused:
        jp.loads(RRR).with_({key: 1})
    assert refused.value.key == key
    assert said in refused.value.problem


def test_a_pattern_in_an_included_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    begin, end = RRR.index("[patterns.leg]"), RRR.index("[start]\n")
    (tmp_path / "main.toml").write_text('include = ["leg.toml"]\n' + RRR[:begin] + RRR[end:])
    (tmp_path / "leg.toml").write_text(RRR[begin:end])
    assert jp.load(tmp_path / "main.toml") == jp.loads(RRR)
    assert run(["check", str(tmp_path / "main.toml")]) == 0
    assert "lower_3" in capsys.readouterr().out


def test_the_json_schema_knows_patterns() -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    for text in (RRR, UPU):
        data = tomllib.loads(text)
        validator.validate(data)
        for wrong in ({"cuont": 1}, {"count": 0}, {"shared": [1]}, {"joints": {"A": {"type": "revolut"}}}):
            assert not validator.is_valid({**data, "patterns": {"leg": {**data["patterns"]["leg"], **wrong}}})


def test_the_delta_by_hand_is_the_generated_one() -> None:
    """Its rods have balls at both ends, where the other one has crosses: without play there they are the same robot."""
    found = jp.loads(jp.examples.text("delta-by-hand"))
    found = found.with_({f"patterns.arm.joints.elbow{rod}.clearance": None for rod in "ab"})
    expected = jp.loads(jp.examples.text("delta"))
    expected = expected.with_({f"joints.elbow{arm}{rod}.clearance": None for arm in (1, 2, 3) for rod in "ab"})
    for ask in (jp.loaded, jp.worst):
        a, b = ask(found), ask(expected)
        assert (a.status == "ok").all()
        np.testing.assert_allclose(a.nominal, b.nominal, atol=1e-9)
        first = "error_first_order" if ask is jp.loaded else "worst_component_first_order"
        np.testing.assert_allclose(a[first], b[first], rtol=1e-9, atol=1e-11)
        # How the shafts tilt where it does not move the output to first order: (0.02 / 60)^2 of the robot's size.
        exact = "error" if ask is jp.loaded else "worst_component"
        np.testing.assert_allclose(a[exact], b[exact], atol=(0.02 / 60) ** 2 * 600)
    lines = [line for line in jp.examples.text("delta-by-hand").splitlines() if line and line[0] != "#"]
    assert len(lines) <= 45


def _tip(lengths: list[float]) -> np.ndarray:
    """Where the teeth of the excavator are: a triangle for every cylinder, two for the four-bar, all by hand."""
    v = tomllib.loads(jp.examples.text("excavator"))["variables"]

    def corner(a: complex, b: complex, opposite: float) -> float:
        return math.acos((abs(a) ** 2 + abs(b) ** 2 - opposite**2) / (2 * abs(a) * abs(b)))

    def angle(z: complex) -> float:
        return math.atan2(z.imag, z.real)

    base, eye = 700 - 600j, 2500 + 500j
    boom = angle(base) + corner(base, eye, lengths[0]) - angle(eye)
    base, eye = 2600 + 1050j - v["boom"], -750 + 300j
    stick = angle(base) - corner(base, eye, lengths[1]) - angle(eye)
    hinge = v["stick"] - v["pivot"]
    base = 150 + 480j - hinge
    rocker = v["rocker"] * np.exp(1j * (angle(base) - corner(base, v["rocker"], lengths[2])))
    top = hinge + rocker - v["stick"]
    bucket = angle(top) - corner(top, v["ear"], v["link"]) - math.radians(100)
    tip = v["boom"] + np.exp(1j * stick) * (v["stick"] + v["tip"] * np.exp(1j * bucket))
    place = np.exp(1j * boom) * tip
    return np.array([place.real, place.imag, math.degrees(boom + stick + bucket)])


def test_the_excavator_by_hand() -> None:
    m = jp.loads(jp.examples.text("excavator"))
    solved = jp.solve(m)
    lengths = np.column_stack([solved[f"length_{k}"].values for k in (1, 2, 3)])
    whole = np.array([_tip(list(row)) for row in lengths])
    np.testing.assert_allclose(solved.nominal[:, :2], whole[:, :2], rtol=1e-9)
    off = (solved.nominal[:, 2].values - whole[:, 2] + 180) % 360 - 180
    np.testing.assert_allclose(off, 0, atol=1e-8)
    # A cylinder that is too long, exactly.
    long = jp.given(m, {"length_2": 0.4})
    expected = np.array([_tip([row[0], row[1] + 0.4, row[2]]) for row in lengths]) - whole
    np.testing.assert_allclose(long.error, expected, atol=1e-7)
    # All pins by one value: what the clearances do is in proportion to it.
    bare = m.with_({"dimensions": None, "patterns.cylinder.joints.guide.clearance": None,
                    "patterns.cylinder.drives.length.error": None})  # fmt: skip
    swept = jp.sweep(bare, "variables.play", [0.1, 0.3])
    first = swept.worst_position_first_order.values
    np.testing.assert_allclose(first[1], 3 * first[0], rtol=1e-9)


@pytest.mark.parametrize(
    "law", [{"polynomial": [20, 0.5, -0.002, 1e-5]}, {"at": [-150, 0, 90, 150], "values": [9, 20, 40, -5]}]
)
def test_followers_turn_with_their_copies(law: dict[str, list[float]]) -> None:
    """A leading angle counted within half a turn of zero: copies at 240 degrees took another branch of a polynomial."""
    b = planar()
    cam = b.pattern("cam", count=3, about={"point": [200, 100]})
    cam.revolute("shaft", ground=(0, 0), crank=(0, 0))
    cam.revolute("arm", ground=(80, 0), finger=(0, 0))
    cam.follower("law", joint="arm", follows="shaft", backlash=0.2, **law)
    cam.drive("q", joint="shaft", values=[0, 100, 140, -120])
    cam.load(body="finger", moment=3)
    b.output(body="finger_1", at=(50, 0))
    m = b.mechanism()
    assert m.sources == ("law_1.backlash", "law_2.backlash", "law_3.backlash")
    first = jp.loaded(m)
    for k in (2, 3):
        other = jp.loaded(m.with_({"output.body": f"finger_{k}"}))
        turn = np.exp(2j * np.pi * (k - 1) / 3)
        for name, centre in (("nominal", 200 + 100j), ("error", 0.0)):
            at = first[name].values[:, 0] + 1j * first[name].values[:, 1]
            there = other[name].values[:, 0] + 1j * other[name].values[:, 1]
            np.testing.assert_allclose(there, centre + turn * (at - centre), atol=1e-9)


def test_a_table_of_a_follower_in_a_pattern_is_read(tmp_path: Path) -> None:
    """One called `law` was taken for the law of a tolerance, and a plate that its follower moves for a misspelt one."""
    (tmp_path / "cam.csv").write_text("angle [rad];lift [cm]\n-1;0.1\n0;0.4\n1.5;-0.2\n")
    path = tmp_path / "cams.toml"
    path.write_text(
        """
format = 1
units = { length = "mm", angle = "deg", force = "N" }
[joints]
shaft = { type = "revolute", on = { ground = [0, 0], crank = [0, 0] } }
[patterns.cam.values]
x = [50, 90]
[patterns.cam.joints.lift]
type = "prismatic"
on = { ground = { at = ["x", 0], axis = [0, 1] }, plate = [0, 0] }
[patterns.cam.followers.law]
joint = "lift"
follows = "shaft"
csv = "cam.csv"
columns = ["angle", "lift"]
[drives]
q = { joint = "shaft", values = [0] }
[output]
body = "plate_2"
"""
    )
    np.testing.assert_allclose(jp.solve(jp.load(path)).nominal.values[0, :2], [90, 4], atol=1e-12)
    path.write_text(path.read_text().replace('"angle", "lift"', '"angle", "left"'))
    with pytest.raises(jp.InputError, match=r"patterns\.cam\.followers\.law\.columns\.1"):
        jp.load(path)


def test_marks_and_eccentricities_turn_where_they_are_on_shared_bodies() -> None:
    """Planets around a sun: what is said of the sun turns, what is said of a planet is in its own axes."""
    gear = {
        "type": "gear",
        "on": {"sun": [0, 0], "planet": [0, 0]},
        "teeth": [30, 18],
        "module": 2,
        "marks": {"sun": [1, 0], "planet": 180},
        "runout": {"sun": {"tolerance": 0.1, "deviation": [0.02, 0]}, "planet": {"deviation": [0.02, 0]}},
    }
    pin = {"type": "revolute", "on": {"carrier": [48, 0], "planet": [0, 0]}}
    part = {"count": 3, "about": {}, "shared": ["sun", "carrier"], "joints": {"pin": pin, "mesh": gear}}
    data = written_out({"format": 1, "units": {"angle": "deg"}, "patterns": {"planet": part}}, "file.toml").data
    second = data["joints"]["mesh_2"]
    c, s = math.cos(math.tau / 3), math.sin(math.tau / 3)
    np.testing.assert_allclose(second["marks"]["sun"], [c, s], atol=1e-15)
    assert second["marks"]["planet_2"] == 180
    np.testing.assert_allclose(second["runout"]["sun"]["deviation"], [0.02 * c, 0.02 * s], atol=1e-15)
    assert second["runout"]["planet_2"]["deviation"] == [0.02, 0]
    np.testing.assert_allclose(data["joints"]["pin_2"]["on"]["carrier"]["at"], [48 * c, 48 * s], atol=1e-13)


def test_deviations_of_places_turn_as_zones() -> None:
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "patterns": {
            "arm": {
                "count": 3,
                "about": {},
                "joints": {
                    "pin": {
                        "type": "revolute",
                        "on": {"ground": [100, 0], "rod": [0, 0]},
                        "position": {"ground": {"diameter": 0.2, "deviation": [0.01, 0]}, "rod": {"x": 0.01}},
                    },
                    "end": {"type": "fixed", "on": {"rod": [80, 0], "tool": [0, 0]}},
                },
                "drives": {"q": {"joint": "pin", "values": [0]}},
                "links": {"length": {"body": "rod", "between": ["pin", "end"], "x": 0.02}},
            }
        },
        "output": {"body": "tool_3", "at": [20, 0]},
    }
    found = written_out(raw, "file.toml").data
    place = found["joints"]["pin_2"]["position"]
    turned = [0.01 * math.cos(math.tau / 3), 0.01 * math.sin(math.tau / 3)]
    np.testing.assert_allclose(place["ground"]["deviation"], turned, atol=1e-15)
    either, far = ({"tolerance": {"plus": size, "minus": size}} for size in (0.01, 0.02))
    assert place["rod_2"] == {"x": either}
    assert found["links"]["length_3"] == {"body": "rod_3", "between": ["pin_3", "end_3"], "x": far}
    errors = [
        jp.worst(jp.Mechanism({**raw, "output": {"body": f"tool_{k}", "at": [20, 0]}})).worst_position[0]
        for k in (1, 2, 3)
    ]
    np.testing.assert_allclose(errors, errors[0], rtol=1e-9)
    with pytest.raises(jp.InputError, match=r"patterns.arm.joints.pin.position: x, y: axes of this body do not turn"):
        jp.Mechanism(raw).with_({"patterns.arm.joints.pin.position.ground": {"x": 0.1, "y": 0.1}})


def test_many_copies_are_read_in_bounded_time() -> None:
    arm = {"type": "revolute", "on": {"ground": ["copy", 0], "rod": [0, 0]}, "clearance": {"radial": 0.01}}
    part = {"count": 300, "joints": {"pin": arm}, "drives": {"q": {"joint": "pin", "values": [0, 1]}}}
    units = {"length": "mm", "angle": "deg", "force": "N"}
    m = jp.Mechanism({"format": 1, "units": units, "patterns": {"arm": part}, "output": {"body": "rod_300"}})
    assert len(m.joints) == 300
    np.testing.assert_allclose(jp.solve(m).nominal[0, :2], [300, 0], atol=1e-9)
