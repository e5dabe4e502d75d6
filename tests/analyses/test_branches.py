"""Nodes of maps are reached on one side of the singular poses; determinants by hand tell the sides.

A map of a five-bar called the far side of a singularity `ok`: a quarter of its nodes had the other sign, and drives
that were read there led somewhere else.
"""

import math
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers import mapped
from helpers.answers import example
from helpers.mapped import span
from jointplay.plot.interactive import figure_of
from jointplay.plot.map import layers
from jointplay.plot.shades import colour_range
from jointplay.result import counted, from_dataset
from jointplay.result.conclusions import conclude

plot = pytest.importorskip("jointplay.plot")

FIVE_BAR = mapped.DATA / "five-bar-behind-singularity.toml"
#: where both distal links lie in one line, on the axis of symmetry
EDGE = math.sqrt(230.0**2 - 92.5**2)
WIDE = {"x": span(-250, 250, 15), "y": span(-20, 380, 11)}


@pytest.fixture(scope="module")
def wide() -> Any:
    return jp.map(jp.load(FIVE_BAR), "solve", WIDE)


@pytest.mark.parametrize("case", mapped.cases(1), ids=lambda case: case.name)
def test_no_node_of_the_other_sign_is_ok_and_none_that_a_fine_path_reaches_is_refused(case: mapped.Case) -> None:
    found = mapped.compare(case, finer=8)
    # Differences of squares of some hundred millimetres.
    assert found.open < 1e-8
    assert (found.wrong, found.refused) == (0, 0)
    assert 0 < found.ok < found.nodes or "x, y and z" in case.name


def test_a_branch_that_crosses_at_a_singular_pose_is_not_taken() -> None:
    """On the cylinder of the 3-UPU its platform may begin to turn, and then has the sign of the start again."""
    grid = {"x": span(80, 320, 10), "y": span(200, 360, 7), "z": 400}
    result = jp.map(example("3-upu"), "solve", grid)
    status, away = result.status.values, np.hypot(*np.meshgrid(result.x, result.y, indexing="ij")) - 300
    np.testing.assert_array_equal(status == "ok", (away < 0) & (status != "singular"))
    assert (status == "other_branch")[away > 0].all()
    assert abs(away[status == "singular"]).max() < 0.5


def test_the_drives_of_a_node_lead_to_it(wide: Any) -> None:
    """Those of y = 100 led to y = 345.7; a path to y = 100 ends at 210.58."""
    m = jp.load(FIVE_BAR)
    result = jp.map(m, "solve", {"x": 0, "y": span(100, 372, 35)})
    y = result.y.values
    np.testing.assert_array_equal(result.status, np.where(y > EDGE, "ok", "other_branch"))
    # The node at 340 first, which is nearest to the start.
    order = [*range(30, -1, -1)]
    targets = {"path": {"x": [0] * 31, "y": y[order].tolist()}}
    path = jp.solve(m.with_({**targets, "drives.q1.values": None, "drives.q2.values": None}))
    np.testing.assert_array_equal(path.status == "ok", y[order] > EDGE)
    drives = {f"drives.{name}.values": result[name].values[order][:17].tolist() for name in m.drives}
    driven = jp.solve(m.with_(drives))
    np.testing.assert_allclose(driven.nominal, result.nominal.values[order][:17], rtol=0, atol=1e-7)


@pytest.mark.parametrize("chunk", [1, 7, 40])
def test_the_side_of_a_node_does_not_hang_on_chunks(wide: Any, chunk: int) -> None:
    again = jp.map(jp.load(FIVE_BAR), "solve", WIDE, chunk=chunk)
    assert set(np.unique(wide.status)) == {"ok", "not_assembled", "other_branch"}
    np.testing.assert_array_equal(again.status, wide.status)
    np.testing.assert_allclose(again.singular_crossing, wide.singular_crossing, rtol=0, atol=1e-6)
    apart = (again.nominal - wide.nominal).values
    # How often a link has turned depends on which way round a pivot it came.
    apart[..., 2] -= 360 * np.round(apart[..., 2] / 360)
    np.testing.assert_allclose(apart, np.where(np.isfinite(apart), 0.0, np.nan), rtol=0, atol=1e-9)


