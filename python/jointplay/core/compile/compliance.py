"""How far joints and pieces of members give: displacement per force, over the directions that a joint holds.

A pin's bearing has one stiffness k per direction, so that its compliance is the diagonal of 1/k. A piece of a straight
member of length L, held at one end, is a cantilever (Euler and Bernoulli). Its other end, in the plane:

    along              L / (E A)
    [normal, angle]    [[L^3 / 3EI, L^2 / 2EI], [L^2 / 2EI, L / EI]]

In space it is bent the same way towards `side` and towards `normal`, the direction across both, and it is twisted by
L / (G J). Bending towards side turns the section about normal, bending towards normal turns it about minus side.
"""

from collections.abc import Sequence

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.units import Units
from jointplay.file.schema import BodyTable, JointTable, SpatialBody, Stiffness

#: keys of a stiffness that are moments per angle
TURNING = ("roll", "tilt")


def compliance_of(joint: JointTable, units: Units) -> tuple[float, ...] | None:
    """Compliance of a joint of the file, SI, one row after the other; None where it is rigid."""
    given: Stiffness | None = getattr(joint, "stiffness", None)
    if given is None:
        return None
    keys = joint.held
    diagonal: list[float] = []
    for k, key in enumerate(keys):
        value = getattr(given, key)
        if isinstance(value, tuple):
            value = value[keys[:k].count(key)]
        unit = units.turning_stiffness if key in TURNING else units.stiffness
        diagonal.append(0.0 if value is None else 1.0 / (value * unit))
    return flat(np.diag(diagonal))


def axial(body: BodyTable, length: float, whole: float, units: Units) -> float:
    """Elongation per force of a piece of a member, m/N.

    Parameters
    ----------
    body : BodyTable
        The member.
    length, whole : float
        Of the piece, and of the member between its outermost joints, in metres.
    units : Units
        Units of the file.
    """
    if body.stiffness is not None:
        return length / whole / (body.stiffness * units.stiffness)
    if body.E is None or body.area is None:
        return 0.0
    return length / (body.E * body.area * units.force)


def bending(E: float | None, inertia: float | None, length: float, units: Units) -> Floats:
    """Deflection and rotation of the end of a cantilever under a force and a moment there, 2 x 2, SI."""
    if E is None or inertia is None:
        return np.zeros((2, 2))
    # Force / length^2 times length^4.
    rigidity = E * inertia * units.force * units.length**2
    cubic, square, linear = length**3 / 3.0, length**2 / 2.0, length
    return np.array([[cubic, square], [square, linear]]) / rigidity


def member(body: BodyTable, length: float, whole: float, units: Units) -> tuple[float, ...]:
    """Compliance of a piece of a member at its far end, over what a fixed joint holds there, SI, row by row."""
    stretch = axial(body, length, whole, units)
    if not isinstance(body, SpatialBody):
        assert not isinstance(body.inertia, tuple)
        matrix = np.zeros((3, 3))
        matrix[0, 0] = stretch
        matrix[1:, 1:] = bending(body.E, body.inertia, length, units)
        return flat(matrix)
    about_side, about_normal = body.inertia or (None, None)
    matrix = np.zeros((6, 6))
    matrix[0, 0] = stretch
    matrix[np.ix_((1, 5), (1, 5))] = bending(body.E, about_normal, length, units)
    turned = np.array([[1.0, -1.0], [-1.0, 1.0]])
    matrix[np.ix_((2, 4), (2, 4))] = turned * bending(body.E, about_side, length, units)
    if body.G is not None and body.torsion is not None:
        matrix[3, 3] = length / (body.G * body.torsion * units.force * units.length**2)
    return flat(matrix)


def flat(matrix: Floats | Sequence[Sequence[float]]) -> tuple[float, ...]:
    """A matrix, one row after the other."""
    return tuple(float(value) for value in np.asarray(matrix).reshape(-1))
