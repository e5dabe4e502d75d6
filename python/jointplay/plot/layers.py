"""What is drawn of a map, on paper and in a page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.result import Variable


@dataclass(frozen=True, eq=False)
class Field(Variable):
    """A quantity over a grid, or over a slice of one; importing xarray takes longer than drawing it.

    Attributes
    ----------
    axes : tuple of Variable
        The coordinates along its dimensions, in their order.
    """

    axes: tuple[Variable, ...] = ()

    def slice(self, k: int) -> Field:
        """Across the last of three axes."""
        return Field(self.dims[:2], self.values[:, :, k], self.units, self.long_name, self.axes[:2])


@dataclass(frozen=True)
class Layers:
    """What is drawn of a map, over its axes.

    Attributes
    ----------
    value : Field
        The quantity; nan where there is no trusted number.
    status : ndarray of str
    contact_change : ndarray of bool
        Over nodes and axes: between a node and the next one.
    singular : ndarray
        Over nodes and axes: the part of the way to the next node at which the mechanism becomes singular.
    title : str
    bounds : tuple of float
        The limits of the quantity.
    """

    value: Field
    status: np.ndarray[Any, np.dtype[np.str_]]
    contact_change: np.ndarray[Any, np.dtype[np.bool_]]
    singular: np.ndarray[Any, np.dtype[np.float64]]
    title: str
    bounds: tuple[float, ...] = ()

    @property
    def limit(self) -> str:
        """The limits in words."""
        told = ", ".join(f"{bound:g}" for bound in self.bounds)
        return f"limit {told} {self.value.units}".rstrip()
