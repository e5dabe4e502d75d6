"""The mechanism itself, with its clearances as large as one wants to see them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from jointplay import poses
from jointplay.analyses.nominal import Nominal, nominal
from jointplay.errors import InputError, shown
from jointplay.gaps import clearance_of
from jointplay.mobility import Attempt, attempt
from jointplay.model import Mechanism
from jointplay.result import Result
from jointplay.spec import JointSpec
from jointplay.typed import typed

from . import couplings, springs
from .names import write as write_names
from .spatial import Sketch
from .style import (
    COLOURS,
    GREY,
    OPEN,
    body_colour,
    canvas,
    check_exaggeration,
    on_ground,
    path_of_output,
    point_colour,
    single,
)

if TYPE_CHECKING:
    import xarray as xr

#: sizes on the drawing, as shares of its extent
PIN, SLIDER, SUPPORT = 0.008, 0.035, 0.03

Points = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@typed
def mechanism(
    m: Mechanism,
    configuration: int = 0,
    *,
    exaggerate: float = 0.0,
    result: Result | xr.Dataset | None = None,
    path: bool = True,
    names: bool = True,
    axes: Axes | None = None,
) -> Figure:
    """Draw a mechanism in one of its configurations.

    Parameters
    ----------
    m : Mechanism
    configuration : int
        Which, counted from 0.
    exaggerate : float
        Factor on the drawn pin clearances (in the plane) and errors; 0: they are not drawn.
    result : Dataset, optional
        Of `given` or `loaded`: the pins are drawn where they lie in their clearances, and the error of the output as an
        arrow.
    path : bool
        Draw the path of the output over all configurations.
    names : bool
        Write the names of the joints.
    axes : matplotlib axes, optional
    """
    check_exaggeration(exaggerate)
    at = nominal(m)
    if not 0 <= configuration < len(at):
        raise InputError(
            f"there is no configuration {shown(configuration)}; they go from 0 to {len(at) - 1}", file=m.file
        )
    found = None
    if not np.isfinite(at.poses[configuration]).all():
        at, found = _attempted(m, at, configuration)
    figure, axes = canvas(axes, 7.4, 5.0, projection(m))
    drawing = (Sketch if m.pose_size == poses.SPATIAL else _Drawing)(m, at, configuration, axes)
    if path and len(at) > 1:
        drawing.trace()
    drawing.bodies()
    drawing.joints()
    drawing.springs()
    if found is not None:
        drawing.gap(found)
    if exaggerate > 0:
        drawing.error(exaggerate, None if result is None else single(result))
    drawing.frame()
    if names:
        drawing.names()
    axes.set_title(m.title)
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    # In space the names of the axes stand beside them.
    beside = 1.12 if m.pose_size == poses.SPATIAL else 1.0
    axes.legend(unique.values(), unique.keys(), loc="upper left", bbox_to_anchor=(beside, 1.0))
    return figure


def _attempted(m: Mechanism, at: Nominal, configuration: int) -> tuple[Nominal, Attempt]:
    """The nearest attempt to assemble a configuration in the place of its poses."""
    missing = ~np.isfinite(at.poses).all(axis=(1, 2))
    before = [int(missing.argmax()) - 1] if missing.argmax() else []
    chosen = [*before, configuration]
    found = attempt(m, at.drives[chosen], at.poses[chosen])
    if found is None:
        raise InputError(f"configuration {configuration} is not assembled and cannot be drawn", file=m.file)
    placed = at.poses.copy()
    placed[configuration] = found.poses
    return replace(at, poses=placed), found


def projection(m: Mechanism) -> str | None:
    """What kind of axes a mechanism is drawn in: those of matplotlib's own choice, or in space."""
    return "3d" if m.pose_size == poses.SPATIAL else None


