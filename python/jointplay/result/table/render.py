"""Answers and tables on the terminal."""

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from rich import console as terminal
from rich.text import Text

from jointplay.errors import one_line
from jointplay.result.conclusions import Sentence
from jointplay.result.verdict import HELD, NOT_SHOWN

from .fit import fitted
from .layout import Column, ResultTable

#: colour of what is not ok: the vermilion that readers with every kind of colour vision see, on light and dark ground
ALARM = "bold #d55e00"
#: of what is not shown, and of what holds: orange and bluish green of the same palette
STATES = {NOT_SHOWN: "bold #e69f00", HELD: "#009e73"}
#: characters in front of sentences
INDENT = "  "
#: spaces within `3.2 mm`, `95 %` and `theta = 40 deg`, at which no line ends
TOGETHER = re.compile(r"(?<=[0-9]) (?=%|[a-zµ]{1,4}\b)| (?==)|(?<==) |(?<=±) ")
HARD_SPACE = "\N{NO-BREAK SPACE}"


class Answer(NamedTuple):
    """What is said first of a question."""

    label: str
    sentences: tuple[Sentence, ...]


class Console(terminal.Console):
    """Where tables are printed."""

    def on_broken_pipe(self) -> None:
        """Leave it to the program what happens when nobody reads any more."""
        raise BrokenPipeError


def show(
    title: str,
    answers: Sequence[Answer],
    tables: Iterable[ResultTable],
    console: Console,
    *,
    remarks: Iterable[str] = (),
    every: bool = False,
) -> None:
    """Print the answers, then tables one under the other.

    Parameters
    ----------
    title : str
        The first line.
    remarks : iterable of str, optional
        What is said at the end.
    every : bool, optional
        All rows and columns are to be shown.
    """
    _wrapped(Sentence(title), console, style="bold")
    console.print()
    wide = max((len(answer.label) for answer in answers), default=0)
    for label, sentences in answers:
        for k, sentence in enumerate(sentences):
            head = (label if k == 0 else "").ljust(wide) + "  " * bool(wide)
            _wrapped(sentence, console, INDENT + head)
    if any(answer.sentences for answer in answers):
        console.print()
    for table in tables:
        _print_table(table, console, every)
    for remark in remarks:
        _wrapped(Sentence(one_line(remark)), console, INDENT)


def show_names(first: str, titles: Mapping[str, str], console: Console) -> None:
    """Print names with what they are, under a first sentence."""
    _wrapped(Sentence(first), console)
    console.print()
    wide = max(map(len, titles))
    for name, title in titles.items():
        _wrapped(Sentence(title), console, f"{name:<{wide}}  ")


def _print_table(table: ResultTable, console: Console, every: bool) -> None:
    fit = fitted(table, console.width, every=every)
    _wrapped(Sentence(table.title), console, style="bold")
    for sentence in table.lead:
        _wrapped(sentence, console, INDENT)
    for block in fit.blocks:
        console.print()
        for line in _lines(block, fit.gap):
            _print(line, console)
    console.print()
    for note in fit.notes:
        _wrapped(Sentence(note), console, INDENT)
    if fit.notes:
        console.print()


def _wrapped(sentence: Sentence, console: Console, head: str = "", style: str = "") -> None:
    """Print a sentence in lines that fit, those after the first one below its beginning."""
    text = TOGETHER.sub(HARD_SPACE, one_line(sentence.text))
    lines = textwrap.wrap(
        text, console.width, initial_indent=head, subsequent_indent=" " * len(head), break_on_hyphens=False
    )
    for line in lines:
        _print(Text(line.replace(HARD_SPACE, " "), style=_style(sentence) or style), console)


def _style(sentence: Sentence) -> str:
    return STATES.get(sentence.state) or (ALARM if sentence.is_alarm else "")


def _print(line: Text, console: Console) -> None:
    # A line that the terminal breaks is better than a number cut off.
    console.print(line, no_wrap=True, crop=False, overflow="ignore", soft_wrap=True)


def _lines(columns: tuple[Column, ...], gap: int) -> Iterable[Text]:
    """The lines of a table: names, units, a rule, rows."""
    names = [column.name.split("\n") for column in columns]
    height = max(map(len, names))
    for k in range(height):
        # A short name stands on the last line of names.
        yield _line(columns, gap, [name[k - height + len(name)] if k >= height - len(name) else "" for name in names])
    if any(column.unit for column in columns):
        yield _line(columns, gap, [column.unit for column in columns], "dim")
    yield Text(f" {'─' * (sum(column.width + gap for column in columns) - gap)}")
    for row in range(len(columns[0].cells)):
        styles = [ALARM if row in column.alarms else "" for column in columns]
        yield _line(columns, gap, [column.cells[row] for column in columns], *styles)


def _line(columns: tuple[Column, ...], gap: int, cells: Sequence[str], *styles: str) -> Text:
    line = Text(" ")
    for k, (column, cell) in enumerate(zip(columns, cells, strict=True)):
        padded = cell.ljust(column.width) if column.left else cell.rjust(column.width)
        line.append(" " * (gap if k else 0))
        line.append(padded, style=styles[k % len(styles)] if styles else "")
    line.rstrip()
    return line
