"""Comparisons, sweeps, questions in one file, shares of the sources; and what Ctrl-C leaves of them."""

from itertools import product
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import EXAMPLES, ask, example
from jointplay.analyses import random as random_question
from jointplay.analyses import sweep as sweep_question
from jointplay.analyses.nominal import Interrupted
from jointplay.result import blame, from_dataset, merge, to_dataset


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
        assert (
            result.error.sel(mechanism="four-bar").drop_vars("mechanism").equals(jp.loaded(a).error.drop_vars("theta1"))
        )
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
        with pytest.raises(jp.InputError, match="a name of its own"):
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
        assert (laws.error_std_first_order[1] > laws.error_std_first_order[0]).all()

    def test_several_keys_get_the_same_value(self) -> None:
        m = example("four-bar")
        keys = [f"joints.{joint}.clearance.radial" for joint in m.joints]
        assert jp.sweep(m, keys, [0.5]).worst_position.equals(
            jp.sweep(m, "joints.*.clearance.radial", [0.5]).worst_position
        )

    def test_the_new_dimension_never_hides_another(self) -> None:
        result = jp.sweep(
            example("four-bar", limits__position=1.0), "limits.position", [1.0, 2.0], "random", samples=1000
        )
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


class TestBlame:
    @pytest.mark.parametrize(("name", "question"), [*product(EXAMPLES, ["worst", "loaded", "random"])])
    def test_shares_add_up_to_one(self, name: str, question: str) -> None:
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


class TestInterruption:
    def test_random_keeps_the_configurations_that_are_done(self) -> None:
        m = example("four-bar")

        def stop(done: int, total: int) -> None:
            assert total == 11
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(Interrupted) as stopped:
            random_question.compute(m, samples=2000, contact="scattered", progress=stop)
        partial = to_dataset(stopped.value.partial)
        assert "3 of 11" in partial.attrs["incomplete"]
        whole = jp.random(m, samples=2000)
        for name in ("error_mean", "error_quantile", "theta1"):
            np.testing.assert_array_equal(partial[name], whole[name][:3])

    def test_sweep_keeps_the_steps_that_are_done(self) -> None:
        m = example("four-bar")

        def stop(done: int, _: int) -> None:
            if done == 2:
                raise KeyboardInterrupt

        key, values = "joints.*.clearance.radial", [0.1, 0.2, 0.3]
        with pytest.raises(Interrupted) as stopped:
            sweep_question.compute(m, key, values, progress=stop)
        partial = to_dataset(stopped.value.partial)
        assert partial.radial.values.tolist() == [0.1, 0.2]
        assert partial.worst_position.equals(jp.sweep(m, key, values[:2]).worst_position)

    def test_nothing_done_is_a_plain_interruption(self) -> None:
        class Never(list[float]):
            def __iter__(self):  # type: ignore[no-untyped-def]
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt) as stopped:
            sweep_question.compute(example("four-bar"), "joints.*.clearance.radial", Never([1.0]))
        assert not isinstance(stopped.value, Interrupted)


def test_merging_keeps_every_variable() -> None:
    m = example("four-bar")
    parts = {name: from_dataset(ask(name, m)) for name in ("loaded", "worst", "random", "given")}
    merged = merge(parts)
    for question, part in parts.items():
        for name, variable in part.data.items():
            home = name if name == "nominal" or name.startswith(f"{question}_") else f"{question}_{name}"
            assert merged.data[home] is variable or name == "nominal"
    assert {"loaded_error", "given_error", "worst_position", "random_error_mean", "worst_status"} <= set(merged.data)


def test_merging_what_was_interrupted_leaves_the_rest_empty() -> None:
    m = example("four-bar")

    def stop(done: int, _: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        random_question.compute(m, samples=100, progress=stop)
    merged = to_dataset(merge({"worst": from_dataset(jp.worst(m)), "random": stopped.value.partial}))
    assert merged.sizes["configuration"] == 11
    assert np.isfinite(merged.random_error_std[:4]).all()
    assert np.isnan(merged.random_error_std[4:]).all()
    assert merged.random_status.values.tolist() == ["ok"] * 4 + [""] * 7
    assert merged.theta1.equals(jp.worst(m).theta1)
    assert np.isfinite(merged.nominal).all()


@pytest.mark.parametrize("names", [("x-braced-square", "four-bar"), ("four-bar", "redundant-bar")])
def test_a_structure_is_compared_with_a_mechanism_that_has_drives(names: tuple[str, str]) -> None:
    """One has forces of members, the other drives: it was a KeyError."""
    first, second = (jp.loads(jp.examples.text(name), name) for name in names)
    result = jp.compare(first, second)
    np.testing.assert_array_equal(result.worst_position[0], jp.worst(first).worst_position)
    assert int(np.isnan(result.drive_value).all(("configuration", "drive")).sum()) == 1
