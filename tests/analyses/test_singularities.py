"""Singularities against closed forms of linkages and robots, and against what defines them."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

import jointplay as jp
from helpers.answers import EXAMPLES
from jointplay import examples
from jointplay.analyses import solve
from jointplay.analyses.nominal import Interrupted, nominal
from jointplay.analyses.singularities import compute
from jointplay.basics import poses
from jointplay.errors import InputError
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables

Array = NDArray[np.float64]
#: where two bars stand that lean against each other, metres
FEET = {"left": -0.3, "right": 0.3}
#: chords of the steps along the path stand for its arc: STEP^2 / 24 of it
ARC = 5e-5


#: every drive of these moves one joint
ONE_BY_ONE = [name for name in EXAMPLES if name != "belt-arm"]


def example(name: str, **settings: str) -> jp.Mechanism:
    m = jp.loads(examples.text(name, settings))
    return m.only(output=next(iter(m.outputs), None))


def scaled_jacobian(m: jp.Mechanism, pose: Array, length: float) -> tuple[Array, int]:
    """Jacobian with lengths divided by one, written anew; and how many of its rows are the joints'."""
    raw = m.core.jacobian(np.ascontiguousarray(pose))
    turning = ("angle", "roll", "tilt_side", "tilt_normal")
    rows = np.array([1.0 if name in turning else 1.0 / length for _, name in m.core.rows])
    half = len(m.components) // 2 if len(m.components) == 6 else 2
    columns = np.tile([length] * half + [1.0] * (len(m.components) - half), len(m.bodies))
    return rows[:, None] * raw * columns, len(raw) - len(m.drives)


# --- what defines them -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ONE_BY_ONE)
def test_the_determinant_is_that_of_the_joints_times_that_of_the_drives(name: str) -> None:
    m = example(name)
    at, result = nominal(m), jp.singularities(m, path=False)
    near = m.core.measure(at.drives, at.poses)
    for k in range(0, len(at), 3):
        jacobian, split = scaled_jacobian(m, at.poses[k], m.length)
        joints, drives = jacobian[:split], jacobian[split:]
        held = np.linalg.svd(joints, compute_uv=False)
        felt = np.linalg.svd(drives @ null_space(joints), compute_uv=False)
        assert held.prod() * felt.prod() == pytest.approx(abs(np.linalg.det(jacobian)), rel=1e-9)
        one = result.isel(configuration=k)
        assert float(one.constraint_singular_value) == pytest.approx(held[-1], rel=1e-9)
        assert float(one.actuation_singular_value) == pytest.approx(felt[-1], rel=1e-9)
        assert float(one.singular_value) <= min(held[-1], felt[-1])
        assert float(one.singular_value) == pytest.approx(near["singular_value"][k], rel=1e-8)
        assert int(one.determinant_sign) == np.sign(np.linalg.det(jacobian))


def test_a_motor_of_two_joints_ties_them() -> None:
    """Shoulder and pulley move as 1 : -3 whatever the motor does: one more row of the joints, and one drive."""
    m = example("belt-arm")
    at, result = nominal(m), jp.singularities(m, path=False)
    near = m.core.measure(at.drives, at.poses)
    for k in range(len(at)):
        raw, _ = scaled_jacobian(m, at.poses[k], m.length)
        own, shoulder, pulley = raw[:-2], raw[-2], raw[-1]
        joints = np.vstack([own, pulley / -3.0 - shoulder])
        held = np.linalg.svd(joints, compute_uv=False)
        felt = np.abs(shoulder @ null_space(joints))
        one = result.isel(configuration=k)
        assert float(one.constraint_singular_value) == pytest.approx(held[-1], rel=1e-9)
        assert float(one.actuation_singular_value) == pytest.approx(float(felt[0]), rel=1e-9)
        assert float(one.singular_value) == pytest.approx(near["singular_value"][k], rel=1e-8)


