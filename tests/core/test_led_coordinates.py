"""Coordinates that follow those of other joints: closed forms, splines of SciPy, loops by another solver, MuJoCo."""

# ruff: noqa: E501 (one mistake a line)
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import fsolve

import jointplay as jp
from helpers.answers import require_refused
from helpers.builders import planar, spatial
from helpers.lanes import require_lanes_as_one_by_one
from jointplay.errors import InputError

UNITS = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n'

#: a shaft and a lift that have no body in common but the ground, the lift behind an arm of its own
CAM = (
    UNITS
    + """
[joints.shaft]
type = "revolute"
on = { ground = [0, 0], crank = [0, 0] }
[joints.lift]
type = "prismatic"
on = { ground = { at = [50, 0], axis = [0, 1] }, plate = [0, 0] }
[followers.cam]
joint = "lift"
follows = "shaft"
LAW
[drives.q]
joint = "shaft"
values = [0, 35, 100, -70]
[output]
body = "plate"
at = [0, 0]
"""
)


def cam(law: str) -> str:
    return CAM.replace("LAW", law)


def lifts(m: jp.Mechanism) -> np.ndarray:
    return jp.solve(m).nominal.sel(component="y").values


def test_a_lift_follows_a_polynomial_of_an_angle() -> None:
    m = jp.loads(cam("polynomial = [3, 0.1, -0.002, 1e-5]"))
    x = np.array([0.0, 35, 100, -70])
    np.testing.assert_allclose(lifts(m), 3 + 0.1 * x - 0.002 * x**2 + 1e-5 * x**3, atol=1e-10)


def test_powers_count_from_an_origin() -> None:
    """An angle counts within half a turn of it; all questions answer as with the powers of the angle itself."""
    text = cam("origin = 150\npolynomial = [3, 0.1, -0.002]").replace("[0, 35, 100, -70]", "[0, 100, 200, 300]")
    m = jp.loads(text)
    x = np.array([0.0, 100, 200, 300]) - 150
    np.testing.assert_allclose(lifts(m), 3 + 0.1 * x - 0.002 * x**2, atol=1e-10)
    one, other = (
        loop(**law).with_({"drives.q.values": [80]})
        for law in ({"polynomial": [-57, 0.7, -0.002]}, {"origin": -150, "polynomial": [-207, 1.3, -0.002]})
    )
    for answer, name in ((jp.loaded, "error"), (lambda m: jp.worst(m, certify=True), "worst_position_certified")):
        np.testing.assert_allclose(answer(one)[name], answer(other)[name], rtol=1e-9)
    np.testing.assert_allclose(
        jp.random(one, samples=200).error_std, jp.random(other, samples=200).error_std, rtol=1e-9
    )


@pytest.mark.parametrize("ends", ["natural", "clamped", "periodic"])
def test_a_table_is_the_spline_of_another_program(ends: str) -> None:
    at = np.array([-180.0, -100, -20, 30, 90, 140, 180])
    values = np.array([1.0, 4, -2, 5, 7, 0, 1])
    if ends != "periodic":
        at, values = at[1:-1], values[1:-1]
    law = f'at = {at.tolist()}\nvalues = {values.tolist()}\nends = "{ends}"'
    x = np.linspace(at[0], at[-1], 41)
    m = jp.loads(cam(law)).with_({"drives.q": {"joint": "shaft", "values": x.tolist()}})
    spline = CubicSpline(at, values, bc_type=ends)
    np.testing.assert_allclose(lifts(m), spline(x), atol=1e-9)
    # An error of the drive arrives times the slope.
    with_error = m.with_({"drives.q.error": 0.01})
    first = jp.given(with_error, {"q.value": 0.001}).error_first_order.sel(component="y").values
    np.testing.assert_allclose(first, 0.001 * spline(x, 1), atol=1e-12)
    exact = jp.given(with_error, {"q.value": 0.001}).error.sel(component="y").values
    inside = np.abs(x - 0.5 * (at[0] + at[-1])) < 0.499 * (at[-1] - at[0])
    np.testing.assert_allclose(exact[inside], (spline(x + 0.001) - spline(x))[inside], atol=1e-10)


