"""Make the page on paper 3, its figures and the tables of its maps; the build of the documentation does.

python examples/papers/make_paper_3.py --into FOLDER
"""

from into import folder
from paper3 import figures, maps, page, study


def main() -> None:
    """Entry point."""
    place = folder("Make the page on paper 3, its figures and the tables of its maps.")
    answers, mapped = study.study(), maps.compute()
    maps.save(mapped, place / "paper-3-map.csv", place / "paper-3-worst.csv")
    figures.draw_all(answers, mapped, place / "img")
    (place / "paper-3.md").write_text(page.render(answers, mapped), encoding="utf-8")


if __name__ == "__main__":
    main()
