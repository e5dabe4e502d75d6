"""Which configurations count: those where the machine can stand."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: outcomes of configurations that the machine cannot reach
UNREACHABLE = ("other_branch", "outside_limits")


def counted(status: ArrayLike) -> NDArray[np.bool_]:
    """Whether the machine can stand at each configuration, by its status.

    One that lies behind a singular pose, or for which a drive or a joint would leave its range, counts in no verdict
    and no headline. One whose status is something else but ``ok`` does: the machine is asked to be there.

    Examples
    --------
    >>> counted(["ok", "other_branch", "not_assembled"]).tolist()
    [True, False, True]
    """
    return np.isin(np.asarray(status), UNREACHABLE, invert=True)
