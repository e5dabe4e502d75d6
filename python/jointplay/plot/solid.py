"""A mechanism in space with depth: links as tubes, joints as cylinders, balls and boxes, nearer ones before others.

All surfaces are flat pieces. Pieces that look away are left out, the others are painted from the farthest to the
nearest. A piece with the normal n is as light as AMBIENT + (1 - AMBIENT) max(0, n . LIGHT).
"""

from itertools import pairwise

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from jointplay.basics.arrays import Floats
from jointplay.core.spec import ENDS, End, JointSpec

from .couplings import strands
from .scene import Corners, Sight
from .sketch import SLIDING, WHEELS, Sketch
from .style import current, theme
from .words import round_factor

#: from obliquely above
OBLIQUE = Sight(
    "solid",
    (float(np.cos(np.radians(32.0))), float(np.sin(np.radians(32.0))), 0.0),
    (-0.42 * float(np.sin(np.radians(32.0))), 0.42 * float(np.cos(np.radians(32.0))), float(np.sqrt(1.0 - 0.42**2))),
)
LIGHT = np.array([0.25, -0.55, 0.8]) / np.linalg.norm([0.25, -0.55, 0.8])
AMBIENT = 0.45
#: radii of links, balls and pins, half the length of a pin, half the side of a slider, as shares of the extent
TUBE, BALL, PIN, HALF, BOX = 0.011, 0.021, 0.019, 0.034, 0.024
#: flat pieces around a tube, along it, around a ball from pole to pole and around a wheel
ROUND, PIECES, POLES, WHEEL = 14, 10, 8, 48
#: length of the axes in the corner and of the scale, as shares of the extent
TRIAD, SCALE = 0.09, 0.25

#: flat pieces with four corners each, (piece, corner, axis), and their normals
Surface = tuple[Floats, Floats]


