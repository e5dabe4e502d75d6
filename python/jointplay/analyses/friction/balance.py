"""Equilibrium with friction on the exact closure, by Newton's method.

With the unknowns y of all contacts (see `laws`) and one for every other row, offsets u(y) and multipliers l(y) follow.
The closure gives the poses x(u), and friction its generalised forces f(l, x). Equilibrium is

    R(y) = J(x)^T l - W(x) - f(l, x) = 0        W: what loads and springs do

Its derivatives are those of the contacts by y, and of R by x along the motions that offsets make, as central
differences. From the equilibrium without friction the coefficients grow to their values in steps. Where det(dR/dy) goes
through zero on the way and the forces grow without bound, the mechanism is jammed from that part of the coefficients
on. Iteration between reactions and friction finds forces beyond it, too, of the wrong sign. Where a force goes through
zero, the contact may go over to its other side at once, and equilibrium is looked for there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.answers import EquilibriumTerms
from jointplay.core.compile import TURNS
from jointplay.model.inertia import components
from jointplay.model.mechanism import Mechanism

from .laws import ContactForces, ContactPart, HeldOffsets, JointContact
from .places import origin

#: steps of Newton's method, and parts of one that are tried
STEPS, HALVINGS = 30, 8
#: what is left of the forces, as a part of the largest; and what rounding may leave where no step makes it less
LEFT, ROUNDED = 1e-13, 1e-10
#: first part of the coefficients that is added, and the least
FIRST, LEAST = 0.25, 1e-5
#: differences of unknowns, and of motions in characteristic lengths and radians
STEP, MOVE = 1e-6, 1e-6
#: forces below this part of the largest are none
NONE = 1e-9
#: times that contacts which nothing had pressed are let go
RELEASES = 3
#: growth of the forces by which jamming is told from the loss of an equilibrium
JAMMED = 50.0
#: where no step of the coefficients larger than this can be made, contacts with less than a part of the largest force
#: may have changed sides
TURNING, WEAK = (2e-3, 1e-4), 0.1
#: as many of them at a time, pressed from the start by this part
LOOSE, PRESSED = 4, 0.05


@dataclass(frozen=True)
class SlidingTask:
    """What does not change while equilibrium is found, of some configurations."""

    m: Mechanism
    contacts: list[JointContact]
    #: `drives`, `nominal`: drive values and nominal poses
    drives: Floats
    nominal: Floats
    #: force and moment of every load, one after the other
    wrenches: Floats
    #: values of the parameters where nothing displaces a contact
    built: Floats
    #: direction of the motion of every contact, as `JointContact.at` has it
    motions: list[Floats]
    #: unit of forces, shape (configuration,)
    scale: Floats
    #: unit of offsets
    unit: float
    #: `offset`, `multipliers`: values of all parameters and multipliers of all rows without friction
    offset: Floats
    multipliers: Floats

    def chosen(self, places: NDArray[np.intp] | NDArray[np.bool_]) -> SlidingTask:
        """Some configurations only."""
        names = ("drives", "nominal", "wrenches", "built", "scale", "offset", "multipliers")
        return replace(
            self,
            **{name: getattr(self, name)[places] for name in names},
            motions=[motion[places] for motion in self.motions],
        )


@dataclass
class Equilibrium:
    """What was found, of all configurations."""

    #: unknowns, in the order of the rows
    y: Floats
    #: those whose offset nothing decides
    held: NDArray[np.bool_]
    #: of these
    offset: Floats
    #: part of the coefficients up to which equilibrium was found: 1 where all is well
    part: Floats
    #: largest force there, in units
    forces: Floats
    #: steps of Newton's method
    steps: NDArray[np.int64]

    def chosen(self, places: NDArray[np.intp]) -> Equilibrium:
        """A copy of some configurations."""
        return Equilibrium(*(getattr(self, field.name)[places] for field in fields(self)))


class EquilibriumAt:
    """Equilibrium of some configurations at some unknowns."""

    def __init__(self, of: SlidingTask, y: Floats, held: NDArray[np.bool_], offset: Floats, part: Floats) -> None:
        self.of, self.y, self.held, self.offset, self.part = of, y, held, offset, part
        self.u, self.multipliers = of.built.copy(), y * _row_units(of)
        self.forces = [self._forces(k, y) for k in range(len(of.contacts))]
        for contact, forces in zip(of.contacts, self.forces, strict=True):
            self.multipliers[:, contact.rows] = forces.multiplier
            if len(contact.parameters):
                self.u[:, contact.parameters] = of.built[:, contact.parameters] + forces.offset
        found = of.m.core.given(of.drives, of.nominal, self.u)
        self.error, self.poses, self.closed = found["error"], np.array(found["poses"]), found["status"] == 0
        self.closed &= np.isfinite(self.poses).all(axis=(1, 2))
        self.poses[~self.closed] = of.nominal[~self.closed]
        self.geometry = of.m.core.balance(of.drives, self.poses, self.u, of.wrenches)
        self.residual = self._residual(self.geometry, self.poses)
        self.size = np.where(self.closed, np.abs(self.residual).max(axis=1, initial=0.0), np.inf)

    def _forces(self, k: int, y: Floats, motion: Floats | None = None) -> ContactForces:
        of, contact = self.of, self.of.contacts[k]
        own = HeldOffsets(self.held[:, contact.rows], self.offset[:, contact.rows])
        motion = of.motions[k] if motion is None else motion
        return contact.at(y[:, contact.rows], motion, self.part, of.unit, of.scale, own)

    def _residual(self, geometry: EquilibriumTerms, placed: Floats) -> Floats:
        """Forces and moments that are left on all bodies, in units."""
        of = self.of
        many = len(placed) // len(self.y)
        repeated = np.repeat(np.arange(len(self.y)), many)
        left = np.einsum("nrk,nr->nk", geometry["jacobian"], self.multipliers[repeated]) - geometry["loads"]
        for contact, forces in zip(of.contacts, self.forces, strict=True):
            if contact.rubs:
                left -= _on_bodies(of, contact, forces, geometry, placed, repeated)
        return np.asarray(left / (of.scale[repeated][:, None] * _column_units(of.m)))

    @cached_property
    def _slopes(self) -> list[tuple[int, int, ContactForces]]:
        """Derivatives of what every contact does by each of its unknowns, with the contact and the row."""
        found = []
        for k, contact in enumerate(self.of.contacts):
            for row in contact.rows.tolist():
                step = np.zeros_like(self.y)
                step[:, row] = STEP
                after, before = (self._forces(k, self.y + sign * step) for sign in (1.0, -1.0))
                found.append((k, row, _difference(after, before, 2.0 * STEP)))
        return found

    @cached_property
    def _by_unknown(self) -> tuple[Floats, Floats]:
        """Derivatives of multipliers and offsets by all unknowns."""
        of, (count, n) = self.of, self.y.shape
        multiplier = np.eye(n) * _row_units(of)[:, None]
        offset = np.zeros((count, self.u.shape[1], n))
        for k, row, slope in self._slopes:
            contact = of.contacts[k]
            multiplier[:, contact.rows, row] = slope.multiplier
            if len(contact.parameters):
                offset[:, contact.parameters, row] = slope.offset
        return multiplier, offset

    @cached_property
    def derivative(self) -> Floats:
        """Derivatives of what is left by all unknowns."""
        multiplier, offset = self._by_unknown
        forces = np.swapaxes(self.geometry["jacobian"], 1, 2) @ multiplier
        for k, row, slope in self._slopes:
            forces[:, :, row] -= self._rubbing(k, slope)
        return np.asarray(forces / self._units[..., None] + self._stiffness @ offset)

    def by_motions(self, changes: Sequence[tuple[int, Floats]]) -> tuple[Floats, Floats]:
        """Derivatives of offsets and multipliers by changes of motions, in equilibrium.

        Parameters
        ----------
        changes : sequence
            Index of a contact and the change of its motion, each.
        """
        of, (count, n) = self.of, self.y.shape
        left, multiplier = np.zeros((2, count, n, len(changes)))
        offset = np.zeros((count, self.u.shape[1], len(changes)))
        for d, (k, change) in enumerate(changes):
            contact = of.contacts[k]
            after, before = (self._forces(k, self.y, of.motions[k] + sign * STEP * change) for sign in (1.0, -1.0))
            slope = _difference(after, before, 2.0 * STEP)
            multiplier[:, contact.rows, d] = slope.multiplier
            left[:, :, d] = -self._rubbing(k, slope)
            if len(contact.parameters):
                offset[:, contact.parameters, d] = slope.offset
        left += np.swapaxes(self.geometry["jacobian"], 1, 2) @ multiplier
        moved = _solved(self.derivative, -(left / self._units[..., None] + self._stiffness @ offset))
        by_multiplier, by_offset = self._by_unknown
        return np.asarray(offset + by_offset @ moved), np.asarray(multiplier + by_multiplier @ moved)

    @property
    def _units(self) -> Floats:
        """Units of what is left."""
        return np.asarray(self.of.scale[:, None] * _column_units(self.of.m))

    def _rubbing(self, k: int, slope: ContactForces) -> Floats | float:
        """What friction of a contact does to all bodies."""
        of, contact = self.of, self.of.contacts[k]
        if not contact.rubs:
            return 0.0
        return _on_bodies(of, contact, slope, self.geometry, self.poses, np.arange(len(self.y)))

    @cached_property
    def _stiffness(self) -> Floats:
        """Derivatives of what is left by all offsets, through the motions that they make."""
        of, m = self.of, self.of.m
        count, n = self.y.shape
        found = np.zeros((count, n, of.built.shape[1]))
        moving = [(p, r) for c in of.contacts for p, r in zip(c.parameters, c.rows, strict=False)]
        if not moving:
            return found
        right = np.zeros((n, len(moving)))
        for k, (_, row) in enumerate(moving):
            right[row, k] = 1.0
        motions = np.swapaxes(_solved(self.geometry["jacobian"], np.broadcast_to(right, (count, n, len(moving)))), 1, 2)
        sizes = np.abs(motions / _twist_units(m)).max(axis=2, keepdims=True)
        steps = MOVE / np.where(sizes > 0.0, sizes, 1.0)
        ends = []
        for sign in (1.0, -1.0):
            twists = (sign * steps * motions).reshape(count * len(moving), len(m.bodies), -1)
            each = np.repeat(np.arange(count), len(moving))
            placed = poses.moved(self.poses[each], twists, m.core.origins)
            there = m.core.balance(of.drives[each], placed, self.u[each], of.wrenches[each])
            ends.append(self._residual(there, placed).reshape(count, len(moving), n))
        slopes = (ends[0] - ends[1]) / (2.0 * steps)
        for k, (parameter, _) in enumerate(moving):
            found[:, :, parameter] += slopes[:, k]
        return found


def _solved(matrices: Floats, right: Floats) -> Floats:
    """Solutions, nan of a singular matrix: a search may have tried a state there."""
    found = np.full(right.shape, np.nan)
    regular = np.linalg.slogdet(matrices)[0] != 0.0
    found[regular] = np.linalg.solve(matrices[regular], right[regular])
    return found


def _difference(after: ContactForces, before: ContactForces, by: float) -> ContactForces:
    names = ("offset", "multiplier", "force", "second", "first")
    return ContactForces(*((getattr(after, x) - getattr(before, x)) / by for x in names))


def _on_bodies(
    of: SlidingTask,
    contact: JointContact,
    forces: ContactForces,
    geometry: EquilibriumTerms,
    placed: Floats,
    each: NDArray[np.intp],
) -> Floats:
    """What friction does along the twists of all bodies."""
    m = of.m
    first, second = (m.points[p].body for p in m.joint_points[contact.joint])
    levers = geometry["levers"][:, contact.joint]
    axes = geometry["axes"][:, contact.joint]

    def turned(vector: Floats) -> Floats:
        if contact.in_ground_axes:
            return vector[each]
        return np.asarray(np.einsum("nk,nki->ni", vector[each], axes))

    force = turned(forces.force)
    found = np.zeros((len(placed), len(m.bodies), 6))
    where = origin(m, placed, second) + levers[:, 1]
    for body, sign, moment in ((second, 1.0, forces.second), (first, -1.0, forces.first)):
        if body >= 0:
            found[:, body, :3] += sign * force
            found[:, body, 3:] += turned(moment) + np.cross(where - origin(m, placed, body), sign * force)
    return components(m, found).reshape(len(placed), -1)


def _row_units(of: SlidingTask) -> Floats:
    """Units of the multipliers of all rows, shape (configuration, row)."""
    turns = np.array([of.m.length if c in TURNS else 1.0 for _, c in of.m.core.rows])
    return np.asarray(of.scale[:, None] * turns)


def _twist_units(m: Mechanism) -> Floats:
    """Units of the motions of all bodies."""
    own = [m.length, m.length, 1.0] if m.pose_size == 3 else [m.length] * 3 + [1.0] * 3
    return np.tile(own, len(m.bodies))


def _column_units(m: Mechanism) -> Floats:
    """Units of the forces along these, in forces."""
    return np.asarray(m.length / _twist_units(m))


def equilibrium(of: SlidingTask) -> Equilibrium:
    """Equilibrium with friction from that without."""
    offset, multipliers = of.offset, of.multipliers
    count = len(offset)
    y, held, kept = multipliers / _row_units(of), np.zeros(multipliers.shape, bool), np.zeros(multipliers.shape)
    for contact in of.contacts:
        normal = multipliers[:, contact.rows] @ np.linalg.inv(contact.transform) / of.scale[:, None]
        v = np.zeros(normal.shape)
        if len(contact.parameters):
            v = (offset - of.built)[:, contact.parameters] @ contact.transform.T
        for begin, end, low, high in (*contact.parts, *contact.turn):
            quiet = np.linalg.norm(normal[:, begin:end], axis=1) <= NONE
            held[:, contact.rows[begin:end]] = (quiet & (high > low))[:, None]
        own = held[:, contact.rows]
        kept[:, contact.rows] = v
        y[:, contact.rows] = np.where(own, normal, normal + v / of.unit)
    found = Equilibrium(y, held, kept, np.zeros(count), np.zeros(count), np.zeros(count, np.int64))
    _grow(of, found)
    every = [(contact, part) for contact in of.contacts for part in (*contact.parts, *contact.turn)]
    for _ in range(RELEASES):
        if not _release(of, found, every).any():
            break
    # What cannot be let go together may be let go one after the other; the rest stays where nothing pressed it.
    for one in every:
        _release(of, found, [one])
    return found


def _release(of: SlidingTask, found: Equilibrium, some: list[tuple[JointContact, ContactPart]]) -> NDArray[np.bool_]:
    """Let go of contacts that were held and that friction presses; gives where that has led to equilibrium."""
    again = np.zeros(len(found.y), bool)
    before = found.y.copy(), found.held.copy()
    for contact, (begin, end, low, high) in some:
        rows = contact.rows[begin:end]
        size = np.linalg.norm(found.y[:, rows], axis=1)
        pressed = found.held[:, rows].all(axis=1) & (size > NONE) & (found.part == 1.0)
        found.held[np.ix_(pressed, rows)] = False
        normal = found.y[np.ix_(pressed, rows)]
        ends = np.where(normal > 0.0, high, low) if end - begin == 1 else high * normal / size[pressed, None]
        found.y[np.ix_(pressed, rows)] = normal + ends / of.unit
        again |= pressed
    places = np.flatnonzero(again)
    if len(places):
        at = solve(of, found, places, np.ones(len(again)))
        failed = places[~at.good]
        found.y[failed], found.held[failed] = (values[failed] for values in before)
        found.forces[places[at.good]] = at.forces[at.good]
        again[failed] = False
    return again


def _grow(of: SlidingTask, found: Equilibrium) -> None:
    """Let the coefficients grow from nothing to their values."""
    count = len(found.y)
    part, step, sign = np.zeros(count), np.full(count, FIRST), np.zeros(count)
    start = solve(of, found, np.arange(count), part)
    sign[:] = start.sign
    found.forces[:] = 1.0
    places = np.flatnonzero(start.good)
    while len(places):
        to = np.minimum(part + step, 1.0)
        before = found.y[places].copy()
        at = solve(of, found, places, to)
        good = at.good & (at.sign == sign[places])
        found.y[places[~good]] = before[~good]
        between = np.flatnonzero(~good & _is_between(step[places]))
        turned = _turned(of, found, places[between], to, sign)
        good[between] = ~np.isnan(turned)
        at.forces[between] = turned
        failed, done = places[~good], places[good]
        part[done] = to[done]
        found.part[done] = to[done]
        found.forces[done] = at.forces[good]
        step[failed] /= 2.0
        step[done] = np.minimum(2.0 * step[done], FIRST)
        places = places[(part[places] < 1.0) & (step[places] > LEAST)]


def _is_between(step: Floats) -> NDArray[np.bool_]:
    """Whether steps have just become smaller than those of `TURNING`."""
    return np.asarray(np.any([(step <= least) & (2.0 * step > least) for least in TURNING], axis=0))


def _turned(of: SlidingTask, found: Equilibrium, places: NDArray[np.intp], to: Floats, sign: Floats) -> Floats:
    """Equilibrium with contacts on their other sides, where forces on them have vanished; the largest force, or nan."""
    tries = [(place, y) for place in places.tolist() for y in _on_other_sides(of, found, place)]
    forces = np.full(len(places), np.nan)
    if not tries:
        return forces
    which = np.array([place for place, _ in tries])
    tried = found.chosen(which)
    tried.y[:] = [y for _, y in tries]
    at = solve(of.chosen(which), tried, np.arange(len(which)), to[which])
    good = at.good & (at.sign == sign[which])
    for n, place in enumerate(places.tolist()):
        first = np.flatnonzero(good & (which == place))[:1]
        if len(first):
            found.y[place], forces[n] = tried.y[first[0]], at.forces[first[0]]
    return forces


def _on_other_sides(of: SlidingTask, found: Equilibrium, place: int) -> list[Floats]:
    """Unknowns with some of the contacts with the least forces on their other sides, fewest first."""
    before, loose = found.y[place], []
    for contact in of.contacts:
        for begin, end, low, high in contact.parts:
            rows = contact.rows[begin:end]
            if high > low and not found.held[place, rows].any():
                middle = (low + high) / 2.0 / of.unit if end - begin == 1 else 0.0
                v = contact.nearest(before[contact.rows], of.unit)[begin:end] - middle
                size = float(np.linalg.norm(v))
                normal = float(np.linalg.norm(before[rows] - middle - v))
                if size > 0.0 and normal <= WEAK:
                    loose.append((normal, rows, middle - v * (1.0 + PRESSED / size)))
    loose = sorted(loose, key=lambda one: one[0])[:LOOSE]
    turned = []
    for count in range(1, len(loose) + 1):
        for some in combinations(loose, count):
            turned.append(before.copy())
            for _, rows, there in some:
                turned[-1][rows] = there
    return turned


@dataclass(frozen=True)
class SlidingState:
    """What came of Newton's method: whether it ended, the sign of the determinant, the largest force."""

    good: NDArray[np.bool_]
    sign: Floats
    forces: Floats


