"""Published figures: each agrees with what its case says within its printed digits, and the page lists all of them."""

import json
from dataclasses import replace

import pytest

from helpers.verification.page import NUMBERS
from helpers.verification.record import AGREES, FOLDER, Case, Figure, cases, figures
from helpers.verification.record_page import row as shown

FOUND = json.loads(NUMBERS.read_text(encoding="utf-8"))
KEYS = {"what", "unit", "printed", "answer", "method", "rows", "without", "within", "because", "agrees", "why"}


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: f"{figure.case.name}: {figure.what}")
def test_the_figure_agrees_with_what_the_case_says(figure: Figure) -> None:
    assert figure.found == figure.agrees, (figure.printed, figure.jointplay, figure.method, figure.tolerance)


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: f"{figure.case.name}: {figure.what}")
def test_what_is_not_plain_rounding_has_its_reason(figure: Figure) -> None:
    assert set(figure.raw) <= KEYS
    assert figure.agrees in AGREES
    assert ("within" in figure.raw) == ("because" in figure.raw)
    assert ("why" in figure.raw) == (figure.agrees not in ("jointplay", "both"))


@pytest.mark.parametrize("case", cases().values(), ids=lambda case: case.name)
def test_the_case_says_where_its_figures_were_read(case: Case) -> None:
    for key in ("title", "source", "place", "read"):
        assert len(str(case.raw[key])) > 3, key


def test_every_file_belongs_to_a_case() -> None:
    written = " ".join(file.read_text(encoding="utf-8") for file in FOLDER.glob("*.toml"))
    for table in FOLDER.glob("*.csv"):
        assert f"tests/published/{table.name}" in written


def test_another_last_digit_is_seen() -> None:
    """Every figure that agrees with jointplay would not, if one printed digit were another."""
    for figure in figures():
        if figure.agrees != "jointplay" or not isinstance(figure.raw["printed"], list):
            continue
        unit = 10.0**-figure.decimals
        wrong = [f"{value + 2.0 * unit:.{figure.decimals}f}" for value in figure.printed]
        assert replace(figure, raw=figure.raw | {"printed": wrong}).found == "neither", figure.what


def test_the_page_has_every_case_and_every_figure() -> None:
    assert [source["case"] for source in FOUND["sources"]] == list(cases()), (
        "python tests/verify_examples.py --published writes them again"
    )
    exact = ("case", "figure", "unit", "numbers", "printed", "tolerance", "agrees", "remark")
    for row, figure in zip(FOUND["published"], figures(), strict=True):
        now = shown(figure)
        assert [row[key] for key in exact] == [now[key] for key in exact]
        assert (row["difference"] <= row["tolerance"]) == (figure.agrees in ("jointplay", "both")), row
        # The last digits of a computer are its own.
        assert float(row["jointplay"]) == pytest.approx(
            float(now["jointplay"]), abs=1.1 * 10.0 ** -(figure.decimals + 2)
        )
