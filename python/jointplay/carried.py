"""The mechanisms that results on disk carry: their text, by the kind of file."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jointplay import toml
from jointplay.errors import InputError

#: the attribute with the text, and the name of a sheet with all attributes
TEXT = SHEET = "mechanism"
#: letters that a cell of a sheet can hold
CELL = 32_000


def beside(path: Path, suffix: str = "") -> Path:
    """Where the mechanism of a table in text stands: ``errors.csv.toml``."""
    return path.with_name(f"{path.name}{suffix.replace('_', '.')}.toml")


def is_result(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a result by its extension, and no mechanism file."""
    return Path(path).suffix.lower() in READERS


def text(path: str | os.PathLike[str]) -> str:
    """The text of the mechanism that a result is of.

    Raises
    ------
    InputError
        When the file cannot be read, or has no mechanism in it.
    """
    place = Path(path)
    name = os.fspath(path)
    try:
        found = READERS[place.suffix.lower()](place)
    except FileNotFoundError:
        raise InputError("there is no such file", file=name) from None
    except ImportError as problem:
        raise InputError(f"cannot be read without the package {problem.name}", file=name) from None
    # The packages that read these files raise what they like on damaged ones.
    except Exception as problem:  # noqa: BLE001
        raise InputError(f"cannot be read as a result: {type(problem).__name__}", file=name) from None
    if not isinstance(found, str):
        raise InputError("is a result that does not say which mechanism it is of", file=name)
    return found


def _netcdf(path: Path) -> Any:
    import h5py

    with h5py.File(path, "r") as file:
        return file.attrs.get(TEXT)


def _zarr(path: Path) -> Any:
    return json.loads((path / ".zattrs").read_text(encoding="utf-8")).get(TEXT)


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))["attrs"].get(TEXT)


def _parquet(path: Path) -> Any:
    from pyarrow import parquet

    return json.loads((parquet.read_schema(path).metadata or {}).get(b"PANDAS_ATTRS", b"{}")).get(TEXT)


def _xlsx(path: Path) -> Any:
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True)
    if SHEET not in book.sheetnames:
        return None
    lines: dict[str, list[str]] = {}
    name = ""
    for head, *parts in book[SHEET].iter_rows(values_only=True):
        name = head or name
        lines.setdefault(name, []).append("".join(part or "" for part in parts))
    book.close()
    return "\n".join(lines[TEXT]) if TEXT in lines else None


def _csv(path: Path) -> Any:
    other = beside(path)
    return toml.read(other)[1] if path.is_file() and other.is_file() else None


READERS: dict[str, Callable[[Path], Any]] = {
    ".nc": _netcdf,
    ".zarr": _zarr,
    ".json": _json,
    ".parquet": _parquet,
    ".xlsx": _xlsx,
    ".csv": _csv,
}
