"""The subcommand that compares two mechanisms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from . import answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import First, LoadCase, OutputPath, PointName, Second, Settings
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel", "quantity", "against")
@asks(
    "compare",
    "What both are asked.",
    "worst",
    *("samples", "seed", "law", "sampling", "contact", "approach", "corrects", "target"),
)
def compare(
    first: First,
    second: Second,
    question: str = "",
    components: Annotated[
        str | None,
        typer.Option(
            "--components",
            metavar="x,y,angle",
            help="What B follows; if left out, the position, or all components if B has as many drives.",
        ),
    ] = None,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Compare two mechanisms on one path.

    The drives of B are solved so that its output follows that of A.
    """
    from jointplay.analyses.compare import compute

    a, b = (answer.mechanism(file, settings, output_point, load_case) for file in (first, second))
    followed = arguments.words(components)

    def ask(m: Mechanism) -> Result:
        return compute(m, b, question, components=followed, **options.of(a, question))

    return answer.answer({"compare": ask}, a, output, plot)
