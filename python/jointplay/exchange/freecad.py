"""Assemblies of FreeCAD's own workbench, 1.0 and later; the drawing is the saved placements.

A joint names two objects by their paths in the assembly, the moving part first, and has a frame on each: `Placement1`
and `Placement2`, in the axes of the object that the path ends at, offsets included. Its z axis is that of the joint.
What joints measure is in `assembling`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path, PurePosixPath

import numpy as np

from jointplay.basics.files import is_within
from jointplay.errors import listed, not_known, shown

from .assembling import SKEW, AssemblyDraft, JointEnd
from .brep import PartShape, ShapeElement, Unreadable
from .constraints import Chain, at_a_distance, at_an_angle, form_of
from .fcstd import MM, Archive, Budget, DocumentItem, shape_member
from .options import Options
from .pairing import balls, bores, pair
from .silhouettes import facets
from .skeleton import Body, Facets, Frame, Joint, PinAndHole, Skeleton, fixed, free
from .solids import SolidPart, solid

#: the fixed body
WORLD = "world"
ASSEMBLY, SUBASSEMBLY = "Assembly::AssemblyObject", "Assembly::AssemblyLink"
LINK, JOINTS = "App::Link", "Assembly::JointGroup"
#: links, and those that an array has in it
LINKS = (LINK, "App::LinkElement")
#: what contains others and moves nothing, what contains others in axes of its own
GROUPS = ("App::DocumentObjectGroup", "App::DocumentObjectGroupPython", "App::LinkGroup")
CONTAINERS = ("App::Part", ASSEMBLY, SUBASSEMBLY)
BODY = "PartDesign::Body"
#: what a joint of a body can be on besides its faces: it has a placement in the body, and may be inside of another one
DATUMS = (
    "Sketcher::SketchObject",
    *(f"App::{kind}" for kind in ("LocalCoordinateSystem", "Origin", "Point", "Line", "Plane")),
    *(f"PartDesign::{kind}" for kind in ("CoordinateSystem", "Point", "Line", "Plane")),
)
#: links that lead to links, and documents of an assembly
LONGEST_CHAIN, MOST_DOCUMENTS = 50, 500
#: objects that a reference names, one inside of the other
LONGEST_PATH = 200
#: kg/m^3, twice as dense as any metal
DENSEST = 5e4
#: what has a volume and an outline
KINDS_READ = "closed shapes of planes, cylinders, cones, spheres and tori"
#: joints as the mechanism file has them
KINDS = {
    "Fixed": "fixed",
    "Revolute": "revolute",
    "Cylindrical": "cylindrical",
    "Slider": "prismatic",
    "Ball": "spherical",
}
#: the same of constraints that hold directions only: rad
ANGLES = {"Parallel": 0.0, "Perpendicular": math.pi / 2, "Angle": math.nan}
TYPES = (*KINDS, *ANGLES, "Distance", "RackPinion", "Screw", "Gears", "Belt")


@dataclass(frozen=True)
class Side(JointEnd):
    """One side of a joint, with what it names."""

    #: that of the object whose element it names
    owner: Frame
    #: `archive`, `item`: where this object is; what a link leads to
    archive: Archive | None
    item: DocumentItem | None
    #: such as ``Face3``
    element: str


def read(path: Path, options: Options) -> Skeleton:
    """An assembly.

    Raises
    ------
    InputError
        When the document has none, or a joint that is not read.
    """
    return _Assembly(path).skeleton(options)


class _Assembly(AssemblyDraft):
    """One assembly on its way to a skeleton."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.budget = Budget()
        self.archive = Archive(path, self.budget)
        self.others: dict[Path, Archive] = {}
        self.reading = self.archive.reading
        self.items = self.archive.items
        self.top = self._chosen()
        self.bodies[WORLD] = Body()
        #: names of bodies by those of objects
        self.parts: dict[str, str] = {}
        self.shapes: dict[tuple[str, str], PartShape | None] = {}
        #: sleeves with limits of their angle
        self.turning: list[str] = []
        #: documents that are named and not there
        self.gone: dict[str, None] = {}
        #: objects whose shape is damaged, too long or of another version
        self.unread: list[str] = []
        #: what the bodies show
        self.shown: dict[str, DocumentItem] = {}

    def _chosen(self) -> DocumentItem:
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

    def _members(self, item: DocumentItem) -> Iterator[DocumentItem]:
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

    def _joint_items(self, item: DocumentItem) -> Iterator[DocumentItem]:
        for found in self._members(item):
            if "JointType" in found.properties or "ObjectToGround" in found.properties:
                yield found

    def _part(self, item: DocumentItem, frame: Frame) -> str:
        """Name of the body of an object."""
        if item.name not in self.parts:
            if item.kind in LINKS and any(abs(scale - 1.0) > SKEW for scale in item.scales()):
                size = ", ".join(f"{scale:g}" for scale in item.scales())
                problem = f"is a link with a scale ({size}), which is not read; give the part its size"
                raise self.reading.refuse(problem, item.place)
            name = free(item.label, self.bodies)
            self.parts[item.name] = name
            self.bodies[name] = Body(frame)
            self.shown[name] = item
        return self.parts[item.name]

    def _other(self, archive: Archive, file: str) -> Archive | None:
        """A document that another one names, in the folder or below it; None where it is not there."""
        parts = PurePosixPath(file.replace("\\", "/"))
        inside = not parts.is_absolute() and ".." not in parts.parts and ":" not in file and "\0" not in file
        place = archive.path.parent / parts
        if not inside or not is_within(place, self.archive.path.parent) or not place.is_file():
            self.gone[shown(file)] = None
            return None
        if place not in self.others:
            if len(self.others) >= MOST_DOCUMENTS:
                raise self.reading.refuse(f"names more than {MOST_DOCUMENTS} other documents")
            self.others[place] = Archive(place, self.budget)
        return self.others[place]

    def _shown(self, archive: Archive, item: DocumentItem) -> tuple[Archive | None, DocumentItem | None]:
        """What a link leads to, links of links followed; None where its document is not there."""
        here: Archive | None = archive
        found: DocumentItem | None = item
        for _ in range(LONGEST_CHAIN):
            if here is None or found is None or found.kind not in LINKS or _is_array(found):
                return here, found
            to = found.linked()
            if to is None:
                return here, None
            here = self._other(here, to[0]) if to[0] else here
            found = None if here is None else here.items.get(to[1])
        raise self.reading.refuse(
            f"links lead to one another in a circle, or more than {LONGEST_CHAIN} deep", item.place
        )

    def _frame(self, archive: Archive, item: DocumentItem) -> Frame:
        """Where an object is in what contains it."""
        own = item.frame("Placement")
        if item.kind in LINKS and item.holds("LinkTransform"):
            _, shown_item = self._shown(archive, item)
            own = own if shown_item is None else own @ shown_item.frame("Placement")
        return own

    def _end(self, joint: DocumentItem, number: int) -> Side | None:
        """One side of a joint; None where it names nothing that is in the assembly."""
        key = f"Reference{number}"
        reference = joint.reference(key)
        if reference is None:
            return None
        archive: Archive | None = self.archive
        names = (reference.root, *reference.path)
        if len(names) > LONGEST_PATH:
            raise self.reading.refuse(f"names more than {LONGEST_PATH} objects inside one another", joint.place, key)
        # Since version 1.1 the path begins at the part that moves, before that at the assembly or outside of it.
        passed = self.top.name not in names
        frame = self._frame(self.archive, self.top) if passed else Frame()
        part, found, file = None, None, ""
        for name in names:
            item = None if archive is None else archive.items.get(name)
            if item is None or archive is None:
                if found is not None and archive is not None:
                    # Features of a body, and names of faces that begin with a sign.
                    break
                where = "not in the document"
                if archive is None:
                    where = f"in {shown(file)}, which is no file in this folder or below it, named without '..'"
                raise self.reading.refuse(f"names {shown(name)}, which is {where}", joint.place, key)
            if found is not None and found.kind in (BODY, *DATUMS) and item.kind not in DATUMS:
                # Features of a body have its axes.
                break
            if item is self.top:
                frame, passed = self._frame(archive, item), True
                continue
            if not passed or item.kind in GROUPS[:2]:
                continue
            frame = frame @ self._frame(archive, item)
            if part is None and not _is_flexible(item) and not _is_array(item) and item.kind not in GROUPS:
                part = self._part(item, frame)
            file = (item.linked() or ("",))[0]
            archive, found = self._shown(archive, item)
            if found is not None and found.kind not in (*CONTAINERS, *GROUPS, BODY, *DATUMS) and not _is_array(found):
                break
        if part is None:
            return None
        return Side(part, frame @ joint.frame(f"Placement{number}"), frame, archive, found, reference.element)

    # --- all of it --------------------------------------------------------------------------------------------------

    def skeleton(self, options: Options) -> Skeleton:
        """All of it."""
        held = list(dict.fromkeys(self._grounded()))
        # A mechanism has the axes of what is fixed, and those of the assembly where several parts are.
        is_world = len(held) > 1 and options.ground is None
        joints = [fixed(WORLD, name) for name in held] if is_world else [fixed(held[0], name) for name in held[1:]]
        joints += self._joints()
        for item in self._members(self.top):
            self._unjoined(item)
        if not is_world:
            del self.bodies[WORLD]
        base = WORLD if is_world else self._fixed(options.ground, held)
        if options.density:
            self._weigh(options.density, base)
        if options.planar:
            self._outline()
        title = self.top.label if self.top.label != "Assembly" else self.archive.path.stem
        return self.closed(title, joints, base)

    # --- masses -----------------------------------------------------------------------------------------------------

    def _weigh(self, density: Mapping[str, float], base: str) -> None:
        """Give the parts the masses of their shapes; what is fixed needs none."""
        for name, value in density.items():
            if name and name not in self.shown:
                raise self.reading.refuse(not_known(name, "a part", self.shown), "density")
            if not 0.0 < value <= DENSEST:
                raise self.reading.refuse(
                    f"is more than 0 and at most {DENSEST:g} kg/m^3, not {value:g}", "density", name
                )
        unknown, weighed = [], False
        for name, item in self.shown.items():
            rho = density.get(name, density.get("", 0.0))
            if name == base or not rho:
                continue
            body = self.bodies[name]
            own = [
                self._massive(frame, None if shape is None else self._solid(shape), rho)
                for frame, shape in self._placed(self.archive, item, body.frame, 0)
            ]
            if own and None not in own:
                weighed = True
                self.bodies[name] = body.with_masses_of([one for one in own if one is not None])
            else:
                unknown.append(name)
        if unknown:
            self.notes.append(f"These parts have no masses, because they are not {KINDS_READ}: {listed(unknown)}.")
        if weighed:
            self.notes.append("Weight acts against z of the drawing.")

    @staticmethod
    def _massive(frame: Frame, found: SolidPart | None, density: float) -> Body | None:
        if found is None:
            return None
        inertia = density * frame.axes @ found.inertia @ frame.axes.T
        return Body(frame, density * found.volume, frame.point(found.centre), inertia)

    def _placed(
        self, archive: Archive, item: DocumentItem, frame: Frame, depth: int
    ) -> Iterator[tuple[Frame, PartShape | None]]:
        """The shapes that a part shows, with their frames; None of one that is not known."""
        there, found = self._shown(archive, item)
        if there is None or found is None or depth > LONGEST_CHAIN:
            yield frame, None
        elif found.kind in (*CONTAINERS, *GROUPS) or _is_array(found):
            for name in dict.fromkeys(found.links("Group")):
                inner = there.items.get(name)
                if inner is not None and inner.holds("Visibility", default=True) and _has_shape(inner):
                    within = frame if inner.kind in GROUPS[:2] else frame @ self._frame(there, inner)
                    yield from self._placed(there, inner, within, depth + 1)
        else:
            yield frame, self._shape_of(there, found)

    @cache  # noqa: B019 - as long as the import
    def _solid(self, shape: PartShape) -> SolidPart | None:
        with suppress(Unreadable):
            return solid(shape)
        return None

    # --- outlines ---------------------------------------------------------------------------------------------------

    def _outline(self) -> None:
        """Give the parts their surfaces, whose outline is drawn."""
        unknown = []
        for name, item in self.shown.items():
            frame = self.bodies[name].frame
            try:
                own = [
                    self._facets(shape).within(placed)
                    for placed, shape in self._placed(self.archive, item, frame, 0)
                    if shape is not None
                ]
            except Unreadable:
                unknown.append(name)
                continue
            self.bodies[name] = replace(self.bodies[name], facets=Facets.joined(own))
        if unknown:
            self.notes.append(f"These parts have no outlines, because they are not {KINDS_READ}: {listed(unknown)}.")

    @cache  # noqa: B019 - as long as the import
    def _facets(self, shape: PartShape) -> Facets:
        return facets(shape)

    def _unjoined(self, item: DocumentItem) -> None:
        """Take over a part without a joint, so that it can be said that it is left out."""
        is_part = item.kind.startswith(("Part::", "PartDesign::Body")) or item.kind in ("App::Part", LINK, SUBASSEMBLY)
        if is_part and item.name not in self.parts and not _is_flexible(item) and not _is_array(item):
            self._part(item, self._frame(self.archive, self.top) @ self._frame(self.archive, item))

    def _fixed(self, ground: str | None, held: Sequence[str]) -> str:
        """The part that is fixed."""
        if not self.bodies:
            raise self.reading.refuse("has no parts", self.top.place)
        if ground in self.bodies:
            return ground
        if held or ground is not None:
            return held[0] if held else next(iter(self.bodies))
        found = next(iter(self.bodies))
        self.notes.append(f"Nothing is grounded: '{found}' is fixed, and --ground names another part.")
        return found

    def _grounded(self) -> Iterator[str]:
        """Parts that are fixed."""
        for joint in self._joint_items(self.top):
            for name in joint.links("ObjectToGround"):
                item = self.items.get(name)
                if item is not None and not _is_flexible(item) and not _is_suppressed(joint):
                    yield self._part(item, self._frame(self.archive, self.top) @ self._frame(self.archive, item))

    def _joints(self) -> list[Joint]:
        suppressed: list[str] = []
        incomplete: list[str] = []
        made: list[Joint] = []
        taken: set[str] = set()
        for item in self._joint_items(self.top):
            kind = item.choice("JointType")
            if not kind:
                continue
            name = free(item.label, taken)
            taken.add(name)
            if _is_suppressed(item):
                suppressed.append(name)
                continue
            one, other = self._end(item, 1), self._end(item, 2)
            if one is None or other is None or one.part == other.part:
                incomplete.append(name)
                continue
            first, *further = self._made(name, kind, item, one, other)
            made.append(first)
            for joint in further:
                made.append(replace(joint, name=free(joint.name, taken)))
                taken.add(made[-1].name)
        if suppressed:
            self.notes.append(f"Suppressed joints are left out: {listed(suppressed)}.")
        if self.unread:
            self.notes.append(f"Shapes that cannot be read, so that no pins and holes are: {listed(self.unread)}.")
        if self.gone:
            words = "Documents are not in this folder or below it, so that pins and holes in them are not known"
            self.notes.append(f"{words}: {listed(self.gone)}.")
        if self.turning:
            self.notes.append(
                f"Limits of angles of these joints, which slide as well, are left out: {listed(self.turning)}."
            )
        if incomplete:
            self.notes.append(f"Joints that do not name two parts are left out: {listed(incomplete)}.")
        if not made:
            raise self.reading.refuse("has no joints between its parts", self.top.place)
        return list(self._threaded(made))

    def _threaded(self, joints: Sequence[Joint]) -> Iterator[Joint]:
        """The joints, where a screw has the sleeve beside it in it."""
        screws = {frozenset(joint.bodies): joint.name for joint in joints if joint.kind == "screw"}
        held = [joint for joint in joints if joint.kind == "cylindrical" and frozenset(joint.bodies) in screws]
        yield from (joint for joint in joints if joint not in held)
        if held:
            self.notes.append(f"The screws beside these joints hold what they do: {listed(one.name for one in held)}.")

    def _made(self, name: str, kind: str, item: DocumentItem, one: Side, other: Side) -> Sequence[Joint]:
        chain = Chain(name, one.part, other.part, self.between)
        if kind in KINDS:
            return [self._plain(name, KINDS[kind], item, one, other)]
        if kind in ANGLES:
            return at_an_angle(chain, one.line, other.line, _angle(item) if kind == "Angle" else ANGLES[kind])
        if kind == "Distance":
            return self._distance(chain, item, one, other)
        if kind in ("Gears", "Belt"):
            return [self._wheels(name, kind, item, one, other)]
        if kind == "RackPinion":
            return [self._rack(name, item, one, other)]
        if kind == "Screw":
            lead = item.number("Distance")
            if not lead:
                raise self.reading.refuse("its pitch is zero", item.place, "Distance")
            return [self.screw(name, one, other, lead * MM)]
        raise self.reading.refuse(not_known(kind, "a joint that is read", TYPES), item.place)

    def _distance(self, chain: Chain, item: DocumentItem, one: Side, other: Side) -> list[Joint]:
        kinds, radii = zip(*(self._side(item, end) for end in (one, other)), strict=True)
        form, is_swapped = form_of(*kinds)
        distance = item.number("Distance") * MM
        # A point on a circle is one in its plane, and what is not known is a plane.
        if (form != "planes" and "circle" not in kinds) or form == "lines":
            distance += sum(radii)
        if is_swapped:
            one, other = other, one
            chain = Chain(chain.name, one.part, other.part, self.between)
        return at_a_distance(chain, form, one.line, other.line, abs(distance))

    def _side(self, item: DocumentItem, end: Side) -> tuple[str, float]:
        """What a side of a distance is, and its radius."""
        if end.element.startswith("Vertex"):
            return "point", 0.0
        if not end.element:
            # FreeCAD takes both sides for planes, whatever the other one is.
            return "whole", 0.0
        found = self._element(end)
        if found is None:
            what = f"what {end.element} of '{end.part}' is, which decides what a distance means, cannot be read"
            raise self.reading.refuse(what, item.place)
        kind = "curve" if end.element.startswith("Edge") and found.kind == "other" else found.kind
        return kind, found.radius

    def _shape(self, end: Side) -> PartShape | None:
        """The shape of the object that a side names; None where it cannot be read."""
        return None if end.archive is None or end.item is None else self._shape_of(end.archive, end.item)

    def _shape_of(self, archive: Archive, item: DocumentItem) -> PartShape | None:
        if not shape_member(item):
            return None
        key = (archive.file, item.name)
        if key not in self.shapes:
            text = archive.shape(item)
            self.shapes[key] = None
            with suppress(Unreadable):
                self.shapes[key] = None if text is None else PartShape(text)
            if self.shapes[key] is None:
                self.unread.append(item.label)
        return self.shapes[key]

    def _element(self, end: Side) -> ShapeElement | None:
        shape = self._shape(end)
        try:
            return None if shape is None else shape.element(end.element)
        except Unreadable:
            return None

    def _sizes(self, kind: str, one: Side, other: Side) -> PinAndHole | None:
        """Hole and pin of a joint, in the shapes of its parts."""
        along = math.copysign(1.0, float(one.axis @ other.axis)) * other.axis
        # Where the second side would be without a travel.
        start = other.frame.at - along * (one.axis @ (other.frame.at - one.frame.at))
        found = []
        shapes = self._shape(one), self._shape(other)
        for shape, end, point, axis in zip(shapes, (one, other), (one.frame.at, start), (one.axis, along), strict=True):
            if shape is None:
                return None
            named = self._element(end)
            try:
                if kind == "spherical":
                    found.append([*balls(shape.round_faces("sphere"), end.owner, end.frame.at)])
                else:
                    radius = 0.0 if named is None else named.radius
                    found.append(bores(shape.round_faces("cylinder"), end.owner, (point, axis), radius))
            except Unreadable:
                self.unread.append(end.part)
                return None
        return pair(found[0], found[1], (one.part, other.part))

    # --- couplings --------------------------------------------------------------------------------------------------

    def _wheels(self, name: str, kind: str, item: DocumentItem, one: Side, other: Side) -> Joint:
        radii = self._radius(item, "Distance"), self._radius(item, "Distance2")
        return self.wheels(name, one, other, radii, kind == "Belt", item.place)

    def _rack(self, name: str, item: DocumentItem, one: Side, other: Side) -> Joint:
        """A rack, which slides along the axis of its side, and a pinion."""
        sliding = [self._slides(end) for end in (one, other)]
        if sliding[0] == sliding[1]:
            raise self.reading.refuse("one of its parts, the rack, has to be on a slider along the rack", item.place)
        rack, pinion = (one, other) if sliding[0] else (other, one)
        along = rack.axis - pinion.axis * (pinion.axis @ rack.axis)
        if np.linalg.norm(along) < 1.0 - SKEW:
            raise self.reading.refuse("its rack is not at right angles to the axis of the pinion", item.place)
        along = along / np.linalg.norm(along)
        radius = self._radius(item, "Distance")
        return self.rack(name, rack.part, pinion, pinion.axis, along, radius)

    def _slides(self, end: Side) -> bool:
        """Whether a part is on a slider along the axis of a side."""
        return any(abs(axis @ end.axis) > 1.0 - SKEW for axis in self._guides.get(end.part, ()))

    @cached_property
    def _guides(self) -> dict[str, list[np.ndarray]]:
        """Directions of the sliders that parts are on."""
        found: dict[str, list[np.ndarray]] = {}
        for item in self._joint_items(self.top):
            if item.choice("JointType") == "Slider" and not _is_suppressed(item):
                for end in (self._end(item, 1), self._end(item, 2)):
                    if end is not None:
                        found.setdefault(end.part, []).append(end.axis)
        return found

    def _radius(self, item: DocumentItem, key: str) -> float:
        radius = item.number(key) * MM
        if not radius > 0.0:
            raise self.reading.refuse(f"a radius is positive, not {item.number(key):g}", item.place, key)
        return radius

    def _plain(self, name: str, kind: str, item: DocumentItem, one: Side, other: Side) -> Joint:
        """A joint that the mechanism file has, with its range and its sizes."""
        limits = _limits(item, "Angle", math.pi / 180) if kind == "revolute" else _limits(item, "Length", MM)
        if kind == "cylindrical" and _limits(item, "Angle", math.pi / 180):
            self.turning.append(name)
        sizes = None if kind == "fixed" else self._sizes(kind, one, other)
        return self.plain(name, kind, one, other, limits, sizes)


