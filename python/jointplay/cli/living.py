"""The subcommand that says how long the limits hold while joints wear."""

from functools import partial
from typing import Annotated, Any

import typer

from . import answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import File, LoadCase, OutputPath, Passes, PointName, Probability, Settings
from .printing import prints


@prints()
@with_figure("panel")
@asks(
    "life",
    "In which question the limits have to hold.",
    "worst",
    *("samples", "seed", "law", "sampling", "contact", "sizes"),
    samples=20_000,
)
def life(
    file: File,
    question: str = "",
    cycles: Annotated[
        str | None,
        typer.Option(
            "--cycles", metavar="A:B:N", help="Ages at which clearances and errors are given: A to B, or A,B,C."
        ),
    ] = None,
    cycle: Annotated[
        Passes | None,
        typer.Option("--cycle", help="What a cycle is. [default: closed where the path is, else back-and-forth]"),
    ] = None,
    probability: Probability = None,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="T", help="Relative tolerance of the life.")
    ] = 1e-4,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Say for how many cycles the limits hold while joints wear.

    Clearances grow by the loads and the sliding along the path. Exit code 1: the limits are missed within the ages
    that are given, those of forces at the end of the life, or it is not known whether they hold.
    """
    from jointplay.analyses.life import compute, holds

    m = answer.mechanism(file, settings, output_point, load_case)
    ages = None if cycles is None else arguments.several(cycles, "--cycles", answer.reader(m))
    every: dict[str, Any] = {"question": question, "cycles": ages, "cycle": None if cycle is None else cycle.value}
    every |= {"probability": probability, "tolerance": tolerance, **options.of(m, question)}
    return answer.answer({"life": partial(compute, **every)}, m, output, plot, holds)
