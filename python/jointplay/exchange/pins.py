"""Pins of planar drawings, also of several bodies, and what they connect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from jointplay.errors import InputError, listed

from .skeleton import Attachment, Joint, Vector

#: the normal of the plane
Z = np.array([0.0, 0.0, 1.0])


def pins(name: str, bodies: Sequence[str], at: Vector, is_driven: bool = False) -> Iterator[Joint]:
    """A pin: the first body carries it, every other one turns on it."""
    for number, body in enumerate(bodies[1:], 1):
        own = name if number == 1 else f"{name}_{number}"
        yield Joint(own, "revolute", (bodies[0], body), Attachment(at, Z), is_driven=is_driven and number == 1)


def connected(ground: str, joints: Iterable[Joint]) -> set[str]:
    """The bodies that joints connect with the ground."""
    pairs = [joint.bodies for joint in joints]
    found, size = {ground}, 0
    while len(found) > size:
        size = len(found)
        for pair in pairs:
            if found & {*pair}:
                found |= {*pair}
    return found


def require_connected(links: Iterable[str], ground: str, joints: Iterable[Joint], key: str = "") -> None:
    """Refuse links that no joints connect with the ground.

    Raises
    ------
    InputError
    """
    inside = connected(ground, joints)
    apart = [name for name in links if name not in inside]
    if apart:
        raise InputError(f"nothing joins these links with the ground: {listed(apart)}", key=key)
