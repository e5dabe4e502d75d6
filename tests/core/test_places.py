"""Deviations of where joints are on their bodies, of their directions, and of links between them."""
# ruff: noqa: E501 (one mistake a line)

import copy
import itertools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.answers import EXAMPLES as ALL
from helpers.answers import example
from helpers.builders import planar, spatial
from helpers.layouts import KINDS
from helpers.places import deviating, turned
from helpers.strategies import mechanism
from jointplay import _core
from jointplay.analyses.nominal import nominal
from jointplay.basics import poses
from jointplay.errors import InputError
from jointplay.model.mechanism import in_core

#: the examples without patterns, whose copies have no deviations of their own
EXAMPLES = tuple(name for name in ALL if "patterns" not in example(name).raw)
#: those without couplings, whose teeth mesh where the wheels are drawn
UNCOUPLED = [name for name in EXAMPLES if not any("coupling" in joint for joint in example(name).core_spec["joints"])]
WIDTHS = ["plain", "avx2", "avx512"]


def pin(joint: str) -> str:
    """The joint of the file that a joint is, or is a part of."""
    return joint.partition("/")[0].removesuffix(".first").removesuffix(".second")


def by_hand(m: jp.Mechanism, off: dict[tuple[str, str], tuple[Any, Any]]) -> _core.Mechanism:
    """The mechanism with other numbers: every joint of the file on a body shifted by a vector (metres), and its axes
    turned by a rotation vector, both in body axes."""
    spec = copy.deepcopy(dict(m.spec()))
    spec |= {"sources": [], "displacements": []}
    owners = (*m.owners, "ground")
    moved = set()
    for name, joint in zip(map(pin, m.joints), spec["joints"], strict=True):
        for end in ("first", "second"):
            point = spec["points"][joint[end]]
            shift, turn = off.get((name, owners[point["body"]]), (np.zeros(3), np.zeros(3)))
            for axis in (f"axis_{end}", f"side_{end}"):
                if axis in joint:
                    joint[axis] = turned(joint[axis], turn)
            if joint[end] not in moved:
                point["at"] = (np.array(point["at"]) + shift).tolist()
                moved.add(joint[end])
    return in_core(spec)


def frame(m: jp.Mechanism, name: str, body: str) -> np.ndarray:
    """Axis, side and normal of a joint on a body, as rows."""
    for own, joint in zip(m.joints, m.core_spec["joints"], strict=True):
        for end in ("first", "second"):
            on = (*m.owners, "ground")[m.core_spec["points"][joint[end]]["body"]]
            if pin(own) == name and on == body:
                return poses.joint_axes(joint[f"axis_{end}"], joint.get(f"side_{end}", (0.0, 0.0, 1.0))).T
    raise AssertionError((name, body))


def drawn(m: jp.Mechanism, size: float, seed: int) -> tuple[jp.Mechanism, dict[tuple[str, str], tuple[Any, Any]]]:
    """Known deviations of all joints of a mechanism, in the file and as vectors."""
    rng = np.random.default_rng(seed)
    spatial = m.data.space == "spatial"
    changes: dict[str, Any] = {}
    off: dict[tuple[str, str], tuple[Any, Any]] = {}
    for name, joint in m.data.joints.items():
        for body in joint.names:
            shift = size * m.length * rng.uniform(-1, 1, 3) * (1, 1, spatial)
            turn = np.zeros(3)
            key = f"joints.{name}"
            by_component = dict(zip("xyz" if spatial else "xy", shift / m.units.length, strict=False))
            changes[f"{key}.position.{body}"] = {c: {"deviation": float(v)} for c, v in by_component.items()}
            if joint.has_direction(body):
                angles = size * rng.uniform(-1, 1, 2)
                degrees = [float(v / m.units.angle) for v in angles]
                if spatial:
                    turn = angles @ frame(m, name, body)[1:]
                    told = dict(zip(("side", "normal"), ({"deviation": v} for v in degrees), strict=True))
                else:
                    turn, told = np.array([0.0, 0.0, angles[0]]), {"deviation": degrees[0]}
                changes[f"{key}.direction.{body}"] = told
            off[name, body] = (shift, turn)
    return m.with_(changes), off


def assert_same_poses(m: jp.Mechanism, core: _core.Mechanism) -> None:
    """What is given with known deviations is the nominal mechanism whose numbers are others."""
    at = nominal(m)
    found = m.core.given(at.drives, at.poses, np.tile(m.centre, (len(at.drives), 1)))
    expected = core.trace(at.drives)["poses"]
    scale = np.array([m.length] * (2 if m.pose_size == 3 else 3) + [1.0] * (1 if m.pose_size == 3 else 4))
    sign = np.ones((*expected.shape[:2], 1))
    if m.pose_size == 7:
        sign = np.sign(np.sum(expected[..., 3:] * found["poses"][..., 3:], axis=-1, keepdims=True))
    factors = np.where(np.arange(m.pose_size) < 3, 1.0, sign) if m.pose_size == 7 else 1.0
    assert found["status"].tolist() == [0] * len(at.drives)
    np.testing.assert_allclose(found["poses"] / scale, expected * factors / scale, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", UNCOUPLED)
def test_known_deviations_are_other_numbers_in_the_file(name: str) -> None:
    """Large ones: three hundredths of the size and of a radian, of all joints at once."""
    m, off = drawn(example(name), 0.01 if name in ("3-upu", "3-rrr-spherical") else 0.03, 4)
    assert_same_poses(m, by_hand(m, off))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS)
