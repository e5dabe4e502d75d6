"""Another name of a joint, a body, a drive, a spring or a dimension, wherever a file speaks of it."""

import re
from collections.abc import Callable, Mapping
from typing import Any

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema.keys import Steps
from jointplay.file.schema.values import NAME

from .board import GROUND
from .hand import RANGES, Hand

#: what can be renamed, and the section of each; bodies have none
KINDS: Mapping[str, str] = {
    "joint": "joints",
    "body": "",
    "drive": "drives",
    "spring": "springs",
    "dimension": "dimensions",
}


def renamed(raw: Mapping[str, Any], kind: str, old: str, new: str) -> dict[str, Any]:
    """The tables of a file with another name of one of `KINDS`, wherever they speak of it.

    Raises
    ------
    InputError
        When the name is none, or is taken.
    """
    hand = Hand(raw, {})
    known = [*raw.get(KINDS[kind], {})] if KINDS[kind] else [*hand.bodies(), GROUND]
    if old not in known or old == GROUND:
        raise InputError(not_known(old, f"a {kind} of this file that can be renamed", known))
    if kind == "body":
        hand.require_own(old)
    if new in known or not re.match(NAME, new):
        problem = "is taken" if new in known else "is not a name: no blanks and none of . / * = [ ] or quotes"
        raise InputError(f"{shown(new)} {problem}")
    is_key, is_value = PLACES[kind]
    # Where a joint has the name, too, it is the joint's.
    is_first = kind == "joint" or (kind in ("drive", "dimension") and old not in hand.joints)

    def reference(text: str, *, is_own: bool, is_joint: bool) -> str:
        """A name, or that of a joint as one of several on its pin, such as J1/rod."""
        if is_own and text == old:
            return new
        joint, slash, body = text.partition("/")
        if kind == "joint" and is_own and joint == old:
            return new + slash + body
        return f"{joint}/{new}" if kind == "body" and is_joint and slash and body == old else text

    def source(text: str) -> str:
        """The name of a source: that of its joint, drive or dimension, then of a body or a joint that it is of."""
        first, *rest = re.split(r"([./])", text)
        if is_first and first == old:
            return new + text[len(first) :]
        follows = (kind == "body" and first in hand.joints) or (kind == "joint" and first in raw.get("drives", {}))
        return first + "".join(new if part == old else part for part in rest) if follows else text

    def key_of(key: str, path: Steps) -> str:
        if path == ("costs",):
            return source(key)
        if path == ("design", "vary"):
            # Each is the way to a value of the file.
            steps = key.split(".")
            return ".".join(new if step == old and is_key((*steps[:k],)) else step for k, step in enumerate(steps))
        return reference(key, is_own=is_key(path), is_joint=_joint_key(path))

    def walked(value: Any, path: Steps) -> Any:
        if isinstance(value, Mapping):
            named = {key_of(k, path): (k, one) for k, one in value.items()}
            return {key: walked(one, (*path, k)) for key, (k, one) in named.items()}
        if isinstance(value, list):
            return [walked(one, (*path, k)) for k, one in enumerate(value)]
        if isinstance(value, str) and path[:1] == ("correlations",):
            return source(value)
        if kind == "drive" and path[-2:] == ("function", "value") and isinstance(value, str):
            return re.sub(rf"\b{re.escape(old)}\b", new, value)
        if not isinstance(value, str):
            return value
        return reference(value, is_own=is_value(path), is_joint=_joint_value(path))

    found: dict[str, Any] = walked(raw, ())
    return found


def _words(path: Steps) -> list[str]:
    return [step for step in path if isinstance(step, str)]


def _joint_key(path: Steps) -> bool:
    return path in (("joints",), *RANGES["joints"]) or (
        path[:1] == ("drives",) and path[2:] in (("joints",), ("backlash",))
    )


def _joint_value(path: Steps) -> bool:
    return bool(_words(path)) and (
        _words(path)[-1] in ("joint", "joints", "follows", "at", "between", "locked")
        or (_words(path)[-1] == "of" and "target" in path)
        or "between" in path
        or path[-2:-1] == ("joints",)
        or (path[:1] == ("springs",) and "on" in path[:-1])
    )


def _body_key(path: Steps) -> bool:
    if path in (("start",), ("bodies",), ("links",), ("board", "free")):
        return True
    return path[:1] in (("joints",), ("springs",)) and path[-1] in ("on", "position", "direction", "runout", "between")


def _body_value(path: Steps) -> bool:
    return bool(_words(path)) and _words(path)[-1] in ("body", "bodies", "relative_to", "base", "axes", "steps")


def _drive_key(path: Steps) -> bool:
    return path in (("drives",), ("limits", "drives"), ("limits", "drive_torques"), ("grid",))


def _drive_value(path: Steps) -> bool:
    return _words(path)[-1:] == ["drive"]


#: of each kind whether a key at a place is its name, and whether a value is
PLACES: Mapping[str, tuple[Callable[[Steps], bool], Callable[[Steps], bool]]] = {
    "joint": (_joint_key, _joint_value),
    "body": (_body_key, _body_value),
    "drive": (_drive_key, _drive_value),
    "spring": (lambda path: path == ("springs",), lambda _: False),
    "dimension": (lambda path: path == ("dimensions",), lambda _: False),
}
