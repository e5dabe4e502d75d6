"""The least and the largest force that clearances and tolerances allow, on the exact closure.

    extreme = max +-f(u) over u in C        C: the sets of all sources, clearances of their largest size

A step goes from u towards the support point v of the sets along the slope of f at u (Frank and Wolfe 1956), all the way
or by halves until f has grown. It ends where (v - u) . slope, what is left to first order, is small. It begins at the
best of the support points of the first order, of their opposites, and of those of slopes that are tilted a little at
random: what has no slope alone is at a corner there, and counts by its product with others, and a force that is extreme
where it is nominal, as near a dead centre, is left. That no offsets give more is not proved.
"""

import math
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats, Ints
from jointplay.model.gaps import centre

from .statics import Balances

#: starts with slopes that are tilted at random by this part, and their seed
STARTS, TILT, SEED = 16, 1e-6, 0
#: steps of an ascent, and halvings of one
STEPS, HALVINGS = 12, 8
#: of the largest force, what is rounding
ROUNDED = 1e-12
#: of the difference from the nominal force, what an ascent may leave, and what is told where it ends by its steps
LEFT, OPEN = 1e-6, 1e-3


@dataclass(frozen=True)
class Extremes:
    """Least and largest forces."""

    #: `force`, `first_order`: SI, shape (configuration, force, side)
    force: Floats
    first_order: Floats
    #: what attains them, shape (configuration, force, side, parameter)
    offset: Floats
    #: what every parameter adds in the first order, shape (configuration, force, side, parameter)
    parts: Floats
    #: ascents that reached their number of steps, of every configuration
    unsettled: Ints


def extremes(of: Balances, which: Ints, forces: Ints) -> Extremes:
    """Least and largest values of some forces at some configurations; nan where a pose within the sets is singular."""
    m = of.m
    shape = (len(which), len(forces), 2)
    signs = np.broadcast_to([-1.0, 1.0], shape)
    slopes = of.slopes(which, of.zero[: len(which)])[:, forces]
    weights = signs[..., None] * slopes[:, :, None]
    firsts = _supports(of, weights)
    parts = slopes[:, :, None] * firsts
    nominal = of.nominal()[which][:, forces]
    case = np.repeat(which, shape[1] * 2)
    column = np.tile(np.repeat(forces, 2), shape[0])
    sign = signs.reshape(-1)

    def value(rows: Ints, u: Floats) -> Floats:
        found = of.forces(case[rows], u)
        return np.asarray(found[np.arange(len(rows)), column[rows]])

    every = np.arange(sign.size)
    u = firsts.reshape(sign.size, len(m.parameters))
    best = value(every, u)
    lost = np.isnan(best)
    noise = np.random.default_rng(SEED).normal(size=(STARTS, len(m.parameters)))
    sizes = np.abs(np.nan_to_num(weights)).max(axis=-1, keepdims=True, initial=0.0)
    tilted = (_supports(of, weights + TILT * np.where(sizes > 0.0, sizes, 1.0) * row) for row in noise)
    for start in (each.reshape(u.shape) for each in (_supports(of, -weights), *tilted)):
        there = value(every, start)
        lost |= np.isnan(there)
        better = sign * there > sign * best
        u[better], best[better] = start[better], there[better]
    unsettled = _climb(of, case, column, sign, u, np.repeat(nominal.reshape(-1), 2), best)
    best[lost] = np.nan
    return Extremes(
        best.reshape(shape),
        nominal[..., None] + parts.sum(axis=-1),
        u.reshape(parts.shape),
        parts,
        unsettled.reshape(len(which), -1).sum(axis=1),
    )


def _climb(of: Balances, case: Ints, column: Ints, sign: Floats, u: Floats, nominal: Floats, best: Floats) -> Ints:
    """Climb from offsets to their extremes, in place; which ascents reached their number of steps."""
    active = np.flatnonzero(np.isfinite(best))
    scale = np.abs(best).max(initial=0.0, where=np.isfinite(best))
    unsettled = np.zeros(len(u), dtype=np.int64)
    for step in range(STEPS + 1):
        if not active.size:
            break
        slope = of.slopes(case[active], u[active])[np.arange(len(active)), column[active]]
        weights = sign[active, None] * slope
        known = np.isfinite(weights).all(axis=1)
        active, weights = active[known], weights[known]
        towards = _supports(of, weights)
        left = np.einsum("np,np->n", weights, towards - u[active])
        gone = np.abs(best[active] - nominal[active])
        climbing = left > ROUNDED * scale + LEFT * gone
        active, towards, left = active[climbing], towards[climbing], left[climbing]
        if step == STEPS:
            unsettled[active[left > OPEN * gone[climbing]]] = 1
            break
        trying, moved = np.arange(len(active)), np.zeros(len(active), dtype=bool)
        for halving in range(HALVINGS):
            if not trying.size:
                break
            rows = active[trying]
            there = u[rows] + 0.5**halving * (towards[trying] - u[rows])
            found = of.forces(case[rows], there)[np.arange(len(rows)), column[rows]]
            grown = sign[rows] * (found - best[rows]) > ROUNDED * scale
            u[rows[grown]], best[rows[grown]] = there[grown], found[grown]
            moved[trying[grown]] = True
            trying = trying[~grown]
        active = active[moved]
    return unsettled


def _supports(of: Balances, weights: Floats) -> Floats:
    """Where the sets reach farthest along weights of the parameters, which are last."""
    rows = np.ascontiguousarray(weights.reshape(math.prod(weights.shape[:-1]), weights.shape[-1]))
    loosest = np.tile(centre(of.m, "largest"), (len(rows), 1))
    known = np.where(np.isfinite(rows), rows, 0.0)
    return np.asarray(of.m.core.at_supports(loosest, known, all=True)).reshape(weights.shape)
