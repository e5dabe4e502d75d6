"""The steps of an assembly: after each of them a part, how it can move, and what the step was.

The kind of a step follows from how it changes mobility and redundancy of what is assembled, and from how many links it
adds, where members that are locked to one another are one link:

    kind                  mobility    redundancy    links
    fixed                    same          same         1
    connected                same          same       2..
    closing                  less          same
    redundant             not more          more
    loose                    more          same
    redundant and loose      more          more
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism

from .freedom import Freedom, examine
from .part import GROUND, Part, cut, require_unturned


@dataclass(frozen=True, eq=False)
class Step:
    """One step of an assembly."""

    #: the bodies that it adds
    members: tuple[str, ...]
    #: the same, those that are locked to one another together
    links: tuple[tuple[str, ...], ...]
    #: what is assembled after it
    part: Part
    #: how that can move
    freedom: Freedom
    kind: str


def steps(m: Mechanism, nominal: Floats) -> Iterator[Step]:
    """The steps of a mechanism's own order of assembly.

    Parameters
    ----------
    nominal : ndarray
        Nominal poses of all bodies, SI, ground axes; shape (body, pose).
    """
    (base, every), there = order(m), set[int]()
    require_unturned(m, nominal, base)
    mobility = redundancy = 0
    for added in every:
        there |= set(added)
        part = cut(m, nominal, base, there)
        freedom = examine(part)
        links = locked_together(part, added)
        kind = kind_of(freedom.mobility - mobility, freedom.redundancy - redundancy, len(links))
        names = tuple(tuple(name(m, body) for body in link) for link in links)
        yield Step(tuple(name(m, body) for body in added), names, part, freedom, kind)
        mobility, redundancy = freedom.mobility, freedom.redundancy


def order(m: Mechanism) -> tuple[int, tuple[tuple[int, ...], ...]]:
    """The base and the bodies that each step adds.

    Raises
    ------
    InputError
        When the file does not say.
    """
    if m.assembly is None:
        problem = 'the order of assembly is missing: [assembly] with base = "ground" and steps = [["..."], ...]'
        raise InputError(problem, file=m.file, key="assembly")
    return m.assembly.base, m.assembly.steps


def name(m: Mechanism, body: int) -> str:
    """Name of a body by its index."""
    return "ground" if body == GROUND else m.bodies[body]


def index(m: Mechanism, member: str) -> int:
    """Index of a body by its name."""
    return GROUND if member == "ground" else m.bodies.index(member)


def kind_of(mobility: int, redundancy: int, links: int) -> str:
    """What a step is that changes mobility and redundancy by so much and adds so many links.

    Examples
    --------
    >>> kind_of(0, 0, 2), kind_of(0, 1, 1), kind_of(-1, 0, 1)
    ('connected', 'redundant', 'closing')
    """
    if redundancy:
        return "redundant and loose" if mobility > 0 else "redundant"
    if mobility:
        return "loose" if mobility > 0 else "closing"
    return "fixed" if links == 1 else "connected"


def locked_together(part: Part, bodies: Iterable[int]) -> list[tuple[int, ...]]:
    """The bodies in groups that no joint lets move in themselves: joints are fixed, or driven in all their freedom."""
    groups = [[body] for body in bodies]
    for a, b in locked_joints(part):
        ends = [group for group in groups if a in group or b in group]
        if len(ends) == 2:
            ends[0].extend(ends[1])
            groups.remove(ends[1])
    return [tuple(group) for group in groups]


def locked_joints(part: Part) -> list[tuple[int, int]]:
    """Pairs of bodies, by their index in the whole mechanism, that a joint locks to each other."""
    m = part.m
    held = [0] * len(part.joints)
    for joint, _ in part.core().rows:
        held[joint] += 1
    everything = len(m.components)
    return [ends(part, k) for k in range(len(part.joints)) if held[k] == everything]


def ends(part: Part, joint: int) -> tuple[int, int]:
    """The two bodies of a joint of the part, by their index in the whole mechanism."""
    own = part.spec["joints"][joint]
    first, second = (body_of(part, own[end]) for end in ("first", "second"))
    return first, second


def body_of(part: Part, point: int) -> int:
    """The body of the file on which a point of the part is, by its index in the whole mechanism."""
    body = int(part.spec["points"][point]["body"])
    own = part.base if body == GROUND else part.bodies[body]
    return own if own == GROUND else part.m.bodies.index(part.m.owners[own])
