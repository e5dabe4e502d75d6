"""Offsets in space: whether they lie within their clearance, by the geometry of pins, guides, balls and plates."""

import itertools

import numpy as np
import pytest

import jointplay as jp
from jointplay.analyses.offsets import admissible

GAP, LENGTH, WIDTH, HEIGHT = 0.02, 40.0, 20.0, 10.0
HEAD = """
format = 1
space = "spatial"
units = { length = "mm", angle = "rad", force = "N" }
[output]
body = "b"
"""
SETS = {
    "revolute": f"{{ radial = {GAP}, axial = 0.05, length = {LENGTH} }}",
    "cylindrical": f"{{ radial = {GAP}, length = {LENGTH} }}",
    "spherical": f"{{ radial = {GAP} }}",
    "prismatic": f"{{ gap = {GAP}, length = {LENGTH}, width = {WIDTH}, height = {HEIGHT} }}",
    "planar": f"{{ gap = {GAP}, size = [{LENGTH}, {WIDTH}] }}",
}


def moved(shift: np.ndarray, turn: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Small displacements of points of a body, in joint axes."""
    return shift + np.cross(turn, points)


def inside(kind: str, offset: dict[str, float]) -> bool:
    """Whether every corner of the body keeps to its place."""
    shift = np.array([offset.get(key, 0.0) for key in ("along", "side", "normal")])
    turn = np.array([offset.get(key, 0.0) for key in ("roll", "tilt_side", "tilt_normal")])
    if kind == "spherical":
        return bool(np.linalg.norm([offset[key] for key in "xyz"]) <= GAP)
    if kind in ("revolute", "cylindrical"):
        ends = moved(shift, turn, np.array([[LENGTH / 2, 0, 0], [-LENGTH / 2, 0, 0]]))
        return bool((np.hypot(*ends[:, 1:].T) <= GAP).all() and abs(shift[0]) <= 0.05)
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    if kind == "prismatic":
        corners = moved(shift, turn, signs * np.array([LENGTH, WIDTH, HEIGHT]) / 2)
        return bool((np.abs(corners[:, 1:]) <= GAP).all())
    corners = moved(shift, turn, signs * np.array([0, LENGTH, WIDTH]) / 2)
    return bool((np.abs(corners[:, 0]) <= GAP).all())


@pytest.mark.parametrize("kind", SETS)
def test_admissible_is_what_the_corners_say(kind: str) -> None:
    axis = "" if kind == "spherical" else "axis = [0, 0, 1]"
    joint = f'[joints.J]\ntype = "{kind}"\nbodies = ["ground", "b"]\nat = [0, 0, 0]\n{axis}\nclearance = {SETS[kind]}'
    m = jp.loads(f"{HEAD}{joint}")
    names = [parameter.removeprefix("J.") for parameter in m.parameters]
    rng = np.random.default_rng(7)
    sizes = np.array([GAP if key in ("along", "side", "normal", "x", "y", "z") else GAP / LENGTH for key in names])
    sizes = np.where(np.array(names) == "roll", GAP / WIDTH, sizes)
    trials = rng.uniform(-2, 2, (400, len(names))) * sizes * rng.uniform(0.1, 1.0, (400, 1))
    expected = [inside(kind, dict(zip(names, trial, strict=True))) for trial in trials]
    found = admissible(m, trials * m.parameter_factors)[:, 0]
    assert 50 < sum(expected) < 350
    np.testing.assert_array_equal(found, expected)
