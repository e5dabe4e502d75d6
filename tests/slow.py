"""Which tests `make quick` leaves out, by measured time.

`make test` with `PYTEST_ADDOPTS=--junitxml=build/tests.xml`, then `python tests/slow.py build/tests.xml [SHARE]` writes
tests/slow.txt: the functions that took longest, as few as leave SHARE (0.3) of the time to the others.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

SLOW = Path(__file__).parent / "slow.txt"
#: of the whole time, what the others may take
SHARE = 0.3


def measured(report: Path) -> Counter[str]:
    """Seconds of every test function, with all its parameters."""
    seconds: Counter[str] = Counter()
    # A run that was stopped leaves a case without names.
    for case in ElementTree.parse(report).iterfind(".//testcase[@classname]"):
        *folders, last = case.attrib["classname"].split(".")
        # A class of tests comes after its file.
        inside = [last] if last[:1].isupper() else []
        path = "/".join(folders if inside else [*folders, last]) + ".py"
        name = "::".join([path, *inside, case.attrib["name"].partition("[")[0]])
        seconds[name] += float(case.attrib["time"])
    return seconds


def slow(seconds: Counter[str], share: float) -> list[str]:
    """The fewest functions without which no more than a share of the time is left."""
    left, chosen = seconds.total(), []
    for name, time in seconds.most_common():
        if left <= share * seconds.total():
            break
        chosen.append(name)
        left -= time
    return sorted(chosen)


if __name__ == "__main__":
    report, *share = sys.argv[1:]
    chosen = slow(measured(Path(report)), float(share[0]) if share else SHARE)
    SLOW.write_text("".join(f"{name}\n" for name in chosen), encoding="utf-8")
