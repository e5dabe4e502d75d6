"""The printed tables, and the rule they follow.

The rule puts the coupler point a fixed way off, whatever the mechanism and wherever it stands:

    B' = (B_x + 2 r, B_y)                                             displaced point (Tables 2 and 4)
    theta3' = acos((B_x + 2 r + l4) / l3)                             displaced output angle (Tables 3 and 5)
    theta1' = 180 deg - acos((d^2 + l4^2 - l3^2) / (2 d l4)) - acos((l1^2 + d^2 - l2^2) / (2 d l1)),  d = |B'|
                                                                      drive of the 4R that aims at B' (Tables 8 and 10)

with r the radial clearance ("radial link"), the drive pivot at the origin and the rocker pivot at (-l4, 0). Lengths in
mm, angles in degrees, as printed. Tables 9 and 11 follow no rule that was found: `LENGTH_RULES` holds the obvious
candidates.
"""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

DATA = Path(__file__).parent / "data"
POSITIONS = tuple(f"P{i}" for i in range(1, 12))
CRANK = COUPLER = 75.0
ROCKER = 150.0
BASE = 100.0


def rows(number: int) -> list[dict[str, str]]:
    """The rows of a printed table, as text."""
    text = (DATA / f"table-{number:02d}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def column(number: int, name: str) -> Floats:
    """One column of a printed table, as numbers."""
    return np.array([float(row[name]) for row in rows(number)])


def displaced_point(x: Floats, y: Floats, radial: float) -> tuple[Floats, Floats]:
    """The point that the tables call deviated: twice the radial clearance along x."""
    return x + 2.0 * radial, y


def output_angle(x: Floats, radial: float) -> Floats:
    """Displaced output angle from the cosine form, the one the tables use. In degrees."""
    return np.degrees(np.arccos((x + 2.0 * radial + BASE) / ROCKER))


def output_angle_from_sine(y: Floats) -> Floats:
    """The same angle from the sine form, printed as its equal: the clearance does not enter at all. In degrees."""
    return np.degrees(np.arcsin(y / ROCKER))


def drive_angle(x: Floats, y: Floats) -> Floats:
    """Inverse kinematics of the 4R: the drive angle with the coupler point at distance |(x, y)|. In degrees."""
    d = np.hypot(x, y)
    at_base = np.arccos((d**2 + BASE**2 - ROCKER**2) / (2.0 * d * BASE))
    at_crank = np.arccos((CRANK**2 + d**2 - COUPLER**2) / (2.0 * d * CRANK))
    return np.degrees(np.pi - at_base - at_crank)


def _length_to_point(v: Floats, x: Floats, y: Floats, radial: float) -> Floats:
    return np.hypot(*displaced_point(x, y, radial))


def _length_at_output_angle(v: Floats, x: Floats, y: Floats, radial: float) -> Floats:
    angle = np.radians(output_angle(x, radial))
    return np.sqrt(ROCKER**2 + BASE**2 - 2.0 * ROCKER * BASE * np.cos(angle))


def _length_from_printed_inverse(v: Floats, x: Floats, y: Floats, radial: float) -> Floats:
    slope = (v**2 + BASE**2 - ROCKER**2) / (2.0 * BASE * v)
    return -(x + 2.0 * radial) / slope


def _length_less_links(v: Floats, x: Floats, y: Floats, radial: float) -> Floats:
    return v - 2.0 * radial


def _length_at_diagonal_shift(v: Floats, x: Floats, y: Floats, radial: float) -> Floats:
    return _length_at_output_angle(v, x, y, radial / np.sqrt(2.0))


LengthRule = Callable[[Floats, Floats, Floats, float], Floats]

LENGTH_RULES: dict[str, LengthRule] = {
    "v′ = the distance of the displaced point B′ from the actuator pivot": _length_to_point,
    "v′ from the cosine theorem at the displaced output angle θ₃′": _length_at_output_angle,
    "v′ = −(Bₓ + 2r) / cos φ, the printed inverse with the nominal φ": _length_from_printed_inverse,
    "v′ = v − 2r, two clearance links in line with the actuator": _length_less_links,
    "the cosine theorem with √2·r along x in place of 2r (a guess)": _length_at_diagonal_shift,
}
"""Candidates for the actuator length v' of Tables 9 and 11, as functions of (v, x, y, radial)."""


def distance_from_smooth(values: Floats) -> float:
    """How far equally spaced values are, at least, from every cubic polynomial.

    The fourth difference of a cubic is zero, and changing five neighbours by at most e changes it by at most 16 e. So
    max |fourth difference| / 16 is a lower bound of the largest distance, and one that can be checked by hand.
    """
    return float(np.max(np.abs(np.diff(values, 4))) / 16.0)
