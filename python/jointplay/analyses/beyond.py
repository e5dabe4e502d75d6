"""Searches for drive values that begin again beyond the play in which a drive does not act.

Where the load alone decides the offset within a backlash, the errors do not follow the command, and no derivative says
that at either end of the play they would. From the values found, such a drive goes on in growing steps to both sides;
where the errors begin to change the search begins anew, and what it finds counts where it leaves less.
"""

from collections.abc import Callable
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats

from .minimax import PROBE, LeastLargest, PlaceIndices, SeveralErrors, slopes

#: the first step and the last, each twice the one before (radians, characteristic lengths)
STEPS = PROBE * 2.0 ** np.arange(1, 16)

#: drive values for which the errors of some configurations are least, from those at which it begins
SearchFrom = Callable[[Floats, PlaceIndices], LeastLargest]


def beyond_play(
    search: SearchFrom,
    errors: SeveralErrors,
    found: LeastLargest,
    unit: Floats,
    ranges: Floats,
    rounding: Floats,
    gain: float,
) -> NDArray[np.bool_]:
    """Improve what was found, and say which drives are inside their play there, (place, drive).

    Parameters
    ----------
    rounding, gain : ndarray, float
        Changes of errors that are none, by component; by how much what is left has to become less.
    """
    inside = np.zeros(found.drives.shape, dtype=bool)
    active = np.flatnonzero(np.isfinite(found.largest) & (found.largest > gain))
    # Each round brings one drive to an end of its play.
    for _ in unit:
        if not len(active):
            break
        inside[active], rows, starts = _starts(errors, found, active, unit, ranges, rounding)
        better = []
        if len(rows):
            again = search(starts, rows)
            for n in np.argsort(again.largest, kind="stable"):
                k = rows[n]
                if k not in better and again.largest[n] < found.largest[k] - gain:
                    better.append(k)
                    for name in (each.name for each in fields(found)):
                        more = found.iterations[k] if name == "iterations" else 0
                        getattr(found, name)[k] = getattr(again, name)[n] + more
        active = np.array(sorted(better), dtype=np.intp)
    if len(active):
        inside[active] = _starts(errors, found, active, unit, ranges, rounding)[0]
    return inside


def _starts(
    errors: SeveralErrors, found: LeastLargest, active: PlaceIndices, unit: Floats, ranges: Floats, rounding: Floats
) -> tuple[NDArray[np.bool_], PlaceIndices, Floats]:
    """Which drives are inside their play at some configurations, and where searches begin: the places, the drives."""
    here = found.drives[active]
    still = does_not_act(slopes(errors, here, active, unit), unit, rounding)
    # Where a search did not settle it may be at the very end of a play.
    row, drive = np.nonzero(still | ~found.settled[active, None])
    inside = np.zeros_like(still)
    if not len(row):
        return inside, active[:0], here[:0]
    shifts = np.concatenate([STEPS, -STEPS])[:, None] * np.eye(len(unit))[drive][:, None] * unit
    trial = np.concatenate([here[row][:, None], here[row][:, None] + shifts], axis=1)
    within = ((ranges[0] <= trial) & (trial <= ranges[1])).all(axis=2)
    flat = np.clip(trial, *ranges).reshape(-1, len(unit))
    values = errors(flat, np.repeat(active[row], trial.shape[1]))[0]
    values = values.reshape(*trial.shape[:2], -1, len(rounding))
    rows, starts = [], []
    for n, (r, d) in enumerate(zip(row.tolist(), drive.tolist(), strict=True)):
        for side in (range(1, len(STEPS) + 1), range(len(STEPS) + 1, 2 * len(STEPS) + 1)):
            last, flat_before = 0, bool(still[r, d])
            for k in side:
                if not within[n, k] or not np.isfinite(values[n, k]).all():
                    break
                if (np.abs(values[n, k] - values[n, last]) <= rounding).all():
                    flat_before = True
                elif flat_before:
                    rows.append(active[r])
                    starts.append(trial[n, k])
                    inside[r, d] = still[r, d]
                    break
                last = k
    return inside, np.array(rows, dtype=np.intp), np.array(starts).reshape(-1, len(unit))


def does_not_act(slope: Floats, unit: Floats, rounding: Floats) -> NDArray[np.bool_]:
    """Which drives change no error, (place, drive), by derivatives of differences over a probe."""
    changes = np.abs(slope) * (2.0 * PROBE * unit) <= rounding[:, None]
    return np.asarray(changes.reshape(len(slope), -1, len(unit)).all(axis=1))
