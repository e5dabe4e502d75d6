"""The grid of a map: ranges of drives or of components of the output, and what is held."""

from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from .values import Name, Number, Numbers, Omittable, Table, evaluated, is_number, omitted, problem, spaced

#: finer than anybody resolves; a larger number is a slip of the keyboard
MOST_STEPS = 100_000
#: axes that a map can have
MOST_AXES = 3


class GridRange(Table):
    """The values of one axis of the grid, or the single one that is held."""

    example: ClassVar[str] = "{ from = -100, to = 100, count = 201 }"

    values: Omittable[Numbers] = omitted("the values; rising or falling")
    from_: Omittable[Number] = omitted("first of equally spaced values", alias="from")
    to: Omittable[Number] = omitted("last of equally spaced values")
    count: Omittable[Annotated[int, Field(ge=2, le=MOST_STEPS)]] = omitted("how many equally spaced values")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        spaced = [key for key, v in (("from", self.from_), ("to", self.to), ("count", self.count)) if v is not None]
        if (self.values is None) == (len(spaced) == 0) or len(spaced) not in (0, 3):
            raise problem("give from, to and count, or a list of values, or a single number that is held")
        steps = [b - a for a, b in zip(self.nodes, self.nodes[1:], strict=False)]
        if not (all(step > 0 for step in steps) or all(step < 0 for step in steps)):
            hint = ""
            if self.values and len(self.values) == 3 and self.values[2] == int(self.values[2]) >= 2:
                low, high, count = self.values
                hint = f"; a range is {{ from = {low:g}, to = {high:g}, count = {int(count)} }}"
            raise problem(f"the values of an axis rise or fall, and none comes twice{hint}")
        return self

    @property
    def nodes(self) -> tuple[float, ...]:
        """The values in file units; a single one is held."""
        if self.from_ is None or self.to is None or self.count is None:
            return self.values or ()
        return spaced(self.from_, self.to, self.count)


def _range(value: Any, info: ValidationInfo) -> object:
    value = evaluated(value, info)
    if isinstance(value, list | tuple):
        return {"values": value}
    return {"values": [value]} if is_number(value) else value


def _axes(ranges: dict[str, GridRange]) -> dict[str, GridRange]:
    count = sum(len(along.nodes) > 1 for along in ranges.values())
    if not 1 <= count <= MOST_AXES:
        raise problem(f"a map has one to {MOST_AXES} axes, such as x = {GridRange.example}; here are {count}")
    return ranges


#: by name of a drive, or by component of the output; a number holds it
GridRanges = dict[
    Name, Annotated[GridRange, BeforeValidator(_range, json_schema_input_type=Number | Numbers | GridRange)]
]
GridTable = Annotated[GridRanges, AfterValidator(_axes)]
