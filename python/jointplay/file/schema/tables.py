"""Tables of the mechanism file: units, drives, path, outputs, loads, for plane and space and then for the plane."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, ConfigDict, Field, WithJsonSchema, model_validator

from jointplay.basics.units import ANGLES, AngleUnit, ForceUnit, LengthUnit, TurningSpeedUnit
from jointplay.errors import not_known, shown

from .drives import SHORTEST, Backlash, DriveBacklash, DriveStiffness, Duration, LawOfMotion, Ramp
from .expressions import RESERVED, is_variable
from .laws import Deviating, ToleranceLaw, check_law
from .limits import ErrorLimits, PlanarErrorLimits
from .places import PathNumber, PathPair, Place
from .target import PlanarTarget, TargetTable
from .values import (
    IN_SPACE,
    ClearanceLaw,
    Name,
    NonNegative,
    Number,
    Numbers,
    Omittable,
    Table,
    Tolerance,
    is_number,
    omitted,
    problem,
    spaced,
)

#: what the key `links` is
LINKS = "how far one joint of a body is off against another one, by components"
#: what `limits` of an output is
OWN_LIMITS = "its own limits, in place of those of [limits]"
#: what `target` of an output is
OWN_TARGET = "what it ought to do ideally, see [target]"
#: more configurations than anybody looks at; a longer path is a slip of the keyboard
MOST_CONFIGURATIONS = 1_000_000


class UnitsTable(Table):
    """Units of every number in the file."""

    example: ClassVar[str] = '{ length = "mm", angle = "deg", force = "N" }'

    length: LengthUnit = Field("mm", description="unit of lengths")
    angle: AngleUnit = Field("deg", description="unit of angles")
    force: ForceUnit = Field("N", description="unit of forces; moments are in force times length")
    turning_speed: Omittable[TurningSpeedUnit] = omitted(
        "unit of the speeds of drives that turn: 1/min are revolutions per minute; the angle per second if left out"
    )


class StartTable(Table):
    """Roughly where a body is. What is left out follows from the joints; it need not be exact."""

    x: Omittable[Number] = omitted("position of the body's origin in ground axes")
    y: Omittable[Number] = omitted("position of the body's origin in ground axes")


class Start(StartTable):
    """Roughly where a body is. What is left out follows from the joints; it need not be exact."""

    example: ClassVar[str] = "{ x = 0, y = 0, angle = 30 }"
    elsewhere: ClassVar[Mapping[str, str]] = {"z": IN_SPACE, "rotation": IN_SPACE}

    angle: Omittable[Number] = omitted("angle of the body's axes in ground axes")


class Drive(Table):
    """A joint coordinate that is commanded: the angle of a revolute joint, the distance along a guide or slot.

    Or a motor that moves several joints: the coordinate of each is its coefficient times the value of the motor. The
    value is an angle or a length as the coordinate of the first joint is.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["joint"]}, {"required": ["joints"]}]})
    example: ClassVar[str] = '{ joint = "J1", from = 0, to = 90, count = 10 }'

    joint: Omittable[str] = omitted("the joint whose coordinate it commands")
    joints: Omittable[dict[str, Number]] = omitted(
        "instead of `joint`: several joints that one motor moves, each with the motion of its coordinate"
        " per motion of the motor",
    )
    values: Omittable[Numbers] = omitted("the commanded values, one per configuration")
    csv: Omittable[str] = omitted("instead: file in the same folder with the values")
    column: Omittable[str] = omitted("with csv: the name of the column in its first row; that of the drive if left out")
    from_: Omittable[Number] = omitted("first of equally spaced values", alias="from")
    to: Omittable[Number] = omitted("last of equally spaced values")
    count: Omittable[Annotated[int, Field(ge=2, le=MOST_CONFIGURATIONS)]] = omitted("how many equally spaced values")
    error: Omittable[Tolerance] = omitted("how far the drive may be off its command")
    deviation: Number = Field(
        0.0, description="the known error of its zero in one built specimen: actual minus commanded value"
    )
    law: Omittable[ToleranceLaw] = omitted("how it scatters: uniform if left out; see tolerances")
    backlash: Omittable[DriveBacklash] = omitted(
        "lost motion of the joint that it drives, from flank to flank, where the load decides: half of it"
        " to either side of the command, or { plus, minus }; with `joints` a table by joint",
    )
    backlash_law: ClearanceLaw = Field(
        "uniform", description="how it lies in its backlash in random specimens: uniform, boundary (on a flank), normal"
    )
    stiffness: Omittable[DriveStiffness] = omitted(
        "force per length, or moment per angle in the file's units, by which it winds up beside its"
        " backlash; rigid if left out; with `joints` a table by joint",
    )
    speed: Omittable[PathNumber] = omitted(
        "how fast the value changes, per second (see units.turning_speed), or one per configuration: bodies"
        " with a mass then load the joints by their inertia; at rest if left out",
    )
    acceleration: Omittable[PathNumber] = omitted(
        "with speed: how fast that changes, in units.length or units.angle per second squared, or one per configuration"
    )
    motion: Omittable[LawOfMotion] = omitted(
        "with from, to and count: the law by which it goes there, from rest to rest, at equally spaced"
        " times: trapezoid (of speed), cycloidal, poly5 (polynomial of degree 5)",
    )
    duration: Omittable[Duration] = omitted("with motion: how long it takes, in seconds")
    ramp: Omittable[Ramp] = omitted(
        "with a trapezoid: the share of the duration for gaining speed, as for losing it; 0.25 if left out"
    )
    times: Omittable[Numbers] = omitted(
        "with values: when it has them, in seconds; speeds are those of a spline of degree 5"
    )
    time: Omittable[str] = omitted(
        "with csv: the name of the column that has these times, in s or, as its unit says, in ms"
    )
    rotor_inertia: NonNegative = Field(
        0.0,
        description="inertia of the motor, reduced to the value: kg times length squared of an angle, kg of a length;"
        " it takes part of the motor's moment",
    )

    @model_validator(mode="after")
    def _moves_something(self) -> Self:
        if self.joint is None and self.joints is None:
            raise problem(
                "'joint' is missing (the joint whose coordinate it commands; for several joints ="
                " { J1 = 1, J2 = -0.5 })"
            )
        if self.joint is not None and self.joints is not None:
            raise problem("give joint, or joints with the coefficient of each; not both")
        if not self.moves:
            raise problem("joints is empty; a motor moves at least one joint, such as joints = { J1 = 1, J2 = -0.5 }")
        for name, coefficient in self.moves.items():
            if coefficient == 0.0:
                raise problem(f"joints.{name} = 0 moves nothing; take it away or give it a coefficient")
        for key in ("backlash", "stiffness"):
            given = getattr(self, key)
            if given is not None and isinstance(given, Mapping) != (self.joint is None):
                many = ", ".join(f"{name} = ..." for name in self.moves)
                way = "a number (the drive moves one joint)" if self.joint else f"a table by joint: {{ {many} }}"
                raise problem(f"{key} is {way}")
            for name in given if isinstance(given, Mapping) else ():
                if name not in self.moves:
                    raise problem(f"{key}: {not_known(name, 'a joint that this drive moves', self.moves)}")
        if self.backlash is None and "backlash_law" in self.model_fields_set:
            raise problem("'backlash_law' goes with backlash")
        return self

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        check_law(self.error, self.law)
        spaced = [key for key, v in (("from", self.from_), ("to", self.to), ("count", self.count)) if v is not None]
        given = ["values"] if self.values is not None else spaced
        check_table(self.csv, given)
        for key in ("column", "time"):
            if getattr(self, key) is not None:
                raise problem(f"'{key}' goes with csv")
        if self.values is not None and spaced:
            raise problem(f"give either values, or from, to and count; not values with {', '.join(spaced)}")
        if spaced and len(spaced) < 3:
            missing = [key for key in ("from", "to", "count") if key not in spaced]
            raise problem(f"from, to and count belong together; missing: {', '.join(missing)}")
        return self

    @model_validator(mode="after")
    def _one_clock(self) -> Self:
        ways = [key for key in ("speed", "motion", "times") if getattr(self, key) is not None]
        if len(ways) > 1:
            raise problem(f"its speed follows from one of speed, motion, times; here: {', '.join(ways)}")
        if self.acceleration is not None and self.speed is None:
            raise problem("'acceleration' goes with speed, which may be 0")
        for key, other in (("duration", "motion"), ("ramp", "motion"), ("times", "values")):
            if getattr(self, key) is not None and getattr(self, other) is None:
                raise problem(f"'{key}' goes with {other}")
        if self.motion is not None:
            if self.duration is None:
                raise problem("'duration' is missing (seconds that the motion takes)")
            if self.count is None:
                raise problem(f"motion = {shown(self.motion)} goes with from, to and count")
            if self.ramp is not None and self.motion != "trapezoid":
                raise problem("'ramp' goes with motion = \"trapezoid\"")
        if self.times is not None and self.values is not None:
            check_times(self.times, len(self.values))
        return self

    @property
    def moves(self) -> dict[str, float]:
        """The joints that it moves, each with its coefficient in units of the file."""
        return {self.joint: 1.0} if self.joint is not None else dict(self.joints or {})

    @property
    def backlashes(self) -> dict[str, Backlash]:
        """The lost motion of the joints that it moves, where there is some."""
        given = self.backlash
        return dict.fromkeys(self.moves, given) if isinstance(given, Backlash) else dict(given or {})

    @property
    def stiffnesses(self) -> dict[str, float]:
        """The stiffness towards the joints that it moves, where it is not rigid, in units of the file."""
        given = self.stiffness
        return dict.fromkeys(self.moves, given) if isinstance(given, float) else dict(given or {})

    @property
    def is_commanded(self) -> bool:
        """Whether the file gives its values."""
        return self.values is not None or self.count is not None

    @property
    def commands(self) -> tuple[float, ...]:
        """The commanded values in file units; none when the path of the output decides them."""
        if self.values is not None:
            return self.values
        if self.from_ is None or self.to is None or self.count is None:
            return ()
        return spaced(self.from_, self.to, self.count)


