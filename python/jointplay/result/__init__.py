"""Labelled results: units on the way out, and the way to `xarray.Dataset`."""

from jointplay.basics.arrays import Array

from .blame import (
    HIGHER,
    LOAD,
    ROUNDING,
    SIZES,
    Blame,
    blame,
    blamed_for,
    in_words,
    largest,
    parts_by_cause,
    rounding,
    share_of,
    shares,
    untold_part,
)
from .build import BELONGS, FORCES_APART, FORCES_JUDGED, SIDES, STATUSES, Labels, ResultBuilder, axes_of, version
from .combine import SEVERAL, align, beside, judged_alone, merge, parts, stack
from .dataset import from_dataset, to_dataset
from .names import coordinate_names
from .origin import Origin, attributes, today
from .origin import label as origin_label
from .outcomes import UNREACHABLE, counted
from .quantity import (
    TYPICAL,
    bounds,
    commanded,
    figure,
    figures,
    first_largest,
    quantity,
    size,
    split,
    typical,
    unit_of,
)
from .structure import Attribute, Result, Variable
from .tidy import TidyColumn, TidyRows, rows, unit_at

__all__ = [
    "BELONGS",
    "FORCES_APART",
    "FORCES_JUDGED",
    "HIGHER",
    "LOAD",
    "ROUNDING",
    "SEVERAL",
    "SIDES",
    "SIZES",
    "STATUSES",
    "TYPICAL",
    "UNREACHABLE",
    "Array",
    "Attribute",
    "Blame",
    "Labels",
    "Origin",
    "Result",
    "ResultBuilder",
    "TidyColumn",
    "TidyRows",
    "Variable",
    "align",
    "attributes",
    "axes_of",
    "beside",
    "blame",
    "blamed_for",
    "bounds",
    "commanded",
    "coordinate_names",
    "counted",
    "figure",
    "figures",
    "first_largest",
    "from_dataset",
    "in_words",
    "judged_alone",
    "largest",
    "merge",
    "origin_label",
    "parts",
    "parts_by_cause",
    "quantity",
    "rounding",
    "rows",
    "share_of",
    "shares",
    "size",
    "split",
    "stack",
    "to_dataset",
    "today",
    "typical",
    "unit_at",
    "unit_of",
    "untold_part",
    "version",
]