def test_a_periodic_table_is_followed_over_many_turns() -> None:
    at, values = [0.0, 90, 180, 270, 360], [0.0, 4, 10, 4, 0]
    m = jp.loads(cam(f'at = {at}\nvalues = {values}\nends = "periodic"\nbacklash = 0.04'))
    x = np.linspace(-900.0, 1700.0, 60)
    m = m.with_({"drives.q": {"joint": "shaft", "values": x.tolist()}})
    spline = CubicSpline(at, values, bc_type="periodic")
    np.testing.assert_allclose(lifts(m), spline(x % 360.0), atol=1e-9)
    np.testing.assert_allclose(jp.worst(m).worst_position, 0.02, rtol=1e-9)
    scattered = jp.random(m.with_({"drives.q.error": 0.05}), samples=200)
    assert set(scattered.status.values) == {"ok"}


def test_a_shaft_whose_follower_turns_once_with_it() -> None:
    """A table may end a turn higher than it begins, as that of elliptical gears does."""
    at = np.arange(0.0, 361.0, 30.0)
    values = at + 8.0 * np.sin(np.deg2rad(at))
    text = cam(f'at = {at.tolist()}\nvalues = {values.tolist()}\nends = "periodic"').replace(
        'type = "prismatic"\non = { ground = { at = [50, 0], axis = [0, 1] }, plate = [0, 0] }',
        'type = "revolute"\non = { ground = [50, 0], plate = [0, 0] }',
    )
    x = np.linspace(0.0, 1440.0, 49)
    m = jp.loads(text).with_({"drives.q": {"joint": "shaft", "values": x.tolist()}})
    turned = jp.solve(m).nominal.sel(component="angle").values
    rest = values - at
    expected = x + CubicSpline(at, rest, bc_type="periodic")(x % 360.0)
    np.testing.assert_allclose(np.cos(np.deg2rad(turned)), np.cos(np.deg2rad(expected)), atol=1e-9)


def test_beyond_its_ends_a_table_goes_straight_on() -> None:
    at, values = [-30.0, 0, 40], [1.0, 4, 0]
    m = jp.loads(cam(f"at = {at}\nvalues = {values}")).with_({"drives.q": {"joint": "shaft", "values": [-60, 70]}})
    spline = CubicSpline(at, values, bc_type="natural")
    expected = [values[0] - 30 * spline(-30.0, 1), values[-1] + 30 * spline(40.0, 1)]
    np.testing.assert_allclose(lifts(m), expected, atol=1e-9)


def test_the_leading_joint_carries_the_power() -> None:
    """Lost motion of the drive is pressed by the moment slope x force, so that it changes sides where the slope does."""
    text = cam("polynomial = [0, 0.1, -0.002]\nbacklash = 0.06") + "[[loads]]\nforce = [0, -5]\n"
    m = jp.loads(text).with_({"drives.q.backlash": 0.2})
    found = jp.loaded(m)
    x = np.array([0.0, 35, 100, -70])
    slope = 0.1 - 0.004 * x
    offsets = {name: found.offset.sel(parameter=name).values for name in m.parameters}
    np.testing.assert_allclose(offsets["cam.backlash.along"], -0.03, rtol=1e-9)
    np.testing.assert_allclose(offsets["q.backlash.value"], -0.1 * np.sign(slope), rtol=1e-9)
    expected = -0.03 + 0.1 * x.clip(0, 0) - np.abs(slope) * 0.1 - 0.002 * 0.1**2
    np.testing.assert_allclose(found.error.sel(component="y"), expected, atol=1e-9)


def test_error_and_stiffness_of_a_follower_by_hand() -> None:
    text = cam("polynomial = [0, 0.1]\nerror = 0.03\nstiffness = 200") + "[[loads]]\nforce = [0, -5]\n"
    m = jp.loads(text)
    np.testing.assert_allclose(jp.worst(m).worst_position, 0.03, rtol=1e-9)
    np.testing.assert_allclose(jp.loaded(m).error.sel(component="y"), -5 / 200, rtol=1e-6)


