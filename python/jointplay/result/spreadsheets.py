"""Results as tables for statistics and office programs: pandas, Parquet, Excel. One row for each value."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.typed import typed
from jointplay.errors import InputError, require
from jointplay.file import toml
from jointplay.file.carried import CELL, SHEET
from jointplay.result import Result, TidyColumn, attributes, blame, from_dataset, merge, parts, rows
from jointplay.result.table import ResultTable, blocks, heading, is_printed, screen
from jointplay.result.table.layout import NOTHING, Column

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from openpyxl import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

#: rows that a sheet of Excel can have
MOST_ROWS = 2**20
#: characters that its name has at most, those that it cannot have, and the width of sentences
LONGEST, NOT_IN_SHEETS, WIDE = 31, r"[\[\]:*?/\\]", 100
#: what stands where a column has no number
GAPS = (NOTHING, "")
#: who signs, by the key of the file, and what each gives
ROLES = {"author": "author", "checked_by": "checked by", "approved_by": "approved by"}
SIGNED = ("", "name", "date", "signature")
#: what writes tables, by the extension of the file
PACKAGES = {".parquet": "pyarrow", ".xlsx": "openpyxl"}


def require_package(kind: str) -> None:
    """Refuse a table where the package that writes such files is not installed.

    Raises
    ------
    InputError
    """
    if kind in PACKAGES:
        require(PACKAGES[kind], "tables", kind)


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


def _add_answers(
    book: Workbook, results: Mapping[str, Result], attrs: Mapping[str, object], more: Sequence[ResultTable]
) -> None:
    """A sheet to sign with the answers in sentences, and one for every table, to be filtered."""
    from openpyxl.styles import Alignment, Border, Font, Side

    answers, tables = screen({name: result for name, result in results.items() if is_printed(name)})
    sheet = book.create_sheet("answer")
    sheet.column_dimensions["B"].width = WIDE
    for label, sentences in answers:
        for k, one in enumerate(sentences):
            _put(sheet, sheet.max_row + 1, [label if k == 0 else "", one.text])
    for number, each in enumerate(tables, start=1):
        for text in (one.text for one in each.lead):
            _put(sheet, sheet.max_row + 1, [each.title, text])
        _add(book, f"{number} {each.title}", each)
    for each in (*_sources(results), *more):
        _add(book, each.title, each)
    room = Border(bottom=Side(style="thin"))
    for row, line in enumerate(_signing(attrs), start=sheet.max_row + 2):
        _put(sheet, row, line)
        for cell in sheet[row][: len(SIGNED)]:
            cell.border = room
    for column, width in zip("ACD", (16, 14, 30), strict=True):
        sheet.column_dimensions[column].width = width
    for cell in sheet["B"]:
        cell.alignment = Alignment(wrap_text=True, vertical="top")
    for cell in chain(sheet["A"], *(own[1] for own in book.worksheets[1:])):
        cell.font = Font(bold=True)


def _add(book: Workbook, name: str, table: ResultTable) -> None:
    """A table to be filtered, with its notes below it."""
    own = book.create_sheet(re.sub(NOT_IN_SHEETS, " ", name)[:LONGEST])
    columns = _columns(table)
    _put(own, 1, [*columns])
    for row, values in enumerate(zip(*columns.values(), strict=True), start=2):
        _put(own, row, values)
    _filtered(own)
    for k, note in enumerate(table.notes, start=own.max_row + 2):
        _put(own, k, [note])


def _filtered(sheet: Worksheet) -> None:
    """The first row stays, and chooses what is shown."""
    sheet.freeze_panes, sheet.auto_filter.ref = "A2", sheet.dimensions


def _signing(attrs: Mapping[str, object]) -> list[tuple[str, ...]]:
    """Who made, checked and approved what the mechanism file says, with room for those that it leaves out."""
    text = attrs.get("mechanism")
    given = toml.parse(str(text)).get("document", {}) if text else {}
    known = {name: str(value) for name, value in given.items()}
    signs = [(role, known.get(key, ""), "", "") for key, role in ROLES.items()]
    head = [
        ("revision", known.get("revision", "")),
        ("date", known.get("date") or str(attrs.get("created", ""))),
        ("mechanism", " ".join(str(attrs.get(key, "")) for key in ("file", "mechanism_hash"))),
    ]
    return [*(line for line in head if line[1].strip()), SIGNED, *signs]


def _sources(results: Mapping[str, Result]) -> list[ResultTable]:
    """Whose share of the errors is how large, at every configuration."""
    rows: list[tuple[str, ...]] = []
    for question, result in results.items():
        for heading_, part in parts(result):
            # Steps of a sweep, mechanisms and grids have no sheet.
            if "contribution" not in part.data or part.data["contribution"].dims[0] != "configuration":
                continue
            found = blame(part)
            for k, shares in enumerate(zip(found.position, found.rotation, strict=True)):
                for cause, *own in zip(found.causes, *shares, strict=True):
                    told = (f"{100.0 * share:.1f}" if np.isfinite(share) else NOTHING for share in own)
                    rows.append((question, heading_, str(k), cause, *told))
    if not rows:
        return []
    heads = (("question", ""), ("of", ""), ("#", ""), ("source", ""), ("position", "%"), ("rotation", "%"))
    cells = list(zip(*rows, strict=True))
    columns = [
        Column(name, unit, one, left=not unit and name != "#")
        for (name, unit), one in zip(heads, cells, strict=True)
        if any(one)
    ]
    return [ResultTable("sources", tuple(columns), ("Shares of random specimens are in the variance.",))]


def _put(sheet: Worksheet, row: int, values: Sequence[float | str]) -> None:
    """A row of cells; no text is a formula, and no cell is not a number."""
    for column, value in enumerate(values, start=1):
        if isinstance(value, str) or np.isfinite(value):
            cell = sheet.cell(row, column, value)
            if isinstance(value, str):
                cell.data_type = "s"


def to_parquet(results: Mapping[str, Result]) -> bytes:
    """The tidy table of results by question as the content of a Parquet file.

    Raises
    ------
    InputError
        When the package for it is not installed.
    """
    require_package(".parquet")
    stream = io.BytesIO()
    frame(merge(results)).to_parquet(stream, engine="pyarrow", index=False)
    return stream.getvalue()


@typed
def table(result: Result | xr.Dataset) -> pd.DataFrame:
    """Give the table that the command prints of a result.

    Parameters
    ----------
    result : xarray.Dataset
        Of any question.

    Returns
    -------
    pandas.DataFrame
        All rows and columns. The digits are those of the screen; `frame` has all of them. Where the command prints
        several tables, as for several outputs, they stand one below the other, and the index says which is which. Its
        `attrs` have the sentences of the answer (`answer`) and, by table, the `notes` below it.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> found = jp.table(jp.worst(m.with_({"drives.theta1.values": [30, 60]})))
    >>> found[["theta1 (deg)", "position (mm)"]]
       theta1 (deg)  position (mm)
    0            30          3.202
    1            60          3.454
    """
    import pandas as pd

    light = result if isinstance(result, Result) else from_dataset(result)
    answer, tables = blocks(light)
    frames = {each.title: pd.DataFrame(_columns(each)) for each in tables}
    found = (
        next(iter(frames.values()), pd.DataFrame()) if len(frames) < 2 else pd.concat(frames, names=["table", "row"])
    )
    found.attrs = {"answer": answer, "notes": {each.title: list(each.notes) for each in tables}}
    return found


def _columns(found: ResultTable) -> dict[str, list[float | str]]:
    """The cells of a table by heading, as numbers where all of a column are."""
    columns: dict[str, list[float | str]] = {}
    for column in found.columns:
        name = heading(column)
        cells = list(map(_cell, column.cells))
        is_number = not column.left and any(not isinstance(cell, str) for cell in cells)
        is_number &= all(not isinstance(cell, str) or cell in GAPS for cell in cells)
        texts: list[float | str] = [*column.cells]
        values = [np.nan if cell in GAPS else cell for cell in cells] if is_number else texts
        columns[name if name not in columns else f"{name} {len(columns)}"] = values
    return columns


def _cell(text: str) -> float | str:
    try:
        return int(text) if text.isdecimal() else float(text)
    except ValueError:
        return text


def to_xlsx(results: Mapping[str, Result], more: Sequence[ResultTable] = ()) -> bytes:
    """What the command prints of results by question, and the tidy table, as the content of an Excel file.

    Parameters
    ----------
    more : sequence of ResultTable
        Further tables, with sheets of their own.

    Raises
    ------
    InputError
        When the package for it is not installed, or there are more rows than a sheet has.
    """
    require_package(".xlsx")
    result = merge(results)
    tidy = frame(result)
    if len(tidy) >= MOST_ROWS:
        raise InputError(f"{len(tidy):,} rows are more than the {MOST_ROWS:,} of a sheet; write .parquet instead")
    stream = io.BytesIO()
    import pandas as pd

    with pd.ExcelWriter(stream, engine="openpyxl") as writer:
        _add_answers(writer.book, results, tidy.attrs, more)
        name = str(result.attrs.get("question", "result"))[:LONGEST]
        tidy.to_excel(writer, index=False, sheet_name=name)
        _filtered(writer.book[name])
        sheet = writer.book.create_sheet(SHEET)
        lines = [(name, k, line) for name, v in tidy.attrs.items() for k, line in enumerate(str(v).split("\n"))]
        for row, (name, k, line) in enumerate(lines, start=1):
            parts = [line[at : at + CELL] for at in range(0, len(line), CELL)]
            for column, part in enumerate([name if k == 0 else "", *parts], start=1):
                cell = sheet.cell(row, column, part)
                # None of them is a formula.
                cell.data_type = "s"
    return stream.getvalue()
