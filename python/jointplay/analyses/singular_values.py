"""How near a configuration is to a singularity, and in which way it gives.

With J = [A; D] the length-scaled closure Jacobian, rows of the joints above rows of the drives, N an orthonormal basis
of the motions that the joints allow (the null space of A), and E the twist of the output:

    constraint   smallest singular value of A      zero where the joints no longer constrain a motion
    actuation    smallest singular value of D N    zero where the joints allow a motion without the drives
    output       smallest singular value of E N    zero where the mechanism moves and the output does not
    closure      smallest singular value of J      zero where one of the first two is, and never larger than either

because |det J| = (product of the singular values of A) x |det D N|. In the words of Gosselin and Angeles (1990) the
output's singularities are those of the first kind and the drives' those of the second; constraint singularities are
those of Zlatanov, Bonev and Gosselin (2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay import poses
from jointplay.compile import LENGTHS, TURNS
from jointplay.mobility import RANK, motors
from jointplay.model import Mechanism

Floats = NDArray[np.float64]

KINDS = ("constraint", "actuation", "output")
#: memory for the matrices of one chunk of configurations, bytes, and how many matrices each of them needs
CHUNK_BYTES, MATRICES = 64_000_000, 6
#: configurations of a chunk at most, so that progress shows
MOST = 256


@dataclass(frozen=True)
class Measures:
    """Nearness to singularities of some configurations.

    Attributes
    ----------
    values : ndarray
        Smallest singular values, shape (configuration, kind); nan where there is no motion to judge.
    motions : ndarray
        Scaled twists of all bodies that belong to them, shape (configuration, kind, unknown).
    twists : ndarray
        What these motions do to the output, scaled, shape (configuration, kind, component).
    closure : ndarray
        Smallest singular value of the whole Jacobian.
    sign : ndarray
        Sign of its determinant.
    """

    values: Floats
    motions: Floats
    twists: Floats
    closure: Floats
    sign: Floats


class Scaled:
    """Jacobians of a mechanism with lengths divided by a characteristic one.

    Parameters
    ----------
    m : Mechanism
    length : float
        Characteristic length, metres.
    """

    def __init__(self, m: Mechanism, length: float) -> None:
        self.m = m
        self.length = length
        turns = np.array([component in TURNS for _, component in m.core.rows])
        self.rows = np.where(turns, 1.0, 1.0 / length)
        #: rows of the joints, and how many of them and of what ties the joints of one motor to each other
        self.own = len(turns) - sum(map(len, m.drive_moves))
        self.split = len(turns) - len(m.drives)
        lengths = np.isin(m.components, LENGTHS)
        #: SI per scaled unit of a twist's components
        self.units = np.where(lengths, length, 1.0)
        self.positions = np.flatnonzero(lengths)
        self.columns = np.tile(self.units, len(m.bodies))

    @property
    def chunk(self) -> int:
        """Configurations whose matrices fit into the memory that is meant for them."""
        return int(np.clip(CHUNK_BYTES // (8 * MATRICES * max(1, self.columns.size) ** 2), 1, MOST))

    def jacobians(self, at: Floats) -> Floats:
        """Scaled Jacobians at poses of shape (configuration, body, coordinate)."""
        found = [self.m.core.jacobian(np.ascontiguousarray(pose)) for pose in at]
        stacked = np.array(found).reshape(len(at), self.rows.size, self.columns.size)
        return np.asarray(stacked * self.rows[:, None] * self.columns)

    def output(self, at: Floats) -> Floats:
        """Maps from the scaled twists of all bodies to that of the output, (configuration, component, unknown)."""
        spec = self.m.core_spec
        point = spec["points"][spec["output"]["point"]]
        size = len(self.units)
        lever = (poses.matrix(at[:, point["body"]]) @ np.array(point["at"])) / self.length
        part = np.tile(np.eye(size), (len(at), 1, 1))
        if size == 3:
            part[:, 0, 2], part[:, 1, 2] = -lever[:, 1], lever[:, 0]
        else:
            # v + w x lever, column by column of w
            part[:, :3, 3:] = np.moveaxis(np.cross(np.eye(3)[:, None], lever), 0, -1)
        whole = np.zeros((len(at), size, self.columns.size))
        first = size * point["body"]
        whole[:, :, first : first + size] = part
        return whole

    def sign(self, pose: Floats) -> float:
        """Sign of the determinant of the closure Jacobian at one pose of all bodies."""
        return float(np.linalg.slogdet(self.jacobians(pose[None])[0])[0])

    def closure(self, at: Floats) -> tuple[Floats, Floats]:
        """Smallest singular value of the closure Jacobian and sign of its determinant."""
        values, signs = np.empty(len(at)), np.empty(len(at))
        for start in range(0, len(at), self.chunk):
            part = slice(start, start + self.chunk)
            jacobians = self.jacobians(at[part])
            values[part] = np.linalg.svd(jacobians, compute_uv=False).min(axis=-1)
            signs[part] = np.linalg.slogdet(jacobians)[0]
        return values, signs

    def measure(self, at: Floats, components: Sequence[int]) -> Measures:
        """Judge assembled configurations.

        Parameters
        ----------
        at : ndarray
            Poses, shape (configuration, body, coordinate).
        components : sequence of int
            The components of the output's twist that count.

        Notes
        -----
        Where A has lost rank its null space is larger than the number of drives; then all of it counts, because which
        part of it was there before is not decided by A. With more drives than components that count, some motion leaves
        the output at rest everywhere; then the smallest of the first values, one per component, is taken.
        """
        jacobians = self.jacobians(at)
        joints, drives = jacobians[:, : self.split], jacobians[:, self.split :]
        if self.own < self.split or any(c != 1.0 for moves in self.m.drive_moves for _, c in moves):
            ties, drives = motors(self.m, jacobians[:, self.own :], self.length)
            joints = np.concatenate([jacobians[:, : self.own], ties], axis=1)
        output = self.output(at)
        _, values, right = np.linalg.svd(joints)
        motions = [right[:, self.split - 1]]
        found = [values[:, -1]]
        lost = values <= RANK * values[:, :1]
        for rates in (drives, output[:, components]):
            value, motion = _least(rates, np.swapaxes(right[:, self.split :], 1, 2))
            for k in np.flatnonzero(lost.any(axis=1)):
                free = right[k, self.split - int(lost[k].sum()) :].T
                value[k], motion[k] = _least(rates[k], free)
            found.append(value)
            motions.append(motion)
        stacked = _unit(np.stack(motions, axis=1))
        return Measures(
            values=np.stack(found, axis=1),
            motions=stacked,
            twists=np.einsum("ncu,nku->nkc", output, stacked),
            closure=np.linalg.svd(jacobians, compute_uv=False).min(axis=-1),
            sign=np.asarray(np.linalg.slogdet(jacobians)[0]),
        )


def _least(rates: Floats, free: Floats) -> tuple[Floats, Floats]:
    """The free motion that shows least in some rates: the singular value, and the motion of all bodies."""
    mapped = rates @ free
    if not min(mapped.shape[-2:]):
        return np.full(mapped.shape[:-2], np.nan), np.full((*free.shape[:-1],), np.nan)
    _, values, right = np.linalg.svd(mapped, full_matrices=False)
    return values[..., -1], (free @ right[..., -1, :, None])[..., 0]


def _unit(motions: Floats) -> Floats:
    """Motions whose largest part is one characteristic length or one radian, and positive."""
    place = np.abs(motions).argmax(axis=-1)[..., None]
    return np.asarray(motions / np.take_along_axis(motions, place, axis=-1))


def kind(values: Floats, limit: float) -> str:
    """The kinds of singularity that a configuration is at, else the one that it is nearest to.

    Examples
    --------
    >>> kind(np.array([1e-9, 0.2, 1e-12]), 1e-4)
    'constraint, output'
    >>> kind(np.array([0.3, 0.2, 0.5]), 1e-4)
    'actuation'
    """
    if not np.isfinite(values).any():
        return ""
    at = np.flatnonzero(values < limit)
    return ", ".join(KINDS[k] for k in (at if at.size else [int(np.nanargmin(values))]))
