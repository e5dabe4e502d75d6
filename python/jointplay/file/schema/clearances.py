"""The clearances of joints, and the errors of locked ones and of couplings: their keys in the plane and in space."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from jointplay.errors import shown

from .laws import Deviating, ToleranceLaw, check_law
from .sizes import SIZE_LAW, Fit, Hole, Pin, Slider, Slot
from .values import (
    IN_SPACE,
    ClearanceLaw,
    NonNegative,
    Omittable,
    Pair,
    Positive,
    Table,
    Tolerance,
    omitted,
    problem,
    short,
)

LAW = "uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary"


class Clearance(Table):
    """What all clearances have."""

    law: ClearanceLaw = Field("uniform", description=LAW)


class SizedClearance(Clearance):
    """A clearance whose size may scatter: it is given with a tolerance, or by the two sizes that make it."""

    #: keys that say how large it is by themselves, what each is, and the two sizes and the nominal size for a fit
    measures: ClassVar[Mapping[str, str]]
    pair: ClassVar[tuple[str, str]]
    #: which of the two the joint's first body has, for all others
    carried: ClassVar[str]
    nominal_key: ClassVar[str]
    #: what may stand beside a measure, for what temperature makes of it
    grows_with: ClassVar[str] = ""
    #: whether it may be left out
    may_be_none: ClassVar[bool] = False
    instead: ClassVar[Mapping[str, str]] = {
        "backlash": "that of teeth is of a gear or rack, and what a gearbox loses of a drive, [drives.NAME]"
    }

    tolerance: Omittable[Tolerance] = omitted("how far the clearance may be off, in the measure in which it is given")
    fit: Omittable[Fit] = omitted("instead: tolerance classes of ISO 286, such as H7/g6")
    size_law: Omittable[ToleranceLaw] = omitted(f"how the sizes scatter that have no law of their own: {SIZE_LAW}")

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        own = [key for key in self.measures if getattr(self, key) is not None]
        ways = [*own, *(key for key in ("fit", "bearing") if getattr(self, key, None) is not None)]
        first, second = self.pair
        parts = [key for key in self.pair if getattr(self, key) is not None]
        ways += [" and ".join(self.pair)] if parts else []
        if not ways and not self.may_be_none:
            raise problem(self._missing())
        if len(ways) > 1:
            raise problem(f"give {' or '.join(ways)}, not both")
        if len(parts) == 1:
            raise problem(
                f"'{second if parts == [first] else first}' is missing ({first} and {second} belong together)"
            )
        for key, needed, what in self._go_together():
            if getattr(self, key) is not None and getattr(self, needed) is None:
                raise problem(f"'{needed}' is missing ({what}, which {key} needs)")
            by_heat = needed == self.grows_with and bool(own)
            if getattr(self, needed) is not None and getattr(self, key) is None and not by_heat:
                raise problem(f"'{needed}' goes with {key}")
        if self.tolerance is not None and not own:
            raise problem(
                f"'tolerance' goes with {' or '.join(self.measures)}; here {ways[0] if ways else 'it'} has none"
            )
        if self.size_law is not None and not (parts or self.fit or self.tolerance or getattr(self, "bearing", None)):
            raise problem("'size_law' says how sizes scatter; here the size is one number without a tolerance")
        check_law(self.tolerance, self.size_law)
        return self

    @property
    def nominal_size(self) -> float | None:
        """Diameter of pin and hole, or width of slot and slider, in units of the file; None where it is not said."""
        outer = getattr(self, self.pair[0])
        found = outer.nominal if outer is not None else getattr(self, self.nominal_key)
        return None if found is None else float(found)

    def _go_together(self) -> list[tuple[str, str, str]]:
        """Keys that need another one: the key, what it needs, and what that is."""
        return [("fit", self.nominal_key, "the nominal size")]

    def _missing(self) -> str:
        raise NotImplementedError


def _either(*ways: list[str]) -> dict[str, JsonValue]:
    """The JSON Schema of a table that says something in one way."""
    return {"oneOf": [{"required": [*way]} for way in ways]}


class RadialClearance(SizedClearance):
    """Play of something round in something round: its size is the difference of the radii."""

    model_config = ConfigDict(
        json_schema_extra=_either(["radial"], ["diametral"], ["fit", "diameter"], ["hole", "pin"])
    )
    measures: ClassVar[Mapping[str, str]] = {"radial": "hole radius - pin radius", "diametral": "twice that"}
    pair: ClassVar[tuple[str, str]] = ("hole", "pin")
    carried: ClassVar[str] = "pin"
    nominal_key: ClassVar[str] = "diameter"
    grows_with: ClassVar[str] = "diameter"

    radial: Omittable[NonNegative] = omitted("hole radius minus pin radius")
    diametral: Omittable[NonNegative] = omitted("hole diameter minus pin diameter")
    diameter: Omittable[Positive] = omitted(
        "nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance"
    )
    hole: Omittable[Hole] = omitted("instead, with pin: diameter and limits of the hole")
    pin: Omittable[Pin] = omitted("diameter and limits of the pin")

    def _missing(self) -> str:
        return (
            "say which clearance is meant: radial (hole radius - pin radius) or diametral (twice that); or fit and"
            " diameter, or hole and pin"
        )


#: two numbers, such as the least and the most; a single one stands for both
LeastMost = Annotated[
    tuple[NonNegative, NonNegative],
    Field(strict=False),
    short(lambda value: (value, value), NonNegative | tuple[NonNegative, NonNegative]),
]


#: clearance groups of deep groove ball bearings
BearingGroup = Literal["C2", "CN", "N", "C3", "C4", "C5"]


class BearingKeys(SizedClearance):
    """Play of a deep groove ball bearing, where a joint may be one."""

    instead: ClassVar[Mapping[str, str]] = {
        **SizedClearance.instead,
        "fits": "what mounting takes away from the clearance is given as reduction = 0.005, or [least, most]",
    }

    bearing: Omittable[BearingGroup] = omitted(
        "instead: radial internal clearance of a deep groove ball bearing, group of ISO 5753-1"
    )
    bore: Omittable[Positive] = omitted("with bearing: diameter of its bore")
    reduction: Omittable[LeastMost] = omitted(
        "with bearing: by how much mounting reduces its clearance; [least, most] where that scatters"
    )

    @model_validator(mode="after")
    def _mounted(self) -> Self:
        if self.reduction is not None and self.bearing is None:
            raise problem("'reduction' goes with bearing")
        if self.reduction is not None and self.reduction[0] > self.reduction[1]:
            raise problem(f"reduction is [least, most], not {shown(list(self.reduction))}")
        return self

    def _go_together(self) -> list[tuple[str, str, str]]:
        return [*super()._go_together(), ("bearing", "bore", "the diameter of its bore")]


ROUND = (["radial"], ["diametral"], ["fit", "diameter"], ["hole", "pin"], ["bearing", "bore"])


class RevoluteClearance(RadialClearance, BearingKeys):
    """Play of a pin in its hole: the pin's centre lies in a disc."""

    model_config = ConfigDict(json_schema_extra=_either(*ROUND))
    example: ClassVar[str] = "{ radial = 0.02 } (hole radius - pin radius) or { diametral = 0.04 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"axial": IN_SPACE, "length": IN_SPACE}


