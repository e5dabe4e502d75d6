"""`compensate`: drive values that bring the output back as near as they can.

    dq = -(W J)^+ W (E(q) - target),   q <- q + dq,   J = dE/dq

E is the error of the non-linear model at the drives q, found anew at every step, so that a load may move its contacts;
J is found anew where steps do not shrink, and where what is left is not zero; where a drive does not act because the
load holds its joint inside a play, the search begins again at either end (see `beyond`).
A step counts only when it makes |W (E - target)| smaller: where contact flips back and forth the best drives met are
kept. W weighs lengths against angles. What no drive can remove is what remains of E.

Of the worst case, and of all load cases with one table of drive values, the largest error is made least; see `minimax`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Codes, Floats
from jointplay.basics.typed import typed
from jointplay.core.answers import Worst
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, shown
from jointplay.model.gaps import attributes
from jointplay.model.mechanism import Mechanism
from jointplay.questions import asked_by, require_known
from jointplay.result import ROUNDING, Result, ResultBuilder, align, beside, split, to_dataset
from jointplay.result.verdict import judge

from . import worst
from .beyond import beyond_play, does_not_act
from .given import OF_WORST
from .loaded import loads_of, require_loads
from .minimax import LeastLargest, PlaceIndices, least_largest, slopes
from .nominal import Nominal, Progress, at_drives, nominal, report, without_singular
from .offsets import Offsets, array_of, parameters
from .recorded import recorded
from .running import add_contact, drive_units, motion_of, speeds
from .several import of_each, of_outputs, places_of, share
from .worst import STARTS

if TYPE_CHECKING:
    import xarray as xr

#: steps after which a quasi-Newton method goes on: where contact or what is left keeps them long, more hardly help
STEPS = 20
#: shortest part of a step that is tried
SHORTEST = 2.0**-10
#: a step (radians, characteristic lengths) below this is none
STILL = 1e-11
#: the longest step (radians, characteristic lengths)
FARTHEST = 0.5
#: derivatives serve the next step too where a step is below this part of the one before; they are those of the place
#: while no step since is longer than this (radians, characteristic lengths)
SHRUNK, NEAR = 0.1, 1e-8
#: two errors are the same up to this part of them
SAME = 1e-13
#: what is left is least where the drives change it by no more than this part of what they change errors by
LEVEL = 1e-6
#: what holds steps, as a part of the derivatives, where ranges do
SHORT = 1e-6
#: rounds in which offsets of the worst case are added, and the part by which the largest error of all may be more than
#: that of those which were
ROUNDS, MISSED = 40, 1e-8
#: starts of the searches on the way; the last has those of `worst`
ON_THE_WAY = 6
GIVEN = "offsets are given; ask for the question 'given'"

#: error, (place, component), and status at drive values, (place, drive), of the configurations at some places
Errors = Callable[[Floats, PlaceIndices], tuple[Floats, Codes]]


@typed
def compensate(
    m: Mechanism,
    question: str = "loaded",
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    *,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
    one_table: bool = False,
) -> xr.Dataset:
    """Correct the drives so that the output returns as near as possible to its nominal pose.

    Parameters
    ----------
    m : Mechanism
    question : {"loaded", "worst", "given"}
        Which error is corrected. Of the worst case the largest error over all offsets is made least.
    offsets, deviations : optional
        As for `given`; with that question only. Without them and without a `target` they are those of the largest
        position error of the worst case.
    weights : (float, float), optional
        Weights of position and rotation: a position error counts as many times its length, a rotation as
        many times the arc it makes at the radius `weights[1]`, in the length unit of the file per radian. Default:
        (1, 0) with fewer drives than the output has components, else (1, characteristic length). Of the worst case
        the larger of the weighted largest position error and the weighted largest rotation counts; by default each as
        a part of what it is before, so that neither grows.
    target : array, optional
        Error to reach in place of zero: (x, y) or (x, y, angle), in space (x, y, z) or (x, y, z, rx, ry, rz), for all
        or for each configuration. With ``"given"`` and no offsets this is the inverse kinematics of a displaced output
        point.
    one_table : bool
        Whether all load cases get the same drive values, with which the largest error over them is least. With
        ``"loaded"`` only.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `drive_nominal`, `drive_corrected` and `correction` (along `drive`), `error` (before),
        `residual` (after: what no drive can remove), `error_position`, `error_rotation`, `residual_position`,
        `residual_rotation` (sizes), of `loaded` `residual_undetermined` (half-width of what the load leaves open
        after), `target` (the error to reach), `limit`, `limit_met` and `margin` (whether and by how much what is left
        keeps to the limits of the file; what differs from the target counts), `at_limit` (drives held by their range
        in the file), `inside_play` (drives that do not act there; not of `worst`), `settled` (whether nothing near
        leaves less; elsewhere contact alternates between two sides, and the best drives found are given), `iterations`,
        `nominal`, `status` (of the corrected mechanism). Where
        drives have speeds `contact_rate`, `contact` and `transit_time` as of `loaded`. Of `worst` the sizes are the
        largest ones, `residual_component` is the lowest and highest error of each component (along `side`), and `error`
        and `residual` are the errors where the position error is largest. Of `loaded` and `worst` as well
        `between_position` and `between_rotation`: what a controller that takes straight lines between the rows of the
        table leaves half-way to the next one; not where drives have speeds.

    Raises
    ------
    InputError
        When there is no drive, a name is unknown, an array has the wrong shape, or one option excludes another.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.compensate(jp.loads(jp.examples.text("four-bar")))
    >>> result.drive_corrected[0].item() > result.theta1[0].item()
    True
    """
    return to_dataset(compute(m, question, offsets, deviations, weights=weights, target=target, one_table=one_table))


@dataclass(frozen=True)
class Correction:
    """Corrected drives of all configurations, SI."""

    #: `drives`, `error`: of the worst case the error is that at the largest position error
    drives: Floats
    error: Floats
    status: Codes
    iterations: NDArray[np.int64]
    settled: NDArray[np.bool_]
    #: drives within their play, where they do not act
    inside: NDArray[np.bool_] | None = None
    #: of the worst case: the largest position and rotation, before and after, and the ends of all components after
    largest: Mapping[str, Floats] = field(default_factory=dict)


@recorded
def compute(
    m: Mechanism,
    question: str = "loaded",
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    *,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
    one_table: bool = False,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `compensate`."""
    if not one_table:
        return _of_each_case(m, question, offsets, deviations, weights=weights, target=target, at=at, progress=progress)
    if question != "loaded" or not m.load_cases:
        has = "" if m.load_cases else "; the file has no load cases"
        raise InputError(f"one table is for all load cases of the question 'loaded'{has}", file=m.file, key="one_table")
    if offsets is not None or deviations is not None:
        raise InputError(GIVEN, file=m.file, key="offsets")
    found = [
        _of_all_cases(
            [m.only(output, case) for case in m.load_cases],
            *(m.load_cases, weights, target),
            progress=None if progress is None else share(progress, k, max(len(m.outputs), 1)),
        )
        for k, output in enumerate(m.outputs or (None,))
    ]
    return of_outputs(m, found) if m.outputs else found[0]


