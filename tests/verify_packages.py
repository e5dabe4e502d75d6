"""`calibrate` beside another package: planted arms, the same readings and unknowns, no priors.

`verify_packages.py [SEEDS]`, where pybotics is installed. It is not among what tests need, because it asks for NumPy
below 2; it runs with later ones.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec

import numpy as np

from helpers.calibrated_elsewhere import FIXED, NOISE, by_pybotics, planted_arm
from helpers.pages import put_table
from jointplay.analyses.calibrate import compute

SEEDS = 20
#: by how much places may differ, mm, and deviations, in standard errors
PLACES, DEVIATIONS = 1e-6, 1e-3


def main(seeds: int) -> int:
    """Write the table, and return how many arms differ."""
    if find_spec("pybotics") is None:
        print("pybotics is not installed, so that nothing is compared")
        return 0
    largest, wrong = np.zeros(4), 0
    for seed in range(seeds):
        arm = planted_arm(seed)
        found = compute(
            arm.m,
            arm.table,
            sigma={"length": NOISE},
            free=dict.fromkeys(arm.planted),
            fix=(FIXED, *arm.m.drives),
        )
        others, residual, apart = by_pybotics(arm)
        chi = float((residual**2).sum()) / NOISE**2
        estimates = dict(zip(found.labels("unknown"), found.get("estimate").tolist(), strict=True))
        errors = dict(zip(found.labels("unknown"), found.get("standard_error").tolist(), strict=True))
        away = max(abs(estimates[name] - value) / errors[name] for name, value in others.items())
        places = float(np.abs(found.get("residual_after") - residual).max())
        own = np.array([apart, places, away, abs(float(found.attrs["chi_square"]) / chi - 1.0)])
        largest = np.maximum(largest, own)
        wrong += places > PLACES or away > DEVIATIONS
        print(seed, *own, flush=True)
    header = (
        *("package", "arms", "unknowns", "readings", "kinematics as drawn, mm", "places as fitted, mm"),
        *("deviations, standard errors", "sum of squares, relative"),
    )
    row = ("pybotics 3.1.2", seeds, len(others), 3 * len(arm.drives), *(f"{value:.0e}" for value in largest))
    put_table("packages", header, [row])
    return wrong


if __name__ == "__main__":
    sys.exit(int(main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS) > 0))
