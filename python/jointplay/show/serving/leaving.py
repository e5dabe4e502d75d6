"""What goes with what is taken away: prices, limits, correlations and the like that spoke of nothing else.

A source goes with the clearance, error or tolerance that makes it. Of all else the reader of files says whether it
still speaks of something: what it refuses, and has not changed itself, goes.
"""

import copy
from collections.abc import Iterator, Mapping
from typing import Any

from jointplay.errors import InputError
from jointplay.file import document, toml
from jointplay.file.schema.keys import Steps, expand
from jointplay.file.schema.values import is_number

from .hand import found_at, table_at, with_tables

#: what makes the sources of a section: the key, and what it adds to the name
MAKERS: Mapping[str, Mapping[str, str]] = {
    "joints": {"clearance": ""},
    "drives": {"error": "", "backlash": ".backlash"},
    "dimensions": {"tolerance": ""},
    "followers": {"error": ".error", "backlash": ".backlash"},
}
#: parts of a clearance that have sources of their own
PARTS = (".lock", ".hole", ".pin", ".slot", ".slider", ".first", ".second", "/")
#: tables whose entries speak of others by name
NAMED: tuple[Steps, ...] = (
    *(("costs",), ("start",), ("bodies",), ("links",), ("springs",), ("followers",), ("dimensions",), ("drives",)),
    *(("limits", key) for key in ("drives", "joints", "drive_torques", "reactions")),
    *(("design", key) for key in ("vary", "transmission")),
)
#: what speaks of others as a whole
WHOLE = ("grid", "target", "assembly", "gravity")
#: more than a file has of them
MOST = 200


def without_sources(text: str, before: Mapping[str, Any]) -> tuple[str, list[str]]:
    """A text without what spoke of sources and values that it had before and has no more, and what has gone."""
    after = toml.parse(text)
    notes: list[str] = []
    lost = {*_sources(before)} - {*_sources(after)}
    for name in [*table_at(after, "costs")]:
        if any(_is_of(name, source) for source in lost) or _changed_way(name, before, after):
            text, notes = _without(text, ("costs", name), notes)
    if lost:
        text, notes = _uncorrelated(text, lost, notes)
    for name, own in table_at(after, "joints").items():
        if isinstance(own, Mapping) and "wear" in own and name in lost:
            text, notes = _without(text, ("joints", name, "wear"), notes)
    for key in [*table_at(after, "design", "vary")]:
        if _leads(before, key) and not _leads(after, key):
            text, notes = _without(text, ("design", "vary", key), notes)
    return text, notes


def without_refused(text: str, key: str, before: Mapping[str, Any]) -> tuple[str, list[str]]:
    """A text without what was refused at a key, where that is as it was before; the same text where nothing is."""
    after = toml.parse(text)
    steps = _entry(key, after)
    if steps is None or found_at(after, steps) != found_at(before, _entry(key, before) or steps):
        return text, []
    return _without(text, steps, [])


def _sources(raw: Mapping[str, Any]) -> Iterator[str]:
    """The sources of a file, without those that are parts of others."""
    for section, keys in MAKERS.items():
        for name, own in table_at(raw, section).items():
            if isinstance(own, Mapping):
                yield from (name + more for key, more in keys.items() if own.get(key) is not None)


def _is_of(name: str, source: str) -> bool:
    return name == source or any(name.startswith(source + part) for part in (*PARTS, ".backlash."))


def _changed_way(name: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Whether a price is of what a clearance is no more: fits, groups of bearings, or sizes."""
    ways = [_way(found_at(raw, ("joints", name, "clearance"))) for raw in (before, after)]
    choices = found_at(after, ("costs", name, "choices"))
    own = {way for one in choices or () if isinstance(one, Mapping) for way in ("fit", "bearing", "size") if way in one}
    return None not in ways and ways[0] != ways[1] and own == {ways[0]}


def _way(play: Any) -> str | None:
    if is_number(play) or isinstance(play, str):
        return "size"
    return next((way for way in ("fit", "bearing") if way in play), "size") if isinstance(play, Mapping) else None


def _uncorrelated(text: str, lost: set[str], notes: list[str]) -> tuple[str, list[str]]:
    """A text whose correlations are of sources that are there; of fewer than two there is none."""
    found = toml.parse(text).get("correlations")
    entries: list[Any] = found if isinstance(found, list) else []
    for k in reversed(range(len(entries))):
        sources = found_at(entries, (k, "sources"))
        if not isinstance(sources, list):
            continue
        left = [name for name in sources if not any(_is_of(str(name), source) for source in lost)]
        if left == sources:
            continue
        if len(left) < 2 or "ranks" in entries[k]:
            text, notes = _without(text, ("correlations", k), notes)
        else:
            text = document.edited(text, ("correlations", k, "sources"), left)
    return text, notes


def _leads(raw: Mapping[str, Any], key: str) -> bool:
    """Whether a dotted key leads to a value that is there."""
    try:
        return any(found_at(raw, steps) is not None for steps in expand(copy.deepcopy(raw), key, ""))
    except InputError:
        return False


def _entry(key: str, raw: Mapping[str, Any]) -> Steps | None:
    """What speaks of others at a dotted key; None where nothing does."""
    for steps in NAMED:
        head = ".".join(map(str, steps)) + "."
        names = [name for name in table_at(raw, *steps) if f"{key}.".startswith(f"{head}{name}.")]
        if names:
            return (*steps, max(names, key=len))
    first, *rest = key.split(".")
    if first == "correlations" and rest and rest[0].isdigit():
        return ("correlations", int(rest[0]))
    if first == "outputs" and rest[1:2] == ["target"]:
        return ("outputs", rest[0], "target")
    return (first,) if first in WHOLE and first in raw else None


def _without(text: str, steps: Steps, notes: list[str]) -> tuple[str, list[str]]:
    """A text without a value; tables that nothing else is in go with it."""
    raw = toml.parse(text)
    name = ".".join(map(str, steps))
    return document.edited(text, with_tables(raw, steps), None), [*notes, f"{name} went with it."]
