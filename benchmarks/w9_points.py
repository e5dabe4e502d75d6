"""W9: scrambled Sobol points beside pseudo-random samples: processor time to a given standard error.

What a figure misses is measured, not taken from the program: its spread s over many seeds. With the processor time t
of a run, the time to a given standard error goes with t s^2 for plain samples. The same is taken for Sobol points,
whose error falls faster than that.
"""

from __future__ import annotations

import time

import numpy as np

import jointplay as jp
from harness import Report, Target
from jointplay.analyses.nominal import nominal

SAMPLES = (1 << 15, 1 << 17)
SEEDS = 48
LEVELS = np.array([0.95, 0.998_65])
POINTS = ("plain", "sobol")


def measure(rounds: int) -> Report:
    """Run both in turn, seed by seed."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"drives.theta1.values": [60.0]})
    at, position = nominal(m), len(m.components)
    rows, targets = [], []
    for samples in SAMPLES:
        figures: dict[str, list[list[float]]] = {points: [] for points in POINTS}
        seconds: dict[str, list[float]] = {points: [] for points in POINTS}
        for seed in range(max(SEEDS * rounds // 9, 4)):
            for points in POINTS:
                began = time.process_time()
                found = m.core.random(at.drives, at.poses, samples, seed, LEVELS, threads=1, sampling=points)
                seconds[points].append(time.process_time() - began)
                std = np.sqrt(np.diagonal(found["covariance"][0])) / np.sqrt(
                    np.diagonal(found["covariance_first_order"][0])
                )
                figures[points].append([float(std.mean()), *found["quantile"][0, :, position].tolist()])
        spread = {points: np.std(figures[points], axis=0, ddof=1) for points in POINTS}
        cost = {points: float(np.median(seconds[points])) for points in POINTS}
        names = ("standard deviation, mean of the components", "95 % quantile, position", "99.865 % quantile, position")
        for k, name in enumerate(names):
            smaller = float(spread["plain"][k] / spread["sobol"][k])
            less = smaller**2 * cost["plain"] / cost["sobol"]
            rows.append([name, f"{samples:,}", f"{smaller:.3g}", f"{cost['sobol'] / cost['plain']:.3g}", f"{less:.3g}"])
            if samples == SAMPLES[-1] and k < 2:
                targets.append(
                    Target(f"W9: time of plain samples against Sobol points, {name}", (50, 3)[k], False, less)
                )
    header = ["figure", "samples", "standard error, times smaller", "time, times larger", "time to it, times less"]
    return Report("W9", "Sobol points against plain samples", header, rows, targets)
