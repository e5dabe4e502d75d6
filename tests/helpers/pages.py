"""Tables that a program writes into a page of the documentation, between ``<!-- NAME -->`` and ``<!-- /NAME -->``."""

from collections.abc import Iterable, Sequence
from pathlib import Path

CHECKS = Path(__file__).parents[2] / "docs" / "checks.md"


def put_table(name: str, header: Sequence[str], rows: Iterable[Sequence[object]], page: Path = CHECKS) -> None:
    """Replace the table of that name on a page.

    Parameters
    ----------
    name : str
        That of the marks.
    header : sequence of str
    rows : iterable of sequence
        Shown as they are printed.
    page : Path
        In Markdown, with both marks.
    """
    head, *body = (f"| {' | '.join(map(str, line))} |" for line in [header, *rows])
    table = "\n".join([head, "|---" * len(header) + "|", *body])
    text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition(f"<!-- /{name} -->")
    if not (begin and end):
        raise ValueError(f"{page.name} has no place for a table called {name}")
    page.write_text(f"{before}{begin}\n{table}\n\n{end}{after}", encoding="utf-8")
