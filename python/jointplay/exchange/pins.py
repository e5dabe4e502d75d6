"""Pins of planar drawings, also of several bodies, what they connect, and what else drawings have in common."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from jointplay.errors import InputError, listed

from .skeleton import Attachment, Frame, Joint, Vector

#: the normal of the plane
Z = np.array([0.0, 0.0, 1.0])
#: the point that is the output
OUTPUT = "output"


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
    """Refuse links that no joints connect with the ground."""
    inside = connected(ground, joints)
    apart = [name for name in links if name not in inside]
    if apart:
        raise InputError(f"nothing joins these links with the ground: {listed(apart)}", key=key)


def choose_output(
    frames: dict[str, tuple[str, Frame]], traced: Sequence[str], joints: Iterable[Joint]
) -> Iterator[str]:
    """Call a traced point the output where none is called so, and say which one."""
    if OUTPUT in frames or not frames:
        return
    # A point that only one link has is there to be traced.
    pinned = {joint.name for joint in joints}
    chosen = ([name for name in traced if name not in pinned] or traced or [*frames])[-1]
    frames[OUTPUT] = frames[chosen]
    yield f"The output is {chosen}; --output-point names another joint."


def said_of_speed(turning: Iterable[str], speed: object, is_clockwise: bool) -> str:
    """What is said of inputs that turn, in rpm."""
    way = "clockwise, against the values of its drive" if is_clockwise else "counter-clockwise"
    return f"{listed(turning)} turns at {speed} rpm {way}; the speed is left out."
