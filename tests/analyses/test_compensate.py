"""Corrected drives: no others are better, ranges and weights are minded, contact that flips is told."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import least_squares

import jointplay as jp
from helpers.answers import distance, example
from helpers.arms import leg
from helpers.builders import planar
from jointplay.analyses import compensate
from jointplay.result.conclusions import conclude


class TestCompensate:
    @pytest.mark.parametrize("name", ["four-bar", "p3r", "slider-crank", "six-bar"])
    def test_no_other_drive_value_nearby_is_better(self, name: str) -> None:
        """The position error over a dense range of the only drive has its minimum at the corrected value."""
        m = example(name)
        result = jp.compensate(m)
        (drive,) = m.drives
        for k in (0, 3, 7):
            best = result.drive_corrected[k, 0].item()
            nominal = result.nominal[k].sel(component=["x", "y"]).values
            reach = 0.3 * abs(result.correction[k, 0].item())
            sizes = []
            for value in best + np.linspace(-reach, reach, 13):
                at = m.with_({f"drives.{drive}.values": [float(value)]})
                moved = jp.loaded(at)
                pose = moved.nominal[0] + moved.error[0]
                sizes.append(float(np.hypot(*(pose.sel(component=["x", "y"]).values - nominal))))
            assert sizes[6] == pytest.approx(result.residual_position[k].item(), abs=1e-9)
            assert min(sizes) >= sizes[6] - 1e-9

    def test_as_many_drives_as_components_leave_nothing(self) -> None:
        result = jp.compensate(example("3-rrr"))
        assert np.abs(result.residual).max() < 1e-9
        assert distance(result.error).min() > 0.01
        two = jp.compensate(example("five-bar"))
        assert two.residual_position.max() < 1e-9
        assert two.residual_rotation.min() > 1e-4

    def test_rotation_counts_as_it_is_weighted(self) -> None:
        m = example("four-bar")
        position, rotation = jp.compensate(m), jp.compensate(m, weights=(0.0, 1.0))
        assert rotation.residual_rotation.max() < 1e-8
        assert (rotation.residual_position > position.residual_position - 1e-9).all()
        between = jp.compensate(m, weights=(1.0, 300.0))

        def merit(result: xr.Dataset) -> np.ndarray:
            turn = np.deg2rad(result.residual_rotation.values)
            return np.hypot(result.residual_position.values, 300.0 * turn)

        assert (merit(between) <= np.minimum(merit(position), merit(rotation)) + 1e-9).all()

    def test_given_errors_are_corrected_too(self) -> None:
        m = example("five-bar")
        offsets = {"A": [0.015, 0.01], "left_rod": -0.02}
        result = jp.compensate(m, "given", offsets)
        np.testing.assert_array_equal(result.error, jp.given(m, offsets).error)
        assert result.residual_position.max() < 1e-9

    def test_a_displaced_target_is_the_inverse_kinematics_of_the_displaced_point(self) -> None:
        m = example("four-bar")
        target = [2.0, 0.0]
        result = jp.compensate(m, "given", target=target)
        aim = jp.solve(m).nominal.sel(component=["x", "y"]).values + target
        path = {"x": aim[:, 0].tolist(), "y": aim[:, 1].tolist()}
        solved = jp.solve(m.with_({"drives.theta1.values": None, "path": path}))
        np.testing.assert_allclose(result.drive_corrected[:, 0], solved.theta1, rtol=0, atol=1e-6)
        each = jp.compensate(m, "given", target=np.tile(target, (11, 1)))
        assert each.drive_corrected.equals(result.drive_corrected)

    def test_drives_keep_to_their_range(self) -> None:
        m = example("four-bar", limits__drives__theta1=[20, 77])
        result, free = jp.compensate(m), jp.compensate(example("four-bar"))
        held = (free.drive_corrected > 77).values[:, 0]
        assert 0 < held.sum() < len(held)
        assert result.at_limit.values[:, 0].tolist() == held.tolist()
        np.testing.assert_allclose(result.drive_corrected.values[held], 77.0, rtol=1e-12)
        np.testing.assert_allclose(result.drive_corrected.values[~held], free.drive_corrected.values[~held], rtol=1e-9)

    def test_a_drive_at_its_range_leaves_the_work_to_the_other(self) -> None:
        free = jp.compensate(example("five-bar"))
        left = free.drive_nominal.sel(drive="left").max().item()
        span = [0.0, left]
        result = jp.compensate(example("five-bar", limits__drives__left=span))
        held = result.at_limit.sel(drive="left").values
        assert (result.drive_corrected.sel(drive="left") <= left + 1e-9).all()
        assert (result.residual_position.values[~held] < 1e-9).all()

    def test_where_contact_flips_the_best_drive_is_found_and_said_not_to_settle(self) -> None:
        """The rocker pin of the P3R changes sides at a length within reach of the correction: E(q) jumps there."""
        m = example("p3r", drives__v__values=[109.75, 110.25, 112.0])
        result = jp.compensate(m)
        assert not result.settled.all()
        for k in range(3):
            lengths = result.v[k].item() + np.linspace(-4, 4, 1601)
            moved = jp.loaded(m.with_({"drives.v.values": lengths}))
            left = distance(moved.nominal + moved.error - result.nominal[k])
            assert result.residual_position[k].item() <= left.min() + 1e-9
            assert lengths[left.argmin()] == pytest.approx(result.drive_corrected[k, 0].item(), abs=0.006)

    def test_beyond_reach_the_arm_is_stretched_or_folded_towards_the_target(self) -> None:
        """Errors were said not to settle there, up to a fifth above the least: what is left is large and curved."""
        links, start = np.array([300.0, 258.18]), np.radians([30.0, 40.0])
        joints = {
            "A": {"type": "revolute", "on": {"ground": [0, 0], "upper": [0, 0]}},
            "B": {"type": "revolute", "on": {"upper": [links[0], 0], "fore": [0, 0]}},
        }
        values = {"q1": {"joint": "A", "values": [30.0]}, "q2": {"joint": "B", "values": [40.0]}}
        units, output = {"length": "mm", "angle": "deg"}, {"body": "fore", "at": [links[1], 0]}
        m = jp.Mechanism({"format": 1, "units": units, "joints": joints, "drives": values, "output": output})
        turns = np.cumsum(start)
        place = np.array([links @ np.cos(turns), links @ np.sin(turns)])
        rng = np.random.default_rng(0)
        for _ in range(10):
            far, turn = rng.uniform(570.0, 700.0), rng.uniform(-0.5, 2.5)
            goal = far * np.array([np.cos(turn), np.sin(turn)])
            result = jp.compensate(m, "given", deviations={}, target=goal - place)
            assert result.settled.item()
            left = np.linalg.norm((result.residual - result.target).values[0, :2])
            assert left == pytest.approx(far - links.sum(), rel=1e-6)

    @pytest.mark.parametrize("free", [{}, {"q0": [-0.5, 0.5]}])
    def test_a_drive_at_its_end_leaves_the_largest_error_to_two_others(self, free: dict[str, list[float]]) -> None:
        """Steps of least change stopped at the end of the first drive, and eleven times the least "settled"."""
        links = ("ground", "a", "b", "c")
        joints = {
            f"J{k}": {
                "type": "revolute",
                "on": {links[k]: [100 * (k > 0), 0], links[k + 1]: [0, 0]},
                "clearance": {"radial": 1},
            }
            for k in range(3)
        }
        file = {
            "format": 1,
            "units": {"length": "mm", "angle": "deg", "force": "N"},
            "joints": joints,
            "drives": {f"q{k}": {"joint": f"J{k}", "values": [value]} for k, value in enumerate((0, 60, 60))},
            "output": {"body": "c", "at": [100, 0]},
            "load_cases": {"a": [{"force": [0, 10]}], "b": [{"force": [1, 10]}]},
            "limits": {"drives": free},
        }
        result = jp.compensate(jp.Mechanism(file), weights=(1.0, 0.0), one_table=True)
        # Pins lie along the loads: half-way between the two errors of 3 mm.
        assert result.residual_position.values.ravel() == pytest.approx(3.0 * np.sin(0.5 * np.arctan(0.1)), rel=1e-6)

    def test_what_cannot_be_assembled_stays_so(self) -> None:
        result = jp.compensate(example("four-bar", drives__theta1__values=[22.7, 180.0]))
        assert result.status.values.tolist() == ["ok", "not_assembled"]
        assert np.isfinite(result.drive_corrected[0]).all()
        assert np.isnan(result.drive_corrected[1]).all()
        assert not result.settled[1]
        nowhere = jp.compensate(example("four-bar", drives__theta1__values=[180.0]))
        assert nowhere.status.item() == "not_assembled"

    @pytest.mark.parametrize(
        ("arguments", "part"),
        [
            ({"question": "random"}, "'random' is not an error that drives can correct"),
            ({"offsets": {"J1": [0, 0]}}, "ask for the question 'given'"),
            ({"weights": (0, 0)}, "not both zero"),
            ({"weights": (-1, 0)}, "not negative"),
            ({"target": [1.0]}, "x, y or x, y, angle"),
            ({"target": [[1.0, 0.0]]}, "each of the 11"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, arguments: dict[str, Any], part: str) -> None:
        with pytest.raises(jp.InputError) as refusal:
            jp.compensate(example("four-bar"), **arguments)
        assert part in str(refusal.value)


def test_at_a_dead_centre_the_drive_goes_to_the_nearest_best_place():
    """The output hardly follows there, so that a step of Newton's method is many turns; compared with a fine search."""
    m = jp.loads(jp.examples.text("slider-crank")).with_({"drives.theta.values": [180.0]})
    found = jp.compensate(m)
    drives = np.linspace(170.0, 190.0, 4001)
    loaded = jp.loaded(m.with_({"drives.theta.values": drives.tolist()}))
    there = (loaded.nominal + loaded.error).sel(component=["x", "y"])
    aim = found.nominal.sel(component=["x", "y"]).isel(configuration=0)
    apart = np.hypot(*(there - aim).values.T)
    assert found.residual_position.item() == pytest.approx(apart.min(), abs=1e-6)
    best = drives[apart < apart.min() + 1e-6] - 180.0
    assert np.abs(best - found.correction.item()).min() < 0.01


