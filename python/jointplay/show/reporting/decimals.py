"""The decimal sign of a page: numbers in its sentences, tables and figures as its readers write them.

Only what the program says is changed. What is marked as `translate="no"` stays as somebody has typed it: titles, names
of files, the file itself, the command.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from jointplay.errors import InputError, not_known

#: decimal signs, with the dialect of tables in text
DIALECTS = {".": "comma", ",": "semicolon"}
#: between thousands, where a comma would be read as a decimal sign
NARROW = "\u202f"
#: a number with decimals that is no part of a name or of a version; one with commas between its thousands
NUMBER = r"(?<![\w.])(?P<whole>\d+)\.(?P<part>\d+(?:e[+-]?\d+)?)(?![\w]|\.\w)"
THOUSANDS = r"(?<![\w.,])\d{1,3}(?:,\d{3})+(?![\w,])"
TEXT = re.compile(f"{NUMBER}|{THOUSANDS}")
#: the same on a page, beside what stays: tags, and elements that are kept as a whole
KEPT = r'<(?:(?P<kept>script|style|title)\b|(?P<typed>\w+) translate="no")(?s:.*?)</(?:(?P=kept)|(?P=typed))>'
PAGE = re.compile(f"{KEPT}|<[^>]*>|{TEXT.pattern}")

_SIGN: ContextVar[str] = ContextVar("sign", default=".")


def checked(sign: str) -> str:
    """A decimal sign.

    Raises
    ------
    InputError
        When it is none.
    """
    if sign not in DIALECTS:
        raise InputError(not_known(sign, "a decimal sign", DIALECTS), key="decimal")
    return sign


@contextmanager
def using(sign: str) -> Iterator[None]:
    """Write numbers with a decimal sign."""
    token = _SIGN.set(sign)
    try:
        yield
    finally:
        _SIGN.reset(token)


def current() -> str:
    """The decimal sign in use."""
    return _SIGN.get()


def in_text(text: str) -> str:
    """A text with the decimal sign in use.

    Examples
    --------
    >>> with using(","):
    ...     in_text("0.0409 deg of 1,024 specimens, version 2.4.6, J1.5")
    '0,0409 deg of 1\u202f024 specimens, version 2.4.6, J1.5'
    """
    return TEXT.sub(_written, text) if current() != "." else text


def in_page(page: str) -> str:
    """A page with the decimal sign in use, but for what stays as it was typed."""
    return PAGE.sub(_written, page) if current() != "." else page


def _written(found: re.Match[str]) -> str:
    if found["whole"] is not None:
        return f"{found['whole']},{found['part']}"
    return found[0] if found[0].startswith("<") else found[0].replace(",", NARROW)
