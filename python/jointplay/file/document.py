"""The text of a mechanism file with other values: what has not changed stays as it was typed.

The values of the text and those that are wanted are compared place by place, and only the places that differ are
touched, so that comments, order and spelling of all others stay. Tables with heads come and go as whole lines, because
the library would give the comment above a table to the one before it.
"""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from jointplay.errors import InputError, shown

from . import toml
from .schema.keys import Steps, assign

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
    """What a mechanism was read from."""

    #: of the file
    text: str
    #: its values as they were read, with those that it takes from other files
    raw: Mapping[str, Any]
    #: texts of the files that it includes, by name
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


def edited(text: str, steps: Steps, value: Any) -> str:
    """The text with one value set, or taken away; it need not be a valid mechanism before or after.

    Parameters
    ----------
    steps : tuple of str and int
        Place of the value; the tables on the way are made. The number behind the last of a list appends to it.
    value : object
        Plain data; None removes what is there. It replaces what says the same in other words.

    Raises
    ------
    InputError
        When the text is no TOML, or has nothing at the place above.

    Examples
    --------
    >>> print(edited("title = 'bar' # mine\\n\\n# the pin\\n[joints.A]\\nat = [0, 0]\\n", ("joints", "A", "at", 0), 5))
    title = 'bar' # mine
    <BLANKLINE>
    # the pin
    [joints.A]
    at = [5, 0]
    <BLANKLINE>
    """
    before = toml.parse(text)
    wanted = copy.deepcopy(before)
    try:
        here = _at(wanted, steps[:-1])
        if isinstance(here, list) == isinstance(steps[-1], str):
            raise TypeError
        if isinstance(here, list) and steps[-1] == len(here) and value is not None:
            here.append(copy.deepcopy(value))
        else:
            assign(wanted, steps, copy.deepcopy(value))
        if value is None and len(steps) == HEADED and not wanted[str(steps[0])]:
            # A section goes with its last table.
            del wanted[str(steps[0])]
    except (KeyError, IndexError, TypeError):
        key = ".".join(map(str, steps))
        raise InputError(f"the file has no such place for {shown(value)}", key=key) from None
    found = next((one for one in _edits(text, steps, value, before, wanted) if _says(one, wanted)), None)
    if found is None:
        raise InputError("cannot be written", key=".".join(map(str, steps)))
    return found


def _at(data: Any, steps: Steps) -> Any:
    for step in steps:
        if isinstance(data, dict) and step not in data:
            return None
        data = data[step]
    return data


def _has(section: Any, step: str | int) -> bool:
    return step < len(section) if isinstance(section, list) and isinstance(step, int) else step in (section or {})


def _says(text: str, wanted: Mapping[str, Any]) -> bool:
    try:
        return toml.parse(text) == wanted
    except InputError:
        return False


def _edits(text: str, steps: Steps, value: Any, before: Mapping[str, Any], wanted: Mapping[str, Any]) -> Iterator[str]:
    """Texts that may say what is wanted, the best first."""
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    section = before.get(str(steps[0]))
    if value is None and len(steps) <= HEADED:
        yield _without_table(text, steps)
    elif isinstance(value, Mapping) and len(steps) == HEADED and not _has(section, steps[-1]):
        yield _with_table(text, steps, value)
    with suppress(TOMLKitError, LookupError, TypeError, ValueError):
        yield _changed(tomlkit.parse(text), before, wanted)
    yield _changed(tomlkit.document(), {}, wanted)


def _heads(lines: list[str]) -> list[tuple[int, Steps]]:
    """The lines that begin a table, and whose; also lines of an array that look so."""
    found: list[tuple[int, Steps]] = []
    for number, line in enumerate(lines):
        if not line.lstrip().startswith("["):
            continue
        try:
            here: Any = tomllib.loads(line)
        except tomllib.TOMLDecodeError:
            continue
        steps: list[str | int] = []
        while here:
            here = here[0] if isinstance(here, list) else here
            if not here:
                break
            ((step, here),) = here.items()
            steps.append(step)
        found.append((number, tuple(steps)))
    return found


def _end(lines: list[str], start: int, after: int) -> int:
    """Where a table ends that begins at a line: behind what is neither blank nor a comment, which go with the next."""
    while after > start + 1 and (not lines[after - 1].strip() or lines[after - 1].lstrip().startswith("#")):
        after -= 1
    return after


def _without_table(text: str, steps: Steps) -> str:
    """The text without the lines of a table, of tables below it, and of the comment right above it."""
    lines = text.splitlines(keepends=True)
    heads = [*_heads(lines), (len(lines), ())]
    kept, last = [], 0
    names = tuple(step for step in steps if isinstance(step, str))
    alike = [k for k, (_, own) in enumerate(heads[:-1]) if own[: len(names)] == names]
    # One of a list of tables is counted.
    chosen = alike[steps[-1] : steps[-1] + 1] if isinstance(steps[-1], int) else alike
    for k in chosen:
        start, after = heads[k][0], heads[k + 1][0]
        while start > last and lines[start - 1].lstrip().startswith("#"):
            start -= 1
        kept += lines[last:start]
        last = _end(lines, start, after)
        while last < len(lines) and not lines[last].strip() and (not kept or not kept[-1].strip()):
            last += 1
    return "".join([*kept, *lines[last:]])


