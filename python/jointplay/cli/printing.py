"""The options of all commands that print tables: how much is printed, and how a CSV is written.

They are added to a command here, and read where it prints and writes: the commands need not hand them on.
"""

import functools
import inspect
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any

import typer


class Dialect(StrEnum):
    """How a CSV is written."""

    comma = "comma"
    semicolon = "semicolon"


@dataclass(frozen=True)
class Printing:
    """What was asked for."""

    #: all rows and columns
    every: bool = False
    csv_dialect: str = Dialect.comma.value
    #: the options that were typed and not left out
    typed: tuple[str, ...] = ()


#: how the parser calls what does not come from a default
TYPED = "COMMANDLINE"
_USUAL = Printing()
_ASKED = ContextVar("printing", default=_USUAL)
EVERY = Annotated[bool, typer.Option("--all", help="Print every row and every column, wide tables in blocks.")]
DIALECT = Annotated[
    Dialect,
    typer.Option("--csv-dialect", help="-o .csv: with commas and decimal points, or semicolons and decimal commas."),
]


def printed() -> Printing:
    """What the command that runs was asked for."""
    return _ASKED.get()


def prints(*, csv: bool = True) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Add these options to a command.

    Parameters
    ----------
    csv : bool, optional
        Whether it can write a CSV.
    """
    added: dict[str, tuple[Any, Any]] = {"every": (EVERY, False)}
    if csv:
        added["csv_dialect"] = (DIALECT, Dialect.comma)

    def with_options(command: Callable[..., int]) -> Callable[..., int]:
        @functools.wraps(command)
        def run(
            *, context: typer.Context, every: bool = False, csv_dialect: Dialect = Dialect.comma, **given: Any
        ) -> int:
            sources = {name: context.get_parameter_source(name) for name in given}
            typed = tuple(name for name, source in sources.items() if source is not None and source.name == TYPED)
            token = _ASKED.set(Printing(every, csv_dialect.value, typed))
            try:
                return command(**given)
            finally:
                _ASKED.reset(token)

        own = inspect.signature(command, eval_str=True)
        keyword = inspect.Parameter.KEYWORD_ONLY
        extra = [inspect.Parameter(name, keyword, default=put, annotation=kind) for name, (kind, put) in added.items()]
        extra.append(inspect.Parameter("context", keyword, annotation=typer.Context))
        vars(run)["__signature__"] = own.replace(parameters=[*own.parameters.values(), *extra])
        run.__annotations__ = {**command.__annotations__, **{p.name: p.annotation for p in extra}}
        return run

    return with_options
