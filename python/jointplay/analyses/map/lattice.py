"""The nodes of a map and the chunks in which they are worked off."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import Grid

#: nodes by a slice of each axis
Block = tuple[slice, ...]

COARSE = 5


@dataclass(frozen=True)
class Neighbour:
    """A chunk that shares a face with another one."""

    #: the axis across which it lies
    axis: int
    #: 0: before the chunk, 1: after it
    side: int
    #: which chunk it is
    number: int


class Lattice:
    """The nodes of a grid, in box-shaped chunks.

    Parameters
    ----------
    grid : Grid
    nodes : int
        In one chunk, at most.
    """

    def __init__(self, grid: Grid, nodes: int) -> None:
        self.grid = grid
        self.shape = grid.shape
        self.chunk = _chunk(self.shape, max(nodes, 1))
        self.counts = tuple(math.ceil(n / c) for n, c in zip(self.shape, self.chunk, strict=True))

    def __len__(self) -> int:
        return math.prod(self.counts)

    def region(self, number: int) -> Block:
        """A chunk's part of the grid."""
        place = np.unravel_index(number, self.counts)
        bounds = zip(place, self.chunk, self.shape, strict=True)
        return tuple(slice(int(k) * c, min((int(k) + 1) * c, n)) for k, c, n in bounds)

    def size(self, number: int) -> tuple[int, ...]:
        """Nodes of a chunk along each axis."""
        return tuple(part.stop - part.start for part in self.region(number))

    def rows(self, number: int, names: Sequence[str]) -> Floats:
        """Values of drives or components at the nodes of a chunk, the last axis fastest: (node, name), SI."""
        return self._rows([v[part] for v, part in zip(self.grid.values, self.region(number), strict=True)], names)

    def _rows(self, values: Sequence[Floats], names: Sequence[str]) -> Floats:
        mesh = dict(zip(self.grid.axes, np.meshgrid(*values, indexing="ij"), strict=True))
        shape = tuple(len(v) for v in values)
        columns = [mesh.get(name, np.full(shape, self.grid.held.get(name, math.nan))) for name in names]
        return np.stack([column.ravel() for column in columns], axis=1)

    def neighbours(self, number: int) -> list[Neighbour]:
        """The chunks on the faces of a chunk."""
        place = np.unravel_index(number, self.counts)
        found = []
        for axis, side in itertools.product(range(len(self.counts)), (0, 1)):
            other = [int(k) for k in place]
            other[axis] += 2 * side - 1
            if 0 <= other[axis] < self.counts[axis]:
                found.append(Neighbour(axis, side, int(np.ravel_multi_index(other, self.counts))))
        return found

    def order(self, first: int) -> list[int]:
        """The chunks outwards from one of them, so that each has neighbours before it."""
        places = np.stack(np.unravel_index(np.arange(len(self)), self.counts), axis=1)
        return [int(k) for k in np.argsort(np.abs(places - places[first]).sum(axis=1), kind="stable")]

    def coarse(self, names: Sequence[str]) -> tuple[list[tuple[int, int]], Floats]:
        """Some nodes spread over the whole grid: (chunk, node of the chunk) of each, and its row of values."""
        picks = [np.unique(np.linspace(0, n - 1, COARSE).round().astype(int)) for n in self.shape]
        places = np.stack([k.ravel() for k in np.meshgrid(*picks, indexing="ij")], axis=1)
        return [self.place(place) for place in places], self._rows(
            [values[pick] for values, pick in zip(self.grid.values, picks, strict=True)], names
        )

    def nearest(self, values: dict[str, float]) -> tuple[int, int]:
        """The node nearest to some values along each axis: (chunk, node of the chunk)."""
        along = zip(self.grid.axes, self.grid.values, strict=True)
        return self.place(np.array([int(np.argmin(np.abs(nodes - values[name]))) for name, nodes in along]))

    def place(self, node: np.ndarray[tuple[int], np.dtype[np.int64]]) -> tuple[int, int]:
        """The chunk of a node and its number there."""
        chunk = np.array(self.chunk)
        number = int(np.ravel_multi_index(tuple(node // chunk), self.counts))
        return number, int(np.ravel_multi_index(tuple(node % chunk), self.size(number)))


def _chunk(shape: tuple[int, ...], nodes: int) -> tuple[int, ...]:
    """Boxes of about equal sides; what a short axis does not need is left to the others."""
    sides = [1] * len(shape)
    left, axes = nodes, sorted(range(len(shape)), key=lambda axis: shape[axis])
    for k, axis in enumerate(axes):
        side = min(shape[axis], max(1, round(left ** (1 / (len(axes) - k)))))
        # Chunks of even size: no sliver at the end.
        sides[axis] = math.ceil(shape[axis] / math.ceil(shape[axis] / side))
        left //= sides[axis]
    return tuple(sides)