@of_each(lambda given: given["question"] == "loaded")
def _of_each_case(
    m: Mechanism,
    question: str,
    offsets: Offsets | xr.DataArray | xr.Dataset | None,
    deviations: Mapping[str, Any] | None,
    *,
    weights: tuple[float, float] | None,
    target: Sequence[float] | NDArray[np.float64] | None,
    at: Nominal | None,
    progress: Progress | None,
) -> Result:
    _require_drives(m)
    at = (at or nominal(m)).with_errors
    if question == "worst":
        return _of_worst(m, at, offsets, deviations, weights, target, progress=progress)
    of_worst = question == "given" and offsets is None and deviations is None and target is None
    if of_worst:
        offsets = worst.compute(m, at=at).get("worst_offset", extreme="position")
    errors = _errors(m, at, question, offsets, deviations)
    weight = _weights(m, weights)
    wanted = _target(m, len(at), target)
    before, _ = errors(at.drives, np.arange(len(at)))
    correction = _corrected(m, errors, at, weight, wanted, progress)
    result = _report(m, at, question, before, correction, weight, wanted)
    return replace(result, attrs={**result.attrs, "offsets_of": OF_WORST}) if of_worst else result


def _require_drives(m: Mechanism) -> None:
    if not m.drives:
        raise InputError("a mechanism without drives has nothing to correct", file=m.file, key="drives")


