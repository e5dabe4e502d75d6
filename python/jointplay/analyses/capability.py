"""Predicted process capability from quantiles: the general method of ISO 22514-2, for any distribution.

    Cp  = (U - L) / (X99.865 - X0.135)
    Cpk = min((U - X50) / (X99.865 - X50), (X50 - L) / (X50 - X0.135))

U and L are the limits. A quantity with one limit has Cpk by its one side and no Cp; so have position and rotation,
which have no lower one. The standard errors follow from those of the three quantiles, with Sobol points by their
replicates. Two of them, p < r, have the correlation of order statistics of independent specimens,
sqrt(p (1 - r) / (r (1 - p))). It is at most 0.04, so that it hardly matters that Sobol points have another one.
"""

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats

#: what lies below the quantiles: six standard deviations of a normal law apart
TAIL, MIDDLE = 0.00135, 0.5
LEVELS = np.array([TAIL, MIDDLE, 1.0 - TAIL])
#: share of the room between the limits below which a width is rounding: what does not scatter has no capability
NO_WIDTH = 1e-8
#: with fewer specimens the outer quantiles are beyond all of them
FEWEST = round(1.0 / TAIL)


@dataclass(frozen=True)
class Capability:
    """Capability by configuration and quantity, each (configuration, quantity); nan where there is none."""

    cp: Floats
    cp_error: Floats
    cpk: Floats
    cpk_error: Floats


def capability(limits: Floats, quantiles: Floats, errors: Floats, resolution: Floats, samples: int) -> Capability:
    """The capability of every quantity that has a limit.

    Parameters
    ----------
    limits : ndarray
        Lowest and highest acceptable value, infinite where there is none, shape (quantity, 2).
    quantiles, errors : ndarray
        At `LEVELS`, and their standard errors, shape (configuration, level, quantity).
    resolution : ndarray
        Width within which quantiles are known, shape (configuration, quantity).
    samples : int
        Specimens per configuration.
    """
    x = np.moveaxis(quantiles, 1, -1)
    low, high = limits.T
    # A histogram does not tell values within a bin apart.
    error = np.hypot(np.moveaxis(errors, 1, -1), resolution[..., None] / np.sqrt(12.0))
    p, r = np.minimum.outer(LEVELS, LEVELS), np.maximum.outer(LEVELS, LEVELS)
    together = np.sqrt(p * (1.0 - r) / (r * (1.0 - p)))
    covariance = error[..., :, None] * error[..., None, :] * together

    def with_error(value: Floats, slope: Floats) -> tuple[Floats, Floats]:
        return value, np.sqrt(np.einsum("...i,...ij,...j->...", slope, covariance, slope))

    def ratio(
        room: Floats, width: Floats, room_slope: tuple[int, ...], width_slope: tuple[int, ...]
    ) -> tuple[Floats, Floats]:
        known = np.isfinite(room) & (width > NO_WIDTH * np.abs(room)) & (samples >= FEWEST)
        value = np.divide(room, width, out=np.full(width.shape, np.nan), where=known)
        slopes = np.array(room_slope) - value[..., None] * np.array(width_slope)
        return with_error(
            value, np.divide(slopes, width[..., None], out=np.full(slopes.shape, np.nan), where=known[..., None])
        )

    below, middle, above = np.moveaxis(x, -1, 0)
    cp, cp_error = ratio(np.broadcast_to(high - low, above.shape), above - below, (0, 0, 0), (-1, 0, 1))
    upper, upper_error = ratio(high - middle, above - middle, (0, -1, 0), (0, -1, 1))
    lower, lower_error = ratio(middle - low, middle - below, (0, 1, 0), (-1, 1, 0))
    is_upper = np.isnan(lower) | (upper <= lower)
    return Capability(cp, cp_error, np.where(is_upper, upper, lower), np.where(is_upper, upper_error, lower_error))
