"""The subcommand that finds the deviations of one built machine from readings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jointplay.basics.files import require_writable
from jointplay.errors import InputError, shown

from . import DONE, INTERRUPTED, NOT_OK, answer, arguments
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import File, FrameAxes, PlayContact, Seed, Settings
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.result import Result


@prints()
@with_figure("panel")
def calibrate(
    file: File,
    measured: Annotated[
        str, typer.Option("--measured", metavar="TABLE", help="Readings: a CSV with the names of columns and units.")
    ],
    sigma: Annotated[
        list[str] | None,
        typer.Option(
            "--sigma",
            metavar="NAME=VALUE",
            help="Standard deviation of a reading: x=0.002, length=0.002, angle=0.001; or auto, by repeated ones.",
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free",
            metavar="NAME[=SIGMA]",
            help="Unknown as well, or with this standard deviation before any reading.",
        ),
    ] = None,
    fix: Annotated[list[str] | None, typer.Option("--fix", metavar="NAME", help="Held as the file has it.")] = None,
    frame: Annotated[
        FrameAxes, typer.Option("--frame", help="Whether the measuring device has the ground axes of the file.")
    ] = FrameAxes.known,
    zeroed: Annotated[
        list[str] | None,
        typer.Option("--zeroed", metavar="COLUMN", help="This column counts from an unknown zero, as a dial does."),
    ] = None,
    sizes: Annotated[
        bool, typer.Option("--sizes", help="Sizes of clearances and backlash, too, from readings under loads.")
    ] = False,
    contact: Annotated[
        PlayContact | None,
        typer.Option(
            "--contact",
            help="Play scatters, or lies where the loads of the file press it. [default: loaded where something loads]",
        ),
    ] = None,
    hold_out: Annotated[
        float, typer.Option("--hold-out", metavar="SHARE", help="Share of the rows that is predicted and not fitted.")
    ] = 0.0,
    seed: Seed = 0,
    posterior: Annotated[
        bool,
        typer.Option("--posterior", help="-o .toml: tolerances become what is left open, with its correlations."),
    ] = False,
    settings: Settings = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="Write the file as built: .toml; or the result: .nc, .zarr, .csv, .json, .parquet, .xlsx.",
        ),
    ] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find the deviations of a built machine from readings.

    The tolerances of the file say what is unknown. Exit code 1: the readings do not fit.
    """
    from jointplay.analyses.calibrate import as_built, compute, holds

    m = answer.mechanism(file, settings)
    to_file = output is not None and output.suffix.lower() == ".toml"
    if posterior and not to_file:
        raise InputError("goes with -o NAME.toml", key="--posterior")
    if to_file and output is not None:
        require_writable(output)
    options: dict[str, Any] = {"sigma": _sigma(sigma), "free": _free(free), "fix": (*(fix or ()),)}
    options |= {"frame": frame.value, "zeroed": (*(zeroed or ()),), "sizes": sizes}
    options |= {"contact": None if contact is None else contact.value, "hold_out": hold_out, "seed": seed}
    found: list[Result] = []

    def ask(m: Mechanism) -> Result:
        found.append(compute(m, measured, **options))
        return found[0]

    code = answer.answer({"calibrate": ask}, m, None if to_file else output, plot)
    if to_file and output is not None:
        as_built(m, found[0], posterior=posterior).write(output)
        typer.echo(f"  {output} is the file as built; {_about(posterior)}.")
    return code if not found or code == INTERRUPTED else DONE if holds(found[0]) else NOT_OK


def _about(posterior: bool) -> str:
    if posterior:
        return "its tolerances are what is left open"
    return "its tolerances stay as they were; --posterior writes what is left open"


def _sigma(given: Sequence[str] | None) -> Any:
    """Standard deviations by name; several may stand in one option."""
    if not given:
        return None
    if [*given] == ["auto"]:
        return "auto"
    pairs = arguments.assignments([part for one in given for part in arguments.parts(one, ",")], "--sigma")
    return {name: _number(text, f"--sigma {name}") for name, text in pairs.items()}


def _free(given: Sequence[str] | None) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for one in given or ():
        name, mark, text = one.partition("=")
        found[name.strip()] = _number(text, f"--free {name}") if mark else None
    return found


def _number(text: str, option: str) -> float:
    value = arguments.numbers(text, option)
    if isinstance(value, tuple) or not value > 0.0:
        raise InputError(f"{shown(text)} is no standard deviation, which is above zero", key=option)
    return value
