"""A rod between two balls spins about itself; that moves nothing of interest and is held."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.rods import RSSR
from jointplay.basics import poses

Floats = NDArray[np.float64]


def delta(**settings: object) -> jp.Mechanism:
    """The bundled Delta robot with balls at both ends of its rods, which is how it is built."""
    text = jp.examples.text("delta", settings)
    pattern = r'type   = "universal"\n(bodies.*\nat .*\n)axes .*\nclearance.*'
    return jp.loads(re.sub(pattern, r'type   = "spherical"\n\1clearance = { radial = 0.01 }', text))


def rocker_angle(theta: float, hook: Floats, ball: Floats, length: float = 176.0) -> float:
    """Closed form: the rocker's ball is on a circle, at the coupler's length from the crank's (offsets taken away)."""
    pivot = 30.0 * np.array([np.cos(theta), np.sin(theta), 0.0]) + hook
    # (130, -100 sin f, -60 + 100 cos f) - ball at the distance of the coupler
    d = np.array([130.0, 0.0, -60.0]) - ball - pivot
    # d.d + 100^2 + 200 (-d_y sin f + d_z cos f) = length^2
    right = (length**2 - d @ d - 100.0**2) / 200.0
    size, phase = np.hypot(d[1], d[2]), np.arctan2(d[1], d[2])
    # size cos(f + phase) = right, of both branches the one near the start
    both = [sign * np.arccos(right / size) - phase for sign in (1.0, -1.0)]
    return min((np.remainder(f + np.pi, 2 * np.pi) - np.pi for f in both), key=lambda f: abs(f - np.radians(40)))


def test_a_coupler_between_two_balls_closes_as_in_the_closed_form() -> None:
    m = RSSR
    assert jp.check(m).attrs["mobility"] == "1 degree of freedom, 1 drive"
    hook, ball = np.array([0.1, -0.12, 0.05]), np.array([-0.03, 0.05, 0.07])
    offsets = {"hook": hook.tolist(), "ball": ball.tolist(), "coupler": 0.04}
    result = jp.given(m, offsets)
    for k, theta in enumerate(np.radians(np.linspace(0, 330, 12))):
        nominal = rocker_angle(theta, np.zeros(3), np.zeros(3))
        actual = rocker_angle(theta, hook, ball, 176.04)
        assert float(result.nominal.sel(component="rx")[k]) == pytest.approx(np.degrees(nominal), abs=1e-9)
        assert float(result.error.sel(component="rx")[k]) == pytest.approx(np.degrees(actual - nominal), abs=1e-9)


def test_a_rod_between_two_balls_transmits_a_force_along_itself_and_no_moment() -> None:
    """And its pins are pressed along the rod: an independent check of the loaded pose on lanes."""
    m = delta()
    result, poses_of = jp.loaded(m), jp.solve(m)
    for k in range(len(poses_of.configuration)):
        for rod in (f"{arm}{side}" for arm in (1, 2, 3) for side in "ab"):
            ends = []
            for joint in (f"elbow{rod}", f"wrist{rod}"):
                at = np.array(m.value(f"joints.{joint}.at"))
                pose = poses_of.pose.sel(body=f"rod{rod}")[k].values
                ends.append(pose[:3] + poses.turned_by(np.radians(pose[3:])) @ at)
                reaction = result.reaction.sel(joint=joint)[k].values
                assert not reaction[3:].any()
                along = (ends[-1] - ends[0]) if len(ends) == 2 else None
            assert along is not None
            force = result.reaction.sel(joint=f"wrist{rod}")[k].values[:3]
            assert np.linalg.norm(np.cross(force, along / np.linalg.norm(along))) < 5e-4 * np.linalg.norm(force)


