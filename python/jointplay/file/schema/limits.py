"""What is acceptable: errors of the output, ranges of drives and joints, nearness to a singular configuration."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from jointplay.errors import shown

from .values import (
    EXPRESSION,
    IN_PLANE,
    IN_SPACE,
    NonNegative,
    Number,
    Omittable,
    Pair,
    Positive,
    Table,
    evaluated,
    is_number,
    omitted,
    problem,
)

ALONG = "acceptable error along the ground's {} axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or {{ high = 0.1 }}"
ABOUT = "acceptable error {}: a number for both sides, [low, high], or one of them such as {{ high = 0.1 }}"


def _range(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] > pair[1]:
        raise problem(f"a range is [lowest, highest], not {shown(list(pair))}")
    return pair


Range = Annotated[Pair, AfterValidator(_range)]


def _both_sides(value: Any, info: ValidationInfo) -> object:
    value = evaluated(value, info)
    if is_number(value):
        if value < 0:
            raise problem(f"must be 0 or more, for both sides, or [lowest, highest]; here: {value:g}")
        return (-value, value)
    if not isinstance(value, list | tuple):
        raise problem(f"a number for both sides, or [lowest, highest], is needed, not {shown(value)}")
    return value


ForceRange = Annotated[Range, BeforeValidator(_both_sides, json_schema_input_type=NonNegative | Pair)]


class Bounds(Table):
    """The lowest and the highest acceptable value; one of them where the other side does not matter."""

    example: ClassVar[str] = "0.1, [-0.05, 0.1] or { high = 0.1 }"

    low: Omittable[Number] = omitted("lowest acceptable value, not above zero")
    high: Omittable[Number] = omitted("highest acceptable value, not below zero")

    @model_validator(mode="after")
    def _about_zero(self) -> Self:
        if self.low is None and self.high is None:
            raise problem("give low, high or both")
        low, high = self.low or 0.0, self.high or 0.0
        if low > 0.0 or high < 0.0:
            raise problem(f"low <= 0 <= high is needed, since no error is acceptable; here: {shown([low, high])}")
        return self


def _bounds(value: Any, info: ValidationInfo) -> object:
    value = evaluated(value, info)
    if is_number(value):
        if value < 0:
            raise problem(f"must be 0 or more, for both sides: {value:g}")
        return {"low": -value, "high": value}
    if isinstance(value, list | tuple) and len(value) == 2:
        return {"low": value[0], "high": value[1]}
    return value


Between = Annotated[Bounds, BeforeValidator(_bounds, json_schema_input_type=NonNegative | Pair | Bounds)]


class ErrorLimits(Table):
    """Acceptable errors of an output."""

    #: the components of its error
    components: ClassVar[tuple[str, ...]]

    position: Omittable[NonNegative] = omitted("largest acceptable position error")
    rotation: Omittable[NonNegative] = omitted("largest acceptable rotation error")
    x: Omittable[Between] = omitted(ALONG.format("x"))
    y: Omittable[Between] = omitted(ALONG.format("y"))

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """The keys of errors."""
        return (*cls.components, "position", "rotation")

    def given(self) -> tuple[str, ...]:
        """The keys of errors that have a limit."""
        return tuple(word for word in self.words() if getattr(self, word) is not None)


class PlanarErrorLimits(ErrorLimits):
    """Acceptable errors of an output."""

    example: ClassVar[str] = "{ position = 0.5, angle = 0.1 }"
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("z", "rx", "ry", "rz"), IN_SPACE)
    components: ClassVar[tuple[str, ...]] = ("x", "y", "angle")

    angle: Omittable[Between] = omitted(ABOUT.format("of the angle"))


class SpatialErrorLimits(ErrorLimits):
    """Acceptable errors of an output."""

    example: ClassVar[str] = "{ position = 0.5, z = [-0.1, 0.2] }"
    elsewhere: ClassVar[Mapping[str, str]] = {"angle": IN_PLANE}
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z", "rx", "ry", "rz")

    z: Omittable[Between] = omitted(ALONG.format("z"))
    rx: Omittable[Between] = omitted(ABOUT.format("about the x axis"))
    ry: Omittable[Between] = omitted(ABOUT.format("about the y axis"))
    rz: Omittable[Between] = omitted(ABOUT.format("about the z axis"))


class LimitsTable(ErrorLimits):
    """What is acceptable."""

    probability: Omittable[Annotated[float, Field(gt=0.0, lt=1.0), EXPRESSION]] = omitted(
        "share of the specimens that must keep to the limits in `random`; such as 0.9973"
    )
    contact: Omittable[Literal["scattered", "loaded"]] = omitted(
        "where clearances are in these specimens: offsets that scatter, or those that the load decides;"
        " both count where it is left out and there are loads",
    )
    singular_value: Positive = Field(
        1e-4, description="smallest acceptable singular value of the length-scaled Jacobian"
    )
    drives: dict[str, Range] = Field({}, description="range of each drive")
    joints: dict[str, Range] = Field({}, description="range of each joint's coordinate")
    drive_torques: dict[str, ForceRange] = Field(
        {},
        description="acceptable moment or force of each drive in `forces`: 5 for 5 in both directions, or [lowest,"
        " highest]",
    )
    reactions: dict[str, NonNegative] = Field(
        {}, description="largest acceptable reaction force at each joint in `forces`"
    )


class PlanarLimits(LimitsTable, PlanarErrorLimits):
    """What is acceptable."""

    example: ClassVar[str] = "{ position = 0.5, drives = { theta1 = [0, 90] } }"


class SpatialLimits(LimitsTable, SpatialErrorLimits):
    """What is acceptable."""

    example: ClassVar[str] = "{ position = 0.5, z = [-0.1, 0.2] }"


class CopyLimits(Table):
    """Ranges of the drives and joints of a pattern."""

    example: ClassVar[str] = "{ joints = { hip = [0, 90] } }"
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("position", "rotation", *SpatialErrorLimits.components, "angle", "probability", "contact", "singular_value"),
        "of the file as a whole",
    ) | dict.fromkeys(
        ("drive_torques", "reactions"),
        "of the file as a whole",
    )

    drives: dict[str, Range] = Field({}, description="range of each drive")
    joints: dict[str, Range] = Field({}, description="range of each joint's coordinate")
