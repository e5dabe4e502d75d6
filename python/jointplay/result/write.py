"""Results as files, by extension: `.nc` (NetCDF 4), `.zarr` (a folder), `.csv`, `.json`, `.parquet`, `.xlsx`.

All hold every value. CSV, Parquet and Excel have one row per value, as `frame` gives it; Excel has the answer and the
tables of the command on sheets in front. The JSON is that of `xarray.Dataset.to_dict`, with null for what is not a
number. All say what mechanism they are of, see `Origin`: among their attributes, on a sheet of its own, or in a file
beside a CSV. `.md`, `.tex` and `.html` are what the command prints, to be read. A file appears when it is complete, or
not at all.
"""

from __future__ import annotations

import csv
import functools
import io
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointplay.basics import files
from jointplay.errors import InputError, not_known, one_line
from jointplay.file.carried import LETTERS, beside
from jointplay.file.columns import as_cell
from jointplay.result import Result, TidyColumn, Variable, attributes, merge, rows, to_dataset
from jointplay.result.spreadsheets import require_package, to_parquet, to_xlsx
from jointplay.result.table import KINDS, ResultTable, document

#: what stands between the cells of a CSV, and before decimals
DIALECTS = {"comma": (",", "."), "semicolon": (";", ",")}
#: the extension of a table in text
CSV = ".csv"
#: the extension of what is a folder
FOLDER = ".zarr"


def write(
    results: Mapping[str, Result], target: Path, csv_dialect: str, more: Callable[[], Sequence[ResultTable]]
) -> None:
    """Write the results of several questions as one file; a workbook has more tables, which are made for it alone."""
    check_path(target)
    if csv_dialect not in DIALECTS:
        raise InputError(not_known(csv_dialect, "a dialect", DIALECTS), key="csv_dialect")
    if csv_dialect != "comma" and target.suffix.lower() != CSV:
        raise InputError(f"goes with a path that ends in {CSV}", key="csv_dialect")
    kind = target.suffix.lower()
    if kind == FOLDER:
        files.put_folder(lambda new: _zarr(merge(results), new), target)
    elif kind == CSV:
        light = merge(results)
        files.put(to_csv(light, csv_dialect).encode(), target)
        if target.is_file():
            _put_beside(light, target)
    else:
        files.put(to_xlsx(results, more()) if kind == ".xlsx" else WRITERS[kind](results), target)


def _put_beside(result: Result, path: Path) -> None:
    """What a table in text is of, as mechanism files beside it: one, or those that were compared."""
    attrs = {name: str(value) for name, value in attributes(result).items()}
    for suffix in ("", *LETTERS):
        text = attrs.pop(f"mechanism{suffix}", None)
        if text is not None:
            said = "".join(f"#   {name}: {one_line(value)}\n" for name, value in attrs.items())
            content = f"# The mechanism of {path.name}\n{said}\n{text}"
            files.put(content.encode(), beside(path, suffix))


def create(text: str, path: Path, *, replace: bool) -> None:
    """Write text as a new file.

    Raises
    ------
    InputError
        When the file exists and is not to be replaced, or cannot be written.
    """
    if files.require_writable(path).is_file() and not replace:
        raise InputError("exists already; --force replaces it", file=os.fspath(path))
    files.put(text.encode(), path)


def check_path(path: Path, more: tuple[str, ...] = ()) -> None:
    """Refuse a path that no result can be written to.

    Parameters
    ----------
    more : tuple of str
        Extensions of what else is written there.

    Raises
    ------
    InputError
        When the extension is not known, its package is not installed, or nothing can be written there: said
        before long work, not after it.
    """
    kind = path.suffix.lower()
    if kind not in (FOLDER, CSV, *WRITERS):
        known = ", ".join((*more, ".nc, .zarr, .csv, .json, .parquet, .xlsx, .md, .tex, .html"))
        what = f"'{kind}' is not an extension that can be written" if kind else "has no extension"
        raise InputError(f"{what}; known: {known}", file=os.fspath(path))
    require_package(kind)
    place = files.require_writable(path, folder=kind == FOLDER)
    if place.is_dir() and not _is_zarr(place):
        raise InputError("is a folder and no Zarr group, so that it is not replaced; name a file", file=os.fspath(path))


def _is_zarr(path: Path) -> bool:
    return any((path / name).is_file() for name in (".zgroup", "zarr.json"))


def _zarr(result: Result, path: Path) -> None:
    # Format 2, like maps: texts of a fixed length are part of it.
    to_dataset(result).to_zarr(path, mode="w", zarr_format=2, consolidated=True)


def _netcdf(results: Mapping[str, Result]) -> memoryview:
    # In memory: where a disk is full HDF5 brings the whole process down.
    return to_dataset(merge(results)).to_netcdf(engine="h5netcdf")


def _json(results: Mapping[str, Result]) -> bytes:
    return to_json(merge(results)).encode()


def _document(results: Mapping[str, Result], *, kind: str) -> bytes:
    return document(results, kind).encode()


def to_json(result: Result) -> str:
    """The result as JSON text, in the layout of `xarray.Dataset.to_dict`."""

    def entry(variable: Variable) -> dict[str, Any]:
        attrs = {"units": variable.units, "long_name": variable.long_name}
        attrs = {key: text for key, text in attrs.items() if text}
        return {"dims": list(variable.dims), "attrs": attrs, "data": _finite(variable.values.tolist())}

    content = {
        "attrs": attributes(result),
        "dims": result.sizes,
        "coords": {name: entry(v) for name, v in result.coords.items()},
        "data_vars": {name: entry(v) for name, v in result.data.items()},
    }
    return json.dumps(content, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def to_csv(result: Result, dialect: str = "comma", most: int | None = None) -> str:
    """The result as the text of a tidy table, in the columns of `frame`: one row for each value.

    Parameters
    ----------
    dialect : {"comma", "semicolon"}
        Commas between the cells and decimal points, or semicolons and decimal commas.
    most : int, optional
        For a page: no more rows than this, and no column without an entry.
    """
    between, point = DIALECTS[dialect]
    found = rows(result)
    columns = {name: _texts(column, point) for name, column in found.labels.items()}
    columns["value"] = ["" if math.isnan(value) else _number(value, point) for value in found.value.tolist()]
    columns |= {"text": _texts(found.text, point), "unit": _texts(found.unit, point)}
    if most is not None:
        columns = {name: cells[:most] for name, cells in columns.items() if any(cells[:most])}
    stream = io.StringIO()
    table = csv.writer(stream, delimiter=between, lineterminator="\n")
    table.writerow(map(as_cell, columns))
    table.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue()


def _texts(column: TidyColumn, point: str) -> list[str]:
    """The cells of a column of labels, empty where it has none."""
    entries = column.entries.tolist()
    texts = [_number(entry, point) if isinstance(entry, float) else as_cell(str(entry)) for entry in entries]
    # The last one stands for -1, the number of no entry.
    texts.append("")
    return [texts[k] for k in column.rows.tolist()]


def _number(value: float, point: str) -> str:
    return f"{value!r}".replace(".", point)


#: what makes the content of a file of results by question, by extension; a CSV has a dialect as well
WRITERS: dict[str, Callable[[Mapping[str, Result]], bytes | memoryview]] = {
    ".nc": _netcdf,
    ".json": _json,
    ".parquet": to_parquet,
    ".xlsx": to_xlsx,
    **{kind: functools.partial(_document, kind=kind) for kind in KINDS},
}