def _of_all_cases(
    parts: list[Mechanism],
    cases: Sequence[str],
    weights: tuple[float, float] | None,
    target: Any,
    *,
    progress: Progress | None,
) -> Result:
    """One table of drive values, with which the largest error over all load cases is least."""
    first = parts[0]
    _require_drives(first)
    places = [at.with_errors for at in places_of(parts)]
    of_cases = [_errors(m, at, "loaded", None, None) for m, at in zip(parts, places, strict=True)]
    weight, wanted = _weights(first, weights), _target(first, len(places[0]), target)

    def errors(drives: Floats, some: PlaceIndices) -> tuple[Floats, Codes]:
        found = [of_case(drives, some) for of_case in of_cases]
        return np.stack([error - wanted[some] for error, _ in found], axis=1), np.max(
            [code for _, code in found], axis=0
        )

    everywhere, drives = np.arange(len(places[0])), places[0].drives
    weights_of = np.broadcast_to(weight, (len(drives), 1, len(weight)))
    unit, ranges = drive_units(first), _ranges(first)
    found = least_largest(errors, drives, everywhere, weights_of, unit, ranges, progress)

    def search(drives: Floats, some: PlaceIndices) -> LeastLargest:
        return least_largest(errors, drives, some, weights_of[some], unit, ranges)

    inside = beyond_play(search, errors, found, unit, ranges, *_rounding(first, weight))
    answers = []
    for m, at, of_case in zip(parts, places, of_cases, strict=True):
        before, _ = of_case(drives, everywhere)
        error, status = of_case(found.drives, everywhere)
        correction = Correction(found.drives, error, status, found.iterations, found.settled, inside)
        answers.append(_report(m, at, "loaded", before, correction, weight, wanted, one_table=1))
    return beside(align(answers), "load_case", cases, "load case", same=("nominal", "limit"))


