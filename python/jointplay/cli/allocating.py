"""The subcommand that finds the cheapest sizes."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from . import INTERRUPTED, answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import RESULTS, File, PointName, Settings, ShownChanges, writes
from .printing import prints


@prints()
@with_figure("panel")
@asks(
    "allocate",
    "In which question the limits have to hold. [default: worst, without --probability]",
    None,
    *("contact", "samples", "seed"),
    samples=32_768,
)
def allocate(
    file: File,
    question: str | None = None,
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
    changes: ShownChanges = False,
    digits: Annotated[
        int, typer.Option("--digits", metavar="N", help="Digits of sizes by formula, which are rounded down.")
    ] = 3,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    settings: Settings = None,
    output: Annotated[Path | None, writes(f"Write the file with these sizes: .toml; or the result: {RESULTS}")] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find the cheapest sizes with which the limits hold.

    Limits and costs are those in the file.
    """
    from jointplay.analyses.allocate import compute
    from jointplay.model.sizing import sizings

    options.refuse_unheard(question or ("random" if probability is not None else "worst"))
    m = answer.mechanism(file, settings, output_point)
    factors = [] if curve is None else arguments.several(curve, "--curve", answer.reader(m))
    every = {"question": question, "probability": probability, "curve": factors, "digits": digits, **options.of(m)}
    answer.require_other(output, file)
    to_file = answer.file_as_built(output)
    ask = {"allocate": partial(compute, **every)}
    code, found = answer.answered(ask, m, None if to_file else output, plot)
    if code != INTERRUPTED:
        # Patterns are written out, because copies have sizes of their own.
        answer.changed(lambda: sizings(m)[0], found["allocate"], to_file, "no sizes were found", is_shown=changes)
    return code