def loop(**law: object) -> jp.Mechanism:
    """A four-bar whose base moves with the angle between crank and coupler."""
    b = planar()
    b.revolute("A", ground=(0, 0), crank=(0, 0), clearance=jp.radial(0.01))
    b.revolute("B", crank=(30, 0), coupler=(0, 0), clearance=jp.radial(0.02))
    b.revolute("C", coupler=(80, 0), rocker=(60, 0), clearance=jp.radial(0.01))
    b.revolute("D", base=(0, 0), rocker=(0, 0))
    guide = {"at": [90, 0], "axis": [1, 0.2]}
    b.prismatic("E", ground=guide, base=(0, 0), clearance=jp.gap(0.01, length=40))
    law = law or {"polynomial": [4, 0.05, 0.0004]}
    b.follower("law", joint="E", follows="B", backlash=0.02, error=0.01, **law)
    b.start("crank", x=0, y=0, angle=60)
    b.start("coupler", x=15, y=26, angle=20)
    b.start("base", x=90, y=0)
    b.start("rocker", x=90, y=0, angle=95)
    b.drive("q", joint="A", values=[60, 80, 110], error=0.02)
    b.output(body="coupler", at=(40, 25))
    b.load(force=(3, -9))
    return b.mechanism()


def test_a_loop_with_a_follower_closes_as_another_solver_does() -> None:
    """The guide of a rocker is moved by the angle between crank and coupler: the follower couples four bodies of a loop."""
    m = loop()
    found = jp.solve(m)
    assert set(found.status.values) == {"ok"}

    def misses(unknown: np.ndarray, crank: float) -> np.ndarray:
        coupler, rocker, travel = unknown
        pin = 30 * np.exp(1j * crank) + 80 * np.exp(1j * coupler)
        ground = 90 + travel * (1 + 0.2j) / abs(1 + 0.2j)
        gap = pin - ground - 60 * np.exp(1j * rocker)
        angle = np.rad2deg(coupler - crank)
        return np.array([gap.real, gap.imag, travel - 4 - 0.05 * angle - 0.0004 * angle**2])

    near = np.array([math.radians(20), math.radians(95), 3.0])
    for k, angle in enumerate((60, 80, 110)):
        crank = math.radians(angle)
        near = fsolve(misses, near, crank, xtol=1e-13)
        at = 30 * np.exp(1j * crank) + (40 + 25j) * np.exp(1j * near[0])
        np.testing.assert_allclose(found.nominal.values[k, :2], [at.real, at.imag], atol=1e-8)
        assert found.nominal.values[k, 2] == pytest.approx(math.degrees(near[0]), abs=1e-8)


@pytest.mark.parametrize("table", [False, True])
def test_every_question_answers_as_the_plain_solver(table: bool) -> None:
    law = {}
    if table:
        at = np.linspace(-100.0, 20.0, 13)
        law = {"at": at, "values": 4 + 0.05 * at + 0.0004 * at**2 + 0.2 * np.sin(at / 9.0)}
    m = loop(**law)
    core, drives = m.core, np.deg2rad(np.linspace(60.0, 110.0, 70))[:, None]
    poses = core.trace(drives)["poses"]
    require_lanes_as_one_by_one(core, drives, poses)
    told = core.sensitivity(drives[:1], poses[:1])["source"][0]
    step = 1e-7
    for p in range(told.shape[1]):
        u = np.zeros((2, told.shape[1]))
        u[:, p] = step, -step
        ends = core.given(np.repeat(drives[:1], 2, 0), np.repeat(poses[:1], 2, 0), u)["error"]
        np.testing.assert_allclose(told[:, p], (ends[0] - ends[1]) / (2 * step), atol=1e-6 * np.abs(told).max())
    one = m.with_({"drives.q.values": [80]})
    sure = jp.worst(one, certify=True)
    assert sure.certified.all()
    assert float(sure.worst_position_certified[0]) < 1.05 * float(sure.worst_position[0])
    assert set(jp.compensate(one).status.values) == {"ok"}
    assert set(jp.allow(one.with_({"limits": {"position": 1.0}})).status.values) == {"ok"}


def test_a_follower_beside_gears_is_over_constrained() -> None:
    """Two shafts that gears and a follower of the same ratio couple: the one that is tighter decides."""
    b = planar()
    b.revolute("A", ground=(0, 0), first=(0, 0))
    b.revolute("B", ground=(30, 0), second=(0, 0))
    b.gear("G", first=(0, 0), second=(0, 0), teeth=[20, 40], module=1, clearance=jp.backlash(0.1))
    b.follower("law", joint="B", follows="A", polynomial=[0, -0.5], backlash=0.1)
    b.drive("M", joint="A", values=[0, 40])
    b.output(body="second", at=(20, 0))
    m = b.mechanism()
    gear = math.degrees(0.05 / 20)
    np.testing.assert_allclose(jp.worst(m).worst_rotation, min(0.05, gear), rtol=1e-6)
    loose = m.with_({"followers.law.backlash": 1.0})
    np.testing.assert_allclose(jp.worst(loose).worst_rotation, gear, rtol=1e-6)


