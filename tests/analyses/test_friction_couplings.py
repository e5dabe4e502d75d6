"""Friction of gears, racks, belts, screws and worms: against closed forms, and the balance of power."""

import math

import pytest
from numpy.testing import assert_allclose

import jointplay as jp
from helpers import crossed
from helpers.builders import planar
from helpers.machines import GEAR, PAIRS, planetary, screw, wheels
from helpers.rubbing import powers


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("torque", [700.0, -700.0])
def test_of_what_goes_into_a_pair_its_efficiency_comes_out(kind, torque):
    """By which wheel drives: against the load the first, back the second, with an efficiency of its own."""
    mesh, apart, ratio = PAIRS[kind]
    m = wheels(mesh | {"efficiency": [0.9, 0.7]}, apart=apart, torque=torque)
    without = -ratio * torque
    for side, rate in (("forward", 1.0), ("backward", -1.0)):
        result = jp.loaded(m, approach=side).isel(configuration=0)
        drives = without * rate > 0.0
        part = 1.0 / 0.9 if drives else 0.7
        assert_allclose(result.drive_torque[0], without * part, rtol=1e-12)
        assert_allclose(result.efficiency, 0.9 if drives else 0.7, rtol=1e-12)
        assert result.friction_share.sel(joint="m") == 1.0
        # The bearings hold the wheels: all moments on each about its centre, of the mesh those about it.
        assert_allclose(result.reaction.sel(joint="a")[:2] + result.reaction.sel(joint="b")[:2], 0.0, atol=1e-9 * 700)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rack(side):
    b = planar()
    b.revolute("pin", ground=(0, 15 * side), pinion=(0, 0))
    b.prismatic("guide", ground={"at": [0, 0], "axis": [1, 0]}, rack=(0, 0))
    b.rack("m", rack={"at": [0, 0], "axis": [1, 0]}, pinion=(0, 0), radius=15, efficiency=0.8)
    b.drive("q", joint="pin", values=[10])
    b.output(body="rack")
    b.load(force=(-40, 0))
    m = b.mechanism()
    for approach, rate in (("forward", 1.0), ("backward", -1.0)):
        torque = float(jp.loaded(m, approach=approach).drive_torque[0, 0])
        # The pinion turns forward above the rack and pushes it on, below it back.
        without = side * 40.0 * 15.0
        assert_allclose(torque, without / 0.8 if without * rate > 0.0 else without * 0.8, rtol=1e-12)


def test_power_that_rolls_in_a_planetary_gear():
    """Ring fixed, sun to arm: (1 + i e) / (1 + i), and back (1 + i) / (1 + i / e); i = 52 / 20, e of both meshes."""
    m = planetary(0.95)
    i, e = 52.0 / 20.0, 0.95**2
    assert_allclose(jp.loaded(m, approach="forward").efficiency, (1.0 + i * e) / (1.0 + i), rtol=1e-12)
    assert_allclose(jp.loaded(m, approach="backward").efficiency, (1.0 + i / e) ** -1 * (1.0 + i), rtol=1e-12)


