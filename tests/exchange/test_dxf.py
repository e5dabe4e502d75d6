"""Drawings in DXF, as a person draws them: layers are bodies, what coincides is joined."""

import contextlib
import io
import itertools
import math
import random
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.cli import run
from jointplay.exchange.drafting import to_dxf

A, D = np.array([0.0, 0.0]), np.array([100.0, 0.0])
CRANK, COUPLER, ROCKER = 40.0, 110.0, 70.0
#: the coupler point in axes of the coupler, from B along BC
P = np.array([50.0, 30.0])
PLAY = {"revolute": {"radial": 0.05}}


def pose(theta: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """B, C and the coupler point of the four-bar for the angle of its crank: two circles that meet, C above."""
    b = A + CRANK * np.array([math.cos(theta), math.sin(theta)])
    gap = D - b
    r = float(np.hypot(*gap))
    along = (COUPLER**2 - ROCKER**2 + r**2) / (2 * r)
    across = math.sqrt(COUPLER**2 - along**2)
    u = gap / r
    c = b + along * u + across * np.array([-u[1], u[0]])
    v = (c - b) / COUPLER
    return b, c, b + P[0] * v + P[1] * np.array([-v[1], v[0]])


START = math.radians(60)


def document(unit: int = 4, layers: Iterable[str] = ("ground", "crank", "coupler", "rocker")) -> Any:
    """An empty drawing."""
    doc = ezdxf.new("R2010", setup=True)
    doc.header["$INSUNITS"] = unit
    for name in layers:
        doc.layers.add(name)
    return doc


def four_bar(unit: int = 4, scale: float = 1.0, words: bool = True) -> Any:
    """A four-bar linkage as a person draws it: bars, holes, a coupler plate, a point, letters, a frame and a title."""
    doc = document(unit)
    space = doc.modelspace()
    a, d = A * scale, D * scale
    b, c, p = (x * scale for x in pose(START))
    space.add_line(a, d, dxfattribs={"layer": "ground"})
    for hole in (a, d):
        space.add_circle(hole, 3 * scale, dxfattribs={"layer": "ground"})
    space.add_line(a, b, dxfattribs={"layer": "crank"})
    space.add_lwpolyline([b, c, p], close=True, dxfattribs={"layer": "coupler"})
    space.add_line(c, d, dxfattribs={"layer": "rocker"})
    space.add_point(p, dxfattribs={"layer": "coupler"})
    if words:
        for word, where in zip("ABCD", (a, b, c, d), strict=True):
            space.add_text(word, height=3 * scale, dxfattribs={"layer": "names"}).set_placement(where)
    return doc


def saved(doc: Any, folder: Path, name: str = "linkage.dxf") -> Path:
    path = folder / name
    doc.saveas(path)
    return path


class TestFourBar:
    def test_it_is_the_one_that_is_drawn(self, tmp_path: Path) -> None:
        """Positions along the path against two circles that meet."""
        turns = np.arange(0, 360, 30)
        m = jp.read(saved(four_bar(), tmp_path), drives={"A": turns.tolist()})
        assert m.bodies == ("crank", "rocker", "coupler")
        assert m.joints == ("A", "D", "B", "C")
        expected = [pose(START + math.radians(turn))[2] for turn in turns]
        np.testing.assert_allclose(jp.solve(m).nominal.sel(component=["x", "y"]), expected, atol=1e-9)

    def test_all_four_questions_are_answered(self, tmp_path: Path) -> None:
        m = jp.read(saved(four_bar(), tmp_path), drives={"A": [0, 30, 60]}, clearance=PLAY)
        m = m.with_({"loads": [{"force": [0, -10]}]})
        worst, loaded = jp.worst(m), jp.loaded(m)
        assert (worst.status == "ok").all()
        assert (loaded.status == "ok").all()
        assert (np.hypot(*loaded.error.sel(component=["x", "y"]).T) <= worst.worst_position + 1e-9).all()
        assert (jp.random(m, samples=500).error_std > 0).all()
        given = jp.given(m, {"A": [0.05, 0]})
        # A crank that is off by d moves the coupler point as the linkage does with its pivot at d: finite difference.
        shifted = m.with_({"joints.A": {"type": "revolute", "on": {"ground": [0.05, 0], "crank": [0, 0]}}})
        moved = jp.solve(shifted).nominal - jp.solve(m).nominal
        np.testing.assert_allclose(given.error.sel(component=["x", "y"]), moved.sel(component=["x", "y"]), atol=1e-6)

    @pytest.mark.parametrize(("unit", "mm"), [(4, 1.0), (5, 10.0), (6, 1000.0), (1, 25.4), (2, 304.8)])
    def test_the_unit_of_the_drawing_counts(self, unit: int, mm: float, tmp_path: Path) -> None:
        m = jp.read(saved(four_bar(unit, 1 / mm), tmp_path))
        np.testing.assert_allclose(m.value("joints.D.at"), [100, 0], rtol=1e-12)

    def test_a_drawing_without_a_unit_is_in_mm_and_says_so(self, tmp_path: Path) -> None:
        m = jp.read(saved(four_bar(0), tmp_path))
        assert m.value("joints.D.at") == [100, 0]
        assert "does not say its unit" in written(m, tmp_path)

    def test_joints_are_called_by_their_bodies_where_nothing_else_is_said(self, tmp_path: Path) -> None:
        m = jp.read(saved(four_bar(words=False), tmp_path))
        assert m.joints == ("ground-crank", "ground-rocker", "crank-coupler", "coupler-rocker")

    def test_another_layer_can_be_the_ground(self, tmp_path: Path) -> None:
        doc = four_bar()
        for entity in doc.modelspace():
            if entity.dxf.layer == "ground":
                entity.dxf.layer = "Gestell"
        path = saved(doc, tmp_path)
        with pytest.raises(
            jp.InputError, match=r"linkage\.dxf: ground: has no layer 'ground' .* lines or points: Gestell, crank"
        ):
            jp.read(path)
        assert jp.read(path, ground="Gestell").joints == ("A", "D", "B", "C")
        with pytest.raises(jp.InputError, match=r"ground: 'Rahmen' is no layer"):
            jp.read(path, ground="Rahmen")

    def test_a_joint_can_be_the_output(self, tmp_path: Path) -> None:
        m = jp.read(saved(four_bar(), tmp_path), output="C")
        np.testing.assert_allclose(m.value("output.at"), pose(START)[1], rtol=1e-12)
        assert m.value("output.body") == "rocker"


def written(m: jp.Mechanism, folder: Path) -> str:
    m.write(folder / "read.toml")
    return (folder / "read.toml").read_text(encoding="utf-8")


def slider_crank(linetype: bool) -> Any:
    """A slider-crank: a centre line on the ground, one on the slider. The crank's pivot lies on the guide."""
    doc = document(layers=("ground", "crank", "rod", "slider"))
    space = doc.modelspace()
    tip, wrist = (30.0, 40.0), (150.0, 0.0)
    space.add_circle((0, 0), 2, dxfattribs={"layer": "ground"})
    if linetype:
        space.add_line((100, 0), (300, 0), dxfattribs={"layer": "ground", "linetype": "CENTER"})
    else:
        space.add_xline((0, 0), (1, 0), dxfattribs={"layer": "ground"})
    space.add_line((0, 0), tip, dxfattribs={"layer": "crank"})
    space.add_line(tip, wrist, dxfattribs={"layer": "rod"})
    space.add_circle(wrist, 4, dxfattribs={"layer": "slider"})
    space.add_lwpolyline([(130, -10), (170, -10), (170, 10), (130, 10)], close=True, dxfattribs={"layer": "slider"})
    space.add_line((130, 0), (170, 0), dxfattribs={"layer": "slider", "linetype": "CENTER"})
    space.add_point((170, 0), dxfattribs={"layer": "slider"})
    return doc


@pytest.mark.parametrize("linetype", [True, False])
def test_guides_that_lie_along_one_another_are_a_slider(linetype: bool, tmp_path: Path) -> None:
    turns = [0.0, 45.0, 200.0]
    path = saved(slider_crank(linetype), tmp_path)
    m = jp.read(path, drives={"ground-crank": turns}, clearance={"prismatic": {"gap": 0.02, "length": 40}})
    assert [m.value(f"joints.{name}.type") for name in m.joints] == ["revolute", "revolute", "revolute", "prismatic"]
    assert m.value("joints.ground-slider.at") == [150, 0]
    length, radius, start = math.hypot(120, 40), 50.0, math.atan2(40, 30)
    angles = [start + math.radians(turn) for turn in turns]
    stroke = [radius * math.cos(t) + math.sqrt(length**2 - (radius * math.sin(t)) ** 2) for t in angles]
    np.testing.assert_allclose(jp.solve(m).nominal.sel(component="x"), np.array(stroke) + 20, atol=1e-9)


def test_sliders_on_one_line_are_not_joined_with_one_another(tmp_path: Path) -> None:
    """Two pistons, right and left of a crank, on one construction line; one piston's own line passes the crank."""
    doc = document(layers=("ground", "crank", "rod1", "rod2", "right", "left"))
    space = doc.modelspace()
    space.add_xline((0, 0), (1, 0), dxfattribs={"layer": "ground"})
    space.add_circle((0, 0), 2, dxfattribs={"layer": "ground"})
    space.add_line((30, 40), (-30, -40), dxfattribs={"layer": "crank"})
    space.add_circle((0, 0), 2, dxfattribs={"layer": "crank"})
    space.add_line((30, 40), (150, 0), dxfattribs={"layer": "rod1"})
    space.add_line((-30, -40), (-150, 0), dxfattribs={"layer": "rod2"})
    space.add_line((-20, 0), (170, 0), dxfattribs={"layer": "right", "linetype": "CENTER"})
    space.add_circle((150, 0), 2, dxfattribs={"layer": "right"})
    space.add_line((-130, 0), (-170, 0), dxfattribs={"layer": "left", "linetype": "CENTER"})
    space.add_circle((-150, 0), 2, dxfattribs={"layer": "left"})
    # A point that lies on the line by chance is no pin in a slot.
    space.add_point((100, 0), dxfattribs={"layer": "rod1"})
    m = jp.read(saved(doc, tmp_path))
    assert [name for name in m.joints if m.value(f"joints.{name}.type") != "revolute"] == [
        "ground-right",
        "ground-left",
    ]
    assert len(m.joints) == 7
    assert (jp.solve(m).status == "ok").all()


def test_a_pin_on_a_construction_line_slides_in_a_slot(tmp_path: Path) -> None:
    """A crank whose pin drives a slotted lever: the lever is along the line from its pivot to the pin."""
    doc = document(layers=("ground", "crank", "lever"))
    space = doc.modelspace()
    pin = np.array([20.0, 100.0])
    space.add_line((0, 0), (0, 100), dxfattribs={"layer": "ground"})
    space.add_line((0, 100), pin, dxfattribs={"layer": "crank"})
    space.add_line((0, 0), pin * 1.5, dxfattribs={"layer": "lever"})
    space.add_ray((0, 0), pin / np.hypot(*pin), dxfattribs={"layer": "lever"})
    space.add_point(pin * 1.5, dxfattribs={"layer": "lever"})
    m = jp.read(saved(doc, tmp_path), drives={"ground-crank": [0, 90]})
    assert m.value("joints.lever-crank.type") == "pin_in_slot"
    reach = 1.5 * np.hypot(*pin)
    expected = [pin * 1.5, reach * np.array([0.0, 1.0])]
    np.testing.assert_allclose(jp.solve(m).nominal.sel(component=["x", "y"]), expected, atol=1e-9)


def test_several_bodies_share_a_pin(tmp_path: Path) -> None:
    doc = document(layers=("ground", "a", "b", "c"))
    space = doc.modelspace()
    space.add_point((-50, 0), dxfattribs={"layer": "ground"})
    space.add_point((50, 0), dxfattribs={"layer": "ground"})
    for layer, foot in (("a", (-50, 0)), ("b", (50, 0)), ("c", (0, 120))):
        space.add_line(foot, (0, 60), dxfattribs={"layer": layer})
    space.add_text("apex").set_placement((0, 60))
    space.add_mtext("output", dxfattribs={"insert": (0, 120)})
    space.add_point((0, 120), dxfattribs={"layer": "c"})
    m = jp.read(saved(doc, tmp_path))
    assert [m.value(f"joints.{name}.bodies") for name in ("apex", "apex_2")] == [["a", "b"], ["a", "c"]]
    assert m.value("output") == {"body": "c", "at": [0, 120]}


def test_ends_that_nearly_touch_are_joined_within_a_distance(tmp_path: Path) -> None:
    doc = four_bar()
    (rocker,) = doc.modelspace().query('LINE[layer=="rocker"]')
    rocker.dxf.start = (rocker.dxf.start.x + 0.05, rocker.dxf.start.y, 0.0)
    path = saved(doc, tmp_path)
    # As it is drawn the rocker holds nothing, and two more motions have to be driven.
    open_ = jp.read(path)
    assert "--within joins them" in " ".join(written(open_, tmp_path).replace("\n#", "").split())
    assert len(open_.drives) == 3
    assert jp.read(path, within=0.06).drives == ("A",)
    assert run(["import", str(path), "--within", "0.06", "-o", str(tmp_path / "joined.toml")]) == 0
    assert jp.load(tmp_path / "joined.toml").joints == ("A", "D", "B", "C")
    for wrong in (-1.0, float("nan")):
        with pytest.raises(jp.InputError, match="within: is a distance in mm"):
            jp.read(path, within=wrong)


def test_what_is_left_out_is_named(tmp_path: Path) -> None:
    doc = four_bar()
    space = doc.modelspace()
    doc.layers.add("hidden").off()
    space.add_line((0, 0), (20, 20), dxfattribs={"layer": "hidden"})
    space.add_lwpolyline([(-50, -50), (250, -50), (250, 150), (-50, 150)], close=True, dxfattribs={"layer": "frame"})
    space.add_text("scale 1:1", dxfattribs={"layer": "frame"}).set_placement((-40, -40))
    space.add_spline([(0, 0), (5, 9), (9, 0)], dxfattribs={"layer": "coupler"})
    space.add_line((0, 0), (9, 9), dxfattribs={"layer": "0"})
    near = pose(START)[1] + [0.1, 0]
    space.add_circle(near, 3, dxfattribs={"layer": "crank"})
    said = " ".join(written(jp.read(saved(doc, tmp_path)), tmp_path).replace("\n#", "").split())
    assert "Layers that are off or frozen are left out: hidden." in said
    assert "Left out: 1 SPLINE on layer 'coupler', 1 LINE on layer '0'." in said
    assert "Layers that touch no other one are left out: frame." in said
    assert "Texts that are at no pin and at no point are left out: scale 1:1." in said
    assert "Points of the layers coupler, rocker, crank are 0.1 mm apart" in said


def test_a_mirrored_circle_is_where_it_is_seen(tmp_path: Path) -> None:
    """Programs that mirror write circles in a plane seen from behind, whose x goes the other way."""
    doc = four_bar()
    for entity in doc.modelspace().query("CIRCLE"):
        if entity.dxf.center.x > 0:
            entity.dxf.center, entity.dxf.extrusion = (-100, 0, 0), (0, 0, -1)
    for entity in doc.modelspace().query("LINE[layer=='ground']"):
        doc.modelspace().delete_entity(entity)
    assert jp.read(saved(doc, tmp_path)).value("joints.D.at") == [100, 0]


def off_plane(doc: Any) -> None:
    doc.modelspace().add_line((0, 0, 5), (9, 9, 5), dxfattribs={"layer": "crank"})


def no_point(doc: Any) -> None:
    for entity in doc.modelspace().query("POINT"):
        doc.modelspace().delete_entity(entity)


def two_points(doc: Any) -> None:
    doc.modelspace().add_point(pose(START)[1], dxfattribs={"layer": "rocker"})


def apart(doc: Any) -> None:
    for entity in doc.modelspace().query("LINE CIRCLE LWPOLYLINE POINT"):
        if entity.dxf.layer == "ground":
            entity.translate(0, -30, 0)


def no_length(doc: Any) -> None:
    doc.modelspace().add_line((0, 0), (0, 0), dxfattribs={"layer": "ground", "linetype": "CENTER"})


def odd_unit(doc: Any) -> None:
    doc.header["$INSUNITS"] = 18


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (off_plane, r"LINE #[0-9A-F]+ on layer 'crank': is not in the plane: z = 5"),
        (
            no_point,
            r"output: there is none: draw a POINT on the layer of the body that carries it, or name a joint",
        ),
        (
            two_points,
            r"output: which point is it\? Name one of coupler-point, C, or write the text 'output' at one",
        ),
        (apart, r"nothing joins these layers with the ground: crank, coupler, rocker"),
        (no_length, r"LINE #[0-9A-F]+ on layer 'ground': is a centre line without length"),
        (odd_unit, r"\$INSUNITS: 18 is no unit that is read"),
    ],
)
def test_what_cannot_be_read_is_said(spoil: Any, message: str, tmp_path: Path) -> None:
    doc = four_bar()
    spoil(doc)
    with pytest.raises(jp.InputError, match=rf"linkage\.dxf: {message}"):
        jp.read(saved(doc, tmp_path))


