"""The region of a workspace: its nodes in all orientations, and the points where edges of the grid leave it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from jointplay.analyses.map.answering import MapQuestion
from jointplay.basics.arrays import Flags, Floats, Ints, Texts
from jointplay.model.mechanism import Mechanism

from .asked import AskedGrid
from .corners import FAR, cuts, outside
from .crossing import Ways, leave
from .holding import EDGE, WIDTH, HeldPlaces, OneOrientation
from .surface import CrossedEdges, directions, framed, framed_values

#: axes of a region whose corners are found
PLANE = 2
#: part of the work that the nodes are
NODES = 0.7
#: called with the part of the work that is done
PartDone = Callable[[float], None]


@dataclass(frozen=True)
class HeldRegion:
    """A region and its boundary, file units."""

    #: with the output that the grid speaks of
    m: Mechanism
    asked: AskedGrid
    #: which nodes are in it, over the axes
    inside: Flags
    #: what keeps the mechanism from every node; empty also where a region apart from this one is
    why: Texts
    #: nodes of such regions
    apart: int
    #: distance from the start to the nearest node of the region, in cells
    far: float
    #: those that lead out of it
    edges: CrossedEdges
    #: where they do, shape (edge, axis); then the corners that they cut off, in the plane
    points: Floats
    #: what ends each of them
    bound: Texts
    #: by corner the two edges between which it is
    cut: dict[int, tuple[int, int]]

    @property
    def values(self) -> list[Floats]:
        """Of the nodes along each axis."""
        return list(self.asked.axes.values())

    @property
    def nodes(self) -> Floats:
        """Positions of the nodes inside, shape (node, axis)."""
        return places(self.values)[self.inside.ravel()]

    def facets(self) -> Ints:
        """The segments or triangles of the boundary, around its corners."""
        return self._around_corners(self.edges.facets(), 1.0)

    def coarse(self) -> Ints:
        """Those of the boundary by every second node."""
        return self._around_corners(self.edges.halved().facets(), 2.0)

    def _around_corners(self, facets: Ints, times: float) -> Ints:
        """Segments, of which those that cut a corner off go around it."""
        by_bounds: dict[frozenset[str], list[int]] = {}
        for corner, ends in self.cut.items():
            by_bounds.setdefault(frozenset(self.bound[[*ends]].tolist()), []).append(corner)
        kept, added = np.ones(len(facets), dtype=bool), []
        for k in np.flatnonzero(self.bound[facets[:, 0]] != self.bound[facets[:, -1]]).tolist() if by_bounds else ():
            a, b = facets[k].tolist()
            near = by_bounds.get(frozenset(self.bound[[a, b]].tolist()), [])
            away = [float(np.abs(self.points[one] - self.points[[a, b]]).max()) for one in near]
            if not near or min(away) > FAR * times * self.asked.spacing:
                continue
            corner = near[int(np.argmin(away))]
            if outside(self.points, facets[k], self.points[corner]) > 0.0:
                kept[k] = False
                added += [(a, corner), (corner, b)]
        return np.concatenate([facets[kept], np.array(added, dtype=facets.dtype).reshape(-1, facets.shape[1])])

    def is_cut(self, facets: Ints) -> Flags:
        """Which facets are between points that different things bound, and may cut an edge of the region off."""
        ends = np.where(facets < len(self.edges), facets, facets.min(axis=1, keepdims=True))
        return np.asarray((self.bound[ends] != self.bound[ends[:, :1]]).any(axis=1))

    def holds(self, positions: Floats) -> Flags:
        """Whether the nodes next to some positions are inside."""
        nearest = [
            np.clip(np.searchsorted(0.5 * (along[1:] + along[:-1]), positions[:, k]), 0, len(along) - 1)
            for k, along in enumerate(self.values)
        ]
        return np.asarray(self.inside[tuple(nearest)])


def region(
    whole: Mechanism, asked: AskedGrid, start: Floats, asks: Sequence[MapQuestion], tolerance: float, part: PartDone
) -> HeldRegion:
    """The region of a grid.

    Parameters
    ----------
    whole : Mechanism
        With all outputs and load cases.
    start : ndarray
        Position along every axis at the start, file units.
    asks : sequence of MapQuestion
        Whose limits have to hold.
    tolerance : float
        Of the boundary along edges, file units.
    """
    every: list[tuple[OneOrientation, HeldPlaces]] = []
    count = len(asked.orientations)
    part(0.0)
    for k, orientation in enumerate(asked.orientations):
        one = OneOrientation(asked.of(whole, orientation), asks)
        every.append((one, one.nodes(partial(_advance, part, k, count))))
        part(NODES * (k + 1) / count)
    why = every[0][1].why
    for _, held in every[1:]:
        why = np.where(why == "", held.why, why)
    why = why.reshape([len(values) for values in asked.axes.values()])
    inside, far = connected(np.asarray(why == ""), asked, start)
    edges = CrossedEdges.of(framed(inside))
    points, bound = _boundary(every, asked, edges, tolerance, lambda done: part(NODES + (1.0 - NODES) * done))
    points, bound, cut = _with_corners(every, asked, edges, points, bound, tolerance)
    apart = int(np.count_nonzero(why == "") - np.count_nonzero(inside))
    return HeldRegion(every[0][0].m, asked, inside, why, apart, far, edges, points, bound, cut)


def _advance(part: PartDone, orientation: int, count: int, done: int, of: int) -> None:
    part(NODES * (orientation + done / of) / count)


def coarse_region(whole: Mechanism, asked: AskedGrid, start: Floats) -> Flags:
    """The nodes of a region in its first orientation, without its boundary."""
    one = OneOrientation(asked.of(whole, asked.orientations[0]), ())
    held = one.nodes().inside.reshape([len(values) for values in asked.axes.values()])
    return connected(held, asked, start)[0]


def connected(held: Flags, asked: AskedGrid, start: Floats) -> tuple[Flags, float]:
    """The part of some nodes that hangs together with the one nearest to the start, and how far that is in cells."""
    from scipy.ndimage import label

    if not held.any():
        return held, np.inf
    beside = np.zeros((3,) * held.ndim, dtype=bool)
    beside[(1,) * held.ndim] = True
    for d in directions(held.ndim):
        beside[tuple(1 + k for k in d)] = beside[tuple(1 - k for k in d)] = True
    numbers = label(held, beside)[0]
    cells = [float(np.diff(values).max()) for values in asked.axes.values()]
    far = np.linalg.norm((places(list(asked.axes.values())) - start) / cells, axis=1)
    far[~held.ravel()] = np.inf
    nearest = int(np.argmin(far))
    return np.asarray(numbers == numbers.ravel()[nearest]), float(far[nearest])


def places(values: list[Floats]) -> Floats:
    """The positions of all nodes, the last axis fastest."""
    return np.stack([along.ravel() for along in np.meshgrid(*values, indexing="ij")], axis=1)


def _boundary(
    every: list[tuple[OneOrientation, HeldPlaces]],
    asked: AskedGrid,
    edges: CrossedEdges,
    tolerance: float,
    part: PartDone,
) -> tuple[Floats, Texts]:
    """Where the edges leave the region: in the orientation in which they do first."""
    values = list(asked.axes.values())
    framed_places = places([framed_values(along) for along in values])
    first, last = framed_places[edges.inner], framed_places[edges.outer]
    nodes = [np.stack(np.unravel_index(ends, edges.inside.shape)) - 1 for ends in (edges.inner, edges.outer)]
    shape = np.array([len(along) for along in values])[:, None]
    is_edge = ((nodes[1] < 0) | (nodes[1] >= shape)).any(axis=0)
    low = np.where(is_edge, 0.0, 1.0)
    bound = np.where(is_edge, EDGE, "").astype(WIDTH)
    inner, outer = (np.ravel_multi_index(tuple(end), shape.ravel(), mode="clip") for end in nodes)
    for k, (one, held) in enumerate(every):
        ways = np.flatnonzero(~is_edge & (held.why[outer] != ""))
        length = np.linalg.norm(last[ways] - first[ways], axis=1)
        room = held.room[np.stack([inner[ways], outer[ways]])]
        found = Ways(inner[ways], one.rows[outer[ways]], length, held.why[outer[ways]], room)
        gone, why = leave(one, found, tolerance)
        sooner = ways[gone < low[ways]]
        low[sooner], bound[sooner] = gone[gone < low[ways]], why[gone < low[ways]]
        part((k + 1) / len(every))
    return first + low[:, None] * (last - first), bound


def _with_corners(
    every: list[tuple[OneOrientation, HeldPlaces]],
    asked: AskedGrid,
    edges: CrossedEdges,
    points: Floats,
    bound: Texts,
    tolerance: float,
) -> tuple[Floats, Texts, dict[int, tuple[int, int]]]:
    """The points of a boundary in the plane with the corners that lines between them cut off."""
    facets = edges.facets()
    if len(asked.axes) != PLANE or not len(facets):
        return points, bound, {}
    # In spacings: along a short side of the region they are smaller.
    steps = np.array([np.diff(along).max() for along in asked.axes.values()])
    found = cuts(points / steps, bound, facets)
    ends = facets[found.facet]
    nodes = np.stack(np.unravel_index(edges.inner[ends[:, 0]], edges.inside.shape)) - 1
    values = list(asked.axes.values())
    inner = np.ravel_multi_index(tuple(nodes), tuple(map(len, values)))
    first = places(values)[inner]
    to = found.to * steps
    way = to - first
    low, why = np.ones(len(ends)), bound[ends[:, 0]]
    for one, held in every:
        room = np.stack([held.room[inner], np.full(len(inner), np.nan)])
        unknown = np.full(len(inner), "", dtype=WIDTH)
        ways = Ways(inner, one.commands_at(to), np.linalg.norm(way, axis=1), unknown, room)
        gone, ended = leave(one, ways, tolerance)
        why = np.where((gone < low) & (ended != ""), ended, why)
        low = np.minimum(low, gone)
    corners = first + low[:, None] * way
    cut = {len(points) + k: (a, b) for k, (a, b) in enumerate(ends.tolist())}
    return np.concatenate([points, corners]), np.concatenate([bound, why]), cut
