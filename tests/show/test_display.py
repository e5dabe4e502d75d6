"""What a notebook shows of a mechanism: a drawing and tables, whatever the mechanism is, and never a traceback."""

import base64
import io
import re
import threading

import pytest

import jointplay as jp
from helpers.answers import EXAMPLES, example
from jointplay import examples
from jointplay.analyses.nominal import nominal
from jointplay.plot.style import settings
from jointplay.show import display
from jointplay.show.viewer.scene import scene


def pictures(shown: str) -> list[bytes]:
    return [base64.b64decode(part) for part in re.findall(r'src="data:image/png;base64,([^"]+)"', shown)]


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_shows_its_drawing_and_its_joints(name: str) -> None:
    from matplotlib.image import imread

    m = jp.loads(examples.text(name))
    shown = m._repr_html_()
    (content,) = pictures(shown)
    drawn = imread(io.BytesIO(content))[..., :3]
    assert drawn.std() > 0.02, "an empty picture"
    for joint in set(m.joints) - {m.joints[member.joint] for member in m.members}:
        assert f">{joint}</td>" in shown


def test_texts_of_the_file_stay_texts() -> None:
    m = jp.loads(examples.text("four-bar", {"title": '"<script>alert(1)</script>\\" onload=\\"x"'}))
    shown = m._repr_html_()
    assert "<script" not in shown
    assert '" onload=' not in shown
    assert "&lt;script&gt;alert(1)" in shown


def test_several_outputs_and_load_cases_are_one_picture() -> None:
    shown = jp.loads(examples.text("slider-crank-cases"))._repr_html_()
    assert len(pictures(shown)) == 1
    assert "face: position" in shown
    assert "pin: position" in shown


def test_what_cannot_be_assembled_is_drawn_with_its_gap() -> None:
    shown = jp.loads(examples.text("four-bar", {"joints.J2.on.crank": "[500, 0]"}))._repr_html_()
    assert len(pictures(shown)) == 1
    assert "It cannot be assembled." in shown


def test_what_cannot_be_drawn_says_why_beside_its_tables() -> None:
    shown = jp.loads(examples.text("four-bar", {"drives": "{}"}))._repr_html_()
    assert pictures(shown) == []
    assert "It cannot be drawn: &lt;text&gt;: drives: too few drives" in shown
    assert "<table" in shown


def test_without_matplotlib_there_are_the_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "WITHOUT", "drawing needs matplotlib")
    shown = jp.loads(examples.text("four-bar"))._repr_html_()
    assert pictures(shown) == []
    assert "drawing needs matplotlib" in shown
    assert ">J1</td>" in shown


def test_a_page_does_not_wait_for_a_figure() -> None:
    """While a report was drawn, no slider moved anything: colours of bodies were asked of a style in use."""
    m = example("four-bar")
    at, drawing, ends = nominal(m), threading.Event(), threading.Event()

    def draw() -> None:
        with settings({}):
            drawing.set()
            ends.wait()

    figure, page = threading.Thread(target=draw), threading.Thread(target=lambda: scene(m, at), daemon=True)
    figure.start()
    drawing.wait()
    page.start()
    page.join(20.0)
    is_waiting = page.is_alive()
    ends.set()
    figure.join()
    assert not is_waiting
