"""Degrees of freedom of random robots, beside those that they have by construction: `verify_freedoms.py [ROBOTS]`.

Robots of the kinds of `freedoms`, at special poses and beside them, with arms on them, are drawn exactly and with noise
of 1e-7 to 1e-5 of their size, imported, and checked. Counted are wrong counts of `import` and of `check`.
"""

import sys
import tempfile
from pathlib import Path

import jointplay as jp
from helpers.freedoms import KINDS, NOISES, robot
from helpers.pages import put_table

#: robots if nothing is said; of each kind as many
ROBOTS = 20 * len(KINDS)


def main(robots: int) -> int:
    """Write the table, and return how many counts are wrong."""
    rows, wrong = [], 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.sdf")
        for noise in NOISES:
            count = imports = checks = redundant = 0
            for seed in range(robots):
                made, _ = robot(seed, noise)
                path.write_text(made.sdf(), encoding="utf-8")
                for planar in (False, True) if made.flat_redundant is not None else (False,):
                    m = jp.read(path, output=made.output, planar=planar)
                    found = jp.check(m).attrs
                    count += 1
                    imports += len(m.drives) != made.freedoms
                    checks += found["degrees_of_freedom"] != made.freedoms or not found["decided"]
                    redundant += found["redundancy"] != (made.flat_redundant if planar else made.redundant)
            rows.append((f"{noise:g}", count, imports, checks, redundant))
            wrong += imports + checks + redundant
    header = ("noise, part of the size", "robots", "wrong in `import`", "wrong in `check`", "wrong redundancy")
    put_table("freedoms", header, rows)
    return wrong


if __name__ == "__main__":
    sys.exit(int(main(int(sys.argv[1]) if len(sys.argv) > 1 else ROBOTS) > 0))
