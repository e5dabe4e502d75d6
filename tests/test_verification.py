"""docs/verification.md has every bundled example, its rows are within their tolerances, and some of them still hold."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
import pages
from oracles.frames import Frame
from structures import KINDS as STRUCTURES
from verification import contact, elastic, planar
from verification.page import CHECKS, HEAD, PAGE, RANDOM_HEAD, Row, read, read_uncovered, uncovered, wanted
from verification.random_mechanisms import elastic_structure
from verification.subject import FIGURES, Check, Subject, subject

TEXT = PAGE.read_text(encoding="utf-8")
ROWS = read(TEXT)
#: of every kind of engine an example that takes little time
SAMPLE = ("p3r", "redundant-bar", "four-legged-platform", "serial-6r", "rssr", "bennett", "belt-arm")


def key(s: Subject, check: Check) -> tuple[str, ...]:
    return (check.figure, s.name, check.engine, f"{check.tolerance:g}", check.why)


def test_every_example_has_all_rows_that_engines_give() -> None:
    on_page = [(row["figure"], *(row[name] for name in (HEAD[0], HEAD[1], HEAD[5], HEAD[6]))) for row in ROWS]
    assert sorted(on_page) == sorted(key(s, check) for s, check in wanted()), "make verify writes the page again"
    assert {row["example"] for row in ROWS} == set(jp.examples.names())
    assert {check.figure for check in CHECKS} <= set(FIGURES)


def test_every_row_is_within_its_tolerance() -> None:
    for row in ROWS:
        difference, _, unit = row["largest difference"].partition(" ")
        assert unit in {check.unit for check in CHECKS}, row
        assert float(difference) <= float(row["tolerance"]), row
        assert int(row["numbers"]) > 0, row


def test_the_page_lists_what_has_no_engine() -> None:
    assert read_uncovered(TEXT) == {figure: names for figure, names in uncovered().items() if names}


def test_random_mechanisms_have_rows_that_hold() -> None:
    _, _, section = TEXT.partition("## Random mechanisms\n")
    lines = [line.strip("| ").split(" | ") for line in section.partition("\n## ")[0].splitlines() if line[:2] == "| "]
    assert tuple(lines[0]) == RANDOM_HEAD
    rows = [dict(zip(RANDOM_HEAD, line, strict=True)) for line in lines[1:] if line[0] != "---"]
    assert len(rows) > 20
    for row in rows:
        assert float(row["largest difference"].split()[0]) <= float(row["tolerance"]), row


@pytest.mark.parametrize("name", SAMPLE)
def test_rows_hold(name: str) -> None:
    s = subject(name)
    checks = [check for check in CHECKS if check.applies(s)]
    assert checks
    for check in checks:
        row = Row(name, check, check.compare(s))
        assert row.good, (name, check.figure, check.engine, row.found)


@pytest.mark.parametrize("kind", ["elastic trusses", "elastic frames", "elastic frames in space"])
def test_elastic_structures_hold(kind: str) -> None:
    s = elastic_structure(STRUCTURES[kind][1])(1000)
    checks = [check for check in elastic.CHECKS if check.applies(s)]
    assert checks
    for check in checks:
        row = Row(s.name, check, check.compare(s))
        assert row.good, (kind, check.figure, check.engine, row.found)


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
    here = Path(__file__).parent
    programs = "".join(path.read_text(encoding="utf-8") for path in here.glob("verify_*.py"))
    names = re.findall(r"<!-- ([a-z]+) -->", pages.CHECKS.read_text(encoding="utf-8"))
    assert names
    assert [name for name in names if f'put_table("{name}"' not in programs] == []
    assert "for program in tests/verify_*.py" in (here.parent / "Makefile").read_text(encoding="utf-8")
