"""Arguments and options that commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from . import completing


class Question(StrEnum):
    """What `error` can be asked."""

    all = "all"
    loaded = "loaded"
    worst = "worst"
    random = "random"
    given = "given"


class Correctable(StrEnum):
    """What `compensate` can correct."""

    loaded = "loaded"
    given = "given"


class Swept(StrEnum):
    """What `sweep` can ask."""

    worst = "worst"
    loaded = "loaded"
    random = "random"
    given = "given"
    solve = "solve"
    compensate = "compensate"


class Compared(StrEnum):
    """What `compare` can ask."""

    worst = "worst"
    loaded = "loaded"
    random = "random"
    compensate = "compensate"


class Allowed(StrEnum):
    """In which question `allow` has the limits hold."""

    worst = "worst"
    loaded = "loaded"
    random = "random"


class Allocated(StrEnum):
    """In which question `allocate` has the limits hold."""

    worst = "worst"
    random = "random"


class Law(StrEnum):
    """How clearances scatter."""

    uniform = "uniform"
    boundary = "boundary"
    normal = "normal"


class Sampling(StrEnum):
    """Which points random specimens are drawn by."""

    sobol = "sobol"
    plain = "plain"


class Contact(StrEnum):
    """Where clearances are in every specimen."""

    scattered = "scattered"
    loaded = "loaded"


class Sized(StrEnum):
    """Which sizes clearances have that scatter."""

    middle = "middle"
    largest = "largest"
    smallest = "smallest"


class Mapped(StrEnum):
    """What `map` can ask."""

    loaded = "loaded"
    worst = "worst"
    random = "random"
    given = "given"
    solve = "solve"


class Assembled(StrEnum):
    """What `assemble` can ask."""

    unit = "unit"
    worst = "worst"
    random = "random"


class Best(StrEnum):
    """By what `assemble` chooses the order of the steps."""

    force = "force"
    error = "error"


Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Ask the workers of this Dask scheduler, such as tcp://HOST:8786.",
    ),
]
File = Annotated[
    str,
    typer.Argument(metavar="FILE", help="Mechanism file (TOML).", show_default=False, autocompletion=completing.files),
]
First = Annotated[
    str,
    typer.Argument(
        metavar="A",
        help="Mechanism file that gives the path.",
        show_default=False,
        autocompletion=completing.files,
    ),
]
Second = Annotated[
    str,
    typer.Argument(
        metavar="B", help="Mechanism file that follows it.", show_default=False, autocompletion=completing.files
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        "-s",
        metavar="KEY=VALUE",
        help="Change a value of the file: joints.*.clearance.radial=0.2",
        autocompletion=completing.keys,
    ),
]
Point = Annotated[
    str | None,
    typer.Option("--output-point", metavar="NAME", help="Only this one of the outputs. [default: all of them]"),
]
LoadCase = Annotated[
    str | None, typer.Option("--load-case", metavar="NAME", help="Only this load case. [default: all of them]")
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="PATH",
        help="Write the result: .nc, .zarr, .csv, .json, .parquet, .xlsx.",
    ),
]
Offset = Annotated[
    list[str] | None,
    typer.Option(
        "--offset",
        metavar="NAME=VALUE",
        help="Given offset or deviation: J1=0.5,0 or J1.x=0.5 or l2=0.02",
        autocompletion=completing.offsets,
    ),
]
Corrects = Annotated[
    Correctable | None,
    typer.Option("--corrects", help="compensate: which error. [default: loaded where there is a load]"),
]
Target = Annotated[
    str | None,
    typer.Option(
        "--target", metavar="X,Y[,ANGLE]", help="Error to reach, in place of zero; in space X,Y,Z[,RX,RY,RZ]."
    ),
]
Samples = Annotated[
    int, typer.Option("--samples", metavar="N", help="Random specimens per configuration; best a power of two.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the random numbers.")]
Scatter = Annotated[
    Law | None, typer.Option("--law", help="How every clearance scatters, in place of the file's laws.")
]
Points = Annotated[
    Sampling, typer.Option("--sampling", help="random: scrambled Sobol points, or pseudo-random numbers.")
]
Shares = Annotated[
    bool,
    typer.Option("--indices", help="random: Sobol' indices of every source as well, where the first order may miss."),
]
Rare = Annotated[
    bool, typer.Option("--rare", help="random: search for specimens outside the limits where hardly any are.")
]
Touching = Annotated[
    Contact, typer.Option("--contact", help="random: clearances scatter, or the load decides where they are.")
]
Assumed = Annotated[
    Contact | None,
    typer.Option(
        "--contact",
        help="random: clearances scatter, or the load decides where they are. [default: as limits.contact says; with"
        " loads both]",
    ),
]
Certify = Annotated[bool, typer.Option("--certify", help="worst: upper bounds that no offsets within the sets exceed.")]
Parts = Annotated[
    int,
    typer.Option("--parts", metavar="N", help="worst: with --certify, parts of the sets looked at for each bound."),
]
Sizes = Annotated[
    Sized, typer.Option("--sizes", help="loaded, given: clearances that scatter have the sizes of this play.")
]
