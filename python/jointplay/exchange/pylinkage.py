"""Linkages of pylinkage, as its ``mechanism_to_json`` writes them: joints with positions, and links that hold them.

A link is a body, a joint that several links hold is a pin, and a prismatic joint is a pin in a slot of the ground. The
format has no unit: its lengths are read as mm.
"""

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.file.schema.values import is_finite, is_number
from jointplay.file.toml import read as read_text

from .options import Options
from .pins import OUTPUT, pins, require_connected
from .skeleton import Attachment, Body, Frame, Joint, Skeleton, Vector

MILLIMETRE = 1e-3
#: joints and links that are read; the time to find rigid ones grows faster than their number
MOST_PARTS = 1000
#: types of joints and links, as the format writes them
JOINTS = ("ground", "revolute", "prismatic", "tracker")
LINKS = ("ground", "driver", "arc_driver", "link")


def read(path: Path, options: Options) -> Skeleton:
    """A linkage of pylinkage.

    Raises
    ------
    InputError
        When the file is not one of ``mechanism_to_json``, or has a joint without a position.
    """
    data = _data(path)
    joints = {_id(entry, f"joints.{k}"): entry for k, entry in enumerate(_list(data, "joints"))}
    for name, joint in joints.items():
        _known(joint.get("type", "revolute"), JOINTS, f"joints.{name}.type")
    links = {_id(entry, f"links.{k}"): entry for k, entry in enumerate(_list(data, "links"))}
    held = {name: _held(name, link, joints) for name, link in links.items()}
    fixed = [name for name, link in links.items() if link.get("type", "link") == "ground"]
    if not fixed:
        raise InputError("has no link of type 'ground'", key="links")
    ground = data.get("ground", fixed[0])
    _known(ground, links, "ground")
    # What is on the ground need not be said to be held by it.
    held[ground] |= {name for name, joint in joints.items() if joint.get("type") == "ground"}
    body_of, notes = _rigid(held, ground)
    at = {name: _position(name, joint, joints) for name, joint in joints.items()}
    driven = {link["motor_joint"] for link in links.values() if link.get("motor_joint")}
    found = [*_joints(joints, held, body_of, ground, at, driven)]
    bodies = [ground, *(name for name in links if body_of[name] == name and name != ground)]
    require_connected(bodies, ground, found, "links")
    points = {name: _point(name, joint, held, body_of) for name, joint in joints.items()}
    frames = {name: (body, Frame(at[name])) for name, body in points.items() if body is not None}
    trackers = [name for name in frames if joints[name].get("type") == "tracker"]
    if options.output is None and OUTPUT not in frames:
        if len(trackers) != 1:
            raise InputError(f"which point is it? Name one of {listed(frames)}", key="output")
        frames[OUTPUT] = frames[trackers[0]]
    return Skeleton(
        title=str(data.get("name") or path.stem),
        bodies={name: Body() for name in bodies},
        joints=tuple(found),
        space="planar",
        ground=ground,
        frames=frames,
        has_origins=False,
        gravity=(0.0, 0.0, 0.0),
        notes=("pylinkage has no units: its lengths are read as mm.", *notes),
    )


def _data(path: Path) -> Mapping[str, Any]:
    _, text = read_text(path, "linkage")
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON: {error}") from None
    if not isinstance(data, Mapping) or not {"joints", "links"} <= data.keys():
        raise InputError("is no linkage of pylinkage: its mechanism_to_json writes 'joints' and 'links'")
    return data


