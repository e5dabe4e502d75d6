"""Write docs/papers/paper-2.md with its figures, or check that the committed page is what this computes.

python examples/papers/make_paper_2.py            writes the page and the figures
python examples/papers/make_paper_2.py --check    exit code 1 if the page differs or a figure is missing
"""

from __future__ import annotations

import argparse
import sys

from committed import IMAGES, PAPERS, check
from paper2 import page, study

PAGE = PAPERS / "paper-2.md"


def main() -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description="Write the page on paper 2 and its figures.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if something differs")
    arguments = parser.parse_args()
    answers = study.study()
    if arguments.check:
        return check(PAGE, page.render(answers))
    from paper2 import figures  # matplotlib is not needed for --check

    figures.draw_all(answers, IMAGES)
    PAGE.write_text(page.render(answers), encoding="utf-8")
    print(f"{PAGE.name} and {len(figures.FIGURES)} figures written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
