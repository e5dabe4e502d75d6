"""What a drawing leaves open: parts that are drawn so that redundant joints cannot all be closed.

Where N rows hold n unknowns, the core closes n of them; the others miss by the gaps g, rows that are closed have none.
With the self-stresses Y (left null space of the closure Jacobian) the part of the gaps that no motion of the bodies
removes is Y^T g, and a length l closes all loops to first order if

    Y^T (g + dg/dl l) = 0 .
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS, TURNS
from jointplay.model.mechanism import Mechanism

#: gaps below this share of the characteristic length (or angle in radians) are rounding
CLOSED = 1e-9
#: gaps below this share of the largest are what closing others leaves to the second order
SECOND_ORDER = 1e-3
#: step of a length for a derivative, as a share of the characteristic one
STEP = 1e-6
#: changes of a length that are named
MOST_CURES = 3
#: share of the misfit that a single length may leave open and still count as closing it: the second order
LEFT = 0.02


@dataclass(frozen=True)
class Misfit:
    """What stays open in nominal poses."""

    #: per joint or elastic member that does not close how far it is open at most: metres, and radians
    gaps: dict[str, tuple[float, float]]
    #: lengths of which any one alone closes everything: body, from which joint to which, by how much longer (metres);
    #: the smallest change first
    cures: tuple[tuple[str, str, str, float], ...]


def misfit(m: Mechanism, drives: Floats, placed: Floats) -> Misfit | None:
    """What nominal poses of a mechanism leave open; None where everything closes.

    Parameters
    ----------
    drives : ndarray
        Drive values, SI; shape (configuration, drive).
    placed : ndarray
        Poses of all bodies there; shape (configuration, body, pose).
    """
    turns = np.array([component in TURNS for _, component in m.core.rows])
    gaps = m.core.gaps(drives, placed)
    sizes = np.abs(gaps).max(axis=0) / np.where(turns, 1.0, m.length)
    open_ = sizes > max(CLOSED, SECOND_ORDER * float(sizes.max()))
    if not open_.any():
        return None
    inner = {member.joint: member.name for member in m.members}
    joints = np.array([joint for joint, _ in m.core.rows])
    found = {}
    for joint in dict.fromkeys(joints[open_].tolist()):
        far = [np.linalg.norm(gaps[:, (joints == joint) & kind & open_], axis=1).max() for kind in (~turns, turns)]
        found[inner.get(joint, m.joints[joint])] = (float(far[0]), float(far[1]))
    return Misfit(found, tuple(_cures(m, drives, placed, gaps)))


def _cures(m: Mechanism, drives: Floats, placed: Floats, gaps: Floats) -> list[tuple[str, str, str, float]]:
    """Single lengths that close everything everywhere."""
    stresses = _self_stresses(m, placed)

    def observable(gaps: Floats) -> Floats:
        return np.asarray(np.einsum("nrs,nr->ns", stresses, gaps)).ravel()

    missing, found = observable(gaps), []
    for body, first, second, moves in _lengths(m, placed[0]):
        places = {point: m.points[point].at + STEP * m.length * along for point, along in moves.items()}
        core = m.varied(points=m.moved(places))
        slope = observable(core.gaps(drives, placed) - gaps) / (STEP * m.length)
        if not slope @ slope > 0.0:
            continue
        length = -float(slope @ missing / (slope @ slope))
        if np.linalg.norm(missing + slope * length) <= LEFT * np.linalg.norm(missing):
            found.append((body, first, second, length))
    return sorted(found, key=lambda cure: abs(cure[3]))


def _self_stresses(m: Mechanism, placed: Floats) -> Floats:
    """Left null spaces of the closure Jacobians; shape (configuration, row, number)."""
    turns = np.array([component in TURNS for _, component in m.core.rows])
    units = np.where(turns, 1.0, m.length)[:, None]
    unit = np.where(np.isin(m.components, LENGTHS), m.length, 1.0)
    scaled = m.core.jacobian(placed) / units * np.tile(unit, len(m.bodies))
    return np.asarray(np.linalg.svd(scaled)[0][..., scaled.shape[-1] :] / units)


def _lengths(m: Mechanism, placed: Floats) -> Iterator[tuple[str, str, str, dict[int, Floats]]]:
    """Distances on bodies from the first of their joints to every other one.

    Yields the body, the two joints, and the points that move with the second one, each with the direction in which.
    """
    inner = {member.joint for member in m.members}
    on: dict[str, dict[int, str]] = {}
    for k, ends in enumerate(m.joint_points):
        for end in ends:
            body = m.points[end].body
            if k not in inner and body >= 0 and body not in m.crosses:
                on.setdefault(m.owners[body], {}).setdefault(end, m.joints[k])
    for owner, joints in on.items():
        places = {k: poses.place(placed[m.points[k].body], m.points[k].at) for k in joints}
        (start, first), *others = joints.items()
        taken = [places[start]]
        for point, name in others:
            if min(float(np.linalg.norm(places[point] - at)) for at in taken) <= CLOSED * m.length:
                continue
            taken.append(places[point])
            direction = (places[point] - places[start]) / np.linalg.norm(places[point] - places[start])
            there = [k for k in joints if np.linalg.norm(places[k] - places[point]) <= CLOSED * m.length]
            turned = {k: poses.matrix(placed[m.points[k].body]).T @ direction for k in there}
            yield owner, first, name, turned


def misfit_words(m: Mechanism, found: Misfit) -> str:
    """What does not close, and what would close it, in units of the file."""
    cures = [
        f"'{body}' {abs(length) / m.units.length:.4g} {m.units.length_name} {'longer' if length > 0 else 'shorter'}"
        f" from {first} to {second}"
        for body, first, second, length in found.cures[:MOST_CURES]
    ]
    would = f"it closes with {' or '.join(cures)}" if cures else "no single length closes it"
    return f"as drawn, joints stay open where all others are closed: {gaps_words(m, found)}; {would}"


def gaps_words(m: Mechanism, found: Misfit) -> str:
    """By how much every joint is open."""
    units, gaps = m.units, []
    for joint, (gap, turn) in found.gaps.items():
        sizes = [f"{gap / units.length:.4g} {units.length_name}"] if gap > 0.0 else []
        sizes += [f"{turn / units.angle:.4g} {units.angle_name}"] if turn > 0.0 else []
        gaps.append(f"'{joint}' by {' and '.join(sizes)}")
    return ", ".join(gaps)
