"""The closure Jacobian of a mechanism at assembled configurations, and how many motions it leaves.

The rank counts that a mechanism has nearly everywhere: where it can be assembled, a pose may be special, and one beside
it is so to rounding. From the first assembled pose several ways lead on, each along a motion that is free there, and
the largest rank on them counts. A direction that ends after a little way is no motion; rows that hold little are left
open on the way, because closing them would lead back to the special pose.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointplay import _core
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import ANGULAR, DRIVABLE, LENGTHS, TURNS
from jointplay.core.spec import DriveSpec
from jointplay.model.mechanism import Mechanism

from .relative import Relative, null, rank

#: share of the largest singular value that counts as zero where a drawing is exact
RANK = 1e-6
#: parts of a motion or of a dependence below this share of its largest part do not take part in it
TAKES_PART = 1e-6
#: largest residual (in characteristic lengths and radians) of what is closed, ...
CLOSED = 1e-9
#: ... and of what is but for the digits that its places are given with
NEARLY = 1e-4
#: largest residual beside the square of the smallest singular value that is not zero
NEARBY = 0.1
#: how far the guess is moved (in characteristic lengths and radians) where it cannot be assembled
PERTURBATIONS = (0.0, 0.02, 0.1, 0.3)
#: ways that lead on from an assembled pose, of mechanisms with up to so many loop equations, and of larger ones
WAYS, FEW, SMALL = 10, 3, 60
#: joints that are followed each by itself, of these ways
SINGLE = 8
#: largest part of a step, and how many there are on a way
STEP, STEPS = 0.35, 2
#: steps that close loops, with rows that hold little left open, and with all
OPEN, ALL = 12, 30
#: singular values of rows that hold little
LITTLE = 1e-3
#: singular values with which a step would be rounding
NONE = 1e-10


@dataclass(frozen=True)
class Sample:
    """The length-scaled Jacobian at one configuration: of the joints, and of all coordinates that could be driven."""

    #: `joints`, `coordinates`: its rows, over the twists of all bodies
    joints: Floats
    coordinates: Floats
    #: all rows, in SI
    unscaled: Floats
    #: where the bodies are
    poses: Floats
    #: residuals of all rows of the joints, in characteristic lengths and radians
    gaps: Floats
    #: the largest one; infinite where something is not defined
    residual: float
    #: the joints in relative coordinates
    relative: Relative
    #: singular values below this share of the largest count as zero; 0 finds out, from poses that are closed
    tolerance: float = 0.0

    @property
    def assembled(self) -> bool:
        """Whether the joints are closed."""
        return self.residual <= CLOSED

    @cached_property
    def smallest(self) -> float:
        """The smallest singular value of the loops' equations that is not zero."""
        values = np.linalg.svd(self.relative.closing, compute_uv=False) if self.relative.closing.size else np.ones(0)
        counted = rank(self.relative.closing, self.tolerance)
        return float(values[counted - 1]) if counted else np.inf

    @property
    def counts(self) -> bool:
        """Whether its rank is that of a configuration in which the joints are closed, but for digits of the drawing.

        Newton's method then has a solution nearby, at which the values that are not zero are about the same.
        """
        return self.residual <= CLOSED or self.residual <= min(NEARLY, NEARBY * self.smallest * self.smallest)

    @cached_property
    def rates(self) -> Floats:
        """Rates of all coordinates that could be driven, over the relative coordinates."""
        return self.relative.of(self.coordinates)

    def equations(self, further: Floats) -> Floats:
        """What relative coordinates have to keep to, with further rows over them."""
        return np.vstack([self.relative.closing, further])

    def freedoms(self, further: Floats) -> int:
        """Motions that are left with further rows over the relative coordinates held."""
        return self.relative.count - rank(self.equations(further), self.tolerance)

    def motions(self, further: Floats) -> Floats:
        """The same motions, over the relative coordinates, by column."""
        return null(self.equations(further), self.tolerance)

    def dependences(self, driven: list[int]) -> Floats:
        """How rows of the joints, and of driven coordinates below them, depend on one another: by column."""
        multipliers = null(self.equations(self.rates[driven]).T, self.tolerance)
        return self.relative.dependences(multipliers, self.coordinates[driven])