def test_known_deviations_of_random_mechanisms_are_other_numbers(kind: str, seed: int) -> None:
    m, off = drawn(jp.loads(mechanism(kind, seed)), 0.01, seed)
    plain = m.with_({f"dimensions.{name}.tolerance": 0.0 for name in m.data.dimensions})
    assert_same_poses(plain, by_hand(plain, off))


@pytest.mark.parametrize("name", UNCOUPLED)
def test_a_link_shifts_and_turns_everything_at_its_second_joint(name: str) -> None:
    """Position and rotation vector of the second joint of every body, and of the joints drawn at its place but the first."""
    m, rng = example(name), np.random.default_rng(7)
    spatial, size = m.data.space == "spatial", 0.01
    on: dict[str, list[str]] = {}
    for joint, entry in m.data.joints.items():
        for body in entry.names:
            on.setdefault(body, []).append(joint)
    changes: dict[str, Any] = {}
    off: dict[tuple[str, str], tuple[Any, Any]] = {}
    for body, (first, second, *others) in ((body, joints) for body, joints in on.items() if len(joints) > 1):
        # Pins in the plane have no axis in the file; they count their angle from there.
        place = m.data.joints[second].placements[body].at
        there = [joint for joint in (second, *others) if m.data.joints[joint].placements[body].at == place]
        turns = all(m.data.joints[j].has_direction(body) or m.data.joints[j].kind == "fixed" for j in there)
        shift = size * m.length * rng.uniform(-1, 1, 3) * (1, 1, spatial)
        turn = size * rng.uniform(-1, 1, 3) * ((1, 1, 1) if spatial else (0, 0, 1)) * turns
        keys = [*"xyz", "rx", "ry", "rz"] if spatial else ["x", "y", "", "", "", "angle"]
        values = [*(shift / m.units.length), *(turn / m.units.angle)]
        told = {key: {"deviation": float(v)} for key, v in zip(keys, values, strict=True) if key and v}
        changes[f"links.link_{body}"] = {"body": body, "between": [first, second], **told}
        off |= {(joint, body): (shift, turn) for joint in there}
    m = m.with_(changes)
    assert_same_poses(m, by_hand(m, off))


@pytest.mark.parametrize("name", EXAMPLES)
def test_columns_are_finite_differences(name: str) -> None:
    m = deviating(example(name))
    at = nominal(m)
    drives, placed = at.drives[-1:], at.poses[-1:]
    columns = m.core.sensitivity(drives, placed)["source"][0].T
    steps = np.where(m.parameter_factors == m.units.length, 1e-6 * m.length, 1e-6)
    u = np.vstack([np.diag(steps), np.diag(-steps)])
    found = m.core.given(np.repeat(drives, len(u), 0), np.repeat(placed, len(u), 0), u)["error"]
    slopes = (found[: len(steps)] - found[len(steps) :]) / (2 * steps[:, None])
    # Rounding of 1e-16 by the step; the third derivative is lost beside it.
    np.testing.assert_allclose(slopes, columns, rtol=0, atol=2e-9 * np.abs(columns).max())


@pytest.mark.parametrize("name", EXAMPLES)
def test_samples_and_loads_on_lanes_are_those_of_the_plain_solver(name: str) -> None:
    m = deviating(example(name))
    at = nominal(m)
    drives, placed = at.drives[-1:], at.poses[-1:]
    before = _core.simd()
    try:
        answers = []
        for width in WIDTHS:
            _core.simd(width)
            answers.append(m.core.random(drives, placed, 200, 3, np.array([0.5]), keep=True))
    finally:
        _core.simd(before)
    first, *others = answers
    for other in others:
        assert all(np.array_equal(value, other[key], equal_nan=True) for key, value in first.items())
    assert first["fallbacks"].sum() == 0
    given = m.core.given(np.repeat(drives, 200, 0), np.repeat(placed, 200, 0), first["kept_parameters"])
    size = np.abs(given["error"] - first["kept_errors"]).max(axis=0)
    assert (size < 1e-13 * np.where(np.arange(len(size)) < len(size) // 2 + 1, max(m.length, 1.0), 10.0)).all()
    if m.has_loads:
        many, rows = np.repeat(drives, 130, 0), np.repeat(placed, 130, 0)
        on_lanes, alone = m.core.loaded(many, rows), m.core.loaded(drives, placed)
        for key in ("error", "error_first_order", "contribution"):
            atol = 1e-12 * max(float(np.abs(alone[key]).max()), m.length)
            np.testing.assert_allclose(on_lanes[key][:1], alone[key], rtol=0, atol=atol, err_msg=key)


def test_a_link_turns_the_zero_of_a_driven_pin() -> None:
    """In the plane a link that is turned before a driven pin is a drive with another value."""
    m = example("serial-2r")
    link = {"body": "upper", "between": ["shoulder", "elbow"], "angle": {"deviation": 1.5}}
    found = jp.given(m.with_({"links.upper": None, "links.turned": link}))
    values = [value + 1.5 for value in m.data.drives["q2"].commands]
    expected = jp.solve(m.with_({"drives.q2": {"joint": "elbow", "values": values}})).nominal - jp.solve(m).nominal
    np.testing.assert_allclose(found.error, expected, rtol=0, atol=1e-10)


#: the links of an arm of six revolute joints: a, alpha, d, theta (SI), none of them special
TABLE = np.array(
    [
        [0.08, -1.5, 0.35, 0.2],
        [0.40, 0.1, 0.02, -0.4],
        [0.10, 1.4, -0.03, 0.3],
        [0.02, -1.6, 0.38, 0.1],
        [0.03, 1.5, 0.04, -0.2],
        [0.05, 0.3, 0.09, 0.5],
    ]
)


def dh(a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    """Pose of a frame in the one before, after Denavit and Hartenberg (1955)."""
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]])


