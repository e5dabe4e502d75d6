"""What is drawn of a map, on paper and in a page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointplay.result import Variable


@dataclass(frozen=True, eq=False)
class Field(Variable):
    """A quantity over a grid, or over a slice of one; importing xarray takes longer than drawing it."""

    #: the coordinates along its dimensions, in their order
    axes: tuple[Variable, ...] = ()

    def slice(self, k: int) -> Field:
        """Across the last of three axes."""
        return Field(self.dims[:2], self.values[:, :, k], self.units, self.long_name, self.axes[:2])


@dataclass(frozen=True)
class Layers:
    """What is drawn of a map, over its axes."""

    #: the quantity; nan where there is no trusted number
    value: Field
    status: np.ndarray[Any, np.dtype[np.str_]]
    #: over nodes and axes: between a node and the next one
    contact_change: np.ndarray[Any, np.dtype[np.bool_]]
    #: over nodes and axes: the part of the way to the next node at which the mechanism becomes singular
    singular: np.ndarray[Any, np.dtype[np.float64]]
    title: str
    #: the limits of the quantity
    bounds: tuple[float, ...] = ()

    @property
    def limit(self) -> str:
        """The limits in words."""
        told = ", ".join(f"{bound:g}" for bound in self.bounds)
        return f"limit {told} {self.value.units}".rstrip()
