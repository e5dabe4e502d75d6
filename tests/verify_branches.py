"""Maps of parallel robots beside determinants by hand, and what a fine path reaches: the table of `docs/checks.md`.

python tests/verify_branches.py [FINER]      how fine the grids are, 6 if left out; coarser ones are printed only
"""

import sys

from helpers import mapped
from helpers.pages import put_table

#: fineness from which on a table is one to publish
WHOLE = 6
HEADER = (
    *("map", "nodes", "`ok`", "`other_branch`"),
    *("`ok` with the other sign", "refused, although a fine path reaches them", "equations by hand lack"),
)


def main() -> None:
    """Print the table, and write it; ends with 1 where a node is on the wrong side."""
    finer = int(sys.argv[1]) if len(sys.argv) > 1 else WHOLE
    rows, bad = [], False
    for case in mapped.cases(finer):
        found = mapped.compare(case, 12 if case.axes < 3 else 4)
        rows.append((case.name, found.nodes, found.ok, found.other, found.wrong, found.refused, f"{found.open:.0e}"))
        print(*rows[-1], sep="  ", flush=True)
        bad |= bool(found.wrong or found.refused)
    if finer >= WHOLE:
        put_table("branches", HEADER, rows)
    sys.exit(int(bad))


if __name__ == "__main__":
    main()
