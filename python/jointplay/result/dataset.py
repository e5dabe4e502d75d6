"""Between the light form of a result and `xarray.Dataset`."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.arrays import Array

from .origin import attributes
from .structure import Result, Variable

if TYPE_CHECKING:
    import xarray as xr
    from xarray.indexes import PandasIndex

#: bytes of labels that are worth keeping: those of components, joints, sources, not of many configurations
FEW = 4096


def to_dataset(result: Result) -> xr.Dataset:
    """The result as an xarray.Dataset: units and long names in the attributes of its variables."""
    import xarray as xr

    def entry(variable: Variable) -> xr.Variable:
        attrs = {"units": variable.units, "long_name": variable.long_name}
        return xr.Variable(variable.dims, variable.values, {key: text for key, text in attrs.items() if text})

    coords = {name: entry(v) for name, v in result.coords.items()}
    # Given with the coordinates, indexes are not made by the dataset, which takes most of its time otherwise.
    indexes = {name: _index(name, v.values) for name, v in coords.items() if v.dims == (name,)}
    for name, index in indexes.items():
        coords.update(index.create_variables({name: coords[name]}))
    data = {name: entry(v) for name, v in result.data.items()}
    return xr.Dataset(data, xr.Coordinates(coords, indexes), attributes(result))


def _index(dim: str, labels: Array) -> PandasIndex:
    """The index of a dimension's labels."""
    if labels.nbytes > FEW or labels.dtype.hasobject:
        return _new_index(dim, labels)
    return _small_index(dim, labels.dtype.str, labels.tobytes())


def _new_index(dim: str, labels: Array) -> PandasIndex:
    import xarray as xr
    from xarray.indexes import PandasIndex

    return PandasIndex.from_variables({dim: xr.Variable(dim, labels)}, options={})


@functools.lru_cache(256)
def _small_index(dim: str, dtype: str, labels: bytes) -> PandasIndex:
    return _new_index(dim, np.frombuffer(labels, dtype))


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
