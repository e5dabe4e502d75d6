"""A map in memory."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from jointplay.analyses.map.lattice import Block
from jointplay.basics.arrays import Array
from jointplay.errors import InputError
from jointplay.result import Attribute, Result, Variable

from .plan import Entry, StorePlan

#: bytes from which a map has to go to a file
LARGEST = 2_000_000_000


class MemoryStore:
    """Keeps a map that is small enough in memory."""

    def __init__(self, plan: StorePlan) -> None:
        self.plan = plan
        self.position = (1, 0)
        self._result: Result | None = None
        self._journal: dict[int, Entry] = {}

    def begin(self, first: Result) -> None:
        """Make room for the whole map, once."""
        if self._result is not None:
            return
        variables = {**first.coords, **first.data}
        size = sum(math.prod(self.plan.full_shape(name, v)) * v.values.itemsize for name, v in variables.items())
        if size > LARGEST:
            problem = f"{size / 1e9:.3g} GB are too much to hold in memory; write the map to a .zarr or .nc file"
            raise InputError(problem, key="grid")

        def room(name: str, variable: Variable) -> Variable:
            if not self.plan.has_nodes(name, variable):
                return variable
            kind = variable.values.dtype
            values = np.zeros(self.plan.full_shape(name, variable), dtype=kind)
            if kind.kind == "f":
                values[...] = np.nan
            return Variable(variable.dims, values, variable.units, variable.long_name)

        coords = {name: room(name, v) for name, v in first.coords.items()}
        self._result = Result(coords, {name: room(name, v) for name, v in first.data.items()}, first.attrs)

    def resume(self, order: Sequence[int]) -> tuple[int, int]:  # noqa: ARG002
        """The position from which the work goes on."""
        return self.position

    def put(self, number: int, region: Block, part: Result, entry: Entry) -> None:
        """Keep what has a value per node of a chunk, then what the journal says of it."""
        for name, variable in {**part.coords, **part.data}.items():
            if self.plan.has_nodes(name, variable):
                self.replace(number, name, region, variable.values)
        self._journal[number] = entry

    def values(self, name: str, region: Block) -> Array:
        """Values of a variable in a part of the grid."""
        return np.array(self.result.get(name)[region])

    def replace(self, number: int, name: str, region: Block, values: Array) -> None:  # noqa: ARG002
        """Change values of a variable in a part of a chunk."""
        self.result.get(name)[region] = values

    def entry(self, number: int) -> Entry | None:
        """What the journal holds of a chunk."""
        return self._journal.get(number)

    def advance(self, position: tuple[int, int]) -> None:
        """Move on."""
        self.position = position

    def finish(self, attributes: Mapping[str, Attribute]) -> None:
        """Nothing is left to do."""
        self._journal.clear()
        done = self.result
        self._result = Result(done.coords, done.data, {**done.attrs, **attributes})

    def close(self) -> None:
        """Nothing more will be done."""

    @property
    def result(self) -> Result:
        """The map."""
        assert self._result is not None, "no chunk was put"
        return self._result
