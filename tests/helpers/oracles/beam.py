"""The beam equation, integrated along a member in ground axes: no matrix of compliances, no axes of joints."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: steel, N/mm^2, and a section, mm^2 and mm^4
E, G, AREA, INERTIA, TORSION = 210e3, 80e3, 80.0, 1067.0, 2000.0
#: what the file says of such a member, bending apart
MEMBER = f"[bodies.beam]\nE = {E}\narea = {AREA}\n"
#: how a file begins, in the plane and in space
HEAD = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n'
SPATIAL = HEAD + 'space = "spatial"\n'


def pin(name: str, on: str, more: str = "", kind: str = "revolute") -> str:
    """A joint of a file."""
    return f'[joints.{name}]\ntype = "{kind}"\non = {{ {on} }}\n{more}\n'


def beam(axis: Array, side: Array, length: float, wrench: Array, inertias: tuple[float, float]) -> Array:
    """Displacement and rotation of the end of a cantilever, by integration along it; SI, ground axes."""
    normal = np.cross(axis, side)
    force, moment = wrench[:3], wrench[3:]
    turning = sum(np.outer(a, a) / (E * 1e6 * i * 1e-12) for a, i in zip((side, normal), inertias, strict=True))
    turning = turning + np.outer(axis, axis) / (G * 1e6 * TORSION * 1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x, w = length * (nodes + 1) / 2, length * weights / 2
    curvature = np.array([turning @ (moment + (length - at) * np.cross(axis, force)) for at in x])
    rotation = w @ curvature
    # A turn at x carries the end along by the rest of the length.
    deflection = w @ np.array([np.cross(k, (length - at) * axis) for k, at in zip(curvature, x, strict=True)])
    stretch = axis * (axis @ force) * length / (E * 1e6 * AREA * 1e-6)
    return np.concatenate([deflection + stretch, rotation])