class Probe:
    """The mechanism with every joint that has a coordinate driven, and without any drive."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.drivable = [index for index, kind in enumerate(m.joint_kinds) if kind in DRIVABLE]
        #: rows of the drives among the rows of all coordinates
        self.driven = [self.drivable.index(joint) for moves in m.drive_moves for joint, _ in moves]
        #: the drive that each of these rows is of
        self.drives = [drive for drive, moves in enumerate(m.drive_moves) for _ in moves]
        self.core = self._core([{"joint": joint} for joint in self.drivable], m.guess)
        self.free = self._core([], m.guess)
        self.rows = self.core.rows
        self.ends = m.joint_bodies
        self.unit = np.where(np.isin(m.components, LENGTHS), m.length, 1.0)
        turns = np.array([component in TURNS for _, component in self.rows], dtype=bool)
        self.units = np.where(turns, 1.0, m.length)

    def _core(self, drives: list[DriveSpec], guess: Floats) -> _core.Mechanism:
        return self.m.varied(drives=drives, guess=guess.tolist(), loads=[], sources=[], correlations=[])

    def samples(self) -> Iterator[Sample]:
        """Configurations in which the joints are closed, whatever the drives say: at the start, and away from it."""
        start = None
        for perturbation in PERTURBATIONS:
            sample = self._near(perturbation)
            yield sample
            if sample.counts:
                start = sample
                break
        if start is None or not start.relative.closing.size:
            return
        yield from self._ways(start)

    def _near(self, perturbation: float) -> Sample:
        """Where the joints close near the (moved) guess."""
        rng = np.random.default_rng(int(1000 * perturbation))
        guess = self.m.guess
        twists = perturbation * self.unit * rng.uniform(-1.0, 1.0, (len(guess), len(self.unit)))
        moved = poses.moved(guess, twists, self.core.origins)
        sample = self.at(moved)
        if sample.residual <= CLOSED:
            return sample
        return self.at(self._core([], moved).assemble(np.zeros(0))["poses"])

    def _ways(self, start: Sample) -> Iterator[Sample]:
        """Where motions that are free at a configuration lead."""
        rng = np.random.default_rng(0)
        every = start.motions(start.rates[:0])
        # The motion that turns one joint most moves others least.
        single = start.rates @ every
        turning = np.flatnonzero(np.linalg.norm(single, axis=1) > LITTLE)
        is_small = len(start.relative.closing) <= SMALL
        joints = rng.permutation(turning)[: SINGLE if is_small else 1].tolist()
        ways = WAYS if is_small else FEW
        for way in range(ways if every.shape[1] else 0):
            sample, motions, some = start, every, []
            for step in range(STEPS):
                if not step and way < len(joints):
                    z = motions @ single[joints[way]]
                else:
                    z = motions @ rng.normal(size=motions.shape[1])
                twists = sample.relative.twists @ z
                far = float(np.abs(twists).max(initial=0.0))
                if not far:
                    break
                moved = self._moved(sample.poses, STEP * rng.choice([-1.0, 1.0]) * twists / far)
                *some, sample = self._closed(moved)
                motions = sample.motions(sample.rates[:0])
            yield from (*some, sample)

    def _moved(self, placed: Floats, twists: Floats) -> Floats:
        return poses.moved(placed, twists.reshape(len(placed), -1) * self.unit, self.core.origins)

    def _closed(self, placed: Floats) -> Iterator[Sample]:
        """The joints closed near poses of all bodies, without the rows that hold little, and with all of them."""
        sample = self.at(placed)
        for share, steps in ((LITTLE, OPEN), (NONE, ALL)):
            for _ in range(steps):
                if sample.residual <= CLOSED * 1e-3 or sample.residual == np.inf:
                    break
                twists = sample.relative.step(sample.gaps, share)
                far = float(np.abs(twists).max(initial=0.0))
                if far <= CLOSED * 1e-4:
                    break
                sample = self.at(self._moved(sample.poses, twists * min(1.0, STEP / far)))
            yield sample

    def at(self, placed: Floats, tolerance: float = 0.0) -> Sample:
        """The Jacobian where the bodies are; nothing in the place of what is not defined there, and not assembled."""
        split = len(self.rows) - len(self.drivable)
        jacobian = self.core.jacobian(placed)
        gaps = np.asarray(self.free.gaps(np.zeros(0), placed) / self.units[:split])
        is_defined = np.isfinite(jacobian).all() and np.isfinite(gaps).all()
        jacobian = np.where(np.isfinite(jacobian), jacobian, 0.0)
        scaled = jacobian / self.units[:, None] * np.tile(self.unit, len(placed))
        joints = np.array([joint for joint, _ in self.rows[:split]], dtype=np.intp)
        relative = Relative(scaled[:split], joints, self.ends, len(self.unit))
        residual = float(np.abs(gaps).max(initial=0.0)) if is_defined else np.inf
        if residual > NEARLY:
            tolerance = tolerance or RANK
        return Sample(scaled[:split], scaled[split:], jacobian, placed, gaps, residual, relative, tolerance)


def motors(m: Mechanism, rows: Floats, length: float) -> tuple[Floats, Floats]:
    """What drives hold, as what ties the joints of one motor to each other, and as the motion of every motor.

    Parameters
    ----------
    rows : ndarray
        Length-scaled rows of all driven coordinates, drive by drive; shape (..., row, unknown).
    length : float
        The length that they are scaled with.
    """
    own, ties, k = [], [], 0
    for moves in m.drive_moves:
        units = [1.0 if m.joint_kinds[joint] in ANGULAR else length for joint, _ in moves]
        rates = [
            rows[..., k + j, :] * (unit / (coefficient * units[0]))
            for j, ((_, coefficient), unit) in enumerate(zip(moves, units, strict=True))
        ]
        own.append(rates[0])
        ties += [rate - rates[0] for rate in rates[1:]]
        k += len(moves)
    empty = rows[..., :0, :]
    return np.stack(ties, axis=-2) if ties else empty, np.stack(own, axis=-2) if own else empty


def takes_part(space: Floats, row: int) -> bool:
    """Whether a row of a null space is more than rounding."""
    return bool(space.size and np.abs(space[row]).max() > TAKES_PART)


def dependent(space: Floats, number: int, owners: Sequence[int]) -> dict[tuple[int, ...], int]:
    """Owners of rows that depend on one another, apart from those whose rows do so by themselves.

    Of independent dependences in the form [I, F], each with a row of its own, those that have other rows in common
    belong together: no other choice of them comes apart further.

    Parameters
    ----------
    space : ndarray
        Dependences of the rows by column, with what else than these rows takes part in them left out.
    number : int
        How many of them are independent.
    owners : sequence of int
        What every row is of; all rows of one owner belong together.

    Returns
    -------
    dict
        Number of independent dependences of every group of owners.

    Examples
    --------
    >>> both = np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 0.0]])
    >>> dependent(both, 2, [0, 1, 2, 3, 4])
    {(0, 1): 1, (2, 3): 1}
    """
    from scipy.linalg import qr, solve_triangular

    basis = np.linalg.svd(space, full_matrices=False)[0][:, :number]
    _, reduced, order = qr(basis.T, mode="economic", pivoting=True)
    rest = solve_triangular(reduced[:, :number], reduced)
    at = {row: {row} for row in set(owners)}
    counts: Counter[int] = Counter()
    for found in rest:
        taking = [owners[row] for row in order[np.abs(found) > TAKES_PART]]
        joined = set().union(*(at[owner] for owner in taking))
        at |= dict.fromkeys(joined, joined)
        counts[taking[0]] += 1
    groups: Counter[tuple[int, ...]] = Counter()
    for owner, times in sorted(counts.items()):
        groups[tuple(sorted(at[owner]))] += times
    return dict(sorted(groups.items()))
