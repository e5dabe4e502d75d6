"""The order in which a mechanism is assembled."""

from typing import Annotated, ClassVar

from pydantic import Field

from .values import Table

BodyNames = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]


class Assembly(Table):
    """The order in which a mechanism is assembled."""

    example: ClassVar[str] = '{ base = "ground", steps = [["crank"], ["coupler", "rocker"]] }'

    base: str = Field("ground", description="the body that everything is assembled on, and that errors refer to")
    steps: Annotated[tuple[BodyNames, ...], Field(strict=False, min_length=1)] = Field(
        description="the bodies that each step adds; every body is added once"
    )
