"""Worms, crossed helical, bevel and hypoid gears against textbook forces, Willis and pitch surfaces by hand."""

# ruff: noqa: E501 (one mistake a line)
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import jointplay as jp
from helpers.answers import refusal
from helpers.builders import spatial
from helpers.crossed import bevel, crossed, hypoid, loose, worm
from helpers.lanes import require_lanes_as_one_by_one
from jointplay.errors import InputError

ALPHA = math.radians(20.0)
TAN = math.tan(ALPHA)


def turns(m: jp.Mechanism, axis: Any) -> np.ndarray:
    """How far the second wheel has turned about its axis, continued along the path."""
    poses = jp.solve(m).nominal.sel(component=["rx", "ry", "rz"]).values
    return np.unwrap(np.deg2rad(poses) @ np.array(axis))


# a worm


@pytest.mark.parametrize("hand", ["right", "left"])
def test_backlash_of_a_worm_is_an_arc_on_its_wheel(hand: str) -> None:
    """A wheel with a worm could only be a gear pair of parallel axes; 0.02 mm on a radius of 36 mm is 0.01592 deg."""
    m = jp.loads(worm(hand)).with_({"output": {"body": "second", "at": [100, 0, 0]}})
    found = jp.worst(m)
    limit = 0.01 / 36.0
    np.testing.assert_allclose(found.worst_rotation, np.rad2deg(limit), rtol=1e-9)
    np.testing.assert_allclose(found.worst_position, 200.0 * math.sin(limit / 2.0), rtol=1e-9)


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("teeth", [(1, 40), (3, 40)])
def test_a_worm_turns_its_wheel_by_its_threads(hand: str, teeth: tuple[int, int]) -> None:
    """The thread of a right-hand worm that turns about +y moves towards -y, and the wheel with it, over many turns."""
    m = jp.loads(worm(hand, teeth))
    m = m.with_({"drives": {"q": {"joint": "f", "from": 0, "to": 7200, "count": 41}}})
    sense = -1.0 if hand == "right" else 1.0
    driven = np.linspace(0.0, 40.0 * np.pi, 41)
    np.testing.assert_allclose(turns(m, [0, 0, 1]), sense * driven * teeth[0] / teeth[1], atol=1e-9)


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("torque", [36000.0, -36000.0])
def test_the_thrust_of_a_worm_is_the_force_on_its_wheel(hand: str, torque: float) -> None:
    """F_t2 = T / r2, F_a1 = F_t2, F_t1 = F_t2 tan(lead angle), F_r = F_t2 tan(alpha) / cos(lead angle)."""
    m = jp.loads(worm(hand, (3, 180), torque=torque))
    lead = math.atan(3 * 36 / (180 * 4))
    found = jp.loaded(m)
    on_wheel = found.reaction.sel(joint="m").values[:, :3]
    side = 1.0 if hand == "right" else -1.0
    expected = [-1000 * TAN / math.cos(lead), -torque / 36, side * torque / 36 * math.tan(lead)]
    np.testing.assert_allclose(np.abs(on_wheel), np.abs([expected] * 3), rtol=1e-9)
    np.testing.assert_allclose(on_wheel[:, :2], [expected[:2]] * 3, rtol=1e-9)
    # Power is kept: what the worm needs about its axis is the torque over the ratio.
    np.testing.assert_allclose(np.abs(on_wheel[:, 2]) * 4, abs(torque) * 3 / 180, rtol=1e-9)
    # Its bearing holds the thrust, and that of the wheel the force of the worm.
    np.testing.assert_allclose(found.reaction.sel(joint="f", wrench="fy"), on_wheel[:, 1], rtol=1e-9)
    np.testing.assert_allclose(found.reaction.sel(joint="s").values[:, :3], -on_wheel, rtol=1e-9)


