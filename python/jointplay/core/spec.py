"""A mechanism as the core reads it: plain data in SI units and radians, everything by index.

These are names and types for the type checker; the core says what they mean (`mechanism/spec.rs`) and checks them.
"""

from typing import Any, Literal, NotRequired, TypedDict

End = Literal["first", "second"]
ENDS: tuple[End, End] = ("first", "second")
#: the direction of a joint on each of its bodies, and one across
AXIS_ON: dict[End, Literal["axis_first", "axis_second"]] = {"first": "axis_first", "second": "axis_second"}
SIDE_ON: dict[End, Literal["side_first", "side_second"]] = {"first": "side_first", "second": "side_second"}


class PointSpec(TypedDict):
    """A point of a body; the ground is body -1."""

    body: int
    at: list[float]


class ContactSpec(TypedDict):
    """How two wheels touch whose axes are not parallel, in axes common to both."""

    axes: list[list[float]]
    apart: list[float]
    at: list[float]
    normal: list[float]
    opening: list[float]


class CurveSpec(TypedDict):
    """A curve by polynomials between knots."""

    knots: list[float]
    pieces: list[list[float]]


class FollowerSpec(TypedDict):
    """A joint coordinate over that of another joint."""

    of: int
    leader: int
    curve: CurveSpec
    middle: float


class CouplingSpec(TypedDict, total=False):
    """What a coupling needs beside its points and axes; every kind has its own part of it."""

    radii: list[float]
    teeth: list[int]
    pressure_angle: float
    internal: bool
    crossed: bool
    lead: float
    distance: float | None
    marks: list[float] | None
    contact: ContactSpec | None


class JointSpec(TypedDict):
    """A joint between two points."""

    kind: str
    first: int
    second: int
    axis_first: list[float]
    axis_second: list[float]
    side_first: NotRequired[list[float]]
    side_second: NotRequired[list[float]]
    compliance: NotRequired[list[float]]
    coupling: NotRequired[CouplingSpec]
    follows: NotRequired[FollowerSpec]
    settled: NotRequired[bool]


class MoveSpec(TypedDict):
    """A joint coordinate that is commanded."""

    joint: int
    component: NotRequired[str]
    coefficient: NotRequired[float]


class DriveSpec(MoveSpec):
    """A drive with all coordinates that it commands."""

    also: NotRequired[list[MoveSpec]]
    compliance: NotRequired[list[float]]


class GapSpec(TypedDict):
    """How much the gap of a joint grows with a size."""

    joint: int
    factor: float


class OutputSpec(TypedDict):
    """The output point, and the body against which it is measured if that is not the ground."""

    point: int
    relative_to: NotRequired[int]


class LoadSpec(TypedDict):
    """A load: dead in ground axes, or in those of a body."""

    point: int
    force: list[float]
    moment: list[float]
    axes: NotRequired[int]


class SpringSpec(TypedDict):
    """A spring between two points."""

    first: int
    second: int
    stiffness: float
    free_length: float
    preload: float


class TorsionSpec(TypedDict):
    """A torsion spring about a joint."""

    joint: int
    stiffness: float
    free_angle: float
    preload: float


class GrowthSpec(TypedDict):
    """A point that a source moves: by how much per unit of its value, in the axes of its body."""

    point: int
    rate: list[float]


class DisplacementSpec(TypedDict):
    """A rigid displacement of points of one body; it turns about a point, given in body axes."""

    points: list[int]
    about: list[float]


#: a shape by name, with its sizes
SetSpec = dict[str, dict[str, float]]
_Ends = TypedDict("_Ends", {"from": NotRequired[int], "to": NotRequired[int]})


class _Moving(_Ends):
    """What a source moves, by the keys of its kind; where its offset can be, and how it scatters there."""

    set: SetSpec
    law: str | dict[str, Any]
    joint: NotRequired[int]
    factor: NotRequired[float]
    also: NotRequired[list[GapSpec]]
    drive: NotRequired[int]
    together: NotRequired[list[int]]
    displacement: NotRequired[int]
    components: NotRequired[list[str]]
    #: translation and rotation vector per unit of every component, body axes
    ways: NotRequired[list[list[list[float]]]]
    moves: NotRequired[list[GrowthSpec]]


class SourcePart(_Moving):
    """A source without its known deviation, and without its kind where results have the same word for it."""

    kind: NotRequired[str]


class SourceSpec(_Moving):
    """One thing that can be off."""

    kind: str
    centre: list[float]


class CorrelationSpec(TypedDict):
    """Sources that scatter together, and what makes their scores of independent ones."""

    sources: list[int]
    factor: list[list[float]]


class Changes(TypedDict, total=False):
    """What takes the place of parts of a mechanism, the output apart."""

    guess: list[list[float]]
    points: list[PointSpec]
    joints: list[JointSpec]
    drives: list[DriveSpec]
    loads: list[LoadSpec]
    displacements: list[DisplacementSpec]
    springs: list[SpringSpec]
    torsions: list[TorsionSpec]
    sources: list[SourceSpec]
    correlations: list[CorrelationSpec]


class Spec(TypedDict):
    """A whole mechanism."""

    space: str
    n_bodies: int
    guess: list[list[float]]
    length: float
    singular_value: float
    points: list[PointSpec]
    joints: list[JointSpec]
    drives: list[DriveSpec]
    output: OutputSpec
    loads: list[LoadSpec]
    displacements: list[DisplacementSpec]
    springs: list[SpringSpec]
    torsions: list[TorsionSpec]
    sources: list[SourceSpec]
    correlations: list[CorrelationSpec]
