"""`structural`: how far the nominal mechanism, without any play, is from what its output ought to do.

structural error = |nominal - ideal|        see `ideal`
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, to_dataset

from .ideal import compared, strays
from .nominal import OK, Nominal, nominal, report
from .recorded import recorded
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr


@typed
def structural(m: Mechanism) -> xr.Dataset:
    """Find how far the nominal mechanism is from its target.

    Parameters
    ----------
    m : Mechanism
        With a ``[target]``.

    Returns
    -------
    xarray.Dataset
        Over `configuration`, in units of the file: `structural_error` (size of nominal less ideal; nan where the target
        asks for nothing), `structural_deviation` (its components in ground axes, of a target of the output's pose),
        `tolerance` (that of the file; nan without one), `nominal`, `status`. The attribute `fitted` says which line,
        circle or constant fits best: the one with the least largest distance.

    Raises
    ------
    InputError
        When the file has no target, or its expression has no value somewhere.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar")).with_(target={"line": {"fit": True}})
    >>> jp.structural(m).structural_error.max().item()  # doctest: +ELLIPSIS
    1.92...
    """
    return to_dataset(compute(m))


def check(m: Mechanism) -> None:
    """Refuse a mechanism without a target."""
    if m.ideal is None:
        problem = (
            "the file does not say what the output ought to do: [target] with points, line, circle, function or dwell"
        )
        raise InputError(problem, file=m.file, key="target")


@recorded
@of_each(lambda _: False, check)
def compute(m: Mechanism, *, at: Nominal | None = None) -> Result:
    """The light form of `structural`."""
    at = at or nominal(m)
    if m.ideal is not None and m.ideal.is_of_path and not at.is_path:
        problem = (
            "compares a path as a whole, which the nodes of a grid are not: give the line, the circle or the value that"
            " is meant, or points with timed = false"
        )
        raise InputError(problem, file=m.file, key=f"target.{m.ideal.kind}")
    off = strays(m, at.drives, at.poses, at.output, at.status == OK)
    assert off is not None
    assert m.ideal is not None
    builder = report(m, "structural", at, target=m.ideal.kind)
    if off.fitted:
        builder.attrs["fitted"] = off.fitted
    of, kind = compared(m)
    if of:
        builder.attrs["of"] = of
    words = "structural error"
    builder.add("structural_error", "configuration", off.size, words, kind)
    allowed = np.array(m.ideal.tolerance if np.isfinite(m.ideal.tolerance) else np.nan)
    builder.add("tolerance", (), allowed, "largest acceptable structural error", kind)
    builder.status(at.status)
    return builder.result()
