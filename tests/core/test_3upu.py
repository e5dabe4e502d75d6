"""The 3-UPU robot from its file against its closed form, and against numbers that were worked out beforehand.

The numbers belong to base and platform radii of 300 and 150 mm, pins of 40 mm with 10 um of radial and 20 um of axial
play, guides of 80 x 30 x 30 mm with gaps of 10 um, pins along the circles.
"""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import jointplay as jp
from helpers.geometry import unit_vectors
from helpers.oracles.upu import Upu

Array = NDArray[np.float64]
LEGS = (1, 2, 3)
LAYOUTS = {"tsai": 0.0, "snu": math.pi / 2}
#: the pose and load off the axis, metres, newtons and newton metres
OFF_AXIS = (np.array([0.05, -0.03, 0.4]), np.array([30.0, -20.0, -100.0]), np.array([1.0, 2.0, -0.5]))
ON_AXIS = (np.array([0.0, 0.0, 0.4]), np.array([0.0, 0.0, -100.0]), np.zeros(3))
CLEARANCES = {
    "joints.*.clearance.radial": "radial",
    "joints.*.clearance.axial": "axial",
    "joints.*.clearance.gap": "gap",
}


def path_to(p: Array) -> dict[str, list[float]]:
    return {f"path.{name}": [1e3 * value] for name, value in zip("xyz", p, strict=True)}


def written(robot: Upu, layout: str, p: Array, force: Array, moment: Array) -> jp.Mechanism:
    """The mechanism of the bundled file with these sizes, a path of one position, and this load."""
    sizes = {
        "base_radius": robot.base_radius,
        "platform_radius": robot.platform_radius,
        "height": p[2],
        "radial": robot.radial,
        "axial": robot.axial,
        "pin_length": 2 * robot.half_pin,
        "gap": robot.gap,
        "guide_length": robot.guide_length,
        "guide_width": robot.guide_width,
    }
    settings = {key: repr(1e3 * float(value)) for key, value in sizes.items()}
    m = jp.loads(jp.examples.text("3-upu", {**settings, "layout": layout}))
    return m.with_({**path_to(p), "loads.0.force": force, "loads.0.moment": 1e3 * moment})


def si(error: xr.DataArray) -> Array:
    """Millimetres and degrees in metres and radians."""
    return np.asarray(error.values * np.repeat([1e-3, math.pi / 180], 3))


def shrunk(m: jp.Mechanism, factor: float) -> jp.Mechanism:
    """The mechanism with all its clearances multiplied."""
    sizes = {"radial": 0.01, "axial": 0.02, "gap": 0.01}
    return m.with_({key: factor * sizes[name] for key, name in CLEARANCES.items()})


def bundled(case: tuple[Array, Array, Array]) -> jp.Mechanism:
    """The file as it is, with another path of one position and another load."""
    p, force, moment = case
    m = jp.loads(jp.examples.text("3-upu"))
    return m.with_({**path_to(p), "loads.0.force": force, "loads.0.moment": 1e3 * moment})


def lengths(result: xr.Dataset) -> Array:
    return np.array([result[f"l{k}"].item() for k in LEGS]) * 1e-3


def random_case(rng: np.random.Generator, layout: str) -> tuple[Upu, Array, Array, Array]:
    """A robot, pose and load that are not near a singularity, where rounding would be told apart from nothing."""
    while True:
        base = rng.uniform(0.2, 0.5)
        robot = Upu(
            base_radius=base,
            platform_radius=base * rng.uniform(0.2, 0.7),
            radial=rng.uniform(1e-6, 3e-5),
            axial=rng.uniform(1e-6, 5e-5),
            half_pin=rng.uniform(0.01, 0.04),
            gap=rng.uniform(1e-6, 3e-5),
            guide_length=rng.uniform(0.03, 0.15),
            guide_width=rng.uniform(0.01, 0.05),
            turn=LAYOUTS[layout],
        )
        p = np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.25, 0.6)])
        _, s, n, _ = robot.legs_at(p)
        if min(abs(np.linalg.det(s)), abs(np.linalg.det(n))) > 0.05:
            return robot, p, 100 * rng.normal(size=3), 5 * rng.normal(size=3)


CASES = [(layout, seed) for layout in LAYOUTS for seed in range(24)]


@pytest.mark.parametrize(("layout", "seed"), CASES)
def test_first_order_is_the_closed_form(layout: str, seed: int) -> None:
    robot, p, force, moment = random_case(np.random.default_rng([seed, len(layout)]), layout)
    result = jp.loaded(written(robot, layout, p, force, moment)).isel(configuration=0)
    np.testing.assert_allclose(lengths(result), robot.legs_at(p)[0], rtol=0, atol=1e-12)
    error, want = si(result.error_first_order), robot.error(p, force, moment)
    for part in (slice(3), slice(3, 6)):
        assert np.abs(error - want)[part].max() < 1e-10 * np.linalg.norm(want[part])
    # The load's work is the largest that any play allows.
    load = np.concatenate([force, moment])
    assert error @ load == pytest.approx(robot.support(p, force, moment), rel=1e-10)


