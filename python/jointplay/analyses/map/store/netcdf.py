"""A finished map as NetCDF 4, copied chunk by chunk."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.map.lattice import Block
from jointplay.basics.files import replacing

from .patient import Patient
from .plan import DIMENSIONS, StorePlan

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


def to_netcdf(group: zarr.Group, path: Path, plan: StorePlan) -> None:
    """Write a group as a NetCDF file, which appears when it is complete."""
    with replacing(path) as new, Patient(new) as stream:
        _fill(stream, group, plan)
        stream.check()
        os.fsync(stream.fileno())


def _fill(stream: Patient, group: zarr.Group, plan: StorePlan) -> None:
    import h5netcdf

    with h5netcdf.File(stream, "w") as file:
        file.attrs.update(group.attrs.asdict())
        arrays: dict[str, Any] = dict(group.arrays())
        for array in arrays.values():
            for dim, size in zip(array.attrs[DIMENSIONS], array.shape, strict=True):
                _add_dimension(file, dim, size)
        for name, array in arrays.items():
            for _ in _copied(array, _variable(file, name, array, plan), plan):
                stream.check()


def _variable(file: Any, name: str, array: Any, plan: StorePlan) -> Any:
    """A variable as xarray writes and reads it: texts as characters or of any length, booleans as small integers."""
    import h5py

    kind = array.dtype.kind
    attributes = array.attrs.asdict()
    dims = tuple(attributes.pop(DIMENSIONS))
    options: dict[str, Any] = {"dtype": {"b": np.dtype(np.int8), "U": h5py.string_dtype()}.get(kind, array.dtype)}
    chunks = array.chunks
    if kind == "U" and _has_nodes(array, plan):
        # Texts of any length do not compress, and what HDF5 keeps of them in memory grows with the file.
        width = array.dtype.itemsize // np.dtype("U1").itemsize
        _add_dimension(file, f"string{width}", width)
        dims, chunks = (*dims, f"string{width}"), (*chunks, width)
        options["dtype"] = np.dtype("S1")
        attributes["_Encoding"] = "utf-8"
    if _has_nodes(array, plan):
        options |= {"chunks": chunks, "compression": "gzip", "compression_opts": 1, "shuffle": True, "fletcher32": True}
    if kind == "f":
        options["fillvalue"] = np.nan
    variable = file.create_variable(name, dims, **options)
    variable.attrs.update(attributes | ({"dtype": "bool"} if kind == "b" else {}))
    return variable


def _add_dimension(file: Any, name: str, size: int) -> None:
    if name not in file.dimensions:
        file.dimensions[name] = size


def _has_nodes(array: Any, plan: StorePlan) -> bool:
    return bool(array.attrs[DIMENSIONS][: len(plan.axes)] == list(plan.axes)) and array.basename not in plan.axes


def _copied(array: Any, variable: Any, plan: StorePlan) -> Iterator[None]:
    """Copy an array, with a stop after every piece."""
    if not _has_nodes(array, plan):
        values = np.asarray(array[...])
        variable[...] = values.astype({"U": object, "b": np.int8}.get(values.dtype.kind, values.dtype))
        yield
        return
    for region in _regions(plan):
        values = np.asarray(array[region])
        if values.dtype.kind == "b":
            values = values.astype(np.int8)
        elif values.dtype.kind == "U":
            texts = np.char.encode(values, "utf-8").astype(f"S{variable.shape[-1]}")
            values = np.ascontiguousarray(texts)[..., None].view("S1")
        variable[region] = values
        yield


def _regions(plan: StorePlan) -> Iterator[Block]:
    starts = (range(0, size, step) for size, step in zip(plan.shape, plan.chunk, strict=True))
    for corner in itertools.product(*starts):
        yield tuple(
            slice(low, min(low + step, size)) for low, step, size in zip(corner, plan.chunk, plan.shape, strict=True)
        )
