"""How a mechanism can move, and which of its constraints are redundant, by rank and by name.

With A the closure Jacobian of the joints over the twists of all bodies, and C its drive rows (lengths divided by the
characteristic one):

    degrees of freedom   = columns - rank A            free motions with the drives held  = null space of [A; C]
    redundancy           = rows - rank [A; C]          redundant constraints              = left null space of [A; C]

The rank is a generic one: the largest found over assembled configurations around the start guess, so that a first
configuration which happens to be singular, or nearly so, does not count as a freedom (`probe`). It is found in relative
coordinates (`relative`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from jointplay.errors import InputError, listed
from jointplay.model.mechanism import Mechanism

from .attempt import Attempt, attempt
from .misfit import Misfit, gaps_words, misfit, misfit_words
from .motions import FreeMotion, free_motions
from .probe import RANK, Probe, Sample, dependent, motors, takes_part
from .report import sentences
from .self_stress import SelfStress, self_stresses
from .spins import held_spins, spin_bodies, spin_words
from .words import count, joined

__all__ = [
    "RANK",
    "Attempt",
    "FreeMotion",
    "Misfit",
    "Mobility",
    "Probe",
    "Sample",
    "SelfStress",
    "attempt",
    "examine",
    "generic",
    "held_spins",
    "is_tree",
    "misfit_words",
    "motors",
    "require_determinate",
    "sentences",
    "spin_bodies",
    "spin_words",
]

#: shares of the largest singular value that count as zero, in turn, where parts are not drawn to fit
INEXACT = (1e-5, 1e-4, 1e-3, 1e-2)
#: configurations at which it is asked whether they do
CONFIGURATIONS = 5


@dataclass(frozen=True)
class RedundantDrives:
    """Drives that command the same motions."""

    #: their names; a single one commands what cannot move
    drives: tuple[str, ...]
    #: how many of them are redundant
    number: int
    #: whether all of them give way, so that they share what loads their motions
    shared: bool


@dataclass(frozen=True)
class Mobility:
    """Freedoms and redundancies of a mechanism."""

    #: whether the mechanism could be assembled; otherwise the figures are those of the nearest attempt
    assembled: bool
    #: independent motions with no drive held
    degrees_of_freedom: int
    #: number of drives
    drives: int
    #: independent motions that are left with all drives held
    motions: tuple[FreeMotion, ...]
    #: number of redundant constraints of the joints alone
    joint_redundancy: int
    #: how many drives command what is decided already
    drive_redundancy: int
    #: joint components that depend on one another, such as ``J4.x``
    redundant_constraints: tuple[str, ...]
    #: drives that depend on one another or on the joints; of two entries each is redundant by itself
    redundant_drives: tuple[RedundantDrives, ...]
    #: drives that move several joints
    motors: tuple[str, ...] = ()
    #: motions that are possible to first order at the start, where these are more than the degrees of freedom; else 0
    special: int = 0
    #: what stays open in nominal poses of parts that are not drawn to fit
    misfit: Misfit | None = None
    #: what stays open because drives contradict one another, in words
    open: str = ""
    #: finds the self-stresses, which takes longer than all of the rest where there are many
    strained: Callable[[], list[SelfStress]] = field(default=list, repr=False, compare=False)

    @cached_property
    def self_stresses(self) -> tuple[SelfStress, ...]:
        """As many as `joint_redundancy`: how the joints can be strained against one another."""
        return tuple(self.strained())

    @property
    def is_determinate(self) -> bool:
        """Whether the drives decide every body's pose, and just once."""
        return not (self.motions or self.joint_redundancy or self.drive_redundancy)

    @property
    def shared(self) -> bool:
        """Whether all redundant drives give way, so that they share what loads their motions."""
        return all(drives.shared for drives in self.redundant_drives)

    @property
    def is_decided(self) -> bool:
        """Whether the drives determine every pose; joints, and drives that give way, may be redundant."""
        return not (self.motions or (self.drive_redundancy and not self.shared))

    @property
    def words(self) -> str:
        """One sentence for people."""
        freedom = f"{count(self.degrees_of_freedom, 'degree')} of freedom, {count(self.drives, 'drive')}"
        return "; ".join([freedom, *self.problems, *_redundancy(self), *_shared(self), *self.remarks])

    @property
    def problems(self) -> tuple[str, ...]:
        """What the drives do not decide, or decide twice, for people."""
        return tuple(_drive_problems(self))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is true at the start only, for people."""
        if not self.special:
            return ()
        return (f"the start is a special pose, in which {count(self.special, 'motion')} are possible to first order",)


def is_tree(m: Mechanism) -> bool:
    """Whether the joints close no loop."""
    return len(m.joints) == len(m.bodies)


def examine(m: Mechanism) -> Mobility:
    """Find how a mechanism can move and which of its constraints are redundant.

    Parameters
    ----------
    m : Mechanism
        Any mechanism, also with too few or too many drives.

    Examples
    --------
    >>> from jointplay import examples
    >>> from jointplay.model.mechanism import loads
    >>> examine(loads(examples.text("four-bar"))).words
    '1 degree of freedom, 1 drive'
    """
    if "mobility" not in m.known:
        m.known["mobility"] = _examine(m)
    found: Mobility = m.known["mobility"]
    return found


def _examine(m: Mechanism) -> Mobility:
    drives = m.start_drives if m.drive_values is None else m.drive_values[0]
    if m.core.regular(np.ascontiguousarray(drives)):
        # The usual case, and the only one that large mechanisms need not pay dense matrices for.
        free = len(m.drives)
        return Mobility(True, free, free, (), 0, 0, (), ())
    probe = Probe(m)
    found = generic(probe)
    mobility = replace(_mobility(probe, found.sample, found.first), assembled=found.assembled)
    if len(m.core.rows) <= len(m.components) * len(m.bodies):
        return mobility
    return _as_drawn(probe, mobility, found.smallest)


@dataclass(frozen=True)
class Generic:
    """A configuration that has the largest rank."""

    #: the first one found
    sample: Sample
    #: motions that are possible to first order at the start
    first: int
    #: whether the joints could be closed
    assembled: bool
    #: the largest that the smallest singular value is, of all configurations with this rank
    smallest: float


def generic(probe: Probe, *, away: bool = False) -> Generic:
    """A configuration with the largest rank around the start.

    Parameters
    ----------
    away : bool
        Whether a configuration beside the start is wanted also where that has the largest rank that is possible.
    """
    best, best_rank, first, assembled, smallest = None, (False, -1, -1), 0, False, 0.0
    for number, sample in enumerate(probe.samples()):
        motions = sample.freedoms(sample.rates[:0])
        held = sample.freedoms(sample.rates[probe.driven])
        found = (sample.counts, -motions, -held)
        assembled = assembled or sample.assembled
        if not number and sample.counts:
            first = motions
        if best is None or found > best_rank or (away and number == 1 and found == best_rank):
            best, best_rank, smallest = sample, found, 0.0
        if found == best_rank:
            smallest = max(smallest, sample.smallest)
        rows = len(sample.relative.closing)
        full = sample.counts and sample.relative.count - motions == rows and motions - held == len(probe.driven)
        if full and not (away and not number):
            break
    assert best is not None
    return Generic(best, first, assembled, smallest)


def _as_drawn(probe: Probe, mobility: Mobility, smallest: float) -> Mobility:
    """The same with what nominal poses leave open, where there are more equations than unknowns."""
    m = probe.m
    every = m.start_drives[None] if m.drive_values is None else m.drive_values
    taken = np.unique(np.linspace(0, len(every) - 1, CONFIGURATIONS).round().astype(int))
    drives = np.ascontiguousarray(every[taken])
    solved = m.core.trace(drives)["poses"]
    # Where the centres of wheels meet, nothing is known to first order.
    there = np.isfinite(solved).all(axis=(1, 2)) & np.isfinite(m.core.jacobian(solved)).all(axis=(1, 2))
    open_ = misfit(m, drives[there], solved[there]) if there.any() else None
    if open_ is None:
        return mobility
    if mobility.drive_redundancy and mobility.shared:
        # Commands that differ wind the drives up.
        return mobility
    if mobility.drive_redundancy:
        # Parts that do not fit lock a mechanism that would move if they did. Then little holds it everywhere.
        shares = [share for share in INEXACT if smallest <= share]
        inexact = (_mobility(probe, probe.at(solved[there][0], share)) for share in shares)
        fewer = (o for o in inexact if not o.motions and o.drive_redundancy < mobility.drive_redundancy)
        mobility = next(fewer, mobility)
    if mobility.drive_redundancy:
        return replace(mobility, assembled=False, open=gaps_words(m, open_))
    return replace(mobility, assembled=False, misfit=open_) if mobility.is_decided else mobility


def require_determinate(m: Mechanism, *, over_constrained: bool = False) -> Mobility:
    """Refuse a mechanism whose drives and joints do not determine every pose, or are redundant.

    A mechanism that does not assemble passes when the number of its drives is right: that is an outcome, no mistake.

    Parameters
    ----------
    m : Mechanism
        Any mechanism.
    over_constrained : bool
        Whether the joints may be over-constrained. Drives may not: two that command one motion are a mistake.

    Returns
    -------
    Mobility
        What was found.

    Raises
    ------
    InputError
        Naming the motion that is free and the joints that could be driven, or what is redundant.
    """
    mobility = examine(m)
    square = len(m.core.rows) == len(m.components) * len(m.bodies)
    if mobility.is_determinate or (square and not mobility.assembled):
        return mobility
    if over_constrained and mobility.is_decided:
        _require_near(m)
        return mobility
    problems = [*mobility.problems]
    if mobility.joint_redundancy and not over_constrained:
        rows = listed(mobility.redundant_constraints)
        advice = "give one of these joints another freedom or take a joint away"
        problems += [f"{part}, among {rows}; {advice}" for part in _redundancy(mobility)]
    if not over_constrained and (shared := _shared(mobility)):
        each = "it" if len(shared) == 1 else "each"
        problems.append(f"{'; '.join(shared)}, which this question cannot take; drive {each} by one")
    key = "joints" if mobility.joint_redundancy and not over_constrained else "drives"
    raise InputError("; ".join(problems), file=m.file, key=key)


def _require_near(m: Mechanism) -> None:
    """Refuse drives of one joint more than half a turn apart: beyond it an angle is taken for the remainder."""
    for number, joint in enumerate(m.joints):
        moves = [(k, by) for k, of in enumerate(m.drive_moves) for moved, by in of if moved == number]
        if len(moves) < 2 or m.drive_values is None or m.coordinate_kind(number) != "angle":
            continue
        apart = np.ptp([by * m.drive_values[:, k] for k, by in moves], axis=0).max()
        if apart > np.pi:
            names = joined([repr(m.drives[k]) for k, _ in moves])
            problem = f"{names} command angles of joint {joint!r} that are {np.degrees(apart):.6g} deg apart"
            raise InputError(
                f"{problem}; at most half a turn is possible", file=m.file, key=f"drives.{m.drives[moves[1][0]]}"
            )


def _mobility(probe: Probe, sample: Sample, first: int = 0) -> Mobility:
    m, held = probe.m, sample.rates[probe.driven]
    ties, _ = motors(m, held, m.length)
    freedoms, left = sample.freedoms(ties), sample.freedoms(held)
    unknowns = len(m.components) * len(m.bodies)
    joint_redundancy = len(sample.joints) - (unknowns - sample.freedoms(held[:0]))
    drive_redundancy = len(sample.joints) + len(held) - (unknowns - left) - joint_redundancy
    constraints: list[int] = []
    drives: list[RedundantDrives] = []
    if joint_redundancy:
        dependence = sample.dependences([])
        constraints = [k for k in range(len(sample.joints)) if takes_part(dependence, k)]
    if drive_redundancy:
        dependence = sample.dependences(probe.driven)[len(sample.joints) :]
        found = dependent(dependence, drive_redundancy, probe.drives)
        for group, number in found.items():
            shared = all(all(m.gives_way(k)) for k in group)
            drives.append(RedundantDrives(tuple(m.drives[k] for k in group), number, shared))
    # The pieces of an elastic body hang together by joints that are not in the file.
    inner = {member.joint for member in m.members}
    rows = [probe.rows[k] for k in constraints if probe.rows[k][0] not in inner]
    return Mobility(
        assembled=sample.assembled,
        degrees_of_freedom=freedoms,
        drives=len(m.drives),
        motions=tuple(free_motions(probe, sample, sample.motions(held))) if left else (),
        joint_redundancy=joint_redundancy,
        drive_redundancy=drive_redundancy,
        redundant_constraints=tuple(f"{m.joints[joint]}.{component}" for joint, component in rows),
        redundant_drives=tuple(drives),
        motors=tuple(drive for drive, moves in zip(m.drives, m.drive_moves, strict=True) if len(moves) > 1),
        special=first if first > sample.freedoms(held[:0]) else 0,
        strained=lambda: self_stresses(probe, sample),
    )


def _redundancy(mobility: Mobility) -> list[str]:
    number = mobility.joint_redundancy
    verb = "is" if number == 1 else "are"
    return [f"over-constrained: {count(number, 'constraint')} {verb} redundant"] if number else []


def _shared(mobility: Mobility) -> list[str]:
    shared = (found.drives for found in mobility.redundant_drives if found.shared)
    return [f"{joined([repr(name) for name in drives])} share a motion by their stiffness" for drives in shared]


def _drive_problems(mobility: Mobility) -> list[str]:
    problems = []
    if mobility.motions:
        number = len(mobility.motions)
        free = "; ".join(_free(motion) for motion in mobility.motions[:3]) + ("; ..." if number > 3 else "")
        problems.append(f"too few drives: {count(number, 'motion')} {'is' if number == 1 else 'are'} free: {free}")
    rigid = [found for found in mobility.redundant_drives if not found.shared]
    if rigid:
        several = any(len(found.drives) > 1 for found in rigid)
        problem = "; ".join(_too_many(mobility, found) for found in rigid)
        if mobility.open:
            contradict = "they contradict one another" if several else "it contradicts the joints"
            problem += f" ({contradict}, so that joints stay open where all others are closed: {mobility.open})"
        if several:
            problem += "; drives share a motion where each has a stiffness"
        problems.append(f"too many drives: {problem}")
    return problems


def _too_many(mobility: Mobility, found: RedundantDrives) -> str:
    names = [repr(name) for name in found.drives]
    if len(names) > 1:
        return f"{joined(names)} command the same motion; take away {found.number} of them"
    if found.drives[0] in mobility.motors:
        return f"{names[0]} commands joints that others tie to each other already; drive one of them"
    return f"{names[0]} commands a joint that cannot move; take it away"


def _free(motion: FreeMotion) -> str:
    if not motion.joints:
        return f"{motion.words} and no joint's coordinate drives it"
    return f"{motion.words}; drive " + ("" if len(motion.joints) == 1 else "one of ") + listed(motion.joints)
