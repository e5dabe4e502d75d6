"""Mechanisms drawn far from the origins of ground and bodies answer like those that are drawn near them."""

import json
from itertools import product
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import EXAMPLES, example
from helpers.anywhere import Elsewhere
from helpers.builders import spatial
from helpers.couplings import OK, Machine, planetary
from helpers.trains import TURN, drawn
from jointplay import _core
from jointplay.analyses.nominal import nominal
from jointplay.basics import poses

#: lengths by which drawings are shifted, and what rounding leaves of that, in lengths and radians
FAR, ROUNDING = 1e4, 1e-8
GROUND = -1


def told(m: Machine) -> dict[str, Any]:
    return {
        "space": m.space,
        "n_bodies": len(m.guess),
        "guess": m.guess,
        "length": m.length,
        "singular_value": 1e-6,
        "points": m.points,
        "joints": m.joints,
        "drives": m.drives,
        "output": {"point": m.output_point},
        "loads": m.loads,
        "displacements": m.displacements,
        "sources": m.sources,
    }


def core(spec: Any) -> _core.Mechanism:
    return _core.Mechanism(json.dumps(dict(spec)))


def same_poses(there: Elsewhere, found: np.ndarray, spec: Any, expected: np.ndarray) -> None:
    """The same places of all points of the bodies, and the same rotations."""
    here = Elsewhere(spec, np.random.default_rng(0), 0.0, turns=False)
    (places, rotations), (expected_places, expected_rotations) = there.places(found), here.places(expected)
    assert np.abs(places - expected_places).max(initial=0.0) < ROUNDING * spec["length"]
    assert np.abs(rotations - expected_rotations).max(initial=0.0) < ROUNDING


