"""Labelled results: units on the way out, and the way to `xarray.Dataset`."""

from .blame import Blame, blame, parts_by_cause
from .build import SIDES, STATUSES, Builder, axes_of, version
from .combine import SEVERAL, align, beside, merge, parts, stack
from .dataset import from_dataset, to_dataset
from .names import coordinate_names
from .quantity import TYPICAL, quantities, quantity, size, split, typical, unit_of
from .structure import Attribute, Result, Variable

__all__ = [
    "SEVERAL",
    "SIDES",
    "STATUSES",
    "TYPICAL",
    "Attribute",
    "Blame",
    "Builder",
    "Result",
    "Variable",
    "align",
    "axes_of",
    "beside",
    "blame",
    "coordinate_names",
    "from_dataset",
    "merge",
    "parts",
    "parts_by_cause",
    "quantities",
    "quantity",
    "size",
    "split",
    "stack",
    "to_dataset",
    "typical",
    "unit_of",
    "version",
]
