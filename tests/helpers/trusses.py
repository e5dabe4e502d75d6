"""Trusses with clearance in their pins and bars of other lengths, as mechanisms."""

import numpy as np

import jointplay as jp
from helpers.oracles.truss import Truss, square

RADIAL = {"A": 0.02, "B": 0.03, "C": 0.01, "D": 0.015}


def random_square(seed: int, **more: object) -> Truss:
    rng = np.random.default_rng(seed)
    truss = square()
    deviation = {name: float(d) for name, d in zip(truss.names, 0.1 * rng.normal(size=5), strict=True)}
    return square(**{"radial": RADIAL, "deviation": deviation, "load": (30.0, -80.0), "loaded": "C", **more})


def mechanism(truss: Truss) -> jp.Mechanism:
    return jp.loads(truss.text(), "truss.toml")


def tower(**more: object) -> Truss:
    """Two storeys, both with two diagonals."""
    nodes = {
        "A": (0.0, 0.0),
        "B": (100.0, 0.0),
        "C": (100.0, 90.0),
        "D": (0.0, 100.0),
        "E": (95.0, 190.0),
        "F": (5.0, 185.0),
    }
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
