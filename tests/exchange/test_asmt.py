"""Assemblies of OndselSolver: joints hold what its equations say, motions are drives, damaged files are refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.asmt import Assembly
from helpers.commands import refused
from helpers.freecad import Floats, Pose, assembled, pose, random_pose
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.exchange.options import Options
from jointplay.exchange.reading import Imported, imported
from jointplay.model.mobility import examine


def seen(one: Pose, other: Pose) -> Pose:
    """The marker J in the axes of I."""
    return one.inverse() @ other


def parallel(at: Pose) -> Floats:
    """z of I across x and y of J."""
    return np.asarray([at.turn.as_matrix()[2, 0], at.turn.as_matrix()[2, 1]])


def cosine(at: Pose) -> float:
    return float(at.z[2])


def radius(at: Pose) -> float:
    return float(np.hypot(*at.at[:2]))


#: values, where J is in I, how many components are locked, and what the solver holds at zero
Held = tuple[dict[str, float], Pose, int, Callable[[Pose], object]]
HELD: dict[str, Held] = {
    "RevoluteJoint": ({}, pose(about=(0, 0, 40)), 5, lambda j: [*j.at, *parallel(j)]),
    "CylindricalJoint": ({}, pose(0, 0, 7, about=(0, 0, 40)), 4, lambda j: [*j.at[:2], *parallel(j)]),
    "TranslationalJoint": ({}, pose(0, 0, 7), 5, lambda j: [*j.at[:2], *j.turn.as_rotvec()]),
    "SphericalJoint": ({}, pose(about=(10, 50, 40)), 3, lambda j: j.at),
    "UniversalJoint": ({}, pose(about=(90, 0, 0)), 4, lambda j: [*j.at, cosine(j)]),
    "ParallelAxesJoint": ({}, pose(4, 5, 6, about=(0, 0, 40)), 2, parallel),
    "PerpendicularJoint": ({}, pose(4, 5, 6, about=(90, 0, 0)), 1, cosine),
    "AngleJoint": ({"theIzJz": np.pi / 6}, pose(4, 5, 6, about=(0, 30, 0)), 1, lambda j: cosine(j) - 0.75**0.5),
    "NoRotationJoint": ({}, pose(4, 5, 6), 3, lambda j: j.turn.as_rotvec()),
    "PlanarJoint": ({"offset": -4.0}, pose(7, 8, -4, about=(0, 0, 30)), 3, lambda j: [*parallel(j), j.at[2] + 4]),
    "LineInPlaneJoint": ({"offset": 4.0}, pose(7, 8, 4, about=(0, 90, 0)), 2, lambda j: [cosine(j), j.at[2] - 4]),
    "PointInPlaneJoint": ({"offset": -4.0}, pose(7, 8, -4, about=(9, 9, 9)), 1, lambda j: j.at[2] + 4),
    "PointInLineJoint": ({}, pose(0, 0, 5, about=(9, 9, 9)), 2, lambda j: j.at[:2]),
    "SphSphJoint": ({"distanceIJ": 7.0}, pose(2, 3, 6), 1, lambda j: np.linalg.norm(j.at) - 7),
    "CylSphJoint": ({"distanceIJ": 5.0}, pose(3, 4, 9, about=(9, 9, 9)), 1, lambda j: radius(j) - 5),
    "RevCylJoint": ({"distanceIJ": 5.0}, pose(3, 4, 9), 3, lambda j: [*parallel(j), radius(j) - 5]),
    "RevRevJoint": ({"distanceIJ": 5.0}, pose(3, 4, 0), 4, lambda j: [*parallel(j), radius(j) - 5, j.at[2]]),
}


def written(assembly: Assembly, **options: object) -> Imported:
    Path("a.asmt").write_text(assembly.text(), encoding="utf-8")
    return imported(Path("a.asmt"), Options(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", HELD)
def test_a_joint_holds_what_the_solver_holds(kind: str) -> None:
    """As many components, and in poses away from the drawing what its equations say is zero."""
    values, where, locked, zero = HELD[kind]
    generator = np.random.default_rng(sorted(HELD).index(kind))
    first, second, base = (random_pose(generator) for _ in range(3))
    assembly = Assembly()
    assembly.part("base", base)
    assembly.part("part", base @ first @ where @ second.inverse())
    assembly.joint("G", "FixedJoint", ("A", base), ("base", Pose()))
    assembly.joint("J", kind, ("base", first), ("part", second), **values)
    found = written(assembly, output="part")
    mobility = examine(found.mechanism)
    assert mobility.degrees_of_freedom == 6 - locked
    assert mobility.misfit is None
    drawn = base @ first @ where @ second.inverse()
    for near in (drawn, drawn @ pose(4, -3, 2, about=(20, 10, -15))):
        is_at = assembled(found.text, near)
        assert np.abs(zero(seen(base @ first, is_at @ second))).max() < 1e-7


def crank(length: float = 50.0) -> Assembly:
    """A crank of 15 and a rod in the drawing at 30 degrees, driven through half a turn; the slider on a sleeve."""
    angle = np.radians(30.0)
    wrist = 15 * np.cos(angle) + np.sqrt(length**2 - (15 * np.sin(angle)) ** 2)
    tilt = -np.degrees(np.arcsin(15 * np.sin(angle) / length))
    found = Assembly()
    found.part("crank", pose(about=(0, 0, 30)))
    found.part("rod", pose(15 * np.cos(angle), 15 * np.sin(angle), 0, about=(0, 0, tilt)))
    found.part("doc#slider", pose(wrist, 0, 0))
    along = Pose(np.zeros(3), Rotation.from_rotvec([0, 90, 0], degrees=True))
    found.joint("main", "RevoluteJoint", ("A", pose()), ("crank", pose()))
    found.joint("pin", "RevoluteJoint", ("crank", pose(15, 0, 0)), ("rod", pose()))
    found.joint("wrist", "RevoluteJoint", ("rod", pose(length, 0, 0)), ("doc#slider", pose()))
    found.joint("guide", "CylindricalJoint", ("A", along), ("doc#slider", along))
    return found


@pytest.mark.parametrize(
    "formula", ["pi/6 + pi*time", "(30.0d + 180.0d*time)*pi/180.0d", "pi/6 + arctan(1e99)*2*time^1"]
)
def test_a_motion_drives_through_the_times_of_the_file(formula: str) -> None:
    """Crank-slider: x = r cos a + sqrt(l^2 - r^2 sin^2 a) at five instants."""
    assembly = crank()
    assembly.motion("main", formula)
    m = written(assembly, output="slider").mechanism
    assert m.drive_values is not None
    turns = np.radians(30.0 + 45.0 * np.arange(5))
    assert np.abs(m.drive_values[:, 0] - turns).max() < 1e-9
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("slider")] * 1e3
    by_hand = 15 * np.cos(turns) + np.sqrt(50**2 - (15 * np.sin(turns)) ** 2)
    assert np.abs(found[:, 0] - by_hand).max() < 1e-9
    assert np.abs(found[:, 1:3]).max() < 1e-9


def test_a_crank_is_the_same_in_its_plane() -> None:
    """Angles of the drive count as the solver counts them, and values follow a zero that moves."""
    assembly = crank()
    assembly.motion("main", "pi/6 + pi*time")
    m = written(assembly, output="slider", planar=True).mechanism
    assert m.drive_values is not None
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("slider")] * 1e3
    turns = np.radians(30.0 + 45.0 * np.arange(5))
    by_hand = 15 * np.cos(turns) + np.sqrt(50**2 - (15 * np.sin(turns)) ** 2)
    assert np.abs(found[:, 0] - found[0, 0] - (by_hand - by_hand[0])).max() < 1e-9


@pytest.mark.parametrize(("radii", "ratio"), [((10.0, 20.0), -0.5), ((10.0, -20.0), 0.5)])
def test_gears_and_belts_turn_in_the_ratio_of_their_radii(radii: tuple[float, float], ratio: float) -> None:
    """r1 a1 + r2 a2 is constant; a radius below zero is a belt."""
    assembly = Assembly()
    assembly.part("one", pose())
    assembly.part("two", pose(30, 0, 0))
    assembly.joint("A1", "RevoluteJoint", ("A", pose()), ("one", pose()))
    assembly.joint("A2", "RevoluteJoint", ("A", pose(30, 0, 0)), ("two", pose()))
    assembly.joint("C", "GearJoint", ("one", pose()), ("two", pose()), radiusI=radii[0], radiusJ=radii[1])
    assembly.motion("A1", "pi/2*time")
    m = written(assembly, output="two").mechanism
    assert m.drive_values is not None
    found = poses.matrix(m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("two")])
    turned = np.degrees(np.arctan2(found[:, 1, 0], found[:, 0, 0]))
    assert turned == pytest.approx(ratio * 22.5 * np.arange(5), abs=1e-8)


@pytest.mark.parametrize("radius_of", [12.0, -12.0])
def test_a_rack_travels_by_the_arc_of_its_pinion(radius_of: float) -> None:
    """x of the pinion in the rack + r a is constant."""
    along = Pose(np.zeros(3), Rotation.from_rotvec([0, 90, 0], degrees=True))
    assembly = Assembly()
    assembly.part("rack", pose(0, -12, 0))
    assembly.part("pinion", pose())
    assembly.joint("A1", "RevoluteJoint", ("A", pose()), ("pinion", pose()))
    assembly.joint("G", "TranslationalJoint", ("A", pose(0, -12, 0) @ along), ("rack", along))
    assembly.joint("C", "RackPinionJoint", ("rack", pose()), ("pinion", pose()), pitchRadius=radius_of)
    assembly.motion("A1", "pi/2*time")
    m = written(assembly, output="rack").mechanism
    assert m.drive_values is not None
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("rack"), 0] * 1e3
    assert found == pytest.approx(radius_of * np.pi / 8 * np.arange(5), abs=1e-8)


def test_a_screw_travels_by_its_pitch() -> None:
    assembly = Assembly()
    assembly.part("screw", pose(0, 0, 3))
    assembly.joint("C", "ScrewJoint", ("A", pose()), ("screw", pose()), pitch=8.0)
    m = written(assembly, output="screw", drives={"C": [0, 360]}).mechanism
    assert m.drive_values is not None
    found = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, 0, 2] * 1e3
    assert found == pytest.approx([3.0, 11.0], abs=1e-8)


def test_lengths_are_metres_and_masses_count_where_there_is_gravity() -> None:
    """A bar of 2 kg with its centre 0.1 m from the pin; FreeCAD writes no gravity, and masses that mean nothing."""
    inside = [("Name", "mass"), ("Position3D", "0.1\t0\t0"), ("Mass", "2"), ("MomentOfInertias", "0.01\t0.02\t0.03")]
    for gravity, length, known in (("0\t-9.81\t0", 1000.0, True), ("0\t0\t0", 1.0, False)):
        assembly = Assembly(gravity=gravity)
        assembly.part("bar", pose(0.5, 0, 0), inside)
        assembly.joint("J", "RevoluteJoint", ("A", pose(0.5, 0, 0)), ("bar", pose()))
        assembly.limit("J", "-30*pi/180", "Rotation", "=>")
        assembly.limit("J", "45*pi/180", "Rotation", "=<")
        found = written(assembly, output="bar")
        m = found.mechanism
        assert m.value("joints.J.on.ground.at") == [0.5 * length, 0, 0]
        assert m.value("limits.drives.J") == pytest.approx([-30, 45])
        assert ("mass   = 2" in found.text) == known
        assert ("rotational_inertia = [10000, 20000, 30000]" in found.text) == known
        assert ("m." in found.notes[0]) == known or "mm" in found.notes[0]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Assembly\n", "Assemblage\n", "no line 'Assembly'"),
        ("/A/crank/M1", "/A/crank/M99", 'names "/A/crank/M99", which is no marker'),
        ("RevoluteJoint", "CurveCurveContact", "is not a joint that is read"),
        ("\t\t\tMarkers", "\t\t\t\t\t\t\t\tMarkers", "is indented by more tabs"),
        ("1\t0\t0", "2\t0\t0", "the matrix is no rotation"),
        ("1\t0\t0", "1\t0", "3 numbers"),
        ("1\t0\t0", "1\tnan\t0", "3 numbers"),
        ("1\t0\t0", "1\t1e300\t0", "at most"),
        ("\t\t\tName\n\t\t\t\tcrank\n", "", "needs a Name"),
    ],
)
def test_a_damaged_file_is_refused_in_one_sentence(
    old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = crank().text()
    assert old in text
    Path("a.asmt").write_text(text.replace(old, new, 1), encoding="utf-8")
    message = refused(capsys, "import", "a.asmt")
    assert message.startswith("error: a.asmt: ")
    assert said in message


def test_files_that_are_cut_anywhere_end_in_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    text = crank().text()
    for end in np.linspace(0, len(text), 60).astype(int):
        Path("a.asmt").write_text(text[:end], encoding="utf-8")
        code = run(["import", "a.asmt", "--force"])
        message = capsys.readouterr().err
        assert code == 2 or (code == 0 and end > text.index("ConstantGravity"))
        assert code == 0 or (message.startswith("error: a.asmt: ") and message.count("\n") == 1)


def test_more_parts_than_any_machine_has_are_refused_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    """Also where all of them have one name."""
    assembly = crank()
    part = "\t\tPart\n\t\t\tName\n\t\t\t\tcrank\n"
    Path("a.asmt").write_text(
        assembly.text().replace("\tKinematicIJs", part * 30_000 + "\tKinematicIJs"), encoding="utf-8"
    )
    assert "a number of parts that is read" in refused(capsys, "import", "a.asmt")


def test_formulas_that_are_not_read_are_named() -> None:
    assembly = crank()
    assembly.motion("main", "integral(time)")
    assert "Formulas of these motions are not read" in " ".join(written(assembly).notes)


def test_the_command_reads_it(capsys: pytest.CaptureFixture[str]) -> None:
    assembly = crank()
    assembly.motion("main", "pi/6 + pi*time")
    Path("a.asmt").write_text(assembly.text(), encoding="utf-8")
    assert (
        run(["import", "a.asmt", "--planar", "--clearance", "revolute={radial=0.01}", "--output-point", "slider"]) == 0
    )
    capsys.readouterr()
    assert jp.load("a.toml").drive_values is not None
