"""What a column of readings measures: a component of a pose, a distance of two points, or what a dial shows.

    x, angle, jaw.x             a component of the pose of the output, or of one of several
    distance:A-B                from point to point
    dial:A:x, dial:A:0 0 1      how far a point is along a direction in ground axes

A point is that of an output, or a joint: its place on the first of its bodies.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, nearest, not_known, shown
from jointplay.model.mechanism import Mechanism

#: the point whose error is asked where the file has a single output
OUTPUT = "output"
DISTANCE, DIAL = "distance", "dial"
AXES = "xyz"
#: poses of points by name, shape (station, component)
Poses = Mapping[str, Floats]


@dataclass(frozen=True)
class Channel:
    """One column."""

    #: as the table has it
    name: str
    #: ``length`` or ``angle``
    kind: str
    #: the points whose poses it is made of, by name
    points: tuple[str, ...]
    #: ``component``, ``distance`` or ``dial``
    form: str
    #: which component of the pose; of a component only
    component: int = -1
    #: along which a dial measures, of length one
    direction: tuple[float, ...] = ()

    def value(self, poses: Poses, axes: int) -> Floats:
        """What is read at poses of the points; `axes` of their components are lengths."""
        first = poses[self.points[0]]
        match self.form:
            case "component":
                return first[:, self.component]
            case "dial":
                return np.asarray(first[:, :axes] @ np.array(self.direction[:axes]))
            case _:
                return np.asarray(np.linalg.norm(self._between(poses, axes), axis=1))

    def slopes(self, poses: Poses, axes: int) -> dict[str, Floats]:
        """Derivative by small displacements of each point, shape (station, component)."""
        zero = {point: np.zeros_like(poses[point]) for point in self.points}
        first = zero[self.points[0]]
        match self.form:
            case "component":
                first[:, self.component] = 1.0
            case "dial":
                first[:, :axes] = self.direction[:axes]
            case _:
                between = self._between(poses, axes)
                unit = between / np.linalg.norm(between, axis=1, keepdims=True)
                first[:, :axes], zero[self.points[1]][:, :axes] = -unit, unit
        return zero

    def _between(self, poses: Poses, axes: int) -> Floats:
        return poses[self.points[1]][:, :axes] - poses[self.points[0]][:, :axes]


def channel(m: Mechanism, name: str) -> Channel | None:
    """What a column of this name measures; None where its name says nothing that is measured.

    Raises
    ------
    InputError
        When it names a point or a direction that is none.
    """
    kind, mark, rest = name.partition(":")
    if mark and kind == DISTANCE:
        return Channel(name, "length", _pair(m, name, rest), DISTANCE)
    if mark and kind == DIAL:
        point, mark, way = rest.rpartition(":")
        if not mark:
            raise InputError("is written dial:POINT:DIRECTION, such as dial:tip:z or dial:tip:0 0 1", key=name)
        return Channel(name, "length", (_point(m, name, point),), DIAL, direction=_direction(m, name, way))
    output, _, component = name.rpartition(".")
    if component not in m.components:
        return None
    if output not in m.outputs and (m.outputs or output not in ("", OUTPUT)):
        return None
    which = m.components.index(component)
    return Channel(name, "length" if component in LENGTHS else "angle", (output or OUTPUT,), "component", which)


def names_of(m: Mechanism) -> list[str]:
    """What columns of components are called; a drive has its name for itself."""
    if m.outputs:
        return [f"{output}.{one}" for output in m.outputs for one in m.components]
    return [f"{OUTPUT}.{one}" if one in m.drives else one for one in m.components]


def unknown(m: Mechanism, name: str, more: Sequence[str]) -> str:
    """What is wrong with a name that says nothing."""
    known = [*more, *names_of(m)]
    near = nearest(name, known)
    hint = f"did you mean '{near}'? " if near else ""
    forms = "distance:POINT-POINT or dial:POINT:DIRECTION; a column whose name begins with # is left out"
    return f"'{name[:60]}' is no drive and nothing that is measured; {hint}Known: {', '.join(known[:24])}, {forms}"


def _points(m: Mechanism) -> list[str]:
    return [*(m.outputs or (OUTPUT,)), *m.joints]


def _point(m: Mechanism, name: str, point: str) -> str:
    if point not in _points(m):
        raise InputError(not_known(point, "an output or a joint", _points(m)), key=name)
    return point


def _pair(m: Mechanism, name: str, text: str) -> tuple[str, str]:
    """Two points with a dash between them; their names may have dashes."""
    known = _points(m)
    for place in (k for k, letter in enumerate(text) if letter == "-"):
        first, second = text[:place].strip(), text[place + 1 :].strip()
        if first in known and second in known and first != second:
            return first, second
    first, mark, second = text.partition("-")
    if not mark or first.strip() == second.strip():
        raise InputError("is written distance:POINT-POINT, of two different points", key=name)
    wrong = next(point.strip() for point in (first, second) if point.strip() not in known)
    raise InputError(not_known(wrong, "an output or a joint", known), key=name)


def _direction(m: Mechanism, name: str, text: str) -> tuple[float, ...]:
    axes = AXES[: sum(component in LENGTHS for component in m.components)]
    sign, letter = (-1.0, text[1:]) if text[:1] == "-" else (1.0, text.removeprefix("+"))
    if letter in tuple(axes):
        return tuple(sign * (axis == letter) for axis in axes)
    try:
        way = [float(word) for word in text.split()]
    except ValueError:
        way = []
    size = math.hypot(*way)
    if len(way) != len(axes) or not np.isfinite(size) or size == 0.0:
        problem = f"{shown(text)} is no direction: {', '.join(axes)}, with - in front, or {len(axes)} numbers"
        raise InputError(problem, key=name)
    return tuple(one / size for one in way)