@pytest.mark.parametrize("seed", range(12))
def test_within_ranges_of_drives_what_is_left_is_least(seed: int) -> None:
    """Steps that were cut drive by drive ended with drives at their ends where others would have left less."""
    chance = np.random.default_rng(seed)
    n = 2 + seed % 3
    lengths, angles = chance.uniform(50.0, 150.0, n), chance.uniform(-60.0, 60.0, n)
    ranges = angles + np.abs(chance.normal(0.0, 0.1, (2, n))) * [[-1.0], [1.0]]
    target = chance.normal(0.0, 0.4, 2)
    bodies = ["ground", *(f"link{k}" for k in range(n))]
    at = [0.0, *lengths.tolist()]
    text = ["format = 1", 'units = { length = "mm", angle = "deg", force = "N" }']
    for k in range(n):
        text += [
            f"joints.J{k}.type = 'revolute'",
            f"joints.J{k}.on = {{ {bodies[k]} = [{at[k]}, 0], link{k} = [0, 0] }}",
        ]
        text += [f"drives.q{k} = {{ joint = 'J{k}', values = [{angles[k]}] }}"]
        text += [f"limits.drives.q{k} = {ranges[:, k].tolist()}"]
    m = jp.loads("\n".join([*text, f"output = {{ body = '{bodies[-1]}', at = [{at[-1]}, 0] }}"]))

    def missed(q: np.ndarray) -> np.ndarray:
        sums = np.cumsum(np.radians([angles, q]), axis=1)
        place = np.stack([np.cos(sums) @ lengths, np.sin(sums) @ lengths], axis=1)
        return np.asarray(place[1] - place[0] - target)

    inside = [np.clip(angles, ranges[0] + 1e-9, ranges[1] - 1e-9), *chance.uniform(*ranges, (3, n))]
    best = min(2.0 * least_squares(missed, q, bounds=ranges, xtol=1e-15, ftol=1e-15, gtol=1e-15).cost for q in inside)
    result = jp.compensate(m, "given", target=target.tolist(), weights=(1.0, 0.0))
    assert result.settled.all()
    left = missed(result.drive_corrected.values[0])
    np.testing.assert_allclose(left, result.residual.values[0, :2] - target, atol=1e-9)
    assert np.linalg.norm(left) == pytest.approx(np.sqrt(best), rel=1e-6, abs=1e-8)


