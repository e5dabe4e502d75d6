"""The subcommand that shows a mechanism in motion."""

from pathlib import Path
from typing import Annotated

import typer

from jointplay.basics.progress import bar
from jointplay.errors import InputError

from . import DONE, answer
from .drawing import Dots, FigureFile, FigureSize, StyleName
from .options import File, LoadCase, PointName, Settings, writes


def animate(
    file: File,
    output: Annotated[Path | None, writes("Write it: .html, .gif, or .mp4 (needs ffmpeg).")] = None,
    fps: Annotated[int, typer.Option("--fps", metavar="N", help="Frames per second.")] = 12,
    frames: Annotated[
        int | None,
        typer.Option(
            "--frames", metavar="N", help="Configurations between those of the file until there are N. [default: 48]"
        ),
    ] = None,
    exaggerate: Annotated[
        float | None,
        typer.Option("--exaggerate", metavar="F", help="Factor on the errors. [default: what makes them visible]"),
    ] = None,
    view: Annotated[
        str | None, typer.Option("--view", metavar="NAME", help="In space: solid, front, top or side. [default: solid]")
    ] = None,
    size: FigureSize = None,
    dpi: Dots = None,
    style: StyleName = None,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
) -> int:
    """Show the mechanism in motion, its errors magnified.

    It is drawn under its loads, with the region in which its output can be.
    """
    m = answer.mechanism(file, settings, output_point, load_case)
    if output is None:
        raise InputError("say where the animation goes: -o NAME.html, .gif or .mp4", key="--output")
    from jointplay.plot.animation import DPI, animate

    look = FigureFile(output, {"size": size, "dpi": dpi or DPI, "style": style}).style()
    try:
        with bar("animate") as progress:
            animate(m, output, exaggerate=exaggerate, frames=frames, fps=fps, view=view, style=look, progress=progress)
    except InputError as problem:
        # Its options have the names of the arguments.
        key = f"--{problem.key}" if problem.key in ("fps", "frames", "exaggerate", "view") else problem.key
        raise InputError(problem.problem, file="" if key.startswith("--") else problem.file, key=key) from None
    return DONE
