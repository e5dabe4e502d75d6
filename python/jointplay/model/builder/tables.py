"""The tables of a mechanism file as types: their keys, for editors and type checkers.

Written from the schema of the file by tests/helpers/signatures.py; not by hand.
"""

from __future__ import annotations

from typing import Literal, TypedDict

from .values import Count, Number, Numbers


class About(TypedDict, total=False):
    """What the copies of a pattern are turned about."""

    point: Numbers
    """The middle [x, y]; in space: a point [x, y, z] of the axis."""
    angle: Number
    """Angle from one copy to the next; a full turn divided by `count` if left out."""
    axis: Numbers
    """Direction of the axis [ux, uy, uz] (in space only)."""


class Backlash(TypedDict, total=False):
    """How far a driven coordinate can be on either side of its command until a flank stops it."""

    plus: Number
    """To its positive side."""
    minus: Number
    """To its negative side, as a positive number."""


class BallClearance(TypedDict, total=False):
    """Play of a ball in its socket: its centre lies in a ball."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""


class BallStiffness(TypedDict, total=False):
    """Ball in its socket."""

    radial: Number
    """In all directions, force per length."""


class BearingClearance(TypedDict, total=False):
    """Play of a pin in its hole and along it, or of a ball bearing, in space."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Instead: radial internal clearance of a deep groove ball bearing, group of ISO 5753-1."""
    bore: Number
    """With bearing: diameter of its bore."""
    reduction: Number | Numbers
    """With bearing: by how much mounting reduces its clearance; [least, most] where that scatters."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""
    length: Number
    """Length of the pin inside its hole."""
    axial: Number
    """How far the pin can slide to each side."""


class BeltClearance(TypedDict, total=False):
    """Slack of a belt or chain: how far the second pulley's rim can go to either side until a strand is taut."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    slack: Number | Numbers
    """Travel at the rim to either side; [minus, plus] where the sides differ."""


class Bounds(TypedDict, total=False):
    """The lowest and the highest acceptable value; one of them where the other side does not matter."""

    low: Number
    """Lowest acceptable value, not above zero."""
    high: Number
    """Highest acceptable value, not below zero."""


class Choice(TypedDict, total=False):
    """One of the things that can be ordered, and its price."""

    cost: Number
    """Its price, in any currency, the same everywhere in the file."""
    size: Number
    """The size of the clearance in its measure, or the tolerance or error."""
    fit: str
    """Tolerance classes of ISO 286, such as H7/g6."""
    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Clearance group of a deep groove ball bearing, such as C3."""


class Clearance(TypedDict, total=False):
    """Play of a joint of any kind."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""
    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Instead: radial internal clearance of a deep groove ball bearing, group of ISO 5753-1."""
    bore: Number
    """With bearing: diameter of its bore."""
    reduction: Number | Numbers
    """With bearing: by how much mounting reduces its clearance; [least, most] where that scatters."""
    length: Number
    """Length of the pin inside its hole."""
    axial: Number
    """How far the nut can shift on the thread to each side."""
    slack: Number | Numbers
    """Travel at the rim to either side; [minus, plus] where the sides differ."""
    backlash: Number
    """Backlash from flank to flank, an arc at the pitch circle (of crossed gears the second one)."""
    backlash_angle: Number
    """Instead: angle that the second body turns from flank to flank while the first is held."""
    gap: Number
    """Gap on each side."""
    nominal: Number
    """With fit: nominal width of the slot."""
    slot: Slot
    """Instead, with slider: width and limits of the slot."""
    slider: Slider
    """Width and limits of what is in the slot."""
    width: Number
    """Size of its section along `side` (in the plane only)."""
    height: Number
    """Size of its section across axis and `side`; as its width if left out (in the plane only)."""
    size: Numbers
    """Size of the plate [along `side`, across it]."""


class ComponentDeviation(TypedDict, total=False):
    """One component of a deviation: its tolerance, and its known value in a built specimen."""

    tolerance: Number | Tolerance
    """How far it may be off."""
    deviation: Number
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | Law
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01
    }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class Direction(TypedDict, total=False):
    """How far the axis of a joint is from its direction on a body."""

    tolerance: Number | Tolerance
    """How far it may be off (in the plane only)."""
    deviation: Numbers
    """With a zone: the known rotations [about side, about normal]."""
    law: Literal["uniform", "boundary", "normal"]
    """How it scatters in its zone: normal (three sigma to the boundary, default), uniform, boundary."""
    side: Number | ComponentDeviation
    """Rotation about the side."""
    normal: Number | ComponentDeviation
    """Rotation about the normal (axis x side)."""
    angle: Number
    """Largest angle to the drawn axis: a cone."""
    diameter: Number
    """Instead, with length: diameter of the cylinder in which the axis lies (ISO 1101)."""
    length: Number
    """With diameter: length of the cylinder."""


class ErrorLimits(TypedDict, total=False):
    """Acceptable errors of an output."""

    position: Number
    """Largest acceptable position error."""
    rotation: Number
    """Largest acceptable rotation error."""
    x: Number | Numbers | Bounds
    """Acceptable error along the ground's x axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1
    }."""
    y: Number | Numbers | Bounds
    """Acceptable error along the ground's y axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1
    }."""
    angle: Number | Numbers | Bounds
    """Acceptable error of the angle: a number for both sides, [low, high], or one of them such as { high =
    0.1 } (in the plane only)."""
    z: Number | Numbers | Bounds
    """Acceptable error along the ground's z axis: 0.1 for 0.1 to both sides, [-0.05, 0.1], or { high = 0.1
    } (in space only)."""
    rx: Number | Numbers | Bounds
    """Acceptable error about the x axis: a number for both sides, [low, high], or one of them such as {
    high = 0.1 } (in space only)."""
    ry: Number | Numbers | Bounds
    """Acceptable error about the y axis: a number for both sides, [low, high], or one of them such as {
    high = 0.1 } (in space only)."""
    rz: Number | Numbers | Bounds
    """Acceptable error about the z axis: a number for both sides, [low, high], or one of them such as {
    high = 0.1 } (in space only)."""


class FlankClearance(TypedDict, total=False):
    """Backlash of teeth: how far one flank can go until the other touches."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    backlash: Number
    """Backlash from flank to flank, an arc at the pitch circle (of crossed gears the second one)."""
    backlash_angle: Number
    """Instead: angle that the second body turns from flank to flank while the first is held."""


