"""Drawings show the numbers of the results."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import EXAMPLES, distance, example
from jointplay.plot import Drawn, bodies, couplings
from jointplay.plot.linkage import VIEWS
from jointplay.plot.sheet import sheet
from jointplay.result import from_dataset


class TestPlot:
    def test_error_curves(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("four-bar").with_({"limits": None})
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

    def test_a_question_has_its_colour_in_every_figure(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("four-bar-fits")
        found = {"worst": jp.worst(m), "loaded": jp.loaded(m)}

        def colours(figure: Any) -> dict[str, Any]:
            lines = figure.axes[0].lines
            return {line.get_label().split(" ")[0]: line.get_color() for line in lines if line.get_label()[0] in "lw"}

        own = colours(plot.error(found))
        assert own["worst"] != own["loaded"]
        assert colours(plot.error(dict(reversed(found.items())))) == own
        # Of a component the worst case has two curves.
        assert {**own, "limit": None} == {**colours(plot.error(found, "y")), "limit": None}
        for question, result in found.items():
            assert colours(plot.error({question: result}))[question] == own[question]
        # Several answers to one question are told apart.
        several = plot.error({"a": found["worst"], "b": found["worst"].copy()}).axes[0].lines
        assert several[0].get_color() != several[1].get_color()

    def test_what_has_a_limit_has_a_panel(self) -> None:
        m = example("four-bar-fits")
        found = {name: from_dataset(getattr(jp, name)(m)) for name in ("loaded", "worst")}
        drawn = {axes.get_ylabel(): axes for axes in sheet(m, found).axes}
        for words, limits in {"error in y [mm]": [-0.07, 0.06], "error in angle [deg]": [-0.035, 0.035]}.items():
            lines = [line.get_ydata()[0] for line in drawn[words].lines if line.get_linestyle() == "--"]
            assert {*limits} <= {*lines}
        assert "error in x [mm]" not in drawn
        assert [axes.get_ylabel() for axes in sheet(m, found, Drawn(panel="x")).axes] == ["error in x [mm]"]

    def test_what_one_configuration_leaves_open_is_not_drawn_over_its_neighbours(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        loaded = jp.loaded(example("press"))
        assert (loaded.status != "ok").values.nonzero()[0].tolist() == [5]
        bars, band = plot.error(loaded, "rotation").axes[0].collections
        assert [segment[:, 0].tolist() for segment in bars.get_segments()] == [[180.0, 180.0]]
        assert {x for path in band.get_paths() for x in path.vertices[:, 0].tolist()} <= {180.0}

    def test_blame_bars_add_up(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        for name in ("four-bar", "3-rrr"):
            axes = plot.blame(jp.worst(example(name))).axes[0]
            # Of every bar five points, the second and the third at its right side.
            sides = [bars.get_path().vertices.reshape(-1, 5, 2)[:, 1:3, 1] for bars in axes.patches]
            heights = np.diff(sides, axis=-1)[..., 0]
            assert 1 <= len(heights) <= 7
            np.testing.assert_allclose(heights.sum(axis=0), 100.0)

    def test_what_makes_the_error_smaller_is_said_to_do_so(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("p3r")
        words = [plot.blame(ask(m)).axes[0].get_ylabel() for ask in (jp.worst, jp.loaded)]
        assert words == ["share [%]", "share [%]; below 0: makes it smaller"]

    def test_sweeps(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("four-bar").with_({"limits": None})
        result = jp.sweep(m, "joints.*.clearance.radial", [0.0, 0.5, 1.0])
        axes = plot.sweep(result).axes[0]
        # Without clearance the error is rounding, which is drawn as nothing.
        assert axes.lines[-1].get_ydata()[0] == 0.0
        np.testing.assert_array_equal(axes.lines[-1].get_ydata()[1:], result.worst_position[1:, -1])
        assert axes.get_xlabel() == "joints.*.clearance.radial [mm]"
        surface = plot.sweep(result, surface=True).axes[0]
        # Of errors below the rounding nothing is drawn.
        shown = np.where(result.worst_position.values > 1e-9, result.worst_position.values, 0.0)
        np.testing.assert_array_equal(surface.collections[0].get_array(), shown.T)
        with pytest.raises(jp.InputError, match="not the result of a sweep"):
            plot.sweep(jp.worst(example("four-bar")))

    def test_histogram(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        result = jp.random(example("four-bar"), samples=5000)
        axes = plot.histogram(result, "rotation", 4).axes[0]
        assert sum(axes.patches[0].get_data().values) == pytest.approx(100.0)
        marks = [line.get_xdata()[0] for line in axes.lines]
        np.testing.assert_array_equal(marks, result.error_quantile.sel(quantity="rotation")[4])

    def test_a_histogram_of_specimens_without_a_pose_says_so(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example("four-bar").with_({"drives.theta1.values": [40.0, 300.0]})
        axes = plot.histogram(jp.random(m, samples=200), "position", 1).axes[0]
        assert axes.get_title(loc="left").endswith("no specimen has a pose")
        assert not axes.patches

    @pytest.mark.parametrize("name", EXAMPLES)
    def test_mechanism(self, name: str) -> None:
        plot = pytest.importorskip("jointplay.plot")
        m = example(name)
        loaded = jp.loaded(m)
        axes = plot.mechanism(m, 1, exaggerate=100.0, result=loaded).axes[0]
        axis = [c for c in m.components if c in ("x", "y", "z")]
        output = jp.solve(m).nominal[1].sel(component=axis).values
        stars = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "*"]
        seen = VIEWS["solid"][0].flat(output) if len(axis) == 3 else output
        np.testing.assert_allclose(stars, [seen], rtol=0, atol=1e-9)
        names = {part for text in axes.texts for part in text.get_text().split(", ")}
        # Several bodies on one pin have its name, and so have the two axes of a cross.
        crosses = {name for name in m.joints if name.endswith((".first", ".second"))}
        assert {name.partition("/")[0] for name in m.joints if name not in crosses} <= names
        assert {name.rpartition(".")[0] for name in crosses} <= names
        axes.get_figure().canvas.draw()
        with pytest.raises(jp.InputError, match="no configuration 99"):
            plot.mechanism(m, 99)


@pytest.mark.parametrize("name", ["excavator", "delta-by-hand", "planetary-gear"])
def test_names_of_joints_do_not_lie_on_one_another(name: str) -> None:
    """At the bucket of an excavator three pins are close together, at the platform of a delta robot six balls."""
    m = example(name)
    figure = sheet(m, {"loaded": from_dataset(jp.loaded(m))})
    figure.canvas.draw()
    # Arrows are annotations without words.
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text()]
    areas = [
        max(0.0, min(a.x1, b.x1) - max(a.x0, b.x0)) * max(0.0, min(a.y1, b.y1) - max(a.y0, b.y0))
        for k, a in enumerate(boxes)
        for b in boxes[:k]
    ]
    assert max(areas) < 0.2 * min(box.width * box.height for box in boxes)


def test_given_alone_has_its_curve() -> None:
    """The command failed: of the offsets of the worst case the curve is that of the worst case, which was not drawn."""
    m = example("four-bar")
    result = from_dataset(jp.given(m))
    result.attrs["offsets_of"] = "the largest position error"
    figure = sheet(m, {"given": result})
    np.testing.assert_array_equal(figure.axes[1].lines[0].get_ydata(), distance(jp.given(m).error))


def test_bodies_have_colours_of_their_own() -> None:
    """A delta robot has ten bodies besides the ground, and there are eight colours."""
    m = example("delta-by-hand")
    colours = {bodies.body_colour(m, body) for body in range(-1, len(m.bodies))}
    assert len(colours) == 1 + len(set(m.owners))


def test_a_figure_names_load_cases_only_where_it_depends_on_them() -> None:
    """Under the worst case, which no load changes, it said which other load cases there are."""
    m = jp.loads(jp.examples.text("slider-crank-cases"))
    said = {
        question: sheet(m, {question: from_dataset(getattr(jp, question)(m))}).get_supxlabel()
        for question in ("worst", "loaded")
    }
    assert "other outputs (--output-point)" in said["worst"]
    assert "load case" not in said["worst"]
    assert "other load cases (--load-case)" in said["loaded"]


def test_between_fits_there_are_no_lines_of_equal_error() -> None:
    m = jp.loads(jp.examples.text("slider-crank-cases")).only(output="face")
    key = next(f"joints.{name}.clearance.fit" for name in m.joints if "fit" in (m.value(f"joints.{name}.clearance")))
    axes = jp.plot.sweep(jp.sweep(m, key, ["H7/g6", "H7/f7"]), surface=True).axes[0]
    assert len(axes.collections) == 1


def test_configurations_are_whole_numbers() -> None:
    figure = jp.plot.error(jp.loaded(example("delta")))
    figure.canvas.draw()
    assert all(float(tick).is_integer() for tick in figure.axes[0].get_xticks())


def test_a_sweep_over_speeds_marks_where_contact_may_be_lost() -> None:
    """And a surface of nothing but zeros says so, in place of a grey one with a scale about zero."""
    plot = pytest.importorskip("jointplay.plot")
    swept = jp.sweep(example("press-running"), "drives.crank.speed", [200, 460], "loaded")
    axes = plot.sweep(swept).axes[0]
    (marks,) = [drawn for drawn in axes.collections if str(drawn.get_label()).startswith("contact")]
    # Of some configurations there is a curve.
    curves = [np.array(line.get_ydata()) for line in axes.lines if str(line.get_label()).startswith("crank")]
    errors = np.hypot(*(swept.error.sel(component=name).values for name in "xy"))
    loose = swept.contact.isin(["lost", "may be lost"]).any("source").values
    shown = [k for k in range(errors.shape[1]) if any(np.allclose(errors[:, k], curve) for curve in curves)]
    places = {(200 if k == 0 else 460, round(float(errors[k, c]), 9)) for k in (0, 1) for c in shown if loose[k, c]}
    assert places
    assert {(x, round(y, 9)) for x, y in marks.get_offsets().tolist()} <= places
    nothing = plot.sweep(swept, "rotation", surface=True).axes
    assert len(nothing) == 1
    assert [text.get_text() for text in nothing[0].texts] == ["no error"]


def test_a_sweep_of_a_structure_has_no_empty_panels() -> None:
    m = jp.loads(jp.examples.text("redundant-bar"))
    swept = from_dataset(jp.sweep(m, "dimensions.length.deviation", [0.0, 0.25], "loaded"))
    assert len(sheet(m, {"loaded": swept}).axes) == 2


GEARS_IN_SPACE = jp.Builder(space="spatial", units={"length": "mm"})
GEARS_IN_SPACE.revolute("A", bodies=["ground", "a"], at=(0, 0, 0), axis=(0, 0, 1))
GEARS_IN_SPACE.revolute("B", bodies=["ground", "b"], at=(60, 0, 0), axis=(0, 0, 1))
GEARS_IN_SPACE.revolute("C", bodies=["ground", "c"], at=(60, 80, 0), axis=(0, 0, 1))
GEARS_IN_SPACE.gear("mesh", bodies=["a", "b"], at=[(0, 0, 0), (60, 0, 0)], axis=(0, 0, 1), teeth=(20, 40), module=2)
GEARS_IN_SPACE.belt("belt", bodies=["b", "c"], at=[(60, 0, 0), (60, 80, 0)], axis=(0, 0, 1), radii=(20, 10))
GEARS_IN_SPACE.drive("A", joint="A", values=(0, 30))
GEARS_IN_SPACE.output(body="c")


def circles(axes: Any) -> list[tuple[float, float, float]]:
    """Centre and radius of every circle, the pins' with negative radius."""
    found = [(patch.center, patch.radius, patch.get_fill()) for patch in axes.patches if hasattr(patch, "radius")]
    return sorted((*map(float, centre), -radius if filled else radius) for centre, radius, filled in found)


