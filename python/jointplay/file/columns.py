"""Columns of a table in the folder of the mechanism: CSV with commas, semicolons or tabs, names in the first row.

A spreadsheet takes a cell that begins with ``=``, ``+``, ``-`` or ``@`` for a formula, and runs it. So in every `.csv`
that is written texts that do have an apostrophe in front of them, which says to a spreadsheet that what follows is
text. Where a table is read it is taken away again.
"""

import csv
import io
import math
import re
from dataclasses import dataclass
from pathlib import Path

from jointplay.basics import files
from jointplay.errors import InputError, comma_hint, not_known, one_line, shown

#: no column that somebody measured is longer
MOST_VALUES = 100_000
LARGEST_FILE = 8_000_000
#: what stands between the columns: the first of these that the first row has
SEPARATORS = ";\t,"


#: what stands around the unit in the name of a column
BRACKETS = (("[", "]"), ("(", ")"))
#: what a spreadsheet takes for a formula, also behind apostrophes of the text's own, so that reading undoes writing
FORMULA = re.compile(r"'*[=+\-@\t\r]")
#: what it takes for a number, which stays one
NUMBER = re.compile(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?")


def as_cell(text: str) -> str:
    """A text as a cell of a table that is written.

    Examples
    --------
    >>> as_cell("-arm"), as_cell("-1.5"), as_cell("arm"), as_cell("'=arm")
    ("'-arm", '-1.5', 'arm', "''=arm")
    """
    return f"'{text}" if FORMULA.match(text) and not NUMBER.fullmatch(text) else text


def split(word: str) -> tuple[str, str]:
    """Name and unit of a column.

    Examples
    --------
    >>> split("theta [deg]"), split("x (mm)"), split("y")
    (('theta', 'deg'), ('x', 'mm'), ('y', ''))
    """
    name = word.strip()
    for opening, closing in BRACKETS:
        start, mark, unit = name.removesuffix(closing).rpartition(opening)
        if mark and name.endswith(closing) and closing not in unit:
            return start.rstrip(), unit.strip()
    return name, ""


def from_cell(text: str) -> str:
    """The text of a cell that is read.

    Examples
    --------
    >>> from_cell("'-arm"), from_cell("'arm'")
    ('-arm', "'arm'")
    """
    return text[1:] if text.startswith("'") and FORMULA.match(text) else text


@dataclass(frozen=True)
class Columns:
    """A table."""

    #: its file, for messages
    name: str
    #: names of the columns
    header: list[str]
    #: number, counted from 1 as a spreadsheet does, and words of the rows below that have any
    rows: list[tuple[int, list[str]]]

    def numbers(self, column: str, key: str, *, whole: bool = False) -> list[float]:
        """The numbers below the name of a column.

        Parameters
        ----------
        key : str
            Key of the mechanism file that asks for it, for messages.
        whole : bool
            Whether an empty place is refused in a row that has others; if not, it is left out.

        Raises
        ------
        InputError
            When there is no such column, or a value is no number.
        """
        if self.header.count(column) != 1:
            problem = (
                not_known(column, "a column of its first row", self.header)
                if column not in self.header
                else (f"the first row has {shown(column)} more than once")
            )
            raise InputError(problem, file=self.name, key=key)
        found = self._words(self.header.index(column), whole)
        if len(found) > MOST_VALUES:
            problem = f"column {shown(column)} has more than {MOST_VALUES} values"
            raise InputError(problem, file=self.name, key=key)
        values = [_number(word) for _, word in found]
        for (number, word), value in zip(found, values, strict=True):
            if not math.isfinite(value):
                problem = (
                    f"row {number}, column {shown(column)}: a number is needed, not {shown(word)}{comma_hint(word)}"
                )
                raise InputError(problem, file=self.name, key=key)
        return values

    def _words(self, place: int, whole: bool) -> list[tuple[int, str]]:
        """The words of a column with their rows."""
        every = ((number, row[place].strip() if place < len(row) else "") for number, row in self.rows)
        return [(number, from_cell(word)) for number, word in every if word or whole]


class Tables:
    """The tables in the folder of a mechanism file, each read once, however many drives or laws name it.

    Parameters
    ----------
    path : str
        The mechanism file.
    file : str
        Its name in messages.
    """

    def __init__(self, path: str, file: str) -> None:
        self.path, self.file = path, file
        self._known: dict[str, Columns] = {}

    def beside(self, name: object, key: str) -> Columns:
        """The table of a name.

        Parameters
        ----------
        name : object
            What the file says is the name of the table.
        key : str
            Where it says so.

        Raises
        ------
        InputError
            When it is not there, or is no table.
        """
        if isinstance(name, str) and name in self._known:
            return self._known[name]
        place = files.beside(self.path, name, self.file, key)
        self._known[place.name] = read(place, key)
        return self._known[place.name]


def read(place: Path, key: str = "", *, decimals: str = "decimals have a point") -> Columns:
    """A table.

    Parameters
    ----------
    key : str
        Of the mechanism file that names it, for messages.
    decimals : str
        What messages say of numbers.

    Raises
    ------
    InputError
        When it cannot be read, or is no table.
    """
    said = one_line(str(place))
    # Lines end as in a spreadsheet; a form feed, or what else Unicode has, ends none.
    lines = io.StringIO(_text(place), newline=None)
    first = lines.readline()
    lines.seek(0)
    separator = next((mark for mark in SEPARATORS if mark in first), ",")
    try:
        rows = [*csv.reader(lines, delimiter=separator)]
    except csv.Error as error:
        raise InputError(f"is no table: {error}", file=said, key=key) from None
    header = [from_cell(word.strip()) for word in rows[0]] if rows else []
    below = [(number, row) for number, row in enumerate(rows[1:], 2) if any(word.strip() for word in row)]
    for number, row in below:
        if len(row) > len(header) and any(word.strip() for word in row[len(header) :]):
            # 22,7 below a single name would be read as 22.
            columns = f"{len(header)} column{'s' * (len(header) != 1)}"
            problem = f"row {number} has {len(row)} values for {columns}; {decimals}"
            raise InputError(problem, file=said, key=key)
    return Columns(said, header, below)


def _text(place: Path) -> str:
    name = one_line(str(place))
    try:
        with place.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=name) from None
    except ValueError as error:
        raise InputError(f"is no name of a file: {error}", file=name) from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"is longer than {LARGEST_FILE // 1_000_000} MB, too long for a table", file=name)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=name) from None


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan
