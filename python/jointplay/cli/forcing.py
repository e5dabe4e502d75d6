"""The subcommand that says what play makes of the forces of drives and joints."""

from functools import partial
from typing import Annotated

import typer

from . import answer
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import NO_FIGURE
from .options import File, LoadCase, OutputPath, Probability, Settings
from .printing import prints


@prints()
@asks("forces", "At which offsets.", "worst", *("offset", "samples", "seed"), samples=4_096)
def forces(
    file: File,
    question: str = "",
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Only this force: drives.theta1, joints.J1. [default: all of them]"),
    ] = None,
    probability: Probability = None,
    options: GivenOptions = NO_OPTIONS,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: OutputPath = None,
) -> int:
    """Say how much play changes drive torques and reactions.

    worst: the least and largest forces that clearances and tolerances allow. loaded: where the load pushes the joints.
    random: of specimens. given: for given offsets (--offset).

    Exit code 1: some configuration is not ok, or limits.drive_torques or limits.reactions of the file are missed or
    not shown to hold.
    """
    from jointplay.analyses.forces import compute

    m = answer.mechanism(file, settings, None, load_case)
    every = {"question": question, "of": of or None, "probability": probability, **options.of(m, question)}
    return answer.answer({"forces": partial(compute, **every)}, m, output, NO_FIGURE)
