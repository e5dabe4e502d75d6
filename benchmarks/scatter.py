"""Sampling and statistics of a Monte Carlo, once for jointplay and once as a NumPy user would write them.

Statistics are what jointplay gives: mean and covariance of the three components, the largest size and a histogram of
1024 bins for x, y, angle, position and rotation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BINS = 1024
LEVELS = np.array([0.5, 0.9, 0.99])
#: samples a peer holds at a time
BATCH = 1 << 15


@dataclass(frozen=True)
class Problem:
    """One configuration of one mechanism, whose samples jointplay drew and solved for the peers to solve, too."""

    mechanism: Any
    drives: Array
    poses: Array
    offsets: Array
    errors: Array
    edges: Array  # of the histograms: [quantity, 2]
    sets: tuple[tuple[str, float], ...]  # ("disc", radius) or ("interval", half-width) per source

    def random(self, samples: int) -> dict[str, Any]:
        """Run the Monte Carlo of jointplay's core on one thread."""
        return self.mechanism.core.random(self.drives, self.poses, samples, 1, LEVELS, None, None, 1)

    def draw(self, rng: np.random.Generator, n: int) -> Array:
        """Discs uniform; lengths normal, truncated at three sigma."""
        columns: list[Array] = []
        for kind, size in self.sets:
            if kind == "disc":
                radius, angle = size * np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
                columns += [radius * np.cos(angle), radius * np.sin(angle)]
            else:
                values = rng.standard_normal(n)
                while (outside := np.abs(values) > 3).any():
                    values[outside] = rng.standard_normal(int(outside.sum()))
                columns.append(values * (size / 3))
        return np.stack(columns, axis=1)

    def monte_carlo(self, solve: Callable[[Array], Array], samples: int) -> dict[str, Array]:
        """Draw, solve and count with NumPy."""
        rng = np.random.default_rng(1)
        total = {"sum": np.zeros(3), "product": np.zeros((3, 3)), "bins": np.zeros((5, BINS)), "largest": np.zeros(5)}
        for done in range(0, samples, BATCH):
            error = solve(self.draw(rng, min(BATCH, samples - done)))
            total["sum"] += error.sum(axis=0)
            total["product"] += error.T @ error
            sizes = [np.hypot(error[:, 0], error[:, 1]), np.abs(error[:, 2])]
            for k, values in enumerate([*error.T, *sizes]):
                total["bins"][k] += np.histogram(values, BINS, (self.edges[k, 0], self.edges[k, 1]))[0]
                total["largest"][k] = max(total["largest"][k], np.abs(values).max())
        return total

    def difference(self, errors: Array) -> str:
        """Say how far errors of the first samples are from jointplay's, as a part of the largest of a component."""
        mine = self.errors[: len(errors)]
        part = (np.abs(errors - mine) / np.abs(mine).max(axis=0)).max()
        return f"same samples: {part:.0e}"

    def same_sigma(self, total: dict[str, Array], samples: int) -> str:
        """Compare standard deviations, in standard errors of the smaller set of samples."""
        sigma = np.sqrt(np.diag(total["product"]) / samples - (total["sum"] / samples) ** 2)
        return sigma_words(sigma, self, samples)


def sigma_words(sigma: Array, problem: Problem, samples: int) -> str:
    """Say by how many standard errors standard deviations differ from jointplay's."""
    mine = np.sqrt(np.diag(problem.random(1 << 20)["covariance"][0]))[: len(sigma)]
    # A normal law's; flatter ones are known better.
    off = np.abs(sigma / mine - 1).max() / np.sqrt(0.5 / samples)
    return f"sigma within {off:.1f} standard errors"


def problem(mechanism: Any, samples: int = 1 << 12) -> Problem:
    """The first configuration of a mechanism."""
    core = mechanism.core
    drives = np.ascontiguousarray(mechanism.drive_values[:1])
    poses = core.trace(drives)["poses"]
    kept = core.random(drives, poses, samples, 7, LEVELS, None, None, 1, True)
    if kept["failures"][0, 1:].any():
        raise RuntimeError("the peers compare solved samples only")
    sets: list[tuple[str, float]] = []
    for source in mechanism.spec()["sources"]:
        kind, numbers = next(iter(source["set"].items()))
        if source["kind"] != "drive":
            sets.append((kind, numbers["radius"] if kind == "disc" else numbers["high"]))
    width = sum(2 if kind == "disc" else 1 for kind, _ in sets)
    return Problem(
        mechanism=mechanism,
        drives=drives,
        poses=poses,
        offsets=np.ascontiguousarray(kept["kept_parameters"][:, :width]),
        errors=kept["kept_errors"],
        edges=kept["edges"][0][:, [0, -1]],
        sets=tuple(sets),
    )
