"""What a size costs: `[costs.SOURCE]`, by a formula or as a list of choices.

reciprocal     cost = a + b / t^k
exponential    cost = a + b exp(-k t)
choices        sizes, fits or bearing groups that can be ordered, each with its price

Whatever is tighter costs at least as much: b >= 0 and k > 0, and prices of choices do not rise with the size.
"""

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, Field, StringConstraints, model_validator

from .clearances import BearingGroup
from .sizes import Fit
from .values import NonNegative, Number, Omittable, Positive, Table, omitted, problem

#: the ways to say what is chosen
WAYS = ("size", "fit", "bearing")
#: more choices than any catalogue has for one part
MOST_CHOICES = 200
#: beyond this exponent a power overflows
MOST_EXPONENT = 20.0
FORMULA = ("a", "b", "k", "from", "to")


#: the name of a source in results, which may have points and slashes in it, or a pattern of names with `*`
SourceName = Annotated[str, StringConstraints(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=200)]


class Choice(Table):
    """One of the things that can be ordered, and its price."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [way]} for way in WAYS]})
    example: ClassVar[str] = '{ fit = "H7/g6", cost = 4.2 } or { size = 0.02, cost = 3 }'

    cost: NonNegative = Field(description="its price, in any currency, the same everywhere in the file")
    size: Omittable[NonNegative] = omitted("the size of the clearance in its measure, or the tolerance or error")
    fit: Omittable[Fit] = omitted("tolerance classes of ISO 286, such as H7/g6")
    bearing: Omittable[BearingGroup] = omitted("clearance group of a deep groove ball bearing, such as C3")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = [way for way in WAYS if getattr(self, way) is not None]
        if len(given) != 1:
            raise problem(f"a choice has one of {', '.join(WAYS)}; here: {' and '.join(given) or 'none'}")
        return self

    @property
    def way(self) -> str:
        """Which of the ways it is given in."""
        return next(way for way in WAYS if getattr(self, way) is not None)

    @property
    def value(self) -> float | str:
        """The size, the fit or the bearing group."""
        value: float | str = getattr(self, self.way)
        return value


class Cost(Table):
    """What a source costs, by its size."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["choices"]}, {"required": ["model", "b", "from", "to"]}]}
    )
    example: ClassVar[str] = (
        '{ model = "reciprocal", b = 0.1, from = 0.01, to = 0.1 } or { choices = [{ fit = "H7/g6", cost = 4 }] }'
    )

    model: Omittable[Literal["reciprocal", "exponential"]] = omitted(
        "reciprocal: a + b / t^k; exponential: a + b exp(-k t); t is the size in the units of the file"
    )
    a: Omittable[Number] = omitted("what it costs in any case; 0 if left out")
    b: Omittable[Number] = omitted("what tightness costs; not negative")
    k: Omittable[Positive] = omitted("how fast the cost falls as the size grows; 1 if left out, of a reciprocal cost")
    from_: Omittable[Positive] = omitted("smallest size that can be made", alias="from")
    to: Omittable[Positive] = omitted("largest size that is considered")
    choices: Omittable[Annotated[tuple[Choice, ...], Field(strict=False, min_length=1, max_length=MOST_CHOICES)]] = (
        omitted("instead of a model: what can be ordered, with prices")
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        formula = [key for key in ("model", *FORMULA) if self.given(key) is not None]
        if self.choices is not None:
            if formula:
                raise problem(f"give either choices, or a model with its numbers; not choices with {formula[0]}")
            self._check_choices(self.choices)
            return self
        if self.model is None:
            raise problem("give model = 'reciprocal' or 'exponential' with b, from and to, or choices with prices")
        self._check_formula(self.model)
        return self

    def given(self, key: str) -> object:
        """The value of a key of the file."""
        return getattr(self, "from_" if key == "from" else key)

    def _check_formula(self, model: str) -> None:
        needed = ("b", "from", "to") if model == "reciprocal" else ("b", "k", "from", "to")
        missing = [key for key in needed if self.given(key) is None]
        if missing:
            article = "an" if model == "exponential" else "a"
            raise problem(f"{article} {model} cost needs {', '.join(needed)}; missing: {', '.join(missing)}")
        assert self.b is not None
        assert self.from_ is not None
        assert self.to is not None
        if self.b < 0.0:
            raise problem(f"b = {self.b:g}: the cost would rise with the tolerance; b is 0 or more")
        if self.from_ >= self.to:
            raise problem(f"no size is between from = {self.from_:g} and to = {self.to:g}; from is the smaller one")
        if model == "reciprocal" and self.exponent > MOST_EXPONENT:
            raise problem(f"k = {self.exponent:g}: the power of a reciprocal cost is at most {MOST_EXPONENT:g}")
        if not math.isfinite(self.at(self.from_)):
            raise problem(f"the cost at from = {self.from_:g} is too large for a number")

    def _check_choices(self, choices: tuple[Choice, ...]) -> None:
        said = [(choice.way, choice.value) for choice in choices]
        twice = next((value for value in said if said.count(value) > 1), None)
        if twice is not None:
            raise problem(f"{twice[0]} = {twice[1]} is there twice")

    @property
    def exponent(self) -> float:
        """The k of the formula."""
        return 1.0 if self.k is None else self.k

    def at(self, size: float) -> float:
        """What a size costs by the formula; the size in units of the file."""
        assert self.b is not None
        try:
            falling = math.exp(-self.exponent * size) if self.model == "exponential" else size**-self.exponent
        except OverflowError:
            return math.inf
        return (self.a or 0.0) + self.b * falling

    def slope(self, size: float) -> float:
        """By how much the formula rises with the size; never above zero."""
        assert self.b is not None
        k = self.exponent
        if self.model == "exponential":
            return -self.b * k * math.exp(-k * size)
        return -self.b * k * float(size ** (-k - 1.0))

    def bend(self, size: float) -> float:
        """The second derivative of the formula; never below zero."""
        assert self.b is not None
        k = self.exponent
        if self.model == "exponential":
            return self.b * k**2 * math.exp(-k * size)
        return self.b * k * (k + 1.0) * float(size ** (-k - 2.0))
