"""The sizes that make a clearance: hole and pin, slot and slider, and how each of them scatters."""

from typing import Annotated, ClassVar, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from jointplay.file import standards

from .laws import LAW, ToleranceLaw, check_law
from .values import Number, Omittable, Positive, Table, Tolerance, omitted, problem

SIZE_LAW = LAW


def _hole_class(text: str) -> str:
    return _class(text, "H7", is_hole=True)


def _shaft_class(text: str) -> str:
    return _class(text, "g6", is_hole=False)


def _class(text: str, example: str, *, is_hole: bool) -> str:
    try:
        letter, _ = standards.parse(text)
    except standards.NotInStandard as error:
        raise problem(str(error)) from None
    if letter.isupper() != is_hole:
        case = "upper" if is_hole else "lower"
        raise problem(f"the class here is written in {case} case, such as {example}, not '{text}'")
    return text


def _fit(text: str) -> str:
    try:
        standards.fit(text)
    except standards.NotInStandard as error:
        raise problem(str(error)) from None
    return text


HoleClass = Annotated[str, AfterValidator(_hole_class)]
ShaftClass = Annotated[str, AfterValidator(_shaft_class)]
#: tolerance classes of a hole and of what sits in it
Fit = Annotated[str, AfterValidator(_fit)]


class Machined(Table):
    """One of the two sizes of a clearance, with its limits."""

    model_config = ConfigDict(json_schema_extra={"dependentRequired": {"plus": ["minus"], "minus": ["plus"]}})

    #: the key of the nominal size
    measure: ClassVar[str] = "diameter"

    tolerance: Omittable[Tolerance] = omitted("how far it may be off")
    plus: Omittable[Number] = omitted("with minus: how far above the nominal size")
    minus: Omittable[Number] = omitted(
        "how far below the nominal size, positive; negative where also this limit is above"
    )
    iso_class: str | None
    deviation: Omittable[Number] = omitted(
        "of one built specimen: measured minus nominal; the middle of the limits if left out"
    )
    law: Omittable[ToleranceLaw] = omitted(SIZE_LAW)

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        ways = [
            name
            for name, given in (
                ("tolerance", self.tolerance is not None),
                ("plus and minus", self.plus is not None or self.minus is not None),
                ("class", self.iso_class is not None),
            )
            if given
        ]
        if len(ways) > 1:
            raise problem(f"give its limits once: {' or '.join(ways)}")
        if (self.plus is None) != (self.minus is None):
            raise problem("plus and minus belong together")
        if self.plus is not None and self.minus is not None and self.plus < -self.minus:
            raise problem(f"the upper limit, plus = {self.plus:g}, is below the lower one, minus = {self.minus:g}")
        check_law(self.tolerance, self.law)
        return self

    @property
    def nominal(self) -> float:
        """Nominal size, in file units."""
        return float(getattr(self, self.measure))


class Hole(Machined):
    """The hole: what the pin, or the ball, sits in."""

    example: ClassVar[str] = '{ diameter = 12, class = "H7" } or { diameter = 12.01, tolerance = 0.01 }'

    diameter: Positive = Field(description="its nominal diameter")
    iso_class: Omittable[HoleClass] = omitted("tolerance class of ISO 286, such as H7", alias="class")


class Pin(Machined):
    """The pin, or the ball."""

    example: ClassVar[str] = '{ diameter = 12, class = "g6" } or { diameter = 11.99, tolerance = 0.01 }'

    diameter: Positive = Field(description="its nominal diameter")
    iso_class: Omittable[ShaftClass] = omitted("tolerance class of ISO 286, such as g6", alias="class")


class Slot(Machined):
    """The slot: what the slider, the pin or the plate sits in."""

    measure: ClassVar[str] = "width"
    example: ClassVar[str] = '{ width = 12, class = "H9" } or { width = 12.05, tolerance = 0.02 }'

    width: Positive = Field(description="its nominal width")
    iso_class: Omittable[HoleClass] = omitted("tolerance class of ISO 286, such as H9", alias="class")


class Slider(Machined):
    """The slider, pin or plate in a slot."""

    measure: ClassVar[str] = "width"
    example: ClassVar[str] = '{ width = 12, class = "e8" } or { width = 11.95, tolerance = 0.02 }'

    width: Positive = Field(description="its nominal width, across the slot")
    iso_class: Omittable[ShaftClass] = omitted("tolerance class of ISO 286, such as e8", alias="class")