def test_followers_in_space_follow_one_another() -> None:
    b = spatial()
    clearance = jp.radial(0.01, axial=0.01, length=20)
    b.revolute("a", bodies=["ground", "first"], at=(0, 0, 0), axis=(0, 0, 1), clearance=clearance)
    b.revolute("b", bodies=["first", "second"], at=(100, 0, 0), axis=(0, 1, 1))
    b.follower("turn", joint="b", follows="a", polynomial=[5, -0.9, 0.005])
    b.drive("q", joint="a", values=[0, 10])
    b.output(body="second", at=(200, 0, 0))
    m = b.mechanism()
    found = jp.solve(m).nominal.values
    for angle, row in zip(np.deg2rad([0.0, 10.0]), found, strict=True):
        x = math.degrees(angle)
        turn = math.radians(5 - 0.9 * x + 0.005 * x * x)
        axis = np.array([0, 1, 1]) / math.sqrt(2)
        arm = np.array([100.0, 0, 0])
        arm = arm * math.cos(turn) + np.cross(axis, arm) * math.sin(turn) + axis * (axis @ arm) * (1 - math.cos(turn))
        at = np.array([100.0, 0, 0]) + arm
        expected = [
            at[0] * math.cos(angle) - at[1] * math.sin(angle),
            at[0] * math.sin(angle) + at[1] * math.cos(angle),
            at[2],
        ]
        np.testing.assert_allclose(row[:3], expected, atol=1e-9)
    assert set(jp.random(m, samples=100).status.values) == {"ok"}


