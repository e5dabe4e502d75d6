"""A file for HDF5, which brings the whole process down where a file that it has open cannot be written."""

import io
from pathlib import Path
from typing import Any


class Patient(io.RawIOBase):
    """A new file that never refuses to be written.

    When the disk does, what follows is kept in memory until the file is closed. Ask `check` between larger pieces, so
    that this is not much.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w+b", buffering=0)
        self._error: OSError | None = None
        self._kept: list[tuple[int, bytes]] = []
        self._at = self._size = 0

    def check(self) -> None:
        """Raise what the disk has refused."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        """Write, on the disk or in memory."""
        content = bytes(data)
        if self._error is None:
            try:
                self._file.seek(self._at)
                rest = memoryview(content)
                while rest:
                    rest = rest[self._file.write(rest) :]
            except OSError as error:
                self._error = error
        if self._error is not None:
            self._kept.append((self._at, content))
        self._at += len(content)
        self._size = max(self._size, self._at)
        return len(content)

    def readinto(self, buffer: Any) -> int:
        """Read back what was written, wherever it is."""
        room = memoryview(buffer).cast("B")
        low, high = self._at, min(self._at + len(room), self._size)
        count = max(high - low, 0)
        self._file.seek(low)
        found = self._file.read(count) if count else b""
        room[:count] = found + bytes(count - len(found))
        for at, content in self._kept:
            a, b = max(at, low), min(at + len(content), high)
            if a < b:
                room[a - low : b - low] = content[a - at : b - at]
        self._at += count
        return count

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        """The place."""
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """Set the length."""
        self._size = self._at if size is None else size
        if self._error is None:
            try:
                self._file.truncate(self._size)
            except OSError as error:
                self._error = error
        return self._size

    def fileno(self) -> int:
        """The handle of the file."""
        return self._file.fileno()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()

    def readable(self) -> bool:
        """Yes."""
        return True

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True
