"""Structural errors against closed forms: straight-line linkages, Ackermann steering, curves by hand."""

from collections.abc import Mapping
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from jointplay.analyses.ideal import best_circle, best_line
from jointplay.result.conclusions import conclude
from jointplay.result.dataset import from_dataset

#: of Newton's method, beside lengths of some hundred millimetres
CLOSE = 1e-9


def four_bar(ground: float, crank: float, coupler: float, rocker: float, at: list[float], **more: Any) -> jp.Mechanism:
    """A four-bar with its ground pins at the origin and at [ground, 0]; the coupler's x axis goes from pin to pin."""
    pin = lambda **on: {"type": "revolute", "on": on, "clearance": {"radial": 0.02}}  # noqa: E731
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {
            "A": pin(ground=[0, 0], crank=[0, 0]),
            "B": pin(crank=[crank, 0], coupler=[0, 0]),
            "C": pin(coupler=[coupler, 0], rocker=[rocker, 0]),
            "D": pin(ground=[ground, 0], rocker=[0, 0]),
        },
        "output": {"body": "coupler", "at": at},
        **more,
    }
    return jp.Mechanism(raw)


def chebyshev(**more: Any) -> jp.Mechanism:
    """Crank and rocker cross: lengths 100, 125, 50, 125; the middle of the coupler goes along y = 100."""
    crank = np.degrees(np.arccos(np.linspace(0.6, 0.0, 61)))
    start = {"crank": {"angle": 60}, "coupler": {"angle": 170}, "rocker": {"angle": 140}}
    drives = {"theta": {"joint": "A", "values": crank.tolist()}}
    return four_bar(100.0, 125.0, 50.0, 125.0, [25, 0], start=start, drives=drives, **more)


def coupler_middle(theta: np.ndarray) -> np.ndarray:
    """The middle of the coupler of Chebyshev's linkage by two circles, the crossed assembly."""
    b = 125.0 * np.column_stack([np.cos(theta), np.sin(theta)])
    to = np.array([100.0, 0.0]) - b
    d = np.linalg.norm(to, axis=1)
    along = (50.0**2 - 125.0**2 + d**2) / (2.0 * d)
    across = np.sqrt(50.0**2 - along**2)
    e = to / d[:, None]
    # The coupler points back over the crank.
    ends = [b + along[:, None] * e + s * across[:, None] * np.column_stack([-e[:, 1], e[:, 0]]) for s in (1.0, -1.0)]
    c = np.where((ends[0][:, 0] < ends[1][:, 0])[:, None], ends[0], ends[1])
    return np.asarray(0.5 * (b + c))


def test_chebyshev_is_off_its_line_as_its_coupler_curve_says() -> None:
    m = chebyshev(target={"line": {"through": [0, 100], "direction": [1, 0]}, "tolerance": 1.0})
    result = jp.structural(m)
    expected = coupler_middle(m.drive_values[:, 0])[:, 1] - 100.0
    assert np.abs(expected).max() > 0.05
    np.testing.assert_allclose(result.structural_deviation.sel(component="y"), expected, atol=CLOSE)
    np.testing.assert_allclose(result.structural_deviation.sel(component="x"), 0.0, atol=CLOSE)
    np.testing.assert_allclose(result.structural_error, np.abs(expected), atol=CLOSE)
    assert np.isnan(result.structural_deviation.sel(component="angle")).all()
    # Exact at the middle and where the coupler is upright.
    assert abs(expected[0]) < CLOSE


def test_the_fitted_line_is_narrower_than_any_other() -> None:
    m = chebyshev(target={"line": {"fit": True}})
    result = jp.structural(m)
    points = coupler_middle(m.drive_values[:, 0])
    angles = np.linspace(-0.02, 0.02, 4001)
    heights = points @ np.array([-np.sin(angles), np.cos(angles)])
    brute = 0.5 * np.ptp(heights, axis=0).min()
    assert result.structural_error.max().item() == pytest.approx(brute, rel=1e-5)
    assert result.structural_error.max().item() <= brute + CLOSE


