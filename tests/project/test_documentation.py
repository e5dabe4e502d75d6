"""What the build of the documentation makes: the gallery, the page of the notebook, formulas."""

import base64
import html
import io
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from helpers.hooks import hook
from jointplay import examples
from jointplay.show.reporting.printing import BROWSERS

pytest.importorskip("mkdocs", reason="the documentation is built with the group docs")
DOCS = Path(__file__).resolve().parents[2] / "docs"
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
#: says of the pictures of a page how wide they are, and of the drawings to play with how many bodies they have
LOOK = """
<script>
addEventListener("load", () => setTimeout(() => {
  const seen = [...document.images].map((image) => image.naturalWidth);
  const bodies = [...document.querySelectorAll("iframe")].map(
    (frame) => frame.contentDocument.querySelectorAll(".jp-body").length);
  document.body.innerHTML = `<pre>${JSON.stringify([seen, bodies])}</pre>`;
}, 500));
</script>
"""


class TestGallery:
    def test_every_bundled_example_is_there(self) -> None:
        rows = hook("gallery").rows((DOCS / "examples.md").read_text(encoding="utf-8"))
        assert sorted(row.name for row in rows) == sorted(examples.names())

    @pytest.mark.parametrize("name", ["four-bar", "slider-crank-cases", "3-upu", "redundant-bar"])
    def test_an_example_has_its_drawing_its_answer_its_command_and_its_file(self, name: str) -> None:
        from matplotlib.image import imread

        gallery = hook("gallery")
        (row,) = [r for r in gallery.rows((DOCS / "examples.md").read_text(encoding="utf-8")) if r.name == name]
        for style in gallery.STYLES:
            drawn = imread(io.BytesIO(gallery.drawing(name, style)))[..., :3]
            assert drawn.std() > 0.02, "an empty picture"
        card, page = gallery.card(row), gallery.page(row)
        assert re.search(r"(Limits hold|Limit missed|Largest position error|Output .*):? .* mm", card)
        assert f"`jointplay error {name}.toml -q worst`" in card
        assert f"(examples/{name}.md#the-file)" in card
        assert examples.text(name).rstrip() in page
        assert "export function view" in gallery.view(name)

    def test_a_missing_example_stops_the_build(self) -> None:
        from mkdocs.exceptions import PluginError
        from mkdocs.structure.files import File, Files

        text = (DOCS / "examples.md").read_text(encoding="utf-8").replace("| `bennett` |", "| `benet` |")
        config: Any = {"docs_dir": "", "site_dir": "", "use_directory_urls": True}
        source = File("examples.md", "", "", True)
        source.content_string = text
        with pytest.raises(PluginError, match="differ: benet, bennett"):
            hook("gallery").on_files(Files([source]), config)

    def test_names_are_no_markup(self) -> None:
        assert hook("gallery").plain("a_b *c* <d> $e$") == r"a\_b \*c\* \<d\> \$e\$"


