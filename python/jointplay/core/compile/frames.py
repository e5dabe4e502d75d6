"""Points and directions as three numbers, in the plane as in space."""

import math
from collections.abc import Sequence

Vector3 = tuple[float, float, float]
#: axis and side of a joint on a body
AxisAndSide = tuple[Vector3, Vector3]

X: Vector3 = (1.0, 0.0, 0.0)
Y: Vector3 = (0.0, 1.0, 0.0)
Z: Vector3 = (0.0, 0.0, 1.0)
#: sizes of components that differ by less are the same, so that rounding does not choose between two axes
TIE = 1e-9
#: a side whose part across the axis is shorter, of length one as a whole, lies along the axis
PARALLEL = 1e-6


def vector(numbers: Sequence[float], factor: float = 1.0) -> Vector3:
    """Up to three numbers as three, times a factor."""
    x, y, z = (*numbers, 0.0, 0.0, 0.0)[:3]
    return (x * factor, y * factor, z * factor)


def unit(direction: Sequence[float]) -> Vector3:
    """The direction with length one."""
    return vector(direction, 1.0 / math.hypot(*direction))


def dot(a: Vector3, b: Vector3) -> float:
    """Scalar product."""
    return sum(p * q for p, q in zip(a, b, strict=True))


def across(direction: Vector3, axis: Vector3) -> Vector3 | None:
    """The direction's part across an axis of length one, with length one; None where it has none.

    Examples
    --------
    >>> across((1.0, 0.0, 5.0), Z)
    (1.0, 0.0, 0.0)
    """
    direction = unit(direction)
    along = dot(direction, axis)
    x, y, z = (d - along * a for d, a in zip(direction, axis, strict=True))
    return None if math.hypot(x, y, z) < PARALLEL else unit((x, y, z))


def default_side(axis: Vector3) -> Vector3:
    """The coordinate axis that is least aligned with an axis, the first of equals, across it.

    Examples
    --------
    >>> default_side(Z)
    (1.0, 0.0, 0.0)
    """
    sizes = [abs(component) for component in axis]
    least = next(k for k, size in enumerate(sizes) if size <= min(sizes) + TIE)
    side = across((X, Y, Z)[least], axis)
    assert side is not None  # at least one coordinate axis is more than 54 degrees away from any direction
    return side


def cross_axes(first: Vector3, second: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Axes of the cross of a universal joint, x along its first pin and y along its second one."""
    y = across(second, first) or default_side(first)
    return first, y, cross_product(first, y)


def cross_product(a: Vector3, b: Vector3) -> Vector3:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def in_axes(direction: Vector3, axes: tuple[Vector3, Vector3, Vector3]) -> Vector3:
    """Components of a direction along three axes."""
    x, y, z = (dot(direction, axis) for axis in axes)
    return (x, y, z)
