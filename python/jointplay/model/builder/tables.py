"""The tables of a mechanism file as types: their keys, for editors and type checkers.

Written from the schema of the file by tests/helpers/signatures.py; not by hand.
"""

from __future__ import annotations

from typing import Literal, TypedDict

from .values import Count, NumberLike, NumbersLike, RowsLike


class AboutDict(TypedDict, total=False):
    """What the copies of a pattern are turned about."""

    point: NumbersLike
    """The middle [x, y]; in space: a point [x, y, z] of the axis."""
    angle: NumberLike
    """Angle from one copy to the next; a full turn divided by `count` if left out."""
    axis: NumbersLike
    """Direction of the axis [ux, uy, uz] (in space only)."""


class AxisDeviationDict(TypedDict, total=False):
    """How far the axis of a joint is from its direction on a body."""

    tolerance: NumberLike | ToleranceDict
    """How far it may be off (in the plane only)."""
    deviation: NumbersLike
    """With a zone: the known rotations [about side, about normal]."""
    law: Literal["uniform", "boundary", "normal"]
    """How it scatters in its zone: normal (three sigma to the boundary, default), uniform, boundary."""
    side: NumberLike | ComponentDeviationDict
    """Rotation about the side."""
    normal: NumberLike | ComponentDeviationDict
    """Rotation about the normal (axis x side)."""
    angle: NumberLike
    """Largest angle to the drawn axis: a cone."""
    diameter: NumberLike
    """Instead, with length: diameter of the cylinder in which the axis lies (ISO 1101)."""
    length: NumberLike
    """With diameter: length of the cylinder."""


class BacklashDict(TypedDict, total=False):
    """How far a driven coordinate can be on either side of its command until a flank stops it."""

    plus: NumberLike
    """To its positive side."""
    minus: NumberLike
    """To its negative side, as a positive number."""


class BallClearanceDict(TypedDict, total=False):
    """Play of a ball in its socket: its centre lies in a ball."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary."""
    tolerance: NumberLike | ToleranceDict
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | LawDict
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default), uniform or
    triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv',
    column = 'd' }."""
    radial: NumberLike
    """Hole radius minus pin radius."""
    diametral: NumberLike
    """Hole diameter minus pin diameter."""
    diameter: NumberLike
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: HoleDict
    """Instead, with pin: diameter and limits of the hole."""
    pin: PinDict
    """Diameter and limits of the pin."""


class RevoluteClearanceDict(BallClearanceDict, total=False):
    """Play of a pin in its hole: the pin's centre lies in a disc."""

    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Instead: radial internal clearance of a deep groove ball bearing, group of ISO 5753-1."""
    bore: NumberLike
    """With bearing: diameter of its bore."""
    reduction: NumberLike | NumbersLike
    """With bearing: by how much mounting reduces its clearance; [least, most] where that scatters."""


class BearingClearanceDict(RevoluteClearanceDict, total=False):
    """Play of a pin in its hole and along it, or of a ball bearing, in space."""

    length: NumberLike
    """Length of the pin inside its hole."""
    axial: NumberLike
    """How far the pin can slide to each side."""


class ClearanceDict(RevoluteClearanceDict, total=False):
    """Play of a joint of any kind."""

    length: NumberLike
    """Length of the pin inside its hole."""
    axial: NumberLike
    """How far the nut can shift on the thread to each side."""
    slack: NumberLike | NumbersLike
    """Travel at the rim to either side; [minus, plus] where the sides differ."""
    backlash: NumberLike
    """Backlash from flank to flank, an arc at the pitch circle (of crossed gears the second one)."""
    backlash_angle: NumberLike
    """Instead: angle that the second body turns from flank to flank while the first is held."""
    gap: NumberLike
    """Gap on each side."""
    nominal: NumberLike
    """With fit: nominal width of the slot."""
    slot: SlotDict
    """Instead, with slider: width and limits of the slot."""
    slider: SliderDict
    """Width and limits of what is in the slot."""
    width: NumberLike
    """Size of its section along `side` (in the plane only)."""
    height: NumberLike
    """Size of its section across axis and `side`; as its width if left out (in the plane only)."""
    size: NumbersLike
    """Size of the plate [along `side`, across it]."""


class SleeveClearanceDict(BallClearanceDict, total=False):
    """Play of a pin in its hole, in space: both of its ends lie in a disc, so that it may shift and tilt."""

    length: NumberLike
    """Length of the pin inside its hole."""


class ScrewClearanceDict(SleeveClearanceDict, total=False):
    """Play of a screw in its nut: along the thread's axis, and of the pin in its hole."""

    axial: NumberLike
    """How far the nut can shift on the thread to each side."""


