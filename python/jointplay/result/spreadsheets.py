"""Results as tables for statistics and office programs: pandas, Parquet, Excel. One row for each value."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.typed import typed
from jointplay.errors import InputError
from jointplay.file.carried import CELL, SHEET
from jointplay.result import Result, TidyColumn, attributes, from_dataset, rows

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: rows that a sheet of Excel can have
MOST_ROWS = 2**20
EXTRA = "needs further packages; install them with: pip install 'jointplay[tables]'"


@typed
def frame(result: Result | xr.Dataset) -> pd.DataFrame:
    """Give a result as a tidy table: one row for each value.

    Parameters
    ----------
    result : xarray.Dataset
        Of any question.

    Returns
    -------
    pandas.DataFrame
        Columns: `variable`; one for each dimension and each coordinate along it, such as `configuration`, the drives,
        `component`, `source`, empty in rows of variables that do not have it; `value` (1 and 0 for true and false, nan
        where the value is a text), `text` (where it is one, such as the status) and `unit`, as in the file. A drive
        that is called like one of these columns is `drive_NAME`. Its `attrs` are those of the result.

    Examples
    --------
    >>> import jointplay as jp
    >>> table = jp.frame(jp.worst(jp.loads(jp.examples.text("four-bar"))))
    >>> largest = table[table.variable == "worst_position"]
    >>> largest.value.round(3).tolist()[-1], largest.unit.tolist()[-1]
    (3.848, 'mm')
    """
    import pandas as pd

    light = result if isinstance(result, Result) else from_dataset(result)
    found = rows(light)
    columns = {name: _series(column) for name, column in found.labels.items()}
    own = {"value": found.value, "text": _series(found.text), "unit": _series(found.unit)}
    table = pd.DataFrame({**columns, **own})
    table.attrs = attributes(light)
    return table


def _series(column: TidyColumn) -> pd.Series:
    """A column of labels: texts as categories, whole numbers with gaps where there are some."""
    import pandas as pd

    entries, empty = column.entries, ~column.is_filled
    if entries.dtype.kind == "U":
        texts, which = np.unique(entries, return_inverse=True)
        codes = np.where(empty, -1, which.reshape(-1)[column.rows]) if len(entries) else column.rows
        return pd.Series(pd.Categorical.from_codes(codes, texts.astype(object)))
    values = column.values()
    if values.dtype.kind in "iu":
        return pd.Series(pd.arrays.IntegerArray(values.astype(np.int64), empty))
    return pd.Series(np.where(empty, np.nan, values.astype(np.float64)))


def to_parquet(result: Result) -> bytes:
    """The tidy table as the content of a Parquet file.

    Raises
    ------
    InputError
        When the packages for it are not installed.
    """
    stream = io.BytesIO()
    try:
        frame(result).to_parquet(stream, index=False)
    except ImportError:
        raise InputError(f".parquet {EXTRA}") from None
    return stream.getvalue()


def to_xlsx(result: Result) -> bytes:
    """The tidy table as the content of an Excel file.

    Raises
    ------
    InputError
        When the packages for it are not installed, or there are more rows than a sheet has.
    """
    table = frame(result)
    if len(table) >= MOST_ROWS:
        raise InputError(f"{len(table):,} rows are more than the {MOST_ROWS:,} of a sheet; write .parquet instead")
    stream = io.BytesIO()
    import pandas as pd

    try:
        with pd.ExcelWriter(stream, engine="openpyxl") as writer:
            table.to_excel(writer, index=False, sheet_name=str(result.attrs.get("question", "result"))[:31])
            sheet = writer.book.create_sheet(SHEET)
            lines = [(name, k, line) for name, v in table.attrs.items() for k, line in enumerate(str(v).split("\n"))]
            for row, (name, k, line) in enumerate(lines, start=1):
                parts = [line[at : at + CELL] for at in range(0, len(line), CELL)]
                for column, part in enumerate([name if k == 0 else "", *parts], start=1):
                    cell = sheet.cell(row, column, part)
                    # None of them is a formula.
                    cell.data_type = "s"
    except ImportError:
        raise InputError(f".xlsx {EXTRA}") from None
    return stream.getvalue()