def test_other_files_are_no_drawings(tmp_path: Path) -> None:
    path = tmp_path / "no.dxf"
    with pytest.raises(jp.InputError, match=r"no\.dxf: there is no such file"):
        jp.read(path)
    for content in (b"", b"format = 1\n", bytes(range(256)), b"\xff\xfe0\n\x00"):
        path.write_bytes(content)
        with pytest.raises(jp.InputError, match=r"no\.dxf: is no DXF"):
            jp.read(path)


def test_a_damaged_drawing_is_read_or_refused(tmp_path: Path) -> None:
    lines = saved(four_bar(), tmp_path).read_text(encoding="utf-8").splitlines()
    path = tmp_path / "damaged.dxf"
    rng = random.Random(0)
    odd = ["nan", "inf", "1e300", "x", "", "0", "LINE", "POINT", "\u00e9", "9" * 30]
    for _ in range(150):
        other = list(lines)
        for _ in range(rng.choice([1, 2, 5])):
            k = rng.randrange(lines.index("ENTITIES"), len(lines))
            other[k : k + 1] = rng.choice([[], [rng.choice(odd)], [rng.choice(odd), *other[k : k + 1]], other[k:][:1]])
        path.write_text("\n".join(other), encoding="utf-8")
        # Any other error fails the test.
        with contextlib.suppress(jp.InputError):
            jp.read(path)


