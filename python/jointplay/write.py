"""Results as files, by extension: `.nc` (NetCDF 4), `.zarr` (a folder), `.csv`, `.json`, `.parquet`, `.xlsx`.

All but `.csv` hold everything. A CSV has one row per configuration (and per value of a sweep, per mechanism of a
comparison) and one column per number, named after variable, labels and unit, such as ``worst_component.x.low [mm]``;
it leaves out histograms. Parquet and Excel have one row per value, as `frame` gives it. The JSON is that of
`xarray.Dataset.to_dict`, with null for what is not a number. A file appears when it is complete, or not at all.
"""

from __future__ import annotations

import csv
import io
import itertools
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay import files
from jointplay.errors import InputError
from jointplay.result import Result, Variable, from_dataset, to_dataset, unit_at
from jointplay.spreadsheets import to_parquet, to_xlsx
from jointplay.typed import typed

if TYPE_CHECKING:
    import xarray as xr

#: dimensions that make rows of a table, the rest makes columns
ROWS = ("mechanism", "output", "load_case", "configuration", "step")
#: the extension of what is a folder
FOLDER = ".zarr"
#: dimensions too long for columns
LEFT_OUT = ("bin", "bin_edge")


@typed
def save(result: Result | xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a result; the extension says how.

    Parameters
    ----------
    result : xarray.Dataset
        Of any question.
    path : path-like
        Ending in `.nc`, `.zarr`, `.csv`, `.json`, or, with the extra `tables`, `.parquet` or `.xlsx`. An existing
        result is replaced.

    Raises
    ------
    InputError
        When the extension is another one, or the file cannot be written.
    """
    target = Path(path)
    check_path(target)
    light = result if isinstance(result, Result) else from_dataset(result)
    kind = target.suffix.lower()
    if kind == FOLDER:
        files.put_folder(lambda new: _zarr(light, new), target)
    else:
        files.put(WRITERS[kind](light), target)


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


def check_path(path: Path) -> None:
    """Refuse a path that no result can be written to.

    Raises
    ------
    InputError
        When the extension is not known, or nothing can be written there: said before long work, not after it.
    """
    kind = path.suffix.lower()
    if kind != FOLDER and kind not in WRITERS:
        known = ".nc, .zarr, .csv, .json, .parquet, .xlsx"
        what = f"'{kind}' is not an extension that can be written" if kind else "has no extension"
        raise InputError(f"{what}; known: {known}", file=os.fspath(path))
    place = files.require_writable(path, folder=kind == FOLDER)
    if place.is_dir() and not _is_zarr(place):
        raise InputError("is a folder and no Zarr group, so that it is not replaced; name a file", file=os.fspath(path))


def _is_zarr(path: Path) -> bool:
    return any((path / name).is_file() for name in (".zgroup", "zarr.json"))


def _zarr(result: Result, path: Path) -> None:
    # Format 2, like maps: texts of a fixed length are part of it.
    to_dataset(result).to_zarr(path, mode="w", zarr_format=2, consolidated=True)


def _netcdf(result: Result) -> memoryview:
    # In memory: where a disk is full HDF5 brings the whole process down.
    return to_dataset(result).to_netcdf(engine="h5netcdf")


def _json(result: Result) -> bytes:
    return to_json(result).encode()


def to_json(result: Result) -> str:
    """The result as JSON text, in the layout of `xarray.Dataset.to_dict`."""

    def entry(variable: Variable) -> dict[str, Any]:
        attrs = {"units": variable.units, "long_name": variable.long_name}
        attrs = {key: text for key, text in attrs.items() if text}
        return {"dims": list(variable.dims), "attrs": attrs, "data": _finite(variable.values.tolist())}

    content = {
        "attrs": dict(result.attrs),
        "dims": result.sizes,
        "coords": {name: entry(v) for name, v in result.coords.items()},
        "data_vars": {name: entry(v) for name, v in result.data.items()},
    }
    return json.dumps(content, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _csv(result: Result) -> bytes:
    return to_csv(result).encode()


def to_csv(result: Result) -> str:
    """The result as the text of a table: one row per configuration, one column per number."""
    sizes = result.sizes
    swept = str(result.attrs.get("sweep", ""))
    own = str(result.attrs.get("rows", ""))
    rows = (own,) if own else tuple(dim for dim in (swept, *ROWS) if dim in sizes)
    if not rows:
        rows = tuple(dim for dim in ("joint", "source") if dim in sizes)[:1]
    columns = [column for name, v in _tabled(result, rows) for column in _columns(result, name, v, rows)]
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow([header for header, _ in columns])
    shape = tuple(sizes[dim] for dim in rows)
    cells = [np.broadcast_to(values, shape).reshape(-1).tolist() for _, values in columns]
    table.writerows(["" if _is_nan(cell) else cell for cell in row] for row in zip(*cells, strict=True))
    return stream.getvalue()


def _is_nan(cell: object) -> bool:
    return isinstance(cell, float) and cell != cell


def _tabled(result: Result, rows: tuple[str, ...]) -> Iterator[tuple[str, Variable]]:
    """The variables that make columns: what says which row it is, then drive values, then all others."""
    coords = {name: v for name, v in result.coords.items() if name in rows}
    coords |= {name: v for name, v in result.coords.items() if name not in rows and set(v.dims) & set(rows)}
    status = {name: v for name, v in result.data.items() if name.endswith("status")}
    others = {name: v for name, v in result.data.items() if name not in status}
    for name, variable in (coords | status | others).items():
        if set(variable.dims) & set(rows) and not set(variable.dims) & set(LEFT_OUT):
            yield name, variable


def _columns(result: Result, name: str, variable: Variable, rows: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    inner = [dim for dim in variable.dims if dim not in rows]
    outer = [dim for dim in variable.dims if dim in rows]
    order = [variable.dims.index(dim) for dim in (*inner, *sorted(outer, key=rows.index))]
    values = variable.values.transpose(order)
    shape = [values.shape[len(inner) + sorted(outer, key=rows.index).index(d)] if d in outer else 1 for d in rows]
    for index in itertools.product(*(range(n) for n in values.shape[: len(inner)])):
        labels = [
            str(result.labels(dim)[i]) if dim in result.coords else str(i) for dim, i in zip(inner, index, strict=True)
        ]
        unit = unit_at(result, variable, dict(zip(inner, index, strict=True)))
        yield ".".join([name, *labels]) + (f" [{unit}]" if unit else ""), values[index].reshape(shape)


#: what makes the content of a file, by extension
WRITERS: dict[str, Callable[[Result], bytes | memoryview]] = {
    ".nc": _netcdf,
    ".csv": _csv,
    ".json": _json,
    ".parquet": to_parquet,
    ".xlsx": to_xlsx,
}