def same_answers(spec: Any, drives: np.ndarray, rng: np.random.Generator, far: float = FAR) -> None:
    """Path, given offsets, worst case and, where there are loads, loaded poses of a mechanism here and elsewhere."""
    there = Elsewhere(spec, rng, far)
    here, moved = core(spec), core(there.spec)
    path, other = here.trace(drives), moved.trace(drives)
    np.testing.assert_array_equal(path["status"], other["status"])
    ok = path["status"] == OK
    same_poses(there, other["poses"][ok], spec, path["poses"][ok])
    if not ok.any() or not spec["sources"]:
        return
    unit = np.where(np.arange(path["output"].shape[1]) < (2 if spec["space"] == "planar" else 3), spec["length"], 1.0)
    # Errors along the axes of the ground are others where these are turned.
    shifted = Elsewhere(spec, rng, far, turns=False)
    beside = core(shifted.spec)
    cases = [(drives[ok][:1], found["poses"][ok][:1]) for found in (path, beside.trace(drives), other)]
    worst, same = here.worst(*cases[0]), beside.worst(*cases[1])
    np.testing.assert_array_equal(same["status"], worst["status"])
    # Where a singular pose is within the clearances the search ends anywhere.
    for name in ("position", "rotation", "component") if (worst["status"] == OK).all() else ():
        np.testing.assert_allclose(same[name], worst[name], rtol=1e-6, atol=ROUNDING * spec["length"], err_msg=name)
    if spec["loads"]:
        loaded, same = here.loaded(*cases[0]), moved.loaded(*cases[2])
        np.testing.assert_array_equal(loaded["status"], same["status"])
        np.testing.assert_allclose(there.back(same["error"]) / unit, loaded["error"] / unit, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("seed", range(16))
def test_trains_answer_alike_wherever_they_are_drawn(seed: int) -> None:
    """A screw 100 mm beside the origin failed from steps of 60 degrees on, gears and racks as well: how far a body's
    origin moved decided over the steps of the path."""
    machine, start = drawn(seed, play=0.3)
    drives = start + np.array([[0.02], [0.3], [0.3 + 2 * TURN]])
    same_answers(told(machine), drives, np.random.default_rng(seed), 10.0 ** (seed % 5))


def screw(lead: float = 5e-3) -> Machine:
    m = Machine("spatial", 0.02)
    body = m.body(0, 0, 0)
    joint = m.joint("screw", (GROUND,), (body,), lead=lead)
    m.drive(joint, "angle")
    m.source("clearance", {"journal": {"radius": 1e-5, "axial": 1e-5, "half_length": 0.01}}, joint=joint)
    m.load(body, force=(0, 0, -10.0))
    m.output(body, (0.01, 0.02, 0.0))
    return m


def rack() -> Machine:
    m = Machine("planar", 0.03)
    pinion, slide = m.body(0, 0), m.body(0, -0.02)
    m.joint("revolute", (GROUND, (0, 0)), (pinion,))
    m.joint("prismatic", (GROUND, (0, -0.02)), (slide,))
    mesh = m.joint("rack", (slide, (0.0, 0.0)), (pinion,), radii=[0.02, 0.0], pressure_angle=0.349)
    m.drive(0)
    m.source("clearance", (-2e-5, 2e-5), joint=mesh)
    m.output(slide)
    return m


def wheels() -> Machine:
    """Two gears and a belt in space, about axes that are not parallel to those of the ground."""
    m = Machine("spatial", 0.06)
    tilt = poses.quaternion([0.3, -0.4, 0.2])
    axes = poses.matrix(np.array([0, 0, 0, *tilt]))
    axis, side = axes[:, 2].tolist(), axes[:, 0].tolist()
    places = [np.zeros(3), 0.06 * axes[:, 0], 0.06 * axes[:, 0] + 0.1 * axes[:, 1]]
    for at in places:
        m.body(*at, *tilt)
    for body, at in enumerate(places):
        number = m.joint("revolute", (GROUND, tuple(at)), (body, (0.0, 0.0, 0.0)))
        m.joints[number] |= {"axis_first": axis, "side_first": side}
        m.source("clearance", {"journal": {"radius": 1e-5, "axial": 2e-5, "half_length": 0.01}}, joint=number)
    gear = m.joint("gear", (0,), (1,), radii=[0.02, 0.04], teeth=[20, 40], pressure_angle=0.349)
    m.joint("belt", (1,), (2,), radii=[0.02, 0.03], teeth=[20, 30])
    m.drive(0)
    m.source("clearance", (-2e-5, 2e-5), joint=gear)
    m.output(2, (0.01, 0.0, 0.0))
    return m


@pytest.mark.parametrize(("make", "far"), [*product([screw, rack, wheels, planetary], [0.0, 5.0, 1e2, 1e4])])
def test_couplings_answer_alike_wherever_they_are_drawn(make: Any, far: float) -> None:
    """In steps of up to a thousand turns, which docs/file-format.md promises; a rack is drawn as long as it takes."""
    m = make()
    most = 3.0 if make is rack else 1000.0
    drives = np.array([[0.0], [1.1], [500 * np.pi / 180], [500 * np.pi / 180 + most * TURN]])
    same_answers(told(m), drives, np.random.default_rng(3), far)


def test_wheels_that_turn_many_times_as_fast_follow_a_thousand_turns() -> None:
    """The steps of a path were counted by the turns of the drive, whatever turned faster."""
    m = Machine("planar", 0.05)
    radii, places = [0.04, 0.004], [0.0]
    for k in range(4):
        m.body(places[-1], 0.0)
        m.joint("revolute", (GROUND, (places[-1], 0.0)), (k,))
        places.append(places[-1] + sum(radii))
    for k in range(3):
        # A large and a small wheel on every body.
        m.joint("gear", (k,), (k + 1,), radii=radii, teeth=[80, 8], pressure_angle=0.35)
    m.drive(0)
    m.output(3)
    found = m.core().trace(np.array([[0.0], [TURN]]))
    np.testing.assert_array_equal(found["status"], OK)
    np.testing.assert_allclose(found["poses"][1, 3, 2], -1000 * TURN, rtol=1e-12)


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name not in ("template", "stewart-gough", "delta")])
def test_examples_answer_alike_wherever_they_are_drawn(name: str) -> None:
    """Bodies as they are, the ground and the axes of the bodies a hundred thousand lengths away."""
    m = example(name)
    if m.data.units.length and any("relative_to" in str(output) for output in m.raw.get("outputs", {}).values()):
        pytest.skip("outputs seen from other bodies")
    at = nominal(m)
    spec = {**m.spec()}
    there = Elsewhere(spec, np.random.default_rng(1), 1e5, turns=False)
    found = core(there.spec).trace(np.ascontiguousarray(at.drives))
    here = m.core.trace(np.ascontiguousarray(at.drives))
    np.testing.assert_array_equal(found["status"], here["status"])
    ok = here["status"] == OK
    same_poses(there, found["poses"][ok], spec, here["poses"][ok])


@pytest.mark.parametrize("at", [(20.0, 0.0, 0.0), (2e5, -3e5, 1e5)])
def test_a_screw_goes_its_lead_wherever_it_stands(at: tuple[float, float, float]) -> None:
    b = spatial()
    b.screw("N", bodies=["ground", "s"], at=at, axis=(0, 0, 1), lead=5)
    b.drive("d", joint="N", values=[0, 500, 360000])
    b.output(body="s", at=at)
    m = b.mechanism()
    found = jp.solve(m)
    assert (found.status == "ok").all()
    expected = np.multiply.outer(5.0 * found.d.values / 360, [0, 0, 1]) + at
    np.testing.assert_allclose(found.nominal[:, :3], expected, rtol=0, atol=1e-8)
    assert jp.check(m).attrs["degrees_of_freedom"] == 1
