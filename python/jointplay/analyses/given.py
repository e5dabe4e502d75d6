"""`given`: the exact pose for given clearance offsets and deviations.

closure(poses, drives, u) = 0 with u given;  error = output(poses) - output(nominal poses)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.model.gaps import attributes
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, parts, to_dataset
from jointplay.result.verdict import judge

from .nominal import ON_CLOSURE, Nominal, nominal, report, without_singular
from .offsets import Offsets, admissible, parameters
from .recorded import recorded
from .several import of_each, of_outputs

if TYPE_CHECKING:
    import xarray as xr


@typed
def given(
    m: Mechanism,
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    *,
    sizes: str = "middle",
) -> xr.Dataset:
    """Find the pose error for given clearance offsets and deviations.

    Parameters
    ----------
    m : Mechanism
    offsets : mapping, array, DataArray or Dataset
        By source (``{"J1": [0.5, 0]}``: every component of its offset) or by label (``{"J1.x": 0.5}``), in the units of
        the file; a value, or one per configuration. The offset of a pin is that of the second body's pin centre from
        the first's, in ground axes. Or a result that has `offset`, or a certificate of the worst case:
        ``worst.worst_offset.sel(extreme="position")``.
    deviations : mapping, optional
        The same for dimensions, locked angles and drive errors: the whole deviation, in place of the known one of
        the file. They may stand among the offsets as well.
    sizes : {"middle", "largest", "smallest"}
        Which sizes clearances have that scatter: in the middle of their limits, or those with the largest or the
        smallest play. A size that is named (``{"J1.hole": 0.005}``: its difference from the middle) has its own value.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error`, `error_first_order`, `contribution` (per source; they add up to the first-order
        error), `offset` (all parameters), `admissible` (whether the offset of a source lies within its clearance or
        tolerance; an offset outside is used as given), `pose` of every body, `residual` (the largest one of the
        loop closure at this pose, angles at the mechanism's length), `nominal`, `status`.

        Of an over-constrained or elastic mechanism as well: `lack_of_fit` (misfit of the redundant constraints
        with these offsets; rigid bodies with a misfit are ``not_assemblable``), `prestress` and `deformation`
        (elastic ones take up the misfit with the least energy and are ``strained``).

    Raises
    ------
    InputError
        When a name is unknown or an array has the wrong shape.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> jp.given(m, {"J1": [0.5, 0], "J3.x": -1}).error[0].values.round(3)
    array([-0.183,  0.255,  0.12 ])
    """
    return to_dataset(compute(m, offsets, deviations, sizes=sizes))


@recorded
@of_each(lambda _: False)
def compute(
    m: Mechanism,
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    *,
    sizes: str = "middle",
    at: Nominal | None = None,
) -> Result:
    """The light form of `given`."""
    at = (at or nominal(m)).with_errors
    u = parameters(m, len(at), {} if offsets is None else offsets, deviations or {}, sizes)
    # Offsets of another result are nan where it has none.
    unknown = np.isnan(u).sum(axis=1) > 0
    found = without_singular(m.core.given(at.drives, at.poses, np.where(unknown[:, None], m.centre, u)))
    for name in ("error", "error_first_order", "poses", "residual"):
        found[name][unknown] = np.nan
    slopes = m.core.sensitivity(at.drives, at.poses)["source"]
    pose = ("configuration", "component")
    how = "Newton's method" if m.core.isostatic else "Newton's method, redundant members at their least energy"
    builder = report(m, "given", at, obtained=f"{how}, {ON_CLOSURE}", **attributes(m, sizes))
    builder.add("error", pose, found["error"], "error of the output, actual - nominal", "component")
    builder.add("error_first_order", pose, found["error_first_order"], "error to first order", "component")
    builder.add(
        "contribution",
        ("configuration", "source", "component"),
        by_source(m, slopes * u[:, None, :]),
        "part of the source in the first-order error",
        "component",
    )
    builder.add("offset", ("configuration", "parameter"), u, "offset of the parameter", "parameter")
    inside = admissible(m, u)
    builder.add("admissible", ("configuration", "source"), inside, "whether the offset lies within its clearance")
    builder.add(
        "pose",
        ("configuration", "body", "component"),
        poses.components(found["poses"]),
        "pose of the body's axes",
        "component",
    )
    words = "largest residual of the loop closure at this pose, angles at the mechanism's length"
    builder.add("residual", "configuration", m.length * found["residual"], words, "length")
    if not m.core.isostatic:
        words = "reaction to the elastic deformations"
        builder.add("prestress", ("configuration", "joint", "wrench"), found["prestress"], words, "wrench")
        words = "largest misfit of redundant constraints, angles at the mechanism's length"
        builder.add("lack_of_fit", "configuration", found["lack_of_fit"], words, "length")
        if m.core.deformations:
            words = "elastic deformation of the joint"
            builder.add("deformation", ("configuration", "elastic"), found["deformation"], words, "elastic")
    judge(builder)
    builder.status(at.worse(found["status"]))
    return builder.result()


#: what offsets are that nobody gave
OF_WORST = "the largest position error"


def at_worst(m: Mechanism, worst: Result) -> Result:
    """The light form of `given` at the offsets of the largest position error, which it reproduces."""
    if m.outputs:
        own = zip(m.outputs, parts(worst), strict=False)
        return of_outputs(m, [at_worst(m.only(output=name), part) for name, (_, part) in own])
    result = compute(m, worst.get("worst_offset", extreme="position"))
    return replace(result, attrs={**result.attrs, "offsets_of": OF_WORST})


def by_source(m: Mechanism, parts: Floats) -> Floats:
    """Parts of the parameters, (configuration, component, parameter), summed to (configuration, source, component)."""
    owners = m.parameter_source[:, None] == np.arange(len(m.sources))
    summed: Floats = np.einsum("ncp,ps->nsc", parts, owners.astype(float))
    return summed