def test_the_glossary_is_in_order() -> None:
    words = re.findall(r"^## (.*)$", (DOCS / "glossary.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(words) > 40
    assert words == sorted(words, key=str.casefold)


class TestFormulas:
    def test_they_become_mathml(self) -> None:
        page: Any = None
        done = hook("formulas").on_page_content(r'a <span class="arithmatex">\(u &lt; h\)</span>', page)
        assert done == "a <math><mi>u</mi><mo>&lt;</mo><mi>h</mi></math>"

    def test_what_is_no_latex_stops_the_build(self) -> None:
        from mkdocs.exceptions import PluginError
        from mkdocs.structure.files import File
        from mkdocs.structure.pages import Page

        config: Any = {"docs_dir": "", "site_dir": "", "use_directory_urls": True, "site_url": "", "edit_uri": ""}
        page = Page(None, File("theory.md", "", "", True), config)
        with pytest.raises(PluginError, match=r"theory.md: \\fraction"):
            hook("formulas").on_page_content(r'<div class="arithmatex">\[\fraction{a}{b}\]</div>', page)


@pytest.fixture(scope="module")
def executed() -> Any:
    """The notebook with what its cells show."""
    return hook("notebook").executed((DOCS / "notebook.ipynb").read_text(encoding="utf-8"))


@pytest.fixture
def outputs(executed: Any) -> dict[str, list[Any]]:
    """What the cells of the notebook show, by the last line of their code."""
    return {cell.source.splitlines()[-1]: cell.outputs for cell in executed.cells if cell.cell_type == "code"}


class TestNotebook:
    def test_it_is_kept_without_outputs(self) -> None:
        cells = json.loads((DOCS / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)

    def test_figures_appear_without_more_ado(self, outputs: dict[str, list[Any]]) -> None:
        from matplotlib.image import imread

        figures = [shown for line, shown in outputs.items() if line.startswith("jp.plot.")]
        assert len(figures) == 3
        for (output,) in figures:
            drawn = imread(io.BytesIO(base64.b64decode(output.data["image/png"])))[..., :3]
            assert drawn.std() > 0.02, "an empty picture"

    def test_what_it_says_is_what_its_cells_show(self, outputs: dict[str, list[Any]]) -> None:
        text = (DOCS / "notebook.ipynb").read_text(encoding="utf-8")
        (margins,) = outputs["worst.margin.to_pandas().round(4)"]
        assert "-0.0358" in margins.data["text/plain"]
        assert "up to 0.036 mm of the position" in text
        (fits,) = outputs["pd.DataFrame(rows).T"]
        cells = [re.findall(r"<t[hd]>(.*?)</t[hd]>", row) for row in fits.data["text/html"].split("<tr>")]
        found = {row[0]: (row[2], row[3]) for row in cells if len(row) == 4}
        assert found["H8/f7"] == ("False", "62.8")
        assert found["H7/g6"] == ("True", "100.0")
        assert "**H7/g6 in all four pins.**" in text
        assert "With H8/f7 only 63 % of the specimens" in text

    def test_its_page_has_all_that_the_cells_show(self, executed: Any) -> None:
        markdown, pictures = hook("notebook").page(executed, "notebook")
        assert len(pictures) == 3
        assert [f"(notebook-{k}.png)" in markdown for k in (1, 2, 3)] == [True] * 3
        assert "<iframe" in markdown
        assert "data:image/png;base64," in markdown

    def test_the_printer_is_calibrated(self) -> None:
        """What the text says of the probe is what its cells show; the last cell says what is left."""
        text = (DOCS / "printer.ipynb").read_text(encoding="utf-8")
        cells = json.loads(text)["cells"]
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
        said = [output for cell in hook("notebook").executed(text).cells for output in cell.get("outputs", ())]
        shown = "\n".join(output.get("text", "") + output.get("data", {}).get("text/plain", "") for output in said)
        assert "Heights are good to 0.006 mm, places in the plane only to 0.11 mm" in text
        assert re.search(r"x +0\.107\d\ny +0\.107\d\nz +0\.005\d", shown)
        assert "tower 1: end stop +0.479, rod -0.168, radius +0.292 mm, angle +0.0097 deg" in shown

    def test_a_cell_that_fails_stops_the_build(self) -> None:
        import nbformat
        from mkdocs.exceptions import PluginError

        cell = nbformat.v4.new_code_cell("1 / 0")
        with pytest.raises(PluginError, match="ZeroDivisionError"):
            hook("notebook").executed(nbformat.writes(nbformat.v4.new_notebook(cells=[cell])))

    @pytest.mark.skipif(
        BROWSER is None and "JOINTPLAY_NEEDS_BROWSER" not in os.environ,
        reason="no Chromium, Chrome or Edge is installed",
    )
    def test_a_browser_shows_its_drawings(self, outputs: dict[str, list[Any]], tmp_path: Path) -> None:
        assert BROWSER is not None
        shown = [output.data["text/html"] for line in ("m", "jp.view(m)") for output in outputs[line]]
        path = tmp_path / "page.html"
        path.write_text(f"<!DOCTYPE html><body>{''.join(shown)}{LOOK}</body>", encoding="utf-8")
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=4000", "--dump-dom"]
        command = [BROWSER, *options, f"--user-data-dir={tmp_path / 'profile'}", path.as_uri()]
        seen = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
        images, bodies = json.loads(html.unescape(re.findall(r"<pre>(.*?)</pre>", seen)[0]))
        assert len(images) == 1
        assert images[0] > 600
        assert len(bodies) == 1
        assert bodies[0] >= 3
