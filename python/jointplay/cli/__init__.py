"""The command `jointplay`. Its subcommands call the analyses; what is slow to import waits until it is needed."""

from __future__ import annotations

import os
import sys

from jointplay.errors import JointplayError, one_line

#: exit codes
DONE, NOT_OK, BAD_INPUT, INTERRUPTED, BROKEN_PIPE = 0, 1, 2, 130, 141


def main() -> None:
    """Entry point: run the command and leave with its exit code."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : list of str
        What follows the name of the command.

    Returns
    -------
    int
        0 done, 1 done but some configuration is not ok, 2 bad input, 130 interrupted.
    """
    try:
        code = _done(arguments)
        sys.stdout.flush()
    except JointplayError as problem:
        return _refuse(str(problem))
    except BrokenPipeError:
        # The reader has gone; nothing more can be said, also not by the interpreter when it leaves.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt:
        return _interrupted()
    except Exception as problem:
        # What typer raises for bad usage and for Ctrl-C has no public base class.
        bases = {base.__name__ for base in type(problem).__mro__}
        if "Abort" in bases:
            return _interrupted()
        if "Exit" in bases:
            return int(problem.exit_code)  # type: ignore[attr-defined]
        if "ClickException" not in bases:
            raise
        return _refuse(one_line(problem.format_message()))  # type: ignore[attr-defined]
    return code if isinstance(code, int) else DONE


def _done(arguments: list[str]) -> object:
    """What a command gives; unlike `app()` this leaves Ctrl-C to the caller, who has something to say."""
    from typer.main import get_command

    from .commands import app

    command = get_command(app)
    with command.make_context("jointplay", arguments) as context:
        return command.invoke(context)


def _refuse(message: str) -> int:
    sys.stderr.write(f"error: {message}\n")
    return BAD_INPUT


def _interrupted() -> int:
    sys.stderr.write("interrupted before there was anything to tell\n")
    return INTERRUPTED
