"""Spins that move nothing of interest, by name."""

from jointplay.core.compile import Spin
from jointplay.model.mechanism import Mechanism

from .words import joined


def spin_bodies(m: Mechanism, spin: Spin) -> tuple[str, ...]:
    """The bodies of the file that turn."""
    # Names of the file have no dot: that is the cross of a universal joint.
    return tuple(name for name in dict.fromkeys(m.owners[body] for body in spin.bodies) if "." not in name)


def spin_words(m: Mechanism, spin: Spin) -> str:
    """``'rod' spins about the line from A to B``."""
    bodies = spin_bodies(m, spin)
    start, end = (m.joints[joint] for joint in spin.joints)
    spins = "spins" if len(bodies) == 1 else "spin together"
    return f"{joined([repr(body) for body in bodies])} {spins} about the line from {start} to {end}"


def held_spins(m: Mechanism) -> list[Spin]:
    """The spins that are held."""
    return [spin for spin in m.spins if spin.load is None]
