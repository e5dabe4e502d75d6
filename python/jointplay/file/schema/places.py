"""Points of bodies, and forces that may change from configuration to configuration."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo

from jointplay.errors import shown, split_hint

from .values import Number, Numbers, Pair, Triple, evaluated, is_number, problem


def place_checker(size: int) -> Callable[[Any, ValidationInfo], object]:
    """A validator of points with so many coordinates, or names of joints."""
    point = "[x, y]" if size == 2 else "[x, y, z]"

    def check(value: Any, info: ValidationInfo) -> object:
        if isinstance(value, str):
            return value
        value = evaluated(value, info)
        if isinstance(value, list | tuple) and len(value) == size and all(is_number(v) for v in value):
            return value
        needed = f"a point {point} or the name of a joint on that body is needed"
        raise problem(f"{needed}, not {shown(value)}{split_hint(value, size)}")

    return check


#: a point of a body: its coordinates in body axes, or the name of a joint on that body
Place = Annotated[Pair | str, BeforeValidator(place_checker(2))]

#: the same in space
SpatialPlace = Annotated[Triple | str, BeforeValidator(place_checker(3))]


def _many_numbers(value: object) -> str:
    return "path" if isinstance(value, list | tuple) else "one"


def _many_vectors(value: object) -> str:
    return "path" if isinstance(value, list | tuple) and any(isinstance(v, list | tuple) for v in value) else "one"


#: a number, or one per configuration
PathNumber = Annotated[Annotated[Number, Tag("one")] | Annotated[Numbers, Tag("path")], Discriminator(_many_numbers)]
#: a vector, or one per configuration
PathPair = Annotated[
    Annotated[Pair, Tag("one")] | Annotated[tuple[Pair, ...], Field(strict=False), Tag("path")],
    Discriminator(_many_vectors),
]
PathTriple = Annotated[
    Annotated[Triple, Tag("one")] | Annotated[tuple[Triple, ...], Field(strict=False), Tag("path")],
    Discriminator(_many_vectors),
]


def along_the_path(value: Any, is_vector: bool) -> tuple[Any, ...] | None:
    """The values of all configurations where there is one for each; None where one serves for all.

    Examples
    --------
    >>> along_the_path((0.0, -10.0), True)
    >>> along_the_path(((0.0, -10.0), (0.0, -12.0)), True)
    ((0.0, -10.0), (0.0, -12.0))
    """
    if not isinstance(value, tuple) or (is_vector and (not value or is_number(value[0]))):
        return None
    return value
