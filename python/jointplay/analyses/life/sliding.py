"""How the faces of a joint slide along the path, and what presses them together.

With all contacts of a joint at the edge of its clearance c, the sum of their normal forces is h(l) / c, where h is the
support function of the clearance at the force l that the joint transmits. Spread over the face that slides it is the
pressure p, and the clearance grows by

    rate * integral of p ds                 Archard's law; ds the sliding distance

    pin              p = F / (D w),                ds = D/2 |dtheta|; D cancels
    pin in space     the same for each end, which carries its force on half of the length; ds with the travel along it
    slider           p = max(|F|, 2 |M| / L) / (L w),  ds along the guide; in space for each pair of faces
    block in a slot  p = |F| / (L w),              ds along the slot
    ball             p = F / (pi R^2),             ds = R |dtheta across the force|
    plate            p = max(|F|, |M1|/a, |M2|/b) / (4 a b),  ds the mean over the plate

Where hole and pin have rates of their own, what the load wears off lies where the load was: a shift by dh towards an
angle of the part takes dh cos(psi - angle) off at psi, over the half of the circle that faces it. Both profiles are
added at every pose of the pin in the hole, and the largest sum counts. A load that does not move on a part wears it
by all of the integral, one that goes round it by 1/pi of it.

Forces and motions are those in the axes of the first body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.sets import SETS
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.model.wearing import Wearing

#: nodes and weights across a plate, by which the mean of what slides is taken
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
#: angles at which what is worn off round parts is known
ANGLES = 1440
#: configurations in the order in which they are passed
Order = np.ndarray[tuple[int], np.dtype[np.intp]]


@dataclass(frozen=True)
class Slide:
    """How the second body of a joint moves against the first between the configurations that it passes, SI."""

    #: `turns`, `shifts`: rotation vectors, and displacements of the second body's point; in axes of the first body,
    #: shape (step, 3)
    turns: Floats
    shifts: Floats
    #: axes of the first body, as rotation matrices, one more than steps
    axes: Floats
    #: `along`, `side`, `normal`: directions of the joint on the first body
    along: Floats
    side: Floats
    normal: Floats


def slide_of(m: Mechanism, joint: int, at: Floats, order: Order) -> Slide:
    """How a joint moves along the path.

    Parameters
    ----------
    at : ndarray
        Poses of all bodies, shape (configuration, body, pose).
    order : ndarray
        The configurations in the order in which they are passed.
    """
    seen = m.relative(joint, at)
    turns = poses.rotation_vector(poses.product(seen.turned[order[1:]], poses.inverse(seen.turned[order[:-1]])))
    return Slide(turns, np.diff(seen.apart[order], axis=0), seen.axes[order], *seen.directions)


@dataclass(frozen=True)
class Faces:
    """The faces of a joint that slide through configurations, as they are passed."""

    #: mean pressure of every face, Pa, shape (configuration, face)
    pressure: Floats
    #: `start`, `end`: how far the face slides in every step, m, by the direction of the force at the start and at the
    #: end of the step; shape (step, face)
    start: Floats
    end: Floats
    #: of a pin: the angle at which it touches its hole, about the axis, as the first body sees it, shape
    #: (configuration, face)
    towards: Floats | None = None
    #: how far the second body has turned about the axis since the first configuration
    turned: Floats | None = None

    def worn(self, own: Wearing) -> float:
        """Growth of the clearance on the way, m: rate times pressure times sliding distance, by the trapezoid."""
        first = 0.5 * self.pressure[:-1] * self.start
        last = 0.5 * self.pressure[1:] * self.end
        if own.rate is not None:
            return float(own.rate * (first + last).sum(axis=0).max())
        assert own.of_both is not None
        assert self.towards is not None
        assert self.turned is not None
        nothing = np.zeros((1, first.shape[1]))
        at = np.concatenate([first, nothing]) + np.concatenate([nothing, last])
        if not np.isfinite(at).all():
            return float("nan")
        return max(_deepest(at[:, k], self.towards[:, k], self.turned, own.of_both) for k in range(at.shape[1]))

    @property
    def slid(self) -> float:
        """Sliding distance on the way, m; of several faces the largest."""
        return float(0.5 * (self.start + self.end).sum(axis=0).max())


def joined(ways: Sequence[Faces]) -> Faces:
    """Faces that go one way after the other, as in several load cases; nothing slides between two of them."""
    nothing = np.zeros((1, ways[0].start.shape[1]))

    def whole(parts: list[Floats | None]) -> Floats | None:
        known = [part for part in parts if part is not None]
        return np.concatenate(known) if known else None

    def steps(parts: list[Floats]) -> Floats:
        return np.concatenate([rows for part in parts for rows in (part, nothing)][:-1])

    return Faces(
        np.concatenate([way.pressure for way in ways]),
        steps([way.start for way in ways]),
        steps([way.end for way in ways]),
        whole([way.towards for way in ways]),
        whole([way.turned for way in ways]),
    )


def _deepest(at: Floats, towards: Floats, turned: Floats, rates: tuple[float, float]) -> float:
    """Largest sum of what is worn off hole and pin at one angle, in any of the poses of the way."""
    rate_hole, rate_pin = rates
    hole, pin = rate_hole * _profile(at, towards - turned), rate_pin * _profile(at, towards)
    shifts = np.unique(np.round(turned / (2.0 * np.pi) * ANGLES).astype(np.int64) % ANGLES)
    return float(max((pin + np.roll(hole, shift)).max() for shift in shifts))


def _profile(at: Floats, angles: Floats) -> Floats:
    """What is worn off at all angles of a part by shifts towards some of them."""
    place = np.remainder(angles, 2.0 * np.pi) / (2.0 * np.pi) * ANGLES
    below = np.floor(place).astype(np.int64)
    share = place - below
    bins = np.zeros(ANGLES)
    np.add.at(bins, below % ANGLES, at * (1.0 - share))
    np.add.at(bins, (below + 1) % ANGLES, at * share)
    facing = np.maximum(np.cos(2.0 * np.pi * np.arange(ANGLES) / ANGLES), 0.0)
    return np.asarray(np.fft.irfft(np.fft.rfft(bins) * np.fft.rfft(facing), ANGLES))


def faces_of(
    m: Mechanism,
    own: Wearing,
    source: int,
    slide: Slide,
    reaction: Floats,
) -> Faces:
    """What presses and slides in a joint along the path.

    Parameters
    ----------
    own : Wearing
        With a rate.
    source : int
        The source of its clearance.
    reaction : ndarray
        Force and moment on the second body as it passes the configurations, ground axes, SI, shape
        (configuration, wrench).
    """
    shape, size = clearance_of(m, source)
    force, moment = _wrench(reaction, slide.axes)
    travel, half = np.abs(slide.shifts @ slide.along), size.get("half_length", np.inf)
    diameter = own.diameter if np.isfinite(own.diameter) else 1.0
    match SETS[shape].slides:
        case "pin":
            # In the plane its axis is across it.
            x, y, z = np.eye(3)
            seen = slide if m.pose_size == poses.SPATIAL else replace(slide, along=z, side=x, normal=y)
            return _pin(force, moment, seen, half, diameter, own.length)
        case "block":
            sum_ = np.maximum(np.abs(force @ slide.normal), np.abs(moment[:, 2]) / half)
            return _plain(sum_ / (own.length * own.width), travel)
        case "ball":
            return _ball(force, slide, 0.5 * own.diameter)
        case "guide":
            return _guide(force, moment, slide, size, travel)
        case "plate":
            return _plate(force, moment, slide, size)


def _wrench(reaction: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Force and moment in axes of the first body, three components each."""
    if reaction.shape[-1] == 3:
        zero = np.zeros(len(reaction))
        force = np.stack([reaction[:, 0], reaction[:, 1], zero], axis=1)
        moment = np.stack([zero, zero, reaction[:, 2]], axis=1)
    else:
        force, moment = reaction[:, :3], reaction[:, 3:]
    turned = np.swapaxes(axes, -1, -2)
    return (turned @ force[..., None])[..., 0], (turned @ moment[..., None])[..., 0]


