"""The subcommand that writes a report."""

import shlex
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from jointplay.basics.progress import bar

from . import DONE, NOT_OK, answer
from .options import File, LoadCase, PointName, Seed, Settings, writes


class Decimal(StrEnum):
    """What stands in front of decimals."""

    point = "."
    comma = ","


class Paper(StrEnum):
    """What is printed on."""

    a4 = "a4"
    letter = "letter"


def report(
    file: File,
    output: Annotated[Path | None, writes("Where to write it: .html, or .pdf. [default: FILE.html]")] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            metavar="N",
            help="Random specimens per configuration; best a power of two. [default: 32768, over-constrained 8192]",
        ),
    ] = None,
    seed: Seed = 0,
    against: Annotated[
        Path | None,
        typer.Option("--against", metavar="PAGE.html", help="A former report: say what has changed since."),
    ] = None,
    decimal: Annotated[Decimal, typer.Option("--decimal", help="Decimal sign of the page.")] = Decimal.point,
    paper: Annotated[Paper | None, typer.Option("--paper", help="Size of the sheets. [default: a4 of a PDF]")] = None,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
) -> int:
    """Write a page to hand on: verdict, drawing, errors, blame.

    The page needs no network. [document] of the file has author, revision and date, and who checked and approved it;
    --set document.revision=B changes them. A .pdf needs Chromium, Chrome or Edge. Exit code 1: some configuration is
    not ok, or a limit of the file is missed; the page is written.
    """
    from jointplay.show.reporting import check_path, write

    path = output or Path(file).with_suffix(".html")
    check_path(path)
    m = answer.mechanism(file, settings, output_point, load_case)
    command = shlex.join(["jointplay", *sys.argv[1:]])
    with bar("report") as progress:
        is_good = write(
            *(m, path),
            samples=samples,
            seed=seed,
            against=against,
            decimal=decimal.value,
            paper=None if paper is None else paper.value,
            command=command,
            progress=progress,
        )
    rest = "" if is_good else "; a limit is missed or a configuration is not ok, as its verdict says"
    typer.echo(f"wrote {path}{rest}")
    return DONE if is_good else NOT_OK
