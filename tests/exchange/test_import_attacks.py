"""Robots that are made to do harm: to read other files, to take all memory, or never to end."""

import json
import os
import sys
import time
from pathlib import Path

import pytest

import jointplay as jp
from helpers.commands import refused
from jointplay.cli import run
from jointplay.exchange import mjcf, mujoco_child
from jointplay.exchange.options import Options
from jointplay.exchange.pylinkage import _rigid
from jointplay.exchange.reading import imported

BODY = '<body name="{}"><joint name="J" axis="0 0 1"/><geom size=".1"/></body>'
INCLUDED = f"<mujocoinclude>{BODY.format('secret')}</mujocoinclude>"
MODEL = f"<mujoco><worldbody>{BODY.format('secret')}</worldbody></mujoco>"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a robot's parts in it, beside one with what it must not see."""
    for name in ("robot/parts", "outside"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "outside" / "body.inc").write_text(INCLUDED, encoding="utf-8")
    (tmp_path / "outside" / "model.xml").write_text(MODEL, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "robot")
    Path("parts", "body.inc").write_text(INCLUDED, encoding="utf-8")
    Path("parts", "typed.inc").write_text(f"<!DOCTYPE m [<!ENTITY a 'b'>]>{INCLUDED}", encoding="utf-8")
    Path("parts", "deep.inc").write_text('<mujocoinclude><include file="../outside/body.inc"/></mujocoinclude>')
    Path("leads-out.inc").symlink_to("../outside/body.inc")
    Path("folder").symlink_to("../outside")
    os.mkfifo("pipe.stl")
    return tmp_path


def model(inside: str = "", *, top: str = "") -> str:
    return f"<mujoco>{top}<worldbody>{BODY.format('own')}{inside}</worldbody></mujoco>"


def mesh(file: str, compiler: str = "") -> str:
    return model(top=f'<compiler {compiler}/><asset><mesh name="m" file="{file}"/></asset>')


ELSEWHERE = {
    "include above": (model('<include file="../outside/body.inc"/>'), "<include>: .* is elsewhere"),
    "include by a link": (model('<include file="leads-out.inc"/>'), "<include>: .* leads out of the folder"),
    "include by a linked folder": (model('<include file="folder/body.inc"/>'), "<include>: .* leads out of the folder"),
    "include in a part": (model('<include file="parts/deep.inc"/>'), r"parts/deep\.inc: <include>: .* is elsewhere"),
    "document type in a part": (model('<include file="parts/typed.inc"/>'), r"typed\.inc: has a document type"),
    "attached model": (
        model(
            '<attach model="m" body="secret" prefix="p"/>',
            top='<asset><model name="m" file="../outside/model.xml"/></asset>',
        ),
        "<model>: .* is elsewhere",
    ),
    "mesh": (mesh("../outside/model.xml"), "<mesh>: .* is elsewhere"),
    "folder of meshes": (mesh("model.xml", 'meshdir="../outside"'), "<compiler>: .* is elsewhere"),
    "linked folder of meshes": (mesh("model.xml", 'meshdir="folder"'), "<mesh>: .* leads out of the folder"),
    "texture": (
        model(top='<asset><texture name="t" type="cube" fileright="/etc/passwd"/></asset>'),
        "<texture>: .* is elsewhere",
    ),
    "pipe": (mesh("pipe.stl"), "<mesh>: .* is no regular file"),
    "device of Windows": (mesh("C:x.stl"), "<mesh>: .* is elsewhere"),
}  # fmt: skip


