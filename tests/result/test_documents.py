"""What commands print, as documents, as a workbook and as a table of pandas."""

import html
import re
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

import jointplay as jp
from jointplay.cli import run

#: a name that means something everywhere
ODD = "a|b_c$<i>&\\"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("documents")
    text = jp.examples.text("four-bar").replace("[joints.J2]", "[joints.-J_2]").replace('"J2"', '"-J_2"')
    text = text.replace('title  = "4R', "title  = '" + ODD).replace('(Jaiswal et al.)"', "'")
    (place / "m.toml").write_text(text, encoding="utf-8")
    for kind in ("md", "tex", "html", "xlsx"):
        run(["error", str(place / "m.toml"), "-q", "worst", "-q", "loaded", "-o", str(place / f"r.{kind}")])
    return place


def printed():
    return jp.table(jp.worst(jp.loads(jp.examples.text("four-bar"))))


def test_table_has_the_numbers_of_the_result():
    found, result = printed(), jp.worst(jp.loads(jp.examples.text("four-bar")))
    np.testing.assert_allclose(found["position (mm)"], result.worst_position, atol=5e-4)
    assert found["#"].tolist() == list(range(11))
    assert found.attrs["answer"][0].startswith("Limits hold: position 3.848 mm of 4 mm")


def test_several_tables_stand_one_below_the_other():
    found = jp.table(jp.check(jp.loads(jp.examples.text("four-bar"))))
    titles = found.index.get_level_values("table").unique().tolist()
    assert titles[0] == "3 bodies, 4 joints"
    assert found.loc[titles[0], "joint"].tolist() == ["J1", "J2", "J3", "J4"]


def test_markdown(folder):
    lines = (folder / "r.md").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("# a\\|b\\_c$\\<i\\>&\\\\")
    rows = [re.split(r"(?<!\\)\|", line)[1:-1] for line in lines if line.startswith("| ")]
    assert {len(row) for row in rows} == {8}
    first = [row[2].strip() for row in rows if row[0].strip().isdecimal()]
    assert first[11:] == [f"{value:.3f}" for value in printed()["position (mm)"]]
    assert any("-J\\_2" in line for line in lines)


def test_latex(folder, tmp_path):
    text = (folder / "r.tex").read_text(encoding="utf-8")
    assert r"\section*{a|b\_c\$\textless{}i\textgreater{}\&\textbackslash{}" in text
    rows = [line for line in text.splitlines() if re.match(r"\d+ & ", line)]
    assert len(rows) == 22
    assert {len(re.split(r"(?<!\\)&", line)) for line in rows} == {8}
    if shutil.which("pdflatex"):
        whole = "\\documentclass{article}\\usepackage{booktabs,longtable}\\begin{document}" + text + "\\end{document}"
        (tmp_path / "d.tex").write_text(whole, encoding="utf-8")
        subprocess.run(["pdflatex", "-interaction=nonstopmode", "d.tex"], cwd=tmp_path, check=True, capture_output=True)


def test_html(folder):
    text = (folder / "r.html").read_text(encoding="utf-8")
    assert html.escape(ODD) in text
    assert "<i>" not in text
    assert text.count("<tr>") == 2 * (1 + 11)


def test_workbook(folder):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.load_workbook(folder / "r.xlsx")
    assert book.sheetnames[0] == "answer"
    assert [book.worksheets[k].auto_filter.ref for k in (1, 2)] == ["A1:H12", "A1:H12"]
    assert book.sheetnames[-1] == "mechanism"
    sentences = [row[1] for row in book["answer"].iter_rows(values_only=True)]
    assert "Limits hold under the load and in the worst case." in sentences
    found = pd.read_excel(folder / "r.xlsx", sheet_name=2)
    np.testing.assert_array_equal(found["position (mm)"], printed()["position (mm)"])
    kinds = {cell.data_type for sheet in book for row in sheet.iter_rows() for cell in row}
    assert "f" not in kinds
    assert jp.load(folder / "r.xlsx") == jp.load(folder / "m.toml")