@pytest.mark.parametrize("name", ONE_BY_ONE)
def test_motions_are_those_of_the_values(name: str) -> None:
    m = example(name)
    at, result = nominal(m), jp.singularities(m, path=False)
    units = np.where(np.isin(m.components, ("x", "y", "z")), m.length, 1.0)
    for k in (0, len(at) - 1):
        jacobian, split = scaled_jacobian(m, at.poses[k], m.length)
        for kind in ("constraint", "actuation", "output"):
            one = result.isel(configuration=k)
            twists = (one[f"{kind}_motion"].values * m.component_factors / units).reshape(-1)
            assert np.abs(twists).max() == pytest.approx(1.0)
            size = np.linalg.norm(twists)
            seen = jacobian[:split] @ twists if kind == "constraint" else jacobian[split:] @ twists
            if kind != "output":
                assert np.linalg.norm(seen) / size == pytest.approx(float(one[f"{kind}_singular_value"]), rel=1e-8)
            if kind != "constraint":
                assert np.linalg.norm(jacobian[:split] @ twists) < 1e-9 * size
            counted = np.isin(m.components, result.attrs["output_components"].split(", "))
            shown = (one[f"{kind}_twist"].values * m.component_factors / units)[counted]
            if kind == "output":
                assert np.linalg.norm(shown) / size == pytest.approx(float(one.output_singular_value), rel=1e-8)


@pytest.mark.parametrize("name", ["four-bar", "3-rrr", "rssr", "3-upu", "serial-6r", "delta"])
def test_the_twist_is_what_the_output_does_when_the_drives_make_the_motion(name: str) -> None:
    m = example(name)
    at, result = nominal(m), jp.singularities(m, path=False)
    _, split = scaled_jacobian(m, at.poses[0], m.length)
    motion = result.output_motion.values[0] * m.component_factors
    rates = m.core.jacobian(np.ascontiguousarray(at.poses[0]))[split:] @ motion.reshape(-1)
    step = 1e-5
    solved = [m.core.trace(np.stack([at.drives[0], at.drives[0] + s * step * rates])) for s in (-1, 1)]
    before, after = (each["output"][1] for each in solved)
    measured = poses.difference(after, before) / (2 * step)
    np.testing.assert_allclose(result.output_twist.values[0] * m.component_factors, measured, rtol=0, atol=1e-7)


def test_length_is_the_scale_of_every_value() -> None:
    m = example("four-bar")
    result = jp.singularities(m, length=40.0, path=False)
    assert result.attrs["length"] == 40.0
    pose = nominal(m).poses[4]
    jacobian, split = scaled_jacobian(m, pose, 0.04)
    values = np.linalg.svd(jacobian[:split], compute_uv=False)
    assert float(result.constraint_singular_value[4]) == pytest.approx(values[-1], rel=1e-12)
    assert float(result.singular_value[4]) == pytest.approx(np.linalg.svd(jacobian, compute_uv=False)[-1], rel=1e-12)


@pytest.mark.parametrize("name", ["five-bar", "belt-arm", "3-upu", "stewart-gough"])
def test_many_configurations_at_once_are_as_each_by_itself(name: str) -> None:
    """They crossed the border to the core one by one, which took most of the time."""
    m = example(name)
    at = nominal(m)
    counted = list(range(len(m.components)))
    together = m.core.nearness(at.poses, m.length, counted)
    for k in range(len(at)):
        alone = m.core.nearness(at.poses[k : k + 1], m.length, counted)
        for column, values in together.items():
            np.testing.assert_array_equal(alone[column][0], values[k], err_msg=column)  # type: ignore[literal-required]
    lean = m.core.nearness(at.poses, m.length, [], details=False)
    assert set(lean) == {"closure", "sign"}
    np.testing.assert_array_equal(lean["closure"], together["closure"])
    jacobians = m.core.jacobian(at.poses)
    gaps = m.core.gaps(at.drives, at.poses)
    for k in range(len(at)):
        np.testing.assert_array_equal(jacobians[k], m.core.jacobian(at.poses[k]))
        np.testing.assert_array_equal(gaps[k], m.core.gaps(at.drives[k], at.poses[k]))
        assert together["sign"][k] == np.linalg.slogdet(jacobians[k])[0]


