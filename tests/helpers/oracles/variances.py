"""Variances of offsets uniform in the sets of spatial joints, and of tolerances, by elementary integrals.

journal, sleeve   both ends uniform in discs:  r^2/8 across, r^2/(8 h^2) in tilt;  a^2/3 along
ball              r^2/5
plate             an octahedron:  c^2/10, (c/a)^2/10, (c/b)^2/10
guide             a roll r leaves two diamonds of c - a r and c - b r, so that its density goes with the product of
                  their squares; a diamond of size s has s^2/6
interval          w^2/3;  normal, cut off at three sigma, the tolerance:  s^2 (1 - 6 phi(3) / erf(3 / sqrt 2))
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def variance(source: dict[str, Any]) -> Array:
    """Variance of every component of a source, a clearance uniform in its set."""
    ((kind, size),) = source["set"].items()
    if kind in ("journal", "sleeve"):
        shift = size["radius"] ** 2 / 8
        tilt = shift / size["half_length"] ** 2
        along = [size["axial"] ** 2 / 3] if kind == "journal" else []
        return np.array([*along, shift, shift, tilt, tilt])
    if kind == "ball":
        return np.full(3, size["radius"] ** 2 / 5)
    if kind == "plate":
        return size["gap"] ** 2 / 10 / np.array([1.0, size["half_normal"], size["half_side"]]) ** 2
    if kind == "guide":
        return _guide(size["gap"], size["half_length"], size["half_width"], size["half_height"])
    half = (size["high"] - size["low"]) / 2
    if source["law"] == "uniform":
        return np.array([half**2 / 3])
    cut = 6 * math.exp(-4.5) / math.sqrt(math.tau) / math.erf(3 / math.sqrt(2))
    return np.array([half**2 / 9 * (1 - cut)])


def _guide(c: float, h: float, width: float, height: float) -> Array:
    # Polynomials of degree six: four nodes of Gauss are exact.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    r = 0.5 * (1 + nodes) * min(c / height, c / width)
    across, upright = c - height * r, c - width * r
    density = weights * (across * upright) ** 2
    density /= density.sum()
    a, b = density @ across**2 / 6, density @ upright**2 / 6
    return np.array([a, b, density @ r**2, b / h**2, a / h**2])
