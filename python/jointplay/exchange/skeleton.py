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
    """A pose in the drawing.

    Attributes
    ----------
    at : ndarray
        Position of the origin.
    axes : ndarray
        Rotation matrix; its columns are the frame's axes in those of the drawing.
    """

    at: Vector = field(default_factory=lambda: np.zeros(3))
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
    """The surface of a body in flat pieces.

    Attributes
    ----------
    ends : ndarray
        Of the directed edges around the pieces, in the drawing: shape (edge, end, axis).
    piece : ndarray
        The piece of each edge, by its number.
    """

    ends: Matrix = field(default_factory=lambda: np.zeros((0, 2, 3)))
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
    """One rigid body.

    Attributes
    ----------
    frame : Frame
        Its own axes in the drawing; the mechanism file has the same.
    mass : float
        kg.
    centre : ndarray
        Centre of mass in the drawing.
    inertia : ndarray
        Matrix of its moments of inertia about the centre of mass, kg m^2, axes of the drawing.
    is_between : bool
        Whether it is no part of the drawing, but stands between joints that together hold what one holds there.
    facets : Facets
        Its surface, where it is known.
    outline : tuple of ndarray
        Closed lines around what is seen of it along z, x and y in the drawing.
    """

    frame: Frame = field(default_factory=Frame)
    mass: float = 0.0
    centre: Vector = field(default_factory=lambda: np.zeros(3))
    inertia: Matrix = field(default_factory=lambda: np.zeros((3, 3)))
    is_between: bool = False
    facets: Facets = field(default_factory=Facets)
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
    """A hole and the pin in it, or a socket and its ball.

    Attributes
    ----------
    hole, pin : float
        Diameters, m.
    length : float
        How far the pin is in the hole, m; 0 of a ball.
    said : str
        Where they come from.
    """

    hole: float
    pin: float
    length: float
    said: str


@dataclass(frozen=True)
class Joint:
    """A joint between two bodies.

    Attributes
    ----------
    name : str
    kind : str
        As the `type` of the mechanism file: "revolute", "prismatic", "fixed", ...
    bodies : tuple of str
        The carrier first.
    place : Place
        In the drawing, on the first body.
    second : Place or None
        On the second body, where the drawing does not have the joint closed.
    coordinate : float
        Angle or travel in the drawing: rad or m.
    limits : tuple or None
        Range of the coordinate; as the format has it until `shaping.bounded`.
    is_driven : bool
        Whether the format says that a motor moves it.
    follows : tuple or None
        ``(joint, factor, offset)``: its coordinate is factor times that of the other joint plus the offset.
    curve : tuple or None
        ``(joint, coefficients)``: its coordinate is a polynomial of that of the other joint, from the constant on, SI.
    lead : float
        Of a screw: m along the axis for one turn.
    spring : tuple or None
        ``(stiffness, coordinate)``: a spring beside its motor, N/m or N m/rad, and where it is free of force.
    play : tuple or None
        Lost motion of its drive to the positive and to the negative side of the coordinate: rad or m.
    windup : float
        Stiffness of its drive, N/m or N m/rad; 0 where it is rigid.
    reduction : float
        Turns of its motor for one of the joint; 0 where the format does not say.
    side : ndarray or None
        Of a rack: the direction of its pitch line, in the drawing.
    keys : mapping
        Of a coupling: further keys of the mechanism file, in its units.
    sizes : PinAndHole or None
        Hole and pin, where the format has them.
    motion : tuple or None
        Values of the coordinate through which its motor moves it: rad or m.
    """

    name: str
    kind: str
    bodies: tuple[str, str]
    place: Attachment
    second: Attachment | None = None
    coordinate: float = 0.0
    limits: tuple[float, float] | None = None
    is_driven: bool = False
    follows: tuple[str, float, float] | None = None
    curve: tuple[str, tuple[float, ...]] | None = None
    lead: float = 0.0
    spring: tuple[float, float] | None = None
    play: tuple[float, float] | None = None
    windup: float = 0.0
    reduction: float = 0.0
    side: Vector | None = None
    keys: Mapping[str, object] = field(default_factory=dict)
    sizes: PinAndHole | None = None
    motion: tuple[float, ...] | None = None

    def shifted(self, shift: float) -> Joint:
        """With another zero of the coordinate, which is larger everywhere."""
        limits = self.limits and (self.limits[0] + shift, self.limits[1] + shift)
        spring = self.spring and (self.spring[0], self.spring[1] + shift)
        motion = self.motion and tuple(value + shift for value in self.motion)
        return replace(self, coordinate=self.coordinate + shift, limits=limits, spring=spring, motion=motion)


@dataclass(frozen=True)
class AppliedForce:
    """A force on a body.

    Attributes
    ----------
    body : str
    at : ndarray
        Its point in the drawing.
    force : ndarray
        N, in the axes of the drawing.
    is_follower : bool
        Whether it turns with the body.
    """

    body: str
    at: Vector
    force: Vector
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
    """A mechanism as a foreign format has it.

    Attributes
    ----------
    title : str
    bodies : mapping
        By name, in the order of the format.
    joints : tuple of Joint
    space : str
        "spatial" or "planar".
    ground : str
        The body that is fixed. It gets the name "ground".
    frames : mapping
        ``name: (body, frame)`` of what can be an output: tools, sites, links that are merged, points of a drawing.
    starts_drawn : bool
        Whether the bodies start where they are drawn even where no loop asks for it.
    has_origins : bool
        Whether the origins of bodies can be the output as well. Those of a drawing are nowhere on its bodies.
    gravity : tuple
        m/s^2, axes of the drawing.
    forces : tuple of AppliedForce
    other_links, other_joints : mapping
        What the format calls links, frames and joints whose legal names others have: the names that they have instead.
    notes : tuple of str
        What the format says and the mechanism file does not: one sentence each.
    """

    title: str
    bodies: Mapping[str, Body]
    joints: tuple[Joint, ...]
    space: str = "spatial"
    ground: str = GROUND
    frames: Mapping[str, tuple[str, Frame]] = field(default_factory=dict)
    starts_drawn: bool = False
    has_origins: bool = True
    gravity: tuple[float, float, float] = STANDARD_GRAVITY
    forces: tuple[AppliedForce, ...] = ()
    other_links: Mapping[str, str] = field(default_factory=dict)
    other_joints: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def noted(skeleton: Skeleton, *notes: str) -> Skeleton:
    """With further notes."""
    return replace(skeleton, notes=(*skeleton.notes, *notes))
