"""Where the machine can be."""

from __future__ import annotations

import numpy as np

from .structure import Array

#: outcomes of places where the machine cannot stand
OUT_OF_REACH = ("other_branch", "outside_limits")


def counted(status: Array) -> Array:
    """Which outcomes count: those of places where the machine can stand, whatever comes of it there.

    Examples
    --------
    >>> counted(np.array(["ok", "other_branch", "singular"])).tolist()
    [True, False, True]
    """
    return np.asarray(~np.isin(status, OUT_OF_REACH))
