"""Make the page on paper 2 and its figures; the build of the documentation does.

python examples/papers/make_paper_2.py --into FOLDER
"""

from into import folder
from paper2 import figures, page, study


def main() -> None:
    """Entry point."""
    place, answers = folder("Make the page on paper 2 and its figures."), study.study()
    figures.draw_all(answers, place / "img")
    (place / "paper-2.md").write_text(page.render(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
