"""The bundled examples and random mechanisms beside independent engines, and published figures; docs/verification.md.

python tests/verify_examples.py                  all rows, some minutes; ends with 1 where one is outside its tolerance
python tests/verify_examples.py four-bar rssr    the rows of these examples, printed only
python tests/verify_examples.py --published      the published figures, written into the page
"""

from __future__ import annotations

import sys

from verification import random_mechanisms
from verification.page import PAGE, Row, wanted, with_record, written
from verification.record import figures


def main(names: list[str]) -> int:
    if names == ["--published"]:
        PAGE.write_text(with_record(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
        print(f"wrote {PAGE.name}")
        return 0
    rows = []
    for s, check in wanted():
        if names and s.name not in names:
            continue
        row = Row(s.name, check, check.compare(s))
        rows.append(row)
        mark = "" if row.good else "  OUTSIDE"
        print(f"{s.name:24}{check.figure:34}{check.engine:38}{row.found.difference:8.1e}{mark}", flush=True)
    good = all(row.good for row in rows)
    if not names:
        random = list(random_mechanisms.rows())
        good = good and all(row.found.difference <= row.check.tolerance for row in random)
        good = good and all(figure.found == figure.agrees for figure in figures())
        PAGE.write_text(written(rows, random), encoding="utf-8")
        print(f"wrote {PAGE.name}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