def test_roberts_is_off_the_line_through_its_pins() -> None:
    """Roberts' linkage: isosceles halves; the apex is on the line of the ground pins at both ends and in the middle."""
    # Ground 2, coupler 1, arms 1.2, apex as far below the coupler as the pins are.
    half, arm = 50.0, 120.0
    height = np.sqrt(arm**2 - half**2)
    start = {"crank": {"angle": 67.4}, "coupler": {"angle": 0}, "rocker": {"angle": 112.6}}
    drives = {"theta": {"joint": "A", "from": 55, "to": 80, "count": 26}}
    line = {"line": {"through": [0, 0], "to": [200, 0]}}
    m = four_bar(200.0, arm, 100.0, arm, [50, -height], start=start, drives=drives, target=line)
    theta = m.drive_values[:, 0]
    b = arm * np.column_stack([np.cos(theta), np.sin(theta)])
    to = np.array([200.0, 0.0]) - b
    d = np.linalg.norm(to, axis=1)
    turn = np.arctan2(to[:, 1], to[:, 0]) + np.arccos((100.0**2 + d**2 - arm**2) / (200.0 * d))
    y = b[:, 1] + 50.0 * np.sin(turn) - height * np.cos(turn)
    found = jp.structural(m).structural_deviation.sel(component="y")
    np.testing.assert_allclose(found, y, atol=CLOSE)
    assert 0.1 < np.abs(y).max() < 10.0


def test_watt_is_near_its_line() -> None:
    """Watt's linkage: equal arms to both sides, the middle of the coupler goes up and down."""
    start = {"crank": {"angle": 0}, "coupler": {"angle": -90}, "rocker": {"angle": 180}}
    drives = {"theta": {"joint": "A", "from": -15, "to": 15, "count": 31}}
    more: Mapping[str, Any] = {
        "start": start,
        "drives": drives,
        "target": {"line": {"through": [100, 0], "direction": 90}},
    }
    raw = dict(four_bar(200.0, 100.0, 80.0, 100.0, [40, 0], **more).raw)
    raw["joints"] = {**raw["joints"], "A": {**raw["joints"]["A"], "on": {"ground": [0, 40], "crank": [0, 0]}}}
    raw["joints"]["D"] = {**raw["joints"]["D"], "on": {"ground": [200, -40], "rocker": [0, 0]}}
    m = jp.Mechanism(raw)
    theta = m.drive_values[:, 0]
    b = np.array([0.0, 40.0]) + 100.0 * np.column_stack([np.cos(theta), np.sin(theta)])
    to = np.array([200.0, -40.0]) - b
    d = np.linalg.norm(to, axis=1)
    turn = np.arctan2(to[:, 1], to[:, 0]) - np.arccos((80.0**2 + d**2 - 100.0**2) / (160.0 * d))
    x = b[:, 0] + 40.0 * np.cos(turn) - 100.0
    np.testing.assert_allclose(jp.structural(m).structural_deviation.sel(component="x"), x, atol=CLOSE)
    # Exact in the middle, and within 0.05 % of the stroke of 52 mm.
    assert abs(x[15]) < CLOSE
    assert 0.01 < np.abs(x).max() < 0.05


