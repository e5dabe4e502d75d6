"""The machine as it runs: how the bodies move, what the drives give, and whether contact follows the reactions.

What is computed is quasi-static: inertia acts at the nominal motion, and a joint's offset is where its reaction presses
it. A pin in a hole with the play c does not follow a reaction R at once. With the mass m_t that is moved when the gap
alone moves across R while the drives are held, it swings about the direction of R like a pendulum with the frequency
sqrt(R / (m_t c)), while R itself turns with the speed theta'. The ratio of both is the contact rate

    kappa = theta' sqrt(m_t c / R),   theta' = |R x R'| / R^2,   m_t = 1 / (t . (T^T M T)^-1 t)

with t across R in the plane of R and R', T the twists of all bodies by displacements of the gap, and M their masses. Below
`FOLLOWS` the pin lags by less than some degrees; above `LOST` the pendulum, starting from rest, leaves its hole while R
passes by; in between it depends on what is still swinging.
"""

from __future__ import annotations

import numpy as np

from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError
from jointplay.model.inertia import Kinematics, kinematics, matrices, wrenches
from jointplay.model.mechanism import Mechanism
from jointplay.result import ResultBuilder

from .nominal import OK, Nominal

#: contact rates below which contact follows, and above which it is lost
FOLLOWS, LOST = 0.3, 5.6
#: the words for these, and for what is in between
CONTACT = ("follows", "may be lost", "lost")
#: sets of offsets in a plane or in space that are the same in every direction; only they are judged
ROUND = ("disc", "ball")
#: motion of the drives by which reactions are differenced, in radians or characteristic lengths
STEP = 1e-4
#: a rate of turning below this part of the speed of the drives is rounding
STILL = 1e-9


def rates_of(m: Mechanism, count: int) -> Floats:
    """Speeds, accelerations and their derivatives of the drives in so many configurations.

    Raises
    ------
    InputError
        When they change along the path of the file, and other configurations are asked for.
    """
    assert m.motion is not None
    rates = m.motion.rates
    if m.motion.is_steady:
        return np.repeat(rates[:, :1], count, axis=1)
    if rates.shape[1] != count:
        problem = "speeds that change along the path hold for its configurations only; here a drive needs a single one"
        raise InputError(problem, file=m.file, key="drives")
    return rates


def moving(m: Mechanism, at: Nominal) -> Kinematics:
    """How the bodies move in configurations that are solved."""
    return kinematics(m, at.drives, at.poses, rates_of(m, len(at)))


def add_motion(m: Mechanism, builder: ResultBuilder, at: Nominal, *, details: bool) -> None:
    """Add when each configuration is passed, and how the output moves; with details all bodies and drives."""
    if m.motion is None:
        return
    motion, rates = moving(m, at), rates_of(m, len(at))
    if m.motion.times is not None and len(m.motion.times) == len(at):
        builder.add("time", "configuration", m.motion.times, "time since the first configuration", "time")
    point = m.points[m.output_point]
    both = motion.of_point(point.body, point.at)
    for name, order, values in zip(("velocity", "acceleration"), (1, 2), both, strict=True):
        words = f"nominal {name} of the output, ground axes"
        builder.add(name, ("configuration", "component"), _components(m, values), words, f"rate{order}:component")
    if not details:
        return
    each = ("configuration", "body", "component")
    for k, (name, order) in enumerate((("body_velocity", 1), ("body_acceleration", 2))):
        of_all = [_components(m, motion.of_point(body, (0.0, 0.0, 0.0))[k]) for body in range(len(m.bodies))]
        words = f"nominal {name.removeprefix('body_')} of the body's axes, ground axes"
        builder.add(name, each, np.stack(of_all, axis=1), words, f"rate{order}:component")
    builder.add("drive_speed", ("configuration", "drive"), rates[0], "speed of the drive", "rate1:drive")


def add_drives(m: Mechanism, builder: ResultBuilder, torque: Floats) -> None:
    """Add what the motors give besides the moments or forces on the joints."""
    if m.motion is None:
        return
    each, rates = ("configuration", "drive"), rates_of(m, len(torque))
    if m.rotor_inertia.any():
        torque = torque + m.rotor_inertia * rates[1]
        words = "moment or force of the motor, that which accelerates its rotor included"
        builder.add("motor_torque", each, torque, words, "work:drive")
    builder.add("drive_power", each, torque * rates[0], "power of the motor", "power")


def add_contact(m: Mechanism, builder: ResultBuilder, at: Nominal) -> None:
    """Add how fast every reaction turns beside the pendulum of the play, of a determinate mechanism."""
    if m.motion is None or not m.loads.inertial or not m.core.isostatic:
        return
    rate = contact_rates(m, at)
    words = "turning of the reaction over the frequency of the play's pendulum (contact rate)"
    builder.add("contact_rate", ("configuration", "source"), rate, words)
    named = np.where(np.isnan(rate), "", np.array(CONTACT)[(rate > FOLLOWS).astype(int) + (rate > LOST)])
    builder.add("contact", ("configuration", "source"), named, "whether contact follows the reaction; empty: not judged")


