"""Singularities of the 3-UPU robot against its closed forms."""

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.oracles.platform import placed
from helpers.oracles.upu import Upu
from jointplay import examples
from jointplay.analyses.nominal import Nominal, nominal
from jointplay.analyses.singular_path import DrivePath
from jointplay.analyses.singular_values import Scaled

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "papers"))

import make_upu_singularities as picture

Array = NDArray[np.float64]
UPU_POSES = np.random.default_rng(7).uniform([-0.28, -0.28, 0.2], [0.28, 0.28, 0.6], (60, 3))


def example(**sizes: str) -> jp.Mechanism:
    return jp.loads(examples.text("3-upu", sizes))


def jacobians(m: jp.Mechanism, at: Array) -> Array:
    """Closure Jacobians with lengths divided by the characteristic one, shape (configuration, row, unknown)."""
    turning = np.array([name in ("angle", "roll", "tilt_side", "tilt_normal") for _, name in m.core.rows])
    rows, columns = np.where(turning, 1.0, 1.0 / m.length), np.tile([m.length] * 3 + [1.0] * 3, len(m.bodies))
    return np.asarray(rows[:, None] * m.core.jacobian(at) * columns)


@pytest.mark.parametrize("turn", [0.0, np.pi / 2], ids=["tsai", "snu"])
def test_determinant_of_the_3_upu_is_the_product_of_its_closed_forms(turn: float) -> None:
    robot = Upu(turn=turn)
    m = example(layout="snu" if turn else "tsai")
    sign, logarithm = np.linalg.slogdet(jacobians(m, placed(m, UPU_POSES)))
    general = sign * np.exp(logarithm)
    closed = np.empty(len(UPU_POSES))
    for k, p in enumerate(UPU_POSES):
        lengths, s, n, cosines = robot.legs_at(p)
        closed[k] = np.linalg.det(s) * np.linalg.det(n) * lengths.prod() ** 2 * np.sqrt(1 - cosines**2).prod()
        # The closed forms of both determinants.
        d, (x, y, z) = robot.base_radius - robot.platform_radius, p
        assert np.linalg.det(s) == pytest.approx(1.5 * np.sqrt(3) * z * d**2 / lengths.prod(), rel=1e-10)
        square = (0.0 if turn else 3 * d**2) - 0.75 * (x**2 + y**2)
        inclined = lengths.prod() * np.sqrt(1 - cosines**2).prod()
        assert np.linalg.det(n) == pytest.approx(0.5 * np.sqrt(3) * z * square / inclined, rel=1e-9, abs=1e-12)
    # A constant apart they are the same, also in sign. Next to the cylinder both are small and share their rounding.
    constant = np.median(general / closed)
    np.testing.assert_allclose(general, constant * closed, rtol=0, atol=1e-10 * np.abs(general).max())
    if turn == 0.0:
        assert {-1.0, 1.0} == set(sign), "the poses lie on both sides of the cylinder"


def upu_values(m: jp.Mechanism, positions: Array) -> Array:
    """Constraint and actuation singular values at positions of the platform, metres."""
    return Scaled(m, m.length).measure(placed(m, positions), (0, 1, 2))["values"][:, :2]


def test_the_3_upu_loses_its_joints_hold_on_a_cylinder() -> None:
    angles = np.radians([0, 17, 60, 133, 250])
    circle = np.stack([0.3 * np.cos(angles), 0.3 * np.sin(angles), [0.3, 0.4, 0.5, 0.4, 0.25]], axis=-1)
    constraint, actuation = upu_values(example(), circle).T
    assert constraint.max() < 1e-12
    assert actuation.min() > 0.05
    nearer = upu_values(example(), circle * [0.999, 0.999, 1])[:, 0]
    assert nearer.min() > 1e-5


def test_the_3_upu_in_the_plane_of_its_base() -> None:
    values = upu_values(example(), np.array([[0.06, 0.04, 0.0], [0.06, 0.04, 0.01]]))
    assert values[0].max() < 1e-7
    assert values[1].min() > 1e-3


def test_a_3_upu_with_platform_and_base_of_one_size_is_not_held_by_its_drives_anywhere() -> None:
    m = example(platform_radius="300")
    constraint, actuation = upu_values(m, np.array([[0.1, -0.05, 0.4], [0.2, 0.1, 0.3]])).T
    assert actuation.max() < 1e-12
    assert constraint.min() > 1e-3


def test_the_snu_layout_is_singular_on_its_axis_in_two_directions() -> None:
    m = example(layout="snu")
    heights = np.array([[0, 0, 0.3], [0, 0, 0.4], [0, 0, 0.55]])
    assert upu_values(m, heights)[:, 0].max() < 1e-12
    jacobian = jacobians(m, placed(m, heights))
    assert ((np.linalg.svd(jacobian, compute_uv=False) < 1e-12).sum(axis=1) == 2).all()
    # At its home, where the bundled file draws it, the legs are alike.
    legs = {f"drives.l{k}.values": [float(np.hypot(400, 150))] for k in (1, 2, 3)}
    result = jp.singularities(m.with_({"path": None} | legs))
    assert (result.status.item(), result.kind.item()) == ("singular", "constraint")
    assert result.singularity_distance.item() == 0.0
    turns = np.abs(result.constraint_twist.sel(component=["rx", "ry"]).values).max()
    assert turns > 1.0, "the platform turns about an axis in its plane, in degrees"


