"""One configuration of a mechanism as seen along a direction: what plans, views and solid drawings share.

A point p is drawn at (right . p, up . p), and right x up looks at the viewer; right . p of all points is `View.flat`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import AXIS_ON, ENDS, SIDE_ON, End, JointSpec
from jointplay.model.mobility import Attempt
from jointplay.result import Result

from . import springs
from .bodies import body_colour, drawn_outline, on_ground, outline, path_of_output, put_outline
from .clearances import DrawnClearance, shapes
from .names import write as write_names
from .style import alarm, scaled, theme

if TYPE_CHECKING:
    from jointplay.analyses.nominal import Nominal
    from jointplay.model.mechanism import Mechanism

#: lower left and upper right corner of a drawing
Corners = tuple[Floats, Floats]
#: points nearer to a line than this share of the mechanism are on it
STRAIGHT = 1e-6
#: size of the star at the output, points: its core is as large as a pin on a wide drawing
STAR = 13.0
#: what is left of the colour of a pose that stands behind
BEHIND = 0.3


class Sight(NamedTuple):
    """A direction of sight."""

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]

    def flat(self, points: Floats) -> Floats:
        """Places on the drawing; the last axis holds three coordinates."""
        return np.asarray(points @ np.array([self.right, self.up]).T)

    @property
    def towards(self) -> Floats:
        """Unit vector to the viewer."""
        return np.cross(self.right, self.up)


PLAN = Sight("plan", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


class Scene(ABC):
    """One configuration in file units.

    What is drawn at `below_joints` is covered by the marks of joints.

    Parameters
    ----------
    m : Mechanism
    at : Nominal
    configuration : int
    axes : matplotlib axes
    view : Sight
    moved : pair of ndarray, optional
        Poses of the bodies, and places of the points on them, to draw in place of the nominal ones, with `times` their
        difference from these.
    times : float
    """

    def __init__(
        self,
        m: Mechanism,
        at: Nominal,
        configuration: int,
        axes: Axes,
        view: Sight,
        moved: tuple[Floats, Floats] | None = None,
        times: float = 1.0,
    ) -> None:
        self.m, self.axes, self.configuration, self.view = m, axes, configuration, view
        self.spec = m.core_spec
        ground = poses.ground(m.pose_size)
        self.poses = np.vstack([at.poses[configuration], ground])  # the ground has index -1
        self.places = places(m, self.poses)
        self.path = path_of_output(m, at) / m.units.length
        every = np.vstack([self.places, self.path[np.isfinite(self.path).all(axis=1)]])
        self.extent = float(np.ptp(every, axis=0).max()) or 1.0
        #: poses in the place of the nominal ones, and how many times the way to them is drawn
        self.moved, self.times = self.poses, times
        if moved is not None:
            self.moved = np.vstack([moved[0], ground])
            self.places = self.places + times * (places(m, self.moved, moved[1]) - self.places)
        inner = {member.joint for member in m.members}
        #: joints of the file; the pieces of elastic bodies hang together by others
        self.joints_drawn = [
            (k, joint) for k, joint in enumerate(self.spec["joints"]) if k not in inner and "follows" not in joint
        ]

    #: order in which joints are drawn, a little less
    below_joints = 5.9

    @abstractmethod
    def bodies(self) -> None:
        """Every body."""

    @abstractmethod
    def joints(self) -> None:
        """Every joint."""

    @abstractmethod
    def pins(self, times: float, result: Result) -> None:
        """Where each pin lies in its clearance."""

    def line(self, points: Floats, **look: Any) -> None:
        """A line through points of three coordinates."""
        self.axes.plot(*self.view.flat(np.asarray(points)).T, **look)

    def body_of(self, point: int) -> int:
        """The body that carries a point, by its index."""
        return self.m.points[point].body

    def tint(self, body: int) -> str:
        """The colour of a body."""
        return body_colour(self.m, body)

    def colour_of(self, point: int) -> str:
        """The colour of the body that carries a point."""
        return self.tint(self.body_of(point))

    def outline(self, body: int) -> Floats:
        """The corners of a body, in turn and closed; two points of one that is a line, one of a mere point."""
        used = {point for points in self.m.joint_points for point in points} | {self.m.output_point}
        points = self.places[[k for k in sorted(used) if self.body_of(k) == body]]
        if not len(points):
            return np.zeros((0, 3))
        found = outline(points, STRAIGHT * self.extent)
        return found[:1] if np.ptp(found, axis=0).max() <= STRAIGHT * self.extent else found

    def contour(self, body: int) -> None:
        """What the file says is the outline of a body."""
        here, there = (contour(self.m, at, body) for at in (self.poses, self.moved))
        lines = [self.view.flat(a + self.times * (b - a)) for a, b in zip(here, there, strict=True)]
        put_outline(self.axes, lines, self.tint(body))

    def label(self, body: int) -> str | None:
        """What the legend calls a body; a piece of an elastic body is drawn as that body."""
        if body == -1:
            return "ground"
        name = self.m.bodies[body]
        return name if name == self.m.owners[body] else None

    def frame_of(self, joint: JointSpec, end: End = "first") -> tuple[Floats, Floats]:
        """Axis and side of a joint as one of its bodies carries them, ground axes."""
        turn = poses.matrix(self.poses[self.body_of(joint[end])])
        side = joint.get(SIDE_ON[end])
        return turn @ np.array(joint[AXIS_ON[end]]), turn @ np.array(side if side is not None else [0.0, 0.0, 1.0])

    def ghost(self) -> None:
        """The bodies alone, light, as a pose that stands behind another."""
        for body in range(len(self.m.bodies)):
            corners = self.outline(body)
            if len(corners) > 1:
                self.line(corners, color=body_colour(self.m, body), alpha=BEHIND, linewidth=scaled(1.6), zorder=1)

    def trace(self) -> None:
        """The path of the output over all configurations."""
        look: dict[str, Any] = {"color": theme().grey, "linewidth": 1.0, "linestyle": (0, (4, 2))}
        self.line(self.path, label="path of the output", zorder=1, **look)

    def output(self) -> None:
        """The output point."""
        place = self.places[self.m.output_point][None]
        look = {"marker": "*", "color": theme().ink, "markersize": scaled(STAR), "linestyle": ""}
        # A pin there is seen in the middle of the star, and what is as dark as the star beside its edge.
        look |= {"markeredgecolor": theme().paper, "markeredgewidth": scaled(0.8)}
        self.line(place, label="output", zorder=self.below_joints, **look)

    def springs(self) -> None:
        """Springs as zigzags or rings, torsion springs as spirals."""
        pairs = [(self.places[spring["first"]], self.places[spring["second"]]) for spring in self.spec["springs"]]
        lines = [springs.zigzag(*pair, self.extent) for pair in pairs]
        for spring in self.spec["torsions"]:
            joint = self.spec["joints"][spring["joint"]]
            axis, side = self.frame_of(joint)
            x, y = (side, np.cross(axis, side)) if self.m.pose_size == poses.SPATIAL else np.eye(3)[:2]
            lines.append(springs.spiral(self.places[joint["second"]], x, y, self.extent))
        for line in lines:
            self.line(line, label="spring", zorder=5, color=theme().ink, **springs.STYLE)

    def gap(self, found: Attempt) -> None:
        """The joints that stay open, from the one body's point to the other's."""
        for index, _, _ in found.open:
            joint = self.spec["joints"][index]
            stays = f"{self.m.joints[index]} stays" if found.joint >= 0 else f"{len(found.open)} joints stay"
            self.line(self.places[[joint["first"], joint["second"]]], label=f"{stays} open", **alarm())

    def clearances(self, times: float) -> None:
        """What every clearance allows, so many times as large."""
        for shape in shapes(self.m, self.poses, self.places):
            self._clearance(shape, times)

    def _clearance(self, shape: DrawnClearance, times: float) -> None:
        corners = self.view.flat(shape.middle + times * (shape.points / self.m.units.length))
        corners = outline(corners, 0.0)
        colours = theme().colours
        look = {"facecolor": colours[1], "edgecolor": colours[3 % len(colours)], "alpha": 0.4}
        self.axes.add_patch(Polygon(corners, closed=True, label=f"clearance, {times:g} times", zorder=5, **look))

    def error(self, times: float, result: Result) -> None:
        """The position error of the output as an arrow."""
        if "error" not in result.data:
            return
        axes = ("x", "y", "z")[: 3 if self.m.pose_size == poses.SPATIAL else 2]
        found: Floats = np.zeros(3)
        found[: len(axes)] = [result.get("error", component=c)[self.configuration] for c in axes]
        found = on_ground(self.m, self.poses, found)
        if not np.isfinite(found).all():
            return
        tail = self.places[self.m.output_point]
        head, tail = self.view.flat(tail + times * found), self.view.flat(tail)
        colour = theme().colours[3 % len(theme().colours)]
        look = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", xy=tuple(head), xytext=tuple(tail), arrowprops=look, zorder=9)
        self.axes.plot([], [], color=colour, label=f"error, {times:g} times")
        self.axes.update_datalim([head])
        self.axes.autoscale_view()

    def hold(self, limits: Corners | None) -> None:
        """Equal scales along both axes, around all that is drawn or between two corners."""
        if limits is None:
            self.axes.margins(0.08)
            self.axes.set_aspect("equal", adjustable="datalim")
            self.axes.autoscale_view()
        else:
            (left, low), (right, high) = limits
            self.axes.set(xlim=(left, right), ylim=(low, high))
            self.axes.set_aspect("equal", adjustable="box")

    def frame(self, limits: Corners | None = None) -> None:
        """Axes with equal scales, and their names."""
        unit = self.m.units.length_name
        self.hold(limits)
        across, up = ("xyz"[int(np.argmax(axis))] for axis in (self.view.right, self.view.up))
        self.axes.set(xlabel=f"{across} [{unit}]", ylabel=f"{up} [{unit}]")

    def named_at(self, joint: JointSpec) -> Floats:
        """Where the name of a joint is written."""
        place: Floats = self.places[joint["second"]]
        return place

    def obstacles(self) -> Floats:
        """Places beside those of the joints that names should not hide."""
        return self.view.flat(self.places[self.m.output_point][None])

    def names(self) -> None:
        """Names of the joints; those at one place in a row, riders of one pin under its name."""
        at: dict[tuple[float, ...], dict[str, None]] = {}
        for k, joint in self.joints_drawn:
            x, y = np.round(self.view.flat(self.named_at(joint)) / self.extent, 3) * self.extent
            at.setdefault((float(x), float(y)), {})[written(self.m, k)] = None
        joined: Mapping[tuple[float, ...], str] = {place: ", ".join(names) for place, names in at.items()}
        # Equal scales give the axes their limits.
        self.axes.apply_aspect()
        write_names(self.axes, joined, np.array(list(at)).reshape(-1, 2), self.obstacles())


def written(m: Mechanism, joint: int) -> str:
    """The name of a joint on a drawing: riders of one pin, and both axes of a cross, are one."""
    name = m.joints[joint].split("/")[0]
    whole, _, part = name.rpartition(".")
    return whole if part in ("first", "second") and whole and m.joint_kinds[joint] == "revolute" else name


def contour(m: Mechanism, at: Floats, body: int) -> list[Floats]:
    """The outline of a body that the file has, ground axes, file units; the poses end with that of the ground."""
    turn, start = poses.matrix(at[body]).T, poses.position(at[body])
    return [(line @ turn + start) / m.units.length for line in drawn_outline(m, body)]


def wheels(m: Mechanism) -> list[tuple[int, float]]:
    """The point in the middle of every wheel, and its radius in file units."""
    couplings = [joint for joint in m.core_spec["joints"] if "radii" in joint.get("coupling", {})]
    return [
        (joint[end], abs(radius) / m.units.length)
        for joint in couplings
        for end, radius in zip(ENDS, joint["coupling"]["radii"], strict=False)
    ]


def drawn_points(m: Mechanism, at: Floats) -> Floats:
    """All points of the specification and of outlines, as `places` and `contour` have them."""
    lines = [line for body in range(-1, len(m.bodies)) for line in contour(m, at, body)]
    return np.concatenate([places(m, at), *lines])


def places(m: Mechanism, at: Floats, on_bodies: Floats | None = None) -> Floats:
    """All points of the specification, ground axes, file units; the poses end with that of the ground.

    They may be elsewhere on their bodies, shape (point, 3), SI.
    """
    own = on_bodies if on_bodies is not None else [point.at for point in m.points]
    found = [poses.place(at[point.body], here) for point, here in zip(m.points, own, strict=True)]
    return np.asarray(found).reshape(-1, 3) / m.units.length
