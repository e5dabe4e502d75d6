"""A bar for long work, on a terminal only."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: work shorter than this (seconds) needs no bar
PATIENCE = 0.7


@contextmanager
def bar(name: str) -> Iterator[Callable[[int, int], None] | None]:
    """What long work calls with the steps done and all steps; None where nobody looks."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    began = time.monotonic()
    progress = Progress(console=Console(stderr=True), transient=True)
    task = progress.add_task(name, total=None)

    def step(done: int, total: int) -> None:
        if not progress.live.is_started and time.monotonic() - began > PATIENCE:
            progress.start()
        progress.update(task, completed=done, total=total)

    try:
        yield step
    finally:
        progress.stop()
