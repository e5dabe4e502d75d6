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
    values[:, 1:][~within[:, 1:]] = np.nan
    rows, starts = [], []
    for n, (r, d) in enumerate(zip(row, drive, strict=True)):
        for side in np.arange(1, trial.shape[1]).reshape(2, -1):
            way = [0, *side]
            end = _end_of_play(values[n, way], rounding, still[r, d])
            if end is not None:
                rows.append(active[r])
                starts.append(trial[n, way[end]])
                inside[r, d] = still[r, d]
    return inside, np.array(rows, dtype=np.intp), np.array(starts).reshape(-1, len(unit))


def _end_of_play(values: Floats, rounding: Floats, is_flat: bool) -> int | None:
    """Which of the values, step by step, is the first that changes after some that did not; None where none does."""
    for k in range(1, len(values)):
        if not np.isfinite(values[k]).all():
            return None
        if (np.abs(values[k] - values[k - 1]) <= rounding).all():
            is_flat = True
        elif is_flat:
            return k
    return None


def does_not_act(slope: Floats, unit: Floats, rounding: Floats) -> NDArray[np.bool_]:
    """Which drives change no error, (place, drive), by derivatives of differences over a probe."""
    changes = np.abs(slope) * (2.0 * PROBE * unit) <= rounding[:, None]
    return np.asarray(changes.reshape(len(slope), -1, len(unit)).all(axis=1))
