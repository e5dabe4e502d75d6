"""The subcommand that compares mechanisms."""

from functools import partial
from typing import Annotated

import typer

from . import answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import First, Further, LoadCase, OutputPath, PointName, Second, Settings
from .printing import prints


@prints()
@with_figure("panel", "quantity", "against")
@asks(
    "compare",
    "What all are asked.",
    "worst",
    *("samples", "seed", "law", "sampling", "contact", "approach", "corrects", "target"),
)
def compare(
    first: First,
    second: Second,
    further: Further = None,
    question: str = "",
    components: Annotated[
        str | None,
        typer.Option(
            "--components",
            metavar="x,y,angle",
            help="What the others follow; if left out, the position, or all components with as many drives.",
        ),
    ] = None,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Compare mechanisms on one path.

    The drives of B, and of all that come after it, are solved so that their output follows that of A.
    """
    from jointplay.analyses.compare import compute

    files = (first, second, *(further or ()))
    a, b, *others = (answer.mechanism(file, settings, output_point, load_case) for file in files)
    ask = partial(compute, b=b, question=question, others=others, components=arguments.words(components))
    return answer.answer({"compare": partial(ask, **options.of(a, question))}, a, output, plot)
