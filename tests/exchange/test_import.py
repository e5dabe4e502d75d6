"""Robots of other formats: their poses are those of other engines, and what cannot be read is said in one line."""

import importlib.util
import itertools
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.commands import refused
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported
from jointplay.exchange.shaping import legal

HERE = Path(__file__).resolve().parents[1]
ROBOTS = HERE / "data" / "robots"
EXAMPLES = HERE.parent / "docs" / "robots"
Floats = NDArray[np.float64]
#: numbers of a file have 12 decimals of a millimetre or of a direction; a chain of a few metres adds them up
ROUNDING = 1e-11


def gymnasium_models() -> list[Path]:
    """MJCF models of the package gymnasium, which need not be imported for it."""
    spec = importlib.util.find_spec("gymnasium")
    assert spec is not None
    assert spec.origin is not None
    return sorted(Path(spec.origin).parent.glob("envs/mujoco/assets/*.xml"))


def described() -> list[Path]:
    """Robots of the package example-robot-data, where it is installed: it is large."""
    share = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"
    return sorted(share.rglob("*.urdf"))


def matrix(pose: Floats) -> Floats:
    return pin.Quaternion(*pose[3:]).toRotationMatrix()


def solved(m: jp.Mechanism) -> Floats:
    """Poses of all bodies over the configurations, metres and quaternions."""
    assert m.drive_values is not None
    found: Floats = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"]
    return found


def coordinates(m: jp.Mechanism, configuration: int) -> Iterator[tuple[str, float]]:
    """Coordinates of the driven joints in SI."""
    assert m.drive_values is not None
    for moves, value in zip(m.drive_moves, m.drive_values[configuration], strict=True):
        for joint, coefficient in moves:
            yield m.joints[joint], float(value * coefficient)


