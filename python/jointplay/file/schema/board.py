"""What the drawing board of the studio keeps in a file; questions do not read it."""

from typing import Annotated, ClassVar

from pydantic import Field

from .values import Name, Pair, Table

FreePoints = Annotated[tuple[Pair, ...], Field(strict=False, min_length=1)]


class Board(Table):
    """What the drawing board of the studio keeps; questions do not read it."""

    example: ClassVar[str] = '{ free = { rod = [[40, 0], [90, 20]] }, locked = ["J1"] }'

    free: dict[Name, FreePoints] = Field({}, description="points of bodies that no joint is at yet, in body axes")
    locked: Annotated[tuple[Name, ...], Field(strict=False)] = Field((), description="joints that are not dragged")
