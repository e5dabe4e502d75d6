"""Mechanisms written as files: what is read again is the same, and what has not changed stays as it was typed."""

import copy
import pickle
import re
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import jointplay as jp
from jointplay import examples
from jointplay.errors import InputError
from jointplay.model.mechanism import ORDERED
from jointplay.model.sizing import sizings, times

TEXTS = {name: examples.text(name) for name in examples.names()}
FOUR_BAR = TEXTS["four-bar"]
SPRING = {"joint": "J1", "stiffness": 2}


def written(m: jp.Mechanism, folder: Path, name: str = "new.toml") -> str:
    """The text that is written, which is read as the same mechanism."""
    path = folder / name
    m.write(path)
    read = jp.load(path)
    assert read == m
    assert all(getattr(read, name) == getattr(m, name) for name in ORDERED)
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", examples.names())
def test_an_example_is_written_as_it_is(name: str, tmp_path: Path) -> None:
    assert written(jp.loads(TEXTS[name]), tmp_path) == TEXTS[name]
    # Where nothing is known of a text, too.
    written(jp.Mechanism(jp.loads(TEXTS[name]).raw), tmp_path)


@pytest.mark.parametrize("name", examples.names())
def test_of_other_sizes_only_their_lines_are_others(name: str, tmp_path: Path) -> None:
    m = jp.loads(TEXTS[name])
    base, sources = sizings(m)
    if base is not m:
        pytest.skip("its sizes are in a pattern")
    lines = written(m.with_(times(sources, 1.5)), tmp_path).splitlines()
    before = TEXTS[name].splitlines()
    assert len(lines) == len(before)
    other = [k for k, pair in enumerate(zip(before, lines, strict=True)) if pair[0] != pair[1]]
    assert 0 < len(other) <= len(sources)
    for k in other:
        assert before[k].partition("#")[2] == lines[k].partition("#")[2]


def test_the_results_are_the_same(tmp_path: Path) -> None:
    m = jp.loads(FOUR_BAR).with_({"joints.J2.clearance.radial": 0.123, "loads.0.force": [3, -4]})
    written(m, tmp_path)
    for question in (jp.worst, jp.loaded):
        assert question(jp.load(tmp_path / "new.toml")).equals(question(m))


