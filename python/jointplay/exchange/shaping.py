"""From the links of a foreign file to bodies: legal names, one body for what is fixed together, the ground."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial

from jointplay.errors import REVERSING, InputError, listed, not_known

from .pins import OUTPUT
from .skeleton import GROUND, Body, Facets, Frame, Joint, Skeleton

#: what a name of the mechanism file cannot have
FORBIDDEN = re.compile(rf"""[\s\x00-\x1f\x7f{REVERSING}./*"'=\[\]]+""")
LONGEST = 100
#: larger limits of a coordinate (rad, m) are none: formats write 1e16 for a joint that turns without end
LARGEST_LIMIT = 1e4
#: kinds that cannot follow another joint, nor be followed
NO_COORDINATE = ("planar", "spherical")


def legal(name: str) -> str:
    """A name of a foreign format as the mechanism file can have it.

    Examples
    --------
    >>> legal("left arm/joint.1")
    'left_arm_joint_1'
    """
    return FORBIDDEN.sub("_", name.strip())[:LONGEST] or "_"


def renamed(skeleton: Skeleton) -> Skeleton:
    """With legal names, each of them once. The fixed body is called ground, and no other one; output is no joint."""
    bodies = _names(skeleton.bodies, {skeleton.ground: GROUND}, taken={GROUND})
    joints = _names((joint.name for joint in skeleton.joints), {}, taken={OUTPUT})
    frames = _names((name for name in skeleton.frames if name not in bodies), {}, taken=set(bodies.values()))

    def joint(old: Joint) -> Joint:
        follows = old.follows
        if follows is not None:
            if follows[0] not in joints:
                raise InputError(not_known(follows[0], "a joint", joints), key=f"joint '{old.name}' <mimic>")
            follows = (joints[follows[0]], *follows[1:])
        curve = old.curve and (joints[old.curve[0]], old.curve[1])
        first, second = old.bodies
        return replace(old, name=joints[old.name], bodies=(bodies[first], bodies[second]), follows=follows, curve=curve)

    named = {frames[name]: (bodies[body], frame) for name, (body, frame) in skeleton.frames.items() if name in frames}
    if skeleton.ground != GROUND and legal(skeleton.ground) not in bodies.values():
        # What the file calls its fixed link can still be asked for.
        named[legal(skeleton.ground)] = (GROUND, skeleton.bodies[skeleton.ground].frame)
    links = {old: new for old, new in {**bodies, **frames}.items() if new not in (legal(old), GROUND)}
    others = {old: new for old, new in joints.items() if new != legal(old)}
    said = [f"'{old}' is {new}" for old, new in (*links.items(), *others.items())]
    return replace(
        skeleton,
        # The ground has the axes of the drawing.
        bodies={
            bodies[name]: replace(body, frame=Frame()) if name == skeleton.ground else body
            for name, body in skeleton.bodies.items()
        },
        joints=tuple(joint(old) for old in skeleton.joints),
        ground=GROUND,
        frames=named,
        forces=tuple(force.on(bodies[force.body]) for force in skeleton.forces),
        other_links=links,
        other_joints=others,
        notes=(*skeleton.notes, *([f"Another one has the name already: {listed(said)}."] if said else ())),
    )


def link_called(skeleton: Skeleton, name: str) -> str:
    """Name of a link or frame by what the format calls it."""
    return skeleton.other_links.get(name, legal(name))


def joint_called(skeleton: Skeleton, name: str) -> str:
    """Name of a joint by what the format calls it."""
    return skeleton.other_joints.get(name, legal(name))


def _names(names: Iterable[str], fixed: Mapping[str, str], taken: set[str]) -> dict[str, str]:
    found = dict(fixed)
    for name in names:
        if name in found:
            continue
        wanted = legal(name)
        number, free = 1, wanted
        while free in taken:
            number += 1
            free = f"{wanted[: LONGEST - 6]}_{number}"
        taken.add(free)
        found[name] = free
    return found


def bounded(skeleton: Skeleton) -> Skeleton:
    """With limits that the mechanism file can have: two finite ones, the lower one first. The others are named."""
    no_range, one_sided, made = [], [], []
    for joint in skeleton.joints:
        if joint.limits is None:
            made.append(joint)
            continue
        low, high = joint.limits
        ends = sum(abs(end) < LARGEST_LIMIT for end in joint.limits)
        if low >= high:
            no_range.append(joint.name)
        elif ends == 1:
            one_sided.append(joint.name)
        made.append(joint if low < high and ends == 2 else replace(joint, limits=None))
    notes = list(skeleton.notes)
    if no_range:
        notes.append(f"Limits that leave no range are left out: {listed(no_range)}.")
    if one_sided:
        notes.append(f"Limits on one side only are left out: {listed(one_sided)}.")
    return replace(skeleton, joints=tuple(made), notes=tuple(notes))


def grounded(skeleton: Skeleton, name: str) -> Skeleton:
    """With another link as the fixed one; the drawing has its axes then.

    Raises
    ------
    InputError
        When there is no such link.
    """
    known = {body: (body, old.frame) for body, old in skeleton.bodies.items()} | dict(skeleton.frames)
    if name not in known:
        raise InputError(not_known(name, "a link", known), key="ground")
    body, frame = known[name]
    back = frame.inverse()

    def joint(old: Joint) -> Joint:
        side = None if old.side is None else np.asarray(back.axes @ old.side)
        return replace(old, place=old.place.within(back), second=old.second and old.second.within(back), side=side)

    gx, gy, gz = back.axes @ np.array(skeleton.gravity)
    return replace(
        skeleton,
        bodies={name: body.within(back) for name, body in skeleton.bodies.items()},
        joints=tuple(joint(old) for old in skeleton.joints),
        ground=body,
        frames={name: (body, back @ frame) for name, (body, frame) in skeleton.frames.items()},
        gravity=(float(gx), float(gy), float(gz)),
        forces=tuple(
            replace(force, at=back.point(force.at), force=back.axes @ force.force) for force in skeleton.forces
        ),
    )


def merged(skeleton: Skeleton) -> Skeleton:
    """With one body for links that fixed joints hold together; what the others are called stays as frames.

    The body has the name and the axes of the link that is nearest to the root, or is the ground.
    """
    body_of = {name: name for name in skeleton.bodies}

    def found(name: str) -> str:
        while body_of[name] != name:
            name = body_of[name]
        return name

    for joint in skeleton.joints:
        if joint.kind == "fixed":
            first, second = (found(name) for name in joint.bodies)
            if second == skeleton.ground:
                first, second = second, first
            body_of[second] = first
    groups: dict[str, list[str]] = {}
    for name in skeleton.bodies:
        groups.setdefault(found(name), []).append(name)
    frames = dict(skeleton.frames)
    frames |= {name: (body, skeleton.bodies[name].frame) for body, g in groups.items() for name in g if name != body}
    inside, kept = [], []
    for joint in skeleton.joints:
        first, second = (found(name) for name in joint.bodies)
        if joint.kind == "fixed":
            continue
        if first == second:
            inside.append(joint.name)
        else:
            kept.append(replace(joint, bodies=(first, second)))
    notes = skeleton.notes
    if inside:
        notes = (*notes, f"Joints between links that are fixed to each other are left out: {listed(inside)}.")
    return replace(
        skeleton,
        bodies={body: _one([skeleton.bodies[name] for name in (body, *group)]) for body, group in groups.items()},
        joints=tuple(kept),
        frames={name: (found(body), frame) for name, (body, frame) in frames.items()},
        forces=tuple(force.on(found(force.body)) for force in skeleton.forces),
        notes=notes,
    )


def _one(bodies: list[Body]) -> Body:
    """The first of them, which comes again in its place, with the mass and the surface of all."""
    return replace(bodies[0].with_masses_of(bodies[1:]), facets=Facets.joined(body.facets for body in bodies[1:]))


def leading(skeleton: Skeleton) -> Skeleton:
    """With joints that follow others by a factor alone, and no joint that follows a follower.

    An offset is taken into the zero of the coordinate, which is free.
    """
    joints = {joint.name: joint for joint in skeleton.joints}
    gone = [joint.name for joint in skeleton.joints if joint.follows and joint.follows[0] not in joints]
    shifted = []

    def law(name: str) -> tuple[str, float, float]:
        """Leader, factor and offset."""
        factor, offset, seen = 1.0, 0.0, {name}
        follows = joints[name].follows
        while follows is not None and follows[0] in joints:
            leader = follows[0]
            if leader in seen:
                raise InputError("follows itself", key=f"joint '{name}' <mimic>")
            seen.add(leader)
            factor, offset = factor * follows[1], offset + factor * follows[2]
            name, follows = leader, joints[leader].follows
        return name, factor, offset

    def curve(joint: Joint) -> tuple[str, tuple[float, ...]] | None:
        """Its polynomial of a coordinate whose zero is shifted."""
        if joint.curve is None or joint.curve[0] not in joints:
            return None
        leader, coefficients = joint.curve
        return leader, tuple(Polynomial(coefficients)(Polynomial([law(leader)[2], 1.0])).coef.tolist())

    gone += [joint.name for joint in skeleton.joints if joint.curve and joint.curve[0] not in joints]
    made = []
    for joint in skeleton.joints:
        leader, factor, offset = law(joint.name)
        if leader == joint.name:
            made.append(replace(joint, follows=None, curve=curve(joint)))
            continue
        key = f"joint '{joint.name}' <mimic>"
        if not factor:
            raise InputError("its factor is zero, so that it never moves: a fixed joint is needed", key=key)
        for one in (joint, joints[leader]):
            if one.kind in NO_COORDINATE:
                raise InputError(f"'{one.name}' is a {one.kind} joint, which has no coordinate", key=key)
        made.append(replace(joint.shifted(-offset), follows=(leader, factor, 0.0)))
        if offset:
            shifted.append(joint.name)
    notes = skeleton.notes
    following = [joint.name for joint in made if joint.follows or joint.curve]
    if following:
        exactly = (
            "What this stands for has play, which is in no result: --loop NAME={on=..,instead=[JOINT]} closes a "
            "linkage, --backlash is the lost motion of gears or a belt."
        )
        notes = (*notes, f"These joints follow others exactly: {listed(following)}. {exactly}")
    if gone:
        notes = (*notes, f"These joints follow joints that are no more, and are free: {listed(gone)}.")
    if shifted:
        notes = (*notes, f"Zero of these joints is where the joint that they follow is zero: {listed(shifted)}.")
    return replace(skeleton, joints=tuple(made), notes=notes)
