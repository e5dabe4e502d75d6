"""A mechanism in the plane: bodies as lines and plates, pins as circles, guides with their sliders, supports."""

from typing import Any

import numpy as np
from matplotlib.patches import Circle, Polygon

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import JointSpec
from jointplay.result import Result
from jointplay.result.verdict import LOOSE

from . import couplings
from .bodies import body_colour
from .scene import Scene
from .style import scaled, series, theme

#: sizes on the drawing, as shares of its extent
PIN, SLIDER, SUPPORT = 0.008, 0.035, 0.03


class DrawingPlan(Scene):
    """One configuration of a mechanism in the plane."""

    def place(self, point: int) -> Floats:
        """A point of the specification on the drawing."""
        return self.view.flat(self.places[point])

    def bodies(self) -> None:
        """Every body as the line or the plate through its points."""
        self.contour(-1)
        for body in range(len(self.m.bodies)):
            self.contour(body)
            corners = self.view.flat(self.outline(body))
            colour = body_colour(self.m, body)
            if len(corners) > 2:
                plate: dict[str, Any] = {"closed": True, "edgecolor": colour}
                self.axes.add_patch(Polygon(corners, facecolor=colour, alpha=0.25, zorder=2, **plate))
                self.axes.add_patch(Polygon(corners, fill=False, linewidth=scaled(1.6), zorder=3, **plate))
                self.axes.plot([], [], color=colour, linewidth=2.0, label=self.label(body))
            else:
                marker = "s" if len(corners) == 1 else ""
                look: dict[str, Any] = {"linewidth": scaled(2.4), "marker": marker, "zorder": 3}
                self.axes.plot(*corners.T, color=colour, label=self.label(body), **look)

    def joints(self) -> None:
        """Pins as small circles, guides as lines with their slider, supports under what is fixed to the ground."""
        for k, joint in self.joints_drawn:
            kind = self.m.joint_kinds[k]
            first, second = self.place(joint["first"]), self.place(joint["second"])
            if kind in ("prismatic", "pin_in_slot"):
                self._guide(joint, first, second, kind)
            if kind in ("revolute", "pin_in_slot"):
                circle = Circle((second[0], second[1]), PIN * self.extent, zorder=6)
                circle.set(facecolor=theme().paper, edgecolor=theme().ink)
                self.axes.add_patch(circle)
            elif "coupling" in joint:
                turns = (self._turn(joint["first"]), self._turn(joint["second"]))
                colours = (self.colour_of(joint["first"]), self.colour_of(joint["second"]))
                couplings.draw(self.axes, joint, (first, second), turns, colours, self.m.units.length)
            elif kind == "fixed":
                self.axes.plot(*second, marker="x", color=theme().ink, markersize=6, zorder=6)
            if self._grounded(joint):
                self._support(first)

    def _turn(self, point: int) -> float:
        """Angle of the body that carries a point, radians."""
        return float(self.poses[self.body_of(point)][2])

    def _grounded(self, joint: JointSpec) -> bool:
        """Whether a joint is drawn on a support."""
        return joint["kind"] in ("revolute", "fixed") and self.body_of(joint["first"]) == -1

    def _support_at(self, place: Floats) -> Floats:
        """Corners of the triangle of a support."""
        return place + SUPPORT * self.extent * np.array([[0.0, 0.0], [-0.8, -1.3], [0.8, -1.3]])

    def _support(self, place: Floats) -> None:
        s = SUPPORT * self.extent
        triangle = Polygon(self._support_at(place), closed=True, zorder=2)
        triangle.set(facecolor=theme().paper, edgecolor=theme().grey)
        self.axes.add_patch(triangle)
        ground = np.array([place[0] - 1.2 * s, place[1] - 1.3 * s])
        self.axes.plot([ground[0], ground[0] + 2.4 * s], [ground[1]] * 2, color=theme().grey, linewidth=2.0, zorder=2)

    def _guide(self, joint: JointSpec, first: Floats, second: Floats, kind: str) -> None:
        along = couplings.direction(joint, self._turn(joint["first"]))
        across = np.array([-along[1], along[0]])
        reach = max(abs(float((second - first) @ along)), 1e-9) + 1.5 * SLIDER * self.extent
        ends = np.array(
            [first - SLIDER * self.extent * along, first + np.sign((second - first) @ along or 1.0) * reach * along]
        )
        self.axes.plot(*ends.T, color=self.colour_of(joint["first"]), linewidth=1.4, linestyle="-.", zorder=1)
        if kind == "prismatic":
            a, b = SLIDER * self.extent, 0.5 * SLIDER * self.extent
            corners = [second + sa * a * along + sb * b * across for sa, sb in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            box = Polygon(np.array(corners), closed=True, linewidth=scaled(1.6), zorder=4)
            box.set(facecolor=theme().paper, edgecolor=self.colour_of(joint["second"]))
            self.axes.add_patch(box)

    def named_at(self, joint: JointSpec) -> Floats:
        """Where the name of a joint is written: a coupling's where it acts."""
        if "coupling" not in joint:
            return super().named_at(joint)
        ends = (self.place(joint["first"]), self.place(joint["second"]))
        along = couplings.direction(joint, self._turn(joint["first"]))
        return np.append(couplings.contact(joint, ends, along, self.m.units.length), 0.0)

    def obstacles(self) -> Floats:
        """The output and the supports."""
        supports = [
            self._support_at(self.place(joint["first"])) for _, joint in self.joints_drawn if self._grounded(joint)
        ]
        return np.vstack([super().obstacles(), *supports])

    def pins(self, times: float, result: Result) -> None:
        """Where each pin lies in its clearance."""
        if "offset" not in result.data:
            return
        for number, joint, _ in self.m.round_plays:
            at = self.place(self.spec["joints"][joint]["first"]) + times * self._offset(joint, result)
            look = {"marker": "o", "markersize": scaled(4.0), "color": series(3)["color"], "linestyle": ""}
            self.axes.plot(*at, label="pin in its clearance", zorder=8, **look)
            state = str(result.get("contact")[self.configuration, number]) if "contact" in result.data else ""
            if state in LOOSE:
                look |= {"markersize": scaled(13.0), "markerfacecolor": "none", "color": theme().ink}
                self.axes.plot(*at, label=f"contact {state}", zorder=8, **look)

    def _offset(self, index: int, result: Result) -> Floats:
        """Where a pin lies in its disc, ground axes; that of a locked one is given in the axes of its joint."""
        name, joint = self.m.joints[index], self.spec["joints"][index]
        along = ("x", "y") if joint["kind"] == "revolute" else ("along", "normal")
        offset = np.array([result.get("offset", parameter=f"{name}.{c}")[self.configuration] for c in along])
        if joint["kind"] == "revolute":
            return offset
        c, s, _ = poses.matrix(self.poses[self.body_of(joint["first"])]) @ joint["axis_first"]
        turned: Floats = np.array([[c, -s], [s, c]]) @ offset
        return turned
