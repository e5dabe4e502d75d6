"""From the file of a mechanism in space to the numbers of the core: joints of every type, crosses, starts."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jointplay import examples
from jointplay.basics import poses
from jointplay.core.compile import coordinate
from jointplay.model.mechanism import Mechanism, loads

#: of a few dozen operations on numbers around one, sines of the C library among them
ROUNDING = 32 * float(np.finfo(float).eps)

HEAD = """
format = 1
space = "spatial"
units = { length = "mm", angle = "deg", force = "N" }
[output]
body = "b"
at = [10, 20, 30]
"""


def two_bodies(joint: str, more: str = "") -> Mechanism:
    return loads(f"{HEAD}\n[joints.J]\n{joint}\n{more}")


class TestRotations:
    """Against scipy's."""

    @pytest.fixture(scope="class")
    @staticmethod
    def vectors() -> np.ndarray:
        rng = np.random.default_rng(1)
        sizes = np.array([0.0, 1e-12, 1e-6, 0.1, 1.0, 3.0, np.pi - 1e-9])
        directions = rng.normal(size=(len(sizes), 3))
        return sizes[:, None] * directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def test_there_and_back(self, vectors: np.ndarray) -> None:
        quaternions = poses.quaternion(vectors)
        expected = Rotation.from_rotvec(vectors).as_quat(scalar_first=True)
        np.testing.assert_allclose(quaternions, expected, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(poses.rotation_vector(quaternions), vectors, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(poses.rotation_vector(-quaternions), vectors, rtol=0, atol=ROUNDING)

    def test_one_after_the_other(self, vectors: np.ndarray) -> None:
        a, b = poses.quaternion(vectors), poses.quaternion(vectors[::-1])
        expected = (Rotation.from_rotvec(vectors) * Rotation.from_rotvec(vectors[::-1])).as_matrix()
        both = np.concatenate([np.zeros((len(a), 3)), poses.product(a, b)], axis=1)
        np.testing.assert_allclose(poses.matrix(both), expected, rtol=0, atol=ROUNDING)
        for matrix in expected:
            back = poses.matrix(np.concatenate([np.zeros(3), poses.from_axes(matrix)]))
            np.testing.assert_allclose(back, matrix, rtol=0, atol=1e-14)

    def test_differences(self, vectors: np.ndarray) -> None:
        nominal = np.concatenate([vectors, vectors], axis=1)
        actual = np.concatenate([vectors + 1.0, vectors[::-1]], axis=1)
        expected = (Rotation.from_rotvec(vectors[::-1]) * Rotation.from_rotvec(vectors).inv()).as_rotvec()
        found = poses.difference(actual, nominal)
        np.testing.assert_allclose(found[:, :3], 1.0)
        np.testing.assert_allclose(found[:, 3:], expected, rtol=0, atol=1e-14)

    def test_the_twist_is_what_is_left_without_the_swing(self) -> None:
        for angle in (-3.0, -0.5, 0.0, 2.0):
            swing = Rotation.from_rotvec([0.0, 0.3, -0.4])
            turned = (swing * Rotation.from_rotvec([angle, 0.0, 0.0])).as_matrix()
            assert poses.twist_angle(turned) == pytest.approx(angle, abs=1e-14)


#: joint, then the components of its clearance and the set that the core gets
TYPES: dict[str, tuple[str, tuple[str, ...], dict[str, Any]]] = {
    "revolute": (
        "axis = [0, 0, 2]\nclearance = { diametral = 0.02, axial = 0.05, length = 30 }",
        ("along", "side", "normal", "tilt_side", "tilt_normal"),
        {"journal": {"radius": 1e-5, "half_length": 0.015, "axial": 5e-5}},
    ),
    "cylindrical": (
        "axis = [0, 0, 2]\nclearance = { radial = 0.02, length = 30 }",
        ("side", "normal", "tilt_side", "tilt_normal"),
        {"sleeve": {"radius": 2e-5, "half_length": 0.015}},
    ),
    "spherical": ("clearance = { radial = 0.02 }", ("x", "y", "z"), {"ball": {"radius": 2e-5}}),
    "prismatic": (
        "axis = [0, 0, 2]\nclearance = { gap = 0.02, length = 40, width = 20, height = 10 }",
        ("side", "normal", "roll", "tilt_side", "tilt_normal"),
        {"guide": {"gap": 2e-5, "half_length": 0.02, "half_width": 0.01, "half_height": 0.005}},
    ),
    "planar": (
        "axis = [0, 0, 2]\nclearance = { gap = 0.02, size = [40, 30] }",
        ("along", "tilt_side", "tilt_normal"),
        {"plate": {"gap": 2e-5, "half_side": 0.02, "half_normal": 0.015}},
    ),
    "fixed": (
        "axis = [0, 0, 2]\nangle = { tolerance = 0.1, deviation = 0.05 }",
        ("angle",),
        {"interval": {"low": -np.radians(0.1), "high": np.radians(0.1)}},
    ),
}


@pytest.mark.parametrize("kind", TYPES)
def test_every_type_of_joint(kind: str) -> None:
    text, components, shape = TYPES[kind]
    m = two_bodies(f'type = "{kind}"\nbodies = ["ground", "b"]\nat = [0, 5, 0]\n{text}')
    (joint,), (source,) = m.core_spec["joints"], m.core_spec["sources"]
    assert (joint["kind"], joint["first"], joint["second"]) == (kind, 0, 1)
    axis = [0.0, 0.0, 1.0] if kind != "spherical" else [1.0, 0.0, 0.0]
    assert joint["axis_first"] == joint["axis_second"] == axis
    ((name, sizes),) = source["set"].items()
    ((expected_name, expected),) = shape.items()
    assert name == expected_name
    assert sizes == pytest.approx(expected)
    assert m.parameters == tuple(f"J.{component}" for component in components)
    angles = [component.startswith(("roll", "tilt", "angle")) for component in components]
    np.testing.assert_array_equal(m.parameter_factors, np.where(angles, np.radians(1), 1e-3))
    assert source["centre"] == pytest.approx([np.radians(0.05)] if kind == "fixed" else [0.0] * len(components))
    # The core agrees on what it is told.
    rows = [component for joint, component in m.core.rows if joint == 0]
    assert kind == "fixed" or tuple(rows) == components


def test_a_universal_joint_is_a_cross_with_two_pins() -> None:
    play = "clearance = { radial = 0.01, axial = 0.02, length = 40 }"
    m = two_bodies(
        f'type = "universal"\nbodies = ["ground", "b"]\nat = [0, 5, 0]\naxes = [[0, 0, 1], [0, 2, 0]]\n{play}'
    )
    assert m.bodies == ("J.cross", "b")
    assert m.joints == m.sources == ("J.first", "J.second")
    first, second = m.core_spec["joints"]
    assert first["axis_first"] == [0, 0, 1]
    assert second["axis_second"] == [0, 1, 0]
    assert first["axis_second"] == [1, 0, 0]
    assert second["axis_first"] == [0, 1, 0]
    guess = np.array(m.core_spec["guess"])
    turned = poses.matrix(guess[0])
    np.testing.assert_allclose(turned[:, :2].T, [[0, 0, 1], [0, 1, 0]], atol=ROUNDING)
    # As drawn, both angles are zero.
    np.testing.assert_allclose([coordinate(m.core_spec, k, guess) for k in range(2)], 0.0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("axis", "side"),
    [
        ([0, 0, 1], [1, 0, 0]),
        ([1, 0, 0], [0, 1, 0]),
        ([0, -3, 0], [1, 0, 0]),
        ([1, 2, 3], np.array([13, -2, -3]) / np.sqrt(182)),
        ([1, 1, 1], np.array([2, -1, -1]) / np.sqrt(6)),
        # A direction of the drawing whose components differ by rounding only.
        ([1, 1 - 1e-13, 1 - 2e-13], np.array([2, -1, -1]) / np.sqrt(6)),
    ],
)
def test_the_side_is_the_ground_axis_that_is_least_aligned(axis: list[float], side: Any) -> None:
    m = two_bodies(f'type = "revolute"\nbodies = ["ground", "b"]\nat = [0, 0, 0]\naxis = {axis}')
    np.testing.assert_allclose(m.core_spec["joints"][0]["side_first"], side, atol=1e-12)


def test_a_locked_joint_mounts_one_body_on_the_other() -> None:
    """The tool's x axis along the arm's z axis, its y axis along -x."""
    place = "{ at = [100, 0, 0], axis = [0, 0, 1], side = [-1, 0, 0] }"
    m = two_bodies(f'type = "fixed"\non = {{ ground = {place}, b = [0, 0, 10] }}')
    (guess,) = np.array(m.core_spec["guess"])
    np.testing.assert_allclose(poses.matrix(guess), [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=ROUNDING)
    np.testing.assert_allclose(poses.place(guess, [0, 0, 0.01]), [0.1, 0, 0], atol=ROUNDING)


def test_the_rest_of_an_axis_that_is_left_out_is_that_of_the_first_body() -> None:
    place = "{ at = [0, 0, 0], axis = [0, 1, 0], side = [0, 0, 1] }"
    m = two_bodies(f'type = "prismatic"\non = {{ ground = {place}, b = [0, 0, 10] }}')
    (joint,) = m.core_spec["joints"]
    assert joint["axis_second"] == [0, 1, 0]
    assert joint["side_second"] == [0, 0, 1]


def test_loads_and_weights_are_forces_in_space() -> None:
    text = 'type = "fixed"\nbodies = ["ground", "b"]\nat = [0, 0, 0]'
    more = "[bodies.b]\nmass = 2\ncentre = [1, 2, 3]\n[[loads]]\nforce = [1, 2, 3]\nmoment = [4, 5, 6]"
    m = two_bodies(text, more).with_(gravity=[0, 1, -9.81])
    load, weight = m.core_spec["loads"]
    assert load["force"] == [1, 2, 3]
    assert load["moment"] == pytest.approx([0.004, 0.005, 0.006])
    assert weight["force"] == pytest.approx([0, 2, -19.62])
    assert m.core_spec["points"][weight["point"]]["at"] == pytest.approx([0.001, 0.002, 0.003])


@pytest.mark.parametrize("name", ["3-upu", "stewart-gough", "delta", "sarrus"])
def test_what_is_drawn_assembled_starts_closed(name: str) -> None:
    """Gaps of all joints at the guess, computed here from the file's points and axes alone."""
    m = loads(examples.text(name))
    if m.drive_values is not None:
        m = m.with_({f"drives.{drive}.values": [0] for drive in m.drives})
    guess = np.vstack([m.core_spec["guess"], poses.ground(7)])
    for joint in m.core_spec["joints"]:
        a, b = (m.core_spec["points"][joint[end]] for end in ("first", "second"))
        at, to = (poses.place(guess[p["body"]], p["at"]) for p in (a, b))
        axes = [poses.matrix(guess[p["body"]]) @ joint[f"axis_{end}"] for p, end in ((a, "first"), (b, "second"))]
        gap = to - at
        if joint["kind"] == "prismatic":
            gap = np.cross(gap, axes[0])
        # Directions are written with twelve decimals, over legs of half a metre.
        np.testing.assert_allclose(gap, 0, atol=1e-12)
        if joint["kind"] != "spherical":
            np.testing.assert_allclose(axes[0], axes[1], atol=1e-12)


def test_an_open_chain_starts_where_its_drives_are() -> None:
    m = loads(examples.text("serial-6r"))
    guess = np.array(m.core_spec["guess"])
    assert m.drive_values is not None
    np.testing.assert_allclose([coordinate(m.core_spec, k, guess) for k in range(6)], m.drive_values[0], atol=1e-14)
    np.testing.assert_allclose(m.start_drives, m.drive_values[0], atol=1e-14)
    np.testing.assert_allclose(m.core.trace(m.drive_values)["poses"][0], guess, atol=1e-12)


def test_leg_lengths_of_the_3_upu_in_closed_form() -> None:
    """l_i = |p - D u_i|; and back, from three spheres."""
    m = loads(examples.text("3-upu"))
    rng = np.random.default_rng(3)
    p = rng.uniform([-0.08, -0.08, 0.3], [0.08, 0.08, 0.5], (50, 3))
    angles = np.radians([0, 120, 240])
    u = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    lengths = np.linalg.norm(p[:, None] - 0.15 * u, axis=2)
    solved = m.core.trace(lengths)
    expected = np.concatenate([p, np.zeros_like(p)], axis=1)
    np.testing.assert_allclose(solved["output"], expected, rtol=0, atol=1e-10)
    targets = np.concatenate([p, np.full_like(p, np.nan)], axis=1)
    back = m.core.inverse(targets, np.array([1.0, 1, 1, 0, 0, 0]), m.start_drives)
    np.testing.assert_allclose(back["drives"], lengths, rtol=0, atol=1e-10)
