"""The largest errors to first order, of determinate mechanisms without meshing flanks.

    max |A u|, max a . u        over u in the product of all sets C

A linear function is largest where every source is at its own support point. A size is climbed along its own direction,
from directions all around: it is convex and lies above its tangents, so that no step makes it smaller.
"""

from __future__ import annotations

import numpy as np

from jointplay.answers import Worst
from jointplay.compile import LENGTHS
from jointplay.gaps import centre, growth
from jointplay.model import Mechanism

from .nominal import Floats
from .region import IN_PLANE, around

#: directions from which sizes are climbed in space
IN_SPACE = 60
#: far more steps than are needed to the last digits
MOST_STEPS = 200
#: part of a size by which a step has to make it larger
ALIKE = 1e-14


def is_linear(m: Mechanism) -> bool:
    """Whether supports give the largest errors: not where flanks mesh, of which the carrying one depends on offsets."""
    meshes = any("coupling" in joint and joint["kind"] != "screw" for joint in m.core_spec["joints"])
    return m.core.isostatic and not meshes


def linear_worst(m: Mechanism, drives: Floats, poses: Floats) -> Worst:
    """What the core's `worst` gives, with first-order values in the place of the exact ones.

    Upper bounds are not found: they are nan.
    """
    found = m.core.sensitivity(drives, poses)
    each = [_extremes(m, slopes) for slopes in found["source"]]
    offset, along = (np.array([one[k] for one in each]) for k in (0, 1))
    contribution = np.array([_contributions(m, *one) for one in zip(found["source"], offset, along, strict=True)])
    value = contribution.sum(axis=2)
    lengths = _lengths(m)
    count, none = len(drives), np.full(len(drives), np.nan)
    ends = value[:, 2:].reshape(count, -1, 2)
    return {
        "position": value[:, 0],
        "position_first_order": value[:, 0],
        "position_bound": none,
        "rotation": value[:, 1],
        "rotation_first_order": value[:, 1],
        "rotation_bound": none,
        "component": ends,
        "component_first_order": ends,
        "direction": along[:, 0, lengths],
        "rotation_direction": along[:, 1, ~lengths],
        "offset": offset,
        "contribution": contribution,
        "contribution_elastic": np.zeros((*offset.shape[:2], len(m.joints))),
        "fallbacks": np.zeros(count, dtype=np.uint32),
        "unsettled": np.zeros(count, dtype=np.uint32),
        "status": found["status"],
    }


def linear_region(m: Mechanism, slopes: Floats, directions: Floats) -> Floats:
    """Errors of the output point that are largest along directions, to first order, SI, shape (direction, axis)."""
    own = slopes[_lengths(m)]
    return support(m, directions @ own) @ own.T


def support(m: Mechanism, weights: Floats, sizes: str = "largest") -> Floats:
    """Parameters that reach farthest along weights of them, each (any, parameter), SI.

    Clearances that scatter are as large as `sizes` says.
    """
    return m.core.at_supports(np.tile(centre(m, sizes), (len(weights), 1)), np.ascontiguousarray(weights), all=True)


def _lengths(m: Mechanism) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.array([name in LENGTHS for name in m.components])


def _extremes(m: Mechanism, slopes: Floats) -> tuple[Floats, Floats]:
    """Parameters at every extreme, and the direction in which the error counts there; nan where there is no pose."""
    size = len(m.components)
    axes, lengths = np.eye(size), _lengths(m)
    if not np.isfinite(slopes).all():
        count = 2 + 2 * size
        return np.full((count, len(m.parameters)), np.nan), np.full((count, size), np.nan)
    ends = np.repeat(axes, 2, axis=0)
    signs = np.tile([-1.0, 1.0], size)[:, None]
    offsets, along = [support(m, signs * ends @ slopes)], [ends]
    for which in (~lengths, lengths):
        u = _farthest(m, slopes[which])
        error = np.where(which, slopes @ u, 0.0)
        length = float(np.linalg.norm(error))
        offsets.insert(0, u[None])
        along.insert(0, (error / length if length > 0.0 else 0.0 * error)[None])
    return np.concatenate(offsets), np.concatenate(along)


def _farthest(m: Mechanism, slopes: Floats) -> Floats:
    """The parameters at which the size of some components is largest."""
    directions = np.array([[-1.0], [1.0]])
    if len(slopes) > 1:
        directions = around(len(slopes), IN_PLANE if len(slopes) == 2 else IN_SPACE)
    best = np.zeros(len(directions))
    for _ in range(MOST_STEPS):
        u = support(m, directions @ slopes)
        error = u @ slopes.T
        size = np.linalg.norm(error, axis=1)
        if (size <= best * (1.0 + ALIKE)).all():
            break
        best = size
        directions = np.divide(error, size[:, None], out=directions.copy(), where=size[:, None] > 0.0)
    return np.asarray(u[size.argmax()])


def _contributions(m: Mechanism, slopes: Floats, offset: Floats, along: Floats) -> Floats:
    """What every source adds to every extreme, shape (extreme, source).

    Of a clearance that scatters, the sizes of its parts add what is beyond its play in the middle of their limits.
    """
    weights = along @ slopes
    parts = weights * offset
    # Lowest ends of components are largest the other way.
    signs = np.array([1.0, 1.0, *[-1.0, 1.0] * len(m.components)])[:, None]
    owners = (m.parameter_source[:, None] == np.arange(len(m.sources))).astype(float)
    for k, grows in growth(m).items():
        own = np.flatnonzero(m.parameter_source == k)
        middle = support(m, signs * weights, "middle")[:, own]
        beyond = np.sum(weights[:, own] * (offset[:, own] - middle), axis=1)
        parts[:, own] = weights[:, own] * middle
        total = sum(grows.values())
        for column, part in grows.items():
            parts[:, column] += beyond * (part / total if total else 0.0)
    return np.asarray(parts @ owners)
