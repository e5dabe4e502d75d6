"""Patterns: parts of a mechanism that the file has once and the mechanism several times."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, create_model, model_validator

from .bodies import BodyTable, PlanarBody, SpatialBody
from .deviations import LinkTable, PlanarLink, SpatialLink
from .followers import Follower
from .joints import JointTable
from .kinds import AnySpatialJoint, Joint
from .limits import CopyLimits
from .spatial_tables import SpatialLoad, SpatialStart
from .springs import SpatialSpring, Spring, SpringTable
from .tables import LINKS, Dimension, Drive, Load, LoadTable, Start, StartTable, VariableName
from .values import IN_SPACE, Direction, Name, Number, Omittable, Pair, Plain, Table, Triple, omitted, problem

#: more copies than any machine has; a larger number is a slip of the keyboard
MOST_COPIES = 1000
#: the number of the copy in expressions of a pattern, counted from 1
COPY = "copy"

ABOUT = "what the copies are turned about: the same numbers in the axes of the ground and of every shared body"
ANGLE = "angle from one copy to the next; a full turn divided by `count` if left out"
#: a number for each copy, or one expression that holds for all of them
PerCopy = Annotated[tuple[Plain | str, ...], Field(strict=False, min_length=1)] | Plain | str


class AboutTable(Table):
    """What the copies of a pattern are turned about."""

    point: tuple[float, ...]
    angle: Omittable[Number] = omitted(ANGLE)


class About(AboutTable):
    """What the copies of a pattern are turned about."""

    example: ClassVar[str] = "{ point = [0, 0] }"
    elsewhere: ClassVar[Mapping[str, str]] = {"axis": IN_SPACE}

    point: Pair = Field((0.0, 0.0), description="the middle [x, y]")


class SpatialAbout(AboutTable):
    """What the copies of a pattern are turned about."""

    example: ClassVar[str] = "{ axis = [0, 0, 1] }"

    point: Triple = Field((0.0, 0.0, 0.0), description="a point [x, y, z] of the axis")
    axis: Direction = Field(description="direction of the axis [ux, uy, uz]")


class PatternHead(Table):
    """How often a part of the mechanism is repeated, and in what its copies differ."""

    example: ClassVar[str] = "{ count = 3, about = { point = [0, 0] }, joints = { ... } }"

    count: Omittable[Annotated[int, Field(ge=1, le=MOST_COPIES)]] = omitted(
        "how many copies there are; as many as `values` has if left out"
    )
    about: AboutTable | None
    values: dict[VariableName, PerCopy] = Field(
        {}, description="variables of the pattern: a list with one value for each copy, or an expression for all"
    )
    shared: Annotated[tuple[Name, ...], Field(strict=False)] = Field(
        (), description="bodies that all copies have in common, beside the ground"
    )

    @model_validator(mode="after")
    def _counted(self) -> Self:
        lengths = {name: len(value) for name, value in self.values.items() if isinstance(value, tuple)}
        if self.count is None and not lengths:
            raise problem("'count' is missing (how many copies there are), or a list in `values`")
        if len({*lengths.values(), self.copies}) > 1:
            has = ", ".join(f"{name} {length}" for name, length in lengths.items())
            count = "" if self.count is None else f"count = {self.count}; "
            raise problem(f"values has one for each copy: {count}here are {has}")
        if COPY in self.values:
            raise problem(f"values: '{COPY}' is the number of the copy already; use another name")
        return self

    @property
    def copies(self) -> int:
        """How many copies there are."""
        lists = (len(value) for value in self.values.values() if isinstance(value, tuple))
        return self.count if self.count is not None else next(lists)


class PatternTable(PatternHead):
    """A part of the mechanism that is repeated."""

    elsewhere: ClassVar[Mapping[str, str]] = {
        "patterns": "of the file as a whole: what is copied is not copied again",
        "variables": "of the file as a whole; those of a pattern are its `values`",
        **dict.fromkeys(
            (
                "output",
                "outputs",
                "path",
                "grid",
                "assembly",
                "gravity",
                "units",
                "load_cases",
                "correlations",
                "temperature",
                "expansion",
            ),
            "of the file as a whole, which may name the copies",
        ),
    }

    joints: Mapping[str, JointTable]
    bodies: Mapping[str, BodyTable]
    start: Mapping[str, StartTable]
    drives: dict[Name, Drive] = Field({}, description="commanded joint coordinates, those of the first copy")
    followers: dict[Name, Follower] = Field({}, description="joint coordinates that depend on those of other joints")
    loads: Sequence[LoadTable]
    dimensions: dict[Name, Dimension] = Field({}, description="distances with a tolerance or a known deviation")
    links: Mapping[str, LinkTable]
    springs: Mapping[str, SpringTable]
    limits: CopyLimits = Field(
        default_factory=lambda: CopyLimits.model_validate({}), description="ranges of drives and joints"
    )


class PlanarHead(PatternHead):
    """How often a part of a mechanism in the plane is repeated."""

    about: Omittable[About] = omitted(ABOUT)


class PlanarPattern(PlanarHead, PatternTable):
    """A part of a mechanism in the plane that is repeated."""

    joints: dict[Name, Joint] = Field({}, description="its joints")
    links: dict[Name, PlanarLink] = Field({}, description=LINKS)
    springs: dict[Name, Spring] = Field({}, description="springs between its bodies, and to shared ones")
    bodies: dict[Name, PlanarBody] = Field({}, description="masses of its bodies, and what makes them elastic")
    start: dict[Name, Start] = Field({}, description="roughly where its bodies are, those of the first copy")
    loads: Annotated[tuple[Load, ...], Field(strict=False)] = Field((), description="loads, those of the first copy")


class SpatialHead(PatternHead):
    """How often a part of a mechanism in space is repeated."""

    about: Omittable[SpatialAbout] = omitted(ABOUT)


class SpatialPattern(SpatialHead, PatternTable):
    """A part of a mechanism in space that is repeated."""

    joints: dict[Name, AnySpatialJoint] = Field({}, description="its joints")
    links: dict[Name, SpatialLink] = Field({}, description=LINKS)
    springs: dict[Name, SpatialSpring] = Field({}, description="springs between its bodies, and to shared ones")
    bodies: dict[Name, SpatialBody] = Field({}, description="masses of its bodies, and what makes them elastic")
    start: dict[Name, SpatialStart] = Field({}, description="roughly where its bodies are, those of the first copy")
    loads: Annotated[tuple[SpatialLoad, ...], Field(strict=False)] = Field(
        (), description="loads, those of the first copy"
    )


def _holder(model: type[Table]) -> type[Table]:
    """A table with nothing but `patterns`, so that messages name the whole key."""
    fields: dict[str, Any] = {"patterns": (dict[Name, model], ...)}  # type: ignore[valid-type]
    return create_model("Patterns", __base__=Table, **fields)


#: what is checked before the copies are made: how often a part is repeated, then the part with the values of a copy
HEADS: Mapping[str, type[Table]] = {"planar": _holder(PlanarHead), "spatial": _holder(SpatialHead)}
PARTS: Mapping[str, type[Table]] = {"planar": _holder(PlanarPattern), "spatial": _holder(SpatialPattern)}
