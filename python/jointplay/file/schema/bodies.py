"""Bodies: their mass, and what makes a member of them that gives under force.

A body that says nothing of elasticity is rigid, and so is every way of giving that an elastic one leaves out.
"""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator
from pydantic.json_schema import SkipJsonSchema

from .values import EXPRESSION, IN_SPACE, Direction, NonNegative, OneOrTwo, Pair, Positive, Table, Triple, problem

#: keys that mean nothing without another one
NEEDS: dict[str, JsonValue] = {"area": ["E"], "inertia": ["E"], "G": ["torsion"], "torsion": ["G"], "side": ["inertia"]}


#: the coefficient of thermal expansion; polymers go to a few 1e-4 per kelvin, some ceramics shrink
Expansion = Annotated[float, Field(ge=-0.01, le=0.01), EXPRESSION]


class BodyTable(Table):
    """Mass of a body, for its weight, and what makes it elastic."""

    model_config = ConfigDict(
        json_schema_extra={"not": {"required": ["stiffness", "area"]}, "dependentRequired": NEEDS}
    )

    mass: NonNegative = Field(0.0, description="mass in kg")
    centre: tuple[float, ...]
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
    """Mass of a body, for its weight, and what makes it elastic."""

    example: ClassVar[str] = "{ mass = 0.4, centre = [50, 0] } or { stiffness = 5e4 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"G": IN_SPACE, "torsion": IN_SPACE, "side": IN_SPACE}

    centre: Pair = Field((0.0, 0.0), description="centre of mass in body axes")
    inertia: Positive | SkipJsonSchema[None] = Field(
        None, description="second moment of area of the section: with E it can be bent"
    )


class SpatialBody(BodyTable):
    """Mass of a body, for its weight, and what makes it elastic."""

    example: ClassVar[str] = "{ mass = 0.4, centre = [50, 0, 0] } or { stiffness = 5e4 }"

    centre: Triple = Field((0.0, 0.0, 0.0), description="centre of mass in body axes")
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
