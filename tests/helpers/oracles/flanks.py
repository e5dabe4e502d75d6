"""Two wheels between which several couplings mesh: specimens by plain rejection.

With c from the centre of a coupling on the first wheel to that on the second one, and psi its direction, the flanks of
coupling k are displaced by R and opened by E,

    R = r1 (theta1 - psi) + r2 (theta2 - psi) - start,    E = k (f(rho) - f(rho0)),  f(rho) = rho - b atan(rho / b)
    rho^2 = c^2 - b^2,   gear: b = (r1 + r2) cos(alpha), k = 1 / cos(alpha);   crossed belt: b = r1 + r2, k = -1

and an offset u about the middle m of its play of half-width h displaces it by w = m + (u - m) (1 + E / h). All offsets
are drawn by their laws. A specimen is kept where the second wheel can be turned so that all flanks miss their
displacements by less than a small length together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Mesh:
    """A coupling between the wheels; the angle is that of the line of centres at rest."""

    teeth: tuple[int, int]
    radii: tuple[float, float]
    #: zero for a crossed belt
    pressure: float
    #: of the coupling on both wheels, at rest
    eccentric: complex
    low: float
    high: float
    belt: bool = False

    @property
    def half(self) -> float:
        return 0.5 * (self.high - self.low)

    @property
    def middle(self) -> float:
        return 0.5 * (self.high + self.low)

    def at(self, apart: complex, shifts: NDArray[np.complex128], turn: Floats) -> tuple[Floats, Floats]:
        """Displacement and gap, for shifts of the second wheel against the first one, and its turn."""
        r1, r2 = self.radii
        c = apart + shifts + self.eccentric * (np.exp(1j * turn) - 1.0)
        psi = np.angle(c / apart)
        base, factor = (r1 + r2, -1.0) if self.belt else ((r1 + r2) * np.cos(self.pressure), 1 / np.cos(self.pressure))

        def involute(distance: Floats) -> Floats:
            rho = np.sqrt(distance**2 - base**2)
            return rho - base * np.arctan(rho / base)

        opened = factor * (involute(np.abs(c)) - involute(np.abs(apart if self.belt else complex(r1 + r2))))
        return r2 * turn - (r1 + r2) * psi, 1.0 + opened / self.half


@dataclass(frozen=True)
class Wheels:
    """Both wheels, the first one held at its angle, in bearings of these radial clearances."""

    apart: complex
    bearings: tuple[float, float]
    meshes: tuple[Mesh, ...]
    normal: bool

    def _in_disc(self, radius: float, count: int, rng: np.random.Generator) -> NDArray[np.complex128]:
        if self.normal:
            # Three standard deviations are the radius.
            drawn = rng.normal(size=(2, 2 * count + 1000)) / 3.0
            drawn = drawn[:, np.hypot(*drawn) < 1.0][:, :count]
        else:
            size, angle = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
            drawn = np.array([size * np.cos(angle), size * np.sin(angle)])
        return np.asarray(radius * (drawn[0] + 1j * drawn[1]))

    def _between(self, mesh: Mesh, count: int, rng: np.random.Generator) -> Floats:
        if not self.normal:
            return mesh.low + (mesh.high - mesh.low) * rng.random(count)
        drawn = rng.normal(size=2 * count) / 3.0
        return mesh.middle + mesh.half * drawn[np.abs(drawn) < 1.0][:count]

    def kept(self, count: int, near: float, rng: np.random.Generator) -> Floats:
        """Shift of the second wheel (x, y), its turn, and the offsets of all flanks, one specimen a row.

        `near` is by how much flanks may miss each other, as a part of the smallest play.
        """
        first, second = (self._in_disc(radius, count, rng) for radius in self.bearings)
        offsets = np.array([self._between(mesh, count, rng) for mesh in self.meshes])
        shifts, turn = second - first, np.zeros(count)

        def missing(turn: Floats) -> tuple[Floats, Floats]:
            found = [mesh.at(self.apart, shifts, turn) for mesh in self.meshes]
            rows, gaps = (np.array(of) for of in zip(*found, strict=True))
            middles = np.array([mesh.middle for mesh in self.meshes])[:, None]
            return rows - middles - (offsets - middles) * gaps, gaps

        step = 1e-6
        at_rest = [mesh.at(self.apart, np.zeros(2, complex), np.array([-step, step]))[0] for mesh in self.meshes]
        slopes = np.array([np.diff(rows)[0] / (2 * step) for rows in at_rest])
        for _ in range(6):
            turn = turn - slopes @ missing(turn)[0] / (slopes @ slopes)
        missed, gaps = missing(turn)
        smallest = min(mesh.half for mesh in self.meshes)
        kept = (np.linalg.norm(missed, axis=0) < near * smallest) & (gaps > 0.0).all(axis=0)
        return np.stack([second.real, second.imag, turn, *offsets])[:, kept].T


def drawn(seed: int) -> Wheels:
    """Random wheels: gears of unlike pressure angles and backlash, crossed belts, eccentric ones, rigid bearings."""
    rng = np.random.default_rng(seed)
    count, module = (2, 2, 3)[seed % 3], 2e-3
    apart = 60 * module / 2
    play = 10 ** rng.uniform(-4.5, -4.0)
    meshes = []
    for k in range(count):
        teeth = [(20, 40), (25, 35), (30, 30), (42, 18)][rng.integers(4)]
        belt = bool(seed % 4 == 1 and k == 1)
        radii = tuple(module / 2 * z * (0.5 if belt else 1.0) for z in teeth)
        eccentric = 0.15 * apart * np.exp(2j * np.pi * rng.random()) * float(rng.random() < 0.4)
        high, low = play * rng.uniform(0.5, 1.5, 2)
        pressure = 0.0 if belt else float(np.radians(rng.choice([14.5, 20.0, 25.0])))
        low = low if belt else high
        meshes.append(Mesh(teeth, radii, pressure, complex(eccentric), -float(low), float(high), belt))
    largest = 0.4 if count == 2 else 0.8
    bearings = [play * float(rng.uniform(0.2, largest)) for _ in range(2)]
    if seed % 5 == 2:
        bearings[seed % 2] = 0.0
    return Wheels(complex(apart), (bearings[0], bearings[1]), tuple(meshes), bool(rng.random() < 0.4))
