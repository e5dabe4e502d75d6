"""The public functions: what a result is made of, and that each of them answers what it says."""

from __future__ import annotations

import math
from typing import Any

import jointplay as jp
import numpy as np
import pytest
import xarray as xr
from jointplay.analyses import random as random_question
from jointplay.analyses import sweep as sweep_question
from jointplay.analyses.nominal import Interrupted
from jointplay.result import Builder, blame, from_dataset, merge, to_dataset

EXAMPLES = jp.examples.names()
LABELLED = {"component", "source", "joint", "parameter", "extreme", "quantity", "body", "drive", "outcome", "side"}
PLAIN = {"failures", "histogram", "outside", "iterations", "singular_value", "worst_direction", "status"}


def example(name: str, **changes: Any) -> jp.Mechanism:
    m = jp.loads(jp.examples.text(name), f"{name}.toml")
    return m.with_({key.replace("__", "."): value for key, value in changes.items()}) if changes else m


def ask(question: str, m: jp.Mechanism) -> xr.Dataset:
    if question == "random":
        return jp.random(m, samples=2000)
    if question == "given":
        return jp.given(m, {m.parameters[0]: 0.001})
    return getattr(jp, question)(m)


def distance(error: xr.DataArray) -> np.ndarray:
    return np.hypot(error.sel(component="x"), error.sel(component="y")).values


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("question", ["solve", "given", "loaded", "worst", "random", "compensate"])
class TestEveryResult:
    def test_names_everything(self, question: str, name: str) -> None:
        m = example(name)
        result = ask(question, m)
        assert result.attrs["title"] == m.title
        assert result.attrs["question"] == question
        assert set(result.dims) & LABELLED <= set(result.coords)
        for drive, factor in zip(m.drives, m.drive_factors, strict=True):
            assert result[drive].dims == ("configuration",)
            if m.drive_values is not None:
                np.testing.assert_allclose(result[drive] * factor, m.drive_values[:, m.drives.index(drive)], rtol=1e-15)
        for dim, labels in (("source", m.sources), ("joint", m.joints), ("parameter", m.parameters)):
            if dim in result.dims:
                assert result[dim].values.tolist() == list(labels)

    def test_says_its_units(self, question: str, name: str) -> None:
        result = ask(question, example(name))
        for variable in result.data_vars.values():
            assert variable.attrs["long_name"]
            if variable.dtype.kind == "f" and variable.name not in PLAIN:
                assert variable.attrs.get("units") or variable.name == "coordinate", variable.name

    def test_is_ok_where_the_example_is(self, question: str, name: str) -> None:
        status = ask(question, example(name)).status
        assert status.dims == ("configuration",)
        if question in ("solve", "given", "worst", "random"):
            assert status.values.tolist() == ["ok"] * len(status)

    def test_survives_the_way_through_the_light_form(self, question: str, name: str) -> None:
        result = ask(question, example(name))
        assert to_dataset(from_dataset(result)).identical(result)


def test_numbers_do_not_depend_on_what_the_units_are_called() -> None:
    """The same numbers in inches and pounds: geometry scales, so do all lengths and moments of the result."""
    # Weight is in SI whatever the units, so it is left out.
    metric = example("slider-crank", gravity=None)
    imperial = metric.with_({"units.length": "in", "units.force": "lbf"})
    for question in ("worst", "loaded", "compensate"):
        one, other = ask(question, metric), ask(question, imperial)
        for name, variable in one.data_vars.items():
            if variable.dtype.kind == "f":
                np.testing.assert_allclose(other[name], variable, rtol=1e-6, atol=1e-9, err_msg=str(name))
    assert ask("worst", imperial).worst_position.units == "in"
    assert ask("loaded", imperial).wrench_unit.values.tolist() == ["lbf", "lbf", "lbf in"]


