"""Assemblies of FreeCAD's own workbench, 1.0 and later; the drawing is the saved placements.

A joint names two objects by their paths in the assembly, the moving part first, and has a frame on each: `Placement1`
and `Placement2`, in the axes of the object that the path ends at, offsets included. Its z axis is that of the joint.
With the frames F1 and F2 in the drawing, what joints measure is that of the second part in F1,

    travel = z1 . (o2 - o1),    angle = atan2(y1 . x2, x1 . x2)

Constraints that are no joint by themselves become joints in series, with massless bodies between them: a distance of
two points is a rod between two balls. How they are meant is in `constraints`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np

from jointplay.basics.files import is_within
from jointplay.errors import InputError, listed, not_known, shown
from jointplay.file.toml import MOST_FILES

from .fcstd import MM, Archive, Budget, Item
from .options import Options
from .skeleton import Attachment, Body, Frame, Joint, Skeleton, fixed, floating, free

#: the fixed body
WORLD = "world"
ASSEMBLY, SUBASSEMBLY = "Assembly::AssemblyObject", "Assembly::AssemblyLink"
LINK, JOINTS = "App::Link", "Assembly::JointGroup"
#: what contains others and moves nothing, what contains others in axes of its own
GROUPS = ("App::DocumentObjectGroup", "App::DocumentObjectGroupPython", "App::LinkGroup")
CONTAINERS = ("App::Part", ASSEMBLY, SUBASSEMBLY)
#: links that lead to links
LONGEST_CHAIN = 50
#: joints as the mechanism file has them
KINDS = {
    "Fixed": "fixed",
    "Revolute": "revolute",
    "Cylindrical": "cylindrical",
    "Slider": "prismatic",
    "Ball": "spherical",
}
#: how far a joint may be open in the drawing: m, rad
OPEN = 1e-6


@dataclass(frozen=True)
class End:
    """One side of a joint.

    Attributes
    ----------
    part : str
        Name of the body.
    frame : Frame
        The joint's frame in the drawing.
    owner : Frame
        That of the object whose element it names.
    archive, item
        Where this object is; what a link leads to.
    element : str
        Such as ``Face3``.
    """

    part: str
    frame: Frame
    owner: Frame
    archive: Archive | None
    item: Item | None
    element: str

    @property
    def axis(self) -> np.ndarray:
        """Direction of the joint."""
        return self.frame.axes[:, 2]


def read(path: Path, options: Options) -> Skeleton:
    """An assembly.

    Raises
    ------
    InputError
        When the document has none, or a joint that is not read.
    """
    return _Assembly(path).skeleton(options.ground)


class _Assembly:
    """One assembly on its way to a skeleton."""

    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self.budget = Budget()
        self.archive = Archive(path, self.budget)
        self.others: dict[str, Archive | None] = {}
        self.reading = self.archive.reading
        self.items = self.archive.items
        self.notes: list[str] = []
        self.top = self._chosen()
        self.bodies: dict[str, Body] = {WORLD: Body()}
        #: names of bodies by those of objects
        self.parts: dict[str, str] = {}
        self.ends: dict[str, tuple[End, End]] = {}

    def _chosen(self) -> Item:
        """The assembly that is read: no other one has it inside."""
        every = [item for item in self.items.values() if item.kind == ASSEMBLY]
        if not every:
            kinds = "an assembly, which FreeCAD's own workbench makes since version 1.0"
            raise self.reading.refuse(f"has no object that is {kinds}")
        links = (item.linked() for item in self.items.values() if item.kind in (LINK, SUBASSEMBLY))
        inside = {name for file, name in (link for link in links if link) if not file}
        inside |= {name for item in every for name in item.links("Group")}
        outer = [item for item in every if item.name not in inside] or every
        found = max(outer, key=lambda item: len(list(self._joint_items(item))))
        if len(outer) > 1:
            others = [item.label for item in outer if item is not found]
            self.notes.append(f"The assembly '{found.label}' is read, and others are left out: {listed(others)}.")
        return found

    # --- objects ----------------------------------------------------------------------------------------------------

    def _members(self, item: Item) -> Iterator[Item]:
        """What an assembly has in it, with what groups and flexible assemblies in it have."""
        waiting, seen = [item.name], {item.name}
        for name in waiting:
            for inner in self.items[name].links("Group"):
                if inner in self.items and inner not in seen:
                    seen.add(inner)
                    found = self.items[inner]
                    yield found
                    if found.kind in (*GROUPS, JOINTS) or _is_flexible(found):
                        waiting.append(inner)

    def _joint_items(self, item: Item) -> Iterator[Item]:
        for found in self._members(item):
            if "JointType" in found.properties or "ObjectToGround" in found.properties:
                yield found

    def _part(self, item: Item, frame: Frame) -> str:
        """Name of the body of an object."""
        if item.name not in self.parts:
            name = free(item.label, self.bodies)
            self.parts[item.name] = name
            self.bodies[name] = Body(frame)
        return self.parts[item.name]

    def _other(self, file: str) -> Archive | None:
        """Another document, which has to be in the folder or below it; None where it is not there."""
        if file not in self.others:
            if len(self.others) >= MOST_FILES:
                raise self.reading.refuse(f"names more than {MOST_FILES} other documents")
            parts = PurePosixPath(file.replace("\\", "/"))
            place = self.folder / parts
            inside = not parts.is_absolute() and ".." not in parts.parts and ":" not in file and "\0" not in file
            there = inside and is_within(place, self.folder) and place.is_file()
            self.others[file] = Archive(place, self.budget) if there else None
        return self.others[file]

    def _shown(self, archive: Archive, item: Item) -> tuple[Archive | None, Item | None]:
        """What a link leads to, links of links followed; None where its document is not there."""
        here: Archive | None = archive
        found: Item | None = item
        for _ in range(LONGEST_CHAIN):
            if here is None or found is None or found.kind != LINK:
                return here, found
            to = found.linked()
            if to is None:
                return here, None
            here = self._other(to[0]) if to[0] else here
            found = None if here is None else here.items.get(to[1])
        raise self.reading.refuse(f"links lead to one another in a circle, or more than {LONGEST_CHAIN} deep", item.place)

    def _frame(self, archive: Archive, item: Item) -> Frame:
        """Where an object is in what contains it."""
        own = item.frame("Placement")
        if item.kind == LINK and item.holds("LinkTransform"):
            _, shown_item = self._shown(archive, item)
            own = own if shown_item is None else own @ shown_item.frame("Placement")
        return own

    def _end(self, joint: Item, number: int) -> End | None:
        """One side of a joint; None where it names nothing that is in the assembly."""
        key = f"Reference{number}"
        reference = joint.reference(key)
        if reference is None:
            return None
        archive: Archive | None = self.archive
        frame, part, passed, found = Frame(), None, False, None
        for name in (reference.root, *reference.path):
            item = None if archive is None else archive.items.get(name)
            if item is None or archive is None:
                if found is not None and archive is not None:
                    # Features of a body, and names of faces that begin with a sign.
                    break
                where = "in a document that is not in this folder" if archive is None else "not in the document"
                raise self.reading.refuse(f"names {shown(name)}, which is {where}", joint.place, key)
            if item is self.top:
                frame, passed = self._frame(archive, item), True
                continue
            if not passed or item.kind in GROUPS[:2]:
                continue
            frame = frame @ self._frame(archive, item)
            if part is None and not _is_flexible(item) and item.kind not in GROUPS:
                part = self._part(item, frame)
            archive, found = self._shown(archive, item)
            if found is not None and found.kind not in (*CONTAINERS, *GROUPS):
                break
        if part is None:
            return None
        return End(part, frame @ joint.frame(f"Placement{number}"), frame, archive, found, reference.element)

    # --- all of it --------------------------------------------------------------------------------------------------

    def skeleton(self, ground: str | None) -> Skeleton:
        """All of it."""
        joints = [*self._grounded(ground), *self._joints()]
        for name, item in ((item.name, item) for item in self._members(self.top)):
            self._unjoined(name, item)
        if not any(WORLD in joint.bodies for joint in joints):
            del self.bodies[WORLD]
        fixed_body = WORLD if WORLD in self.bodies else self._fixed(ground)
        loose = [name for group in floating(self.bodies, joints, fixed_body) for name in group]
        if loose:
            self.notes.append(f"Nothing holds these parts to what is fixed, and they are left out: {listed(loose)}.")
        return Skeleton(
            title=self.top.label if self.top.label != "Assembly" else self.archive.path.stem,
            bodies={name: body for name, body in self.bodies.items() if name not in loose},
            joints=tuple(joint for joint in joints if joint.bodies[0] not in loose),
            ground=fixed_body,
            notes=tuple(self.notes),
        )

    def _unjoined(self, name: str, item: Item) -> None:
        """Take over a part without a joint, so that it can be said that it is left out."""
        if "Placement" in item.properties and name not in self.parts and not _is_flexible(item):
            if item.kind.startswith(("Part::", "PartDesign::Body", "App::Part", LINK, SUBASSEMBLY)):
                self._part(item, self._frame(self.archive, self.top) @ self._frame(self.archive, item))

    def _fixed(self, ground: str | None) -> str:
        """The part that is fixed where nothing is grounded."""
        if ground is not None:
            return next(iter(self.bodies))
        if not self.bodies:
            raise self.reading.refuse("its assembly has no parts", self.top.place)
        found = next(iter(self.bodies))
        self.notes.append(f"Nothing is grounded: '{found}' is fixed, and --ground names another part.")
        return found

    def _grounded(self, ground: str | None) -> Iterator[Joint]:
        """Parts that are fixed, unless another one is to be."""
        for joint in self._joint_items(self.top):
            for name in joint.links("ObjectToGround"):
                item = self.items.get(name)
                if item is not None and ground is None and not _is_flexible(item):
                    frame = self._frame(self.archive, self.top) @ self._frame(self.archive, item)
                    yield fixed(WORLD, self._part(item, frame))

    def _joints(self) -> list[Joint]:
        suppressed, incomplete, made = [], [], []
        labels: Counter[str] = Counter()
        for item in self._joint_items(self.top):
            kind = item.choice("JointType")
            if not kind:
                continue
            labels[item.label] += 1
            name = item.label if labels[item.label] == 1 else f"{item.label}_{labels[item.label]}"
            if item.holds("Suppressed") or not item.holds("Activated", default=True):
                suppressed.append(name)
                continue
            one, other = self._end(item, 1), self._end(item, 2)
            if one is None or other is None or one.part == other.part:
                incomplete.append(name)
                continue
            made += self._made(name, kind, item, one, other)
        if suppressed:
            self.notes.append(f"Suppressed joints are left out: {listed(suppressed)}.")
        if incomplete:
            self.notes.append(f"Joints that do not name two parts are left out: {listed(incomplete)}.")
        if not made:
            raise self.reading.refuse("its assembly has no joints", self.top.place)
        return made

    def _made(self, name: str, kind: str, item: Item, one: End, other: End) -> Iterator[Joint]:
        if kind not in KINDS:
            raise self.reading.refuse(not_known(kind, "a joint that is read", KINDS), item.place)
        yield self._plain(name, KINDS[kind], item, one, other)

    def _plain(self, name: str, kind: str, item: Item, one: End, other: End) -> Joint:
        """A joint that the mechanism file has."""
        bodies = (one.part, other.part)
        if kind == "fixed":
            return Joint(name, kind, bodies, Attachment(one.frame.at))
        if kind == "spherical":
            return Joint(name, kind, bodies, Attachment(one.frame.at), Attachment(other.frame.at))
        along = float(np.sign(one.axis @ other.axis)) or 1.0
        travel = float(one.axis @ (other.frame.at - one.frame.at))
        seen = one.frame.axes.T @ other.frame.axes[:, 0]
        angle = math.atan2(seen[1], seen[0])
        return Joint(
            name,
            kind,
            bodies,
            Attachment(one.frame.at, one.axis),
            Attachment(other.frame.at, along * other.axis),
            coordinate=angle if kind == "revolute" else travel,
            limits=_limits(item, "Angle", math.pi / 180) if kind == "revolute" else _limits(item, "Length", MM),
        )


def _is_flexible(item: Item) -> bool:
    """Whether it is an assembly whose parts move by themselves."""
    return item.kind == SUBASSEMBLY and not item.holds("Rigid", default=True)


def _limits(item: Item, what: str, unit: float) -> tuple[float, float] | None:
    """The range of a coordinate; an end that is not there is infinite."""
    low, high = (
        item.number(f"{what}{end}") * unit if item.holds(f"Enable{what}{end}") else sign * math.inf
        for end, sign in (("Min", -1.0), ("Max", 1.0))
    )
    if math.isinf(low) and math.isinf(high):
        return None
    return min(low, high), max(low, high)
