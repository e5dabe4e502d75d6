"""The text of a mechanism file for a skeleton, with comments where the foreign format says nothing."""

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np

from jointplay.basics import poses
from jointplay.basics.units import Units
from jointplay.errors import nearest, one_line
from jointplay.file.schema.kinds import PLANAR, SPATIAL
from jointplay.file.toml import number, numbers

from .driving import has_loops
from .rotations import across, aligning
from .silhouettes import TOLERANCE
from .skeleton import GROUND, Attachment, Body, Frame, Joint, Skeleton, Vector, free

#: of every file that is written
UNITS = Units("mm", "deg", "N")
BARE = re.compile(r"[\w-]+", re.ASCII)
#: width of comments
WIDTH = 110
#: a product of inertia below this part of the largest moment is what rounding leaves of zero
EVEN = 1e-9
#: kinds whose coordinate is an angle, and kinds that have an axis and a side
ANGULAR = ("revolute", "screw")
SIDED = ("revolute", "prismatic", "screw")
#: a fit that lets things move
EXAMPLE = "H7/g6"
#: kinds with a pin that tilts in its hole
TILTING = ("revolute", "cylindrical")
#: kinds whose clearance is that of something round
ROUND = (*TILTING, "spherical")
#: kinds whose axis is the normal of the plane
TURNING = ("revolute", "gear", "belt")
#: kinds that have an axis in the plane
GUIDED = ("prismatic", "pin_in_slot")
#: configurations of a path that is proposed: an even number leaves out the middle, which often is a singular pose
COUNT = 6
#: half of the range of a joint without limits: rad, m
FREE_TURN, FREE_TRAVEL = np.pi, 0.1


def text(
    skeleton: Skeleton,
    source: str,
    drives: Mapping[str, Sequence[float] | None],
    output: tuple[str, Vector],
    clearance: Mapping[str, Mapping[str, Any]],
) -> str:
    """The file.

    Parameters
    ----------
    source : str
        Where it comes from, for the first line.
    drives : mapping
        Values in file units by the joint that is driven; None for a proposal.
    output : tuple
        Body and point of the output in the drawing.
    clearance : mapping
        By joint.
    """
    parts = ["\n".join(_head(skeleton, source, drives, clearance)), "\n".join(_top(skeleton))]
    parts += [_joint(skeleton, joint, clearance.get(joint.name)) for joint in skeleton.joints]
    parts += [*_start(skeleton), *_drives(skeleton, drives), *_followers(skeleton), _output(skeleton, *output)]
    parts += [*_bodies(skeleton), *_loads(skeleton), *_springs(skeleton), *_limits(skeleton, drives)]
    return "\n\n".join(parts) + "\n"


def key(name: str) -> str:
    """A name as a key of the file."""
    return name if BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _string(value: str) -> str:
    return json.dumps(one_line(value), ensure_ascii=False)


def value(given: Any) -> str:
    """A value of an inline table."""
    if isinstance(given, Mapping):
        return "{ " + ", ".join(f"{key(str(name))} = {value(inner)}" for name, inner in given.items()) + " }"
    if isinstance(given, list | tuple):
        return f"[{', '.join(value(inner) for inner in given)}]"
    if isinstance(given, str):
        return _string(given)
    return str(given).lower() if isinstance(given, bool) else number(given)


def _comment(sentence: str) -> Iterator[str]:
    """Comment lines of a sentence."""
    line = "#"
    for word in one_line(sentence).split():
        if len(line) + len(word) >= WIDTH:
            yield line
            line = "#"
        line += f" {word}"
    yield line


def _head(
    skeleton: Skeleton, source: str, drives: Mapping[str, object], clearance: Mapping[str, object]
) -> Iterator[str]:
    said = [f"Imported from {source}.", *skeleton.notes]
    if any(joint.name not in clearance for joint in skeleton.joints):
        said.append("Clearances: take the # away where a joint has one, and write its size.")
    if any(values is None for values in drives.values()):
        said.append("The values of the drives are a proposal.")
    for sentence in said:
        yield from _comment(sentence)


