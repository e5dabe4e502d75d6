"""The mechanism file as a whole, `format = 1`: what is common to plane and space, then either."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, JsonValue, model_validator

from jointplay.errors import shown

from .assembly import Assembly
from .board import Board
from .bodies import BodyTable, Expansion, PlanarBody, SpatialBody
from .correlations import Correlation
from .costs import Cost, SourceName
from .design import DESIGN, DesignTable
from .deviations import LinkTable, PlanarLink, SpatialLink
from .document import TitleBlock
from .followers import Follower
from .grid import GridTable
from .joints import JointTable
from .kinds import AnySpatialJoint, Joint
from .limits import LimitsTable, PlanarLimits, SpatialLimits
from .pattern_tables import PlanarPattern, SpatialPattern
from .spatial_tables import SpatialLoads, SpatialNamedOutput, SpatialOutput, SpatialPath, SpatialStart
from .springs import SpatialSpring, Spring, SpringTable
from .tables import (
    LINKS,
    Dimension,
    Drive,
    LoadTable,
    LoadTables,
    NamedOutput,
    OneOfSeveral,
    Output,
    OutputTable,
    Path,
    PathTable,
    Start,
    StartTable,
    Temperature,
    UnitsTable,
    VariableName,
)
from .target import TARGET, PlanarTarget, SpatialTarget, TargetTable
from .values import Name, NonNegative, Number, Omittable, Pair, Plain, Table, Triple, omitted, problem, short

#: what the key `patterns` is
PATTERNS = "parts of the mechanism that are repeated, such as the legs of a platform"
#: what `limits` is
LIMITS = "what is acceptable"


def _included(names: tuple[str, ...]) -> tuple[str, ...]:
    # `load` has put the tables of the files in the place of their names.
    if names:
        raise problem(
            "files are included where the file that names them is read, not in a text or a change; write it in the file"
        )
    return names


Included = Annotated[tuple[str, ...], Field(strict=False), AfterValidator(_included)]


def _format(value: object) -> object:
    if not (type(value) is int and value == 1):
        raise problem(f"this version reads format = 1, not {shown(value)}")
    return value


OUTPUT = "the point whose error is asked: a body and a point on it"
OUTPUTS = "several points whose errors are asked, by name, in place of [output]"
LOAD_CASES = "loads that act in one case, by name, beside those that act in every case"
#: a file has either of them, and joints, which may be those of a pattern
REQUIRED: dict[str, JsonValue] = {
    "oneOf": [{"required": ["output"]}, {"required": ["outputs"]}],
    "anyOf": [{"required": ["joints"]}, {"required": ["patterns"]}],
}


#: kinds of joints in which faces slide on one another
RUBBING = ("revolute", "prismatic", "pin_in_slot", "spherical", "universal")


def _rubbing(joint: object, coefficient: object) -> object:
    """A joint with the coefficient of the file, if it rubs and says none; bearings roll."""
    if not isinstance(joint, dict) or joint.get("type") not in RUBBING:
        return joint
    play, own = joint.get("clearance"), joint.get("friction", {})
    rolls = isinstance(play, dict) and "bearing" in play
    if rolls or not isinstance(own, dict) or own.keys() & {"coefficient", "torque", "force"}:
        return joint
    return {**joint, "friction": {**own, "coefficient": coefficient}}


class MechanismFile(Table):
    """What the files of all mechanisms have in common."""

    model_config = ConfigDict(json_schema_extra=REQUIRED)

    format: Annotated[Literal[1], BeforeValidator(_format)] = Field(description="version of the file format: 1")
    title: str = Field("", description="one line that says what the mechanism is")
    space: Literal["planar", "spatial"]
    include: Included = Field((), description="files in the same folder whose tables join as if they were written here")
    variables: dict[VariableName, Plain | str] = Field(
        {}, description="numbers by name, or expressions, for the expressions that stand where a number may"
    )
    units: UnitsTable = Field(description='such as { length = "mm", angle = "deg", force = "N" }')
    patterns: Mapping[str, Table]
    gravity: tuple[float, ...]
    bodies: Mapping[str, BodyTable]
    joints: Mapping[str, JointTable]
    start: Mapping[str, StartTable]
    drives: dict[Name, Drive] = Field({}, description="commanded joint coordinates")
    path: PathTable | None
    grid: Omittable[GridTable] = omitted("what is mapped: ranges of drives or of the output")
    output: OutputTable | None
    outputs: Mapping[str, OneOfSeveral]
    target: TargetTable | None
    loads: Sequence[LoadTable]
    load_cases: Mapping[str, Sequence[LoadTable]]
    springs: Mapping[str, SpringTable]
    temperature: Omittable[Annotated[Temperature, short(lambda value: {"deviation": value}, Number | Temperature)]] = (
        omitted("difference in kelvin from the temperature at which the lengths of the file hold")
    )
    expansion: Omittable[Expansion] = omitted(
        "coefficient of thermal expansion in 1/K of every body without its own, ground included"
    )
    friction: Omittable[NonNegative] = omitted(
        "coefficient of friction of every pin, guide, slot and ball that names none; bearings roll"
    )
    followers: dict[Name, Follower] = Field({}, description="joint coordinates that depend on those of other joints")
    dimensions: dict[Name, Dimension] = Field({}, description="distances with a tolerance or a known deviation")
    links: Mapping[str, LinkTable]
    correlations: Annotated[tuple[Correlation, ...], Field(strict=False)] = Field(
        (), description="sources that scatter together"
    )
    costs: dict[SourceName, Cost] = Field({}, description="what sources cost by their size, for `allocate`")
    design: Omittable[DesignTable] = omitted(DESIGN)
    assembly: Omittable[Assembly] = omitted("the order in which it is assembled")
    board: Omittable[Board] = omitted("what the drawing board of the studio keeps")
    document: Omittable[TitleBlock] = omitted("author, revision, signatures, for `report`")
    limits: LimitsTable

    @model_validator(mode="before")
    @classmethod
    def _rubs_everywhere(cls, data: Any) -> Any:
        """Give joints the friction of the file where they have none of their own."""
        if not isinstance(data, dict) or data.get("friction") is None or not isinstance(data.get("joints"), dict):
            return data
        joints = {name: _rubbing(joint, data["friction"]) for name, joint in data["joints"].items()}
        return {**data, "joints": joints}

    @model_validator(mode="after")
    def _not_empty(self) -> Self:
        if not self.joints:
            raise problem("'joints' is missing; a mechanism needs joints: [joints.NAME] tables")
        return self

    @model_validator(mode="after")
    def _one_output_or_several(self) -> Self:
        if self.output is not None and self.outputs:
            raise problem("give [output], or [outputs.NAME] for each of several; not both")
        if self.output is None and not self.outputs:
            raise problem(f"'output' is missing ({OUTPUT}), or [outputs.NAME] for each of several")
        if self.target is not None and self.outputs:
            raise problem(f"[target] is of [output]; of several it is [outputs.NAME.target]: {shown([*self.outputs])}")
        for word in self.limits.words():
            own = [name for name, output in self.outputs.items() if getattr(output.limits, word) is not None]
            if own and len(own) == len(self.outputs) and getattr(self.limits, word) is not None:
                raise problem(f"limits.{word} holds for no output: {shown(own)} have their own")
        if self.path is not None and len(self.outputs) > 1 and not any(o.leads for o in self.outputs.values()):
            raise problem(
                f"which output has the [path]? Say leads = true in one of [outputs.NAME]: {shown([*self.outputs])}"
            )
        if len(leading := [name for name, output in self.outputs.items() if output.leads]) > 1:
            raise problem(f"one output leads, that which [path] and [grid] speak of; here: {shown(leading)}")
        return self

    @model_validator(mode="after")
    def _a_yield_has_limits(self) -> Self:
        every = (self.limits, *(output.limits for output in self.outputs.values()))
        if self.limits.probability is not None and not any(limits.given() for limits in every):
            known = ", ".join(self.limits.words())
            raise problem(f"limits.probability is the share of the specimens within limits: give one of {known}, too")
        if self.limits.contact is not None and not any(limits.given() for limits in every):
            raise problem("limits.contact says which specimens keep to the limits, and there are none")
        return self

    @model_validator(mode="after")
    def _cases_have_loads(self) -> Self:
        for name, loads in self.load_cases.items():
            if not (loads or self.loads or any(self.gravity)):
                raise problem(f"load_cases.{name} has no loads: [[load_cases.{name}]] with a force or a moment")
        return self

    def only(self, output: str, load_case: str) -> Self:
        """The file of one of its outputs, and of one of its load cases; empty names are of what it has none."""
        changes: dict[str, object] = {}
        if output:
            chosen = self.outputs[output]
            own = {key: value for key, value in chosen.limits if value is not None}
            changes = {"output": chosen, "limits": self.limits.model_copy(update=own), "target": chosen.target}
        if load_case:
            changes["loads"] = (*self.loads, *self.load_cases[load_case])
        return self.model_copy(update=changes)


class PlanarFile(MechanismFile):
    """A mechanism in the plane."""

    space: Literal["planar"] = Field("planar", description="plane or space")
    # `written_out` has put the copies in their place.
    patterns: dict[Name, PlanarPattern] = Field({}, description=PATTERNS)
    gravity: Pair = Field((0.0, 0.0), description="acceleration of gravity [gx, gy] in m/s^2, ground axes")
    bodies: dict[Name, PlanarBody] = Field({}, description="masses of bodies, and what makes them elastic")
    joints: dict[Name, Joint] = Field({}, description="the joints; the bodies are named by them")
    links: dict[Name, PlanarLink] = Field({}, description=LINKS)
    start: dict[Name, Start] = Field({}, description="roughly where the bodies are: it chooses the assembly branch")
    path: Omittable[Path] = omitted("targets of the output, in place of drive values")
    output: Omittable[Output] = omitted(OUTPUT)
    outputs: dict[Name, NamedOutput] = Field({}, description=OUTPUTS)
    target: Omittable[PlanarTarget] = omitted(TARGET)
    loads: LoadTables = Field((), description="forces and moments")
    load_cases: dict[Name, LoadTables] = Field({}, description=LOAD_CASES)
    springs: dict[Name, Spring] = Field({}, description="springs between bodies")
    limits: PlanarLimits = Field(default_factory=lambda: PlanarLimits.model_validate({}), description=LIMITS)


class SpatialFile(MechanismFile):
    """A mechanism in space."""

    space: Literal["spatial"] = Field(description="plane or space")
    patterns: dict[Name, SpatialPattern] = Field({}, description=PATTERNS)
    gravity: Triple = Field((0.0, 0.0, 0.0), description="acceleration of gravity [gx, gy, gz] in m/s^2, ground axes")
    bodies: dict[Name, SpatialBody] = Field({}, description="masses of bodies, and what makes them elastic")
    joints: dict[Name, AnySpatialJoint] = Field({}, description="the joints; the bodies are named by them")
    links: dict[Name, SpatialLink] = Field({}, description=LINKS)
    start: dict[Name, SpatialStart] = Field(
        {}, description="roughly where the bodies are; needed where the joints do not determine it"
    )
    path: Omittable[SpatialPath] = omitted("targets of the output, in place of drive values")
    output: Omittable[SpatialOutput] = omitted(OUTPUT)
    outputs: dict[Name, SpatialNamedOutput] = Field({}, description=OUTPUTS)
    target: Omittable[SpatialTarget] = omitted(TARGET)
    loads: SpatialLoads = Field((), description="forces and moments")
    load_cases: dict[Name, SpatialLoads] = Field({}, description=LOAD_CASES)
    springs: dict[Name, SpatialSpring] = Field({}, description="springs between bodies")
    limits: SpatialLimits = Field(default_factory=lambda: SpatialLimits.model_validate({}), description=LIMITS)
