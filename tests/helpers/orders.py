"""Orders of convergence, fitted.

Formula: of r(s) = a s^p (1 + b s + ...) the slopes  log(r(s_k) / r(s_k+1)) / log(s_k / s_k+1)  are p + O(s_k), so that,
for sizes in one proportion, the slope extrapolated to size zero has an error of second order in s.
"""

import numpy as np
from numpy.typing import ArrayLike

#: How far a fitted order may be from the whole number that it is.
NEAR = 0.05


def order(sizes: ArrayLike, remainders: ArrayLike) -> np.ndarray:
    """The exponent with which remainders (sizes first) vanish with sizes in one proportion, three or more."""
    s, r = np.asarray(sizes, dtype=float), np.abs(np.asarray(remainders, dtype=float))
    proportion = s[1:] / s[:-1]
    np.testing.assert_allclose(proportion, proportion[0], rtol=1e-12)
    slopes = np.diff(np.log(r), axis=0) / np.log(proportion[0])
    extrapolated: np.ndarray = slopes[-1] + (slopes[-1] - slopes[-2]) * proportion[0] / (1 - proportion[0])
    return extrapolated