def _plain(pressure: Floats, slid: Floats) -> Faces:
    return Faces(pressure[:, None], slid[:, None], slid[:, None])


def _pin(force: Floats, moment: Floats, slide: Slide, half: float, diameter: float, length: float) -> Faces:
    """Both ends of a pin, R = (F +- M x a / l) / 2 across its axis a; one of them of a pin that does not tilt."""
    across = force - (force @ slide.along)[:, None] * slide.along
    lever = np.cross(moment, slide.along) / half
    ends = np.stack([0.5 * (across + sign * lever) for sign in ((1.0, -1.0) if np.isfinite(half) else (1.0,))], axis=1)
    pressure = np.linalg.norm(ends, axis=2) / (diameter * 0.5 * length)
    angle = np.arctan2(ends @ slide.normal, ends @ slide.side)
    turned = np.concatenate([[0.0], np.cumsum(slide.turns @ slide.along)])
    slid = np.hypot(0.5 * diameter * np.abs(slide.turns @ slide.along), np.abs(slide.shifts @ slide.along))
    each = np.repeat(slid[:, None], ends.shape[1], axis=1)
    return Faces(pressure, each, each, angle, turned)


def _ball(force: Floats, slide: Slide, radius: float) -> Faces:
    size = np.linalg.norm(force, axis=1)
    towards = np.divide(force, size[:, None], out=np.zeros_like(force), where=size[:, None] > 0.0)

    def slid(unit: Floats) -> Floats:
        rolled = slide.turns - (slide.turns * unit).sum(axis=1, keepdims=True) * unit
        found: Floats = radius * np.linalg.norm(rolled, axis=1)
        return found[:, None]

    pressure = size / (np.pi * radius**2)
    return Faces(pressure[:, None], slid(towards[:-1]), slid(towards[1:]))


