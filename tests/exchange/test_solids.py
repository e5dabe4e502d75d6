"""Volumes, centres and moments of inertia of shapes, beside closed forms and a kernel; masses of assemblies."""

import re
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.brep import damaged
from helpers.commands import refused
from helpers.freecad import Document, links, pose
from jointplay.exchange.brep import PartShape, Unreadable
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported
from jointplay.exchange.solids import solid

SHAPES = Path(__file__).parent / "shapes"
#: a box of 20 x 30 x 10 mm with its least corner at 5, 6, 7 mm; a hole of radius 4 along z; edges of radius 1.5
BOX, LEAST = np.array([20.0, 30.0, 10.0]), np.array([5.0, 6.0, 7.0])
HOLE, RADIUS, EDGE = np.array([12.0, 20.0, 12.0]), 4.0, 1.5
#: what Open CASCADE 8.0 says of `fork.brp`, a box with a slanted pin, a hole and the mark of a ball: mm^3, mm^5
FORK = 7590.8216279363605
FORK_INERTIA = [
    [1448913.0613073409, -44379.61771578435, 15153.389898380963],
    [-44379.61771578435, 447525.03162006196, -362312.11554887425],
    [15153.389898380963, -362312.11554887425, 1350578.1100842701],
]


def text(name: str) -> str:
    return (SHAPES / f"{name}.brp").read_text(encoding="utf-8")


