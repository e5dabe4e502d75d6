"""Configurations that cannot be assembled: where they stay open, and what would close them."""

from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import Attempt, attempt, is_tree, sentences


@dataclass(frozen=True)
class Failure:
    """What is known of configurations that cannot be assembled."""

    #: the nearest attempt
    found: Attempt
    #: one sentence each; a start is several lines, to be pasted into the file
    words: tuple[str, ...]
    #: the first configuration that cannot be assembled
    first: int


def failure(m: Mechanism, drives: Floats | None = None, placed: Floats | None = None) -> Failure | None:
    """Look at the nominal configurations that cannot be assembled; None where there are none or nothing is known.

    Parameters
    ----------
    drives, placed : ndarray, optional
        Values of the drives and poses, SI; solved if left out.
    """
    if drives is None or placed is None:
        if is_tree(m):
            # Whatever the drives say, an open chain can follow; a long one takes its time.
            return None
        drives = m.start_drives[None] if m.drive_values is None else m.drive_values
        placed = m.core.trace(np.ascontiguousarray(drives))["poses"]
    missing = np.flatnonzero(~np.isfinite(placed).all(axis=(1, 2))).tolist()
    found = attempt(m, drives, placed) if missing else None
    return None if found is None else Failure(found, tuple(sentences(m, found, missing, len(drives))), missing[0])
