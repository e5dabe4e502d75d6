"""Bodies: their mass with its inertia, and what makes a member of them that gives under force.

A body that says nothing of elasticity is rigid, and so is every way of giving that an elastic one leaves out.
"""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, JsonValue, model_validator
from pydantic.json_schema import SkipJsonSchema

from jointplay.basics.arrays import Floats
from jointplay.errors import shown

from .values import (
    EXPRESSION,
    IN_SPACE,
    Direction,
    NonNegative,
    Number,
    OneOrTwo,
    Pair,
    Positive,
    Table,
    Triple,
    problem,
)

#: keys that mean nothing without another one
NEEDS: dict[str, JsonValue] = {"area": ["E"], "inertia": ["E"], "G": ["torsion"], "torsion": ["G"], "side": ["inertia"]}


#: the coefficient of thermal expansion; polymers go to a few 1e-4 per kelvin, some ceramics shrink
Expansion = Annotated[float, Field(ge=-0.01, le=0.01), EXPRESSION]
#: part of the largest moment of inertia by which rounding may miss what no body can have
ROUNDED = 1e-6


def inertia_matrix(given: tuple[float, ...]) -> Floats:
    """The matrix of three moments of inertia, or of these and Ixy, Ixz, Iyz."""
    xx, yy, zz, xy, xz, yz = (*given, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _of_a_body(given: tuple[float, ...]) -> tuple[float, ...]:
    """Refuse what no distribution of mass can have.

    With the moments of inertia about the principal axes none is negative, and none is larger than both others together.
    """
    if len(given) not in (3, 6):
        raise problem(f"[Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] is needed, not {shown(list(given))}")
    least, middle, largest = np.linalg.eigvalsh(inertia_matrix(given)).tolist()
    room = ROUNDED * abs(largest)
    if least < -room:
        raise problem(f"{shown(list(given))} has a negative principal moment, {least:.6g}; no body has that")
    if largest > least + middle + room:
        raise problem(
            f"{shown(list(given))} has the principal moments {least:.6g}, {middle:.6g} and {largest:.6g}; no body has"
            " one that is larger than the two others together"
        )
    return given


InertiaMatrix = Annotated[
    tuple[Number, ...], Field(strict=False, min_length=3, max_length=6), AfterValidator(_of_a_body)
]


class BodyTable(Table):
    """Mass of a body, for its weight and its inertia, and what makes it elastic."""

    model_config = ConfigDict(
        json_schema_extra={"not": {"required": ["stiffness", "area"]}, "dependentRequired": NEEDS}
    )

    mass: NonNegative = Field(0.0, description="mass in kg")
    centre: tuple[float, ...]
    rotational_inertia: float | tuple[float, ...] | None
    expansion: Expansion | SkipJsonSchema[None] = Field(
        None, description="coefficient of thermal expansion, 1/K; the one of the whole file if left out"
    )
    stiffness: Positive | SkipJsonSchema[None] = Field(
        None, description="axial stiffness of the whole member between its outermost joints, force per length"
    )
    E: Positive | SkipJsonSchema[None] = Field(None, description="modulus of elasticity, force per length squared")
    area: Positive | SkipJsonSchema[None] = Field(None, description="area of the section: with E it can be stretched")
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
    elsewhere: ClassVar[Mapping[str, str]] = {"G": IN_SPACE, "torsion": IN_SPACE, "side": IN_SPACE}

    centre: Pair = Field((0.0, 0.0), description="centre of mass in body axes")
    rotational_inertia: NonNegative | SkipJsonSchema[None] = Field(
        None, description="moment of inertia about the centre of mass, kg times length squared; acts with a speed"
    )
    inertia: Positive | SkipJsonSchema[None] = Field(
        None, description="second moment of area of the section: with E it can be bent"
    )


class SpatialBody(BodyTable):
    """Mass of a body, for its weight and its inertia, and what makes it elastic."""

    example: ClassVar[str] = "{ mass = 0.4, centre = [50, 0, 0] } or { stiffness = 5e4 }"

    centre: Triple = Field((0.0, 0.0, 0.0), description="centre of mass in body axes")
    rotational_inertia: InertiaMatrix | SkipJsonSchema[None] = Field(
        None,
        description="[Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz], the entries of the inertia matrix about the"
        " centre of mass in body axes, kg times length squared; acts with a speed",
    )
    inertia: OneOrTwo | SkipJsonSchema[None] = Field(
        None, description="second moment of area; two of them for bending about `side` and about the direction across"
    )
    G: Positive | SkipJsonSchema[None] = Field(None, description="shear modulus, force per length squared")
    torsion: Positive | SkipJsonSchema[None] = Field(
        None, description="torsion constant of the section (round: its polar moment): with G it can be twisted"
    )
    side: Direction | SkipJsonSchema[None] = Field(
        None, description="direction across the member, in body axes, to which its two inertias refer"
    )

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
