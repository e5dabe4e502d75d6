"""A planar mechanism that a format has in space, seen along its pins.

All pins are parallel to the normal n of the plane, all guides across it. A point p of the drawing becomes
(e1 . p, e2 . p) with e1 x e2 = n; what lies across the plane is left out.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from jointplay.errors import InputError, listed

from .rotations import across
from .skeleton import GROUND, Attachment, Body, Frame, Joint, Matrix, Skeleton, Vector

#: how far an axis may be off the normal or the plane, rad: files of robots have angles with four digits
TILT = 1e-3
#: what a joint in space is in the plane, where its axis is along the normal
ALONG = {"revolute": "revolute", "cylindrical": "revolute", "spherical": "revolute"}
#: kinds that slide in the plane, and those that hold no body by themselves
GUIDES, COUPLINGS = ("prismatic", "planar"), ("gear", "belt", "rack")
Z = np.array([0.0, 0.0, 1.0])
#: by how much the zero of an angle may be off by rounding, rad
ZERO = 1e-9


def projected(skeleton: Skeleton, driven: Iterable[str]) -> Skeleton:
    """The mechanism in its plane.

    Parameters
    ----------
    driven : iterable of str
        Joints whose coordinates have to be those of the format, as those of joints that follow one another.

    Raises
    ------
    InputError
        When it is not planar; the message names the joint whose axis is out of the plane.
    """
    plane = _plane(skeleton)
    kept, within = [], []
    for drawn in skeleton.joints:
        joint = _seen(drawn, plane)
        if joint.kind == "planar" and _is_along(joint, plane):
            within.append(joint.name)
        else:
            kept.append(_joint(joint, plane))
    exact = {
        *driven,
        *(name for joint in kept if (led := joint.follows or joint.curve) for name in (joint.name, led[0])),
    }
    holding = [joint for joint in kept if joint.kind not in COUPLINGS]
    angles = _angles(skeleton.bodies, sorted(holding, key=lambda joint: joint.name not in exact))
    joints = tuple(_closed(joint, angles) for joint in kept)
    gravity = plane @ np.array(skeleton.gravity)
    notes = [*skeleton.notes, "Seen along the pins: distances across the plane are left out."]
    if within:
        notes.append(f"Joints that hold bodies in the plane are left out: {listed(within)}.")
    pulls = any(body.mass > 0.0 for body in skeleton.bodies.values())
    if pulls and abs(gravity[2]) > TILT * max(1.0, float(np.linalg.norm(gravity))):
        notes.append("Gravity across the plane is left out.")
    moved = [old.name for old, new in zip(kept, joints, strict=True) if abs(new.coordinate - old.coordinate) > ZERO]
    if moved:
        notes.append(f"Angles of these joints count from another zero, because loops are closed: {listed(moved)}.")
    bodies = {name: _body(body, plane, angles.get(name, 0.0)) for name, body in skeleton.bodies.items()}
    if not any(angles.values()):
        # All axes are those of the ground then, and may have its origin, too: every joint has one place.
        bodies = {name: replace(body, frame=Frame()) for name, body in bodies.items()}
    return replace(
        skeleton,
        space="planar",
        bodies=bodies,
        joints=joints,
        frames={name: (body, Frame(_flat(plane, frame.at))) for name, (body, frame) in _every_frame(skeleton)},
        gravity=(float(gravity[0]), float(gravity[1]), 0.0),
        notes=tuple(notes),
    )


def _every_frame(skeleton: Skeleton) -> Iterator[tuple[str, tuple[str, Frame]]]:
    """Frames, and those of the bodies, whose axes change: both can be the output."""
    for name, body in skeleton.bodies.items():
        if name != GROUND:
            yield name, (name, body.frame)
    yield from skeleton.frames.items()


def _plane(skeleton: Skeleton) -> Matrix:
    """Rows e1, e2 and n: coordinate axes where the pins are along one, else e2 as upright as can be."""
    pins = [joint for joint in skeleton.joints if joint.kind in ALONG and joint.place.axis is not None]
    pins.sort(key=lambda joint: joint.kind != "revolute")
    if not pins:
        raise InputError("needs a joint that turns, whose axis is the normal of the plane", key="planar")
    normal = pins[0].place.axis
    assert normal is not None
    if abs(normal[2]) > 1 - TILT**2:
        return np.eye(3)
    up = Z - normal * (Z @ normal) if abs(normal[2]) < 0.9 else across(normal)
    up /= np.linalg.norm(up)
    first = np.cross(up, normal)
    # To the right is where x, or else y, is positive.
    if first[np.argmax(np.abs(first).round(9))] < 0:
        first, normal = -first, -normal
    return np.array([first, up, normal])


def _check(joint: Joint, plane: Matrix, *, along: bool) -> None:
    axis = joint.place.axis
    assert axis is not None
    sine = float(np.linalg.norm(plane[:2] @ axis)) if along else abs(float(plane[2] @ axis))
    if sine > TILT:
        angle = np.degrees(np.arcsin(min(1.0, sine)))
        normal = ", ".join(f"{x:.3g}" for x in plane[2] + 0.0)
        what = "off the normal of the plane" if along else "out of the plane, whose normal is"
        problem = f"its axis is {angle:.3g} degrees {what} [{normal}]; the mechanism is not planar"
        raise InputError(problem, key=f"planar joint '{joint.name}'")


def _seen(joint: Joint, plane: Matrix) -> Joint:
    """The joint, where a sleeve that is seen from its side is a guide."""
    axis = joint.place.axis
    is_across = joint.kind == "cylindrical" and axis is not None and abs(float(plane[2] @ axis)) <= TILT
    return replace(joint, kind="prismatic") if is_across else joint


def _is_along(joint: Joint, plane: Matrix) -> bool:
    """Whether its axis is the normal of the plane; else it has to be in the plane."""
    assert joint.place.axis is not None
    if float(np.linalg.norm(plane[:2] @ joint.place.axis)) <= TILT:
        return True
    _check(joint, plane, along=False)
    return False


def _flat(plane: Matrix, point: Vector) -> Vector:
    flat = plane @ point
    return np.array([flat[0], flat[1], 0.0])


def _joint(joint: Joint, plane: Matrix) -> Joint:
    if joint.kind not in (*ALONG, *COUPLINGS, *GUIDES):
        raise InputError(f"is a {joint.kind} joint, which the plane does not have", key=f"planar joint '{joint.name}'")
    if joint.kind == "prismatic" and _is_along(joint, plane):
        # It moves what is not seen.
        return replace(joint, kind="fixed", place=Attachment(_flat(plane, joint.place.at)), second=None)
    if joint.kind in GUIDES:
        _check(joint, plane, along=False)
    elif joint.place.axis is not None:
        _check(joint, plane, along=True)

    def place(old: Attachment) -> Attachment:
        if joint.kind not in GUIDES:
            return Attachment(_flat(plane, old.at), Z)
        assert old.axis is not None
        direction = _flat(plane, old.axis)
        if joint.kind == "planar":
            # A plate that is seen from its edge slides along it.
            direction = np.cross(Z, direction)
        return Attachment(_flat(plane, old.at), direction / np.linalg.norm(direction))

    kind = ALONG.get(joint.kind, "prismatic" if joint.kind in GUIDES else joint.kind)
    flat = replace(joint, kind=kind, place=place(joint.place), second=joint.second and place(joint.second))
    if joint.kind in ("cylindrical", "spherical"):
        # What it counts is not an angle.
        flat = replace(flat, coordinate=0.0, limits=None)
    if joint.side is not None:
        along = _flat(plane, joint.side)
        assert flat.second is not None
        return replace(
            flat,
            place=replace(flat.place, axis=along / np.linalg.norm(along)),
            second=replace(flat.second, axis=None),
            side=None,
        )
    if joint.kind not in ALONG or joint.place.axis is None or plane[2] @ joint.place.axis > 0:
        return flat
    # Its angle counts clockwise: counter-clockwise it is that of the first body against the second.
    first, second = flat.bodies
    return replace(flat, bodies=(second, first), place=flat.second or flat.place, second=flat.second and flat.place)


def _angles(bodies: Iterable[str], joints: Iterable[Joint]) -> dict[str, float]:
    """Angles of the bodies' axes in the drawing, so that the coordinates of joints are those of the format.

    Of the joints of a loop the last one has the coordinate that is left.
    """
    groups = {name: {name: 0.0} for name in bodies}
    for joint in joints:
        first, second = joint.bodies
        one, other = groups[first], groups[second]
        if one is other:
            continue
        # The drawing shows the second body turned by the coordinate, so that its axes are turned back.
        turn = one[first] + (joint.coordinate if joint.kind == "revolute" else 0.0) - other[second]
        one |= {body: angle + turn for body, angle in other.items()}
        groups |= dict.fromkeys(other, one)
    own = groups[GROUND]
    return {body: angle - own[GROUND] for body, angle in own.items()}


def _closed(joint: Joint, angles: dict[str, float]) -> Joint:
    """The joint with the coordinate that it has between the axes of its bodies."""
    if joint.kind != "revolute":
        return joint
    first, second = (angles.get(name, 0.0) for name in joint.bodies)
    return replace(joint.shifted(second - first - joint.coordinate), coordinate=second - first)


def _body(body: Body, plane: Matrix, angle: float) -> Body:
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    seen = body.within(Frame(axes=plane))
    about = np.diag([0.0, 0.0, seen.inertia[2, 2]])
    return replace(seen, frame=Frame(_flat(plane, body.frame.at), axes), centre=seen.centre * [1, 1, 0], inertia=about)
