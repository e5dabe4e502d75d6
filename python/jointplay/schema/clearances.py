"""The clearances of joints, and the errors of locked ones and of couplings: their keys in the plane and in space."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator
from pydantic.json_schema import SkipJsonSchema

from .values import (
    IN_SPACE,
    ClearanceLaw,
    Deviating,
    NonNegative,
    Pair,
    Positive,
    Table,
    is_number,
    problem,
)

LAW = "uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary"


class Clearance(Table):
    """What all clearances have."""

    law: ClearanceLaw = Field("uniform", description=LAW)


class RadialClearance(Clearance):
    """Play of something round in something round: its size is the difference of the radii."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["radial"]}, {"required": ["diametral"]}]})

    radial: NonNegative | SkipJsonSchema[None] = Field(None, description="hole radius minus pin radius")
    diametral: NonNegative | SkipJsonSchema[None] = Field(None, description="hole diameter minus pin diameter")
    diameter: Positive | SkipJsonSchema[None] = Field(
        None, description="diameter of pin and hole, by which the clearance changes where the bodies grow differently"
    )

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if self.radial is None and self.diametral is None:
            raise problem("say which clearance is meant: radial (hole radius - pin radius) or diametral (twice that)")
        if self.radial is not None and self.diametral is not None:
            raise problem("give radial or diametral, not both")
        return self

    @property
    def radius(self) -> float:
        """Radius of the play, in file units."""
        return self.radial if self.radial is not None else (self.diametral or 0.0) / 2.0


class RevoluteClearance(RadialClearance):
    """Play of a pin in its hole: the pin's centre lies in a disc."""

    example: ClassVar[str] = "{ radial = 0.02 } (hole radius - pin radius) or { diametral = 0.04 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"axial": IN_SPACE, "length": IN_SPACE}


class PrismaticClearance(Clearance):
    """Play of a slider in its guide: it may shift, and tilt over its length."""

    example: ClassVar[str] = "{ gap = 0.02, length = 40 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"width": IN_SPACE, "height": IN_SPACE}

    gap: NonNegative = Field(description="gap on each side of the slider")
    length: Positive = Field(description="length of the slider inside its guide")


class SlotClearance(Clearance):
    """Play of a pin across its slot."""

    example: ClassVar[str] = "{ gap = 0.02 }"

    gap: NonNegative = Field(description="gap on each side of the pin")


class SleeveClearance(RadialClearance):
    """Play of a pin in its hole, in space: both of its ends lie in a disc, so that it may shift and tilt."""

    example: ClassVar[str] = "{ radial = 0.02, length = 30 }"

    length: Positive | SkipJsonSchema[None] = Field(None, description="length of the pin inside its hole")

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.radius > 0.0 and self.length is None:
            raise problem("'length' is missing (length of the pin inside its hole: it decides how far the pin tilts)")
        return self


class JournalClearance(SleeveClearance):
    """Play of a pin in its hole and along it, in space."""

    example: ClassVar[str] = "{ radial = 0.02, axial = 0.05, length = 30 }"

    axial: NonNegative = Field(0.0, description="how far the pin can slide to each side")


class GuideClearance(Clearance):
    """Play of a slider of rectangular section in its guide: it may shift, tilt over its length, and roll."""

    example: ClassVar[str] = "{ gap = 0.02, length = 40, width = 20, height = 10 }"

    gap: NonNegative = Field(description="gap on each side of the slider")
    length: Positive = Field(description="length of the slider inside its guide")
    width: Positive = Field(description="size of its section along `side`")
    height: Positive | SkipJsonSchema[None] = Field(
        None, description="size of its section across axis and `side`; as its width if left out"
    )


class BallClearance(RadialClearance):
    """Play of a ball in its socket: its centre lies in a ball."""

    example: ClassVar[str] = "{ radial = 0.02 } (socket radius - ball radius) or { diametral = 0.04 }"


class PlateClearance(Clearance):
    """Play of a plate between two planes: it may rise, and tilt over its size."""

    example: ClassVar[str] = "{ gap = 0.02, size = [40, 30] }"

    gap: NonNegative = Field(description="gap on each side of the plate")
    size: Annotated[tuple[Positive, Positive], Field(strict=False)] = Field(
        description="size of the plate [along `side`, across it]"
    )


class LockedAngle(Deviating):
    """The angle at which two bodies are locked together, as an error around the mounting angle."""

    example: ClassVar[str] = "{ tolerance = 0.1, deviation = 0 }"


class RatioError(Deviating):
    """Transmission error: how far the second body is from where the first one should bring it, as a length."""

    example: ClassVar[str] = '0.01 or { tolerance = 0.01, deviation = 0, law = "normal" }'


class RunOut(Table):
    """Eccentricity of a wheel: how far its centre is from where it is drawn, in any direction."""

    example: ClassVar[str] = "0.02 or { tolerance = 0.02, deviation = [0, 0] }"

    tolerance: NonNegative | SkipJsonSchema[None] = Field(None, description="largest eccentricity, a radius")
    deviation: Pair = Field((0.0, 0.0), description="the known eccentricity of one built specimen, in body axes")
    law: ClearanceLaw = Field(
        "normal", description="how it scatters: normal (three sigma to the radius), uniform in the disc, or boundary"
    )


def _tolerance(value: object) -> object:
    return {"tolerance": value} if is_number(value) else value


Ratio = Annotated[RatioError, BeforeValidator(_tolerance, json_schema_input_type=NonNegative | RatioError)]
Eccentric = Annotated[RunOut, BeforeValidator(_tolerance, json_schema_input_type=NonNegative | RunOut)]


class FlankClearance(Clearance):
    """Backlash of teeth: how far one flank can go until the other touches."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["backlash"]}, {"required": ["backlash_angle"]}]}
    )
    example: ClassVar[str] = "{ backlash = 0.1 } (arc at the pitch circle, flank to flank) or { backlash_angle = 0.3 }"

    backlash: NonNegative | SkipJsonSchema[None] = Field(
        None, description="backlash from flank to flank, an arc at the pitch circle"
    )
    backlash_angle: NonNegative | SkipJsonSchema[None] = Field(
        None, description="instead: angle that the second body turns from flank to flank while the first is held"
    )

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.backlash is None) == (self.backlash_angle is None):
            raise problem(
                "give backlash (an arc at the pitch circle, from flank to flank) or backlash_angle (an angle of the"
                " second body)" + (", not both" if self.backlash is not None else "")
            )
        return self


def _slack(value: object) -> object:
    return (value, value) if is_number(value) else value


class BeltClearance(Clearance):
    """Slack of a belt or chain: how far the second pulley's rim can go to either side until a strand is taut."""

    example: ClassVar[str] = "{ slack = 0.2 } or { slack = [0, 0.2] }"

    slack: Annotated[
        tuple[NonNegative, NonNegative],
        Field(strict=False),
        BeforeValidator(_slack, json_schema_input_type=NonNegative | tuple[NonNegative, NonNegative]),
    ] = Field(description="travel at the rim to either side; [minus, plus] where the sides differ")


class ScrewClearance(JournalClearance):
    """Play of a screw in its nut: along the thread's axis, and of the pin in its hole."""

    model_config = ConfigDict(json_schema_extra={"not": {"required": ["radial", "diametral"]}})
    example: ClassVar[str] = "{ axial = 0.02 } or { axial = 0.02, radial = 0.05, length = 30 }"

    axial: NonNegative = Field(0.0, description="how far the nut can shift on the thread to each side")

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if self.radial is not None and self.diametral is not None:
            raise problem("give radial or diametral, not both")
        return self
