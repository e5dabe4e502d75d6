"""A sketch of a mechanism in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from mpl_toolkits.mplot3d import proj3d  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from jointplay import poses
from jointplay.mobility import Attempt
from jointplay.result import Result
from jointplay.spec import AXIS_ON, ENDS, SIDE_ON, End, JointSpec

from . import couplings, springs
from .names import write as write_names
from .style import COLOURS, GREY, OPEN, body_colour, on_ground, path_of_output, point_colour

if TYPE_CHECKING:
    from jointplay.analyses.nominal import Nominal
    from jointplay.model import Mechanism

#: half the length of an axis on the drawing, as a share of its extent
AXIS = 0.04
#: how joints without an axis are marked
MARKERS = {"spherical": "o", "fixed": "x"}
SLIDING = ("prismatic", "cylindrical")
WHEELS = ("gear", "rack", "belt")

Points = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


class Sketch:
    """One configuration in file units: bodies as lines and plates, axes of joints as short lines."""

    def __init__(self, m: Mechanism, at: Nominal, configuration: int, axes: Any) -> None:
        self.m, self.axes, self.configuration = m, axes, configuration
        self.spec = m.core_spec
        self.poses = np.vstack([at.poses[configuration], poses.ground(m.pose_size)])  # the ground has index -1
        self.places = np.array([self._place(k) for k in range(len(self.spec["points"]))])
        self.path = path_of_output(m, at) / m.units.length
        every = np.vstack([self.places, self.path[np.isfinite(self.path).all(axis=1)]])
        self.extent = float(np.ptp(every, axis=0).max()) or 1.0
        self.every = every
        #: names of the joints by their places
        self.named: dict[tuple[float, ...], list[str]] = {}

    def _place(self, index: int) -> Points:
        point = self.spec["points"][index]
        placed: Points = poses.place(self.poses[point["body"]], point["at"]) / self.m.units.length
        return placed

    def trace(self) -> None:
        """The path of the output over all configurations."""
        style = {"color": GREY, "linewidth": 1.0, "linestyle": (0, (4, 2))}
        self.axes.plot(*self.path.T, label="path of the output", **style)

    def bodies(self) -> None:
        """Every body as the line or the plate through its points; the ground as a plate of dashes."""
        used = sorted({joint[end] for joint in self.spec["joints"] for end in ("first", "second")})
        output = self.spec["output"]["point"]
        for body, name in [(-1, "ground"), *enumerate(self.m.bodies)]:
            points = [self.places[k] for k in used if self.spec["points"][k]["body"] == body]
            if self.spec["points"][output]["body"] == body and len(points) < 3:
                points.append(self.places[output])
            outline = _outline(np.array(points), self.extent)
            owner = name if body == -1 else self.m.owners[body]
            colour = body_colour(self.m, body)
            # A cross has no size of its own; a piece of an elastic body is drawn as that body.
            label = name if len(outline) > 1 and name == owner else None
            style = "--" if body == -1 else "-"
            closed = np.vstack([outline, outline[:1]]) if len(outline) > 2 else outline
            self.axes.plot(*closed.T, color=colour, linewidth=1.8, linestyle=style, label=label)
            if len(outline) > 2 and body != -1:
                self.axes.add_collection3d(Poly3DCollection([outline], facecolor=colour, alpha=0.2))

    def joints(self) -> None:
        """Axes of joints as short lines, those of guides dotted; balls and locked joints as marks."""
        inner = {member.joint for member in self.m.members}
        for k, (name, joint) in enumerate(zip(self.m.joints, self.spec["joints"], strict=True)):
            if k in inner:
                continue
            place = self.places[joint["second"]]
            if joint["kind"] in MARKERS:
                marker = MARKERS[joint["kind"]]
                self.axes.plot(*place[:, None], marker=marker, color="black", markerfacecolor="white", linestyle="")
            elif joint["kind"] in WHEELS:
                place = self._wheels(joint)
            else:
                self._axis(joint, place)
            self.named.setdefault(tuple((np.round(place / self.extent, 3) * self.extent).tolist()), []).append(name)
        output = self.places[self.spec["output"]["point"]]
        self.axes.plot(*output[:, None], marker="*", color="black", markersize=9, linestyle="", label="output")

    def names(self) -> None:
        """Names of the joints, when the axes have their limits."""
        places = np.array(list(self.named)).reshape(-1, 3)
        x, y, _ = proj3d.proj_transform(*places.T, self.axes.get_proj())
        joined = {place: ", ".join(names) for place, names in self.named.items()}
        write_names(self.axes, joined, np.stack([x, y], axis=1))

    def springs(self) -> None:
        """Springs as zigzags, torsion springs as spirals about the axes of their joints."""
        pairs = [(self.places[spring["first"]], self.places[spring["second"]]) for spring in self.spec["springs"]]
        lines = [springs.zigzag(*pair, self.extent) for pair in pairs]
        for spring in self.spec["torsions"]:
            joint = self.spec["joints"][spring["joint"]]
            axis, side = self._frame(joint, "first")
            lines.append(springs.spiral(self.places[joint["second"]], side, np.cross(axis, side), self.extent))
        for line in lines:
            self.axes.plot(*line.T, label="spring", **springs.STYLE)

    def _axis(self, joint: JointSpec, place: Points) -> None:
        """The axis of a joint; of a guide or screw the line from the one body's point to the other's, too."""
        along = AXIS * self.extent * self._frame(joint, "first")[0]
        ends = np.stack([self.places[joint["first"]], place])
        slides = joint["kind"] in SLIDING
        if slides:
            self.axes.plot(*ends.T, color=point_colour(self.m, joint["second"]), linewidth=1.4, linestyle="-.")
        elif joint["kind"] == "screw":
            body = self.spec["points"][joint["first"]]["body"]
            label = None if body == -1 else self.m.bodies[body]
            self.axes.plot(*ends.T, color=point_colour(self.m, joint["first"]), linewidth=2.4, label=label)
        ends = np.stack([place - along, place + along])
        self.axes.plot(*ends.T, color="black", linewidth=2.2, linestyle=":" if slides else "-")

    def _wheels(self, joint: JointSpec) -> Points:
        """A gear pair, rack or belt; gives the place of its name."""
        ends = (self.places[joint["first"]], self.places[joint["second"]])
        frames = (self._frame(joint, "first"), self._frame(joint, "second"))
        colours = (point_colour(self.m, joint["first"]), point_colour(self.m, joint["second"]))
        for end, colour in zip(ENDS, colours, strict=True):
            body = self.spec["points"][joint[end]]["body"]
            self.axes.plot([], [], [], color=colour, label=None if body == -1 else self.m.owners[body])
        couplings.draw_in_space(self.axes, joint, ends, frames, colours, self.m.units.length)
        return couplings.contact(joint, ends, frames[0][1], self.m.units.length)

    def _frame(self, joint: JointSpec, end: End) -> tuple[Points, Points]:
        """Axis and side of a joint as one of its bodies carries them, ground axes."""
        turn = poses.matrix(self.poses[self.spec["points"][joint[end]]["body"]])
        return turn @ np.array(joint[AXIS_ON[end]]), turn @ np.array(joint[SIDE_ON[end]])

    def gap(self, found: Attempt) -> None:
        """The joints that stay open, from the one body's point to the other's."""
        for index, _, _ in found.open:
            joint = self.spec["joints"][index]
            ends = np.stack([self.places[joint["first"]], self.places[joint["second"]]])
            stays = f"{self.m.joints[index]} stays" if found.joint >= 0 else f"{len(found.open)} joints stay"
            self.axes.plot(*ends.T, label=f"{stays} open", **OPEN)

    def error(self, exaggerate: float, result: Result | None) -> None:
        """The position error of the output as an arrow."""
        if result is None or "error" not in result.data:
            return
        tail = self.places[self.spec["output"]["point"]]
        error = [result.get("error", component=c)[self.configuration] for c in ("x", "y", "z")]
        arrow = exaggerate * on_ground(self.m, self.poses, np.array(error))
        self.axes.quiver(*tail, *arrow, color=COLOURS[3], linewidth=1.6, label=f"error, {exaggerate:g} times")
        self.every = np.vstack([self.every, tail + arrow])

    def frame(self) -> None:
        """Equal scales along all axes, and their names."""
        unit = self.m.units.length_name
        self.axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
        middle, reach = (self.every.max(axis=0) + self.every.min(axis=0)) / 2, 0.55 * self.extent
        low, high = middle - reach, middle + reach
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        self.axes.set_box_aspect((1, 1, 1))


def _outline(points: Points, extent: float) -> Points:
    """Different points of a body in their order around their middle, as seen across the plane that suits them best."""
    if not len(points):
        return np.zeros((0, 3))
    _, first = np.unique(np.round(points / extent, 6), axis=0, return_index=True)
    unique: Points = points[np.sort(first)]
    if len(unique) < 3:
        return unique
    away = unique - unique.mean(axis=0)
    _, _, directions = np.linalg.svd(away, full_matrices=False)
    order = np.argsort(np.arctan2(away @ directions[1], away @ directions[0]), kind="stable")
    return np.asarray(unique[order])