def _guide(force: Floats, moment: Floats, slide: Slide, size: dict[str, float], travel: Floats) -> Faces:
    """The faces across `side` and those across the normal.

    Force and tilt press on each pair by themselves. What a moment about the axis needs beyond that is carried by the
    pair with the longer lever.
    """
    length, width, height = (size[key] for key in ("half_length", "half_width", "half_height"))
    across = np.maximum(np.abs(force @ slide.side), np.abs(moment @ slide.normal) / length)
    upright = np.maximum(np.abs(force @ slide.normal), np.abs(moment @ slide.side) / length)
    lever = max(width, height)
    tapers = height / lever, width / lever
    roll = np.abs(moment @ slide.along) / lever
    more = np.maximum(roll - tapers[0] * across - tapers[1] * upright, 0.0)
    sums = np.stack([across + more * (height > width), upright + more * (height <= width)], axis=1)
    pressure = sums / (4.0 * length * np.array([height, width]))
    return Faces(pressure, *(2 * [np.stack([travel, travel], axis=1)]))


def _plate(force: Floats, moment: Floats, slide: Slide, size: dict[str, float]) -> Faces:
    normal, side = size["half_normal"], size["half_side"]
    tilts = np.abs(moment @ slide.side) / normal, np.abs(moment @ slide.normal) / side
    sums = np.maximum(np.abs(force @ slide.along), np.maximum(*tilts))
    turn = slide.turns @ slide.along
    slid = np.zeros(len(turn))
    for y, wy in zip(side * NODES, WEIGHTS, strict=True):
        for z, wz in zip(normal * NODES, WEIGHTS, strict=True):
            moved = slide.shifts @ slide.side - turn * z, slide.shifts @ slide.normal + turn * y
            slid += 0.25 * wy * wz * np.hypot(*moved)
    return _plain(sums / (4.0 * normal * side), slid)