def _of_worst(
    m: Mechanism, at: Nominal, offsets: Any, deviations: Any, weights: Any, target: Any, *, progress: Progress | None
) -> Result:
    """Drive values with which the largest error over all offsets is least; see `minimax`."""
    for name, value in (("offsets", offsets), ("deviations", deviations)):
        if value is not None:
            raise InputError(GIVEN, file=m.file, key=name)
    if target is not None:
        raise InputError("the largest error is made least, and has no target", file=m.file, key="target")
    weight, low_high = _weights(m, weights), _ranges(m)
    drives, everywhere = np.clip(at.drives, *low_high), np.arange(len(at))
    begin = _largest(m, drives, at.poses, STARTS)
    before = np.stack([begin["position"], begin["rotation"]], axis=1)
    moves = np.isin(m.components, LENGTHS)
    by_size = np.tile([weight[moves].max(), weight[~moves].max()], (len(at), 1))
    if weights is None:
        # Neither size gets larger than it is without a correction.
        by_size = np.divide(by_size > 0.0, before, out=np.zeros_like(before), where=before > 0.0)
    asked = np.flatnonzero(by_size.any(axis=0))
    by_size = by_size[:, asked]
    measures = by_size[:, :, None] * np.stack([moves, ~moves])[asked]

    def weighed(found: Worst, some: PlaceIndices) -> Floats:
        sizes = np.stack([found["position"], found["rotation"]], axis=1)[:, asked] * by_size[some]
        return np.asarray(np.where(np.isfinite(sizes), sizes, np.inf).max(axis=1, initial=0.0))

    def look(drives: Floats, some: PlaceIndices, starts: int) -> tuple[Worst, Floats]:
        found = _largest(m, drives, at.poses[some], starts)
        return found, weighed(found, some)

    largest = weighed(begin, everywhere)
    offset = begin["offset"][:, asked]

    def errors(drives: Floats, some: PlaceIndices) -> tuple[Floats, Codes]:
        u = offset[some]
        each = np.repeat(np.arange(len(some)), u.shape[1])
        found = m.core.given(drives[each], at.poses[some][each], u.reshape(len(each), -1))
        status = found["status"].reshape(len(some), -1).max(axis=1)
        return found["error"].reshape(*u.shape[:2], -1), at.worse(status, some)

    best, iterations, settled = drives.copy(), np.zeros(len(at), np.int64), np.zeros(len(at), bool)
    active = np.flatnonzero(np.isfinite(largest))
    for _ in range(ROUNDS):
        if progress is not None:
            progress(len(at) - len(active), len(at))
        if not len(active):
            break
        found = least_largest(errors, drives[active], active, measures[active], drive_units(m), low_high)
        drives[active] = found.drives
        iterations[active] += found.iterations
        seen, size = look(drives[active], active, ON_THE_WAY)
        near = np.flatnonzero(size <= found.largest * (1.0 + MISSED))
        if len(near):
            # Only here is a thorough search worth its time.
            again, size[near] = look(drives[active[near]], active[near], STARTS)
            seen["offset"][near] = again["offset"]
        less = size < largest[active]
        best[active[less]], largest[active[less]] = drives[active[less]], size[less]
        done = size <= found.largest * (1.0 + MISSED)
        settled[active[done]] = True
        more = offset[:, : len(asked)].copy()
        more[active] = seen["offset"][:, asked]
        offset = np.concatenate([offset, more], axis=1)
        active = active[~done]
    end = _largest(m, best, at.poses, STARTS)
    ends = {"position": end["position"], "rotation": end["rotation"], "component": end["component"]}
    sizes = {**ends, "position_before": begin["position"], "rotation_before": begin["rotation"]}

    def at_largest(drives: Floats, found: Worst) -> Floats:
        return np.asarray(m.core.given(drives, at.poses, found["offset"][:, 0])["error"])

    correction = Correction(best, at_largest(best, end), at.worse(end["status"]), iterations, settled, largest=sizes)
    return _report(m, at, "worst", at_largest(at.drives, begin), correction, weight, _target(m, len(at), None))


def _largest(m: Mechanism, drives: Floats, poses: Floats, starts: int) -> Worst:
    """The largest errors at drive values, measured from nominal poses."""
    return without_singular(m.core.worst(drives, poses, starts, partly=True))


def corrected(
    m: Mechanism,
    *,
    corrects: str | None = None,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
    one_table: bool = False,
) -> Result:
    """`compensate` as others ask it: of the error under the load where there is one."""
    return compute_corrected(m, corrects=corrects, weights=weights, target=target, one_table=one_table)


def compute_corrected(
    m: Mechanism, *, corrects: str | None = None, at: Nominal | None = None, **options: Any
) -> Result:
    """The light form of `corrected`."""
    known = "loaded" if m.has_loads and options.get("target") is None else "given"
    return compute(m, corrects or known, at=at, **options)