# --- the drawing of a mechanism --------------------------------------------------------------------------------------

#: kinds that a drawing can hold
DRAWN = {"revolute", "prismatic", "pin_in_slot"}


def example(name: str) -> jp.Mechanism:
    return jp.loads(jp.examples.text(name), f"{name}.toml")


def is_drawn(name: str) -> bool:
    m = example(name)
    return m.spec()["space"] == "planar" and {*m.joint_kinds} <= DRAWN


def drawn(m: jp.Mechanism, configuration: int = 0) -> Any:
    return ezdxf.read(io.StringIO(to_dxf(m, configuration)))


@pytest.mark.parametrize("name", jp.examples.names())
def test_a_drawing_is_sound(name: str) -> None:
    m = example(name)
    doc = drawn(m)
    audit = doc.audit()
    assert not audit.errors
    assert not audit.fixes
    layers = {entity.dxf.layer for entity in doc.modelspace()}
    assert {*m.owners} <= layers | {m.owners[body] for body in m.crosses}
    texts = {entity.dxf.text for entity in doc.modelspace().query("TEXT")}
    assert {*m.raw.get("joints", {})} <= texts
    assert texts >= ({*m.outputs} or {"output"})


@pytest.mark.parametrize("configuration", [0, -1])
@pytest.mark.parametrize("name", [name for name in jp.examples.names() if is_drawn(name)])
def test_what_is_drawn_is_read_as_the_same_mechanism(name: str, configuration: int, tmp_path: Path) -> None:
    """The output goes the same way when the joints with the same names are driven by as much from the drawing on."""
    m = example(name)
    m = m.only(output=m.outputs[0]) if m.outputs else m
    solved = jp.solve(m)
    k = range(solved.sizes["configuration"])[configuration]
    path = tmp_path / "drawn.dxf"
    path.write_text(to_dxf(m, k), encoding="utf-8")
    joints = [m.joints[joint].partition("/")[0] for joint in m.drive_joints]
    drives = {
        joint: (solved[drive] - solved[drive][k]).values.tolist() for drive, joint in zip(m.drives, joints, strict=True)
    }
    read = jp.read(path, drives=drives, output="output" if not m.outputs else m.outputs[0])
    assert {*read.bodies} == {*m.bodies}
    there = jp.solve(read)
    moved = there.nominal.sel(component=["x", "y"])
    np.testing.assert_allclose(moved, solved.nominal.sel(component=["x", "y"]), atol=1e-8)


