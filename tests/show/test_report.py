"""Reports: what stands on the page, that nothing of a file can act there, and what a browser makes of it."""

import base64
import functools
import html
import io
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb

import jointplay as jp
from helpers.browser import needs_browser, opened
from jointplay import cli, examples
from jointplay.errors import InputError
from jointplay.plot.animation import motion_of
from jointplay.plot.words import MOST_TIMES
from jointplay.result import from_dataset
from jointplay.show.reporting.answers import IN_PLANE, thinned
from jointplay.show.reporting.figures import numbers
from verify_reports import FEW, column, files, in_browser, in_text, scenes

#: two outputs in three load cases, elastic members with an assembly, in space, strained; all of them: verify_reports.py
NAMES = ("four-bar", "slider-crank-cases", "antenna-support", "delta-by-hand", "redundant-bar")


def page(m: jp.Mechanism, folder: Path) -> str:
    path = folder / "page.html"
    jp.report(m, path, samples=FEW)
    return path.read_text(encoding="utf-8")


@functools.cache
def of_example(name: str) -> str:
    """The page of a bundled example."""
    with tempfile.TemporaryDirectory() as folder:
        return page(jp.loads(examples.text(name)), Path(folder))


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
    # Opened from an attachment nothing is fetched, and its numbers are those of the questions.
    assert [*in_text(m, text)] == []


