"""What gives way between a motor and the joint that it drives, lost motion and wind-up; and how a motor moves."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from jointplay.errors import shown

from .values import EXPRESSION, LARGEST, Name, NonNegative, Positive, Table, problem, short

#: laws of motion from rest to rest
LawOfMotion = Literal["trapezoid", "cycloidal", "poly5"]
#: of the duration, for gaining and for losing speed
Ramp = Annotated[float, Field(gt=0.0, le=0.5), EXPRESSION]
#: seconds in which nothing moves from one value to another
SHORTEST = 1e-9
#: of a motion from rest to rest
Duration = Annotated[float, Field(ge=SHORTEST, le=LARGEST), EXPRESSION]


class Backlash(Table):
    """How far a driven coordinate can be on either side of its command until a flank stops it."""

    example: ClassVar[str] = "1.2 (from flank to flank) or { plus = 1.2, minus = 0 }"

    plus: NonNegative = Field(description="to its positive side")
    minus: NonNegative = Field(description="to its negative side, as a positive number")

    @property
    def width(self) -> float:
        """From flank to flank."""
        return self.plus + self.minus

    def resized(self, width: float) -> float | dict[str, float]:
        """The same with another width, as a file has it."""
        if self.plus == self.minus:
            return width
        return {"plus": width * self.plus / self.width, "minus": width * self.minus / self.width}


def _flanks(value: float) -> object:
    if value < 0.0:
        raise problem(f"must not be negative: {shown(value)}")
    return {"plus": value / 2.0, "minus": value / 2.0}


#: a number is the distance from flank to flank
Flanks = Annotated[Backlash, short(_flanks, NonNegative | Backlash)]


def _of_backlash(value: Any) -> str:
    """Which member of the union it is. In angle brackets, because no key of a file can look like that."""
    return "<joints>" if isinstance(value, Mapping) and not {*value} & {*Backlash.model_fields} else "<one>"


def _of_stiffness(value: Any) -> str:
    return "<joints>" if isinstance(value, Mapping) else "<one>"


#: joints, none of which can have the name of a flank
_Joints = Field(json_schema_extra={"propertyNames": {"maxLength": 100, "not": {"enum": [*Backlash.model_fields]}}})
DriveBacklash = Annotated[
    Annotated[Flanks, Tag("<one>")] | Annotated[dict[Name, Flanks], Tag("<joints>"), _Joints],
    Discriminator(_of_backlash),
]
DriveStiffness = Annotated[
    Annotated[Positive, Tag("<one>")] | Annotated[dict[Name, Positive], Tag("<joints>")], Discriminator(_of_stiffness)
]
