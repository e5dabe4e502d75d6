"""How entries of the tables are written, and which line of a program wrote them."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jointplay.errors import InputError, shown
from jointplay.file import toml
from jointplay.model.mechanism import plain

#: keys of the place of a joint on a body
PLACEMENT = ("at", "axis", "side")
#: keys with which the table of a joint begins
FRONT = ("type", "on", "bodies", *PLACEMENT, "axes")


class WrittenTables:
    """The tables of a file that is being written.

    Attributes
    ----------
    data : dict
        The tables.
    lines : dict
        The line of the program that wrote an entry, by its place in the tables.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data
        self.lines: dict[tuple[str, ...], str] = {}

    def put(self, place: tuple[str, ...], value: object) -> None:
        """Write an entry.

        Raises
        ------
        InputError
            When it has been written before.
        """
        here = self.data
        for step in place[:-1]:
            here = here.setdefault(step, {})
        if place[-1] in here:
            raise InputError(f"is given again; first in {self.lines[place]}", file=_line(), key=".".join(place))
        here[place[-1]] = _kept(value, place)
        self.lines[place] = _line()

    def add(self, place: tuple[str, ...], value: object) -> None:
        """Write an entry of a list."""
        here = self.data
        for step in place[:-1]:
            here = here.setdefault(step, {})
        entries = here.setdefault(place[-1], [])
        self.lines[(*place, str(len(entries)))] = _line()
        entries.append(_kept(value, place))

    def at_its_line(self, error: InputError) -> InputError:
        """The error with the line of the program that wrote what is wrong, in place of the name of a file."""
        steps = tuple(error.key.split("."))
        places = (steps[:length] for length in range(len(steps), 0, -1))
        line = next((self.lines[place] for place in places if place in self.lines), error.file)
        return InputError(error.problem, file=line, key=error.key)


class Writing:
    """What the methods of a builder and of its patterns write by: each hands over all its parameters by name."""

    _tables: WrittenTables
    #: where its sections are: at the top, or in a pattern
    _above: tuple[str, ...]

    def _named(self, section: str, given: Mapping[str, object], **more: object) -> None:
        _, first, *_ = given
        name = given[first]
        if not isinstance(name, str):
            raise TypeError(f"a name in {section} is text, not {shown(name)}")
        self._tables.put((*self._above, section, name), _table({**given, **more}, first))

    def _joint(self, kind: str, given: Mapping[str, object]) -> None:
        self._named("joints", given, type=kind)

    def _single(self, section: str, given: Mapping[str, object]) -> None:
        self._tables.put((*self._above, section), _table(given))

    def _listed(self, section: str, given: Mapping[str, object]) -> None:
        self._tables.add((*self._above, section), _table(given))

    def _output(self, given: Mapping[str, object]) -> None:
        if given["name"] is None:
            self._tables.put(("output",), _table(given, "name"))
        else:
            self._named("outputs", given)

    def _load(self, case: str | None, given: Mapping[str, object]) -> None:
        table = _table(given, "case")
        if case is None:
            self._tables.add(("loads",), table)
        elif table:
            self._tables.add(("load_cases", case), table)
        else:
            self._tables.put(("load_cases", case), [])


def _kept(value: object, place: tuple[str, ...]) -> object:
    """A copy of a value, so that what becomes of the program's own does not matter."""
    toml.check_plain(value, file=_line(), key=".".join(place))
    return plain(value)


def _table(given: Mapping[str, Any], name: str = "") -> dict[str, Any]:
    """The table of what a method was given, without the name of the entry, which is another parameter.

    Places of bodies are in its key `on`, and what is no place is a key of the table, so that a key with a slip is
    refused like that of a file.
    """
    apart, places = ("self", "places", name), given.get("places", {})
    # A parameter cannot be called `from`.
    table = {key.removesuffix("_"): value for key, value in given.items() if key not in apart and value is not None}
    own = table.get("on", {})
    # A body twice, or beside something that is no table, stays where it is refused.
    taken = own if isinstance(own, Mapping) else places
    on = {body: value for body, value in places.items() if _is_place(value) and body not in taken}
    table |= {key: value for key, value in places.items() if key not in on}
    if on:
        table["on"] = {**taken, **on}
    # In front, where files have them.
    first = FRONT if "type" in table else FRONT[:2]
    return {key: table[key] for key in first if key in table} | table


def _is_place(value: object) -> bool:
    if isinstance(value, Mapping):
        return any(key in value for key in PLACEMENT)
    return isinstance(value, list | tuple | str) or (hasattr(value, "__array__") and np.ndim(value) > 0)


def _line() -> str:
    """The line of the program that called the builder, its file as seen from the current folder."""
    frame = sys._getframe()
    package = __name__.rpartition(".")[0]
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).startswith(package):
        frame = frame.f_back
    file = Path(frame.f_code.co_filename)
    return f"{file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file}:{frame.f_lineno}"
