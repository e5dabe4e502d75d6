"""The figures of the page: figures 10 to 27 of the paper in combined drawings.

Colours are those of Okabe and Ito, and every series also has its own marker or dash, so that the drawings survive
colour blindness and a black-and-white printer.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from . import published, rings
from .exact import Answers, Study
from .published import POSITIONS, Floats

BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#6b6b6b"
SERIES = ((BLUE, "o", "-"), (ORANGE, "s", "--"), (GREEN, "^", "-."), (RED, "D", ":"), (GREY, "v", "-"))
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.markersize": 4,
    "svg.hashsalt": "paper-1",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.08,
}
SHOWN = (0, 5, 10)
WHERE = np.arange(len(POSITIONS))


def _positions(axes: Axes) -> None:
    axes.set_xticks(WHERE, POSITIONS)
    axes.tick_params(axis="x", labelsize=7.5)
    axes.set_xlabel("position on the path")


def _surface(
    figure: Figure, place: tuple[int, int, int], study: Answers, values: Floats, title: str, label: str
) -> None:
    axes: Any = figure.add_subplot(*place, projection="3d")
    axes.plot_surface(WHERE[None, :], study.radii[:, None], values, cmap="cividis", edgecolor="white", linewidth=0.3)
    axes.set_xticks(WHERE[::5], [POSITIONS[i] for i in SHOWN])
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.locator_params(axis="z", nbins=4)
    axes.set(xlabel="position", ylabel="radial link [mm]", zlabel=label)
    axes.set_title(title)
    axes.view_init(elev=24, azim=-128)
    axes.set_box_aspect((1.0, 1.0, 0.8), zoom=0.9)


def _by_position(axes: Axes, answers: Answers, values: Floats, title: str, label: str) -> None:
    for k, (colour, marker, dash) in enumerate(SERIES, start=1):
        i = k * (len(answers.radii) - 1) // len(SERIES)
        axes.plot(WHERE, values[i], color=colour, marker=marker, ls=dash, label=f"r = {answers.radii[i]:g} mm")
    axes.set_title(title)
    axes.set_ylabel(label)
    _positions(axes)


def trajectories(study: Study) -> Figure:
    """Figures 10 and 16: the path, the displaced points, and everything that the play really allows."""
    figure = Figure(figsize=(9.2, 4.0))
    for k, (answers, table, title) in enumerate(
        ((study.four_bar, 2, "4R: figure 10 of the paper"), (study.p3r, 4, "P3R: figure 16 of the paper"))
    ):
        axes = figure.add_subplot(1, 2, k + 1)
        x, y = answers.nominal[:, 0], answers.nominal[:, 1]
        axes.plot(x, y, color=BLUE, marker="o", label="nominal, ours")
        axes.plot(
            published.column(table, "x_mm"),
            published.column(table, "y_mm"),
            ls="",
            marker="+",
            ms=9,
            color="black",
            label="desired, printed",
        )
        axes.plot(
            published.column(table, "x_deviated_mm"),
            published.column(table, "y_deviated_mm"),
            color=ORANGE,
            marker="s",
            ls="--",
            label="deviated, printed",
        )
        for i in range(len(POSITIONS)):
            border = rings.outline(*rings.output_ties(answers.drive_unit, float(answers.drives[i]), 1.0))
            axes.fill(*border.T, facecolor=BLUE, alpha=0.2, label="all that the play allows" if i == 0 else None)
        axes.plot(
            *(answers.nominal[:, :2] + answers.farthest).T, color=RED, marker="D", ls="", label="largest error, exact"
        )
        for i in SHOWN:
            axes.annotate(POSITIONS[i], (x[i], y[i]), xytext=(-16, -18), textcoords="offset points", ha="right")
        axes.set(xlabel="x [mm]", ylabel="y [mm]", title=title, aspect="equal", xlim=(-41, 31), ylim=(79, 139))
        axes.legend(loc="lower left")
    return figure


def reach(study: Study) -> Figure:
    """Where the coupler joint can be at all, and where the displaced point of the paper lies."""
    figure = Figure(figsize=(9.2, 6.2))
    axes_of: Any = figure.subplots(2, 3, sharex=True, sharey=True)
    radial = 1.0
    for row, answers in enumerate((study.four_bar, study.p3r)):
        for col, i in enumerate(SHOWN):
            axes: Axes = axes_of[row, col]
            drive = float(answers.drives[i])
            for (colour, _, dash), ties, label in zip(
                SERIES,
                (rings.output_ties, rings.other_pin_ties),
                ("pin centre on the rocker (output)", "pin centre on the other link"),
                strict=False,
            ):
                region = ties(answers.drive_unit, drive, radial)
                border = rings.outline(*region) - rings.nominal(*region)
                axes.fill(*border.T, facecolor=colour, alpha=0.18)
                axes.plot(*np.vstack([border, border[:1]]).T, color=colour, ls=dash, label=label)
            axes.plot(0, 0, marker="+", color="black", ms=8, ls="", label="nominal")
            axes.plot(2 * radial, 0, marker="s", color=RED, ms=6, ls="", label="displaced point of the paper")
            axes.plot(*answers.farthest[i, :2], marker="D", color=BLUE, ls="", label="largest error (jp.worst)")
            axes.set(title=f"{answers.name}, {POSITIONS[i]}", aspect="equal", xlim=(-4.9, 4.9), ylim=(-4.9, 4.9))
            if row == 1:
                axes.set_xlabel("displacement along x [mm]")
            if col == 0:
                axes.set_ylabel("displacement along y [mm]")
    figure.legend(*axes_of[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def position_error(study: Study) -> Figure:
    """Figures 11 to 13 and 17 to 19: position error against position, against radial link, and over both."""
    figure = Figure(figsize=(10.4, 6.6))
    for row, (answers, numbers) in enumerate(((study.four_bar, (11, 12, 13)), (study.p3r, (17, 18, 19)))):
        top = 1.1 * float(max(study.four_bar.position_by_radius.max(), study.p3r.position_by_radius.max()))
        axes = figure.add_subplot(2, 3, 3 * row + 1)
        _by_position(
            axes,
            answers,
            answers.position_by_radius,
            f"{answers.name}: figure {numbers[0]}",
            "largest position error [mm]",
        )
        axes.axhline(2.0, color="black", lw=1.2, ls=(0, (1, 2)), label="printed, r = 1 mm")
        axes.set_ylim(0, top * 1.35)
        axes.legend(ncols=3, loc="upper center", fontsize=7, columnspacing=1.0)
        axes = figure.add_subplot(2, 3, 3 * row + 2)
        for i, (colour, marker, dash) in zip(SHOWN, SERIES, strict=False):
            axes.plot(
                answers.radii,
                answers.position_by_radius[:, i],
                color=colour,
                marker=marker,
                ls=dash,
                label=POSITIONS[i],
            )
        axes.plot(answers.radii, 2 * answers.radii, color="black", ls=(0, (1, 2)), label="printed, all positions")
        axes.set(
            title=f"{answers.name}: figure {numbers[1]}",
            xlabel="radial link [mm]",
            ylabel="largest position error [mm]",
            ylim=(0, top * 1.05),
        )
        axes.legend()
        _surface(
            figure,
            (2, 3, 3 * row + 3),
            answers,
            answers.position_by_radius,
            f"{answers.name}: figure {numbers[2]}",
            "largest error [mm]",
        )
    return figure


def rotation_error(study: Study) -> Figure:
    """Figures 14, 15, 20, 21, 26 and 27: orientation error against position and over position and radial link."""
    figure = Figure(figsize=(10.4, 6.6))
    for row, (answers, table, numbers) in enumerate(((study.four_bar, 3, (14, 15, 26)), (study.p3r, 5, (20, 21, 27)))):
        top = 1.1 * float(max(study.four_bar.rotation.max(), study.p3r.rotation.max()))
        axes = figure.add_subplot(2, 3, 3 * row + 1)
        axes.plot(WHERE, answers.rotation, color=BLUE, marker="o", label="exact largest rotation")
        axes.plot(WHERE, answers.rotation_first_order, color=GREEN, ls="", marker="x", ms=6, label="first order")
        axes.plot(WHERE, published.column(table, "error_deg"), color=ORANGE, marker="s", ls="--", label="printed")
        axes.set(
            title=f"{answers.name}, r = 1 mm: figure {numbers[0]}",
            ylabel="orientation error [deg]",
            ylim=(0, top * 1.05),
        )
        _positions(axes)
        axes.legend(loc="lower left")
        axes = figure.add_subplot(2, 3, 3 * row + 2)
        _by_position(
            axes, answers, answers.rotation_by_radius, f"{answers.name}: figure {numbers[2]}", "largest rotation [deg]"
        )
        axes.set_ylim(0, top * 1.3)
        axes.legend(ncols=3, loc="upper center", fontsize=7, columnspacing=1.0)
        _surface(
            figure,
            (2, 3, 3 * row + 3),
            answers,
            answers.rotation_by_radius,
            f"{answers.name}: figure {numbers[1]}",
            "largest rotation [deg]",
        )
    return figure


def cad(study: Study) -> Figure:
    """Figures 22 and 23: the mechanisms at P1 and P11; enlarged, the displaced point and the reach of the rocker."""
    figure = Figure(figsize=(9.6, 6.4))
    axes_of: Any = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, answers in enumerate((study.four_bar, study.p3r)):
        for col, i in enumerate((0, 10)):
            axes: Axes = axes_of[row, col]
            home = answers.nominal[i, :2]
            links = np.array([[0.0, 0.0], home, rings.PIVOT])
            if answers.drive_unit == "deg":
                links = np.insert(links, 1, rings.tie_to_crank(float(answers.drives[i]), 0.0).centre, axis=0)
            axes.plot(*links.T, color=BLUE, lw=2, marker="o", mfc="white", ms=6)
            axes.text(
                0.02,
                0.97,
                f"({home[0]:.3f}, {home[1]:.3f}) mm, {answers.nominal[i, 2]:.2f}°",
                transform=axes.transAxes,
                va="top",
                fontsize=8,
            )
            axes.set(
                title=f"{answers.name}, {POSITIONS[i]}: figures 22 and 23",
                aspect="equal",
                xlim=(-112, 205),
                ylim=(-12, 178),
            )
            _enlarged_joint(axes.inset_axes((0.66, 0.3, 0.33, 0.55)), answers, i)
            if row == 1:
                axes.set_xlabel("x [mm]")
            if col == 0:
                axes.set_ylabel("y [mm]")
    figure.legend(*axes_of[0, 0].child_axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _enlarged_joint(axes: Axes, answers: Answers, i: int) -> None:
    home = answers.nominal[i, :2]
    angle = np.radians(answers.nominal[i, 2] + np.linspace(-3.5, 3.5, 40))
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    band = np.vstack([rings.PIVOT + 149.0 * ray, (rings.PIVOT + 151.0 * ray)[::-1]]) - home
    axes.fill(*band.T, facecolor=BLUE, alpha=0.2, label="150 ± 1 mm from the rocker pivot")
    axes.plot(0, 0, marker="o", mfc="white", color=BLUE, ms=6, ls="", label="nominal")
    axes.plot(2, 0, marker="s", color=RED, ms=5, ls="", label="deviated, printed")
    axes.plot(*answers.toward_x[i, :2], marker="D", color=GREEN, ms=5, ls="", label="farthest along +x, ours")
    axes.set(
        xlim=(-4.8, 4.8), ylim=(-4.8, 4.8), aspect="equal", facecolor="white", xticks=[-4, 0, 4], yticks=[-4, 0, 4]
    )
    axes.tick_params(labelsize=7)
    axes.set_xlabel("Δx [mm]", fontsize=7, labelpad=1)
    axes.set_ylabel("Δy [mm]", fontsize=7, labelpad=-4)


def compensation(study: Study) -> Figure:
    """Figures 24 and 25: the drive correction, printed and needed; below it the position error that is left."""
    figure = Figure(figsize=(9.6, 8.4))
    axes_of: Any = figure.subplots(3, 2, sharex=True)
    cases = (
        (0, 0, study.four_bar, 0.2, 24),
        (0, 1, study.p3r, 0.2, 24),
        (1, 0, study.four_bar, 1.0, 25),
        (1, 1, study.p3r, 1.0, 25),
    )
    for row, col, answers, radial, number in cases:
        axes: Axes = axes_of[row, col]
        fix = answers.corrections[radial]
        axes.plot(
            WHERE, fix.printed - answers.drives, color=ORANGE, marker="s", ls="--", label="printed drive − nominal"
        )
        axes.plot(
            WHERE,
            fix.rule - answers.drives,
            color=GREY,
            marker="x",
            ls=":",
            label="rule of the paper" if col == 0 else "cosine theorem at θ₃′",
        )
        axes.plot(
            WHERE, fix.ours - answers.drives, color=BLUE, marker="o", label="brings the output back (jp.compensate)"
        )
        axes.axhline(0, color="black", lw=0.8)
        axes.set(
            title=f"{answers.name}, r = {radial:g} mm: figure {number}", ylabel=f"drive change [{answers.drive_unit}]"
        )
    for col, answers in enumerate((study.four_bar, study.p3r)):
        axes = axes_of[2, col]
        fix = answers.corrections[1.0]
        for values, (colour, marker, dash), label in (
            (fix.error_held, (GREEN, "^", "-."), "drive not corrected"),
            (fix.error_printed, (ORANGE, "s", "--"), "printed drive"),
            (fix.error_reversed, (RED, "D", ":"), "printed correction, sign reversed"),
            (fix.error_ours, (BLUE, "o", "-"), "corrected by jp.compensate"),
        ):
            axes.plot(WHERE, values, color=colour, marker=marker, ls=dash, label=label)
        axes.set(title=f"{answers.name}, r = 1 mm: what the correction leaves", ylabel="position error [mm]")
        axes.set_ylim(0, None)
        _positions(axes)
    for col in (0, 1):
        axes_of[0, col].legend(loc=("center right", "lower left")[col])
    figure.legend(*axes_of[2, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


FIGURES: dict[str, Callable[[Study], Figure]] = {
    "trajectories": trajectories,
    "reach": reach,
    "position-error": position_error,
    "rotation-error": rotation_error,
    "cad": cad,
    "compensation": compensation,
}


def draw_all(study: Study, folder: Path) -> None:
    """Write every figure as SVG; the same study gives the same bytes with the same matplotlib."""
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, draw in FIGURES.items():
            draw(study).savefig(folder / f"paper-1-{name}.svg", metadata={"Date": None})
