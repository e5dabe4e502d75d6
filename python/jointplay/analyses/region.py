"""`region`: where the output point can be, as far as clearances and tolerances let it.

    extent(d) = max d . error over u in C        for unit vectors d all around

on the exact closure, each climbed as the extremes of `worst`. The points that attain the extents are on the convex hull
of the region; between them the hull lies within the half-planes d . error <= extent(d).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.answers import Region
from jointplay.core.compile import LENGTHS
from jointplay.errors import in_range
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, to_dataset

from .nominal import Nominal, Progress, batched, finished, nominal, report, without_singular
from .recorded import recorded
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr

#: in how many directions one looks if nothing else is said, in the plane and in space
IN_PLANE, IN_SPACE = 72, 162
MOST_DIRECTIONS = 10_000
#: starts of every climb; more than a few find nothing that neighbouring directions do not find
STARTS = 4


@typed
def region(m: Mechanism, *, directions: int | None = None) -> xr.Dataset:
    """Find the region of the output point's error, by how far the point can go in directions all around.

    Parameters
    ----------
    m : Mechanism
    directions : int, optional
        How many: 72 in the plane, which are five degrees apart, and 162 in space if left out.

    Returns
    -------
    xarray.Dataset
        Over `configuration` and `direction`: `extent` (how far the point can be displaced along the direction, also
        with `_first_order`) and `region` (components of the displacement that attains it, over `axis`), both lengths,
        in the axes of the error. Over `direction`: `region_direction`, unit vectors, in the plane one after the other
        against the clock from x. `unsettled` (number of directions whose ascent reached its limit of steps), `nominal`,
        `status`.

    Raises
    ------
    InputError
        When the number of directions is not one from 3 to 10,000.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.region(jp.loads(jp.examples.text("four-bar")), directions=8)
    >>> result.extent[0, ::2].values.round(3)  # to the right, up, to the left, down
    array([2.507, 3.048, 2.547, 3.103])
    """
    return to_dataset(compute(m, directions=directions))


@recorded
@of_each(lambda _: False)
def compute(
    m: Mechanism, *, directions: int | None = None, at: Nominal | None = None, progress: Progress | None = None
) -> Result:
    """The light form of `region`."""
    axes = sum(name in LENGTHS for name in m.components)
    count = (IN_PLANE if axes == 2 else IN_SPACE) if directions is None else directions
    in_range(count, "directions", "a number of directions", 3, MOST_DIRECTIONS)
    towards = around(axes, count)
    at = (at or nominal(m)).with_errors
    drives, poses = at.drives, at.poses

    def run(part: slice) -> Region:
        return m.core.region(drives[part], poses[part], towards, STARTS)

    found, done = batched(len(at), 1, run, progress)
    found, at = without_singular(found), at.first(done)
    builder = report(m, "region", at)
    builder.labels("direction", np.arange(count), "number of the direction, from 0")
    words = "unit vector along which the point is displaced"
    builder.add("region_direction", ("direction", "axis"), towards, words)
    each = ("configuration", "direction")
    words = "largest displacement along the direction"
    builder.add("extent", each, found["extent"], words, "length")
    builder.add("extent_first_order", each, found["extent_first_order"], f"{words}, to first order", "length")
    words = "displacement of the output point that is largest along the direction"
    builder.add("region", (*each, "axis"), found["error"][..., :axes], words, "length")
    words = "directions whose ascent reached its limit of steps"
    builder.add("unsettled", "configuration", found["unsettled"], words)
    builder.status(at.worse(found["status"]))
    return finished(builder, done, len(drives))


def around(axes: int, count: int) -> Floats:
    """Unit vectors evenly all around: in the plane from x against the clock, in space along a spiral.

    Parameters
    ----------
    axes : int
        2 or 3.

    Examples
    --------
    >>> around(2, 4).round(12) + 0.0
    array([[ 1.,  0.],
           [ 0.,  1.],
           [-1.,  0.],
           [ 0., -1.]])
    """
    steps = np.arange(count)
    if axes == 2:
        angles = 2.0 * np.pi * steps / count
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # Equal steps of height have equal areas of the sphere between them; turns of the golden angle never meet.
    height = 1.0 - (2.0 * steps + 1.0) / count
    turns = np.pi * (3.0 - np.sqrt(5.0)) * steps
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turns), ring * np.sin(turns), height], axis=1)
