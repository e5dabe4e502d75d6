"""The 3-UPU leg by leg: what each leg transmits, and the pose error that its play allows.

A leg transmits a force F along its axis s and a couple M along n, which is normal to both pins of a universal
joint. The work that this wrench can do over the play of the leg's five joints is

    H(F, M) = 2 (radial sqrt(F^2 sin^2 + m^2) + axial |F cos|)              the pins on base and platform
            + radial (sqrt(F^2 + m^2 - 2 F m cos) + sqrt(F^2 + m^2 + 2 F m cos))    the pins on the leg
            + gap |M| max(2 sin / width, 2 |cos| / length)                  the guide, which rolls or tilts

with m = M / (half the pin), cos = s . (pin on the base). Its gradient is what the leg is off: in length and in the
angle that it holds. Millimetres, newtons, radians; arrays may have any leading dimensions (poses, loads).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: directions from which the largest error is searched for, and steps from each of the best
DIRECTIONS, BEST, STEPS = 2000, 20, 60
#: forces and couples that are smaller parts of the largest one, or of a newton and a newton millimetre, are none
NOISE = 1e-11


@dataclass(frozen=True)
class Upu:
    """Sizes, named as those of the bundled example; Tsai's layout."""

    base_radius: float = 300.0
    platform_radius: float = 150.0
    radial: float = 0.01
    axial: float = 0.02
    pin_length: float = 40.0
    gap: float = 0.01
    guide_length: float = 80.0
    guide_width: float = 30.0

    @property
    def difference(self) -> float:
        """D, the difference of the radii."""
        return self.base_radius - self.platform_radius

    def error(self, position: Any, force: Any, moment: Any) -> Floats:
        """Error (x, y, z, rx, ry, rz) of the platform's middle under a load there, to first order."""
        legs = Legs(self, np.asarray(position, dtype=float))
        return legs.displaced(*self._off(legs, *legs.transmitted(force, moment)))

    def work(self, position: Any, force: Any, moment: Any) -> Floats:
        """Support function of the set of errors: the most work that a load can do over all play."""
        legs = Legs(self, np.asarray(position, dtype=float))
        along, couple = legs.transmitted(force, moment)
        by_force, by_couple = self._off(legs, along, couple)
        # H is homogeneous: it is its gradient times its argument.
        work: Floats = -(along * by_force + couple * by_couple).sum(axis=-1)
        return work

    def largest(self, position: Any) -> tuple[float, float]:
        """Largest displacement and largest rotation of the set of errors at one position, to first order."""
        return self._farthest(position, slice(0, 3)), self._farthest(position, slice(3, 6))

    def _farthest(self, position: Any, part: slice) -> float:
        def load(directions: Floats) -> tuple[Floats, Floats]:
            return (directions, 0 * directions) if part.start == 0 else (0 * directions, directions)

        directions = _sphere(DIRECTIONS)
        directions = directions[np.argsort(self.work(position, *load(directions)))[-BEST:]]
        for _ in range(STEPS):  # along the error that a direction selects, the set reaches at least as far
            error = self.error(position, *load(directions))[..., part]
            directions = error / np.linalg.norm(error, axis=-1, keepdims=True)
        return float(self.work(position, *load(directions)).max())

    def _off(self, legs: Legs, along: Floats, couple: Floats) -> tuple[Floats, Floats]:
        """What every leg is off in length and in the angle that it holds: the gradient of H, reversed."""
        cos, sin, m = legs.cos, legs.sin, couple / (self.pin_length / 2)
        first = np.hypot(along * sin, m)
        ends = [np.sqrt(along**2 + m**2 + sign * 2 * along * m * cos) for sign in (-1, 1)]
        per_force = 2 * (self.radial * _part(along * sin**2, first) + self.axial * np.abs(cos) * np.sign(along))
        per_lever = 2 * self.radial * _part(m, first)
        for sign, end in zip((-1, 1), ends, strict=True):
            per_force += self.radial * _part(along + sign * m * cos, end)
            per_lever += self.radial * _part(m + sign * along * cos, end)
        guide = self.gap * np.maximum(2 * sin / self.guide_width, 2 * np.abs(cos) / self.guide_length)
        return -per_force, -(per_lever / (self.pin_length / 2) + guide * np.sign(couple))


class Legs:
    """The legs of a robot at positions of its platform, [..., 3]."""

    def __init__(self, robot: Upu, position: Floats) -> None:
        angles = np.radians([0, 120, 240])
        outwards = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
        pins = np.cross([0.0, 0.0, 1.0], outwards)
        vectors = position[..., None, :] - robot.difference * outwards
        self.length: Floats = np.sqrt((vectors**2).sum(axis=-1))
        self.s: Floats = vectors / self.length[..., None]
        self.cos: Floats = (self.s * pins).sum(axis=-1)
        self.sin: Floats = np.sqrt(1 - self.cos**2)
        self.n: Floats = (self.s - self.cos[..., None] * pins) / self.sin[..., None]
        self.levers: Floats = np.cross(robot.platform_radius * outwards, self.s)

    def transmitted(self, force: Any, moment: Any) -> tuple[Floats, Floats]:
        """Force along and couple of every leg on the platform, [..., 3]."""
        force, moment = np.asarray(force, dtype=float), np.asarray(moment, dtype=float)
        along = -_solved(np.swapaxes(self.s, -1, -2), force)
        by_legs = (along[..., None] * self.levers).sum(axis=-2)
        return _cleaned(along), _cleaned(-_solved(np.swapaxes(self.n, -1, -2), moment + by_legs))

    def displaced(self, longer: Floats, turned: Floats) -> Floats:
        """Error of the platform for legs that are longer, and turned about n, by so much."""
        rotation = _solved(self.n, turned)
        lifted = (self.levers * rotation[..., None, :]).sum(axis=-1)
        return np.concatenate([_solved(self.s, longer - lifted), rotation], axis=-1)


def _solved(matrix: Floats, right: Floats) -> Floats:
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0], dtype=float)


def _cleaned(transmitted: Floats) -> Floats:
    """Zeros in place of rounding noise, which would send play to one side."""
    size = np.abs(transmitted)
    cleaned: Floats = np.where(size > NOISE * size.max(initial=1.0), transmitted, 0.0)
    return cleaned


def _part(value: Floats, of: Floats) -> Floats:
    """A quotient; zero where nothing is transmitted, for there the play is not taken up."""
    quotient: Floats = np.divide(value, of, out=np.zeros(np.broadcast(value, of).shape), where=of != 0)
    return quotient


def _sphere(n: int) -> Floats:
    """Directions along a spiral that turns by the golden angle."""
    z = 1 - 2 * (np.arange(n) + 0.5) / n
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(n)
    ring = np.sqrt(1 - z**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=-1)
