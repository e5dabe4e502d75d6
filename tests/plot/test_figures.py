"""Figures for a paper: the style, sizes, panels, and what is drawn of results."""

import re
import threading
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Circle

import jointplay as jp
from helpers.answers import example
from helpers.figures import outside, overlapping
from jointplay.cli import run
from jointplay.cli.drawing import OPTIONS, FigureFile
from jointplay.plot import Drawn, Style, style
from jointplay.plot.figures import worst_of
from jointplay.plot.put import put
from jointplay.plot.sheet import panel_names, sheet
from jointplay.plot.style import THEMES, size_of, using
from jointplay.result import Result, from_dataset

THEME = sorted(THEMES)
#: width of a column of a page, mm
COLUMN = 85.0


def results(m: jp.Mechanism, *asked: str) -> dict[str, Result]:
    options: dict[str, Any] = {"random": {"samples": 1024, "keep": 100}}
    return {name: from_dataset(getattr(jp, name)(m, **options.get(name, {}))) for name in asked}


def kinds() -> dict[str, tuple[str, dict[str, Result]]]:
    """A sheet of every kind, by its name."""
    four, slider, robot = example("four-bar"), example("slider-crank"), example("3-upu")
    swept = jp.sweep(four, "joints.*.clearance.radial", [0.5, 1.0, 1.5])
    pairs = jp.sweep(
        four, "joints.J1.clearance.radial", [0.2, 0.9, 1.6], by={"joints.J3.clearance.radial": [0.2, 0.8, 1.4]}
    )
    straight = example("straight-line")
    designed = jp.design(straight, aim=["structural", "size"], evaluations=20, points=3)
    return {
        "error": ("four-bar", results(four, "loaded", "worst", "random")),
        "error in space": ("delta-by-hand", results(example("delta-by-hand"), "loaded", "worst")),
        "compensate": ("four-bar", results(four, "compensate")),
        "sweep": ("four-bar", {"sweep": from_dataset(swept)}),
        "sweep over pairs": ("four-bar", {"pairs": from_dataset(pairs)}),
        "solve": ("excavator", results(example("excavator"), "solve")),
        "solve in space": ("3-upu", results(robot, "solve")),
        "singularities": ("slider-crank", results(slider, "singularities")),
        "assemble": ("antenna-support", results(example("antenna-support"), "assemble")),
        "allow": ("six-bar", results(example("six-bar"), "allow")),
        "life": ("four-bar", results(four.with_({"joints.J3.wear": {"growth": 1e-6}, "limits.position": 5.0}), "life")),
        "workspace": ("serial-2r", {"workspace": from_dataset(jp.workspace(example("serial-2r"), count=21))}),
        "allocate": ("press", results(example("press"), "allocate")),
        "structural": ("straight-line", results(example("straight-line"), "structural")),
        "design": ("straight-line", {"design": from_dataset(designed)}),
    }


KINDS = (
    "error", "error in space", "compensate", "sweep", "sweep over pairs", "solve", "solve in space", "singularities",
    "assemble", "allow", "life", "workspace", "allocate", "structural", "design",
)  # fmt: skip


@pytest.fixture(scope="module")
def drawn() -> dict[str, tuple[str, dict[str, Result]]]:
    return kinds()


