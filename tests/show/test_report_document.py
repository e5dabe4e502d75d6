"""The report as a document: who signs it, what it was compared with, what is to be ordered, and how it is printed."""

import html
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import jointplay as jp
from helpers.browser import needs_browser, opened
from helpers.builders import planar
from jointplay import cli, examples
from jointplay.analyses import ordering
from jointplay.errors import InputError
from jointplay.show.reporting import decimals, figures, former, printing, signing
from verify_reports import FEW, files

SIGNED = {"document": {"author": "A. Meier", "revision": "B", "date": "2026-11-28", "checked_by": "Ch. Ng"}}
PRESS = jp.loads(examples.text("press"), "press.toml").with_({"drives.angle.count": 2, **SIGNED})


def written(m: jp.Mechanism, folder: Path, **options: object) -> str:
    path = folder / "page.html"
    jp.report(m, path, samples=FEW, **options)
    return path.read_text(encoding="utf-8")


@pytest.fixture(autouse=True, scope="module")
def _no_pictures() -> Iterator[None]:
    """Drawing them takes most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "svg", lambda figure: "data:,")
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, _no_pictures: None) -> Path:
    """Where a report is."""
    path = tmp_path_factory.mktemp("report")
    written(PRESS, path, paper="letter")
    return path


def text_of(page: str) -> str:
    body = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]*>", "\n", body))


def test_the_hash_is_that_of_the_mechanism_whoever_signs() -> None:
    """Approving what has a hash gave it another one."""
    approved = PRESS.with_({"document.approved_by": "B. Oss"})
    assert approved != PRESS
    assert approved.hash == PRESS.hash == PRESS.with_({"document": None}).hash
    assert PRESS.with_({"limits.position": 0.3}).hash != PRESS.hash
    assert jp.loads(PRESS.complete_text).raw == PRESS.raw


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"author": "A\nB"}, "one line without control characters"),
        ({"revision": "x" * 201}, "at most 200 letters, not 201"),
        ({"author": ["A"]}, "a text in quotes is needed"),
        ({"autor": "A"}, "did you mean 'author'"),
    ],
)
def test_what_is_no_entry_is_refused(entry: Mapping[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        PRESS.with_({"document": entry})


def test_numbers_and_dates_need_no_quotes() -> None:
    text = examples.text("press") + "\n[document]\nrevision = 2\ndate = 2026-11-28\n"
    m = jp.loads(text)
    assert m.data.document is not None
    assert (m.data.document.revision, m.data.document.date) == ("2", "2026-11-28")
    assert m.complete_text == text
    b = planar()
    b.document(author="A. Meier")


def test_a_page_says_who_answers_for_it(folder: Path) -> None:
    page = (folder / "page.html").read_text(encoding="utf-8")
    told = text_of(page.partition("<nav>")[0])
    for words in ("A. Meier", "Ch. Ng", "Approved by", "Signature", f"press.toml, {PRESS.hash}"):
        assert words in told
    # The verdict comes first, and each says what it assumes.
    assert page.index("</h1>") < page.index('<p class="answer">') < page.index("A. Meier")
    assert page.count("Assumed: ") == 3
    assert signing.quoted("Crank press with fits and costs, revision B") in page


def test_entries_stay_texts(tmp_path: Path) -> None:
    evil = '</style></title><script>alert(1)</script>"; } body { display: none'
    entry = dict.fromkeys(("title", "author", "revision", "date", "checked_by", "approved_by"), evil)
    page = written(PRESS.with_({"document": entry}), tmp_path, decimal=",")
    assert "<script>alert" not in page
    # One drawing and the program; the style is as long as its own.
    assert page.count("<script") == 2
    assert page.count("</style>") == 1
    assert "body { display: none" not in re.findall(r"<style>(.*?)</style>", page, re.DOTALL)[0]


def test_what_has_changed_since_a_former_report(folder: Path, tmp_path: Path) -> None:
    old = folder / "page.html"
    looser = PRESS.with_({"joints.main.clearance.fit": "H8/f7", "limits.position": 0.1, "document.revision": "C"})
    page = written(looser, tmp_path, against=old)
    told = text_of(page)
    assert f"2026-11-28, revision B, mechanism {PRESS.hash}; this one of mechanism {looser.hash}" in told
    before, now = former.read(old), former.read(tmp_path / "page.html")
    assert former.changed_keys(before.raw, now.raw).columns[0].cells == ("joints.main.clearance.fit", "limits.position")
    assert before.record is not None
    assert now.record is not None
    assert [one.outcome for one in before.record.judgements] == ["held", "held", "not shown"]
    assert now.record.judgements[0].outcome == "missed"
    table = former.changed_answers(before.record, now.record)
    cells = {column.name: column.cells[0] for column in table.columns}
    errors = [float(jp.worst(m).worst_position.max()) for m in (PRESS, looser)]
    assert cells["position\nbefore"] == f"{errors[0]:.4g} mm"
    assert cells["position\nchange"] == f"{100 * (errors[1] / errors[0] - 1):+.3g} %"
    # A page of before records has its file, and nothing else to compare.
    page = re.sub(r"<meta name=\"jointplay-report\"[^>]*>", "", old.read_text(encoding="utf-8"))
    (tmp_path / "older.html").write_text(page, encoding="utf-8")
    found = former.read(tmp_path / "older.html")
    assert found.record is None
    assert found.raw == PRESS.raw


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "there is no such file"),
        ("<html></html>", "is no report"),
        ("<pre>a = [</pre>", "is no report"),
        ('<meta name="jointplay-report" content="{}"><pre>a = 1</pre>', "damaged"),
    ],
)
def test_what_is_no_former_report_is_refused(
    content: str | None, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("press.toml").write_text(examples.text("press"), encoding="utf-8")
    if content is not None:
        Path("old.html").write_text(content, encoding="utf-8")
    assert cli.run(["report", "press.toml", "--against", "old.html"]) == 2
    assert capsys.readouterr().err.startswith("error: old.html: ")
    assert not Path("press.html").exists()
    with pytest.raises(InputError, match=said):
        former.read(Path("old.html"))


def test_sizes_to_order_are_those_of_the_standard() -> None:
    """H7 of 60 is 0 to +30 um, g6 is -29 to -10 um (ISO 286-2); costs are the formulas of the file."""
    table = ordering.table(PRESS)
    assert table is not None
    rows = [*zip(*(column.cells for column in table.columns), strict=True)]
    assert rows[0] == ("main", "hole", "H7/g6 of 60", "60", "0", "+0.03", "24.00")
    assert rows[1] == ("", "pin", "", "60", "-0.029", "-0.01", "")
    assert rows[-2] == ("guide", "gap", "", "0.02", "–", "–", "18.50")
    assert rows[-1][:1] + rows[-1][4:] == ("rod_length", "-0.02", "+0.02", "12.99")
    total = 24 + 21 + 16 + (6 + 0.25 / 0.02) + (4 + 20 * math.exp(-40 * 0.02))
    assert f"All together cost {total:.2f}." in table.notes
    none = ordering.table(PRESS.with_({"costs": None}))
    assert none is not None
    assert "cost" not in [column.name for column in none.columns]
    warm = jp.loads(examples.text("four-bar")).with_({"temperature": {"tolerance": 5.0}, "expansion": 1e-5})
    assert "temperature" in ordering.table(warm).columns[0].cells


def test_a_decimal_comma_is_in_all_that_the_program_says(tmp_path: Path) -> None:
    m = PRESS.with_({"document.title": "Press 2.5"})
    page = written(m, tmp_path, decimal=",")
    shown = re.sub(r'<(?:(script|style|title)\b|(\w+) translate="no").*?</(?:\1|\2)>', "", page, flags=re.DOTALL)
    assert re.findall(r"[^\s>]*\d\.\d[^\s<]*", text_of(shown)) == []
    assert '<h1 translate="no">Press 2.5</h1>' in page
    assert html.escape(m.complete_text) in page
    value = f"{float(jp.worst(m).worst_position.max()):.4g}".replace(".", ",")
    assert f"The largest possible position error is {value} mm" in page
    (worst,) = files(page, "worst.csv")
    assert ";" in worst.columns[0]


def test_figures_have_a_decimal_comma() -> None:
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([0.0, 0.5], [0.25, 0.75], label="0.5 mm")
    axes.set_title("Press 2.5")
    axes.legend()
    with decimals.using(","):
        figures.with_sign(figure)
        figure.draw_without_rendering()
        ticks = [text.get_text() for text in (*axes.get_xticklabels(), *axes.get_yticklabels())]
    assert "0,4" in ticks
    assert not any("." in text for text in ticks)
    assert axes.get_legend().get_texts()[0].get_text() == "0,5 mm"
    assert axes.get_title() == "Press 2.5"


@needs_browser
class TestOnPaper:
    """What is printed."""

    def test_no_table_is_wider_than_the_sheet(self, folder: Path, tmp_path: Path) -> None:
        """Values of the table of `random` were cut at the right edge."""
        with opened(tmp_path / "profile") as browser:
            page = browser.page((folder / "page.html").as_uri(), width=1280)
            page.run("dispatchEvent(new Event('beforeprint'))")
            page.ask("Emulation.setEmulatedMedia", media="print")
            # 182 mm are 688 pixels.
            page.ask("Emulation.setDeviceMetricsOverride", width=688, height=900, deviceScaleFactor=1, mobile=False)
            wide = "Math.max(...[...document.querySelectorAll('table')].map((t) => t.getBoundingClientRect().right))"
            assert 600.0 < page.run(wide) <= 688.0
            assert page.run("document.documentElement.scrollWidth") <= 688
            assert page.run("getComputedStyle(document.querySelector('.viewer')).display") == "none"

    @pytest.mark.parametrize(("paper", "box"), [("a4", (594.96, 841.92)), ("letter", (612.0, 792.0))])
    def test_sheets_have_their_size(self, paper: str, box: tuple[float, float], folder: Path) -> None:
        page = (folder / "page.html").read_text(encoding="utf-8")
        assert page.count("size: letter;") == 1
        printed = printing.pdf(page.replace("size: letter;", f"size: {paper};"))
        found = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", printed)
        assert found
        assert all(tuple(map(float, one)) == pytest.approx(box, abs=0.5) for one in found)


def test_other_sheets_and_signs_are_refused(tmp_path: Path) -> None:
    for option, said in ({"paper": "a5"}, "a4, letter"), ({"decimal": "'"}, "a decimal sign"):
        with pytest.raises(InputError, match=said):
            jp.report(PRESS, tmp_path / "page.html", **option)
    assert list(tmp_path.iterdir()) == []
