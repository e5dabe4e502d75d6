"""The subcommand that finds the workspace of a mechanism."""

import os
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from jointplay.basics.files import require_writable
from jointplay.errors import InputError

from . import INTERRUPTED, answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import RESULTS, File, LoadCase, PointName, Settings, writes
from .printing import prints

#: extensions of the boundary alone
BOUNDARIES = (".dxf", ".stl")


@prints()
@with_figure("panel")
@asks(
    "workspace",
    "In which question the limits of the file have to hold as well. [default: errors do not count]",
    None,
    *("first_order", "samples", "seed", "law", "sampling", "contact"),
    samples=1_024,
)
def workspace(
    file: File,
    grid: Annotated[
        list[str] | None,
        typer.Option(
            "--grid",
            "-g",
            metavar="NAME=A:B:N",
            help="Axis, such as x=-50:50:101; of rotations, orientations that are all needed. In place of the file's.",
        ),
    ] = None,
    centre: Annotated[
        str | None,
        typer.Option("--centre", metavar="X,Y[,Z]", help="Disc and box about it. [default: where they are largest]"),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--count",
            metavar="N",
            help="Nodes along the longest side, where no grid says it. [default: 101, in space 25]",
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", metavar="T", help="Of the boundary between nodes. [default: spacing / 1000]"),
    ] = None,
    question: str | None = None,
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Annotated[
        Path | None, writes(f"Write its boundary: .dxf (plane), .stl (space); or the result: {RESULTS}")
    ] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find the region in which it can be used.

    Says how large it is, and the largest disc and box in it. Exit code 1: there is none, or with a question the limits
    of forces cannot be judged.
    """
    from jointplay.analyses.workspace import compute
    from jointplay.result.write import check_path

    drawn = output if output is not None and output.suffix.lower() in BOUNDARIES else None
    if drawn is not None:
        require_writable(drawn)
    elif output is not None:
        check_path(output, BOUNDARIES)
    m = answer.mechanism(file, settings, output_point, load_case)
    if drawn is not None and drawn.suffix.lower() == ".stl" and "z" not in m.components:
        from jointplay.exchange.outlines import NO_SURFACE

        raise InputError(NO_SURFACE, file=os.fspath(drawn), key="--output")
    ranges = arguments.gridded(arguments.assignments(grid, "--grid"), answer.reader(m)) if grid else None
    middle = None if centre is None else arguments.numbers(centre, "--centre", (2, 3), answer.reader(m))
    asked = {} if question is None else options.of(m, question)
    every = {"grid": ranges, "question": question, "centre": middle, "count": count, "tolerance": tolerance, **asked}
    ask = {"workspace": partial(compute, **every)}
    code, found = answer.answered(ask, m, output if drawn is None else None, plot)
    if drawn is not None and code != INTERRUPTED:
        from jointplay.exchange.exporting import boundary

        boundary(found["workspace"], drawn)
        typer.echo(f"wrote {drawn}")
    return code
