"""Drawings of maps show the numbers of maps; surfaces lie where the values are."""

import base64
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import distance, example
from jointplay.result import quantity

plot = pytest.importorskip("jointplay.plot")
ContourSet = pytest.importorskip("matplotlib.contour").ContourSet
pytest.importorskip("plotly")

#: of a root of a sum of squares
ROUNDING = 1e-15
AREA = {"x": {"from": -120, "to": 120, "count": 13}, "y": {"from": -120, "to": 120, "count": 17}, "angle": 0}


def along_edges(x: np.ndarray, y: np.ndarray, values: np.ndarray, at_x: float, at_y: float) -> float:
    """A value on an edge of the grid, linear between its ends, also of half a cell whose other corner is missing."""
    i, j = (np.interp(at, line, np.arange(len(line))) for at, line in ((at_x, x), (at_y, y)))
    a, b = (int(i + 1e-9), int(j + 1e-9)), (int(np.ceil(i - 1e-9)), int(np.ceil(j - 1e-9)))
    if a[0] != b[0] and a[1] != b[1]:
        # On the diagonal, which is the edge of the other half of the cell.
        is_rising = np.isclose(i - a[0], j - a[1]) and np.isfinite(values[a] + values[b])
        a, b = (a, b) if is_rising else ((a[0], b[1]), (b[0], a[1]))
        part = i - a[0]
    else:
        part = (i - a[0]) + (j - a[1])
    return float(values[a] + part * (values[b] - values[a]))


