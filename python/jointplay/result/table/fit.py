"""Tables that fit: what says the same in all rows becomes a note, then the least needed columns and rows go.

What is left out is said in one line, with the option that shows it. Where all of it is asked for, and where there is
still no room, a table is printed in blocks one under the other, each with the columns that say which row it is.
"""

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .layout import NOTHING, Column, ResultTable

#: tables of more rows are shown in part, as many rows of them
MANY_ROWS, MOST_ROWS = 16, 12
#: characters to which texts are shortened: before columns are left out, and before a table is printed in blocks
LONG, SHORT = 24, 14
#: what stands behind names that share the blame
SHARE = re.compile(r" -?\d+ %( each)?$")
#: the widest space between columns
WIDEST_GAP = 3


@dataclass(frozen=True)
class Fitted:
    """A table as it is printed."""

    #: what stands side by side
    blocks: tuple[tuple[Column, ...], ...]
    #: characters between columns
    gap: int
    notes: tuple[str, ...]


def fitted(table: ResultTable, width: int, *, every: bool = False) -> Fitted:
    """A table for a terminal.

    Parameters
    ----------
    width : int
        Characters of a line.
    every : bool, optional
        All rows and all columns are to be shown.
    """
    columns, same = _squeezed(table.columns)
    count = len(columns[0].cells) if columns else 0
    rows: Sequence[int] = range(count)
    if not every and count > MANY_ROWS:
        rows = table.rows if table.rows is not None else range(MOST_ROWS)
        columns = [_only(column, rows) for column in columns]
    if not every:
        kept = _that_fit(columns, width)
        left_out = [_heading(column) for column in columns if not any(_is(column, c) for c in kept)]
        columns = kept
    else:
        left_out = []
    gap = next((gap for gap in (WIDEST_GAP, 2) if _width(columns, gap) <= width), 1)
    legends = dict.fromkeys(column.legend for column in columns if column.legend)
    hidden = _hidden(count - len(rows), count, left_out)
    return Fitted(tuple(_blocks(columns, width, gap)), gap, (*legends, *same, *table.notes, *hidden))