def test_poses_of_a_wrong_shape_are_refused() -> None:
    m = example("five-bar")
    at = nominal(m)
    for refused in (at.poses[:, 1:], at.poses[..., 1:], at.poses[0, 0]):
        with pytest.raises(ValueError, match="poses has shape"):
            m.core.jacobian(refused)
    with pytest.raises(ValueError, match="one row of drives per pose"):
        m.core.gaps(at.drives[:1], at.poses)
    with pytest.raises(ValueError, match="components of the output"):
        m.core.nearness(at.poses, m.length, [3])
    bar = example("redundant-bar")
    poses_of_bar = nominal(bar).poses
    with pytest.raises(ValueError, match="as many rows as unknowns"):
        bar.core.nearness(poses_of_bar, bar.length, [0])


def test_a_path_goes_on_from_given_poses() -> None:
    """The other assembly branch, which the guess of the file does not lead to."""
    m = example("four-bar")
    at = nominal(m)
    mirrored = m.spec()
    other = m.core.trace(at.drives[3:], at.poses[3])
    np.testing.assert_allclose(other["poses"], at.poses[3:], rtol=0, atol=1e-12)
    start = at.poses[0].copy()
    # Coupler and rocker mirrored about the line from the crank's end to the rocker's foot.
    points = mirrored["points"]
    foot = next(p["at"] for p in points if p["body"] == -1 and np.abs(p["at"]).max() > 0)
    end = at.poses[0, 1, :2]
    along = np.arctan2(*(np.array(foot[:2]) - end)[::-1])
    start[1:, 2] = 2 * along - start[1:, 2]
    there = m.core.trace(at.drives[:1], start)
    assert there["status"][0] == 0
    assert np.abs(there["poses"][0, 1:, 2] - at.poses[0, 1:, 2]).min() > 0.1
    with pytest.raises(ValueError, match="poses"):
        m.core.trace(at.drives, at.poses[0, 1:])


# --- planar closed forms ---------------------------------------------------------------------------------------------


def test_rocker_over_crank_speed_of_a_four_bar() -> None:
    m = example("four-bar")
    result, solved = jp.singularities(m, path=False), jp.solve(m)
    crank, coupler, rocker = np.radians(solved.pose.sel(component="angle").values.T)
    speed = 75 * np.sin(crank - coupler) / np.sin(rocker - coupler)
    ratio = result.output_singular_value / result.actuation_singular_value
    np.testing.assert_allclose(ratio * result.attrs["length"], np.abs(speed), rtol=1e-9)


def test_a_driven_rocker_reaches_its_dead_centre() -> None:
    m = example("four-bar").with_({"drives.theta1.joint": "J4", "drives.theta1.values": [36, 50, 80]})
    result = jp.singularities(m)
    # Crank and coupler in one line: a triangle of 75 + 75, 100 and 150.
    dead = np.degrees(np.arccos((150**2 + 100**2 - 150**2) / (2 * 150 * 100)))
    np.testing.assert_allclose(result.singularity_at.values[:2, 0], dead, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.singularity_distance[:2], 150 * np.radians(dead - [36, 50]), rtol=ARC)
    assert result.singularity_kind.values.tolist() == ["actuation", "actuation", ""]
    assert result.status.values.tolist() == ["ok", "ok", "not_assembled"]
    assert np.isnan(result.singularity_distance[2])


def test_the_dead_centre_itself() -> None:
    dead = float(np.degrees(np.arccos(1 / 3)))
    m = example("four-bar").with_({"drives.theta1.joint": "J4", "drives.theta1.values": [60.0, dead]})
    result = jp.singularities(m)
    assert result.status.values.tolist() == ["ok", "singular"]
    # The crank turns, and neither the driven rocker nor its tip, the output, does.
    assert result.kind.values[1] == "actuation, output"
    assert float(result.singularity_distance[1]) == 0.0
    assert float(result.singularity_distance[0]) == pytest.approx(150 * np.radians(dead - 60), rel=ARC)


