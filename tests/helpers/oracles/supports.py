"""Support functions of all sets, vectorised over directions.

journal, sleeve   r (|R+| + |R-|) + a |W_along|,  R+- = half of (W_side, W_normal) +- the couple over the half length
ball              r |W|
guide             max over rolls r of |M_roll| r + (c - a r) max(|W_side|, |M_normal| / h) + (c - b r) max(...)
plate             c max(|W|, |M_side| / a, |M_normal| / b)
interval          max(low W, high W)
disc              r |W|
diamond           c max(|W|, |M| / half length)
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def support(spec: dict[str, Any], w: Array) -> Array:
    """The largest <w, u> over the parameters u that all sources allow; w is [direction, parameter]."""
    total, at = np.zeros(len(w)), 0
    for source in spec["sources"]:
        ((kind, size),) = source["set"].items()
        part = w[:, at : at + len(source["centre"])].T
        at += len(part)
        total += part.T @ np.array(source["centre"]) + SUPPORTS[kind](part, size)
    assert at == w.shape[1]
    return total


def _pin(side: Array, normal: Array, tilt_side: Array, tilt_normal: Array, size: dict[str, float]) -> Array:
    h = size["half_length"]
    # The ends move by side +- h tilt_normal and normal -+ h tilt_side.
    ends = [np.hypot(side + sign * tilt_normal / h, normal - sign * tilt_side / h) for sign in (1.0, -1.0)]
    return np.asarray(0.5 * size["radius"] * (ends[0] + ends[1]))


def _journal(w: Array, size: dict[str, float]) -> Array:
    return _pin(w[1], w[2], w[3], w[4], size) + size["axial"] * np.abs(w[0])


def _sleeve(w: Array, size: dict[str, float]) -> Array:
    return _pin(w[0], w[1], w[2], w[3], size)


def _ball(w: Array, size: dict[str, float]) -> Array:
    return np.asarray(size["radius"] * np.linalg.norm(w, axis=0))


def _guide(w: Array, size: dict[str, float]) -> Array:
    side, normal, roll, tilt_side, tilt_normal = np.abs(w)
    # What a roll r leaves of the gap is shared by shift and tilt, between either pair of faces. The work is linear in
    # r, so that it is largest without any, or where one pair has no gap left.
    across = np.maximum(side, tilt_normal / size["half_length"])
    upright = np.maximum(normal, tilt_side / size["half_length"])
    c, a, b = size["gap"], size["half_height"], size["half_width"]
    rolls = (0.0, min(c / a, c / b))
    work = [roll * r + across * (c - a * r) + upright * (c - b * r) for r in rolls]
    return np.asarray(np.max(work, axis=0))


def _plate(w: Array, size: dict[str, float]) -> Array:
    parts = [np.abs(w[0]), np.abs(w[1]) / size["half_normal"], np.abs(w[2]) / size["half_side"]]
    return np.asarray(size["gap"] * np.max(parts, axis=0))


def _interval(w: Array, size: dict[str, float]) -> Array:
    return np.maximum(w[0] * size["low"], w[0] * size["high"])


def _diamond(w: Array, size: dict[str, float]) -> Array:
    return np.asarray(size["gap"] * np.maximum(np.abs(w[0]), np.abs(w[1]) / size["half_length"]))


SUPPORTS = {"journal": _journal, "sleeve": _sleeve, "ball": _ball, "guide": _guide, "plate": _plate}
SUPPORTS |= {"interval": _interval, "disc": _ball, "diamond": _diamond}
