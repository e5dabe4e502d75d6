"""Joints that tie the motions of two bodies to each other: gears, racks, belts and chains, screws.

A coupling acts between its two bodies, at the pitch point or strand, and holds nothing else: every wheel needs a
bearing of its own, a joint beside the coupling. Pitch radii r and tooth counts z are in one ratio,

    r1 / r2 = z1 / z2,    gears and racks: 2 r = module z,    belts and chains: 2 pi r = pitch z
"""

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from jointplay.errors import not_known, shown

from .clearances import BeltClearance, Eccentric, FlankClearance, Ratio, ScrewClearance
from .friction import RUBS, Efficiencies, ThreadRubs, ToothRubs
from .joints import ELASTIC, JointTable, PlanarJoint
from .placements import PlacementTable, SpatialPlacementTable
from .spatial_joints import SpatialJoint
from .stiffness import FlankStiffness, JournalStiffness, StrandStiffness
from .values import Axis, Direction, Name, NonNegative, Number, Omittable, Pair, Positive, Triple, omitted, problem

#: more teeth than any wheel has; a larger number is a slip of the keyboard
MOST_TEETH = 10_000
#: radii are in the ratio of the teeth to this share; what is written in digits is rounded
ROUNDED = 1e-6
#: the largest whole numbers in whose ratio radii without teeth can be
MOST_PARTS = 1000

Teeth = Annotated[int, Field(ge=1, le=MOST_TEETH)]
TwoTeeth = Annotated[tuple[Teeth, Teeth], Field(strict=False)]
TwoRadii = Annotated[tuple[Positive, Positive], Field(strict=False)]


#: what to say of wear
WEARS = (
    "how flanks, belts and threads slide differs from place to place, and is not computed; `sweep` over the clearance"
    " shows what wear does"
)


class Coupling(JointTable):
    """A joint that ties the motions of two bodies to each other."""

    is_pair: ClassVar[bool] = True
    instead: ClassVar[Mapping[str, str]] = {
        "wear": WEARS,
        "friction": "of flanks and belts the efficiency is given, such as efficiency = 0.97",
    }

    ratio_error: Omittable[Ratio] = omitted(
        "transmission error, a length at the pitch circle (of crossed gears that of the second wheel, of a"
        " screw along its axis)",
    )
    efficiency: Omittable[Efficiencies] = omitted(
        "power out over power in, which counts where a direction of approach is asked for; of a pair the"
        " first where the first body drives, of a screw where its turning drives",
    )

    @model_validator(mode="after")
    def _loses_once(self) -> Self:
        if self.rubs is not None and self.efficiency is not None:
            raise problem("give friction or efficiency, not both")
        return self

    @property
    def loses(self) -> bool:
        """Whether power is lost in it."""
        return super().loses or self.efficiency is not None


class Mesh(Coupling):
    """A coupling at the rims of wheels."""

    places: ClassVar[bool] = False
    #: places of the wheels among its two bodies; a rack is none
    wheels: ClassVar[tuple[int, ...]] = (0, 1)
    drawn: ClassVar[str] = "a point for each of the two bodies, [{point}, {point}]"

    runout: dict[Name, Eccentric] = Field({}, description="eccentricity of its wheels, by the name of the body")

    @model_validator(mode="after")
    def _about_its_bodies(self) -> Self:
        for name in self.runout:
            if name not in [self.names[k] for k in self.wheels]:
                known = [self.names[k] for k in self.wheels]
                raise problem(f"runout: {not_known(name, 'a wheel of this joint', known)}")
        marks = self.directions
        if marks is not None and set(marks) != set(self.names):
            first, second = self.names
            raise problem(f"marks is a direction on each of the two bodies: {{ {first} = ..., {second} = ... }}")
        return self

    @property
    def displaced(self) -> set[str]:
        """The bodies on which it deviates by itself; a wheel that runs out is not where its bearing is."""
        return super().displaced | {*self.runout}

    @property
    def directions(self) -> Mapping[str, Any] | None:
        """Its marks, where it can have any."""
        return getattr(self, "marks", None)

    @property
    def radii(self) -> tuple[float, ...]:
        """Pitch radius of every wheel, in file units."""
        raise NotImplementedError

    @property
    def counts(self) -> tuple[int, ...]:
        """Tooth counts, or whole numbers in the ratio of the radii."""
        raise NotImplementedError


MARKS = (
    "direction from the first centre to the second in the axes of each body, where the teeth mesh; as in the start if"
    " left out"
)