#: a spline of degree 5 needs one more
FEWEST_TIMES = 6


def check_times(times: Sequence[float], count: int) -> None:
    """Refuse times at which a number of values cannot be met.

    Raises
    ------
    ValueError
        When there are others than there are values, too few of them, or not one after the other.
    """
    if len(times) != count:
        raise problem(f"times and values belong together; here are {len(times)} times and {count} values")
    if count < FEWEST_TIMES:
        raise problem(f"speeds from a table need {FEWEST_TIMES} or more values, not {count}")
    late = next((k for k in range(1, count) if times[k] < times[k - 1] + SHORTEST), 0)
    if late:
        raise problem(
            f"times: {times[late]:g} comes after {times[late - 1]:g}; each has to be later than the one before"
            + f", by {SHORTEST:g} s at least" * (times[late] > times[late - 1])
        )


def check_table(csv: str | None, given: Sequence[str]) -> None:
    """Refuse the name of a table in whose place `load` has not put its values.

    Raises
    ------
    ValueError
        When there is one.
    """
    if csv is not None and given:
        raise problem(f"give either csv, or {', '.join(given)}; not both")
    if csv is not None:
        raise problem(
            "a table is read where the file that names it is read, not in a text or a change; write it in the file, or"
            " its values"
        )


class PathTable(Table):
    """Target values of the output, from which the drives are solved."""

    components: ClassVar[tuple[str, ...]]

    csv: Omittable[str] = omitted("instead: file in the same folder, whose columns have the names of the components")
    x: Omittable[Numbers] = omitted("positions of the output along the ground's x axis")
    y: Omittable[Numbers] = omitted("positions of the output along the ground's y axis")

    @model_validator(mode="after")
    def _equal(self) -> Self:
        counts = {key: len(values) for key, values in self.asked.items()}
        names = ", ".join(self.components)
        check_table(self.csv, list(counts))
        if not counts:
            raise problem(f"a path needs at least one of {names}, each a list of target values")
        if len(set(counts.values())) > 1:
            has = ", ".join(f"{key} {count}" for key, count in counts.items())
            raise problem(f"{names} run together and need as many values each; here: {has}")
        return self

    @property
    def asked(self) -> dict[str, tuple[float, ...]]:
        """The components that have targets."""
        given = {key: getattr(self, key) for key in self.components}
        return {key: values for key, values in given.items() if values is not None}