def _corrected(
    m: Mechanism,
    errors: Errors,
    at: Nominal,
    weight: Floats,
    wanted: Floats,
    progress: Progress | None,
) -> Correction:
    """The best drives of all configurations, on whichever side of their play they act."""
    unit, ranges = drive_units(m), _ranges(m)
    rounding, gain = _rounding(m, weight)

    def search(begin: Floats, places: PlaceIndices, progress: Progress | None = None) -> LeastLargest:
        return _searched(errors, begin, places, weight, wanted, unit, ranges, rounding, progress)

    everywhere = np.arange(len(at))
    found = search(at.drives, everywhere, progress)
    inside = beyond_play(search, errors, found, unit, ranges, rounding, gain)
    error, status = errors(found.drives, everywhere)
    return Correction(found.drives, error, status, found.iterations, found.settled, inside)


def _rounding(m: Mechanism, weight: Floats) -> tuple[Floats, float]:
    """What of each component of an error is rounding, and of their weighted size."""
    rounding = ROUNDING * np.where(np.isin(m.components, LENGTHS), m.length, 1.0)
    return rounding, float(np.linalg.norm(weight * rounding))


def _searched(
    errors: Errors,
    begin: Floats,
    places: PlaceIndices,
    weight: Floats,
    wanted: Floats,
    unit: Floats,
    ranges: Floats,
    rounding: Floats,
    progress: Progress | None = None,
) -> LeastLargest:
    """Damped Gauss-Newton steps on some configurations at once; see the top of the file.

    Parameters
    ----------
    begin, places : ndarray
        Drives at which to begin, and of which configurations.
    unit : ndarray
        What makes steps of different drives comparable: one radian, or one characteristic length.
    ranges : ndarray
        Lowest and highest value of every drive, shape (2, drive).
    """
    drives, wanted = np.clip(begin, *ranges), wanted[places]
    everywhere = np.arange(len(drives))
    error, status = errors(drives, places)

    def size(e: Floats, at: PlaceIndices) -> Floats:
        norm = np.linalg.norm(weight * (e - wanted[at]), axis=1)
        return np.where(np.isfinite(norm), norm, np.inf)

    merit = size(error, everywhere)
    iterations = np.zeros(len(drives), dtype=np.int64)
    settled = np.zeros(len(drives), dtype=bool)
    slope = np.zeros((*error.shape, len(unit)))
    # Derivatives serve while steps shrink; `own` are those of the present place.
    own, renews = np.zeros(len(drives), dtype=bool), np.ones(len(drives), dtype=bool)
    last = np.full(len(drives), np.inf)
    active = np.flatnonzero(np.isfinite(merit))
    for _ in range(STEPS):
        if progress is not None:
            progress(len(drives) - len(active), len(drives))
        if not len(active):
            break
        new = active[renews[active]]
        if len(new):
            slope[new] = slopes(errors, drives[new], places[new], unit)
            # Rounding says nothing of where a drive that changes nothing should go.
            slope[new] *= ~does_not_act(slope[new], unit, rounding)[:, None]
            own[new], renews[new] = True, False
        step = np.zeros_like(drives)
        for k in active.tolist():
            outward = _step(slope[k], weight, error[k] - wanted[k], unit, drives[k], ranges)
            # Where the output hardly follows, the way to its target is long: as far as errors are linear, and no turns.
            outward *= min(1.0, FARTHEST / max(float(np.abs(outward / unit).max()), FARTHEST))
            step[k] = outward
        length = np.abs(step / unit).max(axis=1)
        active = active[np.isfinite(length[active])]
        still = active[length[active] <= STILL]
        # Where something is left that no step removes, the best drives are those by the derivatives of the place.
        removed = STILL * np.linalg.norm(weight[:, None] * slope[still] * unit, axis=(1, 2))
        settled[still[own[still] | (merit[still] <= removed)]] = True
        renews[still] = True
        searching, part = active[length[active] > STILL], 1.0
        while len(searching) and part >= SHORTEST:
            trial = _within(drives[searching] + part * step[searching], unit, ranges)
            found, outcome = errors(trial, places[searching])
            there, moved = size(found, searching), part * length[searching]
            # Near the least error it hardly changes, and the derivatives see more.
            shrinks = own[searching] & (moved <= NEAR) & (moved <= SHRUNK * last[searching])
            better = (there < merit[searching]) | (shrinks & (there <= merit[searching] * (1.0 + SAME)))
            done, moved = searching[better], moved[better]
            drives[done], error[done], status[done] = trial[better], found[better], outcome[better]
            merit[done] = there[better]
            iterations[done] += 1
            own[done] &= moved <= NEAR
            renews[done] = moved > SHRUNK * last[done]
            last[done] = moved
            # Derivatives of another place may lead nowhere better.
            renews[searching] |= ~better & ~own[searching]
            searching, part = searching[~better & own[searching]], 0.5 * part
        # Rounding, not contact, stops a search whose steps hardly change anything.
        settled[searching] = length[searching] < 1e3 * STILL
        active = active[~settled[active] & ~np.isin(active, searching)]
    for row in np.flatnonzero(~settled & np.isfinite(merit))[:, None]:
        # Where much is left the curvature of the errors decides as much as their derivatives.
        k = row[0]
        nearer, count, settled[k] = _descended(errors, places[row], drives[k], weight, wanted[k], unit, ranges)
        iterations[k] += count
        found, outcome = errors(nearer[None], places[row])
        if size(found, row)[0] < merit[k]:
            drives[k], error[k], status[k] = nearer, found[0], outcome[0]
    return LeastLargest(drives, merit, status, iterations, settled)


