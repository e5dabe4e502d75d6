"""The public functions: what a result is made of, and that each of them answers what it says."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import EXAMPLES, ask, distance, example
from jointplay.result import ResultBuilder, from_dataset, to_dataset

LABELLED = {"component", "source", "joint", "parameter", "extreme", "quantity", "body", "drive", "outcome", "side"}
PLAIN = {
    "failures",
    "histogram",
    *(f"outside{which}{end}" for which in ("", "_quantity") for end in ("", "_low", "_high", "_standard_error")),
    *(f"outside_loaded{end}" for end in ("", "_low", "_high")),
    *("cp", "cpk", "cp_standard_error", "cpk_standard_error"),
    *(f"yield_{which}{end}" for which in ("path", "specimen") for end in ("", "_low", "_high", "_standard_error")),
    "interference",
    "contact_rate",
    "iterations",
    "singular_value",
    "worst_direction",
    "status",
}


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("question", ["solve", "given", "loaded", "worst", "random", "compensate"])
def test_every_result_is_what_it_says(question: str, name: str) -> None:
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
    for variable in result.data_vars.values():
        assert variable.attrs["long_name"]
        if variable.dtype.kind == "f" and variable.name not in PLAIN:
            assert variable.attrs.get("units") or variable.name == "coordinate", variable.name
    status = result.status
    assert status.dims == ("configuration",)
    if question in ("solve", "given", "worst", "random"):
        assert status.values.tolist() == ["ok"] * len(status)
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
        assert result.status.values.tolist() == np.where(inside, "ok", "outside_limits").tolist()
        assert result.leaves_range.values.tolist() == np.where(inside, "", "J4").tolist()

    def test_drive_values_stand_where_the_links_cannot_follow(self) -> None:
        result = jp.solve(example("four-bar", drives__theta1__values=[22.7, 180.0]))
        assert result.status.values.tolist() == ["ok", "not_assembled"]
        assert result.theta1.values.tolist() == pytest.approx([22.7, 180.0])
        assert np.isnan(result.nominal[1]).all()

    def test_no_variable_is_lost_to_a_drive_of_its_name(self) -> None:
        builder = ResultBuilder(example("four-bar"), "solve")
        builder.drives(np.array([[0.1], [0.2]]))
        builder.add("theta1", "configuration", np.array([3.0, 4.0]), "a variable")
        result = to_dataset(builder.result())
        assert result.theta1.values.tolist() == [3.0, 4.0]
        np.testing.assert_allclose(result.drive_theta1, np.rad2deg([0.1, 0.2]))
        assert list(from_dataset(result).drives) == ["drive_theta1"]


def test_two_results_subtract_variable_by_variable_but_not_as_a_whole() -> None:
    """What the manual says of differences: a count of the one that is smaller is no 18446744073709551615 more."""
    m = example("four-bar")
    loose, tight = jp.worst(m), jp.worst(m.with_({"joints.*.clearance.radial": 0.5}))
    with pytest.raises(TypeError):
        loose - tight
    words = {str(name) for name, variable in loose.data_vars.items() if variable.dtype.kind in "Ub"}
    assert {"status", "limit_met"} <= words
    difference = loose.drop_vars(words) - tight.drop_vars(words)
    np.testing.assert_array_equal(difference.worst_position, loose.worst_position - tight.worst_position)
    unsettled = tight.unsettled - (loose.unsettled + 1)
    assert unsettled.dtype.kind == "i"
    assert (unsettled == -1).all()
    compared = jp.compare(m, m.with_({"joints.*.clearance.radial": 0.5}), names=("loose", "tight")).worst_position
    np.testing.assert_allclose(-compared.diff("mechanism")[0], difference.worst_position, rtol=1e-9)


def test_results_say_how_they_were_obtained() -> None:
    m = example("four-bar")
    for result in (jp.given(m), jp.loaded(m), jp.worst(m), jp.random(m, samples=256)):
        assert "on the exact loop closure" in result.attrs["obtained"]
    for result in (jp.loaded(m, exact=False), jp.worst(m, exact=False)):
        assert result.attrs["obtained"] == "to first order at the nominal pose"
    attained, proved = jp.worst(m, starts=7), jp.worst(m, certify=True)
    assert attained.attrs["starts"] == 7
    assert "7 starts" in attained.attrs["obtained"]
    assert "not certified" in attained.attrs["obtained"]
    assert "not certified" not in proved.attrs["obtained"]


class TestGiven:
    @pytest.mark.parametrize("name", ["four-bar", "3-upu", "geared-five-bar", "redundant-bar", "antenna-support"])
    def test_loops_are_closed_to_rounding(self, name: str) -> None:
        m = example(name)
        result = jp.given(m)
        assert result.residual.attrs["units"] == m.units.length_name
        residual = result.residual.values / (m.length / m.units.length)
        assert (residual[(result.status != "not_assembled").values] < 1e-12).all()
        assert np.isfinite(residual).all()

    def test_the_residual_is_that_of_its_pose(self) -> None:
        """The largest misfit of the four pins, from points on the bodies and offsets by hand."""
        m = example("four-bar")
        offsets = {"J1": [0.5, -0.25], "J3": [0.1, 0.9]}
        result = jp.given(m, offsets)
        ends = {"J2": ("crank", [75, 0], "coupler", [0, 0]), "J3": ("coupler", [75, 0], "rocker", [150, 0])}
        for joint, (first, at, second, on) in ends.items():
            x = [result.pose.sel(body=body).values for body in (first, second)]
            turned = [
                p[:, :2] + np.stack([np.cos(np.deg2rad(p[:, 2])), np.sin(np.deg2rad(p[:, 2]))], 1) * point[0]
                for p, point in zip(x, (at, on), strict=True)
            ]
            misfit = turned[1] - turned[0] - np.array(offsets.get(joint, [0.0, 0.0]))
            assert np.abs(misfit).max() < 1e-11
            assert (np.abs(misfit).max(axis=1) <= result.residual.values + 1e-13).all()

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
        # Poses are known to some 1e-12 of the mechanism; the excavator's links are a metre long.
        atol = max(1e-10, 1e-12 * m.length / m.units.length)
        np.testing.assert_allclose(distance(again.error), worst.worst_position, rtol=0, atol=atol)
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