def test_a_drawing_has_the_unit_and_the_path_of_its_mechanism(tmp_path: Path) -> None:
    m = example("slider-crank").with_({"units.length": "in"})
    doc = drawn(m, 2)
    assert doc.header["$INSUNITS"] == 1
    (path,) = doc.modelspace().query("LWPOLYLINE[layer=='_path']")
    np.testing.assert_allclose(
        [point[:2] for point in path], jp.solve(m).nominal.sel(component=["x", "y"]), rtol=1e-12, atol=1e-12
    )
    (point,) = doc.modelspace().query("POINT")
    np.testing.assert_allclose(point.dxf.location.vec2, jp.solve(m).nominal.sel(component=["x", "y"])[2], rtol=1e-12)


def test_a_pin_in_space_is_a_circle_across_its_axis() -> None:
    m = example("rssr")
    doc = drawn(m)
    (joint,) = [joint for name, joint in zip(m.joints, m.spec()["joints"], strict=True) if name == m.joints[0]]
    assert joint["kind"] == "revolute"
    circles = [c for c in doc.modelspace().query("CIRCLE") if c.dxf.layer == "ground"]
    place = np.array(m.spec()["points"][joint["first"]]["at"]) / m.units.length
    found = [c for c in circles if np.allclose(tuple(c.ocs().to_wcs(c.dxf.center)), place)]
    assert found
    np.testing.assert_allclose(np.abs(np.dot(tuple(found[0].dxf.extrusion), joint["axis_first"])), 1.0, rtol=1e-12)