def _descended(
    errors: Errors, row: PlaceIndices, drives: Floats, weight: Floats, wanted: Floats, unit: Floats, ranges: Floats
) -> tuple[Floats, int, bool]:
    """Drives of one configuration by a quasi-Newton method, its steps, and whether nothing near leaves less."""
    from scipy.optimize import minimize

    def seen(x: Floats) -> tuple[Floats, Floats]:
        """What is left, and its derivatives."""
        here = _within(x[None] * unit, unit, ranges)
        gap = weight * (errors(here, row)[0][0] - wanted)
        return gap, weight[:, None] * slopes(errors, here, row, unit)[0] * unit

    begin = max(float(np.linalg.norm(weight * (errors(drives[None], row)[0][0] - wanted))), 1e-300)

    def left(x: Floats) -> tuple[float, Floats]:
        """As a part of what is left at the beginning: the search ends by differences of such numbers."""
        gap, slope = seen(x)
        size = float(np.linalg.norm(gap))
        # No mechanism there: as far away as to be left at once.
        if not np.isfinite(size):
            return 1e300, np.zeros(len(unit))
        return size / begin, slope.T @ gap / max(size, 1e-300) / begin

    ends = ranges.T / unit[:, None]
    # What changes by less is rounding.
    options = {"ftol": SAME, "gtol": 0.0}
    found = minimize(left, drives / unit, jac=True, method="L-BFGS-B", bounds=ends, options=options)
    gap, slope = seen(found.x)
    gradient = slope.T @ gap / max(float(np.linalg.norm(gap)), 1e-300)
    free = np.where(gradient > 0.0, found.x > ends[:, 0], found.x < ends[:, 1])
    least = bool(np.abs(np.where(free, gradient, 0.0)).max() <= LEVEL * np.linalg.norm(slope))
    return _within(found.x[None] * unit, unit, ranges)[0], int(found.nit), least


