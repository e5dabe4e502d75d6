"""What all foreign formats have in common: bodies and joints as they are drawn, before they become a mechanism file.

Everything is in SI units and radians, in the axes of the drawing: the pose in which the foreign file shows its bodies.
Readers of formats make a `Skeleton`; what follows (merging, projection, drives, text) knows of no format. In the plane
z is zero, and axes of revolute joints are (0, 0, 1).
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointplay.file.schema import wrong_with

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

#: the fixed body of every mechanism
GROUND = "ground"
#: gravity where a format has no other
STANDARD_GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class Frame:
    """A pose in the drawing."""

    #: position of the origin
    at: Vector = field(default_factory=lambda: np.zeros(3))
    #: rotation matrix; its columns are the frame's axes in those of the drawing
    axes: Matrix = field(default_factory=lambda: np.eye(3))

    def __matmul__(self, inner: Frame) -> Frame:
        """A frame that is given in this one, in the drawing."""
        return Frame(self.at + self.axes @ inner.at, self.axes @ inner.axes)

    def inverse(self) -> Frame:
        """The drawing as this frame sees it."""
        return Frame(-self.axes.T @ self.at, self.axes.T)

    def point(self, inner: Vector) -> Vector:
        """A point of this frame in the drawing."""
        return np.asarray(self.at + self.axes @ inner)


@dataclass(frozen=True)
class Facets:
    """The surface of a body in flat pieces."""

    #: of the directed edges around the pieces, in the drawing: shape (edge, end, axis)
    ends: Matrix = field(default_factory=lambda: np.zeros((0, 2, 3)))
    #: the piece of each edge, by its number
    piece: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def within(self, frame: Frame) -> Facets:
        """The same, where a frame is given instead of its own axes."""
        return replace(self, ends=self.ends @ frame.axes.T + frame.at)

    @classmethod
    def joined(cls, several: Iterable[Facets]) -> Facets:
        """All pieces of some surfaces."""
        found = cls()
        for one in several:
            start = int(found.piece.max(initial=-1)) + 1
            found = cls(np.concatenate([found.ends, one.ends]), np.concatenate([found.piece, start + one.piece]))
        return found


@dataclass(frozen=True)
class Body:
    """One rigid body."""

    #: its own axes in the drawing; the mechanism file has the same
    frame: Frame = field(default_factory=Frame)
    #: kg
    mass: float = 0.0
    #: centre of mass in the drawing
    centre: Vector = field(default_factory=lambda: np.zeros(3))
    #: matrix of its moments of inertia about the centre of mass, kg m^2, axes of the drawing
    inertia: Matrix = field(default_factory=lambda: np.zeros((3, 3)))
    #: whether it is no part of the drawing, but stands between joints that together hold what one holds there
    is_between: bool = False
    #: its surface, where it is known
    facets: Facets = field(default_factory=Facets)
    #: closed lines around what is seen of it along z, x and y in the drawing
    outline: tuple[Matrix, ...] = ()

    def within(self, frame: Frame) -> Body:
        """The same, where a frame is given instead of the axes of the drawing."""
        inertia = np.asarray(frame.axes @ self.inertia @ frame.axes.T)
        placed = replace(self, frame=frame @ self.frame, centre=frame.point(self.centre), inertia=inertia)
        return replace(placed, facets=self.facets.within(frame))

    def with_masses_of(self, bodies: Sequence[Body]) -> Body:
        """The same body with the masses of some bodies in place of its own."""
        mass = sum(body.mass for body in bodies)
        if mass <= 0.0:
            return replace(self, mass=mass)
        centre = np.sum([body.mass * body.centre for body in bodies], axis=0) / mass
        arms = [body.centre - centre for body in bodies]
        inertia = sum(
            body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            for body, arm in zip(bodies, arms, strict=True)
        )
        return replace(self, mass=mass, centre=centre, inertia=np.asarray(inertia))


def is_of_a_body(inertia: Matrix) -> bool:
    """Whether a matrix can be that of the moments of inertia of a body, but for rounding."""
    return not wrong_with((*np.diag(inertia).tolist(), *inertia[[0, 0, 1], [1, 2, 2]].tolist()))


@dataclass(frozen=True)
class Attachment:
    """Where a joint sits on a body: its point and direction in the drawing."""

    at: Vector
    axis: Vector | None = None

    def within(self, frame: Frame) -> Attachment:
        """The same, where a frame is given instead of its own axes."""
        return Attachment(frame.point(self.at), None if self.axis is None else np.asarray(frame.axes @ self.axis))


@dataclass(frozen=True)
class PinAndHole:
    """A hole and the pin in it, or a socket and its ball."""

    #: `hole`, `pin`: diameters, m
    hole: float
    pin: float
    #: how far the pin is in the hole, m; 0 of a ball
    length: float
    #: where they come from
    said: str


@dataclass(frozen=True)
class Joint:
    """A joint between two bodies."""

    name: str
    #: as the `type` of the mechanism file: "revolute", "prismatic", "fixed", ...
    kind: str
    #: the carrier first
    bodies: tuple[str, str]
    #: in the drawing, on the first body
    place: Attachment
    #: on the second body, where the drawing does not have the joint closed
    second: Attachment | None = None
    #: angle or travel in the drawing: rad or m
    coordinate: float = 0.0
    #: range of the coordinate; as the format has it until `shaping.bounded`
    limits: tuple[float, float] | None = None
    #: whether the format says that a motor moves it
    is_driven: bool = False
    #: ``(joint, factor, offset)``: its coordinate is factor times that of the other joint plus the offset
    follows: tuple[str, float, float] | None = None
    #: ``(joint, coefficients)``: its coordinate is a polynomial of that of the other joint, from the constant on, SI
    curve: tuple[str, tuple[float, ...]] | None = None
    #: of a screw: m along the axis for one turn
    lead: float = 0.0
    #: ``(stiffness, coordinate)``: a spring beside its motor, N/m or N m/rad, and where it is free of force
    spring: tuple[float, float] | None = None
    #: lost motion of its drive to the positive and to the negative side of the coordinate: rad or m
    play: tuple[float, float] | None = None
    #: stiffness of its drive, N/m or N m/rad; 0 where it is rigid
    windup: float = 0.0
    #: turns of its motor for one of the joint; 0 where the format does not say
    reduction: float = 0.0
    #: of a rack: the direction of its pitch line, in the drawing
    side: Vector | None = None
    #: of a coupling: further keys of the mechanism file, in its units
    keys: Mapping[str, object] = field(default_factory=dict)
    #: hole and pin, where the format has them
    sizes: PinAndHole | None = None
    #: values of the coordinate through which its motor moves it: rad or m
    motion: tuple[float, ...] | None = None

    def shifted(self, shift: float) -> Joint:
        """With another zero of the coordinate, which is larger everywhere."""
        limits = self.limits and (self.limits[0] + shift, self.limits[1] + shift)
        spring = self.spring and (self.spring[0], self.spring[1] + shift)
        motion = self.motion and tuple(value + shift for value in self.motion)
        return replace(self, coordinate=self.coordinate + shift, limits=limits, spring=spring, motion=motion)


@dataclass(frozen=True)
class AppliedForce:
    """A force on a body."""

    body: str
    #: its point in the drawing
    at: Vector
    #: n, in the axes of the drawing
    force: Vector
    #: whether it turns with the body
    is_follower: bool = False

    def on(self, body: str) -> AppliedForce:
        """The same on a body of this name."""
        return replace(self, body=body)


def fixed(one: str, other: str) -> Joint:
    """A joint that makes one body of two; where it is does not matter."""
    return Joint(f"{other}-fixed", "fixed", (one, other), Attachment(np.zeros(3)))


def free(name: str, taken: Container[str]) -> str:
    """The name, or one like it that nothing else has."""
    while name in taken:
        name += "_"
    return name


def free_names(names: Mapping[str, str], taken: Iterable[str]) -> dict[str, str]:
    """Names by identifier; of those that are there twice the later ones have underscores."""
    found: dict[str, str] = {}
    for own, name in names.items():
        found[own] = free(name, {*taken, *found.values()})
    return found


def floating(bodies: Iterable[str], joints: Iterable[Joint], ground: str) -> list[list[str]]:
    """Groups of bodies that joints connect with one another, but not with the ground."""
    group = {name: [name] for name in bodies}
    for joint in joints:
        one, other = (group[name] for name in joint.bodies)
        if one is not other:
            one += other
            group |= dict.fromkeys(other, one)
    found = {id(members): members for members in group.values() if ground not in members}
    order = list(group)
    return [sorted(members, key=order.index) for members in found.values()]


@dataclass(frozen=True)
class Skeleton:
    """A mechanism as a foreign format has it."""

    title: str
    #: by name, in the order of the format
    bodies: Mapping[str, Body]
    joints: tuple[Joint, ...]
    #: "spatial" or "planar"
    space: str = "spatial"
    #: the body that is fixed. It gets the name "ground".
    ground: str = GROUND
    #: ``name: (body, frame)`` of what can be an output: tools, sites, links that are merged, points of a drawing
    frames: Mapping[str, tuple[str, Frame]] = field(default_factory=dict)
    #: whether the bodies start where they are drawn even where no loop asks for it
    starts_drawn: bool = False
    #: whether the origins of bodies can be the output as well. Those of a drawing are nowhere on its bodies.
    has_origins: bool = True
    #: m/s^2, axes of the drawing
    gravity: tuple[float, float, float] = STANDARD_GRAVITY
    forces: tuple[AppliedForce, ...] = ()
    #: `other_links`, `other_joints`: what the format calls links, frames and joints whose legal names others have: the
    #: names that they have instead
    other_links: Mapping[str, str] = field(default_factory=dict)
    other_joints: Mapping[str, str] = field(default_factory=dict)
    #: what the format says and the mechanism file does not: one sentence each
    notes: tuple[str, ...] = ()


def noted(skeleton: Skeleton, *notes: str) -> Skeleton:
    """With further notes."""
    return replace(skeleton, notes=(*skeleton.notes, *notes))
