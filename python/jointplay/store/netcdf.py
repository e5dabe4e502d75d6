"""A finished map as NetCDF 4, copied chunk by chunk."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .plan import Plan, Region

if TYPE_CHECKING:
    import zarr


def fingerprint_of(path: Path) -> str:
    """The fingerprint of a map in a NetCDF file; empty for any other file."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs.get("fingerprint", ""))
    except OSError:
        return ""


def to_netcdf(group: zarr.Group, path: Path, plan: Plan) -> None:
    """Write a group as a NetCDF file, which appears when it is complete."""
    import h5netcdf

    new = path.with_name(f".{path.name}.new")
    with h5netcdf.File(new, "w") as file:
        file.attrs.update(group.attrs.asdict())
        arrays: dict[str, Any] = dict(group.arrays())
        for array in arrays.values():
            for dim, size in zip(array.attrs["_ARRAY_DIMENSIONS"], array.shape, strict=True):
                if dim not in file.dimensions:
                    file.dimensions[dim] = size
        for name, array in arrays.items():
            _copy(array, _variable(file, name, array), plan)
    new.replace(path)


def _variable(file: Any, name: str, array: Any) -> Any:
    """A variable as xarray writes and reads it: texts of any length, booleans as small integers."""
    import h5py

    kind = array.dtype
    stored = h5py.string_dtype() if kind.kind == "U" else np.int8 if kind.kind == "b" else kind
    options: dict[str, Any] = {}
    if array.ndim and kind.kind != "U":
        options = {"chunks": array.chunks, "compression": "gzip", "compression_opts": 1, "shuffle": True}
    if kind.kind == "f":
        options["fillvalue"] = np.nan
    attributes = array.attrs.asdict()
    variable = file.create_variable(name, tuple(attributes.pop("_ARRAY_DIMENSIONS")), stored, **options)
    variable.attrs.update(attributes | ({"dtype": "bool"} if kind.kind == "b" else {}))
    return variable


def _copy(array: Any, variable: Any, plan: Plan) -> None:
    nodes = tuple(array.attrs["_ARRAY_DIMENSIONS"])[: len(plan.axes)] == plan.axes
    for region in _regions(plan) if nodes else [...]:
        values = np.asarray(array[region])
        if values.dtype.kind in "Ub":
            values = values.astype(object if values.dtype.kind == "U" else np.int8)
        variable[region] = values


def _regions(plan: Plan) -> Iterator[Region]:
    starts = (range(0, size, step) for size, step in zip(plan.shape, plan.chunk, strict=True))
    for corner in itertools.product(*starts):
        yield tuple(
            slice(low, min(low + step, size)) for low, step, size in zip(corner, plan.chunk, plan.shape, strict=True)
        )
