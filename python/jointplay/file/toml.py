"""TOML that is read in bounded time, whatever somebody puts there; numbers as they are written."""

import codecs
import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointplay.basics import files
from jointplay.errors import InputError, comma_hint, one_line, shown

#: no file that a person wrote is longer; the bound keeps devices and archives out
LARGEST_FILE = 8_000_000
#: more parts than any machine is made of; a longer list is a slip
MOST_FILES = 100
#: what a part gives again must be the same
SHARED = ("format", "space", "units")
#: tables and lists inside one another
DEEPEST = 20
#: parts of a dotted key; the time to read one grows with their square. Twice what can be valid, because the pattern
#: below also finds words with dots between them in a comment.
MOST_PARTS = 2 * DEEPEST
#: decimals of a coordinate in millimetres or of a direction; more are rounding
DECIMALS = 12
#: halves of letters beyond the first 65,536, which Python lets stand alone
SURROGATE = re.compile("[\ud800-\udfff]")
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?m)(?:^|[\[{{,])[ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


class NotToml(InputError):
    """A text that is not TOML."""


def read(path: str | os.PathLike[str], what: str = "mechanism file") -> tuple[str, str]:
    """Name and text of a file; what it should be is for messages.

    Raises
    ------
    InputError
        When it cannot be read, is too long, or is no text in UTF-8.
    """
    place = os.fspath(path)
    # Letters that no text has, from names that are not UTF-8, would end up in every result.
    name = one_line(place)
    try:
        with Path(place).open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InputError("there is no such file", file=name) from None
    except IsADirectoryError:
        raise InputError(f"this is a folder, not a {what}", file=name) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read: {reason}", file=name) from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"is longer than {LARGEST_FILE // 1_000_000} MB, too long for a {what}", file=name)
    return name, decoded(content, name, what)


def decoded(content: bytes, name: str, what: str) -> str:
    """The text of a file in UTF-8.

    Raises
    ------
    InputError
        When it is no such text; `what` says what the file ought to be.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise InputError("is UTF-16 text; save it as UTF-8", file=name)
    if b"\0" in content:
        raise InputError(f"is a binary file, not a {what}", file=name)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        byte = content[error.start]
        raise InputError(f"line {line}: is not UTF-8 text (byte 0x{byte:02x}); save it as UTF-8", file=name) from None


@dataclass(frozen=True)
class Joined:
    """The tables of a file with those of its parts."""

    #: as if all of them were written in the file
    tables: dict[str, Any]
    #: name of the file in messages
    file: str
    #: part, and place in it, of what does not stand in the file itself, by place
    came_from: dict[tuple[str, ...], tuple[str, tuple[str, ...]]]
    #: texts of the parts, by name
    texts: dict[str, str]

    def in_its_part(self, error: InputError) -> InputError:
        """The error with the file and the key where the mistake was written."""
        steps = tuple(error.key.split(".")) if error.file == self.file else ()
        for length in range(len(steps), 0, -1):
            if steps[:length] in self.came_from:
                part, place = self.came_from[steps[:length]]
                return InputError(error.problem, file=part, key=".".join((*place, *steps[length:])))
        return error

    def file_of(self, *place: str) -> str | None:
        """The part that gives a place; None where the file itself does."""
        return self.came_from[place][0] if place in self.came_from else None


def joined(tables: Mapping[str, Any], path: str, file: str) -> Joined:
    """The tables of a file with those of the files that it includes, as if they were written in it.

    Parameters
    ----------
    tables : mapping
        What `parse` gives, with the key `include`.
    path : str
        The file: what it includes is in the same folder.
    file : str
        Its name in messages.

    Raises
    ------
    InputError
        When a part cannot be read, or gives again what is given.
    """
    whole = {key: value for key, value in tables.items() if key != "include"}
    names = tables["include"]
    if not (isinstance(names, list) and len(names) <= MOST_FILES and all(isinstance(name, str) for name in names)):
        raise InputError(
            f'names of files are needed, such as ["leg.toml"], not {shown(names)}', file=file, key="include"
        )
    joined = Joined(whole, file, {}, {})
    total = 0
    for number, name in enumerate(names):
        key = f"include.{number}"
        if name == Path(path).name or name in names[:number]:
            raise InputError(f"{shown(name)} is not another file, named once", file=file, key=key)
        part, text = read(files.beside(path, name, file, key))
        joined.texts[name] = text
        total += len(text)
        if total > LARGEST_FILE:
            raise InputError(f"the parts are longer than {LARGEST_FILE // 1_000_000} MB together", file=file, key=key)
        for section, value in parse(text, file=part).items():
            if section == "include":
                raise InputError("a part that is included includes no other", file=part, key="include")
            _join(joined, section, value, file, part)
    return joined


def _join(joined: Joined, section: str, value: Any, file: str, part: str) -> None:
    whole, came_from = joined.tables, joined.came_from
    here = whole.get(section)
    if section not in whole:
        whole[section] = dict(value) if isinstance(value, dict) else value
        came_from[section,] = part, (section,)
        came_from |= {(section, key): (part, (section, key)) for key in (value if isinstance(value, dict) else ())}
    elif section in SHARED:
        if type(here) is not type(value) or here != value:
            said = f"{shown(value)} in {part}, but {shown(here)} in {joined.file_of(section) or file}"
            raise InputError(said, file=file, key=section)
    elif isinstance(here, dict) and isinstance(value, dict):
        for key in value:
            if key in here:
                problem = _twice(file, part, joined.file_of(section, key))
                raise InputError(problem, file=file, key=f"{section}.{key}")
            came_from[section, key] = part, (section, key)
        whole[section] = {**here, **value}
    elif isinstance(here, list) and isinstance(value, list) and all(isinstance(v, dict) for v in [*here, *value]):
        for number in range(len(value)):
            came_from[section, str(len(here) + number)] = part, (section, str(number))
        whole[section] = [*here, *value]
    else:
        raise InputError(_twice(file, part, joined.file_of(section)), file=file, key=section)


def _twice(file: str, part: str, before: str | None) -> str:
    return f"is given in {before or file} and again in {part}"


def parse(text: str, *, file: str = "", key: str = "") -> dict[str, Any]:
    """The tables of a text.

    Raises
    ------
    NotToml
    InputError
        When it is nested too deep, or a number is too long.
    """
    if _LONG_KEY.search(text):
        raise too_deep(file, key)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise NotToml(_syntax(str(error), text), file=file, key=key) from None
    except RecursionError:
        raise too_deep(file, key) from None
    except ValueError:
        # All that is left: Python refuses to read whole numbers of thousands of digits.
        raise InputError("a number has thousands of digits", file=file, key=key) from None


def too_deep(file: str = "", key: str = "") -> InputError:
    """The error for tables and lists inside one another."""
    return InputError(f"tables and lists are nested more than {DEEPEST} deep", file=file, key=key)


def check_plain(node: Any, *, file: str = "", key: str = "") -> None:
    """Refuse what no TOML text holds: tables and lists nested too deep, or within themselves; half letters."""
    level = [node]
    for _ in range(DEEPEST):
        for value in level:
            if isinstance(value, str) and not value.isascii() and SURROGATE.search(value):
                raise InputError(
                    f"{shown(one_line(value))} has halves of letters, which no text has", file=file, key=key
                )
        level = [v for n in level for v in (n.values() if isinstance(n, Mapping) else n if isinstance(n, list) else ())]
        if not level:
            return
    raise too_deep(file, key)


def number(value: float) -> str:
    """A number as short as it is.

    Examples
    --------
    >>> number(300.0), number(-1e-17), number(1 / 3)
    ('300', '0', '0.333333333333')
    """
    text = f"{round(float(value), DECIMALS):.15g}"
    return "0" if text == "-0" else text


def numbers(values: Iterable[float]) -> str:
    """A list of numbers.

    Examples
    --------
    >>> numbers([0.0, 150.0])
    '[0, 150]'
    """
    return f"[{', '.join(number(value) for value in values)}]"


def _syntax(message: str, text: str) -> str:
    """tomllib's message with its place in front, and a hint where a number with a decimal comma ends there."""
    found = re.fullmatch(r"(?s)(.*) \(at (.*)\)", message)
    what, where = found.groups() if found else (message, "")
    place = re.fullmatch(r"line (\d+), column (\d+)", where)
    if place is not None:
        row, column = map(int, place.groups())
        # Of `values = 0,5` the comma is what cannot be read, of `{ radial = 0,05 }` what follows the number.
        line = text.split("\n")[row - 1]
        words = re.finditer(r"[^\s={}\[\]#\"']+", line)
        near = [word[0] for word in words if word.start() < column and not line[word.end() : column - 1].strip()]
        what += comma_hint(near[-1].rstrip(",")) if near else ""
    return f"{where}: is not TOML: {what}" if where else f"is not TOML: {what}"
