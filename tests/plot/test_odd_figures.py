"""Figures of odd results in a column of a page: nothing is off, very little or in many places, and names are long."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

import jointplay as jp
from helpers.answers import example
from helpers.figures import outside, overlapping, too_wide
from jointplay import examples
from jointplay.plot import Drawn, Style
from jointplay.plot.figures import error
from jointplay.plot.sheet import sheet
from jointplay.plot.words import wrapped
from jointplay.result import Result, from_dataset

COLUMN = 85.0
LONG = {
    "J1": "main_bearing_of_the_crank_in_the_left_wall_of_the_frame",
    "J2": "main_bearing_of_the_crank_in_the_right_wall_of_the_frame",
    "coupler": "connecting_rod_of_the_second_stage_assembly_0001_rev_B",
    "theta1": "motor_angle_of_the_servo_drive_number_one_in_cabinet_three",
}


def panel(m: jp.Mechanism, name: str, *asked: str, quantity: str | None = None) -> Figure:
    options: dict[str, Any] = {"random": {"samples": 1024}}
    found = {one: from_dataset(getattr(jp, one)(m, **options.get(one, {}))) for one in asked or ("worst", "loaded")}
    choice = Drawn(panel=name, quantity=quantity, style=Style("print", width=COLUMN))
    figure = sheet(m, found, choice)
    FigureCanvasAgg(figure).draw()
    return figure


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def marks(axes: Axes) -> list[str]:
    """The numbers along the vertical axis."""
    return [text.get_text() for text in axes.yaxis.get_majorticklabels() if text.get_text()]


def test_with_no_error_at_all_an_axis_has_no_rounding_on_it() -> None:
    m = example("four-bar").with_({"joints.*.clearance.radial": 0.0, "limits": {}})
    for name in ("position", "rotation"):
        (axes,) = panel(m, name, "worst", "random").axes
        assert all(not np.any(line.get_ydata()) for line in axes.lines)
        assert axes.get_ylim() == (0.0, 1.0)
        assert axes.get_yticks().tolist() == [0.0]
        assert "10" not in axes.get_ylabel()
    figure = panel(m, "histogram", "random")
    assert "no error" in texts(figure)
    assert abs(np.array(figure.axes[0].get_xlim())).max() <= 1.0
    sizes = ("joints.*.clearance.radial", "dimensions.*.tolerance", "drives.*.error")
    exact = example("five-bar").with_({**dict.fromkeys(sizes, 0.0), "limits": {}})
    drawn = jp.plot.map(jp.map(exact, "worst", {"x": [-20.0, 0.0], "y": [150.0, 170.0, 190.0]}), style=Style())
    assert drawn.axes[1].get_ylim() == (0.0, 1.0)


@pytest.mark.parametrize(("size", "power"), [(1e-6, -6), (1e-2, 0), (1.0, 0)])
def test_powers_of_ten_stand_in_the_label_and_not_under_the_legend(size: float, power: int) -> None:
    m = example("four-bar").with_({"joints.*.clearance.radial": size, "limits": {}})
    figure = panel(m, "position")
    (axes,) = figure.axes
    assert axes.get_ylabel() == ("position error [10⁻⁶ mm]" if power else "position error [mm]")
    highest = max(float(mark.replace("\N{MINUS SIGN}", "-")) for mark in marks(axes)) * 10.0**power
    top = max(float(line.get_ydata().max()) for line in axes.lines)
    assert 0.8 * top < highest < 1.5 * top
    assert not axes.yaxis.get_offset_text().get_text()
    assert overlapping(figure) == outside(figure) == []
    # Drawn once more with other values, the label follows them.
    axes.set_ylim(0.0, 5e7)
    for _ in range(2):
        FigureCanvasAgg(figure).draw()
        assert axes.get_ylabel() == "position error [10⁶ mm]"
        assert marks(axes)[1] == "10"


@pytest.mark.parametrize("name", ["mechanism", "position", "sources", "histogram"])
def test_long_names_leave_room_for_what_is_drawn(name: str) -> None:
    text = examples.text("four-bar")
    for old, new in LONG.items():
        text = text.replace(old, new)
    figure = panel(jp.loads(text, "long.toml"), name, "worst", "random")
    assert overlapping(figure) == outside(figure) == []
    (axes,) = figure.axes
    assert axes.get_position().width > 0.6
    legend = axes.get_legend()
    if name == "sources":
        # Names that differ in the middle remain two.
        assert legend is not None
        assert len(legend.get_texts()) == 4


def test_many_configurations_have_markers_apart_and_bars_without_edges() -> None:
    m = example("four-bar").with_({"drives.theta1.values": np.linspace(22, 76, 200).tolist()})
    (axes,) = panel(m, "position").axes
    for line in (line for line in axes.lines if line.get_marker() not in ("None", None)):
        every = np.array(line.get_markevery())
        wide = 72.0 * axes.get_window_extent().width / axes.figure.dpi
        assert every[0] == 0
        assert 0.8 * line.get_markersize() < wide / len(every) < 4.0 * line.get_markersize()
    (axes,) = panel(m, "sources").axes
    assert not axes.patches
    assert len(axes.collections) == 4
    assert all(not np.any(one.get_linewidth()) or len(one.get_paths()) == 1 for one in axes.collections)


def test_a_place_alone_keeps_its_marker() -> None:
    m = example("four-bar").with_({"drives.theta1.values": np.linspace(22, 76, 200).tolist()})
    result = jp.worst(m)
    values = result["worst_position"].values
    values[1:150] = np.nan
    values[77] = 3.0
    figure = error(result, style=Style("print", width=COLUMN))
    FigureCanvasAgg(figure).draw()
    every = figure.axes[0].lines[0].get_markevery()
    assert {0, 77, 150, 199} <= {*every}
    assert len(every) < 60


def test_a_single_configuration_has_one_mark_below_it() -> None:
    (axes,) = panel(example("four-bar").with_({"drives.theta1.values": [31.5]}), "position").axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["31.5"]


def test_a_limit_that_is_not_in_sight_is_not_in_the_legend() -> None:
    for limit, is_seen in ((4.0, True), (400.0, False)):
        figure = panel(example("four-bar").with_({"limits.position": limit}), "histogram", "random")
        legend = figure.axes[0].get_legend()
        assert legend is not None
        assert ("limit" in [text.get_text() for text in legend.get_texts()]) == is_seen


@pytest.fixture(scope="module")
def plan() -> Any:
    grid = {
        "x": [float(x) for x in range(-150, 151, 25)],
        "y": [float(y) for y in range(-150, 151, 25)],
        "angle": [0.0],
    }
    return jp.map(example("3-rrr"), "loaded", grid)


@pytest.mark.parametrize("look", [{}, {"log": True}, {"levels": 6}, {"levels": 14}, {"levels": 6, "log": True}])
@pytest.mark.parametrize("width", [COLUMN, 170.0])
def test_a_map_of_a_plan_is_whole(plan: Any, width: float, look: dict[str, Any]) -> None:
    """In a column of a page its legend left a quarter of the width to it, and lines had their numbers on the edge."""
    figure = jp.plot.map(plan, style=Style("print", width=width, **look))
    assert outside(figure) == []
    assert too_wide(figure) == []
    assert not any("$" in text for text in texts(figure))
    plane, bar = (axes.get_window_extent() for axes in figure.axes)
    # The colours stand beside the plan.
    assert 0.0 < bar.x0 - plane.x1 < 0.2 * figure.bbox.width
    assert plane.width > 0.45 * figure.bbox.width
    numbers = [text for text in figure.axes[0].texts if text.get_rotation() is not None]
    assert bool(numbers) == ("levels" in look)
    # Numbers are as far from each other as they are high, at least.
    middles = figure.axes[0].transData.transform([text.get_position() for text in numbers] or [(0.0, 0.0)])
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1)[np.triu_indices(len(middles), 1)]
    assert (apart > 5.0 * figure.dpi / 72.0).all()
    # Ends of the colours would be numbers of many digits.
    assert max(map(len, marks(figure.axes[1]))) <= len("0.025")


def test_titles_of_slices_keep_clear_of_the_colours() -> None:
    grid = {"x": [-80.0, 0.0, 80.0], "y": [-60.0, 0.0, 60.0], "angle": [-10.0, 0.0, 10.0, 20.0]}
    figure = jp.plot.map(jp.map(example("3-rrr"), "loaded", grid), style=Style("print", width=COLUMN, levels=6))
    assert outside(figure) == []
    *slices, bar = figure.axes
    titles = [axes._left_title.get_window_extent() for axes in slices]
    assert all(box.width > 0.0 and not box.overlaps(bar.get_tightbbox()) for box in titles)
    assert not any(one.overlaps(other) for one, other in combinations(titles, 2))
    # Labels and legend have not all of the height.
    assert sum(axes.get_window_extent().height for axes in slices[::2]) > 0.35 * figure.bbox.height


def test_a_power_of_ten_stands_once_in_a_label_without_a_unit() -> None:
    figure = Style().figure(4.0, 3.0)
    axes = figure.add_subplot()
    axes.plot([0.0, 3e-7])
    axes.set_ylabel("part")
    for _ in range(3):
        FigureCanvasAgg(figure).draw()
    assert axes.get_ylabel() == "part [10⁻⁹]"


def test_a_limit_of_specimens_is_in_the_legend_where_it_is_seen() -> None:
    for limit, is_seen in ((4.0, True), (40.0, False)):
        found = jp.random(example("four-bar").with_({"limits.position": limit}), samples=64, keep=50)
        (axes,) = jp.plot.cloud(found, style=Style("print", width=COLUMN)).axes
        assert ("limit" in [text.get_text() for text in axes.get_legend().get_texts()]) == is_seen
        assert (axes.get_xlim()[1] > limit) == is_seen


def test_a_logarithm_of_nothing_has_the_colour_below_its_scale() -> None:
    grid = {"x": [340.0, 360.0, 380.0], "y": [-60.0, 0.0, 60.0]}
    result = jp.map(example("serial-2r"), "worst", grid)
    result["worst_position"].values[0, 0] = 0.0
    figure = jp.plot.map(result, style=Style(log=True, width=COLUMN))
    mesh = figure.axes[0].collections[0]
    colours = mesh.to_rgba(mesh.get_array())
    # One without a value has no colour.
    assert (np.asarray(colours).reshape(-1, 4)[:, 3] == 1.0).all()


def test_an_axis_of_a_sweep_has_the_key_of_the_file() -> None:
    m = example("four-bar")
    result = jp.sweep(m, "joints.J1.clearance.radial", [0.2, 0.9], by={"joints.J3.clearance.radial": [0.2, 0.8]})
    (axes, _) = jp.plot.sweep(result, style=Style(width=COLUMN)).axes
    assert axes.get_xlabel() == "joints.J1.clearance.radial [mm]"
    assert axes.get_ylabel() == "joints.J3.clearance.radial [mm]"


@pytest.mark.parametrize("name", ["delta", "3-upu", "rssr", "excavator", "3-rrr"])
@pytest.mark.parametrize("width", [COLUMN, 170.0])
def test_names_keep_clear_of_one_another_and_of_the_axes_in_the_corner(name: str, width: float) -> None:
    figure = jp.plot.mechanism(example(name), style=Style("print", width=width))
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    boxes = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_text()}
    assert outside(figure) == []
    room = 0.5 * figure.dpi / 72.0
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        over = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(over) <= room, (one, other)


def test_a_line_of_a_title_does_not_end_within_a_value() -> None:
    text = "RSSR spatial linkage with four bars: configuration 0, theta = 42 deg of the crank"
    for wide in range(80, 400, 10):
        lines = wrapped(text, float(wide), 9.0).split("\n")
        assert " ".join(lines) == text
        assert any("theta = 42 deg" in line for line in lines)
    assert wrapped("a" * 99 + " = 3 deg", 60.0, 9.0).replace("\n", "").endswith("= 3 deg")


def test_results_are_light(plan: Result) -> None:
    """What is drawn leaves results as they are."""
    before = plan.copy(deep=True)
    jp.plot.map(plan, style=Style(log=True))
    assert plan.identical(before)


def test_numbers_of_legends_and_axes_are_no_computer_notation() -> None:
    """All of a boundary was 1e+02 %, and the end of the axis of singular values 1e-05."""
    region = jp.workspace(example("serial-2r"), count=11)
    region["share"].values[:] = 1.0
    (axes,) = jp.plot.workspace(region).axes
    assert all(text.get_text().endswith(" 100 %") for text in axes.get_legend().get_texts())
    figure = jp.plot.nearness(jp.singularities(example("slider-crank")))
    FigureCanvasAgg(figure).draw()
    assert {"10⁻⁵", "0.0001", "0.1"} <= {*marks(figure.axes[0])}