class FlankStiffness(TypedDict, total=False):
    """Teeth in mesh, with what bends behind them."""

    flank: Number
    """Along the pitch circle, force per length."""


GridRange = TypedDict(
    "GridRange", {"values": "Numbers", "from": "Number", "to": "Number", "count": "Count"}, total=False
)


class GuideClearance(TypedDict, total=False):
    """Play of a slider of rectangular section in its guide: it may shift, tilt over its length, and roll."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    gap: Number
    """Gap on each side."""
    nominal: Number
    """With fit: nominal width of the slot."""
    slot: Slot
    """Instead, with slider: width and limits of the slot."""
    slider: Slider
    """Width and limits of what is in the slot."""
    length: Number
    """Length of the slider inside its guide."""
    width: Number
    """Size of its section along `side` (in the plane only)."""
    height: Number
    """Size of its section across axis and `side`; as its width if left out (in the plane only)."""


class GuideStiffness(TypedDict, total=False):
    """Bearing of a slider in its guide, in space."""

    normal: Number
    """Across the guide, force per length; in space: across axis and `side`, force per length."""
    tilt: Number | Numbers
    """Against tilting, moment per angle, in the file's unit of angles; in space: against tilting, moment
    per angle, in the file's unit of angles; two of them for tilting about `side` and about the direction
    across."""
    side: Number
    """Along `side`, force per length (in the plane only)."""
    roll: Number
    """About the axis, moment per angle, in the file's unit of angles (in the plane only)."""


Hole = TypedDict(
    "Hole",
    {
        "tolerance": "Number | Tolerance",
        "plus": "Number",
        "minus": "Number",
        "class": "str",
        "deviation": "Number",
        "law": "Literal['normal', 'uniform', 'triangular'] | Law",
        "diameter": "Number",
    },
    total=False,
)


class JournalStiffness(TypedDict, total=False):
    """Bearing of a pin, in space."""

    radial: Number
    """Across the pin, force per length."""
    tilt: Number | Numbers
    """Against tilting, moment per angle, in the file's unit of angles; two of them for tilting about `side`
    and about the direction across."""
    axial: Number
    """Along the pin, force per length."""


class Law(TypedDict, total=False):
    """A law with numbers of its own; exactly one of its kinds."""

    normal: Process
    """A process with its sigma, shift and drift."""
    triangular: Number
    """The likeliest value, as the tolerance is given."""
    beta: Numbers
    """Beta law: exponents [a, b] at the lower and at the upper limit."""
    pert: Number
    """PERT: the likeliest value, as the tolerance is given."""
    measured: Numbers
    """Measured values, two or more."""
    csv: str
    """File in the same folder with measured values."""
    column: str
    """With csv: the name of the column in its first row."""
    nominal: Number
    """With measured values: what is subtracted from them, if they are whole sizes."""


