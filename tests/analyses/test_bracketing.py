"""Ends, changes of sign and minima of functions, found in few values."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import jointplay as jp
from jointplay.analyses import singular_path
from jointplay.analyses.bracketing import edge, minimum

PLACES = (0.02, 0.3, 0.7071, 0.99)


class Counted:
    """A function that counts its values."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self.function = function
        self.count = 0

    def __call__(self, x: float) -> float:
        self.count += 1
        return self.function(x)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("flip", [False, True])
def test_an_end_is_found_from_one_side(place: float, flip: bool) -> None:
    # The square of a singular value beside a fold, which is a series in the root of the way that is left.
    def left(x: float) -> float:
        s = place - (1.0 - x if flip else x)
        return s + 0.8 * s**1.5 if s > 0.0 else math.nan

    counted, near, far = Counted(left), 1.0 * flip, 1.0 - flip
    found = edge(counted, near, far, left(near), zero=2e-16)
    assert abs(found - (1.0 - place if flip else place)) < 2e-15
    assert counted.count <= 24


@pytest.mark.parametrize("place", PLACES)
def test_a_change_of_sign_is_that_of_another_method(place: float) -> None:
    def height(x: float) -> float:
        return math.sin(3.0 * (place - x)) * (1.0 + x)

    counted = Counted(height)
    found = edge(counted, 0.0, 1.0, height(0.0), height(1.0), zero=1e-12)
    assert abs(found - brentq(height, 0.0, 1.0, xtol=1e-15)) < 1e-12
    assert counted.count <= 16


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(
    "height",
    [
        lambda s: 1.0 if s > 0.0 else -2.0,
        lambda s: 1.0 + s if s > 0.0 else math.nan,
        lambda s: s**3,
        lambda s: math.sqrt(s) if s > 0.0 else math.nan,
    ],
    ids=["jump", "gap", "flat", "steep"],
)
def test_what_no_line_follows_is_found_by_halving(place: float, height: Callable[[float], float]) -> None:
    counted = Counted(lambda x: height(place - x))
    found = edge(counted, 0.0, 1.0, counted(0.0), counted(1.0))
    assert counted(found) > 0.0
    # where the line ends in the last digits of a place the search does, too: of s^3 that is a little before
    assert found <= place < found + 1e-14
    assert counted.count <= 50 + 52


def test_a_place_beside_the_first_end_is_the_end_itself() -> None:
    assert edge(lambda _: math.nan, 2.0, 3.0, 1.0) == 2.0


@pytest.mark.parametrize(
    "function",
    [
        lambda x: (x - 0.3) ** 2 + 0.1 * (x - 0.3) ** 3,
        lambda x: abs(x - 0.3),
        lambda x: math.cosh(x - 0.9),
        lambda x: (x - 0.3) ** 4,
        lambda x: x,
        lambda x: -x,
    ],
)
def test_a_minimum_is_that_of_another_method(function: Callable[[float], float]) -> None:
    counted = Counted(function)
    found = minimum(counted, 0.0, 1.0)
    other = minimize_scalar(function, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-10})
    assert function(found) <= other.fun + 1e-9
    assert counted.count <= 46


def test_a_singularity_of_a_path_takes_few_states(monkeypatch: pytest.MonkeyPatch) -> None:
    path = {"path.x": [150.0, 240.0, 330.0], "path.y": [20.0] * 3, "path.z": [400.0] * 3}
    m = jp.loads(jp.examples.text("3-upu")).with_(path)
    states = 0
    state = singular_path.DrivePath._state

    def counted(*args: object) -> object:
        nonlocal states
        states += 1
        return state(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(singular_path.DrivePath, "_state", counted)
    result = jp.singularities(m)
    assert np.isfinite(result.singularity_distance).all()
    assert 0 < states <= 12
