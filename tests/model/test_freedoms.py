"""One count of freedoms and one diagnosis of all commands, also beside special poses and of drawings with few digits.

The robots of `freedoms` have freedoms that are known by construction.
"""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.freedoms import KINDS, Robot, closed_legs, robot
from jointplay.cli import run
from jointplay.exchange.options import Options
from jointplay.exchange.reading import Imported, imported

#: a robot of every kind, some with arms
SEEDS = range(len(KINDS))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def read(made: Robot, *, drives: list[str] | None = None, planar: bool = False) -> Imported:
    Path("robot.sdf").write_text(made.sdf(), encoding="utf-8")
    asked = None if drives is None else dict.fromkeys(drives)
    return imported(Path("robot.sdf"), Options(output=made.output, drives=asked, planar=planar))


def refused(ask: object, m: jp.Mechanism) -> str:
    assert callable(ask)
    with pytest.raises(jp.InputError) as caught:
        ask(m)
    return str(caught.value)


@pytest.mark.parametrize(("seed", "noise"), [*product(SEEDS, [0.0, 1e-7, 1e-5])])
def test_import_and_check_count_what_is_there_by_construction(seed: int, noise: float) -> None:
    """Closed legs got two drives where `check` wanted three, a robot of eight motions got twelve."""
    made, _ = robot(seed, noise)
    for planar in (False, True) if made.flat_redundant is not None else (False,):
        m = read(made, planar=planar).mechanism
        found = jp.check(m).attrs
        assert found["degrees_of_freedom"] == len(m.drives) == made.freedoms
        assert found["redundancy"] == (made.flat_redundant if planar else made.redundant)
        assert found["decided"] == 1


@pytest.mark.parametrize(("seed", "noise"), [*product([1, 4, 7], [0.0, 1e-6])])
def test_a_missing_drive_and_one_too_many_are_told_by_all_in_the_same_words(seed: int, noise: float) -> None:
    made, rng = robot(seed, noise)
    whole = read(made)
    drives = list(whole.mechanism.drives)
    missing = drives.pop(int(rng.integers(len(drives))))
    less = read(made, drives=drives) if drives else whole.mechanism.with_({"drives": {}})
    m = less.mechanism if isinstance(less, Imported) else less
    few = str(jp.check(m).attrs["mobility"])
    assert "too few drives: 1 motion is free: " in few
    problem = few.partition("; ")[2].partition("; over-constrained")[0].partition("; the start is")[0]
    assert missing in problem
    for ask in (jp.solve, jp.worst):
        assert problem in refused(ask, m)
    if isinstance(less, Imported):
        assert f"{problem[0].upper()}{problem[1:]}." in less.notes
    loop = [joint for joint in whole.mechanism.joints if joint not in whole.mechanism.drives]
    loop = [joint for joint in loop if whole.mechanism.value(f"joints.{joint}.type") == "revolute"]
    # In a special pose nothing is solved; the legs are drawn with all coordinates zero.
    value = np.nan_to_num(jp.solve(whole.mechanism).coordinate.sel(joint=loop[0]).values[0])
    more = whole.mechanism.with_({"drives.more": {"joint": loop[0], "values": [float(value) + 3.0]}})
    found = jp.check(more).attrs
    assert found["assembled"] == 0
    assert "too many drives: " in found["mobility"]
    assert "'more'" in found["mobility"]
    assert "contradict one another, so that joints stay open where all others are closed: '" in found["mobility"]
    problem = str(found["mobility"]).partition("; ")[2].partition("; over-constrained")[0]
    for ask in (jp.solve, jp.worst):
        assert problem.partition("; the start is")[0] in refused(ask, more)


def test_drives_that_contradict_one_another_are_no_pose(capsys: pytest.CaptureFixture[str]) -> None:
    """Two legs on one toe have two degrees of freedom; with three drives that did not agree, `solve` said "ok"."""
    made = closed_legs(np.random.default_rng(0), 0.0)
    whole = read(made)
    Path("legs.toml").write_text(whole.text, encoding="utf-8")
    driven = {"joint": "kl-first", "values": [0]}
    m = whole.mechanism.with_({"drives": {"a": {"joint": "ml", "values": [5]}, "b": {"joint": "mr", "values": [2]}}})
    m.with_({"drives.c": driven}).write("three.toml")
    for command in ("solve", "check", "error"):
        assert run([command, "three.toml"]) in (1, 2)
        said = " ".join("".join(capsys.readouterr()).split())
        assert "too many drives: 'a', 'b' and 'c' command the same motion; take away 1 of them (they contradict" in said
        # The toe turns as the arms come out of line.
        assert "'toe' by 0." in said
        assert "absorb" not in said


def test_a_special_pose_is_told() -> None:
    found = read(closed_legs(np.random.default_rng(0), 0.0))
    said = "in which 3 motions are possible to first order"
    assert any(said in note for note in found.notes)
    assert said in jp.check(found.mechanism).attrs["mobility"]
    assert f"# The start is a special pose, {said}." in found.text


def test_a_leaf_on_a_closed_loop_is_named_where_its_drive_is_missing() -> None:
    """The message was that the loops cannot be closed, which they are."""
    made, _ = robot(0, 0.0)
    arm = made.with_arms(1, np.random.default_rng(3))
    found = read(arm, drives=["world-crank"])
    assert "Too few drives: 1 motion is free: 'finger' turns; drive to_finger." in found.notes
    assert (
        "too few drives: 1 motion is free: 'finger' turns; drive to_finger"
        in jp.check(found.mechanism).attrs["mobility"]
    )


def test_a_part_that_does_not_fit_is_told_by_solve_and_error(capsys: pytest.CaptureFixture[str]) -> None:
    """`solve` said "It has a pose" of a bar that is 0.25 mm too long, with exit code 0."""
    bar = jp.loads(jp.examples.text("redundant-bar"))
    bar.with_({"dimensions.length.deviation": 0.0, "joints.Q.on.bar": [200.25, 0.0]}).write("bar.toml")
    said = "joints stay open where all others are closed: 'bar' by 0.25 mm; it closes with 'bar' 0.25 mm shorter"
    for command in (["solve"], ["check"], ["error", "-q", "worst"], ["error", "-q", "loaded"]):
        assert run([command[0], "bar.toml", *command[1:]]) == 1
        assert said in " ".join(capsys.readouterr().out.split())


def test_a_tree_is_driven_at_all_its_joints_but_those_that_follow() -> None:
    count = 60
    links = "".join(f'<link name="l{k}"/>' for k in range(count + 1))
    pin = (
        '<joint name="j{1}" type="revolute"><parent link="l{0}"/><child link="l{1}"/><origin xyz=".1 0 0"/>{2}</joint>'
    )
    law = '<mimic joint="j1" multiplier="2"/>'
    joints = "".join(pin.format(k, k + 1, law if k == 40 else "") for k in range(count))
    Path("tree.urdf").write_text(f"<robot>{links}{joints}</robot>", encoding="utf-8")
    found = imported(Path("tree.urdf"), Options())
    assert len(found.mechanism.drives) == count - 1
    assert jp.check(found.mechanism).attrs["degrees_of_freedom"] == count - 1
    some = imported(Path("tree.urdf"), Options(drives={"j2": 0, "j3": 0}))
    assert f"{count - 2} motions are free" in jp.check(some.mechanism).attrs["mobility"]
