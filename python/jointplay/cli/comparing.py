"""The subcommand that compares two mechanisms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import answer, arguments
from .belonging import refuse_unheard
from .drawing import NO_FIGURE, Figure, with_figure
from .options import (
    Assumed,
    Compared,
    Corrects,
    First,
    LoadCase,
    Output,
    Point,
    Points,
    Samples,
    Sampling,
    Scatter,
    Second,
    Seed,
    Settings,
    Target,
)
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel", "quantity")
def compare(
    first: First,
    second: Second,
    question: Annotated[Compared, typer.Option("--question", "-q", help="What both are asked.")] = Compared.worst,
    components: Annotated[
        str | None,
        typer.Option(
            "--components",
            metavar="x,y,angle",
            help="What B follows; if left out, the position, or all components if B has as many drives.",
        ),
    ] = None,
    samples: Samples = 131_072,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Assumed = None,
    corrects: Corrects = None,
    target: Target = None,
    output_point: Point = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Compare two mechanisms on one path.

    The drives of B are solved so that its output follows that of A.
    """
    from jointplay.analyses.compare import compute

    refuse_unheard([question.value])
    a, b = (answer.mechanism(file, settings, output_point, load_case) for file in (first, second))
    options: dict[str, Any] = {}
    if question is Compared.random:
        options = answer.scatter(samples, seed, law, sampling) | {"contact": contact and contact.value}
    if question is Compared.compensate:
        options = {"corrects": corrects.value if corrects else None, "target": answer.target(a, target)}
    followed = arguments.words(components)

    def ask(m: Mechanism) -> Result:
        return compute(m, b, question.value, components=followed, **options)

    return answer.answer({"compare": ask}, a, output, plot)