class BallFrictionDict(TypedDict, total=False):
    """Friction of a ball in its socket, which the second body has."""

    coefficient: NumberLike
    """Friction force over normal force where the faces slide."""
    diameter: NumberLike
    """Diameter of the socket; that of the clearance if left out."""
    torque: NumberLike
    """Moment against its turning whatever the load, as of seals; in the file's units of force times length."""


class BallStiffnessDict(TypedDict, total=False):
    """Ball in its socket."""

    radial: NumberLike
    """In all directions, force per length."""


class BeltClearanceDict(TypedDict, total=False):
    """Slack of a belt or chain: how far the second pulley's rim can go to either side until a strand is taut."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary."""
    slack: NumberLike | NumbersLike
    """Travel at the rim to either side; [minus, plus] where the sides differ."""


class BoundsDict(TypedDict, total=False):
    """The lowest and the highest acceptable value; one of them where the other side does not matter."""

    low: NumberLike
    """Lowest acceptable value, not above zero."""
    high: NumberLike
    """Highest acceptable value, not below zero."""


class ChoiceDict(TypedDict, total=False):
    """One of the things that can be ordered, and its price."""

    cost: NumberLike
    """Its price, in any currency, the same everywhere in the file."""
    size: NumberLike
    """The size of the clearance in its measure, or the tolerance or error."""
    fit: str
    """Tolerance classes of ISO 286, such as H7/g6."""
    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Clearance group of a deep groove ball bearing, such as C3."""


class CircleDict(TypedDict, total=False):
    """A circle on which the output point ought to be."""

    centre: NumbersLike
    """Its centre."""
    radius: NumberLike
    """Its radius."""
    fit: bool
    """Whether it is the circle with the least largest distance; then nothing else (in the plane only)."""
    axis: NumbersLike
    """Direction of its axis (in space only)."""


class ComponentDeviationDict(TypedDict, total=False):
    """One component of a deviation: its tolerance, and its known value in a built specimen."""

    tolerance: NumberLike | ToleranceDict
    """How far it may be off."""
    deviation: NumberLike
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | LawDict
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 }, { normal
    = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class ErrorLimitsDict(TypedDict, total=False):
    """Acceptable errors of an output."""

    position: NumberLike
    """Largest acceptable position error."""
    rotation: NumberLike
    """Largest acceptable rotation error."""
    x: NumberLike | NumbersLike | BoundsDict
    """Acceptable error along the ground's x axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 }."""
    y: NumberLike | NumbersLike | BoundsDict
    """Acceptable error along the ground's y axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 }."""
    angle: NumberLike | NumbersLike | BoundsDict
    """Acceptable error of the angle: a number for both sides, [low, high], or one of them such as { high = 0.1 } (in
    the plane only)."""
    z: NumberLike | NumbersLike | BoundsDict
    """Acceptable error along the ground's z axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1 } (in space
    only)."""
    rx: NumberLike | NumbersLike | BoundsDict
    """Acceptable error about the x axis: a number for both sides, [low, high], or one of them such as { high = 0.1 }
    (in space only)."""
    ry: NumberLike | NumbersLike | BoundsDict
    """Acceptable error about the y axis: a number for both sides, [low, high], or one of them such as { high = 0.1 }
    (in space only)."""
    rz: NumberLike | NumbersLike | BoundsDict
    """Acceptable error about the z axis: a number for both sides, [low, high], or one of them such as { high = 0.1 }
    (in space only)."""


