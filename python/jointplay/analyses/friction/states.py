"""The sliding state: directions of motion, equilibrium, and what friction takes, in the columns of `loaded`.

The efficiency of a configuration is the ratio of the power of the drives without friction and with it: the smaller over
the larger where the motor works, and where the load drives it, what arrives of that.
"""

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Nominal
from jointplay.analyses.running import drive_units
from jointplay.basics.arrays import Floats, Texts
from jointplay.core.answers import EquilibriumTerms, Loaded
from jointplay.core.compile import TURNS, DriveMotion
from jointplay.file.schema import Coupling
from jointplay.model.gaps import centre
from jointplay.model.inertia import acting, kinematics, line_of
from jointplay.model.mechanism import Mechanism
from jointplay.result import STATUSES

from .balance import JAMMED, Equilibrium, EquilibriumAt, SlidingTask, equilibrium
from .couplings import wrenches
from .laws import FLANK, JointContact, contacts
from .places import ends, motions, origin

#: from which side a configuration is approached, with the sign of the motion
SIDES = {"forward": 1.0, "backward": -1.0}
#: a speed below this part of that of the bodies is none
STILL = 1e-9
#: configurations that are solved together
TOGETHER = 512
#: kinds of joints whose forces act at the points of both bodies, wherever these are
IN_GROUND_AXES = ("spherical",)
#: in the plane
IN_GROUND_AXES_IN_PLANE = ("revolute",)
#: offsets below this part of the mechanism's length move nothing
UNMOVED = 1e-12
OK, UNDETERMINED, SINGULAR, STUCK = map(STATUSES.tolist().index, ("ok", "undetermined", "singular", "jammed"))


@dataclass(frozen=True)
class Sliding:
    """What friction makes of `loaded`, from one side."""

    #: its columns
    found: Loaded
    #: power of friction while the drives move as `directions` says, negative, shape (configuration, joint)
    friction: Floats
    #: power that comes out over power that goes in, shape (configuration,)
    efficiency: Floats
    #: coefficient of the joint `jams` from which it jams; nan where it does not
    jam: Floats
    #: the joint that takes most of the power there; empty where it does not
    jams: Texts


def directions(m: Mechanism, drives: Floats, motion: DriveMotion | None) -> Floats:
    """How the drives move where they go forward, shape (configuration, drive).

    As the file says by speeds; else from each configuration to the next; where there is a single one, all of them
    upwards, by a radian or a characteristic length.

    Parameters
    ----------
    drives : ndarray
        Their values.
    motion : DriveMotion or None
        How the file says that they move.
    """
    found = np.zeros_like(drives)
    if motion is not None:
        found += motion.rates[0, : len(drives)]
    still = ~found.any(axis=1)
    if len(drives) > 1:
        found[still] = np.gradient(drives, axis=0)[still]
        still = ~found.any(axis=1)
    found[still] = drive_units(m)
    return found


