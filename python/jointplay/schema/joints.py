"""The joints of a mechanism file and their clearances."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic.json_schema import SkipJsonSchema

from jointplay.errors import listed, nearest, shown, suggestion

from .values import (
    Axis,
    ClearanceLaw,
    Name,
    NonNegative,
    Number,
    Pair,
    Placement,
    PlacementTable,
    Positive,
    Table,
    Tolerance,
    ToleranceLaw,
    check_law,
    problem,
)

LAW = "uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary"


class RevoluteClearance(Table):
    """Play of a pin in its hole: the pin's centre lies in a disc."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["radial"]}, {"required": ["diametral"]}]})
    example: ClassVar[str] = "{ radial = 0.02 } (hole radius - pin radius) or { diametral = 0.04 }"

    radial: NonNegative | SkipJsonSchema[None] = Field(None, description="hole radius minus pin radius")
    diametral: NonNegative | SkipJsonSchema[None] = Field(None, description="hole diameter minus pin diameter")
    law: ClearanceLaw = Field("uniform", description=LAW)

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if self.radial is None and self.diametral is None:
            raise problem("say which clearance is meant: radial (hole radius - pin radius) or diametral (twice that)")
        if self.radial is not None and self.diametral is not None:
            raise problem("give radial or diametral, not both")
        return self

    @property
    def radius(self) -> float:
        """Radius of the disc, in file units."""
        return self.radial if self.radial is not None else (self.diametral or 0.0) / 2.0


class PrismaticClearance(Table):
    """Play of a slider in its guide: it may shift, and tilt over its length."""

    example: ClassVar[str] = "{ gap = 0.02, length = 40 }"

    gap: NonNegative = Field(description="gap on each side of the slider")
    length: Positive = Field(description="length of the slider inside its guide")
    law: ClearanceLaw = Field("uniform", description=LAW)


class SlotClearance(Table):
    """Play of a pin across its slot."""

    example: ClassVar[str] = "{ gap = 0.02 }"

    gap: NonNegative = Field(description="gap on each side of the pin")
    law: ClearanceLaw = Field("uniform", description=LAW)


class LockedAngle(Table):
    """The angle at which two bodies are locked together, as an error around the mounting angle."""

    example: ClassVar[str] = "{ tolerance = 0.1, deviation = 0 }"

    tolerance: Tolerance | SkipJsonSchema[None] = Field(None, description="how far the angle may be off")
    deviation: Number = Field(0.0, description="the known error of one built unit")
    law: ToleranceLaw | SkipJsonSchema[None] = Field(None, description="normal (three sigma, default) or uniform")

    @model_validator(mode="after")
    def _law(self) -> Self:
        check_law(self.tolerance, self.law)
        return self