def _list(data: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    value = data[key]
    if not isinstance(value, list) or not all(isinstance(entry, Mapping) for entry in value):
        raise InputError(f"a list of tables is needed, not {shown(value)}", key=key)
    in_range(len(value), key, "a number of them that is read", 0, MOST_PARTS)
    counts = Counter(str(entry.get("id")) for entry in value)
    twice = [name for name, count in counts.items() if count > 1]
    if twice:
        raise InputError(f"are there more than once: {listed(twice)}", key=key)
    return value


def _id(entry: Mapping[str, Any], key: str) -> str:
    if not isinstance(entry.get("id"), str):
        raise InputError(f"a name is needed, not {shown(entry.get('id'))}", key=f"{key}.id")
    return str(entry["id"])


def _known(value: object, known: Any, key: str) -> None:
    if not isinstance(value, str) or value not in known:
        raise InputError(not_known(str(value), "known here", known), key=key)


def _held(name: str, link: Mapping[str, Any], joints: Mapping[str, Any]) -> set[str]:
    """The joints that a link holds."""
    _known(link.get("type", "link"), LINKS, f"links.{name}.type")
    held = link.get("joints", [])
    if not isinstance(held, list):
        raise InputError(f"a list of joints is needed, not {shown(held)}", key=f"links.{name}.joints")
    for joint in (*held, *([link["motor_joint"]] if link.get("motor_joint") else [])):
        _known(joint, joints, f"links.{name}.joints")
    return set(held)


def _rigid(held: dict[str, set[str]], ground: str) -> tuple[dict[str, str], list[str]]:
    """The body of every link. Links that share two pins are one body, and so are three that form a triangle.

    pylinkage makes a plate with three pins of bars; with a clearance in each corner it would be no plate.
    """
    body_of = {name: name for name in held}
    groups = {name: set(joints) for name, joints in held.items()}

    order = {name: k for k, name in enumerate(held)}
    while ties := dict.fromkeys(_rigidly_tied(groups)):
        for names in ties:
            first, *others = sorted({body_of[name] for name in names}, key=lambda name: (name != ground, order[name]))
            for other in others:
                groups[first] |= groups.pop(other)
                body_of.update({link: first for link, body in body_of.items() if body == other})
    made = [[link for link, body in body_of.items() if body == own] for own in groups]
    notes = [f"These links hold one another and are one body: {listed(links)}." for links in made if len(links) > 1]
    return body_of, notes


def _rigidly_tied(groups: Mapping[str, set[str]]) -> Iterator[tuple[str, ...]]:
    """Links that share two pins; where there are none, three that form a triangle of pins."""
    holding: dict[str, list[str]] = {}
    between: dict[tuple[str, str], str] = {}
    is_found = False
    for name, joints in groups.items():
        for joint in joints:
            holding.setdefault(joint, []).append(name)
        for pair in permutations(sorted(joints), 2):
            if between.setdefault(pair, name) != name:
                is_found = True
                yield between[pair], name
    if is_found:
        return
    # One link has the pins p and r, the second p and q, the third q and r.
    for (p, r), one in between.items():
        for other in holding[p]:
            for q in groups[other] - {p} if other != one else ():
                third = between.get((q, r))
                if third is not None and third not in (one, other):
                    yield one, other, third


def _position(name: str, joint: Mapping[str, Any], joints: Mapping[str, Any]) -> Vector:
    """Where a joint is, in metres. A tracker is where its links hold it, by its distance and angle."""
    key = f"joints.{name}"
    if joint.get("type") != "tracker":
        return _pair(joint.get("position"), f"{key}.position") * MILLIMETRE
    ends = [_pair(_reference(joint, word, joints, key).get("position"), f"{key}.{word}") for word in REFERENCES]
    along = ends[1] - ends[0]
    angle = math.atan2(along[1], along[0]) + _number(joint.get("angle", 0.0), f"{key}.angle")
    distance = _number(joint.get("distance", 0.0), f"{key}.distance")
    return np.asarray(ends[0] + distance * np.array([math.cos(angle), math.sin(angle), 0.0])) * MILLIMETRE


#: the joints that a tracker is held by
REFERENCES = ("ref_joint1_id", "ref_joint2_id")


def _reference(joint: Mapping[str, Any], word: str, joints: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    _known(joint.get(word), joints, f"{key}.{word}")
    found: Mapping[str, Any] = joints[joint[word]]
    return found


def _pair(value: object, key: str) -> Vector:
    if not isinstance(value, list) or len(value) != 2 or not all(is_number(number) for number in value):
        raise InputError(f"two numbers are needed, [x, y], not {shown(value)}", key=key)
    return np.array([_number(value[0], key), _number(value[1], key), 0.0])


def _number(value: Any, key: str) -> float:
    if not is_finite(value):
        raise InputError(f"a number is needed, not {shown(value)}", key=key)
    return float(value)


def _joints(
    joints: Mapping[str, Mapping[str, Any]],
    held: Mapping[str, set[str]],
    body_of: Mapping[str, str],
    ground: str,
    at: Mapping[str, Vector],
    driven: set[Any],
) -> Iterator[Joint]:
    for name, joint in joints.items():
        bodies = list(dict.fromkeys(body_of[link] for link in (ground, *held) if name in held[link]))
        if joint.get("type") == "tracker":
            continue
        if joint.get("type") == "prismatic":
            yield from _in_slot(name, joint, [body for body in bodies if body != ground], ground, at[name])
        elif len(bodies) > 1:
            yield from pins(name, bodies, at[name], name in driven)


def _in_slot(name: str, joint: Mapping[str, Any], bodies: list[str], ground: str, at: Vector) -> Iterator[Joint]:
    """A pin in a slot of the ground; further links turn on the pin of the first."""
    axis = _pair(joint.get("axis", [1.0, 0.0]), f"joints.{name}.axis")
    if not axis.any():
        raise InputError(f"{shown(joint['axis'])} is no direction", key=f"joints.{name}.axis")
    along = axis / np.linalg.norm(axis)
    if not bodies:
        raise InputError("no link holds it", key=f"joints.{name}")
    on = _pair(joint.get("line_point", [0.0, 0.0]), f"joints.{name}.line_point") * MILLIMETRE
    # The slot is where the format has its line, which the pin may have left by rounding.
    place = Attachment(on + along * ((at - on) @ along), along)
    yield Joint(name, "pin_in_slot", (ground, bodies[0]), place)
    if len(bodies) > 1:
        yield from pins(f"{name}_pin", bodies, place.at)


def _point(
    name: str,
    joint: Mapping[str, Any],
    held: Mapping[str, set[str]],
    body_of: Mapping[str, str],
) -> str | None:
    """The body that carries a point which can be the output: of a pin the last one; None where nothing moves it."""
    needed = {joint[word] for word in REFERENCES} if joint.get("type") == "tracker" else {name}
    of_body: dict[str, set[str]] = {}
    for link, joints in held.items():
        of_body.setdefault(body_of[link], set()).update(joints)
    carriers = [body for body, joints in of_body.items() if needed <= joints]
    return carriers[-1] if carriers else None
