"""What a robot says of play, loops and couplings: lost motion, springs, second parents, closures, reductions."""

import re
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import jointplay as jp
import verify_robots
from helpers.commands import refused
from helpers.oracles.robots import MuJoCo
from jointplay.exchange.lost import with_lost_motion
from jointplay.exchange.options import Options
from jointplay.exchange.reading import Imported, imported
from jointplay.exchange.skeleton import GROUND, Attachment, Body, Joint, Skeleton

DOCS = Path(__file__).resolve().parents[2] / "docs"


def read(name: str, text: str, options: Options | None = None) -> Imported:
    Path(name).write_text(text, encoding="utf-8")
    return imported(Path(name), options or Options())


# --- lost motion and springs -----------------------------------------------------------------------------------------

#: an arm that hangs over its hip and knee: 213 mm each, with the joints of hip and knee and angles of its bodies
ARM = """<mujoco><compiler angle="degree"/><option gravity="0 -9.81 0" timestep="0.0005"/>
  <default><joint axis="0 0 1" damping="0.3" armature="0.001" solreflimit="0.004 1" solimplimit=".999 .9999 .0001"/>
  </default><worldbody>
  <body name="thigh" euler="0 0 {}">{}<inertial pos="0.1 0 0" mass="0.5" diaginertia=".001 .001 .001"/>
    <body name="calf" pos=".213 0 0" euler="0 0 {}">{}<inertial pos="0.1 0 0" mass="0.2" diaginertia=".001 .001 .001"/>
      <site name="tip" pos=".213 0 0"/></body></body></worldbody>{}</mujoco>"""
MOTORS = '<actuator><position joint="hip"/><position joint="knee"/></actuator>'
#: 2000 and 400 N mm per degree, in N m per rad
STIFF = (114.591559026, 22.918311805)
YIELDING = (
    f'<joint name="hip_play" axis="0 0 -1" range="-0.7 0.3"/><joint name="hip_spring" stiffness="{STIFF[0]}"/>',
    f'<joint name="knee_spring" stiffness="{STIFF[1]}"/><joint name="knee_play" range="-1 0.5"/>',
)
HELD = {"hip": -45, "knee": -90}


def test_a_joint_beside_a_motor_is_its_lost_motion_or_its_wind_up() -> None:
    """The arm at rest is where MuJoCo has it, which knows of two more joints on each axis."""
    hip, knee = YIELDING
    text = ARM.format(0, '<joint name="hip"/>' + hip, 0, knee + '<joint name="knee"/>', MOTORS)
    found = read("arm.xml", text, Options(output="tip", drives=HELD))
    m = found.mechanism
    assert m.bodies == ("thigh", "calf")
    assert m.value("drives.hip.backlash") == pytest.approx({"plus": 0.7, "minus": 0.3})
    assert m.value("drives.knee.backlash") == pytest.approx({"plus": 0.5, "minus": 1})
    assert [m.value(f"drives.{name}.stiffness") for name in HELD] == pytest.approx([2000, 400])
    assert "lost motion: hip_play of hip (+0.7, -0.3 deg), knee_play of knee (+0.5, -1 deg)." in " ".join(found.notes)
    got = jp.loaded(m)
    model = mujoco.MjModel.from_xml_string(ARM.format(-45, hip, -90, knee, ""))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start = data.site("tip").xpos.copy()
    mujoco.mj_step(model, data, 6000)
    assert np.abs(data.qvel).max() < 1e-4
    # Its limits are soft: some thousandths of a millimetre.
    assert got.error.values[0, :2] == pytest.approx((data.site("tip").xpos - start)[:2] * 1e3, abs=5e-3)
    assert np.abs(got.error.values[0, :2]).max() > 2


