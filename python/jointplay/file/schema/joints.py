"""The joints of mechanisms in the plane, and what all joints have in common."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from jointplay.errors import listed, not_known

from .clearances import LockedAngle, PrismaticClearance, RevoluteClearance, SlotClearance
from .deviations import Component, ComponentDeviation, PlanarPosition, Zone
from .friction import RUBS, Friction, PinRubs, SliderRubs, SlotRubs
from .placements import Placement, PlacementKeys, PlacementTable
from .stiffness import ClampStiffness, PinStiffness, SliderStiffness, SlotStiffness
from .values import IN_SPACE, Axis, Name, Omittable, Pair, Table, omitted, problem
from .wear import WORN, BlockWear, PinWear, SliderWear, Wear

#: what the key `stiffness` is, for all kinds of joints
ELASTIC = "how hard it is in the directions that it holds; rigid if left out"


class JointTable(Table):
    """Where a joint sits: on each of its bodies in their own axes, or once for bodies drawn assembled."""

    needs_axis: ClassVar[bool] = False
    #: what a drive commands: `angle`, `along`, or nothing
    coordinate: ClassVar[str] = ""
    #: whether it connects two bodies and no more
    is_pair: ClassVar[bool] = False
    #: whether one of its bodies can be placed beside the other by it
    places: ClassVar[bool] = True
    #: keys of its stiffness, in the order of the directions that it holds
    held: ClassVar[tuple[str, ...]] = ()
    #: how a point, a placement with an axis, and `at` beside `bodies` are written
    point: ClassVar[str]
    placement: ClassVar[str]
    drawn: ClassVar[str] = "the joint's point {point}"

    on: Mapping[str, PlacementKeys] | None
    bodies: Omittable[Annotated[tuple[Name, ...], Field(strict=False)]] = omitted(
        "instead of `on`: bodies described in one assembled reference configuration"
    )
    at: tuple[Any, ...] | None
    position: Mapping[str, Zone]
    direction: Mapping[str, Zone | ComponentDeviation]

    #: the keys that say it once, beside `at`
    shared: ClassVar[tuple[str, ...]] = ("axis",)

    @model_validator(mode="after")
    def _placed(self) -> Self:
        point = self.point
        if (self.on is None) == (self.bodies is None):
            raise problem(f"say where it sits: either on = {{ BODY = {point}, BODY = {point} }}, or bodies and at")
        if self.on is not None and any(getattr(self, key) is not None for key in ("at", *self.shared)):
            keys = ", ".join(["at", *self.shared[:-1]])
            raise problem(
                f"{keys} and {self.shared[-1]} at this place go with `bodies`; with `on` every body has its own"
            )
        if self.bodies is not None and self.at is None:
            raise problem(f"'at' is missing (with `bodies`: {self.drawn.format(point=point)})")
        names = self.names
        if len(names) < 2:
            raise problem(f"a joint connects two bodies or more, not {listed(names)}")
        if len(set(names)) < len(names):
            raise problem(f"a joint connects different bodies, not {listed(names)}")
        if self.is_pair and len(names) > 2:
            raise problem(f"a {self.kind} joint connects two bodies, not {listed(names)}")
        self._check_axes()
        return self

    @model_validator(mode="after")
    def _deviates_on_its_bodies(self) -> Self:
        for key, bodies in (("position", self.position), ("direction", self.direction)):
            for body in bodies:
                if body not in self.names:
                    raise problem(f"{key}: {not_known(body, 'a body of this joint', self.names)}")
        for body in self.direction:
            if not self.has_direction(body):
                raise problem(f"direction: {self.no_direction(body)}")
        return self

    @model_validator(mode="after")
    def _has_what_wears(self) -> Self:
        if self.wears is not None:
            play = getattr(self, "clearance", None)
            if play is None:
                raise problem("wear: it goes with clearance, which grows by it")
            self.wears.check(play)
        return self

    @property
    def wears(self) -> Wear | None:
        """How its clearance grows; None where the file does not say."""
        return getattr(self, "wear", None)

    @model_validator(mode="after")
    def _has_what_rubs(self) -> Self:
        if self.rubs is not None:
            self.rubs.check(getattr(self, "clearance", None))
        return self

    @property
    def rubs(self) -> Friction | None:
        """What holds it back; None where the file does not say."""
        return getattr(self, "friction", None)

    @property
    def loses(self) -> bool:
        """Whether power is lost in it."""
        return self.rubs is not None

    def has_direction(self, body: str) -> bool:
        """Whether it has an axis on a body, which can deviate."""
        raise NotImplementedError

    def no_direction(self, body: str) -> str:
        """Why its axis on a body cannot deviate."""
        return f"a {self.kind} joint has no axis on '{body}'"

    @property
    def displaced(self) -> set[str]:
        """The bodies on which it deviates by itself, so that it is not where others of the same place are."""
        return {*self.position, *self.direction}

    def _check_axes(self) -> None:
        """Refuse axes that the kind of joint has not, and ask for those that it needs."""

    def _check_first_axis(self, axis: object) -> None:
        if self.needs_axis and axis is None:
            where = f"{self.names[0]} = {self.placement}" if self.on else "axis, beside `at`"
            raise problem(f"its first body needs an axis: {where}")

    @property
    def kind(self) -> str:
        """The joint's type."""
        return str(getattr(self, "type", ""))

    @property
    def names(self) -> Sequence[str]:
        """Its bodies, the carrier first."""
        return list(self.on or self.bodies or ())

    @property
    def placements(self) -> Mapping[str, PlacementKeys]:
        """Every body with the place of the joint on it, the carrier first."""
        raise NotImplementedError

    @property
    def is_drawn_assembled(self) -> bool:
        """Whether its bodies are described in one assembled reference configuration."""
        return self.on is None


