"""The subcommand that finds the deviations of one built machine from readings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jointplay.basics.files import put, require_writable
from jointplay.errors import InputError, shown

from . import INTERRUPTED, answer, arguments
from .drawing import NO_FIGURE, FigureFile, with_figure
from .options import RESULTS, File, FrameAxes, OutputPath, PlayContact, Seed, Settings, writes
from .printing import prints

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism
    from jointplay.result import Result


Sigma = Annotated[
    list[str] | None,
    typer.Option(
        "--sigma",
        metavar="NAME=VALUE",
        help="Standard deviation of a reading: x=0.002, length=0.002, angle=0.001; or auto, by repeated ones.",
    ),
]
Free = Annotated[
    list[str] | None,
    typer.Option(
        "--free",
        metavar="NAME[=SIGMA]",
        help="Unknown as well, or with this standard deviation before any reading.",
    ),
]
Fix = Annotated[list[str] | None, typer.Option("--fix", metavar="NAME", help="Held as the file has it.")]
Axes = Annotated[
    FrameAxes, typer.Option("--frame", help="Whether the measuring device has the ground axes of the file.")
]
Zeroed = Annotated[
    list[str] | None,
    typer.Option("--zeroed", metavar="COLUMN", help="This column counts from an unknown zero, as a dial does."),
]
ClearanceSizes = Annotated[
    bool, typer.Option("--sizes", help="Sizes of clearances and backlash, too, from readings under loads.")
]
ContactChoice = Annotated[
    PlayContact | None,
    typer.Option(
        "--contact",
        help="Play scatters, or lies where the loads of the file press it. [default: loaded where something loads]",
    ),
]
MEASURED = "Readings: a CSV with the names of columns and units."


@prints()
@with_figure("panel")
def calibrate(
    file: File,
    measured: Annotated[str, typer.Option("--measured", metavar="TABLE", help=MEASURED)],
    sigma: Sigma = None,
    free: Free = None,
    fix: Fix = None,
    frame: Axes = FrameAxes.known,
    zeroed: Zeroed = None,
    sizes: ClearanceSizes = False,
    contact: ContactChoice = None,
    hold_out: Annotated[
        float, typer.Option("--hold-out", metavar="SHARE", help="Share of the rows that is predicted and not fitted.")
    ] = 0.0,
    seed: Seed = 0,
    posterior: Annotated[
        bool,
        typer.Option("--posterior", help="-o .toml: tolerances become what is left open, with its correlations."),
    ] = False,
    settings: Settings = None,
    output: Annotated[Path | None, writes(f"Write the file as built: .toml; or the result: {RESULTS}")] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Find the deviations of a built machine from readings.

    The tolerances of the file say what is unknown. Exit code 1: the readings do not fit.
    """
    from jointplay.analyses.calibrate import as_built, compute, holds

    m = answer.mechanism(file, settings)
    answer.require_other(output, file, measured)
    built = answer.file_as_built(output)
    if posterior and built is None:
        raise InputError("goes with -o NAME.toml", key="--posterior")
    options = _options(sigma, free, fix, frame, zeroed, sizes, contact) | {"hold_out": hold_out, "seed": seed}

    def ask(m: Mechanism, progress: Any) -> Result:
        found = compute(m, measured, **options, progress=progress)
        if built is not None:
            # Before anything is printed: what fails is told alone.
            as_built(m, found, posterior=posterior).write(built)
        return found

    code = answer.answer({"calibrate": ask}, m, None if built else output, plot, holds)
    if built is not None and code != INTERRUPTED:
        typer.echo(f"  {output} is the file as built; {_about(posterior)}.")
    return code