def forward(table: np.ndarray, drives: np.ndarray) -> np.ndarray:
    """Frames of all links, the ground first; the drives turn about the axes before the links."""
    frames = [np.eye(4)]
    for row, q in zip(table, drives, strict=True):
        frames.append(frames[-1] @ dh(0, 0, 0, q) @ dh(*row))
    return np.array(frames)


#: the same with a wrist: the axes of three joints and of the flange meet in one point. The common normal is the vector
#: product of two of them, about which the twist is positive
WRIST = np.array([*TABLE[:3], [0.0, 1.6, 0.0, 0.1], [0.0, 1.5, 0.0, -0.2], [0.0, 0.3, 0.0, 0.5]])


def arm(drives: np.ndarray, errors: np.ndarray | None = None, table: np.ndarray = TABLE) -> str:
    """The arm as a file: the axes of each body are those of its first joint where its theta is zero."""
    lines = ['format = 1\nspace = "spatial"\nunits = { length = "m", angle = "rad", force = "N" }']
    before = "ground = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }"
    for k, row in enumerate(table):
        own = f"link{k} = {{ at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }}"
        lines.append(f'[joints.J{k}]\ntype = "revolute"\non = {{ {before}, {own} }}')
        lines.append(f'[drives.q{k}]\njoint = "J{k}"\nvalues = [{float(drives[k])!r}]')
        at, axis, side = (dh(*row)[:3, c].tolist() for c in (3, 2, 0))
        before = f"link{k} = {{ at = {at}, axis = {axis}, side = {side} }}"
        following = f"J{k + 1}" if k < 5 else "flange"
        off = ""
        for j, name in enumerate(("a", "alpha", "d", "theta")):
            deviation = 0.0 if errors is None else float(errors[k, j])
            off += f"{name} = {{ tolerance = 0.001, deviation = {deviation!r} }}\n"
        lines.append(f'[links.L{k}]\nbody = "link{k}"\nbetween = ["J{k}", "{following}"]\n{off}')
    tool = "tool = { at = [0, 0, 0], axis = [0, 0, 1], side = [1, 0, 0] }"
    lines.append(f'[joints.flange]\ntype = "fixed"\non = {{ {before}, {tool} }}')
    lines.append('[output]\nbody = "tool"')
    return "\n".join(lines)


DRIVES = np.array([0.3, -0.5, 0.4, 0.7, -0.6, 0.2])


@pytest.mark.parametrize("table", [TABLE, WRIST], ids=["arm", "wrist"])
def test_links_of_an_arm_are_those_of_denavit_and_hartenberg(table: np.ndarray) -> None:
    """Finite errors of all 24 parameters are the product of the matrices with other numbers.

    At a wrist both ends of a link shared one point, which its deviations moved as a whole: they changed nothing.
    """
    errors = np.random.default_rng(1).uniform(-0.02, 0.02, (6, 4))
    found = jp.given(jp.loads(arm(DRIVES, errors, table)))
    there, nominally = forward(table + errors, DRIVES)[-1], forward(table, DRIVES)[-1]
    expected = there[:3, 3] - nominally[:3, 3]
    turn = Rotation.from_matrix(there[:3, :3] @ nominally[:3, :3].T).as_rotvec()
    np.testing.assert_allclose(found.error[0], [*expected, *turn], rtol=0, atol=1e-12)


WAYS = {
    # second joint and third body: how far apart in millimetres, the axis of the second joint, what is off
    "meet": ([0.3, 1.0, 0.0], ("a", "alpha", "d", "theta")),
    "parallel": ([0.0, 0.0, 1.0], ("d", "theta")),
    "vector": ([0.3, 1.0, 0.0], ("x", "y", "z", "rx", "ry", "rz")),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("third", [False, True])
def test_a_link_in_one_point_is_the_limit_of_points_that_move_together(way: str, third: bool) -> None:
    """With the points a ten-thousandth of a millimetre apart the deviations of a wrist counted, at one point not. A third
    joint there goes with the second end of the link, as everywhere."""
    axis, off = WAYS[way]

    def machine(apart: float) -> jp.Mechanism:
        # Where the axes of the ends stay as they are: along the second one, or along both.
        at = (apart * np.array(axis) / np.linalg.norm(axis)).tolist()
        joints = {
            "A": {"bodies": ["ground", "wrist"], "at": [0, 0, 0], "axis": [0, 0, 1]},
            "B": {"bodies": ["wrist", "hand"], "at": at, "axis": axis},
        }
        if third:
            joints["C"] = {"bodies": ["wrist", "eye"], "at": at, "axis": [1, 0, 1]}
        body = "eye" if third else "hand"
        return jp.Mechanism(
            {
                "format": 1,
                "space": "spatial",
                "units": {"length": "mm", "angle": "deg", "force": "N"},
                "joints": {name: {"type": "revolute", **joint} for name, joint in joints.items()},
                "drives": {f"q{name}": {"joint": name, "values": [0.0]} for name in joints},
                "links": {"w": {"body": "wrist", "between": ["A", "B"], **dict.fromkeys(off, 0.1)}},
                "output": {"body": body, "at": [30.0, 20.0, 100.0]},
            }
        )

    found, expected = (jp.solve(m) and slopes(m) for m in (machine(0.0), machine(1e-4)))
    assert np.abs(found).max(axis=0).min() > 0.1  # every component does something
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)


