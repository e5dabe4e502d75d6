"""What joints of FreeCAD mean that are no joints by themselves: joints in series with massless bodies between them.

With z the axis of a side, o its origin, and a number of what is locked between two bodies:

| constraint | locks | here |
|---|---|---|
| axes parallel | 2 | a plate on a plane across z1, and a guide along it |
| axes at an angle | 1 | the same, and a pin along z2 |
| distance of points | 1 | a rod between two balls |
| point at a distance from a line | 1 | a rod between a sleeve on the line and a ball |
| lines, parallel and at a distance | 3 | a rod between a pin and a sleeve |
| plane at a distance from a plane | 3 | a plate |
| point at a distance from a plane | 1 | two guides across each other, and a ball |
| line at a distance from a plane | 2 | a plate with a pin along the line |

Which of them a distance is follows from what its sides are: a circle or a cylinder is its axis, a sphere its centre.
Where something at a distance may lie on two sides, it is where it is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from .rotations import across
from .skeleton import Attachment, Joint, Vector

#: metres that are no distance
NONE = 1e-10
#: how FreeCAD means a distance by the elements that its sides name; for all others both are planes
FORMS = {
    **dict.fromkeys([("point", "point"), ("sphere", "sphere"), ("sphere", "point")], "points"),
    **dict.fromkeys(
        [("line", "point"), ("cylinder", "point"), ("cylinder", "sphere"), ("torus", "sphere")], "line and point"
    ),
    **dict.fromkeys(
        [("line", "line"), ("line", "circle"), ("circle", "circle"), ("cylinder", "cylinder"), ("cylinder", "torus")],
        "lines",
    ),
    **dict.fromkeys(
        [("plane", "point"), ("plane", "sphere"), ("circle", "point"), ("curve", "point")], "plane and point"
    ),
    **dict.fromkeys([("plane", "line"), ("plane", "cylinder")], "plane and line"),
}
#: the smaller of two wheels has so many teeth at least, where only their ratio is known
TEETH, MOST_PARTS = 20, 1000


class Chain:
    """Joints in series from one body to another.

    Parameters
    ----------
    name : str
        Of the constraint; its joints are called ``NAME``, ``NAME-2``, and so on.
    one, other : str
        The bodies.
    added : callable
        Makes a body of a name, and says what it is called.
    """

    def __init__(self, name: str, one: str, other: str, added: Callable[[str], str]) -> None:
        self.name, self.here, self.other, self.added = name, one, other, added
        self.joints: list[Joint] = []

    def then(self, kind: str, at: Vector, axis: Vector | None = None) -> Chain:
        """A joint to a further body, closed as it is drawn."""
        number = len(self.joints) + 1
        body = self.added(f"{self.name}-{number}")
        self.joints.append(Joint(self._called(number), kind, (self.here, body), Attachment(at, axis)))
        self.here = body
        return self

    def last(
        self, kind: str, at: Vector, second: Vector, axis: Vector | None = None, own: Vector | None = None
    ) -> list[Joint]:
        """All of them, with the joint to the last body, whose side may be where it is not drawn to be."""
        place = Attachment(second, None if axis is None else axis if own is None else own)
        travel = 0.0 if axis is None else float(axis @ (second - at))
        self.joints.append(
            Joint(
                self._called(len(self.joints) + 1),
                kind,
                (self.here, self.other),
                Attachment(at, axis),
                place,
                coordinate=travel if kind in ("prismatic", "cylindrical") else 0.0,
            )
        )
        return self.joints

    def _called(self, number: int) -> str:
        return self.name if number == 1 else f"{self.name}-{number}"


def at_an_angle(chain: Chain, one: tuple[Vector, Vector], other: tuple[Vector, Vector], angle: float) -> list[Joint]:
    """Axes at an angle, each given by its point and its direction."""
    (_, z1), (o2, z2) = one, other
    cosine = math.cos(angle)
    if abs(cosine) >= 1.0 - 1e-12:
        own = math.copysign(1.0, float(z1 @ z2)) * z2
        return chain.then("planar", o2, z1).last("prismatic", o2, o2, z1, own)
    aside = z2 - z1 * (z1 @ z2)
    length = float(np.linalg.norm(aside))
    aside = across(z1) if length < NONE else aside / length
    # The other way round is the same angle between two lines.
    cosine = math.copysign(cosine, float(z1 @ z2)) if abs(cosine) > NONE else 0.0
    axis = cosine * z1 + math.sqrt(1.0 - cosine**2) * aside
    return chain.then("planar", o2, z1).then("prismatic", o2, z1).last("revolute", o2, o2, axis, z2)


def at_a_distance(
    chain: Chain, form: str, one: tuple[Vector, Vector], other: tuple[Vector, Vector], distance: float
) -> list[Joint]:
    """Two things at a distance.

    Parameters
    ----------
    form : str
        One of `FORMS`, or "planes".
    one, other : tuple of ndarray
        Point and direction of each side, in the drawing.
    distance : float
        Between points, axes and planes.
    """
    (o1, z1), (o2, z2) = one, other
    own = math.copysign(1.0, float(z1 @ z2)) * z2
    if form == "points":
        if distance < NONE:
            return chain.last("spherical", o1, o2)
        away = _unit(o2 - o1, across(z1))
        return chain.then("spherical", o1).last("spherical", o1 + distance * away, o2)
    if form == "line and point":
        foot = o1 + z1 * (z1 @ (o2 - o1))
        if distance < NONE:
            return chain.then("prismatic", foot, z1).last("spherical", foot, o2)
        away = _unit(o2 - foot, across(z1))
        return chain.then("cylindrical", foot, z1).last("spherical", foot + distance * away, o2)
    if form == "lines":
        if distance < NONE:
            return chain.last("cylindrical", o1, o2, z1, own)
        away = o2 - o1
        away = _unit(away - z1 * (z1 @ away), across(z1))
        return chain.then("revolute", o1, z1).last("cylindrical", o1 + distance * away, o2, z1, own)
    # At a distance from a plane, on the side where it is drawn.
    high = float(z1 @ (o2 - o1))
    level = o2 + z1 * (math.copysign(distance, high) - high)
    if form == "plane and point":
        side = across(z1)
        first = chain.then("prismatic", level, side).then("prismatic", level, np.cross(z1, side))
        return first.last("spherical", level, o2)
    if form == "plane and line":
        flat = _unit(z2 - z1 * (z1 @ z2), across(z1))
        return chain.then("planar", level, z1).last("revolute", level, o2, flat, z2)
    return chain.last("planar", level, o2, z1, own)


def form_of(first: str, second: str) -> tuple[str, bool]:
    """How a distance of two kinds of element is meant, and whether its sides change places for it.

    Examples
    --------
    >>> form_of("point", "plane"), form_of("plane", "circle")
    (('plane and point', True), ('planes', False))
    """
    if (first, second) in FORMS:
        return FORMS[first, second], False
    if (second, first) in FORMS:
        return FORMS[second, first], True
    return "planes", False


def _unit(vector: Vector, default: Vector) -> Vector:
    length = float(np.linalg.norm(vector))
    return default if length < NONE else np.asarray(vector / length)


def teeth(first: float, second: float) -> tuple[int, int]:
    """Tooth counts in the ratio of two radii.

    Examples
    --------
    >>> teeth(20.0, 30.0)
    (20, 30)
    """
    ratio = Fraction(second / first).limit_denominator(MOST_PARTS)
    least = max(1, math.ceil(TEETH / min(ratio.numerator, ratio.denominator))) if ratio else 1
    return ratio.denominator * least, ratio.numerator * least


def rolling(pinion: Vector, axis: Vector, along: Vector, radius: float) -> Vector:
    """A point of the pitch line of a rack on which a pinion rolls so that x + radius * angle stays what it is."""
    return np.asarray(pinion - radius * np.cross(axis, along))