def _step(slopes: Floats, weight: Floats, gap: Floats, unit: Floats, drives: Floats, ranges: Floats) -> Floats:
    """The step of least norm; where it would leave a range, the one within all ranges that leaves least."""
    if not np.isfinite(slopes).all():
        return np.full_like(drives, np.nan)
    matrix, right = weight[:, None] * slopes * unit, -weight * gap
    low, high = (ranges - drives) / unit
    step = np.linalg.lstsq(matrix, right, rcond=1e-9)[0]
    if not ((low <= step) & (step <= high)).all():
        from scipy.optimize import lsq_linear

        # Of steps that leave as much a short one.
        held = SHORT * np.linalg.norm(matrix) * np.eye(len(drives))
        rows, right = np.vstack([matrix, held]), np.append(right, np.zeros(len(drives)))
        step = lsq_linear(rows, right, (low, np.maximum(high, low + STILL)), method="bvls", tol=1e-14).x
    return np.asarray(unit * step)


def _within(drives: Floats, unit: Floats, ranges: Floats) -> Floats:
    """Drives within their ranges; those at an end are there without rounding."""
    for end in ranges:
        drives = np.where(np.abs(drives - end) <= STILL * unit, end, drives)
    return np.asarray(np.clip(drives, *ranges))


def _errors(m: Mechanism, at: Nominal, question: str, offsets: Any, deviations: Mapping[str, Any] | None) -> Errors:
    if question == "given":
        u = parameters(m, len(at), {} if offsets is None else offsets, deviations or {})

        def by_offsets(drives: Floats, places: PlaceIndices) -> tuple[Floats, Codes]:
            found = m.core.given(drives, at.poses[places], u[places])
            return found["error"], at.worse(found["status"], places)

        return by_offsets
    require_known(question, asked_by("compensate"), "an error that drives can correct")
    if offsets is not None or deviations is not None:
        raise InputError(GIVEN, file=m.file, key="offsets")
    require_loads(m, "; or correct known deviations alone, by an offset of zero (--offset NAME=0,0; question 'given')")
    loads = loads_of(m, at)

    def by_load(drives: Floats, places: PlaceIndices) -> tuple[Floats, Codes]:
        own = None if loads is None else loads[places]
        found = m.core.loaded(drives, at.poses[places], offset=False, details=False, loads=own)
        return found["error"], at.worse(found["status"], places)

    return by_load


def _weights(m: Mechanism, weights: tuple[float, float] | None) -> Floats:
    """Metres per metre and per radian, of every component."""
    if weights is None:
        position, rotation = 1.0, 0.0 if len(m.drives) < len(m.components) else m.length
    else:
        if len(weights) != 2 or not all(np.isfinite(w) and w >= 0 for w in weights) or not any(weights):
            problem = f"two weights, position and rotation, not negative and not both zero; here {shown(list(weights))}"
            raise InputError(problem, key="weights")
        array_of(weights, "", "weights")
        position, rotation = float(weights[0]), float(weights[1]) * m.units.length
    return np.array([position if c in LENGTHS else rotation for c in m.components])


def _target(m: Mechanism, count: int, target: Any) -> Floats:
    wanted = np.zeros((count, len(m.components)))
    if target is None:
        return wanted
    array = array_of(target, m.file, "target")
    width = array.shape[-1] if array.ndim else 0
    lengths, _ = split(list(m.components))
    widths = (len(lengths), len(m.components))
    if array.ndim not in (1, 2) or width not in widths or (array.ndim == 2 and len(array) != count):
        names = f"{', '.join(lengths)} or {', '.join(m.components)}"
        problem = f"needs {names} for all or each of the {count} configurations; here the shape is {array.shape}"
        raise InputError(problem, file=m.file, key="target")
    wanted[:, :width] = array * m.component_factors[:width]
    return wanted


def _ranges(m: Mechanism) -> Floats:
    free = (-np.inf, np.inf)
    return np.array([m.limits.drives.get(name, free) for name in m.drives]).T


