"""The mechanisms that results on disk carry: their text, by the kind of file."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from string import ascii_lowercase
from typing import Any

from jointplay.errors import InputError
from jointplay.file import toml

#: the attribute with the text, and the name of a sheet with all attributes
TEXT = SHEET = "mechanism"
#: behind the names of attributes of mechanisms that were compared: `mechanism` is a dimension there
LETTERS = tuple(f"_{letter}" for letter in ascii_lowercase)
#: what the name of a file may have, in bytes
LONGEST_NAME = 255
#: letters that a cell of a sheet can hold
CELL = 32_000


def beside(path: Path, suffix: str = "") -> Path:
    """Where the mechanism of a table in text stands: ``errors.csv.toml``."""
    name = os.fsencode(f"{path.name}{suffix.replace('_', '.')}.toml")
    # Of a name that is too long the end is kept.
    return path.with_name(os.fsdecode(name[-LONGEST_NAME:]))


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


def text_in(attributes: Mapping[str, Any]) -> Any:
    """The text of the mechanism, or of the first of several."""
    return attributes.get(TEXT, attributes.get(f"{TEXT}{LETTERS[0]}"))


def _netcdf(path: Path) -> Any:
    import h5py

    with h5py.File(path, "r") as file:
        return text_in(file.attrs)


def _zarr(path: Path) -> Any:
    return text_in(json.loads((path / ".zattrs").read_text(encoding="utf-8")))


def _json(path: Path) -> Any:
    return text_in(json.loads(path.read_text(encoding="utf-8"))["attrs"])


def _parquet(path: Path) -> Any:
    from pyarrow import parquet

    return text_in(json.loads((parquet.read_schema(path).metadata or {}).get(b"PANDAS_ATTRS", b"{}")))


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
    return text_in({name: "\n".join(some) for name, some in lines.items()})


def _csv(path: Path) -> Any:
    found = [other for suffix in ("", *LETTERS) if (other := beside(path, suffix)).is_file()]
    return toml.read(found[0])[1] if path.is_file() and found else None


READERS: dict[str, Callable[[Path], Any]] = {
    ".nc": _netcdf,
    ".zarr": _zarr,
    ".json": _json,
    ".parquet": _parquet,
    ".xlsx": _xlsx,
    ".csv": _csv,
}