def test_the_delta_written_by_hand_is_the_delta_of_the_template_with_balls() -> None:
    """To the last digits, if the angles of the shafts count from the same directions.

    The angle of a shaft that is tilted in its bearing by (a, b) about its side and its normal is that of its side.
    Another side is turned by another angle, the difference being of the order of a b; so is that of exact results.
    """
    outwards = {
        f"joints.shaft{k + 1}.side": [np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0] for k in range(3)
    }
    template, by_hand = delta().with_(outwards), jp.loads(jp.examples.text("delta-by-hand"))
    one, other = jp.loaded(template), jp.loaded(by_hand)
    assert (one.status == "ok").all()
    np.testing.assert_allclose(other.error, one.error, rtol=0, atol=1e-10)
    np.testing.assert_allclose(other.error_first_order, one.error_first_order, rtol=0, atol=1e-10)
    one, other = jp.worst(template), jp.worst(by_hand)
    np.testing.assert_allclose(other.worst_component, one.worst_component, rtol=0, atol=1e-8)


@pytest.mark.parametrize("turn", [0.0, 70.0, -160.0])
def test_no_result_depends_on_how_a_rod_is_turned_about_itself(turn: float) -> None:
    plain = RSSR
    turned = plain.with_({"start.coupler.rotation": [turn, 0.0, 0.0]})
    for question in (jp.loaded, jp.worst, lambda m: jp.random(m, samples=2000)):
        one, other = question(plain), question(turned)
        for name in one.data_vars:
            if name in other and one[name].dtype == float and "parameter" not in one[name].dims:
                # As exact as the closure, which is solved to 1e-9 of the size, quadratically.
                np.testing.assert_allclose(other[name], one[name], rtol=2e-6, atol=1e-9, err_msg=str(name))