class LockedAngle(TypedDict, total=False):
    """The angle at which two bodies are locked together, as an error around the mounting angle."""

    tolerance: Number | Tolerance
    """How far it may be off."""
    deviation: Number
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | Law
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01
    }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class MountStiffness(TypedDict, total=False):
    """What locks two bodies together, in space."""

    along: Number
    """Along the joint's axis, force per length."""
    normal: Number
    """Across the joint's axis, force per length; in space: across axis and `side`, force per length."""
    tilt: Number | Numbers
    """Against turning, moment per angle, in the file's unit of angles; in space: against tilting, moment
    per angle, in the file's unit of angles; two of them for tilting about `side` and about the direction
    across."""
    side: Number
    """Along `side`, force per length (in the plane only)."""
    roll: Number
    """About the axis, moment per angle, in the file's unit of angles (in the plane only)."""


Pin = TypedDict(
    "Pin",
    {
        "tolerance": "Number | Tolerance",
        "plus": "Number",
        "minus": "Number",
        "class": "str",
        "deviation": "Number",
        "law": "Literal['normal', 'uniform', 'triangular'] | Law",
        "diameter": "Number",
    },
    total=False,
)


class Placement(TypedDict, total=False):
    """Where a joint sits on one of its bodies, in body axes."""

    at: Numbers
    """The point [x, y] in body axes; in space: the point [x, y, z] in body axes."""
    axis: Number | Numbers
    """Direction of the joint: [ux, uy] or an angle; in space: direction of the joint [ux, uy, uz]."""
    side: Numbers
    """Direction across the axis [ux, uy, uz]: where a guide is wide, where an angle is zero (in space
    only)."""


class PlateClearance(TypedDict, total=False):
    """Play of a plate between two planes: it may rise, and tilt over its size."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    gap: Number
    """Gap on each side."""
    nominal: Number
    """With fit: nominal width of the slot."""
    slot: Slot
    """Instead, with slider: width and limits of the slot."""
    slider: Slider
    """Width and limits of what is in the slot."""
    size: Numbers
    """Size of the plate [along `side`, across it]."""


class PlateStiffness(TypedDict, total=False):
    """Plate between its planes."""

    along: Number
    """Along the axis, the normal of the planes, force per length."""
    tilt: Number | Numbers
    """Against tilting, moment per angle, in the file's unit of angles; two of them for tilting about `side`
    and about the direction across."""


class Position(TypedDict, total=False):
    """How far a joint is from its place on a body."""

    law: Literal["uniform", "boundary", "normal"]
    """How it scatters in its zone: normal (three sigma to the boundary, default), uniform, boundary."""
    x: Number | ComponentDeviation
    """Deviation along the x axis of the body."""
    y: Number | ComponentDeviation
    """Deviation along the y axis of the body."""
    diameter: Number
    """Diameter of the zone in which it lies (ISO 1101): it is off by up to half of it; a cylinder about its
    axis."""
    deviation: Numbers
    """With diameter: the known deviation, [side, normal]; of a ball [x, y, z] in body axes."""
    z: Number | ComponentDeviation
    """Deviation along the z axis of the body."""
    length: Number
    """With diameter: length of the cylinder, in which the axis shifts and tilts."""
    spherical: bool
    """With diameter: a ball instead of a cylinder."""


class Process(TypedDict, total=False):
    """What a process makes: normal about a mean that may be shifted and may drift."""

    sigma: Number
    """Standard deviation; a third of the way from the middle to the limits if left out."""
    cpk: Number
    """Instead of sigma: (distance from the mean to the nearer limit) / (3 sigma)."""
    shift: Number
    """How far the mean is above the middle of the limits, in sigmas."""
    drift: Number
    """How far the mean drifts to either side, evenly, in sigmas."""
    sorted: bool
    """Whether what is beyond the limits is sorted out."""


class RatioError(TypedDict, total=False):
    """Transmission error: how far the second body is from where the first one should bring it, as a length."""

    tolerance: Number | Tolerance
    """How far it may be off."""
    deviation: Number
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | Law
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01
    }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class RevoluteClearance(TypedDict, total=False):
    """Play of a pin in its hole: the pin's centre lies in a disc."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    bearing: Literal["C2", "CN", "N", "C3", "C4", "C5"]
    """Instead: radial internal clearance of a deep groove ball bearing, group of ISO 5753-1."""
    bore: Number
    """With bearing: diameter of its bore."""
    reduction: Number | Numbers
    """With bearing: by how much mounting reduces its clearance; [least, most] where that scatters."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""


class RunOut(TypedDict, total=False):
    """Eccentricity of a wheel: how far its centre is from where it is drawn, in any direction."""

    tolerance: Number
    """Largest eccentricity, a radius."""
    deviation: Numbers
    """The known eccentricity of one built specimen, in body axes."""
    law: Literal["uniform", "boundary", "normal"]
    """How it scatters: normal (three sigma to the radius), uniform in the disc, or boundary."""


class ScrewClearance(TypedDict, total=False):
    """Play of a screw in its nut: along the thread's axis, and of the pin in its hole."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""
    length: Number
    """Length of the pin inside its hole."""
    axial: Number
    """How far the nut can shift on the thread to each side."""


