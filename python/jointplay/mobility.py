"""How a mechanism can move, and what holds it more than once, by rank and by name.

With A the closure Jacobian of the joints over the twists of all bodies, and C its drive rows (lengths divided by the
characteristic one):

    degrees of freedom   = columns - rank A            free motions with the drives held  = null space of [A; C]
    redundancy           = rows - rank [A; C]          redundant constraints              = left null space of [A; C]

The rank is a generic one: the largest found over assembled configurations around the start guess, so that a first
configuration which happens to be singular does not count as a freedom.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay import _core, poses
from jointplay.compile import DRIVABLE, LENGTHS, TURNS
from jointplay.errors import InputError, listed
from jointplay.model import Mechanism

#: singular values below this share of the largest count as zero; assembly is exact to 1e-11 of the length
RANK = 1e-6
#: parts of a motion or of a dependence below this share of its largest part do not take part in it
TAKES_PART = 1e-6
#: how far the guess is moved (in characteristic lengths and radians) to find generic configurations
PERTURBATIONS = (0.0, 0.02, 0.1, 0.3)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """One free motion.

    Parameters
    ----------
    bodies : tuple of str
        The bodies that move.
    joints : tuple of str
        The joints whose coordinate changes; driving one of them takes the motion away.
    words : str
        The same as a phrase.
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class Mobility:
    """Freedoms and redundancies of a mechanism.

    Parameters
    ----------
    assembled : bool
        Whether the joints could be brought together; otherwise the figures are those of the nearest attempt.
    degrees_of_freedom : int
        Independent motions with no drive held.
    drives : int
        Number of drives.
    motions : tuple of Motion
        Independent motions that are left with all drives held.
    joint_redundancy : int
        By how much the joints alone hold the bodies more than once.
    drive_redundancy : int
        How many drives command what is decided already.
    redundant_constraints : tuple of str
        Joint components that depend on one another, such as ``J4.x``.
    redundant_drives : tuple of str
        Drives that depend on one another or on the joints.
    """

    assembled: bool
    degrees_of_freedom: int
    drives: int
    motions: tuple[Motion, ...]
    joint_redundancy: int
    drive_redundancy: int
    redundant_constraints: tuple[str, ...]
    redundant_drives: tuple[str, ...]

    @property
    def is_determinate(self) -> bool:
        """Whether the drives decide every body's pose, and just once."""
        return not (self.motions or self.joint_redundancy or self.drive_redundancy)

    @property
    def words(self) -> str:
        """One sentence for people."""
        freedom = f"{_count(self.degrees_of_freedom, 'degree')} of freedom, {_count(self.drives, 'drive')}"
        return "; ".join([freedom, *_problems(self)])


@dataclass(frozen=True)
class _Sample:
    """The length-scaled Jacobian at one configuration: of the joints, and of all coordinates that could be driven."""

    joints: Floats
    coordinates: Floats
    assembled: bool

    def closure(self, driven: list[int]) -> Floats:
        return np.vstack([self.joints, self.coordinates[driven]])


class _Probe:
    """The mechanism with every joint that has a coordinate driven, and without any drive."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.spec = m.spec() | {"loads": [], "sources": []}
        self.drivable = [index for index, kind in enumerate(m.joint_kinds) if kind in DRIVABLE]
        #: rows of the drives among the rows of all coordinates
        self.driven = [self.drivable.index(joint) for joint in m.drive_joints]
        self.core = self._core([{"joint": joint} for joint in self.drivable], self.spec["guess"])
        self.rows = self.core.rows

    def _core(self, drives: list[dict[str, int]], guess: list[list[float]]) -> _core.Mechanism:
        return _core.Mechanism(json.dumps(self.spec | {"drives": drives, "guess": guess}))

    def sample(self, perturbation: float) -> _Sample:
        """The Jacobian where the joints close near the (moved) guess, whatever the drives say."""
        rng = np.random.default_rng(int(1000 * perturbation))
        unit = np.where(np.isin(self.m.components, LENGTHS), self.m.length, 1.0)
        guess = np.array(self.spec["guess"])
        guess = poses.moved(guess, perturbation * unit * rng.uniform(-1.0, 1.0, (len(guess), len(unit))))
        closed = self._core([], guess.tolist()).assemble(np.zeros(0))
        jacobian = self.core.jacobian(closed["poses"])
        lengths = np.array([component not in TURNS for _, component in self.rows])
        jacobian = np.where(lengths[:, None], jacobian / self.m.length, jacobian) * np.tile(unit, len(guess))
        split = len(self.rows) - len(self.drivable)
        return _Sample(jacobian[:split], jacobian[split:], bool(closed["converged"]))


def examine(m: Mechanism) -> Mobility:
    """Find how a mechanism can move and what holds it more than once.

    Parameters
    ----------
    m : Mechanism
        Any mechanism, also with too few or too many drives.

    Examples
    --------
    >>> from jointplay import examples
    >>> from jointplay.model import loads
    >>> examine(loads(examples.text("four-bar"))).words
    '1 degree of freedom, 1 drive'
    """
    drives = m.start_drives if m.drive_values is None else m.drive_values[0]
    if m.core.regular(np.ascontiguousarray(drives)):
        # The usual case, and the only one that large mechanisms need not pay dense matrices for.
        count = len(m.drives)
        return Mobility(True, count, count, (), 0, 0, (), ())
    probe = _Probe(m)
    best, best_rank = None, (False, -1, -1)
    for perturbation in PERTURBATIONS:
        sample = probe.sample(perturbation)
        closure = sample.closure(probe.driven)
        rank = (sample.assembled, _rank(sample.joints), _rank(closure))
        if best is None or rank > best_rank:
            best, best_rank = sample, rank
        if rank == (True, len(sample.joints), closure.shape[1]) and len(closure) == closure.shape[1]:
            break
    assert best is not None
    return _mobility(probe, best)


def require_determinate(m: Mechanism) -> None:
    """Refuse a mechanism whose drives and joints do not decide every pose just once.

    A mechanism that does not assemble passes when the number of its drives is right: that is an outcome, no mistake.

    Parameters
    ----------
    m : Mechanism
        Any mechanism.

    Raises
    ------
    InputError
        Naming the motion that is free and the joints that could be driven, or what is redundant.
    """
    mobility = examine(m)
    square = len(m.core.rows) == len(m.components) * len(m.bodies)
    if mobility.is_determinate or (square and not mobility.assembled):
        return
    key = "joints" if mobility.joint_redundancy else "drives"
    raise InputError("; ".join(_problems(mobility)), file=m.file, key=key)


def _mobility(probe: _Probe, sample: _Sample) -> Mobility:
    m = probe.m
    closure = sample.closure(probe.driven)
    rank_joints, rank = _rank(sample.joints), _rank(closure)
    dependence = _null(sample.joints.T)
    constraints = [k for k in range(len(sample.joints)) if _takes_part(dependence, k)]
    dependence = _null(closure.T)
    drives = [k for k in range(len(probe.driven)) if _takes_part(dependence, len(sample.joints) + k)]
    joint_redundancy = len(sample.joints) - rank_joints
    return Mobility(
        assembled=sample.assembled,
        degrees_of_freedom=closure.shape[1] - rank_joints,
        drives=len(m.drives),
        motions=tuple(_motions(probe, sample, _null(closure))),
        joint_redundancy=joint_redundancy,
        drive_redundancy=len(closure) - rank - joint_redundancy,
        redundant_constraints=tuple(f"{m.joints[probe.rows[k][0]]}.{probe.rows[k][1]}" for k in constraints),
        redundant_drives=tuple(m.drives[k] for k in drives),
    )


def _rank(matrix: Floats) -> int:
    if not matrix.size:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > RANK * max(float(values[0]), np.finfo(float).tiny)).sum())


def _null(matrix: Floats) -> Floats:
    """Orthonormal null space, one column per dimension."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    return np.linalg.svd(matrix)[2][_rank(matrix) :].T