def leaves(node: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every value of a file with its place."""
    entries = node.items() if isinstance(node, Mapping) else enumerate(node) if isinstance(node, list) else ()
    for key, value in entries:
        yield (*place, str(key)), value
        yield from leaves(value, (*place, str(key)))


def test_a_long_list_is_written_in_a_time_that_grows_as_its_length() -> None:
    """A map of 9,000 by 9,000 nodes was refused as too large after 14 s, in which its file was written."""
    m = jp.loads(FOUR_BAR).with_({"drives.theta1.values": np.linspace(20.0, 100.0, 20_000)})
    before = time.process_time()
    text = m.complete_text
    # A fraction of a second where it does, about twenty where every value counts all others again.
    assert time.process_time() - before < 5.0
    assert jp.loads(text) == m


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_changes_are_read_again(data: st.DataObject, tmp_path: Path) -> None:
    m = jp.loads(TEXTS[data.draw(st.sampled_from(examples.names()))])
    for _ in range(data.draw(st.integers(1, 4))):
        places = dict(leaves(m.raw))
        place = data.draw(st.sampled_from(sorted(places)))
        value = places[place]
        new: Any = None
        if isinstance(value, int | float) and not isinstance(value, bool):
            new = data.draw(st.sampled_from([0, 1, value * 1.25, value + 0.1, f"{value} + 1"]))
        elif isinstance(value, list):
            new = [*value, *value[:1]]
        elif isinstance(value, Mapping) and value:
            new = {**value, **dict(zip(value, reversed(list(value.values())), strict=True))}
        elif place[-1] == "title":
            new = 'quo"te \\ and\nline'
        if data.draw(st.booleans()):
            new = None
        try:
            m = m.with_({".".join(place): new})
        except jp.InputError:
            continue
    written(m, tmp_path)


def test_a_new_value_stands_in_the_place_of_an_expression(tmp_path: Path) -> None:
    text = FOUR_BAR.replace("[joints.J1]", "[variables]\nplay = 0.3  # of all pins\n\n[joints.J1]", 1)
    text = re.sub(r"radial = 1.0", 'radial = "play"', text, count=2)
    m = jp.loads(text).with_({"joints.J1.clearance.radial": 0.5})
    assert written(m, tmp_path) == text.replace('"play"', "0.5", 1)


def test_lines_of_a_list_stay(tmp_path: Path) -> None:
    text = re.sub(r"values = \[.*\]", "values = [\n    30,  # first\n    40.0,\n    50,  # last\n]", FOUR_BAR, count=1)
    m = jp.loads(text).with_({"drives.theta1.values.1": 45})
    assert written(m, tmp_path) == text.replace("40.0", "45")


def test_a_pattern_stays_a_pattern(tmp_path: Path) -> None:
    text = TEXTS["excavator"]
    m = jp.loads(text).with_({"patterns.cylinder.joints.guide.clearance.gap": 0.25})
    assert written(m, tmp_path) == text.replace("gap = 0.1,", "gap = 0.25,")


def test_the_order_of_bodies_is_kept_where_only_values_are_known(tmp_path: Path) -> None:
    """The library writes tables behind lists, which made the slider the first body of its guide."""
    m = jp.Mechanism(jp.loads(TEXTS["slider-crank"]).raw)
    assert "on = {ground = {at = [0, 0], axis = [1, 0]}, slider = [0, 0]}" in written(m, tmp_path)


def test_comments_outlive_copies(tmp_path: Path) -> None:
    m = jp.loads("# mine\n" + TEXTS["slider-crank-cases"])
    for copied in (pickle.loads(pickle.dumps(m)), copy.copy(m), m.only(output="pin"), m.with_({"title": "new"})):
        copied.write(tmp_path / "new.toml")
        assert (tmp_path / "new.toml").read_text().startswith("# mine\n")


@pytest.fixture
def in_parts(tmp_path: Path) -> Path:
    """A file whose rocker is in another file, and whose length l2 has measured values."""
    pin = FOUR_BAR[FOUR_BAR.index("[joints.J4]") : FOUR_BAR.index("[start]")]
    main = FOUR_BAR.replace(pin, "").replace("format = 1", 'format = 1\ninclude = ["rocker.toml"]', 1)
    main += '\n[dimensions.l9]\nbody = "coupler"\nbetween = ["J2", "J3"]\nlaw = { csv = "l2.csv", column = "d" }\n'
    (tmp_path / "rocker.toml").write_text("# the rocker\n" + pin)
    (tmp_path / "l2.csv").write_text("d\n0.01\n-0.02\n0.03\n")
    (tmp_path / "main.toml").write_text(main)
    return tmp_path


def test_what_stands_in_other_files_stays_there(in_parts: Path) -> None:
    m = jp.load(in_parts / "main.toml").with_({"joints.J1.clearance.radial": 0.125})
    text = written(m, in_parts)
    assert 'include = ["rocker.toml"]' in text
    assert 'csv = "l2.csv"' in text
    assert "J4]" not in text


@pytest.mark.parametrize("elsewhere", [True, False])
def test_a_file_is_complete_where_its_parts_are_not_found_or_have_changed(in_parts: Path, elsewhere: bool) -> None:
    m = jp.load(in_parts / "main.toml")
    folder = in_parts
    if elsewhere:
        folder = in_parts / "elsewhere"
        folder.mkdir()
    else:
        m = m.with_({"joints.J4.clearance.radial": 0.125})
    text = written(m, folder)
    assert "include" not in text
    assert "[joints.J4]" in text
    assert "measured = [0.01, -0.02, 0.03]" in text
    assert text.count("#") >= FOUR_BAR.count("#")


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    m = jp.loads(FOUR_BAR)
    with pytest.raises(jp.InputError, match="there is no folder"):
        m.write(tmp_path / "nowhere" / "new.toml")
    assert list(tmp_path.iterdir()) == []


def test_numbers_of_other_libraries_are_numbers(tmp_path: Path) -> None:
    m = jp.loads(FOUR_BAR).with_({"loads.0.force": np.array([1.0, 2.0]), "joints.J1.clearance.radial": np.float32(0.5)})
    assert "force = [1.0, 2.0]" in written(m, tmp_path)


def test_what_an_include_brings_is_written_out_in_its_order(tmp_path: Path) -> None:
    """Joints and their bodies count in their order: in another one the text would say something else."""
    head, *tables = re.split(r"(?m)^(?=\[joints\.)", FOUR_BAR)
    last, rest = re.split(r"(?m)^(?=\[(?!joints))", tables[-1], maxsplit=1)
    (tmp_path / "part.toml").write_text("".join([*tables[2:-1], last]))
    main = tmp_path / "main.toml"
    main.write_text('include = ["part.toml"]\n' + head + "".join(tables[:2]) + rest)
    m = jp.load(main).with_({"joints.J3.clearance.radial": 0.3})
    text = m.text(tmp_path / "elsewhere" / "x.toml")
    names = re.findall(r"(?m)^\[joints\.(\w+)\]", text)
    assert sorted(names) == ["J1", "J2", "J3", "J4"]
    assert names.index("J3") < names.index("J4")
    assert text.count("#") > 5


def test_a_part_of_the_mechanism_is_not_replaced_by_it(in_parts: Path) -> None:
    part = in_parts / "rocker.toml"
    before = part.read_text()
    with pytest.raises(InputError, match=r"rocker.toml: is a part of .*; name another file"):
        jp.load(in_parts / "main.toml").write(part)
    assert part.read_text() == before


def test_lines_end_as_they_did(tmp_path: Path) -> None:
    """New tables once had the line ends of Unix in files that have those of Windows."""
    path = tmp_path / "windows.toml"
    path.write_bytes(FOUR_BAR.replace("\n", "\r\n").encode())
    m = jp.load(path).with_({"limits.rotation": 2, "loads.0.force": [0, -3], "springs.S": SPRING})
    m.write(path)
    text = path.read_bytes().decode()
    assert "[springs.S]" in text
    assert "\n" not in text.replace("\r\n", "")
    assert jp.load(path) == m


def test_halves_of_letters_are_refused() -> None:
    with pytest.raises(InputError, match=r"title: .*\\ud83d.* has halves of letters, which no text has"):
        jp.loads(FOUR_BAR).with_({"title": "a \ud83d b"})