@pytest.mark.parametrize("name", ELSEWHERE)
def test_a_robot_reads_no_file_outside_of_its_folder(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Bodies of other folders came into the result, and a pipe was waited for without end."""
    text, problem = ELSEWHERE[name]
    Path("robot.xml").write_text(text, encoding="utf-8")
    refused(capsys, "import", "robot.xml")
    with pytest.raises(jp.InputError, match=problem):
        jp.read("robot.xml")


@pytest.mark.parametrize("name", ["robot.xml", "robot.mjcf"])
def test_parts_in_the_folder_are_read(name: str) -> None:
    """MuJoCo knows models by the extension .xml only, while .mjcf was said to be valid."""
    Path(name).write_text('<mujoco><worldbody><include file="parts/body.inc"/></worldbody></mujoco>', encoding="utf-8")
    assert jp.read(name).bodies == ("secret",)


def test_a_model_that_needs_more_memory_than_there_is_ends_with_a_message(capfd: pytest.CaptureFixture[str]) -> None:
    """It took 4.6 GB of the process that asked, or all there was."""
    top = '<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>'
    Path("robot.xml").write_text(model('<geom type="hfield" hfield="h"/>', top=top), encoding="utf-8")
    assert run(["import", "robot.xml"]) == 2
    assert capfd.readouterr().err == "error: robot.xml: MuJoCo gives up on it: 60 s and 2 GB are there for it\n"
    assert not list(Path().glob("MUJOCO*"))


def test_a_model_that_takes_too_long_ends_with_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """100,000 copies of a body were not back after 25 s."""
    monkeypatch.setattr(mjcf, "LONGEST", 2.0)
    body = '<body><joint type="hinge"/><geom size=".1"/></body>'
    many = f'<replicate count="100000" offset="1 0 0">{body}</replicate>'
    Path("robot.xml").write_text(model(many), encoding="utf-8")
    start = time.monotonic()
    with pytest.raises(jp.InputError, match="MuJoCo takes too long to compile it: 2 s and 2 GB are there for it"):
        jp.read("robot.xml")
    assert time.monotonic() - start < 30


def test_what_mujoco_cannot_explain_is_a_message() -> None:
    """ "Caught an unknown exception!" was a traceback."""
    for text in ("<mujoco><worldbody><geom/></worldbody><size memory='9999999999999999999G'/></mujoco>", "<mujoco/>"):
        Path("robot.xml").write_text(text, encoding="utf-8")
        with pytest.raises(jp.InputError) as caught:
            jp.read("robot.xml")
        assert "Traceback" not in str(caught.value)


def test_the_program_beside_needs_nothing_of_jointplay() -> None:
    """It runs before the package is imported, and with the memory that is left."""
    text = Path(mujoco_child.__file__).read_text(encoding="utf-8")
    assert "import jointplay" not in text
    assert "from jointplay" not in text
    assert sys.executable


def test_joints_that_an_equality_holds_are_fixed_where_mujoco_has_them() -> None:
    """They were left out, and became drives."""
    import mujoco
    import numpy as np

    text = """<mujoco><worldbody><body name="a"><joint name="J" axis="0 0 1"/><geom size=".1"/>
      <body name="b" pos="1 0 0"><joint name="K" axis="0 1 0" ref="20"/><geom size=".1"/>
      <body name="c" pos="1 0 0"><joint name="L" axis="0 0 1"/><geom size=".1"/></body></body></body></worldbody>
      <equality><joint joint1="K" polycoef="0.5 0 0 0 0"/>
      <joint joint1="L" joint2="K" polycoef="0.1 0.3 1 0 0"/></equality></mujoco>"""
    Path("robot.xml").write_text(text, encoding="utf-8")
    found = imported(Path("robot.xml"), Options(output="c", drives={"J": [0, 40]}))
    assert found.mechanism.drives == ("J",)
    assert "Equality constraints hold these joints, which are fixed: K, L." in found.notes
    data = mujoco.MjData(compiled := mujoco.MjModel.from_xml_string(text))
    for turn, at in zip((0, 40), jp.solve(found.mechanism).nominal.values, strict=True):
        data.qpos[:] = [np.radians(turn), np.radians(20) + 0.5, 0.1 + 0.3 * 0.5 + 0.25]
        mujoco.mj_kinematics(compiled, data)
        assert at[:3] / 1e3 == pytest.approx(data.body("c").xpos, abs=1e-9)


def test_joints_that_mimic_others_do_so_exactly_and_the_file_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    """The parallelogram of a gripper has play of its own, of which nothing was said."""
    links = "".join(f'<link name="{name}"/>' for name in "abc")
    pin = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz=".1 0 0"/>{}</joint>'
    joints = pin.format("J", "a", "b", "") + pin.format("K", "b", "c", '<mimic joint="J" multiplier="-1"/>')
    Path("gripper.urdf").write_text(f"<robot>{links}{joints}</robot>", encoding="utf-8")
    assert run(["import", "gripper.urdf"]) == 0
    said = "These joints follow others exactly: K. What this stands for has play, which is in no result"
    assert said in capsys.readouterr().err
    assert said in " ".join(Path("gripper.toml").read_text(encoding="utf-8").replace("# ", "").split())


@pytest.mark.parametrize("version", ["1.²", "1." + "7" * 5000, "1..7", "1.7.", "-1"])
def test_versions_of_sdf_that_are_no_numbers(version: str) -> None:
    Path("robot.sdf").write_text(f'<sdf version="{version}"><model name="m"/></sdf>', encoding="utf-8")
    with pytest.raises(jp.InputError, match=r"version: .* is no version of SDF, such as 1\.7"):
        jp.read("robot.sdf")


@pytest.mark.parametrize("digits", [310, 5000])
@pytest.mark.parametrize("key", ["position", "distance", "axis"])
def test_numbers_of_pylinkage_that_are_larger_than_any(digits: int, key: str) -> None:
    number = "9" * digits
    distance = number if key == "distance" else 1
    joints = [
        '{"id": "A", "type": "ground", "position": [0, 0]}',
        f'{{"id": "B", "type": "prismatic", "position": [1, 0], "axis": [{number if key == "axis" else 1}, 0]}}',
        f'{{"id": "C", "position": [{number if key == "position" else 2}, 0]}}',
        '{"id": "T", "type": "tracker", "ref_joint1_id": "A", "ref_joint2_id": "B", ' + f'"distance": {distance}}}',
    ]
    links = '[{"id": "g", "type": "ground"}, {"id": "a", "joints": ["A", "B", "C"]}]'
    Path("a.json").write_text(f'{{"joints": [{", ".join(joints)}], "links": {links}}}', encoding="utf-8")
    with pytest.raises(jp.InputError, match="is not JSON" if digits > 4300 else "a number is needed"):
        jp.read("a.json")


def test_numbers_of_options_that_are_larger_than_any() -> None:
    links = "".join(f'<link name="{name}"/>' for name in "abc")
    pin = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/></joint>'
    Path("arm.urdf").write_text(f"<robot>{links}{pin.format('J', 'a', 'b')}{pin.format('K', 'b', 'c')}</robot>")
    with pytest.raises(jp.InputError, match="drives J: a number or a list of them is needed"):
        jp.read("arm.urdf", drives={"J": 10**310})
    with pytest.raises(jp.InputError, match=r"loops L on\.c\.at: three numbers are needed"):
        jp.read("arm.urdf", loops={"L": {"type": "spherical", "on": {"a": [0, 0, 0], "c": [10**310, 0, 0]}}})


def test_rigid_links_are_those_that_every_pair_and_triple_gives() -> None:
    """Every pair and every three links were compared, a minute for 1,000 of them."""
    import random
    from itertools import combinations

    def slowly(held: dict[str, set[str]]) -> set[frozenset[str]]:
        parts = {frozenset([name]): set(joints) for name, joints in held.items()}
        while True:
            tied = [c for c in combinations(parts, 2) if len(parts[c[0]] & parts[c[1]]) > 1]
            for c in combinations(parts, 3):
                shared = [parts[a] & parts[b] for a, b in combinations(c, 2)]
                tied += [c] if all(shared) and len(set.union(*shared)) == 3 else []
            if not tied:
                return set(parts)
            names = frozenset.union(*tied[0])
            joints = set.union(*(parts.pop(part) for part in tied[0]))
            parts[names] = joints

    rng = random.Random(1)
    for _ in range(300):
        pins = [f"j{k}" for k in range(rng.randint(2, 9))]
        held = {f"l{k}": set(rng.sample(pins, rng.randint(0, min(3, len(pins))))) for k in range(rng.randint(2, 8))}
        body_of, _ = _rigid(held, "l0")
        assert {frozenset(k for k in held if body_of[k] == body) for body in body_of.values()} == slowly(held)
    start = time.process_time()
    for joints in ((), ("s",)):
        _rigid({f"l{k}": {*joints, f"own{k}"} for k in range(1000)}, "l0")
    assert time.process_time() - start < 5


def test_a_linkage_of_too_many_links_is_refused() -> None:
    links = [{"id": f"l{k}", "type": "ground"} for k in range(1001)]
    Path("a.json").write_text(json.dumps({"joints": [], "links": links}), encoding="utf-8")
    with pytest.raises(jp.InputError, match="links: 1001 is not a number of them that is read; 0 to 1000 are possible"):
        jp.read("a.json")


def test_a_table_beside_the_file_is_read_once_for_all_its_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table of 900,000 rows was read once for each of 30 drives."""
    from jointplay.file import columns

    names, count = [], 20
    text = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n'
    for k in range(count):
        on = f"{'ground' if not k else f'a{k - 1}'} = [0, 0], a{k} = [0, 0]"
        text += f'[joints.J{k}]\ntype = "revolute"\non = {{ {on} }}\n'
        text += f'[drives.q{k}]\njoint = "J{k}"\ncsv = "motion.csv"\ncolumn = "{"xy"[k % 2]}"\n'
    Path("motion.csv").write_text("x,y\n" + "1,2\n" * 3 + ",\n" * 100_000, encoding="utf-8")
    Path("arm.toml").write_text(text + '[output]\nbody = "a0"\n', encoding="utf-8")
    read = columns._text
    monkeypatch.setattr(columns, "_text", lambda place: names.append(place) or read(place))
    start = time.process_time()
    assert jp.load("arm.toml").value("drives.q3.values") == [2, 2, 2]
    assert len(names) == 1
    assert time.process_time() - start < 6


def test_checking_a_chain_takes_time_that_grows_as_the_chain_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of 300 joints took 17 s, of 900 more than anybody waits for: all its configurations were followed."""
    pin = '<joint name="j{1}" type="continuous"><parent link="l{0}"/><child link="l{1}"/><origin xyz=".1 0 0"/></joint>'
    seconds = []
    for count in (100, 300):
        links = "".join(f'<link name="l{k}"/>' for k in range(count + 1))
        joints = "".join(pin.format(k, k + 1) for k in range(count))
        Path("chain.urdf").write_text(f"<robot>{links}{joints}</robot>", encoding="utf-8")
        start = time.process_time()
        found = jp.check(jp.read("chain.urdf"))
        seconds.append(time.process_time() - start)
        assert found.attrs["mobility"] == f"{count} degrees of freedom, {count} drives"
        assert found.attrs["assembled"] == 1
    assert seconds[1] < 8 * seconds[0]
