"""Measured values from a column of a table in the folder of the mechanism, in the place of the file's name."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jointplay.errors import InputError, not_known, one_line, shown

#: no column that somebody measured is longer
MOST_VALUES = 100_000
LARGEST_FILE = 8_000_000
#: what stands between the columns: the first of these that the first row has
SEPARATORS = ";\t,"


def filled_in(raw: dict[str, Any], path: str, file: str) -> dict[str, Any]:
    """The tables of a file with the values of the columns that its laws name.

    Parameters
    ----------
    raw : dict
        The tables as they were read. What changes is copied.
    path : str
        The file: the tables with measured values are in the same folder.
    file : str
        Its name in messages.

    Raises
    ------
    InputError
        When a file or a column is not there, or a value is no number.
    """
    found = dict(_laws(raw, ""))
    return _replaced(raw, "", {key: _measured(law, path, file, key) for key, law in found.items()}) if found else raw


def _laws(node: Any, key: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The laws that name a file, by their keys."""
    if isinstance(node, dict):
        for name, value in node.items():
            place = f"{key}.{name}" if key else str(name)
            if name in ("law", "size_law") and isinstance(value, dict) and "csv" in value:
                yield place, value
            else:
                yield from _laws(value, place)


def _replaced(node: Any, key: str, laws: dict[str, Any]) -> Any:
    if key in laws:
        return laws[key]
    if not isinstance(node, dict):
        return node
    return {name: _replaced(value, f"{key}.{name}" if key else str(name), laws) for name, value in node.items()}


def _measured(law: dict[str, Any], path: str, file: str, key: str) -> dict[str, Any]:
    name, column = law["csv"], law.get("column")
    if not isinstance(name, str) or name in ("", ".", "..") or Path(name).name != name or "\\" in name:
        problem = f"{shown(name)} is not the name of a file in the same folder, without its folder"
        raise InputError(problem, file=file, key=f"{key}.csv")
    if not isinstance(column, str):
        problem = "'column' is missing (the name in the first row above the measured values)"
        raise InputError(problem, file=file, key=f"{key}.column" if "column" in law else key)
    place = Path(path).parent / name
    if not place.is_file():
        raise InputError(f"there is no file {shown(name)} in the same folder", file=file, key=f"{key}.csv")
    values = _column(_text(place), column, one_line(str(place)), f"{key}.column")
    return {**{k: v for k, v in law.items() if k not in ("csv", "column")}, "measured": values}


def _text(place: Path) -> str:
    name = one_line(str(place))
    try:
        with place.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=name) from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"is longer than {LARGEST_FILE // 1_000_000} MB, too long for measured values", file=name)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=name) from None


def _column(text: str, column: str, name: str, key: str) -> list[float]:
    """The numbers below the name of a column; rows that are empty there are left out."""
    lines = text.splitlines()
    separator = next((mark for mark in SEPARATORS if lines and mark in lines[0]), ",")
    try:
        rows = [*csv.reader(lines, delimiter=separator)]
    except csv.Error as error:
        raise InputError(f"is no table: {error}", file=name, key=key) from None
    header = [word.strip() for word in rows[0]] if rows else []
    if header.count(column) != 1:
        problem = (
            not_known(column, "a column of its first row", header)
            if column not in header
            else (f"the first row has {shown(column)} more than once")
        )
        raise InputError(problem, file=name, key=key)
    place = header.index(column)
    values: list[float] = []
    for number, row in enumerate(rows[1:], 2):
        word = row[place].strip() if place < len(row) else ""
        if not word:
            continue
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(
                f"row {number}, column {shown(column)}: a number is needed, not {shown(word)}", file=name, key=key
            )
        values.append(value)
        if len(values) > MOST_VALUES:
            raise InputError(f"column {shown(column)} has more than {MOST_VALUES} values", file=name, key=key)
    if len(values) < 2:
        raise InputError(f"column {shown(column)} has fewer than two values", file=name, key=key)
    return values