def hip(second: Joint, between: float = 0.0, beyond: float = 1.0) -> Skeleton:
    """A motor and a second joint in a row, with masses between them and beyond."""
    at = np.zeros(3)
    first = Joint("hip", "revolute", (GROUND, "between"), Attachment(at, np.array([0.0, 0.0, 1.0])), is_driven=True)
    bodies = {GROUND: Body(), "between": Body(mass=between), "thigh": Body(mass=beyond)}
    return with_lost_motion(Skeleton("", bodies, (first, second)))


def test_where_a_second_joint_stays_one() -> None:
    """Its range is larger than 5 degrees, it is elsewhere, or a body with a mass lies between the two."""
    degree = np.radians(1.0)

    def second(low: float, high: float, at: float = 0.0, tilt: float = 0.0, zero: float = 0.0) -> Joint:
        place = Attachment(np.array([0.0, at, 0.0]), np.array([0.0, np.sin(tilt), np.cos(tilt)]))
        limits = (low * degree, high * degree)
        return Joint("second", "revolute", ("between", "thigh"), place, limits=limits, coordinate=zero * degree)

    for joint, play in (
        (second(-1, 1), (1, 1)),
        (second(-2, 3), (3, 2)),
        (second(0, 0.01), (0.01, 0)),
        (second(1, 3, zero=1.5), (1.5, 0.5)),
        (second(-1, 1, at=1e-7), (1, 1)),
    ):
        (one,) = hip(joint).joints
        assert np.array(one.play) / degree == pytest.approx(play)
        assert one.bodies == (GROUND, "thigh")
    others = (second(-2, 3.1), second(-1, 1, at=1e-4), second(-1, 1, tilt=1e-3), second(-2, -1), second(-1, 1, zero=2))
    assert [len(hip(joint).joints) for joint in others] == [2] * 5
    assert len(hip(second(-1, 1), between=0.005).joints) == 1
    heavy = hip(second(-1, 1), between=0.1)
    assert len(heavy.joints) == 2
    assert heavy.notes == ("These stay joints, because a body with a mass lies before them: second (between).",)
    text = ARM.format(0, '<joint name="hip"/><joint name="second" range="-1 1"/>', 0, '<joint name="knee"/>', MOTORS)
    assert read("arm.xml", text, Options(keep_joints=True)).mechanism.drives == ("hip", "second", "knee")


def test_the_coordinate_of_a_motor_counts_from_where_its_spring_rests() -> None:
    """A spring whose rest is not the reference turns the arm by the difference, and the axes are opposite."""
    spring = '<joint name="spring" axis="0 0 -1" stiffness="3" springref="20" ref="5"/>'
    text = ARM.format(0, '<joint name="hip"/>' + spring, 0, '<joint name="knee"/>', MOTORS)
    m = read("arm.xml", text, Options(drives={"hip": 30, "knee": 10})).mechanism
    want = MuJoCo(Path("arm.xml"), {"spring": np.radians(20)}).poses({"hip": np.radians(30), "knee": np.radians(10)})
    assert want is not None
    at = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][0, 1, :3]
    assert at == pytest.approx(want["calf"][0], abs=1e-12)
    assert np.degrees(np.arctan2(at[1], at[0])) == pytest.approx(30 - 15)


def test_springs_of_joints_hold_them_or_load_them() -> None:
    """Without a motor a spring is a drive that winds up; beside one, or pressed against a limit, it is a load."""
    motor = '<actuator><position joint="hip"/></actuator>'
    knee = '<joint name="knee" stiffness="5.729577951308" springref="{}" range="-40 40" limited="true"/>'
    hip = '<joint name="hip" stiffness="5.729577951308" springref="15"/>'
    found = read("arm.xml", ARM.format(0, hip, 0, knee.format(12), motor))
    m = found.mechanism
    assert "Springs hold these joints, as drives that wind up: knee." in found.notes
    assert m.value("drives.knee.values") == pytest.approx([12])
    assert m.value("drives.knee.stiffness") == pytest.approx(100)
    assert [m.value(f"springs.hip.{key}") for key in ("stiffness", "free_angle")] == pytest.approx([100, 15])
    m = read("arm.xml", ARM.format(0, hip, 0, knee.format(150), motor)).mechanism
    # Its moment where the knee is drawn: 100 N mm/deg over 150 deg, towards the rest.
    assert m.value("springs.knee.preload") == pytest.approx(-100 * 150)
    slide = '<joint name="knee" type="slide" stiffness="5"/>'
    found = read("arm.xml", ARM.format(0, '<joint name="hip"/>', 0, slide, MOTORS))
    assert "Springs along these joints are left out: knee." in found.notes


