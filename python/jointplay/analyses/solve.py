"""`solve`: the nominal mechanism, its drives and how near it is to a singularity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics import poses
from jointplay.basics.typed import typed
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import examine
from jointplay.result import Result, Variable, to_dataset

from .failure import failure
from .nominal import Nominal, nominal, report
from .ranges import coordinates
from .recorded import recorded
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr


@typed
def solve(m: Mechanism) -> xr.Dataset:
    """Solve the nominal mechanism for every configuration.

    Parameters
    ----------
    m : Mechanism
        With drive values or a path of the output.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `nominal` (pose of the output), `pose` (of every body), `coordinate` (of every joint:
        angle or distance along the guide), `singular_value` (smallest singular value of the Jacobian with lengths
        divided by the characteristic one) and `singular_motion` (the motion of the bodies that belongs to it; its
        largest part is one radian or one characteristic length), `status`; with a path `target` and `mismatch`
        (nominal - target), with ranges of joints or drives `leaves_range` (which of them leaves its range). Where
        `nominal` is nan, the configuration has no pose, and `status` says why. Where drive values cannot be assembled,
        the attribute `failure` says in sentences which loop stays open, at which joint and by how much, and what would
        close it.

    Raises
    ------
    InputError
        When the mechanism has too few or too many drives.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> result = jp.solve(m)
    >>> result.nominal.sel(component=["x", "y"])[0].values.round(2)
    array([22.02, 87.25])
    >>> apart = jp.solve(m.with_({"joints.J3.on.coupler": [10, 0]}))
    >>> apart.nominal[0].values, str(apart.status[0].item())
    (array([nan, nan, nan]), 'not_assembled')
    >>> print(apart.attrs["failure"].splitlines()[0])
    Configurations 0 to 4, 10 (of 0 to 10) cannot be assembled.
    """
    return to_dataset(compute(m))


@recorded
@of_each(lambda _: False)
def compute(m: Mechanism, *, at: Nominal | None = None) -> Result:
    """The light form of `solve`; at configurations that are solved already, without the targets of a path."""
    on_path = at is None and m.targets is not None
    asked = at is None
    at = at or nominal(m)
    near = m.core.measure(at.drives, at.poses)
    mobility = examine(m)
    builder = report(m, "solve", at, degrees_of_freedom=mobility.degrees_of_freedom)
    builder.add(
        "pose",
        ("configuration", "body", "component"),
        poses.components(at.poses),
        "pose of the body's axes",
        "component",
    )
    values, angular = coordinates(m, at.drives, at.poses)
    scale = np.where(angular, m.units.angle, m.units.length)
    builder.add("coordinate", ("configuration", "joint"), values / scale, "coordinate of the joint")
    units = np.where(angular, m.units.angle_name, m.units.length_name)
    builder.coords["joint_unit"] = Variable(("joint",), units, "", "unit of the joint's coordinate")
    words = "smallest singular value of the scaled Jacobian"
    builder.add("singular_value", "configuration", near["singular_value"], words)
    builder.add(
        "singular_motion",
        ("configuration", "body", "component"),
        near["singular_motion"],
        "motion that belongs to the smallest singular value",
        "component",
    )
    if on_path:
        assert m.targets is not None
        pose = ("configuration", "component")
        builder.add("target", pose, m.targets, "pose asked of the output", "component")
        mismatch = poses.difference(at.output, m.targets)
        builder.add("mismatch", pose, mismatch, "nominal pose - target", "component")
    builder.status(at.status)
    failed = failure(m, at.drives, at.poses) if asked and not on_path else None
    if failed is not None:
        builder.attrs["failure"] = "\n".join(failed.words)
    return builder.result()
