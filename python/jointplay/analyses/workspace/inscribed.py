"""The largest disc, ball and box within a boundary.

    r(c) = min |c - p|    over the points p of the boundary

is increased from the best nodes by linear programs, each of which moves c by d where the nearest points p_i allow it:
max r such that r <= |c - p_i| + (c - p_i) / |c - p_i| . d. Boxes of many places and proportions are as large as the
points of the boundary let them be; the best of them, by differential evolution, and the largest one of nodes inside
are enlarged by linear programs while planes stand between them and the facets. What is found is in the region; that
nothing larger is, is not proven.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from jointplay.basics.arrays import Flags, Floats, Ints

from .surface import facet_sizes

#: points of a facet along each of its sides, by dimensions, and around what has been found
PARTS, FINE = {2: 8, 3: 3}, 32
#: nodes from which the largest disc is looked for
STARTS = 3
#: points of the boundary that are nearest to a centre and decide where it goes
MOST_POINTS = 300
#: how often a linear program of a box is asked again, with the planes that its last answer met
ROUNDS = 20
#: steps go down to this part of a spacing
SMALLEST = 1.0 / 512.0
#: of planes of about one direction so many decide first how far a box goes, the nearest ones
ALIKE, DIGITS = 3, 2
#: a box is moved where it gains a larger part, and shrinks by this factor where a facet is in it
LEAST_GAIN, SHRINK = 1e-7, 0.97
#: planes are as good as others within this part of the extent
TIE = 1e-9
#: parts of a box that cannot be enlarged, from which it is tried again
SMALLER = (0.95, 0.85, 0.7)
#: by dimensions, how many boxes are tried and improved how often; how slim they may be, as powers of e
BOXES, TRIES, SLIM = {2: 20, 3: 16}, {2: 200, 3: 160}, 1.5
#: by dimensions, nodes along an axis at most among which the largest box of nodes is looked for
MOST_ALONG = {2: 121, 3: 17}
#: the place of a node in a grid
NodePlace = tuple[int, ...]
#: whether places are in a region, shape (place, axis)
Within = Callable[[Floats], Flags]


def samples(points: Floats, facets: Ints, parts: int) -> Floats:
    """Points all over the facets, their corners among them."""
    n = points.shape[1]
    weights = np.array([k for k in itertools.product(range(parts + 1), repeat=n) if sum(k) == parts]) / parts
    return np.asarray(np.einsum("wk,fkx->fwx", weights, points[facets]).reshape(-1, n))


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


def box(points: Floats, facets: Ints, within: Within, centre: Floats | None) -> Floats:
    """The lowest and the highest corner of the largest box with sides along the axes.

    Parameters
    ----------
    points, facets : ndarray
        The boundary.
    within : callable
        Which places are in the region, roughly.
    centre : ndarray, optional
        Where the middle of the box has to be.
    """
    from scipy.optimize import differential_evolution

    n = points.shape[1]
    surface = points[np.unique(facets)]
    low, high = points.min(axis=0), points.max(axis=0)
    free = 0 if centre is not None else n

    def boxes(numbers: Floats) -> tuple[Floats, Floats]:
        """Middles and half the sides of the largest boxes of some proportions, shape (axis, box)."""
        middle = np.repeat(centre[:, None], numbers.shape[1], axis=1) if centre is not None else numbers[:n]
        sides = np.exp(np.vstack([numbers[free:], -numbers[free:].sum(axis=0)])) * (high - low)[:, None]
        parts = np.abs(surface[:, :, None] - middle) / sides
        return middle, sides * parts.max(axis=1).min(axis=0)

    def smallness(numbers: Floats) -> Floats:
        middle, half = boxes(numbers)
        with np.errstate(divide="ignore"):
            return np.where(within(middle.T), -np.log(half).sum(axis=0), np.inf)

    limits = [*zip(low, high, strict=True)][:free] + [(-SLIM, SLIM)] * (n - 1)
    found = differential_evolution(
        smallness,
        limits,
        seed=0,
        vectorized=True,
        updating="deferred",
        polish=False,
        popsize=BOXES[n],
        maxiter=TRIES[n],
        tol=1e-5,
    )
    middle, half = (values[:, 0] for values in boxes(found.x[:, None]))
    return larger_box(points, facets, np.stack([middle - half, middle + half]), centred=centre is not None)


def box_of_nodes(inside: Flags, values: Sequence[Floats]) -> Floats:
    """The lowest and the highest corner of the largest box whose nodes, of every few of a fine grid, are all inside.

    Parameters
    ----------
    inside : ndarray
        Over the axes.
    values : sequence of ndarray
        Coordinates along them.
    """
    most = MOST_ALONG[len(values)]
    every = [along[:: -(-len(along) // most)] for along in values]
    some = inside[np.ix_(*(np.searchsorted(along, few) for along, few in zip(values, every, strict=True)))]
    _, places = _largest_of(some, [float(along[-1] - along[0]) / max(len(along) - 1, 1) for along in every])
    return np.array([[along[place] for along, place in zip(every, end, strict=True)] for end in places])


def _largest_of(inside: Flags, steps: Sequence[float]) -> tuple[float, tuple[NodePlace, NodePlace]]:
    """Size and ends, as places in the grid, of the largest box of nodes."""
    nothing = (0,) * inside.ndim
    best: tuple[float, tuple[NodePlace, NodePlace]] = 0.0, (nothing, nothing)
    if inside.ndim == 1:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], inside, [0]])))
        if edges.size:
            k = int((edges[1::2] - edges[::2]).argmax())
            first, last = int(edges[2 * k]), int(edges[2 * k + 1]) - 1
            best = (last - first) * steps[0], ((first,), (last,))
        return best
    for first in range(len(inside)):
        both = inside[first]
        for last in range(first + 1, len(inside)):
            both = both & inside[last]
            size = (last - first) * steps[0]
            if not both.any():
                break
            found, (low, high) = _largest_of(both, steps[1:])
            if size * found > best[0]:
                best = size * found, ((first, *low), (last, *high))
    return best


def larger_box(points: Floats, facets: Ints, ends: Floats, *, centred: bool) -> Floats:
    """The largest box near one, whose middle is in the region.

    Parameters
    ----------
    points, facets : ndarray
        The boundary.
    ends : ndarray
        The lowest and the highest corner of a box.
    centred : bool
        Whether its middle stays where it is.
    """
    planes = _Planes(points[facets[facet_sizes(points, facets) > 0.0]])
    # Between the samples a corner may have come through.
    best = _enlarged(planes.within(ends), planes, centred=centred)
    # Steps end early where a corner stands against several facets; from a smaller box they pass.
    for part in SMALLER:
        middle, half = best.mean(axis=0), 0.5 * part * (best[1] - best[0])
        again = _enlarged(np.stack([middle - half, middle + half]), planes, centred=centred)
        best = max(best, again, key=lambda one: float(np.prod(one[1] - one[0])))
    return best


class _Planes:
    """Planes that may stand between a box and facets, several for each facet.

    Two convex bodies are apart if and only if one of their own directions, or one across an edge of both, separates
    them (Gottschalk, Lin and Manocha 1996). With such a plane held, the condition on the box is linear in its ends.
    """

    def __init__(self, corners: Floats) -> None:
        n = corners.shape[2]
        sides = np.roll(corners, -1, axis=1) - corners
        own = sides[:, :1, ::-1] * [1.0, -1.0] if n == 2 else np.cross(sides[:, 0], sides[:, 1])[:, None]
        across = [np.cross(sides, axis) for axis in np.eye(3)] if n == 3 else []
        axes = np.broadcast_to(np.eye(n), (len(corners), n, n))
        normal = np.concatenate([own, -own, axes, -axes, *across, *(-one for one in across)], axis=1)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        #: no box is larger than what the facets reach over
        self.most = np.ptp(corners.reshape(-1, n), axis=0)
        self.normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
        support = np.einsum("fkx,fcx->fkc", self.normal, corners).min(axis=2)
        self.support = np.where(length[..., 0] > 0.0, support, -np.inf)
        own_sides, across_axes = (0, 1), [(2 + k, 2 + n + k) for k in range(n)]
        #: columns of planes to prefer: none, the facet's own, those across an axis
        self.choices: list[list[tuple[int, int]]] = [[], [own_sides], *([one, own_sides] for one in across_axes)]

    def gaps(self, ends: Floats, liked: Sequence[tuple[int, int]] = ()) -> tuple[Floats, Floats]:
        """How far every facet is from a box, negative where it is in it, and the normal of the plane between them.

        The plane is the first one of those that are liked which stands between, or the farthest one: a box that can go
        no farther with one choice can with another.
        """
        reach = np.maximum(self.normal, 0.0) @ ends[1] + np.minimum(self.normal, 0.0) @ ends[0]
        gaps = self.support - reach
        best, every = gaps.argmax(axis=1), np.arange(len(gaps))
        for pair in reversed(liked):
            other = np.array(pair)[gaps[:, pair].argmax(axis=1)]
            best = np.where(gaps[every, other] >= -TIE * float(np.ptp(ends)), other, best)
        return gaps[every, best], self.normal[every, best]

    def within(self, ends: Floats) -> Floats:
        """A box, smaller where a facet reaches into it."""
        middle, half = ends.mean(axis=0), 0.5 * (ends[1] - ends[0])
        while self.gaps(ends)[0].min() < 0.0:
            # On a facet there is room for nothing.
            half = half * (SHRINK if (half > TIE * self.most).any() else 0.0)
            if not half.any():
                return np.stack([middle, middle])
            ends = np.stack([middle - half, middle + half])
        return ends


def _enlarged(ends: Floats, planes: _Planes, *, centred: bool) -> Floats:
    """A box made larger as long as that goes, by linear programs within steps that shrink."""
    step = float((ends[1] - ends[0]).max())
    smallest = SMALLEST * step
    while step > smallest:
        for liked in planes.choices:
            moved = _step(ends, planes, step, liked, centred=centred)
            if moved is not None and np.prod(moved[1] - moved[0]) > np.prod(ends[1] - ends[0]) * (1.0 + LEAST_GAIN):
                ends = moved
                # A slim box may have far to go.
                step = max(step, min(2.0 * step, float(planes.most.max()) / 8.0))
                break
        else:
            step *= 0.25
    return ends


def _step(
    ends: Floats, planes: _Planes, most: float, liked: Sequence[tuple[int, int]], *, centred: bool
) -> Floats | None:
    """The best box of which no side is farther than a step from that of one, as far as planes between allow it."""
    from scipy.optimize import linprog

    gaps, normal = planes.gaps(ends, liked)
    outwards, inwards = np.maximum(normal, 0.0), np.minimum(normal, 0.0)
    # What of the box moves: half its sides, or its lowest and its highest corner.
    rows = outwards - inwards if centred else np.column_stack([inwards, outwards])
    gain = 1.0 / (ends[1] - ends[0])
    cost = -gain if centred else np.concatenate([gain, -gain])
    asked = (gaps < 2.0 * ends.shape[1] * most) & (_nth_alike(normal, gaps) < ALIKE)
    for _ in range(ROUNDS):
        found = linprog(cost, rows[asked], gaps[asked], bounds=[(-most, most)] * len(cost))
        if found.status != 0:
            break
        moved = ends + (np.stack([-found.x, found.x]) if centred else found.x.reshape(ends.shape))
        sides = moved[1] - moved[0]
        if not ((sides > 0.0) & (sides <= planes.most)).all():
            break
        met = planes.gaps(moved)[0] < 0.0
        if not met.any():
            return np.asarray(moved)
        # The program is asked again with the planes that this answer met.
        if not (met & ~asked).any():
            break
        asked |= met
    return None


def _nth_alike(normals: Floats, gaps: Floats) -> Ints:
    """The how manieth of its direction every plane is, the nearest first."""
    groups = np.unique(np.round(normals, DIGITS), axis=0, return_inverse=True)[1].reshape(-1)
    order = np.lexsort((gaps, groups))
    found = np.empty(len(normals), dtype=np.intp)
    found[order] = np.arange(len(normals)) - np.searchsorted(groups[order], groups[order])
    return found