def test_bodies_keep_their_layers_whatever_they_are_called(tmp_path: Path) -> None:
    """Layers do not know small letters from capital ones, and some names have a meaning."""
    b = planar()
    names = ["ground", "arm", "ARM", "0", "_x", "a:b|c", "Glied-\u00e4"]
    for k, (one, other) in enumerate(itertools.pairwise(names)):
        b.revolute(f"J{k}", on={one: (100, 0), other: (0, 0)})
        b.drive(f"q{k}", joint=f"J{k}", values=[20 * k + 5])
    b.output(body=names[-1], at=(50, 0))
    path = tmp_path / "names.dxf"
    path.write_text(to_dxf(b.mechanism()), encoding="utf-8")
    read = jp.read(path, drives={f"J{k}": 0 for k in range(6)})
    assert read.bodies == ("arm", "ARM_2", "0_2", "body_x", "a_b_c", "Glied-\u00e4")
    expected = jp.solve(b.mechanism()).nominal.sel(component=["x", "y"])
    np.testing.assert_allclose(jp.solve(read).nominal.sel(component=["x", "y"])[0], expected[0], rtol=1e-12)


def test_what_cannot_be_drawn_is_said() -> None:
    with pytest.raises(jp.InputError, match="configuration: 11 is not the number of a configuration; 0 to 10 are"):
        to_dxf(example("four-bar"), 11)
    with pytest.raises(jp.InputError, match=r"four-bar\.toml: configuration 1 cannot be assembled"):
        to_dxf(example("four-bar").with_({"drives.theta1.values": [22.7, 180.0]}), 1)


