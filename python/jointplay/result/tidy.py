"""A result as rows, one for each value: what statistics and spreadsheets want.

A variable gives as many rows as it has values. Its labels stand in columns, one for each dimension and for each
coordinate along it; those that it does not have stay empty, so that dimensions that have nothing to do with each other
are never multiplied.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Array

from .structure import Result, Variable

#: columns that every table has
OWN = ("variable", "value", "text", "unit")


@dataclass(frozen=True, eq=False)
class TidyColumn:
    """A column of rows."""

    #: what may stand in it; where there are none, `rows` are the entries themselves
    entries: Array
    #: number of the entry in each row, -1 where the row has none
    rows: NDArray[np.int64]

    @property
    def is_filled(self) -> NDArray[np.bool_]:
        """Which rows have an entry."""
        return self.rows >= 0

    def values(self) -> Array:
        """The entries row by row; any where there is none."""
        return self.entries[np.maximum(self.rows, 0)]


@dataclass(frozen=True, eq=False)
class TidyRows:
    """A result row by row."""

    #: columns that say which value it is: the variable, then dimensions and the coordinates along them
    labels: dict[str, TidyColumn]
    #: the number, nan where it is a text; 1 and 0 for true and false
    value: NDArray[np.float64]
    #: the text where the value is one, such as the status
    text: TidyColumn
    #: unit of the number
    unit: TidyColumn


def rows(result: Result) -> TidyRows:
    """The result row by row.

    Examples
    --------
    >>> side = Variable(("side",), np.array(["low", "high"]))
    >>> reach = Variable(("side",), np.array([-1.0, 2.0]), "mm")
    >>> found = rows(Result({"side": side}, {"reach": reach, "play": Variable((), np.array(0.1), "mm")}))
    >>> found.labels["side"].values()[found.labels["side"].is_filled].tolist(), found.value.tolist()
    (['low', 'high'], [-1.0, 2.0, 0.1])
    """
    dims = [*dict.fromkeys(dim for v in result.data.values() for dim in v.dims)]
    # The order of coordinates is that of the result: configurations and drives first.
    dims.sort(key=lambda dim: list(result.coords).index(dim) if dim in result.coords else len(result.coords))
    own = {dim: result.coords.get(dim, Variable((dim,), np.arange(result.sizes[dim]))) for dim in dims}
    beside = {
        name: v
        for name, v in result.coords.items()
        if v.dims and name not in own and set(v.dims) <= set(dims) and name.removesuffix("_unit") not in dims
    }
    columns = {name: own.get(name) or beside[name] for dim in dims for name in (dim, *_along(dim, beside))}
    variables = list(result.data.items())
    names = TidyColumn(
        np.array([name for name, _ in variables], dtype=str),
        np.repeat(np.arange(len(variables)), [v.values.size for _, v in variables]),
    )
    labels = {"variable": names}
    for name, column in columns.items():
        # A drive may have the name of one of the other columns.
        name = f"drive_{name}" if name in OWN else name
        parts = [_numbers(column, v) for _, v in variables]
        labels[name] = TidyColumn(column.values.reshape(-1), np.concatenate([np.zeros(0, np.int64), *parts]))
    texts = [v.values.reshape(-1) if v.values.dtype.kind == "U" else None for _, v in variables]
    value = [
        v.values.reshape(-1).astype(np.float64) if text is None else np.full(v.values.size, np.nan)
        for (_, v), text in zip(variables, texts, strict=True)
    ]
    written = [
        np.full(v.values.size, "") if text is None else text for (_, v), text in zip(variables, texts, strict=True)
    ]
    units = [_units(result, v) for _, v in variables]
    return TidyRows(
        labels,
        np.concatenate([np.zeros(0), *value]),
        _column(np.concatenate([np.zeros(0, "U1"), *written])),
        _column(np.concatenate([np.zeros(0, "U1"), *units])),
    )


def _along(dim: str, beside: dict[str, Variable]) -> Iterator[str]:
    """Coordinates that stand behind a dimension."""
    return (name for name, v in beside.items() if v.dims[0] == dim)


def _column(texts: Array) -> TidyColumn:
    """A column of texts, empty where they are."""
    entries, which = np.unique(texts, return_inverse=True)
    return TidyColumn(entries, np.where(texts == "", -1, which.reshape(-1)))


def _numbers(column: Variable, variable: Variable) -> NDArray[np.int64]:
    """Which entry of a coordinate belongs to each value of a variable."""
    if not set(column.dims) <= set(variable.dims):
        return np.full(variable.values.size, -1, dtype=np.int64)
    at = [variable.dims.index(dim) for dim in column.dims]
    shape = [variable.values.shape[k] if k in at else 1 for k in range(variable.values.ndim)]
    numbers = np.arange(column.values.size).reshape(column.values.shape)
    numbers = numbers.transpose(np.argsort(at)).reshape(shape)
    return np.broadcast_to(numbers, variable.values.shape).reshape(-1)


def _units(result: Result, variable: Variable) -> Array:
    """Unit of every value of a variable."""
    differs = [dim for dim in variable.dims if f"{dim}_unit" in result.coords]
    shape = [size if dim in differs else 1 for dim, size in zip(variable.dims, variable.values.shape, strict=True)]
    sizes = [result.sizes[dim] for dim in differs]
    texts = [
        unit_at(result, variable, dict(zip(differs, at, strict=True))) for at in itertools.product(*map(range, sizes))
    ]
    return np.broadcast_to(np.array(texts, dtype=str).reshape(shape), variable.values.shape).reshape(-1)


def unit_at(result: Result, variable: Variable, at: dict[str, int]) -> str:
    """Unit of the values of a variable at places along its dimensions.

    Parameters
    ----------
    at : mapping
        Number of the label along dimensions; those whose units differ are needed.
    """
    if not variable.units:
        return ""
    known = {dim: result.coords[f"{dim}_unit"].values for dim in at if f"{dim}_unit" in result.coords}
    units = {dim: str(names[at[dim]]) for dim, names in known.items()}
    if variable.units.startswith("product"):
        return " ".join(units.values())
    if "," not in variable.units and not variable.units.startswith("see "):
        return variable.units
    power = "^2" if variable.units.endswith("^2") else ""
    # Where two dimensions have units the variable says which one counts: the one whose units it lists.
    for dim, unit in units.items():
        names = [f"{name}{power}" for name in known[dim]]
        if variable.units in (", ".join(names), f"see {dim}_unit"):
            return f"{unit}{power}"
    listed = variable.units.split(", ")
    return next((listed[at[dim]] for dim, names in known.items() if len(names) == len(listed)), "")
