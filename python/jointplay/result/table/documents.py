"""Answers and tables as text for documents: Markdown, LaTeX, a page of HTML. All rows and columns are there."""

import re
from collections.abc import Callable, Mapping, Sequence
from html import escape

from jointplay.basics import pages
from jointplay.errors import InputError
from jointplay.questions import QUESTIONS
from jointplay.result import Result

from . import html
from .layout import Column, ResultTable
from .screen import screen

#: how characters are written that mean something in LaTeX
TEX = {
    **{c: f"\\{c}" for c in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "–": "--",
    "±": r"$\pm$",
    "²": r"$^2$",
    "µ": r"$\mu$",
}
STYLE = (
    "body{font:15px/1.5 sans-serif;margin:2em auto;max-width:60em;padding:0 1em}table{border-collapse:collapse}"
    "td{white-space:nowrap}th,td{padding:.15em .7em;text-align:right}.left{text-align:left}"
    "thead{border-bottom:1px solid}.wide{overflow-x:auto}.note{font-size:90%}"
)


def document(results: Mapping[str, Result], kind: str) -> str:
    """What a command prints of its results, as text of a kind.

    Parameters
    ----------
    results : mapping
        By question.
    kind : str
        One of `KINDS`, an extension.
    """
    answers, tables = screen(_known(results))
    label_of = {answer.label: [sentence.text for sentence in answer.sentences] for answer in answers}
    title = next((str(result.attrs["title"]) for result in results.values() if result.attrs.get("title")), "")
    return KINDS[kind](title, label_of, tables)


def blocks(result: Result) -> tuple[list[str], list[ResultTable]]:
    """The sentences of the answer and the tables of one result."""
    answers, tables = screen(_known({str(result.attrs.get("question", "")): result}))
    return [sentence.text for answer in answers for sentence in answer.sentences], tables


def is_printed(name: str) -> bool:
    """Whether a command prints the answer to a question; not that to several which are one result."""
    return name in QUESTIONS and bool(QUESTIONS[name].conclusion)


def _known(results: Mapping[str, Result]) -> Mapping[str, Result]:
    if others := [name for name in results if not is_printed(name)]:
        what = "what a command prints" if others[0] in QUESTIONS else "one question"
        raise InputError(f"a table is of {what}; this is of '{others[0]}'", key="result")
    return results


def _markdown(title: str, answers: Mapping[str, Sequence[str]], tables: Sequence[ResultTable]) -> str:
    lines = [f"# {_plain(title)}", ""] if title else []
    for label, sentences in answers.items():
        lines += [f"{f'**{label}**: ' if label and k == 0 else ''}{_plain(text)}\n" for k, text in enumerate(sentences)]
    for table in tables:
        lines += [f"## {_plain(table.title)}", "", *(f"{_plain(one.text)}\n" for one in table.lead)]
        if table.columns:
            heads = [_plain(heading(column)) for column in table.columns]
            rows = [[_plain(cell) for cell in row] for row in _rows(table)]
            sides = ["---" if column.left else "--:" for column in table.columns]
            lines += [f"| {' | '.join(row)} |" for row in (heads, sides, *rows)]
            lines.append("")
        lines += [f"{_plain(note)}\n" for note in table.notes]
    return "\n".join(lines).rstrip("\n") + "\n"


def _latex(title: str, answers: Mapping[str, Sequence[str]], tables: Sequence[ResultTable]) -> str:
    lines = ["% needs \\usepackage{booktabs, longtable}"]
    lines += [f"\\section*{{{_tex(title)}}}"] if title else []
    for label, sentences in answers.items():
        lines += [_tex(f"{label}: " * bool(label and k == 0) + text) + "\n" for k, text in enumerate(sentences)]
    for table in tables:
        lines += [f"\\subsection*{{{_tex(table.title)}}}", *(_tex(one.text) + "\n" for one in table.lead)]
        if table.columns:
            sides = "".join("l" if column.left else "r" for column in table.columns)
            names = [_tex(" ".join(column.name.split("\n"))) for column in table.columns]
            units = [_tex(column.unit) for column in table.columns]
            rows = [" & ".join(map(_tex, row)) + r" \\" for row in _rows(table)]
            head = [" & ".join(names) + r" \\", *([" & ".join(units) + r" \\"] if any(units) else [])]
            lines += [f"\\begin{{longtable}}{{{sides}}}", r"\toprule", *head, r"\midrule", r"\endhead"]
            lines += [*rows, r"\bottomrule", r"\end{longtable}"]
        lines += [_tex(note) + "\n" for note in table.notes]
    return "\n".join(lines) + "\n"


def _page(title: str, answers: Mapping[str, Sequence[str]], tables: Sequence[ResultTable]) -> str:
    parts = [pages.head(title or "jointplay", STYLE), "<body>", f"<h1>{escape(title)}</h1>" if title else ""]
    for label, sentences in answers.items():
        parts.append(html.paragraphs([f"{label}: " * bool(label and k == 0) + s for k, s in enumerate(sentences)]))
    for table in tables:
        parts += [f"<h2>{escape(table.title)}</h2>", html.paragraphs([one.text for one in table.lead])]
        parts.append(html.table(table, most=None))
    return "\n".join((*parts, "</body></html>", ""))


def heading(column: Column) -> str:
    """The name of a column with its unit, in one line."""
    name = " ".join(column.name.split("\n"))
    return f"{name} ({column.unit})" if column.unit else name


def _rows(table: ResultTable) -> list[tuple[str, ...]]:
    count = max((len(column.cells) for column in table.columns), default=0)
    return [tuple(column.cells[k] for column in table.columns) for k in range(count)]


def _plain(text: str) -> str:
    """Text that Markdown takes as it is."""
    return re.sub(r"([\\`*_{}\[\]<>#|~])", r"\\\1", text)


def _tex(text: str) -> str:
    return "".join(TEX.get(c, c) for c in text)


#: by extension
KINDS: Mapping[str, Callable[[str, Mapping[str, Sequence[str]], Sequence[ResultTable]], str]] = {
    ".md": _markdown,
    ".tex": _latex,
    ".html": _page,
}
