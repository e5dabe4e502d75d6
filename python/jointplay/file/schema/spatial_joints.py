"""The joints of mechanisms in space."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from .clearances import (
    BallClearance,
    BearingClearance,
    GuideClearance,
    LockedAngle,
    PlateClearance,
    SleeveClearance,
)
from .deviations import SpatialDirection, SpatialPosition
from .friction import RUBS, BallRubs, GuideRubs, JournalRubs
from .joints import ELASTIC, JointTable
from .placements import SpatialPlacement, SpatialPlacementTable
from .stiffness import (
    BallStiffness,
    GuideStiffness,
    JournalStiffness,
    MountStiffness,
    PlateStiffness,
    SleeveStiffness,
)
from .values import Direction, Name, Omittable, Triple, omitted, problem
from .wear import WORN, BallWear, GuideWear, JournalWear, PlateWear, SleeveWear

PLAY = "play built into the joint"
#: how far from a right angle (cosine) the drawn pins of a cross may be
SQUARE = 1e-3


class SpatialJoint(JointTable):
    """A joint in space."""

    has_axis: ClassVar[bool] = True
    point: ClassVar[str] = "[x, y, z]"
    placement: ClassVar[str] = "{ at = [x, y, z], axis = [ux, uy, uz] }"
    shared: ClassVar[tuple[str, ...]] = ("axis", "side")

    on: Omittable[dict[Name, SpatialPlacement]] = omitted(
        "the bodies with the joint's place on each, in body axes; the first carries pin or guide"
    )
    at: Omittable[Triple] = omitted("with `bodies`: the joint's point, the same for all")
    axis: Omittable[Direction] = omitted("with `bodies`: its direction, the same for all")
    side: Omittable[Direction] = omitted("with `bodies`: a direction across the axis, the same for all")
    position: dict[Name, SpatialPosition] = Field({}, description="deviation of its place, by the name of the body")
    direction: dict[Name, SpatialDirection] = Field({}, description="deviation of its axis, by the name of the body")

    @model_validator(mode="after")
    def _zones_about_an_axis(self) -> Self:
        for body, zone in self.position.items():
            if zone.has_zone and not zone.spherical and not self.has_axis:
                raise problem(f"position.{body}: a {self.kind} joint has no axis; write spherical = true for a ball")
        return self

    def has_direction(self, body: str) -> bool:  # noqa: ARG002 - it has its axis on all bodies
        """Whether it has an axis on a body, which can deviate."""
        return self.has_axis

    def _check_axes(self) -> None:
        places = self.placements
        self._check_first_axis(places[self.names[0]].axis)
        for body, place in places.items():
            if not self.has_axis and (place.axis or place.side):
                what = "axis" if place.axis else "side"
                raise problem(f"a {self.kind} joint has no {what}" + (f"; take it from '{body}'" if self.on else ""))

    @property
    def placements(self) -> dict[str, SpatialPlacementTable]:
        """Every body with the place of the joint on it, the carrier first."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        place = SpatialPlacementTable(at=self.at, axis=self.axis, side=self.side)
        return dict.fromkeys(self.bodies or (), place)


class SpatialRevolute(SpatialJoint):
    """A pin in a hole, held along its axis as well."""

    needs_axis: ClassVar[bool] = True
    coordinate: ClassVar[str] = "angle"
    held: ClassVar[tuple[str, ...]] = ("axial", "radial", "radial", "tilt", "tilt")

    type: Literal["revolute"] = Field(description="kind of joint")
    clearance: Omittable[BearingClearance] = omitted(PLAY)
    stiffness: Omittable[JournalStiffness] = omitted(ELASTIC)
    wear: Omittable[JournalWear] = omitted(WORN)
    friction: Omittable[JournalRubs] = omitted(RUBS)


class SpatialPrismatic(SpatialJoint):
    """A slider of rectangular section in a guide, which the first body carries."""

    needs_axis: ClassVar[bool] = True
    coordinate: ClassVar[str] = "along"
    held: ClassVar[tuple[str, ...]] = ("side", "normal", "roll", "tilt", "tilt")

    type: Literal["prismatic"] = Field(description="kind of joint")
    clearance: Omittable[GuideClearance] = omitted(PLAY)
    stiffness: Omittable[GuideStiffness] = omitted(ELASTIC)
    wear: Omittable[GuideWear] = omitted(WORN)
    friction: Omittable[GuideRubs] = omitted(RUBS)


