"""Where a joint really is on a body: deviations of its place and of its direction, and those of a link between joints.

position     by component, each within its tolerance, or anywhere in a zone: its diameter is twice how far
direction    by rotations about side and normal, or anywhere in a cone
link         of one joint against another: all components of a pose, or a, alpha, d, theta (Denavit-Hartenberg)
"""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import ConfigDict, Field, model_validator

from .laws import Deviating
from .values import (
    IN_PLANE,
    IN_SPACE,
    ClearanceLaw,
    NonNegative,
    Number,
    Omittable,
    Pair,
    Positive,
    Table,
    omitted,
    problem,
    short,
)

#: parameters of Denavit and Hartenberg
DH = ("a", "alpha", "d", "theta")


class ComponentDeviation(Deviating):
    """One component of a deviation: its tolerance, and its known value in a built specimen."""

    example: ClassVar[str] = '0.02 or { tolerance = 0.02, deviation = 0.005, law = "normal" }'


#: a number is a tolerance, plus and minus
Component = Annotated[ComponentDeviation, short(lambda value: {"tolerance": value}, NonNegative | ComponentDeviation)]
_Component = Omittable[Component]


class Components(Table):
    """Deviations by their components."""

    #: the keys of components
    keys: ClassVar[tuple[str, ...]]

    @property
    def by_component(self) -> dict[str, ComponentDeviation]:
        """The components that deviate."""
        given = {key: getattr(self, key) for key in self.keys}
        return {key: value for key, value in given.items() if value is not None}


class Zone(Components):
    """Deviations by their components, or anywhere in a zone."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})
    #: the key of a zone's size
    sized: ClassVar[str] = "diameter"
    #: what belongs to a zone
    of_zone: ClassVar[tuple[str, ...]] = ("deviation", "law")

    law: Omittable[ClearanceLaw] = omitted(
        "how it scatters in its zone: normal (three sigma to the boundary, default), uniform, boundary"
    )

    @property
    def has_zone(self) -> bool:
        """Whether it is given by a zone."""
        return getattr(self, self.sized) is not None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        components, names = self.by_component, ", ".join(self.keys)
        if self.has_zone and components:
            raise problem(
                f"give either {self.sized} (a zone) or {names}; not {self.sized} with {', '.join(components)}"
            )
        if not self.has_zone:
            alone = [key for key in self.of_zone if key in self.model_fields_set]
            if alone:
                raise problem(f"{alone[0]} at this place belongs to a zone: give {self.sized}, too")
            if not components:
                raise problem(f"say how far it is off: {names} or {self.sized}, such as {self.example}")
        return self


DIAMETER = "diameter of the zone in which it lies (ISO 1101): it is off by up to half of it"


class PlanarPosition(Zone):
    """How far a joint is from its place on a body."""

    example: ClassVar[str] = "{ x = 0.02, y = 0.01 } or { diameter = 0.1 }"
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("z", "length", "spherical"), IN_SPACE)
    keys: ClassVar[tuple[str, ...]] = ("x", "y")

    x: _Component = omitted("deviation along the x axis of the body")
    y: _Component = omitted("deviation along the y axis of the body")
    diameter: Omittable[NonNegative] = omitted(DIAMETER)
    deviation: Pair = Field((0.0, 0.0), description="with diameter: the known deviation [x, y] in body axes")


class SpatialPosition(Zone):
    """How far a joint is from its place on a body."""

    example: ClassVar[str] = "{ x = 0.02, y = 0.01 } or { diameter = 0.1 }"
    keys: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    of_zone: ClassVar[tuple[str, ...]] = ("deviation", "law", "length", "spherical")

    x: _Component = omitted("deviation along the x axis of the body")
    y: _Component = omitted("deviation along the y axis of the body")
    z: _Component = omitted("deviation along the z axis of the body")
    diameter: Omittable[NonNegative] = omitted(f"{DIAMETER}; a cylinder about its axis")
    length: Omittable[Positive] = omitted("with diameter: length of the cylinder, in which the axis shifts and tilts")
    spherical: bool = Field(False, description="with diameter: a ball instead of a cylinder")
    deviation: Omittable[Annotated[tuple[Number, ...], Field(strict=False, min_length=2, max_length=3)]] = omitted(
        "with diameter: the known deviation, [side, normal]; of a ball [x, y, z] in body axes"
    )

    @model_validator(mode="after")
    def _zone(self) -> Self:
        if self.spherical and self.length is not None:
            raise problem("a ball has no length; take away length, or spherical")
        wanted = "[x, y, z]" if self.spherical else "[side, normal]"
        if self.deviation is not None and len(self.deviation) != (3 if self.spherical else 2):
            raise problem(f"the deviation in this zone is {wanted}, not {len(self.deviation)} numbers")
        return self

    @property
    def centre(self) -> tuple[float, ...]:
        """The known deviation in its zone."""
        return self.deviation or ((0.0, 0.0, 0.0) if self.spherical else (0.0, 0.0))


class AxisDeviation(Zone):
    """How far the axis of a joint is from its direction on a body."""

    example: ClassVar[str] = "{ angle = 0.05 } or { diameter = 0.02, length = 40 } or { side = 0.05, normal = 0.02 }"
    keys: ClassVar[tuple[str, ...]] = ("side", "normal")
    sized: ClassVar[str] = "angle"
    of_zone: ClassVar[tuple[str, ...]] = ("deviation", "law")

    side: _Component = omitted("rotation about the side")
    normal: _Component = omitted("rotation about the normal (axis x side)")
    angle: Omittable[NonNegative] = omitted("largest angle to the drawn axis: a cone")
    diameter: Omittable[NonNegative] = omitted(
        "instead, with length: diameter of the cylinder in which the axis lies (ISO 1101)"
    )
    length: Omittable[Positive] = omitted("with diameter: length of the cylinder")
    deviation: Pair = Field((0.0, 0.0), description="with a zone: the known rotations [about side, about normal]")

    @property
    def has_zone(self) -> bool:
        """Whether it is given by a zone."""
        return self.angle is not None or self.diameter is not None

    @model_validator(mode="after")
    def _zone(self) -> Self:
        if (self.diameter is None) != (self.length is None):
            raise problem("diameter and length belong together: the cylinder in which the axis lies")
        if self.angle is not None and self.diameter is not None:
            raise problem("give angle, or diameter and length; not both")
        return self


#: a number is the angle of a cone
SpatialDirection = Annotated[AxisDeviation, short(lambda value: {"angle": value}, NonNegative | AxisDeviation)]


class LinkTable(Components):
    """How far one joint of a body is from its place against another one."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 3})

    body: str = Field(description="the body that has both joints")
    between: Annotated[tuple[str, str], Field(strict=False)] = Field(
        description='two joints on the body; the second is displaced, or the "output"'
    )

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.by_component:
            raise problem(f"say what deviates: {', '.join(self.keys)}, such as {self.example}")
        return self