def slopes(m: jp.Mechanism) -> np.ndarray:
    at = nominal(m)
    factors = m.component_factors[:, None] / m.parameter_factors[None]
    return np.asarray(m.core.sensitivity(at.drives, at.poses)["source"][0] / factors)


def test_deviations_of_the_flange_of_a_wrist_by_hand() -> None:
    """A tool of 100 mm behind a flange in the centre of the wrist: alpha of 0.1 deg takes its tip 0.17451 mm aside."""
    b = spatial()
    b.revolute("J6", bodies=["ground", "hand"], at=(0, 0, 0), axis=(0, 1, 0))
    b.fixed("flange", bodies=["hand", "tool"], at=(0, 0, 0), axis=(0, 0, 1))
    b.drive("q6", joint="J6", values=[0])
    b.link("last", body="hand", between=["J6", "flange"], alpha={"tolerance": 0.0, "deviation": 0.1})
    b.output(body="tool", at=(0, 0, 100))
    m = b.mechanism()
    # The common normal is y x z = x.
    turn = np.radians(0.1)
    expected = [0.0, -100 * np.sin(turn), 100 * (np.cos(turn) - 1), 0.1, 0.0, 0.0]
    np.testing.assert_allclose(jp.given(m).error[0], expected, rtol=0, atol=1e-9)


def test_columns_of_an_arm_are_those_of_the_error_model() -> None:
    """Wu (1984), Veitschegger and Wu (1986): every error is a screw about the axis before it (d, theta) or about the
    common normal behind it (a, alpha)."""
    m = jp.loads(arm(DRIVES))
    at = nominal(m)
    found = m.core.sensitivity(at.drives, at.poses)["source"][0]
    frames = forward(TABLE, DRIVES)
    end = frames[-1][:3, 3]
    for k, (before, after) in enumerate(itertools.pairwise(frames)):
        z, p0, x, p1 = before[:3, 2], before[:3, 3], after[:3, 0], after[:3, 3]
        nothing = np.zeros(3)
        columns = {
            "a.length": [x, nothing],
            "alpha.angle": [np.cross(x, end - p1), x],
            "d.length": [z, nothing],
            "theta.angle": [np.cross(z, end - p0), z],
        }
        for name, column in columns.items():
            got = found[:, m.parameters.index(f"L{k}.{name}")]
            np.testing.assert_allclose(got, np.concatenate(column), rtol=0, atol=1e-12)


def same(a: xr.Dataset, b: xr.Dataset, *, without: tuple[str, ...] = (), part: float = 1e-9) -> None:
    """The same numbers, whatever their sources are called."""
    for name in a.data_vars:
        if name in without or a[name].dtype.kind not in "fiub":
            continue
        size = float(np.nan_to_num(np.abs(a[name].values)).max(initial=0.0)) if a[name].dtype.kind == "f" else 1.0
        np.testing.assert_allclose(a[name], b[name], rtol=0, atol=part * max(size, 1e-9), err_msg=str(name))
    if "status" in a:
        assert a["status"].values.tolist() == b["status"].values.tolist()


def with_links(m: jp.Mechanism) -> jp.Mechanism:
    """Links in the place of dimensions; all of them are along axes of their bodies."""
    changes: dict[str, Any] = {}
    for name, dimension in m.data.dimensions.items():
        points = []
        for joint in dimension.between:
            at = m.data.output.at if joint == "output" else m.data.joints[joint].placements[dimension.body].at
            points.append(np.array(at, dtype=float))
        way = points[1] - points[0]
        (axis,) = np.flatnonzero(np.abs(way) > 1e-9)
        low, high = (dimension.tolerance.low, dimension.tolerance.high) if dimension.tolerance else (0.0, 0.0)
        tolerance = {"plus": high, "minus": -low} if way[axis] > 0 else {"plus": -low, "minus": high}
        off = {"tolerance": tolerance, "deviation": float(np.sign(way[axis])) * dimension.deviation}
        if dimension.law:
            off["law"] = dimension.law
        changes[f"dimensions.{name}"] = None
        changes[f"links.{name}"] = {"body": dimension.body, "between": list(dimension.between), "xyz"[axis]: off}
    return m.with_(changes)