class FlankClearanceDict(TypedDict, total=False):
    """Backlash of teeth: how far one flank can go until the other touches."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary."""
    backlash: NumberLike
    """Backlash from flank to flank, an arc at the pitch circle (of crossed gears the second one)."""
    backlash_angle: NumberLike
    """Instead: angle that the second body turns from flank to flank while the first is held."""


class FlankStiffnessDict(TypedDict, total=False):
    """Teeth in mesh, with what bends behind them."""

    flank: NumberLike
    """Along the pitch circle, force per length."""


GridRangeDict = TypedDict(
    "GridRangeDict", {"values": "NumbersLike", "from": "NumberLike", "to": "NumberLike", "count": "Count"}, total=False
)


class GuideStiffnessDict(TypedDict, total=False):
    """Bearing of a slider in its guide, in space."""

    normal: NumberLike
    """Across the guide, force per length; in space: across axis and `side`, force per length."""
    tilt: NumberLike | NumbersLike
    """Against tilting, moment per angle, in the file's unit of angles; in space: against tilting, moment per angle, in
    the file's unit of angles; two of them for tilting about `side` and about the direction across."""
    side: NumberLike
    """Along `side`, force per length (in the plane only)."""
    roll: NumberLike
    """About the axis, moment per angle, in the file's unit of angles (in the plane only)."""


HoleDict = TypedDict(
    "HoleDict",
    {
        "tolerance": "NumberLike | ToleranceDict",
        "plus": "NumberLike",
        "minus": "NumberLike",
        "class": "str",
        "deviation": "NumberLike",
        "law": "Literal['normal', 'uniform', 'triangular'] | LawDict",
        "diameter": "NumberLike",
    },
    total=False,
)


class JournalFrictionDict(TypedDict, total=False):
    """Friction of a pin that turns in its hole, in space: at both of its ends, and at its shoulders."""

    coefficient: NumberLike
    """Friction force over normal force where the faces slide."""
    diameter: NumberLike
    """Diameter of the hole; that of the clearance if left out."""
    torque: NumberLike
    """Moment against its turning whatever the load, as of seals; in the file's units of force times length."""
    length: NumberLike
    """Length of the pin in its hole; that of the clearance if left out."""
    collar: NumberLike | NumbersLike
    """Inner and outer diameter of its shoulders; left out, a load along the pin does not rub."""


class LawDict(TypedDict, total=False):
    """A law with numbers of its own; exactly one of its kinds."""

    normal: ProcessDict
    """A process with its sigma, shift and drift."""
    triangular: NumberLike
    """The likeliest value, as the tolerance is given."""
    beta: NumbersLike
    """Beta law: exponents [a, b] at the lower and at the upper limit."""
    pert: NumberLike
    """PERT: the likeliest value, as the tolerance is given."""
    measured: NumbersLike
    """Measured values, two or more."""
    csv: str
    """File in the same folder with measured values."""
    column: str
    """With csv: the name of the column in its first row."""
    nominal: NumberLike
    """With measured values: what is subtracted from them, if they are whole sizes."""


class LineDict(TypedDict, total=False):
    """A straight line on which the output point ought to be."""

    fit: bool
    """Whether it is the line with the least largest distance; then nothing else."""
    through: NumbersLike
    """A point of the line."""
    to: NumbersLike
    """Another point of it."""
    direction: NumberLike | NumbersLike
    """Instead: its direction, [ux, uy] or an angle; in space: instead: its direction [ux, uy, uz]."""


