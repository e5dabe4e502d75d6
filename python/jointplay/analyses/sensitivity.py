"""`sensitivity`: derivatives of the output's pose with respect to everything that is given, as matrices.

    d pose = parameter_jacobian d u + drive_jacobian d q + load_jacobian d f + compliance d w

with a wrench w at the output, at the nominal pose as the loads deform it. Every clearance is held: a load moves what is
elastic only. The pose of elastic mechanisms is that of equilibrium, so that forces that turn with the bodies count in
all of these.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointplay.basics.typed import typed
from jointplay.core.answers import Jacobians
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, to_dataset

from .nominal import Nominal, batched, finished, nominal, report, without_singular
from .recorded import recorded
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr


@typed
def sensitivity(m: Mechanism) -> xr.Dataset:
    """Find the derivatives of the output's pose with respect to parameters, drives and loads.

    They are exact, at the nominal pose as the loads deform it: of a rigid mechanism that is the nominal pose. All
    clearances are held; where redundant members are rigid, those of other joints give way as in `given`. A turn is the
    rotation vector from there.

    Parameters
    ----------
    m : Mechanism

    Returns
    -------
    xarray.Dataset
        Over `configuration` and `component`, in units of the file: `parameter_jacobian` (per component of every source:
        offsets, deviations of dimensions, links, positions, angles and drives), `drive_jacobian` (per drive value),
        `load_jacobian` (per force and moment of every load, in its axes; loads by their key in the file), `compliance`
        (per force and moment at the output) and `deflection` (the displacement by which the pose of the derivatives
        differs from the nominal one). Over `configuration` and `parameter`: `defined` (whether something can give way
        to the parameter; if not, its derivative is nan). `nominal`, `status`.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> jp.sensitivity(m).drive_jacobian.sel(component=["x", "y"])[0, :, 0].values.round(3)  # mm per degree
    array([-0.732,  1.024])
    """
    return to_dataset(compute(m))


@recorded
@of_each(lambda _: True)
def compute(m: Mechanism, *, at: Nominal | None = None) -> Result:
    """The light form of `sensitivity`."""
    at = (at or nominal(m)).with_errors
    drives, poses = at.drives, at.poses

    def jacobians(part: slice) -> Jacobians:
        own = m.running_under(part.start, drives[part], poses[part]) if m.loads.vary else m
        return own.core.jacobians(drives[part], poses[part])

    found, done = batched(len(at), 1 if m.loads.vary else len(at), jacobians, None)
    found, at = without_singular(found), at.first(done)
    builder = report(m, "sensitivity", at, obtained="derivatives of the equations of closure and equilibrium")
    each = ("configuration", "component")
    words = "displacement of the output per unit of the parameter"
    builder.add("parameter_jacobian", (*each, "parameter"), found["parameter"], words, "component", per="parameter")
    words = "whether something can give way to the parameter, so that its derivative exists"
    builder.add("defined", ("configuration", "parameter"), found["defined"], words)
    words = "displacement of the output per unit of the drive"
    builder.add("drive_jacobian", (*each, "drive"), found["drive"], words, "component", per="drive")
    keys = _keys_of_loads(m)
    if keys:
        builder.labels("acting_load", keys, "load by its key in the file")
        words = "displacement of the output per force and moment of the load, clearances held"
        own = found["load"][:, :, : len(keys)]
        builder.add("load_jacobian", (*each, "acting_load", "wrench"), own, words, "component", per="wrench")
    words = "displacement of the output per force and moment on it, clearances held"
    builder.add("compliance", (*each, "wrench"), found["compliance"], words, "component", per="wrench")
    words = "displacement of the output from nominal at the pose of the derivatives, by what the loads deform"
    builder.add("deflection", each, found["error"], words, "component")
    builder.status(at.worse(found["status"]))
    return finished(builder, done, len(drives))


def _keys_of_loads(m: Mechanism) -> tuple[str, ...]:
    """Loads of every case, then those of the own case; weights have none."""
    common = len(m.raw.get("loads", ()))
    own = len(m.raw["load_cases"][m.of[1]]) if m.of[1] else 0
    return (*(f"loads.{k}" for k in range(common)), *(f"load_cases.{m.of[1]}.{k}" for k in range(own)))
