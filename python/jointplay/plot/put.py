"""Drawings as files."""

from __future__ import annotations

import io
import os
from pathlib import Path

from matplotlib.figure import Figure

from jointplay import files
from jointplay.errors import InputError
from jointplay.typed import typed

from .style import as_far_as_it_goes, escape_texts

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


def put(figure: Figure, path: Path) -> None:
    """Write a drawing."""
    kind = path.suffix.lower().removeprefix(".")
    content = io.BytesIO()
    escape_texts(figure)
    # Without a date the same drawing is the same file.
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    with as_far_as_it_goes():
        figure.savefig(content, format=kind, metadata=undated)
    files.put(content.getbuffer(), path)
