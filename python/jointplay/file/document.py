"""The text of a mechanism file with other values: what has not changed stays as it was typed.

The values of the text and those that are wanted are compared place by place, and only the places that differ are
touched, so that comments, order and spelling of all others stay.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomlkit import TOMLDocument

#: containers of tomlkit are used by their common interface of dictionaries and lists
Node = Any
#: tables inside one another that have heads, such as [joints.J1]; what is below stands in one line
HEADED = 2
#: ends of lines without carriage return
LONE = re.compile(r"(?<!\r)\n")


@dataclass(frozen=True)
class Source:
    """What a mechanism was read from.

    Attributes
    ----------
    text : str
        Of the file.
    raw : mapping
        Its values as they were read, with those that it takes from other files.
    parts : mapping
        Texts of the files that it includes, by name.
    """

    text: str
    raw: Mapping[str, Any]
    parts: Mapping[str, str] = field(default_factory=dict)


def texts(source: Source | None, raw: Mapping[str, Any], *, complete: bool = False) -> Iterator[str]:
    """Texts for wanted values, the best first; a reader finds out which of them says the same.

    Parameters
    ----------
    source : Source or None
        What the values were read from, before some of them changed.
    raw : mapping
        The values.
    complete : bool
        Whether nothing may be taken from other files.

    Yields
    ------
    str
        The text with what it takes from other files, as far as those values have not changed; the same with everything
        written out; the bare values, where the text cannot be changed so.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    if source is not None:
        for attempt in (_whole,) if complete else (_referring, _whole):
            try:
                yield attempt(source, raw)
            except (TOMLKitError, LookupError, TypeError, ValueError):
                # The place of a change is in another file, or the library cannot make the change there.
                continue
    yield _changed(tomlkit.document(), {}, raw)


def _referring(source: Source, raw: Mapping[str, Any]) -> str:
    """The text with what it takes from other files."""
    import tomlkit

    return _changed(tomlkit.parse(source.text), source.raw, raw)


def _whole(source: Source, raw: Mapping[str, Any]) -> str:
    """The text with its parts in it."""
    import tomlkit

    document = tomlkit.parse(source.text)
    document.pop("include", None)
    for text in source.parts.values():
        for section, value in tomlkit.parse(text).items():
            here = document.get(section)
            if here is None:
                document[section] = value
            elif isinstance(value, Mapping):
                # In their order, which for bodies has a meaning.
                for key in value:
                    if key not in here:
                        here[key] = value[key]
            elif isinstance(here, list):
                for entry in value:
                    here.append(entry)
    return _changed(document, document.unwrap(), raw)


def _changed(document: TOMLDocument, before: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    windows = "\r\n" in document.as_string()
    _change_table(document, before, wanted, HEADED)
    text = document.as_string()
    # The library ends its own lines as Unix does.
    return LONE.sub("\r\n", text) if windows else text


def _change_table(node: Node, before: Mapping[str, Any], wanted: Mapping[str, Any], headed: int) -> None:
    for key in before:
        if key not in wanted:
            del node[key]
    for key, value in wanted.items():
        # What a pattern repeats are tables of a file again.
        below = headed + HEADED * (headed == HEADED and key == "patterns")
        if key not in before:
            node[key] = _item(value, below)
        elif before[key] != value:
            _change(node, key, before[key], value, below)


def _change(node: Node, key: str | int, before: Any, wanted: Any, headed: int) -> None:
    if isinstance(before, Mapping) and isinstance(wanted, Mapping):
        _change_table(node[key], before, wanted, max(headed - 1, 0))
    elif isinstance(before, list) and isinstance(wanted, list) and len(before) == len(wanted):
        # Entry by entry, so that lines and comments between them stay.
        for k, (old, new) in enumerate(zip(before, wanted, strict=True)):
            if old != new:
                _change(node[key], k, old, new, 0)
    else:
        node[key] = _item(wanted, 0)


def _item(value: Any, headed: int) -> Any:
    """A new value; its tables have heads of their own down to some depth and stand in one line below."""
    import tomlkit

    if isinstance(value, list):
        if headed and value and all(isinstance(one, Mapping) for one in value):
            tables = tomlkit.aot()
            for one in value:
                tables.append(_item(one, headed))
            return tables
        array, items = tomlkit.array(), [_item(one, 0) for one in value]
        # All but the last at once: to append one counts all others again.
        array.add_line(*items[:-1], indent="", newline=False)
        array.extend(items[-1:])
        return array
    if not isinstance(value, Mapping):
        return value
    # The library would put tables with heads behind other values, and the order of bodies has a meaning.
    table = tomlkit.table() if headed else tomlkit.inline_table()
    for key, one in value.items():
        table.append(key, _item(one, max(headed - 1, 0)))
    return table
