"""Confidence intervals of shares, and the standard errors of quantiles.

Clopper and Pearson (1934), exact for k of n independent specimens, alpha = 1 - level:

    low = B(alpha / 2; k, n - k + 1),   high = B(1 - alpha / 2; k + 1, n - k)

with B the quantile of the beta distribution; low = 0 for k = 0, high = 1 for k = n. Of independent replicates with the
shares p_1 ... p_R, by Student's t: mean +- t(1 - alpha / 2; R - 1) s / sqrt(R).
"""

import functools
import math

import numpy as np

from jointplay.basics.arrays import Floats

#: how sure an interval is
LEVEL = 0.95
#: specimens on the rarer side below which replicates say too little of their own scatter
FEW = 30
#: beyond so many on the rarer side the score interval is the same to seven digits
MANY = 10_000_000
#: bound of the continued fraction; it takes some sqrt(MANY)
TERMS = 20_000
STEPS = 200
SMALL = 1e-300
PRECISION = 1e-13


def of_counts(counts: Floats, samples: Floats, level: float = LEVEL) -> tuple[Floats, Floats]:
    """Lowest and highest share that so many of the specimens are consistent with; nan where a count is nan.

    Examples
    --------
    >>> low, high = of_counts(np.array([0.0, 4.0]), np.array([100.0, 100.0]))
    >>> low.round(4).tolist(), high.round(4).tolist()
    ([0.0, 0.011], [0.0362, 0.0993])
    """
    counts, samples = np.broadcast_arrays(counts, samples)
    ends = [
        (math.nan, math.nan) if math.isnan(k) or n < 1.0 else _clopper_pearson(round(k), round(n), level)
        for k, n in zip(counts.ravel().tolist(), samples.ravel().tolist(), strict=True)
    ]
    low, high = np.array(ends).reshape(-1, 2).T
    return low.reshape(counts.shape), high.reshape(counts.shape)


def of_errors(
    mean: Floats, errors: Floats, replicates: int, total: Floats, level: float = LEVEL
) -> tuple[Floats, Floats]:
    """Intervals of shares from the share in all specimens of some replicates, and its standard error by them.

    Examples
    --------
    >>> low, high = of_errors(np.array([0.1, 0.0]), np.array([0.001, 0.0]), 16, np.array([16000.0, 16000.0]))
    >>> low.round(5), high.round(5)
    (array([0.09787, 0.     ]), array([0.10213, 0.00023]))
    """
    half = student(replicates - 1, level) * errors
    low, high = np.clip(mean - half, 0.0, 1.0), np.clip(mean + half, 0.0, 1.0)
    rare = (np.minimum(mean, 1.0 - mean) * total < FEW) | (half == 0.0)
    from_counts = of_counts(np.where(rare, mean * total, np.nan), total, level)
    return np.where(rare, np.minimum(low, from_counts[0]), low), np.where(rare, np.maximum(high, from_counts[1]), high)


@functools.lru_cache(64)
def student(freedom: int, level: float = LEVEL) -> float:
    """Half-width of the interval about zero that Student's t lies within.

    Examples
    --------
    >>> round(student(15), 3)
    2.131
    """
    x = _quantile(1.0 - level, 0.5 * freedom, 0.5)
    return math.sqrt(freedom * (1.0 - x) / x)


@functools.lru_cache(65_536)
def _clopper_pearson(k: int, n: int, level: float) -> tuple[float, float]:
    tail = 0.5 * (1.0 - level)
    if min(k, n - k) > MANY:
        return _score(k, n, level)
    low = 0.0 if k == 0 else _quantile(tail, k, n - k + 1)
    high = 1.0 if k == n else _quantile(1.0 - tail, k + 1, n - k)
    return low, high


def _score(k: int, n: int, level: float) -> tuple[float, float]:
    """Wilson's interval."""
    z = student(10**9, level)
    middle = (k + 0.5 * z * z) / (n + z * z)
    half = z * math.sqrt(k * (n - k) / n + 0.25 * z * z) / (n + z * z)
    return middle - half, middle + half


def _quantile(share: float, a: float, b: float) -> float:
    """The x below which the beta distribution has a share: Newton's method between bounds that it halves."""
    low, high, x = 0.0, 1.0, a / (a + b)
    scale = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    for _ in range(STEPS):
        excess = _share_below(x, a, b) - share
        low, high = (low, x) if excess > 0.0 else (x, high)
        density = math.exp(scale + (a - 1.0) * math.log(x) + (b - 1.0) * math.log1p(-x))
        step = excess / density if density > 0.0 else math.inf
        following = x - step
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - x) <= PRECISION * x or following in (0.0, 1.0):
            return following
        x = following
    return x


def _share_below(x: float, a: float, b: float) -> float:
    """The regularised incomplete beta function I_x(a, b), by the fraction of the side on which it converges."""
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _lower(1.0 - x, math.log(x), b, a)
    return _lower(x, math.log1p(-x), a, b)


def _lower(x: float, log_rest: float, a: float, b: float) -> float:
    """I_x(a, b) by Lentz's method; DLMF 8.17.22. `log_rest` is the logarithm of 1 - x."""
    if x <= 0.0:
        return 0.0
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * log_rest)

    def safe(value: float) -> float:
        return value if abs(value) > SMALL else SMALL

    c, d = 1.0, 1.0 / safe(1.0 - (a + b) * x / (a + 1.0))
    fraction = d
    for m in range(1, TERMS):
        change = 1.0
        for term in (
            m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0)),
        ):
            d, c = 1.0 / safe(1.0 + term * d), safe(1.0 + term / c)
            change = c * d
            fraction *= change
        if abs(change - 1.0) < PRECISION:
            break
    return front * fraction / a
