"""The page itself: sections, style and the program of the drawing in one text."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.resources import files
from pathlib import Path

from jointplay.basics import pages
from jointplay.errors import one_line
from jointplay.show import viewer

from . import sections
from .answers import Answers
from .drawing import program
from .sections import Section


def page(answers: Answers, command: str) -> str:
    """The whole page."""
    m = answers.m
    title = one_line(m.title or Path(m.file).name)
    chapters = []
    for chapter in answers.chapters:
        name = one_line(chapter.output)
        chapters.append((f"Output {name}" if name else "", list(sections.of_chapter(chapter))))
    last = [section for section in (sections.assembly(answers), sections.map_(answers)) if section is not None]
    chapters.append(("", [*last, sections.inputs(answers, command)]))
    body, contents = _body(chapters)
    if len(answers.chapters) > 1:
        body = f"{sections.whole(answers.chapters)}{body}"
    style = files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    return (
        f"{pages.head(title, style + viewer.style())}<body>"
        f"<header><h1>{escape(title)}</h1><nav>{contents}</nav></header><main>{body}</main>{program()}"
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
