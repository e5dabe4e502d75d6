"""Bodies: their mass with its inertia, and what makes a member of them that gives under force.

A body that says nothing of elasticity is rigid, and so is every way of giving that an elastic one leaves out.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, JsonValue, model_validator

from jointplay.errors import shown

from .values import (
    EXPRESSION,
    IN_PLANE,
    IN_SPACE,
    Direction,
    NonNegative,
    Number,
    Omittable,
    OneOrTwo,
    Pair,
    Positive,
    Table,
    Triple,
    omitted,
    problem,
)

#: keys that mean nothing without another one
NEEDS: dict[str, JsonValue] = {"area": ["E"], "inertia": ["E"], "G": ["torsion"], "torsion": ["G"], "side": ["inertia"]}


#: the coefficient of thermal expansion; polymers go to a few 1e-4 per kelvin, some ceramics shrink
Expansion = Annotated[float, Field(ge=-0.01, le=0.01), EXPRESSION]
#: closed lines of an outline, and corners of each: more cannot be told apart on a drawing
MOST_LINES, MOST_CORNERS = 100, 2000
#: part of the largest moment of inertia by which rounding may miss what a body can have
ROUNDED = 1e-6


def principal_moments(moments: tuple[float, ...]) -> tuple[float, float, float]:
    """The moments of inertia about the principal axes, the least first, of Ixx, Iyy, Izz, Ixy, Ixz, Iyz.

    They are the eigenvalues of a symmetric matrix, by the trigonometric solution of its cubic equation.

    Examples
    --------
    >>> [round(moment, 9) for moment in principal_moments((2.0, 2.0, 5.0, 1.0, 0.0, 0.0))]
    [1.0, 3.0, 5.0]
    """
    xx, yy, zz, xy, xz, yz = moments
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    size = math.sqrt((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    if size == 0.0:
        return mean, mean, mean
    determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    angle = math.acos(max(-1.0, min(1.0, determinant / (2.0 * size**3)))) / 3.0
    low, high = (mean + 2.0 * size * math.cos(angle + turn) for turn in (2.0 * math.pi / 3.0, 0.0))
    return low, 3.0 * mean - low - high, high


def wrong_with(moments: tuple[float, ...]) -> str:
    """Why no distribution of mass has these moments of inertia; nothing where one has.

    About the principal axes none is negative, and none is larger than the two others together.
    """
    least, middle, largest = principal_moments(moments)
    room = ROUNDED * abs(largest)
    if least < -room:
        return f"has a negative principal moment, {least:.6g}; no body has that"
    if largest > least + middle + room:
        numbers = f"{least:.6g}, {middle:.6g} and {largest:.6g}"
        return f"has the principal moments {numbers}; no body has one that is larger than the two others together"
    return ""


def _of_a_body(given: tuple[float, ...]) -> tuple[float, ...]:
    if len(given) not in (3, 6):
        raise problem(f"[Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] is needed, not {shown(list(given))}")
    whole = (*given, 0.0, 0.0, 0.0)[:6]
    if why := wrong_with(whole):
        raise problem(f"{shown(list(given))} {why}")
    return whole


#: all six, of which the last three may be left out
InertiaMatrix = Annotated[
    tuple[Number, ...], Field(strict=False, min_length=3, max_length=6), AfterValidator(_of_a_body)
]


def _is_corner(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and not any(isinstance(x, list | tuple) for x in value)


def _of_lines(value: Any) -> Any:
    """Refuse a single closed line, whose corners would be taken for lines."""
    if isinstance(value, list | tuple) and value and _is_corner(value[0]):
        raise problem("closed lines are needed, each a list of corners: [[[0, 0], [50, 0], [50, 20]]]")
    return value


#: a closed line, whose last corner is joined to the first one
OutlineCorners = Annotated[tuple[Pair, ...], Field(strict=False, min_length=3, max_length=MOST_CORNERS)]
OutlineLines = Annotated[
    tuple[OutlineCorners, ...], Field(strict=False, min_length=1, max_length=MOST_LINES), BeforeValidator(_of_lines)
]


def _of_area(value: Any) -> Any:
    """Refuse in the place of second moments of area what looks like moments of inertia of a mass."""
    if isinstance(value, list | tuple) and len(value) in (3, 6):
        raise problem(
            "a second moment of area, or two of them, is needed; moments of inertia of the mass are rotational_inertia"
        )
    return value


class BodyTable(Table):
    """Mass of a body, for its weight and its inertia, and what makes it elastic."""

    model_config = ConfigDict(
        json_schema_extra={"not": {"required": ["stiffness", "area"]}, "dependentRequired": NEEDS}
    )

    mass: NonNegative = Field(0.0, description="mass in kg")
    centre: tuple[float, ...]
    rotational_inertia: float | tuple[float, ...] | None
    expansion: Omittable[Expansion] = omitted(
        "coefficient of thermal expansion, 1/K; the one of the whole file if left out"
    )
    stiffness: Omittable[Positive] = omitted(
        "axial stiffness of the whole member between its outermost joints, force per length"
    )
    E: Omittable[Positive] = omitted("modulus of elasticity, force per length squared")
    area: Omittable[Positive] = omitted("area of the section: with E it can be stretched")
    inertia: float | tuple[float, ...] | None

    @model_validator(mode="after")
    def _elastic(self) -> Self:
        if self.stiffness is not None and self.area is not None:
            raise problem("the axial stiffness is either stiffness, or E and area; not both")
        bent = [key for key in ("area", "inertia") if getattr(self, key) is not None]
        if bent == ["inertia"] and self.E is None and self.rotational_inertia is None:
            raise problem(
                "'E' is missing (modulus of elasticity): inertia is the second moment of area of a section that bends;"
                " that of the mass, in kg times length squared, is rotational_inertia"
            )
        if bent and self.E is None:
            need = f"{' and '.join(bent)} need{'s' * (len(bent) == 1)}"
            raise problem(f"'E' is missing (modulus of elasticity, which {need})")
        if self.E is not None and not bent:
            raise problem("E alone makes nothing elastic; it needs area (to be stretched) or inertia (to be bent)")
        return self

    @property
    def is_elastic(self) -> bool:
        """Whether it gives in any way."""
        return self.stiffness is not None or self.E is not None


class PlanarBody(BodyTable):
    """Mass of a body, for its weight and its inertia, and what makes it elastic."""

    example: ClassVar[str] = "{ mass = 0.4, centre = [50, 0] } or { stiffness = 5e4 }"
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("G", "torsion", "side"), IN_SPACE)

    centre: Pair = Field((0.0, 0.0), description="centre of mass in body axes")
    rotational_inertia: Omittable[NonNegative] = omitted(
        "moment of inertia about the centre of mass, kg times length squared; acts with a speed"
    )
    inertia: Omittable[Positive] = omitted("second moment of area of the section: with E it can be bent")
    outline: Omittable[OutlineLines] = omitted(
        "what drawings show of it: closed lines, of holes too, each a list of corners in body axes"
    )


class SpatialBody(BodyTable):
    """Mass of a body, for its weight and its inertia, and what makes it elastic."""

    example: ClassVar[str] = "{ mass = 0.4, centre = [50, 0, 0] } or { stiffness = 5e4 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"outline": IN_PLANE}

    centre: Triple = Field((0.0, 0.0, 0.0), description="centre of mass in body axes")
    rotational_inertia: Omittable[InertiaMatrix] = omitted(
        "[Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz], the entries of the inertia matrix about the"
        " centre of mass in body axes, kg times length squared; acts with a speed",
    )
    inertia: Omittable[Annotated[OneOrTwo, BeforeValidator(_of_area)]] = omitted(
        "second moment of area; two of them for bending about `side` and about the direction across"
    )
    G: Omittable[Positive] = omitted("shear modulus, force per length squared")
    torsion: Omittable[Positive] = omitted(
        "torsion constant of the section (round: its polar moment): with G it can be twisted"
    )
    side: Omittable[Direction] = omitted("direction across the member, in body axes, to which its two inertias refer")

    @model_validator(mode="after")
    def _twisted(self) -> Self:
        if (self.G is None) != (self.torsion is None):
            raise problem(
                "'G' is missing (shear modulus, which torsion needs)"
                if self.G is None
                else "G alone makes nothing elastic; it needs torsion (torsion constant of the section)"
            )
        if self.side is not None and self.inertia is None:
            raise problem("side is the direction to which two inertias refer; there is no inertia here")
        return self

    @property
    def is_elastic(self) -> bool:
        """Whether it gives in any way."""
        return super().is_elastic or self.torsion is not None
