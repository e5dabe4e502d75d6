"""Coordinates of joints that follow those of others: by a polynomial, or through the points of a table."""

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from jointplay.errors import shown

from .drives import Flanks
from .laws import ToleranceLaw, check_law
from .values import ClearanceLaw, Number, Numbers, Omittable, Positive, Table, Tolerance, omitted, problem

#: terms of a polynomial and points of a table
MOST_TERMS, MOST_POINTS = 20, 2000


class Follower(Table):
    """A joint coordinate that depends on that of another joint, as a cam makes it whose shape is not modelled."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [{"required": ["polynomial"]}, {"required": ["at", "values"]}, {"required": ["csv", "columns"]}]
        }
    )
    example: ClassVar[str] = '{ joint = "lift", follows = "shaft", polynomial = [0, 0.5, -0.01] }'

    joint: str = Field(description="the joint whose coordinate follows")
    follows: str = Field(description="the joint whose coordinate it depends on")
    polynomial: Omittable[Annotated[Numbers, Field(max_length=MOST_TERMS)]] = omitted(
        "coefficients of the powers of the leading coordinate, from the constant on, in file units"
    )
    origin: Number = Field(
        0.0,
        description="of a polynomial: the leading coordinate from which its powers count; an angle counts within half a"
        " turn of it",
    )
    at: Omittable[Annotated[Numbers, Field(min_length=2, max_length=MOST_POINTS)]] = omitted(
        "instead: values of the leading coordinate, rising"
    )
    values: Omittable[Annotated[Numbers, Field(min_length=2, max_length=MOST_POINTS)]] = omitted(
        "with `at`: the following coordinate there; between them a cubic spline"
    )
    csv: Omittable[str] = omitted("instead: file in the same folder with both")
    columns: Omittable[Annotated[tuple[str, str], Field(strict=False)]] = omitted(
        "with csv: names of the columns of the leading and of the following coordinate"
    )
    ends: Literal["natural", "clamped", "periodic"] = Field(
        "natural",
        description="of a table: without curvature (natural), without slope (clamped), or the same after a full turn of"
        " the leading joint (periodic)",
    )
    backlash: Omittable[Flanks] = omitted(
        "lost motion of the following coordinate, from flank to flank, where the load decides: half to"
        " either side, or { plus, minus }",
    )
    backlash_law: ClearanceLaw = Field(
        "uniform", description="how it lies in its backlash in random specimens: uniform, boundary (on a flank), normal"
    )
    error: Omittable[Tolerance] = omitted("how far the following coordinate may be off")
    deviation: Number = Field(0.0, description="the known error of the following coordinate in one built specimen")
    law: Omittable[ToleranceLaw] = omitted("how it scatters: uniform if left out")
    stiffness: Omittable[Positive] = omitted(
        "force per length, or moment per angle, by which the following coordinate gives way"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if self.joint == self.follows:
            raise problem(f"'{self.joint}' cannot follow itself")
        if (self.csv is None) != (self.columns is None):
            raise problem('csv goes with columns: csv = "cam.csv", columns = ["angle", "lift"]')
        if self.csv is not None and (self.polynomial or self.at or self.values):
            raise problem("give a polynomial, at and values, or csv and columns; not two of them")
        if self.csv is not None:
            raise problem("a table beside the file is read with a mechanism file; a text gives at and values")
        if (self.polynomial is None) == (self.at is None):
            raise problem(
                "say what it follows along: polynomial = [c0, c1, ...], or a table by at and values"
                + (", not both" if self.at is not None else "")
            )
        if (self.at is None) != (self.values is None):
            raise problem("a table has both at (the leading coordinate) and values (the following one)")
        if self.polynomial is not None:
            if not any(self.polynomial[1:]):
                raise problem(f"polynomial = {shown(list(self.polynomial))} is constant: nothing follows")
            if "ends" in self.model_fields_set:
                raise problem("'ends' goes with a table")
            check_law(self.error, self.law)
            return self
        if "origin" in self.model_fields_set:
            raise problem("'origin' goes with a polynomial")
        at, values = self.at or (), self.values or ()
        if len(at) != len(values):
            raise problem(f"at and values have the same length, not {len(at)} and {len(values)}")
        for k in range(len(at) - 1):
            if at[k] >= at[k + 1]:
                raise problem(f"at rises from value to value; {at[k + 1]:g} comes after {at[k]:g}")
        if self.ends == "periodic" and len(at) < 4:
            raise problem("a periodic table has four points or more; the last one is the first one after a turn")
        if not all(map(math.isfinite, (*at, *values))):
            raise problem("at and values are finite numbers")
        if max(values) == min(values):
            raise problem("values are all the same: nothing follows")
        check_law(self.error, self.law)
        return self

    @model_validator(mode="after")
    def _law_of_something(self) -> Self:
        if self.backlash is None and "backlash_law" in self.model_fields_set:
            raise problem("'backlash_law' goes with backlash")
        return self