def _top(skeleton: Skeleton) -> Iterator[str]:
    yield "format  = 1"
    yield f"title   = {_string(skeleton.title)}"
    yield f'space   = "{skeleton.space}"'
    yield f'units   = {{ length = "{UNITS.length_name}", angle = "{UNITS.angle_name}", force = "{UNITS.force_name}" }}'
    if any(skeleton.gravity) and any(body.mass for name, body in skeleton.bodies.items() if name != GROUND):
        yield f"gravity = {_vector(skeleton, skeleton.gravity)}"


def _vector(skeleton: Skeleton, vector: Iterable[float]) -> str:
    return numbers(list(vector)[: 2 if skeleton.space == "planar" else 3])


def _length(skeleton: Skeleton, vector: Vector) -> str:
    return _vector(skeleton, vector / UNITS.length)


# --- joints ---------------------------------------------------------------------------------------------------------


def _joint(skeleton: Skeleton, joint: Joint, clearance: Mapping[str, Any] | None) -> str:
    lines = [f"[joints.{key(joint.name)}]", f'type = "{joint.kind}"']
    if joint.lead:
        lines.append(f"lead = {number(joint.lead / UNITS.length)}")
    lines += [f"{key(word)} = {value(given)}" for word, given in joint.keys.items()]
    where = list(_places(skeleton, joint))
    drawn = where if where[0].startswith("bodies") else []
    written = f"clearance = {value(clearance)}" if clearance else f"# clearance = {_example(skeleton, joint)}"
    lines += [*drawn, *(_comment(joint.sizes.said) if joint.sizes else ()), written]
    if not drawn:
        lines += ["", f"[joints.{key(joint.name)}.on]", *where]
    return "\n".join(lines)


def _example(skeleton: Skeleton, joint: Joint) -> str:
    """A clearance as this joint can have it."""
    if (drawn := sized(skeleton, joint, EXAMPLE)) is not None:
        return value(drawn)
    kind = joint.kind
    kinds = PLANAR if skeleton.space == "planar" else SPATIAL
    annotation = kinds[kind].model_fields["clearance"].annotation
    text = str(get_args(annotation)[0].example)
    return text[: text.index("}") + 1]


def sized(skeleton: Skeleton, joint: Joint, fit: str | None) -> dict[str, object] | None:
    """The clearance of a joint whose hole and pin are known: as they are drawn, or with a fit of the pin's diameter.

    None where they are not known, or say nothing of this kind of joint.
    """
    if joint.sizes is None or joint.kind not in (*ROUND, *(("prismatic",) if skeleton.space == "planar" else ())):
        return None
    hole, pin, length = (
        float(number(size / UNITS.length)) for size in (joint.sizes.hole, joint.sizes.pin, joint.sizes.length)
    )
    if joint.kind == "prismatic":
        drawn = {"slot": {"width": hole}, "slider": {"width": pin}}
        return ({"fit": fit, "nominal": pin} if fit is not None else drawn) | {"length": length}
    found: dict[str, object] = {"hole": {"diameter": hole}, "pin": {"diameter": pin}}
    if fit is not None:
        found = {"fit": fit, "diameter": pin}
    # In the plane nothing tilts, and a ball never does.
    return found | ({"length": length} if skeleton.space == "spatial" and joint.kind in TILTING else {})


def _places(skeleton: Skeleton, joint: Joint) -> Iterator[str]:
    """Lines that say where a joint is: once for both bodies, if their axes are those of the ground, or on each body."""
    bodies = [skeleton.bodies[name] for name in joint.bodies]
    if joint.second is None and not joint.coordinate and all(_is_drawn(body) for body in bodies):
        yield f"bodies = [{', '.join(_string(name) for name in joint.bodies)}]"
        yield f"at = {_length(skeleton, joint.place.at)}"
        if joint.place.axis is not None and (skeleton.space == "spatial" or joint.kind in GUIDED):
            yield f"axis = {_vector(skeleton, joint.place.axis)}"
        return
    for name, body, place, side in zip(joint.bodies, bodies, _both(joint), _sides(joint, bodies[1]), strict=True):
        yield f"{key(name)} = {_placement(skeleton, joint, place.within(body.frame.inverse()), body, side)}"


