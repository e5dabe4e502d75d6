"""A mechanism in space as a model of MuJoCo: balls that run in holes, in guides and between planes.

All solids are balls on the second body of a joint and boxes on the first. A ball of radius b before a box at the
distance b + c from its centre gives n . d <= c for the displacement d of its centre, whatever b is. With d the shift,
tau the tilt and a the axis of the hole, the clearances of the file are:

    pin        |d_across +- (length / 2) tau x a| <= radial    two balls, at the ends of the pin, in a ring of N boxes
               |d . a| <= axial                                a ball in the middle between two boxes
    slider     |d_s| + (length / 2) |tau_n| + (height / 2) |roll| <= gap, and across     eight balls at its corners
    plate      |d . a| + (size / 2) . |tau| <= gap             four balls at its corners between two boxes
    ball       |d| <= radial                                   the largest length of a tendon between the two centres

The ends of a pin are where the file has them also when it is tilted. A ring is a regular polygon: it exceeds the disc
by radial pi^2 / (2 N^2) at most, and a load finds a corner within the angle pi / N. A ball in its socket has no
polygon: without friction the force goes along the line of centres, as that of a tendon does.

What a joint holds without clearance is a relation between the coordinates of its two bodies: one of them hangs on the
other by what is free, in the tree of bodies of MuJoCo. A joint that closes a loop of such joints has a carriage, which
hangs on the first body and is welded to the second.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.poses import from_axes, matrix
from jointplay.core.spec import AXIS_ON, ENDS, SIDE_ON, End
from jointplay.model.mechanism import Mechanism

from .contact_model import LEAST, Model, text_of

#: of a joint's frame: along its axis, along its side, across both
ALONG, SIDE, NORMAL = range(3)
SIDES = (1.0, -1.0)


class Freedoms(NamedTuple):
    """What one body can do on another: slides along axes of the joint, and then turns."""

    slides: tuple[int, ...] = ()
    #: about all axes
    ball: bool = False
    hinges: tuple[int, ...] = ()

    def without(self, held: set[str]) -> Freedoms:
        """What is left when coordinates are driven."""
        slides, ball, hinges = self
        if "along" in held:
            slides = tuple(axis for axis in slides if axis != ALONG)
        if "angle" in held:
            # The side of the second body keeps to the plane of axis and side of the first.
            hinges = (NORMAL, SIDE) if ball else ()
            ball = False
        return Freedoms(slides, ball, hinges)


#: of joints without clearance
FREE: Mapping[str, Freedoms] = MappingProxyType(
    {
        "revolute": Freedoms(hinges=(ALONG,)),
        "cylindrical": Freedoms(slides=(ALONG,), hinges=(ALONG,)),
        "prismatic": Freedoms(slides=(ALONG,)),
        "spherical": Freedoms(ball=True),
        "planar": Freedoms(slides=(SIDE, NORMAL), hinges=(ALONG,)),
        "fixed": Freedoms(),
    }
)
#: of those with it, and of a body on its own
ALL = Freedoms(slides=(ALONG, SIDE, NORMAL), ball=True)
#: names of joints of MuJoCo, by kind and axis
OF_JOINT = MappingProxyType(
    {"slide": ("along", "side", "normal"), "hinge": ("angle", "tilt_side", "tilt_normal"), "ball": ("turn",)}
)
OF_BODY = MappingProxyType({"slide": ("x", "y", "z"), "ball": ("rotation",)})


class JointPlace(NamedTuple):
    """Where joints of MuJoCo are in the nominal pose: a point, and directions as columns; and how they are called."""

    at: Floats
    frame: Floats
    name: str
    names: Mapping[str, tuple[str, ...]]


class Hanging(NamedTuple):
    """A body that hangs on another one by a joint."""

    body: int
    on: int
    joint: int


class Spatial(Model):
    """One mechanism in space on its way to a model."""

    # Only what is paired touches.
    SOLIDS = (("pin", "0", "0", "0.8 0.5 0.2 1"), ("hole", "0", "0", "0.5 0.6 0.7 0.3"))

    def __init__(self, m: Mechanism, drives: Floats, poses: Floats, pieces: int) -> None:
        super().__init__(m, drives, poses, pieces)
        self.places = np.vstack([poses[:, :3], np.zeros(3)])  # the ground has index -1
        self.turned = np.concatenate([matrix(poses), np.eye(3)[None]])
        self.held: dict[int, set[str]] = {}
        for drive in self.spec["drives"]:
            for move in (drive, *drive.get("also", ())):
                kind = self.spec["joints"][move["joint"]]["kind"]
                usual = "angle" if kind == "revolute" else "along"
                self.held.setdefault(move["joint"], set()).add(move.get("component", usual))
        # Loops are closed by balls where they can be, which needs no carriage.
        order = sorted(range(len(m.joints)), key=lambda k: self.spec["joints"][k]["kind"] == "spherical")
        self.tight = {k: found for k in order if (found := self._freedoms(k)) is not None}
        self.hanging = list(self._tree())

    # --- joints as relations between coordinates --------------------------------------------------------------------

    def _sizes(self, number: int) -> dict[str, float]:
        """The sizes of a clearance; none where it is zero."""
        sizes = self.plays.get(number, {})
        return sizes if any(sizes.get(gap) for gap in ("radius", "axial", "gap")) else {}

    def _freedoms(self, number: int) -> Freedoms | None:
        """What a joint leaves free, or nothing where contacts alone hold it."""
        sizes, held = self._sizes(number), self.held.get(number, set())
        free = FREE[self.spec["joints"][number]["kind"]]
        if sizes.get("radius") or sizes.get("gap"):
            return ALL.without(held) if held else None
        if sizes:
            free = free._replace(slides=(ALONG,))
        return free.without(held)

    def _ends(self, number: int) -> tuple[int, int]:
        joint = self.spec["joints"][number]
        first, second = (self.spec["points"][joint[end]]["body"] for end in ENDS)
        return first, second

    def _tree(self) -> Iterator[Hanging]:
        """Every body that hangs on another, those nearer to the ground first."""
        placed: set[int] = set()
        for root in (-1, *range(len(self.m.bodies))):
            placed.add(root)
            while True:
                ends = ((k, *self._ends(k)) for k in self.tight)
                found = next(((k, a, b) for k, a, b in ends if (a in placed) != (b in placed)), None)
                if found is None:
                    break
                k, first, second = found
                body, on = (second, first) if first in placed else (first, second)
                placed.add(body)
                yield Hanging(body, on, k)

    def add_bodies(self) -> None:
        above = {one.body for one in self.hanging}
        for k, name in enumerate(self.m.bodies):
            if k not in above:
                body = self.add_body(self.world, k, **self._seen(k, -1))
                self._add_freedoms(body, k, ALL, JointPlace(self._centre(k), np.eye(3), name, OF_BODY))
        for one in self.hanging:
            body = self.add_body(self.on(one.on), one.body, **self._seen(one.body, one.on))
            is_first = one.body == self._ends(one.joint)[0]
            self._add_freedoms(body, one.body, self.tight[one.joint], self._joint_place(one.joint), reverse=is_first)

    def _carried(self, body: int) -> list[int]:
        """A body and all that hangs on it, the ground left out."""
        found = [body]
        for one in self.hanging:
            if one.on in found:
                found.append(one.body)
        return [k for k in found if k >= 0]

    def _add_freedoms(
        self, element: Element, body: int, freedoms: Freedoms, place: JointPlace, *, reverse: bool = False
    ) -> None:
        """Joints of MuJoCo: slides along axes of the first body come first, turns on the second.

        Where the first body hangs on the second, the order is the reverse.
        """
        carried = self._carried(body)
        mass = sum(self.masses[k] for k in carried)
        about = sum(self.masses[k] * float(np.sum((self._centre(k) - place.at) ** 2)) + self.spins[k] for k in carried)
        drags = {"slide": mass, "hinge": about, "ball": about}
        steps = [("slide", axis) for axis in freedoms.slides]
        steps += [("ball", ALONG)] if freedoms.ball else [("hinge", axis) for axis in freedoms.hinges]
        axes, pos = self.turned[body].T @ place.frame, text_of(self.turned[body].T @ (place.at - self.places[body]))
        for kind, axis in reversed(steps) if reverse else steps:
            more = {} if kind == "ball" else {"axis": text_of(axes[:, axis])}
            called, drag = f"{place.name}-{place.names[kind][axis]}", text_of(2 * self.rate * drags[kind])
            SubElement(element, "joint", {"name": called, "type": kind, "pos": pos, "damping": drag, **more})

    # --- where things are -------------------------------------------------------------------------------------------

    def _seen(self, body: int, on: int) -> dict[str, str]:
        """Attributes of a body in the axes of another."""
        pos = self.turned[on].T @ (self.places[body] - self.places[on])
        return {"pos": text_of(pos), "quat": text_of(from_axes(self.turned[on].T @ self.turned[body]))}

    def _centre(self, body: int) -> Floats:
        return np.asarray(self.places[body] + self.turned[body] @ self.centre(body))

    def _place(self, number: int) -> Floats:
        """The second point of a joint."""
        point = self.spec["points"][self.spec["joints"][number]["second"]]
        return np.asarray(self.places[point["body"]] + self.turned[point["body"]] @ point["at"])

    def _own_frame(self, number: int, end: End) -> Floats:
        """Columns along, side and normal of a joint in the axes of one of its bodies."""
        joint = self.spec["joints"][number]
        along, side = np.array(joint[AXIS_ON[end]]), np.array(joint[SIDE_ON[end]])
        along = along / np.linalg.norm(along)
        side = side - (side @ along) * along
        side /= np.linalg.norm(side)
        return np.column_stack([along, side, np.cross(along, side)])

    def _joint_place(self, number: int) -> JointPlace:
        """As the second body has it."""
        frame = self.turned[self._ends(number)[1]] @ self._own_frame(number, "second")
        return JointPlace(self._place(number), frame, self.m.joints[number], OF_JOINT)

    # --- joints as solids -------------------------------------------------------------------------------------------

    def add_joint(self, number: int) -> None:
        sizes, kind = self._sizes(number), self.spec["joints"][number]["kind"]
        if number in self.tight and number not in {one.joint for one in self.hanging}:
            self._close(number)
        if kind == "spherical" and sizes:
            self._socket(number, sizes["radius"])
        elif kind in ("revolute", "cylindrical") and sizes:
            if sizes["radius"]:
                self._hole(number, sizes)
            if "axial" in sizes:
                middle = [("middle", np.zeros(3))]
                self._between(number, middle, {ALONG: sizes["axial"]}, 2 * self.radius * np.ones(3))
        elif kind == "prismatic" and sizes:
            half = np.array([sizes["half_length"], sizes["half_width"], sizes["half_height"]])
            corners = [(f"corner{k}", half * sign) for k, sign in enumerate(_signs(3))]
            gaps = dict.fromkeys((SIDE, NORMAL), sizes["gap"])
            self._between(number, corners, gaps, half + np.array([2 * self.size, self.radius, self.radius]), half)
        elif kind == "planar" and sizes:
            half = np.array([0.0, sizes["half_side"], sizes["half_normal"]])
            corners = [(f"corner{k}", half * [0.0, *sign]) for k, sign in enumerate(_signs(2))]
            self._between(number, corners, {ALONG: sizes["gap"]}, half + 2 * self.size)

    def _sites(self, number: int) -> list[str]:
        """Names of the points of a joint on its two bodies."""
        names = []
        for end in ENDS:
            point = self.spec["points"][self.spec["joints"][number][end]]
            names.append(f"{self.m.joints[number]}-{end}")
            self.add_site(point["body"], names[-1], point["at"])
        return names

    def _socket(self, number: int, radius: float) -> None:
        tendon = SubElement(self.tendon, "spatial", name=self.m.joints[number], range=text_of([0, radius]))
        for name in self._sites(number):
            SubElement(tendon, "site", site=name)

    def _hole(self, number: int, sizes: dict[str, float]) -> None:
        """A ring over the whole length in which the ends of the pin move, and over what it may slide."""
        half = sizes["half_length"]
        slides = sizes["axial"] if "axial" in sizes else 2 * self.size
        ends = [(f"end{k}", np.array([side * half, 0.0, 0.0])) for k, side in enumerate(SIDES)]
        balls = [self._ball(number, *end) for end in ends]
        hole = self.radius + sizes["radius"]
        # Their ends overlap outside of the hole.
        wide = (hole + self.wall) * math.tan(math.pi / self.pieces)
        size = np.array([half + self.radius + slides, self.wall / 2, wide])
        walls = []
        for k in range(self.pieces):
            angle = 2 * math.pi * k / self.pieces
            out = np.array([0.0, math.cos(angle), math.sin(angle)])
            axes = np.column_stack([[1.0, 0.0, 0.0], out, np.cross([1.0, 0.0, 0.0], out)])
            walls.append(self._wall(number, f"wall{k}", (hole + self.wall / 2) * out, size, axes))
        self._pair(balls, walls)

    def _between(
        self,
        number: int,
        balls: list[tuple[str, Floats]],
        gaps: dict[int, float],
        size: Floats,
        reach: Floats | None = None,
    ) -> None:
        """Balls between two boxes across each of some axes of the first body, which leave gaps to both sides.

        Parameters
        ----------
        balls
            Names, and where they are in the frame of the second body.
        gaps
            By axis.
        size
            Half sizes of the boxes along the other axes.
        reach
            How far the balls are from the joint along each axis, nothing if left out.
        """
        made, walls = [self._ball(number, *ball) for ball in balls], []
        for axis, gap in gaps.items():
            out, half = np.eye(3)[axis], size.copy()
            half[axis] = self.wall / 2
            beyond = self.radius + gap + self.wall / 2 + (0.0 if reach is None else reach[axis])
            for k, side in enumerate(SIDES):
                name = f"{OF_JOINT['slide'][axis]}{k}"
                walls.append(self._wall(number, name, side * beyond * out, half, np.eye(3)))
        self._pair(made, walls)

    def _ball(self, number: int, name: str, at: Floats) -> str:
        """A ball on the second body, at a place in the frame of the joint there."""
        called = f"{self.m.joints[number]}-{name}"
        point = self.spec["points"][self.spec["joints"][number]["second"]]
        pos = text_of(point["at"] + self._own_frame(number, "second") @ at)
        self.add_geom(point["body"], "pin", name=called, type="sphere", size=text_of(self.radius), pos=pos)
        return called

    def _wall(self, number: int, name: str, at: Floats, size: Floats, axes: Floats) -> str:
        """A box on the first body, at a place in the frame of the joint there, beside the nominal place of the second.

        `axes` are its own in this frame.
        """
        called = f"{self.m.joints[number]}-{name}"
        point = self.spec["points"][self.spec["joints"][number]["first"]]
        body, frame = point["body"], self._own_frame(number, "first")
        there = self.turned[body].T @ (self._place(number) - self.places[body])
        pos, quat = text_of(there + frame @ at), text_of(from_axes(frame @ axes))
        self.add_geom(body, "hole", name=called, type="box", size=text_of(size), pos=pos, quat=quat)
        return called

    def _pair(self, balls: list[str], walls: list[str]) -> None:
        for ball in balls:
            for wall in walls:
                SubElement(self.contact, "pair", geom1=ball, geom2=wall)

    # --- loops ------------------------------------------------------------------------------------------------------

    def _close(self, number: int) -> None:
        """A joint between two bodies that have their coordinates already."""
        name, freedoms = self.m.joints[number], self.tight[number]
        first, second = self._ends(number)
        if freedoms == FREE["spherical"]:
            sites = {f"site{k}": site for k, site in enumerate(self._sites(number), 1)}
            SubElement(self.equality, "connect", {"name": name, **sites})
            return
        welded = [self.m.bodies[k] for k in (second, first) if k >= 0]
        if any(freedoms):
            welded = [f"{name}/carriage", *([self.m.bodies[second]] if second >= 0 else [])]
            carriage = SubElement(
                self.on(first), "body", {"name": welded[0], "gravcomp": "1", **self._seen(second, first)}
            )
            place = self._joint_place(number)
            mass = LEAST * max(self.masses)
            inertia = text_of([mass * (0.1 * self.size) ** 2] * 3)
            pos = text_of(self.turned[second].T @ (place.at - self.places[second]))
            SubElement(carriage, "inertial", pos=pos, mass=text_of(mass), diaginertia=inertia)
            self._add_freedoms(carriage, second, freedoms, place)
        bodies = {f"body{k}": body for k, body in enumerate(welded, 1)}
        SubElement(self.equality, "weld", {"name": name, "torquescale": text_of(self.size), **bodies})


def _signs(count: int) -> Iterator[Floats]:
    """The corners of a cube."""
    for corner in np.ndindex(*[2] * count):
        yield 1.0 - 2.0 * np.array(corner)
