"""The largest disc, ball and box within a boundary.

    r(c) = min |c - p|    over the points p of the boundary

is increased from the best nodes by linear programs, each of which moves c where the nearest points p_i allow it:
max r such that r <= |c - p_i| + (c - p_i) / |c - p_i| . d. A box holds no point of the boundary; from the largest one
of nodes on, one face is moved inwards and the others outwards as far as they go, by smaller and smaller steps.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from jointplay.basics.arrays import Flags, Floats, Ints

#: points of a facet along each of its sides, by dimensions, and around what has been found
PARTS, FINE = {2: 8, 3: 3}, 32
#: nodes from which the largest disc is looked for
STARTS = 3
#: points of the boundary that are nearest to a centre and decide where it goes
MOST_POINTS = 300
#: steps go down to this part of a spacing
SMALLEST = 1.0 / 512.0
#: nodes along an axis in space among which the first box is looked for
MOST = 24
#: planes between which a box about a centre is looked for, and how often
PLANES, ROUNDS = 60, 3


def samples(points: Floats, facets: Ints, parts: int) -> Floats:
    """Points all over the facets, their corners among them."""
    n = points.shape[1]
    weights = np.array([k for k in itertools.product(range(parts + 1), repeat=n) if sum(k) == parts]) / parts
    return np.einsum("wk,fkx->fwx", weights, points[facets]).reshape(-1, n)


def disc(points: Floats, facets: Ints, nodes: Floats, spacing: float, centre: Floats | None) -> tuple[Floats, float]:
    """Centre and radius of the largest disc or ball; about a centre that is given, if one is.

    Parameters
    ----------
    points, facets : ndarray
        The boundary.
    nodes : ndarray
        Those inside, shape (node, axis).
    spacing : float
        Of the nodes.
    centre : ndarray, optional
        Inside.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(samples(points, facets, PARTS[points.shape[1]]))
    if centre is None:
        far = tree.query(nodes)[0]
        centre, best = nodes[0], -np.inf
        for _ in range(min(STARTS, len(nodes))):
            first = int(np.argmax(far))
            if not far[first] > 0.0:
                break
            found, radius = _moved(tree, nodes[first], spacing)
            if radius > best:
                centre, best = found, radius
            # Nodes of the same disc lead to the same one.
            far = np.where(np.linalg.norm(nodes - nodes[first], axis=1) < 0.5 * far[first], 0.0, far)
    radius = float(tree.query(centre)[0])
    near = (np.linalg.norm(points[facets] - centre, axis=2) < radius + 3.0 * spacing).any(axis=1)
    return centre, float(np.linalg.norm(samples(points, facets[near], FINE) - centre, axis=1).min())


def _moved(tree: Any, centre: Floats, spacing: float) -> tuple[Floats, float]:
    """A centre with a locally largest distance from the points of a tree."""
    from scipy.optimize import linprog

    n, step = len(centre), spacing
    radius = float(tree.query(centre)[0])
    while step > SMALLEST * spacing:
        _, nearest = tree.query(centre, min(MOST_POINTS, tree.n), distance_upper_bound=radius + 2.0 * np.sqrt(n) * step)
        away = centre - tree.data[nearest[nearest < tree.n]]
        far = np.linalg.norm(away, axis=1)
        rows = np.column_stack([-away / far[:, None], np.ones(len(far))])
        found = linprog([0.0] * n + [-1.0], rows, far, bounds=[(-step, step)] * n + [(0.0, None)])
        moved = centre + found.x[:n] if found.status == 0 else centre
        reached = float(tree.query(moved)[0])
        if reached > radius * (1.0 + 1e-12):
            centre, radius = moved, reached
        else:
            step *= 0.25
    return centre, radius


def box(
    points: Floats, facets: Ints, values: list[Floats], inside: Flags, spacing: float, centre: Floats | None
) -> tuple[Floats, Floats]:
    """The lowest and the highest corner of the largest box with sides along the axes.

    Parameters
    ----------
    points, facets : ndarray
        The boundary.
    values : list of ndarray
        Of the nodes along each axis.
    inside : ndarray
        Which nodes are in the region.
    spacing : float
        Of the nodes.
    centre : ndarray, optional
        Where the middle of the box has to be; inside.
    """
    n = points.shape[1]
    surface = samples(points, facets, PARTS[n])
    if centre is not None:
        half = _half_sides(np.abs(surface - centre), np.ptp(surface, axis=0))
        return centre - half, centre + half
    low, high = _of_nodes(values, inside)
    margin = 4.0 * spacing
    near = ((surface > low - margin) & (surface < high + margin)).all(axis=1)
    return _grown(low, high, surface[near], spacing, margin)


