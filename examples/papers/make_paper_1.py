"""Make the page on paper 1 and its figures; the build of the documentation does.

python examples/papers/make_paper_1.py --into FOLDER
"""

from into import folder
from paper1 import exact, figures, page


def main() -> None:
    """Entry point."""
    place, study = folder("Make the page on paper 1 and its figures."), exact.study()
    figures.draw_all(study, place / "img")
    (place / "paper-1.md").write_text(page.render(study), encoding="utf-8")


if __name__ == "__main__":
    main()
