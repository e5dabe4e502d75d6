"""The bundled examples and random mechanisms beside independent engines, and published figures; docs/verification.json.

python tests/verify_examples.py                  all rows, some minutes; ends with 1 where one is outside its tolerance
python tests/verify_examples.py four-bar rssr    the rows of these examples, printed only
python tests/verify_examples.py --published      the published figures and closed forms, written again
"""

import sys
from functools import cache

from helpers.cores import on_all_cores
from helpers.verification import random_mechanisms
from helpers.verification.closed_forms import FORMS
from helpers.verification.page import NUMBERS, Row, wanted, with_record, written
from helpers.verification.record import figures
from helpers.verification.subject import Check, Found, Subject


@cache
def comparisons() -> list[tuple[Subject, Check]]:
    return list(wanted())


def compared(place: int) -> Found:
    s, check = comparisons()[place]
    return check.compare(s)


def main(names: list[str]) -> int:
    if names == ["--published"]:
        NUMBERS.write_text(with_record(NUMBERS.read_text(encoding="utf-8")), encoding="utf-8")
        print(f"wrote {NUMBERS.name}")
        return 0
    rows = []
    places = [k for k, (s, _) in enumerate(comparisons()) if not names or s.name in names]
    for k, found in zip(places, on_all_cores(compared, places), strict=True):
        s, check = comparisons()[k]
        row = Row(s.name, check, found)
        rows.append(row)
        mark = "" if row.good else "  OUTSIDE"
        print(f"{s.name:24}{check.figure:34}{check.engine:38}{row.found.difference:8.1e}{mark}", flush=True)
    good = all(row.good for row in rows)
    if not names:
        random = list(random_mechanisms.rows())
        good = good and all(row.found.difference <= row.check.tolerance for row in random)
        good = good and all(figure.found == figure.agrees for figure in figures())
        good = good and all(form.found.difference <= form.tolerance for form in FORMS)
        NUMBERS.write_text(written(rows, random), encoding="utf-8")
        print(f"wrote {NUMBERS.name}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
