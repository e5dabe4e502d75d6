"""Numbers that were meant in another unit, and commas that were meant as points, are asked about and not refused."""

from pathlib import Path

import pytest

import jointplay as jp
from jointplay.analyses.hints import hints

FOUR_BAR = jp.examples.text("four-bar")


def test_drives_of_an_arm_in_radians() -> None:
    m = jp.loads(FOUR_BAR)
    assert "theta1 = 1.57 looks like radians" in hints(m.with_({"drives.theta1.values": [0, 0.5, 1.57]}))[0]
    # A flexure moves by a few degrees.
    assert hints(m.with_({"drives.theta1.values": [0, 1.5, 3]})) == []


def test_one_link_in_metres() -> None:
    found = hints(jp.loads(FOUR_BAR.replace("[75, 0]", "[0.075, 0]", 1)))
    assert found[0].startswith("crank is 0.075 mm long and the others are 75 to 150 mm")


def test_decimal_commas_in_a_list() -> None:
    found = hints(jp.loads(FOUR_BAR.replace("values = [22.7,", "values = [22,7, 23.5,")))
    assert "has 13 values: decimals have a point" in found[0]
    with pytest.raises(jp.InputError, match=r"2 values are needed, not \[75, 5, 0\] \(decimals have a point"):
        jp.loads(FOUR_BAR.replace("[75, 0]", "[75,5, 0]", 1))


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("at   = [150, 0]", "at = [150,5, 0]", r"not \[150, 5, 0\] \(decimals have a point"),
        ("values = [22.7,", "values = 22,7\nsee = [", "line .* is not TOML: .*; decimals have a point, such as 0.5"),
        ("radial = 1.0", "radial = 0,05", "line .* is not TOML: .*; decimals have a point, such as 0.5"),
    ],
)
def test_decimal_commas_that_toml_cannot_read(before: str, after: str, said: str) -> None:
    """The parser expected a newline, or a key, and said no more."""
    assert before in FOUR_BAR
    with pytest.raises(jp.InputError, match=said):
        jp.loads(FOUR_BAR.replace(before, after))


def test_a_decimal_comma_in_a_setting() -> None:
    with pytest.raises(jp.InputError, match='"0,5"; decimals have a point'):
        jp.loads(FOUR_BAR).with_({"joints.J1.clearance.radial": "0,5"})


@pytest.mark.parametrize("name", jp.examples.names())
def test_the_examples_are_what_they_seem(name: str) -> None:
    assert hints(jp.loads(jp.examples.text(name))) == []


def test_a_range_that_was_written_as_values() -> None:
    with pytest.raises(jp.InputError, match=r"a range is \{ from = -60, to = 60, count = 13 \}"):
        jp.map(jp.loads(jp.examples.text("five-bar")), "solve", {"x": (-60, 60, 13), "y": [180, 190]})


@pytest.mark.parametrize("name", ["arm.urdf", "arm.xacro", "arm.sdf", "arm.dxf"])
def test_files_of_other_programs_are_read_by_read(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / name).write_text("<robot name='arm'/>")
    with pytest.raises(jp.InputError, match=r"jointplay\.read"):
        jp.load(tmp_path / name)
    if name.endswith(".xacro"):
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(jp.InputError, match=r"`xacro arm\.xacro > arm\.urdf`"):
            jp.read(tmp_path / name)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("theta1\n22,7\n30\n", "row 2 has 2 values for 1 column; decimals have a point"),
        ("theta1;other\n22,7;1\n30;2\n", 'a number is needed, not "22,7"; decimals have a point'),
    ],
)
def test_decimal_commas_in_a_table(table: str, said: str, tmp_path: Path) -> None:
    """`22,7` below one name was read as 22."""
    (tmp_path / "motion.csv").write_text(table)
    text = "\n".join('csv = "motion.csv"' if line.startswith("values") else line for line in FOUR_BAR.splitlines())
    (tmp_path / "four-bar.toml").write_text(text)
    with pytest.raises(jp.InputError, match=said):
        jp.load(tmp_path / "four-bar.toml")
