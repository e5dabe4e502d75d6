"""A lock on a path, held by the system: it ends with the process, however that ends."""

import errno
import os
import sys
from contextlib import suppress
from pathlib import Path

from jointplay.errors import InputError

#: what file systems say that know no locks; work goes on without
UNKNOWN = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP}


class Lock:
    """Keeps other runs away from a path, until it is released.

    Parameters
    ----------
    path : Path
        What is worked on. The lock is a hidden file beside it.

    Raises
    ------
    InputError
        When another run has it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.with_name(f".{path.name}.lock")
        while True:
            self._handle = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                _take(self._handle)
            except OSError as error:
                if error.errno in UNKNOWN:
                    return
                os.close(self._handle)
                problem = "another run works on it; wait until it is done, or name another path"
                raise InputError(problem, file=os.fspath(path)) from None
            # Whoever had it may have removed the file in the meantime: then this is a lock on nothing.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._handle), self._path.stat()):
                    return
            os.close(self._handle)

    def release(self) -> None:
        """Let others work."""
        if os.name == "posix":
            self._path.unlink(missing_ok=True)
            os.close(self._handle)
        else:
            os.close(self._handle)
            with suppress(OSError):
                self._path.unlink()


if sys.platform == "win32":
    import msvcrt

    def _take(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _take(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
