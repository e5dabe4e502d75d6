"""`calibrate` beside other packages: planted arms, the same readings, no priors.

`verify_packages.py [SEEDS]`, where pybotics and robotkinecal are installed. They are not among what tests need, because
they ask for NumPy below 2; they run with later ones. The unknowns of pybotics are the same, so that what is found is
compared; robotkinecal corrects all axes, so that places are compared which no reading has, of readings without noise.
"""

import sys
from importlib.util import find_spec

import numpy as np

import jointplay as jp
from helpers.calibrated_elsewhere import FIXED, NOISE, PlantedArm, by_pybotics, by_robotkinecal, planted_arm
from helpers.pages import put_table
from jointplay.analyses.calibrate import compute
from jointplay.analyses.nominal import at_drives
from jointplay.result import Result

SEEDS = 20
#: by how much places may differ, mm, and deviations, in standard errors
PLACES, DEVIATIONS = 1e-6, 1e-3


#: standard deviation that is told of readings without noise, mm, and by how much places may then differ that none has
EXACT, UNSEEN = 1e-5, 1e-6


def main(seeds: int) -> int:
    """Write the table, and return how many arms differ."""
    missing = [name for name in ("pybotics", "robotkinecal") if find_spec(name) is None]
    if missing:
        print(f"{' and '.join(missing)}: not installed, so that nothing is compared")
        return 0
    rows, wrong = [], 0
    for compared in (_pybotics, _robotkinecal):
        row, off = compared(seeds)
        rows.append(row)
        wrong += off
    header = (
        *("package", "arms", "unknowns", "readings", "kinematics as drawn, mm", "places as fitted, mm"),
        *("places without a reading, mm", "deviations, standard errors", "sum of squares, relative"),
    )
    put_table("packages", header, rows)
    return wrong


def _found(arm: PlantedArm, sigma: float) -> Result:
    free, fix = dict.fromkeys(arm.planted), (FIXED, *arm.m.drives)
    return compute(arm.m, arm.table, sigma={"length": sigma}, free=free, fix=fix)


def _pybotics(seeds: int) -> tuple[tuple[object, ...], int]:
    largest, wrong = np.zeros(4), 0
    for seed in range(seeds):
        arm = planted_arm(seed)
        found = _found(arm, NOISE)
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
    drawn, places, away, squares = (f"{value:.0e}" for value in largest)
    return ("pybotics 3.1.2", seeds, len(others), 3 * len(arm.drives), drawn, places, "–", away, squares), wrong


def _robotkinecal(seeds: int) -> tuple[tuple[object, ...], int]:
    largest, wrong = np.zeros(2), 0
    for seed in range(seeds):
        arm = planted_arm(seed, noise=0.0)
        drives = arm.drives + np.random.default_rng([seed, 1]).uniform(-0.3, 0.3, arm.drives.shape)
        built = jp.as_built(arm.m, _found(arm, EXACT))
        at = at_drives(built, drives)
        errors = built.core.given(at.drives, at.poses, np.tile(built.centre, (len(drives), 1)))["error"]
        theirs, apart = by_robotkinecal(arm, drives)
        unseen = np.abs((at.output + errors)[:, :3] / arm.m.units.length - theirs).max()
        largest = np.maximum(largest, (apart, unseen))
        wrong += int(unseen > UNSEEN)
        print(seed, apart, unseen, flush=True)
    unknowns = 4 * len(arm.m.drives) + 3
    drawn, unseen = (f"{value:.0e}" for value in largest)
    return ("robotkinecal 0.1.0", seeds, unknowns, 3 * len(drives), drawn, "–", unseen, "–", "–"), wrong


if __name__ == "__main__":
    sys.exit(int(main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS) > 0))
