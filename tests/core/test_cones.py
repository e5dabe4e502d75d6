"""Cone programs of the core against linear programs, closed forms and themselves."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from jointplay import _core

Array = NDArray[np.float64]
SOLVED, INFEASIBLE = 0, 1


def intervals(sizes: Array) -> str:
    """Blocks of one component each."""
    return json.dumps([{"clearance": {"interval": {"low": -s, "high": s}}} for s in sizes])


def random_programs(rng: np.random.Generator, n: int, s: int, width: int) -> dict[str, Any]:
    """Programs whose right sides are within reach."""
    maps = rng.normal(size=(n, s, width))
    sizes = rng.uniform(0.2, 2.0, width)
    inside = 0.6 * sizes * rng.uniform(-1, 1, (n, width))
    rights = np.einsum("nsw,nw->ns", maps, inside)
    return {"sizes": sizes, "maps": maps, "forces": rng.normal(size=(n, width)), "rights": rights}


@pytest.mark.parametrize(("s", "width"), [(1, 3), (4, 12), (9, 30)])
def test_intervals_are_linear_programs(s: int, width: int) -> None:
    p = random_programs(np.random.default_rng(s), 12, s, width)
    numbers = (p["maps"], p["forces"], p["rights"])
    pose = _core.cone_programs("pose", intervals(p["sizes"]), *numbers)
    assembly = _core.cone_programs("assembly", intervals(p["sizes"]), *numbers)
    assert (pose["outcome"] == SOLVED).all()
    assert (assembly["outcome"] == SOLVED).all()
    for k in range(12):
        bounds = [(-size, size) for size in p["sizes"]]
        one = linprog(-p["forces"][k], A_eq=p["maps"][k], b_eq=p["rights"][k], bounds=bounds)
        assert pose["value"][k] == pytest.approx(one.fun, abs=1e-8)
        # The offsets as parts of their sizes, and the factor: |u| <= t.
        scaled = p["maps"][k] * p["sizes"]
        sides = np.block([[np.eye(width), -np.ones((width, 1))], [-np.eye(width), -np.ones((width, 1))]])
        free = [(None, None)] * width + [(0, None)]
        cost = np.r_[np.zeros(width), 1.0]
        equal = np.c_[scaled, np.zeros(s)]
        one = linprog(cost, A_ub=sides, b_ub=np.zeros(2 * width), A_eq=equal, b_eq=p["rights"][k], bounds=free)
        assert assembly["factor"][k] == pytest.approx(one.fun, abs=1e-8)


def test_a_redundant_bar_between_pins() -> None:
    """N = k sign(g) max(0, |g| - sum r |s|): a dead band of the play, a spring beyond it."""
    rng = np.random.default_rng(2)
    n, radii, stiffness = 20, np.array([1e-5, 4e-5, 2e-5]), 3e7
    blocks = [{"clearance": {"disc": {"radius": r}}} for r in radii] + [{"spring": [1 / stiffness]}]
    maps = np.concatenate([rng.normal(size=(n, 1, 6)), np.ones((n, 1, 1))], axis=2)
    misfit = rng.uniform(-2e-4, 2e-4, (n, 1))
    found = _core.cone_programs("pose", json.dumps(blocks), maps, np.zeros((n, 7)), misfit)
    play = np.linalg.norm(maps[:, 0, :6].reshape(n, 3, 2), axis=2) @ radii
    force = stiffness * np.sign(misfit[:, 0]) * np.maximum(np.abs(misfit[:, 0]) - play, 0)
    assert found["multipliers"][:, 0] == pytest.approx(force, abs=1e-7 * stiffness * 2e-4)
    assert (force == 0).any()
    assert (force != 0).any()
    factor = _core.cone_programs("assembly", json.dumps(blocks), maps, np.zeros((n, 7)), misfit)["factor"]
    assert factor == pytest.approx(np.abs(misfit[:, 0]) / play, rel=1e-9)


def test_alone_and_eight_at_a_time_agree() -> None:
    p = random_programs(np.random.default_rng(3), 19, 5, 14)
    blocks = json.dumps([{"clearance": {"ball": {"radius": 0.7}}}] * 4 + [{"fixed": {"disc": {"radius": 0.4}}}])
    numbers = (p["maps"], p["forces"], 0.3 * p["rights"])
    for question in ("pose", "assembly"):
        many = _core.cone_programs(question, blocks, *numbers)
        each = _core.cone_programs(question, blocks, *numbers, alone=True)
        assert many["outcome"].tolist() == each["outcome"].tolist()
        solved = many["outcome"] == SOLVED
        assert many["value"][solved] == pytest.approx(each["value"][solved], rel=1e-8, abs=1e-8)
        assert many["difference"] < 1e-8
        assert many["compared"] >= 1
        assert each["alone"] == 19


def test_what_cannot_be_is_infeasible() -> None:
    blocks = json.dumps([{"clearance": {"disc": {"radius": 1.0}}}])
    maps, forces = np.ones((1, 1, 2)), np.ones((1, 2))
    found = _core.cone_programs("pose", blocks, maps, forces, np.array([[2.0]]))
    assert found["outcome"][0] == INFEASIBLE
    found = _core.cone_programs("assembly", blocks, maps, forces, np.array([[2.0]]))
    assert found["factor"][0] == pytest.approx(np.sqrt(2.0))


@pytest.mark.parametrize(
    ("question", "blocks", "message"),
    [
        ("where", "[]", "unknown question 'where'"),
        ("pose", '[{"clearance": {"disc": {"radius": -1}}}]', "radius of the disc is -1"),
        ("pose", "[]", "do not fit"),
    ],
)
def test_bad_input_is_named(question: str, blocks: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _core.cone_programs(question, blocks, np.ones((1, 1, 2)), np.ones((1, 2)), np.ones((1, 1)))
