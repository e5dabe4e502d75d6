"""What robots and drawings seldom have: names that clash, laws of nothing, limits of one side, what is switched off."""

import math
from pathlib import Path

import ezdxf
import mujoco
import numpy as np
import pytest

import jointplay as jp
from jointplay.cli import run
from jointplay.exchange.options import Options
from jointplay.exchange.reading import Imported, imported


def read(name: str, text: str, options: Options | None = None) -> Imported:
    Path(name).write_text(text, encoding="utf-8")
    return imported(Path(name), options or Options())


def two_links(second: str = "", *, kind: str = "continuous", limit: str = "") -> str:
    """Two links on a base, each turning about z."""
    return f"""<robot name="r"><link name="base"/><link name="a"/><link name="b"/>
      <joint name="J" type="{kind}"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>{limit}</joint>
      <joint name="K" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
      {second}</joint></robot>"""


def mjcf(inside: str, *, option: str = "", more: str = "", joint: str = "") -> str:
    """A body `a` that turns, and what hangs on it."""
    return f"""<mujoco>{option}<worldbody><body name="a"><joint name="J" axis="0 0 1"{joint}/><geom size=".1"/>
      {inside}</body></worldbody>{more}</mujoco>"""


INNER = '<body name="b" pos="1 0 0"><joint name="K" axis="0 0 1"/><geom size=".1"/></body>'


def sdf(inside: str, *, world: str = "") -> str:
    inside = f'<model name="m">{inside}</model>'
    if world:
        inside = f'<world name="w">{world}{inside}</world>'
    return f'<sdf version="1.11">{inside}</sdf>'


# --- names -----------------------------------------------------------------------------------------------------------


def test_a_body_may_be_called_like_one_that_lies_between_two_joints() -> None:
    """The body between the joints x and y of `a` was the body `a-x` once, and the robot a closed loop."""
    text = """<mujoco><worldbody><body name="a" pos="0 0 1"><joint name="x" axis="0 1 0"/><joint name="y" axis="1 0 0"/>
      <geom size=".1"/><body name="a-x" pos="0 0 1"><joint name="z" axis="0 1 0"/><geom size=".1"/></body></body>
      </worldbody></mujoco>"""
    m = read("a.xml", text, Options(output="a-x", drives={"x": 20, "y": 30, "z": 0})).mechanism
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = np.radians([20, 30, 0])
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(jp.solve(m).nominal.values[0, :3] / 1e3, data.body("a-x").xpos, atol=1e-12)


def test_a_constraint_may_be_called_like_a_joint() -> None:
    text = f"""<mujoco><worldbody><body name="a"><joint name="J" axis="0 0 1"/><geom size=".1"/>{INNER}</body>
      <body name="c" pos="1 1 0"><joint name="top" axis="0 0 1"/><geom size=".1"/></body></worldbody>
      <equality><connect name="top" body1="b" body2="c" anchor="0 1 0"/></equality></mujoco>"""
    m = read("a.xml", text, Options(clearance={"top": {"radial": 0.1, "axial": 0.1, "length": 5}})).mechanism
    assert m.joints == ("J", "K", "top", "top_")
    assert m.sources == ("top",)


def test_a_link_may_be_called_like_the_cross_of_a_universal_joint() -> None:
    inside = """<link name="u-cross"/><link name="b"/>
      <joint name="u-first" type="revolute"><parent>world</parent><child>u-cross</child><axis/></joint>
      <joint name="u" type="universal"><parent>u-cross</parent><child>b</child><axis><xyz>1 0 0</xyz></axis>
      <axis2><xyz>0 1 0</xyz></axis2></joint>"""
    m = read("a.sdf", sdf(inside)).mechanism
    assert set(m.bodies) == {"u-cross", "b", "u-cross_"}
    assert len(m.drives) == len(m.joints) == 3


def test_options_mean_the_joint_that_the_format_calls_so() -> None:
    """`a.b` and `a b` are both a_b in a file: the second one gets a number, the file says it, and options find it."""
    text = (
        two_links()
        .replace('"J"', '"a b"')
        .replace('"K"', '"a.b"')
        .replace('"b"', '"the arm"')
        .replace('"a"', '"the.arm"')
    )
    found = read("a.urdf", text, Options(drives={"a.b": 10, "a b": 0}, output="the arm", clearance={"a.b": PIN}))
    m = found.mechanism
    assert "Another one has the name already: 'the arm' is the_arm_2, 'a.b' is a_b_2." in found.notes
    assert m.value("drives.a_b_2.values") == [10]
    assert m.value("output.body") == "the_arm_2"
    assert m.sources == ("a_b_2",)


PIN = {"radial": 0.1, "axial": 0.1, "length": 5}