def upu_path(positions: Array, **settings: str) -> jp.Mechanism:
    """The 3-UPU with its legs driven to positions, millimetres."""
    lengths = 1e3 * np.array([Upu().legs_at(1e-3 * p)[0] for p in positions])
    legs = {f"drives.l{k + 1}.values": lengths[:, k] for k in range(3)}
    return example(**settings).with_({"path": None} | legs)


def test_the_path_of_the_3_upu_meets_the_cylinder() -> None:
    result = jp.singularities(upu_path(np.array([[150.0, 20, 400], [240, 20, 400], [330, 20, 400]])))
    for k in range(3):
        x, y, _ = 1e3 * Upu().forward(1e-3 * result.singularity_at.values[k])
        # Nearer than this Newton's method does not converge on a singular closure.
        assert np.hypot(x, y) == pytest.approx(300, abs=1e-5)
    # Straight lines of the legs are nearly one of the platform, which is the shortest way.
    straight = np.abs(np.array([150, 240, 330]) - np.sqrt(300**2 - 20**2))
    assert (result.singularity_distance.values >= straight - 1e-6).all()
    np.testing.assert_allclose(result.singularity_distance, straight, rtol=5e-3)
    assert set(result.singularity_kind.values.tolist()) == {"constraint"}
    assert result.determinant_sign.values.tolist() == [1, 1, -1]


def test_a_path_that_touches_the_cylinder_without_crossing_it() -> None:
    between = np.array([[290.0, -60, 400], [0, 0, 400]])
    assert np.isinf(jp.singularities(upu_path(between)).singularity_distance).all()
    over = np.array([[120.0, 0, 40], [120, 0, 0]])
    result = jp.singularities(upu_path(over))
    assert result.status.values.tolist() == ["ok", "singular"]
    assert result.kind.values[1] == "constraint, actuation"
    assert float(result.singularity_distance[0]) == pytest.approx(40, rel=1e-3)


@pytest.mark.parametrize("between", [[], [[0, 0, 0.4]]], ids=["between", "at a configuration"])
def test_a_singularity_without_a_change_of_sign(between: list[list[float]]) -> None:
    m = example(layout="snu")
    # By symmetry, two legs staying alike, the platform stays in the plane y = 0 and meets the axis.
    positions = np.array([[-0.06, 0, 0.4], *between, [0.06, 0, 0.4]])
    count, scaled = len(positions), Scaled(m, m.length)
    poses_there = placed(m, positions)
    values, sign = scaled.closure(poses_there)
    assert sign[0] == sign[-1]
    at = Nominal(
        drives=np.array([Upu().legs_at(p)[0] for p in positions]),
        poses=poses_there,
        output=np.zeros((count, 6)),
        status=np.zeros(count, np.uint8),
    )
    found = DrivePath(scaled, at, values, 1e-4).nearest(lambda steps: None)
    assert set(found.kind) == {"constraint"}
    # On the axis the legs are alike. The closure is singular to the limit over a tenth of a millimetre.
    assert np.ptp(found.drives, axis=1).max() < 1e-6
    np.testing.assert_allclose(found.distance[[0, -1]], 0.06, rtol=5e-3)


def test_the_drawn_map_follows_the_closed_form() -> None:
    rows = picture.table(picture.numbers())
    assert len(rows) == picture.COUNT**2
    radius = np.hypot(rows[:, 0], rows[:, 1])
    on_circle = np.isclose(radius, 2 * (picture.BASE - picture.PLATFORM))
    assert on_circle.sum() == 4, "where the circle meets the axes of the grid"
    assert (rows[on_circle, 2:] == 0).all()
    assert (rows[~on_circle, 2] > 0).all()
    # The legs hold the less, the smaller the determinant of their couples, on rings around the axis.
    inside = (radius > 40) & (radius < 290)
    assert np.corrcoef(rows[inside, 2], np.abs(rows[inside, 3]))[0, 1] > 0.95


def test_a_pose_of_another_mode_is_no_end_of_the_branch() -> None:
    """With these lengths the platform can be under the base and turned by 43 degrees, in a mode of motion in which
    each pose is singular. No way leads there, and the search for a dead centre must not end there."""
    m = example()
    reached = np.array([0.58099225, 0.63225628, 0.63225628])
    beyond = np.array([0.63225628, 0.27340812, 0.47846421])
    found = m.core.trace(np.stack([nominal(m).drives[0], reached, beyond]))
    assert found["status"].tolist() == [0, 0, 1]
    assert np.isnan(found["poses"][2]).all()