def test_radians_come_out_when_radians_go_in() -> None:
    degrees = example("four-bar")
    radians = degrees.with_(
        {
            "units.angle": "rad",
            "start": {body: {"angle": math.radians(at["angle"])} for body, at in degrees.value("start").items()},
            "drives.theta1.values": np.deg2rad(degrees.value("drives.theta1.values")),
        }
    )
    one, other = jp.worst(degrees), jp.worst(radians)
    np.testing.assert_allclose(np.rad2deg(other.worst_rotation), one.worst_rotation, rtol=1e-9)
    np.testing.assert_allclose(other.worst_position, one.worst_position, rtol=1e-9)
    assert other.worst_rotation.units == "rad"


class TestSolve:
    def test_a_path_is_followed_and_its_drives_are_given(self) -> None:
        result = jp.solve(example("five-bar"))
        assert np.abs(result.mismatch.sel(component=["x", "y"])).max() < 1e-9
        assert np.isnan(result.mismatch.sel(component="angle")).all()
        assert len(set(result.left.values)) == result.sizes["configuration"]

    def test_coordinates_of_driven_joints_are_the_drive_values(self) -> None:
        for name in EXAMPLES:
            m = example(name)
            result = jp.solve(m)
            for drive, joint in zip(m.drives, m.drive_joints, strict=True):
                gap = result.coordinate.isel(joint=joint) - result[drive]
                if m.joint_kinds[joint] == "revolute":
                    gap = (gap + 180) % 360 - 180
                np.testing.assert_allclose(gap, 0, atol=1e-8, err_msg=f"{name} {drive}")

    def test_ranges_of_joints_are_watched(self) -> None:
        m = example("four-bar", limits__joints__J4=[0, 50])
        result = jp.solve(m)
        inside = (result.coordinate.sel(joint="J4") <= 50).values
        assert 0 < inside.sum() < len(inside)
        assert result.within_limits.values.tolist() == inside.tolist()

    def test_drive_values_stand_where_the_links_cannot_follow(self) -> None:
        result = jp.solve(example("four-bar", drives__theta1__values=[22.7, 180.0]))
        assert result.status.values.tolist() == ["ok", "not_assembled"]
        assert result.theta1.values.tolist() == pytest.approx([22.7, 180.0])
        assert np.isnan(result.nominal[1]).all()

    def test_no_variable_is_lost_to_a_drive_of_its_name(self) -> None:
        builder = Builder(example("four-bar"), "solve")
        builder.drives(np.array([[0.1], [0.2]]))
        builder.add("theta1", "configuration", np.array([3.0, 4.0]), "a variable")
        result = to_dataset(builder.result())
        assert result.theta1.values.tolist() == [3.0, 4.0]
        np.testing.assert_allclose(result["drive theta1"], np.rad2deg([0.1, 0.2]))
        assert list(from_dataset(result).drives) == ["drive theta1"]


