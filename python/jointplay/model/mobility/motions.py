"""Motions that are left with all drives held, one joint each as far as joints distinguish them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import nearest
from jointplay.model.mechanism import Mechanism

from .probe import TAKES_PART, Probe, Sample
from .spins import spin_words
from .words import joined

#: bodies that are named of those that move together
MOST_NAMES = 8


@dataclass(frozen=True)
class FreeMotion:
    """One free motion."""

    #: the bodies that move
    bodies: tuple[str, ...]
    #: the joints whose coordinate changes; driving one of them takes the motion away
    joints: tuple[str, ...]
    #: makes a phrase of it. That takes long where hundreds of motions are free, of which few are named.
    told: Callable[[], str] = field(repr=False, compare=False)

    @property
    def words(self) -> str:
        """The same as a phrase."""
        return self.told()


def free_motions(probe: Probe, sample: Sample, motions: Floats) -> list[FreeMotion]:
    """Motions over the relative coordinates as those of one joint each, and of few bodies each, as far as that goes."""
    null, rates = sample.relative.twists @ motions, sample.rates @ motions
    left = list(range(null.shape[1]))

    def part(own: Floats, row: int, pivot: int) -> None:
        """Let one motion alone have what a row of a table says."""
        scale = 1.0 / own[row, pivot]
        others = np.flatnonzero(own[row])
        others = others[others != pivot]
        shares = own[row, others] * scale
        for table in (null, rates):
            if len(others):
                table[:, others] -= np.outer(table[:, pivot], shares)
            table[:, pivot] *= scale
        left.remove(pivot)

    for row in range(len(rates)):
        pivot = max(left, key=lambda k: abs(rates[row, k]), default=-1)
        if left and abs(rates[row, pivot]) >= TAKES_PART:
            part(rates, row, pivot)
    # No joint's coordinate tells those apart that are left.
    while left:
        largest, column = np.unravel_index(np.abs(null[:, left]).argmax(), (len(null), len(left)))
        part(null, int(largest), left[int(column)])
    return [_motion(probe, null[:, k], rates[:, k]) for k in range(null.shape[1])]


def _motion(probe: Probe, twists: Floats, rates: Floats) -> FreeMotion:
    m = probe.m
    parts = np.abs(twists.reshape(-1, len(m.components)))
    moving = parts.max(axis=1) > TAKES_PART * parts.max()
    bodies = tuple(dict.fromkeys(owner for owner, moves in zip(m.owners, moving, strict=True) if moves))
    turning = np.abs(rates) > TAKES_PART * max(float(np.abs(rates).max(initial=0.0)), float(parts.max()))
    joints = tuple(m.joints[index] for index, turns in zip(probe.drivable, turning, strict=True) if turns)
    return FreeMotion(bodies, joints, lambda: f"{_words(m, bodies, parts[moving])}{_namesake(m, bodies)}")


def _words(m: Mechanism, bodies: tuple[str, ...], parts: Floats) -> str:
    turned = next((s for s in m.spins if s.load is not None and {m.owners[b] for b in s.bodies} == set(bodies)), None)
    if turned is not None and turned.load is not None:
        return f"{spin_words(m, turned)}, {turned.load} turns it"
    if len(bodies) == 1:
        turns = parts[0, ~np.isin(m.components, LENGTHS)].max() > TAKES_PART
        return f"'{bodies[0]}' {'turns' if turns else 'slides'}"
    named = [repr(body) for body in bodies[:MOST_NAMES]]
    more = len(bodies) - len(named)
    return f"{joined([*named, f'{more} more'] if more else named)} move together"


def _namesake(m: Mechanism, bodies: tuple[str, ...]) -> str:
    """A body that moves on a single joint, and one with almost the same name: they may be one."""
    ends = [{m.owners[body] for body in pair if body >= 0} for pair in m.joint_bodies]
    for body in bodies:
        if sum(body in pair for pair in ends) > 1:
            continue
        near = nearest(body, [name for name in dict.fromkeys(m.owners) if name != body], slips_only=True)
        if near is not None:
            return f" ('{body}' and '{near}': one body?)"
    return ""
