"""The boundary of a region of nodes, by marching simplices on Kuhn's triangulation of the grid.

Every cell is cut into n! simplices along 0, e_a, e_a + e_b, ... (Kuhn 1960; Allgower and Georg, Numerical Continuation
Methods, chapter 12), so that neighbouring simplices share whole faces and the boundary is closed without cases that are
ambiguous. Where an edge leads out of the region is known beforehand, so that nothing is interpolated:

    size = 1/n! sum over the facets of det(p_1 - o, ..., p_n - o)        divergence theorem, o anywhere

The edges of every second node are made of two of these, so that the boundary on twice the spacing costs nothing.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Flags, Floats, Ints

#: from a node to another one of its cell
KuhnStep = tuple[int, ...]


def directions(dimensions: int) -> list[KuhnStep]:
    """The directions of the edges of the triangulation."""
    return [d for d in itertools.product((0, 1), repeat=dimensions) if any(d)]


def framed(inside: Flags) -> Flags:
    """A region with nodes beyond the ends of the grid, of which none is inside: an odd number along each axis."""
    return np.pad(inside, [(1, 1 + (count + 1) % 2) for count in inside.shape])


def framed_values(values: Floats) -> Floats:
    """Coordinates of these nodes along an axis: those beyond the ends lie on them."""
    return np.pad(values, (1, 1 + (len(values) + 1) % 2), mode="edge")


@dataclass(frozen=True)
class CrossedEdges:
    """The edges that lead out of a region."""

    #: the framed region
    inside: Flags
    #: by direction: the number of the edge from each node on, -1 where it leads out of nothing
    number: dict[KuhnStep, Ints]
    #: `inner`, `outer`: the nodes at the ends of every edge, as places in the flattened region
    inner: Ints
    outer: Ints

    @classmethod
    def of(cls, inside: Flags) -> CrossedEdges:
        """Those of a framed region."""
        nodes = np.arange(inside.size).reshape(inside.shape)
        number: dict[KuhnStep, Ints] = {}
        inner: list[Ints] = [np.zeros(0, np.int64)]
        outer: list[Ints] = [np.zeros(0, np.int64)]
        total = 0
        for d in directions(inside.ndim):
            low, high = _ends(d)
            crossed = inside[low] != inside[high]
            of_one = np.full(inside.shape, -1, dtype=np.int64)
            of_one[low][crossed] = total + np.arange(np.count_nonzero(crossed))
            number[d] = of_one
            first, second, is_first = nodes[low][crossed], nodes[high][crossed], inside[low][crossed]
            inner.append(np.where(is_first, first, second))
            outer.append(np.where(is_first, second, first))
            total += len(first)
        return cls(inside, number, np.concatenate(inner), np.concatenate(outer))

    def __len__(self) -> int:
        return len(self.inner)

    def halved(self) -> CrossedEdges:
        """The same region by every second node, with the numbers that its edges have here."""
        every = tuple(slice(None, None, 2) for _ in self.inside.shape)
        inside = self.inside[every]
        number = {}
        for d, of_one in self.number.items():
            low, high = _ends(d)
            coarse = np.full(inside.shape, -1, dtype=np.int64)
            halves = np.roll(of_one, [-k for k in d], axis=range(len(d)))
            first, second = of_one[every][low], halves[every][low]
            crossed = inside[low] != inside[high]
            coarse[low] = np.where(crossed, np.where(first >= 0, first, second), -1)
            number[d] = coarse
        return CrossedEdges(inside, number, self.inner, self.outer)

    def facets(self) -> Ints:
        """The facets of the boundary by the numbers of the edges that they cut, seen from outside counterclockwise."""
        n = self.inside.ndim
        found: list[Ints] = [np.zeros((0, n), np.int64)]
        for order in itertools.permutations(range(n)):
            corners = np.zeros((n + 1, n), dtype=np.int64)
            for k, axis in enumerate(order):
                corners[k + 1 :, axis] = 1
            cells = [tuple(slice(k, k - 1 or None) for k in corner) for corner in corners.tolist()]
            code = np.sum([self.inside[cell].astype(np.int64) << k for k, cell in enumerate(cells)], axis=0)
            is_odd = np.linalg.det(np.eye(n)[list(order)]) < 0.0
            for case, facets in FACETS[n].items():
                at = np.nonzero(code == case)
                for facet in facets:
                    ids = []
                    for i, j in facet:
                        i, j = min(i, j), max(i, j)
                        node = tuple(place + step for place, step in zip(at, corners[i].tolist(), strict=True))
                        ids.append(self.number[tuple((corners[j] - corners[i]).tolist())][node])
                    found.append(np.stack(ids[:2][::-1] + ids[2:] if is_odd else ids, axis=1))
        return np.concatenate(found)


def _ends(d: KuhnStep) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """The nodes where edges of a direction begin, and where they end."""
    return tuple(slice(None, -k or None) for k in d), tuple(slice(k, None) for k in d)


def _cases(n: int) -> dict[int, list[list[tuple[int, int]]]]:
    """By the corners of a simplex that are inside, as bits: the facets that cut it, each by its edges inside-out."""
    path = np.tril(np.ones((n + 1, n)), -1)
    table = {}
    for case in range(1, 2 ** (n + 1) - 1):
        inner = [k for k in range(n + 1) if case >> k & 1]
        outer = [k for k in range(n + 1) if k not in inner]
        edges = [(i, o) for i in inner for o in outer]
        if len(edges) > n:
            a, b, c, d = edges[0], edges[1], edges[3], edges[2]
            facets = [[a, b, c], [a, c, d]]
        else:
            facets = [edges]
        for facet in facets:
            middles = np.array([path[[i, o]].mean(axis=0) for i, o in facet]) - path[inner].mean(axis=0)
            if np.linalg.det(middles) < 0.0:
                facet[:2] = facet[1::-1]
        table[case] = facets
    return table


FACETS = {n: _cases(n) for n in (2, 3)}


def enclosed(points: Floats, facets: Ints) -> float:
    """The area or the volume that a closed boundary encloses; points (point, axis)."""
    if not len(facets):
        return 0.0
    corners = points[facets] - points[facets].mean(axis=(0, 1))
    return float(np.linalg.det(corners).sum() / math.factorial(points.shape[1]))


def facet_sizes(points: Floats, facets: Ints) -> Floats:
    """Lengths of segments, areas of triangles."""
    corners = points[facets]
    sides = corners[:, 1:] - corners[:, :1]
    gram = sides @ sides.transpose(0, 2, 1)
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(points.shape[1] - 1))
