"""Where joints are, and how their bodies move there."""

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.answers import EquilibriumTerms
from jointplay.model.mechanism import Mechanism


def origin(m: Mechanism, placed: Floats, body: int) -> Floats:
    """Where the core has the origin of a body."""
    if body < 0:
        return np.zeros((len(placed), 3))
    return poses.place(placed[:, body], m.core.origins[body])


def ends(m: Mechanism, joint: int, at: EquilibriumTerms, placed: Floats) -> tuple[Floats, Floats]:
    """The points of a joint on its first and on its second body."""
    first, second = (
        origin(m, placed, m.points[point].body) + at["levers"][:, joint, end]
        for end, point in enumerate(m.joint_points[joint])
    )
    return first, second


def motions(m: Mechanism, joint: int, at: EquilibriumTerms, velocity: Floats) -> list[tuple[Floats, Floats]]:
    """Velocities of these points, and the angular velocities of the bodies.

    Parameters
    ----------
    velocity : ndarray
        Of the core's origins, then angular, shape (configuration, body, 6).
    """
    found = []
    for end, point in enumerate(m.joint_points[joint]):
        body = m.points[point].body
        twist = velocity[:, body] if body >= 0 else np.zeros((len(velocity), 6))
        found.append((twist[:, :3] + np.cross(twist[:, 3:], at["levers"][:, joint, end]), twist[:, 3:]))
    return found