@pytest.mark.parametrize(
    ("mu", "raises", "lowers", "efficiency"),
    [(0.12, 1770.274685, -477.284273, 0.359616), (0.05, 1106.545715, 170.122580, 0.575322)],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("play", [{}, {"clearance": jp.radial(0.02, axial=0.05, length=30)}])
def test_thread(mu, raises, lowers, efficiency, sign, play):
    """F d / 2 tan(lead angle +- atan(mu / cos b)); with the larger coefficient the load cannot drive it."""
    m = screw(sign * 4.0, -1000.0, friction={"coefficient": mu, "mean_diameter": 18, "flank_angle": 15}, **play)
    # A right-hand screw that turns forward goes up.
    up, down = ("forward", "backward") if sign > 0.0 else ("backward", "forward")
    slope, angle = math.atan(4.0 / (math.pi * 18.0)), math.atan(mu / math.cos(math.radians(15.0)))
    result = jp.loaded(m, approach=up)
    assert_allclose(result.drive_torque[0, 0], sign * 9000.0 * math.tan(slope + angle), rtol=1e-11)
    assert_allclose(abs(result.drive_torque[0, 0]), raises, atol=5e-7)
    assert_allclose(result.efficiency, efficiency, atol=5e-7)
    back = jp.loaded(m, approach=down)
    assert_allclose(sign * back.drive_torque[0, 0], lowers, atol=5e-7)
    assert_allclose(back.efficiency, math.tan(slope - angle) / math.tan(slope), rtol=1e-10)


def test_efficiencies_and_drag_of_a_ball_screw():
    """Its turning drives with the first, the load with the second; a drag is there whatever the load."""
    m = screw(5.0, -200.0, efficiency=[0.9, 0.8])
    without = 200.0 * 5.0 / math.tau
    assert_allclose(jp.loaded(m, approach="forward").drive_torque, without / 0.9, rtol=1e-12)
    assert_allclose(jp.loaded(m, approach="backward").drive_torque, without * 0.8, rtol=1e-12)
    m = screw(5.0, -200.0, friction={"torque": 7})
    assert_allclose(jp.loaded(m, approach="forward").drive_torque, without + 7.0, rtol=1e-12)
    assert_allclose(jp.loaded(m, approach="backward").drive_torque, without - 7.0, rtol=1e-12)


@pytest.mark.parametrize("mu", [0.02, 0.1])
@pytest.mark.parametrize("torque", [500.0, -500.0])
def test_worm(mu, torque):
    """tan g (cos a - mu tan g) / (cos a tan g + mu) with the worm driving; from mu = cos a tan g on it locks."""
    m = jp.loads(crossed.worm(teeth=(2, 40), more=f"friction = {mu}", torque=torque, values="[5]"))
    # Of the worm's thread at its pitch radius: both wheels go as far across it.
    lead, alpha = math.atan(36.0 * 2.0 / (4.0 * 40.0)), math.radians(20.0)
    drives = math.tan(lead) * (math.cos(alpha) - mu * math.tan(lead)) / (math.cos(alpha) * math.tan(lead) + mu)
    back = (math.cos(alpha) - mu / math.tan(lead)) / (math.cos(alpha) + mu * math.tan(lead))
    without = float(jp.loaded(m).drive_torque[0, 0])
    found = sorted(float(jp.loaded(m, approach=side).efficiency[0]) for side in ("forward", "backward"))
    assert_allclose(found, sorted([drives, back]), rtol=1e-12)
    assert abs(without) > 0.0


@pytest.mark.parametrize("shaft", [70.0, 90.0])
def test_bevel_gears(shaft):
    """Rolling where the pitch circles touch: their efficiency is given."""
    m = jp.loads(crossed.bevel(shaft=shaft, torque=900.0, more="efficiency = 0.95", values="[15]"))
    without = float(jp.loaded(m).drive_torque[0, 0])
    for side, rate in (("forward", 1.0), ("backward", -1.0)):
        torque = float(jp.loaded(m, approach=side).drive_torque[0, 0])
        assert_allclose(torque, without / 0.95 if without * rate > 0.0 else without * 0.95, rtol=1e-12)
    with pytest.raises(jp.InputError, match="the teeth roll where the pitch circles touch"):
        jp.loads(crossed.bevel(more="friction = 0.1"))


@pytest.mark.parametrize("name", ["geared-five-bar", "rack-slider", "belt-arm"])
@pytest.mark.parametrize("approach", ["forward", "backward"])
def test_power_of_the_drives_is_that_of_the_loads_and_what_friction_takes(name, approach):
    """Without play. By equilibrium, and by what friction does at the speeds of the joints."""
    m = jp.loads(jp.examples.text(name))
    changes = {f"joints.{joint}.clearance": None for joint in m.raw["joints"]}
    changes |= {f"joints.{joint}.position": None for joint in m.raw["joints"]}
    for joint, table in m.raw["joints"].items():
        if table["type"] in ("gear", "rack", "belt"):
            changes[f"joints.{joint}.efficiency"] = 0.9
        elif table["type"] == "revolute":
            changes[f"joints.{joint}.friction"] = {"coefficient": 0.2, "diameter": 10}
    m = m.with_(changes)
    taken, lost = powers(m, approach)
    assert (taken > 0.0).all()
    assert_allclose(taken, lost, rtol=1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"efficiency": 0}, "efficiency"),
        ({"efficiency": 1.2}, "efficiency"),
        ({"friction": 0.1}, "the efficiency is given"),
        ({"efficiency": [0.9]}, "efficiency"),
    ],
)
def test_what_is_refused_of_gears(more, words):
    with pytest.raises(jp.InputError, match=words):
        wheels(GEAR | more, apart=70.0)


def test_what_is_refused_of_screws():
    with pytest.raises(jp.InputError, match="not both"):
        screw(4.0, 1.0, efficiency=0.9, friction={"torque": 1})
    with pytest.raises(jp.InputError, match="'mean_diameter' is missing"):
        screw(4.0, 1.0, friction=0.1)


def test_a_follower_brings_the_friction_of_its_guide_to_the_drive():
    """(F +- mu 2 M / L) times the slope of the cam, and the friction circle of the bearing that the cam loads."""
    b = planar()
    b.revolute("shaft", ground=(0, 0), cam=(0, 0), friction={"coefficient": 0.1, "diameter": 20})
    b.prismatic(
        "tappet",
        ground={"at": [0, 50], "axis": [0, 1]},
        stem={"at": [0, 0], "axis": [0, 1]},
        friction={"coefficient": 0.2, "length": 30},
    )
    b.follower("cam", joint="tappet", follows="shaft", polynomial=[0, 0.2, 0.001], backlash=0.1)
    b.drive("q", joint="shaft", values=[10, 30])
    b.output(body="stem")
    b.load(force=(3, -50), at=(0, 20))
    b.load(body="cam", force=(0, -80))
    m = b.mechanism()
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        for k, angle in enumerate((10.0, 30.0)):
            slope = math.degrees(0.2 + 0.002 * angle)
            torque = (50.0 + sign * 0.2 * 2.0 * 3.0 * 20.0 / 30.0) * slope + sign * 80.0 * 10.0 * math.sin(
                math.atan(0.1)
            )
            assert_allclose(jp.loaded(m, approach=side).drive_torque[k, 0], torque, rtol=1e-12)