def test_lost_motion_is_asked_for_by_kind_or_by_joint() -> None:
    """What is said of a joint counts more; the worst error is that of the same lost motion written in the file."""
    options = {"revolute": {"angle": 0.4}, "knee": {"plus": 0.1, "minus": 0}}
    text = ARM.format(0, '<joint name="hip"/>', 0, '<joint name="knee"/>', MOTORS)
    m = read("arm.xml", text, Options(backlash=options, output="tip", drives=HELD)).mechanism
    without = read("arm.xml", text, Options(output="tip", drives=HELD)).text
    for name, value in (("hip", "0.4"), ("knee", "{ plus = 0.1, minus = 0 }")):
        without = without.replace(f"[drives.{name}]", f"[drives.{name}]\nbacklash = {value}")
    written = jp.loads(without)
    worst = float(jp.worst(m).worst_position.max())
    assert worst == float(jp.worst(written).worst_position.max())
    # The whole arm about the hip, and the calf about the knee: both to the first order in a straight line.
    assert worst == pytest.approx(np.radians(0.2) * 213 * np.sqrt(2) + np.radians(0.1) * 213 / np.sqrt(2), rel=0.1)


BACKLASH = [
    (
        "hipp={angle=1}",
        r"--backlash hipp: 'hipp' is not a joint or a kind of joint that is driven; did you mean 'hip'\?",
    ),
    ("prismatic={travel=1}", "--backlash prismatic: 'prismatic' is not a joint or a kind"),
    ("hip={travel=1}", 'a revolute joint has angle, or plus and minus here, not "travel"'),
    ("hip={plus=-1}", "is no lost motion; write { angle = 0.2 }"),
    ("hip={}", "a revolute joint has angle"),
    ("hip=x", "--backlash hip"),
    ("hip=true", "is no lost motion"),
]


@pytest.mark.parametrize(("given", "problem"), BACKLASH)
def test_lost_motion_that_is_none_is_refused(given: str, problem: str, capsys: pytest.CaptureFixture[str]) -> None:

    Path("arm.xml").write_text(
        ARM.format(0, '<joint name="hip"/>', 0, '<joint name="knee"/>', MOTORS), encoding="utf-8"
    )
    assert re.search(problem, refused(capsys, "import", "arm.xml", "--backlash", given))


# --- couplings -------------------------------------------------------------------------------------------------------


def test_a_tendon_whose_length_is_held_couples_two_joints() -> None:
    """As MuJoCo solves it; the joint with the motor leads. With three joints it is left out, and named."""
    tendon = """<tendon><fixed name="t"><joint joint="hip" coef="{}"/><joint joint="knee" coef="0.5"/></fixed></tendon>
      <equality><tendon name="law" tendon1="t" polycoef="0.1 0 0 0 0"/></equality>"""
    motor = '<actuator><position joint="knee"/></actuator>'
    joints = ('<joint name="hip" ref="10"/>', '<joint name="knee"/>')
    text = ARM.format(0, joints[0], 0, joints[1], tendon.format(-0.8) + motor)
    m = read("arm.xml", text, Options(drives={"knee": 30})).mechanism
    engine = MuJoCo(Path("arm.xml"), {})
    want = engine.poses({"knee": np.radians(30)})
    assert want is not None
    assert engine.freedoms() == len(m.drives) == 1
    assert m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][0, 1, :3] == pytest.approx(want["calf"][0])
    ankle = text.replace('<site name="tip"', '<body><joint name="toe"/><geom size=".01"/></body><site name="tip"')
    found = read("arm.xml", ankle.replace("</fixed>", '<joint joint="toe" coef="1"/></fixed>'))
    assert "Equality constraints that are left out: law." in found.notes
    assert len(found.mechanism.drives) == 3