class TestSheets:
    @pytest.mark.parametrize(("kind", "width"), [*product(KINDS, [None, COLUMN])])
    def test_nothing_overlaps_or_is_cut_off(self, drawn: Any, kind: str, width: float | None) -> None:
        name, found = drawn[kind]
        figure = sheet(example(name), found, Drawn(style=Style("print", width=width)))
        if width is not None:
            assert figure.get_figwidth() * 25.4 == pytest.approx(width)
        assert overlapping(figure) == []
        assert outside(figure) == []

    @pytest.mark.parametrize("theme", THEME)
    def test_every_colour_is_seen_on_its_ground(self, drawn: Any, theme: str) -> None:
        """In the dark theme axes, words and bodies were black on black."""
        name, found = drawn["error"]
        figure = sheet(example(name), found, Drawn(style=Style(theme)))
        paper = np.array(figure.get_facecolor()[:3])
        for axes in figure.axes:
            seen = [axes.xaxis.label.get_color(), axes.title.get_color(), *(line.get_color() for line in axes.lines)]
            for colour in seen:
                assert np.abs(np.array(style.to_rgb(colour)) - paper).max() > 0.3, colour

    def test_a_panel_alone_has_the_size_that_is_asked(self, drawn: Any) -> None:
        name, found = drawn["error"]
        m = example(name)
        for panel in panel_names(m, list(found)):
            figure = sheet(m, found, Drawn(panel=panel, style=Style(width=85, height=60)))
            assert figure.get_size_inches() * 25.4 == pytest.approx([85, 60])
            assert len(figure.axes) == 1
            assert outside(figure) == []

    def test_a_height_in_which_panels_would_cover_each_other_is_refused(self, drawn: Any) -> None:
        name, found = drawn["error"]
        with pytest.raises(
            jp.InputError, match=r"^size: 60 mm are too low for \d panels: \d+ mm; leave the height out"
        ):
            sheet(example(name), found, Drawn(style=Style(width=85, height=60)))

    def test_panels_have_the_names_that_are_checked_before_the_work(self, drawn: Any) -> None:
        for name, found in drawn.values():
            m = example(name)
            for panel in panel_names(m, list(found)):
                if panel.startswith("correction-") or panel == "distance":
                    continue  # of drives of both kinds, and where the path has a singularity
                if {"sweep", "pairs"} & {*found} and not panel.startswith(("position", "rotation")):
                    continue  # of other questions
                sheet(m, found, Drawn(panel=panel))
        with pytest.raises(jp.InputError, match=r"panel: 'histo' is not a panel.*mechanism, position"):
            Drawn(panel="histo").check(example("four-bar"), ["worst"])