def test_a_parallelogram_is_singular_where_it_lies_flat() -> None:
    m = example("four-bar")
    changes = {
        "joints.J2.on.crank": [50, 0],
        "joints.J3.on": {"coupler": [100, 0], "rocker": [50, 0]},
        "joints.J4.on.ground": [100, 0],
        "output.at": [50, 0],
        "dimensions": None,
        "start": {"crank": {"angle": 100}, "coupler": {"angle": 0}, "rocker": {"angle": 100}},
        "drives.theta1.values": [100, 150, 210, 250],
    }
    result = jp.singularities(m.with_(changes))
    np.testing.assert_allclose(result.nominal.sel(component="angle"), [100, 150, 210, 250], atol=1e-9)
    np.testing.assert_allclose(result.singularity_at[:, 0], 180, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.singularity_distance, 50 * np.radians([80, 30, 30, 70]), rtol=ARC)
    assert result.determinant_sign[0] == result.determinant_sign[1] == -result.determinant_sign[2]


def test_slider_crank_driven_by_its_crank_and_by_its_slider() -> None:
    m = example("slider-crank").with_({"drives.theta.values": [0, 60, 180]})
    by_crank = jp.singularities(m)
    np.testing.assert_allclose(by_crank.output_singular_value[[0, 2]], 0, atol=1e-12)
    assert by_crank.kind.values[[0, 2]].tolist() == ["output", "output"]
    assert np.isinf(by_crank.singularity_distance).all()
    ends = by_crank.nominal.sel(component="x").values
    places = jp.solve(m).coordinate.sel(joint="guide").values
    push = {"push": {"joint": "guide", "values": [places[1], places[0] + 1.0]}}
    by_slider = jp.singularities(m.with_({"drives": push}))
    assert by_slider.singularity_kind.values[0] == "actuation"
    # A little beyond its dead centre the mechanism still closes within rounding, and the branch ends there.
    assert float(by_slider.singularity_at[0, 0]) == pytest.approx(places[0], abs=1e-7)
    assert float(by_slider.singularity_distance[0]) == pytest.approx(ends[0] - ends[1], abs=1e-7)


def test_five_bar_with_a_leg_stretched_and_with_its_rods_in_line() -> None:
    m = example("five-bar")
    # The left leg is 110 + 150 mm long and starts at (-45, 0): on that circle the tool cannot go on outwards.
    direction = np.array([np.cos(np.radians(70)), np.sin(np.radians(70))])
    tools = np.array([-45, 0]) + np.outer([255, 259.9, 259.9999], direction)
    stretched = jp.singularities(m.with_({"path.x": tools[:, 0], "path.y": tools[:, 1]}), path=False)
    # Of a sum of two lengths in a nearly straight line, what misses is square to the angle between them.
    values = stretched.output_singular_value.values
    assert values[1] / values[2] == pytest.approx(np.sqrt(0.1 / 0.0001), rel=1e-2)
    assert set(stretched.kind.values[1:]) == {"output"}
    drives = {"path": None, "drives.left.values": [140, 105], "drives.right.values": [40, 75]}
    apart = {"drives.left.values": [140, 190], "drives.right.values": [40, -10]}
    spread = jp.singularities(m.with_(drives | apart))
    # Elbows at -45 + 110 cos q and 45 - 110 cos q: 300 mm apart when the rods are in line.
    inline = float(np.degrees(np.arccos(-105 / 110)))
    assert float(spread.singularity_at[0, 0]) == pytest.approx(inline, abs=1e-7)
    assert spread.singularity_kind.values[0] == "actuation"


