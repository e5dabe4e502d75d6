"""Mechanisms of Pyslvs: an expression in project files (`.pyslvs`), which has a joint with its links for each point.

    M[J[R, color[Green], P[0, 0], L[ground, link_0]], J[RP, A[30], P[9, 3], L[ground, link_0]], ...]

R is a pin; RP is a pin in a slot of the first link, P a slider that does not turn in it, both along the angle A in
degrees. The format has no unit: its lengths are read as mm.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointplay.errors import InputError, in_range, listed, shown
from jointplay.file import toml

from .fcstd import MM
from .options import Options
from .pins import pins, require_connected
from .skeleton import GROUND, Attachment, Body, Frame, Joint, Skeleton, Vector
from .xml import Reading

#: points of a mechanism
MOST_POINTS = 1000
COMMENT = re.compile(r"#[^\n]*")
START, BETWEEN, END = re.compile(r"\bM\["), re.compile(r"[\s,]*"), re.compile(r"\]")
_LIST = r"\[([^\[\]]*)\]\s*"
POINT = re.compile(rf"J\[\s*(RP|R|P)\s*,\s*(?:A{_LIST},\s*)?(?:color{_LIST},\s*)?P{_LIST},\s*L{_LIST},?\s*\]")


@dataclass(frozen=True)
class LinkedPoint:
    """A point with the links that meet in it."""

    name: str
    kind: str
    at: Vector
    links: tuple[str, ...]
    along: Vector


def read(path: Path, options: Options) -> Skeleton:
    """The mechanism of a project.

    Raises
    ------
    InputError
        When it has none, or nothing joins a link with the ground.
    """
    name, text = toml.read(path, "project of Pyslvs")
    points = [*_points(Reading(name), COMMENT.sub("", text))]
    links = list(dict.fromkeys(link for point in points for link in point.links))
    if GROUND not in links:
        raise InputError("has no link called ground", file=name)
    joints = [joint for point in points for joint in _joints(point)]
    in_range(len(joints), "", "a number of joints that is read", 0, MOST_POINTS)
    require_connected(links, GROUND, joints)
    # A point is carried by the link that is farthest from the ground in its list.
    frames = {
        point.name: (point.links[-1], Frame(point.at)) for point in points if point.links and point.links != (GROUND,)
    }
    tracked = [point.name for point in points if len(point.links) == 1 and point.links != (GROUND,)]
    if options.output is None:
        if len(tracked) != 1:
            raise InputError(f"which point is it? Name one of {listed(frames)}", file=name, key="output")
        frames["output"] = frames[tracked[0]]
    return Skeleton(
        title=path.stem,
        bodies={link: Body() for link in links},
        joints=tuple(joints),
        space="planar",
        frames=frames,
        has_origins=False,
        gravity=(0.0, 0.0, 0.0),
        notes=("Pyslvs has no units: its lengths are read as mm.",),
    )


def _points(reading: Reading, text: str) -> Iterator[LinkedPoint]:
    start = START.search(text)
    if start is None:
        raise reading.refuse("has no mechanism of Pyslvs: an expression M[J[R, P[0, 0], L[ground, link_0]], ...]")
    place = start.end()
    for number in range(MOST_POINTS + 1):
        between = BETWEEN.match(text, place)
        place = place if between is None else between.end()
        if END.match(text, place):
            return
        in_range(number, "", "a number of points that is read", 0, MOST_POINTS - 1)
        name = f"Point{number}"
        found = POINT.match(text, place)
        if found is None:
            raise reading.refuse(f"is no joint of Pyslvs: {shown(text[place : place + 60])}", name)
        kind, angle, _, at, links = found.groups()
        x, y = reading.numbers(at.replace(",", " "), 2, name) * MM
        if kind != "R" and angle is None:
            raise reading.refuse(f"a joint {kind} needs the angle of its slot: A[30]", name)
        turn = np.radians(reading.number(angle, 0.0, name))
        named = tuple(dict.fromkeys(word.strip() for word in links.split(",") if word.strip()))
        yield LinkedPoint(name, kind, np.array([x, y, 0.0]), named, np.array([np.cos(turn), np.sin(turn), 0.0]))
        place = found.end()


def _joints(point: LinkedPoint) -> Iterator[Joint]:
    if point.kind == "R":
        yield from pins(point.name, point.links, point.at)
        return
    slot, *others = point.links or ("",)
    if not others:
        return
    kind = "prismatic" if point.kind == "P" else "pin_in_slot"
    sliding: Sequence[str] = others if point.kind == "P" else others[:1]
    for number, link in enumerate(sliding, 1):
        own = point.name if number == 1 else f"{point.name}_{number}"
        yield Joint(own, kind, (slot, link), Attachment(point.at, point.along))
    if point.kind == "RP":
        yield from pins(f"{point.name}_pin", others, point.at)