def contact_rates(m: Mechanism, at: Nominal) -> Floats:
    """Contact rate of every source, shape (configuration, source); nan where it is not judged."""
    rates = rates_of(m, len(at))
    unit = np.array([1.0 if m.coordinate_kind(joint) == "angle" else m.length for joint in m.drive_joints])
    fastest = np.abs(rates[0] / unit).max(axis=1)
    places = np.flatnonzero(np.isfinite(at.poses).all(axis=(1, 2)) & (at.status == OK) & (fastest > 0.0))
    found = np.full((len(at), len(m.sources)), np.nan)
    judged = _judged(m)
    if not len(places) or not judged:
        return found
    here, own, fastest = at.chosen(places), rates[:, places], fastest[places]
    before, reaction, after = (_reactions(m, here, own, side * STEP / fastest, places) for side in (-1.0, 0.0, 1.0))
    turning = (after - before) / (2.0 * STEP / fastest[:, None, None])
    masses, twists = _mobility(m, here)
    for source, joint, play in judged:
        size = np.linalg.norm(reaction[:, joint], axis=1)
        along = reaction[:, joint] / np.where(size > 0.0, size, 1.0)[:, None]
        across = turning[:, joint] - np.sum(turning[:, joint] * along, axis=1, keepdims=True) * along
        change = np.linalg.norm(across, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            gap = twists[:, :, _rows(m, joint)]
            mass = _effective(np.einsum("nia,nij,njb->nab", gap, masses, gap), across / change[:, None])
            theta = change / size
            rate = theta * np.sqrt(mass * play / size)
        rate = np.where(theta > STILL * fastest, rate, 0.0)
        found[places, source] = np.where(size > 0.0, rate, np.inf)
    return found


def _judged(m: Mechanism) -> list[tuple[int, int, float]]:
    """Round clearances: source, joint, play."""
    found = []
    for k, source in enumerate(m.compiled_sources):
        sizes = next((source.spec["set"][name] for name in ROUND if name in source.spec["set"]), {"radius": 0.0})
        if source.kind == "clearance" and "joint" in source.spec and sizes["radius"] > 0.0:
            found.append((k, source.spec["joint"], sizes["radius"]))
    return found


def _rows(m: Mechanism, joint: int) -> list[int]:
    """The rows of the closure that hold the point of a joint along ground axes, as those of round clearances do."""
    return [k for k, (own, name) in enumerate(m.core.rows) if own == joint and name in LENGTHS]


def _reactions(m: Mechanism, at: Nominal, rates: Floats, dt: Floats, places: NDArray[np.intp]) -> Floats:
    """Forces on the second bodies of joints with a round clearance at times near to those of configurations.

    Shape (configuration, joint, translation); nan of other joints.
    """
    speed, acceleration, jerk = rates
    step = dt[:, None]
    now = kinematics(m, at.drives, at.poses, rates)
    twists = step[..., None] * now.velocity + step[..., None] ** 2 / 2 * now.acceleration
    drives = at.drives + step * speed + step**2 / 2 * acceleration
    placed = poses.moved(at.poses, twists if m.pose_size == poses.SPATIAL else twists[..., [0, 1, 5]], now.origins)
    then = np.stack([speed + step * acceleration + step**2 / 2 * jerk, acceleration + step * jerk])
    motion = kinematics(m, drives, placed, then)
    work = np.zeros((len(at), len(m.bodies), 6))
    for inertial, force in zip(m.loads.inertial, np.moveaxis(wrenches(m, motion), 1, 0), strict=True):
        _push(m, motion, m.loads.first[inertial.load]["point"], force, work)
    for k, load in enumerate(m.loads.first):
        each = [m.loads.along[k][n] for n in places] if k in m.loads.along else [load] * len(at)
        acting = np.array([[one["force"], one["moment"]] for one in each])
        if "axes" in load:
            acting = acting @ np.swapaxes(poses.matrix(placed[:, load["axes"]]), 1, 2)
        _push(m, motion, load["point"], acting.reshape(-1, 6), work)
    flat = (work if m.pose_size == poses.SPATIAL else work[..., [0, 1, 5]]).reshape(len(at), -1)
    held = -np.linalg.solve(np.swapaxes(m.core.jacobian(placed), 1, 2), flat[..., None])[..., 0]
    of_springs = None
    if m.core_spec["springs"] or m.core_spec["torsions"]:
        of_springs = m.varied(loads=[]).loaded(drives, placed, exact=False)["reaction"]
    found = np.full((len(at), len(m.joints), len([name for name in m.components if name in LENGTHS])), np.nan)
    for _, joint, _ in _judged(m):
        found[:, joint] = held[:, _rows(m, joint)]
        if of_springs is not None:
            found[:, joint] += of_springs[:, joint, : found.shape[2]]
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
    return masses, np.linalg.inv(m.core.jacobian(at.poses))


def _effective(mass: Floats, tangent: Floats) -> Floats:
    """Mass that a force on a gap along some direction moves; zero where something without mass gives way to it."""
    sizes, ways = np.linalg.eigh(mass)
    along = np.einsum("nab,na->nb", ways, tangent) ** 2
    sizes = np.where(sizes > STILL * sizes[:, -1:], sizes, 0.0)
    mobility = np.where(along > STILL, along / sizes, 0.0).sum(axis=1)
    return np.asarray(np.where(mobility > 0.0, 1.0 / mobility, 0.0))


def _components(m: Mechanism, values: Floats) -> Floats:
    """Six numbers of a velocity as the components of a pose."""
    return values if m.pose_size == poses.SPATIAL else values[..., [0, 1, 5]]
