"""W9: scrambled Sobol points beside pseudo-random samples: processor time to a given standard error.

What a figure misses is measured, not taken from the program: its spread s over many seeds. With the processor time t
of a run, the time to a given standard error goes with t s^2 for plain samples. The same is taken for Sobol points,
whose error falls faster than that.
"""

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import jointplay as jp
from harness import Report, Target
from jointplay.analyses.nominal import nominal

FOLDER = Path(__file__).parent
SAMPLES = 1 << 17
SEEDS = 96
LEVELS = np.array([0.95, 0.998_65])
POINTS = ("plain", "sobol")
FIGURES = ("standard deviation, mean of the components", "95 % quantile, position", "99.865 % quantile, position")
#: of the first figures, how much less time is to be reached
LEAST = (50, 3)


def measure(rounds: int) -> Report:
    """Run both in turn, mechanism by mechanism, seed by seed."""
    bundled = jp.loads(jp.examples.text("four-bar")).with_({"drives.theta1.values": [60.0]})
    mechanisms = {
        "W1": jp.load(FOLDER / "four-bar.toml"),
        "W2": jp.load(FOLDER / "ten-bar.toml"),
        "bundled four-bar": bundled,
    }
    rows, targets = [], []
    for label, m in mechanisms.items():
        smaller, longer = compared(m, max(SEEDS * rounds // 9, 4))
        for k, name in enumerate(FIGURES):
            less = float(smaller[k] ** 2 / longer)
            rows.append([f"{label}: {name}", f"{smaller[k]:.3g}", f"{longer:.3g}", f"{less:.3g}"])
            if k < len(LEAST) and m is not bundled:
                words = f"W9: time of plain samples against Sobol points, {label}, {name}"
                targets.append(Target(words, LEAST[k], False, less))
    header = ["figure", "standard error, times smaller", "time, times larger", "time to it, times less"]
    return Report("W9", "Sobol points against plain samples", header, rows, targets)


def compared(m: jp.Mechanism, seeds: int) -> tuple[NDArray[np.float64], float]:
    """How many times smaller standard errors are with Sobol points, and how many times longer they take."""
    at, position = nominal(m).first(1), len(m.components)
    figures: dict[str, list[list[float]]] = {points: [] for points in POINTS}
    seconds: dict[str, list[float]] = {points: [] for points in POINTS}
    for seed in range(seeds):
        for points in POINTS:
            began = time.process_time()
            found = m.core.random(at.drives, at.poses, SAMPLES, seed, LEVELS, threads=1, sampling=points)
            seconds[points].append(time.process_time() - began)
            std = np.sqrt(np.diagonal(found["covariance"][0]))
            std /= np.sqrt(np.diagonal(found["covariance_first_order"][0]))
            figures[points].append([float(std.mean()), *found["quantile"][0, :, position].tolist()])
    plain, sobol = (np.std(figures[points], axis=0, ddof=1) for points in POINTS)
    return plain / sobol, float(np.median(seconds["sobol"]) / np.median(seconds["plain"]))
