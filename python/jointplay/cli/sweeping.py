"""The subcommand that asks for every value of something in the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from jointplay.errors import InputError

from . import answer, arguments, completing
from .belonging import refuse_unheard
from .drawing import NO_FIGURE, Figure, with_figure
from .options import (
    Assumed,
    Corrects,
    File,
    LoadCase,
    Offset,
    Output,
    Point,
    Points,
    Samples,
    Sampling,
    Scatter,
    Scheduler,
    Seed,
    Swept,
    Target,
)
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel", "quantity")
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
    question: Annotated[Swept, typer.Option("--question", "-q", help="What is asked at every value.")] = Swept.worst,
    output_point: Point = None,
    load_case: LoadCase = None,
    offset: Offset = None,
    samples: Samples = 131_072,
    seed: Seed = 0,
    law: Scatter = None,
    sampling: Points = Sampling.sobol,
    contact: Assumed = None,
    corrects: Corrects = None,
    target: Target = None,
    scheduler: Scheduler = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Compute the error for every value of something in the file."""
    from jointplay.analyses.sweep import compute

    refuse_unheard([question.value], own=("scheduler",))
    pairs = arguments.assignments(settings or (), "--set")
    m = answer.mechanism(file, arguments.only_set(pairs), output_point, load_case)
    keys, values = arguments.swept(pairs, answer.reader(m))
    # What a swept key reaches is said once, not again for every value.
    answer.change(m, dict.fromkeys(keys, values[0]))
    options: dict[str, Any] = {}
    if by:
        if len(by) > 1:
            raise InputError(f"one second key can be swept, here are {len(by)}", key="--by")
        (second,), others = arguments.swept(arguments.assignments(by, "--by"), answer.reader(m), "--by")
        answer.change(m, {second: others[0]})
        options["by"] = {second: others}
    if question is Swept.random:
        options |= answer.scatter(samples, seed, law, sampling) | {"contact": contact and contact.value}
    if question is Swept.compensate:
        options |= {"corrects": corrects.value if corrects else None, "target": answer.target(m, target)}
    if question is Swept.given:
        options |= {"offsets": answer.offsets(m, offset)}

    def ask(m: Mechanism, progress: Any) -> Result:
        return compute(m, keys, values, question.value, progress=progress, scheduler=scheduler, **options)

    # Of pairs of values there are other figures.
    return answer.answer({"pairs" if by else "sweep": ask}, m, output, plot)
