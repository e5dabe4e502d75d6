"""`check`: what a mechanism is made of, how it can move, and whether it goes together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointplay import poses
from jointplay.mobility import examine
from jointplay.model import Mechanism
from jointplay.result import Builder, Result, Variable, axes_of, to_dataset

from .nominal import Floats

if TYPE_CHECKING:
    import xarray as xr


#: which numbers of a set bound a displacement
SIZES = ("radius", "axial", "gap")


def check(m: Mechanism) -> xr.Dataset:
    """Examine a mechanism without asking for its error.

    Parameters
    ----------
    m : Mechanism
        Any, also with too few or too many drives.

    Returns
    -------
    xarray.Dataset
        `joint_kind`, `first_body` and `second_body` over `joint`, `guess` (where the file says the bodies are) over
        `body`, `size` over `source`, `driven_joint` over `drive`. Attributes: `degrees_of_freedom`, `mobility` (a
        sentence), `determinate` (whether the drives decide every pose just once), `assembled` (whether the joints go
        together near the start), as 0 or 1.

    Examples
    --------
    >>> import jointplay as jp
    >>> jp.check(jp.loads(jp.examples.text("five-bar"))).attrs["mobility"]
    '2 degrees of freedom, 2 drives'
    """
    return to_dataset(compute(m))


def compute(m: Mechanism) -> Result:
    """The light form of `check`."""
    mobility = examine(m)
    builder = Builder(
        m,
        "check",
        degrees_of_freedom=mobility.degrees_of_freedom,
        mobility=mobility.words,
        determinate=int(mobility.is_determinate),
        assembled=int(mobility.assembled),
    )
    spec = m.core_spec
    names = ("ground", *m.bodies)
    ends = [[names[spec["points"][joint[end]]["body"] + 1] for joint in spec["joints"]] for end in ("first", "second")]
    builder.add("joint_kind", "joint", np.array(m.joint_kinds, dtype=str), "type of the joint")
    builder.add("first_body", "joint", np.array(ends[0], dtype=str), "body that carries the joint")
    builder.add("second_body", "joint", np.array(ends[1], dtype=str), "body that rides on it")
    guess = poses.components(np.array(spec["guess"]).reshape(len(m.bodies), -1))
    builder.add("guess", ("body", "component"), guess, "pose of the body at the start", "component")
    driven = np.array([m.joints[joint] for joint in m.drive_joints], dtype=str)
    builder.add("driven_joint", "drive", driven, "joint that the drive commands")
    if m.sources:
        sizes, units = _sizes(m)
        builder.add("size", "source", sizes, "largest offset: radius, gap or larger tolerance")
        builder.coords["source_unit"] = Variable(("source",), np.array(units, dtype=str), "", "unit along source")
    values = m.drive_values if m.drive_values is not None else m.targets
    builder.attrs["configurations"] = 0 if values is None else len(values)
    return builder.result()


def _sizes(m: Mechanism) -> tuple[Floats, list[str]]:
    """The size of every source's set in units of the file, and those units."""
    sizes: list[float] = []
    units: list[str] = []
    for s, source in enumerate(m.core_spec["sources"]):
        ((shape, size),) = source["set"].items()
        names = ("low", "high") if shape == "interval" else SIZES
        value = max(abs(size[name]) for name in names if name in size)
        first = int(np.flatnonzero(m.parameter_source == s)[0])
        sizes.append(value / float(m.parameter_factors[first]))
        kind = axes_of(m)["parameter"].kinds[first]
        units.append(m.units.angle_name if kind == "angle" else m.units.length_name)
    return np.array(sizes), units
