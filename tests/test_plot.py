"""Drawings show the numbers of the results."""

from __future__ import annotations

import numpy as np
import pytest

import jointplay as jp
from answers import EXAMPLES, distance, example
from jointplay.plot.sheet import sheet
from jointplay.result import from_dataset


class TestPlot:
    def test_error_curves(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("four-bar")
        worst, loaded = jp.worst(m), jp.loaded(m)
        axes = plot.error({"a": worst, "b": loaded}).axes[0]
        for line, result, values in zip(axes.lines, (worst, loaded), (worst.worst_position, None), strict=True):
            expected = distance(result.error) if values is None else values
            np.testing.assert_array_equal(line.get_ydata(), expected)
            np.testing.assert_array_equal(line.get_xdata(), m.value("drives.theta1.values"))
        assert axes.get_xlabel() == "theta1 [deg]"
        assert axes.get_ylabel() == "position error [mm]"
        assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a worst", "b loaded"]
        assert plot.error(worst, "rotation").axes[0].get_ylabel() == "rotation [deg]"

    def test_blame_bars_add_up(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        for name in ("four-bar", "3-rrr"):
            axes = plot.blame(jp.worst(example(name))).axes[0]
            heights = np.array([[bar.get_height() for bar in bars] for bars in axes.containers])
            assert len(heights) <= 7
            np.testing.assert_allclose(heights.sum(axis=0), 100.0)

    def test_sweeps(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        result = jp.sweep(example("four-bar"), "joints.*.clearance.radial", [0.0, 0.5, 1.0])
        axes = plot.sweep(result).axes[0]
        np.testing.assert_array_equal(axes.lines[-1].get_ydata(), result.worst_position[:, -1])
        assert axes.get_xlabel() == "radial [mm]"
        surface = plot.sweep(result, surface=True).axes[0]
        np.testing.assert_array_equal(surface.collections[0].get_array(), result.worst_position.values.T)
        with pytest.raises(jp.InputError, match="not the result of a sweep"):
            plot.sweep(jp.worst(example("four-bar")))

    def test_histogram(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        result = jp.random(example("four-bar"), samples=5000)
        axes = plot.histogram(result, "rotation", 4).axes[0]
        assert sum(axes.patches[0].get_data().values) == pytest.approx(100.0)
        marks = [line.get_xdata()[0] for line in axes.lines]
        np.testing.assert_array_equal(marks, result.error_quantile.sel(quantity="rotation")[4])

    @pytest.mark.parametrize("name", EXAMPLES)
    def test_mechanism(self, name: str) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example(name)
        loaded = jp.loaded(m)
        axes = plot.mechanism(m, 1, exaggerate=100.0, result=loaded).axes[0]
        axis = [c for c in m.components if c in ("x", "y", "z")]
        output = jp.solve(m).nominal[1].sel(component=axis).values
        stars = [line for line in axes.lines if line.get_marker() == "*"]
        stars = [np.ravel(line.get_data_3d()) if len(axis) == 3 else line.get_xydata()[0] for line in stars]
        np.testing.assert_allclose(stars, [output], rtol=0, atol=1e-9)
        names = {part for text in axes.texts for part in text.get_text().split(", ")}
        assert set(m.joints) <= names
        axes.get_figure().canvas.draw()
        with pytest.raises(jp.InputError, match="no configuration 99"):
            plot.mechanism(m, 99)


def test_a_sweep_of_a_structure_has_no_empty_panels() -> None:
    m = jp.loads(jp.examples.text("redundant-bar"))
    swept = from_dataset(jp.sweep(m, "dimensions.length.deviation", [0.0, 0.25], "loaded"))
    assert len(sheet(m, {"loaded": swept}).axes) == 2
