"""Joints with clearance and friction: offsets and friction by one vector of unknowns for each contact.

A contact is where something round, or a face, lies within its clearance c. Its unknown y, a force and an offset in one,
gives the normal force N and the offset v without friction, whether it touches or not:

    v = P(y),    N = F (y - v / c0)        P: the nearest point of the set, F, c0: units of force and of offsets

With friction, Coulomb's coefficient mu, phi = atan mu, s = -1, 0 or 1 the direction of the motion, and the hole or
socket, of radius r, on the second body:

    pin in a hole         the line of force touches the circle of radius r sin phi: offset Rot(s phi) v, and the moment
                          -s r sin phi |N| on the second body about the hole's centre
    pin in space          the same at each of its ends; at its shoulders -s mu r_m |N|
    ball in a socket      w: relative angular velocity; N = |N| (cos phi u - sin phi (w x u) / |w x u|) with the offset
                          along u, and the moment -r sin phi |N| e with e along w - u (u . w)
    slider in a guide     contacts at both ends, in space on two pairs of faces; force -s mu sum |N| along the axis, and
                          the moments that it has since it acts at the faces
    block in a slot       force -s mu |N| along the slot
    couplings             see `couplings`

A force or moment of its own acts against the motion as well. In the plane, and of balls, forces act on each body at its
own centre, so that the moment on the first body has the radius of the pin or ball.

A slider in space, of half sizes w and h across, does not roll in its guide while the moment M about its axis is smaller
than m = h sum |N_side| + w sum |N_normal|, by which its faces bear it along their edges; friction acts there by the
part M / m of half an edge from the middle, as if all were pressed alike. Beyond that it rolls onto the ends of these
edges, and what is left of M presses (|M| - m) / max(w, h) more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.sets import BOUNDS, SETS, SINGLE, TILTS, OffsetSet
from jointplay.errors import InputError
from jointplay.file.schema import Coupling, JointTable
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism

from .couplings import NEGATIVE, OWN, POSITIVE, loss

#: that of couplings
FLANK = "flank"
#: a ball that bores is taken to slide by this part of its turning
BORES = 1e-6


#: of every contact the first unknown and the one behind its last, lowest and highest offset
ContactPart = tuple[int, int, float, float]
ContactParts = tuple[ContactPart, ...]
#: numbers of a pose in the plane
PLANAR = 3


@dataclass(frozen=True)
class ContactForces:
    """What joints do in some configurations."""

    #: along the rows of the contact, shape (configuration, row)
    offset: Floats
    #: of these rows, by which the loads push
    multiplier: Floats
    #: of friction, on the second body at its point, shape (configuration, 3); the opposite acts on the first body at
    #: the same place. In the joint's axes on the first body, as the moments are; of `in_ground_axes` in these.
    force: Floats
    #: `second`, `first`: moments of friction on both bodies about that point
    second: Floats
    first: Floats


@dataclass(frozen=True)
class JointContact:
    """A joint whose offset is decided, or that rubs."""

    joint: int
    #: what its set `rubs` as, or `FLANK`; empty where nothing rubs
    kind: str
    #: rows of the closure
    rows: NDArray[np.intp]
    #: parameters that displace them; empty where nothing does
    parameters: NDArray[np.intp]
    #: offsets of the contacts over those of the rows
    transform: Floats
    #: of every contact the first unknown and the one behind its last, and lowest and highest offset: the highest is the
    #: radius of a round one
    parts: ContactParts
    #: of a coupling with an efficiency the part of the power that it loses at most
    coefficient: float = 0.0
    #: force or moment of its own, SI
    own: float = 0.0
    #: of the hole, SI
    radius: float = 0.0
    #: `height`, `width`: from face to face, SI
    height: float = 0.0
    width: float = 0.0
    #: lever of friction at the shoulders
    collar: float = 0.0
    #: of the offsets; -1 where there is none
    source: int = -1
    #: of a slider in space half of its height and of its width, which bear a moment about its axis
    half: tuple[float, float] = (0.0, 0.0)
    #: unit of its roll, a length
    roll: float = 1.0

    @property
    def turn(self) -> ContactParts:
        """The roll of a slider in space, as another part; its faces decide how far it goes."""
        gap = self.parts[0][3]
        if not any(self.half) or gap == 0.0:
            return ()
        most = gap * self.roll / max(self.half)
        return ((4, 5, -most, most),)

    @property
    def rubs(self) -> bool:
        """Whether friction holds it back."""
        return self.coefficient > 0.0 or self.own > 0.0

    def nearest(self, y: Floats, unit: Floats | float) -> Floats:
        """Offsets without friction, in a unit."""
        v = np.zeros_like(y)
        for begin, end, low, high in self.parts:
            own = y[..., begin:end]
            if end - begin == 1:
                v[..., begin:end] = np.clip(own, low / unit, high / unit)
                continue
            size = np.linalg.norm(own, axis=-1, keepdims=True)
            most = high / unit
            v[..., begin:end] = own * np.where(size > most, most / np.where(size > 0.0, size, 1.0), 1.0)
        if self.turn:
            return self._rolled(y, self.parts[0][3] / unit)
        return v

    def _rolled(self, y: Floats, gap: Floats | float) -> Floats:
        """The nearest offsets of a slider that may roll: each pair of faces has the gap less what the roll t takes.

        With slopes a of what it takes, t is where sum a (|y| - gap + a t)+ = |y_roll| - t; the left side is convex, so
        that Newton's method comes down to it, piece by piece.
        """
        slopes = np.repeat(np.array(self.half) / self.roll, 2)
        faces, turn = np.abs(y[..., :4]), np.abs(y[..., 4])
        t = np.zeros(turn.shape)
        for _ in range(len(slopes) + 2):
            beyond = np.maximum(faces - gap + slopes * t[..., None], 0.0)
            left = (beyond * slopes).sum(axis=-1) + t - turn
            bends = ((beyond > 0.0) * slopes**2).sum(axis=-1) + 1.0
            t = np.clip(t - left / bends, 0.0, gap / slopes.max())
        edge = gap - slopes * t[..., None]
        return np.concatenate([np.clip(y[..., :4], -edge, edge), (np.sign(y[..., 4]) * t)[..., None]], axis=-1)

    @property
    def in_ground_axes(self) -> bool:
        """Whether its friction is given in ground axes."""
        return self.kind in ("ball", FLANK)

    def at(
        self, y: Floats, motion: Floats, part: Floats, unit: float, scale: Floats, held: HeldOffsets
    ) -> ContactForces:
        """What it does.

        Parameters
        ----------
        y : ndarray
            Its unknowns, shape (configuration, unknown).
        motion : ndarray
            Direction of its motion, shape (configuration,); of a ball that of its relative angular velocity,
            (configuration, 3); of a coupling what `couplings` has for it, (configuration, 3, 6). A smaller number is
            the part of friction that acts.
        part : ndarray
            Part of the coefficient and of its own force that counts.
        unit : float
            Of offsets.
        scale : ndarray
            Of forces, shape (configuration,).
        held : HeldOffsets
            Unknowns whose offset stays.
        """
        v = np.where(held.which, held.offset / unit, self.nearest(y, unit))
        normal = scale[:, None] * np.where(held.which, y, y - v)
        v = v * unit
        force, second, first = (np.zeros((len(y), 3)) for _ in range(3))
        inverse = np.linalg.inv(self.transform)
        if not self.rubs:
            return ContactForces(v @ inverse.T, normal @ self.transform, force, second, first)
        mu, own = part * self.coefficient, part * self.own
        sine = mu / np.sqrt(1.0 + mu * mu)
        if self.kind == FLANK:
            pressed = normal[:, :1]
            rubs = mu[:, None] * np.abs(pressed) * np.where(pressed > 0.0, motion[:, POSITIVE], motion[:, NEGATIVE])
            force, second = np.split(rubs + own[:, None] * motion[:, OWN], 2, axis=1)
            return ContactForces(v @ inverse.T, normal @ self.transform, force, second, -second)
        if self.kind == "ball":
            sine = sine * np.linalg.norm(motion, axis=1)
            v, about = _on_ball(y, np.linalg.norm(v, axis=1), motion, sine)
            size = np.linalg.norm(normal, axis=1)
            against = own[:, None] * motion
            second = -(self.radius * sine * size)[:, None] * about - against
            first = ((self.radius - self.parts[0][3]) * sine * size)[:, None] * about + against
            return ContactForces(v @ inverse.T, normal @ self.transform, force, second, first)
        mu, own, sine = mu * motion, own * motion, sine * motion
        # Of a coefficient beyond all measure the sine rounds to more than one.
        cosine = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
        if self.kind in ("pin", "journal"):
            moment = own.copy()
            for begin, end, _, _ in self.parts:
                if end - begin == 1:
                    moment += mu * self.collar * np.abs(normal[:, begin])
                    continue
                x, z = v[:, begin].copy(), v[:, begin + 1].copy()
                v[:, begin], v[:, begin + 1] = cosine * x - sine * z, sine * x + cosine * z
                moment += self.radius * sine * np.linalg.norm(normal[:, begin:end], axis=1)
            axis = 2 if self.kind == "pin" else 0
            second[:, axis] = -moment
            first[:, axis] = moment
            if self.kind == "pin":
                first[:, axis] -= self.parts[0][3] * sine * np.linalg.norm(normal, axis=1)
        elif self.kind == "rail":
            side, upright = normal[:, :2].sum(axis=1), normal[:, 2:4].sum(axis=1)
            both = [np.abs(normal[:, faces]).sum(axis=1) for faces in (slice(0, 2), slice(2, 4))]
            turning, borne = normal[:, 4] * self.roll, self.half[0] * both[0] + self.half[1] * both[1]
            along = np.clip(turning / np.where(borne > 0.0, borne, 1.0), -1.0, 1.0)
            more = np.maximum(np.abs(turning) - borne, 0.0) / (max(self.half) or 1.0)
            force[:, 0] = -(mu * (both[0] + both[1] + more) + own)
            second[:, 1] = -mu * self.height / 2.0 * (upright - along * side)
            second[:, 2] = mu * self.width / 2.0 * (side + along * upright)
            first = -second
        else:
            force[:, 0] = -(mu * np.abs(normal).sum(axis=1) + own)
            second[:, 2] = mu * self.height / 2.0 * normal.sum(axis=1)
            first = -second
        return ContactForces(v @ inverse.T, normal @ self.transform, force, second, first)


def _on_ball(y: Floats, offset: Floats, w: Floats, sine: Floats) -> tuple[Floats, Floats]:
    """Offset of a ball whose force is along y, of a given size, and the direction of the friction moment.

    With n the direction of the force, u . w = n . w / cos phi, and across w u is turned from n by atan(tan phi / b), b
    the part of u across w.
    """
    cosine = np.sqrt(1.0 - sine * sine)
    size, speed = (np.linalg.norm(x, axis=1, keepdims=True) for x in (y, w))
    n = y / np.where(size > 0.0, size, 1.0)
    w = w / np.where(speed > 0.0, speed, 1.0)
    along = np.sum(n * w, axis=1)
    a = np.clip(along / cosine, -1.0 + BORES, 1.0 - BORES)
    b = np.sqrt(1.0 - a * a)
    across = n - along[:, None] * w
    far = np.linalg.norm(across, axis=1, keepdims=True)
    p = across / np.where(far > 0.0, far, 1.0)
    turn = np.arctan2(sine, cosine * b)[:, None]
    p = np.cos(turn) * p + np.sin(turn) * np.cross(w, p)
    u = a[:, None] * w + b[:, None] * p
    about = (w - a[:, None] * u) / b[:, None]
    still = speed == 0.0
    return offset[:, None] * np.where(still, n, u), np.where(still, 0.0, about)


@dataclass(frozen=True)
class HeldOffsets:
    """Unknowns of a contact whose offset stays: nothing presses them."""

    #: shape (configuration, unknown)
    which: NDArray[np.bool_]
    offset: Floats


def contacts(m: Mechanism, u: Floats) -> list[JointContact]:
    """The contacts of all joints.

    Parameters
    ----------
    u : ndarray
        Values of all parameters, of which those of sizes count.

    Raises
    ------
    InputError
        When it has something whose friction is not computed.
    """
    from_rows = list(m.core.rows)
    found: list[JointContact] = []
    played: dict[int, int] = {}
    for k, source in enumerate(m.compiled_sources):
        if source.kind == "clearance":
            played[source.spec["joint"]] = k
        elif source.kind == "backlash":
            found.append(_lost_motion(m, k, from_rows))
    for joint, name in enumerate(m.joints):
        entry = m.data.joints.get(name) or m.data.joints.get(name.rsplit("/", 1)[0])
        coupling = entry if isinstance(entry, Coupling) and entry.loses else None
        if joint in played or coupling is not None or (entry is not None and entry.rubs is not None):
            found.append(_contact(m, joint, entry, coupling, played.get(joint, -1), u, from_rows))
    return found


def _touching(kind: OffsetSet, size: Mapping[str, float], roll: float) -> tuple[Floats, ContactParts]:
    """Offsets of the contacts over those of a set, and the contacts: both ends of what is flat, and last its roll."""
    names = np.array(kind.components)
    rows: list[Floats] = []
    parts: list[ContactPart] = []
    for one in kind.conditions(size):
        if len(one.rows) > 1:
            parts.append((len(rows), len(rows) + len(one.rows), one.low, one.high))
            rows += [*one.rows]
            continue
        end = np.where(names == "roll", 0.0, one.rows[0])
        for other in (end, np.where(np.isin(names, ("angle", *TILTS)), -end, end))[: 1 + one.is_flat]:
            parts.append((len(rows), len(rows) + 1, one.low, one.high))
            rows.append(other)
    rows += [roll * (names == name) for name in names if name == "roll"]
    return np.array(rows, dtype=float), tuple(parts)


def _lost_motion(m: Mechanism, source: int, rows: list[tuple[int, str]]) -> JointContact:
    own = m.compiled_sources[source]
    joint, sides = own.spec["joint"], own.size
    component = "angle" if m.coordinate_kind(joint) == "angle" else "along"
    parameter = int(np.flatnonzero(m.parameter_source == source)[0])
    unit = 1.0 if component == "along" else m.length
    return JointContact(
        joint,
        "",
        np.array([rows.index((joint, component))]),
        np.array([parameter]),
        np.array([[unit]]),
        ((0, 1, sides["low"] * unit, sides["high"] * unit),),
        source=source,
    )


def _contact(
    m: Mechanism,
    joint: int,
    entry: JointTable | None,
    coupling: Coupling | None,
    source: int,
    u: Floats,
    from_rows: list[tuple[int, str]],
) -> JointContact:
    units, friction = m.units, entry.rubs if entry is not None else None
    place = (m.joint_kinds[joint], m.pose_size == PLANAR)
    usual = next((one for one in SETS.values() if (one.joint, one.is_planar) == place), None)
    within, size = usual or SINGLE, dict[str, float]()
    names = within.components if coupling is None else ()
    if source >= 0:
        shape, size = clearance_of(m, source, u)
        within, names = SETS[shape], m.compiled_sources[source].components
    # Of a coupling without play its own row, which is its first.
    rows = [from_rows.index((joint, name)) for name in names] or [[of for of, _ in from_rows].index(joint)]
    sizes: dict[str, float] = {}
    if friction is not None:
        for key in ("diameter", "length", "width", "height"):
            value = friction.size(getattr(entry, "clearance", None), key)
            sizes[key] = 0.0 if value is None else value * units.length
    # A joint with nothing but a force of its own has no size: where it is held does not matter.
    half = size.get("half_length", sizes.get("length", 0.0) / 2.0) or m.length
    halves = {f"half_{key}": sizes.get(key, 0.0) / 2.0 for key in ("height", "width")}
    size = {**dict.fromkeys(BOUNDS, 0.0), **halves, **size, "half_length": half}
    transform, parts = _touching(within, size, m.length)
    if len(transform) != len(within.components):
        # What tilts in two directions between the same faces has more corners than offsets.
        problem = f"friction is not computed in mechanisms with the clearance of a {m.joint_kinds[joint]} joint"
        raise InputError(problem, file=m.file, key=f"joints.{m.joints[joint]}.clearance")
    own = 0.0
    if friction is not None and friction.own:
        given = getattr(friction, friction.own)
        own = (given or 0.0) * (units.moment if friction.own == "torque" else units.force)
    return JointContact(
        joint,
        FLANK if coupling is not None else usual.rubs if usual is not None else "",
        np.array(rows),
        np.flatnonzero(m.parameter_source == source),
        transform,
        parts,
        coefficient=loss(coupling) if coupling is not None else friction.coefficient if friction is not None else 0.0,
        own=own,
        radius=sizes.get("diameter", 0.0) / 2.0,
        height=sizes.get("height", 0.0),
        width=sizes.get("width", 0.0),
        collar=getattr(friction, "collar_radius", 0.0) * units.length,
        source=source,
        half=(size["half_height"], size["half_width"]) if "roll" in within.components else (0.0, 0.0),
        roll=m.length,
    )
