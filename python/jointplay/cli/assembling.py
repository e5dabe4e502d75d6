"""The subcommand that follows an assembly."""

from functools import partial
from typing import Annotated

import typer

from jointplay.basics.progress import bar

from . import answer
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import Best, File, LoadCase, OutputPath, PointName, Settings
from .printing import prints


@prints()
@with_figure("panel")
@asks(
    "assemble",
    "One built specimen (unit), the worst case, or random specimens.",
    "unit",
    *("samples", "seed", "law", "sampling"),
    own=("unit",),
    samples=2_000,
)
def assemble(
    file: File,
    question: str = "",
    configuration: Annotated[
        int, typer.Option("--configuration", "-c", metavar="N", help="At which configuration, counted from 0.")
    ] = 0,
    best: Annotated[
        Best | None,
        typer.Option("--best", help="Put the steps into the order with the smallest forces or errors on the way."),
    ] = None,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Follow an assembly: errors, forces, whether parts fit.

    Says of every step what it is, how far off every joint is after it, and whether it fits.
    """
    from jointplay.analyses.assemble import best_order, compute

    answer.check_paths(output)
    m = answer.mechanism(file, settings, output_point, load_case)
    plot.check(m, ["assemble"])
    if best is not None:
        with bar("order") as progress:
            m = best_order(m, best.value, configuration=configuration, progress=progress)
    ask = partial(compute, question=question, configuration=configuration, **options.of(m))
    return answer.answer({"assemble": ask}, m, output, plot)