class TestStyle:
    @pytest.mark.parametrize(
        ("options", "said"),
        [
            ({"theme": "drak"}, "style: 'drak' is not a style; did you mean 'dark'"),
            ({"width": 3}, "width: 3 is not a number of mm from 20 to 2000"),
            ({"dpi": 5}, "dpi: 5 is not a number of dots per inch; 30 to 2400 are possible"),
            ({"width": 1900, "dpi": 2400}, "1900 mm at 2400 dots per inch are more than 30000 dots"),
            ({"colours": ("blau",)}, '"blau" is not a colour'),
            ({"legend": "upper rigth"}, "legend: 'upper rigth' is not a place of a legend; did you mean 'upper right'"),
            ({"font": "Blau"}, 'font: "Blau" is not a font of this machine'),
            ({"colour_map": "veridis"}, "colour_map: 'veridis' is not a colour map; did you mean 'viridis'"),
            ({"scale": (1.0, 1.0)}, "scale: goes from a number to a larger one"),
            ({"scale": (0.0, 1.0), "log": True}, "scale: is logarithmic and begins above zero, not at 0"),
            ({"levels": 0}, "levels: 0 is not a number of levels; 1 to 100 are possible"),
            ({"levels": (0.2, 0.1)}, "levels: are 1 to 100 numbers that rise"),
            ({"levels": (0.0, 0.1), "log": True}, "levels: of a logarithmic scale are above zero, not 0"),
        ],
    )
    def test_what_is_not_valid_is_refused(self, options: dict[str, Any], said: str) -> None:
        with pytest.raises(jp.InputError, match=re.escape(said)):
            Style(**options)

    def test_every_option_of_the_command_says_something(self) -> None:
        given = {
            "size": "85mm", "dpi": 300, "style": "print", "panel": "position", "configuration": 1, "quantity": "x",
            "font": "DejaVu Serif", "no_title": True, "legend": "none", "against": "length", "colours": "viridis",
            "scale": "0:1", "log": True, "levels": "0.1,0.2",
        }  # fmt: skip
        assert {*given} == {*OPTIONS}
        usual = FigureFile().choice()
        assert [name for name, value in given.items() if FigureFile(options={name: value}).choice() == usual] == []

    @pytest.mark.parametrize("text", ["85 furlong", "x60mm", "85x", "", "1.2.3mm", "-3mm"])
    def test_sizes_that_are_none(self, text: str) -> None:
        with pytest.raises(jp.InputError, match="is not a size such as 85x60mm or 85mm; units are mm, cm, in, pt"):
            size_of(text)

    def test_a_legend_stands_where_it_is_put(self) -> None:
        figure = jp.plot.error(jp.worst(example("four-bar")), style=Style(legend="lower right"))
        axes = figure.axes[0]
        figure.draw_without_rendering()
        box, legend = axes.get_window_extent(), axes.get_legend().get_window_extent()
        assert box.y0 < legend.y0 < legend.y1 < box.y0 + 0.5 * box.height
        assert box.x0 + 0.5 * box.width < legend.x1 < box.x1

    def test_text_in_vector_files_stays_text(self, tmp_path: Path) -> None:
        """Letters were drawn as paths, which nobody can search, edit or set in the fonts of a journal."""
        m = example("four-bar")
        figure = jp.plot.error(jp.worst(m), style=Style("print", width=85))
        figure.savefig(tmp_path / "own.svg")
        put(figure, tmp_path / "command.svg")
        for name in ("own.svg", "command.svg"):
            assert ">position error [mm]</text>" in (tmp_path / name).read_text(encoding="utf-8")
        figure.savefig(tmp_path / "own.pdf")
        content = (tmp_path / "own.pdf").read_bytes()
        # TrueType, not outlines of letters (Type 3).
        assert b"/CIDFontType2" in content
        assert b"/Type3" not in content

    def test_the_same_drawing_is_the_same_file(self, tmp_path: Path) -> None:
        for kind in ("png", "svg", "pdf"):
            written = []
            for name in ("a", "b"):
                put(jp.plot.error(jp.worst(example("four-bar"))), tmp_path / f"{name}.{kind}")
                written.append((tmp_path / f"{name}.{kind}").read_bytes())
            assert written[0] == written[1], kind

    def test_a_drawing_leaves_the_settings_of_matplotlib_alone(self) -> None:
        import matplotlib as mpl

        before = dict(mpl.rcParams)
        jp.plot.error(jp.worst(example("four-bar")), style="dark")
        assert dict(mpl.rcParams) == before

    def test_threads_leave_the_settings_of_matplotlib_to_each_other(self) -> None:
        """A thread that had begun within a drawing of another left that one's settings behind."""
        import matplotlib as mpl

        before = dict(mpl.rcParams)
        begun, done = threading.Event(), threading.Event()

        def draw() -> None:
            begun.set()
            with using("dark") as style:
                done.wait(1.0)
                assert mpl.rcParams["axes.facecolor"] == style.rc["axes.facecolor"]

        thread = threading.Thread(target=draw)
        with using("print"):
            thread.start()
            begun.wait()
            done.wait(0.2)
        done.set()
        thread.join()
        assert dict(mpl.rcParams) == before

    def test_a_notebook_shows_a_figure_by_itself(self) -> None:
        figure: Any = jp.plot.error(jp.worst(example("four-bar")))
        assert figure._repr_png_().startswith(b"\x89PNG")


class TestAgainst:
    """What configurations are drawn against."""

    def test_the_length_of_a_straight_path(self) -> None:
        figure = jp.plot.error(jp.worst(example("five-bar")), style=Style(against="length"))
        assert figure.axes[0].get_xlabel() == "length of the path [mm]"
        assert figure.axes[0].lines[0].get_xdata() == pytest.approx(15.0 * np.arange(9))

    def test_the_time_of_a_machine_that_runs(self) -> None:
        found = jp.loaded(example("press-running"))
        figure = jp.plot.error(found, style=Style(against="time"))
        assert figure.axes[0].lines[0].get_xdata() == pytest.approx(found["time"].values)

    @pytest.mark.parametrize("drive", ["left", "right"])
    def test_one_of_several_drives(self, drive: str) -> None:
        found = jp.worst(example("five-bar"))
        figure = jp.plot.error(found, style=Style(against=drive))
        assert figure.axes[0].lines[0].get_xdata() == pytest.approx(found[drive].values)

    def test_what_there_is_not_is_refused(self) -> None:
        said = "against: 'time' is not what configurations are drawn against; known: left, right, configuration, length"
        with pytest.raises(jp.InputError, match=re.escape(said)):
            jp.plot.error(jp.worst(example("five-bar")), style=Style(against="time"))


