"""Reports: what stands on the page, that nothing of a file can act there, and what a browser makes of it."""

from __future__ import annotations

import base64
import functools
import html
import json
import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from browser import BROWSER, needs_browser
from jointplay import cli, examples
from jointplay.errors import InputError

#: few specimens: only whether they stand on the page is looked at
FEW = 256
NAMES = ("four-bar", "slider-crank-cases", "planetary-gear", "antenna-support", "delta-by-hand")


def page(m: jp.Mechanism, folder: Path) -> str:
    path = folder / "page.html"
    jp.report(m, path, samples=FEW)
    return path.read_text(encoding="utf-8")


@functools.cache
def of_example(name: str) -> str:
    """The page of a bundled example."""
    with tempfile.TemporaryDirectory() as folder:
        return page(jp.loads(examples.text(name)), Path(folder))


def scenes(text: str) -> list[dict[str, Any]]:
    """The drawings of a page."""
    return [json.loads(part) for part in re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)]


def headings(text: str) -> list[str]:
    return [html.unescape(words) for words in re.findall(r"<h[23]>(.*?)</h[23]>", text)]


@pytest.mark.parametrize("name", NAMES)
def test_a_page_has_what_its_reader_asks(name: str) -> None:
    m = jp.loads(examples.text(name))
    text = of_example(name)
    found = headings(text)
    for title in ("Verdict", "The mechanism", "Errors along the path", "Which source is to blame"):
        assert found.count(title) == max(1, len(m.outputs))
    assert ("Assembly" in found) == (m.assembly is not None)
    assert found[-1] == "Inputs and assumptions"
    assert len(scenes(text)) == max(1, len(m.outputs))
    # Opened from an attachment nothing is fetched: all that is referred to is within the page.
    assert re.findall(r'(?:src|href)="(?!data:|#)[^"]*"', text) == []
    assert "@import" not in text
    assert "url(" not in text
    assert len(text) < 6_000_000
    for picture in re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', text):
        assert base64.b64decode(picture).startswith(b"<?xml")


def test_numbers_of_the_page_are_those_of_the_results() -> None:
    m = jp.loads(examples.text("four-bar"))
    text = of_example("four-bar")
    worst, region = jp.worst(m), jp.region(m)
    (drawn,) = scenes(text)
    # Four digits of the largest are kept.
    step = 1e-4 * float(np.abs(region.region).max())
    np.testing.assert_allclose(np.array(drawn["region"]), region.region, atol=step)
    output = jp.solve(m).nominal.sel(component=["x", "y"])
    np.testing.assert_allclose(np.array(drawn["path"]), output, atol=1e-5 * drawn["extent"])
    places, k = np.array(drawn["places"], dtype=float), drawn["output"]
    np.testing.assert_allclose(places[:, k], output, atol=1e-5 * drawn["extent"])
    states = {state["label"]: np.array(state["moves"], dtype=float) for state in drawn["states"]}
    moved = np.linalg.norm(states["at the largest position error"][:, k], axis=1)
    np.testing.assert_allclose(moved, worst.worst_position, atol=1e-3 * float(worst.worst_position.max()))
    loaded = jp.loaded(m).error.sel(component=["x", "y"])
    np.testing.assert_allclose(states["under load"][:, k], loaded, atol=1e-3 * float(np.abs(loaded).max()))
    assert f"{float(worst.worst_position.max()):.4g} mm" in text
    table = base64.b64decode(re.findall(r'download="worst.csv" href="[^,]*,([^"]*)"', text)[0]).decode()
    rows = [line for line in table.splitlines() if line.startswith("worst_position,")]
    np.testing.assert_allclose([float(re.findall(r",([\d.]+),,mm", row)[0]) for row in rows], worst.worst_position)


def test_what_moves_in_the_drawing_are_the_bodies() -> None:
    """Lengths between two points of one body are the same in every configuration, and displaced ones nearly so."""
    from jointplay.analyses.nominal import nominal
    from jointplay.viewer import scene

    for name in ("excavator", "3-upu", "planetary-gear", "rack-slider", "ball-screw", "belt-arm"):
        m = jp.loads(examples.text(name)).first
        drawn = scene(m, nominal(m))
        places = np.array(drawn["places"], dtype=float)
        for shape in drawn["shapes"]:
            if shape["kind"] in ("body", "box", "wheel"):
                sides = np.linalg.norm(np.diff(places[:, shape["points"]], axis=1), axis=2)
                np.testing.assert_allclose(sides, sides[:1].repeat(len(sides), axis=0), atol=3e-5 * drawn["extent"])


def test_a_body_with_three_joints_on_one_line_is_a_line() -> None:
    """It was a dot."""
    from jointplay.analyses.nominal import nominal
    from jointplay.viewer import scene

    m = jp.loads(examples.text("four-bar")).with_({"output.body": "coupler", "output.at": [40.0, 0.0]})
    (coupler,) = (s for s in scene(m, nominal(m))["shapes"] if s["kind"] == "body" and s["name"] == "coupler")
    assert len(coupler["points"]) == 2
    assert m.core_spec["output"]["point"] not in coupler["points"]