class GapClearance(SizedClearance):
    """Play of something between two parallel faces."""

    model_config = ConfigDict(json_schema_extra=_either(["gap"], ["fit", "nominal"], ["slot", "slider"]))
    measures: ClassVar[Mapping[str, str]] = {"gap": "on each side"}
    pair: ClassVar[tuple[str, str]] = ("slot", "slider")
    carried: ClassVar[str] = "slot"
    nominal_key: ClassVar[str] = "nominal"
    #: what has the gap on each side
    inner: ClassVar[str]

    gap: Omittable[NonNegative] = omitted("gap on each side")
    nominal: Omittable[Positive] = omitted("with fit: nominal width of the slot")
    slot: Omittable[Slot] = omitted("instead, with slider: width and limits of the slot")
    slider: Omittable[Slider] = omitted("width and limits of what is in the slot")

    def _missing(self) -> str:
        return f"'gap' is missing (gap on each side of the {self.inner}); or fit and nominal, or slot and slider"


class PrismaticClearance(GapClearance):
    """Play of a slider in its guide: it may shift, and tilt over its length."""

    inner: ClassVar[str] = "slider"
    example: ClassVar[str] = "{ gap = 0.02, length = 40 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"width": IN_SPACE, "height": IN_SPACE}

    length: Positive = Field(description="length of the slider inside its guide")


class SlotClearance(GapClearance):
    """Play of a pin across its slot."""

    inner: ClassVar[str] = "pin"
    example: ClassVar[str] = "{ gap = 0.02 }"


class SleeveClearance(RadialClearance):
    """Play of a pin in its hole, in space: both of its ends lie in a disc, so that it may shift and tilt."""

    example: ClassVar[str] = "{ radial = 0.02, length = 30 }"

    length: Omittable[Positive] = omitted("length of the pin inside its hole")

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        # A size that is one number may be zero, in which case the pin cannot tilt.
        has_play = any(self.measures_given()) or self.tolerance is not None
        if has_play and self.length is None:
            raise problem("'length' is missing (length of the pin inside its hole: it decides how far the pin tilts)")
        return self

    def measures_given(self) -> list[object]:
        """What says how large the radial play is; empty or zero where there is none."""
        return [self.radial, self.diametral, self.fit, self.hole]


