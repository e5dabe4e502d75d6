"""Write docs/papers/paper-3.md with its figures and tables, or check that the committed page is what this computes.

python examples/papers/make_paper_3.py            writes the page, the figures and the tables of the maps
python examples/papers/make_paper_3.py --check    exit code 1 if page or tables differ or a figure is missing
"""

from __future__ import annotations

import argparse
import sys

from committed import IMAGES, PAPERS, check
from paper3 import maps, page, study

PAGE = PAPERS / "paper-3.md"
LOADED, WORST = PAPERS / "paper-3-map.csv", PAPERS / "paper-3-worst.csv"


def main() -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description="Write the page on paper 3, its figures and tables.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if something differs")
    arguments = parser.parse_args()
    answers, mapped = study.study(), maps.compute()
    if arguments.check:
        if not maps.agree(maps.load(LOADED, WORST), mapped):
            print(f"{LOADED.name} or {WORST.name} differs")
            return 1
        return check(PAGE, page.render(answers, maps.load(LOADED, WORST)))
    from paper3 import figures  # matplotlib is not needed for --check

    maps.save(mapped, LOADED, WORST)
    figures.draw_all(answers, mapped, IMAGES)
    PAGE.write_text(page.render(answers, maps.load(LOADED, WORST)), encoding="utf-8")
    print(f"{PAGE.name}, 2 tables and {len(figures.FIGURES)} figures written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
