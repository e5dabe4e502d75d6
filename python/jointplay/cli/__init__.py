"""The command `jointplay`. Its subcommands call the analyses; what is slow to import waits until it is needed."""

import gc
import os
import sys
from contextlib import suppress

from jointplay.errors import JointplayError, one_line

from .stopping import leave, listen
from .streams import forget, let_go, open_all, tell

#: exit codes
DONE, NOT_OK, BAD_INPUT, INTERRUPTED, BROKEN_PIPE = 0, 1, 2, 130, 141
#: new objects after which the interpreter looks for garbage; a start makes 70,000, nearly all of which stay
GARBAGE = 50_000
#: threads of linear algebra in Python, whose matrices are small: more of them only wait, at the cost of the processor
LINEAR_ALGEBRA = ("OPENBLAS_NUM_THREADS", "1")


def main() -> None:
    """Entry point: run the command and leave with its exit code."""
    open_all()
    # Set by a shell that asks what could follow.
    if "_JOINTPLAY_COMPLETE" in os.environ:
        _complete()
    gc.set_threshold(GARBAGE)
    # NumPy reads it while it is imported.
    os.environ.setdefault(*LINEAR_ALGEBRA)
    try:
        listen()
        code = run(sys.argv[1:])
    except KeyboardInterrupt:
        # Once more, while the first one was being answered.
        code = INTERRUPTED
    leave(code)


def run(arguments: list[str]) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : list of str
        What follows the name of the command.

    Returns
    -------
    int
        0 done, 1 done but some configuration is not ok or a limit is missed, 2 bad input, 130 interrupted, 141
        nobody reads any more.
    """
    forget()
    try:
        code = _run(arguments)
        if code != BAD_INPUT:
            tell()
        sys.stdout.flush()
    except JointplayError as problem:
        return _refuse(str(problem))
    except BrokenPipeError:
        let_go()
        return BROKEN_PIPE
    except OSError as problem:
        # Files say their name; what is left is what is printed.
        let_go()
        reason = problem.strerror or str(problem)
        return _refuse(
            f"{problem.filename}: {reason}" if problem.filename else f"the standard output cannot be written: {reason}"
        )
    except MemoryError:
        return _refuse("there is not enough memory for this")
    except KeyboardInterrupt:
        _say("interrupted before there was anything to report")
        return INTERRUPTED
    return code


def _run(arguments: list[str]) -> int:
    """Run a subcommand, and say ourselves what a broken pipe or a file that ends too early is."""
    from typer.main import get_command

    from .commands import program

    try:
        command = get_command(program(*arguments[:1]))
        with command.make_context("jointplay", arguments) as context:
            code = command.invoke(context)
    except Exception as problem:
        # What typer raises has no public base class.
        bases = {base.__name__ for base in type(problem).__mro__}
        if "Exit" in bases:
            return int(problem.exit_code)  # type: ignore[attr-defined]
        if "ClickException" not in bases:
            raise
        # The words of the validation library before its sentence are not for users.
        return _refuse(problem.format_message().replace("Value error, ", ""))  # type: ignore[attr-defined]
    return code if isinstance(code, int) else DONE


def _complete() -> None:
    """Tell a shell what could follow, and leave."""
    from typer.main import get_command

    from .commands import program

    get_command(program()).main(prog_name="jointplay")


def _refuse(message: str) -> int:
    _say(f"error: {one_line(message)}")
    return BAD_INPUT


def _say(line: str) -> None:
    # Where the standard error is full or closed the exit code has to do.
    with suppress(OSError):
        sys.stderr.write(f"{line}\n")