class PlanarMesh(PlanarJoint, Mesh):
    """A coupling at the rims of wheels in the plane."""

    at: Omittable[Annotated[tuple[Pair, Pair], Field(strict=False)]] = omitted(  # type: ignore[assignment]
        "with `bodies`: the joint's point on each of the two, as drawn"
    )

    @property
    def placements(self) -> dict[str, PlacementTable]:
        """Both bodies with the place of the joint on each."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        axes = (self.axis, None)
        drawn = zip(self.bodies or (), self.at, axes, strict=True)
        return {body: PlacementTable(at=at, axis=axis) for body, at, axis in drawn}


class SpatialMesh(SpatialJoint, Mesh):
    """A coupling at the rims of wheels in space."""

    needs_axis: ClassVar[bool] = True

    at: Omittable[Annotated[tuple[Triple, Triple], Field(strict=False)]] = omitted(  # type: ignore[assignment]
        "with `bodies`: the joint's point on each of the two, as drawn"
    )

    @property
    def placements(self) -> dict[str, SpatialPlacementTable]:
        """Both bodies with the place of the joint on each."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        drawn = zip(self.bodies or (), self.at, strict=True)
        return {body: SpatialPlacementTable(at=at, axis=self.axis, side=self.side) for body, at in drawn}


def _in_ratio(radii: Sequence[float], teeth: Sequence[int]) -> None:
    wanted = radii[0] * teeth[1] / teeth[0]
    if not math.isclose(radii[1], wanted, rel_tol=ROUNDED):
        raise problem(
            f"pitch radii are in the ratio of the teeth: with {shown(list(teeth))} teeth and a first radius of"
            f" {radii[0]:.10g} the second is {wanted:.10g}, not {radii[1]:.10g}"
        )


class GearKeys(Mesh):
    """What a gear pair is in the plane and in space."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["module"]}, {"required": ["radii"]}]})

    held: ClassVar[tuple[str, ...]] = ("flank",)

    type: Literal["gear"] = Field(description="kind of joint")
    clearance: Omittable[FlankClearance] = omitted("play built into the joint")
    stiffness: Omittable[FlankStiffness] = omitted(ELASTIC)
    teeth: TwoTeeth = Field(description="tooth counts of the wheels on the first and on the second body")
    module: Omittable[Positive] = omitted("module: pitch diameter over tooth count")
    pitch_radii: Omittable[TwoRadii] = omitted("instead of the module: pitch radii of both wheels", alias="radii")
    internal: bool = Field(False, description="whether the second body is a ring with teeth inside")
    pressure_angle: Omittable[NonNegative] = omitted(
        "pressure angle where the pitch circles touch, at most 45 degrees; 20 if left out"
    )

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if (self.module is None) == (self.pitch_radii is None):
            raise problem(
                "say how large the wheels are: module (pitch diameter over tooth count) or radii = [first, second]"
                " (pitch radii)" + (", not both" if self.module is not None else "")
            )
        if self.pitch_radii is not None:
            _in_ratio(self.pitch_radii, self.teeth)
        if self.internal and self.teeth[1] <= self.teeth[0]:
            planet, ring = self.names
            raise problem(
                f"with internal = true the second body is the ring and has more teeth than the wheel inside;"
                f" here '{ring}' has {self.teeth[1]} and '{planet}' {self.teeth[0]}"
            )
        return self

    @property
    def radii(self) -> tuple[float, ...]:
        """Pitch radii, in file units."""
        first = self.pitch_radii[0] if self.pitch_radii else self.teeth[0] * (self.module or 0.0) / 2.0
        return first, first * self.teeth[1] / self.teeth[0]

    @property
    def counts(self) -> tuple[int, ...]:
        """Tooth counts."""
        return self.teeth


class RackKeys(Mesh):
    """What a rack and its pinion are in the plane and in space."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [{"required": ["radius"]}, {"required": ["module"]}],
            "dependentRequired": {"module": ["teeth"]},
        }
    )
    wheels: ClassVar[tuple[int, ...]] = (1,)
    needs_axis: ClassVar[bool] = True

    held: ClassVar[tuple[str, ...]] = ("flank",)

    type: Literal["rack"] = Field(description="kind of joint")
    clearance: Omittable[FlankClearance] = omitted("play built into the joint")
    stiffness: Omittable[FlankStiffness] = omitted(ELASTIC)
    radius: Omittable[Positive] = omitted("pitch radius of the pinion")
    teeth: Omittable[Teeth] = omitted("tooth count of the pinion")
    module: Omittable[Positive] = omitted("instead of the radius, with teeth: pitch diameter over tooth count")
    pressure_angle: Omittable[NonNegative] = omitted("pressure angle, at most 45 degrees; 20 if left out")

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if (self.module is None) == (self.radius is None):
            raise problem(
                "say how large the pinion is: radius (pitch radius) or module with teeth"
                + (", not both" if self.module is not None else "")
            )
        if self.module is not None and self.teeth is None:
            raise problem("'teeth' is missing (tooth count of the pinion, which a module needs)")
        return self

    @property
    def radii(self) -> tuple[float, ...]:
        """Pitch radius of the pinion, in file units."""
        return (self.radius if self.radius is not None else (self.module or 0.0) * (self.teeth or 0) / 2.0,)

    @property
    def counts(self) -> tuple[int, ...]:
        """Tooth count of the pinion; one where none is given."""
        return (self.teeth or 1,)