def _with_table(text: str, steps: Steps, value: Mapping[str, Any]) -> str:
    """The text with a new table behind the last one of its section."""
    import tomlkit

    lines = text.splitlines(keepends=True)
    heads = [*_heads(lines), (len(lines), ())]
    document = tomlkit.document()
    section, name = str(steps[0]), steps[1]
    document[section] = _item([value] if isinstance(name, int) else {name: value}, HEADED)
    end = "\r\n" if "\r\n" in text else "\n"
    own = LONE.sub(end, document.as_string()).splitlines(keepends=True)
    alike = [(start, heads[k + 1][0]) for k, (start, steps) in enumerate(heads[:-1]) if steps[:1] == (section,)]
    place = _end(lines, *alike[-1]) if alike else len(lines)
    before = lines[:place]
    if before and not before[-1].endswith("\n"):
        before[-1] += end
    gap = [end] if before and before[-1].strip() else []
    return "".join([*before, *gap, *own, *lines[place:]])


#: comments, texts in quotes, and bare words
_TOKEN = re.compile(r"""#[^\n]*|"[^"\n]*"|'[^'\n]*'|[\w-]+""")


def renamed(text: str, wanted: Mapping[str, Any], old: str, new: str) -> str:
    """The text with another name in the place of one, where that says what is wanted; else with changed values.

    Parameters
    ----------
    wanted : mapping
        Its tables with the other name.

    Examples
    --------
    >>> renamed("[joints.A] # A\\n", {"joints": {"B": {}}}, "A", "B")
    '[joints.B] # A\\n'
    """
    import tomlkit

    bare = new if re.fullmatch(r"[A-Za-z0-9_-]+", new) else json.dumps(new, ensure_ascii=False)
    found = [token for token in _TOKEN.finditer(text) if token[0] in (old, f'"{old}"', f"'{old}'")]
    kept: set[int] = set()

    def changed(kept: set[int]) -> str:
        parts, last = [], 0
        for k, token in enumerate(found):
            if k not in kept:
                parts += [text[last : token.start()], bare if token[0] == old else token[0].replace(old, new)]
                last = token.end()
        return "".join([*parts, text[last:]])

    best = _alike(changed(kept), wanted)
    for k in range(len(found)):
        # Other things may have the same name.
        if (alike := _alike(changed(kept | {k}), wanted)) > best:
            kept, best = kept | {k}, alike
    other = changed(kept)
    return other if _says(other, wanted) else _changed(tomlkit.parse(text), toml.parse(text), wanted)


def _alike(text: str, wanted: Mapping[str, Any]) -> int:
    """How many values of a text are those that are wanted."""
    try:
        found = toml.parse(text)
    except InputError:
        return -1
    return len({*_leaves(found)} & {*_leaves(wanted)})


def _leaves(value: Any, path: Steps = ()) -> Iterator[tuple[Steps, str]]:
    if isinstance(value, Mapping | list) and value:
        for step, one in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _leaves(one, (*path, step))
    else:
        yield path, repr(value)


def line_of(text: str, key: str) -> int:
    """The line in which a dotted key stands, counted from 1, or the table that it would be in; 0 where neither does.

    Examples
    --------
    >>> line_of("title = 'bar'\\n[joints.A]\\nat = [0, 0]\\n", "joints.A.at.1")
    3
    """
    steps = [*key.split(".")]
    lines = text.splitlines()
    heads = [(-1, ()), *_heads(lines)]
    alike = [(len(own), k) for k, (_, own) in enumerate(heads) if [*map(str, own)] == steps[: len(own)]]
    depth, best = max(alike)
    start, end = heads[best][0], heads[best + 1][0] if best + 1 < len(heads) else len(lines)
    for number in range(start + 1, end):
        if depth < len(steps) and re.match(rf"\s*[\"']?{re.escape(steps[depth])}\b", lines[number]):
            return number + 1
    return start + 1


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
        if before.keys() == wanted.keys() or type(node[key]).__name__ != "InlineTable":
            _change_table(node[key], before, wanted, max(headed - 1, 0))
        else:
            # The library would leave blanks behind where keys of one line come and go.
            same = {k: node[key][k] for k in wanted if k in before and before[k] == wanted[k]}
            node[key] = _item({k: same.get(k, one) for k, one in wanted.items()}, 0)
    elif isinstance(before, list) and isinstance(wanted, list) and len(before) == len(wanted):
        # Entry by entry, so that lines and comments between them stay.
        for k, (old, new) in enumerate(zip(before, wanted, strict=True)):
            if old != new:
                _change(node[key], k, old, new, 0)
    elif isinstance(before, list) and isinstance(wanted, list) and wanted[: len(before)] == before:
        for one in wanted[len(before) :]:
            # A list of tables with heads grows by such tables.
            node[key].append(_item(one, int(type(node[key]).__name__ == "AoT")))
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