class TestCloud:
    @pytest.fixture(scope="class")
    @classmethod
    def found(cls) -> Any:
        m = example("five-bar").with_({"limits.position": 0.06, "limits.x": 0.04})
        return jp.random(m, samples=512, keep=200)

    def test_marks_are_the_specimens_inside_and_outside(self, found: Any) -> None:
        axes = jp.plot.cloud(found, 3).axes[0]
        x, y, _ = found.specimen_error.isel(configuration=3).values.T
        outside = (np.hypot(x, y) > 0.06) | (np.abs(x) > 0.04)
        drawn = [np.asarray(marks.get_offsets()) for marks in axes.collections]
        for marks, mask in zip(drawn, (~outside, outside), strict=True):
            assert mask.any()
            assert marks == pytest.approx(np.stack([x, y], axis=1)[mask])

    def test_specimens_are_within_the_region(self, found: Any) -> None:
        from matplotlib.path import Path as Outline

        axes = jp.plot.cloud(found, region=jp.region(example("five-bar"))).axes[0]
        outline = next(line for line in axes.lines if line.get_label() == "all that is possible")
        marks = np.vstack([marks.get_offsets() for marks in axes.collections])
        assert Outline(outline.get_xydata()).contains_points(marks).all()

    def test_what_has_no_specimens_is_refused(self) -> None:
        with pytest.raises(jp.InputError, match=re.escape("has no specimens; jointplay.random(keep=N) keeps them")):
            jp.plot.cloud(jp.random(example("five-bar"), samples=64))

    def test_a_component_that_there_is_not(self, found: Any) -> None:
        with pytest.raises(jp.InputError, match="components: 'z' is not a component; known: x, y, angle"):
            jp.plot.cloud(found, components=("x", "z"))


class TestShades:
    """The colours of a map, on a plane whose values are x + y."""

    @pytest.fixture(scope="class")
    @classmethod
    def plane(cls) -> Any:
        grid = {"x": np.linspace(-50, 50, 6), "y": np.linspace(120, 180, 4)}
        found = jp.map(example("five-bar"), "worst", grid=grid)
        found["worst_position"].values[:] = 1.0 + np.add.outer(np.arange(6.0), np.arange(4.0))
        return found

    def mesh(self, plane: Any, **options: Any) -> Any:
        figure = jp.plot.map(plane, "position", style=Style(**options))
        return figure.axes[0].collections[0]

    def test_colours_end_where_values_do(self, plane: Any) -> None:
        assert self.mesh(plane).get_clim() == (1.0, 9.0)

    def test_colours_end_where_they_are_said_to(self, plane: Any) -> None:
        mesh = self.mesh(plane, scale=(2.0, 5.0), colour_map="viridis")
        assert (mesh.get_clim(), mesh.cmap.name, mesh.colorbar.extend) == ((2.0, 5.0), "viridis", "both")

    def test_logarithmic(self, plane: Any) -> None:
        norm = self.mesh(plane, log=True).norm
        assert norm(3.0) == pytest.approx(0.5)

    def test_lines_are_where_they_are_said_to_be(self, plane: Any) -> None:
        figure = jp.plot.map(plane, "position", style=Style(levels=(2.5, 6.0), title=False, legend="none"))
        axes = figure.axes[0]
        lines = [one for one in axes.collections if getattr(one, "labelTexts", None)]
        assert {text.get_text() for one in lines for text in one.labelTexts} == {"2.5", "6.0"}
        assert figure.axes[1].get_yticks().tolist() == [1.0, 2.5, 6.0, 9.0]
        assert axes.get_title("left") == ""
        assert axes.get_legend() is None

    def test_a_page_has_no_levels(self, plane: Any, tmp_path: Path) -> None:
        with pytest.raises(jp.InputError, match="levels: is for"):
            jp.plot.draw_map(plane, tmp_path / "a.html", style=Style(levels=3))


