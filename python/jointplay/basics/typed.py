"""Arguments of public functions, checked against their annotations before anything is done with them.

A value of the wrong type is a `TypeError` that names function and parameter; what a value of the right type may be, is
for the function to say.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextvars import ContextVar
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np

from jointplay.errors import InputError

#: how messages call what `load` gives
MECHANISM = "a Mechanism"
LARGEST_FLOAT = int(np.finfo(float).max)

#: the public function that somebody has called
_ASKED: ContextVar[str] = ContextVar("asked", default="")
P = ParamSpec("P")
R = TypeVar("R")


class Alternative(NamedTuple):
    """One alternative of an annotation: what it is called in a message, and whether a value is one."""

    words: str
    fits: Callable[[Any], bool]


def typed(function: Callable[P, R]) -> Callable[P, R]:
    """The function, with its arguments checked first."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:
            # Too many or too few: Python says it best itself.
            return function(*args, **kwargs)
        for name, value in given.items():
            kind = signature.parameters[name].kind
            for one in value if kind is inspect.Parameter.VAR_POSITIONAL else (value,):
                if kind is not inspect.Parameter.VAR_KEYWORD:
                    check(function, name, one)
        _require_heard(function, given)
        if _ASKED.get():
            return function(*args, **kwargs)
        token = _ASKED.set(function.__name__)
        try:
            return function(*args, **kwargs)
        finally:
            _ASKED.reset(token)

    return checked


def waiting_for() -> str:
    """The public function whose answer somebody waits for, the outermost; nothing inside of commands and pages."""
    return _ASKED.get()


class Need(NamedTuple):
    """What an argument counts only with: another one with a value, or one that stands for that."""

    other: str
    value: object
    or_with: str = ""