ON_GROUND = ("ground", [["left", "beam"], ["middle"], ["right"]])
ON_BEAM = ("beam", [["left"], ["ground"], ["middle"], ["right"]])


def parallel(base: str = ON_GROUND[0], steps: list[list[str]] = ON_GROUND[1]) -> jp.Mechanism:
    """A beam on three parallel bars, one of which is redundant."""
    b = planar()
    b.revolute("A", ground=(0, 0), left=(0, 0), clearance=jp.radial(0.05))
    b.revolute("B", ground=(100, 0), middle=(0, 0), clearance=jp.radial(0.04))
    b.revolute("C", ground=(180, 0), right=(0, 0), clearance=jp.radial(0.06))
    b.revolute("D", left=(0, 60), beam=(0, 0), clearance=jp.radial(0.05))
    b.revolute("E", middle=(60, 0), beam=(0, 100), clearance=jp.radial(0.05))
    b.revolute("F", right=(60, 0), beam=(0, 180), clearance=jp.radial(0.05))
    for body, angle in (("left", -20), ("middle", 70), ("right", 70)):
        b.start(body, angle=angle)
    b.start("beam", x=20, y=56, angle=-90)
    b.drive("crank", joint="A", values=[-20, -10])
    b.output(body="beam", at="F")
    b.load(force=(4, -10))
    b.dimension("a", body="left", between=["A", "D"], tolerance={"plus": 0.04, "minus": 0.02}, deviation=0.01)
    b.dimension("b", body="middle", between=["B", "E"], tolerance=0.05)
    b.dimension("c", body="beam", between=["D", "F"], tolerance=0.03, law="uniform")
    b.assembly(base=base, steps=steps)
    return b.mechanism()


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("question", ["given", "loaded", "worst", "random"])
def test_a_link_along_a_dimension_is_that_dimension(question: str, elastic: bool) -> None:
    """In an over-constrained mechanism, rigid and elastic, every figure of every question is the same."""
    m = parallel()
    if elastic:
        m = m.with_({"bodies.middle.stiffness": 3000.0, "bodies.right.stiffness": 2000.0})
    twin = with_links(m)
    assert twin.sources[-3:] == ("a.y", "b.x", "c.y")
    options = {"samples": 500, "seed": 2} if question == "random" else {}
    first, second = (getattr(jp, question)(of, **options) for of in (m, twin))
    # Beside the middle of what they leave open, offsets are where a climb ends, and programs of a climb are good to 1e-8.
    same(first, second, without=("worst_offset",), part=1e-7 if question == "worst" else 1e-9)


@pytest.mark.parametrize("question", ["unit", "worst", "random"])
@pytest.mark.parametrize("base", [ON_GROUND, ON_BEAM])
def test_an_assembly_with_links_is_the_one_with_dimensions(base: tuple[str, str], question: str) -> None:
    m = parallel(*base).with_({"bodies.middle.stiffness": 3000.0, "bodies.right.stiffness": 2000.0})
    options = {"samples": 300, "seed": 2} if question == "random" else {}
    first, second = (jp.assemble(of, question=question, **options) for of in (m, with_links(m)))
    same(first, second)


@pytest.mark.parametrize("question", ["given", "loaded", "worst", "random"])
@pytest.mark.parametrize("seed", range(2))
def test_a_link_that_turns_a_locked_joint_is_its_angle(question: str, seed: int) -> None:
    m = jp.loads(mechanism("welded", seed))
    (name,) = [name for name, joint in m.data.joints.items() if joint.kind == "fixed"]
    entry = m.data.joints[name]
    assert entry.angle is not None
    body = entry.names[0]
    other = next(joint for joint, of in m.data.joints.items() if body in of.names and joint != name)
    off = {"tolerance": {"plus": entry.angle.tolerance.high, "minus": -entry.angle.tolerance.low}}
    off |= {"deviation": entry.angle.deviation} | ({"law": entry.angle.law} if entry.angle.law else {})
    link = {"body": body, "between": [other, name], "angle": off}
    twin = m.with_({f"joints.{name}.angle": None, "links.turn": link})
    options = {"samples": 4000, "seed": 2} if question == "random" else {}
    first, second = (getattr(jp, question)(of, **options) for of in (m, twin))
    kept = {"error", "error_first_order", "worst_component", "worst_position", "worst_rotation_first_order"}
    # Draws differ: the sources are in another order.
    kept |= {"error_covariance_first_order", "error_mean_first_order"}
    same(first[[name for name in first.data_vars if name in kept]], second)


GUIDES = planar()
GUIDES.prismatic(
    "guide", ground={"at": (0, 0), "axis": 0}, slider={"at": (0, 0), "axis": 0}, clearance=jp.gap(0.02, length=30)
)
GUIDES.fixed("bolt", ground=(60, 10), bracket=(0, 0))
GUIDES.prismatic(
    "second", bracket={"at": (0, 0), "axis": 0}, slider={"at": (60, 10), "axis": 0}, clearance=jp.gap(0.03, length=20)
)
GUIDES.start("slider", x=5)
GUIDES.drive("x", joint="guide", values=[5])
GUIDES.output(body="slider", at=(30, 40))
GUIDES.load(force=(1, -8))


