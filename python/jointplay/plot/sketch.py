"""A mechanism in space projected along an axis: bodies as lines and plates, axes of joints as short lines."""

import numpy as np
from matplotlib.patches import Polygon

from jointplay.basics.arrays import Floats
from jointplay.core.spec import ENDS, End, JointSpec
from jointplay.result import Result

from . import couplings
from .bodies import body_colour
from .scene import Scene, Sight
from .style import scaled, theme

#: along which the three views look: at the front from -y, at the top from +z, at the side from +x
FRONT = Sight("front", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
TOP = Sight("top", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
SIDE = Sight("side", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
#: half the length of an axis on the drawing, as a share of its extent
AXIS = 0.04
#: an axis that looks nearly at the viewer, with a shorter share of its length, is a circle
ACROSS = 0.2
#: how joints without an axis are marked
MARKERS = {"spherical": "o", "fixed": "x"}
SLIDING = ("prismatic", "cylindrical")
WHEELS = ("gear", "crossed_gear", "rack", "belt")


class Sketch(Scene):
    """One configuration of a mechanism in space, projected."""

    def bodies(self) -> None:
        """Every body as the line or the plate through its points; the ground as a plate of dashes."""
        for body in range(-1, len(self.m.bodies)):
            corners = self.outline(body)
            if len(corners) < 2:
                # A cross has no size of its own.
                continue
            colour, dash = body_colour(self.m, body), "--" if body == -1 else "-"
            self.line(corners, color=colour, linewidth=scaled(1.8), linestyle=dash, label=self.label(body), zorder=3)
            if len(corners) > 2 and body != -1:
                plate = Polygon(self.view.flat(corners), closed=True, facecolor=colour, alpha=0.2, zorder=2)
                self.axes.add_patch(plate)

    def joints(self) -> None:
        """Axes of joints as short lines, those of guides dotted; balls and locked joints as marks."""
        for _, joint in self.joints_drawn:
            if joint["kind"] in MARKERS:
                self._mark(self.places[joint["second"]], MARKERS[joint["kind"]])
            elif joint["kind"] in WHEELS:
                self._wheels(joint)
            else:
                self._axis(joint)

    def _mark(self, place: Floats, marker: str) -> None:
        look = {"marker": marker, "markersize": scaled(5.0), "markerfacecolor": theme().paper, "linestyle": ""}
        self.line(place[None], color=theme().ink, zorder=6, **look)

    def _axis(self, joint: JointSpec) -> None:
        """The axis of a joint; of a guide or screw the line from the one body's point to the other's, too."""
        place = self.places[joint["second"]]
        axis = self.frame_of(joint)[0]
        ends = self.places[[joint["first"], joint["second"]]]
        slides = joint["kind"] in SLIDING
        if slides:
            label = self.label_of_slider(joint)
            self.line(ends, color=self.colour_of(joint["second"]), linewidth=1.4, linestyle="-.", label=label, zorder=3)
        elif joint["kind"] == "screw":
            body = self.body_of(joint["first"])
            label = None if body == -1 else self.m.bodies[body]
            self.line(ends, color=self.colour_of(joint["first"]), linewidth=2.4, label=label, zorder=3)
        if np.linalg.norm(self.view.flat(axis)) < ACROSS:
            self._mark(place, "o")
            return
        half = AXIS * self.extent * axis
        dash = ":" if slides else "-"
        self.line(
            np.stack([place - half, place + half]), color=theme().ink, linewidth=scaled(2.2), linestyle=dash, zorder=5
        )

    def label_of_slider(self, joint: JointSpec, end: End = "second") -> str | None:
        """What the legend calls a body of a guide that has no extent of its own."""
        body = self.body_of(joint[end])
        return self.label(body) if len(self.outline(body)) < 2 else None

    def _wheels(self, joint: JointSpec) -> None:
        """A gear pair, rack or belt."""
        ends = (self.places[joint["first"]], self.places[joint["second"]])
        frames = (self.frame_of(joint, "first"), self.frame_of(joint, "second"))
        colours = (self.colour_of(joint["first"]), self.colour_of(joint["second"]))
        for end, colour in zip(ENDS, colours, strict=True):
            body = self.body_of(joint[end])
            self.axes.plot([], [], color=colour, label=None if body == -1 else self.m.owners[body])
        couplings.draw_in_space(self.line, joint, ends, frames, colours, self.m.units.length)

    def named_at(self, joint: JointSpec) -> Floats:
        """Where the name of a joint is written: a coupling's where it acts."""
        if joint["kind"] not in WHEELS:
            return super().named_at(joint)
        ends = (self.places[joint["first"]], self.places[joint["second"]])
        axes = (self.frame_of(joint, "first")[0], self.frame_of(joint, "second")[0])
        return couplings.contact(joint, ends, self.frame_of(joint)[1], self.m.units.length, axes)

    def pins(self, times: float, result: Result) -> None:
        """Pins in space are not drawn in their clearances: they tilt as well."""