def written(folder: Path, text: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


# --- URDF ------------------------------------------------------------------------------------------------------------


def against_pinocchio(path: Path, m: jp.Mechanism) -> float:
    """Largest difference of a pose of a link, m and parts of a unit vector."""
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    joints = {legal(name): joint for name, joint in zip(model.names, model.joints, strict=True)}
    links = {legal(f.name): k for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}
    worst = 0.0
    for number, found in enumerate(solved(m)):
        q = pin.neutral(model)
        for name, value in coordinates(m, number):
            joint = joints[name]
            turns = joint.nq == 2
            q[joint.idx_q : joint.idx_q + joint.nq] = (math.cos(value), math.sin(value)) if turns else value
        pin.framesForwardKinematics(model, data, q)
        for name, pose in zip(m.bodies, found, strict=True):
            frame = data.oMf[links[name]]
            worst = max(worst, np.abs(pose[:3] - frame.translation).max(), np.abs(matrix(pose) - frame.rotation).max())
    return worst


@pytest.mark.parametrize("path", [ROBOTS / "panda.urdf", EXAMPLES / "arm.urdf"], ids=lambda path: path.stem)
def test_links_of_a_urdf_are_where_pinocchio_has_them(path: Path) -> None:
    m = jp.read(path)
    assert len(m.bodies) > 5
    assert against_pinocchio(path, m) < ROUNDING


@pytest.mark.skipif(not described(), reason="example-robot-data is not installed")
@pytest.mark.parametrize("path", described(), ids=lambda path: path.stem)
def test_robots_of_others_are_where_pinocchio_has_them(path: Path) -> None:
    try:
        m = jp.read(path)
    except jp.InputError as error:
        # Two flying robots without joints, a file that is none, and a hand whose joints mimic names without a prefix.
        known = ("no joint that lets something move", "has no <link>", "<mimic>: 'index_q1' is not a joint")
        assert any(problem in str(error) for problem in known)  # noqa: PT017
        return
    assert against_pinocchio(path, m) < ROUNDING


def test_masses_of_links_that_are_fixed_to_each_other_are_added() -> None:
    """Total mass and its centre in every configuration; the base belongs to the ground."""
    path = ROBOTS / "panda.urdf"
    m = jp.read(path)
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    moving = list(model.inertias)[1:]
    for number, found in enumerate(solved(m)):
        q = pin.neutral(model)
        for name, value in coordinates(m, number):
            q[model.joints[model.getJointId(name)].idx_q] = value
        pin.forwardKinematics(model, data, q)
        placed = zip(list(data.oMi)[1:], moving, strict=True)
        want = sum(inertia.mass * (place * inertia.lever) for place, inertia in placed)
        masses = [(m.data.bodies[name].mass, np.array(m.data.bodies[name].centre) / 1e3) for name in m.bodies]
        got = sum(mass * (pose[:3] + matrix(pose) @ centre) for (mass, centre), pose in zip(masses, found, strict=True))
        assert sum(mass for mass, _ in masses) == pytest.approx(sum(inertia.mass for inertia in moving), rel=1e-12)
        assert got == pytest.approx(want, abs=ROUNDING)
    assert m.value("gravity") == [0, 0, -9.81]


FINGERS = """<robot name="fingers"><link name="palm"/><link name="a"/><link name="b"/><link name="c"/><link name="tip"/>
  <joint name="J1" type="revolute"><parent link="palm"/><child link="a"/><origin xyz="0 0 .1" rpy=".3 0 .2"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="J2" type="revolute"><parent link="a"/><child link="b"/><origin xyz=".2 0 0" rpy="0 .4 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>
    <mimic joint="J1" multiplier="-0.5" offset="0.25"/></joint>
  <joint name="J3" type="prismatic"><parent link="b"/><child link="c"/><origin xyz=".1 .02 0"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/>
    <mimic joint="J2" multiplier="0.1" offset="0.01"/></joint>
  <joint name="J4" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0 0 .3"/></joint></robot>"""


def test_joints_that_mimic_others_follow_with_their_factors_and_offsets(tmp_path: Path) -> None:
    path = written(tmp_path, FINGERS)
    m = jp.read(path, drives={"J1": [-30, 0, 45]}, output="tip")
    assert m.drives == ("J1",)
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    for angle, nominal in zip((-30, 0, 45), jp.solve(m).nominal.values, strict=True):
        one = math.radians(angle)
        two = 0.25 - 0.5 * one
        pin.framesForwardKinematics(model, data, np.array([one, two, 0.01 + 0.1 * two]))
        assert nominal[:3] / 1e3 == pytest.approx(data.oMf[model.getFrameId("tip")].translation, abs=ROUNDING)
    # The zero of a follower is where its leader is zero, and so are its limits.
    low, high = m.value("limits.joints.J2")
    assert (low, high) == pytest.approx((math.degrees(-2.25), math.degrees(1.75)))


def test_a_link_can_be_the_ground(tmp_path: Path) -> None:
    """Seen from the tip, the palm is where the inverse of its pose is; gravity turns with the axes."""
    path = written(tmp_path, FINGERS)
    m = jp.read(path, ground="tip", output="palm", drives={"J1": 20})
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    one = math.radians(20)
    pin.framesForwardKinematics(model, data, np.array([one, 0.25 - 0.5 * one, 0.01 + 0.1 * (0.25 - 0.5 * one)]))
    seen = data.oMf[model.getFrameId("tip")].inverse() * data.oMf[model.getFrameId("palm")]
    assert jp.solve(m).nominal.values[0, :3] / 1e3 == pytest.approx(seen.translation, abs=ROUNDING)


# --- MJCF ------------------------------------------------------------------------------------------------------------


def against_mujoco(path: Path, m: jp.Mechanism) -> float:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warnings.warn", lambda *_, **__: None)
        model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    worst = 0.0
    for number, found in enumerate(solved(m)):
        data.qpos[:] = model.qpos0
        for name, value in coordinates(m, number):
            data.qpos[model.joint(name).qposadr] = value
        mujoco.mj_kinematics(model, data)
        names = {model.body(k).name or f"body{k}": k for k in range(model.nbody)}
        for name, pose in zip(m.bodies, found, strict=True):
            if name not in names:
                continue  # between two joints of one body
            body = data.body(names[name])
            turned = body.xmat.reshape(3, 3)
            worst = max(worst, np.abs(pose[:3] - body.xpos).max(), np.abs(matrix(pose) - turned).max())
    return worst


@pytest.mark.parametrize("path", gymnasium_models(), ids=lambda path: path.stem)
def test_bodies_of_an_mjcf_are_where_mujoco_has_them(path: Path) -> None:
    m = jp.read(path)
    assert len(m.drives) == len(m.joints) > 1
    assert against_mujoco(path, m) < ROUNDING


def test_a_loop_of_an_mjcf_is_closed_where_mujoco_has_it_closed() -> None:
    """Coordinates of a closed five-bar leave no residual of the equality constraint."""
    path = EXAMPLES / "five-bar.xml"
    for planar in (False, True):
        m = jp.read(path, output="tip", drives={"left": [-20, 0, 25], "right": [10, 0, -15]}, planar=planar)
        result = jp.solve(m)
        assert set(result.status.values) == {"ok"}
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        for number in range(3):
            for joint in ("left", "left_elbow", "right", "right_elbow"):
                angle = float(result.coordinate.sel(joint=joint)[number])
                data.qpos[model.joint(joint).qposadr] = math.radians(angle)
            mujoco.mj_forward(model, data)
            assert np.abs(data.efc_pos[:3]).max() < ROUNDING
            tip = result.nominal.values[number][: 2 if planar else 3] / 1e3
            assert tip == pytest.approx(data.site("tip").xpos[: len(tip)], abs=ROUNDING)


MECHANISM = """<mujoco><compiler angle="degree"/><worldbody>
  <body name="a" pos="0 0 1"><joint name="J1" axis="0 1 0" ref="10" range="-50 80"/><geom size=".1" mass="2"/>
    <body name="b" pos=".3 0 0"><joint name="J2" axis="0 1 0"/><joint name="J3" type="slide" axis="1 0 0" pos="0 0 .1"/>
      <geom size=".1"/><body name="plate" pos="0 .1 0"><geom size=".1"/></body></body></body>
  </worldbody><equality><joint joint1="J2" joint2="J1" polycoef="0.1 -2 0 0 0"/>{more}</equality></mujoco>"""


def test_coupled_joints_of_an_mjcf_follow_each_other(tmp_path: Path) -> None:
    """The reference of a joint is where its coordinate is `ref`, and both ends of the law count from there."""
    path = written(tmp_path, MECHANISM.format(more=""), "a.xml")
    m = jp.read(path, drives={"J1": [10, 40], "J3": [0, 50]}, output="plate")
    assert m.value("limits.drives.J1") == pytest.approx([-50, 80])
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for (angle, travel), nominal in zip(((10, 0), (40, 0.05)), jp.solve(m).nominal.values, strict=True):
        data.qpos[:] = math.radians(angle), 0.1 - 2 * math.radians(angle - 10), travel
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[:1]).max() < ROUNDING
        assert nominal[:3] / 1e3 == pytest.approx(data.body("plate").xpos, abs=ROUNDING)