def pendulum(value: float = -90.0, **clearance: float) -> jp.Builder:
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0), **({"clearance": clearance} if clearance else {}))
    b.drive("q", joint="pivot", values=[value], backlash=0.2)
    b.output(body="arm", at=(200, 0))
    return b


@pytest.mark.parametrize(("value", "change"), [(-89.95, 0.1), (-90.03, -0.1)])
def test_a_drive_inside_its_backlash_goes_to_the_flank_that_carries_the_arm(value: float, change: float) -> None:
    """An arm that hung inside the backlash was left there, since "no drive can remove the rest"."""
    alone = pendulum(value)
    alone.load(force=(0, -20))
    result = jp.compensate(alone.mechanism())
    assert result.correction.item() == pytest.approx(change, abs=1e-7)
    assert result.residual_position.item() < 1e-7
    assert not result.inside_play.item()
    cases = pendulum(value)
    cases.load("light", force=(0, -10))
    cases.load("heavy", force=(0, -20))
    table = jp.compensate(cases.mechanism(), one_table=True)
    assert table.correction.values.ravel() == pytest.approx(change, abs=1e-6)
    assert table.residual_position.values.ravel() == pytest.approx(0.0, abs=1e-6)


def test_where_neither_flank_helps_the_command_stays_as_it_is() -> None:
    b = pendulum(radial=0.05)
    b.load(force=(0, -20))
    result = compensate.compute(b.mechanism())
    assert result.get("correction").item() == 0.0
    assert result.get("residual_position").item() == pytest.approx(0.05, abs=1e-9)
    told = " ".join(sentence.text for sentence in conclude(result).sentences)
    assert "no drive can remove the rest: inside its play q does not act" in told
    assert "Largest change" not in told


def test_two_drives_inside_their_backlash_go_to_their_flanks() -> None:
    result = jp.compensate(leg(-89.8, 0.1).mechanism())
    assert result.error_position.item() > 0.5
    assert result.residual_position.item() < 1e-6


def test_a_drive_that_the_backlash_of_a_gear_keeps_from_its_arm_goes_through_it() -> None:
    b = planar()
    b.revolute("shaft", ground=(0, 0), pinion=(0, 0))
    b.revolute("pivot", ground=(60, 0), wheel=(0, 0))
    b.gear("mesh", pinion=(0, 0), wheel=(0, 0), teeth=(20, 40), module=2, clearance={"backlash": 0.2})
    b.drive("q", joint="shaft", values=[0.1])
    b.output(body="wheel", at=(200, 0))
    b.start("wheel", angle=-90)
    b.load(force=(0, -20))
    result = jp.compensate(b.mechanism())
    # Half of the backlash, at the pitch circle of the pinion.
    assert abs(result.correction.item()) == pytest.approx(np.rad2deg(0.1 / 20.0), rel=0.1)
    assert result.residual_position.item() < 1e-6
