"""Offsets in round clearances of an elastic structure that is linear: those of least energy, by Clarabel.

    minimise  u' H u / 2 + R' u   with  |u_j| <= r_j

R is the force in the joints without offsets, H by how much it grows with them. At the optimum the force in a joint
points against its offset, or is zero; these conditions are solved to rounding and checked.
"""

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
#: of forces and clearances, as parts of the largest: what Clarabel's answer is off by
CLOSE = 1e-6
#: the same of stiffnesses: what rounding leaves of zero
ZERO = 1e-7


def contacts(stiffness: Array, force: Array, radii: list[float]) -> Array:
    """The offsets of least energy, in discs or balls."""
    n, axes = len(force), len(force) // len(radii)
    # By Maxwell and Betti it is symmetric. What strains nothing is zero but for rounding.
    values, vectors = np.linalg.eigh((stiffness + stiffness.T) / 2)
    values[values < ZERO * values.max()] = 0.0
    size = np.repeat(radii, axes)
    p = (vectors * values) @ vectors.T * np.outer(size, size)
    q = size * force
    unit = max(np.abs(p).max(), np.abs(q).max())
    p, q = p / unit, q / unit
    rows = np.zeros((n + len(radii), n))
    right = np.zeros(len(rows))
    for j in range(len(radii)):
        right[(axes + 1) * j] = 1.0
        rows[(axes + 1) * j + 1 : (axes + 1) * (j + 1), axes * j : axes * (j + 1)] = -np.eye(axes)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    cones = [clarabel.SecondOrderConeT(axes + 1)] * len(radii)
    conditions = sparse.csc_matrix(rows), right, cones
    found = clarabel.DefaultSolver(sparse.csc_matrix(np.triu(p)), q, *conditions, settings).solve()
    return size * _to_rounding(p, q, np.array(found.x).reshape(-1, axes)).ravel()


def _to_rounding(p: Array, q: Array, offsets: Array) -> Array:
    """Newton steps on the conditions of least energy: a force points against its offset, or is zero."""
    number, axes = offsets.shape
    pressed = -np.sum(offsets * (p @ offsets.ravel() + q).reshape(-1, axes), axis=1)
    touching = np.flatnonzero((np.linalg.norm(offsets, axis=1) > 0.999) & (pressed > CLOSE))
    pressed = pressed[touching]
    for _ in range(4):
        v, spread = offsets.ravel(), np.zeros((number * axes, len(touching)))
        for k, j in enumerate(touching):
            spread[axes * j : axes * (j + 1), k] = offsets[j]
        gap = (np.sum(offsets[touching] ** 2, axis=1) - 1) / 2
        left = np.concatenate([p @ v + q + spread @ pressed, gap])
        own = np.zeros(number)
        own[touching] = pressed
        matrix = np.block([[p + np.diag(np.repeat(own, axes)), spread], [spread.T, np.zeros((len(touching),) * 2)]])
        # Offsets that nothing feels stay where they are.
        step = np.linalg.lstsq(matrix, -left, rcond=1e-12)[0]
        offsets, pressed = (v + step[: len(v)]).reshape(-1, axes), pressed + step[len(v) :]
    v, own[touching] = offsets.ravel(), pressed
    assert np.abs(p @ v + q + np.repeat(own, axes) * v).max() < ZERO
    assert np.linalg.norm(offsets, axis=1).max() < 1 + CLOSE
    assert pressed.min(initial=0.0) >= 0.0
    return offsets
