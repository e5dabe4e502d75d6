"""What is drawn of a map, on paper and in a page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Layers:
    """What is drawn of a map, over its axes.

    Attributes
    ----------
    value : xarray.DataArray
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

    value: xr.DataArray
    status: np.ndarray[Any, np.dtype[np.str_]]
    contact_change: np.ndarray[Any, np.dtype[np.bool_]]
    singular: np.ndarray[Any, np.dtype[np.float64]]
    title: str
    bounds: tuple[float, ...] = ()

    @property
    def limit(self) -> str:
        """The limits in words."""
        told = ", ".join(f"{bound:g}" for bound in self.bounds)
        return f"limit {told} {self.value.attrs['units']}".rstrip()
