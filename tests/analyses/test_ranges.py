"""Where the machine cannot stand, because a drive or a joint would leave its range, nothing is judged.

The largest error of a 3-UPU was told for a place that its legs cannot reach: 17 mm, where inside it is 6.6.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.mapped import span
from jointplay.analyses import compare, sweep
from jointplay.cli import run
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude

#: a four-bar whose rocker has a range that some of its path leaves
RANGE = {"limits.joints": {"J4": [0, 50]}}


def errors(result: Any) -> np.ndarray:
    return np.asarray(result.worst_position.values)


def test_rows_outside_have_a_pose_and_no_error() -> None:
    free, held = jp.worst(example("four-bar")), jp.worst(example("four-bar", **RANGE))
    outside = (held.status == "outside_limits").values
    assert 0 < outside.sum() < len(outside)
    assert held.leaves_range.values.tolist() == np.where(outside, "J4", "").tolist()
    np.testing.assert_array_equal(errors(held), np.where(outside, np.nan, errors(free)))
    np.testing.assert_array_equal(held.nominal, free.nominal)


@pytest.mark.parametrize("question", ["worst", "random", "given", "solve", "loaded"])
def test_the_first_sentence_says_how_many_and_what_leaves_its_range(question: str) -> None:
    m = example("four-bar", **RANGE, loads=[{"force": [0, -10], "at": [0, 0]}] if question == "loaded" else [])
    options = {"random": {"samples": 64}, "given": {"offsets": {"J1": [0.01, 0]}}}.get(question, {})
    result = getattr(jp, question)(m, **options)
    outside = int((result.status == "outside_limits").sum())
    first = conclude(from_dataset(result)).sentences[0]
    assert first.is_alarm
    assert f"{outside} outside limits" in first.text
    assert "J4 leaves its range" in first.text


def test_the_nearness_to_singularities_tells_of_rows_outside_as_well() -> None:
    held = example("four-bar", **RANGE)
    np.testing.assert_array_equal(jp.singularities(held, path=False).status, jp.solve(held).status)


def test_the_largest_error_is_that_of_the_rest() -> None:
    result = jp.worst(example("four-bar", **RANGE, limits__position=None))
    inside = (result.status == "ok").values
    said = " ".join(sentence.text for sentence in conclude(from_dataset(result)).sentences)
    assert f"Largest position error: {errors(result)[inside].max():.4g} mm" in said


def test_a_limit_that_only_rows_outside_miss_is_not_missed() -> None:
    free = jp.worst(example("four-bar"))
    outside = (jp.worst(example("four-bar", **RANGE)).status == "outside_limits").values
    largest, rest = errors(free)[outside].max(), errors(free)[~outside].max()
    assert largest != rest
    # Above what the rest has; where the rows outside have more, only they would miss it.
    m = example("four-bar", **RANGE, **{"limits.position": float(1.001 * rest)})
    said = [sentence.text for sentence in conclude(from_dataset(jp.worst(m))).sentences]
    assert any(text.startswith("Limits hold") for text in said)
    assert not any("Not known" in text or "missed" in text for text in said)


def test_a_map_with_strokes_counts_the_nodes_inside_only() -> None:
    strokes = {"limits.drives": {f"l{k}": [360, 499] for k in (1, 2, 3)}}
    grid = {"x": span(-200, 200, 5), "y": span(-200, 200, 5), "z": span(350, 450, 2)}
    result = jp.map(example("3-upu", **strokes), "worst", grid, exact=False)
    inside = np.all([(result[k] >= 360) & (result[k] <= 499) for k in ("l1", "l2", "l3")], axis=0)
    assert 0 < inside.sum() < inside.size
    np.testing.assert_array_equal(result.status, np.where(inside, "ok", "outside_limits"))
    free = jp.map(example("3-upu"), "worst", grid, exact=False)
    assert float(free.worst_position.max()) > float(free.worst_position.values[inside].max())
    said = conclude(from_dataset(result)).sentences
    assert f"{(~inside).sum()} outside limits (l" in said[0].text
    assert f"of the {inside.sum()} nodes" in said[1].text
    assert f"{free.worst_position.values[inside].max():.4g} mm" in said[2].text


def test_comparisons_and_sweeps_count_the_rest() -> None:
    held, free = example("four-bar", **RANGE), example("four-bar")
    outside = (jp.solve(held).status == "outside_limits").values
    for pair in ((held, free), (free, held)):
        found = compare.compute(*pair, names=("first", "second"))
        bounded = ("first", "second")[pair.index(held)]
        np.testing.assert_array_equal(np.isnan(found.get("worst_position", mechanism=bounded)), outside)
        assert "J4 leaves its range" in conclude(found).sentences[0].text
    swept = sweep.compute(held, "joints.J1.clearance.radial", [0.01, 0.02])
    assert np.isnan(swept.get("worst_position")[:, outside]).all()
    assert "outside limits (J4 leaves its range)" in conclude(swept).sentences[0].text


def test_corrections_and_costs_leave_them_out() -> None:
    held = example("four-bar", **RANGE)
    outside = (jp.solve(held).status == "outside_limits").values
    found = jp.compensate(held, "given", {"J1": [0.01, 0]})
    np.testing.assert_array_equal(np.isnan(found.correction.values).any(-1), outside)
    # What limits the rest is bought, whatever the rows outside would need.
    inside = example("four-bar")
    kept = jp.solve(inside)["theta1"].values[~outside].tolist()
    costs = {"costs": {"J1": {"model": "reciprocal", "b": 1, "from": 0.001, "to": 10}}}
    limit = {"limits.position": float(0.9 * errors(jp.worst(inside))[~outside].max())}
    whole = jp.allocate(held.with_(costs | limit))
    part = jp.allocate(inside.with_(costs | limit | {"drives.theta1.values": kept}))
    np.testing.assert_allclose(whole["size"], part["size"], rtol=1e-6)


def test_the_exit_code_tells_of_rows_outside(tmp_path: Path) -> None:
    path = tmp_path / "four-bar.toml"
    path.write_text(jp.examples.text("four-bar"))
    assert run(["solve", str(path)]) == 0
    assert run(["solve", str(path), "-s", "limits.joints.J4=[0, 50]"]) == 1


def test_of_a_singular_pose_there_is_no_number() -> None:
    """A worst error of 2,600 mm was printed, and of 8,024 after the axes of a body had been put elsewhere."""
    # Driven by its rocker: crank and coupler in one line.
    angle = math.degrees(math.acos(1 / 3))
    m = example("four-bar", **{"drives.theta1.joint": "J4", "drives.theta1.values": [50.0, angle]})
    assert jp.solve(m).status.values.tolist() == ["ok", "singular"]
    for result in (jp.worst(m), jp.random(m, 64), jp.given(m, {"J1": [0.01, 0]})):
        own = [name for name, v in result.data_vars.items() if v.dims[:1] == ("configuration",) and v.dtype.kind == "f"]
        shown = {name for name in own if np.isfinite(result[name][1]).any()}
        # The pose, and what was asked.
        assert shown <= {"nominal", "offset"}, shown
        assert {name for name in own if np.isfinite(result[name][0]).any()} > shown


def test_where_the_clearances_reach_a_singular_pose_the_first_order_alone_is_told() -> None:
    angle = math.degrees(math.acos(1 / 3)) - 0.01
    m = example("four-bar", **{"drives.theta1.joint": "J4", "drives.theta1.values": [angle], "limits.position": None})
    result = jp.worst(m)
    assert result.status.item() == "singular"
    assert np.isnan(result.worst_position).all()
    assert np.isnan(result.worst_offset).all()
    assert np.isfinite(result.worst_position_first_order).all()
