"""Readings of a built machine: a table as an instrument or a spreadsheet writes it.

Columns stand between semicolons, tabs or commas, with their names and units in the first row. Where columns do not
stand between commas, decimals may have a comma. An empty cell says that nothing was read.
"""

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointplay.errors import InputError, shown

from .columns import from_cell, read, split
from .schema.values import LARGEST

#: no device reads more, and all of them are fitted at once
MOST_ROWS = 20_000
#: columns that nobody asks for begin with it
LEFT_OUT = "#"
#: as instruments write units, and as files do
SPELLINGS = {
    **dict.fromkeys(("\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "micron", "microns"), "um"),
    **dict.fromkeys(("\N{DEGREE SIGN}", "degree", "degrees"), "deg"),
    **dict.fromkeys(("inch", "inches", '"'), "in"),
}
COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")

Cell = str | float


@dataclass(frozen=True)
class ReadingColumn:
    """A column: the unit that its heading says, empty if none, and a cell for each row."""

    unit: str
    cells: Sequence[Cell]


@dataclass(frozen=True)
class ReadingSheet:
    """A table of readings."""

    #: its file, for messages
    name: str
    #: by name
    columns: Mapping[str, ReadingColumn]
    #: number of every row, counted as a spreadsheet does
    lines: Sequence[int]

    def refuse(self, problem: str, column: str = "", row: int | None = None) -> InputError:
        """The error for a place in the table."""
        where = [f"row {self.lines[row]}"] if row is not None else []
        where += [f"column {shown(column)}"] if column else []
        return InputError(f"{', '.join(where)}: {problem}" if where else problem, file=self.name)

    def numbers(self, column: str) -> list[float]:
        """The numbers of a column; nan where a cell is empty.

        Raises
        ------
        InputError
            When a cell is no number.
        """
        return [self._number(column, row, cell) for row, cell in enumerate(self.columns[column].cells)]

    def texts(self, column: str) -> list[str]:
        """The texts of a column."""
        return [cell.strip() if isinstance(cell, str) else f"{cell:g}" for cell in self.columns[column].cells]

    def _number(self, column: str, row: int, cell: Cell) -> float:
        if not isinstance(cell, str):
            value = float(cell)
        elif not cell.strip():
            return math.nan
        else:
            text = cell.strip().replace("\N{MINUS SIGN}", "-")
            try:
                value = float(text.replace(",", ".") if COMMA.fullmatch(text) else text)
            except ValueError:
                problem = f"a number is needed, not {shown(cell)}; an empty cell says that nothing was read"
                raise self.refuse(problem, column, row) from None
        if not abs(value) <= LARGEST:
            problem = f"{shown(cell)} is no reading; leave the cell empty where nothing was read"
            raise self.refuse(problem, column, row)
        return value


def sheet(source: Any) -> ReadingSheet:
    """A table of readings.

    Parameters
    ----------
    source : path or mapping
        A file; or columns of equal lengths by name, such as a frame of pandas. In those nan says that nothing was read.

    Raises
    ------
    InputError
        When it cannot be read, has no rows or too many, or has two columns of one name.
    """
    if isinstance(source, str | os.PathLike):
        found = read(Path(source), decimals="between commas decimals have a point, or put ; between the columns")
        lines = [number for number, _ in found.rows]
        rows = [[*row, *[""] * (len(found.header) - len(row))] for _, row in found.rows]
        cells = [[from_cell(row[k].strip()) for row in rows] for k in range(len(found.header))]
        return _sheet(found.name, found.header, cells, lines)
    if not (isinstance(source, Mapping) or hasattr(source, "columns")):
        raise InputError(f"{shown(source)} is neither a file nor columns by name", key="measured")
    columns = [_cells(str(word), source[word]) for word in source]
    lengths = {len(column) for column in columns}
    if len(lengths) > 1:
        raise InputError(f"columns have equal lengths, not {shown(sorted(lengths))}", key="measured")
    return _sheet("measured", [str(word) for word in source], columns, range(1, max(lengths, default=0) + 1))


def _cells(name: str, values: Any) -> list[Cell]:
    if isinstance(values, str | bytes) or not hasattr(values, "__iter__") or getattr(values, "ndim", 1) != 1:
        raise InputError(f"column {shown(name)} is a list of values, not {shown(values)}", key="measured")
    return [_plain(value) for value in values]


def _plain(value: Any) -> Cell:
    """A value of Python as a cell of a table; what it has no number for is empty."""
    if isinstance(value, str):
        return value
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return "" if value is None else str(value)
    return "" if math.isnan(number) else number


def _sheet(name: str, header: Sequence[str], cells: Sequence[Sequence[Cell]], lines: Sequence[int]) -> ReadingSheet:
    columns: dict[str, ReadingColumn] = {}
    for word, own in zip(header, cells, strict=True):
        if word.startswith(LEFT_OUT) or not (word or any(own)):
            continue
        key, unit = split(word)
        if key in columns:
            raise InputError(f"the first row has {shown(key)} more than once", file=name)
        columns[key] = ReadingColumn(SPELLINGS.get(unit, unit), own)
    if not lines:
        raise InputError("has no readings: names of columns in the first row, a reading in each row below", file=name)
    if len(lines) > MOST_ROWS:
        raise InputError(f"has {len(lines):,} rows; at most {MOST_ROWS:,} are fitted at once", file=name)
    return ReadingSheet(name, columns, lines)
