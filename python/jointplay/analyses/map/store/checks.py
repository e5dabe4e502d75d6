"""Length and CRC-32 of files, kept within the file or beside it, by which damage is noticed."""

import os
import zlib
from pathlib import Path

from jointplay.errors import InputError

#: bytes that are read at a time
SLAB = 2**22

#: length and CRC-32 of a file; None where there is none
Stamp = tuple[int, int] | None
Stamps = dict[str, Stamp]


class Damaged(InputError):
    """A store in which something is not as it was written."""


def stamp(path: Path, *, sync: bool = False) -> Stamp:
    """Length and CRC-32 of a file; with `sync` after it has reached the disk."""
    length, crc = 0, 0
    try:
        with path.open("r+b" if sync else "rb") as stream:
            if sync:
                os.fsync(stream.fileno())
            while block := stream.read(SLAB):
                length, crc = length + len(block), zlib.crc32(block, crc)
    except FileNotFoundError:
        return None
    return length, crc


def put_sealed(content: bytes, path: Path) -> None:
    """Write a file that begins with its length and CRC-32. It appears as a whole, and is on the disk then."""
    new = path.with_name(f".{path.name}.new")
    with new.open("wb") as stream:
        stream.write(b"%d %d\n" % (len(content), zlib.crc32(content)))
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    new.replace(path)
    sync_folder(path.parent)


def sealed(path: Path) -> bytes:
    """The content of such a file.

    Raises
    ------
    ValueError
        When it is not what was written.
    """
    head, _, content = path.read_bytes().partition(b"\n")
    if head != b"%d %d" % (len(content), zlib.crc32(content)):
        raise ValueError("length or checksum differ")
    return content


def sync_folder(path: Path) -> None:
    """Have the names in a folder reach the disk, where the system knows of such a thing."""
    if os.name == "posix":
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