@prints(csv=False)
def plan(
    file: File,
    count: Annotated[
        int, typer.Option("--readings", "-n", metavar="N", min=1, help="How many readings are wanted.")
    ] = 8,
    columns: Annotated[
        str | None,
        typer.Option(
            "--columns",
            metavar="NAMES",
            help="What is read each time: x,y or dial:tip:z. [default: all components of all outputs]",
        ),
    ] = None,
    sigma: Sigma = None,
    measured: Annotated[
        str | None, typer.Option("--measured", metavar="TABLE", help="Readings that are there already.")
    ] = None,
    free: Free = None,
    fix: Fix = None,
    frame: Axes = FrameAxes.known,
    zeroed: Zeroed = None,
    sizes: ClearanceSizes = False,
    contact: ContactChoice = None,
    settings: Settings = None,
    output: Annotated[
        Path | None,
        writes("Write a table to fill in: .csv; or the result: .nc, .zarr, .json, .parquet, .xlsx, .md, .tex, .html."),
    ] = None,
) -> int:
    """Say which readings determine most of a built machine.

    They are chosen from the path or the grid of the file, without load and in each load case.
    """
    from jointplay.analyses.plan import compute, sheet_of

    m = answer.mechanism(file, settings)
    answer.require_other(output, file, measured)
    to_fill = output if output is not None and output.suffix.lower() == ".csv" else None
    if to_fill is not None:
        require_writable(to_fill)
    names = None if columns is None else tuple(arguments.parts(columns, ","))
    options = _options(sigma, free, fix, frame, zeroed, sizes, contact)

    def ask(m: Mechanism, progress: Any) -> Result:
        found = compute(m, count, columns=names, measured=measured, **options, progress=progress)
        if to_fill is not None:
            put(sheet_of(m, found).encode(), to_fill)
        return found

    code = answer.answer({"plan": ask}, m, None if to_fill else output, NO_FIGURE)
    if to_fill is not None and code != INTERRUPTED:
        typer.echo(f"  {output} is a table to fill in.")
    return code


@prints()
def diagnose(
    file: File,
    reversal: Annotated[
        str,
        typer.Option(
            "--reversal",
            metavar="TABLE",
            help="Readings at the same places under loads that push and pull: a CSV with a column load_case.",
        ),
    ],
    sigma: Sigma = None,
    settings: Settings = None,
    output: OutputPath = None,
) -> int:
    """Say which joints of a built machine are worn.

    Exit code 1: a joint has more or less play than the file allows, or the readings do not fit or do not show it.
    """
    from jointplay.analyses.diagnose import compute, holds

    m = answer.mechanism(file, settings)
    answer.require_other(output, file, reversal)
    asked = partial(compute, measured=reversal, sigma=_sigma(sigma))
    return answer.answer({"diagnose": asked}, m, output, NO_FIGURE, holds)


@prints()
def verify(
    file: File,
    measured: Annotated[str, typer.Option("--measured", metavar="TABLE", help=MEASURED)],
    sigma: Sigma = None,
    risk: Annotated[
        float, typer.Option("--risk", metavar="SHARE", help="Risk with which limits are accepted, or rejected.")
    ] = 0.05,
    settings: Settings = None,
    output: OutputPath = None,
) -> int:
    """Say whether measured poses keep to the limits.

    Exit code 1: the limits are rejected, or undecided.
    """
    from jointplay.analyses.verify import compute, holds

    m = answer.mechanism(file, settings)
    answer.require_other(output, file, measured)
    asked = partial(compute, measured=measured, sigma=_sigma(sigma), risk=risk)
    return answer.answer({"verify": asked}, m, output, NO_FIGURE, holds)


def _options(
    sigma: Sequence[str] | None,
    free: Sequence[str] | None,
    fix: Sequence[str] | None,
    frame: FrameAxes,
    zeroed: Sequence[str] | None,
    sizes: bool,
    contact: PlayContact | None,
) -> dict[str, Any]:
    """What both are asked with."""
    found: dict[str, Any] = {"sigma": _sigma(sigma), "free": _free(free), "fix": (*(fix or ()),)}
    found |= {"frame": frame.value, "zeroed": (*(zeroed or ()),), "sizes": sizes}
    return found | {"contact": None if contact is None else contact.value}


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