class BeltKeys(Mesh):
    """What a belt or chain is in the plane and in space."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [{"required": ["radii"]}, {"required": ["pitch"]}],
            "dependentRequired": {"pitch": ["teeth"]},
        }
    )

    held: ClassVar[tuple[str, ...]] = ("strand",)

    type: Literal["belt"] = Field(description="kind of joint")
    clearance: Omittable[BeltClearance] = omitted("slack of the belt or chain")
    stiffness: Omittable[StrandStiffness] = omitted(ELASTIC)
    pitch_radii: Omittable[TwoRadii] = omitted(
        "pitch radii of the pulleys on the first and on the second body", alias="radii"
    )
    teeth: Omittable[TwoTeeth] = omitted("tooth counts of the pulleys or sprockets")
    pitch: Omittable[Positive] = omitted("instead of the radii, with teeth: distance of two teeth of the belt or chain")
    crossed: bool = Field(False, description="whether it is crossed, so that the pulleys turn against each other")
    distance: Omittable[Positive] = omitted(
        "distance of the centres at which it has its slack; as in the start if left out"
    )

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if (self.pitch is None) == (self.pitch_radii is None):
            raise problem(
                "say how large the pulleys are: radii = [first, second] (pitch radii) or pitch with teeth"
                + (", not both" if self.pitch is not None else "")
            )
        if self.pitch is not None and self.teeth is None:
            raise problem("'teeth' is missing (tooth counts of both pulleys, which a pitch needs)")
        if self.pitch_radii is not None:
            if self.teeth is None and not math.isclose(self._parts, self.pitch_radii[1] / self.pitch_radii[0]):
                raise problem(
                    f"radii = {shown(list(self.pitch_radii))} are in no ratio of whole numbers up to {MOST_PARTS};"
                    " give teeth = [first, second], and pitch instead of radii"
                )
            _in_ratio(self.pitch_radii, self.counts)
        return self

    @property
    def _parts(self) -> Fraction:
        """The nearest ratio of whole numbers of the second radius to the first."""
        assert self.pitch_radii is not None
        return Fraction(self.pitch_radii[1] / self.pitch_radii[0]).limit_denominator(MOST_PARTS)

    @property
    def radii(self) -> tuple[float, ...]:
        """Pitch radii, in file units."""
        first, second = self.counts
        own = self.pitch_radii[0] if self.pitch_radii else first * (self.pitch or 0.0) / (2.0 * math.pi)
        return own, own * second / first

    @property
    def counts(self) -> tuple[int, ...]:
        """Tooth counts, or whole numbers in the ratio of the radii."""
        return self.teeth or (self._parts.denominator, self._parts.numerator)


class CrossedGear(SpatialMesh):
    """Two toothed wheels whose axes cross or intersect: worm and wheel, crossed helical, bevel or hypoid gears."""

    instead: ClassVar[Mapping[str, str]] = {"wear": WEARS}
    shared: ClassVar[tuple[str, ...]] = ("axes",)
    held: ClassVar[tuple[str, ...]] = ("flank",)
    drawn: ClassVar[str] = "the centres of both pitch circles, [{point}, {point}]"

    type: Literal["crossed_gear"] = Field(description="kind of joint")
    clearance: Omittable[FlankClearance] = omitted("play built into the joint")
    stiffness: Omittable[FlankStiffness] = omitted(ELASTIC)
    teeth: TwoTeeth = Field(
        description="tooth counts of the wheels on the first and on the second body; of a worm its threads"
    )
    pitch_radii: TwoRadii = Field(alias="radii", description="radii of both pitch circles, which touch each other")
    hand: Omittable[Literal["right", "left"]] = omitted(
        "hand of the teeth or threads of the first wheel; straight teeth have none"
    )
    spiral_angle: Omittable[NonNegative] = omitted(
        "only where the axes intersect: angle from straight teeth at the pitch point"
    )
    pressure_angle: Omittable[NonNegative] = omitted(
        "pressure angle in the section across the teeth, at most 45 degrees; 20 if left out"
    )
    marks: Omittable[dict[Name, Direction]] = omitted(
        "direction from each centre to the pitch point in the axes of each body, where the teeth mesh; as"
        " in the start if left out",
    )
    friction: Omittable[ToothRubs] = omitted(
        f"of teeth that slide where the pitch circles touch, as those of worms do: {RUBS}"
    )
    axes: Omittable[Annotated[tuple[Direction, Direction], Field(strict=False)]] = omitted(
        "with `bodies`: directions of the axes of the first and of the second wheel"
    )

    @model_validator(mode="after")
    def _inclined_to_a_hand(self) -> Self:
        if self.spiral_angle and self.hand is None:
            raise problem('a spiral_angle needs the hand of the first wheel: hand = "right" or "left"')
        return self

    def _check_axes(self) -> None:
        if self.axis is not None or self.side is not None:
            raise problem("two wheels whose axes cross have two: axes = [[ux, uy, uz], [ux, uy, uz]]")
        for body, place in (self.on or {}).items():
            if place.axis is None:
                raise problem(f"each wheel needs its axis: {body} = {self.placement}")
        if self.bodies is not None and self.axes is None:
            raise problem("'axes' is missing (with `bodies`: the axis of the wheel on each body)")

    @property
    def placements(self) -> dict[str, SpatialPlacementTable]:
        """Both bodies with the centre and the axis of their wheel."""
        if self.on is not None:
            return self.on
        assert self.at is not None
        assert self.axes is not None
        drawn = zip(self.bodies or (), self.at, self.axes, strict=True)
        return {body: SpatialPlacementTable(at=at, axis=axis, side=None) for body, at, axis in drawn}

    @property
    def radii(self) -> tuple[float, ...]:
        """Pitch radii, in file units."""
        return self.pitch_radii

    @property
    def counts(self) -> tuple[int, ...]:
        """Tooth counts."""
        return self.teeth


class Gear(PlanarMesh, GearKeys):
    """Two toothed wheels that mesh."""

    marks: Omittable[dict[Name, Axis]] = omitted(MARKS)


class SpatialGear(SpatialMesh, GearKeys):
    """Two toothed wheels that mesh, of parallel axes."""

    marks: Omittable[dict[Name, Direction]] = omitted(MARKS)


class Rack(PlanarMesh, RackKeys):
    """A rack on the first body, along the joint's axis, and a pinion on the second."""

    @model_validator(mode="after")
    def _pinion_has_no_axis(self) -> Self:
        pinion = self.names[1]
        if self.placements[pinion].axis is not None:
            raise problem(f"only the rack on the first body has an axis; take it from the pinion on '{pinion}'")
        return self