class _Joint(Table):
    """Where a joint sits: on each of its bodies in their own axes, or once for bodies drawn assembled."""

    needs_axis: ClassVar[bool] = False
    may_turn: ClassVar[bool] = False

    on: dict[Name, Placement] | SkipJsonSchema[None] = Field(
        None, description="the bodies with the joint's place on each, in body axes; the first carries pin or guide"
    )
    bodies: Annotated[tuple[Name, ...], Field(strict=False)] | SkipJsonSchema[None] = Field(
        None, description="instead of `on`: bodies described in one assembled reference configuration"
    )
    at: Pair | SkipJsonSchema[None] = Field(None, description="with `bodies`: the joint's point, the same for all")
    axis: Axis | SkipJsonSchema[None] = Field(None, description="with `bodies`: its direction, the same for all")

    @model_validator(mode="after")
    def _placed(self) -> Self:
        if (self.on is None) == (self.bodies is None):
            raise problem("say where it sits: either on = { BODY = [x, y], BODY = [x, y] }, or bodies and at")
        if self.on is not None and (self.at is not None or self.axis is not None):
            raise problem("at and axis at this place go with `bodies`; with `on` every body has its own")
        if self.bodies is not None and self.at is None:
            raise problem("'at' is missing (with `bodies`: the joint's point [x, y])")
        names = list(self.on or self.bodies or ())
        if len(names) < 2:
            raise problem(f"a joint connects two bodies or more, not {listed(names)}")
        if len(set(names)) < len(names):
            raise problem(f"a joint connects different bodies, not {listed(names)}")
        self._check_axes()
        return self

    def _check_axes(self) -> None:
        first, *others = self.placements.items()
        if self.needs_axis and first[1].axis is None:
            raise problem(f"its first body needs an axis: {first[0]} = {{ at = [x, y], axis = [ux, uy] }}")
        turned = [name for name, p in [first, *others] if p.axis is not None]
        if turned and not self.needs_axis and not self.may_turn:
            raise problem(f"a {self.kind} joint in the plane has no axis; take it from '{turned[0]}'")

    @property
    def kind(self) -> str:
        """The joint's type."""
        return str(getattr(self, "type", ""))

    @property
    def placements(self) -> dict[str, PlacementTable]:
        """Every body with the place of the joint on it, the carrier first."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        return {body: PlacementTable(at=self.at, axis=self.axis) for body in self.bodies or ()}


class Revolute(_Joint):
    """A pin in a hole."""

    type: Literal["revolute"] = Field(description="kind of joint")
    clearance: RevoluteClearance | SkipJsonSchema[None] = Field(None, description="play built into the joint")


class Prismatic(_Joint):
    """A slider in a guide, which the first body carries."""

    needs_axis: ClassVar[bool] = True
    may_turn: ClassVar[bool] = True

    type: Literal["prismatic"] = Field(description="kind of joint")
    clearance: PrismaticClearance | SkipJsonSchema[None] = Field(None, description="play built into the joint")


class PinInSlot(_Joint):
    """A pin in a straight slot, which the first body carries."""

    needs_axis: ClassVar[bool] = True

    type: Literal["pin_in_slot"] = Field(description="kind of joint")
    clearance: SlotClearance | SkipJsonSchema[None] = Field(None, description="play built into the joint")

    @model_validator(mode="after")
    def _pin_has_no_axis(self) -> Self:
        for body, placement in list((self.on or {}).items())[1:]:
            if placement.axis is not None:
                raise problem(f"only the slot on the first body has an axis; take it from the pin on '{body}'")
        return self


class Fixed(_Joint):
    """Two bodies locked together; an axis on them gives the mounting angle."""

    may_turn: ClassVar[bool] = True

    type: Literal["fixed"] = Field(description="kind of joint")
    angle: LockedAngle | SkipJsonSchema[None] = Field(None, description="error of the mounting angle")


KINDS = ("revolute", "prismatic", "pin_in_slot", "fixed")
#: what the file format has for mechanisms in space
SPATIAL = ("cylindrical", "spherical", "universal", "planar")


def _check_kind(value: Any) -> Any:
    if isinstance(value, _Joint):
        return value
    if not isinstance(value, dict):
        raise problem(f'a table such as {{ type = "revolute", on = {{ ... }} }} is needed, not {shown(value)}')
    if "type" not in value:
        near = nearest("type", map(str, value))
        raise problem(f"'type' is missing (one of {listed(KINDS)})" + (f"; is it '{near}'?" if near else ""))
    kind = value["type"]
    if kind in SPATIAL:
        raise problem(f"{shown(kind)} is a joint in space; in the plane there are {listed(KINDS)}")
    if kind not in KINDS:
        raise problem(f"type = {shown(kind)} is not a joint; {suggestion(str(kind), KINDS)}")
    return value


def _tag(value: Any) -> str:
    return f"<{value.kind if isinstance(value, _Joint) else value['type']}>"


#: tags in angle brackets, because no key of a file can look like that
Joint = Annotated[
    Annotated[Revolute, Tag("<revolute>")]
    | Annotated[Prismatic, Tag("<prismatic>")]
    | Annotated[PinInSlot, Tag("<pin_in_slot>")]
    | Annotated[Fixed, Tag("<fixed>")],
    Discriminator(_tag),
    BeforeValidator(_check_kind),
]
