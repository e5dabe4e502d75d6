"""Planted deviations of built machines beside what `calibrate` finds of them: `verify_calibrate.py [SEEDS]`.

For every kind of machine deviations are drawn by the laws of its file, and readings with noise and with play that is
drawn anew at each. Counted is how often the truth lies within 1.96 standard errors of the estimate, which is to be
0.95, and by how much the mean of (estimate - truth) / standard error differs from zero.
"""

import sys

import numpy as np

from helpers.built import MACHINES, readings, specimen
from helpers.pages import put_table
from jointplay.analyses.calibrate import compute
from jointplay.analyses.calibrate.unknowns import unknowns_of

SEEDS = 200
#: seeds of a machine whose readings are means of specimens, which takes a hundred times as long
FEW = 20
#: standard deviations by which a coverage or a mean may differ from what it is to be
MOST = 4.0


def main(seeds: int) -> int:
    """Write the table, and return how many numbers are off."""
    rows, wrong = [], 0
    for kind, build in MACHINES.items():
        machine = build()
        every = unknowns_of(machine.m, {}, ()).unknowns
        away, left_out, chi, free = [], 0, 0.0, 0
        count = seeds if machine.m.core.isostatic else min(seeds, FEW)
        for seed in range(count):
            u = specimen(machine.m, seed)
            found = compute(machine.m, readings(machine, u, seed), sigma=machine.sigma)
            truth = np.array([u[one.parameter] / one.factor for one in every])
            away.append((found.get("estimate") - truth) / found.get("standard_error"))
            left_out += int(found.get("left_out").sum())
            chi += float(found.attrs["chi_square"])
            free += int(found.attrs["degrees_of_freedom"])
        z = np.array(away)
        # The unknowns of one machine hang together: what scatters is the share of each machine.
        shares = (np.abs(z) < 1.96).mean(axis=1)
        coverage, error = float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(count))
        mean = float(np.abs(z.mean(axis=0)).max())
        wrong += abs(coverage - 0.95) > MOST * error
        wrong += mean > MOST / np.sqrt(count)
        cells = len(machine.drives) * len(machine.components)
        numbers = (f"{coverage:.3f} ± {error:.3f}", f"{mean:.2f}", f"{chi / free:.3f}", left_out)
        rows.append((kind, len(every), cells, count, *numbers))
        print(*rows[-1], flush=True)
    header = (
        *("machine", "unknowns", "readings", "machines", "within 1.96 standard errors", "largest mean"),
        *("chi square per degree of freedom", "rows left out"),
    )
    put_table("calibrate", header, rows)
    return wrong


if __name__ == "__main__":
    sys.exit(int(main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS) > 0))
