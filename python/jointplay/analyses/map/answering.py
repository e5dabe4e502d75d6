"""The question, asked at the nodes of a chunk of a map, here or in another process.

It has no part in the way from node to node: a chunk is asked as soon as its nodes are reached, whatever else is done.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from jointplay.analyses.nominal import Nominal, bounded, carried, straying
from jointplay.analyses.questions import computation
from jointplay.basics.arrays import Array, Floats
from jointplay.core.compile import Grid
from jointplay.errors import InputError, listed
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate
from jointplay.questions import QUESTIONS
from jointplay.result import Attribute, Origin, Result, Variable, axes_of, coordinate_names

from .contact import Contacts
from .lattice import Lattice
from .store import Stamps, Writer

#: what a map has beside the answers at its nodes
CROSSING = "singular_crossing"
OWN = ("across", "contact_change", CROSSING)
NOT_ASSEMBLED = 1
#: the number of a chunk, the configurations at its nodes, and where ways to next nodes become singular
Chunk = tuple[int, Nominal, Floats]


@dataclass(frozen=True)
class MapQuestion:
    """A question of a mechanism."""

    #: with all outputs and load cases
    whole: Mechanism
    question: str
    #: of the question
    options: Mapping[str, Any]
    #: who asks at the nodes of a grid
    asker: str = "map"

    @cached_property
    def m(self) -> Mechanism:
        """The part of the mechanism that is brought to the nodes of a grid."""
        return leading(self.whole)

    def __call__(self, at: Nominal) -> Result:
        """The answer at configurations that are solved."""
        ask, m = computation(self.question, self.asker), self.m
        also = QUESTIONS[self.question].asked_by[self.asker]
        at = straying(m, at) if self.whole is m else carried(at, m, self.whole)
        # The axes of the grid come first.
        return _configurations_first(ask(self.whole, at=at, **self.options, **also))


@dataclass(frozen=True)
class ChunkAnswer:
    """The answer at the nodes of a chunk."""

    #: over the axes of the grid; None where it is written already
    part: Result | None
    #: of the files of the chunk, where it is written already
    stamps: Stamps
    #: states of contact at the faces of the chunk, by the face; empty where there is no load
    contacts: dict[str, Floats]


@dataclass(frozen=True)
class ChunkAsking:
    """Asks the question chunk by chunk."""

    ask: MapQuestion
    lattice: Lattice
    #: what the drives are called in the map, see `drive_names`
    names: Mapping[str, str]
    #: writes chunks where they are computed; without it they are handed over
    writer: Writer | None = None

    def writing(self, writer: Writer | None) -> ChunkAsking:
        """The same, which writes what is answered."""
        return replace(self, writer=writer)

    @cached_property
    def _contacts(self) -> Contacts:
        return Contacts(self.ask.m)

    def __call__(self, chunk: Chunk) -> ChunkAnswer:
        """The answer at the nodes of a chunk, of which these are the configurations."""
        number, at, crossing = chunk
        m = self.ask.m
        at = bounded(m, at)
        part, states = self._part(number, at, crossing)
        contacts = {} if states is None else faces(self.lattice, number, {"contacts": states})
        if self.writer is None:
            return ChunkAnswer(part, {}, contacts)
        return ChunkAnswer(None, self.writer.write(self.lattice.region(number), part), contacts)

    def _attributes(self, flat: Result) -> dict[str, Attribute]:
        """Those of an answer, which say what the whole map is of: they are written with its first chunk."""
        known = flat.origin.options if flat.origin is not None else {}
        options = {"question": self.ask.question, **{name: v for name, v in known.items() if name != "path"}}
        return {**flat.attrs, **Origin((self.ask.whole,), options).attributes()}

    def _part(self, number: int, at: Nominal, crossing: Floats) -> tuple[Result, Floats | None]:
        """The answer at the nodes of a chunk, over the axes of the grid, and under load the states of contact."""
        flat = self.ask(at)
        flat = replace(flat, attrs=self._attributes(flat), origin=None)
        result = _on_grid(flat, self.ask.m, self.lattice, number, self.names)
        axes = axis_names(self.lattice.grid, self.names)
        words = "part of the way to the next node along the axis at which the mechanism becomes singular"
        crossing = crossing.reshape(*self.lattice.size(number), len(axes))
        across = Variable(("across",), np.array(axes), "", "axis of the grid along which the next node lies")
        data = {**result.data, CROSSING: Variable((*axes, "across"), crossing, "", words)}
        result = Result({**result.coords, "across": across}, data, result.attrs)
        if result.attrs["question"] != "loaded":
            return result, None
        states = self._contacts.states(result.get("offset"))
        several = result.data["offset"].dims[len(axes) : -1]
        changed = np.zeros((*states.shape[:-1], len(axes)), dtype=bool)
        for axis in range(len(axes)):
            along = np.moveaxis(states, axis, 0)
            np.moveaxis(changed[..., axis], axis, 0)[:-1] = self._contacts.change(along[:-1], along[1:])
        words = "whether a contact changes sides between this node and the next one along the axis"
        data["contact_change"] = Variable((*axes, *several, "across"), changed, "", words)
        coords = result.coords
        if not self.ask.options.get("details", True):
            del data["offset"]
            coords = {name: v for name, v in coords.items() if "parameter" not in v.dims}
        return Result(coords, data, result.attrs), states


def faces(lattice: Lattice, number: int, values: Mapping[str, Array]) -> dict[str, Array]:
    """Of values at the nodes of a chunk those at the faces that it shares with others, by name, axis and side."""
    return {
        f"{name}.{neighbour.axis}.{neighbour.side}": np.array(face(of, neighbour.axis, neighbour.side))
        for neighbour in lattice.neighbours(number)
        for name, of in values.items()
    }


def face(values: Array, axis: int, side: int) -> Array:
    """The first or the last nodes along an axis."""
    return np.asarray(np.take(values, -side, axis=axis))


def leading(m: Mechanism) -> Mechanism:
    """The mechanism that is brought to the nodes of a grid: with the output that the grid speaks of.

    Raises
    ------
    InputError
        When the grid is one of positions and does not say of which output.
    """
    if not (m.outputs or m.load_cases):
        return m.leader if m.grid is not None and m.grid.of_output else m
    if m.grid is not None and m.grid.of_output and len(m.outputs) > 1 and not m.names_leader:
        problem = f"which output is meant? Say leads = true in one of [outputs.NAME]: {listed(m.outputs)}"
        raise InputError(problem, file=m.file, key="grid")
    return m.leader if m.grid is not None and m.grid.of_output else m.first


def _configurations_first(result: Result) -> Result:
    def moved(variable: Variable) -> Variable:
        if "configuration" not in variable.dims:
            return variable
        place = variable.dims.index("configuration")
        dims = ("configuration", *(dim for dim in variable.dims if dim != "configuration"))
        return Variable(dims, np.moveaxis(variable.values, place, 0), variable.units, variable.long_name)

    coords = {name: moved(v) for name, v in result.coords.items()}
    return replace(result, coords=coords, data={name: moved(v) for name, v in result.data.items()})


def unassembled(m: Mechanism, ask: MapQuestion) -> Result:
    """What the question answers where nothing is assembled: the names that all its answers have."""
    require_determinate(m, over_constrained=True)
    pose, output = (np.full((1, *shape), np.nan) for shape in ((len(m.bodies), m.pose_size), (len(m.components),)))
    status = np.array([NOT_ASSEMBLED], dtype=np.uint8)
    return ask(Nominal(m.start_drives[None], pose, output, status, is_path=False))


def drive_names(m: Mechanism, grid: Grid, flat: Result) -> dict[str, str]:
    """What the drives are called in a map, by their own names.

    They are dimensions of the store, which is there before the first answer; so it needs the `unassembled` one.
    """
    taken = {*flat.data, *flat.attrs, *flat.sizes, *OWN, *(name for name in flat.coords if name not in flat.drives)}
    if grid.of_output:
        taken |= {*grid.axes, *grid.held}
    return dict(zip(m.drives, coordinate_names(m.drives, taken), strict=True))


def axis_names(grid: Grid, names: Mapping[str, str]) -> tuple[str, ...]:
    """Dimensions of a map."""
    return grid.axes if grid.of_output else tuple(names[axis] for axis in grid.axes)


def _on_grid(flat: Result, m: Mechanism, lattice: Lattice, number: int, names: Mapping[str, str]) -> Result:
    """A result over the nodes of a chunk as one over the axes of the grid."""
    grid, size = lattice.grid, lattice.size(number)
    axes = axis_names(grid, names)

    def shaped(variable: Variable) -> Variable:
        if variable.dims[:1] != ("configuration",):
            return variable
        values = variable.values.reshape(*size, *variable.values.shape[1:])
        return Variable((*axes, *variable.dims[1:]), values, variable.units, variable.long_name)

    commanded = _commanded(m, grid, {} if grid.of_output else names)
    known = {name: v for name, v in flat.coords.items() if name not in flat.drives and name != "configuration"}
    values = [shaped(v) for v in flat.drives.values()]
    drives = dict(zip(names.values(), values, strict=True)) if grid.of_output else {}
    coords = {**commanded, **drives, **{name: shaped(v) for name, v in known.items()}}
    attrs = {**flat.attrs, "grid": ", ".join(axes), "drives": ", ".join(drives or commanded)}
    return Result(coords, {name: shaped(v) for name, v in flat.data.items()}, attrs)


def _commanded(m: Mechanism, grid: Grid, called: Mapping[str, str]) -> dict[str, Variable]:
    """Coordinates of the axes, and of what is held, in file units."""
    along = axes_of(m)["component" if grid.of_output else "drive"]
    names, units = (
        along.labels,
        {name: str(getattr(m.units, f"{kind}_name")) for name, kind in zip(along.labels, along.kinds, strict=True)},
    )
    factors = m.component_factors if grid.of_output else m.drive_factors
    words = {name: f"{name} of the output" if grid.of_output else f"value of drive {name}" for name in names}
    coords = {
        called.get(name, name): Variable((called.get(name, name),), labels, units[name], words[name])
        for name, labels in zip(grid.axes, grid.labels, strict=True)
    }
    for name, value in grid.held.items():
        factor = factors[names.index(name)]
        coords[called.get(name, name)] = Variable((), np.array(value / factor), units[name], f"{words[name]}, held")
    return coords
