"""Which hole and which pin of a drawing belong to a joint.

On the axis of the joint lie cylinders of both parts. Those with one radius on one part are one hole or one pin, also
where they are apart, as in a fork. A hole and a pin belong together if they overlap along the axis and are nearly
equal; of several pairs it is the one that the joint names, then the one that is nearest to equal, then the longest.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from .brep import ShapeElement
from .skeleton import Frame, PinAndHole, Vector

#: how far cylinders may be off the axis of a joint: m, and as the sine of an angle
OFF, TILT = 1e-6, 1e-5
#: a part of the diameter by which a hole and its pin differ less
NEAR = 0.1
#: metres by which diameters differ that are drawn alike
EQUAL = 1e-9


@dataclass(frozen=True)
class Bore:
    """A hole or a pin on the axis of a joint."""

    radius: float
    is_hole: bool
    #: `low`, `high`: from where to where along the axis, m
    low: float
    high: float
    #: whether the joint names an element of this radius
    is_named: bool


def bores(elements: Iterable[ShapeElement], owner: Frame, axis: tuple[Vector, Vector], named: float) -> list[Bore]:
    """Holes and pins of a part on the axis of a joint.

    Parameters
    ----------
    elements : iterable of ShapeElement
        Cylinders of the part, in its own axes.
    owner : Frame
        These axes in the drawing.
    axis : tuple of ndarray
        Point and direction of the joint on this part, in the drawing.
    named : float
        Radius of the element that the joint names; 0 where it has none.
    """
    point, along = axis
    found: dict[tuple[float, bool], Bore] = {}
    for element in elements:
        direction, at = owner.axes @ element.axis, owner.point(element.at) - point
        if np.linalg.norm(np.cross(direction, along)) > TILT or np.linalg.norm(np.cross(at, along)) > OFF:
            continue
        ends = [float(along @ (at + direction * end)) for end in element.extent]
        key = (round(element.radius / EQUAL), element.is_hole)
        before = found.get(key)
        ends += [] if before is None else [before.low, before.high]
        is_named = abs(element.radius - named) < EQUAL
        found[key] = Bore(element.radius, element.is_hole, min(ends), max(ends), is_named)
    return list(found.values())


def pair(first: Iterable[Bore], second: Iterable[Bore], names: tuple[str, str]) -> PinAndHole | None:
    """The hole and the pin of a joint; None where there is none.

    Parameters
    ----------
    first, second : iterable of Bore
        Of both parts, along one axis.
    names : tuple of str
        The parts.
    """
    pairs = list(_pairs(list(first), list(second)))
    if not pairs:
        return None
    one, other = max(pairs, key=_rank)
    hole, pin = (one, other) if one.is_hole else (other, one)
    of_hole, of_pin = names if one.is_hole else names[::-1]
    play = hole.radius - pin.radius
    drawn = "smaller than" if play > EQUAL else "as large as" if play > -EQUAL else "larger than"
    said = f"The pin of {of_pin} is drawn {drawn} the hole of {of_hole}."
    return PinAndHole(2.0 * hole.radius, 2.0 * pin.radius, _overlap(one, other), said)


def balls(elements: Iterable[ShapeElement], owner: Frame, at: Vector) -> Iterator[Bore]:
    """Sockets and balls of a part about the centre of a joint; arguments as of `bores`."""
    for element in elements:
        if np.linalg.norm(owner.point(element.at) - at) <= OFF:
            yield Bore(element.radius, element.is_hole, -element.radius, element.radius, is_named=True)


def _pairs(first: list[Bore], second: list[Bore]) -> Iterator[tuple[Bore, Bore]]:
    for one in first:
        for other in second:
            near = abs(one.radius - other.radius) < NEAR * max(one.radius, other.radius)
            if one.is_hole != other.is_hole and near and _overlap(one, other) > OFF:
                yield one, other


def _overlap(one: Bore, other: Bore) -> float:
    return min(one.high, other.high) - max(one.low, other.low)


def _rank(bores: tuple[Bore, Bore]) -> tuple[int, float, float]:
    one, other = bores
    return one.is_named + other.is_named, -abs(one.radius - other.radius), _overlap(one, other)