def goes_with(need: Need, *names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare below `typed` that some arguments, where they are given, count only with another one."""

    def declared(function: Callable[P, R]) -> Callable[P, R]:
        vars(function)["needs"] = {**needs_of(function), **dict.fromkeys(names, need)}
        return function

    return declared


def needs_of(function: Callable[..., Any]) -> Mapping[str, Need]:
    """What arguments of a function count only with."""
    return getattr(function, "needs", {})


def _require_heard(function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    parameters = inspect.signature(function).parameters
    for name, (other, value, or_with) in needs_of(function).items():
        known = given.get(other, parameters[other].default)
        stands = or_with in given and known is None
        if name in given and known != value and not stands:
            raise InputError(f"goes with {other}={value!r}", key=name)


def options(function: Callable[..., Any], given: Mapping[str, Any], asked_by: str) -> None:
    """Check what goes on to a function by name.

    Raises
    ------
    TypeError
        When it has no such parameter, or the value is of the wrong type.
    InputError
        When it counts only with another one that is not given.
    """
    known = list(inspect.signature(function).parameters)[1:]
    for name, value in given.items():
        if name not in known:
            raise TypeError(f"{asked_by}(): '{name}' is not an option of {function.__name__}: {', '.join(known)}")
        check(inspect.unwrap(function), name, value)
    _require_heard(function, given)


def check(function: Callable[..., Any], name: str, value: object) -> None:
    """Check one argument.

    Raises
    ------
    TypeError
        When the value is of another type than the parameter's annotation says.
    """
    if name == "self":
        return
    kinds = _kinds(function, function.__annotations__[name])
    if not any(kind.fits(value) for kind in kinds):
        wanted = " or ".join(dict.fromkeys(kind.words for kind in kinds))
        raise TypeError(
            f"{function.__qualname__}(): '{name}' is {wanted}, not {_described(value)}{_advice(kinds, value)}"
        )


def _advice(kinds: Sequence[Alternative], value: object) -> str:
    """What to do where a file was given in place of its mechanism."""
    if not isinstance(value, str | os.PathLike) or all(kind.words != MECHANISM for kind in kinds):
        return ""
    if isinstance(value, str) and "\n" in value:
        return "; read the text first: jointplay.loads(text)"
    return f"; read the file first: jointplay.load({os.fspath(value)!r})"


def _described(value: object) -> str:
    if value is None:
        return "None"
    if isinstance(value, int) and abs(value) > LARGEST_FLOAT:
        return "a whole number of too many digits"
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        # Its keys are right, so it is what they have.
        return f"with values of type {', '.join(sorted({type(v).__name__ for v in value.values()}))}"
    return f"of type {type(value).__name__}"


@functools.cache
def _kinds(function: Callable[..., Any], annotation: str) -> tuple[Alternative, ...]:
    parts = [ALIASES.get(part, part) for part in _split(annotation, " | ")]
    return tuple(_kind(function, part) for part in _split(" | ".join(parts), " | "))


def _kind(function: Callable[..., Any], annotation: str) -> Alternative:
    name, _, inside = annotation.removesuffix("]").partition("[")
    if annotation in SIMPLE:
        return SIMPLE[annotation]
    if name.startswith("xr."):
        # xarray is slow to import; who has no such object need not.
        return Alternative(f"an xarray.{name[3:]}", lambda value: _is_of(value, "xarray", name[3:]))
    if name == "NDArray":
        return Alternative("an array of numbers", _is_array)
    if name in ("Sequence", "tuple"):
        elements = _split(inside, ", ")[0]
        each = _kinds(function, elements)
        if elements == "str":
            return Alternative("a word or several", lambda v: isinstance(v, str) or _are(v, each))
        return Alternative("a sequence of numbers", lambda v: _are(v, each) or _is_row(v))
    if name == "Iterable":
        return Alternative("a sequence of values", lambda v: isinstance(v, Iterable) and not _is_one(v))
    if name == "Mapping":
        each = _kinds(function, _split(inside, ", ")[1])
        words = " or ".join(kind.words for kind in each)
        values = "" if words == SIMPLE["Any"].words else f", each with {words}"
        return Alternative(f"a mapping with names as keys{values}", lambda value: _is_table(value, each))
    found = inspect.unwrap(function).__globals__[name]
    article = "an" if name[0] in "AEIO" else "a"
    return Alternative(f"{article} {name}", lambda value: isinstance(value, found))


def _split(text: str, by: str) -> list[str]:
    """Split where no bracket is open."""
    parts = [""]
    for piece in text.split(by):
        parts[-1] += piece
        if parts[-1].count("[") == parts[-1].count("]"):
            parts.append("")
        else:
            parts[-1] += by
    return parts[:-1]


def _is_of(value: object, package: str, name: str) -> bool:
    return any(c.__name__ == name and c.__module__.partition(".")[0] == package for c in type(value).__mro__)


def _is_flag(value: object) -> bool:
    return isinstance(value, bool | np.bool_)


def _is_count(value: object) -> bool:
    return isinstance(value, int | np.integer) and not _is_flag(value)


def _is_number(value: object) -> bool:
    # Whole numbers can be too large for a float.
    if isinstance(value, int) and abs(value) > LARGEST_FLOAT:
        return False
    return _is_count(value) or isinstance(value, float | np.floating)


def _is_row(value: object) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and _is_array(value)


def _is_array(value: object) -> bool:
    """Whether it is an array of real numbers, also one that is written as lists in lists."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "iuf"
    return isinstance(value, list | tuple) and all(_is_number(v) or _is_array(v) for v in value)


def _is_one(value: object) -> bool:
    """Whether what can be gone through means a single thing, or things by name."""
    return isinstance(value, str | bytes | Mapping)


def _are(value: object, each: Sequence[Alternative]) -> bool:
    if _is_one(value) or not isinstance(value, Sequence):
        return False
    return all(any(kind.fits(element) for kind in each) for element in value)


def _is_table(value: object, each: Sequence[Alternative] = ()) -> bool:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        return False
    return not each or all(any(kind.fits(v) for kind in each) for v in value.values())


SIMPLE = {
    "None": Alternative("None", lambda value: value is None),
    "bool": Alternative("True or False", _is_flag),
    "int": Alternative("a whole number", _is_count),
    "float": Alternative("a number", _is_number),
    "str": Alternative("text", lambda value: isinstance(value, str)),
    "object": Alternative("anything", lambda _: True),
    "Any": Alternative("anything", lambda _: True),
    "os.PathLike[str]": Alternative("a path", lambda value: isinstance(value, os.PathLike)),
    "Progress": Alternative("a function", callable),
    "Scheduler": Alternative(
        "a Dask client or the address of a scheduler",
        lambda value: isinstance(value, str) or _is_of(value, "distributed", "Client"),
    ),
}
#: names of annotations, which read here as text, with what they stand for
ALIASES = {
    "Offsets": "Mapping[str, Any] | NDArray[np.float64]",
    "Results": "Mapping[str, Result | xr.Dataset]",
}
