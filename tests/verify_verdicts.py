"""Whether the first sentence and the exit code of every command agree with the numbers, on 60 files.

python tests/verify_verdicts.py            all of them, and the table in docs/checks.md
python tests/verify_verdicts.py 8          the first eight, which are printed only
"""

import contextlib
import io
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from helpers import pages
from helpers import verdict_files as files
from helpers.cores import on_all_cores
from jointplay.cli import run

#: of so many files one gets a report
REPORTS = 7
#: characters of a line on which every sentence fits
WIDE = "100000"


def of_file(number: int) -> list[tuple[str, str, str, bool, bool, str]]:
    """For every command on a file: what is expected, whether the sentence and whether the exit code agree."""
    os.environ["COLUMNS"] = WIDE
    base, kind = divmod(number, len(files.KINDS))
    file = list(files.of_base(files.BASES[base], base))[kind]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = files.write(file, Path(folder))
        for one in files.asked(file, path, report=number % REPORTS == 0):
            said, code = answered(one.arguments)
            first = said_first(one, said, Path(f"{path}.html"))
            says = one.says is None or files.says(first) == one.says
            label = f"{path.stem}: {' '.join(one.arguments[:1])} {one.command}"
            wrong = "" if says and code == one.code else f"{label}: {one.says} {one.code}; said: {first} ({code})"
            found.append((one.command, one.says or "", kind_of(one.says), says, code == one.code, wrong))
    return found


def kind_of(says: str | None) -> str:
    return says or "no verdict"


def answered(arguments: tuple[str, ...]) -> tuple[str, int]:
    """What a command prints, and its exit code."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        code = run(list(arguments))
    return out.getvalue(), code


def said_first(one: files.Asked, printed: str, page: Path) -> str:
    """The first sentence, of a report that of its page."""
    if one.command != "report":
        return files.first_sentence(printed)
    return files.first_of_page(page.read_text(encoding="utf-8"))


def rows(results: list[list[tuple[str, str, str, bool, bool, str]]]) -> Iterator[list[object]]:
    every = [one for result in results for one in result]
    for command in dict.fromkeys(one[0] for one in every):
        own = [one for one in every if one[0] == command]
        outcomes = Counter(one[2] for one in own)
        counts = [outcomes[which] for which in (files.HELD, files.MISSED, files.NOT_SHOWN)]
        yield [f"`{command}`", len(own), *counts, sum(not one[3] for one in own), sum(not one[4] for one in own)]


def main() -> int:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else len(files.BASES) * len(files.KINDS)
    results = list(on_all_cores(of_file, range(count)))
    wrong = [one[5] for result in results for one in result if one[5]]
    header = ["command", "files", "held", "missed", "not shown", "other sentence", "other exit code"]
    table = list(rows(results))
    for line in (header, *table):
        print(" | ".join(map(str, line)))
    print(*wrong, sep="\n")
    if len(sys.argv) == 1:
        pages.put_table("verdicts", header, table)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
