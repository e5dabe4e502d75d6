"""Self-stresses: reactions that are in equilibrium without any load, described by the members that they run through.

They are the left null space of the joints' closure Jacobian, one dimension for every redundant constraint. Any basis
would do; one that people can read is made of self-stresses through as few joints as can be. Each is found by asking
of one joint after the other that it carries nothing, as long as a self-stress is left that is not made of those found
before. Several orders of asking are tried and the one that leaves the fewest joints is taken: the sparsest basis of
all is out of reach (it is NP-hard), and not needed to be read.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS, TURNS
from jointplay.model.mechanism import Mechanism

from .probe import RANK, TAKES_PART, Probe, Sample
from .relative import null
from .words import joined

#: how many orders of joints are tried for every self-stress
ORDERS = 24


@dataclass(frozen=True)
class SelfStress:
    """One way in which a mechanism can be strained without a load."""

    #: the bodies of the file that carry it, the ground left out
    bodies: tuple[str, ...]
    #: the joints that carry it
    joints: tuple[str, ...]
    #: those of the bodies and joints that give under it; where there are none, it has to fit without
    elastic: tuple[str, ...]
    #: force and moment on the second body of every joint of the mechanism, at the joint, in ground axes, shape (joint,
    #: wrench); the largest component of a force is 1 N, or of a moment 1 N m where there is no force
    reactions: Floats = field(repr=False, compare=False)

    @property
    def words(self) -> str:
        """The same as a phrase."""
        verb = "gives" if len(self.elastic) == 1 else "give"
        gives = f"{joined(self.elastic)} {verb}" if self.elastic else "all rigid"
        return f"{joined(self.bodies)} ({gives if set(self.elastic) != set(self.bodies) else 'all elastic'})"


def self_stresses(probe: Probe, sample: Sample) -> list[SelfStress]:
    """A readable basis of the self-stresses, the one through the fewest joints first."""
    basis = np.linalg.qr(sample.dependences([]))[0]
    joints = np.array([joint for joint, _ in probe.rows[: len(sample.joints)]])
    sparse = sparse_basis(basis, joints)
    return sorted((_told(probe, sample, stress) for stress in sparse.T), key=lambda stress: len(stress.joints))


def sparse_basis(basis: Floats, groups: np.ndarray) -> Floats:
    """Vectors of the same span whose entries are in few groups.

    Parameters
    ----------
    basis : ndarray
        Orthonormal columns.
    groups : ndarray of int
        Group of every row.
    """
    found = np.zeros((basis.shape[1], 0))
    members = [np.flatnonzero(groups == group) for group in np.unique(groups)]
    members = [rows for rows in members if np.abs(basis[rows]).max(initial=0.0) > TAKES_PART]
    for _ in range(basis.shape[1]):
        new = null(found.T)
        tried = [_sparse(basis, [members[k] for k in order], new) for order in _orders(len(members))]
        best = min(tried, key=lambda one: sum(np.abs(basis[rows] @ one).max() > TAKES_PART for rows in members))
        found = np.column_stack([found, best])
    vectors = basis @ found
    return np.asarray(np.where(np.abs(vectors) > TAKES_PART * np.abs(vectors).max(axis=0, initial=0.0), vectors, 0.0))


def _orders(count: int) -> list[list[int]]:
    """Orders in which groups are asked: forwards, backwards, and starting from others."""
    starts = range(0, count, -(-count // ORDERS)) if count else ()
    turned = [[*range(start, count), *range(start)] for start in starts]
    return [*turned, *(order[::-1] for order in turned)]


def _sparse(basis: Floats, members: Sequence[np.ndarray], new: Floats) -> Floats:
    """Coefficients of one vector of few groups with a part in directions that are new."""
    space = np.eye(basis.shape[1])
    for rows in members:
        part = basis[rows] @ space
        # One vector cannot become fewer; and along a leg the groups after the first one mostly see nothing more.
        if space.shape[1] == 1 or np.linalg.norm(part) <= TAKES_PART:
            continue
        smaller = space @ _unseen(part)
        if np.abs(new.T @ smaller).max(initial=0.0) > RANK:
            space = smaller
    # What is left has one dimension, or rounding does not distinguish more: then the one with the largest new part.
    vector: Floats = space[:, int(np.linalg.norm(new.T @ space, axis=0).argmax())]
    return vector / np.linalg.norm(vector)


def _unseen(part: Floats) -> Floats:
    """Orthonormal directions that a part of the basis, whose columns have length one, does not see but by rounding."""
    _, values, directions = np.linalg.svd(part)
    return np.asarray(directions[int((values > TAKES_PART).sum()) :].T)


def _told(probe: Probe, sample: Sample, stress: Floats) -> SelfStress:
    """A self-stress (of the length-scaled rows) by name."""
    m = probe.m
    rows = probe.rows[: len(stress)]
    turns = np.array([component in TURNS for _, component in rows])
    # Lengths of the rows were divided by the characteristic one.
    multipliers = np.where(turns, stress, stress / m.length)
    joints = np.array([joint for joint, _ in rows])
    reactions = np.zeros((len(m.joints), len(m.components)))
    for joint in range(len(m.joints)):
        mine = joints == joint
        reactions[joint] = _reaction(m, sample, joint, multipliers[mine] @ sample.unscaled[: len(rows)][mine])
    lengths = sum(component in LENGTHS for component in m.components)
    # In one unit, what is rounding beside the rest is nothing.
    sizes = np.abs(reactions) * np.where(np.arange(reactions.shape[1]) < lengths, m.length, 1.0)
    reactions[sizes < TAKES_PART * sizes.max(initial=0.0)] = 0.0
    forces, moments = np.split(np.abs(reactions), [lengths], axis=1)
    scale = np.sign(multipliers[np.flatnonzero(stress)[0]]) / (forces.max() or moments.max())
    part = [k for k in range(len(m.joints)) if np.any(stress[joints == k])]
    inner = {member.joint: member.body for member in m.members}
    ends = {m.owners[b] for k in part for b in m.joint_bodies[k] if b >= 0}
    gives: list[str] = []
    for k in part:
        compliance, w = m.compliance(k), multipliers[joints == k]
        if compliance is not None and w @ compliance @ w > 0.0:
            gives.append(inner.get(k, m.joints[k]))
    return SelfStress(
        # Names of the file have no dot: that is the cross of a universal joint.
        bodies=tuple(body for body in dict.fromkeys(m.owners) if body in ends and "." not in body),
        joints=tuple(m.joints[k] for k in part if k not in inner),
        elastic=tuple(dict.fromkeys(gives)),
        reactions=reactions * scale + 0.0,
    )


def _reaction(m: Mechanism, sample: Sample, joint: int, generalised: Floats) -> Floats:
    """Wrench on the second body at the joint, from what the joint's rows do on the twists of all bodies."""
    first, second = m.joint_bodies[joint]
    body, sign = (first, -1.0) if second < 0 else (second, 1.0)
    size = len(m.components)
    wrench = sign * generalised[body * size : (body + 1) * size]
    point = m.points[m.joint_points[joint][1]].at
    at = np.array(point) if second < 0 else poses.place(sample.poses[second], point)
    lever = at - poses.place(sample.poses[body], m.core.origins[body])
    lengths = sum(component in LENGTHS for component in m.components)
    force = np.zeros(3)
    force[:lengths] = wrench[:lengths]
    about = np.cross(lever, force)
    moment = wrench[lengths:] - (about if size > 3 else about[2:])
    return np.concatenate([wrench[:lengths], moment])
