"""Names within a pattern: what belongs to it gets the number of the copy, what is shared or outside keeps its name.

A name means one thing: what belongs to the pattern is not given outside, and the names of its copies are not taken.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jointplay.errors import InputError, not_known
from jointplay.file.schema import Backlash, PatternTable

GROUND = "ground"
#: a point of the output among the two of a dimension
OUTPUT = "output"
#: sections whose entries have names, apart from those of bodies
NAMED = ("joints", "drives", "followers", "dimensions", "links", "springs")
#: axes of a load: those of its body
OF_BODY = "body"
#: keys whose value is the name of a body
BODY_KEYS = ("body", "relative_to")
#: sections whose entries are called as the body
OF_BODIES = ("bodies", "start")


class PatternNames:
    """The names of one pattern.

    Parameters
    ----------
    pattern : str
        Its name.
    table : PatternTable
        One of its copies, checked.
    count : int
        How many copies there are.
    file : str
        For messages.

    Raises
    ------
    InputError
        When a shared body is in no joint of it, or something is said of a body that is not its own.
    """

    def __init__(self, pattern: str, table: PatternTable, count: int, file: str) -> None:
        self.pattern = pattern
        self.table = table
        self.count = count
        self.file = file
        #: bodies of its own, each with the joint that names it first
        self.bodies: dict[str, str] = {}
        in_joints = {body for joint in table.joints.values() for body in joint.names}
        for name, joint in table.joints.items():
            for body in joint.names:
                if body != GROUND and body not in table.shared:
                    self.bodies.setdefault(body, name)
        for number, body in enumerate(table.shared):
            if body not in in_joints:
                raise self.refusing(f"shared.{number}")(not_known(body, "a body of the pattern's joints", in_joints))
        for section in OF_BODIES:
            for body in getattr(table, section):
                if body in (GROUND, *table.shared):
                    problem = f"'{body}' is shared by all copies; what is said of it stands outside the pattern"
                    raise self.refusing(f"{section}.{body}")(problem)
                if body not in self.bodies:
                    raise self.refusing(f"{section}.{body}")(not_known(body, "a body of the pattern", self.bodies))
        self.known_bodies = {GROUND, *self.bodies, *table.shared}
        self.known_joints = {*table.joints}

    def refusing(self, key: str) -> Callable[[str], InputError]:
        """Makes the error for a key within the pattern."""
        return lambda problem: InputError(problem, file=self.file, key=f"patterns.{self.pattern}.{key}")

    def own(self, section: str) -> list[str]:
        """The names of a section that belong to the pattern."""
        return list(self.bodies) if section in OF_BODIES else list(getattr(self.table, section))

    def copies(self, section: str) -> Iterator[tuple[str, str]]:
        """The names of all copies in a section, each with that of the pattern."""
        return ((f"{name}_{k}", name) for name in self.own(section) for k in range(1, self.count + 1))

    def check(self, data: Mapping[str, Any], others: Sequence[PatternNames]) -> None:
        """Refuse names that are given outside, and know those that are."""
        outside = bodies_outside(data)
        shared = {body for other in others for body in other.table.shared}
        for body, joint in self.bodies.items():
            if body in outside | shared:
                raise self.refusing(f"joints.{joint}")(
                    f"'{body}' is a body outside the pattern, too; if it is the same one, write shared = [\"{body}\"],"
                    " otherwise use another name"
                )
        for section in NAMED:
            given = data.get(section)
            for name in self.own(section):
                if isinstance(given, Mapping) and name in given:
                    raise self.refusing(f"{section}.{name}")(
                        f"'{name}' is given outside the pattern, too; use another name"
                    )
        for section in (*NAMED, OF_BODIES[0]):
            taken = {copy: f"pattern {other.pattern}" for other in others for copy, _ in other.copies(section)}
            # What the file says of the body of a copy is said of that copy.
            given = data.get(section) if section in NAMED else None
            taken |= dict.fromkeys(given if isinstance(given, Mapping) else (), "the file")
            for copy, name in self.copies(section):
                if copy in taken:
                    key = f"{section}.{name}" if section in NAMED else f"joints.{self.bodies[name]}"
                    problem = (
                        f"a copy of '{name}' is called '{copy}', which {taken[copy]} has already; use another name"
                    )
                    raise self.refusing(key)(problem)
        joints = data.get("joints")
        self.known_bodies |= outside | {copy for other in others for copy, _ in other.copies("bodies")}
        self.known_joints |= {*joints} if isinstance(joints, Mapping) else set()
        self.known_joints |= {copy for other in others for copy, _ in other.copies("joints")}

    def of(self, number: int) -> NamesOfCopy:
        """The names of one copy."""
        return NamesOfCopy(self, number)


def bodies_in_joints(data: Mapping[str, Any]) -> set[str]:
    """The bodies of the joints of a file."""
    joints = data.get("joints")
    tables = joints.values() if isinstance(joints, Mapping) else ()
    lists = (joint.get(key) for joint in tables if isinstance(joint, Mapping) for key in ("on", "bodies"))
    return {body for names in lists if isinstance(names, Mapping | list) for body in names if isinstance(body, str)}


def bodies_outside(data: Mapping[str, Any]) -> set[str]:
    """The bodies that a file speaks of."""
    named = {*_said(data)} | bodies_in_joints(data)
    for section in OF_BODIES:
        found = data.get(section)
        named |= {*found} if isinstance(found, Mapping) else set()
    return named


def _said(node: Any) -> Iterator[str]:
    """What tables call a body, such as those of outputs, loads and dimensions."""
    if isinstance(node, Mapping):
        yield from (node[word] for word in BODY_KEYS if isinstance(node.get(word), str))
    below = node.values() if isinstance(node, Mapping) else node if isinstance(node, list) else ()
    for value in below:
        yield from _said(value)


@dataclass(frozen=True)
class NamesOfCopy:
    """Gives what a copy says the names of the copy."""

    names: PatternNames
    number: int

    def own(self, name: str) -> str:
        """A name that belongs to the pattern."""
        return f"{name}_{self.number}"

    def body(self, name: str, key: str) -> str:
        """A body: of the copy, shared, or outside.

        Raises
        ------
        InputError
            When there is no such body.
        """
        if name not in self.names.known_bodies:
            problem = not_known(name, "a body of the pattern or of the file", sorted(self.names.known_bodies))
            raise self.names.refusing(key)(problem)
        return self.own(name) if name in self.names.bodies else name

    def joint(self, name: str, key: str) -> str:
        """A joint, ``PIN/BODY`` or ``CROSS.first`` included: of the copy, or outside.

        Raises
        ------
        InputError
            When there is no such joint.
        """
        head, mark, tail = re.fullmatch(r"([^/.]*)([/.]?)(.*)", name, re.DOTALL).groups()  # type: ignore[union-attr]
        if head not in self.names.known_joints:
            problem = not_known(head, "a joint of the pattern or of the file", sorted(self.names.known_joints))
            raise self.names.refusing(key)(problem)
        if head not in self.names.table.joints:
            return name
        return self.own(head) + mark + (self.body(tail, key) if mark == "/" else tail)

    def drive(self, name: str, key: str) -> str:
        """A drive of the copy.

        Raises
        ------
        InputError
            When there is no such drive.
        """
        if name not in self.names.table.drives:
            raise self.names.refusing(key)(not_known(name, "a drive of the pattern", self.names.table.drives))
        return self.own(name)

    def in_joint(self, joint: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A joint that names the bodies of the copy."""
        new = dict(joint)
        for word in ("on", "runout", "marks", "position", "direction"):
            if word in joint:
                new[word] = {self.body(body, f"{key}.{word}.{body}"): value for body, value in joint[word].items()}
        if "bodies" in joint:
            new["bodies"] = [self.body(body, f"{key}.bodies") for body in joint["bodies"]]
        return new

    def in_drive(self, drive: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A drive that moves the joints of the copy."""
        new = dict(drive)
        if "joint" in drive:
            new["joint"] = self.joint(drive["joint"], f"{key}.joint")
        for word in ("joints", "backlash", "stiffness"):
            if isinstance(drive.get(word), dict) and not {*drive[word]} <= {*Backlash.model_fields}:
                new[word] = {self.joint(name, f"{key}.{word}.{name}"): value for name, value in drive[word].items()}
        return new

    def in_follower(self, follower: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A follower between joints of the copy."""
        return {**follower, **{word: self.joint(follower[word], f"{key}.{word}") for word in ("joint", "follows")}}

    def in_spring(self, spring: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A spring between bodies of the copy, or about one of its joints."""
        new = dict(spring)
        if "on" in spring:
            new["on"] = {
                self.body(body, f"{key}.on.{body}"): self.joint(at, f"{key}.on.{body}") if isinstance(at, str) else at
                for body, at in spring["on"].items()
            }
        if "joint" in spring:
            new["joint"] = self.joint(spring["joint"], f"{key}.joint")
        return new

    def in_table(self, table: Mapping[str, Any], key: str) -> dict[str, Any]:
        """A load, a dimension or a link of the bodies and joints of the copy."""
        new = dict(table)
        if "body" in table:
            new["body"] = self.body(table["body"], f"{key}.body")
        if table.get("axes", OF_BODY) not in (OF_BODY, GROUND):
            new["axes"] = self.body(table["axes"], f"{key}.axes")
        if isinstance(table.get("at"), str):
            new["at"] = self.joint(table["at"], f"{key}.at")
        if "between" in table:
            ends = enumerate(table["between"])
            new["between"] = [end if end == OUTPUT else self.joint(end, f"{key}.between.{k}") for k, end in ends]
        return new
