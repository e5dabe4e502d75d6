"""Assemblies of FreeCAD: joints hold what the solver of FreeCAD says that they hold, in the saved placements."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.freecad import Document, Floats, Pose, assembled, cylinder, links, pose, pump, random_pose, shape
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.exchange.brep import PartShape, Unreadable
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported
from jointplay.model.mobility import examine

#: mm and radians: numbers of a file have 12 decimals of a millimetre or of a direction
ROUNDING = 1e-9
ELEMENTS = {
    "plane": "Face2",
    "sphere": "Face3",
    "cylinder": "Face1",
    "line": "Edge3",
    "circle": "Edge4",
    "point": "Vertex3",
}
SHAPE = shape(cylinder(3.0, 0.0, 10.0), "plane", "sphere", "line", "circle", "point")


def away(one: Pose, other: Pose) -> Floats:
    return one.at - other.at


def across(one: Pose, other: Pose) -> Floats:
    """From the axis of one to the origin of the other."""
    apart = other.at - one.at
    return np.asarray(apart - one.z * (one.z @ apart))


def parallel(one: Pose, other: Pose) -> Floats:
    return np.cross(one.z, other.z)


def far(one: Pose, other: Pose) -> float:
    return float(np.linalg.norm(across(one, other)))


def height(one: Pose, other: Pose) -> float:
    return float(abs(one.z @ (other.at - one.at)))


#: of each joint its type, its values, where the second frame is in the first one, how many components are locked, and
#: what is zero. Constraints are those of OndselSolver.
Held = tuple[str, dict[str, float], Pose, int, Callable[[Pose, Pose], object]]
HELD: dict[str, Held] = {
    "revolute": ("Revolute", {}, pose(about=(0, 0, 40)), 5, lambda a, b: [*away(a, b), *parallel(a, b)]),
    "reversed": ("Revolute", {}, pose(about=(180, 0, 0)), 5, lambda a, b: [*away(a, b), *parallel(a, b)]),
    "cylindrical": (
        "Cylindrical",
        {},
        pose(0, 0, 7, about=(0, 0, 40)),
        4,
        lambda a, b: [*across(a, b), *parallel(a, b)],
    ),
    "slider": ("Slider", {}, pose(0, 0, 7), 5, lambda a, b: [*across(a, b), *(a.turn.inv() * b.turn).as_rotvec()]),
    "ball": ("Ball", {}, pose(about=(10, 50, 40)), 3, away),
    "parallel": ("Parallel", {}, pose(4, 5, 6, about=(0, 0, 40)), 2, parallel),
    "against": ("Parallel", {}, pose(4, 5, 6, about=(0, 180, 0)), 2, parallel),
    "perpendicular": ("Perpendicular", {}, pose(4, 5, 6, about=(90, 0, 0)), 1, lambda a, b: a.z @ b.z),
    "angle": ("Angle", {"Distance": 30.0}, pose(4, 5, 6, about=(0, 30, 0)), 1, lambda a, b: a.z @ b.z - 0.75**0.5),
    "angle zero": ("Angle", {"Distance": 0.0}, pose(4, 5, 6), 2, parallel),
}
#: the same of distances, by the elements between which they are
DISTANCES: dict[str, tuple[str, str, float, Pose, int, Callable[[Pose, Pose], object]]] = {
    "points": ("point", "point", 7.0, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "one point": ("point", "point", 0.0, pose(about=(10, 50, 40)), 3, away),
    "spheres": ("sphere", "sphere", 3.0, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "sphere, point": ("point", "sphere", 5.0, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "lines": ("line", "line", 5.0, pose(3, 4, 9), 3, lambda a, b: [*parallel(a, b), far(a, b) - 5]),
    "one line": ("line", "line", 0.0, pose(0, 0, 9), 4, lambda a, b: [*parallel(a, b), *across(a, b)]),
    "line, circle": ("line", "circle", 2.5, pose(3, 4, 9), 3, lambda a, b: [*parallel(a, b), far(a, b) - 5]),
    "cylinders": ("cylinder", "cylinder", 4.0, pose(6, 8, 9), 3, lambda a, b: [*parallel(a, b), far(a, b) - 10]),
    "cylinder, point": ("cylinder", "point", 2.0, pose(3, 4, 9), 1, lambda a, b: far(a, b) - 5),
    "point on line": ("point", "line", 0.0, pose(about=(0, 30, 0)) @ pose(0, 0, 0), 2, lambda a, b: across(b, a)),
    "cylinder, sphere": ("cylinder", "sphere", 5.0, pose(6, 8, 9), 1, lambda a, b: far(a, b) - 10),
    "planes": (
        "plane",
        "plane",
        4.0,
        pose(7, 8, -4, about=(0, 180, 0)),
        3,
        lambda a, b: [*parallel(a, b), height(a, b) - 4],
    ),
    "plane, circle": ("plane", "circle", 4.0, pose(7, 8, 4), 3, lambda a, b: [*parallel(a, b), height(a, b) - 4]),
    "plane, point": ("point", "plane", 4.0, pose(7, 8, 4).inverse(), 1, lambda a, b: height(b, a) - 4),
    "plane, sphere": ("plane", "sphere", 4.0, pose(7, 8, 6, about=(9, 9, 9)), 1, lambda a, b: height(a, b) - 6),
    "plane, cylinder": (
        "plane",
        "cylinder",
        1.0,
        pose(7, 8, -4, about=(90, 0, 0)),
        2,
        lambda a, b: [a.z @ b.z, height(a, b) - 4],
    ),
    "plane, line": (
        "plane",
        "line",
        4.0,
        pose(7, 8, 4, about=(0, 90, 0)),
        2,
        lambda a, b: [a.z @ b.z, height(a, b) - 4],
    ),
    "circle, point": ("circle", "point", 4.0, pose(7, 8, 4), 1, lambda a, b: height(a, b) - 4),
}


def element(word: str) -> str:
    return ELEMENTS.get(word, "")


@pytest.mark.parametrize("case", [*HELD, *DISTANCES])
def test_a_joint_holds_what_the_solver_of_freecad_holds(case: str) -> None:
    """As many components, and in poses that are far from the drawing what the constraint says is zero."""
    if case in HELD:
        sides, (kind, values, where, locked, zero) = ("", ""), HELD[case]
    else:
        *sides, distance, where, locked, zero = DISTANCES[case]
        kind, values = "Distance", {"Distance": distance}
    generator = np.random.default_rng(sorted([*HELD, *DISTANCES]).index(case))
    first, second = random_pose(generator), random_pose(generator)
    base = random_pose(generator)
    document = Document(placement=random_pose(generator))
    document.part("base", base, SHAPE)
    document.part("part", base @ first @ where @ second.inverse(), SHAPE)
    document.ground("base")
    document.joint("J", kind, (f"base.{element(sides[0])}", first), (f"part.{element(sides[1])}", second), **values)
    found = imported(document.write("a.FCStd"), Options(output="part"))
    mobility = examine(found.mechanism)
    assert mobility.degrees_of_freedom == 6 - locked
    assert mobility.misfit is None
    # As drawn, and from somewhere else.
    drawn = first @ where @ second.inverse()
    for near in (drawn, drawn @ pose(4, -3, 2, about=(20, 10, -15))):
        is_at = assembled(found.text, near)
        assert np.abs(zero(first, is_at @ second)).max() < 1e-7


def test_a_slider_crank_is_where_a_hand_says(tmp_path: Path) -> None:
    """Crank 15, rod 50, in four positions; the assembly is saved tilted, as one is that its solver could not solve."""
    tilted = pose(about=(0, 1.2, 0))
    angle = np.radians(28.0)
    wrist = 15 * np.cos(angle) - np.sqrt(50**2 - (15 * np.sin(angle)) ** 2)
    document = Document()
    document.part("Base", pose())
    document.part("Crank", pose(120, 0, 11) @ tilted @ pose(about=(0, 0, 28.0)))
    rod = np.degrees(np.arctan2(-15 * np.sin(angle), wrist - 15 * np.cos(angle)))
    document.part("Rod", pose(120, 0, 15) @ tilted @ pose(15 * np.cos(angle), 15 * np.sin(angle), 0, about=(0, 0, rod)))
    document.part("Slider", pose(120, 0, 10) @ tilted @ pose(wrist, 0, 0))
    document.ground("Base")
    along = Rotation.from_rotvec([0, -90, 0], degrees=True)
    document.joint(
        "Guide",
        "Slider",
        ("Slider.", Pose(np.array([-56.0, 0, 6]), along)),
        ("Base.", Pose(np.array([25.0, 0, 17]), along)),
    )
    document.joint("Main", "Revolute", ("Base.", pose(120, 0, 15)), ("Crank.", pose(0, 0, 4)))
    document.joint("Pin", "Revolute", ("Rod.", pose(0, 0, 4)), ("Crank.", pose(15, 0, 8)))
    document.joint("Wrist", "Revolute", ("Rod.", pose(50, 0, 5)), ("Slider.", pose(0, 0, 12)))
    m = jp.read(document.write("a.FCStd"), planar=True, drives={"Main": [0, 60, 145, 250]}, output="Slider")
    assert m.drive_values is not None
    traced = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"]
    for turn, found in zip(np.radians([0, 60, 145, 250]), traced[:, m.bodies.index("Slider")], strict=True):
        by_hand = 120 + 15 * np.cos(turn) - np.sqrt(50**2 - (15 * np.sin(turn)) ** 2)
        assert found * [1e3, 1e3, 1] == pytest.approx([by_hand, 0, 0], abs=ROUNDING)


# --- couplings -------------------------------------------------------------------------------------------------------


def coupled(kind: str, planar: bool, **values: float) -> jp.Mechanism:
    """Two wheels 60 mm apart on one base, which is tilted unless it is seen in the plane."""
    base = pose() if planar else pose(3, 4, 5, about=(20, 30, 40))
    document = Document()
    document.part("base", base)
    document.part("one", base @ pose(0, 0, 0, about=(0, 0, 20)))
    document.part("two", base @ pose(60, 0, 5, about=(0, 0, -35)))
    document.ground("base")
    document.joint("A", "Revolute", ("base.", pose()), ("one.", pose()))
    document.joint("B", "Revolute", ("base.", pose(60, 0, 5)), ("two.", pose()))
    document.joint("C", kind, ("one.", pose()), ("two.", pose()), **values)
    return jp.read(document.write("a.FCStd"), planar=planar, output="two", drives={"A": [20, 50, 140]})


def turned(m: jp.Mechanism, body: str) -> Floats:
    """Angles of a body about the axis of the wheels in degrees, from the first configuration on."""
    assert m.drive_values is not None
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index(body)]
    if found.shape[-1] == 3:
        return np.degrees(found[:, 2] - found[0, 2])
    axes = poses.matrix(found)
    turns = [Rotation.from_matrix(axes[0].T @ one).as_rotvec(degrees=True)[2] for one in axes]
    return np.asarray(turns)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize(("kind", "ratio"), [("Gears", -0.5), ("Belt", 0.5)])
def test_wheels_turn_in_the_ratio_of_their_radii(kind: str, ratio: float, planar: bool) -> None:
    """r1 a1 + r2 a2 is constant for gears; radii that do not touch give the ratio only."""
    m = coupled(kind, planar, Distance=10.0, Distance2=20.0)
    assert m.value("joints.C.type") == ("gear" if kind == "Gears" else "belt")
    assert turned(m, "two") == pytest.approx(ratio * np.array([0.0, 30.0, 120.0]), abs=1e-8)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("swapped", [True, False])
def test_a_rack_travels_by_the_arc_of_its_pinion(planar: bool, swapped: bool) -> None:
    """x + r a is constant, where x is that of the pinion along the rack."""
    base = pose() if planar else pose(3, 4, 5, about=(20, 30, 40))
    along = Rotation.from_rotvec([0, 90, 0], degrees=True)
    guide = Pose(np.array([0.0, -40, 0]), along)
    document = Document()
    document.part("base", base)
    document.part("pinion", base @ pose(0, 0, 0, about=(0, 0, 20)))
    document.part("rack", base @ pose(15, -40, 0))
    document.ground("base")
    document.joint("A", "Revolute", ("base.", pose()), ("pinion.", pose()))
    document.joint("G", "Slider", ("base.", guide), ("rack.", Pose(np.zeros(3), along)))
    sides = ("rack.", Pose(np.array([0.0, 15, 0]), along)), ("pinion.", pose())
    document.joint("C", "RackPinion", *(sides[::-1] if swapped else sides), Distance=12.0)
    m = jp.read(document.write("a.FCStd"), planar=planar, output="rack", drives={"A": [20, 50, 140]})
    assert m.drive_values is not None
    found = poses.position(m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("rack")]) * 1e3
    assert found[:, 0] - 15 == pytest.approx(12 * np.radians([0, 30, 120]), abs=1e-8)


@pytest.mark.parametrize("beside", ["Cylindrical", ""])
def test_a_screw_travels_by_its_pitch(beside: str) -> None:
    """2 pi z = pitch a; the sleeve of FreeCAD beside the screw is the same thread."""
    document = Document()
    document.part("nut", pose(3, 4, 5, about=(20, 30, 40)))
    document.part("screw", pose(3, 4, 5, about=(20, 30, 40)) @ pose(0, 0, 7, about=(0, 0, 20)))
    document.ground("nut")
    if beside:
        document.joint("S", beside, ("nut.", pose()), ("screw.", pose()))
    document.joint("C", "Screw", ("nut.", pose()), ("screw.", pose()), Distance=8.0)
    m = jp.read(document.write("a.FCStd"), output="screw", drives={"C": [20, 380]})
    assert m.joints == ("C",)
    assert m.drive_values is not None
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, 0] * 1e3
    assert found[:, 2] == pytest.approx([7.0, 15.0], abs=1e-8)


# --- what an assembly is made of -------------------------------------------------------------------------------------


def notes(path: Path, **options: object) -> tuple[jp.Mechanism, str]:
    found = imported(path, Options(**options))  # type: ignore[arg-type]
    return found.mechanism, " ".join(found.notes)


def arm(document: Document, one: str = "base.", other: str = "arm.", **values: float | bool) -> Document:
    document.joint("J", "Revolute", (one, pose()), (other, pose(0, 0, 2)), **values)
    return document


def test_links_are_parts_where_they_are(tmp_path: Path) -> None:
    """Of an object here, of one in a document below, of a link, and with the placement of what they show."""
    (tmp_path / "parts").mkdir()
    other = Document()
    other.assembly = False
    other.body("Body", pose(0, 0, 3), kind="PartDesign::Body")
    other.write(tmp_path / "parts" / "b.FCStd")
    document = Document()
    document.body("shown", pose(100, 0, 0))
    document.part("base")
    document.link("own", "shown", pose(0, 0, -2))
    document.link("other", "Body", pose(0, 0, -4), file="parts/b.FCStd")
    transform = '<Property name="LinkTransform" type="App::PropertyBool"><Bool value="true"/></Property>'
    document.link("twice", "Body", pose(0, 0, -7), file="parts\\b.FCStd", more=transform)
    document.link("chain", "own", pose(0, 0, -2))
    document.ground("base")
    for number, name in enumerate(("own", "other", "twice", "chain")):
        where = pose(0, 0, 4) if name == "twice" else pose(0, 0, 2 + 2 * (name == "other"))
        document.joint(f"J{number}", "Revolute", ("base.", pose()), (f"{name}.Pad.", where))
    m, said = notes(document.write("a.FCStd"))
    assert set(m.bodies) == {"own", "other", "twice", "chain"}
    assert [
        m.value(f"joints.J{k}.on.{name}.at") for k, name in enumerate(("own", "other", "chain"), 0) if name == "own"
    ] == [[0, 0, 2]]
    # All are closed as they are drawn: nothing is said to be open.
    assert "open" not in said


@pytest.mark.parametrize(
    "scale",
    [
        '<Property name="Scale" type="App::PropertyFloat"><Float value="2"/></Property>',
        '<Property name="ScaleVector" type="App::PropertyVector">'
        '<PropertyVector valueX="1" valueY="3" valueZ="1"/></Property>',
    ],
)
def test_a_link_with_a_scale_is_refused_by_name(scale: str) -> None:
    """Its holes are not as large as those of what it shows; a scale of one is none."""
    for text, is_read in ((scale, False), (scale.replace('"2"', '"1"').replace('"3"', '"1"'), True)):
        document = Document()
        document.body("shown")
        document.part("base")
        document.link("arm", "shown", more=text)
        document.ground("base")
        document.joint("J", "Revolute", ("base.", pose()), ("arm.", pose()))
        if is_read:
            assert imported(document.write("a.FCStd"), Options()).mechanism.bodies == ("arm",)
            continue
        with pytest.raises(jp.InputError, match="'arm': is a link with a scale"):
            imported(document.write("a.FCStd"), Options())


def test_a_flexible_assembly_moves_and_a_rigid_one_does_not(tmp_path: Path) -> None:
    """Its parts are links in it, and its joints are in a group in it."""
    for rigid in (True, False):
        document = Document()
        document.part("base")
        document.objects.append(("Inner", "Assembly::AssemblyObject", ""))
        flexible = f'<Property name="Rigid" type="App::PropertyBool"><Bool value="{str(rigid).lower()}"/></Property>'
        group = links("Group", ["Joints2", "lower", "upper"])
        document.link("Sub", "Inner", kind="Assembly::AssemblyLink", more=flexible + group)
        document.link("lower", "base", pose())
        document.link("upper", "base", pose())
        document.group.remove("lower")
        document.group.remove("upper")
        document.ground("base")
        document.joint("J", "Revolute", ("base.", pose()), ("Sub.lower.", pose()))
        document.joint("K", "Revolute", ("Sub.lower.", pose(9, 0, 0)), ("Sub.upper.", pose(9, 0, 0)))
        document.joints.remove("K")
        document.add("Joints2", "Assembly::JointGroup", links("Group", [] if rigid else ["K"]))
        m, _ = notes(document.write("a.FCStd"))
        assert (m.bodies, m.joints) == ((("Sub",), ("J",)) if rigid else (("lower", "upper"), ("J", "K")))


def test_parts_in_a_part_are_where_all_placements_bring_them() -> None:
    """The joint names a body in a part that moves; its frame is that of the body."""
    document = Document()
    document.part("base")
    document.part("holder", pose(0, 0, 10, about=(0, 0, 90)), kind="App::Part")
    document.body("inner", pose(5, 0, 0))
    document.ground("base")
    document.joint("J", "Revolute", ("base.", pose(0, 5, 10)), ("holder.inner.", pose()))
    m, _ = notes(document.write("a.FCStd"))
    assert m.bodies == ("holder",)
    assert m.value("joints.J.on.holder.at") == pytest.approx([5, 0, 0], abs=1e-12)


def test_what_is_fixed() -> None:
    """One grounded part, whose axes are those of the mechanism; several; none; another one by an option."""
    for grounded, option, said, bodies in (
        (("base",), None, "", {"arm"}),
        (("base", "post"), None, "", {"arm"}),
        ((), None, "Nothing is grounded: 'base' is fixed", {"arm"}),
        (("base",), "arm", "", {"base"}),
    ):
        document = Document()
        document.part("base", pose(1, 2, 3))
        document.part("arm", pose(1, 2, 1))
        document.part("post", pose(7, 8, 9))
        document.ground(*grounded)
        m, notes_ = notes(arm(document).write("a.FCStd"), ground=option)
        assert set(m.bodies) == bodies
        assert said in notes_
        assert ("'post'" in notes_ or "left out: post" in notes_) == ("post" not in grounded)


def test_suppressed_and_incomplete_joints_are_left_out_and_named() -> None:
    for values in ({"Suppressed": True}, {"Activated": False}):
        document = Document()
        document.part("base")
        document.part("arm", pose(0, 0, -2))
        document.ground("base")
        arm(document)
        document.joint("Off", "Ball", ("base.", pose(9, 9, 9)), ("arm.", pose()), **values)
        document.joint("Same", "Ball", ("arm.", pose(9, 9, 9)), ("arm.", pose()))
        m, said = notes(document.write("a.FCStd"))
        assert m.joints == ("J",)
        assert "Suppressed joints are left out: Off." in said
        assert "Joints that do not name two parts are left out: Same." in said


def test_limits_are_ranges_and_those_on_one_side_are_named() -> None:
    document = Document()
    document.part("base")
    document.part("arm", pose(0, 0, -2))
    document.part("slide", pose(0, 0, 5))
    document.part("half", pose(0, 0, 5))
    document.ground("base")
    arm(
        document,
        EnableAngleMin=True,
        AngleMin=-20.0,
        EnableAngleMax=True,
        AngleMax=50.0,
        LengthMin=3.0,
        EnableLengthMin=True,
    )
    both = {"EnableLengthMin": True, "EnableLengthMax": True}
    document.joint("S", "Slider", ("base.", pose()), ("slide.", pose()), **both, LengthMin=9.0, LengthMax=-1.0)
    document.joint(
        "H", "Slider", ("base.", pose()), ("half.", pose()), EnableLengthMin=True, LengthMin=1.0, LengthMax=2.0
    )
    m, said = notes(document.write("a.FCStd"))
    assert m.value("limits.drives") == {"J": [-20, 50], "S": [-1, 9]}
    assert "Limits on one side only are left out: H." in said


def test_a_fixed_joint_makes_one_body_also_where_it_is_saved_open() -> None:
    """The frames of both sides coincide, whatever the placements are."""
    document = Document()
    document.part("base")
    document.part("arm", pose(0, 0, -2))
    document.part("tool", pose(1, 1, 1))
    document.ground("base")
    arm(document)
    document.joint("F", "Fixed", ("tool.", pose(about=(0, 0, 90))), ("arm.", pose(50, 0, 0)))
    m, _ = notes(document.write("a.FCStd"), output="tool")
    assert m.bodies == ("arm",)
    assert m.value("output.at") == pytest.approx([50, 0, 0], abs=1e-9)


# --- sizes -----------------------------------------------------------------------------------------------------------


def test_references_of_later_versions_begin_at_the_part() -> None:
    """FreeCAD 1.1 names the part that moves, and what is below it."""
    found = []
    for later in (False, True):
        document = Document(placement=pose(1, 2, 3, about=(10, 20, 30)))
        document.later = later
        document.part("base", pose(4, 5, 6), SHAPE)
        document.part("holder", pose(4, 5, 6, about=(0, 0, 90)), kind="App::Part")
        document.body("inner", pose(5, 0, 0), SHAPE)
        document.ground("base")
        document.joint("J", "Revolute", ("base.Edge1", pose(0, 5, 0)), ("holder.inner.Edge1", pose()))
        found.append(imported(document.write("a.FCStd"), Options()).text)
    assert found[0] == found[1]
    assert "The pin" not in found[0]


def fitted(hole: float, pin: float, kind: str = "Revolute", **options: object) -> tuple[jp.Mechanism, str]:
    """A pin of 12 mm in a fork with lugs from 0 to 4 and from 10 to 15 mm; other round faces have other diameters."""
    fork = shape(
        cylinder(hole / 2, 0, 4, True), cylinder(hole, 0, 4), cylinder(hole / 2, 10, 15, True), cylinder(20, 0, 9, True)
    )
    turned_pin = pose(2, 3, 4, about=(90, 0, 0))
    document = Document()
    document.part("base", pose(), fork)
    document.part("arm", turned_pin.inverse(), shape(cylinder(pin / 2, 1, 13, at=turned_pin), cylinder(1, 0, 9, True)))
    document.ground("base")
    document.joint("J", kind, ("base.Edge1", pose()), ("arm.Face1", turned_pin))
    return notes(document.write("a.FCStd"), **options)


def test_a_pin_that_is_drawn_smaller_has_the_clearance_of_the_drawing() -> None:
    """Radii, and the length from the first lug to the end of the pin."""
    m, said = fitted(8.02, 8.0)
    expected = {"hole": {"diameter": 8.02}, "pin": {"diameter": 8}, "length": 12}
    assert m.value("joints.J.clearance") == expected
    assert "--fit" not in said
    assert "Play along these pins is not read; write `axial` where there is some: J." in said
    flat, _ = fitted(8.02, 8.0, planar=True)
    assert flat.value("joints.J.clearance") == {"hole": {"diameter": 8.02}, "pin": {"diameter": 8}}
    assert fitted(8.02, 8.0, clearance={"J": {"radial": 0.1, "length": 9}})[0].value("joints.J.clearance.radial") == 0.1


def test_a_pin_that_is_drawn_as_large_as_its_hole_asks_for_a_fit(capsys: pytest.CaptureFixture[str]) -> None:
    m, said = fitted(8.0, 8.0)
    assert not m.sources
    assert "--fit H7/g6 gives them a clearance: J." in said
    found, said = fitted(8.0, 8.0, fit="H7/f7")
    assert found.value("joints.J.clearance") == {"fit": "H7/f7", "diameter": 8, "length": 12}
    assert "--fit" not in said
    # As by hand: H7 of 8 mm is 0 to 15 micrometres, f7 is -13 to -28, in the middle 28 in diameter.
    assert jp.worst(found.with_({"output.at": [0, 0, 0]})).worst_position.values.max() > 0.014
    assert run(["import", "a.FCStd", "--fit", "H7/zz9"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_pin_that_is_drawn_larger_than_its_hole_gets_no_clearance() -> None:
    m, said = fitted(8.0, 8.01)
    assert not m.sources
    assert "Pins of these joints are drawn larger than their holes, and get no clearance: J." in said


def test_a_fit_for_nothing_is_refused() -> None:
    with pytest.raises(jp.InputError, match="fit: no joint here has a pin that is drawn with the diameter of its hole"):
        fitted(8.0, 4.0, fit="H7/g6")


def test_a_slider_that_is_round_has_a_gap_in_the_plane() -> None:
    fork = shape(cylinder(6, 0, 20, True))
    document = Document()
    document.part("base", pose(), fork)
    document.part("arm", pose(0, 0, 5), shape(cylinder(5.95, 0, 50)))
    document.part("wheel")
    document.ground("base")
    document.joint("J", "Slider", ("base.Edge1", pose()), ("arm.Face1", pose()))
    document.joint("P", "Revolute", ("base.", pose(about=(90, 0, 0))), ("wheel.", pose(about=(90, 0, 0))))
    m, _ = notes(document.write("a.FCStd"), planar=True, output="arm")
    assert m.value("joints.J.clearance") == {"slot": {"width": 12}, "slider": {"width": 11.9}, "length": 15}


def test_a_shape_that_cannot_be_read_is_no_size(tmp_path: Path) -> None:
    for text in ("", "CASCADE Topology V1,\nLocations 3\n1 2\nCurve2ds", "x" * 1000, shape("plane")[:-30]):
        document = Document()
        document.part("base", pose(), text)
        document.part("arm", pose(0, 0, -2), text)
        document.ground("base")
        m, said = notes(arm(document).write("a.FCStd"))
        assert m.joints == ("J",)
        assert ("cannot be read, so that no pins and holes are: base, arm." in said) == bool(text)


#: of the files, by Open CASCADE
PLATE_FACES = ["plane"] * 6 + ["cylinder"]
PLATE_CIRCLES = [10, 14]
TWICE = (7.773081, 24.015702, -0.928643)
COMPOUND_AT = [(20.0, 15.0, -1.0), TWICE, (12.773081, 30.015702, 69.071357), TWICE]
SHAPES = Path(__file__).resolve().parents[1] / "data" / "shapes"


def test_faces_and_edges_have_the_numbers_of_open_cascade() -> None:
    """Files that Open CASCADE 8.0 wrote, and what its TopExp::MapShapes and BRepAdaptor say of them."""
    plate = PartShape((SHAPES / "plate.brp").read_text())
    kinds = [plate.element(f"Face{k}").kind for k in range(1, 8)]  # type: ignore[union-attr]
    assert kinds == PLATE_FACES
    hole = plate.round_faces("cylinder")
    assert [(one.radius, one.is_hole) for one in hole] == [(pytest.approx(4.01e-3), True)]
    assert hole[0].extent[1] - hole[0].extent[0] == pytest.approx(10e-3)
    circles = [k for k in range(1, 16) if plate.element(f"Edge{k}").kind == "circle"]  # type: ignore[union-attr]
    assert circles == PLATE_CIRCLES
    assert plate.element("Edge16") is None
    # Four times the same plate at other places, of which two coincide in a roundabout way.
    several = PartShape((SHAPES / "compound.brp").read_text())
    found = [tuple(np.round(one.at * 1e3, 6).tolist()) for one in several.round_faces("cylinder")]
    assert found == COMPOUND_AT
    assert several.element("Edge60") is not None
    assert several.element("Edge61") is None
    ball = PartShape((SHAPES / "socket.brp").read_text()).round_faces("sphere")
    assert {(one.radius, one.is_hole, *np.round(one.at * 1e3, 9).tolist()) for one in ball} == {
        (8e-3, True, 3.0, 4.0, 5.0)
    }


# --- in the plane ----------------------------------------------------------------------------------------------------

UP, ACROSS = pose(), pose(about=(0, 90, 0))
#: constraints of a part beside its pin on the ground: what is left of them in the plane, degrees of freedom
SEEN: dict[str, tuple[str, tuple[str, str], Pose, dict[str, float], tuple[str, ...], int]] = {
    "planes along the plane": ("Distance", ("plane", "plane"), UP, {"Distance": 2.0}, ("P",), 1),
    "planes across it": ("Distance", ("plane", "plane"), ACROSS, {"Distance": 0.0}, ("P", "C"), 0),
    "parallel to the pin": ("Parallel", ("", ""), UP, {}, ("P",), 1),
    "sleeve": ("Cylindrical", ("", ""), UP, {}, ("P", "C"), 1),
    "ball": ("Ball", ("", ""), UP, {}, ("P", "C"), 1),
}


@pytest.mark.parametrize("case", SEEN)
def test_constraints_seen_along_the_pins(case: str) -> None:
    """What holds across the plane only is not there, and a plate that is seen from its edge is a slider."""
    kind, sides, frame, values, left, free = SEEN[case]
    document = Document()
    document.part("base", pose(), SHAPE)
    document.part("arm", pose(0, 0, 2 if "planes along" in case else 0), SHAPE)
    document.ground("base")
    height = 2 if "planes along" in case else 0
    document.joint("P", "Revolute", ("base.", pose(0, 0, height)), ("arm.", pose()))
    document.joint("C", kind, (f"base.{element(sides[0])}", frame), (f"arm.{element(sides[1])}", frame), **values)
    m, said = notes(document.write("a.FCStd"), planar=True)
    assert m.joints == left
    assert examine(m).degrees_of_freedom == free
    assert ("left out: C" in said) == (left == ("P",))


def test_wheels_of_crossed_axes_are_refused() -> None:
    document = Document()
    document.part("base")
    document.part("arm")
    document.ground("base")
    arm(document)
    document.joint("G", "Gears", ("base.", pose(9, 0, 0)), ("arm.", ACROSS), Distance=1.0, Distance2=2.0)
    with pytest.raises(jp.InputError, match="'G': its axes are not parallel"):
        jp.read(document.write("a.FCStd"))


def test_a_document_without_joints_is_refused() -> None:
    document = Document()
    document.part("base")
    with pytest.raises(jp.InputError, match="'Assembly': has no joints between its parts"):
        jp.read(document.write("a.FCStd"))


def test_the_example_of_the_documentation_is_what_the_tests_write() -> None:
    """And its clearances are those of its shapes."""
    path = Path(__file__).resolve().parents[2] / "docs" / "cad" / "pump.FCStd"
    with zipfile.ZipFile(path) as one, zipfile.ZipFile(pump().write("own.FCStd")) as other:
        assert {name: one.read(name) for name in one.namelist()} == {
            name: other.read(name) for name in other.namelist()
        }
    m, said = notes(path, planar=True)
    assert {name.partition(".")[0] for name in m.sources} == {"Pin", "Guide"}
    assert m.value("joints.Pin.clearance") == {"hole": {"diameter": 8.02}, "pin": {"diameter": 8}}
    assert m.value("joints.Guide.clearance.slot.width") == 12.03
    assert "Main, Wrist." in said


def test_joints_of_one_label_have_names_of_their_own() -> None:
    """Also those of a chain, whose names another joint may have."""
    document = Document()
    document.part("base")
    document.ground("base")
    for number, name in enumerate(("J", "J-2", "K", "L")):
        document.part(f"p{number}", pose(number, 0, 0))
        document.joint(name, "Parallel", ("base.", pose()), (f"p{number}.", pose()))
    document.objects = [(name, kind, text.replace('"K"', '"J"')) for name, kind, text in document.objects]
    m, _ = notes(document.write("a.FCStd"))
    assert len(set(m.joints)) == 8


@pytest.mark.parametrize("order", [("A", "C"), ("C", "A")])
def test_a_distance_of_a_drawing_that_is_not_solved_is_that_of_the_joint(order: tuple[str, str]) -> None:
    """It was the drawn one, 31.62 mm, where the part on its far side was placed first."""
    d = Document()
    d.part("Base")
    d.part("Crank", pose(), shape("point"))
    d.part("Rocker", pose(30, 0, 0), shape("point"))
    d.ground("Base")
    pins = {"A": ("Crank.", pose()), "C": ("Rocker.", pose(30, 0, 0))}
    for name in order:
        d.joint(name, "Revolute", ("Base.", pins[name][1]), (pins[name][0], pose()))
    d.joint("D", "Distance", ("Crank.Vertex1", pose(0, 10, 0)), ("Rocker.Vertex1", pose(0, 20, 0)), Distance=28.0)
    m, _ = notes(d.write("a.FCStd"))
    (rod,) = [name for name in m.bodies if name not in ("Crank", "Rocker")]
    ends = {m.points[k].at for pair in m.joint_points for k in pair if m.points[k].body == m.bodies.index(rod)}
    assert np.linalg.norm(np.subtract(*ends)) == pytest.approx(0.028, abs=1e-12)
    # The output is a part, not what holds two parts apart.
    assert m.raw["output"]["body"] in ("Crank", "Rocker")


def test_joints_on_a_datum_of_a_body_are_where_it_is() -> None:
    for path, inner in (("Local_CS.", "PartDesign::CoordinateSystem"), ("Sketch.Edge1", "Sketcher::SketchObject")):
        d = Document()
        d.part("Base")
        d.part("Body", kind="PartDesign::Body")
        d.body(path.partition(".")[0], pose(10, 20, 7), kind=inner)
        d.ground("Base")
        d.joint("J", "Revolute", ("Base.", pose(0, 0, 7)), (f"Body.{path}", pose()))
        m, _ = notes(d.write("a.FCStd"))
        assert m.raw["joints"]["J"]["on"]["Body"]["at"] == [10, 20, 7]


def test_what_is_grounded_stays_so_whichever_part_gives_the_axes() -> None:
    d = Document()
    for name in ("Base", "Bracket", "Arm"):
        d.part(name)
    d.ground("Base", "Bracket")
    d.joint("A", "Revolute", ("Base.", pose()), ("Arm.", pose()))
    d.joint("B", "Revolute", ("Bracket.", pose()), ("Arm.", pose()))
    for ground in (None, "Base", "Bracket"):
        m, _ = notes(d.write("a.FCStd"), ground=ground)
        assert m.bodies == ("Arm",)


def test_a_pin_that_is_larger_than_its_hole_gets_no_fit() -> None:
    with pytest.raises(jp.InputError, match="fit: no joint here"):
        fitted(7.9, 8.0, fit="H7/g6")
    with pytest.raises(jp.InputError, match="fit"):
        fitted(8.0, 8.0, fit="")


@pytest.mark.parametrize("radius", ["nan", "inf", "1e308"])
def test_shapes_with_numbers_that_are_none_are_named(radius: str) -> None:
    text = shape(cylinder(4.0, 0.0, 10.0))
    broken = text.replace(" 4.0\n", f" {radius}\n", 1)
    assert broken != text
    with pytest.raises(Unreadable):
        PartShape(broken)
