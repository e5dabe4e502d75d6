"""docs/verification.json has every bundled example, its rows are within their tolerances, and some still hold."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
import verify_robots
from helpers import pages
from helpers.hooks import hook
from helpers.oracles.frames import Frame
from helpers.structures import KINDS as STRUCTURES
from helpers.verification import contact, elastic, planar
from helpers.verification.closed_forms import FORMS, Form
from helpers.verification.page import CHECKS, NUMBERS, Row, dumped, uncovered, wanted
from helpers.verification.random_mechanisms import FAMILIES, elastic_structure
from helpers.verification.subject import FIGURES, Check, Subject, subject

TEXT = NUMBERS.read_text(encoding="utf-8")
FOUND = json.loads(TEXT)
ROWS = FOUND["examples"]
#: of every kind of engine an example that takes little time
SAMPLE = ("p3r", "redundant-bar", "four-legged-platform", "serial-6r", "rssr", "bennett", "belt-arm")


def key(s: Subject, check: Check) -> tuple[object, ...]:
    return (check.figure, s.name, check.engine, check.tolerance, check.why)


def test_every_example_has_all_rows_that_engines_give() -> None:
    there = [tuple(row[name] for name in ("figure", "mechanisms", "engine", "tolerance", "why")) for row in ROWS]
    assert sorted(there) == sorted(key(s, check) for s, check in wanted()), "make verify writes the numbers again"
    assert {row["mechanisms"] for row in ROWS} == set(jp.examples.names())
    assert {check.figure for check in CHECKS} <= set(FIGURES)
    assert FOUND["figures"] == list(FIGURES)


def test_every_row_is_within_its_tolerance() -> None:
    for row in [*ROWS, *FOUND["random"]]:
        assert row["unit"] in {check.unit for check in CHECKS}, row
        assert row["difference"] <= row["tolerance"], row
        assert row["numbers"] > 0, row


def test_it_lists_what_has_no_engine() -> None:
    there = {row["figure"]: row["examples"] for row in FOUND["uncovered"]}
    assert there == {figure: names for figure, names in uncovered().items() if names}


def test_every_family_of_random_mechanisms_has_rows() -> None:
    assert len(FOUND["random"]) > 20
    assert {row["mechanisms"].partition(" ")[2] for row in FOUND["random"]} == {family.name for family in FAMILIES}


@pytest.mark.parametrize("form", [*FORMS])
def test_friction_and_wear_have_rows_that_hold(form: Form) -> None:
    (row,) = [row for row in FOUND["forms"] if (row["machine"], row["figure"]) == (form.machine, form.figure)]
    assert row["difference"] <= row["tolerance"] == form.tolerance
    assert form.found.difference <= form.tolerance
    assert len(FOUND["forms"]) == len(FORMS)


def test_it_is_written_as_it_is_read() -> None:
    assert dumped(FOUND) == TEXT


def test_the_page_shows_every_row() -> None:
    pytest.importorskip("mkdocs", reason="the documentation is built with the group docs")
    page = hook("verification").PARTS
    assert page["examples"]().count("\n| ") == len(ROWS) + 2 * len(FIGURES)
    assert page["random"]().count("\n| ") == len(FOUND["random"]) + 1
    assert "**outside**" not in page["examples"]() + page["random"]()
    assert page["forms"]().count("\n| ") == len(FOUND["forms"]) + 1
    assert page["published"]().count("\n| ") == len(FOUND["published"]) + 2
    for row in ROWS:
        assert f"| {row['engine']} | {row['version']} | {row['tolerance']:g} {row['unit']} |" in page["engines"]()


def require_good(s: Subject, known: list[Check]) -> None:
    """All figures of it that there are checks of are as their engines have them."""
    checks = [check for check in known if check.applies(s)]
    assert checks
    for check in checks:
        row = Row(s.name, check, check.compare(s))
        assert row.good, (s.name, check.figure, check.engine, row.found)


@pytest.mark.parametrize("name", SAMPLE)
def test_rows_hold(name: str) -> None:
    require_good(subject(name), CHECKS)


@pytest.mark.parametrize("kind", ["elastic trusses", "elastic frames", "elastic frames in space"])
def test_elastic_structures_hold(kind: str) -> None:
    require_good(elastic_structure(STRUCTURES[kind][1])(1000), elastic.CHECKS)


def test_a_linkage_rests_in_mujoco_where_it_is_loaded() -> None:
    """In the plane; the examples above have two in space."""
    (check,) = contact.CHECKS
    assert Row("four-bar", check, check.compare(subject("four-bar"))).good


def test_a_wrong_engine_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset with the wrong sign, as an error of either side would be."""
    s, right = subject("p3r"), planar.output_pose
    (check,) = [check for check in planar.CHECKS if check.compare is planar.drawn_offsets]
    mirrored = {"j0.x": -1.0}

    def wrong(link, q, drives, u):  # type: ignore[no-untyped-def]
        return right(link, q, drives, {label: mirrored.get(label, 1.0) * value for label, value in u.items()})

    monkeypatch.setattr(planar, "output_pose", wrong)
    assert not Row("p3r", check, check.compare(s)).good