GRIPPER = """<robot name="gripper"><link name="base"/><link name="crank"/><link name="rod"/><link name="finger"/>
  <joint name="motor" type="revolute"><parent link="base"/><child link="crank"/><axis xyz="0 0 1"/>
    <limit lower="-0.5" upper="0.5"/></joint>
  <joint name="link" type="continuous"><parent link="crank"/><child link="rod"/><origin xyz="0 .05 0"/>
    <axis xyz="0 0 1"/><mimic joint="motor" multiplier="-1"/></joint>
  <joint name="other" type="continuous"><parent link="base"/><child link="finger"/><origin xyz=".03 0 0"/>
    <axis xyz="0 0 1"/><mimic joint="motor"/></joint>{}</robot>"""


def test_a_loop_takes_the_place_of_the_laws_that_stand_for_it() -> None:
    """A parallelogram: the poses are the same, and the play of its fourth pin is in the result."""
    loop = {"on": {"rod": {"at": [30, 0, 0], "axis": [0, 0, 1]}, "finger": [0, 50, 0]}}
    drives, text = {"motor": [-20, 20]}, GRIPPER.format("")
    by_law = read("g.urdf", text, Options(drives=drives, output="rod", planar=True))
    assert any("--loop NAME={on=..,instead=[JOINT]} closes a linkage" in note for note in by_law.notes)
    loops = {"pin": {**loop, "instead": ["link", "other"]}}
    options = Options(drives=drives, output="rod", planar=True, loops=loops, clearance={"pin": {"radial": 0.1}})
    closed = read("g.urdf", text, options)
    assert closed.mechanism.drives == ("motor",)
    poses = [jp.solve(found.mechanism).nominal.values for found in (by_law, closed)]
    assert poses[1] == pytest.approx(poses[0], abs=1e-9)
    # The rod turns about its other pin, until its end has gone the clearance.
    turned = float(jp.worst(closed.mechanism).worst_rotation.max())
    assert turned == pytest.approx(np.degrees(0.1 / 30), rel=0.3)
    for instead, said in ((["motor"], "'motor' is not a joint that follows"), ([1], "needs names of joints")):
        with pytest.raises(jp.InputError, match=said):
            read("g.urdf", text, Options(loops={"pin": {**loop, "instead": instead}}))


def test_reductions_stand_where_the_error_of_a_drive_is_written() -> None:
    transmission = """<transmission name="t"><type>transmission_interface/SimpleTransmission</type>{}<actuator name="m">
      <mechanicalReduction>{}</mechanicalReduction></actuator></transmission>"""
    one, two = '<joint name="motor"/>', '<joint name="motor"/><joint name="link"/>'
    found = read("g.urdf", GRIPPER.format(transmission.format(one, 50)))
    assert "# error = 0.01 (that of its motor over 50)" in found.text
    assert any(note.endswith("which count at the joints: motor 50.") for note in found.notes)
    found = read("g.urdf", GRIPPER.format(transmission.format(two, 50)))
    assert "Transmissions of several joints are left out, each of which is driven: t." in found.notes
    with pytest.raises(jp.InputError, match="transmission 't' <mechanicalReduction>: a number is needed"):
        read("g.urdf", GRIPPER.format(transmission.format(one, "x")))


# --- loops of URDF ---------------------------------------------------------------------------------------------------

PIN = """<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>
  <axis xyz="0 0 1"/></joint>"""
