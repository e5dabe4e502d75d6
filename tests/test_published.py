"""Published figures: each agrees with what its case says within its printed digits, and the page lists all of them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from verification.page import PAGE
from verification.record import AGREES, FOLDER, Case, Figure, cases, figures
from verification.record_page import read, read_sources

TEXT = PAGE.read_text(encoding="utf-8")
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
    assert read_sources(TEXT) == list(cases()), "python tests/verify_examples.py --published writes the section again"
    on_page = [(row["case"], row["figure"], row["unit"], row["tolerance"], row["remark"]) for row in read(TEXT)]
    wanted = [(f.case.name, f.what, f.raw["unit"], f"{f.tolerance:g}", f.remark) for f in figures()]
    assert on_page == wanted


def test_the_rows_of_the_page_are_those_of_the_cases() -> None:
    for row, figure in zip(read(TEXT), figures(), strict=True):
        close = float(row["difference"]) <= float(row["tolerance"])
        assert close == (figure.agrees in ("jointplay", "both")), row
        assert int(row["numbers"]) == figure.printed.size
        assert row["printed"] in figure.texts
        # The page rounds, and the last digits of a computer are its own.
        assert abs(float(row["jointplay"]) - float(row["printed"])) == pytest.approx(
            figure.off(figure.jointplay), abs=0.51 * 10.0 ** -(figure.decimals + 2)
        )