def solve(of: SlidingTask, found: Equilibrium, places: NDArray[np.intp], part: Floats) -> SlidingState:
    """Newton's method at a part of the coefficients, into the unknowns."""
    active = np.arange(len(places))
    good, sign, forces = np.zeros(len(places), bool), np.zeros(len(places)), np.zeros(len(places))
    for _ in range(STEPS):
        if not len(active):
            break
        own = places[active]
        here = of.chosen(own)

        def at(
            y: Floats, some: NDArray[np.intp], here: SlidingTask = here, own: NDArray[np.intp] = own
        ) -> EquilibriumAt:
            chosen = own[some]
            return EquilibriumAt(here.chosen(some), y, found.held[chosen], found.offset[chosen], part[chosen])

        now = at(found.y[own], np.arange(len(own)))
        slope = now.derivative
        sign[active] = np.linalg.slogdet(slope)[0]
        regular = (sign[active] != 0.0) & now.closed
        step = np.zeros_like(now.y)
        step[regular] = np.linalg.solve(slope[regular], -now.residual[regular][..., None])[..., 0]
        forces[active] = np.abs(now.multipliers / _row_units(here)).max(axis=1)
        found.steps[own] += 1
        done = (now.size <= LEFT * np.maximum(forces[active], 1.0)) & now.closed
        best, size = now.y.copy(), now.size.copy()
        trying = np.flatnonzero(~done & regular)
        length = 1.0
        better = np.zeros(len(own), bool)
        for _ in range(HALVINGS):
            if not len(trying):
                break
            there = at(now.y[trying] + length * step[trying], trying)
            less = there.size < size[trying]
            best[trying[less]], size[trying[less]] = there.y[less], there.size[less]
            better[trying[less]] = True
            trying = trying[~less]
            length /= 2.0
        found.y[own] = best
        ends = done | (~better & (size <= ROUNDED * np.maximum(forces[active], 1.0)) & regular)
        good[active[ends]] = True
        active = active[~ends & better]
    return SlidingState(good, sign, forces)