class Solid(Sketch):
    """One configuration of a mechanism in space, shaded."""

    def bodies(self) -> None:
        """Links as tubes between their joints, and the plates that they span; the ground as dashes."""
        self.pieces: list[Floats] = []
        self.colours: list[Floats] = []
        for body in range(-1, len(self.m.bodies)):
            corners = self.outline(body)
            if len(corners) < 2 or not self.is_there(body):
                continue
            colour = self.tint(body)
            if body == -1:
                self.line(corners, color=colour, linewidth=1.2, linestyle="--", label=self.label(body), zorder=1)
                continue
            self.axes.plot([], [], color=colour, linewidth=3.0, label=self.label(body))
            for start, end in pairwise(corners):
                self._add(tube(start, end, TUBE * self.extent), colour)
            if len(corners) > 2:
                self._add(plate(corners, self.view.towards), colour)

    def is_there(self, body: int) -> bool:
        """Whether a body, or the ground, is drawn."""
        return -1 <= body < len(self.m.bodies)

    def joints(self) -> None:
        """Pins as cylinders, sliders as boxes, balls, wheels as rims."""
        size = self.extent
        for _, joint in self.joints_drawn:
            there = [self.is_there(self.body_of(joint[end])) for end in ENDS]
            if joint["kind"] in (*SLIDING, "screw") and any(there):
                self._telescope(joint)
            if not all(there):
                continue
            place, (axis, side) = self.places[joint["second"]], self.frame_of(joint)
            metal = theme().grey
            if joint["kind"] in WHEELS:
                self._solid_wheels(joint)
            elif joint["kind"] in ("spherical", "universal"):
                self._add(ball(place, BALL * size), metal)
            elif joint["kind"] == "prismatic":
                self._add(box(place, axis, side, np.array([HALF, BOX, BOX]) * size), metal)
            elif joint["kind"] in ("fixed", "planar"):
                self._add(box(place, axis, side, np.array([0.4 * BOX, BOX, BOX]) * size), metal)
            else:
                half = HALF * size * axis
                self._add(tube(place - half, place + half, PIN * size, 1), metal)
        self._paint()

    def _telescope(self, joint: JointSpec) -> None:
        """A rod that comes out of a tube: the second body out of the first."""
        start, end = self.places[joint["first"]], self.places[joint["second"]]
        middle = 0.5 * (start + end)
        parts: tuple[tuple[End, Floats, Floats, float], ...] = (
            ("first", start, middle, 1.0),
            ("second", middle, end, 0.6),
        )
        for which, tail, head, share in parts:
            if not self.is_there(self.body_of(joint[which])):
                continue
            colour = self.colour_of(joint[which])
            self._add(tube(tail, head, share * TUBE * self.extent), colour)
            self.axes.plot([], [], color=colour, linewidth=3.0, label=self.label_of_slider(joint, which))

    def _solid_wheels(self, joint: JointSpec) -> None:
        coupling = joint["coupling"]
        radii = [abs(r) / self.m.units.length for r in coupling["radii"]]
        frames = [self.frame_of(joint, end) for end in ENDS]
        for k, (end, radius, (axis, side)) in enumerate(zip(ENDS, radii, frames, strict=True)):
            if joint["kind"] == "rack" and k == 0:
                # The pitch line of the rack, which is not a wheel.
                at = self.named_at(joint)
                self._add(tube(at - 1.6 * radius * side, at + 1.6 * radius * side, TUBE * self.extent), theme().grey)
                continue
            place, colour = self.places[joint[end]], self.colour_of(joint[end])
            self._add(ring(place, axis, side, radius, 0.7 * TUBE * self.extent), colour)
            # A spoke shows how the wheel is turned.
            self._add(tube(place, place + radius * side, 0.4 * TUBE * self.extent), colour)
            body = self.body_of(joint[end])
            self.axes.plot([], [], color=colour, linewidth=3.0, label=None if body == -1 else self.m.owners[body])
        if joint["kind"] == "belt":
            ends = (self.places[joint["first"]], self.places[joint["second"]])
            across = np.cross(frames[0][0], ends[1] - ends[0])
            across /= float(np.linalg.norm(across)) or 1.0
            for strand in strands(*ends, across, (radii[0], radii[1]), bool(coupling["crossed"])):
                self._add(tube(strand[0], strand[1], 0.4 * TUBE * self.extent), theme().grey)

    def obstacles(self) -> Floats:
        """The axes in the corner and the scale with its words as well."""
        pixels = self.axes.transData.transform(np.reshape(self.taken, (-1, 2)))
        above = pixels[-3:] + np.array([0.0, current().font_size_used * self.axes.figure.dpi / 72.0])
        corner = self.axes.transData.inverted().transform(np.concatenate([pixels, above]))
        return np.concatenate([super().obstacles(), corner])

    def _add(self, surface: Surface, colour: str) -> None:
        pieces, normals = surface
        seen = normals @ self.view.towards > 0.0
        lit = AMBIENT + (1.0 - AMBIENT) * np.maximum(normals[seen] @ LIGHT, 0.0)
        self.pieces.append(pieces[seen])
        self.colours.append(np.clip(lit[:, None] * np.array(to_rgb(colour)), 0.0, 1.0))

    def _paint(self) -> None:
        """All pieces at once, the farthest first."""
        if not self.pieces:
            return
        pieces, colours = np.concatenate(self.pieces), np.concatenate(self.colours)
        order = np.argsort(pieces.mean(axis=1) @ self.view.towards, kind="stable")
        flat = self.view.flat(pieces[order])
        # Edges of the same colour close the seams.
        painted = PolyCollection(list(flat), facecolors=colours[order], edgecolors=colours[order], linewidths=0.3)
        painted.set(zorder=4, rasterized=True)
        self.axes.add_collection(painted)

    def frame(self, limits: Corners | None = None) -> None:
        """In place of axes, which an oblique view has not: the directions of x, y and z, and a scale."""
        self.hold(limits)
        self.axes.set_axis_off()
        low, high = np.array(self.axes.get_xlim()), np.array(self.axes.get_ylim())
        size = TRIAD * self.extent
        corner = np.array([low[0] + 1.2 * size, high[0] - 1.2 * size])
        if limits is not None:
            self.axes.set_ylim(high[0] - 2.6 * size, high[1])
        look = {"arrowstyle": "-|>", "color": theme().ink, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
        letters = current().font_size_used
        self.taken = [corner]
        for name, axis in zip("xyz", np.eye(3), strict=True):
            way = self.view.flat(axis)
            tip = corner + size * way
            self.axes.annotate("", xy=tuple(tip), xytext=tuple(corner), arrowprops=look)
            # As far from the tip as letters are high, however small the drawing is.
            off = 0.8 * letters * way / float(np.linalg.norm(way))
            self.axes.annotate(name, tuple(tip), tuple(off), textcoords="offset points", ha="center", va="center")
            self.taken += [tip, corner + 1.5 * size * way]
        length = round_factor(SCALE * self.extent * 1e6) / 1e6
        start = np.array([low[1] - length - 0.2 * size, corner[1] - 0.4 * size])
        self.axes.plot([start[0], start[0] + length], [start[1]] * 2, color=theme().ink, linewidth=2.5)
        self.taken += [start + np.array([share * length, 0.0]) for share in (0.0, 0.5, 1.0)]
        words = f"{length:g} {self.m.units.length_name}"
        self.axes.text(start[0] + 0.5 * length, start[1] + 0.25 * size, words, ha="center", va="bottom")


def across(axis: Floats) -> Floats:
    """Two unit vectors at right angles to a direction and to each other, in rows."""
    axis = axis / np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def tube(start: Floats, end: Floats, radius: float, pieces: int = PIECES) -> Surface:
    """A closed cylinder.

    Examples
    --------
    >>> corners, normals = tube(np.zeros(3), np.array([0.0, 0.0, 2.0]), 0.5)
    >>> corners.shape, float(np.abs(np.linalg.norm(normals, axis=1) - 1.0).max()) < 1e-12
    ((168, 4, 3), True)
    """
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        return np.zeros((0, 4, 3)), np.zeros((0, 3))
    axis = (end - start) / length
    sides = across(axis)
    turns = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    out = np.column_stack([np.cos(turns), np.sin(turns)]) @ sides
    along = start + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (end - start)
    grid = along[:, None] + radius * out
    walls = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 4, 3)
    middle = np.column_stack([np.cos(turns[:-1] + turns[1] / 2), np.sin(turns[:-1] + turns[1] / 2)]) @ sides
    caps = [np.stack([rim[:-1], rim[1:], at + 0 * rim[1:], at + 0 * rim[1:]], axis=1) for rim, at in
            ((grid[0], start), (grid[-1], end))]  # fmt: skip
    normals = [np.tile(middle, (pieces, 1)), np.tile(-axis, (ROUND, 1)), np.tile(axis, (ROUND, 1))]
    return np.concatenate([walls, *caps]), np.concatenate(normals)