class Cylindrical(SpatialJoint):
    """A pin that turns and slides in its hole."""

    needs_axis: ClassVar[bool] = True
    coordinate: ClassVar[str] = "along"
    held: ClassVar[tuple[str, ...]] = ("radial", "radial", "tilt", "tilt")
    instead: ClassVar[Mapping[str, str]] = {"friction": "that of a pin which turns and slides at once is not computed"}

    type: Literal["cylindrical"] = Field(description="kind of joint")
    clearance: Omittable[SleeveClearance] = omitted(PLAY)
    stiffness: Omittable[SleeveStiffness] = omitted(ELASTIC)
    wear: Omittable[SleeveWear] = omitted(WORN)


class Spherical(SpatialJoint):
    """A ball in a socket."""

    has_axis: ClassVar[bool] = False
    held: ClassVar[tuple[str, ...]] = ("radial", "radial", "radial")

    type: Literal["spherical"] = Field(description="kind of joint")
    clearance: Omittable[BallClearance] = omitted(PLAY)
    stiffness: Omittable[BallStiffness] = omitted(ELASTIC)
    wear: Omittable[BallWear] = omitted(WORN)
    friction: Omittable[BallRubs] = omitted(RUBS)


class Universal(SpatialJoint):
    """A cross whose two pins, at right angles, sit in one body each."""

    is_pair: ClassVar[bool] = True
    shared: ClassVar[tuple[str, ...]] = ("axes",)
    held: ClassVar[tuple[str, ...]] = ("axial", "radial", "radial", "tilt", "tilt")

    type: Literal["universal"] = Field(description="kind of joint")
    clearance: Omittable[BearingClearance] = omitted("play of each of the two pins")
    stiffness: Omittable[JournalStiffness] = omitted(f"of each of the two pins: {ELASTIC}")
    wear: Omittable[JournalWear] = omitted(f"of each of the two pins: {WORN}")
    friction: Omittable[JournalRubs] = omitted(f"of each of the two pins: {RUBS}")
    axes: Omittable[Annotated[tuple[Direction, Direction], Field(strict=False)]] = omitted(
        "with `bodies`: directions of the pin in the first and of the pin in the second body"
    )

    def _check_axes(self) -> None:
        if self.axis is not None or self.side is not None:
            raise problem("a universal joint has two pins: axes = [[ux, uy, uz], [ux, uy, uz]]")
        for body, place in (self.on or {}).items():
            if place.axis is None:
                raise problem(f"each body needs the axis of its pin: {body} = {self.placement}")
        if self.bodies is None:
            return
        if self.axes is None:
            raise problem("'axes' is missing (with `bodies`: the axis of the pin in each body)")
        first, second = self.axes
        cosine = sum(a * b for a, b in zip(first, second, strict=True)) / (math.hypot(*first) * math.hypot(*second))
        if abs(cosine) > SQUARE:
            angle = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
            raise problem(f"the pins of a cross are at right angles; as drawn, these axes are at {angle:.4g} deg")

    @property
    def placements(self) -> dict[str, SpatialPlacementTable]:
        """Both bodies with the place of the joint and the axis of the pin in it."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        assert self.axes is not None
        ends = zip(self.bodies or (), self.axes, strict=True)
        return {body: SpatialPlacementTable(at=self.at, axis=axis, side=None) for body, axis in ends}


class Planar(SpatialJoint):
    """A plate between two planes; its axis is their normal."""

    needs_axis: ClassVar[bool] = True
    held: ClassVar[tuple[str, ...]] = ("along", "tilt", "tilt")
    instead: ClassVar[Mapping[str, str]] = {"friction": "that of a plate between two planes is not computed"}

    type: Literal["planar"] = Field(description="kind of joint")
    clearance: Omittable[PlateClearance] = omitted(PLAY)
    stiffness: Omittable[PlateStiffness] = omitted(ELASTIC)
    wear: Omittable[PlateWear] = omitted(WORN)


class SpatialFixed(SpatialJoint):
    """Two bodies locked together; axis and side on them give the mounting."""

    held: ClassVar[tuple[str, ...]] = ("along", "side", "normal", "roll", "tilt", "tilt")
    instead: ClassVar[Mapping[str, str]] = dict.fromkeys(("wear", "friction"), "nothing slides in a fixed joint")

    type: Literal["fixed"] = Field(description="kind of joint")
    angle: Omittable[LockedAngle] = omitted("error of the mounting angle about the axis")
    stiffness: Omittable[MountStiffness] = omitted(ELASTIC)

    @model_validator(mode="after")
    def _angle_about_something(self) -> Self:
        if self.angle is not None and self.placements[self.names[0]].axis is None:
            where = f"{self.names[0]} = {self.placement}" if self.on else "axis, beside `at`"
            raise problem(f"the angle is about an axis, which its first body needs: {where}")
        return self
