"""How the drives move: their values, speeds and accelerations in every configuration, on one clock.

With the stroke h and the duration T of a motion from rest to rest, x = t/T and f the share of a ramp:

    trapezoid   v = h / (T (1 - f)) between the ramps, a = v / (f T) in the first and -a in the last one
    cycloidal   q = h (x - sin(2 pi x) / (2 pi))
    poly5       q = h (10 x^3 - 15 x^4 + 6 x^5)

At the corners of a trapezoid the acceleration jumps; there are two configurations, one for either side. Values at times
are met by a spline of degree 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.file.schema import Drive, MechanismFile

from .graph import Graph

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

#: of a trapezoid whose file does not say it
RAMP = 0.25
DEGREE = 5
#: times that differ by no more than this part of a duration are one
SAME = 1e-9
#: part of the time of a path by which a drive of constant speed may be early or late
PACE = 1e-3
#: a spline does not go farther beyond its values than by so many times their range, looked at in parts of its steps
SWING, PARTS = 10.0, 8
#: decimals of numbers that are not written out; and an acceleration that is none
DIGITS, TINY = 17, 1e-300
#: speeds and accelerations, in SI, that are none
REST = 1e-30
#: derivatives of a value by time, the value itself included
ORDERS = 4


@dataclass(frozen=True)
class DriveMotion:
    """How the drives move, SI."""

    #: speed, acceleration and the derivative of that (jerk), shape (3, configuration, drive)
    rates: Floats
    #: when each configuration is passed, from zero; None where drive values alone do not say it
    times: Floats | None
    #: of drives with a table the part of their largest acceleration that its rounding can make of nothing
    rounded: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_steady(self) -> bool:
        """Whether all configurations have the same speeds and accelerations."""
        return bool((self.rates == self.rates[:, :1]).all())

    def first(self, count: int) -> DriveMotion:
        """That of the first configurations."""
        return DriveMotion(self.rates[:, :count], None if self.times is None else self.times[:count])

    def at(self, configuration: int) -> DriveMotion:
        """That of one configuration; of a steady motion there may be any number of them."""
        k = 0 if self.is_steady else configuration
        return DriveMotion(self.rates[:, k : k + 1], None)


@dataclass(frozen=True)
class Clock:
    """Instants at which motions from rest to rest are looked at."""

    #: seconds
    times: Floats
    #: whether it is the side after a jump of an acceleration
    after: Floats


def clock_of(data: MechanismFile, graph: Graph) -> Clock | None:
    """The clock of the laws of motion; None where no drive has one."""
    moving = {name: drive for name, drive in data.drives.items() if drive.motion is not None}
    if not moving:
        return None
    first, *others = moving
    for name in others:
        for key in ("duration", "count"):
            one, other = getattr(moving[first], key), getattr(moving[name], key)
            if one != other:
                problem = f"motions run on one clock: '{first}' has {key} {one:g}, and this one {other:g}"
                raise graph.refuse(problem, f"drives.{name}.{key}")
    count, duration = moving[first].count or 2, moving[first].duration or 1.0
    corners = sorted({corner for drive in moving.values() for corner in _corners(drive)})
    times = np.linspace(0.0, duration, count)
    near = [float(times[k]) for k in range(count)]
    instants = [(t, False) for t in near if not any(abs(t - c * duration) <= SAME * duration for c in corners)]
    instants += [(c * duration, side) for c in corners for side in (False, True)]
    instants.sort()
    return Clock(np.array([t for t, _ in instants]), np.array([side for _, side in instants]))


def _corners(drive: Drive) -> tuple[float, ...]:
    """Parts of the duration between rest and rest at which the acceleration jumps."""
    if drive.motion != "trapezoid":
        return ()
    ramp = drive.ramp or RAMP
    return (ramp, 1.0 - ramp) if ramp < 0.5 else (ramp,)


def derivatives(drive: Drive, clock: Clock) -> Floats:
    """Values of a law of motion and their derivatives, shape (order, instant), in units of the file."""
    assert drive.from_ is not None
    assert drive.to is not None
    assert drive.duration is not None
    duration, stroke = drive.duration, drive.to - drive.from_
    x = clock.times / duration
    one, zero = np.ones_like(x), np.zeros_like(x)
    if drive.motion == "cycloidal":
        turn = 2.0 * np.pi
        s, c = np.sin(turn * x), np.cos(turn * x)
        shares = [x - s / turn, one - c, turn * s, turn**2 * c]
    elif drive.motion == "poly5":
        law = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
        shares = [law.deriv(order)(x) if order else law(x) for order in range(ORDERS)]
    else:
        ramp = drive.ramp or RAMP
        speed = 1.0 / (1.0 - ramp)
        slope = speed / ramp
        room = np.where(clock.after, SAME, -SAME)
        gains, loses = x + room < ramp, x + room > 1.0 - ramp
        left = 1.0 - x
        value = np.where(gains, slope * x**2 / 2, np.where(loses, 1.0 - slope * left**2 / 2, speed * (x - ramp / 2)))
        rate = np.where(gains, slope * x, np.where(loses, slope * left, speed))
        shares = [value, rate, slope * (gains * one - loses * one), zero]
    found = np.array([stroke * share / duration**order for order, share in enumerate(shares)])
    found[0] += drive.from_
    # Both ends as the file has them.
    found[0][clock.times == 0.0], found[0][clock.times == duration] = drive.from_, drive.to
    return found


def compile_motion(
    data: MechanismFile,
    graph: Graph,
    values: Floats | None,
    factors: Floats,
    clock: Clock | None,
    turning: Sequence[bool],
) -> DriveMotion | None:
    """Speeds and accelerations of the drives; None where every drive is at rest.

    Parameters
    ----------
    values : ndarray or None
        Commanded values, SI; None where a path or the nodes of a grid decide them.
    factors : ndarray
        SI per file unit of each drive.
    turning : sequence of bool
        Which drives turn.
    """
    moving = [n for n, d in data.drives.items() if not (d.speed is None and d.motion is None and d.times is None)]
    if not moving:
        return None
    if data.path is not None:
        problem = "the drives follow the [path] of the output, and a path has no speed; give the drives their values"
        raise graph.refuse(problem, f"drives.{moving[0]}")
    count = 1 if values is None else len(values)
    rates = np.zeros((ORDERS - 1, count, len(data.drives)))
    rounded: dict[str, float] = {}
    clocks: list[tuple[str, Floats]] = [] if clock is None else [(moving[0], clock.times)]
    for k, (name, drive) in enumerate(data.drives.items()):
        if drive.motion is not None:
            assert clock is not None
            rates[:, :, k] = derivatives(drive, clock)[1:] * factors[k]
        elif drive.times is not None and drive.values is not None:
            spline = _spline(graph, name, drive.times, drive.values)
            rates[:, :, k] = [spline.derivative(order)(np.array(drive.times)) for order in range(1, ORDERS)]
            rates[:, :, k] *= factors[k]
            rounded[name] = _rounding(drive.times, drive.values) * factors[k] / max(np.abs(rates[1, :, k]).max(), TINY)
            clocks.append((name, np.array(drive.times) - drive.times[0]))
        elif drive.speed is not None:
            units = (graph.units.turning_speed if turning[k] else graph.units.speed, factors[k])
            given = ("speed", drive.speed), ("acceleration", drive.acceleration or 0.0)
            for order, ((key, value), unit) in enumerate(zip(given, units, strict=True)):
                rates[order, :, k] = np.array(_along(graph, value, count, f"drives.{name}.{key}")) * unit
            if count > 1 and len(drive.commands) == 1 and rates[0, :, k].any():
                problem = f"'{name}' is held at one value while others run, and has a speed; at rest it has none"
                raise graph.refuse(problem, f"drives.{name}.speed")
    for name, times in clocks[1:]:
        if np.abs(times - clocks[0][1]).max() > SAME * abs(float(times[-1])):
            raise graph.refuse(f"drives run on one clock, and '{clocks[0][0]}' has other times", f"drives.{name}")
    rates[np.abs(rates) < REST] = 0.0
    if not rates.any():
        return None
    if clocks and values is not None:
        _check_pace(graph, data, values, rates, clocks[0])
    return DriveMotion(rates, clocks[0][1] if clocks else _times(values, rates), rounded)


def _check_pace(graph: Graph, data: MechanismFile, values: Floats, rates: Floats, clock: tuple[str, Floats]) -> None:
    """Refuse a drive of constant speed that reaches its values at other times than the clock of another one says."""
    other, times = clock
    for k, (name, drive) in enumerate(data.drives.items()):
        if not isinstance(drive.speed, float) or drive.acceleration or not drive.speed:
            continue
        own = (values[:, k] - values[0, k]) / rates[0, 0, k]
        if np.abs(own - times).max() > PACE * float(times[-1]):
            takes = f"{own[-1]:.6g} s from its first value to its last"
            problem = f"drives run on one clock: at this speed it takes {takes}, and '{other}' {times[-1]:.6g} s"
            raise graph.refuse(problem, f"drives.{name}.speed")


def _along(graph: Graph, value: float | tuple[float, ...], count: int, key: str) -> tuple[float, ...]:
    """The values of all configurations."""
    if not isinstance(value, tuple):
        return (value,) * count
    if len(value) != count:
        problem = (
            f"{len(value)} values for {count} configuration{'s' * (count != 1)}; one for each is needed, or one for all"
        )
        raise graph.refuse(problem, key)
    return value


def _spline(graph: Graph, drive: str, times: Sequence[float], values: Sequence[float]) -> BSpline:
    """Values at times; refused where what is between them has nothing to do with them."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(np.array(times), np.array(values), k=DEGREE)
    steps = np.diff(times)
    between = spline(np.array(times[:-1])[:, None] + steps[:, None] * np.arange(1, PARTS) / PARTS)
    far = np.maximum(between.max(axis=1) - max(values), min(values) - between.min(axis=1))
    worst = int(far.argmax())
    stroke = max(values) - min(values)
    if far[worst] > SWING * stroke > 0.0 or not np.isfinite(far).all():
        span = f"between {times[worst]:g} and {times[worst + 1]:g} s"
        problem = f"the spline through the values swings {far[worst]:.3g} beyond all of them {span}"
        raise graph.refuse(f"{problem}; give times of more even steps", f"drives.{drive}.times")
    return spline


def _rounding(times: Sequence[float], values: Sequence[float]) -> float:
    """Acceleration that half a unit in the last digit of values makes by their second differences."""
    digits = max(len(text.partition(".")[2]) if "e" not in (text := repr(value)) else DIGITS for value in values)
    return 4.0 * 0.5 * 10.0**-digits / float(np.diff(times).min()) ** 2


def _times(values: Floats | None, rates: Floats) -> Floats | None:
    """When drives of constant speed have their values; None where they do not run along them at these speeds."""
    if values is None or rates[1:].any() or (rates[0] != rates[0, :1]).any():
        return None
    runs = np.flatnonzero(rates[0, 0])
    each = (values[:, runs] - values[:1, runs]) / rates[0, 0, runs]
    if (np.abs(each - each[:, :1]).max() > SAME * np.abs(each).max()) or (np.diff(each[:, 0]) < 0.0).any():
        return None
    found: Floats = each[:, 0]
    return found
