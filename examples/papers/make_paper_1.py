"""Write docs/papers/paper-1.md and its figures, or check that the committed page is what this computes.

python examples/papers/make_paper_1.py            writes the page and the figures
python examples/papers/make_paper_1.py --check    exit code 1 if the page differs or a figure is missing
"""

from __future__ import annotations

import argparse
import difflib
import sys
from pathlib import Path

from paper1 import exact, page

DOCS = Path(__file__).resolve().parents[2] / "docs" / "papers"
PAGE = DOCS / "paper-1.md"
IMAGES = DOCS / "img"


def check(text: str) -> int:
    """Compare the committed page with the computed one, line by line."""
    committed = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    difference = list(
        difflib.unified_diff(committed.splitlines(), text.splitlines(), "committed", "computed", lineterm="", n=0)
    )
    missing = [target for target in page.images(text) if not (DOCS / target).exists()]
    print("\n".join([*difference, *(f"missing figure: {name}" for name in missing)]) or f"{PAGE.name} is up to date")
    return 1 if difference or missing else 0


def main() -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description="Write the page on paper 1 and its figures.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if the committed page differs")
    arguments = parser.parse_args()
    study = exact.study()
    text = page.render(study)
    if arguments.check:
        return check(text)
    from paper1 import figures  # matplotlib is not needed for --check

    figures.draw_all(study, IMAGES)
    PAGE.write_text(text, encoding="utf-8")
    print(f"{PAGE.name} and {len(figures.FIGURES)} figures written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