@dataclass(frozen=True)
class Setting:
    """What friction is asked of."""

    m: Mechanism
    at: Nominal
    #: the columns of `loaded` without friction, with details
    without: Loaded
    #: how the drives move forward, shape (configuration, drive)
    speeds: Floats
    #: force and moment of every load, one after the other, SI
    loads: Floats
    #: values of all parameters where nothing displaces a contact
    built: Floats
    contacts: list[JointContact]

    def parts(self, many: int) -> list[NDArray[np.intp]]:
        """The configurations that `loaded` has found, about as many at a time."""
        good = np.flatnonzero(np.isin(self.at.worse(self.without["status"]), (OK, UNDETERMINED)))
        return [part for part in np.array_split(good, -(-len(good) // many) or 1) if len(part)]

    def task(self, sign: float, places: NDArray[np.intp]) -> tuple[SlidingTask, list[Floats]]:
        """What is solved in some configurations coming from one side, and the speeds of all contacts."""
        m, every, at = self.m, self.contacts, self.at.chosen(places)
        offset, loads, speeds = self.without["offset"][places], self.loads[places], sign * self.speeds[places]
        built = np.tile(self.built, (len(places), 1))
        nominal = m.core.balance(at.drives, at.poses, built, loads)
        velocity = kinematics(m, at.drives, at.poses, np.stack([speeds, 0.0 * speeds])).velocity
        velocity = _with_spins(m, at.poses, velocity)
        rates = _rates(m, every, nominal, at.poses, velocity)
        displaced = np.array(m.core.given(at.drives, at.poses, offset)["poses"])
        balance = m.core.balance(at.drives, displaced, offset, loads)
        transposed = np.swapaxes(balance["jacobian"], 1, 2)
        multipliers = np.asarray(np.linalg.solve(transposed, balance["loads"][..., None])[..., 0], dtype=np.float64)
        scale = np.abs(multipliers / np.array([m.length if c in TURNS else 1.0 for _, c in m.core.rows])).max(axis=1)
        turning = ("pin", "journal", "ball", FLANK)
        own = [contact.own / (m.length if contact.kind in turning else 1.0) for contact in every]
        scale = np.maximum(scale, max(own, default=0.0))
        scale[scale == 0.0] = 1.0
        plays = [abs(end) for contact in every for *_, low, high in contact.parts for end in (low, high)]
        found = SlidingTask(
            m,
            every,
            at.drives,
            at.poses,
            loads,
            built,
            _motions(m, every, nominal, at.poses, rates, velocity),
            scale,
            max([*plays, UNMOVED * m.length]),
            offset,
            multipliers,
        )
        return found, rates


def setting(
    m: Mechanism, at: Nominal, motion: DriveMotion | None, without: Loaded, sizes: str, loads: Floats | None
) -> Setting:
    """What friction is asked of.

    Parameters
    ----------
    motion : DriveMotion or None
        How the drives move there; None where the file does not say.
    without : Loaded
        The columns of `loaded` without friction, with details.
    sizes : str
        As `loaded` has it.
    loads : ndarray or None
        Force and moment of every load, SI, shape (configuration, load, 6); None where they are the same in all.
    """
    if loads is None:
        loads = np.broadcast_to(acting(m, None, [0]), (len(at), len(m.loads.first), 6))
    u = centre(m, sizes)
    return Setting(m, at, without, directions(m, at.drives, motion), loads.reshape(len(at), -1), u, contacts(m, u))


def sliding(asked: Setting, side: str) -> Sliding:
    """The sliding state coming from one side.

    Parameters
    ----------
    side : str
        One of `SIDES`.
    """
    m, count = asked.m, len(asked.at)
    found: Any = copy.deepcopy(asked.without)
    state = Sliding(
        found,
        np.full((count, len(m.joints)), np.nan),
        np.full(count, np.nan),
        np.full(count, np.nan),
        np.full(count, "", dtype=np.array(m.joints).dtype),
    )
    for places in asked.parts(TOGETHER):
        _slide(asked, SIDES[side], places, state)
    return state


def _slide(asked: Setting, sign: float, places: NDArray[np.intp], state: Sliding) -> None:
    """The sliding state in some configurations, put where they stand among all."""
    m, every, without, found = asked.m, asked.contacts, asked.without, state.found
    speeds = sign * asked.speeds[places]
    task, rates = asked.task(sign, places)
    solved = equilibrium(task)
    last = EquilibriumAt(task, solved.y, solved.held, solved.offset, solved.part)
    _put(found, m, task, solved, last, places)
    whole = solved.part == 1.0
    spent = _spent(m, every, last, rates)
    found["drive_force"][places] = torque(m, last.multipliers)
    frictionless, power = (np.sum(of["drive_force"][places] * speeds, axis=1) for of in (without, found))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(frictionless > 0.0, frictionless / power, power / frictionless)
    state.friction[places[whole]], state.efficiency[places[whole]] = spent[whole], ratio[whole]
    stuck = places[~whole]
    for name in ("error", "reaction", "drive_force", "offset", "contribution", "error_first_order", "undetermined"):
        found[name][stuck] = np.nan
    # Where forces have not grown without bound, contacts go over to a place that was not found.
    grown = (solved.forces > JAMMED)[~whole]
    found["status"][stuck] = np.where(grown, STUCK, SINGULAR)
    coefficients = np.zeros(len(m.joints))
    for contact in every:
        coefficients[contact.joint] = max(coefficients[contact.joint], contact.coefficient)
    most = np.argmin(spent, axis=1)
    jammed = np.flatnonzero(~whole)[grown]
    state.jam[places[jammed]] = (solved.part * coefficients[most])[jammed]
    state.jams[places[jammed]] = np.array(m.joints)[most[jammed]]


def _rates(
    m: Mechanism, every: Sequence[JointContact], at: EquilibriumTerms, placed: Floats, velocity: Floats
) -> list[Floats]:
    """Speed of every contact: along or about its axis, of balls the relative angular velocity.

    Of couplings that of the second body against the first at the point of the second, then the angular one.
    """
    found = []
    for contact in every:
        (v1, w1), (v2, w2) = motions(m, contact.joint, at, velocity)
        axes = at["axes"][:, contact.joint]
        if contact.kind == FLANK:
            first, second = ends(m, contact.joint, at, placed)
            found.append(np.concatenate([v2 - v1 - np.cross(w1, second - first), w2 - w1], axis=1))
        elif contact.kind == "ball":
            found.append(w2 - w1)
        elif contact.kind == "pin":
            found.append((w2 - w1)[:, 2])
        elif contact.kind == "journal":
            found.append(np.sum((w2 - w1) * axes[:, 0], axis=1))
        else:
            found.append(np.sum((v2 - v1) * axes[:, 0], axis=1))
    return found


def _fastest(m: Mechanism, velocity: Floats) -> Floats:
    """Largest angular velocity of the bodies, or velocity over the characteristic length."""
    linear, angular = (np.abs(part).max(axis=(1, 2)) for part in np.split(velocity, 2, axis=2))
    return np.asarray(np.maximum(linear / m.length, angular))


def _motions(
    m: Mechanism,
    every: Sequence[JointContact],
    at: EquilibriumTerms,
    placed: Floats,
    rates: Sequence[Floats],
    velocity: Floats,
) -> list[Floats]:
    """Directions of the motions, as `JointContact.at` has them.

    Nothing where it is still.
    """
    least = STILL * _fastest(m, velocity)
    found = []
    for contact, rate in zip(every, rates, strict=True):
        if contact.kind == FLANK:
            entry = m.data.joints[m.joints[contact.joint]]
            assert isinstance(entry, Coupling)
            found.append(wrenches(m, contact.joint, entry, at, placed, velocity, least * m.length))
        elif contact.kind == "ball":
            speed = np.linalg.norm(rate, axis=1, keepdims=True)
            found.append(np.where(speed > least[:, None], rate / np.where(speed > 0.0, speed, 1.0), 0.0))
        else:
            turns = contact.kind in ("pin", "journal")
            found.append(np.where(np.abs(rate) > least * (1.0 if turns else m.length), np.sign(rate), 0.0))
    return found


def _with_spins(m: Mechanism, placed: Floats, velocity: Floats) -> Floats:
    """Velocities where a rod between two balls spins by the mean of what its neighbours do about its line.

    No friction in the balls decides it: the rod bears two forces on one line, through both points of contact, and these
    have no moment about that line, whichever way the rod spins. Between the rates of its neighbours the balls bore
    against each other, so that it spins somewhere between them.
    """
    found = velocity.copy()
    for spin in m.spins:
        if spin.load is not None:
            continue
        others = []
        for joint in spin.joints:
            bodies = [m.points[p].body for p in m.joint_points[joint]]
            other = bodies[1] if bodies[0] in spin.bodies else bodies[0]
            others.append(velocity[:, other, 3:] if other >= 0 else np.zeros((len(placed), 3)))
        start, line = line_of(m, spin, placed)
        for body in spin.bodies:
            missing = np.sum((np.mean(others, axis=0) - velocity[:, body, 3:]) * line, axis=1, keepdims=True) * line
            found[:, body, 3:] += missing
            found[:, body, :3] += np.cross(missing, origin(m, placed, body) - start)
    return found


def torque(m: Mechanism, multipliers: Floats) -> Floats:
    """What every drive does to the second bodies of its joints, by the multipliers of all rows."""
    rows = [tuple(row) for row in m.core.rows]
    found = np.zeros((len(multipliers), len(m.drives)))
    for drive, moves in enumerate(m.drive_moves):
        for joint, coefficient in moves:
            component = "angle" if m.coordinate_kind(joint) == "angle" else "along"
            found[:, drive] -= coefficient * multipliers[:, rows.index((joint, component))]
    return found


def _spent(m: Mechanism, every: Sequence[JointContact], at: EquilibriumAt, rates: Sequence[Floats]) -> Floats:
    """Power of friction at the nominal speeds, by joints."""
    found = np.zeros((len(at.y), len(m.joints)))
    for k, contact in enumerate(every):
        if not contact.rubs:
            continue
        forces = at.forces[k]
        if contact.kind == "ball":
            found[:, contact.joint] += np.sum(forces.second * rates[k], axis=1)
        elif contact.kind == FLANK:
            wrench = np.concatenate([forces.force, forces.second], axis=1)
            found[:, contact.joint] += np.sum(wrench * rates[k], axis=1)
        elif contact.kind in ("pin", "journal"):
            found[:, contact.joint] += forces.second.sum(axis=1) * rates[k]
        else:
            found[:, contact.joint] += forces.force[:, 0] * rates[k]
    return found


def open_widths(of: SlidingTask, maps: Floats) -> Iterator[tuple[int, int, Floats]]:
    """How far each part of every clearance can move the output where nothing decides it: source, row, half-widths."""
    for contact in (contact for contact in of.contacts if contact.source >= 0):
        by_unknown = maps[:, :, contact.parameters] @ np.linalg.inv(contact.transform)
        for begin, end, low, high in contact.parts:
            half = high if end - begin > 1 else (high - low) / 2.0
            yield contact.source, contact.rows[begin], np.linalg.norm(by_unknown[:, :, begin:end], axis=2) * half


def _put(
    found: Loaded, m: Mechanism, of: SlidingTask, solved: Equilibrium, last: EquilibriumAt, places: NDArray[np.intp]
) -> None:
    """Put the answer into the columns of `loaded`."""
    found["error"][places], found["offset"][places] = last.error, last.u
    found["reaction"][places] = _reactions(m, of, last)
    maps = m.core.sensitivity(of.drives, of.nominal)["source"]
    contribution = np.zeros_like(found["contribution"][places])
    for p, source in enumerate(m.parameter_source):
        contribution[:, source] += maps[:, :, p] * last.u[:, [p]]
    found["contribution"][places] = contribution
    found["error_first_order"][places] = contribution.sum(axis=1)
    found["iterations"][places] = solved.steps
    decided, left = found["decided"][places], np.zeros_like(contribution)
    for contact in (contact for contact in of.contacts if contact.source >= 0):
        faces = contact.rows[: contact.parts[-1][1]]
        decided[:, contact.source] = ~solved.held[:, faces].any(axis=1)
    for source, row, width in open_widths(of, maps):
        left[:, source] += np.where(solved.held[:, [row]], width, 0.0)
    found["decided"][places], found["undetermined_contribution"][places] = decided, left
    found["undetermined"][places] = left.sum(axis=1)
    some = left.sum(axis=1).max(axis=1) > UNMOVED * m.length
    found["status"][places] = np.where(some, UNDETERMINED, OK)


def _reactions(m: Mechanism, of: SlidingTask, at: EquilibriumAt) -> Floats:
    """Force and moment on the second body of every joint at its point, friction with it."""
    size = len(m.components)
    whole = np.zeros((len(at.y), len(m.joints), 6))
    spread = [0, 1, 5] if size == 3 else list(range(6))
    jacobian = at.geometry["jacobian"]
    in_ground_axes = IN_GROUND_AXES_IN_PLANE if size == 3 else IN_GROUND_AXES
    for row, (joint, _) in enumerate(m.core.rows):
        first, second = (m.points[p].body for p in m.joint_points[joint])
        body, sign, end = (second, -1.0, 1) if second >= 0 else (first, 1.0, 0)
        own = np.zeros((len(at.y), 6))
        own[:, spread] = sign * at.multipliers[:, [row]] * jacobian[:, row, body * size : (body + 1) * size]
        lever = at.geometry["levers"][:, joint, end]
        # A row in axes of the first body does no work on a motion of both: its wrench on one is the opposite of that on
        # the other. In ground axes its forces act at the points of both.
        if end == 0 and m.joint_kinds[joint] not in in_ground_axes:
            first_place, second_place = ends(m, joint, at.geometry, at.poses)
            lever = lever + second_place - first_place
        own[:, 3:] -= np.cross(lever, own[:, :3])
        whole[:, joint] += own
    for contact, forces in zip(of.contacts, at.forces, strict=True):
        axes = np.eye(3)[None] if contact.in_ground_axes else at.geometry["axes"][:, contact.joint]
        whole[:, contact.joint, :3] += np.einsum("nk,nki->ni", forces.force, np.broadcast_to(axes, (len(at.y), 3, 3)))
        whole[:, contact.joint, 3:] += np.einsum("nk,nki->ni", forces.second, np.broadcast_to(axes, (len(at.y), 3, 3)))
    return whole[..., spread]