def test_drawings_come_and_go_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    saved(four_bar(), tmp_path)
    options = ["--clearance", "revolute={radial=0.05}", "--drives", "A=0:90:4", "--output-point", "C"]
    assert run(["import", "linkage.dxf", *options]) == 0
    m = jp.load("linkage.toml")
    assert m.sources == ("A", "D", "B", "C")
    assert m.value("drives.A.values") == [0, 30, 60, 90]
    assert run(["export", "linkage.toml", "-o", "out.dxf", "-c", "3"]) == 0
    assert run(["import", "out.dxf"]) == 0
    np.testing.assert_allclose(jp.load("out.toml").value("output.at"), pose(START + math.pi / 2)[1], atol=1e-9)
    for line, says in (
        (["import", "linkage.dxf"], "linkage.toml: exists already"),
        (["import", "linkage.dxf", "--force", "--ground", "x"], "linkage.dxf: --ground: 'x' is no layer"),
        (["import", "linkage.dxf", "--force", "--clearance", "prismatic={gap=1}"], "there is no prismatic joint here"),
        (["export", "linkage.toml", "-o", "bad.dxf", "-c", "4"], "--configuration: 4 is not the number"),
        (["export", "linkage.toml", "-o", "nowhere/x.dxf"], "nowhere"),
    ):
        capsys.readouterr()
        before = {path: path.read_bytes() for path in tmp_path.iterdir()}
        assert run(line) == 2
        assert says in capsys.readouterr().err
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