def test_ackermann_by_its_formula() -> None:
    """Track 1200, wheelbase 2400: cot(outer) - cot(inner) = track / wheelbase; the arms are those of a trapezium."""
    arm, back = 150.0, float(np.degrees(np.arctan2(600.0, 2400.0)))
    tie = 1200.0 - 2.0 * arm * np.sin(np.radians(back))
    start = {"crank": {"angle": -90 + back}, "coupler": {"angle": 0}, "rocker": {"angle": -90 - back}}
    drives = {"steer": {"joint": "A", "from": -90 + back, "to": -60 + back, "count": 16}}
    # The left arm turned by a makes the right arm turn by b with cot(b) = cot(a) + 0.5, as an angle of the rocker.
    wheel = f"(steer + 90 - {back!r} + 1e-9)"
    value = f"-90 - {back!r} + atan2(sin{wheel}, cos{wheel} + 0.5 * sin{wheel})"
    m = four_bar(1200.0, arm, tie, arm, [0, 0], start=start, drives=drives)
    m = m.with_(output={"body": "rocker"}, target={"function": {"of": "angle", "value": value}, "tolerance": 1})
    result = jp.structural(m)
    a = np.radians(result.steer.values + 90.0 - back)
    wanted = np.degrees(np.arctan2(np.sin(a), np.cos(a) + 0.5 * np.sin(a))) - 90.0 - back
    found = jp.solve(m).nominal.sel(component="angle").values
    off = (found - wanted + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(result.structural_deviation.sel(component="angle"), off, atol=1e-7)
    assert result.structural_error.attrs["units"] == "deg"
    assert result.structural_error[0].item() == pytest.approx(0.0, abs=1e-7)
    assert 0.05 < result.structural_error.max().item() < 5.0
    # The same of the joint, whose coordinate is the angle of the rocker, and by a table.
    pairs = {"at": result.steer.values.tolist(), "values": wanted.tolist()}
    for about in ({"of": "D", "value": value}, {"of": "D", **pairs}):
        again = jp.structural(m.with_(target={"function": about})).structural_error
        np.testing.assert_allclose(again, result.structural_error, atol=1e-7)


def test_points_with_and_without_timing() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    nominal = jp.solve(m).nominal.sel(component=["x", "y"]).values
    moved = nominal + np.array([0.3, -0.4])
    timed = jp.structural(m.with_(target={"points": moved.tolist()}))
    np.testing.assert_allclose(timed.structural_error, 0.5, atol=CLOSE)
    loose = jp.structural(m.with_(target={"points": moved[::-1].tolist(), "timed": False}))
    for k, point in enumerate(nominal):
        fine = np.concatenate([np.linspace(a, b, 20001) for a, b in pairwise(moved)])
        assert loose.structural_error[k].item() == pytest.approx(np.linalg.norm(fine - point, axis=1).min(), abs=5e-4)


def test_a_dwell_and_its_middle() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    x = jp.solve(m).nominal.sel(component="x").values
    drive = jp.solve(m).theta1.values
    there = (drive >= 40) & (drive <= 60)
    result = jp.structural(m.with_(target={"dwell": {"of": "x", "from": 40, "to": 60}}))
    assert result.structural_error.max().item() == pytest.approx(0.5 * np.ptp(x[there]), rel=1e-9)
    np.testing.assert_array_equal(np.isnan(result.structural_error), ~there)
    given = jp.structural(m.with_(target={"dwell": {"of": "x", "value": 10}}))
    np.testing.assert_allclose(given.structural_deviation.sel(component="x"), x - 10.0, atol=CLOSE)


def narrowest_ring(points: np.ndarray) -> float:
    """Half the width of the narrowest ring with all points: its centre is as far from both points of two pairs."""
    rooms = []
    for (a, b), (c, d) in combinations(list(combinations(range(len(points)), 2)), 2):
        rows = 2.0 * np.array([points[b] - points[a], points[d] - points[c]])
        if abs(np.linalg.det(rows)) < 1e-9:
            continue
        right = np.array([points[b] @ points[b] - points[a] @ points[a], points[d] @ points[d] - points[c] @ points[c]])
        rooms.append(0.5 * np.ptp(np.linalg.norm(points - np.linalg.solve(rows, right), axis=1)))
    return float(min(rooms))


@pytest.mark.parametrize("seed", range(3))
def test_fits_against_all_that_touch(seed: int) -> None:
    """The best line touches three points, the best circle four: all of them are tried."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([np.linspace(0.0, 100.0, 8), rng.normal(size=8)])
    through, along = best_line(points)
    normal = np.array([-along[1], along[0]])
    found = np.abs((points - through) @ normal).max()
    widths = []
    for a, b in combinations(points, 2):
        across = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
        widths.append(0.5 * np.ptp(points @ across))
    assert found == pytest.approx(min(widths), rel=1e-9)
    turn = rng.uniform(0.0, 2.0, size=7)
    ring = (50.0 + rng.normal(size=7))[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]) + [7.0, -3.0]
    centre, radius = best_circle(ring)
    got = np.abs(np.linalg.norm(ring - centre, axis=1) - radius).max()
    assert got == pytest.approx(narrowest_ring(ring), rel=1e-6)


def test_the_best_circle_of_a_long_loop_is_far_from_that_of_least_squares() -> None:
    """A coupler curve around which two rings are narrower than their neighbours."""
    x = [-65, -78, -89, -97, -103, -106, -106, -103, -97, -90, -83, -75, -67, -57, -45]
    y = [155, 141, 125, 106, 87, 68, 50, 34, 22, 15, 16, 26, 48, 81, 114]
    loop = np.column_stack([x, y]).astype(float)
    centre, radius = best_circle(loop)
    got = np.abs(np.linalg.norm(loop - centre, axis=1) - radius).max()
    assert got == pytest.approx(narrowest_ring(loop), rel=1e-9)
    # Of more points some are looked at, and the others count as well.
    fine = np.column_stack([np.interp(np.arange(0.0, 14.01, 0.1), np.arange(15), z) for z in loop.T])
    centre, radius = best_circle(fine)
    assert np.abs(np.linalg.norm(fine - centre, axis=1) - radius).max() == pytest.approx(got, rel=0.01)


def test_a_line_in_space_is_no_wider_than_its_neighbours() -> None:
    rng = np.random.default_rng(5)
    points = np.column_stack([np.linspace(0.0, 100.0, 12), rng.normal(size=(12, 2))])

    def largest(through: np.ndarray, along: np.ndarray) -> float:
        along = along / np.linalg.norm(along)
        away = points - through
        return float(np.linalg.norm(away - np.outer(away @ along, along), axis=1).max())

    through, along = best_line(points)
    best = largest(through, along)
    for _ in range(300):
        size = 10.0 ** rng.uniform(-6, 0)
        assert largest(through + size * rng.normal(size=3), along + 0.02 * size * rng.normal(size=3)) >= best - 1e-9


def test_limits_are_judged_on_structural_error_and_play() -> None:
    line = {"line": {"through": [0, 100], "direction": [1, 0]}}
    m = chebyshev(limits={"y": 0.5, "position": 1.0})
    with_target = m.with_(target=line)
    play, both = jp.worst(m, starts=4), jp.worst(with_target, starts=4)
    off = both.structural_deviation.sel(component="y").values
    ends = play.worst_component.sel(component="y").values
    margin = np.minimum(0.5 - (ends[:, 1] + off), (ends[:, 0] + off) + 0.5)
    np.testing.assert_allclose(both.margin.sel(quantity="y"), margin, atol=1e-7)
    size = play.worst_position.values + np.abs(off)
    np.testing.assert_allclose(both.margin.sel(quantity="position"), 1.0 - size, atol=1e-7)
    # Where the error is one, the sum is exact.
    given = jp.given(with_target, {"B": [0.0, 0.02]})
    error = given.error.sel(component=["x", "y"]).values + np.column_stack([0.0 * off, off])
    np.testing.assert_allclose(given.margin.sel(quantity="position"), 1.0 - np.linalg.norm(error, axis=1), atol=1e-7)


def test_nodes_of_a_map_are_compared_each_by_itself() -> None:
    """Over the plane, off a line at an angle and off a circle; limits are kept by the error of play beside it."""
    m = jp.loads(jp.examples.text("five-bar")).with_(limits={"position": 6})
    grid = {"x": [-40, -10, 0, 40], "y": [180, 190, 195]}
    x, y = np.meshgrid(*grid.values(), indexing="ij")
    line = m.with_(target={"line": {"through": [0, 190], "direction": [0.6, 0.8]}, "tolerance": 5})
    off = np.array([-0.8, 0.6]) * (-0.8 * x + 0.6 * (y - 190.0))[..., None]
    np.testing.assert_allclose(
        jp.map(line, "structural", grid).structural_error, np.linalg.norm(off, axis=-1), atol=CLOSE
    )
    circle = m.with_(target={"circle": {"centre": [0, 150], "radius": 40}})
    far = np.abs(np.hypot(x, y - 150.0) - 40.0)
    np.testing.assert_allclose(jp.map(circle, "structural", grid).structural_error, far, atol=CLOSE)
    play, both = jp.map(m, grid=grid), jp.map(line, grid=grid)
    error = play.error.sel(component=["x", "y"]).values + off
    left = 6.0 - np.linalg.norm(error, axis=-1) - both.undetermined.sel(component=["x", "y"]).max().item()
    np.testing.assert_allclose(both.margin.sel(quantity="position"), left, atol=1e-7)
    # Other outputs have targets of their own there, too.
    tip = {**line.raw["output"], "leads": True, "target": line.raw["target"]}
    two = m.with_({"output": None, "limits": None, "loads": None, "outputs": {"tip": tip}})
    again = jp.map(two, "structural", grid).structural_error
    np.testing.assert_allclose(again.sel(output="tip"), np.linalg.norm(off, axis=-1), atol=CLOSE)


@pytest.mark.parametrize("target", [{"line": {"fit": True}}, {"points": [[0, 190]] * 9}, {"dwell": {"of": "x"}}])
def test_what_is_fitted_to_a_path_counts_at_no_node(target: dict[str, Any]) -> None:
    m = jp.loads(jp.examples.text("five-bar")).with_(limits={"position": 1})
    grid = {"x": [-40, 40], "y": [185, 195]}
    if "dwell" not in target:
        assert "structural_deviation" in jp.loaded(m.with_(target=target))
    found, play = jp.map(m.with_(target=target), grid=grid), jp.map(m, grid=grid)
    np.testing.assert_array_equal(found.margin, play.margin)
    assert "by play alone" in conclude(from_dataset(found)).sentences[0].text
    assert "by play alone" not in conclude(from_dataset(play)).sentences[0].text
    with pytest.raises(jp.InputError, match=r"target\.\w+: compares a path as a whole"):
        jp.map(m.with_(target=target), "structural", grid)


def test_several_outputs_have_targets_of_their_own() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    ends = {"tip": {"body": "rocker", "at": [150, 0], "target": {"circle": {"centre": [-100, 0], "radius": 149}}}}
    m = m.with_({"output": None, "loads": None, "outputs": {**ends, "pin": {"body": "crank", "at": [75, 0]}}})
    with pytest.raises(jp.InputError, match="target"):
        jp.structural(m)
    np.testing.assert_allclose(jp.structural(m.only(output="tip")).structural_error, 1.0, atol=CLOSE)
    with pytest.raises(jp.InputError, match=r"outputs\.pin\.target\.function\.value.*theta"):
        m.with_({"outputs.pin.target": {"function": {"of": "angle", "value": "2 * theta"}}})


@pytest.mark.parametrize(
    "line",
    [{"to": [1e-300, 100]}, {"through": [1e9, 100], "direction": [1e-9, 0]}],
)
def test_the_length_of_a_direction_says_nothing(line: dict[str, Any]) -> None:
    expected = jp.structural(chebyshev(target={"line": {"through": [0, 100], "direction": 0}})).structural_error
    found = jp.structural(chebyshev(target={"line": {"through": [0, 100], **line}})).structural_error
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ({"points": [[1, 2], [3, 4]]}, r"target\.points.*2 points and 11 configurations.*timed = false"),
        ({"line": {"through": [0, 0], "to": [0, 0]}}, r"target\.line.*same point"),
        ({"line": {"fit": True, "through": [0, 0]}}, r"target\.line.*leave out through"),
        ({"circle": {"radius": 3}}, r"target\.circle.*centre and radius"),
        ({"dwell": {"of": "J9"}}, r"target\.dwell\.of.*'J9'.*J1"),
        ({"dwell": {"of": "x", "from": 60, "to": 40}}, r"target\.dwell.*from < to"),
        ({"function": {"of": "angle"}}, r"target\.function.*value"),
        ({"function": {"of": "angle", "at": [1, 2], "values": [1, 2, 3]}}, r"target\.function.*2 and 3"),
        ({"line": {"fit": True}, "dwell": {"of": "x"}}, r"target.*line, dwell"),
        ({"line": {"fit": True}, "tolerance": 0}, r"target\.tolerance"),
        ({"line": {"fit": 1}}, r"target\.line\.fit: true or false is needed, not 1"),
        ({"function": {"of": "angle", "value": ""}}, r"target\.function\.value.*not an expression"),
    ],
)
def test_bad_targets_name_key_and_remedy(target: dict[str, Any], words: str) -> None:
    with pytest.raises(jp.InputError, match=words):
        jp.loads(jp.examples.text("four-bar")).with_(target=target)