def _has_shape(item: DocumentItem) -> bool:
    """Whether something inside of a part can be a solid of it."""
    return (bool(shape_member(item)) and item.kind not in DATUMS) or item.kind in (*LINKS, *CONTAINERS, *GROUPS)


def _is_flexible(item: DocumentItem) -> bool:
    """Whether it is an assembly whose parts move by themselves."""
    return item.kind == SUBASSEMBLY and not item.holds("Rigid", default=True)


def _is_array(item: DocumentItem) -> bool:
    """Whether it is a link with elements, which move by themselves."""
    return item.kind == LINK and item.value("ElementCount", "Integer") not in (None, "0")


def _is_suppressed(item: DocumentItem) -> bool:
    return item.holds("Suppressed") or not item.holds("Activated", default=True)


def _angle(item: DocumentItem) -> float:
    """The angle of a joint, which has a property of its own in later versions, in rad."""
    return math.radians(abs(item.number("Angle" if "Angle" in item.properties else "Distance")))


def _limits(item: DocumentItem, what: str, unit: float) -> tuple[float, float] | None:
    """The range of a coordinate; an end that is not there is infinite."""
    low, high = (
        item.number(f"{what}{end}") * unit if item.holds(f"Enable{what}{end}") else sign * math.inf
        for end, sign in (("Min", -1.0), ("Max", 1.0))
    )
    if math.isinf(low) and math.isinf(high):
        return None
    return min(low, high), max(low, high)
