"""The formats by extension. A format is a module with ``read(path, options) -> Skeleton``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from jointplay.errors import InputError, listed

from . import dxf, pylinkage, urdf
from .options import Options
from .skeleton import Skeleton

Reader = Callable[[Path, Options], Skeleton]

#: by extension, in small letters
READERS: Mapping[str, Reader] = MappingProxyType({".urdf": urdf.read, ".dxf": dxf.read, ".json": pylinkage.read})


def reader(path: Path) -> Reader:
    """The reader of a file.

    Raises
    ------
    InputError
        When no format has its extension.
    """
    kind = path.suffix.lower()
    if kind not in READERS:
        known = listed(READERS)
        what = f"'{kind}' is not an extension of a format that is read" if kind else "has no extension"
        raise InputError(f"{what}; known: {known}", file=str(path))
    return READERS[kind]
