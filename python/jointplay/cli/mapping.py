"""The command `map`: make it, then print, or leave it where it was written, and draw."""

from __future__ import annotations

import logging
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jointplay.basics.progress import bar
from jointplay.errors import InputError

from . import DONE, INTERRUPTED, NOT_OK, answer, arguments
from .belonging import NO_OPTIONS, GivenOptions, asks
from .drawing import COLOURED, NO_FIGURE, FigureFile, with_figure
from .options import File, LoadCase, PointName, Scheduler, Settings, writes
from .printing import prints

if TYPE_CHECKING:
    import xarray as xr

    from jointplay.result import Result


#: layers that are read at a time where the file does not say
SLAB = 64


@prints(csv=False)
@with_figure(*COLOURED, draws="Draw it: .png, .svg, .pdf, or .html for an interactive page.")
@asks(
    "map",
    "What is asked at every node.",
    "loaded",
    *("offset", "first_order", "details", "certify", "parts", "samples", "seed", "law", "sampling", "contact", "rare"),
    samples=1_024,
)
def map_(
    file: File,
    grid: Annotated[
        list[str] | None,
        typer.Option(
            "--grid",
            "-g",
            metavar="NAME=A:B:N",
            help="Axis of the map, a drive or x, y, angle of the output; NAME=VALUE holds it. In place of the file's.",
        ),
    ] = None,
    question: str = "",
    options: GivenOptions = NO_OPTIONS,
    output_point: PointName = None,
    load_case: LoadCase = None,
    settings: Settings = None,
    output: Annotated[Path | None, writes("Write it in chunks, to .zarr or .nc; run again, it continues.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace something else at the path.")] = False,
    chunk: Annotated[
        int | None, typer.Option("--chunk", metavar="N", help="Nodes that are computed at a time.")
    ] = None,
    scheduler: Scheduler = None,
    variable: Annotated[
        str | None,
        typer.Option("--variable", metavar="NAME", help="What is drawn: position, rotation, or such as undetermined.x"),
    ] = None,
    plot: FigureFile = NO_FIGURE,
) -> int:
    """Compute the error over a grid of drives or of positions."""
    from jointplay.analyses.map import Stopped, check_variable, compute, open_map
    from jointplay.analyses.nominal import Interrupted

    m = answer.mechanism(file, settings, output_point, load_case)
    ranges = arguments.gridded(arguments.assignments(grid, "--grid"), answer.reader(m)) if grid else None
    if overwrite and output is None:
        raise InputError("says what may be replaced; -o says where the map goes", key="--overwrite")
    # Of several writes that fail beside one another one is told; asyncio, on which Zarr writes, would tell the others.
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    own = options.of(m, question)
    plot.check_map()
    if variable is not None and plot.path is None:
        raise InputError("says what is drawn; --plot says where", key="--variable")
    if variable is not None:
        check_variable(m, question, ranges, own, variable)
    interrupted = False
    try:
        with bar("map") as progress:
            made = compute(
                m,
                question,
                ranges,
                path=output,
                overwrite=overwrite,
                chunk=chunk,
                progress=progress,
                scheduler=scheduler,
                **own,
            )
    except Stopped as stopped:
        sys.stderr.write(f"{stopped}\n")
        return INTERRUPTED
    except Interrupted as stopped:
        sys.stderr.write("interrupted; what is done:\n")
        made, interrupted = stopped.partial, True
    if made is not None:
        code = DONE if (made.get("status") == "ok").all() else NOT_OK
        # Before anything is printed, which its reader may cut off.
        try:
            _draw(made, plot, variable)
        finally:
            answer.show({"map": made})
        return INTERRUPTED if interrupted else code
    assert output is not None
    with open_map(output) as dataset:
        _draw(dataset, plot, variable)
        return DONE if _all_ok(dataset) else NOT_OK


def _draw(result: Result | xr.Dataset, plot: FigureFile, variable: str | None) -> None:
    if plot.path is not None:
        from jointplay.plot.map import draw

        draw(result, plot.path, variable, style=plot.style())


def _all_ok(dataset: xr.Dataset) -> bool:
    """Whether every node is ok, a slab at a time."""
    status = dataset["status"]
    along = status.dims[0]
    step = int((status.encoding.get("chunks") or [SLAB])[0])
    return all(
        bool((status.isel({along: slice(low, low + step)}) == "ok").all())
        for low in range(0, status.sizes[along], step)
    )