@pytest.mark.parametrize("question", ["loaded", "worst", "random"])
def test_the_direction_of_a_redundant_guide_is_the_angle_of_its_bracket(question: str) -> None:
    """Angles of axes beside the rows of an over-constrained mechanism: the slider is clamped between two guides."""
    m = GUIDES.mechanism()
    off = {"tolerance": 0.15, "deviation": 0.2} if question == "random" else {"tolerance": 0.04, "deviation": 0.05}
    angle = m.with_({"joints.bolt.angle": off})
    twin = m.with_({"joints.second.direction": {"bracket": off}})
    assert (angle.sources, twin.sources) == (
        ("guide", "bolt", "second"),
        ("guide", "second", "second.direction.bracket"),
    )
    options = {"samples": 20_000, "seed": 2} if question == "random" else {}
    first, second = (getattr(jp, question)(of, **options) for of in (angle, twin))
    if question != "random":
        names = [str(name) for name in first.data_vars if not {"parameter", "source", "joint"} & set(first[name].dims)]
        same(first[names], second[names])
        return
    # The sources are in another order, so that other specimens are drawn.
    share = float(first.failures.sel(outcome="not_assemblable")[0]) / 20_000
    other = float(second.failures.sel(outcome="not_assemblable")[0]) / 20_000
    assert 0.02 < share < 0.98
    assert abs(share - other) < 5 * np.sqrt(2 * share * (1 - share) / 20_000)


ARM = spatial()
ARM.revolute("J", ground={"at": (0, 0, 0), "axis": (0, 0, 1)}, arm={"at": (0, 0, 0), "axis": (0, 0, 1)})
ARM.drive("q", joint="J", values=[0])
ARM.output(body="arm", at=(100, 0, 0))


def largest(**changes: Any) -> tuple[float, float]:
    """Worst position and rotation of an arm of 100 mm, in mm and deg."""
    found = jp.worst(ARM.mechanism().with_({key.replace("__", "."): value for key, value in changes.items()}))
    assert set(found.status.values.tolist()) == {"ok"}
    return float(found.worst_position[0]), float(found.worst_rotation[0])


def test_zones_by_hand() -> None:
    """A diameter is twice the largest shift; a cylinder with a length tilts by its diameter over its length."""
    np.testing.assert_allclose(largest(joints__J__position={"arm": {"diameter": 0.1}}), (0.05, 0.0), atol=1e-9)
    ball = {"ground": {"diameter": 0.1, "spherical": True}}
    np.testing.assert_allclose(largest(joints__J__position=ball), (0.05, 0.0), atol=1e-9)
    # The farther end of the arm rises by the tilt; the shift adds nothing to that direction.
    tilt = np.degrees(0.1 / 40)
    shifted, turned_by = largest(joints__J__position={"arm": {"diameter": 0.1, "length": 40}})
    assert turned_by == pytest.approx(tilt, rel=1e-9)
    assert shifted == pytest.approx(2 * 100 * np.sin(np.radians(tilt) / 2), rel=1e-6)
    cone = largest(joints__J__direction={"arm": {"angle": 0.3}})
    np.testing.assert_allclose(cone, (200 * np.sin(np.radians(0.15)), 0.3), rtol=1e-9)
    parallel = largest(joints__J__direction={"ground": {"diameter": 0.2, "length": 40}})
    angle = np.arctan(0.2 / 40)
    np.testing.assert_allclose(parallel, (200 * np.sin(angle / 2), np.degrees(angle)), rtol=1e-9)
    # About the side (x) the arm only turns about itself.
    side = largest(joints__J__direction={"arm": {"side": 0.3}})
    np.testing.assert_allclose(side, (0.0, 0.3), atol=1e-9)


def test_a_cylinder_with_a_length_tilts_as_far_where_only_first_order_is_asked() -> None:
    m = ARM.mechanism().with_({"joints.J.position": {"arm": {"diameter": 0.1, "length": 40}}})
    linear = jp.worst(m, exact=False)
    assert float(linear.worst_rotation[0]) == pytest.approx(np.degrees(0.1 / 40), rel=1e-9)
    assert float(linear.worst_position[0]) == pytest.approx(100 * 0.1 / 40, rel=1e-9)


@pytest.mark.parametrize("name", ["slider-crank", "3-rrr", "rssr"])
def test_every_question_answers(name: str) -> None:
    m = deviating(example(name), 1e-4)
    assert {"position", "direction", "link"} - {"direction"} <= set(m.source_kinds)
    key = next(f"joints.{joint}.position.{entry.names[0]}.x.tolerance" for joint, entry in m.data.joints.items())
    swept = jp.sweep(m, key, [0.0, 0.1], "worst")
    assert swept.worst_position.values[1].max() > swept.worst_position.values[0].min()
    assert {"ok"} == set(jp.compare(m, m, question="worst").status.values.ravel().tolist())
    random = jp.random(m, samples=5000, seed=3)
    # The scatter beside first order: of second order in the deviations, and of the number of samples.
    exact, linear = random.error_std.values, random.error_std_first_order.values
    np.testing.assert_allclose(exact, linear, rtol=0.05, atol=1e-6)
    if m.has_loads:
        corrected = jp.compensate(m)
        assert "ok" in set(corrected.status.values.ravel().tolist())
    assert jp.check(m).source.size == len(m.sources)


