"""Between the light form of a result and `xarray.Dataset`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .structure import Result, Variable

if TYPE_CHECKING:
    import xarray as xr


def to_dataset(result: Result) -> xr.Dataset:
    """The result as an xarray.Dataset: units and long names in the attributes of its variables."""
    import xarray as xr

    def entry(variable: Variable) -> tuple[tuple[str, ...], object, dict[str, str]]:
        attrs = {"units": variable.units, "long_name": variable.long_name}
        return variable.dims, variable.values, {key: text for key, text in attrs.items() if text}

    coords = {name: entry(v) for name, v in result.coords.items()}
    data = {name: entry(v) for name, v in result.data.items()}
    return xr.Dataset(data, coords, dict(result.attrs))


def from_dataset(dataset: xr.Dataset) -> Result:
    """The light form of a dataset, also of one that was cut or computed from ours."""

    def variable(array: xr.DataArray) -> Variable:
        dims = tuple(str(dim) for dim in array.dims)
        values = np.asarray(array.values)
        if values.dtype.kind == "O":
            values = values.astype(str)
        return Variable(dims, values, str(array.attrs.get("units", "")), str(array.attrs.get("long_name", "")))

    coords = {str(name): variable(array) for name, array in dataset.coords.items()}
    data = {str(name): variable(array) for name, array in dataset.data_vars.items()}
    return Result(coords, data, {str(key): value for key, value in dataset.attrs.items()})
