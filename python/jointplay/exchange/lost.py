"""What lies between a motor and the joint that it drives: lost motion and springs.

A robot for simulation has lost motion as a second joint on the axis of the first: without a motor, and with a small
range [lo, hi]. Its coordinate adds to that of the first, so that the lost motion is hi - c to the one side and c - lo
to the other, where c is its coordinate in the drawing. A second joint with a spring and without a range is the wind-up
of the first: it rests where its spring is free, and the coordinate of the first counts from there.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.schema.values import is_finite

from .driving import ANGULAR, LINEAR
from .shaping import joint_called
from .skeleton import Body, Joint, Skeleton, noted
from .writing import UNITS, unit_of

#: range of a joint that is lost motion: 5 degrees, 1 mm; what moves further is a joint
MOST = {"revolute": np.radians(5.0), "prismatic": 1e-3}
#: how far two axes may be off each other: m, and parts of a direction
OFF = 1e-6
#: mass between the two, as a part of what hangs on it: the load of more would be on the other side of the flanks
LIGHT = 0.01
#: what a lost motion is called, by kind
EXTENTS = {"revolute": "angle", "prismatic": "travel"}


# --- as joints ------------------------------------------------------------------------------------------------------


def with_lost_motion(skeleton: Skeleton) -> Skeleton:
    """With lost motion and wind-up of drives in place of the joints that stand for them."""
    played, wound, inside = [], [], []
    heavy: dict[str, str] = {}
    pair = _pair(skeleton, heavy)
    while pair is not None:
        first, second, between = pair
        outer = next(body for body in second.bodies if body != between)
        sign = _sign(first, second, between)
        made = replace(first, bodies=_instead(first.bodies, between, outer))
        if _is_play(second):
            assert second.limits is not None
            sides = (second.limits[1] - second.coordinate, second.coordinate - second.limits[0])
            up, down = sides if sign > 0 else sides[::-1]
            own = first.play or (0.0, 0.0)
            made = replace(made, play=(own[0] + up, own[1] + down))
            played.append(f"{second.name} of {first.name} ({_words(second, up, down)})")
            if second.spring:
                inside.append(second.name)
        else:
            assert second.spring is not None
            stiffness, rest = second.spring
            windup = 1.0 / (1.0 / stiffness + (1.0 / first.windup if first.windup else 0.0))
            made = replace(made, windup=windup, coordinate=first.coordinate + sign * (second.coordinate - rest))
            wound.append(f"{second.name} of {first.name}")
        bodies = dict(skeleton.bodies)
        bodies[outer] = _heavier(bodies[outer], bodies.pop(between))
        skeleton = replace(
            skeleton,
            joints=tuple(made if joint is first else joint for joint in skeleton.joints if joint is not second),
            bodies=bodies,
            frames={name: (outer if on == between else on, at) for name, (on, at) in skeleton.frames.items()},
        )
        pair = _pair(skeleton, heavy)
    said = []
    if played:
        said.append(f"Joints without a motor, on the axis of another one, are its lost motion: {listed(played)}.")
    if wound:
        said.append(f"Joints with a spring, on the axis of a driven one, are its wind-up: {listed(wound)}.")
    if said:
        said.append("--keep-joints leaves them joints.")
    if inside:
        said.append(f"Springs within lost motion are left out: {listed(inside)}.")
    if heavy:
        names = listed(f"{name} ({between})" for name, between in heavy.items())
        said.append(f"These stay joints, because a body with a mass lies before them: {names}.")
    return noted(skeleton, *said)


def _pair(skeleton: Skeleton, heavy: dict[str, str]) -> tuple[Joint, Joint, str] | None:
    """A joint, another one that is its lost motion or wind-up, and the body between them.

    Bodies between that have a mass are written to the mapping: the load of one would be on the drive, but not on the
    flanks.
    """
    leaders = {joint.follows[0] for joint in skeleton.joints if joint.follows}

    def moves(joint: Joint) -> bool:
        return joint.is_driven or joint.follows is not None or joint.name in leaders

    for second in skeleton.joints:
        is_play = _is_play(second)
        if moves(second) or second.kind not in MOST or not (is_play or (second.spring and second.limits is None)):
            continue
        for between, first in _beside(second, skeleton):
            if not moves(first) and (not is_play or first.spring or _is_play(first)):
                continue
            ends = [body for joint in (first, second) for body in joint.bodies if body != between]
            if skeleton.bodies[between].mass <= LIGHT * min(_hanging(skeleton, end, between) for end in ends):
                heavy.pop(second.name, None)
                return first, second, between
            heavy[second.name] = between
    return None


def _is_play(joint: Joint) -> bool:
    """Whether its range is that of a lost motion, with the drawing in it."""
    if joint.limits is None or joint.kind not in MOST:
        return False
    low, high = joint.limits
    return high - low <= MOST[joint.kind] * (1 + 1e-9) and low <= joint.coordinate <= high


def _beside(second: Joint, skeleton: Skeleton) -> Iterator[tuple[str, Joint]]:
    """Joints on the same axis, each with the body that lies between and that nothing else hangs on."""
    for between in second.bodies:
        others = [joint for joint in skeleton.joints if between in joint.bodies and joint is not second]
        if between == skeleton.ground or len(others) != 1 or others[0].kind != second.kind:
            continue
        one, other = others[0].place, second.place
        assert one.axis is not None
        assert other.axis is not None
        if np.abs(np.cross(one.axis, other.axis)).max() > OFF:
            continue
        if second.kind == "revolute" and np.abs(np.cross(other.at - one.at, one.axis)).max() > OFF:
            continue
        yield between, others[0]


def _sign(first: Joint, second: Joint, between: str) -> float:
    """Whether the two coordinates count in one sense: they do along a chain, where the axes have one direction."""
    assert first.place.axis is not None
    assert second.place.axis is not None
    along = (first.bodies[1] == between) == (second.bodies[0] == between)
    return float(np.sign(first.place.axis @ second.place.axis)) * (1.0 if along else -1.0)


def _instead(ends: tuple[str, str], old: str, new: str) -> tuple[str, str]:
    one, other = (new if body == old else body for body in ends)
    return one, other


def _hanging(skeleton: Skeleton, start: str, between: str) -> float:
    """Mass of all bodies that joints connect with one, other than by way of the one between."""
    found, waiting = {between, start}, [start]
    while waiting:
        at = waiting.pop()
        for joint in skeleton.joints:
            if at in joint.bodies:
                new = {*joint.bodies} - found
                found |= new
                waiting += new
    return np.inf if skeleton.ground in found else sum(skeleton.bodies[name].mass for name in found - {between})


def _heavier(body: Body, more: Body) -> Body:
    return body.with_masses_of([body, more]) if more.mass else body


def _words(joint: Joint, up: float, down: float) -> str:
    unit, name = unit_of(joint), UNITS.angle_name if joint.kind in ANGULAR else UNITS.length_name
    return f"+{up / unit:.3g}, -{down / unit:.3g} {name}"


# --- as an option ---------------------------------------------------------------------------------------------------


def with_backlash(skeleton: Skeleton, given: Mapping[str, object], moved: Collection[str]) -> Skeleton:
    """With lost motion that is asked for, by joint or by kind of joint.

    Parameters
    ----------
    given : mapping
        A number, from flank to flank, ``{"plus": .., "minus": ..}``, or either as ``{"angle": ..}`` of joints that turn
        and ``{"travel": ..}`` of those that slide; in file units.
    moved : collection of str
        The joints that drives move: no other one has lost motion.

    Raises
    ------
    InputError
        When a word is no joint or kind that is driven, or a value is none.
    """
    joints = {joint.name: joint for joint in skeleton.joints}
    kinds = {joints[name].kind for name in moved}
    # What is said of one joint counts more than what is said of its kind.
    for word, value in sorted(given.items(), key=lambda item: joint_called(skeleton, item[0]) in joints):
        key = f"backlash {word}"
        name = joint_called(skeleton, word)
        if name in joints:
            if name not in moved:
                raise InputError(f"no drive moves '{name}'; driven are {listed(moved)}", key=key)
            names = [name]
        elif word in kinds:
            names = [name for name in joints if name in moved and joints[name].kind == word]
        else:
            raise InputError(not_known(word, "a joint or a kind of joint that is driven", [*kinds, *moved]), key=key)
        for name in names:
            up, down = _flanks(joints[name], value, key)
            unit = unit_of(joints[name])
            joints[name] = replace(joints[name], play=(up * unit, down * unit) if up or down else None)
    return replace(skeleton, joints=tuple(joints.values()))


def _flanks(joint: Joint, value: object, key: str) -> tuple[float, float]:
    """How far it goes to either side, in file units."""
    extent = EXTENTS["revolute" if joint.kind in ANGULAR else "prismatic"]
    if isinstance(value, Mapping) and (not value or not {*value} <= {"plus", "minus"}):
        if {*value} != {extent}:
            known = f"{extent}, or plus and minus"
            raise InputError(f"a {joint.kind} joint has {known} here, not {listed(map(shown, value))}", key=key)
        value = value[extent]
    sides: list[Any] = [value.get(side, 0.0) for side in ("plus", "minus")] if isinstance(value, Mapping) else [value]
    numbers = [float(side) for side in sides if is_finite(side) and side >= 0.0]
    if len(numbers) < len(sides):
        example = f"{{ {extent} = 0.2 }} (from flank to flank) or {{ plus = 0.2, minus = 0 }}"
        raise InputError(f"{shown(value)} is no lost motion; write {example}", key=key)
    return (numbers[0], numbers[1]) if len(numbers) == 2 else (numbers[0] / 2, numbers[0] / 2)


# --- springs --------------------------------------------------------------------------------------------------------


def settled(
    skeleton: Skeleton, values: Mapping[str, list[float] | None]
) -> tuple[Skeleton, dict[str, list[float] | None]]:
    """With drives that wind up in place of springs that hold joints by themselves; what no drive has is left out.

    Parameters
    ----------
    values : mapping
        Of the drives, in file units; None where they are ours to choose.

    Returns
    -------
    tuple
        The skeleton, and the values with those where springs are free.
    """
    leaders = {joint.follows[0] for joint in skeleton.joints if joint.follows}
    chosen, made = dict(values), []
    held, lost, sliding = [], [], []
    for joint in skeleton.joints:
        if (joint.follows[0] if joint.follows else joint.name) not in values and (joint.play or joint.windup):
            lost.append(joint.name)
            joint = replace(joint, play=None, windup=0.0)
        is_ours = joint.name in values and values[joint.name] is None and joint.name not in leaders
        stiffness, rest = joint.spring or (0.0, 0.0)
        low, high = joint.limits or (-np.inf, np.inf)
        # A spring that presses its joint against a limit loads it there.
        if stiffness and is_ours and low <= rest <= high and not joint.is_driven and not joint.windup:
            held.append(joint.name)
            chosen[joint.name] = [rest / unit_of(joint)]
            joint = replace(joint, windup=stiffness, spring=None)
        elif joint.spring and joint.kind in LINEAR:
            sliding.append(joint.name)
            joint = replace(joint, spring=None)
        made.append(joint)
    said = [
        (held, "Springs hold these joints, as drives that wind up"),
        (lost, "Lost motion and wind-up of joints without a drive are left out"),
        (sliding, "Springs along these joints are left out"),
    ]
    notes = [f"{what}: {listed(names)}." for names, what in said if names]
    return noted(replace(skeleton, joints=tuple(made)), *notes), chosen
