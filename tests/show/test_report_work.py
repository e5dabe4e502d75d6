"""What a report costs, counted and not timed: how often its figures are measured and drawn."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.transforms import Bbox

import jointplay as jp
from jointplay.analyses import allow, loaded
from jointplay.analyses.nominal import nominal
from jointplay.errors import listed
from jointplay.plot.style import USUAL_STYLE, LayoutEngine, escape_texts, using
from jointplay.plot.ticks import once, subplot
from jointplay.show.reporting import answers, sections
from jointplay.show.reporting.answers import Chapter
from verify_reports import FEW

#: part of a figure by which one layout may differ from the other: a pixel of its shorter side
PIXEL = 1.0 / 288.0


def counted(monkeypatch: pytest.MonkeyPatch, counts: Counter[str], owner: type, name: str) -> None:
    """Count the calls of a method."""
    own = getattr(owner, name)

    def call(*args: Any, **options: Any) -> Any:
        counts[name] += 1
        return own(*args, **options)

    monkeypatch.setattr(owner, name, call)


def test_a_figure_of_a_report_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every figure had a renderer for its layout and another one for its drawing, and was measured twice."""
    counts: Counter[str] = Counter()
    counted(monkeypatch, counts, RendererSVG, "__init__")
    counted(monkeypatch, counts, Axes, "get_tightbbox")
    counted(monkeypatch, counts, Axis, "_copy_tick_props")
    path = tmp_path / "page.html"
    jp.report(jp.loads(jp.examples.text("four-bar")), path, samples=FEW)
    images = len(re.findall(r"<img ", path.read_text(encoding="utf-8")))
    assert images == 15
    assert counts["__init__"] == images
    # Twice what has texts in it; all others once.
    assert counts["get_tightbbox"] <= 29
    # All axes draw theirs at once.
    assert not counts["_copy_tick_props"]


def lines(figure: Figure, top: float) -> Axes:
    """Axes with a curve and a legend."""
    axes = figure.add_subplot()
    axes.plot([0.0, 90.0, 360.0], [0.0, top, 0.5 * top], label="largest")
    axes.set(xlabel="angle [deg]", ylabel="error [mm]")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return axes


def place(top: float, words: str, engine: ConstrainedLayoutEngine) -> tuple[Bbox, int]:
    """Where axes are after a layout, and how often they were measured."""
    with using(USUAL_STYLE), pytest.MonkeyPatch.context() as patch:
        figure = Figure(figsize=(5.2, 4.0), layout=engine)
        axes = lines(figure, top)
        if words:
            axes.text(1.0, 0.5, words, transform=axes.transAxes)
        counts: Counter[str] = Counter()
        counted(patch, counts, Axes, "get_tightbbox")
        figure.draw_without_rendering()
        return axes.get_position(original=True), counts["get_tightbbox"]


@pytest.mark.parametrize(("words", "times"), [("", 1), ("what sticks out at the right", 2)])
@pytest.mark.parametrize("top", [1.0, 0.0123, 4.5e4])
def test_axes_have_the_place_that_constrained_layout_gives_them(top: float, words: str, times: int) -> None:
    own, measured = place(top, words, LayoutEngine())
    other, twice = place(top, words, ConstrainedLayoutEngine())
    np.testing.assert_allclose(own.extents, other.extents, atol=PIXEL)
    assert (measured, twice) == (times, 2)


def test_a_legend_that_sticks_out_is_measured_twice() -> None:
    """Axes were made narrower than their legend needs."""

    def ends(engine: ConstrainedLayoutEngine) -> Bbox:
        with using(USUAL_STYLE):
            figure = Figure(figsize=(3.0, 3.0), layout=engine)
            axes = figure.add_subplot()
            axes.plot([0.0, 1.0], label="a label that is about as wide as these axes are")
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
            figure.draw_without_rendering()
            return axes.get_position(original=True)

    np.testing.assert_allclose(ends(LayoutEngine()).extents, ends(ConstrainedLayoutEngine()).extents, atol=PIXEL)


def test_no_ticks_are_made_to_be_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ticks were made for a place that the axes had not got yet, which took a tenth of a page."""
    figure = Figure()
    axes = lines(figure, 1.0)
    axes.set_title("a\x1b[31mb")
    counts: Counter[str] = Counter()
    counted(monkeypatch, counts, Axis, "get_major_ticks")
    escape_texts(figure)
    assert axes.get_title() == "a\\x1b[31mb"
    assert not counts


@pytest.mark.parametrize("top", [1.0, 0.0123, 4.5e4])
def test_ticks_that_are_drawn_at_once_have_the_place_of_others(top: float) -> None:
    """What is within axes, and what their numbers need beside them, is as matplotlib has it."""

    def ends() -> tuple[Bbox, list[str]]:
        figure = Figure(figsize=(5.2, 4.0), layout=LayoutEngine())
        axes = subplot(figure)
        axes.plot([0.0, 90.0, 360.0], [0.0, top, -top])
        axes.set(xlabel="angle [deg]", ylabel="error [mm]")
        figure.draw_without_rendering()
        words = axes.yaxis.get_major_formatter().format_ticks(axes.get_yticks())
        return axes.get_position(original=True), words

    with using(USUAL_STYLE):
        usual, words = ends()
        with once():
            own, own_words = ends()
    np.testing.assert_allclose(own.extents, usual.extents, atol=PIXEL)
    assert own_words == words


def test_sizes_are_looked_for_until_enough_were_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is found within a budget is what is found without one, and the page says of what nothing is."""
    m = jp.loads(jp.examples.text("four-bar"))
    whole = allow.compute(m)
    some = allow.compute(m, looks=8, first=["J4"])
    names = some.labels("source")
    assert "J4" in names
    assert 1 <= len(names) < len(whole.labels("source"))
    assert "incomplete" in some.attrs
    assert "incomplete" not in whole.attrs
    for name in names:
        assert some.get("allowed", source=name) == whole.get("allowed", source=name)
    monkeypatch.setattr(answers, "LOOKS_IN_PLANE", 8)
    chapter = Chapter(m, "", nominal(m), {"allow": answers._allowed(m, None, 1.0)})
    rest = [name for name in whole.labels("source") if name not in chapter.results["allow"].labels("source")]
    assert rest
    assert f"not looked for: {listed(rest)}" in sections._allowed(chapter)


def test_forces_in_joints_are_drawn_once_for_all_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    """They were drawn once more for each output, though no force depends on which point that is."""
    m = jp.loads(jp.examples.text("slider-crank-cases"))
    counts: Counter[str] = Counter()
    counted(monkeypatch, counts, RendererSVG, "__init__")
    shared: dict[object, str] = {}
    said = []
    for name in m.outputs:
        own = m.only(name)
        chapter = Chapter(own, name, nominal(own.first), {"loaded": loaded.compute(own)}, shared=shared)
        said.append(sections._reactions(chapter))
    assert said[0] == said[1]
    assert counts["__init__"] == len(m.load_cases)
