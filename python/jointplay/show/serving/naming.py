"""Another name of a joint or of a body, wherever a file speaks of it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from jointplay.errors import InputError, not_known, shown
from jointplay.file.schema.keys import Steps
from jointplay.file.schema.values import NAME

from .board import GROUND
from .hand import Hand


def renamed(raw: Mapping[str, Any], kind: str, old: str, new: str) -> dict[str, Any]:
    """The tables of a file with another name of a joint or of a body, wherever they speak of it.

    Raises
    ------
    InputError
        When the name is none, or is taken.
    """
    hand = Hand(raw, {})
    known = [*hand.joints] if kind == "joint" else [*hand.bodies(), GROUND]
    if old not in known or old == GROUND:
        raise InputError(not_known(old, f"a {kind} of this file that can be renamed", known))
    if new in known or not re.match(NAME, new):
        problem = "is taken" if new in known else "is not a name: no blanks and none of . / * = [ ] or quotes"
        raise InputError(f"{shown(new)} {problem}")
    is_key, is_value = (_joint_key, _joint_value) if kind == "joint" else (_body_key, _body_value)

    def source(text: str) -> str:
        """The name of a source, which begins with that of its joint."""
        begins = kind == "joint" and (text == old or text.startswith((f"{old}.", f"{old}/")))
        return new + text[len(old) :] if begins else text

    def key_of(key: str, path: Steps) -> str:
        if path == ("costs",):
            return source(key)
        if path == ("design", "vary"):
            # Each is the way to a value of the file.
            steps = key.split(".")
            return ".".join(new if step == old and is_key((*steps[:k],)) else step for k, step in enumerate(steps))
        return new if key == old and is_key(path) else key

    def walked(value: Any, path: Steps) -> Any:
        if isinstance(value, Mapping):
            named = {key_of(k, path): (k, one) for k, one in value.items()}
            return {key: walked(one, (*path, k)) for key, (k, one) in named.items()}
        if isinstance(value, list):
            return [walked(one, (*path, k)) for k, one in enumerate(value)]
        if isinstance(value, str) and path[:1] == ("correlations",):
            return source(value)
        return new if value == old and is_value(path) else value

    found: dict[str, Any] = walked(raw, ())
    return found


def _words(path: Steps) -> list[str]:
    return [step for step in path if isinstance(step, str)]


def _joint_key(path: Steps) -> bool:
    return path in (("joints",), ("limits", "joints"), ("design", "transmission")) or (
        path[:1] == ("drives",) and path[2:] in (("joints",), ("backlash",))
    )


def _joint_value(path: Steps) -> bool:
    return bool(_words(path)) and (
        _words(path)[-1] in ("joint", "joints", "follows", "at", "between", "locked")
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
