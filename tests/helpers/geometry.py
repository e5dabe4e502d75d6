"""Points and directions by closed forms."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def meeting(one: np.ndarray, other: np.ndarray | complex, drawn: tuple[complex, complex, complex]) -> np.ndarray:
    """Where circles about two points meet, with the radii and on the side of the drawing."""
    start, end, point = drawn
    near, far, base = abs(point - start), abs(point - end), abs(other - one)
    along = (near**2 - far**2 + base**2) / (2 * base)
    side = np.sign(((point - start) / (end - start)).imag)
    return one + (along + side * 1j * np.sqrt(near**2 - along**2)) * (other - one) / base


def unit_vectors(count: int) -> Array:
    """Directions spread evenly over the sphere, along a spiral."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])
