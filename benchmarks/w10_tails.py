"""W10: rare specimens outside a limit: the search for them beside counting plain samples.

The relative standard error e of the search is measured: its spread over many seeds. Plain samples reach it with
(1 - p) / (p e^2) of them, p the share, whose processor time is that of a shorter run in proportion.
"""

import time

import numpy as np

import jointplay as jp
from harness import Report, Target
from jointplay.analyses import tails
from jointplay.analyses.nominal import nominal

#: limits of the position error, mm, and about which share of the specimens is beyond
LIMITS = {2.9: "100 ppm", 3.19: "1 ppm", 3.33: "10 ppb"}
ASKED = "1 ppm"
SEEDS = 96
PLAIN = 1 << 22


def measure(rounds: int) -> Report:
    """Search with one seed after the other, and count beside it."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"drives.theta1.values": [60.0]})
    at, position = nominal(m), len(m.components)
    case = at.drives, at.poses
    rows, targets = [], []
    for limit, about in LIMITS.items():
        limits = np.full((position + 2, 2), [-np.inf, np.inf])
        limits[position, 1] = 1e-3 * limit
        shares, seconds, each = [], [], []
        for seed in range(max(SEEDS * rounds // 9, 4)):
            began = time.process_time()
            shares.append(tails.tail(m, *case, seed, None, limits).share[0])
            seconds.append(time.process_time() - began)
            began = time.process_time()
            m.core.random(*case, PLAIN, seed, np.array([0.5]), limits, threads=1, sampling="plain")
            each.append((time.process_time() - began) / PLAIN)
        share, spent = float(np.mean(shares)), float(np.median(seconds))
        error = float(np.std(shares, ddof=1)) / share
        plain = (1.0 - share) / (share * error**2) * float(np.median(each))
        rows.append(
            [
                about,
                f"{share:.3g}",
                f"{100 * error:.2g} %",
                f"{spent:.2g} s",
                f"{plain:,.3g} s",
                f"{plain / spent:,.3g}",
            ]
        )
        if about == ASKED:
            targets.append(Target(f"W10: time of plain samples against the search, {about}", 50, False, plain / spent))
    header = ["about", "share outside", "relative standard error", "search", "plain samples to it", "times less"]
    return Report("W10", "Rare specimens against counting", header, rows, targets)
