"""Singularities for reading: the values, and in words what moves where they are smallest."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from jointplay.result import Result
from jointplay.result.conclusions import KINDS, motion

from .layout import Column, commands, numbers, words

#: singular values below it are rounding
ROUNDING = 1e-12


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
            yield f"{what} at # {k} ({values[k] if values[k] > ROUNDING else 0.0:.3g}): {motion(result, name, k)}."
    if "singularity_distance" in result.data:
        distance = result.get("singularity_distance")
        # Where the whole path meets none, the answer says so.
        if np.isfinite(distance).any() and np.isinf(distance).any():
            yield "Where no distance is shown, the path between the configurations meets no singularity."