def test_of_grids_of_drives_too_no_node_is_in_the_other_mode() -> None:
    """Where both elbows met on the way, distal links of one length went straight on, into the other mode."""
    m = example("five-bar")
    result = jp.map(m, "solve", {"left": span(-180, 180, 25), "right": span(-180, 180, 25)})
    left, right = np.meshgrid(*(np.radians(result[name].values) for name in m.drives), indexing="ij")
    elbows = -45 + 110 * np.exp(1j * left), 45 + 110 * np.exp(1j * right)
    apart = elbows[1] - elbows[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        tool = (elbows[0] + elbows[1]) / 2 + 1j * apart / abs(apart) * np.sqrt(150**2 - (abs(apart) / 2) ** 2)
    there = result.nominal.values[..., 0] + 1j * result.nominal.values[..., 1]
    ok = (result.status == "ok").values
    assert ok.sum() > 500
    np.testing.assert_allclose(there[ok], tool[ok], rtol=0, atol=1e-7)
    # What lies behind is not known here: elbows would be farther apart than both links are long.
    assert not (ok & (abs(apart) > 300)).any()


def on_edges(result: Any) -> np.ndarray:
    """The places, axis by axis, at which a map becomes singular."""
    x, y, parts = result.x.values, result.y.values, result.singular_crossing.values
    i, j = np.nonzero(np.isfinite(parts[:-1, :, 0]))
    across = np.stack([x[i] + parts[i, j, 0] * (x[i + 1] - x[i]), y[j]], -1)
    i, j = np.nonzero(np.isfinite(parts[:, :-1, 1]))
    return np.concatenate([across, np.stack([x[i], y[j] + parts[i, j, 1] * (y[j + 1] - y[j])], -1)])


def test_the_line_of_singular_poses_is_where_the_determinant_vanishes(wide: Any) -> None:
    along = jp.map(jp.load(FIVE_BAR), "solve", {"x": 0, "y": span(100, 372, 35)})
    (k,) = np.flatnonzero(np.isfinite(along.singular_crossing[:, 0]))
    assert 204 + 8 * float(along.singular_crossing[k, 0]) == pytest.approx(EDGE, abs=1e-4)
    robot = mapped.cases(1)[0].robot
    places = on_edges(wide)
    assert len(places) > 5
    drives = robot.inverse(places)
    elbows = np.array([[-137.5, 0], [137.5, 0]]) + 230 * np.stack([np.cos(drives), np.sin(drives)], -1)
    # In one line both links are 460 long; folded together nothing.
    links = np.linalg.norm(elbows[:, 0] - elbows[:, 1], axis=-1)
    np.testing.assert_allclose(np.minimum(links, 460 - links), 0, rtol=0, atol=1e-3)


def test_the_line_is_right_where_nothing_is_known_behind_it() -> None:
    m = jp.load(FIVE_BAR)
    grid = {"q1": span(40, 200, 9), "q2": span(-20, 140, 9)}
    result = jp.map(m, "solve", grid).rename({"q1": "x", "q2": "y"})
    assert set(np.unique(result.status)) == {"ok", "not_assembled"}
    angles = np.radians(on_edges(result))
    assert len(angles) > 5
    elbows = np.array([-137.5, 137.5]) + 230 * np.exp(1j * angles)
    np.testing.assert_allclose(abs(elbows[:, 1] - elbows[:, 0]), 460, rtol=1e-6)


def test_what_lies_behind_counts_in_nothing_and_has_no_error() -> None:
    m = jp.load(FIVE_BAR)
    grid = {"x": 0, "y": span(100, 372, 35)}
    result = jp.map(m, "worst", grid)
    behind = (result.y < EDGE).values
    np.testing.assert_array_equal(counted(result.status), ~behind)
    np.testing.assert_array_equal(np.isnan(result.worst_position), behind)
    assert np.isfinite(result.nominal).all()
    assert np.isfinite(result.q1).all()
    said = conclude(from_dataset(result)).sentences
    assert f"{float(result.worst_position[~behind].max()):.4g} mm at y = 212 mm" in said[0].text
    assert "14 other branch" in said[1].text


def test_both_are_drawn_with_words() -> None:
    pytest.importorskip("plotly")
    held = {"limits.drives": {"q1": [0, 135]}, "path": {"x": [0], "y": [330]}}
    m = jp.load(FIVE_BAR).with_({**held, "drives.q1.values": None, "drives.q2.values": None})
    result = jp.map(m, "worst", {"x": span(-150, 150, 7), "y": span(60, 360, 11)})
    assert {"outside_limits", "other_branch", "ok"} <= set(np.unique(result.status))
    texts = {text.get_text() for text in plot.map(result).axes[0].get_legend().get_texts()}
    assert {"other branch", "outside limits", "singular pose"} <= texts
    shown = layers(result)
    names = {trace.name for trace in figure_of(shown, colour_range(shown.value.values)).data}
    assert {"other branch", "outside limits", "singular pose"} <= names
    line = plot.map(jp.map(m, "worst", {"x": -100, "y": span(60, 360, 11)}))
    texts = {text.get_text() for text in line.axes[0].get_legend().get_texts()}
    assert {"other branch", "outside limits", "singular pose"} <= texts