def _is_drawn(body: Body) -> bool:
    return not body.frame.at.any() and bool((body.frame.axes == np.eye(3)).all())


def _both(joint: Joint) -> tuple[Attachment, Attachment]:
    """The places on the two bodies. A travel is the distance between them."""
    if joint.second is not None:
        return joint.place, joint.second
    if joint.kind == "prismatic":
        assert joint.place.axis is not None
        return joint.place, Attachment(joint.place.at + joint.coordinate * joint.place.axis, joint.place.axis)
    if joint.kind == "pin_in_slot":
        return joint.place, Attachment(joint.place.at)
    return joint.place, joint.place


def _sides(joint: Joint, second: Body) -> tuple[Vector | None, Vector | None]:
    """Directions across the axis that agree where the angle is zero, in the drawing."""
    first, other = _both(joint)
    if joint.side is not None:
        return joint.side, None
    if joint.kind not in SIDED or first.axis is None or other.axis is None:
        return None, None
    own = second.frame.axes.T @ other.axis
    side = second.frame.axes @ across(own / np.linalg.norm(own))
    turn = -joint.coordinate if joint.kind in ANGULAR else 0.0
    return poses.turned_by(turn * first.axis) @ aligning(other.axis, first.axis) @ side, side


def _placement(skeleton: Skeleton, joint: Joint, place: Attachment, body: Body, side: Vector | None) -> str:
    at = _length(skeleton, place.at)
    if place.axis is None or (skeleton.space == "planar" and joint.kind in TURNING):
        return at
    more = f", side = {_vector(skeleton, body.frame.axes.T @ side)}" if side is not None else ""
    if skeleton.space == "planar":
        more = ""
    return f"{{ at = {at}, axis = {_vector(skeleton, place.axis)}{more} }}"


# --- what moves -----------------------------------------------------------------------------------------------------


def _start(skeleton: Skeleton) -> Iterator[str]:
    """Poses of the bodies in the drawing, where it decides on which branch loops are closed, or parts go back to it."""
    moving = {name: body for name, body in skeleton.bodies.items() if name != GROUND}
    if not (has_loops(skeleton) or skeleton.starts_drawn) or all(_is_drawn(body) for body in moving.values()):
        return
    lines = ["[start]"]
    for name, body in moving.items():
        position = _coordinates(skeleton, body.frame)
        turn = poses.rotation_vector(poses.from_axes(body.frame.axes)) / UNITS.angle
        rotation = f"angle = {number(turn[2])}" if skeleton.space == "planar" else f"rotation = {numbers(turn)}"
        lines.append(f"{key(name)} = {{ {position}, {rotation} }}")
    yield "\n".join(lines)


def _coordinates(skeleton: Skeleton, frame: Frame) -> str:
    names = "xy" if skeleton.space == "planar" else "xyz"
    return ", ".join(f"{n} = {number(x / UNITS.length)}" for n, x in zip(names, frame.at, strict=False))


def unit_of(joint: Joint) -> float:
    """SI per file unit of a joint's coordinate."""
    return UNITS.angle if joint.kind in ANGULAR else UNITS.length


