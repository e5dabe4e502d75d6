"""Patterns written out: parts that the file has once and the mechanism several times.

Copy k of a pattern has the names NAME_k. Its numbers are found with the variables of the file and those of the copy;
then what is turned is turned (see `turn`), and names are made those of the copy. What comes out is a file without
patterns, which is checked and compiled like any other.
"""

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jointplay.errors import InputError, shown
from jointplay.file.schema import (
    COPY,
    HEADS,
    PARTS,
    NotAnExpression,
    PatternHead,
    PatternTable,
    Variables,
    checked,
    space_of,
    variables_of,
)

from .copies import CopiedEntry, Copy, entries
from .names import PatternNames
from .turn import Turn

__all__ = ["Written", "written_out"]


@dataclass(frozen=True)
class Written:
    """A file without patterns, and where its entries come from."""

    #: the data of the file
    data: dict[str, Any]
    #: key that the user wrote, and number of the copy, by the key of an entry
    origins: Mapping[tuple[str, ...], tuple[str, int]]

    def as_the_user_wrote(self, error: InputError) -> InputError:
        """The error with the key that is in the file."""
        parts = tuple(error.key.split("."))
        for length in range(len(parts), 0, -1):
            if parts[:length] in self.origins:
                key, number = self.origins[parts[:length]]
                return of_copy(number, error, ".".join((key, *parts[length:])))
        return error


def of_copy(number: int, error: InputError, key: str) -> InputError:
    """An error at a key of a pattern; what the first copy has, is wrong with all of them."""
    which = f" (copy {number})" if number > 1 else ""
    return InputError(error.problem + which, file=error.file, key=key)


def written_out(raw: dict[str, Any], file: str) -> Written:
    """The data of a file with every copy of its patterns in its place.

    Parameters
    ----------
    raw : dict
        The data; stays as it is.
    file : str
        Name of the file, for messages.

    Raises
    ------
    InputError
        When a pattern is not valid, or a name is taken.
    """
    if "patterns" not in raw:
        return Written(raw, {})
    reader = _PatternReader(raw, file)
    data = copy.deepcopy({key: value for key, value in raw.items() if key != "patterns"})
    parts = {name: reader.copies(name, head) for name, head in reader.heads().items()}
    names = {name: PatternNames(name, copies[0].table, len(copies), file) for name, copies in parts.items()}
    for own in names.values():
        own.check(data, [other for other in names.values() if other is not own])
    origins: dict[tuple[str, ...], tuple[str, int]] = {}
    for name, copies in parts.items():
        for part in copies:
            for entry in entries(part, names[name]):
                place = _join(data, entry)
                if place is not None:
                    origins[place] = (f"patterns.{name}.{entry.written}", part.number)
    return Written(data, origins)


def _join(data: dict[str, Any], entry: CopiedEntry) -> tuple[str, ...] | None:
    """Put an entry of a copy into the data, and say where it is. What is no table is left for the model to refuse."""
    here: Any = data
    *above, last = entry.section
    for section in above:
        here = here.setdefault(section, {})
        if not isinstance(here, dict):
            return None
    table = here.setdefault(last, {} if entry.name else [])
    if isinstance(table, list) and not entry.name:
        table.append(entry.value)
        return (*entry.section, str(len(table) - 1))
    if not isinstance(table, dict):
        return None
    table[entry.name] = entry.value
    return (*entry.section, entry.name)


class _PatternReader:
    """The patterns of a file with their numbers."""

    def __init__(self, raw: Mapping[str, Any], file: str) -> None:
        self.tables = raw["patterns"]
        self.file = file
        self.space = space_of(raw, file)
        self.given, self.unit = variables_of(raw)
        if COPY in self.given:
            problem = f"{shown(COPY)} is the number of the copy in the expressions of a pattern; use another name"
            raise InputError(problem, file=file, key=f"variables.{COPY}")

    def heads(self) -> dict[str, PatternHead]:
        """How often every pattern is repeated, and its values."""
        known = PatternHead.model_fields
        tables = self.tables
        if isinstance(tables, Mapping):
            tables = {
                name: {key: value for key, value in table.items() if key in known} if isinstance(table, dict) else table
                for name, table in tables.items()
            }
        checked_heads = checked({"patterns": tables}, self._scope(), HEADS[self.space], self.file)
        heads: dict[str, PatternHead] = checked_heads.patterns  # type: ignore[attr-defined]
        for name, head in heads.items():
            for taken in set(head.values) & set(self.given):
                problem = f"{shown(taken)} is a variable of the file already; use another name"
                raise InputError(problem, file=self.file, key=f"patterns.{name}.values.{taken}")
        return heads

    def copies(self, name: str, head: PatternHead) -> list[Copy]:
        """The copies of a pattern, with numbers for its expressions and the names of the pattern."""
        found = []
        for number in range(1, head.copies + 1):
            own = {key: value[number - 1] if isinstance(value, tuple) else value for key, value in head.values.items()}
            scope = self._scope({**own, COPY: number}, f"patterns.{name}.values")
            try:
                model = checked({"patterns": {name: self.tables[name]}}, scope, PARTS[self.space], self.file)
            except InputError as error:
                raise of_copy(number, error, error.key) from None
            table: PatternTable = model.patterns[name]  # type: ignore[attr-defined]
            found.append(Copy(number, table, self._turn(head, number)))
        return found

    def _turn(self, head: PatternHead, number: int) -> Turn | None:
        if head.about is None or number == 1:
            return None
        step = math.tau / self.unit / head.copies if head.about.angle is None else head.about.angle
        axis = getattr(head.about, "axis", (0.0, 0.0, 1.0))
        return Turn((number - 1) * step, self.unit, head.about.point, axis)

    def _scope(self, own: Mapping[str, object] | None = None, key: str = "") -> Variables:
        """The variables of the file, and those of a copy."""
        try:
            return Variables({**self.given, **(own or {})}, self.unit)
        except NotAnExpression as problem:
            section = key if problem.name in (own or {}) else "variables"
            raise InputError(str(problem), file=self.file, key=f"{section}.{problem.name}") from None