def test_a_workbook_is_signed_and_has_sources_and_sizes(tmp_path, monkeypatch):
    openpyxl = pytest.importorskip("openpyxl")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.toml").write_text(jp.examples.text("press"), encoding="utf-8")
    run(
        [
            "error",
            "m.toml",
            "-q",
            "worst",
            "-s",
            "document.author=A. Meier",
            "-s",
            "document.revision=B",
            "-o",
            "r.xlsx",
        ]
    )
    book = openpyxl.load_workbook(tmp_path / "r.xlsx")
    rows = [[*row] for row in book["answer"].iter_rows(values_only=True)]
    assert [None, "name", "date", "signature"] in rows
    assert [row[0] for row in rows[-3:]] == ["author", "checked by", "approved by"]
    assert rows[-3][1] == "A. Meier"
    assert ["revision", "B", None, None] in rows
    for name in ("sources", "Sizes to order", "worst"):
        assert (book[name].freeze_panes, bool(book[name].auto_filter.ref)) == ("A2", True)
    found = pd.read_excel("r.xlsx", sheet_name="sources")
    whole = found[found["#"].notna()].groupby("#")["position (%)"].sum()
    np.testing.assert_allclose(whole, 100.0, atol=1.0)
    sizes = pd.read_excel("r.xlsx", sheet_name="Sizes to order")
    assert sizes["cost"].dropna().tolist() == [24.0, 21.0, 16.0, 18.5, 12.99]
    # Of Python it had everything but the sizes to order.
    m = jp.load("m.toml").with_({"document": {"author": "A. Meier", "revision": "B"}})
    jp.save(jp.worst(m), "python.xlsx")
    assert openpyxl.load_workbook("python.xlsx").sheetnames == book.sheetnames
    pd.testing.assert_frame_equal(pd.read_excel("python.xlsx", sheet_name="Sizes to order"), sizes)


@pytest.mark.parametrize(
    ("asked", "has_sources"),
    [
        (lambda m: jp.map(m, "worst", {"theta1": [30.0, 40.0]}), False),
        (lambda m: jp.sweep(m, "joints.*.clearance.radial", [0.1, 0.2]), False),
        (lambda m: jp.compare(m, m, names=("a", "b")), False),
        (lambda m: jp.random(m, samples=64), True),
    ],
    ids=["map", "sweep", "compare", "random"],
)
def test_a_workbook_of_python_has_shares_of_sources_over_configurations(tmp_path, asked, has_sources):
    """It never had: the text of the mechanism, an attribute there, was taken for a comparison of mechanisms."""
    jp.save(asked(jp.loads(jp.examples.text("four-bar"))), tmp_path / "r.xlsx")
    names = pytest.importorskip("openpyxl").load_workbook(tmp_path / "r.xlsx").sheetnames
    assert ("sources" in names) == has_sources
    assert "Sizes to order" in names


@pytest.mark.parametrize("asked", [jp.sensitivity, jp.region, lambda m: jp.worst(m).assign_attrs(question="a, b")])
def test_what_no_command_prints_has_a_workbook_of_its_values(tmp_path, asked):
    """It ended in an IndexError of openpyxl; as a document, a variable 'position' was missing."""
    result = asked(jp.loads(jp.examples.text("four-bar")))
    jp.save(result, tmp_path / "r.xlsx")
    names = pytest.importorskip("openpyxl").load_workbook(tmp_path / "r.xlsx").sheetnames
    assert {"answer", "Sizes to order", result.attrs["question"], "mechanism"} <= {*names}
    for write in (lambda: jp.save(result, tmp_path / "r.md"), lambda: jp.table(result)):
        with pytest.raises(jp.InputError, match=f"a table is of .*; this is of '{result.attrs['question']}'"):
            write()


def test_a_result_of_another_version_has_a_workbook(tmp_path):
    """Its text has keys that this version does not know."""
    result = jp.worst(jp.loads(jp.examples.text("four-bar"))).assign_attrs(mechanism="format = 1\nold = 1\n")
    jp.save(result, tmp_path / "r.xlsx")
    names = pytest.importorskip("openpyxl").load_workbook(tmp_path / "r.xlsx").sheetnames
    assert "answer" in names
    assert "Sizes to order" not in names


def test_several_questions_in_one_result_have_no_table(tmp_path):
    m = jp.loads(jp.examples.text("four-bar"))
    run(["new", "four-bar", "-o", str(tmp_path / "m.toml")])
    result = jp.worst(m).assign_attrs(question="loaded, worst")
    with pytest.raises(jp.InputError, match="a table is of one question; this is of 'loaded, worst'"):
        jp.table(result)


def test_mechanisms_without_limits_are_compared_with_one_that_misses_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("four-bar", "p3r", "four-bar-fits"):
        (tmp_path / f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")
    assert run(["compare", "four-bar.toml", "p3r.toml", "four-bar-fits.toml", "-o", "r.md"]) == 0
    heads = (tmp_path / "r.md").read_text(encoding="utf-8")
    assert "four-bar-fits beyond limit" in heads
    assert "p3r beyond limit" not in heads
