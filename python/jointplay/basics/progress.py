"""How far long work is: a bar on a terminal, a line in a notebook, nothing where nobody looks.

Commands show one for what they ask. A public function, which `typed` marks, shows one for the first long work in it
that nobody else watches; what goes on inside of that, in other threads too, shows no second one.
"""

from __future__ import annotations

import functools
import inspect
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

from .typed import typed, waiting_for

#: called with the steps done and all steps
TellStep = Callable[[int, int], None]
P = ParamSpec("P")
R = TypeVar("R")

#: work shorter than this (seconds) needs no bar
PATIENCE = 1.0
#: seconds between two lines of a notebook
PAUSE = 0.3

_BUSY = threading.Lock()
_wanted = True


@typed
def progress(shown: bool) -> None:
    """Choose whether long questions show how far they are: on a terminal, or in a notebook, after a second.

    They do so unless it is switched off. Where stderr is no terminal, such as in a file, nothing is shown in any case.
    With Ctrl-C, or the interrupt of a notebook, a question ends as described for it.

    Parameters
    ----------
    shown : bool

    Examples
    --------
    >>> import jointplay as jp
    >>> jp.progress(False)
    >>> jp.progress(True)
    """
    global _wanted
    _wanted = shown


def watched(compute: Callable[P, R]) -> Callable[P, R]:
    """Let long work show how far it is where its `progress` is left out and a public function waits for it."""
    knows = "progress" in inspect.signature(compute).parameters

    @functools.wraps(compute)
    def shown(*args: P.args, **kwargs: P.kwargs) -> R:
        name = waiting_for()
        if not (knows and name) or kwargs.get("progress") is not None:
            return compute(*args, **kwargs)
        with bar(name) as step:
            kwargs["progress"] = step
            return compute(*args, **kwargs)

    return shown


def counting(progress: TellStep | None, expected: int) -> Callable[[], None]:
    """What is called at each step of work of which nobody knows how many there are: about so many, else one more."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, max(expected, done + 1))

    return step


@contextmanager
def bar(name: str) -> Iterator[TellStep | None]:
    """What long work calls with the steps done and all steps; None where nobody looks, or looks at another one."""
    show = _in_notebook if _notebook() else _on_terminal if sys.stderr.isatty() else None
    if not _wanted or show is None or not _BUSY.acquire(blocking=False):
        yield None
        return
    try:
        with show(name) as step:
            yield step
    finally:
        _BUSY.release()


@contextmanager
def _on_terminal(name: str) -> Iterator[TellStep]:
    from rich.console import Console
    from rich.progress import Progress

    began = time.monotonic()
    found = Progress(console=Console(stderr=True), transient=True)
    task = found.add_task(name, total=None)

    def step(done: int, total: int) -> None:
        if not found.live.is_started and time.monotonic() - began > PATIENCE:
            found.start()
        found.update(task, completed=done, total=total)

    try:
        yield step
    finally:
        found.stop()


def _notebook() -> bool:
    """Whether a kernel shows what is displayed."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


@contextmanager
def _in_notebook(name: str) -> Iterator[TellStep]:
    """One line that is written again and again, and empty in the end: no widget, which pages and exports lack."""
    from IPython.display import display

    began = last = time.monotonic()
    line: Any = None

    def step(done: int, total: int) -> None:
        nonlocal last, line
        now = time.monotonic()
        if now - began < PATIENCE or (line is not None and now - last < PAUSE):
            return
        last = now
        shown = {"text/plain": f"{name}: {done} of {total}, {100 * done // max(total, 1)} %, {now - began:.0f} s"}
        if line is None:
            line = display(shown, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        else:
            line.update(shown, raw=True)

    try:
        yield step
    finally:
        if line is not None:
            line.update({"text/plain": ""}, raw=True)
