"""The error over the workspace, by the general engine."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import jointplay as jp

from .closed_form import Floats, Upu
from .robot import at, radians, robot, sizes_of
from .study import FORCE, MOMENT

#: half the edge of the square that is mapped, mm; its corners are 0.71 of the way from the axis to the cylinder
REACH = 150.0
#: nodes along the edge of the square by height, mm
LEVELS = {300.0: 21, 400.0: 41, 500.0: 21}
WORST_HEIGHT, WORST_COUNT = 400.0, 11
#: what a table holds of a node
LOADED = (
    "x_mm",
    "y_mm",
    "z_mm",
    "position_mm",
    "rotation_deg",
    "position_first_order_mm",
    "rotation_first_order_deg",
    "undetermined_mm",
)
FLAGS = ("status", "contact_changes_along_x", "contact_changes_along_y")
#: the fields of a level that the columns after the position are
SIZES = ("position", "rotation", "position_first_order", "rotation_first_order", "undetermined")
WORST = ("x_mm", "y_mm", "z_mm", "position_mm", "rotation_deg")
DIGITS = 5


@dataclass(frozen=True)
class Level:
    """The error under the load over a square, [x, y].

    `undetermined` is the size of the displacement's half-widths; `changes` are between a node and the next one.
    """

    z: float
    x: Floats
    y: Floats
    position: Floats
    rotation: Floats
    position_first_order: Floats
    rotation_first_order: Floats
    undetermined: Floats
    status: Any
    changes: Any


@dataclass(frozen=True)
class Largest:
    """The largest error that the play allows over a square, [x, y]."""

    z: float
    x: Floats
    y: Floats
    position: Floats
    rotation: Floats


@dataclass(frozen=True)
class Maps:
    """All maps of the page."""

    levels: tuple[Level, ...]
    largest: Largest

    def level(self, z: float) -> Level:
        """The one at a height."""
        return next(level for level in self.levels if level.z == z)


def compute() -> Maps:
    """Ask for every map. Takes a minute or two."""
    m = at(robot(), [0.0, 0.0, 400.0], FORCE, MOMENT)
    return Maps(tuple(_level(m, z, count) for z, count in LEVELS.items()), _largest(m))


def _square(z: float, count: int) -> dict[str, Any]:
    edge = {"from": -REACH, "to": REACH, "count": count}
    return {"x": edge, "y": edge, "z": z}


def _level(m: jp.Mechanism, z: float, count: int) -> Level:
    result = jp.map(m, "loaded", _square(z, count)).transpose("x", "y", ...)
    position, rotation = sizes_of(result.error.values)
    first = sizes_of(result.error_first_order.values)
    changes = result.contact_change.transpose("x", "y", "across").sel(across=["x", "y"]).values
    open_to, _ = sizes_of(result.undetermined.values)
    status = result.status.values
    return Level(z, result.x.values, result.y.values, position, rotation, *first, open_to, status, changes)


def _largest(m: jp.Mechanism) -> Largest:
    result = jp.map(m, "worst", _square(WORST_HEIGHT, WORST_COUNT)).transpose("x", "y", ...)
    found = result.worst_position.values, result.worst_rotation.values
    return Largest(WORST_HEIGHT, result.x.values, result.y.values, *found)


def closed_form(level: Level) -> tuple[Floats, Floats]:
    """Sizes of displacement and rotation at the nodes of a level by the closed form, in mm and degrees."""
    places = np.stack([*np.meshgrid(level.x, level.y, indexing="ij"), np.full(level.position.shape, level.z)], axis=-1)
    position, rotation = sizes_of(Upu().error(places, FORCE, MOMENT))
    return position, np.degrees(rotation)


def save(maps: Maps, loaded: Path, worst: Path) -> None:
    """Write the tables."""
    rows: list[Sequence[Any]] = []
    for level in maps.levels:
        for i, j in np.ndindex(level.position.shape):
            numbers = [f"{getattr(level, name)[i, j]:.{DIGITS}f}" for name in SIZES]
            flags = level.status[i, j], *level.changes[i, j].astype(int)
            rows.append([f"{level.x[i]:g}", f"{level.y[j]:g}", f"{level.z:g}", *numbers, *flags])
    _write(loaded, (*LOADED, *FLAGS), rows)
    rows = []
    for i, j in np.ndindex(maps.largest.position.shape):
        numbers = [f"{size[i, j]:.{DIGITS}f}" for size in (maps.largest.position, maps.largest.rotation)]
        rows.append([f"{maps.largest.x[i]:g}", f"{maps.largest.y[j]:g}", f"{maps.largest.z:g}", *numbers])
    _write(worst, WORST, rows)


def _write(path: Path, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([header, *rows])


def at_nodes(level: Level, nodes: Sequence[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Displacement and rotation at some nodes, asked along a path instead of over a grid."""
    places = [[level.x[i], level.y[j], level.z] for i, j in nodes]
    error = radians(jp.loaded(at(robot(), places, FORCE, MOMENT)).error.values)
    position, rotation = sizes_of(error)
    return position, np.degrees(rotation)