def test_determinant_of_the_3_rrr_is_that_of_the_lines_of_its_rods() -> None:
    m = example("3-rrr")
    at = nominal(m)
    bodies = {name: at.poses[:, k] for k, name in enumerate(m.bodies)}
    lines = []
    for leg, corner in {"a": (-69.282, -40), "b": (69.282, -40), "c": (0, 80)}.items():
        angle, turn = bodies[f"lower_{leg}"][:, 2], bodies["platform"][:, 2]
        s = np.stack([np.cos(angle), np.sin(angle)])
        x, y = np.array(corner) * 1e-3
        arm = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
        lines.append(np.stack([*s, arm[0] * s[1] - arm[1] * s[0]]))
    closed = np.linalg.det(np.moveaxis(np.array(lines), -1, 0))
    # Every rod adds its length, which turns its angle into a displacement.
    whole = np.array([np.linalg.det(m.core.jacobian(np.ascontiguousarray(pose))) for pose in at.poses])
    np.testing.assert_allclose(np.abs(whole), 0.15**3 * np.abs(closed), rtol=1e-9)
    np.testing.assert_array_equal(jp.singularities(m, path=False).determinant_sign, np.sign(whole))


# --- in space --------------------------------------------------------------------------------------------------------


def test_an_rssr_driven_backwards_reaches_the_limits_of_its_rocker() -> None:
    m = example("rssr")

    def missing(angle: float, radius: float) -> float:
        """What the coupler lacks to join the rocker's ball and the farthest or nearest point of the crank's circle."""
        y, z = -100 * np.sin(np.radians(angle)), -60 + 100 * np.cos(np.radians(angle))
        return float(np.hypot(np.hypot(130, y) + radius, z) - 176)

    # The hook goes round the z axis at 30 mm.
    lowest, highest = brentq(missing, 1, 60, (30,)), brentq(missing, 90, 179, (-30,))
    forward = jp.solve(m).coordinate.sel(joint="rocker").values
    assert lowest < forward.min() < forward.max() < highest
    back = {"back": {"joint": "rocker", "values": [forward[0] - 110, forward[0], forward[3], forward[0] + 150]}}
    result = jp.singularities(m.with_({"drives": back}))
    assert result.status.values.tolist() == ["not_assembled", "ok", "ok", "not_assembled"]
    for k, there in ((1, lowest), (2, highest)):
        assert float(result.singularity_at[k, 0]) == pytest.approx(there, abs=1e-6)
        assert result.singularity_kind.values[k] == "actuation"


# --- options, faces --------------------------------------------------------------------------------------------------


def test_which_components_of_the_output_count() -> None:
    assert jp.singularities(example("four-bar"), path=False).attrs["output_components"] == "x, y"
    assert jp.singularities(example("3-rrr"), path=False).attrs["output_components"] == "x, y, angle"
    assert jp.singularities(example("five-bar"), path=False).attrs["output_components"] == "x, y"
    # A point on the rocker's pivot never moves: then the rotation counts, too.
    pivot = jp.singularities(example("four-bar").with_({"output.at": [0, 0]}), path=False)
    assert pivot.attrs["output_components"] == "x, y, angle"
    assert (pivot.output_singular_value > 0.1).all()
    only = jp.singularities(example("four-bar"), components=["angle"], path=False)
    turning = np.abs(only.output_motion.sel(body="rocker", component="angle"))
    twists = only.output_twist.sel(component="angle")
    np.testing.assert_allclose(np.abs(twists), turning, rtol=1e-12)


def test_more_drives_than_components_that_count() -> None:
    m = example("3-rrr")
    both = jp.singularities(m, components=["x", "y"], path=False)
    every = jp.singularities(m, components=["x", "y", "angle"], path=False)
    assert (both.output_singular_value >= every.output_singular_value).all()


@pytest.mark.parametrize(
    "options", [{"length": 0}, {"length": float("nan")}, {"components": ["z"]}, {"components": []}]
)
def test_what_is_not_valid_is_refused(options: dict[str, object]) -> None:
    with pytest.raises(InputError, match=r"is not a number of mm from|component"):
        jp.singularities(example("four-bar"), **options)  # type: ignore[arg-type]


