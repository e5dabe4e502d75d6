"""Dotted keys: `joints.J1.clearance.radial`, `loads.0.force`, and `*` for every entry (`joints.*.clearance.radial`).

What is repeated has the key of its pattern, `patterns.leg.joints.hip.clearance.radial`, for all copies at once. A `*`
for entries of the file stands for those of its patterns as well.
"""

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from jointplay.errors import SHOWN, InputError, not_known, shown
from jointplay.file.toml import DEEPEST, too_deep

#: sections whose entries have names of the user's own
NAMED = {
    "joints": "a joint",
    "drives": "a drive",
    "followers": "a follower",
    "dimensions": "a dimension",
    "links": "a link",
    "springs": "a spring",
    "outputs": "an output",
    "variables": "a variable",
    "load_cases": "a load case",
    "patterns": "a pattern",
}

#: the sizes that make a clearance, a ball bearing in its place, and what else than a number says how large it is
PAIRS = ("hole", "pin", "slot", "slider")
BEARING = ("bearing", "bore", "reduction")
FITTED = ("fit", "diameter", "nominal", *PAIRS, *BEARING)

#: different ways to say the same
RIVALS: Mapping[str, tuple[str, ...]] = {
    "values": ("from", "to", "count", "polynomial", "origin"),
    "at": ("polynomial", "origin"),
    "polynomial": ("at", "values", "ends"),
    "from": ("values",),
    "to": ("values",),
    "count": ("values",),
    "radial": ("diametral", *FITTED),
    "diametral": ("radial", *FITTED),
    "gap": FITTED,
    "fit": ("radial", "diametral", "gap", "tolerance", *PAIRS, *BEARING),
    "bearing": ("radial", "diametral", "tolerance", "fit", "diameter", *PAIRS),
    **dict.fromkeys(PAIRS, ("radial", "diametral", "gap", "tolerance", "fit", "diameter", "nominal", *BEARING)),
    "tolerance": ("plus", "minus", "class"),
    "class": ("tolerance", "plus", "minus"),
    "sigma": ("plus", "minus"),
    "plus": ("sigma", "tolerance", "class"),
    "minus": ("sigma", "tolerance", "class"),
    "backlash": ("backlash_angle",),
    "backlash_angle": ("backlash",),
    "module": ("radii", "radius"),
    "pitch": ("radii",),
    "radii": ("module", "pitch"),
    "radius": ("module",),
    "joint": ("joints",),
    "joints": ("joint",),
}
#: words that say by themselves all that their rivals do
WHOLE = frozenset({"values", "radial", "diametral", "gap", "sigma", "backlash", "backlash_angle"})
#: what a value of the first word is in terms of the second
IN_TERMS_OF = {("radial", "diametral"): 0.5, ("diametral", "radial"): 2.0}
Steps = tuple[str | int, ...]


def _is_own(steps: Sequence[str | int]) -> bool:
    """Whether the last step is a key of the format's (section, name, key) and not a name."""
    return len(steps) >= 3 + 2 * _in_pattern(steps)


def _in_pattern(steps: Sequence[str | int]) -> bool:
    return len(steps) > 0 and steps[0] == "patterns"


def expand(data: Mapping[str, Any], key: str, file: str) -> list[Steps]:
    """The places that a dotted key means.

    Parameters
    ----------
    data : mapping
        Data of a mechanism file.
    key : str
        Dotted key. With a `*`, only places that are given in the data are meant, be it in other words (`diametral`
        where the key says `radial`); without, a new one may be.
    file : str
        Name of the file, for messages.

    Raises
    ------
    InputError
        A wildcard that matches nothing, a joint, drive or dimension that does not exist, a list index out of range.
    """
    parts = key.split(".")
    if len(parts) > DEEPEST:
        raise too_deep(file, key[:SHOWN])
    if not all(parts):
        raise InputError(f"{shown(key)} is not a dotted key such as joints.J1.clearance.radial", file=file)
    if "*" not in parts:
        return [_path(data, parts, key, file)]
    found = [place for spelled in _spellings(data, parts) for place in _places(data, spelled)]
    if not found:
        raise InputError(_no_match(data, parts), file=file, key=key)
    return found


