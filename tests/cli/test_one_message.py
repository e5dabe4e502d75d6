"""What is refused is told by one message: no warnings of libraries beside it, no remarks before it."""

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.commands import refused
from jointplay.cli import run

ROBOTS = Path(__file__).parents[2] / "docs" / "robots"
#: places of numbers in foreign files
NUMBERS = {
    "linkage.urdf": ('xyz="0.075 0 0" rpy="0 0 1.85"', 'xyz="{n} 0 0" rpy="0 0 1.85"'),
    "an axis.urdf": (
        '<axis xyz="0 0 1"/>\n  </joint>\n  <joint name="J2"',
        '<axis xyz="0 {n} {n}"/></joint><joint name="J2"',
    ),
    "an angle.urdf": ('rpy="0 0 0.4"', 'rpy="0 0 {n}"'),
    "arm.urdf": ('<origin xyz="0', '<origin xyz="{n}'),
    "press.sdf": ("<pose>0", "<pose>{n}"),
    "five-bar.xml": ('axis="0', 'axis="{n}'),
    "a place.xml": ('pos="0', 'pos="{n}'),
}
SOURCES = {"an axis.urdf": "linkage.urdf", "an angle.urdf": "linkage.urdf", "a place.xml": "five-bar.xml"}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("number", ["1e200", "-1e308", "1e13", "1e-320", "1e160"])
@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_nothing_that_can_be_built_in_foreign_files(
    name: str, number: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """NumPy warned of overflows beside the message, or LAPACK ended the command in a traceback."""
    if name.endswith("xml"):
        pytest.importorskip("mujoco")
    old, new = NUMBERS[name]
    text = (ROBOTS / SOURCES.get(name, name)).read_text(encoding="utf-8")
    assert old in text
    Path(name).write_text(text.replace(old, new.format(n=number), 1), encoding="utf-8")
    if run(["import", name, "-o", "new.toml"]) == 0:
        # So small a number is one like any, and MuJoCo makes unit vectors of directions.
        assert number == "1e-320" or (name, number) == ("five-bar.xml", "1e13")
        return
    said = capsys.readouterr().err
    assert said.startswith(f"error: {name}: ")
    assert said.count("\n") == 1


@pytest.mark.parametrize("text", ["1and 2", "2if 3", "0x1for", '"\\d"', "3 or 4", "not 1", '"a" is 1', "1in 2"])
def test_words_that_python_has_remarks_on(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its parser printed a `SyntaxWarning` on the standard error."""
    Path("m.toml").write_text(f"{jp.examples.text('four-bar')}\n[variables]\na = '{text}'\n", encoding="utf-8")
    said = refused(capsys, "check", "m.toml")
    assert "is not an expression such as a / 2 + 10" in said


def test_words_within_names_are_no_such_words() -> None:
    variables = '[variables]\nforce_in = 2\nnotch = "force_in * 3"\nor_ = "notch + 1"\n'
    m = jp.loads(f"{jp.examples.text('four-bar')}\n{variables}")
    assert m.with_({"joints.J1.clearance.radial": "or_ / 10"}).data.joints["J1"].clearance.radial == 0.7


def test_a_limit_of_zero_overflows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    """`report` and `allow` multiplied the largest number there is, which stood for an unlimited share, by 100."""
    found = jp.allow(jp.load("m.toml").with_({"limits.position": 0.0}))
    assert np.isposinf(found.used_without.values).all()
    assert np.isposinf(found.used.item())
    assert run(["allow", "m.toml", "-s", "limits.position=0"]) == 1
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "words",
    [
        ["sweep", "m.toml", "-s", "joints.*.clearance.radial=0.1,-1"],
        ["sweep", "m.toml", "-s", "joints.*.clearance.radial=0.1,x"],
        ["sweep", "m.toml", "-s", "joints.*.clearance.radial=0.1,1", "--by", "drives.*.error=1,1e99"],
        ["error", "m.toml", "-s", "joints.*.clearance.radial=0.1", "--offset", "nothing=1"],
        ["error", "m.toml", "-s", "joints.*.clearance.radial=0.1", "-o", "nowhere/r.nc"],
        ["new", "four-bar", "-s", "joints.*.clearance.radial=0.1", "-o", "m.toml"],
    ],
)
def test_what_a_star_reached_is_not_told_of_what_is_refused(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """`sweep` told it before the error."""
    refused(capsys, *words)


def test_what_a_star_reached_is_told_with_the_answer(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", "m.toml", "-s", "joints.*.clearance.radial=0.1,0.2", "-q", "loaded"]
    assert run(words) == 0
    assert capsys.readouterr().err == "joints.*.clearance.radial: 4 of 4 joints\n"