def test_play_in_the_bearings_of_a_worm_turns_its_wheel_by_hand() -> None:
    """Axially by the play over the pitch radius of the wheel; away from it the backlash grows by 2 tan(alpha) / cos(lead)."""
    lead = math.atan(36 / (40 * 4))
    m = jp.loads(worm(teeth=(1, 40), bearing="clearance = { radial = 0.03, axial = 0.05, length = 20 }"))
    along = jp.given(m, {"f.along": 0.05}).error.sel(component="rz").values
    np.testing.assert_allclose(np.abs(along), np.rad2deg(0.05 / 36), rtol=1e-5)
    axis = m.parameters[m.parameters.index("f.side")]
    plain = jp.given(m, {"m.flank": 0.01}).error.sel(component="rz").values
    opened = [jp.given(m, {"m.flank": 0.01, axis: offset}).error.sel(component="rz").values for offset in (0.01, -0.01)]
    both = [jp.given(m, {axis: offset}).error.sel(component="rz").values for offset in (0.01, -0.01)]
    # One of side and normal is along the common perpendicular, the other moves the wheel as an axial play does not.
    opening = np.abs(np.array(opened) - np.array(both) - plain)
    across = np.abs(np.array(both))
    by_hand = np.rad2deg(0.01 / 36) * np.array([TAN / math.cos(lead), math.tan(lead)])
    if across.max() < 1e-3 * by_hand[0]:
        np.testing.assert_allclose(opening, by_hand[0], rtol=2e-3)
    else:
        np.testing.assert_allclose(across, by_hand[1], rtol=2e-3)


# crossed helical gears and hypoids


@pytest.mark.parametrize("seed", range(40))
def test_crossed_helical_gears_by_their_helix_angles(seed: int) -> None:
    """Teeth of two helix angles mesh where axes are at the sum of them; only radii and tooth counts are told."""
    text, told = crossed(seed)
    m = jp.loads(text)
    found = jp.loaded(m)
    assert set(found.status.values) == {"ok"}
    force = found.reaction.sel(joint="m").values[:, :3]
    axes, at = (np.array(m.data.joints["m"].axes), np.array(m.data.joints["m"].at))
    out = (at[1] - at[0]) / np.linalg.norm(at[1] - at[0])
    normal = 1000.0 / told["r2"] / math.cos(told["b2"]) / math.cos(told["alpha"])
    for axis, helix, side in ((axes[0], told["b1"], 1), (axes[1], told["b2"], -1)):
        around = np.cross(axis, side * out)
        parts = [normal * math.cos(told["alpha"]) * abs(f(helix)) for f in (math.cos, math.sin)]
        np.testing.assert_allclose(np.abs(force @ around), parts[0], rtol=1e-7)
        np.testing.assert_allclose(np.abs(force @ axis), parts[1], rtol=1e-7)
    # It presses the second wheel away from the first one.
    np.testing.assert_allclose(force @ out, normal * math.sin(told["alpha"]), rtol=1e-7)
    ratio = np.diff(turns(m, axes[1]))[0] / math.radians(10)
    assert abs(ratio) == pytest.approx(told["z1"] / told["z2"], rel=1e-9)


def test_the_flanks_of_a_hypoid_touch_in_the_plane_of_its_cones() -> None:
    """The force is at the pressure angle to the plane, across the speed at which the teeth slide, through the pitch point."""
    text, _, axes, out = hypoid()
    m = jp.loads(text)
    reaction = jp.loaded(m).reaction.sel(joint="m").values[0]
    force, moment = reaction[:3], reaction[3:]
    assert force @ out == pytest.approx(np.linalg.norm(force) * math.sin(ALPHA), rel=1e-9)
    at = np.array(m.data.joints["m"].at)
    # A force through the origin, which is the pitch point.
    np.testing.assert_allclose(moment, np.cross(-at[1], force), atol=1e-6 * np.linalg.norm(moment))
    ratio = np.diff(turns(m, axes[1]))[0] / math.radians(10)
    assert abs(ratio) == pytest.approx(11 / 43, rel=1e-9)
    slide = np.cross(axes[0], -at[0]) - ratio * np.cross(axes[1], -at[1])
    assert abs(force @ slide) < 1e-9 * np.linalg.norm(force) * np.linalg.norm(slide)
    # Left-hand teeth: along them the pinion turns back on the way along its axis.
    assert (slide @ axes[0]) * (slide @ np.cross(axes[0], -at[0])) < 0


# bevel gears