def test_what_an_mjcf_says_beyond_the_mechanism_is_named(tmp_path: Path) -> None:
    more = '<weld body1="a" body2="b" active="false" name="off"/><joint joint1="J3" polycoef="0 0 0 0 0" name="stay"/>'
    found = imported(written(tmp_path, MECHANISM.format(more=more), "a.xml"), Options())
    assert "Left out: 3 shapes." in found.notes
    assert "Equality constraints that are left out: off (not active)." in found.notes
    assert "Equality constraints hold these joints, which are fixed: J3." in found.notes
    # Comments of the file are broken into lines.
    assert all(note in found.text.replace("\n# ", " ") for note in found.notes)


def test_a_weld_makes_one_body_of_two(tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="a"><joint name="J1" axis="0 0 1"/><geom size=".1" mass="1"/></body>
      <body name="b" pos="1 0 0" euler="0 0 30"><freejoint/><geom size=".1" mass="3"/></body></worldbody>
      <equality><weld body1="a" body2="b"{more}/></equality></mujoco>"""
    m = jp.read(written(tmp_path, text.format(more=""), "a.xml"), output="b", drives={"J1": 90})
    # Balls of 0.1 m: 2/5 m r^2 of both, and 3/4 kg about the line across their distance of 1 m.
    assert m.value("bodies.a") == {"mass": 4, "centre": [750, 0, 0], "rotational_inertia": [16000, 766000, 766000]}
    assert jp.solve(m).nominal.values[0, :3] == pytest.approx([0, 1000, 0], abs=1e-8)
    with pytest.raises(jp.InputError, match="weld 'equality0': holds its bodies in another pose"):
        jp.read(written(tmp_path, text.format(more=' relpose="1 1 0 1 0 0 0"'), "b.xml"))


def test_bodies_and_joints_without_a_name_get_one(tmp_path: Path) -> None:
    """Their number, where nothing else is called so."""
    text = """<mujoco><worldbody><body name="body2"><joint name="joint1"/><geom size=".1"/>
      <body pos="1 0 0"><joint/><geom size=".1"/></body></body></worldbody></mujoco>"""
    m = jp.read(written(tmp_path, text, "a.xml"))
    assert m.bodies == ("body2", "body2_")
    assert m.joints == ("joint1", "joint1_")


def test_includes_and_meshes_that_are_missing(tmp_path: Path) -> None:
    """A body of which only the mesh has a mass has none; a sensor of the mesh and materials go with it."""
    arm = '<body name="arm"><joint name="J1"/><geom name="g" type="mesh" mesh="m"/></body>'
    text = """<mujoco><asset><mesh name="m" file="no.stl"/><texture name="t" type="2d" file="no.png"/>
      <material name="c" texture="t"/></asset><worldbody><geom size="1" material="c"/><include file="arm.inc"/>
      </worldbody>
      <sensor><distance geom1="g" body2="world" cutoff="1"/></sensor></mujoco>"""
    path = written(tmp_path, text, "a.xml")
    for more, masses in (("", False), ('<geom size=".1"/>', True)):
        inside = arm.replace("<geom", f"{more}<geom")
        written(tmp_path, f"<mujocoinclude>{inside}</mujocoinclude>", "arm.inc")
        found = imported(path, Options())
        assert "Files of meshes are missing: masses that follow from them are missing as well." in found.notes
        assert ("[bodies.arm]" in found.text) == masses
    # What stops MuJoCo beside that is said.
    with pytest.raises(jp.InputError, match=r"MuJoCo cannot compile it: .*'K'"):
        imported(written(tmp_path, text.replace("<sensor>", '<sensor><jointpos joint="K"/>'), "a.xml"), Options())


def test_what_mujoco_warns_of_is_a_remark_and_no_file(tmp_path: Path) -> None:
    """By itself it writes MUJOCO_LOG.TXT where it is called."""
    text = MECHANISM.format(more="").replace('size=".1" mass="2"', 'size=".1" mass="2" rgba="nan 0 0 1"')
    try:
        found = imported(written(tmp_path, text, "a.xml"), Options())
    except jp.InputError as error:
        assert "MuJoCo" in str(error)  # noqa: PT017
    else:
        assert any(note.startswith("MuJoCo: ") for note in found.notes)
    assert [path.name for path in tmp_path.iterdir()] == ["a.xml"]


# --- SDF -------------------------------------------------------------------------------------------------------------


def test_frames_of_an_sdf_are_given_in_one_another() -> None:
    """The crank of the press is raised by 0.6 rad and 50 mm long, its rod is 160 mm long, its shaft 500 mm high."""
    m = jp.read(EXAMPLES / "press.sdf", output="tool", drives={"main": [0, 30]})
    travel = [50 * math.cos(a) + math.sqrt(160**2 - (50 * math.sin(a)) ** 2) for a in (0.6, 0.6 + math.pi / 6)]
    # Eight digits of the angle of the rod let the ram start 0.01 mm below the shaft.
    want = [[x + 50, 0, 490] for x in travel]
    assert jp.solve(m).nominal.values[:, :3] == pytest.approx(np.array(want), abs=0.02)
    assert jp.check(m).attrs["degrees_of_freedom"] == 1


def test_cassie_closes_its_loops() -> None:
    """Two legs with two loops each; every link starts where the file has it."""
    m = jp.read(ROBOTS / "cassie.sdf")
    assert len(m.joints) - len(m.bodies) == 4
    # As it is drawn its knees are straight, which their ranges exclude.
    assert set(jp.solve(m).status.values) <= {"ok", "outside_limits"}
    # `<pose>` of the toe is in the axes of the model; the pelvis is held where it is.
    frame = dict(zip(m.bodies, solved(m)[0], strict=True))
    text = (ROBOTS / "cassie.sdf").read_text(encoding="utf-8")
    for name in ("left-foot", "right-foot", "left-tarsus"):
        pose = text.partition(f"<link name='{name}'>")[2].partition("<pose>")[2].partition("</pose>")[0]
        at = np.array(pose.split(), dtype=float)[:3]
        # Loops of rounded numbers close within the digits of the file.
        assert frame[name][:3] == pytest.approx(at, abs=1e-4)


@pytest.mark.parametrize(
    ("version", "axis", "want"),
    [
        ("1.4", "<xyz>1 0 0</xyz>", [1, 0, 0]),
        ("1.6", "<xyz>1 0 0</xyz>", [0, 1, 0]),
        ("1.6", "<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>", [1, 0, 0]),
        ("1.9", "<xyz>1 0 0</xyz>", [0, 1, 0]),
        ("1.9", '<xyz expressed_in="__model__">1 0 0</xyz>', [1, 0, 0]),
        ("1.9", '<xyz expressed_in="inner::part">0 1 0</xyz>', [-1, 0, 0]),
    ],
)
def test_axes_of_an_sdf_are_in_the_frame_that_its_version_says(
    tmp_path: Path, version: str, axis: str, want: list[float]
) -> None:
    """The link and its joint are turned by 90 degrees about z against the model."""
    text = f"""<sdf version="{version}"><model name="m">
      <model name="inner"><pose>0 0 1 0 0 1.5707963267948966</pose>
        <link name="part"><pose>.1 0 0 0 0 0</pose></link></model>
      <joint name="J" type="revolute"><parent>world</parent><child>inner::part</child><axis>{axis}</axis></joint>
    </model></sdf>"""
    m = jp.read(written(tmp_path, text, "m.sdf"))
    assert m.bodies == ("inner::part",)
    place = m.value("joints.J.on.ground")
    assert (place["at"], place["axis"]) == ([0, 100, 1000], want)


@pytest.mark.parametrize(
    ("pitch", "lead"),
    [
        ("<screw_thread_pitch>0.005</screw_thread_pitch>", 5),
        ("<thread_pitch>-1256.6370614359173</thread_pitch>", 5),
        ("<thread_pitch>1256.6370614359173</thread_pitch>", -5),
    ],
)
def test_leads_of_screws(tmp_path: Path, pitch: str, lead: float) -> None:
    """The older key is in rad/m, and a left-hand thread has a positive one."""
    text = f"""<sdf version="1.10"><model name="m"><link name="nut"/><joint name="J" type="screw"><parent>world</parent>
      <child>nut</child>{pitch}<axis><xyz>0 0 1</xyz></axis></joint></model></sdf>"""
    m = jp.read(written(tmp_path, text, "m.sdf"), drives={"J": [0, 180, 360]})
    assert m.value("joints.J.lead") == pytest.approx(lead)
    assert jp.solve(m).nominal.values[:, 2] == pytest.approx([0, lead / 2, lead])


def test_joints_of_an_sdf_with_two_axes_are_two_joints(tmp_path: Path) -> None:
    text = """<sdf version="1.9"><world name="w"><gravity>0 0 -1.6</gravity><model name="m"><link name="a"/>
      <joint name="J" type="universal"><pose>0 0 .1 0 0 0</pose><parent>world</parent><child>a</child>
      <axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint></model>
      <model name="n"><static>true</static><link name="a"/></model></world></sdf>"""
    m = jp.read(written(tmp_path, text, "m.sdf"), drives={"m::J-first": 90, "m::J-second": 90})
    # The origin of the link, 100 mm below: about y it goes to -x, and about x it stays there.
    assert jp.solve(m).nominal.values[0, :3] == pytest.approx([-100, 0, 100], abs=1e-9)


# --- in the plane ----------------------------------------------------------------------------------------------------


def chain(axis: str) -> str:
    return f"""<robot name="two"><link name="base"/><link name="one"/><link name="two"/><link name="tip"/>
      <joint name="J1" type="continuous"><parent link="base"/><child link="one"/><origin xyz="0 .05 .2" rpy="0 .3 0"/>
        <axis xyz="{axis}"/></joint>
      <joint name="J2" type="continuous"><parent link="one"/><child link="two"/><origin xyz=".3 .02 0"/>
        <axis xyz="0 -1 0"/></joint>
      <joint name="J3" type="prismatic"><parent link="two"/><child link="tip"/><origin xyz=".2 0 0"/><axis xyz="1 0 0"/>
        <limit lower="0" upper=".2"/></joint></robot>"""


@pytest.mark.parametrize("axis", ["0 1 0", "0 -1 0"])
def test_a_planar_mechanism_is_that_in_space_seen_along_its_pins(tmp_path: Path, axis: str) -> None:
    path = written(tmp_path, chain(axis))
    drives = {"J1": [0, 30, -50], "J2": [10, 80, -20], "J3": [0, 100, 20]}
    flat, full = (jp.solve(jp.read(path, drives=drives, planar=planar)).nominal.values for planar in (True, False))
    assert flat[:, :2] == pytest.approx(full[:, [0, 2]], abs=1e-8)


def test_what_is_out_of_the_plane_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        jp.InputError,
        match=r"planar joint 'J2': its axis is 45 degrees off the normal of the plane \[0\.955, 0, -0\.296\]",
    ):
        jp.read(written(tmp_path, chain("1 0 0").replace("0 -1 0", "1 -1 0")), planar=True)
    with pytest.raises(jp.InputError, match=r"planar joint 'J3': its axis is .* degrees out of the plane"):
        jp.read(written(tmp_path, chain("0 1 0").replace('<axis xyz="1 0 0"', '<axis xyz="1 1 0"')), planar=True)


# --- loops of URDF ---------------------------------------------------------------------------------------------------

FOUR_BAR = """<robot name="4r"><link name="base"/><link name="crank"/><link name="coupler"/><link name="rocker"/>
  <link name="end"/>
  <joint name="J1" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 0 1"/>
    <origin rpy="0 0 0.4"/></joint>
  <joint name="J2" type="continuous"><parent link="crank"/><child link="coupler"/>
    <origin xyz=".075 0 0" rpy="0 0 1.85"/><axis xyz="0 0 1"/></joint>
  <joint name="J4" type="continuous"><parent link="base"/><child link="rocker"/><origin xyz="-.1 0 0" rpy="0 0 0.6"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="tip" type="fixed"><parent link="coupler"/><child link="end"/><origin xyz=".075 0 0"/></joint></robot>"""
AXIS = {"axis": [0, 0, 1]}


@pytest.mark.parametrize("planar", [True, False])
def test_a_loop_that_is_named_closes_a_four_bar(tmp_path: Path, planar: bool) -> None:
    """Its poses are those of the bundled four-bar, whose lengths it has."""
    path = written(tmp_path, FOUR_BAR)
    loop = {"J3": {"type": "revolute", "on": {"end": {"at": [0, 0, 0], **AXIS}, "rocker": [150, 0, 0]}}}
    angles = [22.7, 48.98, 76.39]
    m = jp.read(
        path, loops=loop, planar=planar, drives={"J1": [angle - math.degrees(0.4) for angle in angles]}, output="end"
    )
    want = jp.solve(jp.loads(jp.examples.text("four-bar")).with_({"drives.theta1.values": angles})).nominal.values
    # The output of the bundled one is the same pin.
    assert jp.solve(m).nominal.values[:, :2] == pytest.approx(want[:, :2], abs=1e-7)


def test_a_loop_that_cannot_be_closed_says_where_it_is_open(tmp_path: Path) -> None:
    loop = {"J3": {"on": {"end": {"at": [0, 0, 0], **AXIS}, "rocker": [400, 0, 0]}}}
    with pytest.raises(jp.InputError, match=r"robot\.urdf: its loops cannot be closed\. .*'J\d' is open by"):
        jp.read(written(tmp_path, FOUR_BAR), loops=loop, planar=True)


# --- the file, and the command line ----------------------------------------------------------------------------------


def test_the_file_says_where_clearances_are_written(tmp_path: Path) -> None:
    """Taking the # away is enough."""
    text = imported(EXAMPLES / "press.sdf", Options()).text
    assert text.startswith("# Imported from press.sdf.\n")
    assert text.count("\n# clearance = ") == 4
    assert not jp.loads(text).sources
    assert jp.loads(text.replace("# clearance", "clearance")).sources == ("main", "big_end", "small_end", "guide")


def test_drives_of_a_loop_are_the_joints_with_motors(tmp_path: Path) -> None:
    """Then those that are nearest to the ground; what is asked for comes first."""
    text = (EXAMPLES / "five-bar.xml").read_text(encoding="utf-8")
    assert jp.read(EXAMPLES / "five-bar.xml").drives == ("left", "right")
    moved = text.replace('<position joint="left"', '<position joint="right_elbow"')
    assert jp.read(written(tmp_path, moved, "moved.xml")).drives == ("right", "right_elbow")
    alone = text.replace('<position joint="left" kp="10"/>', "").replace('joint="right" kp', 'joint="left_elbow" kp')
    assert jp.read(written(tmp_path, alone, "alone.xml")).drives == ("left", "left_elbow")
    assert jp.read(EXAMPLES / "five-bar.xml", drives=["left_elbow", "right"]).drives == ("left_elbow", "right")
    with pytest.raises(jp.InputError, match="the drive of 'right' is redundant: it would move what left, left_elbow"):
        jp.read(EXAMPLES / "five-bar.xml", drives=["left", "left_elbow", "right"])


def test_proposed_values_are_as_many_as_those_that_are_given() -> None:
    m = jp.read(EXAMPLES / "arm.urdf", drives={"waist": [0, 10, 20], "elbow": 5, "roll": None})
    assert m.drives == ("waist", "elbow", "roll")
    assert m.drive_values is not None
    assert m.drive_values.shape == (3, 3)
    every = jp.read(EXAMPLES / "arm.urdf").drive_values
    assert every is not None
    assert every.shape == (6, 6)


def test_robots_are_asked_all_questions() -> None:
    play = "revolute={radial=0.02,axial=0.02,length=30}"
    assert run(["import", str(EXAMPLES / "arm.urdf"), "--output-point", "tool0", "--clearance", play]) == 0
    assert run(["error", "arm.toml", "--samples", "64"]) == 0
    assert run(["error", "arm.toml", "-q", "given", "--offset", "elbow=0.01,0,0,0,0"]) == 0
    flat = ["--planar", "--clearance", "revolute={radial=0.02}"]
    assert run(["import", str(EXAMPLES / "five-bar.xml"), *flat, "--output-point", "tip"]) == 0
    assert run(["error", "five-bar.toml", "--samples", "64"]) == 0
    assert run(["error", "five-bar.toml", "-q", "given", "--offset", "top=0.01,0"]) == 0


def long_chain(count: int) -> str:
    pin = '<joint name="J{0}" type="continuous"><parent link="{0}"/><child link="{1}"/></joint>'
    links = "".join(f'<link name="{k}"/>' for k in range(count + 1))
    return f"<robot>{links}{''.join(pin.format(k, k + 1) for k in range(count))}</robot>"


def frames_in_frames(first: str, count: int) -> str:
    frames = "".join(f'<frame name="f{k + 1}"><pose relative_to="f{k}"/></frame>' for k in range(count))
    start = f'<pose relative_to="{first}"/>' if first != "f0" else ""
    link = f'<link name="a"><pose relative_to="f{count}"/></link>'
    pin = '<joint name="J" type="revolute"><parent>world</parent><child>a</child><axis/></joint>'
    return f'<sdf version="1.9"><model name="m"><frame name="f0">{start}</frame>{frames}{link}{pin}</model></sdf>'


BAD: list[tuple[str, str, str, list[str], str]] = [
    ("a.urdf", "<robot", "", [], r"a\.urdf: line 1, column \d+: is not XML: "),
    ("a.urdf", "<model/>", "", [], r"a\.urdf: has the root element <model>; a URDF file has <robot>"),
    (
        "a.xml",
        "<html/>",
        "",
        [],
        r"a\.xml: has the root element <html>; files of robots have one of <robot>, ",
    ),
    ("a.step", "", "", [], r"a\.step: '\.step' is not the extension of a format that is read; known: \.urdf, \.sdf, "),
    ("a.urdf", '<!DOCTYPE r [<!ENTITY a "b">]><robot/>', "", [], "has a document type"),
    ("a.urdf", "<a>" * 300, "", [], "nested more than 200 deep"),
    ("a.urdf", "\x00", "", [], "is a binary file, not a URDF file"),
    ("a.urdf", "<robot/>", "", [], "has no <link>"),
    ("a.urdf", '<robot><link name="a"/></robot>', "", [], "has no joint that lets something move"),
    ("a.urdf", '<robot xmlns:xacro="x"><xacro:macro/></robot>', "", [], "has macros of xacro"),
    ("a.urdf", chain("0 0 0"), "", [], r"joint 'J1' <axis>: \"0 0 0\" is no direction"),
    ("a.urdf", chain("0 x 0"), "", [], "joint 'J1' <axis>: 3 numbers with blanks between them are needed, not"),
    ("a.urdf", chain("0 1 0"), 'parent link="one"', ['parent link="ome"'], "'ome' is not a link; did you mean 'one'?"),
    ("a.urdf", chain("0 1 0"), 'child link="tip"', ['child link="one"'], "several links without a parent: base, tip"),
    ("a.urdf", chain("0 1 0"), '"prismatic"', ['"slider"'], "joint 'J3': 'slider' is not a type of joint"),
    (
        "a.urdf",
        chain("0 1 0"),
        'parent link="base"',
        ['parent link="two"'],
        "links hang on one another in a circle: one, two, tip",
    ),
    ("a.urdf", long_chain(1001), "", [], "1001 is not a number of joints that is read; 0 to 1000 are possible"),
    ("a.urdf", FINGERS, 'joint="J1"', ['joint="J3"'], r"joint 'J\d' <mimic>: follows itself"),
    ("a.sdf", frames_in_frames("f0", 300), "", [], "frames are given in one another more than 200 deep"),
    ("a.sdf", frames_in_frames("f2", 3), "", [], r"f\d: frames are given in one another in a circle"),
    ("a.sdf", frames_in_frames("no", 3), "", [], "'no' is not a frame; known: world, "),
    ("a.sdf", "<sdf/>", "", [], "has no <model>"),
    ("a.sdf", '<sdf version="x"/>', "", [], 'version: "x" is no version of SDF'),
]


@pytest.mark.parametrize(("name", "text", "old", "new", "problem"), BAD, ids=range(len(BAD)))
def test_what_cannot_be_read_is_said_in_one_line(
    name: str, text: str, old: str, new: list[str], problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path, text.replace(old, *new) if old else text, name)
    assert re.search(problem, refused(capsys, "import", name))


OPTIONS: list[tuple[list[str], str]] = [
    (["--output-point", "tol0"], r"arm\.urdf: --output-point: 'tol0' is not a link; did you mean 'tool0'\? Known: "),
    (["--output-point", "base"], "--output-point: 'base' is fixed to the ground and has no error"),
    (["--drives", "wiast"], "--drives: 'wiast' is not a joint that can be driven; did you mean 'waist'?"),
    (["--drives", "waist=x"], "--drives waist: "),
    (["--drives", "waist=500"], "--drives waist: 500 is outside"),
    (
        ["--clearance", "revolut={radial=1}"],
        "--clearance revolut: 'revolut' is not a joint or a kind of joint; did",
    ),
    (
        ["--clearance", "prismatic={gap=1}"],
        "--clearance prismatic: there is no prismatic joint here; there are rev",
    ),
    (["--clearance", "revolute=0.02"], r"--clearance revolute: a table is needed, such as \{ radial = 0.02 \}"),
    (["--clearance", "elbow={radail=1}"], "--clearance elbow: 'radail' is not a key here; did you mean 'radial'?"),
    (["--clearance", "elbow"], '--clearance: "elbow" is not KEY=VALUE'),
    (["--ground", "bse"], "--ground: 'bse' is not a link; did you mean 'base'?"),
    (["--planar"], "--planar joint 'shoulder': its axis is 90 degrees off the normal"),
    (["--loop", "L={on={wrist=[0,0,0],base=[0,0]}}"], r"--loop L on\.base\.at: three numbers are needed"),
    (["--loop", "L={on={wrist=[0,0,0],bas=[0,0,0]}}"], "--loop L: 'bas' is not a link; did you mean 'base'?"),
    (["--loop", "L={type='fixed'}"], "--loop L: 'fixed' is not a joint that closes a loop"),
    (["--loop", "L={on={wrist=[0,0,0],base=[0,0,0]}}"], "--loop L: a revolute joint needs an axis on its first link"),
    (["--output", "nowhere/a.toml"], "nowhere/a.toml: there is no folder 'nowhere'"),
]


@pytest.mark.parametrize(("options", "problem"), OPTIONS, ids=lambda value: " ".join(value) if value else "")
def test_options_that_do_not_fit_are_named(
    options: list[str], problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "arm.urdf").write_text((EXAMPLES / "arm.urdf").read_text(encoding="utf-8"), encoding="utf-8")
    assert re.search(problem, refused(capsys, "import", "arm.urdf", *options))


def test_a_file_is_replaced_only_by_force(capsys: pytest.CaptureFixture[str]) -> None:
    arm = str(EXAMPLES / "arm.urdf")
    assert run(["import", arm]) == 0
    assert "exists already; --force replaces it" in refused(capsys, "import", arm)
    assert run(["import", arm, "--force"]) == 0


def test_without_mujoco_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(jp.InputError, match=r"pip install 'jointplay\[robots\]'"):
        jp.read(EXAMPLES / "five-bar.xml")


def test_names_that_a_file_cannot_have_are_changed(tmp_path: Path) -> None:
    """Blanks, dots and slashes become underscores, and two names stay two."""
    text = chain("0 1 0").replace('"one"', '"link 1"').replace('"two"', '"link.1"').replace('"J1"', '"a/b"')
    m = jp.read(written(tmp_path, text), output="link.1", drives={"a/b": 10, "J2": 0, "J3": 0})
    assert m.bodies == ("link_1", "link_1_2", "tip")
    assert "a_b" in m.joints


def test_rotations_of_all_kinds_agree_with_those_of_the_core() -> None:
    """Roll, pitch and yaw against products of quaternions."""
    from jointplay.exchange.rotations import aligning, from_rpy

    generator = np.random.default_rng(1)
    for rpy in generator.uniform(-3, 3, (20, 3)):
        turns = [poses.quaternion(axis * angle) for axis, angle in zip(np.eye(3), rpy, strict=True)]
        q = poses.product(turns[2], poses.product(turns[1], turns[0]))
        assert from_rpy(rpy) == pytest.approx(pin.Quaternion(*q).toRotationMatrix(), abs=1e-14)
    units: list[Any] = [*np.eye(3), *-np.eye(3), np.array([0.6, 0.8, 0.0])]
    for one, other in itertools.product(units, units):
        assert aligning(one, other) @ one == pytest.approx(other, abs=1e-14)


INERTIA = """<robot name="r"><link name="base"/>
<link name="a"><inertial><origin xyz="0.1 0 0" rpy="0 0 {turn}"/><mass value="2"/>
  <inertia ixx="0.004" iyy="0.01" izz="0.012" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><mass value="1"/>
  <inertia ixx="{odd}" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><origin rpy="0.3 0.2 0.1"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1"/></joint></robot>"""


def test_moments_of_inertia_are_in_the_axes_of_the_body(tmp_path: Path) -> None:
    """Turned by 0.5 rad about z, Ixx = 4000 cos^2 + 10000 sin^2 and so on, kg mm^2; in the plane about the pins."""
    file = written(tmp_path, INERTIA.format(turn=0.5, odd=0.01), "r.urdf")
    c, s = math.cos(0.5), math.sin(0.5)
    expected = [4000 * c * c + 10000 * s * s, 4000 * s * s + 10000 * c * c, 12000, -6000 * s * c, 0, 0]
    m = jp.read(file)
    assert m.value("bodies.a.rotational_inertia") == pytest.approx(expected, abs=1e-6)
    assert m.value("bodies.b.rotational_inertia") == [10000, 10000, 10000]
    assert jp.read(file, planar=True).value("bodies.a.rotational_inertia") == pytest.approx(12000)


def test_moments_of_inertia_that_no_body_has_are_left_out(tmp_path: Path) -> None:
    m = jp.read(written(tmp_path, INERTIA.format(turn=0, odd=0.1), "r.urdf"))
    assert "rotational_inertia" not in m.raw["bodies"]["b"]
    assert "no body can have are left out: b" in m.text("r.toml")


def test_moments_of_inertia_of_sdf(tmp_path: Path) -> None:
    text = """<sdf version="1.9"><model name="m"><link name="a"><inertial><mass>2</mass><pose>0 0 0.1 0 0 0</pose>
    <inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz><ixy>0.001</ixy></inertia></inertial></link>
    <joint name="j" type="revolute"><parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz></axis></joint>
    </model></sdf>"""
    m = jp.read(written(tmp_path, text, "m.sdf"))
    assert m.value("bodies.a.rotational_inertia") == [20000, 30000, 40000, 1000, 0, 0]
