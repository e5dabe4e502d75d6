"""The standard streams: closed, full, left by their reader, or with an alphabet that lacks a letter."""

import io
import os
import sys
from collections.abc import Iterable
from contextlib import suppress

from jointplay.errors import one_line

_held: list[str] = []


def open_all() -> None:
    """Let every stream exist and take every letter."""
    # A file that is opened while a stream is closed would get its number, and what is printed.
    while (handle := os.open(os.devnull, os.O_RDWR)) <= 2:
        if handle == 1:
            # Opened for reading: what is printed fails, and is not lost without a word.
            os.close(handle)
            os.open(os.devnull, os.O_RDONLY)
    os.close(handle)
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace" if stream is sys.stdout else "backslashreplace")


def hold(lines: Iterable[str]) -> None:
    """Keep remarks until there is an answer: of what is refused there is one message, and nothing else."""
    _held.extend(lines)


def tell() -> None:
    """Write the remarks that are kept to stderr."""
    lines = [f"{one_line(line)}\n" for line in _held]
    forget()
    sys.stderr.write("".join(lines))


def forget() -> None:
    """Drop the remarks that are kept."""
    _held.clear()


def let_go() -> None:
    """Drop what could not be printed, which the interpreter would try again when it leaves."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