class SpatialRack(SpatialMesh, RackKeys):
    """A rack on the first body, along the joint's side, and a pinion on the second that turns about its axis."""

    @model_validator(mode="after")
    def _along_something(self) -> Self:
        if self.placements[self.names[0]].side is None:
            where = f"{self.names[0]} = {{ at, axis, side }}" if self.on else "side, beside `at`"
            raise problem(
                f"a rack lies along the side on its first body, across the axis of the pinion; side is missing: {where}"
            )
        return self


class Belt(PlanarMesh, BeltKeys):
    """A belt or chain around two pulleys."""

    marks: Omittable[dict[Name, Axis]] = omitted(MARKS)


class SpatialBelt(SpatialMesh, BeltKeys):
    """A belt or chain around two pulleys of parallel axes."""

    marks: Omittable[dict[Name, Direction]] = omitted(MARKS)


class Screw(SpatialJoint, Coupling):
    """A screw in a nut, which the first body carries or is."""

    instead: ClassVar[Mapping[str, str]] = {"wear": WEARS}
    needs_axis: ClassVar[bool] = True
    coordinate: ClassVar[str] = "angle"
    held: ClassVar[tuple[str, ...]] = ("axial", "radial", "radial", "tilt", "tilt")

    type: Literal["screw"] = Field(description="kind of joint")
    clearance: Omittable[ScrewClearance] = omitted("play built into the joint")
    stiffness: Omittable[JournalStiffness] = omitted(ELASTIC)
    lead: Number = Field(
        description="travel of the second body along the axis for one turn; negative for a left-hand one"
    )
    friction: Omittable[ThreadRubs] = omitted(f"of its thread: {RUBS}")

    @model_validator(mode="after")
    def _has_a_lead(self) -> Self:
        if self.lead == 0.0:
            raise problem("lead = 0 moves nothing; it is the travel along the axis for one turn")
        return self
