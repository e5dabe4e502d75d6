"""The command as a process of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

COMMAND = [sys.executable, "-m", "jointplay"]


def _listen() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def working(arguments: list[str], folder: Path | None = None) -> Iterator[subprocess.Popen[str]]:
    """The command at work; it does not outlive its test.

    It listens to Ctrl-C, which a shell takes from the tests, and so from their children, when it runs them in the
    background.
    """
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [*COMMAND, *arguments], cwd=folder, stdout=pipe, stderr=pipe, text=True, preexec_fn=_listen
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
