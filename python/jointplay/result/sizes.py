"""Position and rotation, out of the components of a pose: (x, y, angle), or (x, y, z, rx, ry, rz)."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointplay.compile import LENGTHS

from .structure import Array, Result


def split(components: list[str]) -> tuple[list[str], list[str]]:
    """The components that are lengths, and those that are angles.

    Examples
    --------
    >>> split(["x", "y", "angle"])
    (['x', 'y'], ['angle'])
    """
    return [c for c in components if c in LENGTHS], [c for c in components if c not in LENGTHS]


def size(result: Result, name: str, quantity: str, **at: Any) -> Array:
    """Size of the position or of the rotation of a variable that has components.

    Parameters
    ----------
    quantity : {"position", "rotation"}
    **at
        Labels along its other dimensions.
    """
    lengths, angles = split(result.labels("component"))
    chosen = lengths if quantity == "position" else angles
    parts = [result.get(name, component=component, **at) for component in chosen]
    return np.asarray(np.linalg.norm(np.stack(parts), axis=0))


def unit_of(result: Result, quantity: str) -> str:
    """Unit of positions or of rotations."""
    lengths, angles = split(result.labels("component"))
    return result.unit("nominal", component=(lengths if quantity == "position" else angles)[0])