class SleeveClearance(TypedDict, total=False):
    """Play of a pin in its hole, in space: both of its ends lie in a disc, so that it may shift and tilt."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    radial: Number
    """Hole radius minus pin radius."""
    diametral: Number
    """Hole diameter minus pin diameter."""
    diameter: Number
    """Nominal diameter of hole and pin: for fit, and for what temperature makes of the clearance."""
    hole: Hole
    """Instead, with pin: diameter and limits of the hole."""
    pin: Pin
    """Diameter and limits of the pin."""
    length: Number
    """Length of the pin inside its hole."""


class SleeveStiffness(TypedDict, total=False):
    """Bearing of a pin that slides, in space."""

    radial: Number
    """Across the pin, force per length."""
    tilt: Number | Numbers
    """Against tilting, moment per angle, in the file's unit of angles; two of them for tilting about `side`
    and about the direction across."""


Slider = TypedDict(
    "Slider",
    {
        "tolerance": "Number | Tolerance",
        "plus": "Number",
        "minus": "Number",
        "class": "str",
        "deviation": "Number",
        "law": "Literal['normal', 'uniform', 'triangular'] | Law",
        "width": "Number",
    },
    total=False,
)

Slot = TypedDict(
    "Slot",
    {
        "tolerance": "Number | Tolerance",
        "plus": "Number",
        "minus": "Number",
        "class": "str",
        "deviation": "Number",
        "law": "Literal['normal', 'uniform', 'triangular'] | Law",
        "width": "Number",
    },
    total=False,
)


class SlotClearance(TypedDict, total=False):
    """Play of a pin across its slot."""

    law: Literal["uniform", "boundary", "normal"]
    """Uniform in the set, on its boundary (always in contact), or normal with three sigma to the
    boundary."""
    tolerance: Number | Tolerance
    """How far the clearance may be off, in the measure in which it is given."""
    fit: str
    """Instead: tolerance classes of ISO 286, such as H7/g6."""
    size_law: Literal["normal", "uniform", "triangular"] | Law
    """How the sizes scatter that have no law of their own: normal (three sigma at the limits, default),
    uniform or triangular; or a table such as { pert = 0.01 }, { normal = { cpk = 1.33, shift = 0.5 } } or {
    csv = 'lot.csv', column = 'd' }."""
    gap: Number
    """Gap on each side."""
    nominal: Number
    """With fit: nominal width of the slot."""
    slot: Slot
    """Instead, with slider: width and limits of the slot."""
    slider: Slider
    """Width and limits of what is in the slot."""


class SlotStiffness(TypedDict, total=False):
    """Flank of a slot: how hard it is across the slot."""

    normal: Number
    """Across the slot, force per length."""


class StrandStiffness(TypedDict, total=False):
    """Belt or chain between its pulleys."""

    strand: Number
    """At the rim, along the strand that pulls, force per length."""


class Temperature(TypedDict, total=False):
    """How far the temperature is from the one at which the lengths of the file hold, in kelvin."""

    tolerance: Number | Tolerance
    """How far it may be off."""
    deviation: Number
    """The known error of one built specimen."""
    law: Literal["normal", "uniform", "triangular"] | Law
    """Normal (three sigma at the limits, default), uniform or triangular; or a table such as { pert = 0.01
    }, { normal = { cpk = 1.33, shift = 0.5 } } or { csv = 'lot.csv', column = 'd' }."""


class Tolerance(TypedDict, total=False):
    """How far a value may be off: two bounds, or a standard deviation."""

    plus: Number
    """How far above."""
    minus: Number
    """How far below, as a positive number."""
    sigma: Number
    """Standard deviation, a third of the bounds."""


class Units(TypedDict, total=False):
    """Units of every number in the file."""

    length: Literal["mm", "cm", "m", "um", "in"]
    """Unit of lengths."""
    angle: Literal["deg", "rad"]
    """Unit of angles."""
    force: Literal["N", "kN", "lbf"]
    """Unit of forces; moments are in force times length."""
