"""Measured values from a column of a table in the folder of the mechanism, in the place of the file's name."""

import re
from collections.abc import Iterator
from typing import Any

from jointplay.errors import InputError, shown
from jointplay.file.columns import Tables

#: sections in which a word is the name of an entry, which may have a table beside the file itself
NAMES = re.compile(r"(patterns\.[^.]*\.)?(drives|followers)")


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
    tables = Tables(path, file)
    return _replaced(raw, "", {key: _measured(law, tables, file, key) for key, law in found.items()}) if found else raw


def _laws(node: Any, key: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The laws that name a file, by their keys."""
    if isinstance(node, dict):
        for name, value in node.items():
            place = f"{key}.{name}" if key else str(name)
            is_law = name in ("law", "size_law") and not NAMES.fullmatch(key)
            if is_law and isinstance(value, dict) and "csv" in value:
                yield place, value
            else:
                yield from _laws(value, place)


def _replaced(node: Any, key: str, laws: dict[str, Any]) -> Any:
    if key in laws:
        return laws[key]
    if not isinstance(node, dict):
        return node
    return {name: _replaced(value, f"{key}.{name}" if key else str(name), laws) for name, value in node.items()}


def _measured(law: dict[str, Any], tables: Tables, file: str, key: str) -> dict[str, Any]:
    table = tables.beside(law["csv"], f"{key}.csv")
    column = law.get("column")
    if not isinstance(column, str):
        problem = "'column' is missing (the name in the first row above the measured values)"
        raise InputError(problem, file=file, key=f"{key}.column" if "column" in law else key)
    values = table.numbers(column, f"{key}.column")
    if len(values) < 2:
        raise InputError(f"column {shown(column)} has fewer than two values", file=table.name, key=f"{key}.column")
    return {**{k: v for k, v in law.items() if k not in ("csv", "column")}, "measured": values}