@pytest.mark.parametrize(("layout", "seed"), CASES)
def test_every_joint_of_a_leg_carries_its_force_and_couple(layout: str, seed: int) -> None:
    """Without clearances, because reactions are told where the joints are, displaced."""
    robot, p, force, moment = random_case(np.random.default_rng([seed, len(layout)]), layout)
    m = written(robot, layout, p, force, moment)
    result = jp.loaded(m.with_(dict.fromkeys(CLEARANCES, 0.0))).isel(configuration=0)
    _, s, n, _ = robot.legs_at(p)
    along, couple = robot.statics(p, force, moment)
    for k, leg in enumerate(LEGS):
        joints = [f"{end}{leg}.{pin}" for end in ("base", "top") for pin in ("first", "second")] + [f"leg{leg}"]
        found = result.reaction.sel(joint=joints).values * np.repeat([1.0, 1e-3], 3)
        want = np.concatenate([along[k] * s[k], couple[k] * n[k]])
        scale = np.repeat([np.abs(along).max(), np.abs(couple).max()], 3)
        np.testing.assert_allclose(found / scale, np.broadcast_to(want / scale, (5, 6)), rtol=0, atol=1e-10)


def test_singularities_of_the_known_poses() -> None:
    for (p, _, _), forces, couples in (
        (ON_AXIS, 0.299916316, 0.299916316),
        (OFF_AXIS, 0.292698076, 0.285575894),
    ):
        length, s, n, cosine = Upu().legs_at(p)
        assert np.linalg.det(s) == pytest.approx(forces, abs=6e-10)
        assert np.linalg.det(n) == pytest.approx(couples, abs=6e-10)
        # Where legs lie in a plane, and on the cylinder of twice the difference of the radii, they vanish.
        d, sines = 0.15, np.sqrt(1 - cosine**2)
        assert np.linalg.det(s) == pytest.approx(1.5 * math.sqrt(3) * p[2] * d**2 / length.prod(), rel=1e-12)
        cylinder = 3 * d**2 - 0.75 * (p[0] ** 2 + p[1] ** 2)
        want = math.sqrt(3) / 2 * p[2] * cylinder / (length * sines).prod()
        assert np.linalg.det(n) == pytest.approx(want, rel=1e-12)


def test_a_load_along_the_axis_leaves_the_rotation_open() -> None:
    m = bundled(ON_AXIS)
    result = jp.loaded(m).isel(configuration=0)
    np.testing.assert_allclose(lengths(result), 0.4272002, atol=5e-8)
    assert result.status == "undetermined"
    np.testing.assert_allclose(si(result.error_first_order), [0, 0, -42.7200e-6, 0, 0, 0], atol=5e-11)
    assert -100 * si(result.error_first_order)[2] == pytest.approx(0.00427200187, rel=1e-8)
    # What is left open is told at the displaced pose, 43 um lower: a ten-thousandth; with less play it is as at the
    # nominal pose. The play of a guide, gap over half its width, through the couples that the legs take up.
    small = jp.loaded(shrunk(m, 1e-3)).isel(configuration=0)
    np.testing.assert_allclose(1e3 * si(small.undetermined)[3:], [2531.6e-6, 2192.4e-6, 712.0e-6], atol=5e-8)
    np.testing.assert_allclose(si(result.undetermined)[3:], [2531.6e-6, 2192.4e-6, 712.0e-6], rtol=2e-4)
    n = Upu().legs_at(ON_AXIS[0])[2]
    open_ = np.abs(np.linalg.inv(n)).sum(axis=1) * 1e-5 * 2 / 0.03
    np.testing.assert_allclose(1e3 * si(small.undetermined)[3:], open_, rtol=1e-6)
    # The height is decided.
    assert si(result.undetermined)[2] < 1e-12


def test_a_load_off_the_axis() -> None:
    m = bundled(OFF_AXIS)
    p, force, moment = OFF_AXIS
    result = jp.loaded(m).isel(configuration=0)
    assert result.status == "ok"
    np.testing.assert_allclose(lengths(result), [0.413400532, 0.448546796, 0.430819883], rtol=0, atol=6e-10)
    error = si(result.error_first_order)
    np.testing.assert_allclose(error[:3], [3276.8048e-6, -2750.6930e-6, -617.9690e-6], rtol=1e-7)
    np.testing.assert_allclose(error[3:], [-6689.2765e-6, -8241.0618e-6, 1066.2687e-6], rtol=1e-7)
    assert error @ np.concatenate([force, moment]) == pytest.approx(0.191410366, rel=1e-8)
    along, couple = Upu().statics(p, force, moment)
    np.testing.assert_allclose(along, [112.536812, -52.461432, 40.814341], rtol=0, atol=6e-7)
    np.testing.assert_allclose(couple, [-24.884958, -10.459029, 36.162894], rtol=0, atol=6e-7)
    # The sources share the first order error among them.
    np.testing.assert_allclose(result.contribution.sum("source"), result.error_first_order, rtol=0, atol=1e-12)


