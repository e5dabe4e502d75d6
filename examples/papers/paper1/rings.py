"""Where a pin centre of the mechanism can be, by elementary geometry and without jointplay.

A link of length l with play r at each of k pins between two points keeps their distance within l - k r ... l + k r: a
ring.
The coupler point is tied to the rocker pivot and to the drive, so it lies where two rings overlap: a small curved
quadrilateral round its nominal place. Its corners are intersections of circles; the farthest corner is the largest
possible displacement.

The coupler joint has two pin centres, at most r apart: the one on the rocker (the output here) has one play between
itself and the rocker pivot, the one on the driving link has two.
"""

from dataclasses import dataclass

import numpy as np

from .published import BASE, COUPLER, CRANK, ROCKER, Floats

PIVOT = np.array([-BASE, 0.0])


@dataclass(frozen=True)
class Tie:
    """A chain of one link: the point stays within `length` +- `play` of `centre`."""

    centre: Floats
    length: float
    play: float


def tie_to_rocker(radial: float, plays: int = 1) -> Tie:
    """The rocker's ring; `plays` is 1 for the pin centre on the rocker, 2 for the one on the coupler."""
    return Tie(PIVOT, ROCKER, plays * radial)


def tie_to_crank(theta1_deg: float, radial: float, plays: int = 3) -> Tie:
    """The coupler's ring round the nominal crank pin of the 4R (plays at J1, J2 and, for the rocker's pin, J3)."""
    angle = np.radians(theta1_deg)
    return Tie(CRANK * np.array([np.cos(angle), np.sin(angle)]), COUPLER, plays * radial)


def tie_to_actuator(v: float, radial: float, plays: int = 2) -> Tie:
    """The actuator's ring round the ground pivot of the P3R (plays at J1 and, for the rocker's pin, J2)."""
    return Tie(np.zeros(2), v, plays * radial)


def output_ties(drive_unit: str, drive: float, radial: float) -> tuple[Tie, Tie]:
    """Both rings of the pin centre on the rocker; a drive in `deg` is the crank of the 4R, in `mm` that of the P3R."""
    driving = tie_to_crank if drive_unit == "deg" else tie_to_actuator
    return tie_to_rocker(radial), driving(drive, radial)


def other_pin_ties(drive_unit: str, drive: float, radial: float) -> tuple[Tie, Tie]:
    """Both rings of the pin centre on the driving link: one play more to the rocker pivot, one less to the drive."""
    if drive_unit == "deg":
        return tie_to_rocker(radial, 2), tie_to_crank(drive, radial, 2)
    return tie_to_rocker(radial, 2), tie_to_actuator(drive, radial, 1)


def intersections(a: Tie, b: Tie, a_sign: int = 0, b_sign: int = 0) -> Floats:
    """Both points where circles of two ties meet, shape (2, 2); a sign of -1, 0, 1: inner, nominal, outer circle."""
    ra, rb = a.length + a_sign * a.play, b.length + b_sign * b.play
    between = b.centre - a.centre
    distance = np.hypot(*between)
    along = between / distance
    across = np.array([-along[1], along[0]])
    s = (ra**2 - rb**2 + distance**2) / (2.0 * distance)
    h = np.sqrt(ra**2 - s**2)
    points: Floats = a.centre + s * along + np.array([[h], [-h]]) * across
    return points


def nominal(a: Tie, b: Tie) -> Floats:
    """The place of the point without play: the upper intersection, as in the paper."""
    points = intersections(a, b)
    upper: Floats = points[np.argmax(points[:, 1])]
    return upper


def corners(a: Tie, b: Tie) -> Floats:
    """The four corners of the region round the nominal place, shape (4, 2), in order round it."""
    home = nominal(a, b)
    found = []
    for a_sign, b_sign in ((-1, -1), (-1, 1), (1, 1), (1, -1)):
        points = intersections(a, b, a_sign, b_sign)
        found.append(points[np.argmin(np.hypot(*(points - home).T))])
    return np.array(found)


def farthest(a: Tie, b: Tie) -> float:
    """Largest possible displacement of the point from its nominal place."""
    return float(np.max(np.hypot(*(corners(a, b) - nominal(a, b)).T)))


def admits(point: Floats, *ties: Tie) -> bool:
    """Whether the point lies in every ring."""
    return all(abs(np.hypot(*(point - tie.centre)) - tie.length) <= tie.play for tie in ties)


def outline(a: Tie, b: Tie, steps: int = 30) -> Floats:
    """The border of the region: arcs between the corners, shape (4 * steps, 2)."""
    points = corners(a, b)
    pieces = []
    for k in range(4):
        start, end = points[k], points[(k + 1) % 4]
        centre = a.centre if k in (0, 2) else b.centre  # corners 0-1 and 2-3 share a circle of the first tie
        from_, to = start - centre, end - centre
        turn = np.arctan2(from_[0] * to[1] - from_[1] * to[0], from_ @ to)
        angle = np.arctan2(from_[1], from_[0]) + np.linspace(0.0, 1.0, steps, endpoint=False) * turn
        pieces.append(centre + np.hypot(*from_) * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.concatenate(pieces)
