"""Where a mechanism is when offsets, or a load, displace it: what drawings show beside the nominal poses.

Deviations of lengths and of places move points within their bodies, too.
"""

from typing import NamedTuple

import numpy as np

from jointplay.analyses import loaded
from jointplay.analyses.nominal import Nominal, report
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.model.gaps import centre, core_with
from jointplay.model.mechanism import Mechanism


class Displaced(NamedTuple):
    """A mechanism that is not at its nominal poses."""

    #: of all bodies, shape (configuration, body, pose), SI; nan where there is none
    poses: Floats
    #: where the points of the specification are on their bodies, shape (configuration, point, 3), SI, body axes
    points: Floats


def at_offsets(m: Mechanism, at: Nominal, offsets: Floats) -> Displaced:
    """The mechanism at given offsets.

    Parameters
    ----------
    offsets : ndarray
        Shape (configuration, parameter), in units of the file; nan where they are not known.
    """
    builder = report(m, "", at)
    u = offsets * np.array([builder.factor(kind) for kind in builder.axes["parameter"].kinds])
    known = np.isfinite(u).all(axis=1)
    u = np.where(known[:, None], u, m.centre)
    displaced = at_parameters(m, at, u)
    displaced.poses[~known] = np.nan
    return displaced


def at_parameters(m: Mechanism, at: Nominal, u: Floats) -> Displaced:
    """The mechanism at values of all parameters, shape (configuration, parameter), SI."""
    return Displaced(np.array(m.core.given(at.drives, at.poses, u)["poses"]), on_bodies(m, u))


def under_load(m: Mechanism, at: Nominal) -> Displaced:
    """The mechanism under the loads of the file; what they leave open is in its middle.

    Parameters
    ----------
    m : Mechanism
        In one load case.
    """
    if m.core.isostatic:
        return at_offsets(m, at, loaded.compute(m, at=at, details=False, offset=True).get("offset"))
    found = np.full(at.poses.shape, np.nan)
    own = centre(m, "middle")
    u = np.tile(own, (len(at), 1))
    for k in np.flatnonzero(np.isfinite(at.poses).all(axis=(1, 2))).tolist():
        # Elastic members give way, too: the mechanism itself is a specimen.
        core = core_with(m.running_under(k, at.drives[k : k + 1], at.poses[k : k + 1]), "middle")
        (found[k],), (u[k],) = (
            core.loaded_specimens(at.drives[k : k + 1], at.poses[k : k + 1], own[None])[name]
            for name in ("poses", "offset")
        )
    return Displaced(found, on_bodies(m, u))


def shifts(m: Mechanism, at: Nominal, displaced: Displaced) -> Floats:
    """How far the output point of a displaced mechanism is from its nominal place, in units of the file.

    Of an output that is seen from another body it is how far the point is off as that body sees it.
    """
    nominal = _seen(m, at.poses, np.asarray(m.points[m.output_point].at))
    there = _seen(m, displaced.poses, displaced.points[:, m.output_point])
    return np.asarray(np.linalg.norm(there - nominal, axis=-1)) / m.units.length


def _seen(m: Mechanism, every: Floats, on_body: Floats) -> Floats:
    """Where the output point is, in the axes of the body from which it is seen; shape (configuration, 3)."""
    own = every[:, m.points[m.output_point].body]
    place: Floats = poses.position(own) + (poses.matrix(own) @ on_body[..., None])[..., 0]
    if m.seen_from is None:
        return place
    other = every[:, m.seen_from]
    return poses.seen_from(other, place - poses.position(other))


def on_bodies(m: Mechanism, u: Floats) -> Floats:
    """Where all points are on their bodies, shape (configuration, point, 3), SI, body axes."""
    return np.stack([m.on_body(point, u) for point in range(len(m.points))], axis=1)
