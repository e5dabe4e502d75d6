"""TOML that is read in bounded time, whatever somebody puts there."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from jointplay.errors import InputError

#: tables and lists inside one another
DEEPEST = 20
#: parts of a dotted key; the time to read one grows with their square. Twice what can be valid, because the pattern
#: below also finds words with dots between them in a comment.
MOST_PARTS = 2 * DEEPEST
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?m)(?:^|[\[{{,])[ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS}}}")


class NotToml(InputError):
    """A text that is not TOML."""


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
        raise NotToml(_syntax(str(error)), file=file, key=key) from None
    except RecursionError:
        raise too_deep(file, key) from None
    except ValueError:
        # All that is left: Python refuses to read whole numbers of thousands of digits.
        raise InputError("a number has thousands of digits", file=file, key=key) from None


def too_deep(file: str = "", key: str = "") -> InputError:
    """The error for tables and lists inside one another."""
    return InputError(f"tables and lists are nested more than {DEEPEST} deep", file=file, key=key)


def check_depth(node: Any, *, file: str = "", key: str = "") -> None:
    """Refuse tables and lists that are nested too deep, also those that hold themselves.

    Raises
    ------
    InputError
    """
    level = [node]
    for _ in range(DEEPEST):
        level = [v for n in level for v in (n.values() if isinstance(n, Mapping) else n if isinstance(n, list) else ())]
        if not level:
            return
    raise too_deep(file, key)


def _syntax(message: str) -> str:
    """tomllib's message with its place in front."""
    found = re.fullmatch(r"(?s)(.*) \(at (.*)\)", message)
    what, where = found.groups() if found else (message, "")
    return f"{where}: is not TOML: {what}" if where else f"is not TOML: {what}"
