"""A planar mechanism as a model of MuJoCo: every body slides along x and y and turns about z against the ground.

A hole with a pin is a ring of N boxes around a capsule. Their faces are the sides of a regular polygon, so that the
centre of the pin stays in

    n_k . d <= c,    n_k = (cos 2 pi k / N, sin 2 pi k / N),

which holds the disc |d| <= c of the clearance and exceeds it by c pi^2 / (2 N^2) at most; a load in any direction finds
a corner within the angle pi / N. The radii of pin and hole have no influence, only their difference. A guide is two
boxes around two balls at the ends of the slider, which gives |d_n| + (length / 2) |sin tau| <= gap.
"""

import math
from xml.etree.ElementTree import SubElement

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.spec import ENDS, PointSpec

from .contact_model import Model, text_of

#: height from one joint to the next, in radii of pins: capsules are four radii high with their round ends
LAYER = 5.0


def _turned(angle: float, vector: Floats) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


class PlanarModel(Model):
    """One planar mechanism on its way to a model."""

    # A pin touches rings, and nothing else touches anything.
    SOLIDS = (("pin", "1", "0", "0.8 0.5 0.2 1"), ("hole", "0", "1", "0.5 0.6 0.7 0.6"))

    def add_bodies(self) -> None:
        for k, name in enumerate(self.m.bodies):
            x, y, angle = self.poses[k]
            body = self.add_body(self.world, k, pos=text_of([x, y, 0]), euler=text_of([0, 0, angle]))
            for axis, direction in (("x", [1.0, 0.0]), ("y", [0.0, 1.0])):
                along = [*_turned(-angle, np.array(direction)), 0.0]
                drag = text_of(2 * self.rate * self.masses[k])
                SubElement(body, "joint", name=f"{name}-{axis}", type="slide", axis=text_of(along), damping=drag)
            centre = self.centre(k)
            about = 2 * self.rate * (self.spins[k] + self.masses[k] * float(centre @ centre))
            SubElement(body, "joint", name=f"{name}-angle", type="hinge", axis="0 0 1", damping=text_of(about))

    def add_joint(self, number: int) -> None:
        joint = self.spec["joints"][number]
        name, kind = self.m.joints[number], joint["kind"]
        first, second = (self.spec["points"][joint[end]] for end in ENDS)
        held = {move["joint"] for drive in self.spec["drives"] for move in (drive, *drive.get("also", ()))}
        # Every joint has a layer of its own.
        height = LAYER * self.radius * number
        if kind in ("revolute", "fixed"):
            play = self.plays.get(number)
            if play is None:
                self._connected(name, first, second)
            else:
                self._pin(name, play["radius"], first, second, height)
            if number in held or kind == "fixed":
                self._locked(name, first["body"], second["body"])
        else:
            self._guide(name, number, height, number in held)

    def _pin(self, name: str, clearance: float, first: PointSpec, second: PointSpec, height: float) -> None:
        """A capsule on the first body in a ring of boxes on the second."""
        at = text_of([*first["at"][:2], height])
        size = text_of([self.radius, self.radius])
        self.add_geom(first["body"], "pin", name=f"{name}-pin", type="capsule", size=size, pos=at)
        hole = self.radius + clearance
        # Their ends overlap outside of the hole.
        half = [self.wall / 2, (hole + self.wall) * math.tan(math.pi / self.pieces), self.radius]
        for k in range(self.pieces):
            angle = 2 * math.pi * k / self.pieces
            middle = np.array(second["at"][:2]) + _turned(angle, np.array([hole + self.wall / 2, 0.0]))
            self._box(second["body"], middle, angle, half, height)

    def _box(self, body: int, middle: Floats, angle: float, half: list[float], height: float) -> None:
        pos, turn = text_of([*middle, height]), text_of([0, 0, angle])
        self.add_geom(body, "hole", type="box", size=text_of(half), pos=pos, euler=turn)

    def _connected(self, name: str, first: PointSpec, second: PointSpec) -> None:
        """A pin without clearance."""
        for point, end in ((first, "first"), (second, "second")):
            self.add_site(point["body"], f"{name}-{end}", point["at"])
        SubElement(self.equality, "connect", name=name, site1=f"{name}-first", site2=f"{name}-second")

    def _locked(self, name: str, first: int, second: int) -> None:
        """Two bodies that keep the angle between them, by the angles that they have turned since the start."""
        turned = [f"{self.m.bodies[body]}-angle" for body in (second, first) if body >= 0]
        joints = {f"joint{k}": joint for k, joint in enumerate(turned, 1)}
        law = "0 1 0 0 0" if len(turned) > 1 else "0 0 0 0 0"
        SubElement(self.equality, "joint", {"name": f"{name}-angle", "polycoef": law, **joints})

    def _guide(self, name: str, number: int, height: float, is_held: bool) -> None:
        """Boxes along the axis on the first body, balls on the second; where it is driven, boxes ahead and behind."""
        joint = self.spec["joints"][number]
        first, second = (self.spec["points"][joint[end]] for end in ENDS)
        sizes = self.plays.get(number, {})
        gap, half = sizes.get("gap", sizes.get("high", 0.0)), sizes.get("half_length", 0.25 * self.size)
        axis, at = np.array(joint["axis_first"][:2]), np.array(first["at"][:2])
        turn = math.atan2(axis[1], axis[0])
        travel = axis @ (self._in_axes_of(first["body"], second) - at)
        middle = at + travel * axis
        wide = [half + 2 * self.size, self.wall / 2, self.radius]
        for side in (1.0, -1.0):
            across = _turned(turn, np.array([0.0, side * (self.radius + gap + self.wall / 2)]))
            self._box(first["body"], middle + across, turn, wide, height)
        own = np.array(joint["axis_second"][:2])
        ends = [0.0] if joint["kind"] == "pin_in_slot" else [half, -half]
        if is_held:
            ends = list(dict.fromkeys([*ends, 0.0]))
            for side in (1.0, -1.0):
                ahead = middle + side * (self.radius + self.wall / 2) * axis
                self._box(first["body"], ahead, turn, [self.wall / 2, 0.5 * self.radius, self.radius], height)
        for k, end in enumerate(ends):
            pos = text_of([*(np.array(second["at"][:2]) + end * own), height])
            self.add_geom(
                second["body"], "pin", name=f"{name}-slider{k}", type="sphere", size=text_of(self.radius), pos=pos
            )

    def _in_axes_of(self, body: int, point: PointSpec) -> Floats:
        """A point in the nominal pose, in the axes of a body."""
        x, y, angle = self.poses[point["body"]] if point["body"] >= 0 else (0.0, 0.0, 0.0)
        there = np.array([x, y]) + _turned(angle, np.array(point["at"][:2]))
        x, y, angle = self.poses[body] if body >= 0 else (0.0, 0.0, 0.0)
        return _turned(-angle, there - np.array([x, y]))
