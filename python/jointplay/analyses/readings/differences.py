"""Derivatives of errors away from the nominal mechanism, by differences on the exact loop closure.

    f'(u) = (8 (f(u + h) - f(u - h)) - (f(u + 2 h) - f(u - 2 h))) / 12 h

exact but for terms of the order h^4, and for rounding of 1e-16 / h: together a part of about 1e-10.
"""

from collections.abc import Callable

import numpy as np

from jointplay import _core
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.model.mechanism import Mechanism
from jointplay.result import axes_of

#: step in radians and in parts of the mechanism's length; of anything else a unit of its own
STEP = 2e-4
#: what is added up: a step, and its part
STENCIL = ((1.0, 8.0 / 12.0), (-1.0, -8.0 / 12.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0))
#: part by which differences over one step and over two may differ; where they do, something jumps in between
SMOOTH = 1e-3


def steps_of(m: Mechanism) -> Floats:
    """The step of every parameter, SI."""
    sizes = {"length": STEP * m.length, "angle": STEP}
    return np.array([sizes.get(kind, 1.0) for kind in axes_of(m)["parameter"].kinds])


def errors_of(core: _core.Mechanism, drives: Floats, placed: Floats, rows: Floats) -> Floats:
    """Errors of a determinate mechanism, shape (row, station, component), of rows of all parameters."""
    each = [core.errors_of(drives[k : k + 1], placed[k : k + 1], rows) for k in range(len(drives))]
    return np.stack(each, axis=1)


def slopes_at(errors: Callable[[Floats], Floats], u: Floats, steps: Floats, otherwise: Floats) -> Floats:
    """Derivatives of small displacements of a pose by parameters, shape (station, component, parameter).

    Parameters
    ----------
    errors : callable
        Makes errors, shape (row, station, component), of rows of all parameters.
    u : ndarray
        Where; SI.
    steps : ndarray
        Of every parameter; nothing is asked for by those whose step is zero.
    otherwise : ndarray
        What is taken for those, and where something jumps.
    """
    own = np.flatnonzero(steps)
    rows = [u + reach * np.diag(steps)[own] for reach, _ in STENCIL]
    found = errors(np.concatenate([u[None], *rows]))
    away = _apart(found[1:], found[0]).reshape(len(STENCIL), len(own), *found.shape[1:])
    each = steps[own, None, None]
    slopes = np.tensordot([part for _, part in STENCIL], away, axes=1) / each
    near, far = (away[0] - away[1]) / (2.0 * each), (away[2] - away[3]) / (4.0 * each)
    largest = np.abs(near).max(axis=(1, 2), keepdims=True)
    with np.errstate(invalid="ignore"):
        smooth = (np.abs(near - far) <= SMOOTH * largest).all(axis=2, keepdims=True)
    whole = otherwise.copy()
    whole[:, :, own] = np.moveaxis(np.where(smooth, slopes, np.moveaxis(otherwise[:, :, own], 2, 0)), 0, 2)
    return whole


def _apart(errors: Floats, middle: Floats) -> Floats:
    """Small displacements from one error to others, in ground axes."""
    if errors.shape[-1] != 6:
        return np.asarray(errors - middle)
    turned = poses.product(poses.quaternion(errors[..., 3:]), poses.inverse(poses.quaternion(middle[..., 3:])))
    return np.concatenate([errors[..., :3] - middle[..., :3], poses.rotation_vector(turned)], axis=-1)
