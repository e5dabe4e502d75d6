"""The nominal mechanism at the nodes of a map.

On a grid of drives it is followed from node to node. On a grid of output poses so is another mechanism: the same
bodies and joints, its drives replaced by ones that command the output point itself. What the real drives have to be
there is then read off the poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay import _core, poses
from jointplay.analyses.nominal import Floats, Nominal
from jointplay.answers import Traced
from jointplay.compile import Grid
from jointplay.errors import InputError, listed
from jointplay.mobility import require_determinate
from jointplay.model import Mechanism, in_core

from .lattice import Lattice

#: columns of a rotation vector among the components of a pose
ROTATIONS = ("rx", "ry", "rz")


@dataclass(frozen=True)
class Seed:
    """A state that may lead to a node.

    Attributes
    ----------
    node : int
        Number of the node in its chunk.
    row : ndarray
        What was commanded in that state.
    poses : ndarray
        Of all bodies.
    """

    node: int
    row: Floats
    poses: Floats


class Reach:
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
        self.start = _start(m)
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
            self._first = Seed(0, row[0], found["poses"][0])
        else:
            self.names, self.core = m.drives, m.core
            self._columns = list(range(len(m.drives)))
            self._first = Seed(0, self.start.drives[0], self.start.poses[0])

    def starts(self, lattice: Lattice) -> dict[int, list[Seed]]:
        """Seeds by chunk: nodes that are reached from the start on a straight way."""
        places, rows = lattice.coarse(self.names)
        values = dict(zip(np.array(self.names)[self._columns].tolist(), self._first.row.tolist(), strict=True))
        nearest = lattice.nearest(values)
        near = lattice.rows(nearest[0], self.names)[nearest[1]]
        places, rows = [nearest, *places], np.ascontiguousarray(np.vstack([near, rows])[:, self._columns])
        seeds: dict[int, list[Seed]] = {}
        # Nothing is reached but from the start.
        first = [Seed(k, self._first.row, self._first.poses) for k in range(len(rows))]
        found = self._trace_grid([len(rows)], rows, first, spread=False)
        for (chunk, node), row, status, state in zip(places, rows, found["status"], found["poses"], strict=True):
            if status == 0:
                seeds.setdefault(chunk, []).append(Seed(node, row, state))
        return seeds

    def commands(self, lattice: Lattice, chunk: int) -> Floats:
        """What is commanded at the nodes of a chunk, without what is held by a joint."""
        return np.ascontiguousarray(lattice.rows(chunk, self.names)[:, self._columns])

    def solve(self, lattice: Lattice, chunk: int, seeds: Sequence[Seed]) -> Nominal:
        """The nominal mechanism at the nodes of a chunk, as far as they are reached from the seeds."""
        rows = self.commands(lattice, chunk)
        found = self._trace_grid(list(lattice.size(chunk)), rows, seeds)
        there, n = found["poses"], len(rows)
        drives = rows
        if self.grid.of_output:
            drives = self.m.core.drive_values(there, self.start.drives[0])
        nothing = np.full((n, 0), np.nan)
        return Nominal(drives, there, found["output"], found["status"], np.full(n, np.nan), nothing)

    def _trace_grid(self, shape: list[int], rows: Floats, seeds: Sequence[Seed], *, spread: bool = True) -> Traced:
        width, bodies = rows.shape[1], self.start.poses.shape[1:]
        return self.core.trace_grid(
            shape,
            rows,
            [seed.node for seed in seeds],
            np.array([seed.row for seed in seeds]).reshape(-1, width),
            np.array([seed.poses for seed in seeds]).reshape(-1, *bodies),
            spread,
        )


def _start(m: Mechanism) -> Nominal:
    """The mechanism where it is assembled: at the first values of its drives, else as the file says it starts."""
    rows = [m.start_drives] if m.drive_values is None else [m.drive_values[0], m.start_drives]
    for row in rows:
        found = m.core.solve(np.array([row]))
        if np.isfinite(found["poses"]).all():
            break
    else:
        problem = "the mechanism cannot be assembled at its start, from which the grid is reached"
        raise InputError(problem, file=m.file, key="start")
    return Nominal(
        np.array([row]),
        found["poses"],
        found["output"],
        found["status"],
        found["singular_value"],
        found["singular_motion"],
    )


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