def test_finite_elements_see_a_bar_that_is_too_short_in_place_of_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    s, right = Subject.of("x-braced-square", subject("x-braced-square").mechanism), Frame.displaced

    def wrong(self: Frame) -> tuple[np.ndarray, np.ndarray]:
        in_joint, own = right(self)
        return in_joint, -own

    monkeypatch.setattr(Frame, "displaced", wrong)
    assert not any(Row(s.name, check, check.compare(s)).good for check in elastic.CHECKS)


def test_every_table_of_the_checks_is_written_by_a_program_of_make_verify() -> None:
    here = Path(__file__).parents[1]
    programs = "".join(path.read_text(encoding="utf-8") for path in here.glob("verify_*.py"))
    names = re.findall(r"<!-- ([a-z]+) -->", pages.CHECKS.read_text(encoding="utf-8"))
    assert names
    assert [name for name in names if f'put_table("{name}"' not in programs] == []
    assert "for program in tests/verify_*.py" in (here.parent / "Makefile").read_text(encoding="utf-8")


def test_public_robots_are_where_other_engines_have_them() -> None:
    """Each one of the list, with as many degrees of freedom."""
    rows = json.loads(pages.CHECKS.with_name("robots.json").read_text(encoding="utf-8"))["robots"]
    assert [row["robot"] for row in rows] == [robot.name for robot in verify_robots.ROBOTS]
    assert len(rows) >= 20
    assert [row["robot"] for row in rows if not verify_robots.is_right(row)] == []


def test_what_a_public_robot_is_said_to_have_it_has() -> None:
    """Seven whose loops were not read stood in the table as robots with loops, and a hand as one with mimic joints."""
    rows = json.loads(pages.CHECKS.with_name("robots.json").read_text(encoding="utf-8"))["robots"]
    assert [row["has"] for row in rows] == [robot.has for robot in verify_robots.ROBOTS]
    trees = [row for row in rows if row["has"].startswith("tree")]
    bound = [row for row in rows if row not in trees and re.search("loop|mimic|coupl", row["has"])]
    assert [row["robot"] for row in trees if row["degrees of freedom"] != row["bodies"]] == []
    assert [row["robot"] for row in bound if row["degrees of freedom"] >= row["bodies"]] == []


def test_a_public_robot_is_cloned_and_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a repository of this machine, at a commit that later ones have changed."""
    shop = tmp_path / "host" / "maker" / "robots"
    work = tmp_path / "work"
    (work / "arm").mkdir(parents=True)

    def git(*arguments: str) -> str:
        who = ["-c", "user.name=maker", "-c", "user.email=maker@example.org"]
        return subprocess.run(
            ["git", "-C", str(work), *who, *arguments], check=True, capture_output=True, text=True
        ).stdout.strip()

    git("init", "-q")
    (work / "arm" / "arm.urdf").write_text((pages.CHECKS.with_name("robots") / "arm.urdf").read_text(encoding="utf-8"))
    (work / "arm" / "mesh.stl").write_bytes(b"0" * 2_000_000)
    git("add", "-A")
    git("commit", "-q", "-m", "arm")
    commit = git("rev-parse", "HEAD")
    (work / "arm" / "arm.urdf").write_text("<robot/>")
    git("commit", "-q", "-a", "-m", "spoilt")
    git("clone", "-q", "--bare", str(work), str(shop))
    monkeypatch.setattr(verify_robots, "HOST", f"file://{shop.parents[1]}")
    robot = verify_robots.Robot("arm", "tree", ("maker/robots", commit), "arm/arm.urdf")
    for _ in range(2):  # the second time from the folder
        path = verify_robots._fetched(robot, tmp_path / "kept", tmp_path / "into")
        assert [one.name for one in path.parent.iterdir()] == ["arm.urdf"]
        row = verify_robots.compared(robot, path)
        assert verify_robots.is_right(row)
        assert row["source"].endswith(f"maker/robots/blob/{commit}/arm/arm.urdf")
    assert [one.name for one in (tmp_path / "kept").iterdir()] == ["maker+robots"]
