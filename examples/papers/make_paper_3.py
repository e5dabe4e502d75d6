"""Write docs/papers/paper-3.md with its figures and tables, or check that the committed page is what this computes.

python examples/papers/make_paper_3.py            writes the page, the figures and the tables of the maps
python examples/papers/make_paper_3.py --check    exit code 1 if page or tables differ or a figure is missing
"""

from __future__ import annotations

import argparse
import difflib
import sys
from pathlib import Path

from paper3 import maps, page, study

DOCS = Path(__file__).resolve().parents[2] / "docs" / "papers"
PAGE = DOCS / "paper-3.md"
LOADED, WORST = DOCS / "paper-3-map.csv", DOCS / "paper-3-worst.csv"
IMAGES = DOCS / "img"


def check(text: str) -> int:
    """Compare the committed page with the computed one, line by line."""
    committed = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    difference = list(
        difflib.unified_diff(committed.splitlines(), text.splitlines(), "committed", "computed", lineterm="", n=0)
    )
    missing = [target for target in page.links(text) if not (DOCS / target).exists()]
    print("\n".join([*difference, *(f"missing: {name}" for name in missing)]) or f"{PAGE.name} is up to date")
    return 1 if difference or missing else 0


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
        return check(page.render(answers, maps.load(LOADED, WORST)))
    from paper3 import figures  # matplotlib is not needed for --check

    maps.save(mapped, LOADED, WORST)
    figures.draw_all(answers, mapped, IMAGES)
    PAGE.write_text(page.render(answers, maps.load(LOADED, WORST)), encoding="utf-8")
    print(f"{PAGE.name}, 2 tables and {len(figures.FIGURES)} figures written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
