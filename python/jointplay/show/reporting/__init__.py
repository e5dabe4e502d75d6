"""A report to hand on: one page with the verdict, the mechanism, its errors, who is to blame, and its inputs.

The page carries all that it needs. It opens from an e-mail attachment, works without a network and prints on A4 and
Letter.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

from jointplay.analyses import random
from jointplay.analyses.nominal import Progress
from jointplay.basics import files
from jointplay.basics.progress import bar
from jointplay.basics.typed import typed
from jointplay.errors import InputError, not_known, require
from jointplay.model.mechanism import Mechanism

from . import decimals, former, printing
from .answers import ask, usual

require("matplotlib", "plot", "report")

__all__ = ["check_path", "report", "write"]

EXTENSIONS = (".html", ".pdf")
#: sizes of sheets, as style sheets call them
PAPERS = ("a4", "letter")


@typed
def report(
    m: Mechanism,
    path: str | os.PathLike[str],
    *,
    samples: int | None = None,
    seed: int = 0,
    against: str | os.PathLike[str] | None = None,
    decimal: str = ".",
    paper: str | None = None,
) -> None:
    """Write a report on a mechanism: with the title block and the signatures of its ``[document]``.

    Parameters
    ----------
    m : Mechanism
        With drive values or a path. Of several outputs each has a chapter of its own.
    path : str or path
        Ending in `.html`, or in `.pdf` where Chromium or a browser like it is installed.
    samples : int, optional
        Random specimens per configuration. If left out 32,768; of an over-constrained mechanism without a required
        yield 8192.
    seed : int
        Of the random numbers.
    against : str or path, optional
        A former report, as `.html`: what has changed since stands in front.
    decimal : {".", ","}
        Decimal sign of sentences, tables and figures. With a comma, tables of numbers have semicolons between cells.
    paper : {"a4", "letter"}, optional
        Of a PDF, `a4` if left out. A page on the screen leaves it to those who print it.

    Raises
    ------
    InputError
        When nothing can be written there, the former report cannot be read, or no configuration can be solved.
    JointplayError
        When the page is to be a PDF and no browser is found that prints it.
    """
    former = None if against is None else Path(against)
    with bar("report") as step:
        write(
            *(m, Path(path)),
            samples=samples,
            seed=seed,
            against=former,
            decimal=decimal,
            paper=paper,
            progress=step,
        )


def write(
    m: Mechanism,
    path: Path,
    *,
    samples: int | None = None,
    seed: int = 0,
    against: Path | None = None,
    decimal: str = ".",
    paper: str | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> bool:
    """The report of `report`.

    Parameters
    ----------
    command : str
        What has been typed to make the page, where it was typed.
    progress : callable, optional
        Called with how many steps are done and how many there are.

    Returns
    -------
    bool
        Whether all configurations are ok and no limit is missed.
    """
    check_path(path)
    samples = usual(m) if samples is None else samples
    random.checked(samples, seed, None, random.PROBABILITIES, "sobol")
    is_pdf = path.suffix.lower() == ".pdf"
    if paper is not None and paper not in PAPERS:
        raise InputError(not_known(paper, "a size of sheets", PAPERS), key="paper")
    before = None if against is None else former.read(against)
    sign, sheet = decimals.checked(decimal), paper or ("a4" if is_pdf else "")
    with ThreadPoolExecutor(1) as beside:
        # Loading what draws takes as long as half of the answers, during which the core leaves Python alone.
        drawing = beside.submit(import_module, f"{__name__}.page")
        answers = ask(m, samples, seed, progress)
    page = drawing.result()
    text = page.page(answers, page.PageLook(command, before, sign, sheet))
    content = printing.pdf(text) if is_pdf else text.encode()
    files.put(memoryview(content), path)
    return answers.is_good


def check_path(path: Path) -> None:
    """Refuse a path that no report can be written to.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in EXTENSIONS:
        raise InputError(f"reports are written as {', '.join(EXTENSIONS)}", file=os.fspath(path))
    files.require_writable(path)
    if path.suffix.lower() == ".pdf":
        printing.browser()