class TestErrors:
    def test_band_of_what_the_load_leaves_open(self) -> None:
        """Only the middle was drawn, as if the load decided everything."""
        m = example("3-upu")
        loaded = jp.loaded(m)
        axes = jp.plot.error(loaded).axes[0]
        drawn = {float(bar[0, 0]): sorted(bar[:, 1]) for bar in axes.collections[0].get_segments()}
        assert drawn
        lengths = [c for c in m.components if c in ("x", "y", "z")]
        error, half = (loaded[name].sel(component=lengths).values for name in ("error", "undetermined"))
        farthest = np.linalg.norm(np.abs(error) + half, axis=1)
        nearest = np.linalg.norm(np.maximum(np.abs(error) - half, 0.0), axis=1)
        for k, ends in enumerate(zip(nearest, farthest, strict=True)):
            middle = [np.linalg.norm(error[k])] * 2
            np.testing.assert_allclose(drawn.get(k, middle), ends, atol=1e-12)

    def test_a_component_has_its_sign_and_both_limits(self) -> None:
        m = example("four-bar").with_({"limits": {"x": [-2.0, 3.0]}})
        worst = jp.worst(m)
        axes = jp.plot.error({"worst": worst}, "x").axes[0]
        drawn = {line.get_label(): line.get_ydata() for line in axes.lines if len(line.get_ydata()) == 11}
        for side in ("low", "high"):
            expected = worst.worst_component.sel(component="x", side=side)
            np.testing.assert_array_equal(drawn[f"worst {side}"], expected)
        levels = [
            line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--" and len(line.get_ydata()) == 2
        ]
        assert {-2.0, 3.0} <= set(levels)

    def test_the_histogram_is_of_the_worst_configuration(self) -> None:
        """It was that of the first configuration, whichever was the worst."""
        result = jp.random(example("four-bar"), samples=2048)
        level = result.error_quantile.sel(probability=0.95, quantity="position")
        worst = int(np.argmax(level.values))
        assert worst != 0
        axes = jp.plot.histogram(result).axes[0]
        assert f"configuration {worst}, theta1 = " in axes.get_title("left").replace("\n", " ")
        np.testing.assert_array_equal(axes.patches[0].get_data().edges, result.edge.sel(quantity="position")[worst])

    def test_what_has_a_limit_has_its_histogram_on_the_sheet(self) -> None:
        """The sheet had that of the position alone, beside limits of y and the angle."""
        m = example("four-bar-fits")
        found = {"random": from_dataset(jp.random(m, samples=256))}
        figure = sheet(m, found)
        drawn = {axes.get_xlabel(): axes for axes in figure.axes if axes.get_ylabel().startswith("specimens per bin")}
        assert list(drawn) == ["position error [mm]", "error in y [mm]", "error in angle [deg]"]
        lines = {float(line.get_xdata()[0]) for line in drawn["error in y [mm]"].lines}
        assert {-0.07, 0.06} <= lines
        for choice, label in (
            (Drawn(panel="histogram-x"), "error in x [mm]"),
            (Drawn(panel="histogram-rotation"), "rotation [deg]"),
            (Drawn(panel="histogram", quantity="angle"), "error in angle [deg]"),
        ):
            assert [axes.get_xlabel() for axes in sheet(m, found, choice).axes] == [label]

    def test_a_component_is_worst_where_it_is_farthest_in_either_direction(self) -> None:
        """The configuration was chosen by high quantiles alone, which are near zero where errors are negative."""
        result = from_dataset(jp.random(example("four-bar"), samples=256))
        result.get("error_mean", component="x")[3] -= 100.0
        result.get("error_quantile", quantity="x")[3] = 0.0
        assert worst_of(result, "x") == 3

    def test_a_median_that_is_nothing_beside_other_quantiles_is_zero(self) -> None:
        """Of most samples it was -4.81e-05 mm, which they do not tell from zero."""
        result = jp.random(example("four-bar-fits"), samples=256)
        result.error_quantile.loc[{"probability": 0.5, "quantity": "y"}] = -1e-5
        legend = jp.plot.histogram(result, "y").axes[0].get_legend()
        assert legend.get_texts()[0].get_text() == "50 %: 0 mm"

    def test_the_correction_itself(self) -> None:
        result = jp.compensate(example("four-bar"))
        axes = jp.plot.correction(result).axes[0]
        np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.correction.sel(drive="theta1"))
        assert axes.get_ylabel() == "correction of the drive [deg]"

    def test_a_sweep_says_its_quantile_and_marks_the_limit(self) -> None:
        m = example("four-bar").with_({"limits": {"position": 1.2}})
        result = jp.sweep(m, "joints.*.clearance.radial", [0.4, 0.8, 1.2], "random", samples=1024)
        axes = jp.plot.sweep(result, surface=True).axes[0]
        assert axes.get_title("left") == "random: 95 % of the specimens are below"
        assert [text.get_text() for text in axes.get_legend().get_texts()] == ["limit"]
        lines = [level for one in axes.collections if hasattr(one, "levels") for level in np.ravel(one.levels)]
        assert 1.2 in lines

    def test_nearness_to_singularities(self) -> None:
        result = jp.singularities(example("slider-crank"))
        axes = jp.plot.nearness(result).axes[0]
        drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
        limit = float(result.attrs["limit"])
        for kind in ("constraint", "actuation", "output"):
            expected = np.maximum(result[f"{kind}_singular_value"], 0.1 * limit)
            np.testing.assert_array_equal(drawn[kind], expected)
        assert drawn["singular below this"][0] == limit