class TestStatic:
    def test_colours_over_two_axes(self) -> None:
        result = jp.map(example("3-rrr"), grid=AREA)
        axes = plot.map(result).axes[0]
        drawn = np.ma.filled(axes.collections[0].get_array(), np.nan).reshape(17, 13)
        expected = np.where(result.status == "ok", distance(result.error), np.nan).T
        np.testing.assert_allclose(drawn, expected, rtol=ROUNDING)
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "y [mm]")
        assert plot.map(result).axes[1].get_ylabel() == "position error [mm]"
        unreached = np.ma.filled(axes.collections[1].get_array().astype(float), np.nan).reshape(17, 13)
        np.testing.assert_array_equal(np.isfinite(unreached), (result.status == "not_assembled").T)
        lines = axes.collections[-1].get_segments()
        assert len(lines) == int(result.contact_change.sum())
        assert {text.get_text() for text in axes.get_legend().get_texts()} == {
            "not assembled",
            "a contact changes sides",
        }

    def test_a_plan_has_no_empty_margin(self) -> None:
        """A map that is higher than wide stood at the right end of a figure whose left half was empty."""
        grid = {"x": {"from": -40, "to": 40, "count": 5}, "y": {"from": -90, "to": 90, "count": 9}, "angle": 0}
        figure = plot.map(jp.map(example("3-rrr"), grid=grid))
        figure.canvas.draw()
        left = min(axes.get_tightbbox().x0 for axes in figure.axes) / figure.bbox.width
        assert left < 0.15

    def test_a_strip_fills_its_figure(self) -> None:
        """With equal scales a map of a narrow strip was a line a few pixels wide."""
        grid = {"x": {"from": -40, "to": 40, "count": 5}, "y": {"from": 0, "to": 5, "count": 3}, "angle": 0}
        figure = plot.map(jp.map(example("3-rrr"), grid=grid))
        figure.canvas.draw()
        assert figure.axes[0].get_position().height > 0.5

    def test_the_line_between_nodes_is_where_the_contact_changes(self) -> None:
        result = jp.map(example("3-rrr"), grid=AREA)
        segments = plot.map(result).axes[0].collections[-1].get_segments()
        drawn = sorted(tuple(np.round(np.mean(segment, axis=0), 9)) for segment in segments)
        x, y = result.x.values, result.y.values
        expected = [
            ((x[i] + x[i + 1]) / 2 if k == 0 else x[i], y[j] if k == 0 else (y[j] + y[j + 1]) / 2)
            for i, j, k in np.argwhere(result.contact_change.values)
        ]
        np.testing.assert_allclose(drawn, sorted(expected), rtol=0, atol=1e-9)

    def test_a_line_over_one_axis(self) -> None:
        result = jp.map(example("slider-crank"), grid={"theta": {"from": 0, "to": 180, "count": 91}})
        axes = plot.map(result, "rotation").axes[0]
        np.testing.assert_array_equal(axes.lines[0].get_xdata(), result.theta)
        np.testing.assert_array_equal(axes.lines[0].get_ydata(), np.abs(result.error.sel(component="angle")))
        assert axes.get_ylabel() == "rotation [deg]"

    def test_slices_over_three_axes_share_their_colours(self) -> None:
        grid = {"x": np.linspace(-60, 60, 5), "y": np.linspace(-50, 50, 4), "angle": np.linspace(-10, 20, 7)}
        result = jp.map(example("3-rrr"), grid=grid)
        *slices, bar = plot.map(result).axes
        assert [axes.get_title("left") for axes in slices] == [f"angle = {v} deg" for v in (-10, 0, 10, 20)]
        values = np.where(result.status == "ok", distance(result.error), np.nan)
        for axes, k in zip(slices, (0, 2, 4, 6), strict=True):
            drawn = np.ma.filled(axes.collections[0].get_array(), np.nan).reshape(4, 5)
            np.testing.assert_allclose(drawn, values[:, :, k].T, rtol=ROUNDING)
            assert axes.collections[0].get_clim() == slices[0].collections[0].get_clim()
        assert bar.get_ylabel() == "position error [mm]"

    def test_limits_are_lines_where_the_values_are_at_them(self) -> None:
        m = example("3-rrr").with_({"limits.position": 0.1, "limits.x": [-0.02, 0.05]})
        result = jp.map(m, grid=AREA)
        for name, bounds in ((None, (0.1,)), ("error.x", (-0.02, 0.05))):
            axes = plot.map(result, name).axes[0]
            (lines,) = (c for c in axes.collections if isinstance(c, ContourSet))
            values = quantity(result, name).values
            assert tuple(lines.levels) == bounds
            for level, path in zip(lines.levels, lines.get_paths(), strict=True):
                assert len(path.vertices) > 1
                for x, y in path.vertices:
                    assert along_edges(result.x.values, result.y.values, values, x, y) == pytest.approx(level)
            unit = "0.1 mm" if name is None else "-0.02, 0.05 mm"
            assert f"limit {unit}" in {text.get_text() for text in axes.get_legend().get_texts()}
        for name in ("error.y", "undetermined.x", "rotation"):
            assert not any(isinstance(c, ContourSet) for c in plot.map(result, name).axes[0].collections)

    def test_limits_of_the_first_output_and_of_the_worst_case(self) -> None:
        m = example("five-bar").with_({"limits": {"position": 0.3, "rotation": 0.2}})
        outputs = {"a": {**m.raw["output"], "limits": {"position": 0.2}}}
        grid = {"x": np.linspace(-20.0, 20.0, 5), "y": 150.0}
        several = m.with_({"output": None, "outputs": outputs, "limits": None, "loads": None})
        for case, question, name, expected in (
            (m, "worst", None, [0.3]),
            (m, "worst", "rotation", [0.2]),
            (m, "worst", "worst_position", [0.3]),
            (m, "random", "position", [0.3]),
            (several, "worst", None, [0.2]),
        ):
            options = {"samples": 64} if question == "random" else {}
            (axes,) = plot.map(jp.map(case, question, grid, **options), name).axes
            assert [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"] == expected

    @pytest.mark.parametrize("extension", ["png", "svg", "pdf"])
    def test_files(self, tmp_path: Path, extension: str) -> None:
        path = tmp_path / f"map.{extension}"
        plot.draw_map(jp.map(example("3-rrr"), grid=AREA), path)
        assert path.stat().st_size > 5000

    def test_what_is_no_map_is_refused(self) -> None:
        with pytest.raises(jp.InputError, match="this is not a map"):
            plot.map(jp.worst(example("four-bar")))


class TestQuantities:
    def test_by_name_and_by_label(self) -> None:
        m = example("five-bar")
        grid = {"x": [0.0, 20.0], "y": [150.0, 170.0]}
        loaded, worst = jp.map(m, grid=grid), jp.map(m, "worst", grid)
        random, solve = jp.map(m, "random", grid, samples=300), jp.map(m, "solve", grid)
        angle = loaded.error.sel(component="angle")
        for result, name, expected in (
            (loaded, None, distance(loaded.error)),
            (loaded, "rotation", np.abs(angle)),
            (loaded, "error.angle", angle),
            (loaded, "reaction.B.fx", loaded.reaction.sel(joint="B", wrench="fx")),
            (worst, "position", worst.worst_position),
            (worst, "worst_component.y.low", worst.worst_component.sel(component="y", side="low")),
            (random, "rotation", random.error_quantile.sel(probability=0.95, quantity="rotation")),
            (solve, None, solve.singular_value),
        ):
            np.testing.assert_allclose(quantity(result, name).values, expected, rtol=ROUNDING)
        assert quantity(loaded, "error.angle").units == "deg"
        assert quantity(loaded, "reaction.B.moment").units == "N mm"

    def test_the_probability_nearest_to_95_percent_stands_for_a_scatter(self) -> None:
        grid = {"x": [0.0, 20.0], "y": [150.0, 170.0]}
        result = jp.map(example("five-bar"), "random", grid, samples=300, probabilities=(0.5, 0.9))
        found = quantity(result, "position")
        expected = result.error_quantile.sel(probability=0.9, quantity="position")
        np.testing.assert_array_equal(found.values, expected)
        assert found.long_name == "position, 90 % of the specimens below"

    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("eror.x", "'eror' is not a variable of this result; did you mean 'error'"),
            ("error", "'' is not a label of error along component; known: x, y, angle"),
            ("error.z", "'z' is not a label of error along component"),
            ("error.x.y", "error.x.y is not one number per node"),
            ("status", "status is not one number per node"),
        ],
    )
    def test_others_are_refused(self, name: str, said: str) -> None:
        result = jp.map(example("five-bar"), grid={"x": [0.0, 20.0], "y": 150.0})
        with pytest.raises(jp.InputError, match=said):
            plot.map(result, name)


