"""Drive values for which the largest of several errors is least.

    min over q   max over k and W   |W E_k(q)|

E_k are the errors of the same configuration for several offsets, or in several load cases; W weighs the components, or
leaves some out. Around the present q every E_k is replaced by E_k + J_k dq, and the convex program that is left is
solved within a region of trust, which grows and shrinks as the largest error follows. Where drives have more freedom
than the errors, the step is that of the least change.

The worst case has offsets without number. Those at which it is largest are added one after the other: the largest over
some is never more than that over all, and what separates both at the end is what the correction may miss.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Codes, Floats
from jointplay.basics.progress import TellStep

#: steps, and the largest step at first (radians, characteristic lengths)
STEPS, TRUST = 60, 0.1
#: a step (radians, characteristic lengths), and a part of the largest error to be gained, below which there is none
STILL, GAIN = 1e-12, 1e-9
#: half the distance of the drive values whose errors give J; its square is the error of J
PROBE = 1e-5
#: part of the expected gain that a step has to bring, and beyond which steps may grow
LITTLE, MUCH = 0.1, 0.7

PlaceIndices = NDArray[np.intp]
#: errors, (place, error, component), and status at drive values, (place, drive), of the configurations at some places
SeveralErrors = Callable[[Floats, PlaceIndices], tuple[Floats, Codes]]


@dataclass
class LeastLargest:
    """Drive values and what they leave, of all configurations."""

    drives: Floats
    #: the largest weighted error
    largest: Floats
    status: Codes
    #: steps made
    iterations: NDArray[np.int64]
    #: whether no step makes it less
    settled: NDArray[np.bool_]


def slopes(errors: SeveralErrors, drives: Floats, places: PlaceIndices, unit: Floats) -> Floats:
    """dE/dq by central differences of the non-linear model, with the drives as the last dimension."""
    half = PROBE * unit
    shifts = np.concatenate([np.diag(half), -np.diag(half)])
    # All at once, because the core solves many in little more time than one.
    found, _ = errors((shifts[:, None] + drives).reshape(-1, len(unit)), np.tile(places, len(shifts)))
    above, below = found.reshape(2, len(unit), *drives.shape[:1], *found.shape[1:])
    return np.moveaxis((above - below) / (2.0 * half.reshape(-1, *[1] * found.ndim)), 0, -1)


def least_largest(
    errors: SeveralErrors,
    drives: Floats,
    places: PlaceIndices,
    weights: Floats,
    unit: Floats,
    ranges: Floats,
    progress: TellStep | None = None,
) -> LeastLargest:
    """Make the largest error least, at some configurations at once.

    Parameters
    ----------
    drives : ndarray
        Where the search begins, shape (place, drive).
    places : ndarray
        The configurations.
    weights : ndarray
        Weights of the components, shape (place, measure, component): every measure counts.
    unit : ndarray
        What makes steps of different drives comparable.
    ranges : ndarray
        Lowest and highest value of every drive, shape (2, drive).
    progress : callable, optional
        Called with how many configurations are done and how many there are.
    """
    low, high = ranges
    drives = np.clip(drives, low, high)
    count = len(places)

    def weighed(found: Floats, some: PlaceIndices) -> Floats:
        """All weighted errors, (place, error and measure, component)."""
        values = found[:, :, None] * weights[some, None]
        return values.reshape(len(found), -1, values.shape[-1])

    def largest(found: Floats, some: PlaceIndices) -> Floats:
        sizes = np.linalg.norm(weighed(found, some), axis=2).max(axis=1)
        return np.where(np.isfinite(sizes), sizes, np.inf)

    found, status = errors(drives, places)
    merit = largest(found, np.arange(count))
    iterations, settled = np.zeros(count, np.int64), merit == 0.0
    trust = np.full(count, TRUST)
    active = np.flatnonzero(np.isfinite(merit) & ~settled)
    for _ in range(STEPS):
        if progress is not None:
            progress(count - len(active), count)
        if not len(active):
            break
        slope = slopes(errors, drives[active], places[active], unit)
        turned = np.moveaxis(slope, 3, 1) * unit[None, :, None, None]
        by_drive = np.stack([weighed(turned[:, d], active) for d in range(turned.shape[1])], axis=3)
        now = weighed(found[active], active)
        step, expected = np.zeros((len(active), drives.shape[1])), np.zeros(len(active))
        for n, k in enumerate(active.tolist()):
            bounds = np.clip(np.stack([low - drives[k], high - drives[k]]) / unit, -trust[k], trust[k])
            step[n], expected[n] = _step(now[n], by_drive[n], merit[k], bounds)
        gain = merit[active] - expected
        moves = (gain > GAIN * merit[active]) & (np.abs(step).max(axis=1) > STILL)
        settled[active[~moves]] = True
        active, step, gain = active[moves], step[moves], gain[moves]
        if not len(active):
            break
        trial = np.clip(drives[active] + step * unit, low, high)
        there, outcome = errors(trial, places[active])
        size = largest(there, active)
        part = (merit[active] - size) / gain
        better = part > LITTLE
        length = np.abs(step).max(axis=1)
        trust[active] = np.where(part > MUCH, np.maximum(trust[active], 2.0 * length), trust[active])
        trust[active] = np.where(better, trust[active], length / 4.0)
        done = active[better]
        drives[done], found[done], status[done], merit[done] = (
            trial[better],
            there[better],
            outcome[better],
            size[better],
        )
        iterations[done] += 1
    return LeastLargest(drives, merit, status, iterations, settled)


def _step(now: Floats, slope: Floats, largest: float, bounds: Floats) -> tuple[Floats, float]:
    """The step within bounds that makes the largest of straight errors least, and how large it is then.

    Parameters
    ----------
    now, slope : ndarray
        Weighted errors, (error, component), and their derivatives, (error, component, drive).
    """
    still = np.zeros(slope.shape[2]), largest
    if not (largest > 0.0 and np.isfinite(now).all() and np.isfinite(slope).all()):
        return still
    # Where drives move nothing they stay.
    _, size, right = np.linalg.svd(slope.reshape(-1, slope.shape[2]), full_matrices=False)
    ways = right[size > 1e-9 * max(size.max(initial=0.0), np.finfo(float).tiny)].T
    if not ways.shape[1]:
        return still
    step, reached = _step_along(ways, now, slope, largest, bounds)
    if ((step <= bounds[0]) | (step >= bounds[1])).any():
        # Of many drives that can do it the least change is stopped by an end, and others can go on.
        each = np.eye(slope.shape[2])[:, np.abs(slope).max(axis=(0, 1)) > 0.0]
        further = _step_along(each, now, slope, largest, bounds)
        if further[1] < reached * (1.0 - GAIN):
            return further
    return step, reached


def _step_along(ways: Floats, now: Floats, slope: Floats, largest: float, bounds: Floats) -> tuple[Floats, float]:
    """Such a step along some directions of the drives, shape (drive, direction)."""
    from scipy.optimize import minimize

    # Errors count in the largest, steps in those that would remove it.
    e, a = now / largest, slope @ ways
    unit = 1.0 / np.abs(a).max()
    a = a * unit
    last = ways.shape[1]

    def straight(x: Floats) -> Floats:
        return np.asarray(e + a @ x[:last])

    def left_over(x: Floats) -> Floats:
        return np.asarray(x[last] - np.sum(straight(x) ** 2, axis=1))

    def by_unknown(x: Floats) -> Floats:
        return np.column_stack([-2.0 * np.einsum("kc,kcd->kd", straight(x), a), np.ones(len(e))])

    constraints = [{"type": "ineq", "fun": left_over, "jac": by_unknown}]
    matrix = ways * (unit * largest)
    own = np.abs(matrix).sum(axis=1) > 0.0
    for sign, bound in ((1.0, -bounds[0]), (-1.0, bounds[1])):
        rows = np.column_stack([sign * matrix, np.zeros(len(matrix))])[own]
        limit = bound[own]
        scale = np.maximum(np.abs(rows).max(axis=1), np.finfo(float).tiny)
        constraints.append(
            {
                "type": "ineq",
                "fun": lambda x, rows=rows, limit=limit, scale=scale: (rows @ x + limit) / scale,
                "jac": lambda _, rows=rows, scale=scale: rows / scale[:, None],
            }
        )
    gradient = np.append(np.zeros(last), 1.0)
    begin = np.append(np.zeros(last), np.sum(e**2, axis=1).max())
    found = minimize(
        lambda x: x[last],
        begin,
        jac=lambda _: gradient,
        constraints=constraints,
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 200},
    )
    step = np.clip(matrix @ found.x[:last], bounds[0], bounds[1])
    reached = float(np.sqrt(np.sum((now + slope @ step) ** 2, axis=1).max()))
    return (step, reached) if np.isfinite(reached) and reached < largest else (np.zeros(len(ways)), largest)
