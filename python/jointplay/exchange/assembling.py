"""Assemblies of solvers that hold two frames to each other: joints between the parts, closed as they are drawn.

With the frames F1 and F2 of a joint in the drawing, what it measures is that of the second one in the first one,

    travel = z1 . (o2 - o1),    angle = atan2(y1 . x2, x1 . x2)

Constraints that are no joint by themselves become joints in series, with massless bodies between them: a distance of
two points is a rod between two balls. How they are meant is in `constraints`.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from jointplay.errors import InputError, listed

from .constraints import rolling, teeth
from .fcstd import MM
from .settling import measured, settled
from .shaping import grounded
from .skeleton import STANDARD_GRAVITY, Attachment, Body, Frame, Joint, PinAndHole, Skeleton, Vector, floating, free

#: how much less than one the product of two unit vectors may be that are parallel, or across each other
SKEW = 1e-6
#: how far a joint may be open in the drawing: m, rad
OPEN = 1e-6


@dataclass(frozen=True)
class JointEnd:
    """One side of a joint."""

    #: name of the body
    part: str
    #: the joint's frame in the drawing
    frame: Frame

    @property
    def axis(self) -> Vector:
        """Direction of the joint."""
        return self.frame.axes[:, 2]

    @property
    def line(self) -> tuple[Vector, Vector]:
        """Its point and its direction."""
        return self.frame.at, self.axis


class AssemblyDraft:
    """An assembly on its way to a skeleton."""

    def __init__(self) -> None:
        self.bodies: dict[str, Body] = {}
        #: bodies between the joints of a chain
        self.added: set[str] = set()
        #: frames of joints on both sides
        self.frames: dict[str, tuple[Frame, Frame]] = {}
        self.notes: list[str] = []

    def between(self, name: str) -> str:
        """A body between two joints of a chain, and what it is called."""
        called = free(name, self.bodies)
        self.bodies[called] = Body()
        self.added.add(called)
        return called

    def plain(
        self,
        name: str,
        kind: str,
        one: JointEnd,
        other: JointEnd,
        limits: tuple[float, float] | None = None,
        sizes: PinAndHole | None = None,
    ) -> Joint:
        """A joint that the mechanism file has."""
        bodies = (one.part, other.part)
        self.frames[name] = one.frame, other.frame
        if kind == "fixed":
            return Joint(name, kind, bodies, Attachment(one.frame.at))
        # A ball has no axis; others are along that of the first side, whichever way the second one points.
        has_axis = kind != "spherical"
        along = math.copysign(1.0, float(one.axis @ other.axis)) * other.axis
        return Joint(
            name,
            kind,
            bodies,
            Attachment(one.frame.at, one.axis if has_axis else None),
            Attachment(other.frame.at, along if has_axis else None),
            limits=limits if has_axis else None,
            sizes=sizes,
        )

    def screw(self, name: str, one: JointEnd, other: JointEnd, lead: float) -> Joint:
        """A thread; its lead is in m."""
        joint = self.plain(name, "screw", one, other)
        # Travel and angle are zero together, wherever along the thread that is.
        travel = lead * measured("screw", one.frame, other.frame) / (2.0 * math.pi)
        start = replace(joint.second or joint.place, at=one.frame.at + travel * one.axis)
        return replace(joint, lead=lead, second=start)

    def wheels(
        self, name: str, one: JointEnd, other: JointEnd, radii: tuple[float, float], is_belt: bool, place: str
    ) -> Joint:
        """Gears or a belt: the ratio of the radii (m) is kept, and gears touch.

        Raises
        ------
        InputError
            When their axes are not parallel, or gears have one axis.
        """
        first, second = radii
        along = float(one.axis @ other.axis)
        if abs(along) < 1.0 - SKEW:
            raise InputError("its axes are not parallel; such wheels are not read", key=place)
        along = math.copysign(1.0, along)
        away = other.frame.at - one.frame.at
        away = away - one.axis * (one.axis @ away)
        apart = float(np.linalg.norm(away))
        # Each wheel turns about its own axis: where they are opposite, what turns against each other turns alike.
        meshes = is_belt == (along < 0)
        counts = teeth(first, second)
        scale = 1.0
        if meshes:
            if apart < OPEN:
                raise InputError("its gears have one axis, and cannot mesh", key=place)
            scale = apart / (first + second)
            if abs(scale - 1.0) > 1e-6:
                words = f"Gears mesh at the distance of their axes, {apart / MM:.6g} mm, with the ratio of their radii"
                self.notes.append(f"{words}: {name}.")
        own = first * scale
        pitch = [own / MM, own * counts[1] / counts[0] / MM]
        level = Attachment(other.frame.at - one.axis * (one.axis @ (other.frame.at - one.frame.at)), one.axis)
        return Joint(
            name,
            "gear" if meshes else "belt",
            (one.part, other.part),
            Attachment(one.frame.at, one.axis),
            replace(level, axis=along * other.axis),
            keys={"teeth": list(counts), "radii": pitch},
        )

    def rack(self, name: str, rack: str, pinion: JointEnd, axis: Vector, along: Vector, radius: float) -> Joint:
        """A pinion that turns about an axis and rolls so that x + radius * angle stays, with x along the rack."""
        return Joint(
            name,
            "rack",
            (rack, pinion.part),
            Attachment(rolling(pinion.frame.at, axis, along, radius), axis),
            Attachment(pinion.frame.at, axis),
            side=along,
            keys={"radius": abs(radius) / MM},
        )

    def closed(
        self,
        title: str,
        joints: Iterable[Joint],
        base: str,
        gravity: tuple[float, float, float] = STANDARD_GRAVITY,
    ) -> Skeleton:
        """All of it, without what nothing holds, in the axes of the body that is fixed."""
        made = list(joints)
        loose = [name for group in floating(self.bodies, made, base) for name in group]
        # What stands between joints is no part that anybody knows.
        if named := [name for name in loose if name not in self.added]:
            self.notes.append(f"Nothing holds these parts to what is fixed, and they are left out: {listed(named)}.")
        found = Skeleton(
            title=title,
            bodies={name: body for name, body in self.bodies.items() if name not in loose},
            # A crank is driven rather than what it drives.
            joints=tuple(
                sorted((one for one in made if one.bodies[0] not in loose), key=lambda one: one.kind != "revolute")
            ),
            ground=base,
            starts_drawn=True,
            gravity=gravity,
            notes=tuple(self.notes),
        )
        found = grounded(settled(found, self.frames), base)
        # What is between the joints of a chain has the axes of the ground, in which it starts where it is drawn.
        own = {name: body if name not in self.added else Body(is_between=True) for name, body in found.bodies.items()}
        return replace(found, bodies=own)
