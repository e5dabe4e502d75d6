"""The subcommands about the nominal mechanism: its motion, and how near it is to a singularity."""

from functools import partial
from typing import Annotated

import typer

from . import answer, arguments
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import File, OutputPath, PointName, Settings
from .printing import prints


@prints()
@with_figure("panel", "configuration")
def solve(
    file: File,
    output_point: PointName = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Solve the nominal mechanism along its path.

    Says where the output is, which drives a path needs, and how near every configuration is to a singular one.
    """
    from jointplay.analyses.solve import compute

    return answer.answer({"solve": compute}, answer.mechanism(file, settings, output_point), output, plot)


@prints()
@with_figure("panel", "configuration", "against")
def singularities(
    file: File,
    length: Annotated[
        float | None,
        typer.Option("--length", metavar="L", help="Length that counts as a radian. [default: size of the mechanism]"),
    ] = None,
    components: Annotated[
        str | None,
        typer.Option("--components", metavar="x,y,...", help="What of the output has to move; see the manual."),
    ] = None,
    path: Annotated[
        bool, typer.Option("--path/--no-path", help="Look for singularities between the configurations, too.")
    ] = True,
    output_point: PointName = None,
    settings: Settings = None,
    output: OutputPath = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find how near to a singularity it is, and what moves there.

    Says of which kind the nearest one is, and how far away along the path.
    """
    from jointplay.analyses.singularities import compute

    ask = partial(compute, length=length, components=arguments.words(components), path=path)
    return answer.answer({"singularities": ask}, answer.mechanism(file, settings, output_point), output, plot)