def test_a_map_and_an_assembly_take_deviations() -> None:
    m = parallel().with_({"joints.E.position.beam": {"x": 0.01, "y": {"tolerance": 0.01, "deviation": 0.002}}})
    grid = {"crank": {"from": -20, "to": -10, "count": 3}}
    mapped = jp.map(m, "loaded", grid)
    alone = jp.loaded(m.with_({"drives.crank.values": [-20, -15, -10]}))
    np.testing.assert_allclose(mapped.error.values, alone.error.values, rtol=0, atol=1e-9)


MISTAKES: dict[str, tuple[dict[str, Any], str, str]] = {
    "unknown body": ({"position": {"crnk": {"x": 1}}}, "joints.J", "position: 'crnk' is not a body of this joint"),
    "no component": ({"position": {"arm": {}}}, "joints.J.position.arm", "say how far it is off"),
    "two forms": ({"position": {"arm": {"x": 1, "diameter": 1}}}, "joints.J.position.arm", "give either diameter (a zone) or x, y, z; not diameter with x"),
    "a law of components": ({"position": {"arm": {"x": 1, "law": "normal"}}}, "joints.J.position.arm", "law at this place belongs to a zone"),
    "a ball with a length": ({"position": {"arm": {"diameter": 1, "spherical": True, "length": 3}}}, "joints.J.position.arm", "a ball has no length"),
    "a deviation of three": ({"position": {"arm": {"diameter": 1, "deviation": [1, 2, 3]}}}, "joints.J.position.arm", "the deviation in this zone is [side, normal], not 3 numbers"),
    "a negative zone": ({"position": {"arm": {"diameter": -1}}}, "joints.J.position.arm.diameter", "-1"),
    "too far": ({"position": {"arm": {"diameter": 1e6}}}, "joints.J.position.arm", "more than the size of the mechanism"),
    "a misspelt key": ({"position": {"arm": {"diametre": 1}}}, "joints.J.position.arm", "did you mean 'diameter'?"),
    "half a cylinder": ({"direction": {"arm": {"diameter": 1}}}, "joints.J.direction.arm", "diameter and length belong together"),
    "cone and cylinder": ({"direction": {"arm": {"angle": 1, "diameter": 1, "length": 2}}}, "joints.J.direction.arm", "give angle, or diameter and length; not both"),
    "too steep": ({"direction": {"arm": {"angle": 91}}}, "joints.J.direction.arm", "more than a quarter of a turn, 90 deg"),
    "sigma and law": ({"direction": {"arm": {"side": {"tolerance": {"sigma": 1}, "law": "uniform"}}}}, "joints.J.direction.arm.side", "sigma already says"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named(mistake: str) -> None:
    changes, key, said = MISTAKES[mistake]
    with pytest.raises(InputError) as caught:
        ARM.mechanism().with_({f"joints.J.{name}": value for name, value in changes.items()})
    assert f": {key}: " in f": {caught.value}"
    assert said in str(caught.value)


PLANAR: dict[str, tuple[dict[str, Any], str]] = {
    "z in the plane": ({"joints.B.position": {"crank": {"z": 1}}}, "'z' is a key in space"),
    "an axis of a pin": ({"joints.B.direction": {"crank": 0.1}}, "a revolute joint has no axis on 'crank'"),
    "a link of a stranger": ({"links.l": {"body": "crank", "between": ["A", "C"], "x": 1}}, "'C' is not a joint on 'crank'"),
    "a link of one joint": ({"links.l": {"body": "crank", "between": ["A", "A"], "x": 1}}, "'A' is given twice"),
    "a link of nothing": ({"links.l": {"body": "crank", "between": ["A", "B"]}}, "say what deviates: x, y, angle"),
    "rz in the plane": ({"links.l": {"body": "crank", "between": ["A", "B"], "rz": 1}}, "'rz' is a key in space"),
    "the name of a joint": ({"links.A": {"body": "crank", "between": ["A", "B"], "x": 1}}, "'A' is the name of a joint"),
    "an output that turns": ({"links.l": {"body": "slider", "between": ["C", "output"], "angle": 1}}, "the output turns with its body"),
    "another's output": ({"links.l": {"body": "crank", "between": ["A", "output"], "x": 1}}, "the output is on 'slider'"),
}  # fmt: skip
CRANK = planar()
CRANK.revolute("A", ground=(0, 0), crank=(0, 0))
CRANK.revolute("B", crank=(40, 0), rod=(0, 0))
CRANK.revolute("C", rod=(120, 0), slider=(0, 0))
CRANK.prismatic("D", ground={"at": (0, 0), "axis": 0}, slider={"at": (0, 0), "axis": 0})
CRANK.start("slider", x=150)
CRANK.drive("t", joint="A", values=(20, 50))
CRANK.output(body="slider")


@pytest.mark.parametrize("mistake", PLANAR)
def test_a_mistake_in_the_plane_is_named(mistake: str) -> None:
    changes, said = PLANAR[mistake]
    with pytest.raises(InputError) as caught:
        CRANK.mechanism().with_(changes)
    assert said in str(caught.value)


def test_axes_that_are_one_line_have_no_common_normal() -> None:
    on = {"arm": {"at": [0, 0, 50], "axis": [0, 0, 1]}, "tip": {"at": [0, 0, 0], "axis": [0, 0, 1]}}
    link = {"body": "arm", "between": ["J", "K"], "alpha": 1}
    with pytest.raises(InputError, match=r"links\.l\.alpha: the axes of 'J' and 'K' are one line"):
        ARM.mechanism().with_({"joints.K": {"type": "revolute", "on": on}, "links.l": link})


def test_a_dimension_is_the_position_along_its_line() -> None:
    dimension = {"body": "crank", "between": ["A", "B"], "tolerance": 0.05, "deviation": 0.02}
    by_length = CRANK.mechanism().with_({"dimensions.r": dimension})
    off = {"crank": {"x": {"tolerance": 0.05, "deviation": 0.02}}}
    by_place = CRANK.mechanism().with_({"joints.B.position": off})
    assert by_place.parameters == ("B.position.crank.x.length",)
    for question in ("given", "worst", "random"):
        options = {"samples": 500} if question == "random" else {}
        same(getattr(jp, question)(by_length, **options), getattr(jp, question)(by_place, **options))
    # It moves a joint that deviates by itself as well.
    both = by_length.with_({"joints.B.position": {"crank": {"y": 0.01}}})
    np.testing.assert_allclose(jp.given(both).error, jp.given(by_length).error, rtol=0, atol=1e-12)


def test_a_link_moves_a_joint_at_the_same_place_that_deviates_by_itself() -> None:
    """The pin of a second rod, drawn where the first is, follows the link although it has a place of its own."""
    upright = {"at": [0, 0], "axis": 90}
    second = {
        "joints.E": {"type": "revolute", "on": {"crank": [40, 0], "arm": [0, 0]}},
        "joints.F": {"type": "revolute", "on": {"arm": [90, 0], "block": [0, 0]}},
        "joints.G": {"type": "prismatic", "on": {"ground": upright, "block": upright}},
        "start.block": {"x": 0, "y": 95},
        "output.body": "block",
    }
    link = {"body": "crank", "between": ["A", "B"], "x": {"deviation": 0.2}, "y": {"deviation": -0.1}}
    m = CRANK.mechanism().with_({**second, "links.l": link})
    apart = m.with_({"joints.E.position": {"crank": {"x": 0.01}}})
    found = jp.given(m).error
    assert abs(found.values).max() > 0.05
    np.testing.assert_allclose(jp.given(apart).error, found, rtol=0, atol=1e-12)


def test_a_sweep_has_the_unit_of_its_deviation() -> None:
    m = ARM.mechanism()
    m = m.with_(
        {"joints.J.position": {"arm": {"diameter": 0.1, "length": 30}}, "joints.J.direction": {"arm": {"angle": 0.1}}}
    )
    keys = {"position.arm.diameter": "mm", "position.arm.length": "mm", "direction.arm.angle": "deg"}
    for key, unit in keys.items():
        swept = jp.sweep(m, f"joints.J.{key}", [0.1, 0.2], "worst")
        assert swept[key.rpartition(".")[2]].attrs["units"] == unit


def legs(ankle: dict[str, object]) -> jp.Mechanism:
    """Three legs round a platform, with a deviation of the place of each ankle."""
    b = planar()
    leg = b.pattern("leg", count=3, about={"point": [0, 0]}, shared=["platform"])
    leg.revolute("hip", ground=(0, 300), upper=(0, 0), position={"upper": {"x": 0.01}})
    leg.revolute("knee", upper=(150, 0), lower=(0, 0))
    leg.revolute("ankle", lower=(150, 0), platform=(0, 80), position={"platform": ankle})
    leg.start("upper", angle=-47)
    leg.start("lower", angle=-133)
    leg.drive("motor", joint="hip", values=[-47])
    b.output(body="platform")
    return b.mechanism()


def test_zones_turn_with_the_copies_of_a_pattern() -> None:
    m = legs({"diameter": 0.1, "deviation": [0.03, 0]})
    assert m.sources[:2] == ("hip_1.position.upper_1.x", "ankle_1.position.platform")
    known = [m.centre[m.parameter_source == m.sources.index(f"ankle_{k}.position.platform")] for k in (1, 2, 3)]
    turns = np.array([0.03 * np.exp(2j * np.pi * k / 3) for k in range(3)])
    np.testing.assert_allclose(known, 1e-3 * np.column_stack([turns.real, turns.imag]), atol=1e-15)
    # All three pins shifted across their legs turn the platform, and do not move it.
    found = jp.given(m).error[0].values
    np.testing.assert_allclose(found[:2], 0.0, atol=1e-9)
    assert abs(found[2]) > 0.01
    with pytest.raises(InputError, match=r"patterns\.leg\.joints\.ankle\.position: x: axes of this body do not turn"):
        legs({"x": 0.1})


def test_a_link_in_the_plane_has_no_z() -> None:
    slot = {"type": "pin_in_slot", "on": {"coupler": {"at": [75, 0], "axis": [1, 0]}, "rocker": [150, 0]}}
    link = {"body": "rocker", "between": ["J4", "J3"], "angle": 1}
    with pytest.raises(jp.InputError, match=r"that could deviate; valid here: x, y$"):
        example("four-bar").with_({"joints.J3": slot, "links.a": link})
