"""The nominal mechanism at the nodes of a map.

On a grid of drives it is followed from node to node. On a grid of output poses so is another mechanism: the same
bodies and joints, its drives replaced by ones that command the output point itself. What the real drives have to be
there is then read off the poses, and the machine with these drives held must not become singular on the way either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.analyses.nominal import Nominal, at_drives
from jointplay.basics import poses
from jointplay.basics.arrays import Flags, Floats
from jointplay.core.answers import TracedGrid
from jointplay.core.compile import Grid
from jointplay.errors import InputError, listed
from jointplay.model.mechanism import Mechanism, in_core
from jointplay.model.mobility import require_determinate
from jointplay.result import STATUSES

from .lattice import Lattice

#: columns of a rotation vector among the components of a pose
ROTATIONS = ("rx", "ry", "rz")
#: outcome of nodes that are reached across singular poses only
BEYOND = "other_branch"


@dataclass(frozen=True)
class Seeds:
    """States that may lead to nodes of a chunk, one after the other."""

    #: number of the node in its chunk
    nodes: NDArray[np.int64]
    #: what was commanded in each state
    rows: Floats
    #: of all bodies
    poses: Floats
    #: whether a singular pose lies between the state and the start
    beyond: Flags

    @classmethod
    def of(cls, parts: Sequence[Seeds]) -> Seeds:
        """Those of all parts; there is one part at least."""
        fields = ([getattr(part, name) for part in parts] for name in ("nodes", "rows", "poses", "beyond"))
        return cls(*(np.concatenate(arrays) for arrays in fields))

    def __len__(self) -> int:
        return len(self.nodes)

    def __getitem__(self, chosen: NDArray[np.int64]) -> Seeds:
        return Seeds(self.nodes[chosen], self.rows[chosen], self.poses[chosen], self.beyond[chosen])


@dataclass(frozen=True)
class Solved:
    """The nominal mechanism at the nodes of a chunk."""

    at: Nominal
    #: part of the way to the next node along each axis at which the mechanism becomes singular, shape (node, axis)
    crossing: Floats
    #: the same of the way from each seed to its node
    seed_crossing: Floats


class GridFollower:
    """Follows a mechanism over a grid.

    Attributes
    ----------
    names : tuple of str
        What is commanded at a node: drives or components of the output.
    start : Nominal
        Where the mechanism is assembled; every node is reached from there.
    """

    def __init__(self, m: Mechanism, grid: Grid) -> None:
        require_determinate(m, over_constrained=True)
        self.m = m
        self.grid = grid
        self.start = start_of(m)
        if grid.of_output:
            self.names = tuple(name for name in m.components if name in (*grid.axes, *grid.held))
            commanded = [name for name in self.names if name not in ROTATIONS]
            self.core = _commanding_output(m, grid, commanded, self.start)
            self._columns = [self.names.index(name) for name in commanded]
            row = self.start.output[:, [m.components.index(name) for name in commanded]]
            if not self.core.regular(row[0]):
                problem = f"{listed(self.names)} of the output do not decide where the drives are"
                raise InputError(problem, file=m.file, key="grid")
            found = self.core.trace(row)
            self._first = _one(row, found["poses"])
        else:
            self.names, self.core = m.drives, m.core
            self._columns = list(range(len(m.drives)))
            self._first = _one(self.start.drives, self.start.poses)

    @property
    def no_seeds(self) -> Seeds:
        """None at all."""
        return self._first[np.zeros(0, np.int64)]

    def starts(self, lattice: Lattice) -> dict[int, Seeds]:
        """Seeds by chunk: nodes that are reached from the start on a straight way."""
        places, rows = lattice.coarse(self.names)
        values = dict(zip(np.array(self.names)[self._columns].tolist(), self._first.rows[0].tolist(), strict=True))
        nearest = lattice.nearest(values)
        near = lattice.rows(nearest[0], self.names)[nearest[1]]
        places, rows = [nearest, *places], np.ascontiguousarray(np.vstack([near, rows])[:, self._columns])
        first = self._first
        if STATUSES[self.start.status[0]] == "singular":
            # No side is that of a singular start: the nearest node decides.
            found = self._straight(first, rows[:1])
            if np.isfinite(found["poses"]).all():
                first = _one(rows, found["poses"])
        # Nothing is reached but from the start.
        found = self._straight(first, rows)
        chunks, nodes = np.array(places).T
        status = STATUSES[found["status"]]
        seeds = Seeds(nodes, rows, found["poses"], status == BEYOND)
        reached = np.flatnonzero(np.isin(status, ("ok", BEYOND)))
        # The chunk of the start comes first.
        return {int(chunk): seeds[reached[chunks[reached] == chunk]] for chunk in dict.fromkeys(chunks[reached])}

    def commands(self, lattice: Lattice, chunk: int) -> Floats:
        """What is commanded at the nodes of a chunk, without what is held by a joint."""
        return np.ascontiguousarray(lattice.rows(chunk, self.names)[:, self._columns])

    def solve(self, lattice: Lattice, chunk: int, seeds: Seeds) -> Solved:
        """The nominal mechanism at the nodes of a chunk, as far as they are reached from the seeds."""
        rows = self.commands(lattice, chunk)
        found = self._trace_grid(list(lattice.size(chunk)), rows, seeds)
        return Solved(self._nominal(rows, found), found["crossing"], found["seed_crossing"])

    def straight(self, seeds: Seeds, rows: Floats) -> tuple[Nominal, Floats]:
        """The nominal mechanism at some rows of commands, each reached on a straight way from its own seed.

        With the part of the way at which it becomes singular, where it does, else up to which it leads.
        """
        found = self._trace_grid([len(rows)], rows, seeds, spread=False)
        singular = found["seed_crossing"]
        return self._nominal(rows, found), np.where(np.isnan(singular), found["seed_end"], singular)

    def _nominal(self, rows: Floats, found: TracedGrid) -> Nominal:
        there = found["poses"]
        drives = self.m.core.drive_values(there, self.start.drives[0]) if self.grid.of_output else rows
        return Nominal(drives, there, found["output"], found["status"], is_path=False)

    def _straight(self, first: Seeds, rows: Floats) -> TracedGrid:
        """The mechanism at some rows, each reached from one state on a straight way."""
        n = len(rows)
        every = replace(first[np.zeros(n, np.int64)], nodes=np.arange(n))
        return self._trace_grid([n], rows, every, spread=False)

    def _trace_grid(self, shape: list[int], rows: Floats, seeds: Seeds, *, spread: bool = True) -> TracedGrid:
        real = self.m.core if self.grid.of_output else None
        states = (seeds.nodes.tolist(), seeds.rows, seeds.poses, seeds.beyond.tolist())
        return self.core.trace_grid(shape, rows, *states, spread, real)


def _one(rows: Floats, poses: Floats) -> Seeds:
    """The first of some states, which leads anywhere."""
    return Seeds(np.zeros(1, np.int64), rows[:1], poses[:1], np.zeros(1, bool))


def start_of(m: Mechanism) -> Nominal:
    """The mechanism where it is assembled: at the first values of its drives, else as the file says it starts."""
    rows = [m.start_drives] if m.drive_values is None else [m.drive_values[0], m.start_drives]
    for row in rows:
        found = at_drives(m, np.array([row]))
        if np.isfinite(found.poses).all():
            return found
    problem = "the mechanism cannot be assembled at its start, from which the grid is reached"
    raise InputError(problem, file=m.file, key="start")


def _commanding_output(m: Mechanism, grid: Grid, commanded: list[str], start: Nominal) -> _core.Mechanism:
    """The mechanism whose drives command components of the output."""
    spec = m.spec() | {"guess": start.poses[0].tolist(), "loads": [], "sources": [], "correlations": []}
    origin, output = len(spec["points"]), spec["output"]["point"]
    spec["points"].append({"body": spec["output"].get("relative_to", -1), "at": [0.0, 0.0, 0.0]})
    frame = np.eye(3)
    spec["joints"].append({"kind": "target", "first": origin, "second": output, **_axes(frame, frame)})
    target = len(spec["joints"]) - 1
    spec["drives"] = [{"joint": target, "component": name} for name in commanded]
    if any(name in grid.held for name in ROTATIONS):
        held = poses.turned_by([grid.held[name] for name in ROTATIONS])
        spec["joints"].append({"kind": "orientation", "first": origin, "second": output, **_axes(held.T, frame)})
    return in_core(spec)


def _axes(first: Floats, second: Floats) -> dict[str, list[float]]:
    """Axis and side of a joint on both bodies: the first two rows."""
    named = {"axis_first": first[0], "side_first": first[1], "axis_second": second[0], "side_second": second[1]}
    return {name: [float(v) for v in values] for name, values in named.items()}
