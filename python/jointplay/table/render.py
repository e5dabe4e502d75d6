"""Tables on the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich import box
from rich import console as terminal
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from .layout import Column, Table

#: characters of a terminal from which columns stand well apart
ROOMY = 100


class Console(terminal.Console):
    """Where tables are printed."""

    def on_broken_pipe(self) -> None:
        """Leave it to the program what happens when nobody reads any more."""
        raise BrokenPipeError


def show(tables: Iterable[Table], console: Console) -> None:
    """Print tables one under the other."""
    for table in tables:
        gap = 3 if console.width >= ROOMY else 1
        columns = table.fitted(console.width, gap)
        notes = list(table.notes)
        if len(columns) < len(table.columns):
            left_out = (
                f"{c.name} {c.unit if c.left else ''}".strip().replace("\n", " ")
                for c in table.columns
                if c not in columns
            )
            notes.append(f"No room for: {', '.join(left_out)}.")
        console.print(Text(table.title, style="bold"))
        for line in table.lead:
            console.print(Padding(Text(line), (0, 0, 0, 2), expand=False))
        _print_whole(_rich(columns, gap), sum(column.width + gap for column in columns) + 2, console)
        for note in notes:
            console.print(Padding(Text(note), (0, 0, 0, 2), expand=False))
        if notes:
            console.print()


def _print_whole(table: RichTable, needed: int, console: Console) -> None:
    """Print a table at the width it needs: a line that the terminal breaks is better than a number cut off."""
    width = console.width
    try:
        console.width = max(width, needed)
        console.print(table, crop=False)
    finally:
        console.width = width


def _rich(columns: tuple[Column, ...], gap: int) -> RichTable:
    units = any(column.unit for column in columns)
    rich = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, header_style="", padding=(0, gap - 1, 0, 0))
    for column in columns:
        header = Text(column.name)
        if units:
            header.append(f"\n{column.unit}", style="dim")
        rich.add_column(header, justify="left" if column.left else "right", no_wrap=True)
    for row in zip(*(column.cells for column in columns), strict=True):
        rich.add_row(*(Text(cell) for cell in row))
    return rich