def test_a_rod_whose_start_points_the_other_way_is_turned_towards_its_ball() -> None:
    """The row that holds a spin has no value where the rod has swung by half a turn."""
    away = RSSR.with_({"joints.ball.on.coupler": [-176, 0, 0]})
    result, plain = jp.loaded(away), jp.loaded(RSSR)
    np.testing.assert_allclose(result.error, plain.error, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("key", ["joints.hook.stiffness.radial", "bodies.coupler.stiffness"])
def test_rods_and_balls_that_give_spin_as_well(key: str) -> None:
    stiff = RSSR.with_({key: 1e9})
    assert jp.check(stiff).attrs["decided"] == 1
    rigid = RSSR
    # A stiffness of 1e9 N/mm gives 1e-8 mm under these loads.
    np.testing.assert_allclose(jp.loaded(stiff).error, jp.loaded(rigid).error, atol=1e-6)
    one, other = jp.worst(stiff).worst_position, jp.worst(rigid).worst_position
    np.testing.assert_allclose(one, other, rtol=1e-3)


def test_telescopic_legs_between_balls_spin_as_a_whole() -> None:
    text = jp.examples.text("stewart-gough")
    pattern = r'type   = "universal"\n(bodies.*\nat .*\n)axes .*\nclearance.*'
    balls = jp.loads(re.sub(pattern, r'type   = "spherical"\n\1clearance = { radial = 0.01 }', text))
    checked = jp.check(balls)
    assert checked.attrs["mobility"] == "6 degrees of freedom, 6 drives"
    assert str(checked.spin_words[0].values) == "'lower1' and 'upper1' spin together about the line from base1 to ball1"
    tight = {"joints.*.clearance.gap": 0.0}
    result = jp.worst(balls.with_(tight))
    # Without play in the guides a leg is a distance between two balls, so that dE = J^-1 n . (offsets).
    solved = jp.solve(balls)
    output = np.array(balls.value("output.at"))
    for k in range(min(3, len(solved.configuration))):
        pose = solved.pose.sel(body="platform")[k].values
        centre = pose[:3] + poses.turned_by(np.radians(pose[3:])) @ output
        rows = []
        for leg in range(1, 7):
            base = np.array(balls.value(f"joints.base{leg}.at"))
            ball = pose[:3] + poses.turned_by(np.radians(pose[3:])) @ np.array(balls.value(f"joints.ball{leg}.at"))
            along = (ball - base) / np.linalg.norm(ball - base)
            rows.append(np.concatenate([along, np.cross(ball - centre, along)]))
        shares = np.abs(np.linalg.inv(np.array(rows))[:3]).sum(axis=1) * 0.02
        found = result.worst_component_first_order.sel(component=["x", "y", "z"], side="high")[k].values
        np.testing.assert_allclose(found, shares, rtol=1e-6)


def test_what_loads_a_spin_leaves_it_a_free_motion() -> None:
    weight = {"body": "coupler", "force": [0, 0, -1]}
    for at, turns in (([88, 0, 0], False), ([88, 2, 0], True)):
        m = RSSR.with_({"loads": [*RSSR.raw["loads"], {**weight, "at": at}]})
        if not turns:
            assert jp.check(m).attrs["decided"] == 1
            continue
        with pytest.raises(jp.InputError, match=r"'coupler' spins about the line from hook to ball, loads\.1 turns it"):
            jp.loaded(m)


def test_a_load_of_a_load_case_that_turns_a_spin_is_named_and_checked() -> None:
    """`check` found nothing wrong, and `loaded` spoke of a load that the file does not have by this key."""
    weight = {"body": "coupler", "force": [0, 0, -1]}
    places = {"on": [88, 0, 0], "beside": [88, 2, 0]}
    m = RSSR.with_({f"load_cases.{name}": [{**weight, "at": at}] for name, at in places.items()})
    words = "'coupler' spins about the line from hook to ball, load_cases.beside.0 turns it"
    with pytest.raises(jp.InputError, match=words.replace(".", r"\.")):
        jp.loaded(m)
    found = jp.check(m)
    assert found.attrs["decided"] == 0
    assert words in found.attrs["mobility"]
    assert found.attrs["load_cases"] == "on, beside"
    assert jp.check(m.only(load_case="on")).attrs["decided"] == 1


def test_several_spins_that_loads_turn_are_told_apart() -> None:
    """Three rods of a delta robot were three times 'a, b and c move together'."""
    m = delta()
    rods = [spin.bodies[0] for spin in m.spins][:3]
    loads = [{"body": m.bodies[rod], "at": [0, 0, 0], "moment": [1, 2, 3]} for rod in rods]
    words = jp.check(m.with_({"loads": loads})).attrs["mobility"]
    for k, rod in enumerate(rods):
        assert f"'{m.bodies[rod]}' spins about the line" in words
        assert f"loads.{k} turns it" in words


def test_a_spin_of_the_output_is_a_free_motion_as_before() -> None:
    with pytest.raises(jp.InputError, match="'coupler' turns and no joint's coordinate drives it"):
        jp.worst(RSSR.with_({"output": {"body": "coupler", "at": [0, 0, 0]}}))


def test_random_specimens_and_loaded_ones_agree_with_given_offsets() -> None:
    """Lanes and the plain solver hold the same spin: the worst offsets, given, have the worst error."""
    m = delta()
    worst = jp.worst(m)
    given = jp.given(m, worst.worst_offset.sel(extreme="position")).error.sel(component=["x", "y", "z"])
    np.testing.assert_allclose(np.linalg.norm(given, axis=-1), worst.worst_position, rtol=1e-8)
    spread = jp.random(m, samples=4000)
    assert not spread.failures.sel(outcome=["not_assembled", "singular"]).any()
    # First order and samples agree to the noise of 4000 samples.
    np.testing.assert_allclose(spread.error_std, spread.error_std_first_order, rtol=0.06)


@pytest.mark.parametrize("name", ["delta", "rssr"])
def test_every_question_answers_with_held_spins(name: str) -> None:
    m = delta() if name == "delta" else RSSR
    axes = {drive: {"from": -5, "to": 5, "count": 3} for drive in m.drives}
    assert (jp.map(m, question="loaded", grid=axes).status == "ok").all()
    assert (jp.compensate(m).status == "ok").all()
    assert np.isfinite(jp.sweep(m, "joints.*.clearance.radial", [0.01, 0.02], question="worst").worst_position).all()
    if name == "delta":
        # Two positions of a crank give one of the rocker, so that only the delta's path has one set of drives.
        both = jp.compare(m, m, question="loaded").error
        np.testing.assert_allclose(both[1], both[0], atol=1e-6)
    assert (jp.singularities(m).status == "ok").all()
    if name == "rssr":
        # Specimens of a delta take seconds each under load, with universal joints as with balls.
        assert np.isfinite(jp.random(m, samples=500, contact="loaded").error_mean).all()
