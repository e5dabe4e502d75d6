"""What a workspace is asked of: coordinates of the output along axes, held ones, and orientations to be reached.

Where nobody says how far the axes go, the drives are sampled within their ranges, a coarse region is looked for there,
and the box around that one, with a margin, is taken.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from jointplay.analyses.map.reach import start_of
from jointplay.analyses.nominal import Nominal
from jointplay.basics.arrays import Flags, Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, listed, not_known
from jointplay.file.schema.grid import GridRange, GridRanges
from jointplay.file.schema.messages import located
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate

#: drive values that are sampled at most beside the corners of their ranges, and corners
SAMPLES, MOST_CORNERS = 500, 64
#: added on both sides of the box of what is found, as a part of its side
MARGIN = 0.06
#: nodes along the longest side where nobody says it, by dimensions; and of the coarse region
USUAL = {2: 101, 3: 25}
COARSE = {2: 31, 3: 11}
#: a short side has as many spacings at least, as a part of those of the longest one
LEAST = 0.5
#: added where a region reaches an edge of the box that was found, as a part of the nodes along it
FURTHER = 0.4


@dataclass(frozen=True)
class AskedGrid:
    """Nodes of a workspace and what is held there, file units."""

    #: rising values along each axis, by the component
    axes: dict[str, Floats]
    #: positions that are held
    held: dict[str, float]
    #: rotations, all of which have to be reached at every node
    orientations: tuple[dict[str, float], ...]

    def of(self, whole: Mechanism, orientation: Mapping[str, float]) -> Mechanism:
        """The mechanism with the grid of one orientation."""
        axes = {name: {"values": values.tolist()} for name, values in self.axes.items()}
        return whole.with_({"grid": {**axes, **self.held, **orientation}})

    @property
    def spacing(self) -> float:
        """The largest distance between neighbours along an axis."""
        return max(float(np.diff(values).max()) for values in self.axes.values())


@dataclass(frozen=True)
class AskedRanges:
    """What is given: by component the values along an axis or the one that is held."""

    m: Mechanism
    nodes: dict[str, tuple[float, ...]]
    start: Nominal

    @classmethod
    def of(cls, whole: Mechanism, grid: Mapping[str, Any] | None) -> AskedRanges:
        """Those of an argument, else of the grid of the file where it is one of the output.

        Raises
        ------
        InputError
            When it does not fit the mechanism.
        """
        m = whole.leader
        for name in m.components:
            if name in m.drives:
                problem = (
                    "has the name of a coordinate of the output, by which a workspace is asked for; rename the drive"
                )
                raise InputError(problem, file=m.file, key=f"drives.{name}")
        ranges = _ranges(m, grid)
        known = m.components
        for name in ranges if grid is not None else ():
            if name in m.drives:
                problem = "is a drive; a workspace is one of the output"
                raise InputError(f"{problem}: {listed(known)}", file=m.file, key=f"grid.{name}")
            if name not in known:
                problem = not_known(name, "a component of the output", known)
                raise InputError(problem, file=m.file, key="grid")
        if not all(name in known for name in ranges):
            ranges = {}
        require_determinate(m, over_constrained=True)
        found = cls(m, {name: tuple(along.nodes) for name, along in ranges.items()}, start_of(m))
        found._check()
        return found

    @property
    def lengths(self) -> list[str]:
        """The components of a position."""
        return [name for name in self.m.components if name in LENGTHS]

    def _check(self) -> None:
        m, axes = self.m, [name for name in self.lengths if len(self.nodes.get(name, ())) > 1]
        if len(m.drives) < 2:
            problem = "one drive moves the output along a line; a workspace needs two drives or more"
            raise InputError(problem, file=m.file, key="drives")
        if self.unsaid and len(m.drives) < len(self.lengths):
            problem = "two drives move the output over a surface; give the ranges of two coordinates, such as x and y"
            raise InputError(problem, file=m.file, key="grid")
        if not self.unsaid and len(axes) < 2:
            problem = f"an area needs two axes of positions, a volume three; here: {listed(axes)}"
            raise InputError(problem, file=m.file, key="grid")

    @property
    def unsaid(self) -> bool:
        """Whether nobody says how far the axes go."""
        return not any(name in self.nodes for name in self.lengths)

    def start_at(self, names: Iterable[str]) -> Floats:
        """Components of the output at the start, file units."""
        own = self.start.output[0] / self.m.component_factors
        return np.array([own[self.m.components.index(name)] for name in names])

    def given(self) -> AskedGrid:
        """Axes as far as they are given, held positions, and all combinations of the rotations that are given."""
        m = self.m
        along = {name: self.nodes[name] for name in self.lengths if name in self.nodes}
        axes = {name: np.sort(values) for name, values in along.items() if len(values) > 1}
        held = {name: values[0] for name, values in along.items() if len(values) == 1}
        turns = [name for name in m.components if name not in LENGTHS]
        if not any(name in self.nodes for name in turns) and len(m.drives) <= len(self.lengths):
            return AskedGrid(axes, held, ({},))
        # Where the drives turn the output as well, it has the orientation of the start unless another one is given.
        own = dict(zip(turns, self.start_at(turns).tolist(), strict=True))
        every = itertools.product(*(self.nodes.get(name, (own[name],)) for name in turns))
        return AskedGrid(axes, held, tuple(dict(zip(turns, values, strict=True)) for values in every))

    def swept(self) -> tuple[Floats, Floats]:
        """Lowest and highest positions of the output, file units, while the drives go through their ranges.

        Raises
        ------
        InputError
            When a drive that moves along a line has no range.
        """
        m, start = self.m, self.start
        low, high = self._drive_ranges()
        corners = list(itertools.islice(itertools.product(*zip(low, high, strict=True)), MOST_CORNERS))
        inner = low + (high - low) * np.random.default_rng(0).random((SAMPLES, len(low)))
        rows = np.vstack([corners, inner])
        n = len(rows)
        drives, poses = (np.repeat(values, n, axis=0) for values in (start.drives, start.poses))
        found = m.core.trace_grid([n], rows, list(range(n)), drives, poses, [False] * n, False)
        output = np.vstack([start.output, found["output"]]) / m.component_factors
        output = output[:, [m.components.index(name) for name in self.lengths]]
        output = output[np.isfinite(output).all(axis=1)]
        return output.min(axis=0), output.max(axis=0)

    def _drive_ranges(self) -> tuple[Floats, Floats]:
        """Ranges of the drives, SI; a drive that turns and has none goes half a turn to both sides."""
        m, ends = self.m, []
        for k, name in enumerate(m.drives):
            at = float(self.start.drives[0, k])
            if name not in m.limits.drives and m.coordinate_kind(m.drive_joints[k]) != "angle":
                problem = f"nothing says how far drive '{name}' goes: give its range here, or the box with a grid"
                raise InputError(problem, file=m.file, key=f"limits.drives.{name}")
            low, high = m.limits.drives.get(name, (at - np.pi, at + np.pi))
            ends.append((low, high))
        low, high = np.array(ends).T
        return low, high


def even(low: Floats, high: Floats, names: list[str], count: int) -> dict[str, Floats]:
    """Axes with about the same spacing, of which the longest has this many nodes; a short one has a finer one."""
    spacing = float((high - low).max()) / (count - 1)
    least = round(LEAST * (count - 1))
    along = zip(names, low.tolist(), high.tolist(), strict=True)
    return {name: np.linspace(a, b, max(least, round((b - a) / spacing)) + 1) for name, a, b in along}


def further(axes: Mapping[str, Floats], inside: Flags, most: int) -> dict[str, Floats]:
    """Longer axes where a region reaches their ends, of the same spacing while they have fewer nodes than most."""
    longer = {}
    for k, (name, values) in enumerate(axes.items()):
        step, more = float(values[1] - values[0]), int(np.ceil(FURTHER * len(values)))
        before, after = (more if np.take(inside, end, axis=k).any() else 0 for end in (0, -1))
        low, high = float(values[0]) - step * before, float(values[-1]) + step * after
        longer[name] = np.linspace(low, high, min(len(values) + before + after, max(most, len(values))))
    return longer


def widened(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """A box with its margin; a side that is much shorter than the others gets theirs as well."""
    sides = high - low
    more = MARGIN * np.maximum(sides, 0.1 * sides.max())
    return low - more, high + more


def around(axes: Mapping[str, Floats], inside: Flags) -> tuple[Floats, Floats, bool]:
    """The box of a coarse region with a spacing on each side, and whether it reached an edge of its grid."""
    low, high, cut = [], [], False
    for k, values in enumerate(axes.values()):
        places = np.flatnonzero(inside.any(axis=tuple(j for j in range(inside.ndim) if j != k)))
        step = float(values[1] - values[0])
        cut = cut or places[0] == 0 or places[-1] == len(values) - 1
        low.append(values[places[0]] - step)
        high.append(values[places[-1]] + step)
    return np.array(low), np.array(high), bool(cut)


def _ranges(m: Mechanism, grid: Mapping[str, Any] | None) -> dict[str, GridRange]:
    if grid is None:
        return dict(m.data.grid or {})
    raw = {name: list(v) if isinstance(v, tuple | np.ndarray) else v for name, v in grid.items()}
    try:
        return TypeAdapter(GridRanges).validate_python(raw)
    except ValidationError as error:
        key, problem = located(error, raw)
        raise InputError(problem, file=m.file, key=".".join(filter(None, ("grid", key)))) from None
