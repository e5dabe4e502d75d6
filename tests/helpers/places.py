"""Mechanisms whose joints deviate on all of their bodies, and the same mechanisms with the numbers changed by hand."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointplay import Mechanism

Floats = NDArray[np.float64]


def deviating(m: Mechanism, share: float = 1e-4, seed: int = 0, *, links: bool = True) -> Mechanism:
    """The mechanism with deviations of every joint on each of its bodies, and of a link on each body with two joints.

    Tolerances and known deviations are random, up to a share of the mechanism's length, and of a radian.
    """
    rng = np.random.default_rng(seed)
    spatial = m.data.space == "spatial"
    length, angle = m.length / m.units.length, 1.0 / m.units.angle

    def off(size: float) -> dict[str, float]:
        return {"tolerance": share * size * rng.uniform(0.2, 1.0), "deviation": share * size * rng.uniform(-1.0, 1.0)}

    changes: dict[str, Any] = {}
    on: dict[str, list[str]] = {}
    for name, joint in m.data.joints.items():
        positions: dict[str, Any] = {}
        directions: dict[str, Any] = {}
        for k, body in enumerate(joint.names):
            on.setdefault(body, []).append(name)
            positions[body] = {c: off(length) for c in ("xyz" if spatial else "xy")}
            if k % 2:
                positions[body] = {"diameter": share * length, "deviation": [share * length * v for v in (0.3, -0.2)]}
                if spatial and not joint.has_direction(body):
                    positions[body] = {"diameter": share * length, "spherical": True}
                elif spatial and rng.uniform() < 0.5:
                    positions[body]["length"] = length
            if joint.has_direction(body):
                directions[body] = {"side": off(angle), "normal": off(angle)} if spatial else off(angle)
                if spatial and k % 2:
                    directions[body] = {"angle": share * angle, "deviation": [share * angle * v for v in (-0.2, 0.3)]}
        changes[f"joints.{name}.position"] = positions
        if directions:
            changes[f"joints.{name}.direction"] = directions
    for body, joints in on.items():
        if not links or len(joints) < 2:
            continue
        second = m.data.joints[joints[1]]
        shifts = {c: off(length) for c in ("xyz" if spatial else "xy")}
        link: dict[str, Any] = {"body": body, "between": joints[:2], **shifts}
        if spatial and second.has_direction(body):
            link |= {c: off(angle) for c in ("rx", "ry", "rz")}
        elif not spatial and second.kind != "pin_in_slot":
            link["angle"] = off(angle)
        changes[f"links.link_{body}"] = link
    return m.with_(changes)


def turned(axis: Any, about: Any) -> list[float]:
    """A direction turned by a rotation vector."""
    return [float(v) for v in Rotation.from_rotvec(about).apply(axis)]
