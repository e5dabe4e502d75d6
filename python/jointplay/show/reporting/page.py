"""The page itself: sections, style and the program of the drawing in one text."""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from importlib.resources import files

from jointplay.basics import pages
from jointplay.errors import one_line
from jointplay.show import viewer

from . import decimals, former, sections, signing
from .answers import Answers
from .drawing import program
from .sections import Section


@dataclass(frozen=True)
class PageLook:
    """How a page is written, beside what it says."""

    #: what has been typed to make the page, where it was typed
    command: str = ""
    #: what it is compared with
    against: former.Former | None = None
    #: decimal sign
    decimal: str = "."
    #: what it is printed on: ``a4`` or ``letter``; nothing leaves that to those who print it
    paper: str = ""


def page(answers: Answers, look: PageLook) -> str:
    """The whole page."""
    with decimals.using(look.decimal):
        return decimals.in_page(_page(answers, look))


def _page(answers: Answers, look: PageLook) -> str:
    block = signing.block(answers.m)
    record = former.record_of(answers, block.date)
    chapters = [("", [sections.changes(look.against, answers.m, record)])] if look.against else []
    for chapter in answers.chapters:
        name = one_line(chapter.output)
        chapters.append((f"Output {name}" if name else "", list(sections.of_chapter(chapter))))
    last = (sections.assembly(answers), sections.map_(answers), sections.sizes_to_order(answers))
    found = [section for section in last if section is not None]
    chapters.append(("", [*found, sections.inputs(answers, look.command)]))
    body, contents = _body(chapters)
    style = files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    style += signing.on_paper(block, look.paper) + viewer.style()
    return (
        f"{pages.head(block.title, style, former.in_head(record))}<body>"
        f'<header><h1 translate="no">{escape(block.title)}</h1>{sections.whole(answers.chapters)}'
        f"{signing.shown(block)}<nav>{contents}</nav></header><main>{body}</main>{program()}"
    )


def _body(chapters: Iterable[tuple[str, list[Section]]]) -> tuple[str, str]:
    """The sections, and a list of them."""
    parts, links = [], []
    count = 0
    for heading, found in chapters:
        if heading:
            parts.append(f"<h2>{escape(heading)}</h2>")
            links.append(f"<strong>{escape(heading)}</strong>")
        level = "h3" if heading else "h2"
        for section in found:
            count += 1
            words = escape(section.title)
            parts.append(f'<section id="s{count}"><{level}>{words}</{level}>{section.content}</section>')
            links.append(f'<a href="#s{count}">{words}</a>')
    return "".join(parts), " ".join(links)