LINKS = "".join(f'<link name="{name}"/>' for name in ("base", "crank", "coupler", "rocker"))
TREE = LINKS + PIN.format("A", "base", "crank", "0 0 0") + PIN.format("B", "crank", "coupler", "0 .04 0")
SECOND = PIN.format("D", "base", "rocker", ".1 0 0")
#: the pin C between the coupler, which is drawn at (0, 40), and the rocker at (100, 0), in (100, 80)
CLOSED = {
    "two parents": PIN.format("C", "rocker", "coupler", "0 .08 0"),
    "loop_joint": """<loop_joint name="C" type="revolute"><link1 link="coupler" xyz=".1 .04 0"/>
      <link1 link="rocker" xyz="0 .08 0"/><axis xyz="0 0 1"/></loop_joint>""",
    "gazebo": """<gazebo><joint name="C" type="revolute"><parent>coupler</parent><child>rocker</child>
      <pose>0 .08 0 0 0 0</pose><axis><xyz>0 0 1</xyz></axis></joint></gazebo>""",
    "coinciding": '<link name="closing_C_1"/><link name="closing_C_2"/>'
    + PIN.format("e", "coupler", "closing_C_1", ".1 .04 0").replace("continuous", "fixed")
    + PIN.format("f", "rocker", "closing_C_2", "0 .08 0").replace("continuous", "fixed"),
}


@pytest.mark.parametrize("way", CLOSED)
def test_a_four_bar_is_closed_in_every_way_that_files_have(way: str) -> None:
    """Crank 40, rocker 80, ground 100: the coupler keeps its length, and the rocker is where two circles meet."""
    text = f"<robot>{TREE}{SECOND}{CLOSED[way]}</robot>"
    found = read("a.urdf", text, Options(drives={"A": [-30, 0, 40]}, output="rocker"))
    assert any(word in " ".join(found.notes) for word in ("close loops: C", "closing_C"))
    m = found.mechanism
    rocker = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"][:, m.bodies.index("rocker")]
    coupler = np.hypot(100, 40)
    for angle, pose in zip((-30, 0, 40), rocker, strict=True):
        crank = 40 * np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])
        turn = 2 * np.arctan2(pose[6], pose[3])
        end = np.array([100, 0]) + 80 * np.array([-np.sin(turn), np.cos(turn)])
        assert np.hypot(*(end - crank)) == pytest.approx(coupler, abs=1e-9)
    assert rocker[1, 3:] == pytest.approx([1, 0, 0, 0], abs=1e-12)
    # As check counts in the plane, where pins are not redundant.
    checked = jp.check(read("a.urdf", text, Options(planar=True)).mechanism).attrs
    assert (checked["degrees_of_freedom"], checked["redundancy"]) == (1, 0)


def test_the_first_joint_of_a_link_says_where_it_is() -> None:
    """Also where it is written before what carries it; a link that carries its own first parent hangs on the other."""
    closing = CLOSED["two parents"]
    for order in ((TREE, SECOND, closing), (SECOND, TREE, closing)):
        assert "closing" not in (found := read("a.urdf", f"<robot>{''.join(order)}</robot>")).text
        assert "C of coupler" in " ".join(found.notes)
    found = read("a.urdf", f"<robot>{LINKS}{closing}{TREE.removeprefix(LINKS)}{SECOND}</robot>")
    assert "B of coupler" in " ".join(found.notes)
    circle = PIN.format("X", "coupler", "crank", "0 0 0") + TREE.removeprefix(LINKS) + SECOND
    assert "X of crank" in " ".join(read("a.urdf", f"<robot>{LINKS}{circle}</robot>").notes)


def test_detachable_joints_hold_links_of_the_robot() -> None:
    plugin = """<gazebo><plugin filename="x.so" name="gz::sim::systems::DetachableJoint">
      <parent_link>crank</parent_link><child_model>{}</child_model><child_link>{}</child_link></plugin></gazebo>"""
    found = read("a.urdf", f'<robot name="r">{TREE}{SECOND}{plugin.format("r", "coupler")}</robot>')
    assert "Detachable joints hold these links: coupler." in found.notes
    assert found.mechanism.bodies == ("crank", "rocker")
    found = read("a.urdf", f'<robot name="r">{TREE}{SECOND}{plugin.format("box", "lid")}</robot>')
    assert "Detachable joints to other models are left out: box on crank." in found.notes
    assert len(found.mechanism.bodies) == 3


