"""The peers of the benchmarks solve what jointplay solves; their speed is not a matter of tests."""

import sys
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from jointplay import examples

HERE = Path(__file__).resolve().parents[2] / "benchmarks"
PAGE = HERE.parent / "docs" / "benchmarks.md"


@pytest.fixture(autouse=True, scope="module")
def _benchmarks_on_the_path():
    sys.path.insert(0, str(HERE))
    yield
    sys.path.remove(str(HERE))


@pytest.mark.parametrize("file", ["four-bar.toml", "ten-bar.toml"])
def test_stacked_newton_agrees_on_the_same_samples(file):
    from revolute import revolute
    from scatter import problem

    p = problem(jp.load(HERE / file), 512)
    errors = revolute(p.mechanism).newton(p.offsets)
    assert np.abs(errors - p.errors).max() < 1e-12 * np.abs(p.errors).max()


def test_closed_form_of_the_four_bar_agrees_on_the_same_samples():
    import closed_form
    from scatter import problem

    p = problem(jp.load(HERE / "four-bar.toml"), 512)
    assert np.abs(closed_form.in_numpy(p)(p.offsets) - p.errors).max() < 1e-11 * np.abs(p.errors).max()


def test_sampling_of_the_peers_has_the_same_spread():
    import closed_form
    from scatter import problem

    p, samples = problem(jp.load(HERE / "four-bar.toml"), 512), 1 << 16
    total = p.monte_carlo(closed_form.in_numpy(p), samples)
    sigma = np.sqrt(np.diag(total["product"]) / samples - (total["sum"] / samples) ** 2)
    mine = np.sqrt(np.diag(p.random(1 << 18)["covariance"][0]))
    assert np.abs(sigma / mine - 1).max() < 5 * np.sqrt(0.5 / samples)
    assert total["bins"].sum(axis=1) == pytest.approx(samples)


def test_statics_of_the_robot_agree_with_the_first_order():
    from revolute import revolute
    from w3_map import Statics, grid

    mechanism = jp.loads(examples.text("3-rrr"))
    statics = Statics(revolute(mechanism), np.array([8.0, -20.0, 0.3]), 1e-5)
    drives = grid(mechanism.drive_values[0])[444_400:444_500]
    poses = mechanism.core.trace(drives)["poses"]
    found = mechanism.core.loaded(drives, poses)
    decided = found["status"] == 0
    assert decided.sum() > 90
    mine = found["error_first_order"][decided]
    for errors in (
        statics.stacked(poses, drives)[decided],
        statics.by_hand(poses)[decided],
        statics.with_poses(drives)[decided],
    ):
        assert np.abs(errors - mine).max() < 1e-9 * np.abs(mine).max()


def test_the_three_upu_agrees_in_closed_form_and_with_closed_loops():
    from upu import in_pinocchio
    from w4_upu import LOAD, POSE, grid, robot, six_legs

    mechanism = jp.loads(examples.text("3-upu")).with_({"loads.0": LOAD})
    closed, core = robot(mechanism), mechanism.core
    lengths = closed.lengths(grid()[:2000:20])
    found = core.loaded(lengths, core.trace(lengths)["poses"])
    mine = found["error_first_order"]
    assert np.abs(closed.errors(lengths) - mine).max() < 1e-9 * np.abs(mine).max()
    at = core.inverse(np.array([[*POSE, 0, 0, 0]]), np.array([1.0, 1, 1, 0, 0, 0]), mechanism.start_drives)
    drawn = core.random(at["drives"], at["poses"], 20, 1, np.array([0.5]), None, None, 1, True)
    errors = in_pinocchio(mechanism.spec(), at["poses"][0], at["drives"][0])(drawn["kept_parameters"])
    assert np.abs(errors - drawn["kept_errors"]).max() < 1e-9 * np.abs(errors).max()
    six = jp.loads(examples.text("stewart-gough"))
    traced = six.core.trace(six_legs(six, grid()[:20]))["output"]
    np.testing.assert_allclose(traced, np.column_stack([grid()[:20], np.zeros((20, 3))]), rtol=0, atol=1e-10)


@pytest.mark.parametrize("loops", [1, 7])
def test_a_chain_has_its_loops_and_is_decided_by_its_loads(loops):
    from w5_chain import chain

    mechanism = jp.loads(chain(loops))
    assert len(mechanism.bodies) == 2 * loops + 1
    found = mechanism.core.loaded(mechanism.drive_values, mechanism.core.trace(mechanism.drive_values)["poses"])
    assert not found["status"].any()


def test_a_target_is_reached_on_its_side_only():
    from harness import Target

    assert Target("x", 3, at_most=True, measured=2.9).verdict == "reached"
    assert Target("x", 3, at_most=True, measured=3.1).verdict == "**not reached**"
    assert Target("x", 3, at_most=False, measured=2.9).verdict == "**not reached**"
    assert Target("x", 3, at_most=False, measured=2.9, void="busy").verdict == "busy"


def test_the_page_has_a_place_for_every_table():
    from run import WORKLOADS
    from tables import replace

    page = PAGE.read_text(encoding="utf-8")
    for name in ("machine", *WORKLOADS):
        page = replace(page, name, f"table of {name}")
    assert all(f"table of {name}\n" in page for name in WORKLOADS)
    with pytest.raises(ValueError, match="no place for W99"):
        replace(page, "W99", "")