class JournalClearance(SleeveClearance):
    """Play of a pin in its hole and along it, in space."""

    example: ClassVar[str] = "{ radial = 0.02, axial = 0.05, length = 30 }"

    axial: NonNegative = Field(0.0, description="how far the pin can slide to each side")


class BearingClearance(JournalClearance, BearingKeys):
    """Play of a pin in its hole and along it, or of a ball bearing, in space."""

    model_config = ConfigDict(json_schema_extra=_either(*ROUND))

    def measures_given(self) -> list[object]:
        """What says how large the radial play is; empty or zero where there is none."""
        return [*super().measures_given(), self.bearing]

    @model_validator(mode="after")
    def _of_bearing(self) -> Self:
        if self.bearing is not None and "axial" not in self.model_fields_set:
            raise problem("'axial' is missing (how far the shaft can slide to each side: the standard does not say)")
        return self


class GuideClearance(GapClearance):
    """Play of a slider of rectangular section in its guide: it may shift, tilt over its length, and roll."""

    inner: ClassVar[str] = "slider"
    example: ClassVar[str] = "{ gap = 0.02, length = 40, width = 20, height = 10 }"

    length: Positive = Field(description="length of the slider inside its guide")
    width: Positive = Field(description="size of its section along `side`")
    height: Omittable[Positive] = omitted("size of its section across axis and `side`; as its width if left out")


class BallClearance(RadialClearance):
    """Play of a ball in its socket: its centre lies in a ball."""

    example: ClassVar[str] = "{ radial = 0.02 } (socket radius - ball radius) or { diametral = 0.04 }"


class PlateClearance(GapClearance):
    """Play of a plate between two planes: it may rise, and tilt over its size."""

    inner: ClassVar[str] = "plate"
    example: ClassVar[str] = "{ gap = 0.02, size = [40, 30] }"

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

    tolerance: Omittable[NonNegative] = omitted("largest eccentricity, a radius")
    deviation: Pair = Field((0.0, 0.0), description="the known eccentricity of one built specimen, in body axes")
    law: ClearanceLaw = Field(
        "normal", description="how it scatters: normal (three sigma to the radius), uniform in the disc, or boundary"
    )


Ratio = Annotated[RatioError, short(lambda value: {"tolerance": value}, NonNegative | RatioError)]
Eccentric = Annotated[RunOut, short(lambda value: {"tolerance": value}, NonNegative | RunOut)]


#: what the play of pins and guides may have, and that of couplings may not
ONE_SIZE = dict.fromkeys(
    ("tolerance", "size_law", "fit"), "the size of a coupling's play does not scatter; give its largest value"
)


class FlankClearance(Clearance):
    """Backlash of teeth: how far one flank can go until the other touches."""

    instead: ClassVar[Mapping[str, str]] = ONE_SIZE

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["backlash"]}, {"required": ["backlash_angle"]}]}
    )
    example: ClassVar[str] = "{ backlash = 0.1 } (arc at the pitch circle, flank to flank) or { backlash_angle = 0.3 }"

    backlash: Omittable[NonNegative] = omitted(
        "backlash from flank to flank, an arc at the pitch circle (of crossed gears the second one)"
    )
    backlash_angle: Omittable[NonNegative] = omitted(
        "instead: angle that the second body turns from flank to flank while the first is held"
    )

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.backlash is None) == (self.backlash_angle is None):
            raise problem(
                "give backlash (an arc at the pitch circle, from flank to flank) or backlash_angle (an angle of the"
                " second body)" + (", not both" if self.backlash is not None else "")
            )
        return self


class BeltClearance(Clearance):
    """Slack of a belt or chain: how far the second pulley's rim can go to either side until a strand is taut."""

    instead: ClassVar[Mapping[str, str]] = ONE_SIZE

    example: ClassVar[str] = "{ slack = 0.2 } or { slack = [0, 0.2] }"

    slack: LeastMost = Field(description="travel at the rim to either side; [minus, plus] where the sides differ")


class ScrewClearance(JournalClearance):
    """Play of a screw in its nut: along the thread's axis, and of the pin in its hole."""

    model_config = ConfigDict(json_schema_extra={"not": {"required": ["radial", "diametral"]}})
    may_be_none: ClassVar[bool] = True
    example: ClassVar[str] = "{ axial = 0.02 } or { axial = 0.02, radial = 0.05, length = 30 }"

    axial: NonNegative = Field(0.0, description="how far the nut can shift on the thread to each side")