def chosen_rows(count: int, figures: Iterable[np.ndarray], marks: Sequence[str] = ()) -> tuple[int, ...]:
    """The rows of a long path to show: its ends, the largest of every figure with its neighbours, the first of every
    mark, and others between them.

    Examples
    --------
    >>> chosen_rows(101, [np.arange(101.0) == 40])
    (0, 9, 19, 29, 39, 40, 41, 55, 62, 70, 85, 100)
    """
    if count <= MANY_ROWS:
        return tuple(range(count))
    rows = {0, count - 1}
    for mark in dict.fromkeys(mark for mark in marks if mark):
        rows.add(list(marks).index(mark))
    for figure in figures:
        if np.isfinite(figure).any():
            top = int(np.nanargmax(figure))
            rows |= {row for row in (top - 1, top, top + 1) if 0 <= row < count}
    while len(rows) < MOST_ROWS:
        ends = sorted(rows)
        low, high = max(itertools.pairwise(ends), key=lambda pair: pair[1] - pair[0])
        rows.add((low + high) // 2)
    return tuple(sorted(rows))


def _squeezed(columns: Sequence[Column]) -> tuple[list[Column], list[str]]:
    """The columns that differ from row to row, and notes on the others."""
    zero = [column for column in columns if not column.is_key and not column.left and _is_zero(column)]
    empty = [column for column in columns if not column.is_key and set(column.cells) <= {NOTHING, ""}]
    rows = len(columns[0].cells) if columns else 0
    same = [c for c in columns if rows > 1 and len(set(c.cells)) == 1 and not c.alarms and c not in (*zero, *empty)]
    # What is the same everywhere may be all that there is to see.
    for left_out in ((*zero, *empty, *same), (*zero, *empty), ()):
        kept = [column for column in columns if not any(_is(column, other) for other in left_out)]
        if not all(column.is_key for column in kept):
            break
    same = [column for column in same if column in left_out]
    if not left_out:
        return list(columns), []
    of = " in all rows" if rows > 1 else ""
    notes = [f"Zero{of}: {_listed(map(_heading, zero))}."] if zero else []
    if same:
        notes.append(f"The same in all rows: {_listed(map(_with_value, same))}.")
    if empty:
        notes.append(f"Without a value{of}: {_listed(map(_heading, empty))}.")
    return kept, notes


def _is(one: Column, other: Column) -> bool:
    return one is other or (one.name, one.unit) == (other.name, other.unit)


def _is_zero(column: Column) -> bool:
    return bool(column.cells) and all(cell.strip("0.") == "" and cell for cell in column.cells)


def _listed(parts: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(parts))


def _heading(column: Column) -> str:
    return f"{column.name} {column.unit if column.left else ''}".strip().replace("\n", " ")


def _with_value(column: Column) -> str:
    return f"{_heading(column)} {column.cells[0]} {'' if column.left else column.unit}".strip()


def _only(column: Column, rows: Sequence[int]) -> Column:
    alarms = tuple(k for k, row in enumerate(rows) if row in column.alarms)
    return replace(column, cells=tuple(column.cells[row] for row in rows), alarms=alarms)


def _width(columns: Sequence[Column], gap: int) -> int:
    # One character stands in front of the first column.
    return sum(column.width + gap for column in columns) - gap + 1


def _that_fit(columns: Sequence[Column], width: int) -> list[Column]:
    """The most needed columns, with texts shortened where they fit then; in blocks they have room as they are."""
    kept = _shortened(columns, width, LONG)
    for spare in sorted({column.spare for column in columns if column.spare}, reverse=True):
        if _width(kept, 1) <= width:
            break
        columns = [column for column in columns if column.spare != spare]
        kept = _shortened(columns, width, LONG)
    short = _shortened(kept, width, SHORT)
    return short if _width(short, 1) <= width else list(columns)


def _shortened(columns: Sequence[Column], width: int, most: int) -> list[Column]:
    """The columns with long texts cut in the middle, the widest ones first, until they fit."""
    kept = list(columns)
    while _width(kept, 1) > width:
        long = [k for k, column in enumerate(kept) if column.left and column.width > most]
        if not long:
            break
        widest = max(long, key=lambda k: kept[k].width)
        over = _width(kept, 1) - width
        cut = _cut(kept[widest], max(most, kept[widest].width - over))
        if cut.width >= kept[widest].width:
            break
        kept[widest] = cut
    return kept


def _cut(column: Column, most: int) -> Column:
    most = max(most, *(len(line) for line in (*column.name.split("\n"), column.unit)))
    cells = tuple(abbreviated(cell, most) for cell in column.cells)
    # Rows that are told by their names keep them.
    return column if column.is_key and len(set(cells)) < len(set(column.cells)) else replace(column, cells=cells)


def abbreviated(text: str, most: int) -> str:
    """A text without its middle.

    Examples
    --------
    >>> abbreviated("base1.first + 11 more 8 % each", 22), abbreviated("crank/link, link/rod 12 % each", 24)
    ('base1.first… 8 % each', 'crank/link… 12 % each')
    """
    if len(text) <= most:
        return text
    share = SHARE.search(text)
    tail = text[share.start() :] if share else text[-(2 * most // 5 + 1) :]
    head = text[: max(most - len(tail) - 1, 0)]
    # Of names in a row whole ones are left.
    head = head.partition(" +")[0] if share else head
    head = head.rpartition(",")[0] if share and "," in head else head.rstrip()
    return f"{head}…{tail}"


def _blocks(columns: Sequence[Column], width: int, gap: int) -> Iterator[tuple[Column, ...]]:
    """Columns in blocks that fit, every one of them with the keys."""
    keys = [column for column in columns if column.is_key]
    block = list(keys)
    for column in (column for column in columns if not column.is_key):
        if len(block) > len(keys) and _width([*block, column], gap) > width:
            yield tuple(block)
            # One key is enough to find the row again.
            block = keys[:1]
            keys = keys[:1]
        block.append(column)
    yield tuple(block)


def _hidden(rows: int, count: int, columns: Sequence[str]) -> Iterator[str]:
    parts = [f"{rows} of {count} rows"] if rows else []
    parts += [_listed(columns)] if columns else []
    if parts:
        yield f"Not shown: {'; '.join(parts)}. --all shows everything."
