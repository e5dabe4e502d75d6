"""Arguments and options that commands share, and those of questions, which `belonging.asks` gives to commands."""

import inspect
from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from jointplay.questions import PARTS, SAMPLES, asked_by

from . import completing

Command = Callable[..., int]


def choice(*names: str) -> Any:
    """One of some words, as the type of an option."""
    return StrEnum("Choice", {name: name for name in names})


def option_of(kind: Any, *names: str, **settings: Any) -> Any:
    """An option as the annotation of a parameter."""
    return Annotated[kind, typer.Option(*names, **settings)]


def writes(said: str) -> Any:
    """The option that says where a command writes."""
    return typer.Option("--output", "-o", metavar="PATH", help=said)


def exchanged(run: Command, command: Command, places: Mapping[str, Mapping[str, tuple[Any, Any]]]) -> Command:
    """What runs a command, with parameters in place of some of those of the command: annotation and default by name."""
    signature = inspect.signature(command, eval_str=True)
    parameters = [
        one.replace(name=name, kind=one.KEYWORD_ONLY, annotation=annotation, default=usual)
        for one in signature.parameters.values()
        for name, (annotation, usual) in places.get(one.name, {one.name: (one.annotation, one.default)}).items()
    ]
    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def _option(kind: Any, left_out: Any, *names: str, **settings: Any) -> tuple[Any, Any]:
    """An option, and what is taken if it is left out."""
    return option_of(kind, *names, **settings), left_out


class Best(StrEnum):
    """By what `assemble` chooses the order of the steps."""

    force = "force"
    error = "error"


class LimitsHold(StrEnum):
    """In which question the limits have to hold where dimensions are chosen."""

    worst = "worst"
    loaded = "loaded"


class Passes(StrEnum):
    """How a cycle goes along the path."""

    closed = "closed"
    back_and_forth = "back-and-forth"
    one_way = "one-way"


class FrameAxes(StrEnum):
    """Whether the axes of a measuring device are those of the ground."""

    known = "known"
    unknown = "unknown"


class PlayContact(StrEnum):
    """Where the play lies while a machine is measured."""

    scattered = "scattered"
    loaded = "loaded"


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
Further = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="C", help="Further ones that follow it.", show_default=False, autocompletion=completing.files
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
PointName = Annotated[
    str | None,
    typer.Option("--output-point", metavar="NAME", help="Only this one of the outputs. [default: all of them]"),
]
Probability = Annotated[
    float | None,
    typer.Option(
        "--probability",
        metavar="P",
        help="random: share of the specimens that keeps to the limits. [default: that of the file, or 0.9973]",
    ),
]
LoadCase = Annotated[
    str | None, typer.Option("--load-case", metavar="NAME", help="Only this load case. [default: all of them]")
]
ShownChanges = Annotated[
    bool, typer.Option("--changes", help="Print the changed values, too, as --set of other commands takes them.")
]
#: the files that a result can be written as
RESULTS = ".nc, .zarr, .csv, .json, .parquet, .xlsx, .md, .tex, .html."
OutputPath = Annotated[Path | None, writes(f"Write the result: {RESULTS}")]
Offset = Annotated[
    list[str] | None,
    typer.Option(
        "--offset",
        metavar="NAME=VALUE",
        help="Given offset or deviation: J1=0.5,0 or J1.x=0.5 or l2=0.02",
        autocompletion=completing.offsets,
    ),
]
Target = Annotated[
    str | None,
    typer.Option(
        "--target", metavar="X,Y[,ANGLE]", help="Error to reach, in place of zero; in space X,Y,Z[,RX,RY,RZ]."
    ),
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the random numbers.")]

#: of questions, by the name of the parameter; each is one of the questions that have an argument of its name
OF_QUESTIONS: dict[str, tuple[Any, Any]] = {
    "offset": (Offset, None),
    "first_order": _option(
        bool, False, "--first-order", help="loaded, worst: to first order only, several times faster."
    ),
    "details": _option(
        bool,
        True,
        "--details/--no-details",
        help="loaded: reactions, offsets and shares of the sources at every node, too.",
    ),
    "certify": _option(bool, False, "--certify", help="worst: upper bounds that no offsets within the sets exceed."),
    "parts": _option(
        int | None,
        None,
        "--parts",
        metavar="N",
        help=f"worst: with --certify, parts of the sets looked at for each bound. [default: {PARTS}]",
    ),
    "samples": _option(
        int, SAMPLES, "--samples", metavar="N", help="Random specimens per configuration; best a power of two."
    ),
    "seed": (Seed, 0),
    "law": _option(
        choice("uniform", "boundary", "normal") | None,
        None,
        "--law",
        help="How every clearance scatters, in place of the file's laws.",
    ),
    "sampling": _option(
        choice("sobol", "plain"),
        "sobol",
        "--sampling",
        help="random: scrambled Sobol points, or pseudo-random numbers.",
    ),
    "contact": _option(
        choice("scattered", "loaded") | None,
        None,
        "--contact",
        help="random: clearances scatter, or the load decides where they are. [default: as limits.contact says; with"
        " loads both]",
    ),
    "indices": _option(
        bool,
        False,
        "--indices",
        help="random: Sobol' indices of every source as well, where the first order may miss.",
    ),
    "rare": _option(
        bool, False, "--rare", help="random: search for specimens outside the limits where hardly any are."
    ),
    "keep": _option(int, 0, "--keep", metavar="N", help="random: write N specimens of each configuration as well."),
    "keep_outside": _option(
        bool, False, "--keep-outside", help="random: with --keep, those beyond a limit or without a pose."
    ),
    "sizes": _option(
        choice("middle", "largest", "smallest"),
        "middle",
        "--sizes",
        help="loaded, given: clearances that scatter have the sizes of this play.",
    ),
    "approach": _option(
        choice("forward", "backward", "rest") | None,
        None,
        "--approach",
        help="loaded: friction counts, where the mechanism slides in this direction of its path, or where friction can"
        " hold it at rest. [default: none]",
    ),
    "corrects": _option(
        choice(*asked_by("compensate")) | None,
        None,
        "--corrects",
        help="compensate: which error. [default: loaded where there is a load]",
    ),
    "target": (Target, None),
    "scheduler": (Scheduler, None),
}
