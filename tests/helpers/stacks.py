"""Bodies that are held by more joints than needed, of all kinds, in space."""

from typing import Any

import numpy as np

from helpers.oracles.loops import Builder


def stack(seed: int, clearance: float = 1e-5) -> dict[str, Any]:
    """Two bodies, the second on the first, each held by more joints of random kinds than it needs; none moves."""
    rng = np.random.default_rng(seed)
    builder = Builder(2, rng)
    for first, second in ((-1, 0), (0, 1)):
        for kind in rng.choice(["revolute", "cylindrical", "prismatic", "spherical", "planar"], 4):
            builder.joint(str(kind), first, second, 0.2 * rng.uniform(-1, 1, 3), clearance)
    return builder.spec(1, np.array([0.1, 0.05, 0.2]), (100 * rng.normal(size=3), 10 * rng.normal(size=3)))