def test_names_that_sdf_keeps_for_itself_are_refused() -> None:
    """A link called world was the ground."""
    joint = '<joint name="j" type="revolute"><parent>world</parent><child>b</child><axis/></joint>'
    with pytest.raises(jp.InputError, match="link 'world': the format keeps this name for itself"):
        read("a.sdf", sdf(f'<link name="world"/><link name="b"/>{joint}'))


# --- what joints follow, and their limits ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            two_links('<mimic joint="J" multiplier="0"/>'),
            "joint 'K' <mimic>: its factor is zero, so that it never moves",
        ),
        (
            two_links('<mimic joint="J"/>', kind="planar"),
            "joint 'K' <mimic>: 'J' is a planar joint, which has no coord",
        ),
        (
            two_links().replace("<axis", "<mimic joint='K'/><axis", 1).replace("continuous", "planar", 1),
            "'J' is a planar",
        ),
        (
            two_links(limit='<limit lower="1_0"/>', kind="revolute"),
            "joint 'J' <limit>: a number is needed, not \"1_0\"",
        ),
        (
            two_links().replace('<link name="b"/>', '<link name="b"><inertial><mass valu="3"/></inertial></link>'),
            "link 'b' <mass>: its value is missing",
        ),
    ],
)
def test_what_means_nothing_is_refused(text: str, problem: str) -> None:
    with pytest.raises(jp.InputError) as caught:
        read("a.urdf", text)
    assert problem in str(caught.value)


def test_an_mjcf_law_without_a_factor_holds_its_joint() -> None:
    """It was left out, and the joint became a drive."""
    law = '<equality><joint name="law" joint1="K" joint2="J" polycoef="0.1 0 0 0 0"/></equality>'
    found = read("a.xml", mjcf(INNER, more=law), Options(output="b"))
    assert "Equality constraints hold these joints, which are fixed: K." in found.notes
    assert found.mechanism.drives == ("J",)


def test_joints_that_others_follow_are_driven_first_and_lost_laws_are_named() -> None:
    """Three joints in a row: the last leads the first."""
    text = two_links().replace('<joint name="J"', '<link name="c"/><joint name="J"')
    third = '<joint name="L" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint></robot>'
    text = text.replace("</robot>", third).replace("<axis", '<mimic joint="L" multiplier="2"/><axis', 1)
    found = read("a.urdf", text)
    assert found.mechanism.drives == ("K", "L")
    assert found.mechanism.value("drives.L.joints") == {"L": 1, "J": 2}
    found = read("a.urdf", text, Options(drives={"K": None}))
    assert "These joints follow joints without a drive, which is left out: J." in found.notes


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ("0", "1e9", "Limits on one side only are left out: J."),
        ("2", "-2", "Limits that leave no range are left out: J."),
        (".5", ".5", "Limits that leave no range are left out: J."),
        ("-1e11", "1e11", None),
        ("0", "0", None),
    ],
)
def test_limits_that_a_file_cannot_have_are_named(low: str, high: str, said: str | None) -> None:
    found = read("a.urdf", two_links(kind="revolute", limit=f'<limit lower="{low}" upper="{high}"/>'))
    assert [note for note in found.notes if "imits" in note] == ([said] if said else [])
    assert "limits" not in found.mechanism.raw


# --- what MuJoCo switches off, and what it has besides ----------------------------------------------------------------


def test_what_the_flags_of_an_mjcf_switch_off_is_off() -> None:
    law = '<equality><joint name="law" joint1="K" joint2="J"/></equality>'
    off = '<option><flag gravity="disable" equality="disable" limit="disable"/></option>'
    limited = ' range="-10 10"'
    on, without = (read("a.xml", mjcf(INNER, option=option, more=law, joint=limited)) for option in ("", off))
    assert on.mechanism.value("gravity") == [0, 0, -9.81]
    assert on.mechanism.value("limits.drives.J") == [-10, 10]
    assert on.mechanism.drives == ("J",)
    assert "gravity" not in without.mechanism.raw
    assert "limits" not in without.mechanism.raw
    assert without.mechanism.drives == ("J", "K")
    assert "Equality constraints that are left out: law (not active)." in without.notes


def test_more_of_an_mjcf_that_is_left_out_is_named() -> None:
    ball = '<body gravcomp="1"><joint type="ball" range="0 20"/><geom size=".1"/></body>'
    moved = '</body><body name="hand" mocap="true"><geom size=".1"/>'
    notes = read("a.xml", mjcf(ball + moved)).notes
    assert "Left out: 3 shapes, limits of ball joints, compensation of gravity." in notes
    assert "Bodies that a program moves (mocap) are held: hand." in notes


def test_what_mujoco_says_in_two_lines_is_one() -> None:
    with pytest.raises(jp.InputError) as caught:
        read("a.xml", mjcf('<include file="nowhere.xml"/>'))
    assert "'nowhere.xml', Element 'include', line" in str(caught.value)


