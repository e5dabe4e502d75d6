"""The work on a map: chunk by chunk outwards from the start, then again where a neighbour opened a new way in.

A chunk is solved from the states on the faces of the chunks around it that are done. A region that winds may be
entered later from another side; further passes solve such chunks again until nothing is added. All of it depends on
the mechanism and the grid only, so that a run that was killed and taken up ends as one that was not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Floats, Nominal, Progress
from jointplay.analyses.solve import coordinates, within_limits
from jointplay.compile import Grid
from jointplay.mobility import require_determinate
from jointplay.model import Mechanism
from jointplay.result import Result, Variable, axes_of, coordinate_names
from jointplay.store import Store

from .contact import Contacts
from .lattice import Lattice, Neighbour
from .reach import Reach, Seed

#: what a map has beside the answers at its nodes
OWN = ("across", "contact_change", "within_limits")
#: passes after which the work ends in any case; a region would have to wind as often in and out of a chunk
MOST_PASSES = 100
OK, NOT_ASSEMBLED = 0, 1
Array = NDArray[Any]
#: the question, asked of configurations that are solved
Ask = Callable[[Nominal], Result]


class Work:
    """A map in the making.

    Parameters
    ----------
    m : Mechanism
    lattice : Lattice
    store : Store
        Where chunks go, and where an earlier run stopped.
    ask : callable
        The question.
    names : mapping
        What the drives are called in the map, see `drive_names`.
    measure : bool
        Whether it needs the nearness to singularity of every node.
    """

    def __init__(
        self, m: Mechanism, lattice: Lattice, store: Store, ask: Ask, names: Mapping[str, str], *, measure: bool
    ) -> None:
        self.m, self.lattice, self.store, self.ask, self.measure = m, lattice, store, ask, measure
        self.names = names
        #: whether the offsets are part of the map; where contacts change sides is seen from them in any case
        self.keep_offset = True
        self.reach = Reach(m, lattice.grid)
        self.contacts = Contacts(m)
        self.starts = self.reach.starts(lattice)
        self.order = lattice.order(next(iter(self.starts), 0))

    def run(self, progress: Progress | None = None) -> None:
        """Do what is left."""
        number, done = self.store.resume(self.order)
        added = False
        while number <= MOST_PASSES:
            for place in range(done, len(self.order)):
                if progress is not None and number == 1:
                    progress(place, len(self.order))
                added |= self._chunk(self.order[place])
                self.store.advance((number, place + 1))
            # A pass that was taken up in its middle may have added something before.
            if not added and done == 0:
                break
            number, done, added = number + 1, 0, False
        self.store.advance((MOST_PASSES + 1, 0))
        self._join()
        self.store.finish()

    def _chunk(self, number: int) -> bool:
        """Solve a chunk, unless it was solved before and nothing new leads into it; whether it was solved."""
        own = self.store.entry(number)
        offered: dict[str, NDArray[np.bool_]] = {}
        seeds = list(self.starts.get(number, ()))
        opened = own is None
        for neighbour in self.lattice.neighbours(number):
            face = f"{neighbour.axis}.{neighbour.side}"
            other = self.store.entry(neighbour.number)
            if other is None:
                continue
            opposite = f"{neighbour.axis}.{1 - neighbour.side}"
            offered[face] = other[f"status.{opposite}"] == OK
            seeds += self._seeds(number, neighbour, offered[face], other[f"poses.{opposite}"])
            if own is not None:
                seen = own[f"seen.{face}"] if f"seen.{face}" in own else np.zeros_like(offered[face])
                opened |= bool((offered[face] & ~seen & (own[f"status.{face}"] == NOT_ASSEMBLED)).any())
        if not opened:
            return False
        at = self.reach.solve(self.lattice, number, seeds)
        reached = at.status.copy()
        result, contacts = self._result(number, self.reach.measured(at) if self.measure else at)
        self.store.begin(result)
        entry = self._entry(number, at.poses, reached, contacts, offered)
        self.store.put(number, self.lattice.region(number), result, entry)
        return True

    def _seeds(self, number: int, neighbour: Neighbour, ok: NDArray[np.bool_], poses: Floats) -> list[Seed]:
        """The states on the face of a neighbour, each with the node of this chunk that is next to it."""
        size, theirs = self.lattice.size(number), self.lattice.size(neighbour.number)
        nodes = np.arange(np.prod(size)).reshape(size)
        rows = self.reach.commands(self.lattice, neighbour.number)
        rows = _face(rows.reshape(*theirs, -1), neighbour.axis, 1 - neighbour.side)
        mine = _face(nodes, neighbour.axis, neighbour.side)
        picked = zip(mine[ok].tolist(), rows[ok], poses[ok], strict=True)
        return [Seed(node, row, state) for node, row, state in picked]

    def _entry(
        self,
        number: int,
        poses: Floats,
        status: NDArray[np.uint8],
        contacts: Floats | None,
        offered: Mapping[str, NDArray[np.bool_]],
    ) -> dict[str, Array]:
        """What the neighbours of a chunk need to know of it."""
        size = self.lattice.size(number)
        kept: dict[str, Array] = {"status": status.reshape(size)}
        kept["poses"] = poses.reshape(*size, *poses.shape[1:])
        if contacts is not None:
            kept["contacts"] = contacts
        entry: dict[str, Array] = {f"seen.{face}": ok for face, ok in offered.items()}
        for neighbour in self.lattice.neighbours(number):
            for name, values in kept.items():
                face = _face(values, neighbour.axis, neighbour.side)
                entry[f"{name}.{neighbour.axis}.{neighbour.side}"] = np.array(face)
        return entry

    def _result(self, number: int, at: Nominal) -> tuple[Result, Floats | None]:
        """The answer at the nodes of a chunk, over the axes of the grid, and under load the states of contact."""
        flat = self.ask(at)
        data = dict(flat.data)
        if self.m.limits.joints or self.m.limits.drives:
            within = within_limits(self.m, at, coordinates(self.m, at)[0])
            words = "whether joints and drives keep to their ranges"
            data["within_limits"] = Variable(("configuration",), within, "", words)
        result = _on_grid(Result(flat.coords, data, flat.attrs), self.m, self.lattice, number, self.names)
        if flat.attrs["question"] != "loaded":
            return result, None
        states = self.contacts.states(result.get("offset"))
        axes = axis_names(self.lattice.grid, self.names)
        several = result.data["offset"].dims[len(axes) : -1]
        changed = np.zeros((*states.shape[:-1], len(axes)), dtype=bool)
        for axis in range(len(axes)):
            along = np.moveaxis(states, axis, 0)
            np.moveaxis(changed[..., axis], axis, 0)[:-1] = self.contacts.change(along[:-1], along[1:])
        words = "whether a contact changes sides between this node and the next one along the axis"
        change = Variable((*axes, *several, "across"), changed, "", words)
        across = Variable(("across",), np.array(axes), "", "axis of the grid along which the next node lies")
        data, coords = {**result.data, "contact_change": change}, {**result.coords, "across": across}
        if not self.keep_offset:
            del data["offset"]
            coords = {name: v for name, v in coords.items() if "parameter" not in v.dims}
        return Result(coords, data, result.attrs), states

    def _join(self) -> None:
        """Mark changes of contact between the last nodes of a chunk and the first ones of the next."""
        for number in range(len(self.lattice)):
            own = self.store.entry(number)
            if own is None or not any(name.startswith("contacts.") for name in own):
                continue
            region = self.lattice.region(number)
            marked = self.store.values("contact_change", region)
            before = marked.copy()
            for neighbour in self.lattice.neighbours(number):
                other = self.store.entry(neighbour.number)
                if neighbour.side == 0 or other is None:
                    continue
                axis = neighbour.axis
                changed = self.contacts.change(own[f"contacts.{axis}.1"], other[f"contacts.{axis}.0"])
                np.moveaxis(marked[..., axis], axis, 0)[-1] = changed
            if not np.array_equal(marked, before):
                self.store.replace(number, "contact_change", region, marked)


def _face(values: Array, axis: int, side: int) -> Array:
    """The first or the last nodes along an axis."""
    return np.asarray(np.take(values, -side, axis=axis))


def unassembled(m: Mechanism, ask: Ask) -> Result:
    """What the question answers where nothing is assembled: the names that all its answers have."""
    require_determinate(m, over_constrained=True)
    bodies, components = len(m.bodies), len(m.components)
    value, pose, motion = (np.full((1, *shape), np.nan) for shape in ((), (bodies, m.pose_size), (bodies, components)))
    output, status = np.full((1, components), np.nan), np.array([NOT_ASSEMBLED], dtype=np.uint8)
    return ask(Nominal(m.start_drives[None], pose, output, status, value, motion))


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
