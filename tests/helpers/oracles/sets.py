"""The admissible sets of the things that can be off: membership, corners, support function, samples.

Formula (theory, table of B.1), w the conjugate of the offset v measured from the set's centre:

    disc       |v| <= r                         h(w) = r |w|
    diamond    |v_n| + (L/2) |v_psi| <= c       h(w) = c max(|w_n|, 2 |w_psi| / L)
    interval   low <= v <= high                 h(w) = max(low w, high w)
"""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Source:
    """One thing that can be off, with its set: disc (radius), diamond (gap, half length) or interval."""

    name: str
    kind: str
    labels: tuple[str, ...]
    size: tuple[float, ...]
    centre: tuple[float, ...]

    @property
    def gives_way(self) -> bool:
        """Whether the load moves it: play of a joint or of a drive, no tolerance."""
        return self.kind != "interval" or self.labels[0].endswith((".normal", ".backlash.value"))

    @property
    def play(self) -> float:
        """How far it goes: a radius, a gap, or the upper end of an interval."""
        return self.size[1] if self.kind == "interval" else self.size[0]

    def inside(self, values: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Whether the values (components first) lie in the set."""
        v = np.asarray(values) - np.reshape(self.centre, (-1,) + (1,) * (np.ndim(values) - 1))
        if self.kind == "disc":
            return np.hypot(v[0], v[1]) <= self.size[0] + slack
        if self.kind == "diamond":
            return np.abs(v[0]) + self.size[1] * np.abs(v[1]) <= self.size[0] + slack
        return (v[0] >= self.size[0] - slack) & (v[0] <= self.size[1] + slack)

    def corners(self) -> np.ndarray:
        """Corners of the set (24 points on the circle of a disc), shape (n, components)."""
        if self.kind == "disc":
            a = np.arange(24) * (math.tau / 24)
            points = self.size[0] * np.stack([np.cos(a), np.sin(a)], axis=-1)
        elif self.kind == "diamond":
            c, h = self.size
            points = np.array([[c, 0], [-c, 0], [0, c / h], [0, -c / h]])
        else:
            points = np.array([[self.size[0]], [self.size[1]]])
        return points + np.asarray(self.centre)

    def support(self, w: np.ndarray) -> np.ndarray:
        """Support function max <w, v - centre> over the set; w components first (theory: table of B.1)."""
        if self.kind == "disc":
            return self.size[0] * np.hypot(w[0], w[1])
        if self.kind == "diamond":
            return self.size[0] * np.maximum(np.abs(w[0]), np.abs(w[1]) / self.size[1])
        return np.maximum(w[0] * self.size[0], w[0] * self.size[1])

    def support_point(self, w: np.ndarray) -> np.ndarray:
        """A maximiser of the support function (boundary point), for one direction w."""
        if self.kind == "disc":
            norm = math.hypot(w[0], w[1])
            point = np.array(w) * (self.size[0] / norm) if norm > 0 else np.array([self.size[0], 0.0])
        elif self.kind == "diamond":
            c, h = self.size
            point = np.array([math.copysign(c, w[0]), 0.0])
            if abs(w[1]) / h > abs(w[0]):
                point = np.array([0.0, math.copysign(c / h, w[1])])
        else:
            point = np.array([self.size[1] if w[0] > 0 else self.size[0]])
        return point + np.asarray(self.centre)

    def sample(self, rng: np.random.Generator, n: int, boundary: bool = True) -> np.ndarray:
        """Points of the set (on its boundary, or uniform), shape (n, components)."""
        if self.kind == "disc":
            a = rng.uniform(0, math.tau, n)
            r = self.size[0] * (np.ones(n) if boundary else np.sqrt(rng.uniform(0, 1, n)))
            v = np.stack([r * np.cos(a), r * np.sin(a)], axis=-1)
        elif self.kind == "diamond":
            c, h = self.size
            p, q = rng.uniform(-1, 1, (2, n))
            if boundary:
                p = np.sign(p)
            v = np.stack([c * (p + q) / 2, c * (p - q) / (2 * h)], axis=-1)
        else:
            low, high = self.size
            v = (rng.choice([low, high], n) if boundary else rng.uniform(low, high, n))[:, None]
        return v + np.asarray(self.centre)