class Path(PathTable):
    """Target values of the output, from which the drives are solved."""

    example: ClassVar[str] = "{ x = [10, 20], y = [80, 85] }"
    components: ClassVar[tuple[str, ...]] = ("x", "y", "angle")
    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("z", "rx", "ry", "rz"), IN_SPACE)

    angle: Omittable[Numbers] = omitted("angles of the output body")


class OutputTable(Table):
    """The point on a body whose pose error is asked."""

    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(("limits", "leads"), "of one of several [outputs.NAME]") | {
        "target": "of the file as a whole, [target], or of one of several [outputs.NAME]"
    }

    body: str = Field(description="the body that carries the output point")
    at: tuple[float, ...] | str
    relative_to: Omittable[str] = omitted(
        "the body against which the output is measured, in the axes of that body; the ground if left out"
    )


class Output(OutputTable):
    """The point on a body whose pose error is asked."""

    example: ClassVar[str] = '{ body = "rocker", at = [150, 0] }'

    at: Place = Field((0.0, 0.0), description="the output point: [x, y] in body axes, or a joint on the body")


class OneOfSeveral(OutputTable):
    """What an output has beside its point where there are several."""

    elsewhere: ClassVar[Mapping[str, str]] = {}

    limits: ErrorLimits
    target: TargetTable | None
    leads: bool = Field(False, description="whether it is the one that [path] and a [grid] of positions speak of")


