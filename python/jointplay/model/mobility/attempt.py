"""Where a mechanism that cannot be assembled stays open, by how much, and what would close it.

The minimum of the squared gaps of all joints and drives has gaps in the loops that cannot close, and in no others.
Then one joint of the loop is left open and everything else held: its gap is the nearest attempt. With g the root of the
least sum of squares, a length l on a body changes it by

    dg/dl = r . (dr/dl) / g

at the minimum (the poses do not count to first order), so that Newton's method on g(l) = 0 finds the length from which
on the loop closes. All searches are local and bounded: what they find is checked, what they miss is not mentioned.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import ANGULAR, LENGTHS, TURNS
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism

from .closing import Closing, in_order, is_closed, starts

#: unknowns beyond which only the nearest attempt is searched, and beyond which nothing is: six per body in space
LARGE, LARGEST = 60, 100
#: joints of a large mechanism that are tried as the one that is open
TRIED = 8
#: failed configurations of which the one with the largest gap is looked at
LOOKED_AT = 5
#: starts that are tried
STARTS = 24
#: starts from which the least squares are tried where those of the file tell nothing
FURTHER = 5
#: gaps below this share of the largest belong to loops that close
TAKES_PART = 1e-4
#: how far lengths are followed, as a multiple of what they are
FARTHEST = 4.0
#: steps of a length for its effect, as a share of the characteristic length
STEP = 1e-6
#: room that a length gets beyond the limit at which the loop is stretched, as a share of the characteristic length
ROOM = 1e-5
#: gaps below this (length-scaled) are those at the limit, where the least squares converge slowly
ALMOST = 1e-7
#: keys of a start, as few as will do, by the number of components of a pose
STARTING = {3: (("angle",), ("x", "y", "angle")), 6: (("rotation",), ("x", "y", "z", "rotation"))}
#: rows on the way along which a drive is followed
WAY, FEW = 120, 4


@dataclass(frozen=True)
class Cure:
    """A length of which any value in a range closes the loop."""

    #: `body`, `start`, `end`: from which joint to which, on which body
    body: str
    start: str
    end: str
    #: `now`, `low`, `high`: what it is, and the range, in metres, as far as it was followed
    now: float
    low: float
    high: float

    @property
    def change(self) -> float:
        """The least change, positive for longer."""
        return self.low - self.now if self.low > self.now else self.high - self.now


@dataclass(frozen=True)
class Attempt:
    """The nearest that a mechanism comes to being assembled."""

    #: which one was looked at: the one with the largest gap of those that fail, or of some of them
    configuration: int
    #: `drives`, `poses`: values of the drives there, and where the bodies are: everything closed but one joint
    drives: Floats
    poses: Floats
    #: joints of the loop that does not close
    loop: tuple[int, ...]
    #: whether these are in the order of one loop; otherwise several loops cannot close together
    is_loop: bool
    #: the joint that is open; -1 where no single one is
    joint: int
    #: `gap`, `turn`: by how much, in metres and radians
    gap: float
    turn: float
    #: where no single joint leaves all others closed: the joints that are open, each by how much, the largest gap first
    together: tuple[tuple[int, float, float], ...] = ()
    #: single lengths that close the loop there, the smallest change first
    cures: tuple[Cure, ...] = ()
    #: by body and key a start from which it does close, in units of the file
    start: dict[str, dict[str, object]] | None = None
    #: range of a single drive in which it can be assembled, SI; infinite where there is no limit
    reach: tuple[float, float] | None = None
    #: values of the drives up to which a path can be followed, SI
    limit: Floats | None = None

    @property
    def open(self) -> tuple[tuple[int, float, float], ...]:
        """All joints that are open, with their gaps and turns."""
        return self.together if self.joint < 0 else ((self.joint, self.gap, self.turn),)


def attempt(m: Mechanism, drives: Floats, placed: Floats) -> Attempt | None:
    """Look at what cannot be assembled.

    Parameters
    ----------
    drives : ndarray
        Values of the drives, SI, shape (configuration, drive).
    placed : ndarray
        Poses of all bodies, shape (configuration, body, pose); nan where a configuration is not assembled.
    """
    missing = np.flatnonzero(~np.isfinite(placed).all(axis=(1, 2)) & np.isfinite(drives).all(axis=1))
    unknowns = len(m.bodies) * len(m.components)
    if not len(missing) or not 0 < unknowns <= LARGEST:
        return None
    closing, first = Closing(m), int(missing[0])
    before = np.flatnonzero(np.isfinite(placed[:first]).all(axis=(1, 2)))
    guess = m.guess
    near = placed[before[-1]] if len(before) else guess
    some = LOOKED_AT if closing.is_small else 1
    looked_at = missing[np.unique(np.linspace(0, len(missing) - 1, some).round().astype(int))]
    found = [(int(k), *closing.least(drives[k], near)) for k in looked_at]
    configuration, at, gaps = max(found, key=lambda one: float(np.square(one[2]).sum()))
    asked = drives[configuration]
    start = _other_start(closing, drives[0], guess) if first == 0 and unknowns <= LARGE else None
    limit = _limit(closing, drives[before[-1]], drives[first], near) if len(before) and closing.is_small else None
    opened, nearest = None, (at, gaps)
    # A poor minimum, with axes the wrong way round, has gaps everywhere: then others are tried.
    for other in (None, *(starts(m, guess, FURTHER) if closing.is_small else ())):
        at, gaps = (at, gaps) if other is None else closing.least(asked, other)
        loop, is_loop = _loop(closing, gaps)
        opened = None if is_closed(gaps) else _open(closing, asked, at, loop)
        if opened is not None or start is not None:
            break
    if opened is None:
        at, gaps = nearest
        loop, is_loop = _loop(closing, gaps)
        # A start that closes says it all; gaps that are closed after all are none.
        together = () if start is not None or is_closed(gaps) else tuple(_gaps(closing, gaps, loop))
        if start is None and not together:
            return None
        return Attempt(configuration, asked, at, tuple(loop), is_loop, -1, 0.0, 0.0, together, start=start, limit=limit)
    joint, at_joint, gap, turn = opened
    forgotten = start is not None and not m.data.start
    cures = () if forgotten or not (is_loop and closing.is_small) else tuple(_cures(closing, asked, at, loop))
    reach = None
    if not forgotten:
        known = (near, drives[before[-1]]) if len(before) else None
        reach = _reach(closing, guess, known)
    return Attempt(
        configuration, asked, at_joint, tuple(loop), is_loop, joint, gap, turn,
        cures=tuple(sorted(cures, key=lambda cure: abs(cure.change))), start=start, reach=reach, limit=limit,
    )  # fmt: skip


def _gaps(closing: Closing, gaps: Floats, loop: list[int]) -> list[tuple[int, float, float]]:
    """The joints of a loop that are open, by how much in metres and radians, the largest gap first."""
    m = closing.m
    inner = {member.joint for member in m.members}
    turns = np.array([component in TURNS for _, component in closing.rows])
    joints = np.where(np.arange(len(gaps)) < closing.joint_rows, closing.joints, -1)
    found = []
    for joint in (joint for joint in loop if joint not in inner):
        gap, turn = (float(np.linalg.norm(gaps[(joints == joint) & kind])) for kind in (~turns, turns))
        if math.hypot(gap, turn) > TAKES_PART * float(np.abs(gaps).max()):
            found.append((joint, gap * m.length, turn))
    return sorted(found, key=lambda one: -math.hypot(one[1] / m.length, one[2]))


def _loop(closing: Closing, gaps: Floats) -> tuple[list[int], bool]:
    """The joints that cannot all close, in the order of their loop where it is one."""
    sizes = np.abs(gaps)
    taking = closing.joints[sizes > TAKES_PART * sizes.max()]
    names = [int(k) for k in dict.fromkeys(np.sort(taking).tolist())]
    order = in_order([closing.m.joint_bodies[k] for k in names], names)
    return (names, False) if order is None else (order, True)


def _open(closing: Closing, drives: Floats, at: Floats, loop: list[int]) -> tuple[int, Floats, float, float] | None:
    """The joint that is nearest to closed when all others are, the middle one of equals."""
    m = closing.m
    inner = {member.joint for member in m.members}
    driven = {joint for moves in m.drive_moves for joint, _ in moves}
    best: tuple[tuple[bool, float], int, Floats, float, float] | None = None
    middle = sorted(range(len(loop)), key=lambda k: abs(2 * k - len(loop) + 0.5))
    tried = [loop[k] for k in middle if loop[k] not in inner and loop[k] not in driven]
    for joint in tried[: TRIED if len(closing.unknowns) > LARGE else None]:
        found, gaps = closing.least(drives, at, closing.opened(joint))
        own = closing.opened(joint) == 1.0
        turns = np.array([component in TURNS for _, component in closing.rows])
        size = float(np.linalg.norm(gaps[own]))
        if np.abs(gaps[~own]).max(initial=0.0) > TAKES_PART * size:
            continue
        gap, turn = (float(np.linalg.norm(gaps[own & kind])) for kind in (~turns, turns))
        # A distance alone is easier to see than one with an angle.
        if best is None or (turn > TAKES_PART * size, size) < (best[0][0], 0.999 * best[0][1]):
            best = ((turn > TAKES_PART * size, size), joint, found, gap * m.length, turn)
    return best and best[1:]


def _cures(closing: Closing, drives: Floats, at: Floats, loop: list[int]) -> Iterator[Cure]:
    """Lengths of the bodies of a loop, from one of its joints to the next, that close it."""
    m = closing.m
    inner = {member.joint for member in m.members}
    own = [k for k in loop if k not in inner]
    names = (*m.owners, "ground")
    for one, other in zip(own, [*own[1:], own[0]], strict=True):
        ends = [{names[m.points[p].body]: p for p in m.joint_points[k]} for k in (one, other)]
        for name in (name for name in ends[0] if name in ends[1] and "." not in name):
            start, end = ends[0][name], ends[1][name]
            # All pieces of an elastic body have its axes.
            between = np.subtract(m.points[end].at, m.points[start].at)
            now = float(np.linalg.norm(between))
            reach = _range(closing, drives, at, start, end, now, between / now) if now > 1e-9 * m.length else None
            if reach is not None:
                yield Cure(name, m.joints[one], m.joints[other], now, *reach)


def _range(
    closing: Closing, drives: Floats, at: Floats, start: int, end: int, now: float, along: Floats
) -> tuple[float, float] | None:
    """The range of a length next to what it is in which the loop closes."""
    m = closing.m
    origin = np.array(m.points[start].at)

    def made(length: float) -> Closing:
        return Closing(m, m.moved({end: origin + length * along}))

    def limit(length: float, near: Floats) -> tuple[float, Floats] | None:
        """Where the gap vanishes, from a length at which it does not."""
        open_, end = length, math.nan
        for _ in range(40):
            found, gaps = made(length).least(drives, near)
            size = float(np.linalg.norm(gaps))
            if size < ALMOST:
                # Across the limit, or nearly there.
                end = length
                if abs(end - open_) < 0.1 * ROOM * m.length:
                    return end, near
                length = 0.5 * (open_ + end)
                continue
            open_, near = length, found
            if math.isfinite(end):
                if abs(end - open_) < 0.1 * ROOM * m.length:
                    return end, near
                length = 0.5 * (open_ + end)
                continue
            step = STEP * m.length
            slope = float(gaps @ (made(length + step).gaps(drives, near) - gaps)) / (size * step)
            if not abs(slope) > 1e-6 / m.length:
                return None
            length -= size / slope
            if not 0.0 < length < FARTHEST * max(now, m.length):
                return None
        return None

    def closed(length: float, near: Floats) -> Floats | None:
        other = made(length)
        tried = (begin for size in (0.03, 0.3) for begin in starts(m, near, 3, size))
        return next((found for begin in tried if (found := other.closed(drives, begin)) is not None), None)

    found = limit(now, at)
    if found is None:
        return None
    edge, near = found
    sign = 1.0 if edge > now else -1.0
    edge += sign * ROOM * m.length
    inside = closed(edge, near) if edge > 0.0 else None
    if inside is None:
        return None
    far, width = edge, 0.02 * m.length
    cap = FARTHEST * max(now, m.length) if sign > 0.0 else ROOM * m.length
    while abs(cap - far) > ROOM * m.length:
        beyond = far + sign * min(width, abs(cap - far))
        further = closed(beyond, inside)
        if further is None:
            for _ in range(10):
                middle = 0.5 * (far + beyond)
                further = closed(middle, inside)
                if further is None:
                    beyond = middle
                else:
                    far, inside = middle, further
            break
        far, inside, width = beyond, further, 1.5 * width
    return (edge, far) if sign > 0 else (far, edge)


def _other_start(closing: Closing, drives: Floats, guess: Floats) -> dict[str, dict[str, object]] | None:
    """A start in file units from which the first configuration can be assembled, checked; None where none was found."""
    m = closing.m
    if m.drive_values is None:
        return None
    for other in (closing.least(drives, guess)[0], *starts(m, guess, STARTS if closing.is_small else FURTHER)):
        closed = closing.closed(drives, other)
        if closed is None:
            continue
        for keys in STARTING[len(m.components)]:
            start = _table(m, closed, keys)
            try:
                solved = m.with_({"start": start}).core.trace(np.ascontiguousarray(drives[None]))
            except InputError:
                continue
            if np.isfinite(solved["poses"]).all():
                return start
    return None


def _table(m: Mechanism, closed: Floats, keys: tuple[str, ...]) -> dict[str, dict[str, object]]:
    """Poses of the bodies of the file as it has them."""
    parts = poses.components(closed) / m.component_factors
    found: dict[str, dict[str, object]] = {}
    # Names of the file have no dot: that is the cross of a universal joint.
    for name in (owner for owner in dict.fromkeys(m.owners) if "." not in owner):
        own = dict(zip(m.components, parts[m.bodies.index(name)].tolist(), strict=True))
        if "angle" in own:
            own["angle"] = math.remainder(own["angle"], 2.0 * math.pi / m.units.angle)
        least = {c: 1e-6 * size for c, size in zip(m.components, _sizes(m), strict=True)}
        short = {c: 0.0 if abs(value) < least[c] else float(f"{value:.5g}") for c, value in own.items()}
        short["rotation"] = [short.get(c, 0.0) for c in ("rx", "ry", "rz")]  # type: ignore[assignment]
        found[name] = {key: short[key] for key in keys}
    return found


def _sizes(m: Mechanism) -> list[float]:
    """What is large of every component, in units of the file."""
    return [
        (m.length if c in LENGTHS else 1.0) / float(f) for c, f in zip(m.components, m.component_factors, strict=True)
    ]


def _limit(closing: Closing, start: Floats, end: Floats, near: Floats) -> Floats:
    """Values of the drives up to which they can be followed from some to others."""
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        found = closing.closed(start + middle * (end - start), near)
        if found is None:
            high = middle
        else:
            low, near = middle, found
    return np.asarray(start + low * (end - start))


def _reach(closing: Closing, guess: Floats, known: tuple[Floats, Floats] | None) -> tuple[float, float] | None:
    """The range of a single drive, around poses with its values that are known or found."""
    m = closing.m
    if len(m.drives) != 1 or not closing.is_small:
        return None
    if known is not None:
        near, there = known
    else:
        weights = np.where(np.arange(len(closing.rows)) < closing.joint_rows, 1.0, 0.0)
        near, gaps = closing.least(np.zeros(1), guess, weights)
        if not is_closed(gaps[: closing.joint_rows]):
            return None
        joint, coefficient = m.drive_moves[0][0]
        there = np.array([float(m.coordinate(joint, near)) / coefficient])
    turns = m.joint_kinds[m.drive_joints[0]] in ANGULAR
    far = (2.0 * math.pi if turns else FARTHEST * m.length) / abs(m.drive_moves[0][0][1])
    ends = []
    for sign in (-1.0, 1.0):
        way = there + sign * far * np.linspace(0.0, 1.0, WAY + 1)[1:, None]
        last, begin, end = there, near, sign * math.inf
        # A few at a time: where a branch ends, every further row costs a long search.
        for first in range(0, WAY, FEW):
            rows = way[first : first + FEW]
            traced = m.core.trace(np.ascontiguousarray(rows), begin)["poses"]
            lost = np.flatnonzero(~np.isfinite(traced).all(axis=(1, 2)))
            if len(lost):
                k = int(lost[0])
                last, begin = (rows[k - 1], traced[k - 1]) if k else (last, begin)
                end = float(_limit(closing, last, rows[k], begin)[0])
                break
            last, begin = rows[-1], traced[-1]
        ends.append(end)
    return (ends[0], ends[1]) if ends[1] - ends[0] > TAKES_PART * far else None