def ball(middle: Floats, radius: float) -> Surface:
    """A sphere."""
    heights, turns = np.linspace(-np.pi / 2, np.pi / 2, POLES + 1), np.linspace(0, 2 * np.pi, ROUND + 1)
    out = np.stack(
        [np.outer(np.cos(heights), np.cos(turns)), np.outer(np.cos(heights), np.sin(turns)),
         np.outer(np.sin(heights), np.ones_like(turns))], axis=-1,
    )  # fmt: skip
    pieces = np.stack([out[:-1, :-1], out[:-1, 1:], out[1:, 1:], out[1:, :-1]], axis=2).reshape(-1, 4, 3)
    normals = pieces.mean(axis=1)
    return middle + radius * pieces, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def box(middle: Floats, axis: Floats, side: Floats, half: Floats) -> Surface:
    """A box with half its lengths along axis, side and normal."""
    frame = np.stack([axis, side, np.cross(axis, side)])
    pieces, normals = [], []
    for k in range(3):
        a, b = frame[(k + 1) % 3] * half[(k + 1) % 3], frame[(k + 2) % 3] * half[(k + 2) % 3]
        for sign in (-1.0, 1.0):
            face = middle + sign * half[k] * frame[k]
            pieces.append(np.stack([face - a - b, face + a - b, face + a + b, face - a + b]))
            normals.append(sign * frame[k])
    return np.stack(pieces), np.stack(normals)


def ring(middle: Floats, axis: Floats, side: Floats, radius: float, thick: float) -> Surface:
    """The rim of a wheel."""
    turns = np.linspace(0.0, 2.0 * np.pi, WHEEL + 1)
    rim = middle + radius * (np.outer(np.cos(turns), side) + np.outer(np.sin(turns), np.cross(axis, side)))
    parts = [tube(start, end, thick, 1) for start, end in pairwise(rim)]
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def plate(corners: Floats, towards: Floats) -> Surface:
    """The area within a closed outline, which looks at the viewer from both sides, in triangles."""
    middle = corners[:-1].mean(axis=0)
    pieces = np.stack([corners[:-1], corners[1:], middle + 0 * corners[1:], middle + 0 * corners[1:]], axis=1)
    normals = np.cross(corners[1:] - middle, corners[:-1] - middle)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return pieces, np.where((normals @ towards)[:, None] < 0.0, -normals, normals)
