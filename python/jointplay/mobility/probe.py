"""The closure Jacobian of a mechanism at assembled configurations, length-scaled, and its rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay import _core, poses
from jointplay.compile import ANGULAR, DRIVABLE, LENGTHS, TURNS
from jointplay.model import Mechanism, in_core
from jointplay.spec import DriveSpec

#: singular values below this share of the largest count as zero; assembly is exact to 1e-11 of the length
RANK = 1e-6
#: parts of a motion or of a dependence below this share of its largest part do not take part in it
TAKES_PART = 1e-6

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sample:
    """The length-scaled Jacobian at one configuration: of the joints, and of all coordinates that could be driven.

    Parameters
    ----------
    joints, coordinates : ndarray
        Its rows, over the twists of all bodies.
    unscaled : ndarray
        All rows, in SI.
    poses : ndarray
        Where the bodies are.
    assembled : bool
        Whether the mechanism could be assembled.
    tolerance : float
        Singular values below this share of the largest count as zero.
    """

    joints: Floats
    coordinates: Floats
    unscaled: Floats
    poses: Floats
    assembled: bool
    tolerance: float = RANK

    def closure(self, driven: list[int]) -> Floats:
        return np.vstack([self.joints, self.coordinates[driven]])


class Probe:
    """The mechanism with every joint that has a coordinate driven, and without any drive."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.spec = m.spec() | {"loads": [], "sources": [], "correlations": []}
        self.drivable = [index for index, kind in enumerate(m.joint_kinds) if kind in DRIVABLE]
        #: rows of the drives among the rows of all coordinates
        self.driven = [self.drivable.index(joint) for moves in m.drive_moves for joint, _ in moves]
        #: the drive that each of these rows is of
        self.drives = [drive for drive, moves in enumerate(m.drive_moves) for _ in moves]
        self.core = self._core([{"joint": joint} for joint in self.drivable], self.spec["guess"])
        self.rows = self.core.rows

    def _core(self, drives: list[DriveSpec], guess: list[list[float]]) -> _core.Mechanism:
        return in_core(self.spec | {"drives": drives, "guess": guess})

    def sample(self, perturbation: float) -> Sample:
        """The Jacobian where the joints close near the (moved) guess, whatever the drives say."""
        rng = np.random.default_rng(int(1000 * perturbation))
        unit = np.where(np.isin(self.m.components, LENGTHS), self.m.length, 1.0)
        guess = np.array(self.spec["guess"])
        twists = perturbation * unit * rng.uniform(-1.0, 1.0, (len(guess), len(unit)))
        guess = poses.moved(guess, twists, self.core.origins)
        closed = self._core([], guess.tolist()).assemble(np.zeros(0))
        return self.at(closed["poses"], bool(closed["converged"]))

    def at(self, placed: Floats, assembled: bool, tolerance: float = RANK) -> Sample:
        """The Jacobian where the bodies are."""
        unit = np.where(np.isin(self.m.components, LENGTHS), self.m.length, 1.0)
        jacobian = self.core.jacobian(placed)
        lengths = np.array([component not in TURNS for _, component in self.rows])
        scaled = np.where(lengths[:, None], jacobian / self.m.length, jacobian) * np.tile(unit, len(placed))
        split = len(self.rows) - len(self.drivable)
        return Sample(scaled[:split], scaled[split:], jacobian, placed, assembled, tolerance)


def motors(m: Mechanism, rows: Floats, length: float) -> tuple[Floats, Floats]:
    """What drives hold, as what ties the joints of one motor to each other, and as the motion of every motor.

    Parameters
    ----------
    m : Mechanism
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


def rank(matrix: Floats, tolerance: float = RANK) -> int:
    """Number of singular values that are not rounding, or not below another share of the largest."""
    if not matrix.size:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > tolerance * max(float(values[0]), np.finfo(float).tiny)).sum())


def null(matrix: Floats, tolerance: float = RANK) -> Floats:
    """Orthonormal null space, one column per dimension."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    return np.linalg.svd(matrix)[2][rank(matrix, tolerance) :].T


def takes_part(space: Floats, row: int) -> bool:
    """Whether a row of a null space is more than rounding."""
    return bool(space.size and np.abs(space[row]).max() > TAKES_PART)