@pytest.mark.parametrize("shaft", [90.0, 60.0, 115.0])
def test_straight_bevel_gears_by_hand(shaft: float) -> None:
    """F_t = T / r, F_r = F_t tan(alpha) cos(delta), F_a = F_t tan(alpha) sin(delta); 20 and 40 teeth of module 2."""
    m = jp.loads(bevel(shaft=shaft, torque=4000.0, more="clearance = { backlash = 0.05 }"))
    angle = math.radians(shaft)
    second = np.array([math.sin(angle), 0.0, math.cos(angle)])
    np.testing.assert_allclose(jp.worst(m).worst_rotation, np.rad2deg(0.025 / 40), rtol=1e-9)
    np.testing.assert_allclose(np.diff(turns(m, second)), -np.deg2rad([5, 145]), rtol=1e-9)
    force = jp.loaded(m).reaction.sel(joint="m").values[0, :3]
    assert abs(force[1]) == pytest.approx(100.0, rel=1e-9)
    cones = [brentq(lambda d: math.sin(d) * 40 - math.sin(angle - d) * 20, 0, angle)]
    cones.append(angle - cones[0])
    # Both wheels are pushed away from the apex.
    assert -force[2] == pytest.approx(100 * TAN * math.sin(cones[0]), rel=1e-9)
    assert force @ second == pytest.approx(100 * TAN * math.sin(cones[1]), rel=1e-9)
    assert np.linalg.norm(force) == pytest.approx(100 / math.cos(ALPHA), rel=1e-9)


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("torque", [4000.0, -4000.0])
def test_spiral_bevel_gears_by_a_textbook(hand: str, torque: float) -> None:
    """F_a = F_t / cos(psi) (tan(alpha) sin(delta) -+ sin(psi) cos(delta)), F_r with cos and sin exchanged.

    The upper sign is of a right-hand pinion that turns clockwise, seen from its large end, or of a left-hand one that turns
    counter-clockwise; the wheel's torque says which way the pinion drives.
    """
    psi, ratio = math.radians(35), 0.5
    more = f'clearance = {{ backlash = 0.05 }}\nspiral_angle = 35\nhand = "{hand}"'
    m = jp.loads(bevel(torque=torque, more=more))
    force = -jp.loaded(m).reaction.sel(joint="m").values[0, :3]  # on the pinion
    first = math.atan(ratio)
    # The driving pinion turns against the moment of the teeth on it.
    back = force @ np.array([0.0, 1.0, 0.0]) * 20
    # About +z, out of its large end: counter-clockwise as seen from there.
    drives = -np.sign(back) if _pitch_point_is_at_x(m) else np.sign(back)
    upper = (hand == "right") == (drives < 0)
    sign = -1.0 if upper else 1.0
    axial = 100 / math.cos(psi) * (TAN * math.sin(first) + sign * math.sin(psi) * math.cos(first))
    radial = 100 / math.cos(psi) * (TAN * math.cos(first) - sign * math.sin(psi) * math.sin(first))
    assert abs(force[1]) == pytest.approx(100.0, rel=1e-9)
    # Positive away from the apex, which is along +z, and towards the axis of the pinion.
    assert force[2] == pytest.approx(axial, rel=1e-9)
    assert -force[0] == pytest.approx(radial, rel=1e-9)


def _pitch_point_is_at_x(m: jp.Mechanism) -> bool:
    """Whether the pitch point of the pinion is on its side towards +x, where the wheel is."""
    return float(np.array(m.data.joints["m"].at)[1][0]) > 0.0


def differential(*planets: np.ndarray) -> jp.Mechanism:
    """A bevel differential with planets on both sides of its arm or on one, each on an axis across that of the suns."""
    b = spatial()
    for body in ("arm", "sun", "other"):
        b.revolute(body, bodies=["ground", body], at=(0, 0, 0), axis=(0, 0, 1))
    up, wheels = [0, 0, 1], {"teeth": [30, 20], "radii": [30, 20], "clearance": jp.backlash(0.02)}
    for k, axis in enumerate(planets):
        planet, place = f"planet{k or ''}", 30 * axis
        b.revolute(f"pin{k}", bodies=["arm", planet], at=(0, 0, 0), axis=axis)
        b.crossed_gear(f"below{k}", bodies=["sun", planet], at=[[0, 0, -20], place], axes=[up, axis], **wheels)
        back = wheels | {"teeth": [20, 30], "radii": [20, 30]}
        b.crossed_gear(f"above{k}", bodies=[planet, "other"], at=[place, [0, 0, 20]], axes=[axis, up], **back)
    b.drive("sun", joint="sun", values=[0, 50, 500, 1000])
    b.drive("other", joint="other", values=[0, 10, -200, 3000])
    b.output(body="arm", at=(0, 0, 0))
    return b.mechanism()


