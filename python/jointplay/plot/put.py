"""Drawings as files."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from jointplay.basics import files
from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.result import Result, origin_label

from .style import as_far_as_it_goes, escape_texts, theme
from .words import wrapped

if TYPE_CHECKING:
    import xarray as xr

#: size of the letters at the foot of a drawing, points
FOOT = 5.5
EXTENSIONS = (".png", ".svg", ".pdf")


@typed
def check_path(path: Path, more: tuple[str, ...] = ()) -> None:
    """Refuse a path that no drawing can be written to; `more` extensions are known where it is asked.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in EXTENSIONS:
        raise InputError(f"drawings are written as {', '.join((*EXTENSIONS, *more))}", file=os.fspath(path))
    files.require_writable(path)


def put(figure: Figure, path: Path, result: Result | xr.Dataset | None = None) -> None:
    """Write a drawing; of a result it says at its foot which mechanism it is of."""
    kind = path.suffix.lower().removeprefix(".")
    if result is not None:
        # What the sheet says of other outputs and load cases stands in front of it.
        said = "; ".join(filter(None, (figure.get_supxlabel(), origin_label(result))))
        lines = wrapped(said, 72.0 * figure.get_figwidth(), FOOT)
        figure.supxlabel(lines, fontsize=FOOT, x=1.0, ha="right", color=theme().grey)
    content = io.BytesIO()
    escape_texts(figure)
    # Without a date the same drawing is the same file.
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    with as_far_as_it_goes():
        figure.savefig(content, format=kind, metadata=undated)
    files.put(content.getbuffer(), path)