def test_texts_of_a_file_stay_texts(tmp_path: Path) -> None:
    evil = "</script><script>document.title = 1</script><img src=x onerror=alert(1)>"
    text = examples.text("four-bar").replace("4R four-bar linkage, rotary drive (Jaiswal et al.)", evil)
    text = re.sub(r'"?\bcoupler\b"?', "'<b>&amp;'", text)
    written = page(jp.loads(text), tmp_path)
    assert "<img src=x" not in written
    assert "<b>" not in written
    assert "</script><script>document" not in written
    # The drawings and the program of the page.
    assert written.count("<script") == 2


def test_a_changed_mechanism_is_printed_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text("# my remark\n" + examples.text("four-bar"), encoding="utf-8")
    m = jp.load(path)
    assert "# my remark" in page(m, tmp_path)
    changed = page(m.with_({"joints.J1.clearance.radial": 0.123}), tmp_path)
    assert "# my remark" in changed
    assert "radial = 0.123" in changed


def test_what_cannot_be_asked_is_said_with_its_reason() -> None:
    text = of_example("delta-by-hand")
    assert "What was not asked" in headings(text)
    assert re.search(r"<dt>allow</dt><dd>[^<]*limits", text)


def test_wrong_places_are_refused_before_the_work(tmp_path: Path) -> None:
    m = jp.loads(examples.text("four-bar"))
    with pytest.raises(InputError, match=r"reports are written as \.html, \.pdf"):
        jp.report(m, tmp_path / "page.txt")
    with pytest.raises(InputError, match="there is no folder"):
        jp.report(m, tmp_path / "nowhere" / "page.html")
    assert list(tmp_path.iterdir()) == []


def test_a_mechanism_without_a_pose_has_no_report(tmp_path: Path) -> None:
    m = jp.loads(examples.text("four-bar", {"joints.J2.on.crank": "[500, 0]"}))
    with pytest.raises(InputError, match="no configuration can be assembled"):
        jp.report(m, tmp_path / "page.html")
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_it_and_says_how_to_do_it_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("four-bar.toml").write_text(examples.text("four-bar"), encoding="utf-8")
    arguments = ["report", "four-bar.toml", "--samples", "256", "--set", "limits.position=1"]
    monkeypatch.setattr("sys.argv", ["jointplay", *arguments])
    assert cli.run(arguments) == 1  # the limit is missed
    assert capsys.readouterr().out == "wrote four-bar.html\n"
    text = Path("four-bar.html").read_text(encoding="utf-8")
    assert "jointplay report four-bar.toml --samples 256 --set limits.position=1" in html.unescape(text)
    assert cli.run(["report", "four-bar.toml", "-o", "page.md"]) == 2
    assert "reports are written as .html, .pdf" in capsys.readouterr().err


def test_a_notebook_shows_the_drawing_by_itself() -> None:
    m = jp.loads(examples.text("four-bar"))
    shown = jp.view(m)._repr_html_()
    inner = html.unescape(re.findall(r'srcdoc="([^"]*)"', shown)[0])
    (drawn,) = scenes(inner)
    assert [state["label"] for state in drawn["states"]] == ["under load", "at the largest position error"]
    assert "export function view" in inner


@needs_browser
class TestInABrowser:
    """What the page is for those who open it."""

    def opened(self, path: Path, *options: str) -> str:
        """The page after its programs have run, and what they complained of."""
        assert BROWSER is not None
        common = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--virtual-time-budget=2000",
        ]
        profile = f"--user-data-dir={path.parent / 'profile'}"
        command = [BROWSER, *common, profile, *options, path.as_uri()]
        done = subprocess.run(command, capture_output=True, timeout=120, check=True)
        complaints = [line for line in done.stderr.decode(errors="replace").splitlines() if "CONSOLE" in line]
        assert complaints == []
        return done.stdout.decode()

    @pytest.mark.parametrize("name", ["four-bar", "planetary-gear", "delta-by-hand"])
    def test_the_mechanism_is_drawn(self, name: str, tmp_path: Path) -> None:
        (tmp_path / "page.html").write_text(of_example(name), encoding="utf-8")
        seen = self.opened(tmp_path / "page.html", "--dump-dom")
        drawing = re.findall(r"<svg viewBox.*?</svg>", seen, re.DOTALL)[0]
        assert drawing.count("jp-body") >= 1
        assert 'class="jp-region"' in drawing
        assert "NaN" not in drawing
        assert len(re.findall(r"<text ", drawing)) >= 3

    def test_it_prints(self, tmp_path: Path) -> None:
        path = tmp_path / "page.pdf"
        jp.report(jp.loads(examples.text("four-bar")), path, samples=FEW)
        assert path.read_bytes().startswith(b"%PDF")
        assert list(tmp_path.iterdir()) == [path]
