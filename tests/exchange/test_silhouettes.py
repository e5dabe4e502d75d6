"""Outlines of parts from their shapes, beside closed forms and rays along z; outlines of assemblies in their files."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.path import Path as Region
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.brep import BrepText, damaged
from helpers.freecad import Document, pose, pump
from jointplay.exchange.brep import PartShape, Unreadable
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported
from jointplay.exchange.silhouettes import MOST_POINTS, TOLERANCE, facets, silhouette
from jointplay.exchange.skeleton import Facets, Frame
from jointplay.exchange.solids import Patch, curve_of

SHAPES = Path(__file__).parent / "shapes"
Floats = np.ndarray
TURN, QUARTER = 2 * np.pi, np.pi / 2
#: the kinds of surfaces by their numbers, along the coordinate axes
UNIT = "0 0 0 0 0 1 1 0 0 0 1 0"


def text(name: str) -> str:
    return (SHAPES / f"{name}.brp").read_text(encoding="utf-8")


def part(*faces: tuple[str, list[tuple[float, float]]]) -> str:
    """A shape of faces: the surface, and the corners of the face in its parameters, in turn."""
    made = BrepText()
    return made.text([f"+@{made.patch(*face)}" for face in faces])


def rectangle(low: tuple[float, float], high: tuple[float, float]) -> list[tuple[float, float]]:
    return [low, (high[0], low[1]), high, (low[0], high[1])]


#: a ball of radius 5, a tube of radius 3 and length 20, a cone from radius 6 to 2 along 8, a ring of radii 10 and 2
BALL = part((f"4 {UNIT} 5", rectangle((0, -QUARTER), (TURN, QUARTER))))
TUBE = part((f"2 {UNIT} 3", rectangle((0, -10), (TURN, 10))))
SLOPE = np.arctan2(-4, 8)
CONE = part((f"3 {UNIT} 6 {SLOPE:.17g}", rectangle((0, 0), (TURN, 8 / np.cos(SLOPE)))))
RING = part((f"5 {UNIT} 10 2", rectangle((0, 0), (TURN, TURN))))


def turned(about: Floats) -> Frame:
    return Frame(axes=Rotation.from_rotvec(about).as_matrix())


def area(line: Floats) -> float:
    x, y = line.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def seen(shape: str, about: Floats | tuple[float, ...] = (0, 0, 0)) -> list[Floats]:
    """Outlines in mm of a shape that is turned by a rotation vector."""
    found = silhouette(facets(PartShape(shape)).within(turned(np.array(about))))
    assert sum(map(len, found)) <= MOST_POINTS
    return [1e3 * line for line in found]


def about_of(tilt: float) -> tuple[float, ...]:
    """A rotation that tilts the z axis, and then turns the drawing."""
    turn = Rotation.from_rotvec([0, 0, 0.3]) * Rotation.from_rotvec([0, tilt, 0])
    return tuple(turn.as_rotvec())


@pytest.mark.parametrize("tilt", [0.4, QUARTER])
@pytest.mark.parametrize(
    ("shape", "size", "areas"),
    [
        # A circle, whatever the direction.
        (BALL, 10, lambda _: np.pi * 25),
        # Its ends are open: a rectangle and two half ellipses.
        (TUBE, 20, lambda tilt: 6 * 20 * np.sin(tilt) + np.pi * 9 * np.cos(tilt)),
        # From the side a trapezoid; little tilted, a circle that hides the rest.
        (CONE, 12, lambda tilt: 8 * 8 if tilt == QUARTER else np.pi * 36 * np.cos(tilt)),
    ],
    ids=["ball", "tube", "cone"],
)
def test_round_parts_cover_what_they_do_by_hand(shape: str, size: float, areas: Any, tilt: float) -> None:
    """All within the stated tolerance of the whole way around."""
    if shape is CONE:
        # Its wide end is nearer to the viewer, and its bottom open.
        tilt = tilt if tilt == QUARTER else 0.2
    lines = seen(shape, about_of(tilt))
    expected = areas(tilt)
    outer = max(lines, key=area)
    length = np.hypot(*(np.roll(outer, -1, axis=0) - outer).T).sum()
    assert area(outer) == pytest.approx(expected, abs=TOLERANCE * size * length)


def test_a_ring_has_a_hole_from_above_and_none_from_its_side() -> None:
    outer, inner = sorted(seen(RING), key=area, reverse=True)
    assert area(outer) == pytest.approx(np.pi * 12**2, rel=4e-3)
    assert area(inner) == pytest.approx(-np.pi * 8**2, rel=6e-3)
    (side,) = seen(RING, (QUARTER, 0, 0))
    assert area(side) == pytest.approx(20 * 4 + np.pi * 4, rel=4e-3)


def test_a_plate_with_a_hole_has_its_corners_and_its_hole() -> None:
    """Corners are exact; the hole is inside of its circle, and off by no more than the tolerance."""
    outer, hole = seen(text("block-with-hole"))
    corners = {(x, y) for x in (5.0, 25.0) for y in (6.0, 36.0)}
    assert {tuple(corner) for corner in outer.round(4).tolist()} == corners
    away = np.hypot(*(hole - [12.0, 20.0]).T)
    assert np.abs(away - 4.0).max() < TOLERANCE * 30
    assert area(hole) == pytest.approx(-np.pi * 16, rel=6e-3)
    (side,) = seen(text("block-with-hole"), (QUARTER, 0, 0))
    assert np.ptp(side, axis=0) == pytest.approx([20, 10], abs=1e-4)
    assert len(side) == 4


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_turned_box_covers_what_its_visible_faces_do(seed: int) -> None:
    """Of a convex body: half of the sum of all faces, as they are seen. The hole of the block is hidden or within."""
    about = np.random.default_rng(seed).uniform(0.5, 1.0, 3)
    normals = np.abs(turned(about).axes[2])
    expected = float(normals @ [30 * 10, 20 * 10, 20 * 30])
    outer = max(seen(text("block-with-hole"), about), key=area)
    assert area(outer) == pytest.approx(expected, rel=1e-3)


def ray_area(shape: PartShape, frame: Frame, steps: int) -> float:
    """The area that rays along z meet, mm^2: every surface is met by its own equation."""
    edges = 1e3 * facets(shape).within(frame).ends[..., :2].reshape(-1, 2)
    low, high = edges.min(axis=0) - 0.1, edges.max(axis=0) + 0.1
    cell = (high - low) / steps
    x, y = np.meshgrid(*(low[k] + cell[k] * (np.arange(steps) + 0.5) for k in (0, 1)))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    hit = np.zeros(len(points), dtype=bool)
    for face in shape.faces():
        patch = Patch(shape, face, np.zeros(3))
        to = patch.matrix[:3, :3] @ np.array([patch.x, patch.y, patch.axis]).T
        own = (frame.axes @ to).T
        start = points @ own.T - (own @ (frame.axes @ (patch.matrix[:3, :3] @ patch.at + patch.matrix[:3, 3])))
        along = own[:, 2]
        quadric = {"plane": None, "cylinder": np.diag([1.0, 1.0, 0.0]), "sphere": np.eye(3)}[patch.kind]
        if quadric is None:
            times = [-start[:, 2] / along[2]]
        else:
            a, b = along @ quadric @ along, start @ quadric @ along
            square = b**2 - a * (np.einsum("ni,ij,nj->n", start, quadric, start) - patch.sizes[0] ** 2)
            root = np.sqrt(np.where(square < 0.0, np.nan, square))
            times = [(-b - root) / a, (-b + root) / a]
        loops = []
        for trace in shape.boundary(face):
            curve, spans, _ = curve_of(patch, trace)
            line = np.concatenate([curve(np.linspace(one, other, 200))[0] for one, other in spans])
            loops.append(line[::-1] if trace.is_reversed else line)
        rings = joined(loops)
        for t in times:
            p = start + t[:, None] * along
            if quadric is None:
                places = [p[:, :2]]
            else:
                u = np.arctan2(p[:, 1], p[:, 0])
                v = p[:, 2] if patch.kind == "cylinder" else np.arcsin(np.clip(p[:, 2] / patch.sizes[0], -1, 1))
                places = [np.stack([u + turn, v], axis=1) for turn in (-TURN, 0.0, TURN)]
            for place in places:
                known = np.isfinite(place).all(axis=1)
                inside = sum(ring.contains_points(np.where(known[:, None], place, 1e9)) for ring in rings)
                hit |= known & (inside % 2 == 1)
    return float(hit.sum() * cell.prod())


def joined(lines: list[Floats]) -> list[Region]:
    """Closed lines of edges in any order."""
    rings = []
    left = list(lines)
    while left:
        ring = left.pop(0)
        while np.hypot(*(ring[-1] - ring[0])) > 1e-5:
            k = min(range(len(left)), key=lambda k: np.hypot(*(left[k][0] - ring[-1])))
            ring = np.concatenate([ring, left.pop(k)])
        rings.append(Region(ring))
    return rings


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["fork", "rounded-box"])
def test_whole_parts_cover_what_rays_meet(name: str, seed: int) -> None:
    """A slanted pin, holes, edges that are splines, from any side. Of 100 x 100 rays those at the outline may miss."""
    shape = PartShape(text(name))
    frame = turned(Rotation.random(rng=np.random.default_rng(seed)).as_rotvec())
    lines = silhouette(facets(shape).within(frame))
    assert 1e6 * sum(map(area, lines)) == pytest.approx(ray_area(shape, frame, 100), rel=3e-3)


def test_a_face_that_does_not_close_has_no_outline() -> None:
    open_face = part((f"2 {UNIT} 3", [(0, 0), (1, 0), (1, 1)]))
    without = re.sub(r"(Wi\n\n0101100\n)\+\d+ 0 ", r"\1", open_face)
    assert len(seen(open_face, (QUARTER, 0, 0))) == 1
    with pytest.raises(Unreadable, match="a face does not close"):
        facets(PartShape(without))


@pytest.mark.parametrize("name", ["block-with-hole", "fork"])
def test_damaged_shapes_have_no_outline_or_one(name: str) -> None:
    """A number that is changed anywhere: nothing but `Unreadable`, and nothing takes long."""
    for changed in damaged(text(name), np.random.default_rng(6)):
        try:
            lines = silhouette(facets(PartShape(changed)))
        except Unreadable:
            continue
        assert all(np.isfinite(line).all() for line in lines)


@pytest.mark.parametrize("angle", [0.0, QUARTER, np.pi, *np.linspace(0.1, 6.0, 12)])
def test_parts_that_touch_are_one(angle: float) -> None:
    """Boxes side by side, each smaller than the one before: no line between them, and no corner but their own."""
    made = BrepText()
    boxes = [rectangle((10 * k, k), (10 * k + 10, 10 - k)) for k in range(4)]
    shape = made.text([f"+@{made.prism(np.eye(3), np.zeros(3), box, 0, 5)}" for box in boxes])
    (line,) = seen(shape, (0, 0, angle))
    assert len(line) == 16
    assert area(line) == pytest.approx(10 * (10 + 8 + 6 + 4), rel=1e-5)


def test_nothing_has_no_outline() -> None:
    assert silhouette(Facets()) == []


# --- assemblies -----------------------------------------------------------------------------------------------------


def assembly() -> Document:
    """A base that is placed somewhere, and an arm of a block and a bolt that turns on it; the bolt is fixed to it."""
    document = Document()
    base = pose(1, 2, 3, about=(0, 0, 90))
    document.part("Base", base, text("block-with-hole"))
    arm = pose(12, -7, 20, about=(0, 0, 30))
    document.part("Arm", arm, text("block-with-hole"))
    document.part("Bolt", arm @ pose(25, 10, 7), BALL)
    document.ground("Base")
    document.joint("J", "Revolute", ("Base.", base.inverse() @ arm), ("Arm.", pose()))
    document.joint("B", "Fixed", ("Arm.", pose(25, 10, 7)), ("Bolt.", pose()))
    return document


def test_an_assembly_has_the_outlines_of_its_parts_in_their_axes() -> None:
    """What is fixed is in the axes of the ground; a ball at the edge of a block is united with it."""
    path = assembly().write("a.FCStd")
    found = imported(path, Options(planar=True, output="Arm"))
    outer, hole = (np.array(line) for line in found.mechanism.value("bodies.ground.outline"))
    assert sorted(outer.round(3).tolist()) == [[5, 6], [5, 36], [25, 6], [25, 36]]
    assert np.hypot(*(hole - [12, 20]).T).max() == pytest.approx(4, abs=1e-3)
    outer, hole = (np.array(line) for line in found.mechanism.value("bodies.Arm.outline"))
    assert area(outer) == pytest.approx(600 + np.pi * 25 / 2, rel=3e-3)
    # The axes are those of the ground in the drawing, and the arm is turned by 30 - 90 degrees there.
    for corner in ([5, 6, 0], [5, 36, 0], [25, 36, 0], [30, 10, 0]):
        x, y, _ = pose(about=(0, 0, -60)).turn.apply(corner)
        assert np.hypot(*(outer - [x, y]).T).min() < (2e-3 if corner[0] < 30 else 0.3)
    assert not [note for note in found.notes if "outlines" in note]
    assert "bodies" not in jp.read(path, output="Arm").raw


def test_the_pump_of_the_documentation_is_covered_and_filled_as_by_hand() -> None:
    """Bars with round ends, a pin on one of them; a shaft from its side."""
    m = jp.read(pump().write("pump.FCStd"), planar=True, output="Slider", density=1000)
    crank, rod = (length * 2 * r + np.pi * r**2 for length, r in ((15, 7.5), (50, 6)))
    covered = {"Crank": crank - np.pi * 16, "Rod": rod - np.pi * (4.01**2 + 16), "Slider": 12 * 80, "ground": 84 * 24}
    for name, wanted in covered.items():
        lines = [np.array(line) for line in m.value(f"bodies.{name}.outline")]
        assert sum(map(area, lines)) == pytest.approx(wanted, rel=4e-3)
    volumes = {"Crank": 10 * crank, "Rod": 8 * covered["Rod"], "Slider": np.pi * (16 * 12 + 36 * 80)}
    for name, volume in volumes.items():
        assert m.value(f"bodies.{name}.mass") == pytest.approx(1e-6 * volume, rel=1e-9)


def test_parts_whose_outline_is_not_known_are_named() -> None:
    """A face of revolution of a line, which is a cylinder in other words, is not read."""
    document = assembly()
    shape = document.shapes["Arm.Shape.brp"]
    turned = shape.replace("\n2 12 20 0 0 0 1 1 0 -0 -0 1 0 4\n", "\n7 12 20 0 0 0 1 1 16 20 0 0 0 1\n")
    assert turned != shape
    document.shapes["Arm.Shape.brp"] = turned
    found = imported(document.write("a.FCStd"), Options(planar=True, output="Arm"))
    words = "they are not closed shapes of planes, cylinders, cones, spheres and tori: Arm."
    assert f"These parts have no outlines, because {words}" in found.notes
    # What is known of the same body is drawn.
    assert area(np.array(found.mechanism.value("bodies.Arm.outline.0"))) == pytest.approx(np.pi * 25, rel=3e-3)


@pytest.mark.parametrize(
    ("bound", "value", "said"),
    [
        ("MOST_MEETINGS", 1200, "too large or too detailed, are left out: ground, Arm."),
        ("FARTHEST", 0.01, "too large or too detailed, are left out: ground, Arm."),
        ("MOST_EDGES", 1200, "spheres and tori: Bolt."),
    ],
)
def test_outlines_that_would_take_long_are_left_out(
    bound: str, value: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"jointplay.exchange.silhouettes.{bound}", value)
    found = imported(assembly().write("a.FCStd"), Options(planar=True, output="Arm"))
    assert said in " ".join(found.notes)


def test_moments_of_inertia_turn_with_the_part_that_is_fixed() -> None:
    """A base that stands on its side: the arm on it had the moments about the axes of the drawing."""
    moments = []
    for about in ((0, 0, 0), (90, 0, 0), (20, 50, -70)):
        document = Document()
        document.part("Base", pose(1, 2, 3, about=about))
        document.part("Arm", pose(1, 2, 3), text("block-with-hole"))
        document.ground("Base")
        document.joint("J", "Revolute", ("Base.", pose(about=about).inverse()), ("Arm.", pose()))
        m = jp.read(document.write("a.FCStd"), output="Arm", density=2700)
        moments.append([*m.value("bodies.Arm.rotational_inertia"), 0, 0][:6])
    assert moments[1] == pytest.approx(moments[0], abs=1e-9)
    assert moments[2] == pytest.approx(moments[0], abs=1e-9)
