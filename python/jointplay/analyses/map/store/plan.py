"""What every store of a map is given, and what it can do."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from jointplay.analyses.map.lattice import Block
from jointplay.basics.arrays import Array
from jointplay.result import Attribute, Result, Variable

Entry = Mapping[str, Array]
#: attribute of an array with its dimensions, where xarray looks for them
DIMENSIONS = "_ARRAY_DIMENSIONS"


@dataclass(frozen=True)
class StorePlan:
    """Layout of a map."""

    #: names of the axes of the grid: the first dimensions of every variable that has a value per node
    axes: tuple[str, ...]
    #: `shape`, `chunk`: nodes along each axis, of the whole and of one chunk
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    #: distinguishes maps of other mechanisms, grids or questions
    fingerprint: str

    def full_shape(self, name: str, variable: Variable) -> tuple[int, ...]:
        """Shape of a variable over the whole grid, from its values on one chunk."""
        if not self.has_nodes(name, variable):
            return variable.values.shape
        return (*self.shape, *variable.values.shape[len(self.axes) :])

    def chunk_shape(self, name: str, variable: Variable) -> tuple[int, ...]:
        """Shape of a variable on a full chunk."""
        if not self.has_nodes(name, variable):
            return variable.values.shape
        return (*self.chunk, *variable.values.shape[len(self.axes) :])

    @property
    def count(self) -> int:
        """Number of chunks."""
        return math.prod(-(-size // step) for size, step in zip(self.shape, self.chunk, strict=True))

    def has_nodes(self, name: str, variable: Variable) -> bool:
        """Whether it has a value per node; the coordinate along an axis is there as a whole from the beginning."""
        return name not in self.axes and variable.dims[: len(self.axes)] == self.axes


class Store(Protocol):
    """Keeps the chunks of a map, and a journal of how far the work is."""

    plan: StorePlan
    #: pass over the chunks and chunks of it that are done
    position: tuple[int, int]

    def resume(self, order: Sequence[int]) -> tuple[int, int]:
        """The position from which the work goes on; the chunks before it, in this order, are as they were written."""

    def begin(self, first: Result) -> None:
        """Make room for the whole map; the result on some chunk has the variables and coordinates."""

    def put(self, number: int, region: Block, part: Result, entry: Entry) -> None:
        """Keep what has a value per node of a chunk, then what the journal says of it."""

    def values(self, name: str, region: Block) -> Array:
        """Values of a variable in a part of the grid, as a copy."""

    def replace(self, number: int, name: str, region: Block, values: Array) -> None:
        """Change values of a variable in a part of a chunk."""

    def entry(self, number: int) -> Entry | None:
        """What the journal holds of a chunk; None when it was never done."""

    def advance(self, position: tuple[int, int]) -> None:
        """Move on: everything before this position is kept."""

    def finish(self, attributes: Mapping[str, Attribute]) -> None:
        """Nothing is left to do; the map gets further attributes."""

    def close(self) -> None:
        """Nothing more will be done."""
