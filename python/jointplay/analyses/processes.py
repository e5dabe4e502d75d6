"""Work in further processes of this machine, for what Python itself computes, of which one thread runs at a time.

Every process is told a function and what is shared once, then lists of items. It answers each of them in its turn, and
None where it failed: that one is done here, where what it raises is seen. Answers have the order of the items, whoever
computes them. A process has one thread of the core; it is a plain interpreter, which does not read the program that
asks, and it ends with its input.
"""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import IO, Any

from jointplay import _core

#: more would wait for what is handed to them
MOST = 16
#: what a process runs
RUN = "from jointplay.analyses.processes import serve; serve()"


def cores() -> int:
    """Processors that this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)
    return min(len(allowed(0)) if allowed is not None else os.cpu_count() or 1, MOST)


class Processes:
    """Processes that compute ``function(*shared, item)``; none where nobody needs them, or they cannot be.

    Parameters
    ----------
    function : callable
        Of a module that can be imported.
    shared : tuple
    count : int
        How many; with fewer than two all is done here.
    """

    def __init__(self, function: Callable[..., Any], shared: tuple[Any, ...], count: int) -> None:
        self.function, self.shared = function, shared
        # What is no interpreter would start itself.
        self.count = 1 if getattr(sys, "frozen", False) or not sys.executable else count
        self._running: list[subprocess.Popen[bytes]] = []

    def each(self, items: Sequence[Any]) -> list[Any]:
        """The answers to items, in their order."""
        found = self._elsewhere(items) if self.count > 1 and len(items) > 1 else [None] * len(items)
        return [
            self.function(*self.shared, item) if answer is None else answer
            for item, answer in zip(items, found, strict=True)
        ]

    def close(self) -> None:
        """End all of them, also one that is at work."""
        for process in self._running:
            process.kill()
            with contextlib.suppress(OSError):
                process.communicate()
        self._running = []

    def _elsewhere(self, items: Sequence[Any]) -> list[Any]:
        found: list[Any] = [None] * len(items)
        try:
            if not self._running:
                self._start()
            for k, process in enumerate(self._running):
                _send(process.stdin, items[k :: self.count])
            for k, process in enumerate(self._running):
                found[k :: self.count] = pickle.load(_pipe(process.stdout))
        except (OSError, EOFError, pickle.PickleError):
            # What one of them does not answer is done here, and so is all that follows.
            self.count = 1
            self.close()
        except BaseException:
            self.close()
            raise
        return found

    def _start(self) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        for _ in range(self.count):
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", RUN], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
            )
            self._running.append(process)
            _send(process.stdin, (self.function, self.shared))


def serve() -> None:
    """Answer lists of items until there are no more; what is printed meanwhile goes to stderr."""
    # Ctrl-C goes to all; the one who asks decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _core.share_threads(1)
    given, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with contextlib.suppress(EOFError, BrokenPipeError):
        function, shared = pickle.load(given)
        while True:
            _send(answers, [_answer(function, shared, item) for item in pickle.load(given)])


def _answer(function: Callable[..., Any], shared: tuple[Any, ...], item: Any) -> Any:
    with contextlib.suppress(Exception):
        return function(*shared, item)
    return None


def _send(to: IO[bytes] | None, what: object) -> None:
    pickle.dump(what, _pipe(to))
    _pipe(to).flush()


def _pipe(end: IO[bytes] | None) -> IO[bytes]:
    assert end is not None
    return end
