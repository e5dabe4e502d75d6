"""The values that a mechanism file is made of: numbers, names, points, axes, tolerances, and the strict table."""

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import InitErrorDetails, PydanticCustomError

from jointplay.errors import shown, split_hint, suggestion

from .expressions import SIGNS_OF_ONE, NotAnExpression, Variables, is_plain

#: beyond this a number is a slip of the keyboard in any unit, and its square could overflow
LARGEST = 1e12
#: a direction shorter than this has no direction
SHORTEST_AXIS = 1e-9


def problem(message: str) -> PydanticCustomError:
    """An error whose message is already a sentence for people."""
    # The text travels as context, so that braces in it are not read as placeholders.
    return PydanticCustomError("problem", "{message}", {"message": message})


T = TypeVar("T")
#: of a key that may be left out, but not be null
Omittable: TypeAlias = T | SkipJsonSchema[None]


def omitted(description: str, *, alias: str | None = None) -> Any:
    """The field of a key that may be left out."""
    return Field(None, description=description, alias=alias)


def is_number(value: object) -> bool:
    """Whether a value of the file is a number (a boolean is not)."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_finite(value: object) -> bool:
    """Whether a value is a number, and not a whole one that is larger than any other kind has."""
    try:
        return is_number(value) and math.isfinite(float(value))  # type: ignore[arg-type]
    except OverflowError:
        return False


def _evaluated(value: Any, scope: Variables | None, *, alone: bool) -> Any:
    """The value of an expression; anything else as it is.

    A text that has no value is refused where only a number may stand; elsewhere only if it has signs of an expression.
    """
    if not isinstance(value, str) or scope is None or is_plain(value):
        return value
    try:
        return scope.number(value)
    except NotAnExpression as why:
        if scope.given and (alone or SIGNS_OF_ONE.search(value)):
            raise problem(str(why)) from None
        return value


def _number(value: Any, info: ValidationInfo) -> Any:
    return _evaluated(value, info.context, alone=True)


def evaluated(value: Any, info: ValidationInfo) -> Any:
    """The value of an expression in whose place something else may stand as well, or of each in a list."""
    if not isinstance(value, list | tuple):
        return _evaluated(value, info.context, alone=False)
    found = []
    for place, one in enumerate(value):
        try:
            found.append(_evaluated(one, info.context, alone=False))
        except PydanticCustomError as error:
            mistake = InitErrorDetails(type=error, loc=(place,), input=one)
            raise ValidationError.from_exception_data("list", [mistake]) from None
    return found


def short(means: Callable[[Any], object], schema: Any) -> BeforeValidator:
    """A validator that makes of a single number what it is short for.

    Parameters
    ----------
    means : callable
        Makes it of the number.
    schema : type
        All that may stand there.
    """

    def check(value: Any, info: ValidationInfo) -> object:
        value = _evaluated(value, info.context, alone=False)
        return means(value) if is_number(value) else value

    return BeforeValidator(check, json_schema_input_type=schema)


#: where a number may stand, an expression may, too; its variables are the context of the validation
EXPRESSION = BeforeValidator(_number)
#: a number that is written as one
Plain = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Number = Annotated[Plain, EXPRESSION]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST), EXPRESSION]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST), EXPRESSION]
Numbers = Annotated[tuple[Number, ...], Field(strict=False, min_length=1)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]

#: names are parts of dotted keys ("joints.J1.clearance") and of labels ("D/ED", "J1.x")
NAME = r"""^[^\s\x00-\x1f\x7f./*"=\[\]]+$"""
Name = Annotated[str, StringConstraints(pattern=NAME, max_length=100)]

ClearanceLaw = Literal["uniform", "boundary", "normal"]

#: where keys belong that a mechanism of the other kind does not have
IN_SPACE = 'in space (space = "spatial")'
IN_PLANE = 'in the plane (space = "planar")'

#: two numbers, such as of two directions; a single one stands for both
OneOrTwo = Annotated[
    tuple[Positive, Positive],
    Field(strict=False),
    short(lambda value: (value, value), Positive | tuple[Positive, Positive]),
]


def spaced(first: float, last: float, count: int) -> tuple[float, ...]:
    """Equally spaced numbers, two or more: both ends as they are, and symmetric where the ends are.

    Examples
    --------
    >>> spaced(-0.7, 0.7, 3)
    (-0.7, 0.0, 0.7)
    """
    steps = count - 1
    return (first, *((first * (steps - k) + last * k) / steps for k in range(1, steps)), last)


class Table(BaseModel):
    """A table of the file: frozen, strict, and with messages that name the nearest known key."""

    # Validators are made when a table is first read: a mechanism has few of the tables there are. Annotations of this
    # package are not postponed for the same reason: pydantic would compile each of them when a program starts.
    # No key begins like a method of pydantic, which would look at each.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True, protected_namespaces=()
    )
    #: what to write, for the message when something else than a table stands there
    example: ClassVar[str] = "{ ... }"
    #: keys that this table has in mechanisms of the other kind only, with what to say of them
    elsewhere: ClassVar[Mapping[str, str]] = {}
    #: keys that one could expect here, with what to write instead
    instead: ClassVar[Mapping[str, str]] = {}

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, data: object) -> object:
        if isinstance(data, cls):
            return data
        if not isinstance(data, dict):
            raise problem(f"a table such as {cls.example} is needed, not {shown(data)}")
        known = {field.alias or name: field for name, field in cls.model_fields.items()}
        for key in data:
            if key in cls.elsewhere:
                raise problem(f"'{key}' is a key {cls.elsewhere[key]}; here: {', '.join(sorted(known))}")
            if key in cls.instead:
                raise problem(f"'{key}' is not a key here: {cls.instead[key]}")
            if key not in known:
                raise problem(f"'{str(key)[:60]}' is not a key here; {suggestion(str(key), sorted(known))}")
        for key, field in known.items():
            if field.is_required() and key not in data:
                what = f" ({field.description})" if field.description else ""
                raise problem(f"'{key}' is missing{what}")
        return data


def as_data(value: Any) -> Any:
    """What a table of the file gives as data: its keys, with numbers for expressions, and lists."""
    # `model_dump` of pydantic before 2.14 fails where a table inside has never been read by itself.
    if isinstance(value, Table):
        fields = [(name, field) for name, field in type(value).model_fields.items() if name in value.model_fields_set]
        return {field.alias or name: as_data(getattr(value, name)) for name, field in fields}
    if isinstance(value, Mapping):
        return {key: as_data(inner) for key, inner in value.items()}
    return [as_data(inner) for inner in value] if isinstance(value, list | tuple) else value


def _is_direction(value: Any, size: int) -> bool:
    if not (isinstance(value, list | tuple) and len(value) == size and all(is_number(v) for v in value)):
        return False
    if not all(abs(v) <= LARGEST for v in value):
        return False
    if math.hypot(*value) < SHORTEST_AXIS:
        example = "[1, 0], or an angle" if size == 2 else "[0, 0, 1]"
        raise problem(f"{shown(list(value))} has no direction; write {example}")
    return True


def _axis(value: Any, info: ValidationInfo) -> float | tuple[float, float]:
    value = evaluated(value, info)
    if is_number(value) and abs(value) <= LARGEST:
        return float(value)
    if _is_direction(value, 2):
        return (float(value[0]), float(value[1]))
    raise problem(f"a direction [ux, uy] or an angle is needed, not {shown(value)}{split_hint(value, 2)}")


#: a direction in the plane: its two components, or its angle from the x axis in the file's unit
Axis = Annotated[float | tuple[float, float], PlainValidator(_axis, json_schema_input_type=Number | Pair)]


def _direction(value: Any, info: ValidationInfo) -> tuple[float, float, float]:
    value = evaluated(value, info)
    if _is_direction(value, 3):
        return (float(value[0]), float(value[1]), float(value[2]))
    raise problem(f"a direction [ux, uy, uz] is needed, not {shown(value)}{split_hint(value, 3)}")


#: a direction in space, of any length
Direction = Annotated[tuple[float, float, float], PlainValidator(_direction, json_schema_input_type=Triple)]


class ToleranceTable(Table):
    """How far a value may be off: two bounds, or a standard deviation."""

    example: ClassVar[str] = "0.05, { plus = 0.05, minus = 0.02 } or { sigma = 0.02 }"

    plus: Omittable[NonNegative] = omitted("how far above")
    minus: Omittable[NonNegative] = omitted("how far below, as a positive number")
    sigma: Omittable[NonNegative] = omitted("standard deviation, a third of the bounds")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        bounds = (self.plus is not None) + (self.minus is not None)
        if (self.sigma is None and bounds != 2) or (self.sigma is not None and bounds):
            raise problem("give either plus and minus, or sigma alone")
        return self

    @property
    def low(self) -> float:
        """Lower bound, not above zero."""
        return -(self.minus or 0.0) if self.sigma is None else -3.0 * self.sigma

    @property
    def high(self) -> float:
        """Upper bound, not below zero."""
        return (self.plus or 0.0) if self.sigma is None else 3.0 * self.sigma


#: a number means plus and minus that number
Tolerance = Annotated[
    ToleranceTable, short(lambda value: {"plus": value, "minus": value}, NonNegative | ToleranceTable)
]
