"""A mechanism over its configurations as data for the drawing on a page: plain lists and numbers, in units of the file.

Every number is rounded to what can be seen: one part in a hundred thousand of the mechanism for places, four digits of
displacements.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.analyses.nominal import Nominal
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.plot.bodies import on_ground, path_of_output
from jointplay.plot.words import automatic

from .geometry import Geometry

#: how large, as a share of the mechanism, a magnified error is drawn
VISIBLE = 0.08
#: part of the mechanism that is too small to be seen
SMALL = 1e-5
#: digits of a displacement
DIGITS = 4


@dataclass(frozen=True)
class DisplacedScene:
    """A mechanism that is not at its nominal poses."""

    #: what displaces it
    label: str
    #: of all bodies, shape (configuration, body, pose), SI; nan where it is not known
    poses: Floats
    #: where the points of the specification are on their bodies, shape (configuration, point, 3), SI, body axes
    points: Floats | None = None


def scene(
    m: Mechanism,
    at: Nominal,
    *,
    displaced: Sequence[DisplacedScene] = (),
    region: Floats | None = None,
    cloud: Floats | None = None,
    limit: float | None = None,
    texts: Sequence[Sequence[str]] = (),
) -> dict[str, Any]:
    """What the drawing on a page shows.

    Parameters
    ----------
    m : Mechanism
        With one output.
    at : Nominal
        The configurations to be shown.
    displaced : sequence of DisplacedScene
        States beside the nominal one.
    region, cloud : ndarray, optional
        Errors of the output point in its own axes, shape (configuration, any, axis), in units of the file: points
        around the region that it can reach, and specimens.
    limit : float, optional
        Acceptable position error, in units of the file.
    texts : sequence of sequences of str
        Lines that are shown beside a configuration.

    Returns
    -------
    dict
        Of lists, numbers and texts, fit for JSON; numbers that are not known are None.
    """
    known = np.isfinite(at.poses).all(axis=(1, 2))
    reference = at.poses[int(known.argmax())] if known.any() else np.zeros(at.poses.shape[1:])
    geometry = Geometry(m, reference)
    axes = 2 if geometry.planar else 3
    places = geometry.places(at.poses)
    digits = _decimals(SMALL * geometry.extent)
    states = []
    for state in displaced:
        moved = geometry.places(state.poses, state.points) - places
        states.append({"label": state.label, "moves": _significant(moved[..., :axes])})
    sizes = [np.linalg.norm(array, axis=-1) for array in (region, cloud) if array is not None]
    largest = max((float(np.nanmax(size, initial=0.0)) for size in sizes), default=0.0)
    if not largest:
        output = m.output_point
        moves = [geometry.places(state.poses, state.points)[:, output] - places[:, output] for state in displaced]
        largest = max((float(np.nanmax(np.linalg.norm(move, axis=-1), initial=0.0)) for move in moves), default=0.0)
    path = path_of_output(m, at)[:, :axes] / m.units.length
    return {
        "axes": axes,
        "unit": m.units.length_name,
        "extent": geometry.extent,
        "shapes": geometry.shapes,
        "output": m.output_point,
        "relative": m.seen_from is not None,
        "places": _rounded(places[..., :axes], digits),
        "path": _rounded(path, digits),
        "states": states,
        "region": None if region is None else _significant(_grounded(m, at, region)),
        "cloud": None if cloud is None else _significant(_grounded(m, at, cloud)),
        "limit": limit,
        "factor": automatic(VISIBLE * geometry.extent, largest) or 1.0,
        "texts": [list(lines) for lines in texts],
    }


def _grounded(m: Mechanism, at: Nominal, errors: Floats) -> Floats:
    """Errors of the output point in ground axes."""
    turned = np.empty_like(errors)
    for k, pose in enumerate(at.poses):
        every = np.vstack([pose, poses.ground(m.pose_size)])
        turned[k] = on_ground(m, every, errors[k].T).T
    return turned


def _decimals(step: float) -> int:
    """Decimals with which numbers are known to a step."""
    return max(0, int(np.ceil(-np.log10(max(step, np.finfo(float).tiny)))))


def _rounded(values: Floats, decimals: int) -> Any:
    return _plain(np.round(values, decimals) + 0.0)


def _significant(values: Floats) -> Any:
    """Rounded to some digits of the largest."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return _rounded(values, _decimals(largest * 10.0**-DIGITS) if largest else 0)


def _plain(values: Floats) -> Any:
    """As nested lists without a number that JSON does not have."""
    plain = values.astype(object)
    plain[~np.isfinite(values)] = None
    return plain.tolist()
