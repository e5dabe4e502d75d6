"""Singularities for reading: the values, and in words what moves where they are smallest."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from jointplay.compile import LENGTHS
from jointplay.result import Result

from .layout import Column, commands, numbers, owners, words

#: what is said of each kind of singularity
KINDS = {
    "constraint": "The joints hold least",
    "actuation": "The drives hold least",
    "output": "The output follows least",
}
#: parts of a motion below this share of its largest part are not named
NAMED = 0.05
#: singular values below it are rounding
ROUNDING = 1e-12
#: as many bodies are named one by one
FEW = 4

Floats = np.ndarray[tuple[int, ...], np.dtype[Any]]


def columns(result: Result) -> list[Column]:
    """The columns of the table."""
    columns = [numbers(name, "value", result.get(f"{name}_singular_value"), digits=3) for name in KINDS]
    columns.append(replace(numbers("closure", "value", result.get("singular_value"), digits=3), spare=2))
    columns.append(replace(words("at or nearest", result.get("kind").tolist()), spare=1))
    if "singularity_distance" in result.data:
        distance = result.get("singularity_distance")
        columns.append(numbers("to a singularity", result.unit("singularity_distance"), distance))
        if np.isfinite(distance).any():
            columns.append(replace(words("kind", result.get("singularity_kind").tolist()), spare=1))
            for drive in result.labels("drive"):
                there = result.get("singularity_at", drive=drive)
                column = commands(f"{drive} there", result.unit("singularity_at", drive=drive), there)
                columns.append(replace(column, spare=3))
    return columns


def remarks(result: Result) -> Iterable[str]:
    """What the values mean here: where each is smallest, and which motion that is."""
    counted = str(result.attrs["output_components"])
    length = f"{float(result.attrs['length']):.4g} {result.unit('nominal', component=result.labels('component')[0])}"
    yield f"A radian counts as {length}, 0 is a singularity. Of the output count {counted}."
    for name, what in KINDS.items():
        values = result.get(f"{name}_singular_value")
        if np.isfinite(values).any():
            k = int(np.nanargmin(values))
            yield f"{what} at # {k} ({values[k] if values[k] > ROUNDING else 0.0:.3g}): {_motion(result, name, k)}."
    if "singularity_distance" in result.data:
        distance = result.get("singularity_distance")
        if len(distance) > 1 and np.isinf(distance).any():
            every = "The" if np.isinf(distance[~np.isnan(distance)]).all() else "Where no distance is shown, the"
            yield f"{every} path between the configurations meets no singularity of joints and drives."


def _motion(result: Result, name: str, configuration: int) -> str:
    bodies = _parts(result, result.get(f"{name}_motion")[configuration])
    largest = float(bodies.max())
    those = [k for k, part in enumerate(bodies.max(axis=1).tolist()) if part > NAMED * largest]
    moving = list(dict.fromkeys(owners(result)[k] for k in those))
    named = moving if len(moving) <= FEW else [*moving[: FEW - 1], f"{len(moving) - FEW + 1} more"]
    turns, shifts = _parts(result, result.get(f"{name}_twist")[configuration][None])[0][::-1]
    does = {(False, False): "does not move", (True, False): "turns", (False, True): "moves"}
    output = does.get((turns > NAMED * largest, shifts > NAMED * largest), "moves and turns")
    if len(moving) == 1:
        shift, turn = bodies[those[0]]
        return f"{moving[0]} {'turns' if turn > NAMED * shift else 'slides'}, the output {output}"
    return f"{', '.join(named[:-1])} and {named[-1]} move together, the output {output}"


def _parts(result: Result, twists: Floats) -> Floats:
    """Largest shift, in characteristic lengths, and largest turn, in radians, of each twist."""
    lengths = np.isin(result.labels("component"), LENGTHS)
    units = result.coords["component_unit"].values.tolist()
    degrees = np.array([np.pi / 180 if unit == "deg" else 1.0 for unit in units])
    sizes = np.abs(twists) * degrees
    shift = sizes[..., lengths].max(axis=-1) / float(result.attrs["length"])
    return np.stack([shift, sizes[..., ~lengths].max(axis=-1)], axis=-1)
