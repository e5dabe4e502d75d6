"""Maps in space: the same code, positions with the attitude held, leg lengths by closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.answers import example


def length(joint: dict[str, object], position: np.ndarray, turn: Rotation) -> np.ndarray:
    """Distance from the base's end of a leg to the platform's, which is drawn with its middle at (0, 0, 400)."""
    low, high = (np.array(place["at"], dtype=float) for place in joint["on"].values())
    return np.linalg.norm(position + turn.apply(high - [0.0, 0.0, 400.0]) - low, axis=-1)


@pytest.mark.parametrize(("name", "held"), [("3-upu", {}), ("stewart-gough", {"rx": 4.0, "ry": -7.0, "rz": 12.0})])
def test_legs_are_as_long_as_the_platform_is_away(name: str, held: dict[str, float]) -> None:
    m = example(name)
    grid = {"x": np.linspace(-60, 60, 4), "y": np.linspace(-50, 50, 3), "z": [380.0, 430.0]}
    result = jp.map(m, "solve", {**grid, **held}, chunk=7)
    assert (result.status == "ok").all()
    x, y, z = np.meshgrid(result.x, result.y, result.z, indexing="ij")
    position = np.stack([x, y, z], axis=-1)
    turn = Rotation.from_rotvec([held.get(r, 0.0) for r in ("rx", "ry", "rz")], degrees=True)
    for k, drive in enumerate(m.drives):
        expected = length(m.value(f"joints.leg{k + 1}"), position.reshape(-1, 3), turn)
        np.testing.assert_allclose(result[drive].values.ravel(), expected, rtol=0, atol=1e-8)
    wanted = np.concatenate([position, np.broadcast_to(turn.as_rotvec(degrees=True), position.shape)], axis=-1)
    np.testing.assert_allclose(result.nominal, wanted, rtol=0, atol=1e-8)


def test_a_map_of_the_3_upu_says_what_loaded_says_along_a_path() -> None:
    m = example("3-upu", loads=[{"force": [30, -20, -100], "moment": [1000, 2000, -500]}])
    grid = {"x": [20.0, 50.0], "y": [-30.0, 10.0], "z": [380.0, 400.0]}
    result = jp.map(m, grid=grid).stack(configuration=["x", "y", "z"])
    mesh = [v.ravel() for v in np.meshgrid(*grid.values(), indexing="ij")]
    along = jp.loaded(m.with_({"path": dict(zip("xyz", mesh, strict=True))}))
    for name in ("error", "error_first_order", "reaction", "offset", "contribution"):
        ours = result[name].transpose(*along[name].dims)
        np.testing.assert_allclose(ours, along[name], rtol=1e-6, atol=1e-9, err_msg=name)
    np.testing.assert_array_equal(result.status, along.status)


@pytest.mark.parametrize(
    ("grid", "said"),
    [
        ({"x": [0, 1], "y": 0, "z": 400}, "x, y, z: 6 drives can bring the output to 6 asked components; .* rx = 0"),
        ({"x": 0, "y": 0, "z": 400, "rx": [0, 1], "ry": 0, "rz": 0}, "grid.rx: the attitude of the output is held as"),
        ({"x": [0, 1], "y": 0, "angle": 3}, "'angle' is not a drive or a component of the output"),
    ],
)
def test_the_attitude_is_held_as_a_whole(grid: dict[str, object], said: str) -> None:
    with pytest.raises(jp.InputError, match=said):
        jp.map(example("stewart-gough"), grid=grid)