class LockedAngleDict(TypedDict, total=False):
    """The angle at which two bodies are locked together, as an error around the mounting angle."""

    tolerance: NumberLike | ToleranceDict
    """How far it may be off."""
    deviation: NumberLike
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | LawDict
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 }, { normal
    = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class MountStiffnessDict(TypedDict, total=False):
    """What locks two bodies together, in space."""

    along: NumberLike
    """Along the joint's axis, force per length."""
    normal: NumberLike
    """Across the joint's axis, force per length; in space: across axis and `side`, force per length."""
    tilt: NumberLike | NumbersLike
    """Against turning, moment per angle, in the file's unit of angles; in space: against tilting, moment per angle, in
    the file's unit of angles; two of them for tilting about `side` and about the direction across."""
    side: NumberLike
    """Along `side`, force per length (in the plane only)."""
    roll: NumberLike
    """About the axis, moment per angle, in the file's unit of angles (in the plane only)."""


PinDict = TypedDict(
    "PinDict",
    {
        "tolerance": "NumberLike | ToleranceDict",
        "plus": "NumberLike",
        "minus": "NumberLike",
        "class": "str",
        "deviation": "NumberLike",
        "law": "Literal['normal', 'uniform', 'triangular'] | LawDict",
        "diameter": "NumberLike",
    },
    total=False,
)


class PlacementDict(TypedDict, total=False):
    """Where a joint sits on one of its bodies, in body axes."""

    at: NumbersLike
    """The point [x, y] in body axes; in space: the point [x, y, z] in body axes."""
    axis: NumberLike | NumbersLike
    """Direction of the joint: [ux, uy] or an angle; in space: direction of the joint [ux, uy, uz]."""
    side: NumbersLike
    """Direction across the axis [ux, uy, uz]: where a guide is wide, where an angle is zero (in space only)."""


class PlateStiffnessDict(TypedDict, total=False):
    """Plate between its planes."""

    along: NumberLike
    """Along the axis, the normal of the planes, force per length."""
    tilt: NumberLike | NumbersLike
    """Against tilting, moment per angle, in the file's unit of angles; two of them for tilting about `side` and about
    the direction across."""


class PlateWearDict(TypedDict, total=False):
    """Wear of a plate between two planes."""

    rate: NumberLike
    """Specific wear rate of both faces together, in mm3/(N m) whatever the units of the file."""
    growth: NumberLike
    """Instead: growth per cycle that was measured, in the measure in which the clearance is given."""


class BallWearDict(PlateWearDict, total=False):
    """Wear of a ball and its socket."""

    diameter: NumberLike
    """Diameter of the ball; that of the clearance if left out."""


class BlockWearDict(PlateWearDict, total=False):
    """Wear of a block that slides in a slot and carries the pin."""

    length: NumberLike
    """Length of the block along the slot."""
    width: NumberLike
    """Width of the faces that slide, across the plane."""


class GuideWearDict(PlateWearDict, total=False):
    """Wear of a slider of rectangular section in its guide."""

    width: NumberLike
    """Width of the faces that slide, across the plane (in the plane only)."""


class SleeveWearDict(PlateWearDict, total=False):
    """Wear of a pin that turns and slides in its hole."""

    rate_hole: NumberLike
    """Instead of rate, with rate_pin: specific wear rate of the hole, on whose surface the load may wander."""
    rate_pin: NumberLike
    """Instead of rate, with rate_hole: specific wear rate of the pin, on whose surface the load may wander."""
    diameter: NumberLike
    """Diameter of the pin, for pressure and sliding distance; that of the clearance if left out."""


class JournalWearDict(SleeveWearDict, total=False):
    """Wear of a pin and its hole, in space."""

    length: NumberLike
    """Length of the pin inside its hole (in the plane only)."""


class PositionDict(TypedDict, total=False):
    """How far a joint is from its place on a body."""

    law: Literal["uniform", "boundary", "normal"]
    """How it scatters in its zone: normal (three sigma to the boundary, default), uniform, boundary."""
    x: NumberLike | ComponentDeviationDict
    """Deviation along the x axis of the body."""
    y: NumberLike | ComponentDeviationDict
    """Deviation along the y axis of the body."""
    diameter: NumberLike
    """Diameter of the zone in which it lies (ISO 1101): it is off by up to half of it; a cylinder about its axis."""
    deviation: NumbersLike
    """With diameter: the known deviation, [side, normal]; of a ball [x, y, z] in body axes."""
    z: NumberLike | ComponentDeviationDict
    """Deviation along the z axis of the body."""
    length: NumberLike
    """With diameter: length of the cylinder, in which the axis shifts and tilts."""
    spherical: bool
    """With diameter: a ball instead of a cylinder."""


class ProcessDict(TypedDict, total=False):
    """What a process makes: normal about a mean that may be shifted and may drift."""

    sigma: NumberLike
    """Standard deviation; a third of the way from the middle to the limits if left out."""
    cpk: NumberLike
    """Instead of sigma: (distance from the mean to the nearer limit) / (3 sigma)."""
    shift: NumberLike
    """How far the mean is above the middle of the limits, in sigmas."""
    drift: NumberLike
    """How far the mean drifts to either side, evenly, in sigmas."""
    sorted: bool
    """Whether what is beyond the limits is sorted out."""


class RatioErrorDict(TypedDict, total=False):
    """Transmission error: how far the second body is from where the first one should bring it, as a length."""

    tolerance: NumberLike | ToleranceDict
    """How far it may be off."""
    deviation: NumberLike
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | LawDict
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 }, { normal
    = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class RunOutDict(TypedDict, total=False):
    """Eccentricity of a wheel: how far its centre is from where it is drawn, in any direction."""

    tolerance: NumberLike
    """Largest eccentricity, a radius."""
    deviation: NumbersLike
    """The known eccentricity of one built specimen, in body axes."""
    law: Literal["uniform", "boundary", "normal"]
    """How it scatters: normal (three sigma to the radius), uniform in the disc, or boundary."""


class SleeveStiffnessDict(TypedDict, total=False):
    """Bearing of a pin that slides, in space."""

    radial: NumberLike
    """Across the pin, force per length."""
    tilt: NumberLike | NumbersLike
    """Against tilting, moment per angle, in the file's unit of angles; two of them for tilting about `side` and about
    the direction across."""


class JournalStiffnessDict(SleeveStiffnessDict, total=False):
    """Bearing of a pin, in space."""

    axial: NumberLike
    """Along the pin, force per length."""


SliderDict = TypedDict(
    "SliderDict",
    {
        "tolerance": "NumberLike | ToleranceDict",
        "plus": "NumberLike",
        "minus": "NumberLike",
        "class": "str",
        "deviation": "NumberLike",
        "law": "Literal['normal', 'uniform', 'triangular'] | LawDict",
        "width": "NumberLike",
    },
    total=False,
)


class SlotClearanceDict(TypedDict, total=False):
    """Play of a pin across its slot."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the boundary."""
    tolerance: NumberLike | ToleranceDict
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | LawDict
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default), uniform or
    triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv',
    column = 'd' }."""
    gap: NumberLike
    """Gap on each side."""
    nominal: NumberLike
    """With fit: nominal width of the slot."""
    slot: SlotDict
    """Instead, with slider: width and limits of the slot."""
    slider: SliderDict
    """Width and limits of what is in the slot."""


class GuideClearanceDict(SlotClearanceDict, total=False):
    """Play of a slider of rectangular section in its guide: it may shift, tilt over its length, and roll."""

    length: NumberLike
    """Length of the slider inside its guide."""
    width: NumberLike
    """Size of its section along `side` (in the plane only)."""
    height: NumberLike
    """Size of its section across axis and `side`; as its width if left out (in the plane only)."""


class PlateClearanceDict(SlotClearanceDict, total=False):
    """Play of a plate between two planes: it may rise, and tilt over its size."""

    size: NumbersLike
    """Size of the plate [along `side`, across it]."""


SlotDict = TypedDict(
    "SlotDict",
    {
        "tolerance": "NumberLike | ToleranceDict",
        "plus": "NumberLike",
        "minus": "NumberLike",
        "class": "str",
        "deviation": "NumberLike",
        "law": "Literal['normal', 'uniform', 'triangular'] | LawDict",
        "width": "NumberLike",
    },
    total=False,
)


class SlotFrictionDict(TypedDict, total=False):
    """Friction along a slot, of a block that slides in it and carries the pin."""

    coefficient: NumberLike
    """Friction force over normal force where the faces slide."""
    force: NumberLike
    """Force against its sliding whatever the load, as of seals and wipers."""


class GuideFrictionDict(SlotFrictionDict, total=False):
    """Friction of a slider of rectangular section in its guide."""

    length: NumberLike
    """Length of the slider in its guide; that of the clearance if left out."""
    height: NumberLike
    """From face to face of the slider, across its axis; left out, friction acts in its axis; in space: size of its
    section across; that of the clearance, or its width."""
    width: NumberLike
    """Size of its section along `side`; that of the clearance if left out (in the plane only)."""


class SlotStiffnessDict(TypedDict, total=False):
    """Flank of a slot: how hard it is across the slot."""

    normal: NumberLike
    """Across the slot, force per length."""


class StrandStiffnessDict(TypedDict, total=False):
    """Belt or chain between its pulleys."""

    strand: NumberLike
    """At the rim, along the strand that pulls, force per length."""


class TargetDict(TypedDict, total=False):
    """What the output ought to do ideally: one of points, line, circle, function, dwell."""

    points: RowsLike
    """Positions [x, y] of the output point; in space: positions [x, y, z] of the output point."""
    timed: bool
    """Of points: whether each belongs to the configuration of its number; if not, the nearest point of the polyline
    through them counts."""
    line: LineDict
    """A straight line."""
    circle: CircleDict
    """A circle."""
    function: TargetFunctionDict
    """A function of the drives."""
    dwell: TargetDwellDict
    """A coordinate that stays as it is."""
    tolerance: NumberLike
    """Largest acceptable structural error."""


TargetDwellDict = TypedDict(
    "TargetDwellDict",
    {"of": "str", "value": "NumberLike", "drive": "str", "from": "NumberLike", "to": "NumberLike"},
    total=False,
)


class TargetFunctionDict(TypedDict, total=False):
    """A coordinate that ought to be a function of the drives, as that of Ackermann steering."""

    of: str
    """Component of the output's pose, such as x, or a joint, whose coordinate is meant."""
    value: NumberLike
    """What it ought to be: an expression in the names of the drives and the variables."""
    drive: str
    """Of a table: the drive; may be left out of one drive."""
    at: NumbersLike
    """Instead of value: values of the drive, rising; outside of them nothing is asked."""
    values: NumbersLike
    """With at: what it ought to be there; between them a natural cubic spline."""


