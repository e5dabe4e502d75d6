"""Readings that cannot be of the mechanism as the file describes it, and the slip that would explain them.

A column is far off where half of its readings are missed by more than `FAR` standard deviations of what the file's
statistics and the noise allow. Units, signs and the order of columns are tried; the one that fits is named.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from jointplay.analyses.readings import ReadingModel, Readings
from jointplay.basics.arrays import Floats
from jointplay.basics.units import ANGLES, LENGTHS
from jointplay.errors import InputError

from .fit import Fitter

FAR = 20.0
#: part of what was missed that a slip has to leave
EXPLAINED = 0.1
#: rows and columns with which slips are tried
MOST_ROWS, MOST_COLUMNS = 40, 12


@dataclass(frozen=True)
class _Slip:
    """What may have happened, in words, and the readings without it."""

    words: str
    readings: Readings


def require_own(fitter: Fitter) -> None:
    """Refuse readings of another machine, or in other units.

    Raises
    ------
    InputError
        Naming the column, how far it is off, and what would fit.
    """
    readings = fitter.readings
    if fitter.frame_columns and not fitter.start.frame_found:
        # Until the frame is fitted nothing says where readings are.
        return
    missed = _missed(fitter, fitter.model, readings)
    worst = int(np.nanargmax(missed))
    if not missed[worst] > FAR:
        return
    channel = readings.channels[worst]
    unit, name = (
        getattr(fitter.unknowns.m.units, channel.kind),
        getattr(fitter.unknowns.m.units, f"{channel.kind}_name"),
    )
    residual = fitter.model.compare(
        readings.values, fitter.model.read(_u(fitter), fitter.start.frame, derivatives=False)
    )
    away = float(np.nanmedian(np.abs(residual[:, worst]))) / unit
    far = f"half of the readings are off by more than {away:.3g} {name}, {missed[worst]:.3g} times what the file allows"
    few = readings.chosen(np.unique(np.linspace(0, len(readings) - 1, MOST_ROWS).astype(int)))
    best, left = "", max(FAR, EXPLAINED * missed[worst])
    for slip in _slips(fitter, few):
        try:
            model = fitter.model if slip.readings is few else ReadingModel(fitter.unknowns.m, slip.readings)
            now = float(np.nanmax(_missed(fitter, model, slip.readings)))
        except InputError:
            continue
        if now < left:
            best, left = slip.words, now
    if not best and _fits_in_a_frame(fitter, few, left):
        best = "the measuring device has axes of its own: frame unknown"
    hint = f"they fit if {best}" if best else "is it this machine, in these units, signs and axes?"
    raise readings.sheet.refuse(f"{far}: {hint}", channel.name)


def _fits_in_a_frame(fitter: Fitter, readings: Readings, left: float) -> bool:
    """Whether readings are those of the mechanism at another place."""
    if fitter.frame_columns:
        return False
    moved = Fitter(fitter.unknowns, readings, frame=True, zeroed=fitter.zeroed, scattered=fitter.scattered)
    return moved.start.frame_found and float(np.nanmax(_missed(moved, moved.model, readings))) < left


def _u(fitter: Fitter) -> Floats:
    return fitter.unknowns.of_parameters(fitter.mean)


def _missed(fitter: Fitter, model: ReadingModel, readings: Readings) -> Floats:
    """Of every column the median of what is missed, in standard deviations before anything is fitted."""
    read = model.read(_u(fitter), fitter.start.frame)
    residual = model.compare(readings.values, read)
    for k in fitter.zeroed:
        residual[:, k] -= np.nanmedian(residual[:, k])
    variance = readings.sigma**2 + np.diagonal(model.play(read), axis1=1, axis2=2)
    for one in fitter.unknowns.unknowns:
        if not one.of_file and np.isfinite(one.sigma):
            variance = variance + (read.by_parameter[:, :, one.parameter] * one.sigma) ** 2
    free = any(not np.isfinite(one.sigma) for one in fitter.unknowns.unknowns)
    known = np.isfinite(residual).any(axis=0)
    found = np.zeros(residual.shape[1])
    # Without a prior anything may be.
    if not free:
        found[known] = np.nanmedian(np.abs(residual[:, known]) / np.sqrt(variance[:, known]), axis=0)
    return found


def _slips(fitter: Fitter, readings: Readings) -> Iterator[_Slip]:
    m, channels = fitter.unknowns.m, readings.channels
    for kind, known in (("length", LENGTHS), ("angle", ANGLES)):
        own = [k for k, channel in enumerate(channels) if channel.kind == kind]
        usual = getattr(m.units, f"{kind}_name")
        for name, factor in known.items():
            for group in ([own] if len(own) > 1 else []) + [[k] for k in own[:MOST_COLUMNS]]:
                said = {readings.sheet.columns[channels[k].name].unit or usual for k in group}
                if len(said) == 1 and name not in said:
                    values = readings.values.copy()
                    values[:, group] *= factor / known[next(iter(said))]
                    which = "all lengths" if kind == "length" and len(group) > 1 else _names(readings, group)
                    yield _Slip(f"{which} are in {name}, not {next(iter(said))}", replace(readings, values=values))
        for k in own[:MOST_COLUMNS]:
            values = readings.values.copy()
            values[:, k] *= -1.0
            yield _Slip(f"{channels[k].name} has the other sign", replace(readings, values=values))
            for other in own[:MOST_COLUMNS]:
                if other < k:
                    values = readings.values.copy()
                    values[:, [k, other]] = values[:, [other, k]]
                    words = f"{channels[other].name} and {channels[k].name} are exchanged"
                    yield _Slip(words, replace(readings, values=values))
    yield from _of_drives(fitter, readings)


def _of_drives(fitter: Fitter, readings: Readings) -> Iterator[_Slip]:
    m = fitter.unknowns.m
    kinds = [m.coordinate_kind(joint) for joint in m.drive_joints]
    angular = [k for k, kind in enumerate(kinds) if kind == "angle"]
    for group, factor, words in (
        (angular, 1.0 / ANGLES["deg"], "drive values are in rad, not deg"),
        (angular, ANGLES["deg"], "drive values are in deg, not rad"),
        ([k for k in range(len(kinds)) if k not in angular], 1000.0, "drive values are in m, not mm"),
        ([k for k in range(len(kinds)) if k not in angular], 0.001, "drive values are in mm, not m"),
    ):
        if group:
            drives = readings.drives.copy()
            drives[:, group] *= factor
            yield _Slip(words, replace(readings, drives=drives))
    for k in range(min(len(kinds), MOST_COLUMNS)):
        drives = readings.drives.copy()
        drives[:, k] *= -1.0
        yield _Slip(f"drive {m.drives[k]} has the other sign", replace(readings, drives=drives))
        for other in range(k):
            drives = readings.drives.copy()
            drives[:, [k, other]] = drives[:, [other, k]]
            yield _Slip(f"drives {m.drives[other]} and {m.drives[k]} are exchanged", replace(readings, drives=drives))


def _names(readings: Readings, group: list[int]) -> str:
    return " and ".join(readings.channels[k].name for k in group)
