"""Readings by the names of a mechanism: drive values, measured values and their standard deviations, SI.

q1 [deg], ...            drive values; or `configuration`, the number of one of the file, from 0
x [mm], jaw.y, ...       what was measured, see `channels`
load_case                which load case acted; empty: none
approach                 readings of one number are of one approach, so that they have the play in common
side                     forward or backward: from which side the drives came; empty: not said. Forward, all of them
                         rise; joints that rub slide as they do along the path where a row is of a configuration
sigma_x [mm], ...        standard deviation of a single reading
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses import friction
from jointplay.analyses.nominal import nominal
from jointplay.analyses.running import drive_units, motion_of
from jointplay.basics import units
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.readings import ReadingSheet, sheet
from jointplay.model.mechanism import Mechanism
from jointplay.result.build import Labels

from .channels import Channel, channel, names_of, unknown

CONFIGURATION, LOAD_CASE, APPROACH, SIDE, SIGMA = "configuration", "load_case", "approach", "side", "sigma_"
#: what `side` may say, with its sign
SIDES = {"forward": 1, "backward": -1, "": 0}
#: columns that say where and how, not what was read
SPECIAL = (CONFIGURATION, LOAD_CASE, APPROACH, SIDE)
#: the noise follows from repeated readings
AUTO = "auto"
#: repeated readings beyond the first of each place from which on their scatter says how large the noise is
FEWEST_REPEATS = 10
#: no reading is more exact, SI: below it squares of standard deviations are no numbers any more
FINEST = 1e-100
#: part of the largest drive value within which two are the same
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Readings:
    """What was read, row by row."""

    #: where it is from
    sheet: ReadingSheet
    #: the measured columns
    channels: tuple[Channel, ...]
    #: drive values, SI, shape (row, drive)
    drives: Floats
    #: what was read, SI, shape (row, channel); nan where nothing was
    values: Floats
    #: standard deviation of each, of the same shape
    sigma: Floats
    #: the load case of each row; empty where none of them acted
    cases: tuple[str, ...]
    #: number of the approach of each row: rows that have it in common are of one place
    approaches: NDArray[np.int64]
    #: 1 forward, -1 backward, 0 where it is not said
    sides: NDArray[np.int64]
    #: how the drives move forward where joints rub, of the same shape as `drives`
    ways: Floats
    #: standard deviation of every drive from approach to approach, SI, shape (row, drive)
    drive_sigma: Floats
    #: repeated readings that the least known standard deviation is from; 0 where all are given
    repeats: int = 0

    def __len__(self) -> int:
        return len(self.values)

    @property
    def names(self) -> list[str]:
        """What the measured columns are called."""
        return [one.name for one in self.channels]

    @property
    def axis(self) -> Labels:
        """The measured columns as a dimension of a result."""
        return Labels(tuple(self.names), tuple(one.kind for one in self.channels))

    @property
    def lines(self) -> list[int]:
        """Number of every row as its table counts them."""
        return list(self.sheet.lines)

    @property
    def given(self) -> NDArray[np.bool_]:
        """Which cells have a reading, shape (row, channel)."""
        return np.isfinite(self.values)

    def chosen(self, rows: NDArray[np.int64]) -> Readings:
        """Some of the rows."""
        lines = [self.sheet.lines[row] for row in rows]
        columns = {
            name: replace(column, cells=[column.cells[row] for row in rows])
            for name, column in self.sheet.columns.items()
        }
        return Readings(
            ReadingSheet(self.sheet.name, columns, lines),
            self.channels,
            self.drives[rows],
            self.values[rows],
            self.sigma[rows],
            tuple(self.cases[row] for row in rows),
            self.approaches[rows],
            self.sides[rows],
            self.ways[rows],
            self.drive_sigma[rows],
        )


def require_whole(m: Mechanism) -> None:
    """Refuse a mechanism of which one output or load case is chosen."""
    if m.chosen != (None, None):
        raise InputError("readings are of the whole file; columns say of which output, rows of which load case")


def readings(
    m: Mechanism,
    source: str | os.PathLike[str] | Mapping[str, Any],
    sigma: Mapping[str, float] | str | None = None,
) -> Readings:
    """Read a table of a mechanism.

    Parameters
    ----------
    source : path or mapping
        A file, or columns by name.
    sigma : mapping or "auto", optional
        Standard deviations in units of the file, by the name of a column, of a component, or ``length`` and ``angle``;
        of a drive how it scatters from approach to approach. Or ``auto``: those of repeated readings. Columns
        ``sigma_NAME`` of the table come first.

    Raises
    ------
    InputError
        When a column or a value is not valid; the message names the table, the row and the column.
    """
    table = sheet(source)
    return _Reader(m, table).readings(sigma)


class _Reader:
    """Makes numbers of one table."""

    def __init__(self, m: Mechanism, table: ReadingSheet) -> None:
        self.m, self.table = m, table
        self.channels: list[Channel] = []
        for name in table.columns:
            if name in (*m.drives, *SPECIAL):
                continue
            if name.startswith(SIGMA) and name.removeprefix(SIGMA) in (*table.columns, *m.drives):
                continue
            try:
                found = channel(m, name)
            except InputError as error:
                raise table.refuse(error.problem, name) from None
            if found is None:
                special = (*SPECIAL, *(f"{SIGMA}{one.name}" for one in self.channels))
                raise table.refuse(unknown(m, name, (*m.drives, *special)), name)
            self.channels.append(found)
        if not self.channels:
            raise table.refuse(f"nothing is measured: name a column {listed(names_of(m))}")
        self._require_rotations()

    def readings(self, sigma: Mapping[str, float] | str | None) -> Readings:
        table = self.table
        drives = self._drives()
        values = np.column_stack([self._in_si(one.name, one.kind) for one in self.channels])
        cases = self._cases()
        approaches = self._approaches(drives, cases)
        found = Readings(
            table,
            tuple(self.channels),
            drives,
            values,
            np.ones_like(values),
            cases,
            approaches,
            self._sides(),
            self._ways(len(drives)),
            np.zeros_like(drives),
        )
        found = found.chosen(np.flatnonzero(found.given.any(axis=1)))
        if not len(found):
            raise table.refuse("no cell of a measured column has a value")
        self._refuse_copies(found)
        if sigma == AUTO:
            deviations, repeats = self._auto(found)
            return replace(found, sigma=deviations, repeats=repeats, drive_sigma=self._of_drives(found, {}))
        if isinstance(sigma, str):
            raise InputError(f"{shown(sigma)} is neither 'auto' nor numbers by name, such as x=0.002", key="sigma")
        given = dict(sigma or {})
        return replace(found, drive_sigma=self._of_drives(found, given), sigma=self._sigma(found, given))

    def _require_rotations(self) -> None:
        """A rotation vector is no vector of three numbers that are read by themselves."""
        turns = [one for one in self.m.components if one not in LENGTHS and len(self.m.components) == 6]
        by_point: dict[str, set[str]] = {}
        for one in self.channels:
            if one.form == "component" and self.m.components[one.component] in turns:
                by_point.setdefault(one.points[0], set()).add(self.m.components[one.component])
        for point, found in by_point.items():
            if len(found) < len(turns):
                raise self.table.refuse(f"a rotation of '{point}' has {listed(turns)}; here is only {listed(found)}")

    def _in_si(self, name: str, kind: str, table: ReadingSheet | None = None) -> Floats:
        """A column of the table, or of some of its rows; its unit, or that of the file."""
        table = table or self.table
        known = units.LENGTHS if kind == "length" else units.ANGLES
        unit = table.columns[name].unit or getattr(self.m.units, f"{kind}_name")
        if unit not in known:
            what = "a length" if kind == "length" else "an angle"
            raise table.refuse(f"its unit: {not_known(unit, f'a unit of {what}', known)}", name)
        return np.array(table.numbers(name)) * known[unit]

    def _drives(self) -> Floats:
        m, table = self.m, self.table
        count = len(table.lines)
        if CONFIGURATION in table.columns:
            if both := [name for name in m.drives if name in table.columns]:
                raise table.refuse(f"give drive values or '{CONFIGURATION}', not both; here is {listed(both)}")
            return self._of_configurations()
        held = self._held()
        columns: list[Floats] = []
        for k, name in enumerate(m.drives):
            if name in table.columns:
                values = self._in_si(name, m.coordinate_kind(m.drive_joints[k]))
                self._require_values(name, values)
                columns.append(values)
            elif name in held:
                columns.append(np.full(count, held[name]))
            else:
                problem = f"a column for drive '{name}' is missing, or '{CONFIGURATION}'; columns: "
                raise table.refuse(problem + listed(table.columns))
        drives = np.column_stack(columns) if columns else np.zeros((count, 0))
        self._check_ranges(drives)
        return drives

    def _held(self) -> dict[str, float]:
        """Drives that the file holds at one value."""
        values = self.m.drive_values
        if values is None:
            return {}
        same = [bool((values[:, k] == values[0, k]).all()) for k in range(values.shape[1])]
        held = {name: float(values[0, k]) for k, name in enumerate(self.m.drives) if same[k]}
        # One configuration holds nothing: it is where the machine was drawn.
        return held if len(values) > 1 else {}

    def _of_configurations(self) -> Floats:
        known = nominal(self.m).drives
        numbers = np.array(self.table.numbers(CONFIGURATION))
        self._require_values(CONFIGURATION, numbers)
        wrong = np.flatnonzero((numbers != np.rint(numbers)) | (numbers < 0) | (numbers >= len(known)))
        if wrong.size:
            row = int(wrong[0])
            problem = f"{numbers[row]:g} is not the number of a configuration; the file has 0 to {len(known) - 1}"
            raise self.table.refuse(problem, CONFIGURATION, row)
        return np.asarray(known[numbers.astype(int)])

    def _require_values(self, name: str, values: Floats) -> None:
        empty = np.flatnonzero(~np.isfinite(values))
        if empty.size:
            raise self.table.refuse("is empty; each row says where the machine stood", name, int(empty[0]))

    def _check_ranges(self, drives: Floats) -> None:
        for k, name in enumerate(self.m.drives):
            low, high = self.m.limits.drives.get(name, (-np.inf, np.inf))
            slack = SAME * max(abs(drives[:, k]).max(initial=0.0), 1e-12)
            outside = np.flatnonzero((drives[:, k] < low - slack) | (drives[:, k] > high + slack))
            if outside.size:
                row, factor = int(outside[0]), self.m.drive_factors[k]
                unit = getattr(self.m.units, f"{self.m.coordinate_kind(self.m.drive_joints[k])}_name")
                problem = (
                    f"{drives[row, k] / factor:g} {unit} is outside limits.drives.{name}, {low / factor:g} to"
                    f" {high / factor:g}"
                )
                raise self.table.refuse(problem, name, row)

    def _cases(self) -> tuple[str, ...]:
        known = self.m.load_cases
        if LOAD_CASE not in self.table.columns:
            return ("",) * len(self.table.lines)
        cases = self.table.texts(LOAD_CASE)
        for row, case in enumerate(cases):
            if case and case not in known:
                raise self.table.refuse(not_known(case, "a load case of the file", known), LOAD_CASE, row)
        return tuple(cases)

    def _sides(self) -> NDArray[np.int64]:
        if SIDE not in self.table.columns:
            return np.zeros(len(self.table.lines), dtype=np.int64)
        sides = self.table.texts(SIDE)
        for row, side in enumerate(sides):
            if side not in SIDES:
                raise self.table.refuse(not_known(side, "a side", [name for name in SIDES if name]), SIDE, row)
        return np.array([SIDES[side] for side in sides])

    def _ways(self, count: int) -> Floats:
        """How the drives move forward: as along the path at a configuration of it, else with rising values."""
        if CONFIGURATION not in self.table.columns:
            return np.tile(drive_units(self.m), (count, 1))
        at = nominal(self.m)
        along = friction.directions(self.m, at.drives, motion_of(self.m, at))
        return np.asarray(along[np.array(self.table.numbers(CONFIGURATION)).astype(int)])

    def _approaches(self, drives: Floats, cases: Sequence[str]) -> NDArray[np.int64]:
        """Numbers of approaches from 0; a row without one is an approach of its own."""
        count = len(drives)
        if APPROACH not in self.table.columns:
            return np.arange(count)
        for row, text in enumerate(self.table.texts(APPROACH)):
            if text and text in SIDES:
                problem = (
                    f"'{text}' is no number of an approach; a column '{SIDE}' says from which side the drives came"
                )
                raise self.table.refuse(problem, APPROACH, row)
        numbers = np.array(self.table.numbers(APPROACH))
        first: dict[float, int] = {}
        found = np.arange(count)
        scale = np.abs(drives).max(initial=0.0)
        for row, number in enumerate(numbers.tolist()):
            if not np.isfinite(number):
                continue
            begun = first.setdefault(number, row)
            found[row] = begun
            if cases[row] != cases[begun] or np.abs(drives[row] - drives[begun]).max(initial=0.0) > SAME * scale:
                problem = (
                    f"approach {number:g} began in row {self.table.lines[begun]} at another place or load; readings of"
                    " one approach are of one place"
                )
                raise self.table.refuse(problem, APPROACH, row)
        return found

    def _refuse_copies(self, found: Readings) -> None:
        """Refuse a row that is there twice, which counts as two readings."""
        if APPROACH in self.table.columns:
            return
        seen: dict[tuple[object, ...], int] = {}
        for row in range(len(found)):
            where = (found.drives[row].tobytes(), found.cases[row], found.sides[row])
            key = (*where, found.values[row].tobytes())
            if key in seen:
                problem = (
                    f"is the same as row {found.lines[seen[key]]}; take it away, or number repeated readings in a"
                    f" column '{APPROACH}'"
                )
                raise found.sheet.refuse(problem, row=row)
            seen[key] = row

    def _of_drives(self, found: Readings, given: dict[str, float]) -> Floats:
        """Standard deviations of drives, which are taken out of those that are given; none if nothing is said."""
        m = self.m
        deviations = np.zeros_like(found.drives)
        for k, name in enumerate(m.drives):
            column, value = f"{SIGMA}{name}", given.pop(name, 0.0)
            if column in found.sheet.columns:
                kind = m.coordinate_kind(m.drive_joints[k])
                deviations[:, k] = np.nan_to_num(self._in_si(column, kind, found.sheet))
            else:
                deviations[:, k] = value * m.drive_factors[k]
            if not (deviations[:, k] >= 0.0).all():
                raise found.sheet.refuse("a standard deviation is not below zero", column)
        return deviations

    def _sigma(self, found: Readings, given: dict[str, float]) -> Floats:
        deviations = np.empty_like(found.values)
        known = dict.fromkeys([*found.names, *(name for one in found.channels for name in _called(one))])
        for word in given:
            if word not in (*known, "length", "angle"):
                raise InputError(not_known(word, "a measured column", known), key="sigma")
        for k, one in enumerate(found.channels):
            column = f"{SIGMA}{one.name}"
            names = _called(one)
            name = next((name for name in names if name in given), None)
            if column in found.sheet.columns:
                deviations[:, k] = self._in_si(column, one.kind, found.sheet)
            elif name is not None:
                deviations[:, k] = given[name] * getattr(self.m.units, one.kind)
            else:
                # A word that names a drive is the scatter of that drive.
                free = [word for word in (one.name, one.kind) if word not in self.m.drives]
                either = " or ".join(f"{word}=VALUE" for word in dict.fromkeys(free))
                problem = (
                    f"the standard deviation of the readings of '{one.name}' is missing: give {either}, a column"
                    f" '{column}' of the table, or 'auto' where readings are repeated"
                )
                raise InputError(problem, key="sigma")
            wrong = np.flatnonzero(found.given[:, k] & ~(deviations[:, k] > FINEST))
            if wrong.size:
                if column in found.sheet.columns:
                    raise found.sheet.refuse("a standard deviation is larger than that", column, int(wrong[0]))
                raise InputError(f"{given[name or '']:g} is no standard deviation, which is above zero", key="sigma")
        return deviations

    def _auto(self, found: Readings) -> tuple[Floats, int]:
        """The scatter of readings that are repeated without moving in between, and of how many it is at least."""
        deviations, repeats = np.empty_like(found.values), found.values.size
        _, groups = np.unique(found.approaches, return_inverse=True)
        for k, one in enumerate(found.channels):
            rows = np.flatnonzero(found.given[:, k])
            own, values = groups[rows], found.values[rows, k]
            counts = np.bincount(own)
            means = np.bincount(own, values) / np.maximum(counts, 1)
            free = int(np.maximum(counts - 1, 0).sum())
            if free < FEWEST_REPEATS:
                problem = (
                    f"'{one.name}' has {free} repeated readings of one approach, and {FEWEST_REPEATS} are needed for"
                    f" 'auto'; number approaches in a column '{APPROACH}', or say the standard deviation"
                )
                raise InputError(problem, key="sigma")
            spread = float(np.sqrt(((values - means[own]) ** 2).sum() / free))
            if not spread > 0.0:
                raise InputError(
                    f"repeated readings of '{one.name}' do not differ; say how exact they are", key="sigma"
                )
            deviations[:, k] = spread
            repeats = min(repeats, free)
        return deviations, repeats


def _called(one: Channel) -> tuple[str, ...]:
    """By which words the standard deviation of a column is said, the most special one first."""
    forms = () if one.form == "component" else (one.form,)
    return (one.name, one.name.rpartition(".")[2], *forms, one.kind)
