"""Names in tables of text: what a spreadsheet would run as a formula has an apostrophe, numbers have none."""

import csv
import io
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointplay as jp
from helpers.fuzz.files import renamed
from jointplay.file.columns import Tables, as_cell, from_cell
from jointplay.result import from_dataset
from jointplay.show.reporting.figures import numbers

DRIVE, JOINT = "-q", "@HYPERLINK(A1,A2)"
NAMES = {"theta1": DRIVE, "J1": JOINT, "J2": "+J2", "J3": "@SUM(1)", "l2": "-2+3"}


def hostile() -> jp.Mechanism:
    """The four-bar with names that a spreadsheet would compute."""
    raw = tomllib.loads(jp.examples.text("four-bar", {"dimensions.l2.tolerance": "0.1"}))
    for old, new in NAMES.items():
        raw = renamed(raw, old, new)
    return jp.Mechanism(raw)


def dangerous(text: str) -> list[list[str]]:
    """Rows with a cell that a spreadsheet would run."""
    rows = [*csv.reader(io.StringIO(text))]
    return [row for row in rows if any(re.match(r"[=+\-@\t\r]", cell) and not is_number(cell) for cell in row)]


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@pytest.fixture(scope="module")
def worst() -> Any:
    return jp.worst(hostile())


@pytest.mark.parametrize("dialect", ["comma", "semicolon"])
def test_no_cell_of_a_result_is_a_formula(worst: Any, tmp_path: Path, dialect: str) -> None:
    """Opened in a spreadsheet, a file of somebody else's mechanism could fetch and send."""
    path = tmp_path / "r.csv"
    jp.save(worst, path, csv_dialect=dialect)
    text = path.read_text()
    assert f"'{DRIVE}" in text
    if dialect == "comma":
        assert dangerous(text) == []
    # Reading it back gives the names and the numbers.
    table = Tables(str(tmp_path / "m.toml"), "m.toml").beside("r.csv", "path.csv")
    assert DRIVE in table.header
    sources = {row[table.header.index("source")] for _, row in table.rows}
    assert {from_cell(name) for name in sources} >= {JOINT, "+J2", "@SUM(1)", "-2+3"}
    if dialect == "comma":
        values = [value for value in table.numbers("value", "k") if value < 0]
        assert len(values) > 50


def test_no_cell_of_the_numbers_of_a_report_is_a_formula(worst: Any) -> None:
    text = numbers(from_dataset(worst), ("worst_error", "contribution"))
    assert dangerous(text) == []
    assert f'"\'{JOINT}"' in text


def test_drives_are_read_from_a_table_that_a_spreadsheet_has_kept(tmp_path: Path) -> None:
    """The name of a column of numbers is that of the drive, with the apostrophe and without it."""
    path = tmp_path / "m.toml"
    hostile().with_({f"drives.{DRIVE}.values": [1.0]}).write(path)
    text = path.read_text()
    for name, header in (("a.csv", "'-q"), ("b.csv", "-q")):
        (tmp_path / name).write_text(f"{header}\n20\n'-1.5\n-3\n")
        path.write_text(text.replace("values = [1.0]", f'csv = "{name}"'))
        values = jp.load(path).drive_values
        assert values is not None
        assert (values[:, 0] * 180.0 / np.pi).round(9).tolist() == [20.0, -1.5, -3.0]


@given(st.text(st.sampled_from("'=+-@\t\ra1.,e"), max_size=6))
def test_reading_undoes_writing(text: str) -> None:
    assert from_cell(as_cell(text)) == text
    assert is_number(text.replace(",", ".")) or not re.match(r"[=+\-@\t\r]", as_cell(text)) or as_cell(text) == text