class TestPages:
    def test_work_without_a_network_and_hold_the_values(self, tmp_path: Path) -> None:
        result = jp.map(example("3-rrr"), grid=AREA)
        path = tmp_path / "map.html"
        plot.draw_map(result, path)
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"<(script|link|img)[^>]+(src|href)=", text)
        assert 3e6 < len(text) < 9e6
        from jointplay.plot.interactive import figure_of
        from jointplay.plot.map import layers
        from jointplay.plot.shades import colour_range

        shown = layers(result)
        figure = figure_of(shown, colour_range(shown.value.values))
        np.testing.assert_array_equal(figure.data[0].z, shown.value.values.T)
        assert base64.b64encode(np.ascontiguousarray(figure.data[0].z).tobytes()).decode() in text.replace(
            "\\u002f", "/"
        )
        assert figure.data[0].customdata[0][0] == "not_assembled"

    def test_of_three_axes_have_a_slider_and_surfaces_inside_the_workspace(self) -> None:
        from jointplay.plot.interactive import figure_of
        from jointplay.plot.map import layers
        from jointplay.plot.shades import colour_range

        grid = {"x": np.linspace(-80, 80, 9), "y": np.linspace(-80, 80, 8), "angle": np.linspace(-10, 20, 7)}
        shown = layers(jp.map(example("3-rrr"), grid=grid))
        figure = figure_of(shown, colour_range(shown.value.values))
        heat, mesh = ([t for t in figure.data if t.type == kind] for kind in ("heatmap", "mesh3d"))
        (slider,) = figure.layout.sliders
        assert [step.label for step in slider.steps] == [f"{v:g}" for v in np.linspace(-10, 20, 7)]
        values = [k for k, trace in enumerate(figure.data) if trace.type == "heatmap" and trace.showscale is not False]
        for k, (at, step) in enumerate(zip(values, slider.steps, strict=True)):
            visible = step.args[0]["visible"]
            np.testing.assert_array_equal(np.array(figure.data[at].z, dtype=float), shown.value.values[:, :, k].T)
            # Of the slices only one is there, with all that belongs to it; surfaces and the legend stay.
            assert [j for j in values if visible[j]] == [at]
            assert all(
                visible[j] for j, trace in enumerate(figure.data) if trace.type == "mesh3d" or trace.x[0] is None
            )
        assert len(heat) > len(values)
        assert len(mesh) == 3
        assert all(len(surface.i) for surface in mesh)

    def test_limits_are_lines_and_a_surface(self) -> None:
        from jointplay.plot.interactive import figure_of
        from jointplay.plot.map import layers
        from jointplay.plot.shades import colour_range

        def figure(grid: dict[str, object]) -> Any:
            shown = layers(jp.map(example("3-rrr").with_({"limits.position": 0.05}), grid=grid))
            assert shown.bounds == (0.05,)
            return figure_of(shown, colour_range(shown.value.values))

        (contour,) = (trace for trace in figure(AREA).data if trace.type == "contour")
        assert (contour.contours.start, contour.contours.end, contour.name) == (0.05, 0.05, "limit 0.05 mm")
        line = figure({"x": np.linspace(-60, 60, 9), "y": 0.0, "angle": 0.0})
        assert [shape.y0 for shape in line.layout.shapes] == [0.05]
        whole = figure({"x": np.linspace(-60, 60, 5), "y": np.linspace(-60, 60, 5), "angle": [0.0, 5.0, 10.0]})
        slices = [trace for trace in whole.data if trace.type in ("heatmap", "contour")]
        # A slice has its values, its nodes out of reach and its limit.
        assert [trace.type for trace in slices] == ["heatmap", "heatmap", "contour"] * 3
        assert whole.data[-1].name == "limit 0.05 mm"
        visible = whole.layout.sliders[0].steps[1].args[0]["visible"]
        of_slices = [there for trace, there in zip(whole.data, visible, strict=True) if trace in slices]
        assert of_slices == [False] * 3 + [True] * 3 + [False] * 3

    def test_outside_of_the_grid_is_not_out_of_reach(self) -> None:
        """The page had the colour of nodes that cannot be assembled, as if all around the grid were out of reach."""
        from jointplay.plot.interactive import figure_of
        from jointplay.plot.map import layers
        from jointplay.plot.shades import colour_range

        result = jp.map(example("3-rrr"), grid=AREA)
        shown = layers(result)
        figure = figure_of(shown, colour_range(shown.value.values))
        _, unreached, lines, key = figure.data
        np.testing.assert_array_equal(np.isfinite(unreached.z), (result.status == "not_assembled").values.T)
        assert unreached.colorscale[0][1] != figure.layout.plot_bgcolor == "#ffffff"
        assert (key.name, key.marker.color) == ("not assembled", unreached.colorscale[0][1])
        assert (lines.name, len(lines.x)) == ("a contact changes sides", 3 * int(result.contact_change.sum()))