X = np.array([1.0, 0.0, 0.0])


def test_a_bevel_differential_obeys_willis() -> None:
    """The arm turns by the mean of both suns; its planet by what they differ, on an axis that turns with it."""
    m = differential(X)
    sun, other = np.deg2rad([[0, 50, 500, 1000], [0, 10, -200, 3000]])
    arm = np.deg2rad(jp.solve(m).nominal.sel(component="rz").values)
    np.testing.assert_allclose(np.exp(1j * arm), np.exp(0.5j * (sun + other)), atol=1e-9)
    # Each mesh lets the arm go by half of its backlash as if the other sun were held: 0.01 / 30 rad twice, halved.
    np.testing.assert_allclose(jp.worst(m).worst_rotation, np.rad2deg(0.01 / 30), rtol=1e-6)
    planet = m.with_({"output": {"body": "planet", "relative_to": "arm"}})
    turned = np.deg2rad(jp.solve(planet).nominal.sel(component="rx").values)
    spin = 0.5 * (sun - other) * 30 / 20
    np.testing.assert_allclose(np.cos(turned), np.cos(spin), atol=1e-9)


def test_a_second_planet_meets_the_teeth_or_is_refused() -> None:
    """Opposite planets of a differential mesh where the teeth of both suns are even between them; else they are refused."""
    m = differential(X, -X)
    assert set(jp.worst(m).status.values) == {"ok"}
    # Planets are apart by multiples of 360 / (30 + 30) degrees.
    aside = np.array([math.cos(math.radians(87)), math.sin(math.radians(87)), 0.0])
    with pytest.raises(InputError, match=r"miss each other by 0\.5 of a tooth"):
        differential(X, aside)


# every question


@pytest.mark.parametrize("seed", range(3))
def test_lanes_answer_as_one_by_one(seed: int) -> None:
    """Load and samples by recorded programs are those of the plain solver; no sample is beyond the worst case."""
    m = jp.loads(loose(seed)).with_({"drives": {"q": {"joint": "f", "from": 0, "to": 500, "count": 70}}})
    core, drives = m.core, np.deg2rad(np.linspace(0.0, 500.0, 70))[:, None]
    require_lanes_as_one_by_one(core, drives, core.trace(drives)["poses"])


@pytest.mark.parametrize("seed", range(3))
def test_questions_answer(seed: int) -> None:
    m = jp.loads(loose(seed)).with_({"drives": {"q": {"joint": "f", "values": [10]}}})
    assert set(jp.compensate(m).status.values) == {"ok"}
    assert jp.check(m).attrs
    elastic = m.with_({"joints.m.stiffness": {"flank": 2e4}})
    found, rigid = (
        np.abs(jp.loaded(each).error.sel(component=["rx", "ry", "rz"]).values).sum() for each in (elastic, m)
    )
    assert found > rigid


def test_a_worst_case_with_a_worm_is_certified() -> None:
    m = jp.loads(worm("left", (2, 41), bearing="clearance = { radial = 0.002, axial = 0.002, length = 15 }"))
    m = m.with_({"drives": {"q": {"joint": "f", "values": [10]}}})
    found = jp.worst(m, certify=True)
    assert found.certified.all()
    assert (
        float(found.worst_rotation[0])
        <= float(found.worst_rotation_certified[0])
        < 1.01 * float(found.worst_rotation[0])
    )