class PlanarLink(LinkTable):
    """How far one joint of a body is from its place against another one."""

    example: ClassVar[str] = '{ body = "arm", between = ["J1", "J2"], x = 0.02, angle = 0.01 }'
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("z", "rx", "ry", "rz", *DH), IN_SPACE)
    keys: ClassVar[tuple[str, ...]] = ("x", "y", "angle")

    x: _Component = omitted("deviation along the x axis of the body")
    y: _Component = omitted("deviation along the y axis of the body")
    angle: _Component = omitted("deviation of the angle")


class SpatialLink(LinkTable):
    """How far one joint of a body is from its pose against another one."""

    example: ClassVar[str] = '{ body = "arm", between = ["J1", "J2"], x = 0.02, rz = 0.01 }'
    elsewhere: ClassVar[Mapping[str, str]] = {"angle": IN_PLANE}
    keys: ClassVar[tuple[str, ...]] = ("x", "y", "z", "rx", "ry", "rz", *DH)

    x: _Component = omitted("deviation along the x axis of the body")
    y: _Component = omitted("deviation along the y axis of the body")
    z: _Component = omitted("deviation along the z axis of the body")
    rx: _Component = omitted("x of the rotation vector of the second joint, body axes")
    ry: _Component = omitted("y of the rotation vector of the second joint, body axes")
    rz: _Component = omitted("z of the rotation vector of the second joint, body axes")
    a: _Component = omitted("Denavit-Hartenberg: deviation along the common normal of the axes")
    alpha: _Component = omitted("Denavit-Hartenberg: deviation of the angle about the common normal")
    d: _Component = omitted("Denavit-Hartenberg: deviation along the axis of the first joint")
    theta: _Component = omitted("Denavit-Hartenberg: deviation of the angle about that axis")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        components = self.by_component
        dh = [key for key in components if key in DH]
        if dh and len(dh) < len(components):
            others = ", ".join(key for key in components if key not in DH)
            raise problem(f"give either {', '.join(DH)} or x, y, z, rx, ry, rz; not {', '.join(dh)} with {others}")
        return self
