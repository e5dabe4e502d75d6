"""Tables of the mechanism file that say something else in space than in the plane."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from .limits import SpatialErrorLimits
from .places import PathTriple, SpatialPlace
from .tables import OWN_LIMITS, OWN_TARGET, LoadTable, OneOfSeveral, OutputTable, PathTable, StartTable
from .target import SpatialTarget
from .values import IN_PLANE, Number, Numbers, Omittable, Triple, omitted, problem

TURNS = ("rx", "ry", "rz")


class SpatialStart(StartTable):
    """Roughly where a body is. What is left out follows from the joints; it need not be exact."""

    example: ClassVar[str] = "{ x = 0, y = 0, z = 100, rotation = [0, 0, 30] }"
    elsewhere: ClassVar[Mapping[str, str]] = {"angle": IN_PLANE}

    z: Omittable[Number] = omitted("position of the body's origin in ground axes")
    rotation: Omittable[Triple] = omitted(
        "rotation vector of the body's axes in ground axes: along the axis, as long as the angle"
    )


class SpatialPath(PathTable):
    """Target values of the output, from which the drives are solved."""

    example: ClassVar[str] = "{ x = [10, 20], y = [0, 5], z = [400, 400] }"
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z", *TURNS)
    elsewhere: ClassVar[Mapping[str, str]] = {"angle": IN_PLANE}

    z: Omittable[Numbers] = omitted("positions of the output along the ground's z axis")
    rx: Omittable[Numbers] = omitted("x of the rotation vector of the output body")
    ry: Omittable[Numbers] = omitted("y of the rotation vector of the output body")
    rz: Omittable[Numbers] = omitted("z of the rotation vector of the output body")

    @model_validator(mode="after")
    def _whole_rotation(self) -> Self:
        asked = [key for key in TURNS if key in self.asked]
        if asked and len(asked) < len(TURNS):
            raise problem(f"rx, ry and rz are one rotation and belong together; here: {', '.join(asked)}")
        return self


class SpatialOutput(OutputTable):
    """The point on a body whose pose error is asked."""

    example: ClassVar[str] = '{ body = "platform", at = [0, 0, 100] }'

    at: SpatialPlace = Field(
        (0.0, 0.0, 0.0), description="the output point: [x, y, z] in body axes, or a joint on the body"
    )


class SpatialNamedOutput(SpatialOutput, OneOfSeveral):
    """One of several outputs."""

    limits: SpatialErrorLimits = Field(
        default_factory=lambda: SpatialErrorLimits.model_validate({}), description=OWN_LIMITS
    )
    target: Omittable[SpatialTarget] = omitted(OWN_TARGET)


class SpatialLoad(LoadTable):
    """A load: dead in ground axes, or a follower in those of a body."""

    example: ClassVar[str] = "{ force = [0, 0, -10] }"
    written: ClassVar[str] = "a force [fx, fy, fz] or a moment [mx, my, mz]"

    at: Omittable[SpatialPlace] = omitted(
        "where: [x, y, z] in body axes or a joint on the body; the output point if left out"
    )
    force: Omittable[PathTriple] = omitted("force [fx, fy, fz], or a list of them, one per configuration")
    moment: PathTriple = Field(
        (0.0, 0.0, 0.0), description="moment [mx, my, mz], or a list of them, one per configuration"
    )


SpatialLoads = Annotated[tuple[SpatialLoad, ...], Field(strict=False)]
