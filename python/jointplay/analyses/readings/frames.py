"""Where a measuring device has the ground axes of the file: a frame that is known, or found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats

#: part of the longest extent of measured places below which they are on a line
LINE = 1e-6
#: which small displacements a frame can have, by the number of axes
FRAME_COLUMNS = {2: (0, 1, 5), 3: (0, 1, 2, 3, 4, 5)}


@dataclass(frozen=True)
class DeviceFrame:
    """Where the measuring device has the ground: a rotation, and then a translation, SI."""

    turn: Floats
    shift: Floats

    @classmethod
    def none(cls) -> DeviceFrame:
        """That of the ground itself."""
        return cls(np.zeros(3), np.zeros(3))

    def moved(self, by: Floats) -> DeviceFrame:
        """The frame after a small displacement: translation, rotation vector."""
        about = poses.quaternion(by[3:])
        turn = poses.rotation_vector(poses.product(about, poses.quaternion(self.turn)))
        return DeviceFrame(np.asarray(turn), poses.turned_by(by[3:]) @ self.shift + by[:3])

    def places(self, on_ground: Floats) -> Floats:
        """Places in its axes, last axis two or three."""
        axes = on_ground.shape[-1]
        return np.asarray(on_ground @ poses.turned_by(self.turn)[:axes, :axes].T + self.shift[:axes])


def nearest_frame(nominal: Floats, measured: Floats) -> DeviceFrame:
    """The frame that brings places nearest to measured ones (Kabsch 1976)."""
    axes = nominal.shape[1]
    middle, seen = nominal.mean(axis=0), measured.mean(axis=0)
    left, sizes, right = np.linalg.svd((measured - seen).T @ (nominal - middle))
    if sizes[axes - 2] <= LINE * sizes[0]:
        # About a line of places, or at a single one, any turn is as good.
        left, right = np.eye(axes), np.eye(axes)
    signs = np.ones(axes)
    signs[-1] = np.sign(np.linalg.det(left @ right))
    turn = np.eye(3)
    turn[:axes, :axes] = (left * signs) @ right
    shift = np.zeros(3)
    shift[:axes] = seen - turn[:axes, :axes] @ middle
    return DeviceFrame(poses.rotation_vector(poses.from_axes(turn)), shift)


def by_frame_of(pose: Floats, axes: int) -> Floats:
    """How a pose moves with its frame, shape (station, component, 6)."""
    found = np.zeros((*pose.shape, 6))
    place = np.zeros((len(pose), 3))
    place[:, :axes] = pose[:, :axes]
    found[:, :axes, :axes] = np.eye(axes)
    # A turn w moves a point by w x p.
    cross = np.zeros((len(pose), 3, 3))
    for k, axis in enumerate(np.eye(3)):
        cross[:, :, k] = np.cross(axis, place)
    found[:, :axes, 3:] = cross[:, :axes]
    if axes == 2:
        found[:, 2, 5] = 1.0
    else:
        found[:, 3:, 3:] = np.eye(3)
    return found
