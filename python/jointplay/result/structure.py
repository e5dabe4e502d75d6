"""What an analysis hands out: arrays with named dimensions, coordinates, units and attributes.

This is the light form that the command line prints from; `to_dataset` makes of it the `xarray.Dataset` of the Python
interface. Importing xarray takes longer than most analyses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.basics.arrays import Array

if TYPE_CHECKING:
    from .origin import Origin

Attribute = str | int | float


@dataclass(frozen=True, eq=False)
class Variable:
    """An array with named dimensions."""

    dims: tuple[str, ...]
    values: Array
    #: unit of the values; where entries along a dimension differ, all of them in order, or where to find them
    units: str = ""
    #: what it is, in words
    long_name: str = ""

    def __post_init__(self) -> None:
        if self.values.ndim != len(self.dims):
            raise ValueError(f"{self.dims} do not name the axes of an array of shape {self.values.shape}")


@dataclass(frozen=True, eq=False)
class Result:
    """Labelled arrays of one analysis."""

    #: coordinates by name; one of the same name per dimension that has labels
    coords: Mapping[str, Variable]
    #: variables by name
    data: Mapping[str, Variable]
    #: title, question, version, seed and the like
    attrs: Mapping[str, Attribute] = field(default_factory=dict)
    #: what it was computed of; of what was read from a file this is among the attributes
    origin: Origin | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        variables = [*self.coords.values(), *self.data.values()]
        return {dim: size for v in variables for dim, size in zip(v.dims, v.values.shape, strict=True)}

    @property
    def drives(self) -> dict[str, Variable]:
        """The coordinates that are drive values, by name."""
        names = str(self.attrs.get("drives", ""))
        return {name: self.coords[name] for name in names.split(", ") if name in self.coords}

    def labels(self, dim: str) -> list[Any]:
        """Labels along a dimension."""
        return list(self.coords[dim].values.tolist())

    def get(self, name: str, **at: Any) -> Array:
        """Values of a variable, at labels along some of its dimensions.

        Examples
        --------
        >>> side = Variable(("side",), np.array(["low", "high"]))
        >>> result = Result({"side": side}, {"reach": Variable(("side",), np.array([-1.0, 2.0]))})
        >>> float(result.get("reach", side="high"))
        2.0
        """
        variable = self.data[name] if name in self.data else self.coords[name]
        index = tuple(self.labels(d).index(at[d]) if d in at else slice(None) for d in variable.dims)
        return np.asarray(variable.values[index])

    def unit(self, name: str, **at: Any) -> str:
        """Unit of a variable, at labels along the dimension whose entries differ in unit."""
        variable = self.data[name] if name in self.data else self.coords[name]
        for dim, label in at.items():
            units = self.coords.get(f"{dim}_unit")
            if units is not None and dim in variable.dims:
                return own_unit(variable, units, self.labels(dim).index(label))
        return variable.units

    def isel(self, dim: str, index: int) -> Result:
        """The part at one place along a dimension."""

        def pick(variable: Variable) -> Variable:
            if dim not in variable.dims:
                return variable
            dims = tuple(d for d in variable.dims if d != dim)
            values = np.asarray(np.take(variable.values, index, axis=variable.dims.index(dim)))
            return Variable(dims, values, variable.units, variable.long_name)

        coords = {name: pick(v) for name, v in self.coords.items()}
        return Result(coords, {name: pick(v) for name, v in self.data.items()}, self.attrs, self.origin)


def own_unit(variable: Variable, units: Variable, place: int) -> str:
    """Unit of the values of a variable at a place along a dimension of which these are the units.

    A variable whose unit is another one there, such as a moment along an angle, lists them itself.

    Examples
    --------
    >>> units = Variable(("drive",), np.array(["deg", "mm"]))
    >>> torque = Variable(("drive",), np.array([1.0, 2.0]), "N mm, N")
    >>> own_unit(torque, units, 1)
    'N'
    """
    listed = variable.units.split(", ")
    if len(listed) == 1 and not variable.units.startswith(("see ", "product")):
        return variable.units
    return listed[place] if 1 < len(listed) == units.values.size else str(units.values[place])