def test_the_error_tends_to_its_first_order_as_clearances_shrink() -> None:
    m = bundled(OFF_AXIS)
    gaps = []
    for factor in (1.0, 0.5, 0.25, 0.125, 0.0625):
        result = jp.loaded(shrunk(m, factor)).isel(configuration=0)
        error, first = si(result.error), si(result.error_first_order)
        gaps.append(np.linalg.norm(error - first) / np.linalg.norm(first))
    assert 0.01 < gaps[0] < 0.05
    for wide, narrow in itertools.pairwise(gaps):
        assert narrow / wide == pytest.approx(0.5, abs=0.02)


def test_leg_lengths_correct_the_position_and_no_rotation() -> None:
    p, force, moment = OFF_AXIS
    m, robot = bundled(OFF_AXIS), Upu()
    error = robot.error(p, force, moment)
    _, s, _, _ = robot.legs_at(p)
    correction = -s @ error[:3]
    np.testing.assert_allclose(correction, [1190.969e-6, -1342.690e-6, 260.879e-6], rtol=0, atol=6e-10)
    # The same from the general engine: legs move the platform without turning it.
    at = m.core.inverse(np.array([[*p, 0, 0, 0]]), np.array([1.0, 1, 1, 0, 0, 0]), m.start_drives)
    drive = m.core.sensitivity(at["drives"], at["poses"])["drive"][0]
    np.testing.assert_allclose(error[:3] + drive[:3] @ correction, 0.0, atol=1e-12)
    np.testing.assert_allclose(drive[3:], 0.0, atol=1e-12)
    # The displaced robot, too.
    result = jp.compensate(m).isel(configuration=0)
    assert result.settled
    assert result.residual_position.item() < 1e-8  # mm
    # The platform, turned, is brought back by other lengths: the difference is of second order.
    np.testing.assert_allclose(result.correction.values * 1e-3, correction, rtol=0.06)
    assert result.residual_rotation.item() == pytest.approx(np.linalg.norm(result.error.values[3:]), rel=0.02)
    few = jp.compensate(shrunk(m, 1e-3)).isel(configuration=0)
    np.testing.assert_allclose(few.correction.values, correction, rtol=1e-4)  # 1e3 / 1e-3
    np.testing.assert_allclose(few.residual.values[3:], few.error.values[3:], rtol=1e-4)


def test_the_largest_error_of_all() -> None:
    """Over 200 000 directions of the load; a step of theirs, 0.005, leaves less than a hundred-thousandth out."""
    m, robot, p = bundled(OFF_AXIS), Upu(), OFF_AXIS[0]
    result = jp.worst(m).isel(configuration=0)
    u = unit_vectors(200_000)
    position = robot.support(p, u, np.zeros_like(u)).max()
    rotation = robot.support(p, np.zeros_like(u), u).max()
    assert result.worst_position_first_order.item() * 1e-3 == pytest.approx(4903.07e-6, rel=2e-6)
    assert position <= result.worst_position_first_order.item() * 1e-3 <= position * (1 + 1e-5)
    # Forces vanish with the force on the platform, and the three angles bound each other no more: a box, skewed.
    corner = np.linalg.norm(robot.turns(p), axis=1).max()
    assert rotation == pytest.approx(corner, rel=1e-5)
    assert corner == pytest.approx(12206.22e-6, rel=1e-6)
    assert math.radians(result.worst_rotation_first_order.item()) == pytest.approx(corner, rel=1e-9)


@pytest.mark.parametrize(("layout", "seed"), CASES[::6])
def test_the_largest_error_of_random_robots(layout: str, seed: int) -> None:
    robot, p, force, moment = random_case(np.random.default_rng([seed, len(layout)]), layout)
    m = written(robot, layout, p, force, moment)
    result = jp.worst(m, starts=1).isel(configuration=0)
    u = unit_vectors(50_000)
    position = robot.support(p, u, np.zeros_like(u)).max()
    assert position * (1 - 1e-12) <= result.worst_position_first_order.item() * 1e-3 <= position * (1 + 1e-4)
    corner = np.linalg.norm(robot.turns(p), axis=1).max()
    assert math.radians(result.worst_rotation_first_order.item()) == pytest.approx(corner, rel=1e-9)
    axes = np.eye(3)
    for name, f, c in [("x", axes[0], 0 * axes[0]), ("rz", 0 * axes[0], axes[2])]:
        high = result.worst_component_first_order.sel(component=name).values[1]
        scale = 1e-3 if name == "x" else math.pi / 180
        assert high * scale == pytest.approx(float(robot.support(p, f, c)), rel=1e-10)