@pytest.mark.parametrize("seed", range(3))
def test_sensitivities_are_differences(seed: int) -> None:
    m = jp.loads(loose(seed)).with_({"drives": {"q": {"joint": "f", "values": [25]}}})
    found = jp.loaded(m)
    for name in m.parameters:
        if name.startswith("m.flank"):
            continue
        step = 1e-4 if name.rpartition(".")[2] not in ("tilt_side", "tilt_normal") else 1e-3
        ends = [jp.given(m, {name: sign * step}).error.values[0] for sign in (1, -1)]
        first = [jp.given(m, {name: sign * step}).error_first_order.values[0] for sign in (1, -1)]
        np.testing.assert_allclose(ends[0] - ends[1], first[0] - first[1], atol=3e-8)
    assert "m.ratio.length" in m.parameters
    assert set(found.status.values) == {"ok"}


# what does not mesh

CROSSED = "[[0, 1, 0], [0, 0, 1]]"
MISTAKES = {
    "parallel axes": (worm(), CROSSED, "[[0, 0, 1], [0, 0, 1]]", "are parallel within 0 deg"),
    "no hand": (worm(), 'hand = "right"\n', "", 'pass each other at 40 mm; the teeth of wheels whose axes cross have a hand'),
    "a spiral angle of a worm": (worm(), "radii", "spiral_angle = 10\nradii", "leave spiral_angle out"),
    "radii that do not reach": (worm(), "[4, 36]", "[3, 36]", "radii of 3 mm and 36 mm about centres 40 mm apart, do not touch"),
    "one axis": (worm(), f"axes = {CROSSED}", "axis = [0, 1, 0]", "two wheels whose axes cross have two: axes ="),
    "too much backlash": (worm(), "0.02", "0.7", "0.7 mm of backlash is half of 1.257 mm or more"),
    "another ratio of cones": (bevel(), "[20, 40]\nradii = [20, 40]", "[20, 40]\nradii = [20, 41]", "a radius of 20 mm the other is 40 mm, not 41 mm"),
    "a cone elsewhere": (bevel(), "radii = [20, 40]", "radii = [10, 20]", "from it and belongs 20 mm from it"),
    "a hand of straight teeth": (bevel(), "radii", 'hand = "left"\nradii', "teeth of a hand have a spiral_angle there"),
    "a spiral without a hand": (bevel(), "radii", "spiral_angle = 20\nradii", "a spiral_angle needs the hand of the first wheel"),
    "a spiral across": (bevel(), "radii", 'spiral_angle = 90\nhand = "left"\nradii', "a spiral angle is below 90 deg, not 90"),
    "a bearing across": (worm(), "at = [40, 0, 0]\naxis = [0, 1, 0]", "at = [40, 0, 0]\naxis = [1, 1, 0]", "teeth of 'first' are about [0, 1, 0] through [40, 0, 0], and it turns in 'f' about [0.707107, 0.707107, 0]"),
    "a bearing beside": (worm(), "at = [40, 0, 0]\naxis", "at = [42, 0, 0]\naxis", "it turns in 'f' about [0, 1, 0] through [42, 0, 0]; a wheel has a bearing along its own axis"),
    "a flank that is hardly one": (bevel(), "radii", "pressure_angle = 89\nradii", "is at most 45 deg"),
    "run-out beyond the teeth": (worm(), "radii", "runout = { first = 1 }\nradii", "by up to 1 mm, more than the height of its teeth, 0.9 mm"),
    "another hand": (worm(), '"right"', '"both"', "hand"),
}  # fmt: skip


@pytest.mark.parametrize(
    "more",
    [
        # A wheel on a shaft of its own, and one on a sliding shaft.
        '[joints.k]\ntype = "fixed"\nbodies = ["shaft", "first"]\nat = [40, 0, 0]\n',
        '[joints.k]\ntype = "cylindrical"\nbodies = ["shaft", "first"]\nat = [40, -20, 0]\naxis = [0, 1, 0]\n',
    ],
)
def test_a_wheel_may_have_its_bearing_elsewhere(more: str) -> None:
    text = worm().replace('bodies = ["ground", "first"]', 'bodies = ["ground", "shaft"]', 1) + more
    assert "shaft" in jp.loads(text).bodies


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_what_is_valid(mistake: str) -> None:
    text, old, new, said = MISTAKES[mistake]
    assert old in text
    found = refusal(text.replace(old, new))
    assert said in found
    assert found.startswith("file.toml: joints.m")
