"""Write docs/papers/paper-1.md and its figures, or check that the committed page is what this computes.

python examples/papers/make_paper_1.py            writes the page and the figures
python examples/papers/make_paper_1.py --check    exit code 1 if the page differs or a figure is missing
"""

from __future__ import annotations

import argparse
import sys

from committed import IMAGES, PAPERS, check
from paper1 import exact, page

PAGE = PAPERS / "paper-1.md"


def main() -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description="Write the page on paper 1 and its figures.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if the committed page differs")
    arguments = parser.parse_args()
    study = exact.study()
    text = page.render(study)
    if arguments.check:
        return check(PAGE, text)
    from paper1 import figures  # matplotlib is not needed for --check

    figures.draw_all(study, IMAGES)
    PAGE.write_text(text, encoding="utf-8")
    print(f"{PAGE.name} and {len(figures.FIGURES)} figures written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
