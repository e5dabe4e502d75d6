"""Bundled mechanisms to start from, each with comments that explain its file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from importlib import resources
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known
from jointplay.file import toml
from jointplay.file.schema import SpatialFile
from jointplay.file.schema.keys import assign, expand, what_is_reached
from jointplay.model.mechanism import Mechanism, loads

from .antenna_support import AntennaSupport
from .delta import Delta
from .stewart_gough import StewartGough
from .template import Template
from .three_upu import ThreeUpu

__all__ = ["names", "parameters", "text", "title"]

_PLANAR = (
    *("four-bar", "p3r", "slider-crank", "slider-crank-cases", "five-bar", "3-rrr", "six-bar", "serial-2r"),
    *("excavator", "four-bar-fits", "press", "press-running", "five-bar-friction", "straight-line"),
)
_PLANAR_OVER_CONSTRAINED = ("redundant-bar", "x-braced-square", "antenna-support")
_TEMPLATES: Mapping[str, type[Template]] = {
    template.name: template for template in (AntennaSupport, ThreeUpu, StewartGough, Delta)
}
_COUPLED = ("geared-five-bar", "rack-slider", "belt-arm", "ball-screw", "planetary-gear")
_SPATIAL = (
    *("serial-6r", "arm-with-gearboxes", "rssr", "3-upu", "stewart-gough", "delta", "delta-by-hand"),
    "3-rrr-spherical",
)
_SPATIAL_OVER_CONSTRAINED = ("sarrus", "bennett", "four-legged-platform")
_NAMES = (*_PLANAR, *_PLANAR_OVER_CONSTRAINED, *_SPATIAL, *_SPATIAL_OVER_CONSTRAINED, *_COUPLED)


def names() -> tuple[str, ...]:
    """Names of the examples, the easiest first.

    Examples
    --------
    >>> names()[0]
    'four-bar'
    """
    return _NAMES


@typed
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
    return _title(name)


@cache
def _title(name: str) -> str:
    """The same, once read: every page of the studio lists all of them."""
    return str(tomllib.loads(text(name))["title"])


@typed
def parameters(name: str) -> dict[str, float | str]:
    """The sizes from which an example is written, with their usual values; none for one that is a file as it stands.

    Parameters
    ----------
    name : str
        One of `names()`.

    Examples
    --------
    >>> parameters("3-upu")["base_radius"]
    300
    """
    _check(name)
    return asdict(_TEMPLATES[name]()) if name in _TEMPLATES else {}


@typed
def text(name: str, settings: Mapping[str, str] | None = None) -> str:
    """The file of an example.

    Parameters
    ----------
    name : str
        One of `names()`.
    settings : mapping, optional
        Values to put in, as TOML, by dotted key (``*`` for every entry that has the rest of the key), or sizes by
        name (see `parameters`). A value that is not TOML is taken as text. Comments stay.

    Raises
    ------
    InputError
        When there is no such example, or a setting is not valid in it.

    Examples
    --------
    >>> print(text("four-bar", {"title": "Mine"}).splitlines()[6])
    title  = "Mine"
    """
    return changed_text(name, settings or {})[0]


def changed_text(name: str, settings: Mapping[str, str]) -> tuple[str, list[str]]:
    """The file that `text` gives, and of every key with a ``*`` what it reached.

    Examples
    --------
    >>> changed_text("four-bar", {"joints.*.clearance.radial": "0.2"})[1]
    ['joints.*.clearance.radial: 4 of 4 joints']
    """
    _check(name)
    given = dict(settings)
    content = _written(name, given)
    if not given:
        return content, []
    file = f"{name}.toml"
    document = tomlkit.parse(content)
    reached = []
    for key, value in given.items():
        data = document.unwrap()
        places = expand(data, key, file)
        if "*" in key.split("."):
            reached.append(what_is_reached(data, key, places))
        for steps in places:
            assign(document, steps, _value(value, key), table=tomlkit.table)
    Mechanism(document.unwrap(), file)  # before it is written: TOML has no way to write some mistakes
    content = document.as_string()
    loads(content, file)  # a file that we write is a file that we read
    return content, reached


def __dir__() -> list[str]:
    return sorted(__all__)


def _check(name: str) -> None:
    if name not in _NAMES:
        raise InputError(not_known(name, "an example", _NAMES))


def _written(name: str, settings: dict[str, str]) -> str:
    """The file with the sizes among the settings, which it takes out of them."""
    if name not in _TEMPLATES:
        return resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")
    template = _TEMPLATES[name]
    # What is neither a key of the file nor has a dot was meant as a size.
    keys_of_the_file = set(SpatialFile.model_fields) - set(template.sizes())
    sizes = [key for key in settings if "." not in key and key not in keys_of_the_file]
    content = template.of({key: _plain(_value(settings.pop(key), key)) for key in sizes}).text()
    loads(content, f"{name}.toml")  # sizes can contradict each other in ways that only the mechanism shows
    return content


def _plain(value: Any) -> Any:
    return value.unwrap() if hasattr(value, "unwrap") else value


def _value(written: str, key: str) -> Any:
    try:
        toml.check_plain(toml.parse(f"value = {written}\n", key=key), key=key)
        parsed = tomlkit.parse(f"value = {written}\n")
    except (toml.NotToml, TOMLKitError):
        return written
    # Text with line ends could bring keys of its own.
    return parsed["value"] if len(parsed) == 1 else written