class TestIsosurface:
    AXES = tuple(np.linspace(-1.1, 1.3, n) for n in (41, 45, 50))

    def test_of_a_distance_is_a_closed_sphere(self) -> None:
        from jointplay.plot.isosurface import isosurface

        mesh = np.meshgrid(*self.AXES, indexing="ij")
        points, triangles = isosurface(self.AXES, np.sqrt(sum(v**2 for v in mesh)), 0.8)
        corners = points[triangles]
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert area.sum() == pytest.approx(4 * np.pi * 0.8**2, rel=2e-3)
        # Between the ends of a cell's diagonal d the distance is off a straight line by d^2 / 8 r at most.
        most = sum((axis[1] - axis[0]) ** 2 for axis in self.AXES) / (8 * 0.8)
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.8, rtol=0, atol=1.01 * most)
        # Closed: every edge belongs to two triangles.
        names = np.unique(points.round(9), axis=0, return_inverse=True)[1].reshape(-1)[triangles]
        names = names[(names[:, 0] != names[:, 1]) & (names[:, 1] != names[:, 2]) & (names[:, 2] != names[:, 0])]
        edges = np.sort(np.concatenate([names[:, [0, 1]], names[:, [1, 2]], names[:, [2, 0]]]), axis=1)
        assert set(np.unique(edges, axis=0, return_counts=True)[1].tolist()) == {2}

    def test_of_a_linear_field_is_exact_and_leaves_out_what_is_missing(self) -> None:
        from jointplay.plot.isosurface import isosurface

        x, y, z = np.meshgrid(*self.AXES, indexing="ij")
        values = 0.3 * x - 0.7 * y + 0.2 * z
        values[x < 0.0] = np.nan
        points, _ = isosurface(self.AXES, values, 0.1)
        np.testing.assert_allclose(points @ [0.3, -0.7, 0.2], 0.1, rtol=0, atol=1e-12)
        assert points[:, 0].min() >= 0.0