class TestWidths:
    def test_steps_of_an_assembly_stand_beside_each_other_on_a_page(self, drawn: Any) -> None:
        """At the width of a page they stood below each other, 290 mm high; at that of a column with gaps between."""
        name, found = drawn["assemble"]
        for width, highest in ((170.0, 170.0), (COLUMN, 270.0)):
            figure = sheet(example(name), found, Drawn(style=Style("print", width=width)))
            assert 25.4 * figure.get_figheight() < highest

    def test_marks_of_no_force_are_seen_as_a_whole(self) -> None:
        """They were cut by the axis on which they lie."""
        axes = jp.plot.reactions(jp.loaded(example("press-running"))).axes[0]
        assert axes.get_ylim()[0] < 0.0


class TestMechanisms:
    def test_the_star_of_the_output_does_not_hide_its_pin(self) -> None:
        """On a page of one column it was larger than the pin and lay over it."""
        for width in (COLUMN, 170.0):
            figure = sheet(example("four-bar"), results(example("four-bar"), "solve"), Drawn(style=Style(width=width)))
            (axes,) = figure.axes
            star = next(line for line in axes.lines if line.get_marker() == "*")
            middle = star.get_xydata()[0]
            pin = next(p for p in axes.patches if isinstance(p, Circle) and np.allclose(p.center, middle))
            assert star.get_zorder() < pin.get_zorder()
            # The points of the star are seen around the pin, its edge on what is as dark.
            points = 72.0 / figure.dpi * np.diff(axes.transData.transform([[0.0, 0.0], [2.0 * pin.radius, 0.0]])[:, 0])
            assert star.get_markersize() > 1.5 * points[0]
            assert star.get_markeredgecolor() != star.get_markerfacecolor()

    def test_names_stay_within_the_frame_of_a_drawing_that_is_written(self, tmp_path: Path) -> None:
        """J3 lay on the frame, because what stands at the foot was written after the names had their places."""
        m = example("four-bar")
        found = results(m, "worst", "loaded")
        choice = Drawn(panel="mechanism", style=Style("print", width=COLUMN))
        with using(choice.style):
            figure = sheet(m, found, choice)
            put(figure, tmp_path / "a.png", found["worst"])
        (axes,) = figure.axes
        frame = axes.get_window_extent()
        for text in (text for text in axes.texts if text.get_text().startswith("J")):
            box = text.get_window_extent()
            assert frame.y0 < box.y0
            assert box.y1 < frame.y1

    def test_a_file_says_what_other_outputs_and_load_cases_there_are(self, tmp_path: Path) -> None:
        """The hash of the mechanism was written in the place of that line."""
        m = jp.loads(jp.examples.text("slider-crank-cases"))
        found = results(m, "loaded")
        figure = sheet(m, found, Drawn(style=Style(width=COLUMN)))
        put(figure, tmp_path / "a.png", found["loaded"])
        said = figure.get_supxlabel().replace("\n", " ")
        assert said.startswith("Output face, load case feed")
        assert "other outputs (--output-point): pin" in said
        assert said.endswith(f"; mechanism {m.hash}")
        assert outside(figure) == []

    def test_views_project_along_their_axes(self) -> None:
        m = example("3-upu")
        x, y, z = jp.solve(m).nominal[0].sel(component=["x", "y", "z"]).values
        for view, seen in (("front", (x, z)), ("top", (x, y)), ("side", (y, z))):
            axes = jp.plot.mechanism(m, view=view).axes[0]
            star = next(line for line in axes.lines if line.get_marker() == "*")
            np.testing.assert_allclose(star.get_xydata()[0], seen, atol=1e-9)
            assert (axes.get_xlabel()[0], axes.get_ylabel()[0]) == {"front": ("x", "z"), "top": ("x", "y")}.get(
                view, ("y", "z")
            )
        with pytest.raises(jp.InputError, match=r"view: 'back' is not a view; .* solid, front, top, side"):
            jp.plot.mechanism(m, view="back")
        with pytest.raises(jp.InputError, match="is for mechanisms in space"):
            jp.plot.mechanism(example("four-bar"), view="top")

    def test_nearer_surfaces_are_painted_over_others(self) -> None:
        from jointplay.plot.linkage import VIEWS

        view = VIEWS["solid"][0]
        frame = np.array([view.right, view.up, view.towards])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        from jointplay.plot.solid import ball, box, tube

        # All pieces of a closed body that look at the viewer cover its outline once: areas along the line of sight.
        for surface, area in (
            (ball(np.zeros(3), 1.0), np.pi),
            (box(np.zeros(3), *np.eye(3)[:2], np.ones(3)), 4.0 * np.abs(view.towards).sum()),
            (tube(np.zeros(3), np.array([0.0, 0.0, 2.0]), 0.5), None),
        ):
            pieces, normals = surface
            flat = view.flat(pieces[normals @ view.towards > 0])
            x, y = flat[..., 0], flat[..., 1]
            covered = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)).sum()
            up = view.towards[2]
            expected = area or 2.0 * np.sqrt(1.0 - up**2) + np.pi * 0.25 * up
            # Polygons of 14 corners have 3 % less area than circles.
            assert covered == pytest.approx(expected, rel=0.06)

    @pytest.mark.parametrize(("name", "radius"), [("four-bar", 1.0), ("delta-by-hand", None)])
    def test_clearances_are_drawn_as_large_as_is_said(self, name: str, radius: float | None) -> None:
        m = example(name)
        axes = jp.plot.mechanism(m, exaggerate=10.0).axes[0]
        patches = [patch for patch in axes.patches if patch.get_label() == "clearance, 10 times"]
        assert len(patches) == sum(kind == "clearance" for kind in m.source_kinds)
        if radius is not None:
            for patch in patches:
                np.testing.assert_allclose(np.ptp(patch.get_xy(), axis=0), 20.0 * radius, rtol=1e-6)

    def test_several_poses(self) -> None:
        m = example("four-bar")
        axes = jp.plot.mechanism(m, 0, behind=[1, 2, 3], beside=[10]).axes[0]
        said = axes.get_title(loc="left").replace("\n", " ")
        assert said.endswith("configuration 0, theta1 = 22.7 deg (with names) to configuration 10, theta1 = 76.39 deg")
        cranks = [line for line in axes.lines if line.get_color() == "#0072b2"]
        assert sorted((line.get_alpha() is None) for line in cranks) == [False] * 3 + [True] * 2


