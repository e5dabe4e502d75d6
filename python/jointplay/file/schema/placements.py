"""Where a joint sits on one of its bodies, in the plane and in space."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field

from .values import IN_SPACE, Axis, Direction, Omittable, Pair, Table, Triple, omitted


class PlacementKeys(Table):
    """What a placement has in the plane and in space alike."""

    at: tuple[float, ...]
    axis: float | tuple[float, ...] | None


class PlacementTable(PlacementKeys):
    """Where a joint sits on one of its bodies, in body axes."""

    example: ClassVar[str] = "[x, y] or { at = [x, y], axis = [ux, uy] }"
    elsewhere: ClassVar[Mapping[str, str]] = {"side": IN_SPACE}

    at: Pair = Field(description="the point [x, y] in body axes")
    axis: Omittable[Axis] = omitted("direction of the joint: [ux, uy] or an angle")


class SpatialPlacementTable(PlacementKeys):
    """Where a joint sits on one of its bodies, in body axes."""

    example: ClassVar[str] = "[x, y, z] or { at = [x, y, z], axis = [ux, uy, uz] }"

    at: Triple = Field(description="the point [x, y, z] in body axes")
    axis: Omittable[Direction] = omitted("direction of the joint [ux, uy, uz]")
    side: Omittable[Direction] = omitted(
        "direction across the axis [ux, uy, uz]: where a guide is wide, where an angle is zero"
    )


def _placement(value: object) -> object:
    return {"at": value} if isinstance(value, list | tuple) else value


#: `[x, y]`, or a table with the axis as well
Placement = Annotated[PlacementTable, BeforeValidator(_placement, json_schema_input_type=Pair | PlacementTable)]
#: `[x, y, z]`, or a table with axis and side as well
SpatialPlacement = Annotated[
    SpatialPlacementTable, BeforeValidator(_placement, json_schema_input_type=Triple | SpatialPlacementTable)
]