class TestGiven:
    def test_offsets_may_be_said_in_many_ways(self) -> None:
        m = example("four-bar")
        n = len(jp.solve(m).configuration)
        one = jp.given(m, {"J1": [0.5, -0.25], "l2": 0.125})
        u = np.zeros(len(m.parameters))
        u[[0, 1, m.parameters.index("l2.length")]] = [0.5, -0.25, 0.125]
        array = xr.DataArray(u, coords={"parameter": list(m.parameters)}, dims="parameter")
        for offsets in (
            {"J1.x": 0.5, "J1.y": -0.25, "l2.length": 0.125},
            {"J1": np.tile([0.5, -0.25], (n, 1)), "l2": np.full(n, 0.125)},
            u,
            np.tile(u, (n, 1)),
            array,
            one,
        ):
            assert jp.given(m, offsets).error.equals(one.error)
        assert jp.given(m, {"J1": [0.5, -0.25]}, deviations={"l2": 0.125}).error.equals(one.error)

    def test_one_value_per_configuration(self) -> None:
        m = example("four-bar")
        values = np.linspace(-1, 1, 11)
        varied = jp.given(m, {"J2.x": values})
        for k in (0, 4, 10):
            same = jp.given(m, {"J2.x": values[k]})
            np.testing.assert_array_equal(varied.error[k], same.error[k])

    @pytest.mark.parametrize("name", EXAMPLES)
    def test_the_certificate_of_the_worst_case_can_be_handed_on(self, name: str) -> None:
        m = example(name)
        worst = jp.worst(m)
        again = jp.given(m, worst.worst_offset.sel(extreme="position"))
        np.testing.assert_allclose(distance(again.error), worst.worst_position, rtol=0, atol=1e-10)
        assert again.admissible.all()

    def test_the_result_of_loaded_can_be_handed_on(self) -> None:
        m = example("six-bar")
        loaded = jp.loaded(m)
        np.testing.assert_allclose(jp.given(m, loaded).error, loaded.error, rtol=0, atol=1e-10)

    def test_contributions_add_up(self) -> None:
        result = jp.given(example("six-bar"), {"A": [0.02, 0.01], "link": 0.05, "theta": 0.1, "C.y": -0.01})
        np.testing.assert_allclose(result.contribution.sum("source"), result.error_first_order, rtol=0, atol=1e-12)
        assert set(result.source.values[(result.contribution != 0).any(["configuration", "component"])]) == {
            "A", "link", "theta", "C",
        }  # fmt: skip

    def test_an_offset_that_does_not_fit_is_told(self) -> None:
        result = jp.given(example("four-bar"), {"J1": [0.8, 0.8], "J2": [0.6, 0.7]})
        inside = result.admissible.all("configuration")
        assert inside.source.values[~inside].tolist() == ["J1"]

    @pytest.mark.parametrize(
        ("offsets", "deviations", "part"),
        [
            ({"J9": [0, 0]}, None, "'J9' is not a source or a parameter"),
            ({"J1": 0.5}, None, "2 numbers (J1.x, J1.y)"),
            ({"J1": [1, 2, 3]}, None, "shape (3,)"),
            ({"J1": "far"}, None, "not a number"),
            ({"J1.x": math.nan}, None, "not finite"),
            ({"J1": [0, 0], "J1.x": 1}, None, "given twice"),
            ({}, {"J1": [0, 0]}, "is a clearance"),
            (np.zeros(3), None, "configurations by parameters"),
            (xr.DataArray([0.0], dims="foo"), None, "configuration and parameter"),
            (xr.Dataset(), None, "no variable 'offset'"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, offsets: Any, deviations: Any, part: str) -> None:
        with pytest.raises(jp.InputError) as refusal:
            jp.given(example("four-bar"), offsets, deviations)
        assert part in str(refusal.value)


def test_loaded_needs_a_load() -> None:
    with pytest.raises(jp.InputError, match="nothing loads the mechanism"):
        jp.loaded(example("four-bar", loads=None))


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

    def test_what_cannot_be_assembled_stays_so(self) -> None:
        result = jp.compensate(example("four-bar", drives__theta1__values=[22.7, 180.0]))
        assert result.status.values.tolist() == ["ok", "not_assembled"]
        assert np.isfinite(result.drive_corrected[0]).all()
        assert np.isnan(result.drive_corrected[1]).all()
        assert not result.settled[1]

    @pytest.mark.parametrize(
        ("arguments", "part"),
        [
            ({"question": "worst"}, "'worst' is not an error that drives can correct"),
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


class TestCompare:
    def test_both_follow_the_same_path(self) -> None:
        """The common path of P3R and 4R: two isosceles links of 75 mm span the actuator's length."""
        result = jp.compare(example("p3r"), example("four-bar"))
        assert np.abs(result.mismatch.sel(component=["x", "y"])).max() < 1e-9
        v = result.drive_value.sel(mechanism="p3r", drive="v").values
        x = (150.0**2 - v**2 - 100.0**2) / 200.0
        expected = np.rad2deg(np.arccos(x / v) - np.arccos(v / 150.0))
        theta = result.drive_value.sel(mechanism="four-bar", drive="theta1")
        np.testing.assert_allclose(theta, expected, rtol=0, atol=1e-9)
        assert np.isnan(result.drive_value.sel(mechanism="p3r", drive="theta1")).all()

    def test_each_side_is_what_it_would_answer_alone(self) -> None:
        a, b = example("four-bar"), example("p3r")
        result = jp.compare(a, b, "loaded")
        assert result.error.sel(mechanism="four-bar").drop_vars("mechanism").equals(jp.loaded(a).error.drop_vars("theta1"))
        values = result.drive_value.sel(mechanism="p3r", drive="v").values.tolist()
        alone = jp.loaded(b.with_({"drives.v.values": values}))
        np.testing.assert_allclose(result.error.sel(mechanism="p3r"), alone.error, rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            result.contribution.sel(mechanism="p3r", source=list(b.sources)), alone.contribution, rtol=0, atol=1e-9
        )
        only = [source for source in a.sources if source not in b.sources]
        assert np.isnan(result.contribution.sel(mechanism="p3r", source=only)).all()

    def test_results_are_in_the_units_of_the_first(self) -> None:
        text = jp.examples.text("p3r").replace('length = "mm"', 'length = "cm"')
        a, b = example("four-bar"), jp.loads(text, "large.toml")
        alone = jp.worst(b)
        scaled = jp.compare(b, b.with_({"title": "again"}), names=("one", "two"))
        np.testing.assert_allclose(scaled.worst_position.sel(mechanism="two"), alone.worst_position, rtol=1e-9)
        # Ten times as large as the path asks: it cannot follow, but what it says is in mm.
        result = jp.compare(a, b, components=["x"])
        assert result.nominal.attrs["units"] == "mm, mm, deg"
        inside = result.nominal.sel(mechanism="large", component="x")
        np.testing.assert_allclose(inside, jp.solve(a).nominal.sel(component="x"), rtol=0, atol=1e-6)

    def test_a_path_that_cannot_be_followed_is_told(self) -> None:
        far = example("four-bar", drives__theta1__values=[22.7])
        result = jp.compare(far, example("slider-crank"))
        gap = result.mismatch.sel(mechanism="slider-crank", component=["x", "y"])
        assert float(np.hypot(*gap.values[0])) > 10

    def test_two_of_a_name_are_told_apart(self) -> None:
        m = example("four-bar")
        tight = m.with_({"joints.*.clearance.radial": 0.1})
        assert jp.compare(m, tight).mechanism.values.tolist() == ["four-bar", "four-bar (2)"]
        assert jp.compare(m, tight, names=("loose", "tight")).mechanism.values.tolist() == ["loose", "tight"]
        with pytest.raises(jp.InputError, match="two names"):
            jp.compare(m, tight, names=("same", "same"))

    def test_unknown_words_are_refused(self) -> None:
        m = example("four-bar")
        with pytest.raises(jp.InputError, match="'given' is not a question"):
            jp.compare(m, m, "given")
        with pytest.raises(jp.InputError, match="'z' is not a component"):
            jp.compare(m, m, components=["x", "z"])


class TestSweep:
    def test_every_step_is_the_question_at_that_value(self) -> None:
        m = example("slider-crank")
        result = jp.sweep(m, "joints.*.clearance.radial", [0.0, 0.01, 0.03], "loaded")
        assert result.radial.values.tolist() == [0.0, 0.01, 0.03]
        assert result.radial.units == "mm"
        for k, radial in enumerate(result.radial.values):
            alone = jp.loaded(m.with_({"joints.*.clearance.radial": radial}))
            np.testing.assert_array_equal(result.error[k], alone.error)

    def test_other_things_than_clearances(self) -> None:
        m = example("four-bar")
        moved = jp.sweep(m, "drives.theta1.error", [0.0, 0.5])
        assert (moved["error"].values == [0.0, 0.5]).all()
        assert moved["error"].units == "deg"
        laws = jp.sweep(m, "joints.J1.clearance.law", ["uniform", "boundary"], "random", samples=2000)
        assert laws.law.values.tolist() == ["uniform", "boundary"]
        assert (laws.std_first_order[1] > laws.std_first_order[0]).all()

    def test_several_keys_get_the_same_value(self) -> None:
        m = example("four-bar")
        keys = [f"joints.{joint}.clearance.radial" for joint in m.joints]
        assert jp.sweep(m, keys, [0.5]).worst_position.equals(
            jp.sweep(m, "joints.*.clearance.radial", [0.5]).worst_position
        )

    def test_the_new_dimension_never_hides_another(self) -> None:
        result = jp.sweep(example("four-bar", limits__position=1.0), "limits.position", [1.0, 2.0], "random", samples=1000)
        assert result.position.values.tolist() == [1.0, 2.0]
        result = jp.sweep(example("four-bar"), "joints.J1.clearance.radial", [1.0], name="nominal")
        assert "nominal" in result.data_vars
        assert result.sizes["joints_J1_clearance_radial"] == 1

    @pytest.mark.parametrize(
        ("key", "values", "part"),
        [
            ("joints.J9.clearance.radial", [1], "'J9' is not a joint"),
            ("joints.*.clearance.radial", [], "at least one value"),
            ("joints.*.clearance.radial", [0.1, -1], "negative"),
            ("joints.*.clearance.radial", [0.1, "wide"], "all numbers or all words"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, key: str, values: list[Any], part: str) -> None:
        with pytest.raises(jp.InputError) as refusal:
            jp.sweep(example("four-bar"), key, values)
        assert part in str(refusal.value) or "greater than or equal" in str(refusal.value)

    def test_steps_of_different_shape_are_refused(self) -> None:
        m = example("four-bar").with_({"drives.theta1": {"joint": "J1", "from": 20, "to": 70, "count": 3}})
        with pytest.raises(jp.InputError, match="another configuration than before"):
            jp.sweep(m, "drives.theta1.count", [3, 4])

    def test_unknown_options_are_refused(self) -> None:
        with pytest.raises(TypeError):
            jp.sweep(example("four-bar"), "joints.*.clearance.radial", [0.1], samplse=3)


class TestRandom:
    def test_quantiles_are_those_asked_for(self) -> None:
        result = jp.random(example("four-bar"), samples=5000, probabilities=[0.25, 0.75])
        assert result.probability.values.tolist() == [0.25, 0.75]
        counts = result.histogram.sum("bin")
        assert (counts == result.failures.sel(outcome="ok")).all()

    @pytest.mark.parametrize(
        ("arguments", "part"),
        [
            ({"samples": 1}, "not a number of samples"),
            ({"seed": -1}, "not a seed"),
            ({"law": "triangular"}, "'triangular' is not a law"),
            ({"probabilities": [0.5, 1.0]}, "between 0 and 1"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, arguments: dict[str, Any], part: str) -> None:
        with pytest.raises(jp.InputError) as refusal:
            jp.random(example("four-bar"), **arguments)
        assert part in str(refusal.value)


class TestInterruption:
    def test_random_keeps_the_configurations_that_are_done(self) -> None:
        m = example("four-bar")

        def stop(done: int, total: int) -> None:
            assert total == 11
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(Interrupted) as stopped:
            random_question.compute(m, samples=2000, progress=stop)
        partial = to_dataset(stopped.value.partial)
        assert "3 of 11" in partial.attrs["incomplete"]
        whole = jp.random(m, samples=2000)
        for name in ("mean", "quantile", "theta1"):
            np.testing.assert_array_equal(partial[name], whole[name][:3])

    def test_sweep_keeps_the_steps_that_are_done(self) -> None:
        m = example("four-bar")

        def stop(done: int, total: int) -> None:
            if done == 2:
                raise KeyboardInterrupt

        key, values = "joints.*.clearance.radial", [0.1, 0.2, 0.3]
        with pytest.raises(Interrupted) as stopped:
            sweep_question.compute(m, key, values, progress=stop)
        partial = to_dataset(stopped.value.partial)
        assert partial.radial.values.tolist() == [0.1, 0.2]
        assert partial.worst_position.equals(jp.sweep(m, key, values[:2]).worst_position)

    def test_nothing_done_is_a_plain_interruption(self) -> None:
        def stop(done: int, total: int) -> None:
            raise KeyboardInterrupt

        class Never(list[float]):
            def __iter__(self):  # type: ignore[no-untyped-def]
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt) as stopped:
            sweep_question.compute(example("four-bar"), "joints.*.clearance.radial", Never([1.0]), progress=stop)
        assert not isinstance(stopped.value, Interrupted)


class TestBlame:
    @pytest.mark.parametrize("question", ["worst", "loaded", "random"])
    @pytest.mark.parametrize("name", EXAMPLES)
    def test_shares_add_up_to_one(self, question: str, name: str) -> None:
        shares = blame(from_dataset(ask(question, example(name))))
        for table in (shares.position, shares.rotation):
            total = table.sum(axis=1)
            np.testing.assert_allclose(total[np.isfinite(total)], 1.0, atol=1e-9)
        assert np.isfinite(shares.position).all()

    def test_the_loosest_joint_is_to_blame(self) -> None:
        m = example("four-bar", joints__J3__clearance__radial=5.0)
        for question in ("worst", "loaded", "random"):
            names, share = blame(from_dataset(ask(question, m))).largest("position", 5) or ([], 0.0)
            assert names == ["J3"]
            assert 0.5 < share < 1.0

    def test_sources_that_cannot_be_told_apart_are_named_together(self) -> None:
        found = blame(from_dataset(jp.worst(example("four-bar")))).largest("rotation", 0)
        assert found is not None
        assert found[0] == ["J1", "J2", "J3", "J4"]
        assert found[1] == pytest.approx(0.25, abs=1e-3)

    def test_nobody_is_to_blame_for_nothing(self) -> None:
        m = example("four-bar", **{"joints__*__clearance__radial": 0.0})
        assert blame(from_dataset(jp.worst(m))).largest("position", 0) is None


def test_merging_keeps_every_variable() -> None:
    m = example("four-bar")
    parts = {name: from_dataset(ask(name, m)) for name in ("loaded", "worst", "random", "given")}
    merged = merge(parts)
    for question, part in parts.items():
        for name, variable in part.data.items():
            home = name if name == "nominal" or name.startswith(f"{question}_") else f"{question}_{name}"
            assert merged.data[home] is variable or name == "nominal"
    assert {"loaded_error", "given_error", "worst_position", "random_mean", "worst_status"} <= set(merged.data)


def test_a_mechanism_that_is_not_determinate_is_refused_by_every_question() -> None:
    m = example("four-bar", drives=None)
    for question in ("solve", "given", "loaded", "worst", "random"):
        with pytest.raises(jp.InputError, match="too few drives"):
            ask(question, m)
    assert jp.check(m).attrs["determinate"] == 0


def test_check_says_what_there_is() -> None:
    result = jp.check(example("slider-crank"))
    assert result.joint_kind.sel(joint="guide").item() == "prismatic"
    assert result.size.sel(source="guide").item() == pytest.approx(0.03)
    assert result.source_unit.sel(source="guide").item() == "mm"
    assert result.driven_joint.values.tolist() == ["main"]
    assert result.attrs["assembled"] == 1
    assert jp.check(example("five-bar")).attrs["degrees_of_freedom"] == 2