def _drives(skeleton: Skeleton, drives: Mapping[str, Sequence[float] | None]) -> Iterator[str]:
    joints = {joint.name: joint for joint in skeleton.joints}
    # Drives run together: a proposal has as many values as those that were given.
    count = max((len(values) for values in drives.values() if values is not None and len(values) > 1), default=COUNT)
    following: dict[str, list[Joint]] = {}
    for joint in skeleton.joints:
        if joint.follows:
            following.setdefault(joint.follows[0], []).append(joint)
    for name, values in drives.items():
        followers = following.get(name, ())
        moved = f"joint = {_string(name)}"
        if followers:
            # The motor has the unit of the first joint.
            unit = unit_of(joints[name])
            ratios = {joint.name: joint.follows[1] * unit / unit_of(joint) for joint in followers if joint.follows}
            moved = f"joints = {value({name: 1.0, **ratios})}"
        given = _proposal(skeleton, joints[name], count) if values is None else [f"values = {numbers(values)}"]
        yielding = _yielding([joints[name], *followers])
        yield "\n".join([f"[drives.{key(name)}]", moved, *given, _error(joints[name]), *yielding])


def _error(joint: Joint) -> str:
    """Where the error of a drive is written."""
    return "# error = 0.01" + f" (that of its motor over {joint.reduction:g})" * bool(joint.reduction)


def _yielding(joints: Sequence[Joint]) -> Iterator[str]:
    """Lost motion and stiffness of a drive: one for its joint, or a table where it moves several."""
    play = {
        joint.name: joint.play[0] * 2 / unit_of(joint)
        if joint.play[0] == joint.play[1]
        else {side: end / unit_of(joint) for side, end in zip(("plus", "minus"), joint.play, strict=True)}
        for joint in joints
        if joint.play
    }
    stiffness = {joint.name: _stiffness(joint, joint.windup) for joint in joints if joint.windup}
    for word, given in (("backlash", play), ("stiffness", stiffness)):
        if given:
            yield f"{word} = {value(given if len(joints) > 1 else next(iter(given.values())))}"


def _stiffness(joint: Joint, stiffness: float) -> float:
    """A stiffness in file units: moment per angle, or force per length."""
    arm = UNITS.length if joint.kind in ANGULAR else 1.0
    return stiffness * unit_of(joint) / (UNITS.force * arm)


def _followers(skeleton: Skeleton) -> Iterator[str]:
    joints = {joint.name: joint for joint in skeleton.joints}
    for joint in skeleton.joints:
        if joint.curve is None:
            continue
        leader, coefficients = joint.curve
        unit, own = unit_of(joints[leader]), unit_of(joint)
        law = [c * unit**k / own for k, c in enumerate(coefficients)]
        lines = [f"joint      = {_string(joint.name)}", f"follows    = {_string(leader)}"]
        name = free(f"{joint.name}-follower", set(joints))
        yield "\n".join([f"[followers.{key(name)}]", *lines, f"polynomial = {numbers(law)}", "# error = 0.01"])


def _proposal(skeleton: Skeleton, joint: Joint, count: int) -> list[str]:
    """The pose of the drawing, or of a tree the middle half of what its joints allow."""
    unit = unit_of(joint)
    reach = FREE_TURN if joint.kind in ANGULAR else FREE_TRAVEL
    low, high = joint.limits or (-reach, reach)
    if has_loops(skeleton):
        return [f"values = [{number(min(max(joint.coordinate, low), high) / unit)}]"]
    if joint.kind in ANGULAR:
        # A joint that turns more than once repeats itself.
        low, high = max(low, min(-reach, high - reach)), min(high, max(reach, low + reach))
    quarter = (high - low) / 4
    return [
        f"from  = {number((low + quarter) / unit)}",
        f"to    = {number((high - quarter) / unit)}",
        f"count = {count}",
    ]


def _output(skeleton: Skeleton, body: str, point: Vector) -> str:
    at = skeleton.bodies[body].frame.inverse().point(point)
    origins = [name for name, one in skeleton.bodies.items() if skeleton.has_origins and not one.is_between]
    on = {name: name for name in origins} | {name: on for name, (on, _) in skeleton.frames.items()}
    others = [name for name, where in on.items() if name != body and where != GROUND]
    known = _comment(f"Other points for --output-point: {', '.join(others)}") if others else ()
    return "\n".join(["[output]", f"body = {_string(body)}", f"at   = {_length(skeleton, at)}", *known])


