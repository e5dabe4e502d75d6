"""The verdict on a structural error: whether it keeps to the tolerance of its target."""

import numpy as np

from jointplay.result import Result, first_largest

from .outcome import HELD, MISSED, NOT_SHOWN, Rows, Verdict
from .words import shown, there


def of_tolerance(result: Result) -> Verdict:
    """The verdict on a result of `structural`; none where the target has no tolerance, or asks for nothing."""
    error, tolerance = result.get("structural_error"), float(result.get("tolerance"))
    if not np.isfinite(tolerance):
        return Verdict()
    unit = result.unit("structural_error")
    rows = Rows.of(result)
    known = rows.known & np.isfinite(error)
    if not known.any():
        return Verdict(
            (f"Not shown: whether the tolerance of the target holds; {rows.why() or 'nothing is asked'}.",),
            (),
            NOT_SHOWN,
        )
    at = int(first_largest(np.where(known, error, -np.inf)))
    value, least = (shown(result, one, unit) for one in (float(error[at]), tolerance))
    far = f"structural error {value} of {least}{there(result, at)}"
    marks = tuple("structural" if k else "" for k in known & (error > tolerance))
    used = float(error[at]) / tolerance
    if used > 1.0:
        sentence = f"Tolerance of the target missed without play: {far}{rows.left_out()}."
        return Verdict((sentence,), marks, MISSED, alarms=1, used=used, gist=far)
    if not rows.are_all_known:
        sentence = f"Not shown: whether the tolerance of the target holds; {rows.why()}; elsewhere {far}."
        return Verdict((sentence,), marks, NOT_SHOWN, used=used, gist=rows.why())
    return Verdict(
        (f"The tolerance of the target holds without play: {far}{rows.left_out()}.",), marks, HELD, used=used
    )