def block() -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre and moments of the box less those of the hole, mm."""
    whole, hole = BOX.prod(), np.pi * RADIUS**2 * BOX[2]
    volume = whole - hole
    middle = LEAST + BOX / 2
    centre = (whole * middle - hole * HOLE) / volume
    squares = BOX**2
    own = whole / 12 * np.diag(squares.sum() - squares)
    across = hole * (3 * RADIUS**2 + squares[2]) / 12
    drilled = np.diag([across, across, hole * RADIUS**2 / 2])

    def moved(volume: float, arm: np.ndarray) -> np.ndarray:
        return np.asarray(volume * (arm @ arm * np.eye(3) - np.outer(arm, arm)))

    inertia = own + moved(whole, middle - centre) - drilled - moved(hole, HOLE - centre)
    return float(volume), centre, inertia


def without_curves_on_planes(shape: str) -> str:
    """As files from STEP are: edges have no curves on planes."""
    head, _, tail = shape.partition("\nTShapes")
    listed = re.split(r"\nSurfaces \d+\n|\nTriangulations", head)[1].splitlines()
    planes = {str(number) for number, line in enumerate(listed, 1) if line.startswith("1 ")}
    kept = []
    for line in tail.splitlines():
        words = line.split()
        if not (len(words) == 6 and words[0] == "2" and words[2] in planes):
            kept.append(line)
    return head + "\nTShapes" + "\n".join(kept)


@pytest.mark.parametrize("change", [str, without_curves_on_planes])
def test_a_block_with_a_hole_is_a_box_less_a_cylinder(change: type) -> None:
    volume, centre, inertia = block()
    shape = change(text("block-with-hole"))
    found = solid(PartShape(shape))
    assert found.volume * 1e9 == pytest.approx(volume, rel=1e-12)
    assert found.centre * 1e3 == pytest.approx(centre, abs=1e-11)
    assert np.abs(found.inertia * 1e15 - inertia).max() < 1e-11 * np.abs(inertia).max()


def test_a_rounded_box_is_a_box_with_cylinders_and_spheres() -> None:
    """Of the box that is smaller by the radius all around: its volume, faces, edges and corners, rounded."""
    inner, r = BOX - 2 * EDGE, EDGE
    faces = 2 * (inner[0] * inner[1] + inner[1] * inner[2] + inner[2] * inner[0])
    volume = inner.prod() + r * faces + np.pi * r**2 * inner.sum() + 4 / 3 * np.pi * r**3
    found = solid(PartShape(text("rounded-box")))
    assert found.volume * 1e9 == pytest.approx(volume, rel=1e-12)
    assert found.centre * 1e3 == pytest.approx(LEAST + BOX / 2, abs=1e-11)
    assert np.abs(found.inertia - np.diag(np.diag(found.inertia))).max() < 1e-11 * np.abs(found.inertia).max()


def test_edges_that_are_splines_are_those_of_the_kernel() -> None:
    found = solid(PartShape(text("fork")))
    assert found.volume * 1e9 == pytest.approx(FORK, rel=1e-9)
    own, kernel = np.linalg.eigvalsh(found.inertia * 1e15), np.linalg.eigvalsh(np.array(FORK_INERTIA))
    assert own == pytest.approx(kernel, rel=1e-8)


@pytest.mark.parametrize("name", ["block-with-hole", "fork"])
def test_damaged_shapes_are_unreadable_or_close(name: str) -> None:
    """A number that is changed anywhere, a word that is gone, an end too early: nothing but `Unreadable`."""
    whole, generator = text(name), np.random.default_rng(5)
    for changed in damaged(whole, generator):
        try:
            found = solid(PartShape(changed))
        except Unreadable:
            continue
        assert np.isfinite([found.volume, *found.centre, *found.inertia.ravel()]).all()
        assert found.volume > 0.0
    for end in generator.integers(100, len(whole), 10).tolist():
        with pytest.raises(Unreadable):
            solid(PartShape(whole[:end].rstrip("0123456789 +-")))


def test_a_shape_that_does_not_close_has_no_volume() -> None:
    """One of the faces is left out of the shell."""
    shape = text("block-with-hole")
    shell = re.search(r"Sh\n\n\d{7}\n((?:[-+]\d+ 0 )+)\*", shape)
    assert shell is not None
    less = " ".join(shell[1].split()[2:])
    with pytest.raises(Unreadable, match="do not close"):
        solid(PartShape(shape.replace(shell[1], less + " ")))


# --- masses --------------------------------------------------------------------------------------------------------


def assembly(shape: str) -> Document:
    document = Document()
    document.part("Base")
    document.part("Arm", pose(1, 2, 3, about=(0, 0, 30)), shape)
    document.ground("Base")
    document.joint("J", "Revolute", ("Base.", pose(1, 2, 3)), ("Arm.", pose()))
    return document


def test_parts_have_the_masses_of_their_shapes() -> None:
    """In the axes of the part, in kg, mm and kg mm^2."""
    volume, centre, inertia = block()
    path = assembly(text("block-with-hole")).write("a.FCStd")
    for density in (2700.0, {"Arm": 2700.0}):
        m = jp.read(path, output="Arm", density=density)
        assert m.value("bodies.Arm.mass") == pytest.approx(2.7e-6 * volume, rel=1e-11)
        assert m.value("bodies.Arm.centre") == pytest.approx(centre, abs=1e-9)
        found = m.value("bodies.Arm.rotational_inertia")
        assert found[:3] == pytest.approx(2.7e-6 * np.diag(inertia), rel=1e-9)
        assert found[3] == pytest.approx(2.7e-6 * inertia[0, 1], rel=1e-9)
        assert m.value("gravity") == [0, 0, -9.81]
    assert "bodies" not in jp.read(path, output="Arm").raw


def test_a_part_of_several_bodies_has_those_that_are_shown() -> None:
    """A container with one body, another one turned over, and a hidden one."""
    volume, centre, _ = block()
    document = Document()
    document.part("Base")
    for name, placed in (("one", pose()), ("two", pose(about=(0, 0, 180))), ("tool", pose())):
        document.body(name, placed, text("block-with-hole"))
    name, kind, properties = document.objects[-1]
    hidden = '<Property name="Visibility" type="App::PropertyBool"><Bool value="false"/></Property>'
    document.objects[-1] = name, kind, properties + hidden
    document.group.append("Arm")
    document.add("Arm", "App::Part", links("Group", ["one", "two", "tool"]))
    document.ground("Base")
    document.joint("J", "Revolute", ("Base.", pose()), ("Arm.one.", pose()))
    m = jp.read(document.write("a.FCStd"), output="Arm", density=1000)
    assert m.value("bodies.Arm.mass") == pytest.approx(2e-6 * volume, rel=1e-11)
    assert m.value("bodies.Arm.centre") == pytest.approx([0, 0, centre[2]], abs=1e-9)


def test_parts_without_a_volume_are_named() -> None:
    found = imported(assembly("").write("a.FCStd"), Options(density={"": 7850.0}))
    assert "These parts have no masses" in " ".join(found.notes)
    assert "Arm." in " ".join(found.notes)


@pytest.mark.parametrize(
    ("density", "said"),
    [
        ("-1", "--density: is more than 0"),
        ("Arm=1e9", "--density Arm: is more than 0"),
        ("arms=7850", "--density: 'arms' is not a part"),
        ("steel", "--density: a number of kg/m^3 is needed"),
        ("nan", "--density"),
    ],
)
def test_densities_that_nothing_has_are_refused(density: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assembly(text("block-with-hole")).write("a.FCStd")
    assert said in refused(capsys, "import", "a.FCStd", "--density", density)


def test_a_density_is_of_assemblies(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.pyslvs").write_text("M[]", encoding="utf-8")
    assert "is of assemblies with shapes" in refused(capsys, "import", "a.pyslvs", "--density", "7850")