class TestCommand:
    @pytest.fixture
    def file(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
        monkeypatch.chdir(tmp_path)
        run(["new", "four-bar"])
        return "four-bar.toml"

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            (
                ["--panel", "histo"],
                "error: --panel: 'histo' is not a panel; did you mean 'histogram'? Known: mechanism",
            ),
            (["--size", "9parsec"], 'error: --size: "9parsec" is not a size such as 85x60mm'),
            (["--size", "9mm"], "error: --size: 9.0 is not a number of mm from 20 to 2000"),
            (
                ["--style", "drak"],
                "error: --style: 'drak' is not a style; did you mean 'dark'? Known: light, dark, print",
            ),
            (["--quantity", "z"], "error: --quantity: 'z' is not a quantity; known: position, rotation, x, y, angle"),
            (["-c", "11"], "error: --configuration: there is no configuration 11; they go from 0 to 10"),
            (["--against", "theta2"], "error: --against: 'theta2' is not what configurations are drawn against"),
            (["--font", "Blau"], 'error: --font: "Blau" is not a font of this machine'),
            (["--dpi", "1"], "error: --dpi: 1 is not a number of dots per inch; 30 to 2400 are possible"),
        ],
    )
    def test_wrong_values_are_refused_before_the_work(
        self, file: str, options: list[str], said: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        capsys.readouterr()
        assert run(["error", file, "--plot", "a.svg", *options]) == 2
        printed = capsys.readouterr()
        assert printed.err.startswith(said)
        assert printed.out == ""
        assert not Path("a.svg").exists()

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            (["--scale", "1"], 'error: --scale: "1" is not two numbers such as 0:0.5'),
            (["--levels", "a"], 'error: --levels: "a" is not a number of levels, or values such as 0.1,0.2,0.5'),
            (["--levels", "2,1"], "error: --levels: are 1 to 100 numbers that rise"),
            (["--colours", "veridis"], "error: --colours: 'veridis' is not a colour map; did you mean 'viridis'"),
        ],
    )
    def test_wrong_colours_of_a_map(
        self, file: str, options: list[str], said: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert run(["map", file, "-g", "theta1=20:70:5", "--plot", "a.svg", *options]) == 2
        assert capsys.readouterr().err.startswith(said)
        assert not Path("a.svg").exists()

    def test_options_without_a_figure_are_refused(self, file: str, capsys: pytest.CaptureFixture[str]) -> None:
        assert run(["error", file, "--size", "85mm"]) == 2
        assert "error: --size: says how a figure looks; --plot says where it goes" in capsys.readouterr().err

    def test_a_panel_in_a_column(self, file: str) -> None:
        run(["error", file, "-q", "worst", "--plot", "a.svg", "--size", "85x60mm", "--panel", "rotation"])
        text = Path("a.svg").read_text(encoding="utf-8")
        width, height = (float(found) for found in re.findall(r'(?:width|height)="([\d.]+)pt"', text)[:2])
        assert (width * 25.4 / 72, height * 25.4 / 72) == pytest.approx((85, 60), abs=1e-3)
        assert ">rotation [deg]</text>" in text
        assert "position error" not in text

    @pytest.mark.parametrize(
        "command",
        [
            ["solve"], ["singularities"], ["compensate"], ["error", "-q", "loaded"], ["compare", "four-bar.toml"],
            ["sweep", "-s", "joints.*.clearance.radial=0.5,1"], ["map", "-g", "theta1=20:70:5"],
        ],
    )  # fmt: skip
    def test_every_command_with_a_figure_takes_its_look(self, file: str, command: list[str]) -> None:
        assert run([command[0], file, *command[1:], "--plot", "a.svg", "--size", "85mm", "--style", "dark"]) in (0, 1)
        text = Path("a.svg").read_text(encoding="utf-8")
        assert float(re.search(r'width="([\d.]+)pt"', text)[1]) * 25.4 / 72 == pytest.approx(85, abs=1e-3)
        assert "#14171c" in text


def test_numbers_of_configurations_are_whole() -> None:
    """A single one had marks from -0.04 to 0.04 beside it, two had halves between them."""
    single, pair = example("redundant-bar"), example("3-upu")
    figures = [
        jp.plot.error(jp.worst(single)),
        jp.plot.reactions(jp.loaded(single)),
        jp.plot.nearness(jp.singularities(pair)),
        jp.plot.correction(jp.compensate(pair)),
        jp.plot.error(jp.worst(pair)),
    ]
    for figure in figures:
        low, high = figure.axes[0].get_xlim()
        ticks = figure.axes[0].get_xticks()
        inside = ticks[(ticks >= low) & (ticks <= high)]
        assert len(inside) > 0
        assert (inside == inside.round()).all()
    swept = jp.plot.sweep(jp.sweep(pair, "joints.base1.clearance.radial", [0.01, 0.02]), surface=True)
    ticks = swept.axes[0].get_yticks()
    assert (ticks == ticks.round()).all()


def test_the_cost_of_the_limits_as_they_are_lies_on_the_curve() -> None:
    found = jp.allocate(example("press"), curve=[0.6, 1.4])
    curve, own = jp.plot.cost_curve(found).axes[0].lines
    assert curve.get_xdata().tolist() == [0.6, 1.0, 1.4]
    assert curve.get_ydata()[1] == own.get_ydata()[0] == found.total_cost.item()


def test_shares_are_hatched_with_lines() -> None:
    """Dots and rings are outlines of thousands of circles in a file of vectors."""
    assert not {"o", ".", "O", "*"} & {*"".join(style.HATCHES)}
