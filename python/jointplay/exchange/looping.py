"""Joints that close loops and that a tree cannot hold: they are written like a joint of the mechanism file."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema.values import is_finite

from .shaping import joint_called, legal, link_called
from .skeleton import Attachment, Frame, Joint, Skeleton
from .writing import UNITS

KEYS = ("type", "on", "instead")
#: kinds that can close a loop, and whether they have an axis
KINDS = {"revolute": True, "prismatic": True, "cylindrical": True, "spherical": False}


def with_loops(skeleton: Skeleton, loops: Mapping[str, object]) -> Skeleton:
    """With more joints, whose places are in the axes of links and in the units of the mechanism file.

    Raises
    ------
    InputError
        When a table is not that of a joint, or names no link.
    """
    for name, table in loops.items():
        if legal(name) in (joint.name for joint in skeleton.joints):
            raise InputError("there is a joint of this name already", key=f"loops {name}")
        if not isinstance(table, Mapping):
            raise InputError(f"a table is needed, not {shown(table)}", key=f"loops {name}")
        joint = _joint(skeleton, name, table)
        freed = _freed(skeleton, f"loops {name}", table.get("instead", ()))
        skeleton = replace(skeleton, joints=(*freed, joint))
    return skeleton


def _freed(skeleton: Skeleton, key: str, names: Any) -> list[Joint]:
    """The joints, of which some follow no other one any more, because the loop moves them."""
    followers = [joint.name for joint in skeleton.joints if joint.follows]
    wanted = [names] if isinstance(names, str) else names
    if not isinstance(wanted, list | tuple) or not all(isinstance(name, str) for name in wanted):
        raise InputError(f"needs names of joints, not {shown(names)}", key=f"{key} instead")
    called = [joint_called(skeleton, name) for name in wanted]
    for name, wrote in zip(called, wanted, strict=True):
        if name not in followers:
            raise InputError(not_known(wrote, "a joint that follows another one", followers), key=f"{key} instead")
    return [replace(joint, follows=None) if joint.name in called else joint for joint in skeleton.joints]


def _joint(skeleton: Skeleton, name: str, table: Mapping[str, Any]) -> Joint:
    key = f"loops {name}"
    for word in table:
        if word not in KEYS:
            raise InputError(not_known(word, "a key here", KEYS), key=key)
    kind = table.get("type", "revolute")
    if kind not in KINDS:
        raise InputError(not_known(str(kind), "a joint that closes a loop", KINDS), key=key)
    on = table.get("on")
    if not isinstance(on, Mapping) or len(on) != 2:
        example = "on = { rod_end = [0, 0, 0], rocker = { at = [80, 0, 0], axis = [0, 0, 1] } }"
        raise InputError(f"needs two links and where the joint sits on each: {example}", key=key)
    known = {link: (link, body.frame) for link, body in skeleton.bodies.items()} | dict(skeleton.frames)
    bodies, places = [], []
    for link, value in on.items():
        called = link_called(skeleton, link)
        if called not in known:
            raise InputError(not_known(link, "a link", known), key=key)
        body, frame = known[called]
        bodies.append(body)
        places.append(_place(f"{key} on.{link}", value, frame))
    first, second = places
    if KINDS[kind]:
        if first.axis is None:
            raise InputError(f"a {kind} joint needs an axis on its first link: {{ at = ..., axis = ... }}", key=key)
        second = replace(second, axis=first.axis if second.axis is None else second.axis)
    if bodies[0] == bodies[1]:
        raise InputError(f"both links are the body '{bodies[0]}'", key=key)
    return Joint(legal(name), kind, (bodies[0], bodies[1]), first, second)


def _place(key: str, value: Any, frame: Frame) -> Attachment:
    table = value if isinstance(value, Mapping) else {"at": value}
    for word in table:
        if word not in ("at", "axis"):
            raise InputError(not_known(word, "a key here", ("at", "axis")), key=key)
    at = _triple(f"{key}.at", table.get("at")) * UNITS.length
    if "axis" not in table:
        return Attachment(at).within(frame)
    axis = _triple(f"{key}.axis", table["axis"])
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise InputError(f"{shown(table['axis'])} is no direction", key=f"{key}.axis")
    return Attachment(at, axis / length).within(frame)


def _triple(key: str, value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not isinstance(value, list | tuple) or len(value) != 3 or not all(is_finite(number) for number in value):
        raise InputError(f"three numbers are needed, [x, y, z], not {shown(value)}", key=key)
    return np.array([float(number) for number in value])
