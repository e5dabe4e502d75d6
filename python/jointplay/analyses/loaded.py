"""`loaded`: where the load pushes every joint.

Each joint's offset lies where its clearance supports the reaction it transmits; the pose is the one of largest work of
the loads over all admissible offsets.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointplay.errors import InputError
from jointplay.model import Mechanism
from jointplay.result import Result, to_dataset

from .nominal import Nominal, nominal, report

if TYPE_CHECKING:
    import xarray as xr


def loaded(m: Mechanism, *, exact: bool = True) -> xr.Dataset:
    """Find the error that the loads cause by taking up the clearances.

    Parameters
    ----------
    m : Mechanism
        With loads or gravity.
    exact : bool
        Whether the closure is solved again with contact and reactions in agreement. If not, everything is told to
        first order at the nominal pose, several times faster: `error` then is `error_first_order`, and reactions are
        the nominal ones.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error`, `error_first_order`, `undetermined` (half-width of what the load does not
        decide), `undetermined_contribution` (per source), `decided` (whether the load decides where a clearance goes),
        `reaction` (force and moment on the second body of every joint, at the joint, ground axes), `offset`
        (where every clearance is), `contribution` (per source; they add up to the first-order error), `iterations`
        (until contact and reactions agreed), `nominal`, `status`.

    Raises
    ------
    InputError
        When nothing loads the mechanism.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.loaded(jp.loads(jp.examples.text("four-bar")))
    >>> result.error.sel(component=["x", "y"])[0].values.round(4)
    array([ 0.9505, -3.1031])
    """
    return to_dataset(compute(m, exact=exact))


def compute(m: Mechanism, *, exact: bool = True, at: Nominal | None = None) -> Result:
    """The light form of `loaded`."""
    require_loads(m)
    at = at or nominal(m)
    found = m.core.loaded(at.drives, at.poses, exact)
    pose = ("configuration", "component")
    builder = report(m, "loaded", at)
    words = "error of the output, actual - nominal" + ("" if exact else ", to first order")
    builder.add("error", pose, found["error"], words, "component")
    builder.add("error_first_order", pose, found["error_first_order"], "error to first order", "component")
    builder.add("undetermined", pose, found["undetermined"], "half-width of what the load leaves open", "component")
    builder.add(
        "undetermined_contribution",
        ("configuration", "source", "component"),
        found["undetermined_contribution"],
        "part of the source in what the load leaves open",
        "component",
    )
    words = "whether the load decides where the clearance goes"
    builder.add("decided", ("configuration", "source"), found["decided"], words)
    builder.add(
        "reaction",
        ("configuration", "joint", "wrench"),
        found["reaction"],
        "force and moment on the second body of the joint",
        "wrench",
    )
    builder.add("offset", ("configuration", "parameter"), found["offset"], "offset of the parameter", "parameter")
    builder.add(
        "contribution",
        ("configuration", "source", "component"),
        found["contribution"],
        "part of the source in the first-order error",
        "component",
    )
    builder.add("iterations", "configuration", found["iterations"].astype(np.int64), "steps until contact was settled")
    builder.status(at.worse(found["status"]))
    return builder.result()


def require_loads(m: Mechanism) -> None:
    """Refuse a mechanism without loads."""
    if not m.has_loads:
        problem = "nothing loads the mechanism: add [[loads]] with a force or a moment, or gravity and masses"
        raise InputError(problem, file=m.file, key="loads")
