"""Variances of the clearance laws and a Monte Carlo of the four-bar, both without the program under test.

Formula (theory B.5 and elementary integrals; k = 3 the truncation in standard deviations, sigma =
half-width / k):

    uniform in a disc, per axis            r^2 / 4
    on the circle, per axis                r^2 / 2
    truncated normal in a disc, per axis   sigma^2 (1 - (k^2/2) exp(-k^2/2) / (1 - exp(-k^2/2)))
    uniform in +-w                         w^2 / 3
    truncated normal in +-w                sigma^2 (1 - 2 k phi(k) / (2 Phi(k) - 1))
    uniform in the guide diamond           c^2 / 6 along the normal, (2 c / L)^2 / 6 in angle

and to first order  Sigma = sum_j A_j Sigma_j A_j^T.
"""

import math
from typing import Any

import numpy as np

from .fourbar import FourBar
from .linkage import Linkage
from .sets import Source

K = 3.0


def variance(s: Source, law: str) -> np.ndarray:
    """Variance of each component of a source under a law, shape (components,)."""
    if s.kind == "disc":
        r = s.size[0]
        shrink = 1 - (K**2 / 2) * math.exp(-(K**2) / 2) / (1 - math.exp(-(K**2) / 2))
        return np.full(2, {"uniform": r**2 / 4, "boundary": r**2 / 2, "normal": (r / K) ** 2 * shrink}[law])
    if s.kind == "diamond":
        if law != "uniform":
            raise NotImplementedError(law)
        return np.array([s.size[0] ** 2 / 6, (s.size[0] / s.size[1]) ** 2 / 6])
    w = (s.size[1] - s.size[0]) / 2
    phi = math.exp(-(K**2) / 2) / math.sqrt(math.tau)
    shrink = 1 - 2 * K * phi / math.erf(K / math.sqrt(2))
    return np.array([{"uniform": w**2 / 3, "boundary": w**2, "normal": (w / K) ** 2 * shrink}[law]])


def covariance(link: Linkage, q: np.ndarray, drives: Any, laws: dict[str, str]) -> np.ndarray:
    """First-order covariance of the output error; laws by source name."""
    source, _ = link.sensitivity(q, drives)
    spread = np.concatenate([variance(s, laws[s.name]) for s in link.sources])
    total: np.ndarray = (source * spread) @ source.T
    return total


def disc(rng: np.random.Generator, radius: float, law: str, n: int) -> np.ndarray:
    """Complex play of one pin."""
    angle = rng.uniform(0, math.tau, n)
    if law == "boundary":
        rho = np.full(n, radius)
    elif law == "uniform":
        rho = radius * np.sqrt(rng.uniform(0, 1, n))
    else:  # Rayleigh, cut at k sigma, by inversion
        rho = radius / K * np.sqrt(-2 * np.log1p(-rng.uniform(0, 1, n) * (1 - math.exp(-(K**2) / 2))))
    play: np.ndarray = rho * np.exp(1j * angle)
    return play


def four_bar_errors(
    four_bar: FourBar,
    theta1: float,
    radii: Any,
    law: str,
    n: int,
    seed: int,
    lengths: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    """Errors (x, y, angle) of the rocker at its pin J3; `lengths` = +- of l2 and l3, uniform."""
    rng = np.random.default_rng(seed)
    d = [disc(rng, r, law, n) for r in radii]
    changed = FourBar(
        four_bar.l1,
        four_bar.l2 + rng.uniform(-1, 1, n) * lengths[0],
        four_bar.l3 + rng.uniform(-1, 1, n) * lengths[1],
        four_bar.A,
        four_bar.D,
        four_bar.branch,
    )
    shift = changed.rocker_pin(theta1, d) - four_bar.rocker_pin(theta1)
    turn = changed.rocker_angle(theta1, d) - four_bar.rocker_angle(theta1)
    errors: np.ndarray = np.stack([shift.real, shift.imag, np.angle(np.exp(1j * turn))], axis=-1)
    return errors
