"""Elastic mechanisms under load, from the file to the error, against textbook formulas of beams and springs."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from helpers.oracles.beam import AREA, HEAD, INERTIA, MEMBER, SPATIAL, TORSION, E, G, beam, pin
from helpers.orders import NEAR, order

#: N mm^2
RIGIDITY = E * INERTIA
CLAMP = pin("root", "ground = { at = [0, 0], axis = [1, 0] }, beam = [0, 0]", kind="fixed")
BENDING = MEMBER + f"inertia = {INERTIA}\n"
OUTPUT = '[output]\nbody = "beam"\nat = [300, 0]\n'


def first_order(text: str) -> np.ndarray:
    found = jp.loaded(jp.loads(text), exact=False)
    # The member is strained by the load, not by its parts.
    assert found.status.values.tolist() == ["ok"]
    return np.asarray(found.error_first_order.values[0])


def test_a_cantilever_under_a_force_and_a_moment() -> None:
    x, y, angle = first_order(HEAD + CLAMP + OUTPUT + BENDING + "[[loads]]\nforce = [20, -10]\nmoment = 500\n")
    length = 300.0
    assert x == pytest.approx(20 * length / (E * AREA), rel=1e-9)
    assert y == pytest.approx((-10 * length**3 / 3 + 500 * length**2 / 2) / RIGIDITY, rel=1e-9)
    assert np.deg2rad(angle) == pytest.approx((-10 * length**2 / 2 + 500 * length) / RIGIDITY, rel=1e-9)


def test_a_rigid_arm_turns_with_the_end_of_its_beam() -> None:
    """Linear is the member alone: the arm on it makes a remainder of second order along the force, of third across."""
    arm = '[joints.tip]\ntype = "fixed"\non = { beam = { at = [300, 0], axis = [1, 0] }, arm = [0, 0] }\n'
    output, load = (
        '[output]\nbody = "arm"\nat = [0, 200]\n',
        '[[loads]]\nbody = "arm"\nat = [0, 0]\nforce = [0, FORCE]\n',
    )
    text = HEAD + CLAMP + arm + output + BENDING + load
    forces, away = 100 * 0.5 ** np.arange(4), []
    for force in forces:
        found = jp.loaded(jp.loads(text.replace("FORCE", str(-force))))
        x, y, angle = found.error.values[0] * [1, 1, np.deg2rad(1)]
        tip = -force * 300.0**3 / 3 / RIGIDITY
        np.testing.assert_allclose([x, y], [-200 * np.sin(angle), tip + 200 * (np.cos(angle) - 1)], rtol=1e-9)
        away.append((found.error - found.error_first_order).values[0, :2])
    assert order(forces, away) == pytest.approx([3.0, 2.0], abs=NEAR)


def test_a_weight_acts_at_the_centre_of_mass() -> None:
    more = "mass = 2\ncentre = [120, 40]\n"
    _, y, _ = first_order("gravity = [0, -9.81]\n" + HEAD + CLAMP + OUTPUT + BENDING + more)
    weight, a, length = 2 * 9.81, 120.0, 300.0
    # 40 mm above the axis: a vertical force has the same moment there.
    assert y == pytest.approx(-weight * a**2 * (3 * length - a) / (6 * RIGIDITY), rel=1e-9)


def test_a_cantilever_in_space() -> None:
    """Along an odd direction, with two inertias, under force and moment, against the integrated beam equation."""
    axis = np.array([2.0, 3.0, 6.0]) / 7
    side = np.cross(axis, [0, 0, 1])
    side /= np.linalg.norm(side)
    end = 280 * axis
    text = SPATIAL + pin("root", "ground = [0, 0, 0], beam = [0, 0, 0]", kind="fixed")
    text += f'[output]\nbody = "beam"\nat = {end.tolist()}\n[[loads]]\nforce = [3, -7, 5]\nmoment = [400, 100, -900]\n'
    text += MEMBER + f"inertia = [{INERTIA}, 300]\nG = {G}\ntorsion = {TORSION}\nside = {side.tolist()}\n"
    found = first_order(text)
    wrench = np.array([3, -7, 5, 0.4, 0.1, -0.9])
    expected = beam(axis, side, 0.28, wrench, (INERTIA, 300.0))
    np.testing.assert_allclose(found[:3] * 1e-3, expected[:3], rtol=1e-8)
    np.testing.assert_allclose(np.deg2rad(found[3:]), expected[3:], rtol=1e-8)


def test_a_propped_cantilever() -> None:
    """Once over-constrained: the prop carries 5/16 of a force in the middle."""
    text = HEAD + CLAMP + '[joints.prop]\ntype = "pin_in_slot"\n'
    text += "on = { ground = { at = [300, 0], axis = [1, 0] }, beam = [300, 0] }\n"
    text += '[output]\nbody = "beam"\nat = [150, 0]\n[[loads]]\nforce = [0, -16]\n' + BENDING
    m = jp.loads(text)
    assert jp.check(m).attrs["redundancy"] == 1
    found = jp.loaded(m, exact=False)
    # The prop is the carrier of the slot and pushes the beam up.
    assert found.reaction.sel(joint="prop", wrench="fy").item() == pytest.approx(5, rel=1e-8)
    assert found.reaction.sel(joint="root", wrench="fy").item() == pytest.approx(11, rel=1e-8)
    assert found.reaction.sel(joint="root", wrench="moment").item() == pytest.approx(16 * 300 * 3 / 16, rel=1e-8)
    y = found.error_first_order.sel(component="y").item()
    assert y == pytest.approx(-7 * 16 * 300**3 / (768 * RIGIDITY), rel=1e-8)


def test_a_beam_clamped_at_both_ends() -> None:
    """Over-constrained three times; the middle sinks by F L^3 / 192 EI, the ends carry F L / 8."""
    text = HEAD + CLAMP + pin("end", "ground = [300, 0], beam = [300, 0]", kind="fixed")
    text += '[output]\nbody = "beam"\nat = [150, 0]\n[[loads]]\nforce = [0, -16]\n' + BENDING
    m = jp.loads(text)
    assert jp.check(m).attrs["redundancy"] == 3
    found = jp.loaded(m, exact=False)
    y = found.error_first_order.sel(component="y").item()
    assert y == pytest.approx(-16 * 300**3 / (192 * RIGIDITY), rel=1e-8)
    moments = found.reaction.sel(joint=["root", "end"], wrench="moment").values[0]
    np.testing.assert_allclose(moments, [16 * 300 / 8, -16 * 300 / 8], rtol=1e-8)


def test_an_elastic_bearing_gives_under_its_reaction() -> None:
    """A lever on a soft pivot and a slider: the pivot moves by force over stiffness, the rest follows."""
    text = HEAD + pin("A", "ground = [0, 0], lever = [0, 0]", "stiffness = { radial = 400 }")
    text += '[joints.B]\ntype = "pin_in_slot"\non = { ground = { at = [100, 0], axis = [1, 0] }, lever = [100, 0] }\n'
    text += "stiffness = { normal = 1000 }\n"
    text += '[output]\nbody = "lever"\nat = [300, 0]\n[[loads]]\nforce = [8, -10]\n'
    x, y, angle = first_order(text)
    # Moments about A: B pushes up by 30 N, A pulls down by 20 N.
    up, down = 20 / 400, -30 / 1000
    assert x == pytest.approx(8 / 400, rel=1e-9)
    assert np.deg2rad(angle) == pytest.approx((down - up) / 100, rel=1e-9)
    assert y == pytest.approx(up + 300 * (down - up) / 100, rel=1e-9)


def test_a_tilting_bearing_in_space() -> None:
    """A shaft in one bearing: a force at its end tilts it by the moment over the stiffness."""
    text = SPATIAL + '[joints.A]\ntype = "revolute"\nbodies = ["ground", "shaft"]\nat = [0, 0, 0]\naxis = [0, 0, 1]\n'
    text += "side = [1, 0, 0]\nstiffness = { radial = 500, tilt = [2000, 4000] }\n"
    text += '[drives.q]\njoint = "A"\nvalues = [0]\n'
    text += '[output]\nbody = "shaft"\nat = [0, 0, 200]\n[[loads]]\nforce = [0, 10, 0]\n'
    found = first_order(text)
    # A force along y at z = 200 turns it about -x, the side: 2000 N mm over 2000 N mm/deg.
    assert found[3] == pytest.approx(-1.0, rel=1e-9)
    assert found[1] == pytest.approx(10 / 500 + 200 * np.deg2rad(1.0), rel=1e-9)


def test_a_bar_that_is_too_long_is_squeezed_by_the_rest() -> None:
    """The bundled bar: 0.25 mm too long, its two pins take up 0.1 mm each, 20 kN/mm press on the rest."""
    found = jp.loaded(jp.loads(jp.examples.text("redundant-bar")))
    assert found.status.item() == "strained"
    # Across the bar 10 N act, which tilt it in its play: the squeeze is 1000 N but for second order.
    assert found.member_force.item() == pytest.approx(-0.05 * 20000, rel=1e-3)
    assert found.clearance_factor.item() == pytest.approx(0.25 / 0.2, rel=1e-9)


def test_the_table_that_rocks() -> None:
    """The self-stress takes the same force from all four legs, in turns; with the load they carry all of it."""
    m = jp.loads(jp.examples.text("four-legged-platform"))
    found, stress = jp.loaded(m, exact=False), jp.check(m).self_stress[0].sel(joint=[f"top{k}" for k in (1, 2, 3, 4)])
    np.testing.assert_allclose(stress.sel(wrench="fz"), [1, -1, 1, -1], atol=1e-9)
    forces = found.member_force.values[0]
    assert forces.sum() == pytest.approx(-500, rel=1e-9)
    # Moments of the load about the middle, 40 mm and 30 mm off it.
    x, y = np.array([-200, 200, 200, -200]), np.array([-150, -150, 150, 150])
    np.testing.assert_allclose([x @ forces, y @ forces], [-40 * 500, -30 * 500], rtol=1e-9)
    # Compatibility: what leg 1 is too long, less the play of four balls, is shared by four springs in a row.
    part = forces @ [1, -1, 1, -1]
    stiffness = E * 60 / 300
    assert part == pytest.approx(-(0.15 - 4 * 0.02) * stiffness, rel=1e-9)


@pytest.mark.parametrize("stiffness", [{"joints.pivot.stiffness": {"radial": 1000}}, {"drives.q.stiffness": 1000}])
def test_an_elastic_arm_hangs_straight_down_within_the_play_of_its_drive(stiffness: dict[str, Any]) -> None:
    """Springs of the search that were much stiffer than the balance left it beside the middle of the play."""
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0))
    values = np.array([-90.08, -90.05, -90.0, -89.95, -89.92])
    b.drive("q", joint="pivot", values=values.tolist(), backlash=0.2, error=0.01)
    b.output(body="arm", at=(200, 0))
    b.load(force=(0, -20))
    m = b.mechanism().with_(stiffness)
    wanted = -200 * np.cos(np.radians(values))
    np.testing.assert_allclose(jp.loaded(m).error.sel(component="x"), wanted, rtol=0, atol=1e-6)
    found = jp.random(m, samples=16, contact="loaded")
    np.testing.assert_allclose(found.error_mean.sel(component="x"), wanted, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.error_std.sel(component="x"), 0, rtol=0, atol=1e-6)
