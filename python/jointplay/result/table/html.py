"""Tables and sentences as HTML, for pages and notebooks. Texts of files are escaped here."""

from collections.abc import Sequence
from html import escape

from .layout import ResultTable

#: rows of a table that a page has; files have all
MOST_ROWS = 400


def table(found: ResultTable, *, title: bool = False, most: int | None = MOST_ROWS) -> str:
    """A table as on the screen, with its notes; its first rows, or all."""
    head = "".join(
        f"<th{_side(column.left)}>{escape(column.name)}<br><small>{escape(column.unit)}</small></th>"
        for column in found.columns
    )
    count = max((len(column.cells) for column in found.columns), default=0)
    rows = [
        "<tr>" + "".join(f"<td{_side(c.left)}>{escape(c.cells[k])}</td>" for c in found.columns) + "</tr>"
        for k in range(count if most is None else min(count, most))
    ]
    caption = f"<caption>{escape(found.title)}</caption>" if title else ""
    body = f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>" if rows else ""
    return f'<div class="wide">{body}</div>{paragraphs(found.notes, "note")}'


def _side(left: bool) -> str:
    return ' class="left"' if left else ""


def folded(words: str, content: str, *, is_open: bool = False) -> str:
    """Something that is there when it is opened."""
    return f"<details{' open' * is_open}><summary>{escape(words)}</summary>{content}</details>"


def paragraphs(lines: Sequence[str], kind: str = "") -> str:
    """Sentences, a paragraph each."""
    mark = f' class="{kind}"' if kind else ""
    return "".join(f"<p{mark}>{escape(line)}</p>" for line in lines)