LOOP = '<loop_joint name="L" type="{}"><link1 link="{}"/>{}</loop_joint>'
ROCKER = '<link2 link="rocker"/>'
WRONG = [
    (LOOP.format("revolute", "crank", ""), "loop_joint 'L': needs two links"),
    (LOOP.format("x", "crank", ROCKER), "'x' is not a joint that"),
    (LOOP.format("revolute", "crank", ROCKER), "<axis> is missing"),
    (LOOP.format("ball", "crnk", ROCKER), "did you mean 'crank'"),
    (
        '<gazebo><joint name="L" type="ball"><parent>crank</parent><child>x</child></joint></gazebo>',
        "'x' is not a link",
    ),
]


@pytest.mark.parametrize(("inside", "problem"), WRONG)
def test_loops_that_name_nothing_are_refused(inside: str, problem: str) -> None:
    with pytest.raises(jp.InputError, match=re.escape(problem)):
        read("a.urdf", f"<robot>{TREE}{SECOND}{inside}</robot>")


# --- macros ----------------------------------------------------------------------------------------------------------


def test_macros_are_expanded_by_the_program_xacro(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the message says what to install; its first line is said where it refuses the file."""
    Path("bin").mkdir()
    monkeypatch.setenv("PATH", str(Path("bin").absolute()))
    with pytest.raises(jp.InputError, match=r"pip install xacro, or `xacro a\.urdf\.xacro > a\.urdf` makes"):
        read("a.urdf.xacro", TREE)
    program = Path("bin/xacro")

    def says(script: str) -> None:
        program.write_text(f"#!{sys.executable}\nimport sys\n{script}\n", encoding="utf-8")
        program.chmod(0o755)

    says("print(open(sys.argv[1]).read().replace('LENGTH', '.04'))")
    robot = f"<robot>{TREE}{SECOND}</robot>".replace(".04", "LENGTH")
    assert read("a.urdf.xacro", robot).mechanism.value("joints.B.on.crank.at") == [0, 40, 0]
    with pytest.raises(jp.InputError, match="expands to the root element <sdf>"):
        read("a.xacro", "<sdf/>")
    says("sys.exit('name prefix is not defined')")
    with pytest.raises(jp.InputError, match="cannot expand it: name prefix is not defined; with the arguments that"):
        read("a.xacro", robot)
    with pytest.raises(jp.InputError, match="there is no such file"):
        imported(Path("nowhere.xacro"), Options())


# --- the table of public robots --------------------------------------------------------------------------------------


def test_robots_of_the_table_are_compared_pose_by_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    """A five-bar by MuJoCo and a four-bar by Pinocchio; with a pose that is off by a micrometre it is wrong."""
    path, robot = Path("a.urdf"), verify_robots.Robot("a", "loops", ("", ""), "")
    five_bar = DOCS / "robots" / "five-bar.xml"
    path.write_text(f"<robot name='r'>{TREE}{SECOND}{CLOSED['coinciding']}</robot>", encoding="utf-8")
    for file, bodies, freedoms in ((five_bar, 4, 2), (path, 3, 1)):
        row = verify_robots.compared(robot, file)
        assert (row["bodies"], row["degrees of freedom"]) == (bodies, freedoms)
        assert verify_robots.is_right(row)
    solved = MuJoCo.poses

    def off(self: MuJoCo, values: dict[str, float]) -> Any:
        found = solved(self, values)
        return found and {name: (at + 1e-6, axes) for name, (at, axes) in found.items()}

    monkeypatch.setattr(MuJoCo, "poses", off)
    assert not verify_robots.is_right(verify_robots.compared(robot, five_bar))
