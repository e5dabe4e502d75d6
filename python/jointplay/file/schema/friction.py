"""Friction of joints, by Coulomb: what slides is held back by its coefficient times the normal force.

A joint may also have a force or moment of its own against its motion, as seals and rolling bearings have.
"""

from typing import Annotated, Any, ClassVar, Self

from pydantic import ConfigDict, Field, model_validator

from .clearances import BearingKeys
from .sliding import SlidingKeys
from .values import EXPRESSION, NonNegative, Omittable, OneOrTwo, Positive, omitted, problem, short

#: what the key `friction` is, for all kinds of joints
RUBS = "friction against its motion, which counts where a direction of approach is asked for; a number: its coefficient"
COEFFICIENT = "friction force over normal force where the faces slide"
MOMENT = "moment against its turning whatever the load, as of seals; {}"
AGAINST_SLIDING = "force against its sliding whatever the load, as of seals and wipers"
OWN = "in the file's units of force times length"

SlidSize = Omittable[Positive]
OwnResistance = Omittable[NonNegative]


class Friction(SlidingKeys):
    """What holds a joint back."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})
    #: the key of a force or moment of its own, if it can have one
    own: ClassVar[str] = ""

    coefficient: NonNegative = Field(0.0, description=COEFFICIENT)

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.model_fields_set & {"coefficient", self.own}:
            raise problem(f"say what holds it back: coefficient, or {self.own}, or both")
        return self

    def check(self, play: Any) -> None:
        """Refuse what is not enough, with the clearance of the joint or without one.

        Raises
        ------
        ValueError
            When a size is missing.
        """
        if self.coefficient and isinstance(play, BearingKeys) and play.bearing is not None:
            raise problem("friction: the balls of a bearing roll, and a coefficient says nothing of them; give torque")
        if self.coefficient:
            self.require(play, "friction", "a coefficient")


class PinFriction(Friction):
    """Friction of a pin in its hole, in the plane. The first body carries the pin, the second one has the hole."""

    example: ClassVar[str] = "{ coefficient = 0.1, diameter = 20 }"
    needed: ClassVar[tuple[str, ...]] = ("diameter",)
    own: ClassVar[str] = "torque"

    diameter: SlidSize = omitted("diameter of the hole; that of the clearance if left out")
    torque: OwnResistance = omitted(MOMENT.format(OWN))


class SliderFriction(Friction):
    """Friction of a slider in its guide, in the plane."""

    example: ClassVar[str] = "{ coefficient = 0.1, height = 30 }"
    needed: ClassVar[tuple[str, ...]] = ("length",)
    own: ClassVar[str] = "force"

    length: SlidSize = omitted("length of the slider in its guide; that of the clearance if left out")
    height: NonNegative = Field(
        0.0, description="from face to face of the slider, across its axis; left out, friction acts in its axis"
    )
    force: OwnResistance = omitted(AGAINST_SLIDING)


class SlotFriction(Friction):
    """Friction along a slot, of a block that slides in it and carries the pin."""

    example: ClassVar[str] = "{ coefficient = 0.1 }"
    own: ClassVar[str] = "force"

    force: OwnResistance = omitted(AGAINST_SLIDING)


class JournalFriction(Friction):
    """Friction of a pin that turns in its hole, in space: at both of its ends, and at its shoulders."""

    example: ClassVar[str] = "{ coefficient = 0.1, diameter = 20, collar = [20, 30] }"
    needed: ClassVar[tuple[str, ...]] = ("diameter", "length")
    own: ClassVar[str] = "torque"

    diameter: SlidSize = omitted("diameter of the hole; that of the clearance if left out")
    length: SlidSize = omitted("length of the pin in its hole; that of the clearance if left out")
    collar: Omittable[OneOrTwo] = omitted(
        "inner and outer diameter of its shoulders; left out, a load along the pin does not rub"
    )
    torque: OwnResistance = omitted(MOMENT.format(OWN))

    @model_validator(mode="after")
    def _inner_first(self) -> Self:
        if self.collar is not None and self.collar[0] > self.collar[1]:
            raise problem("collar is [inner, outer] diameter")
        return self

    @property
    def collar_radius(self) -> float:
        """Lever of the friction of the shoulders, by a pressure that is the same all over; 0 without any."""
        if self.collar is None:
            return 0.0
        inner, outer = (diameter / 2.0 for diameter in self.collar)
        return inner if inner == outer else 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2)


class GuideFriction(Friction):
    """Friction of a slider of rectangular section in its guide."""

    example: ClassVar[str] = "0.1"
    needed: ClassVar[tuple[str, ...]] = ("length", "width", "height")
    own: ClassVar[str] = "force"

    length: SlidSize = omitted("length of the slider in its guide; that of the clearance if left out")
    width: SlidSize = omitted("size of its section along `side`; that of the clearance if left out")
    height: SlidSize = omitted("size of its section across; that of the clearance, or its width")
    force: OwnResistance = omitted(AGAINST_SLIDING)

    def size(self, play: Any, key: str) -> float | None:
        """A size of what slides: its own, or that of the clearance; the height is the width where nothing says it."""
        found = super().size(play, key)
        return super().size(play, "width") if found is None and key == "height" else found


class BallFriction(Friction):
    """Friction of a ball in its socket, which the second body has."""

    example: ClassVar[str] = "{ coefficient = 0.1, diameter = 15 }"
    needed: ClassVar[tuple[str, ...]] = ("diameter",)
    own: ClassVar[str] = "torque"

    diameter: SlidSize = omitted("diameter of the socket; that of the clearance if left out")
    torque: OwnResistance = omitted(MOMENT.format(OWN))


class ThreadFriction(Friction):
    """Friction of a screw in its nut."""

    example: ClassVar[str] = "{ coefficient = 0.12, mean_diameter = 18, flank_angle = 15 }"
    needed: ClassVar[tuple[str, ...]] = ("mean_diameter",)
    own: ClassVar[str] = "torque"

    mean_diameter: SlidSize = omitted("mean diameter of the flanks: between crest and root")
    flank_angle: NonNegative = Field(
        0.0, description="angle of the flank from a plane across the axis: 15 degrees of a trapezoidal thread of 30"
    )
    torque: OwnResistance = omitted(MOMENT.format(OWN))


class ToothFriction(Friction):
    """Friction of teeth that slide along each other where the pitch circles touch, as those of worms do."""

    example: ClassVar[str] = "0.05"

    coefficient: NonNegative = Field(description=COEFFICIENT)


PinRubs = Annotated[PinFriction, short(lambda value: {"coefficient": value}, NonNegative | PinFriction)]
SliderRubs = Annotated[SliderFriction, short(lambda value: {"coefficient": value}, NonNegative | SliderFriction)]
SlotRubs = Annotated[SlotFriction, short(lambda value: {"coefficient": value}, NonNegative | SlotFriction)]
JournalRubs = Annotated[JournalFriction, short(lambda value: {"coefficient": value}, NonNegative | JournalFriction)]
GuideRubs = Annotated[GuideFriction, short(lambda value: {"coefficient": value}, NonNegative | GuideFriction)]
BallRubs = Annotated[BallFriction, short(lambda value: {"coefficient": value}, NonNegative | BallFriction)]
ThreadRubs = Annotated[ThreadFriction, short(lambda value: {"coefficient": value}, NonNegative | ThreadFriction)]
ToothRubs = Annotated[ToothFriction, short(lambda value: {"coefficient": value}, NonNegative | ToothFriction)]

#: of a coupling, by which of its bodies drives the other
Efficiency = Annotated[float, Field(gt=0.0, le=1.0), EXPRESSION]
Efficiencies = Annotated[
    tuple[Efficiency, Efficiency],
    Field(strict=False),
    short(lambda value: (value, value), Efficiency | tuple[Efficiency, Efficiency]),
]
