"""The subcommand that asks for every value of something in the file."""

from functools import partial
from typing import Annotated

import typer

from jointplay.errors import InputError

from . import answer, arguments, completing
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import COLOURED, NO_FIGURE, FigureFile, with_figure
from .options import File, LoadCase, OutputPath, PointName, Scheduler
from .printing import prints


@prints()
@with_figure("panel", "quantity", "against", *COLOURED)
@asks(
    "sweep",
    "What is asked at every value.",
    "worst",
    *("offset", "samples", "seed", "law", "sampling", "contact", "approach", "corrects", "target"),
)
def sweep(
    file: File,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            "-s",
            metavar="KEY=A:B:N",
            help="What is swept: KEY=from:to:count or KEY=1,2,5; KEY=VALUE only sets.",
            autocompletion=completing.keys,
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by",
            metavar="KEY=A:B:N",
            help="A second key with its values: every one of them with every one of --set.",
            autocompletion=completing.keys,
        ),
    ] = None,
    question: str = "",
    output_point: PointName = None,
    load_case: LoadCase = None,
    options: GivenOptions = NO_OPTIONS,
    scheduler: Scheduler = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Compute the error for every value of something in the file."""
    from jointplay.analyses.sweep import compute

    pairs = arguments.assignments(settings or (), "--set")
    m = answer.mechanism(file, arguments.only_set(pairs), output_point, load_case)
    keys, values = arguments.swept(pairs, answer.reader(m))
    # What a swept key reaches is said once, not again for every value.
    answer.change(m, dict.fromkeys(keys, values[0]))
    every = options.of(m, question)
    if by:
        if len(by) > 1:
            raise InputError(f"one second key can be swept, here are {len(by)}", key="--by")
        (second,), others = arguments.swept(arguments.assignments(by, "--by"), answer.reader(m), "--by")
        answer.change(m, {second: others[0]})
        every["by"] = {second: others}

    ask = partial(compute, key=keys, values=values, question=question, scheduler=scheduler, **every)
    # Of pairs of values there are other figures.
    return answer.answer({"pairs" if by else "sweep": ask}, m, output, plot)