class TestCouplings:
    """Gears, racks and belts are drawn where they are, as large as they are."""

    def drawn(self, name: str, configuration: int = 0) -> tuple[Any, Any]:
        plot = pytest.importorskip("jointplay.plot")
        m = example(name)
        pose = jp.solve(m).pose.isel(configuration=configuration)
        return plot.mechanism(m, configuration).axes[0], pose

    def test_pitch_circles_of_a_gear_pair(self) -> None:
        axes, _ = self.drawn("geared-five-bar", 3)
        wheels = [circle for circle in circles(axes) if circle[2] > 0]
        np.testing.assert_allclose(wheels, [(0, 0, 20), (60, 0, 40)], atol=1e-9)
        written = {text.get_text(): text.get_position() for text in axes.texts}
        np.testing.assert_allclose(written["mesh"], (20, 0), atol=0.2)  # names are put together to 0.1 %

    def test_planets_lie_between_sun_and_ring(self) -> None:
        axes, pose = self.drawn("planetary-gear", 2)
        wheels = np.array([circle for circle in circles(axes) if circle[2] > 0])
        radii = sorted(set(wheels[:, 2].round(9)))
        assert radii == [13.5, 18.0, 45.0]
        planets = np.unique(wheels[wheels[:, 2] == 13.5].round(6), axis=0)
        expected = sorted(pose.sel(body=f"planet{k}", component=["x", "y"]).values.tolist() for k in (1, 2, 3))
        np.testing.assert_allclose(planets[:, :2], expected, atol=1e-5)
        np.testing.assert_allclose(np.hypot(*planets[:, :2].T), 18.0 + 13.5, atol=1e-5)
        np.testing.assert_allclose(np.hypot(*planets[:, :2].T), 45.0 - 13.5, atol=1e-5)
        written = {text.get_text(): np.hypot(*text.get_position()) for text in axes.texts}
        # Names stand at the pitch points; those at one place are put together to 0.1 % of the drawing.
        np.testing.assert_allclose([written["sun1"], written["ring1"]], [18.0, 45.0], atol=0.2)

    def test_teeth_turn_with_their_wheel(self) -> None:
        (before, _), (after, pose) = self.drawn("rack-slider", 0), self.drawn("rack-slider", 1)
        first = [axes.collections[1].get_segments() for axes in (before, after)]
        assert [len(teeth) for teeth in first] == [18, 18]
        angles = [np.arctan2(*np.mean(teeth, axis=1).T[::-1]) for teeth in first]
        turn = np.radians(float(pose.sel(body="pinion", component="angle")))
        np.testing.assert_allclose(np.exp(1j * (angles[1] - angles[0])), np.exp(1j * turn), atol=1e-9)

    def test_the_pitch_line_of_a_rack_touches_its_pinion(self) -> None:
        axes, _ = self.drawn("rack-slider", 4)
        line = next(line for line in axes.lines if np.allclose(line.get_ydata(), -18.0))
        np.testing.assert_allclose(np.mean(line.get_xdata()), 0.0, atol=1e-9)

    @pytest.mark.parametrize("configuration", [0, 5])
    def test_strands_touch_both_pulleys(self, configuration: int) -> None:
        axes, pose = self.drawn("belt-arm", configuration)
        radii = [teeth * 5.0 / (2.0 * np.pi) for teeth in (24, 48)]
        centres = [pose.sel(body=body, component=["x", "y"]).values for body in ("pulley", "forearm")]
        strands = [line.get_xydata() for line in axes.lines if line.get_linewidth() == 1.6]
        assert len(strands) == 2
        for strand in strands:
            along = np.diff(strand, axis=0)[0]
            for end, centre, radius in zip(strand, centres, radii, strict=True):
                np.testing.assert_allclose(np.hypot(*(end - centre)), radius, rtol=1e-9)
                np.testing.assert_allclose(along @ (end - centre), 0.0, atol=1e-6)  # mm^2, of 250 * 38

    def test_crossed_strands_touch_on_opposite_sides(self) -> None:
        first, second, radii = np.array([0.0, 0.0]), np.array([50.0, 0.0]), (20.0, 10.0)
        for strand in couplings.strands(first, second, np.array([0.0, 1.0]), radii, crossed=True):
            along = np.diff(strand, axis=0)[0]
            np.testing.assert_allclose([along @ strand[0], along @ (strand[1] - second)], 0.0, atol=1e-12)
            assert strand[0, 1] * strand[1, 1] < 0
        assert couplings.strands(first, np.array([5.0, 0.0]), np.array([0.0, 1.0]), radii, crossed=False) == []

    def test_in_space(self) -> None:
        plot = pytest.importorskip("jointplay.plot")
        axes = plot.mechanism(GEARS_IN_SPACE.mechanism(), 1, view="top").axes[0]
        rims = [line.get_xydata() for line in axes.lines if len(line.get_xydata()) > 20]
        centres = [rim[:-1].mean(axis=0) for rim in rims]
        radii = [np.linalg.norm(rim - centre, axis=1) for rim, centre in zip(rims, centres, strict=True)]
        found = sorted(
            (*centre.round(6).tolist(), round(float(r[0]), 6)) for centre, r in zip(centres, radii, strict=True)
        )
        assert found == [(0, 0, 20), (60, 0, 20), (60, 0, 40), (60, 80, 10)]
        assert all(np.ptp(r) < 1e-9 for r in radii)
        names = {text.get_text() for text in axes.texts}
        assert {"mesh", "belt"} <= names
        labels = {text.get_text() for text in axes.get_legend().get_texts()}
        assert {"a", "b", "c"} <= labels

    def test_a_screw_is_drawn_from_its_bearing_to_the_nut(self) -> None:
        m = example("ball-screw")
        axes = jp.plot.mechanism(m, 2, view="front").axes[0]
        line = next(line for line in axes.lines if line.get_label() == "shaft")
        at = float(jp.solve(m).pose.isel(configuration=2).sel(body="stage", component="x"))
        np.testing.assert_allclose(line.get_xydata(), [[0, 0], [at, 0]], atol=1e-9)