class TestOneLayer:
    """A linkage as it is sketched: all lines on one layer, each a body."""

    def sketch(self, layer: str, names: bool) -> Any:
        doc = four_bar()
        for entity in list(doc.modelspace()):
            if names or entity.dxftype() != "TEXT":
                entity.dxf.layer = layer
            if not names and entity.dxftype() == "LINE" and entity.dxf.start.isclose((*A, 0)):
                entity.destroy() if entity.dxf.end.isclose((*D, 0)) else None
        b, c, _ = pose(START)
        words = {"ground": (A + D) / 2, "crank": (A + b) / 2, "coupler": (b + c) / 2, "rocker": (c + D) / 2}
        for word, at in words.items() if names else [("ground", A), ("Ground", D)]:
            doc.modelspace().add_text(word, dxfattribs={"layer": layer}).set_placement(at)
        return doc

    @pytest.mark.parametrize("layer", ["0", "sketch"])
    def test_it_is_the_linkage_that_has_a_layer_for_each_body(self, layer: str, tmp_path: Path) -> None:
        drives = {"A": [0, 30, 60]}
        layers = jp.read(saved(four_bar(), tmp_path, "layers.dxf"), drives=drives)
        m = jp.read(saved(self.sketch(layer, names=True), tmp_path), drives=drives)
        assert {*m.bodies} == {*layers.bodies}
        assert m.joints == layers.joints
        np.testing.assert_allclose(jp.solve(m).nominal, jp.solve(layers).nominal, atol=1e-9)

    def test_pivots_may_say_what_is_fixed(self, tmp_path: Path) -> None:
        """No line of the ground, no names: circles and the word at the pivots."""
        m = jp.read(saved(self.sketch("0", names=False), tmp_path), drives={"A": [0, 30, 60]})
        assert {*m.bodies} == {"link1", "link2", "link3"}
        expected = [pose(START + math.radians(turn))[2] for turn in (0, 30, 60)]
        np.testing.assert_allclose(jp.solve(m).nominal.sel(component=["x", "y"]), expected, atol=1e-9)

    def test_a_circle_pins_a_bar_in_its_middle_and_a_centre_line_is_fixed(self, tmp_path: Path) -> None:
        """An elliptic trammel: a bar with pins on two axes, carried by a crank to its middle."""
        doc = document(layers=())
        space, half = doc.modelspace(), np.array([30.0, 40.0])
        space.add_line((60, 0), (0, 80))
        space.add_line((0, 0), half)
        space.add_circle(half, 2)
        for end in ((100, 0), (0, 100)):
            space.add_line((0, 0), end, dxfattribs={"linetype": "CENTER"})
        space.add_text("ground").set_placement((0, 0))
        space.add_point((45, 20))
        m = jp.read(saved(doc, tmp_path))
        assert sorted(joint.kind for joint in m.data.joints.values()) == [
            "pin_in_slot",
            "pin_in_slot",
            "revolute",
            "revolute",
        ]

    def test_what_is_missing_is_said(self, tmp_path: Path) -> None:
        doc = document(layers=())
        doc.modelspace().add_line((0, 0), (10, 0))
        doc.modelspace().add_line((10, 0), (10, 20))
        with pytest.raises(jp.InputError, match=r"nothing says what is fixed: .* bodies: link1, link2"):
            jp.read(saved(doc, tmp_path))
        doc.modelspace().add_point((50, 50))
        with pytest.raises(jp.InputError, match=r"output: the POINT at \(50, 50\) mm is on no line"):
            jp.read(saved(doc, tmp_path), ground="link1")
