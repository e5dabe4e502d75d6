"""Files that are there as a whole, or not at all.

What is written is complete in memory before the disk is touched, goes to a new file beside its place, and gets its name
when the disk has it. A symbolic link stays, and what it leads to is replaced. A pipe or a device such as a terminal
cannot be replaced: it is written to.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jointplay.errors import InputError

#: in front of the names of files that are not complete
HIDDEN = ".jointplay-"


def require_writable(path: Path, *, folder: bool = False) -> Path:
    """Where a file goes: the path itself, or what a symbolic link leads to.

    Parameters
    ----------
    path : Path
    folder : bool
        Whether a folder is written and not a file.

    Raises
    ------
    InputError
        When nothing can be written there: said before long work, not after it.
    """
    with said_of(path):
        place = Path(os.path.realpath(path))
        try:
            there = place.stat()
        except FileNotFoundError:
            there = None
        parent = place.parent.is_dir()
    name = os.fspath(path)
    if not parent:
        folder_name = place.parent if path.is_symlink() else path.parent
        raise InputError(f"there is no folder '{folder_name}' to write it to", file=name)
    if there is None or stat.S_ISREG(there.st_mode) or stat.S_ISDIR(there.st_mode):
        if there is not None and stat.S_ISDIR(there.st_mode) != folder:
            raise InputError("is a folder; name a file" if not folder else "is a file; name a folder", file=name)
        if not os.access(place.parent, os.W_OK):
            raise InputError(f"cannot be written: nothing may be written to the folder '{place.parent}'", file=name)
        if there is not None and not os.access(place, os.W_OK):
            raise InputError("cannot be written: it is protected against writing", file=name)
    elif folder or not _is_stream(there.st_mode):
        raise InputError("is neither a file nor something that takes one; name a file", file=name)
    return place


def _is_stream(mode: int) -> bool:
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode)


@contextmanager
def said_of(path: Path) -> Iterator[None]:
    """What the system refuses, as one line on this path."""
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=os.fspath(path)) from None
    except ValueError as error:
        # Names that no system has: with a zero byte in them, or letters that the file system cannot spell.
        raise InputError(f"is not the name of a file: {error}", file=os.fspath(path)) from None


def put(content: bytes | memoryview, path: Path) -> None:
    """Write a file.

    Raises
    ------
    InputError
        When it cannot be written. What was there before is there still.
    """
    place = require_writable(path)
    with said_of(path):
        if place.exists() and not place.is_file():
            with place.open("wb", buffering=0) as stream:
                _write(stream.fileno(), content)
            return
        with replacing(place) as new, new.open("wb", buffering=0) as stream:
            _write(stream.fileno(), content)
            os.fsync(stream.fileno())


def _write(handle: int, content: bytes | memoryview) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(handle, rest) :]


@contextmanager
def replacing(place: Path) -> Iterator[Path]:
    """A new file to write to, which then takes this place; it goes away when that fails."""
    handle, name = tempfile.mkstemp(prefix=HIDDEN, dir=place.parent)
    os.close(handle)
    new = Path(name)
    try:
        yield new
        # mkstemp keeps a file to its owner; this one is as readable as what it replaces, or as any other new file.
        new.chmod(stat.S_IMODE(place.stat().st_mode) if place.exists() else 0o666 & ~_umask())
        new.replace(place)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def remove_folder(path: str | os.PathLike[str]) -> None:
    """Remove a folder although threads that were writing when a disk was full still write, or tidy up.

    Raises
    ------
    OSError
        When it cannot be removed.
    """
    for _ in range(100):
        shutil.rmtree(path, ignore_errors=True)
        if not os.path.lexists(path):
            return
        time.sleep(0.01)
    shutil.rmtree(path)


@contextmanager
def _room(parent: Path) -> Iterator[str]:
    """A hidden folder that goes at the end."""
    room = tempfile.mkdtemp(prefix=HIDDEN, dir=parent)
    try:
        yield room
    finally:
        with suppress(OSError):
            remove_folder(room)


def put_folder(write: Callable[[Path], None], path: Path) -> None:
    """Have a folder written. One that is there gives way when the new one is complete.

    Raises
    ------
    InputError
        When it cannot be written. What was there before is there still.
    """
    place = require_writable(path, folder=True)
    with said_of(path), _room(place.parent) as room:
        new, old = Path(room) / "new", Path(room) / "old"
        write(new)
        if place.is_dir():
            place.replace(old)
        try:
            new.replace(place)
        except BaseException:
            if old.is_dir():
                old.replace(place)
            raise