class TemperatureDict(TypedDict, total=False):
    """How far the temperature is from the one at which the lengths of the file hold, in kelvin."""

    tolerance: NumberLike | ToleranceDict
    """How far it may be off."""
    deviation: NumberLike
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | LawDict
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01 }, { normal
    = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class ThreadFrictionDict(TypedDict, total=False):
    """Friction of a screw in its nut."""

    coefficient: NumberLike
    """Friction force over normal force where the faces slide."""
    mean_diameter: NumberLike
    """Mean diameter of the flanks: between crest and root."""
    flank_angle: NumberLike
    """Angle of the flank from a plane across the axis: 15 degrees of a trapezoidal thread of 30."""
    torque: NumberLike
    """Moment against its turning whatever the load, as of seals; in the file's units of force times length."""


class ToleranceDict(TypedDict, total=False):
    """How far a value may be off: two bounds, or a standard deviation."""

    plus: NumberLike
    """How far above."""
    minus: NumberLike
    """How far below, as a positive number."""
    sigma: NumberLike
    """Standard deviation, a third of the bounds."""


class ToothFrictionDict(TypedDict, total=False):
    """Friction of teeth that slide along each other where the pitch circles touch, as those of worms do."""

    coefficient: NumberLike
    """Friction force over normal force where the faces slide."""


class UnitsDict(TypedDict, total=False):
    """Units of every number in the file."""

    length: Literal["mm", "cm", "m", "um", "in"]
    """Unit of lengths."""
    angle: Literal["deg", "rad"]
    """Unit of angles."""
    force: Literal["N", "kN", "lbf"]
    """Unit of forces; moments are in force times length."""
    turning_speed: Literal["1/min", "1/s", "deg/s", "rad/s"]
    """Unit of the speeds of drives that turn: 1/min are revolutions per minute; the angle per second if left out."""


VariationDict = TypedDict(
    "VariationDict",
    {"from": "NumberLike", "to": "NumberLike", "step": "NumberLike", "values": "NumbersLike"},
    total=False,
)
