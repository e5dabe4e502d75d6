"""`[design]`: which values of the file may be chosen anew, what is to be small, and what else has to hold."""

from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, model_validator

from jointplay.errors import not_known, shown

from .values import Name, Number, Numbers, Omittable, Pair, Positive, Table, evaluated, omitted, problem

#: what `design` is
DESIGN = "which values may be chosen anew, what is to be small, and what has to hold"
#: values of a catalogue
MOST_VALUES = 10_000
AimName = Literal[
    "worst_position",
    "worst_rotation",
    "loaded_position",
    "loaded_rotation",
    "structural",
    "structural_worst",
    "outside",
    "drive_force",
    "size",
    "cost",
]
AIMS: tuple[str, ...] = get_args(AimName)
#: a dotted key of the file, as `--set` takes it
DottedKey = Annotated[str, StringConstraints(pattern=r"^[^\x00-\x1f\x7f=]+$", max_length=300)]


class Variation(Table):
    """What a value may become: anything between two bounds, or one of a list."""

    example: ClassVar[str] = "[60, 90], { from = 60, to = 90, step = 0.5 } or { values = [60, 63, 67] }"

    from_: Omittable[Number] = omitted("smallest value", alias="from")
    to: Omittable[Number] = omitted("largest value")
    step: Omittable[Positive] = omitted("with from and to: only values so far apart")
    values: Omittable[Annotated[Numbers, Field(min_length=1, max_length=MOST_VALUES)]] = omitted(
        "instead: the values of a catalogue"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.values is None) == (self.from_ is None and self.to is None and self.step is None):
            raise problem(f"give bounds or a list: {self.example}")
        if self.values is None:
            if self.from_ is None or self.to is None:
                raise problem(f"bounds are from and to; here one of them is missing: {self.example}")
            if not self.from_ < self.to:
                raise problem(f"bounds are [lowest, highest], not {shown([self.from_, self.to])}")
            if self.step is not None and not (self.to - self.from_) / self.step <= MOST_VALUES:
                raise problem(f"step = {self.step:g} gives more than {MOST_VALUES} values")
        return self

    @property
    def choices(self) -> tuple[float, ...]:
        """The values of a list, rising; none of a range."""
        if self.values is not None:
            return tuple(sorted(set(self.values)))
        if self.step is None:
            return ()
        low, high = self.bounds
        return tuple(low + k * self.step for k in range(int((high - low) / self.step * (1.0 + 1e-12)) + 1))

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest value."""
        if self.values is not None:
            return min(self.values), max(self.values)
        assert self.from_ is not None
        assert self.to is not None
        return self.from_, self.to


def _variation(value: Any, info: ValidationInfo) -> object:
    value = evaluated(value, info)
    if isinstance(value, list | tuple) and len(value) == 2:
        return {"from": value[0], "to": value[1]}
    if isinstance(value, list | tuple):
        raise problem(f"two bounds are [60, 90]; a list of {len(value)} values is {{ values = {shown(list(value))} }}")
    return value


def _aims(value: Any) -> object:
    if isinstance(value, list | tuple) and len(value) > 2:
        raise problem(f"one aim, or two for a front; of {len(value)} a sum with weights is made small")
    return [value] if isinstance(value, str) else value


AnyVariation = Annotated[Variation, BeforeValidator(_variation, json_schema_input_type=Pair | Variation)]
Aims = Annotated[
    tuple[AimName, ...],
    Field(strict=False, min_length=1, max_length=2),
    BeforeValidator(_aims, json_schema_input_type=AimName | tuple[AimName, ...]),
]


class DesignTable(Table):
    """Which values may be chosen anew, what is to be small, and what has to hold beside the limits."""

    example: ClassVar[str] = '{ aim = "worst_position", vary = { "joints.J3.on.ground.0" = [-200, 0] } }'

    vary: dict[DottedKey, AnyVariation] = Field(
        {}, description="bounds or catalogues by the key of a value, as `--set` takes it, in quotes"
    )
    aim: Omittable[Aims] = omitted(
        "what is to be small, at the configuration where it is largest; of two there is a front"
    )
    weights: dict[str, Positive] = Field(
        {}, description="instead of aim: several, each times its weight, whose sum is to be small"
    )
    question: Literal["worst", "loaded"] = Field(
        "worst", description="in which question the limits of the error and of forces have to hold"
    )
    transmission: dict[Name, Positive] = Field(
        {}, description="smallest acceptable transmission angle, by joint: between the lines along its two bodies"
    )

    @model_validator(mode="after")
    def _one_aim(self) -> Self:
        if self.aim is not None and self.weights:
            raise problem("give aim, or weights of several aims; not both")
        for name in self.weights:
            if name not in AIMS:
                raise problem(f"weights: {not_known(name, 'an aim', AIMS)}")
        if self.aim is not None and len(set(self.aim)) < len(self.aim):
            raise problem(f"a front is of two different aims, not {shown(list(self.aim))}")
        return self