def _half_sides(away: Floats, most: Floats) -> Floats:
    """Half the sides of the largest box about the origin that has none of some points in it; all coordinates >= 0."""
    if away.shape[1] == 2:
        order = np.argsort(away[:, 0])
        across = np.concatenate([[most[1]], np.minimum.accumulate(away[order, 1])[:-1]])
        k = int(np.argmax(away[order, 0] * across))
        return np.array([away[order[k], 0], across[k]])
    best, found = -1.0, np.zeros(3)
    low, high = 0.0, float(away[:, 2].max())
    for _ in range(ROUNDS):
        planes = np.linspace(low, high, PLANES)[1:]
        for plane in planes.tolist():
            within = away[away[:, 2] < plane]
            half = _half_sides(within[:, :2], most) if len(within) else np.zeros(2)
            if half.prod() * plane > best:
                best, found = float(half.prod() * plane), np.array([*half, plane])
        step = float(planes[1] - planes[0])
        low, high = max(0.0, found[2] - 2.0 * step), found[2] + 2.0 * step
    return found


def _of_nodes(values: list[Floats], inside: Flags) -> tuple[Floats, Floats]:
    """The largest box of which all nodes are inside."""
    if inside.ndim == 2:
        return _rectangle(values, inside)[1:]
    every = [max(1, -(-len(along) // MOST)) for along in values]
    values = [along[::step] for along, step in zip(values, every, strict=True)]
    inside = inside[tuple(slice(None, None, step) for step in every)]
    best, found = -1.0, (np.zeros(3), np.zeros(3))
    for i in range(len(values[0])):
        all_between = np.ones_like(inside[0])
        for j in range(i, len(values[0])):
            all_between = all_between & inside[j]
            side = float(values[0][j] - values[0][i])
            # No box between these planes is larger than their common part.
            if not all_between.any():
                break
            if side * np.ptp(values[1]) * np.ptp(values[2]) <= best:
                continue
            area, low, high = _rectangle(values[1:], all_between)
            if area * side > best:
                best = area * side
                found = np.array([values[0][i], *low]), np.array([values[0][j], *high])
    return found


def _rectangle(values: list[Floats], inside: Flags) -> tuple[float, Floats, Floats]:
    """Area and corners of the largest rectangle of which all nodes are inside."""
    x, y = values
    best, found = -1.0, (np.array([x[0], y[0]]), np.array([x[0], y[0]]))
    all_between = inside
    for rows in range(len(x)):
        # From every row over as many more: where all nodes are inside, and how long the runs of them are.
        all_between = all_between[: len(x) - rows] & inside[rows:]
        if not all_between.any():
            break
        start = np.where(all_between, np.inf, -np.inf)
        first = np.full(len(all_between), np.inf)
        for k in range(len(y)):
            first = np.where(all_between[:, k], np.minimum(first, y[k]), np.inf)
            start[:, k] = first
        runs = np.where(all_between, y - start, -1.0)
        area = runs.max(axis=1) * (x[rows:] - x[: len(x) - rows])
        i = int(np.argmax(area))
        if area[i] > best:
            k = int(np.argmax(runs[i]))
            best, found = float(area[i]), (np.array([x[i], start[i, k]]), np.array([x[i + rows], y[k]]))
    return best, *found


def _grown(low: Floats, high: Floats, surface: Floats, spacing: float, most: float) -> tuple[Floats, Floats]:
    """A box made larger as long as that goes: no point of the surface is in it."""
    n = len(low)
    ends = np.stack([low, high])
    bounds = np.stack([low - most, high + most])
    faces = list(itertools.product(range(2), range(n)))

    def grow(ends: Floats, side: int, axis: int) -> None:
        others = [k for k in range(n) if k != axis]
        beside = ((surface[:, others] > ends[0, others]) & (surface[:, others] < ends[1, others])).all(axis=1)
        along, middle = surface[beside, axis], 0.5 * (ends[0, axis] + ends[1, axis])
        if side:
            ends[1, axis] = min(along[along > middle].min(initial=np.inf), bounds[1, axis])
        else:
            ends[0, axis] = max(along[along <= middle].max(initial=-np.inf), bounds[0, axis])

    def volume(ends: Floats) -> float:
        return float(np.prod(ends[1] - ends[0]))

    def tried(step: float) -> Floats:
        best = ends
        for k, (side, axis) in enumerate(faces):
            for first in range(1, len(faces)):
                trial = ends.copy()
                trial[side, axis] += step * (1.0 if side == 0 else -1.0)
                if trial[0, axis] >= trial[1, axis]:
                    continue
                for other in (*range(first, len(faces)), *range(1, first), 0):
                    grow(trial, *faces[(k + other) % len(faces)])
                if volume(trial) > volume(best) * (1.0 + 1e-12):
                    best = trial
        return best

    step = spacing
    while step > SMALLEST * spacing:
        larger = tried(step)
        if larger is ends:
            step *= 0.5
        ends = larger
    return ends[0], ends[1]
