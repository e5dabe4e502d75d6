"""What ends the command from outside: Ctrl-C, and the signals of a scheduler or of a terminal that is closed.

A signal that asks the process to end is heard as Ctrl-C is, so that what is done is told and nothing half-written is
left behind. The second one ends it at once.
"""

from __future__ import annotations

import _thread
import atexit
import gc
import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType
from typing import NoReturn

#: signals that ask for an end, where the system has them
ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
#: added to the number of a signal, the exit code of what it ended
BY_SIGNAL = 128
#: seconds until Ctrl-C is told again where it was not heard
AGAIN = 0.02

#: the signal that ended the work
_heard: list[int] = []


def listen() -> None:
    """Hear what asks for an end, if whoever started the process did not turn it off."""
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _end)
    sys.unraisablehook = _unheard


def _end(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)
    _heard.append(number)
    raise KeyboardInterrupt


def _unheard(lost: sys.UnraisableHookArgs) -> None:
    """Ctrl-C that came while an object was taken apart, where nothing can be raised: it is told again."""
    if lost.exc_type is not None and issubclass(lost.exc_type, KeyboardInterrupt):
        again = threading.Timer(AGAIN, _thread.interrupt_main)
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(lost)


def leave(code: int) -> NoReturn:
    """Leave with the exit code of the command; nothing interrupts what is left to do.

    Parameters
    ----------
    code : int
        That of the command.
    """
    for number in (signal.SIGINT, *ENDING):
        signal.signal(number, signal.SIG_IGN)
    # The system takes the memory as a whole; the interpreter would take it apart object by object, which is slow.
    gc.freeze()
    # A command that was done all the same says so.
    if code != BY_SIGNAL + signal.SIGINT:
        sys.exit(code)
    # Python may have noted, where Ctrl-C passed through `exec`, to end by the signal in place of an exit code.
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()
    os._exit(BY_SIGNAL + _heard[-1] if _heard else code)
