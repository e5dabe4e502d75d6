"""Springs between two bodies: along the line between two points, or about a revolute joint."""

from collections.abc import Mapping
from typing import ClassVar, Self

from pydantic import ConfigDict, Field, model_validator

from .places import Place, SpatialPlace
from .values import Name, NonNegative, Number, Omittable, Table, omitted, problem


class SpringTable(Table):
    """A spring: its force follows from the pose."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["on", "free_length"]}, {"required": ["joint"]}]}
    )

    on: Mapping[str, object] | None
    joint: Omittable[str] = omitted(
        "instead of `on`: the joint about which a torsion spring acts, one whose coordinate is an angle"
    )
    stiffness: NonNegative = Field(description="force per length; of a torsion spring moment per angle")
    free_length: Omittable[NonNegative] = omitted("distance of its ends at which its tension is the preload")
    free_angle: Omittable[Number] = omitted(
        "of a torsion spring: the joint's coordinate at which its moment is the preload; 0 if left out"
    )
    preload: Number = Field(
        0.0, description="tension at the free length, negative for a push; of a torsion spring moment at the free angle"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.on is None) == (self.joint is None):
            what = "on = { BODY = point, BODY = point }, or joint for a torsion spring"
            raise problem(f"give {what}; not both" if self.on is not None else f"say where it acts: {what}")
        if self.on is None:
            if self.free_length is not None:
                raise problem("free_length is for a spring between two points; a torsion spring has free_angle")
            return self
        if len(self.on) != 2:
            raise problem(f"a spring is on two bodies; on has {len(self.on)}")
        if self.free_angle is not None:
            raise problem("free_angle is for a torsion spring, which has a joint; here it is free_length")
        if self.free_length is None:
            raise problem("'free_length' is missing (distance of its ends at which its tension is the preload)")
        return self


class Spring(SpringTable):
    """A spring: its force follows from the pose."""

    example: ClassVar[str] = '{ on = { ground = [0, 50], arm = "J2" }, stiffness = 2, free_length = 40 }'

    on: Omittable[dict[Name, Place]] = omitted(
        "its two bodies, and where it is fixed on each: [x, y] in body axes, or a joint on the body"
    )


class SpatialSpring(SpringTable):
    """A spring: its force follows from the pose."""

    example: ClassVar[str] = '{ on = { ground = [0, 0, 50], arm = "J2" }, stiffness = 2, free_length = 40 }'

    on: Omittable[dict[Name, SpatialPlace]] = omitted(
        "its two bodies, and where it is fixed on each: [x, y, z] in body axes, or a joint on the body"
    )