def test_a_page_says_where_its_colours_end() -> None:
    """Near a singularity errors grow without bound, and a few nodes would take all colours."""
    from jointplay.plot.interactive import figure_of
    from jointplay.plot.map import layers
    from jointplay.plot.shades import colour_range

    m = example("five-bar")
    far = jp.map(m, grid={"x": {"from": -160, "to": 160, "count": 41}, "y": {"from": 20, "to": 260, "count": 31}})
    shown = layers(far)
    span = colour_range(shown.value.values)
    assert np.nanmax(shown.value.values) > span[1]
    figure = figure_of(shown, span)
    assert figure.data[0].colorbar.title.text == f"position error [mm]<br>{span[1]:.3g} and more"
    near = layers(jp.map(m, grid={"x": [-20, 0, 20], "y": [150, 180]}))
    assert "more" not in figure_of(near, colour_range(near.value.values)).data[0].colorbar.title.text


@pytest.fixture(scope="module")
def bounds() -> Any:
    """A map whose nodes are not assembled, singular, without a bound, and with one."""
    loose = example("five-bar").with_({"joints.*.clearance.radial": 6.0})
    grid = {"x": {"from": -200, "to": 200, "count": 9}, "y": {"from": 60, "to": 260, "count": 7}}
    return jp.map(loose, "worst", grid=grid, certify=True, parts=1)


def test_hatches_are_where_their_nodes_are(bounds: Any) -> None:
    """Contours of hatches ended at the centres of nodes, and covered parts of others."""
    axes = plot.map(bounds, "worst_position_certified").axes[0]
    assert not any(isinstance(drawn, ContourSet) for drawn in axes.collections)
    (hatched,) = (drawn for drawn in axes.collections if drawn.get_hatch())
    there = np.ma.filled(hatched.get_array().astype(float), np.nan).reshape(7, 9)
    np.testing.assert_array_equal(np.isfinite(there), (bounds.status == "singular").T)


def test_nodes_without_a_value_are_in_the_legend(bounds: Any) -> None:
    """Nodes in order that have no bound were white without a word."""
    from jointplay.plot.interactive import figure_of
    from jointplay.plot.map import layers
    from jointplay.plot.shades import colour_range

    assert (bounds.worst_position_certified.isnull() & (bounds.status == "ok")).any()
    names = {"not assembled", "singular", "no value"}
    axes = plot.map(bounds, "worst_position_certified").axes[0]
    assert {text.get_text() for text in axes.get_legend().get_texts()} == names
    shown = layers(bounds, "worst_position_certified")
    figure = figure_of(shown, colour_range(shown.value.values))
    assert names <= {trace.name for trace in figure.data if trace.showlegend}
    # Beside the colours: above them a long name took half of the page.
    assert figure.data[0].colorbar.title.side == "right"
    axes = plot.map(bounds).axes[0]
    assert "no value" not in {text.get_text() for text in axes.get_legend().get_texts()}


def test_a_part_has_no_unit_on_its_axis(bounds: Any) -> None:
    """A line of gaps was drawn over `attained []`."""
    axes = plot.map(bounds.isel(y=slice(0, 1)).squeeze("y").assign_attrs(grid="x"), "worst_position_gap").axes[0]
    assert axes.get_ylabel().endswith("attained")
