"""The subcommand that finds the cheapest sizes."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import answer, arguments
from .drawing import NO_FIGURE, Figure, with_figure
from .options import Allocated, File, Output, Point, Samples, Seed, Settings
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel")
def allocate(
    file: File,
    question: Annotated[
        Allocated | None,
        typer.Option(
            "--question",
            "-q",
            help="In which question the limits have to hold. [default: worst, without --probability]",
        ),
    ] = None,
    probability: Annotated[
        float | None,
        typer.Option(
            "--probability",
            metavar="P",
            help="random: share of the specimens that keeps to the limits. [default: that of the file]",
        ),
    ] = None,
    curve: Annotated[
        str | None,
        typer.Option(
            "--curve", metavar="A:B:N", help="The least cost with all limits times A to B, or times A,B,C; it is drawn."
        ),
    ] = None,
    changes: Annotated[
        bool, typer.Option("--changes", help="Print the changed values, too, as --set of other commands takes them.")
    ] = False,
    samples: Samples = 20_000,
    seed: Seed = 0,
    output_point: Point = None,
    settings: Settings = None,
    output: Output = None,
    plot: Figure = NO_FIGURE,
) -> int:
    """Find the cheapest sizes with which the limits hold.

    Limits and costs are those in the file.
    """
    from jointplay.analyses.allocate import compute

    m = answer.mechanism(file, settings, output_point)
    factors = [] if curve is None else arguments.several(curve, "--curve", answer.reader(m))
    found: list[Result] = []

    def ask(m: Mechanism, progress: Any) -> Result:
        found.append(
            compute(
                m,
                question.value if question else None,
                probability=probability,
                curve=factors,
                samples=samples,
                seed=seed,
                progress=progress,
            )
        )
        return found[0]

    code = answer.answer({"allocate": ask}, m, output, plot)
    for line in str(found[0].attrs.get("changes", "")).splitlines() if changes and found else ():
        typer.echo(f"--set {shlex.quote(line)}")
    return code
