"""The subcommand that finds the largest sizes."""

from functools import partial
from typing import Annotated

import typer

from . import answer
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import File, LoadCase, OutputPath, PointName, Probability, Settings
from .printing import prints


@prints()
@with_figure("panel")
@asks(
    "allow",
    "In which question the limits have to hold.",
    "worst",
    *("samples", "seed", "law", "sampling", "contact", "sizes"),
    samples=20_000,
)
def allow(
    file: File,
    question: str = "",
    probability: Probability = None,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="T", help="Relative tolerance of the sizes.")
    ] = 1e-4,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find how large every source may be, and the fits to order.

    The limits of the file hold with the largest size of every source, as it is for itself.
    """
    from jointplay.analyses.allow import compute, keeps

    m = answer.mechanism(file, settings, output_point, load_case)
    every = {"probability": probability, "tolerance": tolerance, **options.of(m, question)}
    # What a source alone may be says nothing of the limits as they are.
    return answer.answer({"allow": partial(compute, question=question, **every)}, m, output, plot, keeps)
