"""`solve`: the nominal mechanism, its drives and how near it is to a singularity."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointplay.mobility import examine
from jointplay.model import Mechanism
from jointplay.result import Result, Variable, to_dataset

from .nominal import Floats, Nominal, nominal, report

if TYPE_CHECKING:
    import xarray as xr


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
        (nominal - target), with ranges of joints or drives `within_limits`.

    Raises
    ------
    InputError
        When the mechanism has too few or too many drives, or is over-constrained.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.solve(jp.loads(jp.examples.text("four-bar")))
    >>> result.nominal.sel(component=["x", "y"])[0].values.round(2)
    array([22.02, 87.25])
    """
    return to_dataset(compute(m))


def compute(m: Mechanism, *, at: Nominal | None = None) -> Result:
    """The light form of `solve`; at configurations that are solved already, without the targets of a path."""
    on_path = at is None and m.targets is not None
    at = at or nominal(m)
    mobility = examine(m)
    builder = report(m, "solve", at, degrees_of_freedom=mobility.degrees_of_freedom)
    builder.add("pose", ("configuration", "body", "component"), at.poses, "pose of the body's axes", "component")
    values, angular = coordinates(m, at)
    scale = np.where(angular, m.units.angle, m.units.length)
    builder.add("coordinate", ("configuration", "joint"), values / scale, "coordinate of the joint")
    units = np.where(angular, m.units.angle_name, m.units.length_name)
    builder.coords["joint_unit"] = Variable(("joint",), units, "", "unit of the joint's coordinate")
    builder.add("singular_value", "configuration", at.singular_value, "smallest singular value of the scaled Jacobian")
    builder.add(
        "singular_motion",
        ("configuration", "body", "component"),
        at.singular_motion,
        "motion that belongs to the smallest singular value",
        "component",
    )
    if on_path:
        assert m.targets is not None
        pose = ("configuration", "component")
        builder.add("target", pose, m.targets, "pose asked of the output", "component")
        builder.add("mismatch", pose, at.output - m.targets, "nominal pose - target", "component")
    if m.limits.joints or m.limits.drives:
        within = within_limits(m, at, values)
        builder.add("within_limits", "configuration", within, "whether joints and drives keep to their ranges")
    builder.status(at.status)
    return builder.result()


def coordinates(m: Mechanism, at: Nominal) -> tuple[Floats, NDArray[np.bool_]]:
    """The coordinate of every joint, SI, (configuration, joint), nan for fixed joints; and whether it is an angle."""
    spec = m.core_spec
    ground = np.zeros((len(at), 1, 3))
    poses = np.concatenate([at.poses, ground], axis=1)  # the ground has index -1

    def place(index: int) -> tuple[Floats, Floats]:
        point = spec["points"][index]
        x, y, angle = np.moveaxis(poses[:, point["body"]], -1, 0)
        u, v = point["at"][:2]
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([x + c * u - s * v, y + s * u + c * v], axis=-1), angle

    values = np.full((len(at), len(m.joints)), math.nan)
    angular = np.array([kind in ("revolute", "fixed") for kind in m.joint_kinds])
    for k, (joint, kind) in enumerate(zip(spec["joints"], m.joint_kinds, strict=True)):
        (first, angle), (second, angle_second) = place(joint["first"]), place(joint["second"])
        if kind == "revolute":
            values[:, k] = angle_second - angle
        elif kind != "fixed":
            along = angle + math.atan2(joint["axis_first"][1], joint["axis_first"][0])
            values[:, k] = np.einsum("nc,nc->n", second - first, np.stack([np.cos(along), np.sin(along)], axis=-1))
    return values, angular


def within_limits(m: Mechanism, at: Nominal, values: Floats) -> NDArray[np.bool_]:
    """Whether every joint and drive keeps to its range; a configuration that is not assembled does not."""
    pairs = [(at.drives[:, m.drives.index(name)], span) for name, span in m.limits.drives.items()]
    pairs += [(values[:, m.joints.index(name)], span) for name, span in m.limits.joints.items()]
    within = np.ones(len(at), dtype=bool)
    for value, (low, high) in pairs:
        slack = 1e-9 * max(abs(low), abs(high), m.length)
        within &= (value >= low - slack) & (value <= high + slack)
    return within
