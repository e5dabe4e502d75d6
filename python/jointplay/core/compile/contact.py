"""Where two wheels touch whose axes are not parallel, and what their flanks push along.

The pitch point C is common to both pitch circles. Both wheels turn there with the speeds

    v1 = z2 a1 x (C - P1),    v2 = s z1 a2 x (C - P2)

in the ratio of their teeth, s = +-1 by how the second wheel turns. What separates them, v1 - v2, lies along the
teeth. Where the axes intersect it vanishes: C is on the line in which the pitch cones touch, along z2 a1 - s z1 a2,
and the teeth are at the spiral angle to it. The direction r through C that meets both axes is normal to the plane in
which the pitch surfaces touch. With t across r and the teeth, and the pressure angle alpha in the section across the
teeth, the normals of the flanks are

    n = cos(alpha) t +- sin(alpha) r
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.spec import ContactSpec
from jointplay.errors import InputError

#: sine of the angle between two planes that are one
FLAT = 1e-3
#: part of the tooth height that a direction of no slope has
STRAIGHT = 1e-9


@dataclass(frozen=True)
class Wheels:
    """Two wheels in axes common to both, metres and radians."""

    names: tuple[str, str]
    axes: tuple[Floats, Floats]
    #: from the first centre to the second
    apart: Floats
    radii: tuple[float, float]
    teeth: tuple[int, int]
    pressure_angle: float
    #: 1 for a right-hand first wheel, -1 for a left-hand one, None for none
    hand: int | None
    spiral_angle: float | None
    #: by how much the pitch circles may miss each other
    tolerance: float
    #: a length in the unit of the file, for messages
    length: Callable[[float], str]


@dataclass(frozen=True)
class Contact:
    """The pitch point and the flanks there."""

    wheels: Wheels
    #: from the first centre to the second
    apart: Floats
    #: from the first centre to the pitch point
    at: Floats
    #: along the teeth and across the surfaces that touch, of length one
    trace: Floats
    outward: Floats
    #: 1 where both wheels turn the same way about their axes, else -1
    sense: int

    def spec(self) -> ContactSpec:
        """As the core takes it."""
        wheels = self.wheels
        normal = np.cross(self.outward, self.trace)
        normal *= wheels.radii[1] / (normal @ np.cross(wheels.axes[1], self.at - self.apart))
        steep = math.tan(wheels.pressure_angle) * float(np.linalg.norm(normal))
        return {
            "axes": [axis.tolist() for axis in wheels.axes],
            "apart": self.apart.tolist(),
            "at": self.at.tolist(),
            "normal": normal.tolist(),
            "opening": (steep * self.outward).tolist(),
        }

    @property
    def slides(self) -> bool:
        """Whether the teeth slide along each other at the pitch point; those of axes that intersect roll there."""
        (first, second), (z1, z2) = self.wheels.axes, self.wheels.teeth
        speeds = z2 * np.cross(first, self.at), self.sense * z1 * np.cross(second, self.at - self.apart)
        return bool(np.linalg.norm(speeds[0] - speeds[1]) > FLAT * np.linalg.norm(speeds[0]))

    def ahead(self, end: int) -> float:
        """The angle on a wheel from the pitch point on to where the other axis points."""
        axis, other = self.wheels.axes[end], self.wheels.axes[1 - end]
        return turned(axis, self._levers()[end], other)

    def _levers(self) -> tuple[Floats, Floats]:
        return self.at, self.at - self.apart


def turned(axis: Floats, start: Floats, end: Floats) -> float:
    """The angle about an axis from one direction to another."""
    start = start - (start @ axis) * axis
    return math.atan2(float(axis @ np.cross(start, end)), float(start @ end))


def touching(wheels: Wheels, refuse: Callable[..., InputError]) -> Contact:
    """Where wheels touch.

    Raises
    ------
    InputError
        When they do not, or when their teeth cannot have the hand that is given.
    """
    first, second = wheels.axes
    across = np.cross(first, second)
    normal = across / np.linalg.norm(across)
    miss = abs(float(wheels.apart @ normal))
    names = " and ".join(f"'{name}'" for name in wheels.names)
    if miss <= wheels.tolerance:
        if wheels.hand is not None and wheels.spiral_angle is None:
            raise refuse(
                f"the axes of {names} intersect: teeth of a hand have a spiral_angle there; leave hand out for straight"
                " teeth"
            )
        return _intersecting(wheels, normal, refuse)
    if wheels.hand is None or wheels.spiral_angle is not None:
        problem = f"the axes of {names} do not intersect: they pass each other at {wheels.length(miss)}"
        if wheels.hand is None:
            raise refuse(f'{problem}; the teeth of wheels whose axes cross have a hand: hand = "right" or "left"')
        raise refuse(
            f"{problem}; the angle of the teeth then follows from axes, teeth and radii: leave spiral_angle out",
            ".spiral_angle",
        )
    return _crossing(wheels, normal, refuse)


def _intersecting(wheels: Wheels, normal: Floats, refuse: Callable[..., InputError]) -> Contact:
    """Pitch cones with a common apex."""
    (first, second), (r1, r2), (z1, z2) = wheels.axes, wheels.radii, wheels.teeth
    if not math.isclose(r1 * z2, r2 * z1, rel_tol=1e-6):
        raise refuse(
            f"pitch radii are in the ratio of the teeth where axes intersect: with {z1} and {z2} teeth and a radius"
            f" of {wheels.length(r1)} the other is {wheels.length(r1 * z2 / z1)}, not {wheels.length(r2)}",
            ".radii",
        )
    apart = wheels.apart - (wheels.apart @ normal) * normal
    # How far both centres are from the apex, along their axes.
    sine = float(np.cross(first, second) @ normal)
    from_apex = np.array([np.cross(second, apart) @ normal, np.cross(first, apart) @ normal]) / sine

    def lines() -> list[tuple[float, int, Floats, list[float]]]:
        found = []
        for sense in (1, -1):
            line = z2 * first - sense * z1 * second
            line /= np.linalg.norm(line)
            size = r1 / float(np.linalg.norm(np.cross(first, line)))
            for along in (size * line, -size * line):
                wanted = [float(along @ axis) for axis in wheels.axes]
                off = max(abs(w - s) for w, s in zip(wanted, from_apex, strict=True))
                found.append((off, sense, along, wanted))
        return found

    off, sense, along, wanted = min(lines(), key=lambda line: line[0])
    if off > wheels.tolerance:
        where = " and ".join(
            f"that of '{name}' is {wheels.length(abs(float(s)))} from it and belongs {wheels.length(abs(w))} from it"
            for name, s, w in zip(wheels.names, from_apex, wanted, strict=True)
        )
        raise refuse(
            "the pitch circles do not touch: teeth, radii and the point where the axes intersect say where their"
            f" centres are; {where}"
        )
    apex = -from_apex[0] * first
    at = apex + along
    line = along / np.linalg.norm(along)
    outward = np.cross(line, normal)
    around = np.cross(first, at)
    around /= np.linalg.norm(around)
    slope = (wheels.hand or 0) * (wheels.spiral_angle or 0.0) * (-1.0 if line @ first < 0.0 else 1.0)
    trace = math.cos(slope) * line + math.sin(slope) * around
    return Contact(wheels, apart, at, trace, _out_of_first(at, apart, outward), sense)


def _crossing(wheels: Wheels, normal: Floats, refuse: Callable[..., InputError]) -> Contact:
    """Pitch circles whose planes meet in a line, on which they touch."""
    (first, second), (r1, r2), apart = wheels.axes, wheels.radii, wheels.apart
    cosine = float(first @ second)
    foot = float(apart @ second) / (1.0 - cosine * cosine) * (second - cosine * first)
    beyond = float(apart @ normal)
    off_first = float(foot @ foot)
    off_second = float((foot - apart + beyond * normal) @ (foot - apart + beyond * normal))
    reach = [math.sqrt(max(r * r - off, 0.0)) for r, off in ((r1, off_first), (r2, off_second))]
    ends = [(one, beyond + two) for one in (reach[0], -reach[0]) for two in (reach[1], -reach[1])]
    one, two = min(ends, key=lambda pair: abs(pair[0] - pair[1]))
    at = foot + 0.5 * (one + two) * normal
    off = max(abs(float(np.linalg.norm(at)) - r1), abs(float(np.linalg.norm(at - apart)) - r2))
    a, b = wheels.names
    circles = (
        f"the pitch circles of '{a}' and '{b}', with radii of {wheels.length(r1)} and {wheels.length(r2)} about centres"
        f" {wheels.length(float(np.linalg.norm(apart)))} apart,"
    )
    if off > wheels.tolerance:
        raise refuse(f"{circles} do not touch: they miss each other by {wheels.length(2.0 * off)}")
    speeds = (wheels.teeth[1] * np.cross(first, at), wheels.teeth[0] * np.cross(second, at - apart))
    outward = np.cross(*speeds)
    size = float(np.linalg.norm(outward))
    if size < FLAT * float(np.linalg.norm(speeds[0]) * np.linalg.norm(speeds[1])):
        raise refuse(f"{circles} touch where no direction is across both: the axes nearly intersect")
    assert wheels.hand is not None
    fits = []
    for sense in (1, -1):
        along = speeds[0] - sense * speeds[1]
        slide = float(np.linalg.norm(along))
        if slide == 0.0:
            continue
        trace = along / slide
        slope = float(trace @ first) * float(trace @ speeds[0]) / float(np.linalg.norm(speeds[0]))
        if wheels.hand * slope > -STRAIGHT:
            fits.append((slide, sense, trace))
    if not fits:
        hands = {1: "right", -1: "left"}
        raise refuse(f"{circles} touch with {hands[-wheels.hand]}-hand teeth on '{a}' only, however they turn", ".hand")
    # Of two ways to turn the one that slides less, as gears do.
    _, sense, trace = min(fits, key=lambda fit: fit[0])
    return Contact(wheels, apart, at, trace, _out_of_first(at, apart, outward / size), sense)


def _out_of_first(at: Floats, apart: Floats, direction: Floats) -> Floats:
    """A direction that meets both axes, out of the first wheel and into the second.

    The pitch surface that is curved more is round: inside a ring it is that of the smaller wheel.
    """
    rounds = [float(lever @ direction) / float(lever @ lever) for lever in (at, at - apart)]
    outward = rounds[0] if abs(rounds[0]) >= abs(rounds[1]) else -rounds[1]
    return direction if outward > 0.0 else -direction