def change(data: dict[str, Any], changes: Mapping[str, object], file: str) -> list[str]:
    """Set values by dotted key, in place; says of every key with a `*` what it reached.

    Examples
    --------
    >>> joints = {"A": {"clearance": {"radial": 0.1}}, "B": {"clearance": {"diametral": 0.1}}, "C": {}}
    >>> change({"joints": joints}, {"joints.*.clearance.radial": 0.2}, "m.toml")
    ['joints.*.clearance.radial: 2 of 3 joints; 1 converted from diametral']
    >>> joints["B"]
    {'clearance': {'radial': 0.2}}
    """
    reached = []
    for key, value in changes.items():
        places = expand(data, key, file)
        if "*" in key.split("."):
            reached.append(what_is_reached(data, key, places))
        for steps in places:
            # Places share nothing that a later change of one of them would change in the others.
            assign(data, steps, copy.deepcopy(value))
    return reached


def _spellings(data: Mapping[str, Any], parts: list[str]) -> list[list[str]]:
    """A key with a `*` as it is, and within every pattern."""
    patterns = data.get("patterns")
    within = patterns if isinstance(patterns, Mapping) and parts[0] not in ("*", "patterns") else ()
    return [parts, *(["patterns", name, *parts] for name in within)]


def what_is_reached(data: Mapping[str, Any], key: str, places: list[Steps]) -> str:
    """How many of the entries that a `*` stands for a key reaches, and which of them say it in other words."""
    parts = key.split(".")
    hit: set[Steps] = set()
    entries: list[Steps] = []
    for spelled in _spellings(data, parts):
        star = spelled.index("*")
        hit |= {steps[: star + 1] for steps in places if list(steps[:star]) == spelled[:star]}
        entries += _matches(data, spelled[: star + 1])
    star = parts.index("*")
    what = parts[star - 1] if star else "sections"
    text = f"{key}: {_count(data, hit)} of {_count(data, entries)} {what}"
    others = [(steps, _other_word(value_at(data, steps[:-1]), steps)) for steps in places]
    words = sorted({word for _, word in others if word})
    converted = ((_count(data, (steps for steps, other in others if other == word)), word) for word in words)
    return text + "".join(f"; {number} converted from {word}" for number, word in converted)


def _count(data: Mapping[str, Any], places: Iterable[Steps]) -> int:
    """How many entries of the mechanism places are: what is in a pattern is there once for every copy."""
    return sum(copies(data["patterns"][steps[1]]) if _in_pattern(steps) and len(steps) > 2 else 1 for steps in places)


def copies(pattern: Any) -> int:
    """How many copies of a pattern there are; one as long as it does not say it."""
    table = pattern if isinstance(pattern, Mapping) else {}
    values = table.get("values")
    lists = values.values() if isinstance(values, Mapping) else ()
    count = table.get("count", next((len(value) for value in lists if isinstance(value, list)), 1))
    return count if isinstance(count, int) else 1


def _places(data: Any, parts: list[str]) -> list[Steps]:
    """The places that a key with a `*` means: those that are given, be it in other words."""
    given = _matches(data, parts)
    last = parts[-1]
    if last not in WHOLE or not _is_own(parts):
        return given
    tables = ((steps, value_at(data, steps)) for steps in _matches(data, parts[:-1]))
    return [(*steps, last) for steps, table in tables if _says(table, last)]


def _says(table: Any, word: str) -> bool:
    return isinstance(table, Mapping) and any(other in table for other in (word, *RIVALS[word]))


def _other_word(table: Any, steps: Steps) -> str:
    """The words in which a table says what is set at its end, where these are others."""
    last = steps[-1]
    if not isinstance(last, str) or last not in WHOLE or last in table or not _is_own(steps):
        return ""
    return ", ".join(word for word in RIVALS[last] if word in table)


def _matches(data: Any, parts: list[str]) -> list[Steps]:
    if not parts:
        return [()]
    head, rest = parts[0], parts[1:]
    return [(step, *tail) for step in _steps(data, head) for tail in _matches(data[step], rest)]


def _steps(data: Any, head: str) -> list[str] | list[int]:
    if isinstance(data, Mapping):
        return list(data) if head == "*" else [head] if head in data else []
    if isinstance(data, list):
        return list(range(len(data))) if head == "*" else [int(head)] if _is_index(head, data) else []
    return []


def _is_index(part: str, data: list[Any]) -> bool:
    return part.isascii() and part.isdigit() and len(part) < 9 and int(part) < len(data)


def _no_match(data: Mapping[str, Any], parts: list[str]) -> str:
    """Says how far the key still meant something."""
    for depth in range(1, len(parts) + 1):
        if _matches(data, parts[:depth]):
            continue
        above = _matches(data, parts[: depth - 1])
        known = {str(step) for steps in above for step in _steps(value_at(data, steps), "*")}
        where = f" in {'.'.join(parts[: depth - 1])}" if depth > 1 else ""
        if parts[depth - 1] == "*":
            return f"the * matches nothing: there is nothing{where}"
        return f"the * matches nothing: {not_known(parts[depth - 1], f'given{where}', sorted(known))}"
    return "the * matches nothing"