def _add_between(m: Mechanism, builder: ResultBuilder, at: Nominal, drives: Floats) -> None:
    """Add what is left half-way to the next configuration, with corrected drives on a straight line to it."""
    question = builder.attrs["corrects"]
    if question == "given" or len(at) < 2 or motion_of(m, at) is not None:
        return
    middle = at_drives(m, (at.drives[:-1] + at.drives[1:]) / 2.0)
    corrected = (drives[:-1] + drives[1:]) / 2.0
    lengths = np.isin(m.components, LENGTHS)
    if question == "worst":
        found = _largest(m, corrected, middle.poses, ON_THE_WAY)
        sizes = [found["position"], found["rotation"]]
    else:
        error, _ = _errors(m, middle, "loaded", None, None)(corrected, np.arange(len(middle)))
        sizes = [np.linalg.norm(error[:, some], axis=1) for some in (lengths, ~lengths)]
    both = at.counts[:-1] & at.counts[1:]
    for name, kind, size in zip(("position", "rotation"), ("length", "angle"), sizes, strict=True):
        values = np.append(np.where(both, size, np.nan), np.nan)
        words = f"{name} error half-way to the next configuration, with corrected drives in between"
        builder.add(f"between_{name}", "configuration", values, words, kind)


def _report(
    m: Mechanism,
    at: Nominal,
    question: str,
    before: Floats,
    found: Correction,
    weight: Floats,
    wanted: Floats,
    **attrs: str | int | float,
) -> Result:
    of_load = question == "loaded"
    builder = report(m, "compensate", at, corrects=question, **attributes(m), **(speeds(m) if of_load else {}), **attrs)
    builder.attrs["weight_position"] = float(weight[0])
    builder.attrs["weight_rotation"] = float(weight[-1]) / m.units.length
    pose, drive = ("configuration", "component"), ("configuration", "drive")
    known = np.isfinite(found.error).all(axis=1, keepdims=True)
    corrected = np.where(~known, np.nan, found.drives)
    builder.add("drive_nominal", drive, at.drives, "drive value as commanded", "drive")
    builder.add("drive_corrected", drive, corrected, "corrected drive value", "drive")
    builder.add("correction", drive, corrected - at.drives, "corrected - nominal drive value", "drive")
    there = " at the largest position error" if found.largest else ""
    builder.add("error", pose, before, f"error with the drives as commanded{there}", "component")
    builder.add("residual", pose, found.error, f"error with the drives corrected{there}", "component")
    builder.add("target", pose, wanted, "error to reach", "component")
    if of_load:
        loads = loads_of(m, at)
        half = m.core.loaded(found.drives, at.poses, loads=loads)["undetermined"]
        words = "half-width of the indeterminacy that the load leaves with the drives corrected"
        builder.add("residual_undetermined", pose, half, words, "component")
        if (motion := motion_of(m, at)) is not None:
            add_contact(m, builder, at, motion)
    _add_between(m, builder, at, found.drives)
    lengths = np.isin(m.components, LENGTHS)
    for name, kind, some in (("position", "length", lengths), ("rotation", "angle", ~lengths)):
        sizes = [np.linalg.norm(error[:, some], axis=1) for error in (before, found.error)]
        first, last = (found.largest.get(key, size) for key, size in zip((f"{name}_before", name), sizes, strict=True))
        words = f"largest {name} error" if found.largest else f"{name} error"
        builder.add(f"error_{name}", "configuration", first, f"{words} with the drives as commanded", kind)
        builder.add(f"residual_{name}", "configuration", last, f"{words} with the drives corrected", kind)
    if found.largest:
        words = "lowest and highest error of the component with the drives corrected"
        sides = ("configuration", "component", "side")
        builder.add("residual_component", sides, found.largest["component"], words, "component")
    low, high = _ranges(m)
    builder.add("at_limit", drive, (corrected <= low) | (corrected >= high), "whether the range holds the drive")
    if found.inside is not None:
        words = "whether the drive is inside its play with the drives corrected, where it does not act"
        builder.add("inside_play", drive, found.inside, words)
    builder.add("settled", "configuration", found.settled, "whether the correction has converged")
    builder.add("iterations", "configuration", found.iterations, "steps made")
    judge(builder)
    builder.status(found.status)
    return builder.result()
