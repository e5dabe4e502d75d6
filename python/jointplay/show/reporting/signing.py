"""The head of a report as a document: revision, date and hash, who signs it, and the foot of its sheets."""

from dataclasses import dataclass
from html import escape
from pathlib import Path

from jointplay.errors import one_line
from jointplay.model.mechanism import Mechanism
from jointplay.result import today

#: in the order in which a document is signed
ROLES = {"author": "Author", "checked_by": "Checked by", "approved_by": "Approved by"}
#: letters of a title at the foot of a sheet
SHORT = 60


@dataclass(frozen=True)
class TitleHead:
    """What identifies a report."""

    title: str
    revision: str
    date: str
    file: str
    hash: str
    #: every role with a name, or nothing
    signs: tuple[tuple[str, str], ...]
    #: whether the file says any of it
    is_given: bool


def block(m: Mechanism) -> TitleHead:
    """The title block of a mechanism file; what it leaves out is the title of the mechanism, and the day."""
    given = m.data.document
    title = (given.title if given else "") or m.title or Path(m.file).name
    return TitleHead(
        one_line(title),
        given.revision if given else "",
        (given.date if given else "") or today(),
        one_line(Path(m.file).name),
        m.hash,
        tuple((words, getattr(given, key) if given else "") for key, words in ROLES.items()),
        given is not None,
    )


def shown(found: TitleHead) -> str:
    """The title block, with room for signatures; without a name in the file the room is on paper only."""
    rows = {"Revision": found.revision, "Date": found.date, "Mechanism": f"{found.file}, {found.hash}"}
    items = "".join(
        f'<div><dt>{name}</dt><dd translate="no">{escape(text)}</dd></div>' for name, text in rows.items() if text
    )
    head = "".join(f'<th class="left">{name}</th>' for name in ("", "Name", "Date", "Signature"))
    signs = "".join(
        f'<tr><th class="left">{role}</th><td class="left" translate="no">{escape(name)}</td><td></td><td></td></tr>'
        for role, name in found.signs
    )
    kind = "signs" if found.is_given else "signs paper"
    return (
        f'<dl class="block">{items}</dl>'
        f'<table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{signs}</tbody></table>'
    )


def on_paper(found: TitleHead, paper: str) -> str:
    """The style of printed sheets: their size, and what stands at the foot of each."""
    title = found.title if len(found.title) <= SHORT else f"{found.title[: SHORT - 1]}…"
    revision = f", revision {found.revision[:SHORT]}" if found.revision else ""
    size = f"size: {paper}; " if paper else ""
    font = 'font: 8pt system-ui, "DejaVu Sans", sans-serif; color: #5c6166;'
    return (
        f"@page {{ {size}@bottom-left {{ content: {quoted(title + revision)}; {font} }} "
        f"@bottom-center {{ content: {quoted(f'mechanism {found.hash}, {found.date[:SHORT]}')}; {font} }} "
        f'@bottom-right {{ content: counter(page) " of " counter(pages); {font} }} }}\n'
    )


def quoted(text: str) -> str:
    """A text as a string of a style sheet, in which nothing ends it.

    Examples
    --------
    >>> quoted('A </style>"')
    '"A \\\\3c \\\\2f style\\\\3e \\\\22 "'
    """
    return '"' + "".join(c if c == " " or (c.isascii() and c.isalnum()) else f"\\{ord(c):x} " for c in text) + '"'
