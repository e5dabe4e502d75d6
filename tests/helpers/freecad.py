"""Assemblies as FreeCAD saves them: `Document.xml` and shapes in an archive, written from what is needed of them."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from helpers.brep import Arc, BrepText, words
from jointplay.basics import poses
from jointplay.exchange.brep import PartShape
from jointplay.model.mechanism import loads

Floats = NDArray[np.float64]
#: joints as an enumeration of FreeCAD 1.0 lists them
TYPES = (
    *("Fixed", "Revolute", "Cylindrical", "Slider", "Ball", "Distance", "Parallel", "Perpendicular", "Angle"),
    *("RackPinion", "Screw", "Gears", "Belt"),
)


@dataclass(frozen=True)
class Pose:
    """A placement, in mm."""

    at: Floats = field(default_factory=lambda: np.zeros(3))
    turn: Rotation = field(default_factory=Rotation.identity)

    def __matmul__(self, inner: Pose) -> Pose:
        return Pose(self.at + self.turn.apply(inner.at), self.turn * inner.turn)

    def inverse(self) -> Pose:
        return Pose(-self.turn.inv().apply(self.at), self.turn.inv())

    @property
    def z(self) -> Floats:
        return np.asarray(self.turn.apply([0.0, 0.0, 1.0]))

    @property
    def x(self) -> Floats:
        return np.asarray(self.turn.apply([1.0, 0.0, 0.0]))


def pose(*at: float, about: Sequence[float] = (0.0, 0.0, 0.0)) -> Pose:
    """A placement by its position in mm and its rotation vector in degrees."""
    return Pose(np.array(at or (0.0, 0.0, 0.0), dtype=float), Rotation.from_rotvec(about, degrees=True))


def random_pose(generator: np.random.Generator) -> Pose:
    return Pose(generator.uniform(-30, 30, 3), Rotation.random(rng=generator))


def _property(name: str, kind: str, inside: str) -> str:
    return f'<Property name="{name}" type="App::{kind}">{inside}</Property>'


def _placement(name: str, placed: Pose) -> str:
    q = placed.turn.as_quat()
    numbers = [f'P{axis}="{x:.17g}"' for axis, x in zip("xyz", placed.at, strict=True)]
    numbers += [f'Q{k}="{x:.17g}"' for k, x in enumerate(q)]
    return _property(name, "PropertyPlacement", f"<PropertyPlacement {' '.join(numbers)}/>")


def links(name: str, targets: Sequence[str]) -> str:
    inside = "".join(f"<Link value={quoteattr(target)}/>" for target in targets)
    return _property(name, "PropertyLinkList", f'<LinkList count="{len(targets)}">{inside}</LinkList>')


def assembled(text: str, near: Pose) -> Pose:
    """Where the body `part` of a mechanism file is closed, without drives and from near a placement."""
    rotation = near.turn.as_rotvec(degrees=True).tolist()
    x, y, z = near.at
    start = f"[start]\npart = {{ x = {x:.17g}, y = {y:.17g}, z = {z:.17g}, rotation = {rotation} }}\n"
    kept = [part for part in text.split("\n\n") if not part.startswith(("[drives", "[start"))]
    m = loads("\n\n".join([*kept, start]), "a.toml")
    put = m.core.assemble(np.empty(0))
    assert put["converged"]
    own = put["poses"][m.bodies.index("part")]
    return Pose(own[:3] * 1e3, Rotation.from_matrix(poses.matrix(own)))


class Document:
    """A document with one assembly, called Assembly; `parts` are in it, unless they are written by `body`."""

    def __init__(self, placement: Pose | None = None) -> None:
        self.objects: list[tuple[str, str, str]] = []
        self.shapes: dict[str, str] = {}
        self.group: list[str] = []
        self.joints: list[str] = []
        self.assembly = True
        #: whether references begin at the part, as in FreeCAD 1.1
        self.later = False
        self.placement = placement or Pose()

    def add(self, name: str, kind: str, *properties: str, label: str = "") -> str:
        """An object with its properties as they are."""
        called = _property("Label", "PropertyString", f"<String value={quoteattr(label or name)}/>")
        self.objects.append((name, kind, called + "".join(properties)))
        return name

    def body(self, name: str, placed: Pose | None = None, shape: str = "", kind: str = "Part::Feature") -> str:
        """A part that is not in the assembly by itself."""
        has = []
        if shape:
            self.shapes[f"{name}.Shape.brp"] = shape
            has = [_property("Shape", "PropertyPartShape", f'<Part file="{name}.Shape.brp"/>')]
        return self.add(name, kind, _placement("Placement", placed or Pose()), *has)

    def part(self, name: str, placed: Pose | None = None, shape: str = "", kind: str = "Part::Feature") -> str:
        self.group.append(name)
        return self.body(name, placed, shape, kind)

    def link(
        self, name: str, to: str, placed: Pose | None = None, file: str = "", kind: str = "App::Link", more: str = ""
    ) -> str:
        """A part that shows another object."""
        shown = f'<XLink file={quoteattr(file)} stamp="" name={quoteattr(to)}/>'
        self.group.append(name)
        return self.add(
            name,
            kind,
            _placement("Placement", placed or Pose()),
            _property("LinkedObject", "PropertyXLink", shown),
            more,
        )

    def ground(self, *names: str) -> None:
        for name in names:
            self.joints.append(f"Grounded{name}")
            grounded = _property("ObjectToGround", "PropertyLink", f"<Link value={quoteattr(name)}/>")
            self.add(f"Grounded{name}", "App::FeaturePython", grounded)

    def joint(
        self, name: str, kind: str, one: tuple[str, Pose], other: tuple[str, Pose], **values: float | bool
    ) -> None:
        """A joint of two sides: path with the element, and placement in the axes of the object."""
        words = "".join(f'<Enum value="{word}"/>' for word in TYPES)
        place = TYPES.index(kind)
        chosen = f'<Integer value="{place}" CustomEnum="true"/><CustomEnumList count="13">{words}</CustomEnumList>'
        properties = [_property("JointType", "PropertyEnumeration", chosen)]
        for number, (path, placed) in enumerate((one, other), 1):
            root, _, rest = path.partition(".") if self.later else ("Assembly", "", path)
            sub = f"<Sub value={quoteattr(rest)}/>"
            reference = f'<XLink file="" stamp="" name="{root}" count="2">{sub}{sub}</XLink>'
            properties.append(_property(f"Reference{number}", "PropertyXLinkSubHidden", reference))
            properties.append(_placement(f"Placement{number}", placed))
        for key, value in values.items():
            tag, text = ("Bool", str(value).lower()) if isinstance(value, bool) else ("Float", f"{value:.17g}")
            properties.append(_property(key, f"Property{tag}", f'<{tag} value="{text}"/>'))
        self.joints.append(name)
        self.add(name, "App::FeaturePython", *properties)

    def xml(self) -> str:
        objects = list(self.objects)
        if self.assembly:
            objects += [
                ("Joints", "Assembly::JointGroup", links("Group", self.joints)),
                (
                    "Assembly",
                    "Assembly::AssemblyObject",
                    links("Group", ["Joints", *self.group]) + _placement("Placement", self.placement),
                ),
            ]
        kinds = "".join(f"<Object type={quoteattr(kind)} name={quoteattr(name)}/>" for name, kind, _ in objects)
        data = "".join(
            f"<Object name={quoteattr(name)}><Properties>{inside}</Properties></Object>" for name, _, inside in objects
        )
        return (
            '<?xml version="1.0" encoding="utf-8"?>\n<Document SchemaVersion="4" ProgramVersion="1.0" FileVersion="1">'
            f'<Objects Count="{len(objects)}">{kinds}</Objects>'
            f'<ObjectData Count="{len(objects)}">{data}</ObjectData></Document>'
        )

    def write(self, path: Path | str, more: Mapping[str, str | bytes] | None = None) -> Path:
        """The archive."""
        members: dict[str, str | bytes] = {"Document.xml": self.xml(), **self.shapes, **(more or {})}
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                archive.writestr(name, content)
        return Path(path)


#: radius, from where to where, whether it is a hole, and the placement of its axis
Round = tuple[float, float, float, bool, Pose]

# --- shapes ----------------------------------------------------------------------------------------------------------


def cylinder(
    radius: float, low: float, high: float, is_hole: bool = False, at: Pose | None = None
) -> tuple[object, ...]:
    """A round face along the z axis of a placement, from low to high, with circles at its ends."""
    return radius, low, high, is_hole, at or Pose()


@dataclass(frozen=True)
class Prism:
    """A solid along the z axis of a placement: a line of corners and arcs, from low to high, and round holes in it."""

    line: Sequence[tuple[float, float] | Arc]
    low: float
    high: float
    holes: Sequence[tuple[tuple[float, float], float]] = ()
    at: Pose = field(default_factory=Pose)


def shape(*elements: Round | Prism | str) -> str:
    """A compound in the text format of Open CASCADE: round faces, solids, and by their name a plane, a sphere, a line,
    a circle and a point. Edges and vertices that bound a face come with it."""
    made = BrepText()

    def frame(placed: Pose) -> str:
        return words(placed.at, placed.z, placed.x, placed.turn.apply([0.0, 1.0, 0.0]))

    def face(surface: str, edges: Sequence[int] = ()) -> int:
        return made.face(made.surface(surface), [[f"+@{one}" for one in edges]])

    unit, inside = frame(Pose()), []
    for element in elements:
        if isinstance(element, tuple):
            radius, low, high, is_hole, at = element
            ends = []
            for height in (low, high):
                end = at @ pose(0, 0, height)
                corner = made.vertex((end @ pose(radius, 0, 0)).at)
                ends.append(made.edge(f"2 {frame(end)} {radius}", [corner]))
            inside.append(f"{'-' if is_hole else '+'}@{face(f'2 {frame(at)} {radius}', ends)}")
            continue
        if isinstance(element, Prism):
            at = element.at
            number = made.prism(at.turn.as_matrix(), at.at, element.line, element.low, element.high, element.holes)
        else:
            write = {
                "plane": lambda: face(f"1 {unit}"),
                "sphere": lambda: face(f"4 {unit} 2"),
                "line": lambda: made.edge("1 0 0 0 0 0 1", []),
                "circle": lambda: made.edge(f"2 {unit} 2.5", []),
                "point": lambda: made.vertex(np.zeros(3)),
            }[element]
            number = write()
        inside.append(f"+@{number}")
    return made.text(inside)


# --- the example of the documentation --------------------------------------------------------------------------------


def pump() -> Document:
    """`docs/cad/pump.FCStd`: a crank of 15 mm and a rod of 50 mm, at 28 degrees."""
    angle, reach = np.radians(28.0), 50.0
    wrist = 15 * np.cos(angle) + np.sqrt(reach**2 - (15 * np.sin(angle)) ** 2)
    pin = np.array([15 * np.cos(angle), 15 * np.sin(angle), 16.0])
    rod = np.degrees(np.arctan2(-pin[1], wrist - pin[0]))
    along = Pose(np.zeros(3), Rotation.from_rotvec([0, 90, 0], degrees=True))
    guide = pose(40, 0, 20) @ along
    pin_of = partial(Prism, [((0.0, 0.0), 4.0, 0.0, 360.0)])
    plate = Prism([(-12, -12), (72, -12), (72, 12), (-12, 12)], -4, 0)
    sleeve = Prism([(-8.5, -8.5), (20, -8.5), (20, 8.5), (-8.5, 8.5)], 0, 30, [((0, 0), 6.015)], guide)
    shaft = Prism([((0, 0), 6, 0, 360)], -20, 60, (), pose(0, 0, -8) @ along)
    arm, link = ([((0, 0), r, 90, 270), ((length, 0), r, -90, 90)] for length, r in ((15, 7.5), (reach, 6)))
    shapes = {
        "Base": shape(plate, pin_of(0, 15), sleeve),
        "Crank": shape(Prism(arm, 0, 10, [((0, 0), 4)]), pin_of(10, 20, (), pose(15, 0, 0))),
        "Rod": shape(Prism(link, 0, 8, [((0, 0), 4.01), ((reach, 0), 4)])),
        "Slider": shape(pin_of(-12, 0), shaft),
    }
    document = Document()
    placed = pose(), pose(0, 0, 5, about=(0, 0, 28)), pose(*pin, about=(0, 0, rod)), pose(wrist, 0, 28)
    for (name, own), place in zip(shapes.items(), placed, strict=True):
        document.part(name, place, own)

    def circle(part: str, at: Pose, radius: float) -> tuple[str, Pose]:
        """A side of a joint on a circle about its axis."""
        known = PartShape(shapes[part])
        for number in range(1, 99):
            found = known.element(f"Edge{number}")
            if found is not None and found.kind == "circle" and abs(found.radius - radius / 1e3) < 1e-9:
                away = found.at * 1e3 - at.at
                if np.linalg.norm(np.cross(away, at.z)) < 1e-6:
                    return f"{part}.Edge{number}", at
        raise AssertionError(part)

    document.ground("Base")
    document.joint("Main", "Revolute", circle("Base", pose(0, 0, 15), 4), circle("Crank", pose(0, 0, 10), 4))
    document.joint("Pin", "Revolute", circle("Crank", pose(15, 0, 11), 4), circle("Rod", pose(), 4.01))
    document.joint("Wrist", "Revolute", circle("Rod", pose(reach, 0, 8), 4), circle("Slider", pose(0, 0, -4), 4))
    end = pose(0, 0, -8) @ along
    document.joint("Guide", "Slider", circle("Base", guide, 6.015), circle("Slider", end, 6))
    return document
