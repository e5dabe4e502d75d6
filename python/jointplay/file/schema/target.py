"""What the output, or a joint, ought to do ideally: points, a line, a circle, a function of a drive, a dwell."""

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from .values import (
    IN_PLANE,
    IN_SPACE,
    Axis,
    Direction,
    Number,
    Numbers,
    Omittable,
    Pair,
    Plain,
    Positive,
    Table,
    Triple,
    omitted,
    problem,
)

#: what `target` is
TARGET = "what the output ought to do ideally, from which the nominal mechanism differs by its structural error"
#: what a target can be
KINDS = ("points", "line", "circle", "function", "dwell")
#: points of a target; more is a slip of the keyboard
MOST_POINTS = 100_000
OF = "component of the output's pose, such as x, or a joint, whose coordinate is meant"


class TargetLine(Table):
    """A straight line on which the output point ought to be."""

    fit: bool = Field(False, description="whether it is the line with the least largest distance; then nothing else")
    through: tuple[float, ...] | None
    to: tuple[float, ...] | None

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        direction = getattr(self, "direction", None)
        given = [
            key for key, v in (("through", self.through), ("to", self.to), ("direction", direction)) if v is not None
        ]
        if self.fit and given:
            raise problem(f"a line with fit = true is found; leave out {given[0]}")
        if not self.fit and (self.through is None or (self.to is None) == (direction is None)):
            raise problem("say where the line is: through with to or with direction, or fit = true")
        if self.to is not None and self.to == self.through:
            raise problem("through and to are the same point; a line goes through two")
        return self


class PlanarLine(TargetLine):
    """A straight line on which the output point ought to be."""

    example: ClassVar[str] = "{ through = [0, 100], to = [50, 100] }"

    through: Omittable[Pair] = omitted("a point of the line")
    to: Omittable[Pair] = omitted("another point of it")
    direction: Omittable[Axis] = omitted("instead: its direction, [ux, uy] or an angle")


class SpatialLine(TargetLine):
    """A straight line on which the output point ought to be."""

    example: ClassVar[str] = "{ through = [0, 0, 100], to = [50, 0, 100] }"

    through: Omittable[Triple] = omitted("a point of the line")
    to: Omittable[Triple] = omitted("another point of it")
    direction: Omittable[Direction] = omitted("instead: its direction [ux, uy, uz]")


class TargetCircle(Table):
    """A circle on which the output point ought to be."""

    centre: tuple[float, ...] | None
    radius: Omittable[Positive] = omitted("its radius")


class PlanarCircle(TargetCircle):
    """A circle on which the output point ought to be."""

    example: ClassVar[str] = "{ centre = [0, 0], radius = 50 }"
    elsewhere: ClassVar[dict[str, str]] = {"axis": IN_SPACE}

    fit: bool = Field(False, description="whether it is the circle with the least largest distance; then nothing else")
    centre: Omittable[Pair] = omitted("its centre")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        given = [key for key, v in (("centre", self.centre), ("radius", self.radius)) if v is not None]
        if self.fit and given:
            raise problem(f"a circle with fit = true is found; leave out {given[0]}")
        if not self.fit and len(given) < 2:
            raise problem("give centre and radius, or fit = true")
        return self


class SpatialCircle(TargetCircle):
    """A circle on which the output point ought to be."""

    example: ClassVar[str] = "{ centre = [0, 0, 0], radius = 50, axis = [0, 0, 1] }"
    elsewhere: ClassVar[dict[str, str]] = {"fit": IN_PLANE}

    centre: Triple = Field(description="its centre")
    radius: Positive = Field(description="its radius")
    axis: Direction = Field(description="direction of its axis")


