"""Bundled mechanisms to start from, each with comments that explain its file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from jointplay.errors import InputError, not_known
from jointplay.model import loads
from jointplay.schema.keys import assign, expand

_NAMES = ("four-bar", "p3r", "slider-crank", "five-bar", "3-rrr", "six-bar", "serial-2r")


def names() -> tuple[str, ...]:
    """Names of the examples, the easiest first.

    Examples
    --------
    >>> names()[0]
    'four-bar'
    """
    return _NAMES


def title(name: str) -> str:
    """What an example is.

    Parameters
    ----------
    name : str
        One of `names()`.

    Examples
    --------
    >>> title("3-rrr")
    '3-RRR planar parallel robot'
    """
    return str(tomllib.loads(_read(name))["title"])


def text(name: str, settings: Mapping[str, str] | None = None) -> str:
    """The file of an example.

    Parameters
    ----------
    name : str
        One of `names()`.
    settings : mapping, optional
        Values to put in, as TOML, by dotted key (``*`` for every entry that has the rest of the key). A value that
        is not TOML is taken as text. Comments stay.

    Raises
    ------
    InputError
        When there is no such example, or a setting is not valid in it.

    Examples
    --------
    >>> print(text("four-bar", {"title": "Mine"}).splitlines()[6])
    title  = "Mine"
    """
    content = _read(name)
    if not settings:
        return content
    file = f"{name}.toml"
    document = tomlkit.parse(content)
    for key, value in settings.items():
        for steps in expand(document.unwrap(), key, file):
            assign(document, steps, _value(value), table=tomlkit.table)
    content = document.as_string()
    loads(content, file)  # a file that we write is a file that we read
    return content


def _read(name: str) -> str:
    if name not in _NAMES:
        raise InputError(not_known(name, "an example", _NAMES))
    return resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")


def _value(written: str) -> Any:
    try:
        parsed = tomlkit.parse(f"value = {written}\n")
    except (TOMLKitError, ValueError):
        return written
    # Text with line ends could bring keys of its own.
    return parsed["value"] if len(parsed) == 1 else written