def _path(data: Mapping[str, Any], parts: list[str], key: str, file: str) -> Steps:
    _check_name(data, parts, 0, key, file)
    if _in_pattern(parts) and len(parts) > 2:
        _check_name(data, parts, 2, key, file)
    here: Any = data
    steps: list[str | int] = []
    for part in parts:
        if isinstance(here, list):
            if not _is_index(part, here):
                problem = f"{shown(part)} is not an index into a list of {len(here)}, counted from 0"
                raise InputError(problem, file=file, key=key)
            steps.append(int(part))
            here = here[int(part)]
        elif isinstance(here, Mapping):
            steps.append(part)
            here = here.get(part, {})
        else:
            above = ".".join(str(step) for step in steps)
            raise InputError(f"{above} is {shown(here)} and has no '{part}' below it", file=file, key=key)
    return tuple(steps)


def _check_name(data: Mapping[str, Any], parts: list[str], start: int, key: str, file: str) -> None:
    """Refuse the name of an entry that does not exist, in a section of the file or of a pattern."""
    if len(parts) <= start + 1 + (parts[start] != "variables") or parts[start] not in NAMED:
        return
    section, name = parts[start : start + 2]
    tables: Any = data["patterns"][parts[1]] if start else data
    names = tables.get(section, {}) if isinstance(tables, Mapping) else None
    if not isinstance(names, Mapping) or name in names:
        return
    patterns = data.get("patterns")
    for pattern, table in patterns.items() if isinstance(patterns, Mapping) and not start else ():
        own = table.get(section) if isinstance(table, Mapping) else None
        original, _, number = name.rpartition("_")
        there = f"patterns.{pattern}.{section}"
        if isinstance(own, Mapping) and name in own:
            raise InputError(f"'{name}' is in a pattern: {there}.{name}", file=file, key=key)
        if isinstance(own, Mapping) and original in own and number in map(str, range(1, copies(table) + 1)):
            problem = (
                f"'{name}' is a copy: {there}.{original} is for all copies, and a value that differs from copy to copy"
                f" is in patterns.{pattern}.values"
            )
            raise InputError(problem, file=file, key=key)
    raise InputError(not_known(name, NAMED[section], names), file=file, key=key)


def value_at(data: Any, steps: Steps) -> Any:
    """The value at a place that exists, converted where it is given in other words."""
    for step in steps[:-1]:
        data = data[step]
    last = steps[-1] if steps else None
    if isinstance(data, Mapping) and isinstance(last, str) and last not in data and _is_own(steps):
        for other in RIVALS.get(last, ()):
            if other in data and (last, other) in IN_TERMS_OF:
                return _scaled(data[other], IN_TERMS_OF[last, other])
    return data if last is None else data[last]


def assign(data: Any, steps: Steps, value: Any, table: Callable[[], Any] = dict) -> None:
    """Set a value in place, making the tables on the way; None removes it.

    A value replaces those that say the same in another way: `values` replaces `from`, `to` and `count`.
    """
    here = data
    for step in steps[:-1]:
        if isinstance(step, str) and step not in here:
            here[step] = table()
        here = here[step]
    last = steps[-1]
    if value is None:
        # What is not there need not be removed.
        if isinstance(last, int) or last in here:
            del here[last]
        return
    if isinstance(last, str) and isinstance(here, dict) and _is_own(steps):
        _keep_measure(here, last)
    here[last] = value
    for rival in RIVALS.get(last, ()) if _is_own(steps) and isinstance(last, str) else ():
        if rival in here:
            del here[rival]


def _keep_measure(table: dict[str, Any], word: str) -> None:
    """A tolerance is in the measure in which its clearance is given, and changes with it."""
    for other in RIVALS.get(word, ()):
        if other in table and "tolerance" in table and (word, other) in IN_TERMS_OF:
            table["tolerance"] = _scaled(table["tolerance"], IN_TERMS_OF[word, other])


def _scaled(value: Any, part: float) -> Any:
    """A number, an expression, or a table of them, times a number."""
    if isinstance(value, Mapping):
        return {key: _scaled(one, part) for key, one in value.items()}
    return f"{part:g} * ({value})" if isinstance(value, str) else part * value