WELDED = """<mujoco><worldbody>
  <body name="crank"><joint name="A" axis="0 0 1" ref="20"/><geom size=".01"/>
    <body name="coupler" pos=".04 .05 0"><joint name="B" axis="0 0 -1"/><geom size=".01"/></body></body>
  <body name="rocker" pos=".14 0 0"><joint name="D" axis="0 0 1"/><geom size=".01"/>
    <body name="end" pos=".02 .11 0"><joint name="C" axis="0 0 1" ref="-30"/><geom size=".01"/></body></body>
  </worldbody><equality><weld body1="coupler" body2="end"/></equality></mujoco>"""


@pytest.mark.parametrize(("driven", "values", "other"), [("A", [12.0, 28.0], "C"), ("C", [-38.0, -22.0], "D")])
def test_in_the_plane_a_driven_angle_counts_from_the_zero_of_the_format(
    driven: str, values: list[float], other: str
) -> None:
    """Two references in one loop: axes of bodies can have one of them, and it was that of any joint."""
    found = {}
    for planar in (False, True):
        one = read("a.xml", WELDED, Options(output="coupler", drives={driven: values}, planar=planar))
        found[planar] = jp.solve(one.mechanism).nominal.sel(component=["x", "y"]).values
    np.testing.assert_allclose(found[True], found[False], atol=1e-7)
    assert sum("count from another zero" in note and note.endswith(f": {other}.") for note in one.notes) == 1


# --- worlds of SDF --------------------------------------------------------------------------------------------------


LINKS = """<pose relative_to="shelf">1 0 0 0 0 0</pose><link name="l"><inertial auto="true"/></link>
  <link name="k"><pose>0.5 0 0 0 0 0</pose></link><joint name="j" type="revolute"><parent>l</parent><child>k</child>
  <axis><xyz>0 0 1</xyz></axis></joint>"""
SHELF = """<frame name="shelf"><pose>0 0 2 0 0 0</pose></frame>
  <joint name="hinge" type="revolute"><parent>world</parent><child>m::l</child><axis><xyz>0 1 0</xyz></axis></joint>"""


def test_joints_and_frames_of_a_world_are_read() -> None:
    """The arm is 1.5 m long and lies on x, 2 m high; its hinge turns it about y by 30 degrees at x = 1 m."""
    found = read("a.sdf", sdf(LINKS, world=SHELF), Options(output="m::k", drives={"hinge": 30, "m::j": 0}))
    at = jp.solve(found.mechanism).nominal.values[0, :3]
    turn = math.radians(30)
    np.testing.assert_allclose(at, [1000 + 500 * math.cos(turn), 0, 2000 - 500 * math.sin(turn)], atol=1e-9)
    assert "Masses that follow from collision shapes are left out: m::l." in found.notes


def test_one_world_is_read() -> None:
    with pytest.raises(jp.InputError, match="<world>: has 2 worlds; one is read"):
        read("a.sdf", '<sdf version="1.9"><world name="a"/><world name="b"/></sdf>')


# --- drawings --------------------------------------------------------------------------------------------------------


def drawn(*texts: tuple[str, tuple[float, float]]) -> str:
    """A crank with a point, and texts."""
    doc = ezdxf.new(setup=True)
    doc.header["$INSUNITS"] = 4
    space = doc.modelspace()
    space.add_circle((10, 10), 3, dxfattribs={"layer": "ground"})
    space.add_line((10, 10), (60, 10), dxfattribs={"layer": "crank"})
    space.add_point((60, 10), dxfattribs={"layer": "crank"})
    for text, at in texts:
        space.add_text(text, dxfattribs={"insert": at})
    doc.saveas("crank.dxf")
    return "crank.dxf"


def test_the_text_at_the_only_point_is_its_name() -> None:
    found = imported(Path(drawn(("tip", (60, 10)), ("note", (0, 0)))), Options())
    assert found.notes == ("Texts that are at no pin and at no point are left out: note.",)
    assert imported(Path("crank.dxf"), Options(output="tip")).mechanism.value("output.at") == [60, 10]
    assert found.mechanism.value("output.at") == [60, 10]


def test_a_layer_is_no_point() -> None:
    """The origin of the drawing was the output, as if it were on the crank."""
    with pytest.raises(jp.InputError, match="output: 'crank' is not a point or a joint; known: ground-crank, output"):
        imported(Path(drawn()), Options(output="crank"))


def test_a_drawing_that_is_cut_off_says_so() -> None:
    with pytest.raises(jp.InputError, match="is no DXF: it ends too early"):
        read("a.dxf", "0\nSECTION\n")


def test_the_file_that_is_read_is_not_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    text = two_links()
    Path("a.urdf").write_text(text, encoding="utf-8")
    assert run(["import", "a.urdf", "-o", "a.urdf", "--force"]) == 2
    assert "a.urdf: --output: is the file that is read; name another one" in capsys.readouterr().err
    assert Path("a.urdf").read_text(encoding="utf-8") == text
