"""The subcommand that chooses dimensions."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from jointplay.errors import InputError, shown

from . import answer, arguments, completing
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import RESULTS, File, LimitsHold, PointName, Seed, Settings, ShownChanges, writes
from .printing import prints


@prints()
@with_figure("panel")
def design(
    file: File,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=A:B",
            help="A value of the file from A to B, of A:B:N equal steps, or one of A,B,C. [default: those of the file]",
            autocompletion=completing.keys,
        ),
    ] = None,
    aim: Annotated[
        str | None,
        typer.Option(
            "--aim",
            metavar="AIM",
            help="What is to be small, such as worst_position; A,B for a front of two; A=1,B=0.1 for a weighted sum."
            " [default: that of the file]",
        ),
    ] = None,
    question: Annotated[
        LimitsHold | None,
        typer.Option("--question", "-q", help="In which question the limits have to hold. [default: worst]"),
    ] = None,
    evaluations: Annotated[
        int, typer.Option("--evaluations", metavar="N", help="Attempts of the global search, at most.")
    ] = 1000,
    points: Annotated[int, typer.Option("--points", metavar="N", help="Designs of a front.")] = 9,
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", help="outside: random specimens of an attempt.")
    ] = 4096,
    seed: Seed = 0,
    changes: ShownChanges = False,
    output_point: PointName = None,
    settings: Settings = None,
    output: Annotated[Path | None, writes(f"Write the file with these values: .toml; or the result: {RESULTS}")] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Choose dimensions that make an error small.

    What may vary and what is to be small stands in [design] of the file, or here. What has to hold are the limits of
    the file, a pose at every configuration, and the tolerance of its target. Exit code 1: no design was found that
    holds everything.
    """
    from jointplay.analyses.design import compute

    answer.require_other(output, file)
    to_file = answer.file_as_built(output)
    m = answer.mechanism(file, settings, output_point)
    read = answer.reader(m)
    every: dict[str, Any] = {
        "vary": _variations(vary, read) if vary else None,
        "aim": None if aim is None else _aims(aim, read),
        "question": None if question is None else question.value,
        "evaluations": evaluations,
        "points": points,
        "samples": samples,
        "seed": seed,
    }
    code, found = answer.answered({"design": partial(compute, **every)}, m, None if to_file else output, plot)
    # The best design so far is one to go on from.
    why = "no design was found that holds everything"
    answer.changed(lambda: m, found["design"], to_file, why, is_shown=changes)
    return code


def _variations(given: list[str], read: arguments.Read) -> dict[str, object]:
    """By key what a value may become."""
    found: dict[str, object] = {}
    for key, text in arguments.assignments(given, "--vary").items():
        ends = arguments.parts(text, ":")
        if len(ends) == 2:
            low, high = (arguments.numbers(end, f"--vary {key}", None, read) for end in ends)
            found[key] = [low, high]
        elif len(ends) == 3 or len(arguments.parts(text, ",")) > 1:
            found[key] = {"values": arguments.several(text, f"--vary {key}", read)}
        else:
            problem = f"{shown(text)} is not from:to, such as 60:90, nor from:to:count or a list such as 60,63,67"
            raise InputError(problem, key=f"--vary {key}")
    return found


def _aims(text: str, read: arguments.Read) -> str | list[str] | dict[str, float]:
    """One aim, two for a front, or several with weights."""
    each = arguments.parts(text, ",")
    if not any("=" in one for one in each):
        return each if len(each) > 1 else text
    pairs = arguments.assignments(each, "--aim")
    weights = {key: arguments.numbers(value, f"--aim {key}", (1,), read) for key, value in pairs.items()}
    return {key: value[0] for key, value in weights.items() if isinstance(value, tuple)}
