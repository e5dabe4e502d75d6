"""`compensate`: drive values that bring the output back as near as they can.

    dq = -(W J)^+ W (E(q) - target),   q <- q + dq,   J = dE/dq

E is the error of the non-linear model at the drives q, found anew at every step, so that a load may move its contacts.
A step counts only when it makes |W (E - target)| smaller: where contact flips back and forth the best drives met are
kept. W weighs lengths against angles. What no drive can remove is what remains of E.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Codes, Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, shown
from jointplay.model.gaps import attributes
from jointplay.model.mechanism import Mechanism
from jointplay.questions import asked_by, require_known
from jointplay.result import Result, split, to_dataset
from jointplay.result.verdict import judge

from . import worst
from .given import OF_WORST
from .loaded import loads_of, require_loads
from .nominal import Nominal, nominal, report
from .offsets import Offsets, array_of, parameters
from .recorded import recorded
from .running import add_contact, drive_units, motion_of, speeds
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr

STEPS = 40
#: shortest part of a step that is tried
SHORTEST = 2.0**-10
#: a step (radians, characteristic lengths) below this is none
STILL = 1e-11
#: the longest step (radians, characteristic lengths)
FARTHEST = 0.5
#: half the distance of the drive values whose errors give J; its square is the error of J
PROBE = 1e-5

PlaceIndices = NDArray[np.intp]
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
) -> xr.Dataset:
    """Correct the drives so that the output returns as near as possible to its nominal pose.

    Parameters
    ----------
    m : Mechanism
    question : {"loaded", "given"}
        Which error is corrected.
    offsets, deviations : optional
        As for `given`; with that question only. Without them and without a `target` they are those of the largest
        position error of the worst case.
    weights : (float, float), optional
        Weights of position and rotation: a position error counts as many times its length, a rotation as
        many times the arc it makes at the radius `weights[1]`, in the length unit of the file per radian. Default:
        (1, 0) with fewer drives than the output has components, else (1, characteristic length).
    target : array, optional
        Error to reach in place of zero: (x, y) or (x, y, angle), in space (x, y, z) or (x, y, z, rx, ry, rz), for all
        or for each configuration. With ``"given"`` and no offsets this is the inverse kinematics of a displaced output
        point.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `drive_nominal`, `drive_corrected` and `correction` (along `drive`), `error` (before),
        `residual` (after: what no drive can remove), `residual_position`, `residual_rotation` (sizes), of `loaded`
        `residual_undetermined` (half-width of what the load leaves open after), `target` (the error to reach), `limit`,
        `limit_met` and `margin` (whether and by how much what is left keeps to the limits of the file; what differs
        from the target counts), `at_limit` (drives held by their range in the file), `settled` (whether the correction
        has converged; elsewhere contact alternates between two sides, and the best drives found are given),
        `iterations`, `nominal`, `status` (of the corrected mechanism). Where drives have speeds `contact_rate`,
        `contact` and `transit_time` as of `loaded`.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.compensate(jp.loads(jp.examples.text("four-bar")))
    >>> result.drive_corrected[0].item() > result.theta1[0].item()
    True
    """
    return to_dataset(compute(m, question, offsets, deviations, weights=weights, target=target))


@dataclass(frozen=True)
class Correction:
    """Corrected drives of all configurations, SI."""

    drives: Floats
    error: Floats
    status: Codes
    iterations: NDArray[np.int64]
    settled: NDArray[np.bool_]


@recorded
@of_each(lambda given: given["question"] == "loaded")
def compute(
    m: Mechanism,
    question: str = "loaded",
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    *,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
    at: Nominal | None = None,
) -> Result:
    """The light form of `compensate`."""
    if not m.drives:
        raise InputError("a mechanism without drives has nothing to correct", file=m.file, key="drives")
    at = (at or nominal(m)).with_errors
    of_worst = question == "given" and offsets is None and deviations is None and target is None
    if of_worst:
        offsets = worst.compute(m, at=at).get("worst_offset", extreme="position")
    errors = _errors(m, at, question, offsets, deviations)
    weight = _weights(m, weights)
    wanted = _target(m, len(at), target)
    before, _ = errors(at.drives, np.arange(len(at)))
    correction = correct(errors, at, weight, wanted, drive_units(m), _ranges(m))
    result = _report(m, at, question, before, correction, weight, wanted)
    return replace(result, attrs={**result.attrs, "offsets_of": OF_WORST}) if of_worst else result


def corrected(
    m: Mechanism,
    *,
    corrects: str | None = None,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
) -> Result:
    """`compensate` as others ask it: of the error under the load where there is one."""
    return compute_corrected(m, corrects=corrects, weights=weights, target=target)


def compute_corrected(
    m: Mechanism, *, corrects: str | None = None, at: Nominal | None = None, **options: Any
) -> Result:
    """The light form of `corrected`."""
    known = "loaded" if m.has_loads and options.get("target") is None else "given"
    return compute(m, corrects or known, at=at, **options)


def correct(errors: Errors, at: Nominal, weight: Floats, wanted: Floats, unit: Floats, ranges: Floats) -> Correction:
    """Damped Gauss-Newton steps on all configurations at once; see the top of the file.

    Parameters
    ----------
    unit : ndarray
        What makes steps of different drives comparable: one radian, or one characteristic length.
    ranges : ndarray
        Lowest and highest value of every drive, shape (2, drive).
    """
    low, high = ranges
    drives = np.clip(at.drives, low, high)
    everywhere = np.arange(len(drives))
    error, status = errors(drives, everywhere)

    def size(e: Floats, at: PlaceIndices) -> Floats:
        norm = np.linalg.norm(weight * (e - wanted[at]), axis=1)
        return np.where(np.isfinite(norm), norm, np.inf)

    merit = size(error, everywhere)
    iterations = np.zeros(len(drives), dtype=np.int64)
    settled = np.zeros(len(drives), dtype=bool)
    active = np.flatnonzero(np.isfinite(merit))
    for _ in range(STEPS):
        if not len(active):
            break
        slopes = _slopes(errors, drives[active], active, unit)
        step = np.zeros_like(drives)
        for k, slope in zip(active.tolist(), slopes, strict=True):
            outward = _step(slope, weight, error[k] - wanted[k], unit, drives[k], ranges)
            # Where the output hardly follows, the way to its target is long: as far as errors are linear, and no turns.
            outward *= min(1.0, FARTHEST / max(float(np.abs(outward / unit).max()), FARTHEST))
            step[k] = np.clip(drives[k] + outward, low, high) - drives[k]
        length = np.abs(step / unit).max(axis=1)
        settled[active] = length[active] <= STILL
        active = active[length[active] > STILL]  # not where there is no step, nan
        searching, part = active, 1.0
        while len(searching) and part >= SHORTEST:
            trial = drives[searching] + part * step[searching]
            found, outcome = errors(trial, searching)
            better = size(found, searching) < merit[searching]
            done = searching[better]
            drives[done], error[done], status[done] = trial[better], found[better], outcome[better]
            merit[done] = size(found, searching)[better]
            iterations[done] += 1
            searching, part = searching[~better], 0.5 * part
        # Rounding, not contact, stops a search whose steps hardly change anything.
        settled[searching] = length[searching] < 1e3 * STILL
        active = active[~np.isin(active, searching)]
    return Correction(drives, error, status, iterations, settled)


def _slopes(errors: Errors, drives: Floats, places: PlaceIndices, unit: Floats) -> Floats:
    """dE/dq by central differences of the non-linear model, shape (place, component, drive)."""
    half = PROBE * unit
    shifts = np.concatenate([np.diag(half), -np.diag(half)])
    # All at once, because the core solves many in little more time than one.
    found, _ = errors((shifts[:, None] + drives).reshape(-1, len(unit)), np.tile(places, len(shifts)))
    above, below = found.reshape(2, len(unit), len(places), -1)
    return np.moveaxis((above - below) / (2.0 * half[:, None, None]), 0, -1)


def _step(slopes: Floats, weight: Floats, gap: Floats, unit: Floats, drives: Floats, ranges: Floats) -> Floats:
    """The step of least norm; drives that it would push out of their range stay where they are."""
    if not np.isfinite(slopes).all():
        return np.full_like(drives, np.nan)
    free = np.ones(len(drives), dtype=bool)
    while True:
        matrix = weight[:, None] * slopes * unit * free
        step: Floats = unit * free * np.linalg.lstsq(matrix, -weight * gap, rcond=1e-9)[0]
        out = free & (((drives <= ranges[0]) & (step < 0)) | ((drives >= ranges[1]) & (step > 0)))
        if not out.any():
            return step
        free &= ~out


def _errors(m: Mechanism, at: Nominal, question: str, offsets: Any, deviations: Mapping[str, Any] | None) -> Errors:
    if question == "given":
        u = parameters(m, len(at), {} if offsets is None else offsets, deviations or {})

        def by_offsets(drives: Floats, places: PlaceIndices) -> tuple[Floats, Codes]:
            found = m.core.given(drives, at.poses[places], u[places])
            return found["error"], at.worse(found["status"], places)

        return by_offsets
    require_known(question, asked_by("compensate"), "an error that drives can correct")
    if offsets is not None or deviations is not None:
        raise InputError("offsets are given; ask for the question 'given'", file=m.file, key="offsets")
    require_loads(m, "; or correct known deviations alone, by an offset of zero (--offset NAME=0,0; question 'given')")
    loads = loads_of(m, at)

    def by_load(drives: Floats, places: PlaceIndices) -> tuple[Floats, Codes]:
        found = m.core.loaded(drives, at.poses[places], loads=None if loads is None else loads[places])
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


def _report(
    m: Mechanism, at: Nominal, question: str, before: Floats, found: Correction, weight: Floats, wanted: Floats
) -> Result:
    builder = report(
        m, "compensate", at, corrects=question, **attributes(m), **(speeds(m) if question == "loaded" else {})
    )
    builder.attrs["weight_position"] = float(weight[0])
    builder.attrs["weight_rotation"] = float(weight[-1]) / m.units.length
    pose, drive = ("configuration", "component"), ("configuration", "drive")
    known = np.isfinite(found.error).all(axis=1, keepdims=True)
    corrected = np.where(~known, np.nan, found.drives)
    builder.add("drive_nominal", drive, at.drives, "drive value as commanded", "drive")
    builder.add("drive_corrected", drive, corrected, "corrected drive value", "drive")
    builder.add("correction", drive, corrected - at.drives, "corrected - nominal drive value", "drive")
    builder.add("error", pose, before, "error with the drives as commanded", "component")
    builder.add("residual", pose, found.error, "error with the drives corrected", "component")
    builder.add("target", pose, wanted, "error to reach", "component")
    if question == "loaded":
        loads = loads_of(m, at)
        half = m.core.loaded(found.drives, at.poses, loads=loads)["undetermined"]
        words = "half-width of the indeterminacy that the load leaves with the drives corrected"
        builder.add("residual_undetermined", pose, half, words, "component")
        if (motion := motion_of(m, at)) is not None:
            add_contact(m, builder, at, motion)
    lengths = np.isin(m.components, LENGTHS)
    position = np.linalg.norm(found.error[:, lengths], axis=1)
    builder.add("residual_position", "configuration", position, "position error with the drives corrected", "length")
    rotation = np.linalg.norm(found.error[:, ~lengths], axis=1)
    builder.add("residual_rotation", "configuration", rotation, "rotation with the drives corrected", "angle")
    low, high = _ranges(m)
    builder.add("at_limit", drive, (corrected <= low) | (corrected >= high), "whether the range holds the drive")
    builder.add("settled", "configuration", found.settled, "whether the correction has converged")
    builder.add("iterations", "configuration", found.iterations, "steps made")
    judge(builder)
    builder.status(found.status)
    return builder.result()
