"""Elasticity of joints: how hard each of the directions that a joint holds is, by the keys of its clearance.

What is left out is rigid.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from pydantic import ConfigDict, model_validator

from .values import IN_SPACE, Omittable, OneOrTwo, Positive, Table, omitted, problem

FORCE = "force per length"
MOMENT = "moment per angle, in the file's unit of angles"

Shift = Omittable[Positive]
#: about `side` and about the direction across it and the axis; one number stands for both
Tilts = Omittable[OneOrTwo]
TILTS = f"against tilting, {MOMENT}; two of them for tilting about `side` and about the direction across"


class Stiffness(Table):
    """Stiffness of what a joint holds."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.model_fields_set:
            raise problem(f"say what gives: one or more of {', '.join(type(self).model_fields)}")
        return self


class PinStiffness(Stiffness):
    """Bearing of a pin: how hard it is across the pin."""

    example: ClassVar[str] = "{ radial = 5e4 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"axial": IN_SPACE, "tilt": IN_SPACE}

    radial: Shift = omitted(f"across the pin, {FORCE}")


class SliderStiffness(Stiffness):
    """Bearing of a slider in its guide."""

    example: ClassVar[str] = "{ normal = 5e4, tilt = 1e6 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"side": IN_SPACE, "roll": IN_SPACE}

    normal: Shift = omitted(f"across the guide, {FORCE}")
    tilt: Shift = omitted(f"against tilting, {MOMENT}")


class SlotStiffness(Stiffness):
    """Flank of a slot: how hard it is across the slot."""

    example: ClassVar[str] = "{ normal = 5e4 }"

    normal: Shift = omitted(f"across the slot, {FORCE}")


class ClampStiffness(Stiffness):
    """What locks two bodies together in the plane."""

    example: ClassVar[str] = "{ along = 5e4, normal = 5e4, tilt = 1e6 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"side": IN_SPACE, "roll": IN_SPACE}

    along: Shift = omitted(f"along the joint's axis, {FORCE}")
    normal: Shift = omitted(f"across the joint's axis, {FORCE}")
    tilt: Shift = omitted(f"against turning, {MOMENT}")


class FlankStiffness(Stiffness):
    """Teeth in mesh, with what bends behind them."""

    example: ClassVar[str] = "{ flank = 2e4 }"

    flank: Shift = omitted(f"along the pitch circle, {FORCE}")


class StrandStiffness(Stiffness):
    """Belt or chain between its pulleys."""

    example: ClassVar[str] = "{ strand = 2e3 }"

    strand: Shift = omitted(f"at the rim, along the strand that pulls, {FORCE}")


class SleeveStiffness(Stiffness):
    """Bearing of a pin that slides, in space."""

    example: ClassVar[str] = "{ radial = 5e4, tilt = 1e6 }"

    radial: Shift = omitted(f"across the pin, {FORCE}")
    tilt: Tilts = omitted(TILTS)


class JournalStiffness(SleeveStiffness):
    """Bearing of a pin, in space."""

    example: ClassVar[str] = "{ radial = 5e4, axial = 2e4, tilt = 1e6 }"

    axial: Shift = omitted(f"along the pin, {FORCE}")


class GuideStiffness(Stiffness):
    """Bearing of a slider in its guide, in space."""

    example: ClassVar[str] = "{ side = 5e4, normal = 5e4, roll = 1e6, tilt = 1e6 }"

    side: Shift = omitted(f"along `side`, {FORCE}")
    normal: Shift = omitted(f"across axis and `side`, {FORCE}")
    roll: Shift = omitted(f"about the axis, {MOMENT}")
    tilt: Tilts = omitted(TILTS)


class BallStiffness(Stiffness):
    """Ball in its socket."""

    example: ClassVar[str] = "{ radial = 5e4 }"

    radial: Shift = omitted(f"in all directions, {FORCE}")


class PlateStiffness(Stiffness):
    """Plate between its planes."""

    example: ClassVar[str] = "{ along = 5e4, tilt = 1e6 }"

    along: Shift = omitted(f"along the axis, the normal of the planes, {FORCE}")
    tilt: Tilts = omitted(TILTS)


class MountStiffness(GuideStiffness):
    """What locks two bodies together, in space."""

    example: ClassVar[str] = "{ along = 5e4, side = 5e4, normal = 5e4, roll = 1e6, tilt = 1e6 }"

    along: Shift = omitted(f"along the joint's axis, {FORCE}")
