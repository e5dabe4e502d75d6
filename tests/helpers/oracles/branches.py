"""On which side of its singular poses a parallel robot is, from constraint equations written by hand for each.

    g(x, q) = 0        x the pose of the platform, q the drives
    det dg/dx          zero where the platform can move although the drives are held

And which poses a fine path reaches: inverse kinematics in closed form on a grid that is finer than the map, and what of
it hangs together with the start without a change of the sign. Nothing here is shared with the package. Lengths in
millimetres, angles in radians.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, label

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: step of the central differences, of a unit of length or angle
STEP = 1e-4


def turned(rotation: Floats) -> Floats:
    """Rotation matrices of rotation vectors, by Rodrigues' formula."""
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(rotation, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([np.stack(row, -1) for row in ([zero, -z, y], [z, zero, -x], [-y, x, zero])], -2)
    small = np.where(angle == 0.0, 1.0, angle)
    return np.eye(3) + np.sin(angle) / small * cross + (1.0 - np.cos(angle)) / small**2 * cross @ cross


def plane(angle: Floats) -> Floats:
    """Rotation matrices of the plane."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def squared(v: Floats) -> Floats:
    return np.asarray((v * v).sum(-1))


def elbow(reach: Floats, first: float, second: float, side: float) -> Floats:
    """Where the elbow of two links is that reach so far, the first one from the origin; not a number out of reach."""
    far = np.linalg.norm(reach, axis=-1)
    along = (far**2 + first**2 - second**2) / (2.0 * far)
    with np.errstate(invalid="ignore"):
        aside = side * np.sqrt(first**2 - along**2)
    unit = reach / far[..., None]
    return along[..., None] * unit + aside[..., None] * np.stack([-unit[..., 1], unit[..., 0]], -1)


@dataclass(frozen=True)
class Robot:
    """A parallel robot."""

    #: from poses of the platform and drives to what the equations lack
    constraints: Callable[[Floats, Floats], Floats]
    #: from poses to the drives in the working mode of the start
    inverse: Callable[[Floats], Floats]
    #: pose of the platform at the start
    start: Floats
    #: by which lengths are compared with angles
    size: float = 100.0
    #: how many of the numbers of a pose are lengths
    lengths: int = field(default=3)

    def sign(self, pose: Floats, drives: Floats) -> Floats:
        """Sign of det dg/dx, one at the start."""
        first = self._determinant(self.start[None], self.inverse(self.start[None]))
        return np.sign(self._determinant(pose, drives)) * np.sign(first)

    def _determinant(self, pose: Floats, drives: Floats) -> Floats:
        columns = []
        for k in range(pose.shape[-1]):
            step = np.zeros(pose.shape[-1])
            step[k] = STEP * (self.size if k < self.lengths else 1.0)
            above, below = (
                self.constraints(self._moved(pose, step), drives),
                self.constraints(self._moved(pose, -step), drives),
            )
            columns.append((above - below) / (2.0 * STEP))
        return np.asarray(np.linalg.det(np.nan_to_num(np.stack(columns, -1))))

    def _moved(self, pose: Floats, step: Floats) -> Floats:
        return pose + step

    def reached(self, axes: list[Floats], held: Floats, places: list[int], finer: int) -> tuple[Flags, Flags]:
        """Which nodes of a grid of poses a fine path reaches from the start, and which are clear of where it ends.

        Parameters
        ----------
        axes : list of ndarray
            Values of the nodes.
        held : ndarray
            The pose at which the other numbers are held.
        places : list of int
            Which numbers of a pose the axes are.
        finer : int
            Steps between two nodes.
        """
        fine = [np.interp(np.arange(finer * (len(a) - 1) + 1) / finer, np.arange(len(a)), a) for a in axes]
        mesh = np.stack(np.meshgrid(*fine, indexing="ij"), -1)
        pose = np.broadcast_to(held, (*mesh.shape[:-1], len(held))).copy()
        pose[..., places] = mesh
        flat = pose.reshape(-1, len(held))
        drives = self.inverse(flat)
        known = np.isfinite(drives).all(-1)
        sign = np.where(known, self.sign(flat, drives), 0.0)
        return component(sign.reshape(mesh.shape[:-1]) > 0, fine, self.start[places], finer)


def component(there: Flags, fine: list[Floats], start: Floats, finer: int) -> tuple[Flags, Flags]:
    """The nodes of what hangs together with the start, and those that are two fine steps away from its edge."""
    parts, _ = label(there)
    at = tuple(int(np.abs(a - s).argmin()) for a, s in zip(fine, start, strict=True))
    own = parts == parts[at] if parts[at] else np.zeros_like(there)
    every = tuple(slice(None, None, finer) for _ in fine)
    inside = binary_erosion(own, iterations=2, border_value=1)
    outside = binary_erosion(~own, iterations=2, border_value=1)
    return own[every], (inside | outside)[every]


def five_bar(ground: float, proximal: float, distal: float, at: tuple[float, float]) -> Robot:
    """Elbows outside."""
    pivots = np.array([[-ground, 0.0], [ground, 0.0]])

    def constraints(pose: Floats, drives: Floats) -> Floats:
        elbows = pivots + proximal * np.stack([np.cos(drives), np.sin(drives)], -1)
        return squared(pose[..., None, :] - elbows) - distal**2

    def inverse(pose: Floats) -> Floats:
        sides = (1.0, -1.0)
        found = [elbow(pose - pivot, proximal, distal, side) for pivot, side in zip(pivots, sides, strict=True)]
        return np.stack([np.arctan2(e[..., 1], e[..., 0]) for e in found], -1)

    return Robot(constraints, inverse, np.array(at), lengths=2)


def three_rrr() -> Robot:
    """All legs bend to the same side."""
    base = np.array([[-260.0, -150.0], [260.0, -150.0], [0.0, 300.0]])
    corners = np.array([[-69.282, -40.0], [69.282, -40.0], [0.0, 80.0]])

    def ends(pose: Floats) -> Floats:
        return pose[..., None, :2] + (plane(pose[..., 2])[..., None, :, :] @ corners[:, :, None])[..., 0]

    def constraints(pose: Floats, drives: Floats) -> Floats:
        elbows = base + 150.0 * np.stack([np.cos(drives), np.sin(drives)], -1)
        return squared(ends(pose) - elbows) - 150.0**2

    def inverse(pose: Floats) -> Floats:
        found = elbow(ends(pose) - base, 150.0, 150.0, 1.0)
        return np.arctan2(found[..., 1], found[..., 0])

    return Robot(constraints, inverse, np.zeros(3), lengths=2)


def corners(radius: float, degrees: list[float]) -> Floats:
    """Points on a level circle."""
    angles = np.radians(degrees)
    return radius * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], -1)


def on_platform(pose: Floats, points: Floats) -> Floats:
    """Points of the platform; the pose is position and rotation vector."""
    return pose[..., None, :3] + (turned(pose[..., 3:])[..., None, :, :] @ points[:, :, None])[..., 0]


def stewart_gough() -> Robot:
    """Six legs, two neighbours 30 degrees apart on the base, on the platform with their other neighbours."""
    base = corners(300.0, [15, 105, 135, 225, 255, 345])
    top = corners(200.0, [45, 75, 165, 195, 285, 315])

    def constraints(pose: Floats, drives: Floats) -> Floats:
        return squared(on_platform(pose, top) - base) - drives**2

    def inverse(pose: Floats) -> Floats:
        return np.linalg.norm(on_platform(pose, top) - base, axis=-1)

    return Robot(constraints, inverse, np.array([0, 0, 400.0, 0, 0, 0]))


def three_upu() -> Robot:
    """Pins along the circle: each leg has a length, and second pins that are across those of base and platform."""
    base, top = corners(300.0, [0, 120, 240]), corners(150.0, [0, 120, 240])
    pins = np.cross([0.0, 0.0, 1.0], base / 300.0)

    def constraints(pose: Floats, drives: Floats) -> Floats:
        legs = on_platform(pose, top) - base
        length = np.linalg.norm(legs, axis=-1)
        moved = (turned(pose[..., 3:])[..., None, :, :] @ pins[:, :, None])[..., 0]
        across = (np.cross(pins, legs / length[..., None]) * moved).sum(-1)
        return np.concatenate([length - drives, 100.0 * across], -1)

    def inverse(pose: Floats) -> Floats:
        return np.linalg.norm(on_platform(pose, top) - base, axis=-1)

    return Robot(constraints, inverse, np.array([0, 0, 400.0, 0, 0, 0]))


def delta() -> Robot:
    """Two rods to each arm; the arms are drawn with the platform at the height of 400."""
    outwards = corners(1.0, [0, 120, 240])
    tangent = np.cross([0.0, 0.0, 1.0], outwards)
    down = np.array([0.0, 0.0, -1.0])

    def arms(drives: Floats) -> Floats:
        angle = drives[..., None] + drawn
        return 150.0 * outwards + 200.0 * (np.cos(angle) * outwards + np.sin(angle) * down)

    def constraints(pose: Floats, drives: Floats) -> Floats:
        found = [
            squared(on_platform(pose, 50.0 * outwards + side * tangent) - arms(drives) - side * tangent) - 450.0**2
            for side in (40.0, -40.0)
        ]
        return np.concatenate(found, -1)

    def absolute(pose: Floats) -> Floats:
        """Angles below the level, elbows outside."""
        reach = on_platform(pose, 50.0 * outwards) - 150.0 * outwards
        aside = (reach * tangent).sum(-1)
        in_plane = np.stack([(reach * outwards).sum(-1), -reach[..., 2]], -1)
        with np.errstate(invalid="ignore"):
            rod = np.sqrt(450.0**2 - aside**2)
        far = np.linalg.norm(in_plane, axis=-1)
        with np.errstate(invalid="ignore"):
            bend = np.arccos((far**2 + 200.0**2 - rod**2) / (2.0 * far * 200.0))
        return np.asarray(np.arctan2(in_plane[..., 1], in_plane[..., 0]) - bend)

    start = np.array([0, 0, -400.0, 0, 0, 0])
    drawn = absolute(start[None])[0][:, None]

    def inverse(pose: Floats) -> Floats:
        return absolute(pose) - drawn[:, 0]

    return Robot(constraints, inverse, start)
