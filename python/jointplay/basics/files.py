"""Files that are written as a whole, or not at all; and those that a mechanism file may name.

What is written is complete in memory before the disk is touched, goes to a new file beside its place, and gets its name
when the disk has it. A symbolic link stays, and what it leads to is replaced. A pipe or a device such as a terminal
cannot be replaced: it is written to.
"""

import os
import secrets
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jointplay.errors import InputError, shown

#: in front of the names of files that are not complete
HIDDEN = ".jointplay-"


def beside(path: str | os.PathLike[str], name: object, file: str, key: str) -> Path:
    """Where a file is that a mechanism file names: in its folder, and also what a link leads to is there.

    Whoever sends a mechanism sends a folder. With a link in it, what is read, and shown in messages, would be a file of
    whoever opens it.

    Parameters
    ----------
    path : path-like
        The mechanism file; it may be a link itself.
    name : object
        What it says is the name of the file.
    file : str
        Name of the mechanism file in messages.
    key : str
        Where it says so.

    Raises
    ------
    InputError
        When it is no name without a folder, or there is no such file.
    """
    if not isinstance(name, str) or name in ("", ".", "..") or Path(name).name != name or "\\" in name:
        problem = f"{shown(name)} is not the name of a file in the same folder, without its folder"
        raise InputError(problem, file=file, key=key)
    place = Path(path).parent / name
    # Before it is asked whether there is something, which is nobody's business elsewhere.
    if not is_within(place, place.parent):
        problem = f"{shown(name)} is a link that leads out of the folder; copy the file into it"
        raise InputError(problem, file=file, key=key)
    try:
        mode = place.stat().st_mode
    except (OSError, ValueError):
        raise InputError(f"there is no file {shown(name)} in the same folder", file=file, key=key) from None
    if not stat.S_ISREG(mode):
        raise InputError(f"{shown(name)} is no file", file=file, key=key)
    return place


def is_within(place: Path, folder: Path) -> bool:
    """Whether what a path leads to, links followed, is in a folder or in one below it."""
    try:
        return Path(os.path.realpath(place)).is_relative_to(os.path.realpath(folder))
    except (OSError, ValueError):
        # A name that no system has leads nowhere.
        return True


def require_writable(path: Path, *, folder: bool = False) -> Path:
    """Where a file goes: the path itself, or what a symbolic link leads to.

    Parameters
    ----------
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
    new = _hidden(place.parent)
    try:
        new.touch(0o600, exist_ok=False)
        yield new
        # Until now it was its owner's alone; it becomes as readable as what it replaces, or as any other new file.
        new.chmod(stat.S_IMODE(place.stat().st_mode) if place.exists() else 0o666 & ~_umask())
        new.replace(place)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def _hidden(parent: Path) -> Path:
    """A name that is known before there is something, so that an interruption in between leaves nothing behind."""
    return parent / f"{HIDDEN}{secrets.token_hex(8)}"


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
def _room(parent: Path) -> Iterator[Path]:
    """A hidden folder that goes at the end."""
    room = _hidden(parent)
    try:
        room.mkdir(0o700)
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
        new, old = room / "new", room / "old"
        write(new)
        if place.is_dir():
            place.replace(old)
        try:
            new.replace(place)
        except BaseException:
            if old.is_dir():
                old.replace(place)
            raise