class NamedOutput(Output, OneOfSeveral):
    """One of several outputs."""

    limits: PlanarErrorLimits = Field(
        default_factory=lambda: PlanarErrorLimits.model_validate({}), description=OWN_LIMITS
    )
    target: Omittable[PlanarTarget] = omitted(OWN_TARGET)


class LoadTable(Table):
    """A load: dead in ground axes, or a follower in those of a body."""

    #: how a force and a moment are written
    written: ClassVar[str]

    body: Omittable[str] = omitted("the loaded body; the output body if left out")
    at: tuple[float, ...] | str | None
    axes: Omittable[str] = omitted(
        'axes of force and moment: "ground" (default), "body" for those of the loaded body, with which the'
        " load turns, or the name of another body",
    )
    force: tuple[float, ...] | tuple[tuple[float, ...], ...] | None
    moment: float | tuple[float, ...] | tuple[tuple[float, ...], ...]

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.force is None and "moment" not in self.model_fields_set:
            raise problem(f"a load needs {self.written}")
        return self


class Load(LoadTable):
    """A load: dead in ground axes, or a follower in those of a body."""

    example: ClassVar[str] = "{ force = [0, -10] }"
    written: ClassVar[str] = "a force [fx, fy] or a moment"

    at: Omittable[Place] = omitted("where: [x, y] in body axes or a joint on the body; the output point if left out")
    force: Omittable[PathPair] = omitted("force [fx, fy], or a list of them, one per configuration")
    moment: PathNumber = Field(0.0, description="moment, counter-clockwise, or one per configuration")


LoadTables = Annotated[tuple[Load, ...], Field(strict=False)]


class Dimension(Deviating):
    """A named distance on one body; the second of the two points moves with its error."""

    example: ClassVar[str] = '{ body = "coupler", between = ["J2", "J3"], tolerance = 0.05 }'

    body: str = Field(description="the body that has the distance")
    between: Annotated[tuple[str, str], Field(strict=False)] = Field(
        description='two joints on the body, or "output"; the second point moves'
    )


class Temperature(Deviating):
    """How far the temperature is from the one at which the lengths of the file hold, in kelvin."""

    example: ClassVar[str] = "40, or { deviation = 40, tolerance = 15 }"


def _variable(name: str) -> str:
    if name in RESERVED:
        raise problem(f"{shown(name)} has a meaning in expressions already; use another name")
    if not is_variable(name):
        raise problem(
            f"{shown(name)} is not the name of a variable: letters, digits and _, a letter first, no word of Python"
        )
    return name


#: letters, digits and `_`, no digit first, and nothing that has a meaning in expressions
VARIABLE = f"^(?!(?:{'|'.join(sorted(RESERVED))})$)" + r"(?![0-9])[^\x00-\x2f\x3a-\x40\x5b-\x5e\x60\x7b-\x7f]+$"
VariableName = Annotated[
    Name,
    AfterValidator(_variable),
    WithJsonSchema({"type": "string", "pattern": VARIABLE, "maxLength": 100}),
]


def variables_of(raw: Mapping[str, Any]) -> tuple[Mapping[str, object], float]:
    """What a file gives as variables, and its unit of angles in radians.

    What is no table of numbers and texts is left for the model to refuse.
    """
    given, units = raw.get("variables"), raw.get("units")
    angle = units.get("angle", "deg") if isinstance(units, Mapping) else "deg"
    is_value = lambda value: isinstance(value, str) or is_number(value)  # noqa: E731
    if not (isinstance(given, Mapping) and all(map(is_variable, given)) and all(map(is_value, given.values()))):
        given = {}
    return given, ANGLES.get(angle, 1.0) if isinstance(angle, str) else 1.0
