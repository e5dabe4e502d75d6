"""A sweep over two things as tables: rows for the values of the first, columns for those of the second."""

from dataclasses import replace

import numpy as np

from jointplay.result import Result, rounding
from jointplay.result.conclusions import Tops, missed, tops

from .layout import Column, ResultTable, commands, numbers, words
from .notes import notes


def overview(result: Result, title: str) -> list[ResultTable]:
    """A table for every figure, with the worst one over the configurations in each cell."""
    counts = missed(result)
    over = result.sizes["configuration"]
    among = f" over {over} configurations" if over > 1 else ""
    rows, columns = (result.coords[str(result.attrs[name])] for name in ("sweep", "sweep_by"))
    axes = f", by {rows.long_name} (rows) and {columns.long_name} (columns)"
    found = []
    for top in tops(result):
        if np.nan_to_num(top.values).any():
            kind = {"position": "position error"}.get(top.name, top.name)
            head = f"{title}: {'smallest' if top.is_least else 'largest'} {kind}{among}{axes}"
            found.append(ResultTable(head, _columns(result, top, counts)))
    if found:
        found[-1] = replace(found[-1], notes=(*found[-1].notes, *notes(result)))
    return found


def _columns(result: Result, top: Tops, counts: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> tuple[Column, ...]:
    dims = [str(result.attrs[name]) for name in ("sweep", "sweep_by")]
    first, second = (_labels(result, dim) for dim in dims)
    cells = numbers("", top.unit, top.values.ravel(), rounding(result, top.unit)).cells
    wide = len(first.cells)
    columns = [replace(first, is_key=True)]
    for k, label in enumerate(second.cells):
        alarms = tuple(np.flatnonzero(counts[k] > 0).tolist())
        name = f"{label} {second.unit}".rstrip()
        columns.append(Column(name, top.unit, cells[k * wide : (k + 1) * wide], alarms=alarms))
    return tuple(columns)


def _labels(result: Result, dim: str) -> Column:
    along = result.coords[dim]
    if along.values.dtype.kind in "fiu":
        return commands(dim, along.units, along.values)
    return words(dim, [str(value) for value in along.values.tolist()])