def _takes_part(null: Floats, row: int) -> bool:
    return bool(null.size and np.abs(null[row]).max() > TAKES_PART)


def _motions(probe: _Probe, sample: _Sample, null: Floats) -> list[Motion]:
    """The null space as motions of one joint each, as far as joints tell them apart."""
    rates = sample.coordinates @ null
    done: list[int] = []
    for row in range(len(rates)):
        left = [k for k in range(null.shape[1]) if k not in done]
        if not left:
            break
        pivot = max(left, key=lambda k: abs(rates[row, k]))
        if abs(rates[row, pivot]) < TAKES_PART:
            continue
        scale = 1.0 / rates[row, pivot]
        others = [k for k in range(null.shape[1]) if k != pivot]
        shares = rates[row, others].copy() * scale
        for table in (null, rates):
            table[:, others] -= np.outer(table[:, pivot], shares)
            table[:, pivot] *= scale
        done.append(pivot)
    return [_motion(probe, null[:, k], rates[:, k]) for k in range(null.shape[1])]


def _motion(probe: _Probe, twists: Floats, rates: Floats) -> Motion:
    m = probe.m
    parts = np.abs(twists.reshape(-1, len(m.components)))
    moving = parts.max(axis=1) > TAKES_PART * parts.max()
    bodies = tuple(name for name, moves in zip(m.bodies, moving, strict=True) if moves)
    turning = np.abs(rates) > TAKES_PART * max(float(np.abs(rates).max(initial=0.0)), float(parts.max()))
    joints = tuple(m.joints[index] for index, turns in zip(probe.drivable, turning, strict=True) if turns)
    if len(bodies) == 1:
        angles = ~np.isin(m.components, LENGTHS)
        turns = parts[int(moving.argmax()), angles].max() > TAKES_PART
        words = f"'{bodies[0]}' {'turns' if turns else 'slides'}"
    else:
        words = f"{_and([repr(body) for body in bodies])} move together"
    return Motion(bodies, joints, words)


def _problems(mobility: Mobility) -> list[str]:
    problems = []
    if mobility.motions:
        count = len(mobility.motions)
        free = "; ".join(_free(motion) for motion in mobility.motions[:3]) + ("; ..." if count > 3 else "")
        problems.append(f"too few drives: {_count(count, 'motion')} {'is' if count == 1 else 'are'} free: {free}")
    if mobility.drive_redundancy:
        names = [repr(name) for name in mobility.redundant_drives]
        if len(names) == 1:
            problems.append(f"too many drives: {names[0]} commands a joint that cannot move; take it away")
        else:
            problems.append(
                f"too many drives: {_and(names)} command the same motion; take away {mobility.drive_redundancy} of them"
            )
    if mobility.joint_redundancy:
        rows = listed(mobility.redundant_constraints)
        verb = "is" if mobility.joint_redundancy == 1 else "are"
        problems.append(
            f"over-constrained: {_count(mobility.joint_redundancy, 'constraint')} {verb} redundant, among {rows}; "
            "give one of these joints another freedom or take a joint away"
        )
    return problems


def _free(motion: Motion) -> str:
    if not motion.joints:
        return f"{motion.words} and no joint's coordinate drives it"
    return f"{motion.words}; drive " + ("" if len(motion.joints) == 1 else "one of ") + listed(motion.joints)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _and(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "nothing"
