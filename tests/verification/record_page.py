"""The section of docs/verification.md on published figures: written from the cases, and read again by their test."""

from __future__ import annotations

import numpy as np

from .record import Case, Figure, cases, figures

TITLE = "Published figures"
HEAD = ("case", "figure", "unit", "numbers", "printed", "its method", "jointplay", "difference", "tolerance", "remark")
INTRODUCTION = """\
Figures of publications, beside what jointplay computes. Every figure was read where the list says. The tolerance is
half a unit of the last printed digit; the remark says where it is more, and why. A row with several numbers shows the
one that differs most. *Its method* is the figure by the rule of the publication, where this is not the geometry:
jointplay then gives another value, and the remark says why. The cases are in `tests/published`, and its README lists
what was looked for and not found with complete numbers.
"""
#: digits beyond those printed
MORE = 2


def section() -> str:
    """The section, without what follows it."""
    agreeing = sum(figure.found in ("jointplay", "both") for figure in figures())
    counted = (
        f"{agreeing} of {len(list(figures()))} rows agree with jointplay. The others have a reason in the remark.\n"
    )
    lines = [HEAD, ["---"] * len(HEAD), *(row(figure) for figure in figures())]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"
    return "\n".join([f"## {TITLE}\n", INTRODUCTION, "\n".join(map(_source, cases().values())) + "\n", counted, table])


def replaced(page: str, following: str) -> str:
    """A page with this section anew, before the section that follows it."""
    before, _, _ = page.partition(f"## {TITLE}\n")
    head, _, tail = page.partition(f"## {following}\n")
    return f"{min(before, head, key=len)}{section()}\n## {following}\n{tail}"


def row(figure: Figure) -> list[str]:
    """The cells of one figure."""
    k = int(np.argmax(np.abs(figure.jointplay - figure.printed)))
    digits = figure.decimals + MORE
    method = "" if figure.method is None else f"{figure.method[k]:.{digits}f}"
    return [
        figure.case.name,
        figure.what,
        figure.raw["unit"],
        str(figure.printed.size),
        figure.texts[k],
        method,
        f"{figure.jointplay[k]:.{digits}f}",
        f"{figure.off(figure.jointplay):.2g}",
        f"{figure.tolerance:g}",
        figure.remark,
    ]


def read(page: str) -> list[dict[str, str]]:
    """The rows of a page, by column."""
    lines = [line.strip("|").split(" | ") for line in _own(page) if line.startswith("| ")]
    rows = [dict(zip(HEAD, (cell.strip() for cell in line), strict=True)) for line in lines]
    return rows[2:]


def read_sources(page: str) -> list[str]:
    """The cases that a page lists with their sources."""
    return [line.split("`")[1] for line in _own(page) if line.startswith("* `")]


def _own(page: str) -> list[str]:
    return page.partition(f"## {TITLE}\n")[2].partition("\n## ")[0].splitlines()


def _source(case: Case) -> str:
    return "* `{name}`: {title}. {source}. Read: {place}; {read}.".format(name=case.name, **case.raw)
