"""The worst case where deviations have to be strained: trusses against a dense search with another program.

To first order a bar of an elastic truss with play is a spring with a dead band, as long as its loose ends have play:

    energy(u) = sum over the bars of  k / 2 max(0, |n . (u_b - u_a) - g| - loose)^2

and a unit is where its energy is least; of several such places a small load picks the farthest.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

import jointplay as jp
from answers import example
from oracles.truss import Truss, square

Array = NDArray[np.float64]
SMALL = 1e-6


def tower(**more: object) -> Truss:
    """Two storeys, both with two diagonals."""
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "C": (100.0, 90.0), "D": (0.0, 100.0), "E": (95.0, 190.0), "F": (5.0, 185.0)}
    bars = ("AD", "DC", "BC", "AC", "BD", "CE", "DF", "FE", "DE", "CF")
    return Truss(nodes, ("A", "B"), tuple((bar[0], bar[1]) for bar in bars), **more)  # type: ignore[arg-type]


def random_truss(shape: str, seed: int, play: float, tolerances: dict[str, float]) -> tuple[Truss, jp.Mechanism]:
    """A truss of bars of random stiffness and length, with tolerances; in mm and N."""
    rng = np.random.default_rng(seed)
    make, loaded = (square, "C") if shape == "square" else (tower, "E")
    names = make().names
    truss = make(
        radial={node: float(play * rng.uniform(0.5, 1.5)) for node in make().nodes},
        deviation=dict(zip(names, (0.01 * rng.normal(size=len(names))).tolist(), strict=True)),
        stiffness=dict(zip(names, rng.uniform(500, 5000, len(names)).tolist(), strict=True)),
        loaded=loaded,
    )
    m = jp.loads(truss.text(), "truss.toml")
    return truss, m.with_({f"dimensions.long_{name}.tolerance": t for name, t in tolerances.items()})


def displacement(truss: Truss, off: dict[str, float], load: Array) -> Array:
    """Of the output's node, where a unit with other lengths has the least energy under a small load."""
    b, loose = truss.compatibility(), truss.loose()
    k = np.array([truss.stiffness[name] for name in truss.names])
    g = truss.gaps() + np.array([off.get(name, 0.0) for name in truss.names])
    at = 2 * truss.free.index(truss.loaded)
    force = np.zeros(b.shape[1])
    force[at : at + 2] = load
    u = np.zeros(b.shape[1])
    # Newton's method on a function that is quadratic piece by piece, held where nothing pushes.
    hold = 1e-9 * k.max()
    for _ in range(200):
        stretch = b @ u - g
        tension = k * np.sign(stretch) * np.maximum(0.0, np.abs(stretch) - loose)
        gradient = b.T @ tension - force
        hessian = b.T @ ((k * (np.abs(stretch) > loose))[:, None] * b) + hold * np.eye(len(u))
        step = np.linalg.solve(hessian, -gradient)

        def energy(u: Array) -> float:
            over = np.maximum(0.0, np.abs(b @ u - g) - loose)
            return float(0.5 * k @ over**2 - force @ u)

        part = 1.0
        while energy(u + part * step) > energy(u) + 1e-4 * part * float(gradient @ step) and part > 1e-10:
            part *= 0.5
        u = u + part * step
        if np.abs(part * step).max() < 1e-12:
            break
    return np.asarray(u[at : at + 2])


def strained(truss: Truss, off: dict[str, float]) -> bool:
    lengths = {name: truss.deviation[name] + off.get(name, 0.0) for name in truss.names}
    return Truss(**{**vars(truss), "deviation": lengths}).factor() > 1.0


SCALE = 0.02


@pytest.mark.parametrize(("shape", "seed"), [("square", 0), ("square", 1), ("square", 2), ("tower", 0), ("tower", 1)])
def test_no_unit_of_a_dense_search_is_farther_off_and_some_are_as_far(shape: str, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    names = square().names if shape == "square" else tower().names
    chosen = rng.choice(names, 3, replace=False).tolist()
    tolerances = {name: float(SCALE * rng.uniform(0.5, 1.5)) for name in chosen}
    truss, m = random_truss(shape, seed, 0.2 * SCALE, tolerances)
    worst = jp.worst(m)
    assert worst.status[0].item() == "strained"
    k = max(truss.stiffness.values())
    ways = [SMALL * SCALE * k * np.array([math.cos(a), math.sin(a)]) for a in np.linspace(0, math.tau, 8, endpoint=False)]

    def farthest(lengths: Array) -> float:
        off = dict(zip(chosen, lengths.tolist(), strict=True))
        return max(float(np.hypot(*displacement(truss, off, way))) for way in ways)

    grid = [np.linspace(-tolerances[name], tolerances[name], 5) for name in chosen]
    units = [np.array(u) for u in itertools.product(*grid)]
    units = [u for u in units if strained(truss, dict(zip(chosen, u.tolist(), strict=True)))]
    sizes = [farthest(u) for u in units]
    best = units[int(np.argmax(sizes))]
    bounds = [(-tolerances[name], tolerances[name]) for name in chosen]
    refined = minimize(lambda u: -farthest(u), best, bounds=bounds, method="Nelder-Mead", options={"maxfev": 60})
    largest = max(*sizes, -float(refined.fun))
    found = worst.worst_position_first_order[0].item()
    assert largest <= found * (1 + 1e-4)
    together = jp.worst(m.with_({f"bodies.{name}.stiffness": None for name in truss.names}))
    rigid = together.worst_position_first_order[0].item()
    assert found == pytest.approx(max(largest, 0.0 if math.isnan(rigid) else rigid), rel=1e-3)
    assert found <= worst.worst_position_bound[0].item()
    assert worst.worst_position[0].item() == pytest.approx(found, rel=5e-3)
