"""The machine as it runs: how the bodies move, what the drives give, and whether contact follows the reactions.

What is computed is quasi-static: inertia acts at the nominal motion, and a joint's offset is where its reaction presses
it. A pin in a hole with the play c does not follow a reaction R at once. With the mass m_t that is moved when the gap
alone moves across R while the drives are held, it swings about the direction of R like a pendulum with the frequency
sqrt(R / (m_t c)), while R itself turns with the speed theta'. The ratio of both is the contact rate

    kappa = theta' sqrt(m_t c / R),   theta' = |R x R'| / R^2,   m_t = 1 / (t . (T^T M T)^-1 t)

where t is across R in the plane of R and R', T are the twists of all bodies by displacements of the gap, and M their
masses. It has peaks where R passes near zero, often between two configurations; so R is followed from each to the next.
Below `FOLLOWS` the pin lags by less than some degrees; above `LOST` the pendulum, starting from rest, leaves its hole
while R passes by; in between it depends on what is still swinging. Where R goes through zero, the pin crosses its play
from rest in the transit time

    tau = (12 m_r c / |R'|)^(1/3)

with m_r as m_t, but along R'.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.arrays import Array, Floats
from jointplay.core.compile import LENGTHS, DriveMotion
from jointplay.errors import InputError
from jointplay.model.inertia import Kinematics, components, kinematics, matrices, wrenches
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder, Variable

from .nominal import OK, Nominal, at_drives

#: contact rates below which contact follows, and above which it is lost
FOLLOWS, LOST = 0.3, 5.6
#: the words for these, and for what is in between
CONTACT = ("follows", "may be lost", "lost")
#: what `speeds` tells
SPEEDS = ("speeds", "inertia", "rounded")
#: motion of the drives by which reactions are differenced, in radians or characteristic lengths
STEP = 1e-4
#: instants of a path, at least, between which reactions go straight on
INSTANTS = 720
#: part of the largest acceleration that the rounding of a table may make of nothing, unsaid
NOISY = 0.01
#: a rate of turning below this part of the speed of the drives is rounding
STILL = 1e-9
#: a reaction below this part of the largest one is rounding
ROUNDING = 1e-12


def speeds(m: Mechanism) -> dict[str, str]:
    """What a result says of the speeds at which inertia acts; nothing where all drives are at rest."""
    if m.motion is None:
        return {}
    units = m.units
    told = []
    for k, (name, drive) in enumerate(m.data.drives.items()):
        largest = float(np.abs(m.motion.rates[0, :, k]).max())
        if largest == 0.0 and not m.motion.rates[1, :, k].any():
            continue
        factor, unit = (
            (units.turning_speed, units.turning_speed_name)
            if m.coordinate_kind(m.drive_joints[k]) == "angle"
            else (units.speed, units.speed_name)
        )
        most = "" if (np.abs(m.motion.rates[0, :, k]) == largest).all() else "up to "
        law = f" ({drive.motion}, {drive.duration:g} s)" if drive.motion is not None else ""
        told.append(f"{name} {most}{largest / factor:.6g} {unit}{law}")
    heavy = any(body.mass > 0.0 or body.rotational_inertia for body in m.data.bodies.values())
    said = {"speeds": ", ".join(told), "inertia": "counted" if heavy else "none"}
    noisy = [f"{name} by {100 * part:.2g} %" for name, part in m.motion.rounded.items() if part > NOISY]
    return said | ({"rounded": ", ".join(noisy)} if noisy else {})


def motion_of(m: Mechanism, at: Nominal) -> DriveMotion | None:
    """How the drives move in some configurations; None where they are at rest.

    Raises
    ------
    InputError
        When speeds change along the path of the file, and other configurations are asked for.
    """
    if m.motion is None or (m.drive_values is not None and np.array_equal(at.drives, m.drive_values)):
        return m.motion
    if not m.motion.is_steady:
        problem = "speeds that change along the path hold for its configurations only; here a drive needs a single one"
        raise InputError(problem, file=m.file, key="drives")
    return DriveMotion(np.repeat(m.motion.rates[:, :1], len(at), axis=1), None)


def moving(m: Mechanism, at: Nominal, motion: DriveMotion | None) -> Kinematics | None:
    """How the bodies move in configurations that are solved; None where they are at rest."""
    return None if motion is None else kinematics(m, at.drives, at.poses, motion.rates)


def add_motion(m: Mechanism, builder: ResultBuilder, motion: DriveMotion, bodies: Kinematics, *, details: bool) -> None:
    """Add when each configuration is passed, and how the output moves; with details all bodies and drives."""
    if motion.times is not None:
        builder.add("time", "configuration", motion.times, "time since the first configuration", "time")
    point = m.points[m.output_point]
    both = bodies.of_point(point.body, point.at)
    for name, order, values in zip(("velocity", "acceleration"), (1, 2), both, strict=True):
        words = f"nominal {name} of the output, ground axes"
        builder.add(name, ("configuration", "component"), components(m, values), words, f"rate{order}:component")
    if not details:
        return
    each = ("configuration", "body", "component")
    for k, (name, order) in enumerate((("body_velocity", 1), ("body_acceleration", 2))):
        of_all = [components(m, bodies.of_point(body, (0.0, 0.0, 0.0))[k]) for body in range(len(m.bodies))]
        words = f"nominal {name.removeprefix('body_')} of the body's axes, ground axes"
        builder.add(name, each, np.stack(of_all, axis=1), words, f"rate{order}:component")
    builder.add("drive_speed", ("configuration", "drive"), motion.rates[0], "speed of the drive", "speed:drive")


def add_drives(m: Mechanism, builder: ResultBuilder, motion: DriveMotion, torque: Floats) -> None:
    """Add what the motors give besides the moments or forces on the joints."""
    each = ("configuration", "drive")
    if m.rotor_inertia.any():
        torque = torque + m.rotor_inertia * motion.rates[1]
        words = "moment or force of the motor, that which accelerates its rotor included"
        builder.add("motor_torque", each, torque, words, "work:drive")
    builder.add("drive_power", each, torque * motion.rates[0], "power of the motor", "power")


def add_contact(m: Mechanism, builder: ResultBuilder, at: Nominal, motion: DriveMotion) -> None:
    """Add how fast every reaction turns beside the pendulum of the play, of a determinate mechanism."""
    if not _is_judged(m):
        return
    rate, transit = contact_rates(m, at, motion)
    words = "turning of the reaction over the frequency of the play's pendulum (contact rate)"
    builder.add("contact_rate", ("configuration", "source"), rate, words)
    words = "whether contact follows the reaction; empty: not judged"
    builder.add("contact", ("configuration", "source"), _named(rate), words)
    words = "least time in which the pin crosses its play, where contact may be lost"
    builder.add("transit_time", ("configuration", "source"), np.where(rate > FOLLOWS, transit, np.nan), words, "time")


def add_largest_rate(builder: ResultBuilder, parts: Iterable[tuple[Mechanism, Nominal]], when: str) -> None:
    """Add to the figures of a result the largest contact rate of some mechanisms along their paths; none if at rest."""
    top: tuple[float, str, int] | None = None
    for m, at in parts:
        motion = motion_of(m, at) if _is_judged(m) else None
        if motion is None:
            continue
        rates, _ = contact_rates(m, at, motion)
        if np.isnan(rates).all():
            continue
        place, source = np.unravel_index(int(np.nanargmax(rates)), rates.shape)
        if top is None or rates[place, source] > top[0]:
            top = float(rates[place, source]), m.sources[source], int(place)
    if top is not None:
        for name, value, words in (
            ("contact_rate", top[0], f"largest contact rate {when}"),
            ("contact", str(_named(np.array(top[0]))), "whether contact follows the reactions"),
            ("contact_source", top[1], "where the contact rate is largest"),
            ("contact_configuration", top[2], "near which configuration"),
        ):
            builder.data[name] = Variable((), np.array(value), "", words)


def loses_contact(figures: Result) -> bool:
    """Whether contact may be lost by what `add_largest_rate` has found."""
    return "contact_rate" in figures.data and float(figures.get("contact_rate")) > FOLLOWS


def _is_judged(m: Mechanism) -> bool:
    """Whether inertia turns reactions that statics alone determines."""
    return bool(m.loads.inertial) and m.core.isostatic


def _named(rate: Floats) -> Array:
    """The words for contact rates."""
    words: Array = np.where(np.isnan(rate), "", np.array(CONTACT)[(rate > FOLLOWS).astype(int) + (rate > LOST)])
    return words


def contact_rates(m: Mechanism, at: Nominal, motion: DriveMotion) -> tuple[Floats, Floats]:
    """The largest contact rate and transit time of every source near each configuration, shape (configuration, source).

    Near is as far as half-way to the next configurations, where it is known when each of them is passed. Not a number
    where it is not judged.
    """
    found = np.full((2, len(at), len(m.sources)), np.nan)
    judged = [one for one in m.round_plays if one[2] > 0.0]
    if not judged:
        return found[0], found[1]
    is_path = motion.times is not None and len(at) > 1
    instants = _along_path(m, at, motion) if is_path else _around(m, at, motion.rates)
    speed = np.abs(instants.rates[0] / drive_units(m)).max(axis=1)
    known = np.isfinite(instants.at.poses).all(axis=(1, 2)) & (instants.at.status == OK)
    places = np.flatnonzero(known)
    if not len(places):
        return found[0], found[1]
    forces = np.full((len(known), len(m.joints), 3), np.nan)
    forces[places] = _reactions(m, instants.chosen(places))
    masses, twists = _mobility(m, instants.at.chosen(places))
    own = np.cumsum(known) - 1
    begin = np.flatnonzero(known[:-1] & known[1:] & instants.goes_on[:-1] & (speed[:-1] + speed[1:] > 0.0))
    for source, joint, play in judged:
        rows = _rows(m, joint)
        gaps = [twists[own[k]][:, :, rows] for k in (begin, begin + 1)]
        ends = [
            np.einsum("nia,nij,njb->nab", gap, masses[own[k]], gap)
            for k, gap in zip((begin, begin + 1), gaps, strict=True)
        ]
        start, end = (forces[k, joint, : len(rows)] for k in (begin, begin + 1))
        for of, values in zip(found, _passing(start, end, instants.steps[begin], ends, play), strict=True):
            np.fmax.at(of[:, source], instants.nearest[begin], values)
    return found[0], found[1]


@dataclass(frozen=True)
class _Instants:
    """Instants one after the other."""

    at: Nominal
    #: of the drives, shape (2, instant, drive)
    rates: Floats
    #: number of the configuration, between two of them a part more, shape (instant,)
    number: Floats
    #: the configuration nearest to the half-way from each to the next one
    nearest: NDArray[np.intp]
    #: time to the next one
    steps: Floats
    #: whether the next one follows it
    goes_on: NDArray[np.bool_]

    def chosen(self, places: NDArray[np.intp]) -> _Instants:
        """Some of them."""
        rest = (self.number[places], self.nearest[places], self.steps[places], self.goes_on[places])
        return _Instants(self.at.chosen(places), self.rates[:, places], *rest)


def _along_path(m: Mechanism, at: Nominal, motion: DriveMotion) -> _Instants:
    """Instants on the way from configuration to configuration."""
    assert motion.times is not None
    count = len(at)
    parts = -(-INSTANTS // count)
    spans = np.diff(motion.times, append=motion.times[-1])
    share = np.arange(parts) / parts
    # Both sides of a jump, and the last configuration, are instants without a way to the next.
    kept = (share == 0.0) | (spans[:, None] > 0.0)
    states = _between(at.drives, motion.rates, spans, share)[:, kept]
    owner, number = (
        np.broadcast_to(np.arange(count)[:, None], kept.shape)[kept],
        (np.arange(count)[:, None] + share)[kept],
    )
    nearest = np.minimum(np.floor(number + 0.5 / parts + 0.5).astype(np.intp), count - 1)
    steps = spans[owner] / parts
    return _Instants(at_drives(m, states[0]), states[1:], number, nearest, steps, steps > 0.0)


def _between(drives: Floats, rates: Floats, spans: Floats, share: Floats) -> Floats:
    """Values, speeds and accelerations of drives at shares of the way from each configuration to the next.

    They follow the polynomials of degree 5 that have the value, speed and acceleration of both. Shape (3,
    configuration, share, drive).
    """
    start = np.stack([drives, *rates[:2]])
    end = np.roll(start, -1, axis=1)
    t = spans[:, None, None] * share[:, None]
    span = np.where(spans > 0.0, spans, 1.0)[:, None, None]
    (q, v, a), (q1, v1, a1) = start[:, :, None], end[:, :, None]
    far, fast, more = q1 - (q + v * span + a * span**2 / 2), (v1 - (v + a * span)) * span, (a1 - a) * span**2
    third, fourth, fifth = 10 * far - 4 * fast + more / 2, -15 * far + 7 * fast - more, 6 * far - 3 * fast + more / 2
    x = t / span
    return np.stack(
        [
            q + v * t + a * t**2 / 2 + x**3 * (third + x * (fourth + x * fifth)),
            v + a * t + x**2 * (3 * third + x * (4 * fourth + x * 5 * fifth)) / span,
            a + x * (6 * third + x * (12 * fourth + x * 20 * fifth)) / span**2,
        ]
    )


def _around(m: Mechanism, at: Nominal, rates: Floats) -> _Instants:
    """Instants right before and after each configuration, where they are no path."""
    pace, gain = (np.abs(rate / drive_units(m)).max(axis=1) for rate in rates[:2])
    # Near rest it is the acceleration that moves the drives by a step.
    fastest = pace + np.sqrt(0.5 * STEP * gain)
    dt = np.where(fastest > 0.0, STEP / np.where(fastest > 0.0, fastest, 1.0), 0.0)
    sides = np.array([-1.0, 0.0, 1.0])
    step = (dt[:, None] * sides)[..., None]
    now = kinematics(m, at.drives, at.poses, rates)
    many = np.repeat(np.arange(len(at)), len(sides))
    each = step.reshape(-1, 1, 1)
    twists = each * now.velocity[many] + each**2 / 2 * now.acceleration[many]
    placed = poses.moved(at.poses[many], components(m, twists), now.origins)
    speed, acceleration, jerk = (rate[:, None] for rate in rates)
    drives = at.drives[:, None] + step * speed + step**2 / 2 * acceleration
    then = np.stack([speed + step * acceleration + step**2 / 2 * jerk, acceleration + step * jerk])
    here = replace(at.chosen(many), poses=placed, drives=drives.reshape(-1, len(m.drives)))
    goes_on = np.tile([True, True, False], len(at)) & (dt[many] > 0.0)
    return _Instants(here, then.reshape(2, -1, len(m.drives)), many.astype(float), many, dt[many], goes_on)


def drive_units(m: Mechanism) -> Floats:
    """What counts as much as a radian of the drives."""
    return np.array([1.0 if m.coordinate_kind(joint) == "angle" else m.length for joint in m.drive_joints])


def _passing(start: Floats, end: Floats, step: Floats, masses: Sequence[Floats], play: float) -> tuple[Floats, Floats]:
    """Contact rates where forces that go straight on are nearest to zero, and transit times; nan without any force."""
    change = end - start
    size = np.linalg.norm(change, axis=1)
    largest = np.maximum(np.linalg.norm(start, axis=1), np.linalg.norm(end, axis=1))
    moves = size > STILL * largest
    ahead = change / np.where(moves, size, 1.0)[:, None]
    share = np.clip(-np.sum(start * ahead, axis=1) / np.where(moves, size, 1.0), 0.0, 1.0)
    force = start + share[:, None] * change
    least = np.linalg.norm(force, axis=1)
    zero = least <= STILL * largest
    along = force / np.where(zero, 1.0, least)[:, None]
    across = change - np.sum(change * along, axis=1, keepdims=True) * along
    turning = np.linalg.norm(across, axis=1)
    turns = moves & (turning > STILL * largest)
    tangent = across / np.where(turns, turning, 1.0)[:, None]

    def mass(way: Floats) -> Floats:
        first, last = (_effective(mass, way) for mass in masses)
        return np.asarray((1.0 - share) * first + share * last)

    least = np.where(zero, 1.0, least)
    rate = np.where(turns, turning / (step * least) * np.sqrt(mass(tangent) * play / least), 0.0)
    transit = np.where(moves, np.cbrt(12.0 * mass(ahead) * play * step / np.where(moves, size, 1.0)), 0.0)
    # Without any force there is no contact to follow.
    return np.asarray(np.where(zero, np.where(moves, np.inf, np.nan), rate)), np.asarray(transit)


def _rows(m: Mechanism, joint: int) -> list[int]:
    """The rows of the closure that hold the point of a joint along ground axes, as those of round clearances do."""
    return [k for k, (own, name) in enumerate(m.core.rows) if own == joint and name in LENGTHS]


def _reactions(m: Mechanism, instants: _Instants) -> Floats:
    """Forces on the second bodies of joints with a round clearance, without any; shape (instant, joint, 3)."""
    at = instants.at
    motion = kinematics(m, at.drives, at.poses, instants.rates)
    work = np.zeros((len(at), len(m.bodies), 6))
    for inertial, force in zip(m.loads.inertial, np.moveaxis(wrenches(m, motion), 1, 0), strict=True):
        _push(m, motion, m.loads.first[inertial.load]["point"], force, work)
    for k, load in enumerate(m.loads.first):
        each = np.array([[one["force"], one["moment"]] for one in m.loads.along.get(k, (load,))])
        low = np.minimum(np.floor(instants.number).astype(np.intp), len(each) - 1)
        high, part = np.minimum(low + 1, len(each) - 1), (instants.number % 1.0)[:, None, None]
        acting = (1.0 - part) * each[low] + part * each[high]
        if "axes" in load:
            acting = acting @ np.swapaxes(poses.matrix(at.poses[:, load["axes"]]), 1, 2)
        _push(m, motion, load["point"], acting.reshape(-1, 6), work)
    flat = components(m, work).reshape(len(at), -1)
    held = -np.linalg.solve(np.swapaxes(m.core.jacobian(at.poses), 1, 2), flat[..., None])[..., 0]
    held[np.abs(held) <= ROUNDING * np.abs(held).max(initial=0.0)] = 0.0
    of_springs = None
    if m.data.springs:
        of_springs = m.varied(loads=[]).loaded(at.drives, at.poses, exact=False)["reaction"]
    found = np.full((len(at), len(m.joints), 3), np.nan)
    for _, joint, _ in m.round_plays:
        rows = _rows(m, joint)
        found[:, joint, : len(rows)] = held[:, rows]
        if of_springs is not None:
            found[:, joint, : len(rows)] += of_springs[:, joint, : len(rows)]
    return found


def _push(m: Mechanism, motion: Kinematics, point: int, wrench: Floats, work: Floats) -> None:
    """Add a force and a moment at a point to what acts at the origins of the bodies."""
    body = m.points[point].body
    arm = motion.arm(body, m.points[point].at)
    work[:, body, :3] += wrench[:, :3]
    work[:, body, 3:] += wrench[:, 3:] + np.cross(arm, wrench[:, :3])


def _mobility(m: Mechanism, at: Nominal) -> tuple[Floats, Floats]:
    """Masses of all bodies at their origins, and their twists by displacements of the rows, drives held."""
    still = kinematics(m, at.drives, at.poses, np.zeros((2, 1, len(m.drives))))
    inertia = matrices(m, at.poses)
    kept = list(range(6)) if m.pose_size == poses.SPATIAL else [0, 1, 5]
    size = len(kept)
    masses = np.zeros((len(at), len(m.bodies) * size, len(m.bodies) * size))
    for k, inertial in enumerate(m.loads.inertial):
        point = m.points[m.loads.first[inertial.load]["point"]]
        arm, cross = still.arm(point.body, point.at), np.zeros((len(at), 3, 3))
        cross[:, [2, 0, 1], [1, 2, 0]], cross[:, [1, 2, 0], [2, 0, 1]] = arm, -arm
        own = np.zeros((len(at), 6, 6))
        own[:, :3, :3], own[:, 3:, 3:] = inertial.mass * np.eye(3), inertia[:, k] - inertial.mass * cross @ cross
        own[:, 3:, :3], own[:, :3, 3:] = inertial.mass * cross, -inertial.mass * cross
        part = slice(point.body * size, (point.body + 1) * size)
        masses[:, part, part] += own[:, kept][:, :, kept]
    return masses, np.asarray(np.linalg.inv(m.core.jacobian(at.poses)))


def _effective(mass: Floats, tangent: Floats) -> Floats:
    """Mass that a force on a gap along some direction moves; zero where something without mass gives way to it."""
    sizes, ways = np.linalg.eigh(mass)
    along = np.einsum("nab,na->nb", ways, tangent) ** 2
    along = np.where(along > STILL, along, 0.0)
    light = sizes <= STILL * sizes[:, -1:]
    gives = (light & (along > 0.0)).any(axis=1)
    mobility = (along / np.where(light, 1.0, sizes)).sum(axis=1)
    return np.asarray(np.where(gives | (mobility == 0.0), 0.0, 1.0 / np.where(mobility > 0.0, mobility, 1.0)))