MUJOCO = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a"><joint name="ja" axis="0 0 1" ref="{ref}"/><geom size=".01"/>
<body name="b" pos=".1 0 0"><joint name="jb" axis="0 {tilt} 1"/><geom size=".01"/><site name="tip" pos=".1 0 0"/></body></body>
</worldbody><equality><joint joint1="jb" joint2="ja" polycoef="0.1 -0.9 0.3 {cubic} 0"/></equality></mujoco>"""


@pytest.mark.parametrize(("ref", "tilt", "cubic"), [(0.0, 0, 0.0), (0.15, 0, -0.2), (0.1, 1, 0.4)])
def test_a_polynomial_of_mjcf_is_a_follower(tmp_path: Path, ref: float, tilt: int, cubic: float) -> None:
    """It was left out, and the mechanism had a freedom more: jb = 0.1 - 0.9 ja + 0.3 ja^2."""
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "law.xml"
    path.write_text(MUJOCO.format(ref=ref, tilt=tilt, cubic=cubic))
    m = jp.read(path, drives={"ja": [math.degrees(0.2), -20]}, output="tip")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for angle, row in zip((0.2, math.radians(-20)), jp.solve(m).nominal.values, strict=True):
        x = angle - ref
        data.qpos[:] = angle, 0.1 - 0.9 * x + 0.3 * x * x + cubic * x**3
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[:1]).max() < 1e-12
        size = 3 if tilt else 2
        np.testing.assert_allclose(row[:size] / 1e3, data.site("tip").xpos[:size], atol=1e-9)


def test_a_table_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "cam.csv").write_text("angle [rad];lift (cm);note\n-1;0.1;a\n0;0.4;b\n1.5;-0.2;c\n")
    path = tmp_path / "cam.toml"
    path.write_text(cam('csv = "cam.csv"\ncolumns = ["angle", "lift"]'))
    m = jp.load(path)
    spline = CubicSpline(np.rad2deg([-1, 0, 1.5]), [1, 4, -2], bc_type="natural")
    np.testing.assert_allclose(lifts(m)[:2], spline([0, 35]), atol=1e-9)
    path.write_text(cam('csv = "cam.csv"\ncolumns = ["angle", "left"]'))
    with pytest.raises(InputError, match="is not a column of its first row"):
        jp.load(path)


@pytest.mark.parametrize("seed", range(20))
def test_one_curve_after_another_by_their_composition(seed: int) -> None:
    """A chain of followers on separate guides and shafts is the composition of their polynomials."""
    chance = np.random.default_rng(seed)
    kinds = chance.choice(["revolute", "prismatic"], 4)
    text, laws = UNITS, []
    for k, kind in enumerate(kinds):
        place = f"at = [{50 * k}, 0]" if kind == "revolute" else f"at = [{50 * k}, 0], axis = [0, 1]"
        on = (
            f"{{ ground = {{ {place} }}, b{k} = [0, 0] }}"
            if kind == "prismatic"
            else f"{{ ground = [{50 * k}, 0], b{k} = [0, 0] }}"
        )
        text += f'[joints.j{k}]\ntype = "{kind}"\non = {on}\n'
        if k:
            laws.append(chance.uniform(-1, 1, 3) * [5, 1, 0.01])
            text += f'[followers.f{k}]\njoint = "j{k}"\nfollows = "j{k - 1}"\npolynomial = {laws[-1].tolist()}\n'
    values = chance.uniform(-20, 20, 5)
    text += f'[drives.q]\njoint = "j0"\nvalues = {values.tolist()}\nerror = 0.01\n[output]\nbody = "b3"\n'
    m = jp.loads(text)
    expected, slope = values, np.ones(5)
    for law in laws:
        slope = slope * (law[1] + 2 * law[2] * expected)
        expected = law[0] + law[1] * expected + law[2] * expected**2
    component = "angle" if kinds[3] == "revolute" else "y"
    np.testing.assert_allclose(jp.solve(m).nominal.sel(component=component), expected, atol=1e-9)
    first = jp.given(m, {"q.value": 0.002}).error_first_order.sel(component=component).values
    np.testing.assert_allclose(first, 0.002 * slope, atol=1e-10)


@pytest.mark.parametrize(("points", "recorded"), [(2, True), (40, True), (300, False)])
def test_a_table_is_recorded_with_all_of_its_pieces(points: int, recorded: bool) -> None:
    """Specimens on both sides of its knots and beyond its ends are those of the plain solver."""
    at = np.linspace(-60.0, 60.0, points)
    values = 5 * np.sin(at / 9) + 0.01 * at**2
    m = jp.loads(
        cam(f"at = {at.tolist()}\nvalues = {values.tolist()}\nbacklash = 0.2").replace("[0, 35, 100, -70]", "[0]")
    )
    m = m.with_({"drives.q": {"joint": "shaft", "values": [0], "error": 5}})
    for angle in (0.0, 45.0, -58.0):
        drives = np.deg2rad([[angle]])
        poses = m.core.trace(drives)["poses"]
        drawn = m.core.random(drives, poses, 320, 3, np.array([0.5]), keep=True)
        assert (drawn["fallbacks"][0] < 320) == recorded
        u = drawn["kept_parameters"]
        given = m.core.given(np.repeat(drives, 320, 0), np.repeat(poses, 320, 0), u)
        np.testing.assert_allclose(drawn["kept_errors"], given["error"], atol=1e-11)


MISTAKES: dict[str, tuple[str, str, str, str]] = {
    "no law": ("polynomial = [0, 1]", "", "followers.cam", "say what it follows along"),
    "two laws": ("polynomial = [0, 1]", "polynomial = [0, 1]\nat = [0, 1]\nvalues = [0, 1]", "followers.cam", "not both"),
    "half a table": ("polynomial = [0, 1]", "at = [0, 1]", "followers.cam", "both at (the leading coordinate) and values"),
    "a constant": ("polynomial = [0, 1]", "polynomial = [2]", "followers.cam", "is constant: nothing follows"),
    "itself": ('follows = "shaft"', 'follows = "lift"', "followers.cam", "'lift' cannot follow itself"),
    "nobody": ('follows = "shaft"', 'follows = "shift"', "followers.cam.follows", "'shift' is not a joint; did you mean 'shaft'?"),
    "a driven joint": ('joint = "lift"\nfollows = "shaft"', 'joint = "shaft"\nfollows = "lift"', "followers.cam.joint", "drive 'q' commands 'shaft' already"),
    "an origin of a table": ("polynomial = [0, 1]", "at = [0, 1]\nvalues = [0, 1]\norigin = 3", "followers.cam", "'origin' goes with a polynomial"),
    "past half a turn": ("values = [0, 35, 100, -70]", "values = [0, 90, 200]", "followers.cam", "drive 'q' turns 'shaft' past 180 deg, half a turn from the middle"),
    "ends of a polynomial": ("polynomial = [0, 1]", 'polynomial = [0, 1]\nends = "natural"', "followers.cam", "'ends' goes with a table"),
    "falling": ("polynomial = [0, 1]", "at = [0, 2, 1]\nvalues = [0, 1, 2]", "followers.cam", "1 comes after 2"),
    "of two lengths": ("polynomial = [0, 1]", "at = [0, 2]\nvalues = [0, 1, 2]", "followers.cam", "have the same length, not 2 and 3"),
    "a turn without a period": ("polynomial = [0, 1]", "at = [0, 400]\nvalues = [0, 1]", "followers.cam.at", 'a full turn or more: ends = "periodic"'),
    "a short period": ("polynomial = [0, 1]", 'at = [0, 10, 20, 350]\nvalues = [0, 1, 2, 0]\nends = "periodic"', "followers.cam.at", "a periodic table goes over 360 deg"),
    "a step": ("polynomial = [0, 1]", 'at = [0, 10, 20, 360]\nvalues = [0, 1, 2, 1]\nends = "periodic"', "followers.cam.values", "the last value, 1, is that of the first point: 0"),
    "a law of no backlash": ("polynomial = [0, 1]", 'polynomial = [0, 1]\nbacklash_law = "normal"', "followers.cam", "'backlash_law' goes with backlash"),
    "the name of a joint": ("[followers.cam]", "[followers.lift]", "followers.lift", "'lift' is the name of a joint"),
    "the name of a drive": ("[followers.cam]", "[followers.q]", "followers.q", "'q' is the name of a drive"),
    "a place twice": ("polynomial = [0, 1]", "at = [0, 1e-300]\nvalues = [1, 2]", "followers.cam.at", "0 and 1e-300 are the same place"),
    "a csv in a text": ("polynomial = [0, 1]", 'csv = "cam.csv"\ncolumns = ["a", "b"]', "followers.cam", "a text gives at and values"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_what_is_valid(mistake: str) -> None:
    old, new, key, said = MISTAKES[mistake]
    require_refused(cam("polynomial = [0, 1]"), old, new, key, said)


def test_what_is_left_of_a_follower_in_other_answers() -> None:
    """Checked, written again, drawn, and refused where contacts are exported."""
    m = jp.loads(cam("polynomial = [0, 0.1]\nbacklash = 0.05"))
    assert "cam" in [*m.joints]
    pressed = m.with_({"loads": [{"force": [3, -10]}]})
    assert not jp.loaded(pressed).drive_flank.values.any(), (
        "the lost motion is that of the follower, and not of a drive"
    )
    cost = {"model": "reciprocal", "b": 1.0, "from": 0.005, "to": 0.2}
    cheapest = jp.allocate(m.with_({"limits": {"position": 0.01}, "costs": {"cam.backlash": cost}}))
    np.testing.assert_allclose(cheapest.size, 0.02, rtol=1e-2)
    allowed = jp.allow(m.with_({"limits": {"position": 0.01}}))
    assert set(allowed.status.values) == {"ok"}
    assert jp.plot.mechanism(m) is not None
    with pytest.raises(InputError, match=r"followers\.cam: is a coordinate that follows another one"):
        jp.export(m, "x.xml")


def test_lost_motion_of_a_follower_is_no_flank_of_a_drive() -> None:
    """Its source has no drive; beside it the drive's own flank is told."""
    text = cam("polynomial = [0, 0.1]\nbacklash = 0.05") + "[[loads]]\nforce = [0, -10]\n"
    found = jp.loaded(jp.loads(text))
    np.testing.assert_array_equal(found.drive_flank, 0)
    np.testing.assert_allclose(found.error.sel(component="y"), -0.025, atol=1e-12)
    # 10 N on 0.1 mm per degree
    np.testing.assert_allclose(found.drive_torque, 180 / math.pi, rtol=1e-9)
    both = jp.loaded(jp.loads(text).with_({"drives.q.backlash": 0.2}))
    np.testing.assert_array_equal(both.drive_flank, -1)
    np.testing.assert_allclose(both.error.sel(component="y"), -0.025 - 0.01, atol=1e-12)
