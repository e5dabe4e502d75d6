"""Closed form of the 3-UPU parallel robot: kinematics, statics and the load-determined pose error to first order.

Derived by hand from the legs: a leg transmits a force `F s` along its axis and a couple `M n` normal to both pins of a
universal joint, so that play acts as three errors of leg length and three errors of a constrained angle. Nothing here
is shared with the package.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Upu:
    """Metres. `turn` is the angle of the first pins from the tangent: 0 is Tsai's layout, 90 degrees the SNU's."""

    base_radius: float = 0.30
    platform_radius: float = 0.15
    radial: float = 10e-6
    axial: float = 20e-6
    half_pin: float = 0.02
    gap: float = 10e-6
    guide_length: float = 0.08
    guide_width: float = 0.03
    turn: float = 0.0
    legs: tuple[float, ...] = (0.0, 2 * np.pi / 3, 4 * np.pi / 3)

    def directions(self) -> Array:
        """Unit vectors from the centre to the legs, [leg, 3]."""
        return np.array([[np.cos(a), np.sin(a), 0.0] for a in self.legs])

    def pins(self) -> Array:
        """Directions of the pins on base and platform, [leg, 3]."""
        u = self.directions()
        tangent = np.cross([0.0, 0.0, 1.0], u)
        return np.cos(self.turn) * tangent + np.sin(self.turn) * u

    def legs_at(self, p: Array) -> tuple[Array, Array, Array, Array]:
        """Lengths, axes, constrained directions and the angles' cosines at a pose without rotation."""
        vectors = p - (self.base_radius - self.platform_radius) * self.directions()
        length = np.linalg.norm(vectors, axis=1)
        s = vectors / length[:, None]
        cosine = (s * self.pins()).sum(axis=1)
        n = (s - cosine[:, None] * self.pins()) / np.sqrt(1 - cosine**2)[:, None]
        return length, s, n, cosine

    def forward(self, length: Array) -> Array:
        """Position of the platform for given leg lengths, legs at 0, 120 and 240 degrees."""
        d = self.base_radius - self.platform_radius
        a, b, c = length**2
        x, y = (b + c - 2 * a) / (6 * d), (c - b) / (2 * np.sqrt(3) * d)
        return np.array([x, y, np.sqrt((a + b + c) / 3 - d**2 - x**2 - y**2)])

    def statics(self, p: Array, force: Array, moment: Array) -> tuple[Array, Array]:
        """Force along and couple on every leg."""
        _, s, n, _ = self.legs_at(p)
        along = -np.linalg.solve(s.T, force)
        levers = np.cross(self.platform_radius * self.directions(), s)
        return along, -np.linalg.solve(n.T, moment + along @ levers)

    def error(self, p: Array, force: Array, moment: Array) -> Array:
        """Error of the platform (x, y, z, rx, ry, rz), to first order."""
        _, s, n, cosine = self.legs_at(p)
        along, couple = self.statics(p, force, moment)
        sine = np.sqrt(1 - cosine**2)
        lever = couple / self.half_pin
        tangential = np.hypot(along * sine, lever)
        sums = [np.sqrt(along**2 + lever**2 - sign * 2 * along * lever * cosine) for sign in (1.0, -1.0)]
        by_force = 2 * (self.radial * along * sine**2 / tangential + self.axial * np.abs(cosine) * np.sign(along))
        by_force += self.radial * ((along - lever * cosine) / sums[0] + (along + lever * cosine) / sums[1])
        by_couple = 2 * self.radial * lever / tangential
        by_couple += self.radial * ((lever - along * cosine) / sums[0] + (lever + along * cosine) / sums[1])
        roll_or_tilt = np.maximum(2 * sine / self.guide_width, 2 * np.abs(cosine) / self.guide_length)
        by_couple = by_couple / self.half_pin + self.gap * np.sign(couple) * roll_or_tilt
        turned = np.linalg.solve(n, -by_couple)
        levers = np.cross(self.platform_radius * self.directions(), s)
        return np.concatenate([np.linalg.solve(s, -by_force - levers @ turned), turned])

    def support(self, p: Array, forces: Array, moments: Array) -> Array:
        """Largest work of loads, [..., 3] each, over all that the clearances allow, to first order."""
        _, s, n, cosine = self.legs_at(p)
        sine = np.sqrt(1 - cosine**2)
        along = -forces @ np.linalg.inv(s)
        levers = np.cross(self.platform_radius * self.directions(), s)
        couple = -(moments + along @ levers) @ np.linalg.inv(n)
        lever = couple / self.half_pin
        ends = np.hypot(along * sine, lever)
        crossed = [np.sqrt(along**2 + lever**2 - sign * 2 * along * lever * cosine) for sign in (1.0, -1.0)]
        pins = self.radial * (2 * ends + crossed[0] + crossed[1]) + 2 * self.axial * np.abs(along * cosine)
        guide = (
            self.gap * np.abs(couple) * np.maximum(2 * sine / self.guide_width, 2 * np.abs(cosine) / self.guide_length)
        )
        return np.asarray((pins + guide).sum(axis=-1))

    def turns(self, p: Array) -> Array:
        """Corners [8, 3] of the rotations that the clearances allow: three constrained angles, each within its own."""
        _, _, n, cosine = self.legs_at(p)
        roll_or_tilt = np.maximum(2 * np.sqrt(1 - cosine**2) / self.guide_width, 2 * np.abs(cosine) / self.guide_length)
        half = 4 * self.radial / self.half_pin + self.gap * roll_or_tilt
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
        return np.asarray(np.linalg.solve(n, (signs * half).T).T)