class PlanarJoint(JointTable):
    """A joint in the plane."""

    may_turn: ClassVar[bool] = False
    point: ClassVar[str] = "[x, y]"
    placement: ClassVar[str] = "{ at = [x, y], axis = [ux, uy] }"
    elsewhere: ClassVar[Mapping[str, str]] = {"side": IN_SPACE, "axes": IN_SPACE}

    on: Omittable[dict[Name, Placement]] = omitted(
        "the bodies with the joint's place on each, in body axes; the first carries pin or guide"
    )
    at: Omittable[Pair] = omitted("with `bodies`: the joint's point, the same for all")
    axis: Omittable[Axis] = omitted("with `bodies`: its direction, the same for all")
    position: dict[Name, PlanarPosition] = Field({}, description="deviation of its place, by the name of the body")
    direction: dict[Name, Component] = Field(
        {}, description="deviation of the angle of its axis, by the name of the body"
    )

    def has_direction(self, body: str) -> bool:
        """Whether it has an axis on a body, which can deviate."""
        return self.needs_axis and (self.may_turn or body == self.names[0])

    def _check_axes(self) -> None:
        places = self.placements
        self._check_first_axis(places[self.names[0]].axis)
        turned = [name for name, place in places.items() if place.axis is not None]
        if turned and not self.needs_axis and not self.may_turn:
            raise problem(f"a {self.kind} joint in the plane has no axis; take it from '{turned[0]}'")

    @property
    def placements(self) -> dict[str, PlacementTable]:
        """Every body with the place of the joint on it, the carrier first."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        return {body: PlacementTable(at=self.at, axis=self.axis) for body in self.bodies or ()}


class Revolute(PlanarJoint):
    """A pin in a hole."""

    coordinate: ClassVar[str] = "angle"
    held: ClassVar[tuple[str, ...]] = ("radial", "radial")

    type: Literal["revolute"] = Field(description="kind of joint")
    clearance: Omittable[RevoluteClearance] = omitted("play built into the joint")
    stiffness: Omittable[PinStiffness] = omitted(ELASTIC)
    wear: Omittable[PinWear] = omitted(WORN)
    friction: Omittable[PinRubs] = omitted(RUBS)


class Prismatic(PlanarJoint):
    """A slider in a guide, which the first body carries."""

    needs_axis: ClassVar[bool] = True
    may_turn: ClassVar[bool] = True
    coordinate: ClassVar[str] = "along"
    held: ClassVar[tuple[str, ...]] = ("normal", "tilt")

    type: Literal["prismatic"] = Field(description="kind of joint")
    clearance: Omittable[PrismaticClearance] = omitted("play built into the joint")
    stiffness: Omittable[SliderStiffness] = omitted(ELASTIC)
    wear: Omittable[SliderWear] = omitted(WORN)
    friction: Omittable[SliderRubs] = omitted(RUBS)


class PinInSlot(PlanarJoint):
    """A pin in a straight slot, which the first body carries."""

    needs_axis: ClassVar[bool] = True
    coordinate: ClassVar[str] = "along"
    held: ClassVar[tuple[str, ...]] = ("normal",)

    type: Literal["pin_in_slot"] = Field(description="kind of joint")
    clearance: Omittable[SlotClearance] = omitted("play built into the joint")
    stiffness: Omittable[SlotStiffness] = omitted(ELASTIC)
    wear: Omittable[BlockWear] = omitted(WORN)
    friction: Omittable[SlotRubs] = omitted(RUBS)

    @model_validator(mode="after")
    def _pin_has_no_axis(self) -> Self:
        for body, placement in list((self.on or {}).items())[1:]:
            if placement.axis is not None:
                raise problem(f"only the slot on the first body has an axis; take it from the pin on '{body}'")
        return self


class Fixed(PlanarJoint):
    """Two bodies locked together; an axis on them gives the mounting angle."""

    may_turn: ClassVar[bool] = True
    held: ClassVar[tuple[str, ...]] = ("along", "normal", "tilt")
    instead: ClassVar[Mapping[str, str]] = dict.fromkeys(("wear", "friction"), "nothing slides in a fixed joint")

    type: Literal["fixed"] = Field(description="kind of joint")
    clearance: Omittable[RevoluteClearance] = omitted("play of a pin whose angle is locked: a hinge that latches")
    angle: Omittable[LockedAngle] = omitted("error of the mounting angle")
    stiffness: Omittable[ClampStiffness] = omitted(ELASTIC)