def test_one_configuration_has_no_path() -> None:
    result = jp.singularities(example("four-bar").with_({"drives.theta1.values": [30]}))
    assert np.isinf(result.singularity_distance.item())


def test_a_structure_has_its_joints_only() -> None:
    bar = {"type": "revolute", "on": {"left": [0.5, 0.0], "right": [0.5, 0.0]}}
    feet = {name: {"type": "revolute", "on": {"ground": [x, 0.0], name: [0.0, 0.0]}} for name, x in FEET.items()}
    raw = {
        "format": 1,
        "space": "planar",
        "units": {"length": "m", "angle": "deg", "force": "N"},
        "joints": {"top": bar, **feet},
        "start": {"left": {"angle": 50}, "right": {"angle": 130}},
        "output": {"body": "left", "at": [0.5, 0.0]},
    }
    result = jp.singularities(jp.Mechanism(raw))
    assert result.constraint_singular_value.item() == pytest.approx(result.singular_value.item(), rel=1e-12)
    assert np.isnan(result.actuation_singular_value).all()
    assert result.kind.item() == "constraint"


def test_targets_out_of_reach_leave_a_gap_in_the_path() -> None:
    m = example("five-bar").with_({"path.x": [0, 0, 0, 0], "path.y": [190, 220, 400, 190]})
    result = jp.singularities(m)
    assert result.status.values.tolist() == ["ok", "ok", "not_assembled", "ok"]
    assert np.isinf(result.singularity_distance.values[[0, 1, 3]]).all()
    assert np.isnan(result.singularity_distance.values[2])


def test_ctrl_c_keeps_what_is_done() -> None:
    def stop(done: int, total: int) -> None:
        if done > 11:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        compute(example("four-bar"), progress=stop)
    partial = stopped.value.partial
    assert "incomplete" in partial.attrs
    assert "singularity_distance" not in partial.data
    assert len(partial.get("singular_value")) == 11


def test_progress_ends_at_its_total() -> None:
    seen: list[tuple[int, int]] = []
    compute(example("four-bar"), progress=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


# --- in words --------------------------------------------------------------------------------------------------------


def test_the_table_says_what_moves_and_where() -> None:
    result = compute(example("slider-crank").with_({"drives.theta.values": [60, 180]}))
    (table,) = tables(result)
    notes = " ".join(table.notes)
    assert "The output follows least at # 1 (0): crank and rod move together, the output does not move." in notes
    assert "A radian counts as 50 mm" in notes
    # The answer says it, and the table not again.
    assert any("meets no singularity" in sentence.text for sentence in conclude(result).sentences)
    assert "meets no singularity" not in notes
    backwards = {"drives.theta1.joint": "J4", "drives.theta1.values": [36, 80]}
    (table,) = tables(compute(example("four-bar").with_(backwards)))
    cells = {column.name: column.cells for column in table.columns}
    assert cells["to a singularity"] == ("90.39", "–")
    assert cells["kind"] == ("actuation", "")


def test_solve_points_to_the_command_where_something_is_singular() -> None:
    dead = float(np.degrees(np.arccos(1 / 3)))
    m = example("four-bar").with_({"drives.theta1.joint": "J4", "drives.theta1.values": [60.0, dead]})
    (table,) = tables(solve.compute(m))
    assert any("jointplay singularities" in note for note in table.notes)
    (table,) = tables(solve.compute(example("four-bar")))
    assert not any("jointplay singularities" in note for note in table.notes)


@pytest.mark.parametrize("name", ["redundant-bar", "bennett"])
def test_an_over_constrained_mechanism_is_refused_with_a_reason(name: str) -> None:
    # It fell over its own matrices.
    with pytest.raises(InputError, match=r"over-constrained: .* redundant, among "):
        jp.singularities(jp.loads(jp.examples.text(name)))