class _Drawing:
    """One configuration in file units."""

    def __init__(self, m: Mechanism, at: Nominal, configuration: int, axes: Axes) -> None:
        self.m, self.axes, self.configuration = m, axes, configuration
        self.poses = np.vstack([at.poses[configuration], np.zeros(3)])  # the ground has index -1
        self.spec = m.core_spec
        every = np.array([self.place(k) for k in range(len(self.spec["points"]))])
        self.path = path_of_output(m, at)[:, :2] / m.units.length
        every = np.vstack([every, self.path[np.isfinite(self.path).all(axis=1)]])
        self.extent = float(np.ptp(every, axis=0).max()) or 1.0

    def place(self, index: int) -> Points:
        """A point of the specification, ground axes."""
        point = self.spec["points"][index]
        placed: Points = poses.place(self.poses[point["body"]], point["at"])[:2] / self.m.units.length
        return placed

    def trace(self) -> None:
        """The path of the output over all configurations."""
        style: dict[str, Any] = {"color": GREY, "linewidth": 1.0, "linestyle": (0, (4, 2))}
        self.axes.plot(*self.path.T, label="path of the output", zorder=1, **style)

    def bodies(self) -> None:
        """Every body as the line or the plate through its points."""
        for b, name in enumerate(self.m.bodies):
            owner = self.m.owners[b]
            used = {joint[end] for joint in self.spec["joints"] for end in ("first", "second")}
            used.add(self.spec["output"]["point"])
            points = [self.place(k) for k in sorted(used) if self.spec["points"][k]["body"] == b]
            outline = hull(points)
            colour = body_colour(self.m, b)
            # A piece of an elastic body is drawn as that body, which has its own entry in the legend.
            label = name if name == owner else None
            if len(outline) > 2:
                self.axes.add_patch(
                    Polygon(outline, closed=True, facecolor=colour, edgecolor=colour, alpha=0.25, zorder=2)
                )
                self.axes.add_patch(
                    Polygon(outline, closed=True, fill=False, edgecolor=colour, linewidth=1.6, zorder=3)
                )
                self.axes.plot([], [], color=colour, linewidth=2.0, label=label)
            else:
                marker = "s" if len(outline) == 1 else ""
                self.axes.plot(*np.array(outline).T, color=colour, linewidth=2.4, marker=marker, label=label, zorder=3)

    def joints(self) -> None:
        """Pins as small circles, guides as lines with their slider, supports under what is fixed to the ground."""
        inner = {member.joint for member in self.m.members}
        for k, (joint, kind) in enumerate(zip(self.spec["joints"], self.m.joint_kinds, strict=True)):
            if k in inner:
                continue
            first, second = self.place(joint["first"]), self.place(joint["second"])
            if kind in ("prismatic", "pin_in_slot"):
                self._guide(joint, first, second, kind)
            if kind in ("revolute", "pin_in_slot"):
                self._pin(second)
            elif "coupling" in joint:
                self._coupling(joint, first, second)
            elif kind == "fixed":
                self.axes.plot(*second, marker="x", color="black", markersize=6, zorder=6)
            if self._grounded(joint):
                self._support(first)
        output = self.place(self.spec["output"]["point"])
        self.axes.plot(*output, marker="*", color="black", markersize=9, linestyle="", label="output", zorder=7)

    def springs(self) -> None:
        """Springs as zigzags, torsion springs as spirals."""
        ends = [(self.place(spring["first"]), self.place(spring["second"])) for spring in self.spec["springs"]]
        lines = [springs.zigzag(*pair, self.extent) for pair in ends]
        for spring in self.spec["torsions"]:
            centre = self.place(self.spec["joints"][spring["joint"]]["second"])
            lines.append(springs.spiral(centre, np.array([1.0, 0.0]), np.array([0.0, 1.0]), self.extent))
        for line in lines:
            self.axes.plot(*line.T, label="spring", zorder=5, **springs.STYLE)

    def _pin(self, place: Points) -> None:
        radius = PIN * self.extent
        self.axes.add_patch(Circle((place[0], place[1]), radius, facecolor="white", edgecolor="black", zorder=6))

    def names(self) -> None:
        """Names of the joints; those at one place in a row, riders of one pin under its name."""
        at: dict[tuple[float, ...], dict[str, None]] = {}
        inner = {member.joint for member in self.m.members}
        for k, (name, joint) in enumerate(zip(self.m.joints, self.spec["joints"], strict=True)):
            if k not in inner:
                x, y = np.round(self._named_at(joint) / self.extent, 3) * self.extent
                at.setdefault((float(x), float(y)), {})[name.split("/")[0]] = None
        joined = {place: ", ".join(names) for place, names in at.items()}
        # Equal scales give the axes their limits.
        self.axes.apply_aspect()
        outlines = [self._support_at(self.place(j["first"])) for j in self.spec["joints"] if self._grounded(j)]
        output = self.place(self.spec["output"]["point"])
        write_names(self.axes, joined, np.array(list(at)).reshape(-1, 2), np.vstack([output, *outlines]))

    def _grounded(self, joint: JointSpec) -> bool:
        """Whether a joint is drawn on a support."""
        return joint["kind"] in ("revolute", "fixed") and self.spec["points"][joint["first"]]["body"] == -1

    def _support_at(self, place: Points) -> Points:
        """Corners of the triangle of a support."""
        return place + SUPPORT * self.extent * np.array([[0.0, 0.0], [-0.8, -1.3], [0.8, -1.3]])

    def _support(self, place: Points) -> None:
        s = SUPPORT * self.extent
        corners = self._support_at(place)
        self.axes.add_patch(Polygon(corners, closed=True, facecolor="white", edgecolor=GREY, zorder=2))
        ground = np.array([place[0] - 1.2 * s, place[1] - 1.3 * s])
        self.axes.plot([ground[0], ground[0] + 2.4 * s], [ground[1]] * 2, color=GREY, linewidth=2.0, zorder=2)

    def _guide(self, joint: JointSpec, first: Points, second: Points, kind: str) -> None:
        along = couplings.direction(joint, self._turn(joint["first"]))
        across = np.array([-along[1], along[0]])
        reach = max(abs(float((second - first) @ along)), 1e-9) + 1.5 * SLIDER * self.extent
        ends = np.array(
            [first - SLIDER * self.extent * along, first + np.sign((second - first) @ along or 1.0) * reach * along]
        )
        colours = [point_colour(self.m, joint[end]) for end in ("first", "second")]
        self.axes.plot(*ends.T, color=colours[0], linewidth=1.4, linestyle="-.", zorder=1)
        if kind == "prismatic":
            a, b = SLIDER * self.extent, 0.5 * SLIDER * self.extent
            box = [second + sa * a * along + sb * b * across for sa, sb in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            self.axes.add_patch(
                Polygon(np.array(box), closed=True, facecolor="white", edgecolor=colours[1], linewidth=1.6, zorder=4)
            )

    def _coupling(self, joint: JointSpec, first: Points, second: Points) -> None:
        turns = (self._turn(joint["first"]), self._turn(joint["second"]))
        colours = (point_colour(self.m, joint["first"]), point_colour(self.m, joint["second"]))
        couplings.draw(self.axes, joint, (first, second), turns, colours, self.m.units.length)

    def _turn(self, point: int) -> float:
        """Angle of the body that carries a point, radians."""
        return float(self.poses[self.spec["points"][point]["body"]][2])

    def _named_at(self, joint: JointSpec) -> Points:
        """Where the name of a joint is written: a coupling's where it acts."""
        ends = (self.place(joint["first"]), self.place(joint["second"]))
        if "coupling" not in joint:
            return ends[1]
        along = couplings.direction(joint, self._turn(joint["first"]))
        return couplings.contact(joint, ends, along, self.m.units.length)

    def frame(self) -> None:
        """Equal scales along both axes, and their names."""
        unit = self.m.units.length_name
        self.axes.margins(0.08)
        self.axes.set_aspect("equal", adjustable="datalim")
        self.axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")

    def gap(self, found: Attempt) -> None:
        """The joints that stay open, from the one body's point to the other's."""
        for index, _, _ in found.open:
            joint = self.spec["joints"][index]
            ends = np.array([self.place(joint["first"]), self.place(joint["second"])])
            stays = f"{self.m.joints[index]} stays" if found.joint >= 0 else f"{len(found.open)} joints stay"
            self.axes.plot(*ends.T, label=f"{stays} open", **OPEN)

    def error(self, exaggerate: float, result: Result | None) -> None:
        """The disc that each pin can use, where the pin lies in it, and the error of the output."""
        label = f"clearance, {exaggerate:g} times"
        for number, source in enumerate(self.spec["sources"]):
            if source["kind"] != "clearance" or "disc" not in source["set"]:
                continue
            joint = self.spec["joints"][source["joint"]]
            x, y = self.place(joint["first"])
            radius = clearance_of(self.m, number)[1]["radius"] / self.m.units.length * exaggerate
            self.axes.add_patch(
                Circle((x, y), radius, facecolor=COLOURS[1], edgecolor=COLOURS[3], alpha=0.35, zorder=5, label=label)
            )
            if result is not None and "offset" in result.data:
                offset = self._offset(source["joint"], result)
                self.axes.plot(
                    x + exaggerate * offset[0], y + exaggerate * offset[1], marker="o", markersize=4, color=COLOURS[3],
                    linestyle="", label="pin in its clearance", zorder=8,
                )  # fmt: skip
        if result is not None and "error" in result.data:
            tail = self.place(self.spec["output"]["point"])
            error = [result.get("error", component=c)[self.configuration] for c in ("x", "y")]
            head = tail + exaggerate * on_ground(self.m, self.poses, np.array(error))
            arrow = {"arrowstyle": "-|>", "color": COLOURS[3], "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
            self.axes.annotate("", xy=(head[0], head[1]), xytext=(tail[0], tail[1]), arrowprops=arrow, zorder=9)
            self.axes.plot([], [], color=COLOURS[3], label=f"error, {exaggerate:g} times")
            self.axes.update_datalim([head])

    def _offset(self, index: int, result: Result) -> Points:
        """Where a pin lies in its disc, ground axes; that of a locked one is given in the axes of its joint."""
        name, joint = self.m.joints[index], self.spec["joints"][index]
        along = ("x", "y") if joint["kind"] == "revolute" else ("along", "normal")
        offset = np.array([result.get("offset", parameter=f"{name}.{c}")[self.configuration] for c in along])
        if joint["kind"] == "revolute":
            return offset
        c, s, _ = poses.matrix(self.poses[self.spec["points"][joint["first"]]["body"]]) @ joint["axis_first"]
        turned: Points = np.array([[c, -s], [s, c]]) @ offset
        return turned


def hull(points: list[Points]) -> Points:
    """The convex outline of a body's points (Andrew's monotone chain)."""
    unique = sorted({(round(float(x), 9), round(float(y), 9)) for x, y in points})
    if len(unique) < 3:
        return np.array(unique)

    def chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for p in ordered:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], p) <= 0:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return np.array(chain(unique) + chain(unique[::-1]))


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