def _bodies(skeleton: Skeleton) -> Iterator[str]:
    on = Counter(name for joint in skeleton.joints for name in joint.bodies)
    for name, body in skeleton.bodies.items():
        lines = []
        others = [other for other in skeleton.bodies if other != name]
        if body.mass and name != GROUND:
            centre = _length(skeleton, body.frame.inverse().point(body.centre))
            lines = [f"mass   = {number(body.mass)}", f"centre = {centre}", *_moments(skeleton, body)]
        lines += _outline(body)
        # With an entry a body is not taken for another one, mistyped.
        is_like = name != GROUND and not lines and on[name] == 1 and nearest(name, others, slips_only=True)
        if lines or is_like:
            yield "\n".join([f"[bodies.{key(name)}]", *lines])


def _outline(body: Body) -> Iterator[str]:
    """The lines of the outline, where there is one: rounded to what can be seen."""
    if not body.outline:
        return
    size = max(float(np.ptp(line, axis=0).max()) for line in body.outline) / UNITS.length
    digits = 1 - int(np.floor(np.log10(size * TOLERANCE)))
    back = body.frame.inverse()
    yield "outline = ["
    for line in body.outline:
        own = (np.pad(line, ((0, 0), (0, 1))) @ back.axes.T + back.at) / UNITS.length
        corners = ", ".join(numbers(corner[:2]) for corner in np.round(own, digits) + 0.0)
        yield f"  [{corners}],"
    yield "]"


def _moments(skeleton: Skeleton, body: Body) -> Iterator[str]:
    """The line of the moments of inertia, where there are any."""
    if not body.inertia.any():
        return
    matrix = body.frame.axes.T @ body.inertia @ body.frame.axes / UNITS.length**2
    if skeleton.space == "planar":
        yield f"rotational_inertia = {number(matrix[2, 2])}"
        return
    across = matrix[[0, 0, 1], [1, 2, 2]]
    across[np.abs(across) < EVEN * np.abs(matrix).max()] = 0.0
    yield f"rotational_inertia = {numbers([*np.diag(matrix), *(across if across.any() else ())])}"


def _loads(skeleton: Skeleton) -> Iterator[str]:
    for load in skeleton.forces:
        if load.body == GROUND:
            continue
        back = skeleton.bodies[load.body].frame.inverse()
        lines = ["[[loads]]", f"body  = {_string(load.body)}", f"at    = {_length(skeleton, back.point(load.at))}"]
        force = (back.axes @ load.force if load.is_follower else load.force) / UNITS.force
        axes = ['axes  = "body"'] if load.is_follower else []
        yield "\n".join([*lines, f"force = {_vector(skeleton, force)}", *axes])


def _springs(skeleton: Skeleton) -> Iterator[str]:
    """Springs beside motors, and of joints without a drive; the others are in their drives."""
    for joint in skeleton.joints:
        if joint.spring:
            stiffness, rest = joint.spring
            lines = [f"[springs.{key(joint.name)}]", f"joint = {_string(joint.name)}"]
            lines.append(f"stiffness = {number(_stiffness(joint, stiffness))}")
            # The file counts within half a turn: a spring that is wound further has its moment in the drawing.
            free = rest if abs(rest - joint.coordinate) <= np.pi / 2 else joint.coordinate
            if free:
                lines.append(f"free_angle = {number(free / UNITS.angle)}")
            if free != rest:
                lines.append(f"preload = {number(stiffness * (free - rest) / (UNITS.force * UNITS.length))}")
            yield "\n".join(lines)


def _limits(skeleton: Skeleton, drives: Mapping[str, object]) -> Iterator[str]:
    for table, driven in (("drives", True), ("joints", False)):
        lines = [
            f"{key(joint.name)} = {numbers(limit / unit_of(joint) for limit in joint.limits)}"
            for joint in skeleton.joints
            if joint.limits and (joint.name in drives) == driven
        ]
        if lines:
            yield "\n".join([f"[limits.{table}]", *lines])