class TargetFunction(Table):
    """A coordinate that ought to be a function of the drives, as that of Ackermann steering."""

    example: ClassVar[str] = '{ of = "angle", value = "15 + 0.5 * theta1" }'

    of: str = Field(description=OF)
    value: Omittable[str | Plain] = omitted(
        "what it ought to be: an expression in the names of the drives and the variables"
    )
    drive: Omittable[str] = omitted("of a table: the drive; may be left out of one drive")
    at: Omittable[Annotated[Numbers, Field(min_length=2)]] = omitted(
        "instead of value: values of the drive, rising; outside of them nothing is asked"
    )
    values: Omittable[Annotated[Numbers, Field(min_length=2)]] = omitted(
        "with at: what it ought to be there; between them a natural cubic spline"
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.at is None) != (self.values is None):
            raise problem("a table has both at (values of the drive) and values")
        if (self.value is None) == (self.at is None):
            raise problem("say what it ought to be: value, such as '2 * theta1', or a table by at and values")
        if self.at is None and self.drive is not None:
            raise problem("'drive' goes with a table; an expression names its drives")
        if len(self.at or ()) != len(self.values or ()):
            raise problem(f"at and values have the same length, not {len(self.at or ())} and {len(self.values or ())}")
        for before, after in zip(self.at or (), (self.at or ())[1:], strict=False):
            if before >= after:
                raise problem(f"at rises from value to value; {after:g} comes after {before:g}")
        return self


class TargetDwell(Table):
    """A coordinate that ought to stay as it is over a range of a drive."""

    example: ClassVar[str] = '{ of = "x", drive = "theta1", from = 120, to = 200 }'

    of: str = Field(description=OF)
    value: Omittable[Number] = omitted("what it ought to be; if left out, the middle")
    drive: Omittable[str] = omitted("the drive; may be left out where there is one drive")
    from_: Omittable[Number] = omitted("where the range of the drive begins", alias="from")
    to: Omittable[Number] = omitted("where it ends; without both the whole path")

    @model_validator(mode="after")
    def _a_range(self) -> Self:
        if (self.from_ is None) != (self.to is None):
            raise problem("a range has both from and to")
        if self.from_ is not None and self.to is not None and not self.from_ < self.to:
            raise problem(f"from < to is needed, not {self.from_:g} and {self.to:g}")
        if self.from_ is None and self.drive is not None:
            raise problem("'drive' goes with from and to")
        return self


class TargetTable(Table):
    """What the output ought to do ideally: one of points, line, circle, function, dwell."""

    points: tuple[tuple[float, ...], ...] | None
    timed: bool = Field(
        True,
        description="of points: whether each belongs to the configuration of its number; if not, the nearest point of"
        " the polyline through them counts",
    )
    line: TargetLine | None
    circle: TargetCircle | None
    function: Omittable[TargetFunction] = omitted("a function of the drives")
    dwell: Omittable[TargetDwell] = omitted("a coordinate that stays as it is")
    tolerance: Omittable[Positive] = omitted("largest acceptable structural error")

    @property
    def kind(self) -> str:
        """Which of `KINDS` it is."""
        return next(key for key in KINDS if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        given = [key for key in KINDS if getattr(self, key) is not None]
        if len(given) != 1:
            here = f"; here: {', '.join(given)}" if given else ""
            raise problem(f"a target is one of {', '.join(KINDS)}{here}")
        if "timed" in self.model_fields_set and self.points is None:
            raise problem("'timed' goes with points")
        if self.points is not None and not self.timed and len(self.points) < 2:
            raise problem("a polyline has two points or more")
        return self


class PlanarTarget(TargetTable):
    """What the output ought to do ideally: one of points, line, circle, function, dwell."""

    example: ClassVar[str] = "{ line = { fit = true }, tolerance = 0.1 }"

    points: Omittable[Annotated[tuple[Pair, ...], Field(strict=False, min_length=1, max_length=MOST_POINTS)]] = omitted(
        "positions [x, y] of the output point"
    )
    line: Omittable[PlanarLine] = omitted("a straight line")
    circle: Omittable[PlanarCircle] = omitted("a circle")


class SpatialTarget(TargetTable):
    """What the output ought to do ideally: one of points, line, circle, function, dwell."""

    example: ClassVar[str] = "{ line = { fit = true }, tolerance = 0.1 }"

    points: Omittable[Annotated[tuple[Triple, ...], Field(strict=False, min_length=1, max_length=MOST_POINTS)]] = (
        omitted("positions [x, y, z] of the output point")
    )
    line: Omittable[SpatialLine] = omitted("a straight line")
    circle: Omittable[SpatialCircle] = omitted("a circle")
