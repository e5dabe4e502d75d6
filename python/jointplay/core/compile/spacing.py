"""Whether the teeth of wheels that mesh in a loop meet, such as those of several planets between a sun and a ring.

A wheel with z teeth has in a direction b of its own axes the phase p + z b / 360 degrees, in teeth, with one p for the
whole wheel. Where two wheels mesh a tooth faces a gap:

    p1 + z1 b1 + p2 + z2 b2 = 1/2        in teeth, up to whole ones; inside a ring p1 + z1 b1 - p2 - z2 b2 = 1/2

The first meshes of a loop give every p, the last one has to agree. Planets between a sun and a ring are therefore apart
by multiples of 360 degrees / (z_sun + z_ring).
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass

#: teeth by which a drawing may be off beside the backlash of the loop
DRAWN = 0.05


@dataclass(frozen=True)
class MeshPair:
    """Two wheels that mesh: which they are, their teeth, and where each sees the mesh, radians in its own axes."""

    wheels: tuple[Hashable, Hashable]
    teeth: tuple[int, int]
    directions: tuple[float, float]
    internal: bool
    #: backlash in teeth
    play: float


@dataclass(frozen=True)
class _Phase:
    """p = way x (that of the first wheel) + teeth, with the backlash met on the way."""

    way: int
    teeth: float
    play: float


def mismatches(pairs: list[MeshPair]) -> list[tuple[int, float]]:
    """The pairs that close a loop in which teeth do not meet, with the part of a tooth by which they miss.

    Parameters
    ----------
    pairs : list of MeshPair
        In the order in which they count: a pair that closes a loop is the last of it.
    """
    phases: dict[Hashable, dict[Hashable, _Phase]] = {}
    found = []
    for number, pair in enumerate(pairs):
        first, second = (phases.setdefault(wheel, {wheel: _Phase(1, 0.0, 0.0)}) for wheel in pair.wheels)
        a, b = (group[wheel] for group, wheel in zip((first, second), pair.wheels, strict=True))
        side = -1 if pair.internal else 1
        turned = [z * direction / math.tau for z, direction in zip(pair.teeth, pair.directions, strict=True)]
        rest = 0.5 - turned[0] - side * turned[1]
        if first is second:
            # The phase of the first wheel is open where it does not cancel.
            if a.way + side * b.way == 0:
                off = a.teeth + side * b.teeth - rest
                off = abs(off - round(off))
                if off > DRAWN + pair.play + a.play + b.play:
                    found.append((number, off))
            continue
        # p2 of this pair, and with it the phases of all wheels that mesh with it already.
        way, teeth, play = -side * a.way, side * (rest - a.teeth), a.play + pair.play
        for wheel, own in second.items():
            turn = own.way * b.way
            met = _Phase(turn * way, own.teeth + turn * (teeth - b.teeth), own.play + b.play + play)
            first[wheel] = met
            phases[wheel] = first
    return found