@pytest.mark.parametrize(("name", "limited"), [("four-bar-fits", ["y", "angle"]), ("press", ["angle"])])
def test_what_has_a_limit_is_drawn_with_it(
    name: str, limited: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of specimens, it was the position and the rotation alone, whatever had the limit."""
    drawn: dict[str, list[object]] = {"error": [], "histogram": []}

    def watch(kind: str) -> None:
        own = getattr(jp.plot, kind)

        def seen(results: Any, quantity: str = "position", *told: Any, **options: Any) -> Any:
            drawn[kind].append(quantity)
            return own(results, quantity, *told, **options)

        monkeypatch.setattr(jp.plot, kind, seen)

    for kind in drawn:
        watch(kind)
    page(jp.loads(examples.text(name)), tmp_path)
    for quantities in drawn.values():
        assert quantities[: 2 + len(limited)] == ["position", "rotation", *limited]


def test_numbers_of_the_page_are_those_of_the_results() -> None:
    m = jp.loads(examples.text("four-bar"))
    text = of_example("four-bar")
    worst, region = jp.worst(m), jp.region(m, directions=IN_PLANE)
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


def test_numbers_to_take_along_are_those_of_the_table() -> None:
    result = from_dataset(jp.worst(jp.loads(jp.examples.text("four-bar"))))
    text = numbers(result, ("worst_position", "worst_component", "status"))
    whole = jp.frame(result)
    some = whole[whole.variable.isin(["worst_position", "worst_component", "status"])]
    found = pd.read_csv(io.StringIO(text))
    assert [*found.columns] == [name for name in whole.columns if some[name].notna().any()]
    np.testing.assert_array_equal(found.value, some.value)


def test_a_map_is_where_the_file_has_a_grid(tmp_path: Path) -> None:
    m = jp.loads(examples.text("five-bar"))
    grid = {"x": {"from": -60, "to": 60, "count": 61}, "y": {"from": 120, "to": 200, "count": 41}}
    text = page(m.with_({"grid": grid, "limits": {"position": 0.1}}), tmp_path)
    assert "Map" in headings(text)
    assert "The grid of the file has 61 × 41 nodes; 39 × 38 of them are shown here" in html.unescape(text)
    (found,) = files(text, "map.csv")
    mapped = jp.map(m, grid={"x": sorted({*found.x.dropna()}), "y": sorted({*found.y.dropna()})}, details=False)
    np.testing.assert_allclose(column(found, "error"), mapped.error.values.ravel())
    assert "Map" not in headings(of_example("four-bar"))


@pytest.mark.parametrize(("name", "axis"), [("3-rrr", {"angle": [0, 5, 10]}), ("3-upu", {"z": [400, 420, 440]})])
def test_a_map_with_three_axes_has_slices(name: str, axis: dict[str, list[float]], tmp_path: Path) -> None:
    m = jp.loads(examples.text(name))
    text = page(m.with_({"grid": {"x": [-40, 0, 40], "y": [-40, 0, 40]} | axis}), tmp_path)
    pictures = re.findall(r'<img alt="Error over the grid of the file[^"]*" src="data:[^,]*,([^"]*)"', text)
    assert len(pictures) == 2
    assert "nodes; " not in text


@pytest.mark.parametrize(
    ("counts", "most", "left"),
    [((61, 41), 1500, (39, 38)), ((5, 7), 1500, (5, 7)), ((100, 3, 100), 1200, (20, 3, 20)), ((5000,), 1500, (1500,))],
)
def test_a_thinned_grid_keeps_its_ends(counts: tuple[int, ...], most: int, left: tuple[int, ...]) -> None:
    names = ("x", "y", "z")[: len(counts)]
    base = jp.loads(examples.text("3-upu"))
    ends = {"x": (-40, 40), "y": (-40, 40), "z": (400, 440)}
    grid = {
        name: {"from": ends[name][0], "to": ends[name][1], "count": n} for name, n in zip(names, counts, strict=True)
    }
    held = {name: ends[name][0] for name in ends if name not in names}
    found = thinned(base.with_({"grid": grid | held}), most)
    assert tuple(len(found[name]) for name in names) == left
    assert all((found[name][0], found[name][-1]) == ends[name] for name in names)
    assert {name: found[name] for name in held} == held


def test_every_load_case_has_its_compensation_and_its_sources() -> None:
    """Compensation was asked with those loads only that act in every case."""
    m = jp.loads(examples.text("slider-crank-cases"))
    text = of_example("slider-crank-cases")
    found = jp.compensate(m)
    tables = files(text, "compensation.csv")
    for table, output in zip(tables, m.outputs, strict=True):
        for case in m.load_cases:
            own = column(table[table.load_case == case], "correction")
            np.testing.assert_allclose(own, found.correction.sel(output=output, load_case=case).values.ravel())
    assert len(files(text, "contribution-loaded.csv")) == len(m.outputs) * len(m.load_cases)


def test_what_moves_in_the_drawing_are_the_bodies() -> None:
    """Lengths between two points of one body are the same in every configuration, and displaced ones nearly so."""
    from jointplay.analyses.nominal import nominal
    from jointplay.show.viewer import scene

    for name in ("excavator", "3-upu", "planetary-gear", "rack-slider", "ball-screw", "belt-arm"):
        m = jp.loads(examples.text(name)).first
        drawn = scene(m, nominal(m))
        places = np.array(drawn["places"], dtype=float)
        for shape in drawn["shapes"]:
            if shape["kind"] in ("body", "box", "wheel"):
                sides = np.linalg.norm(np.diff(places[:, shape["points"]], axis=1), axis=2)
                np.testing.assert_allclose(sides, sides[:1].repeat(len(sides), axis=0), atol=3e-5 * drawn["extent"])


def test_bodies_have_colours_for_light_and_dark_pages() -> None:
    """The eighth body was black on a page that is nearly black."""
    m = jp.loads(examples.text("3-upu"))
    (drawn,) = scenes(jp.view(m).html)
    for shape in drawn["shapes"]:
        if "colour" in shape:
            light, dark = (sum(to_rgb(shape[key])) / 3.0 for key in ("colour", "dark"))
            assert light < 0.9, shape
            assert dark > 0.25, shape


def test_a_body_with_three_joints_on_one_line_is_a_line() -> None:
    """It was a dot."""
    from jointplay.analyses.nominal import nominal
    from jointplay.show.viewer import scene

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


def test_the_smallest_clearance_of_all_is_drawn(tmp_path: Path) -> None:
    """A page with a clearance of 1e-320 was a traceback, and an animation asked for a factor that nobody had given."""
    text = re.sub("radial = [0-9.]+ }", "radial = 1e-320 }", examples.text("four-bar"))
    m = jp.loads(text).with_({"drives.theta1.values": [20.0, 30.0], "loads": None})
    found = re.search(r'"factor": ?([0-9.e+]+)', page(m, tmp_path))
    assert found is not None
    assert float(found[1]) <= MOST_TIMES
    assert motion_of(m, 2, None).times <= MOST_TIMES


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
    said = "wrote four-bar.html; a limit is missed or a configuration is not ok, as its verdict says\n"
    assert capsys.readouterr().out == said
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

    @pytest.mark.parametrize("name", ["four-bar", "delta-by-hand", "redundant-bar"])
    def test_nothing_is_wrong_with_it(self, name: str, tmp_path: Path) -> None:
        """`verify_reports.py` looks at those of all examples."""
        path = tmp_path / "page.html"
        path.write_text(of_example(name), encoding="utf-8")
        assert [*in_browser(path)] == []

    def test_outlines_are_drawn_through_the_pins_of_their_bodies(self, tmp_path: Path) -> None:
        """Corners at both pins of the crank, with errors as large as the page begins with."""
        m = jp.loads(examples.text("four-bar"))
        pins = [m.value(f"joints.{name}.on.crank") for name in ("J1", "J2")]
        path = tmp_path / "page.html"
        jp.report(m.with_({"bodies.crank.outline": [[*pins, [20, 30]]]}), path, samples=FEW)
        with opened(tmp_path / "profile") as browser:
            shown = browser.page(path.as_uri())
            shown.wait("document.querySelector('.jp-outline')")
            corners = re.findall(
                r"[ML]([\d.-]+) ([\d.-]+)", shown.run("document.querySelector('.jp-outline').getAttribute('d')")
            )
            circles = shown.run(
                "[...document.querySelectorAll('.jp-pin')].map((c) => [c.cx.baseVal.value, c.cy.baseVal.value])"
            )
        places = np.array(corners, dtype=float)
        assert np.hypot(*(np.array(circles) - places[0]).T).min() < 0.1
        # However errors are magnified, the triangle keeps its shape; a page looks down on it from above.
        sides, seen = ([*map(complex, *np.transpose(one))] for one in ([*pins, [20, 30]], places * [1, -1]))
        turned = (seen[2] - seen[0]) / (seen[1] - seen[0])
        assert abs(turned - (sides[2] - sides[0]) / (sides[1] - sides[0])) < 1e-3

    def test_what_is_wrong_is_found(self, tmp_path: Path) -> None:
        text = of_example("four-bar")
        wrong = {
            text.replace("</main>", '<img alt="" src="data:image/png;base64,AAAA"></main>'): "pictures",
            text.replace("</main>", '<img alt="" src="http://127.0.0.1:9/a.png"></main>'): "CONSOLE",
            text.replace("</body>", "<script>throw Error('x')</script></body>"): "CONSOLE",
        }
        for page, said in wrong.items():
            (tmp_path / "page.html").write_text(page, encoding="utf-8")
            assert any(said in one for one in in_browser(tmp_path / "page.html")), said

    def test_letters_of_all_figures_have_one_size_on_paper(self, tmp_path: Path) -> None:
        """Each was made as high as fits: single ones larger than those in rows, so that they left sheets empty."""
        path = tmp_path / "page.html"
        path.write_text(of_example("four-bar"), encoding="utf-8")
        with opened(tmp_path / "profile") as browser:
            shown = browser.page(path.as_uri(), width=1280)
            shown.wait("[...document.querySelectorAll('figure img')].every((i) => i.naturalWidth)")
            shown.run("dispatchEvent(new Event('beforeprint'))")
            shown.ask("Emulation.setEmulatedMedia", media="print")
            # 182 mm are 688 pixels.
            shown.ask("Emulation.setDeviceMetricsOverride", width=688, height=900, deviceScaleFactor=1, mobile=False)
            size = "(i) => [i.getBoundingClientRect().width, i.naturalWidth]"
            widths, own = np.transpose(shown.run(f"[...document.querySelectorAll('figure img')].map({size})"))
        assert len(own) > 8
        np.testing.assert_allclose(widths / own, 0.56, atol=0.01)

    def test_it_prints(self, tmp_path: Path) -> None:
        path = tmp_path / "page.pdf"
        jp.report(jp.loads(examples.text("four-bar")), path, samples=FEW)
        assert path.read_bytes().startswith(b"%PDF")
        assert list(tmp_path.iterdir()) == [path]
