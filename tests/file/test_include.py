"""Files made of parts: what is included joins as if it were written in the file."""

import os
import pickle
from pathlib import Path

import pytest

import jointplay as jp
from jointplay.cli import run

WHOLE = jp.examples.text("four-bar")
#: where the part with the rocker begins and ends
PIN = WHOLE[WHOLE.index("[joints.J4]") : WHOLE.index("[start]")]
MAIN = WHOLE.replace(PIN, "").replace("format = 1", 'format = 1\ninclude = ["rocker.toml"]', 1)


GRAVITY = "gravity = [0, -9.81]\n\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "main.toml").write_text(MAIN)
    (tmp_path / "rocker.toml").write_text(PIN)
    return tmp_path


def test_a_file_of_parts_is_the_whole_file(folder: Path) -> None:
    m = jp.load(folder / "main.toml")
    assert m == jp.loads(WHOLE)
    assert "include" not in m.raw
    assert pickle.loads(pickle.dumps(m)) == m
    assert m.with_({"joints.J4.clearance.radial": 0.2}).value("joints.J4.clearance.radial") == 0.2


def test_what_a_part_says_again_must_be_the_same(folder: Path) -> None:
    part = folder / "rocker.toml"
    part.write_text('format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n' + PIN)
    assert jp.load(folder / "main.toml") == jp.loads(WHOLE)
    part.write_text('units = { length = "m", angle = "deg", force = "N" }\n' + PIN)
    with pytest.raises(jp.InputError, match=r"units: .*\"m\".* in .*rocker.toml, but .*\"mm\".* in .*main.toml"):
        jp.load(folder / "main.toml")


def test_lists_and_variables_join(folder: Path) -> None:
    (folder / "rocker.toml").write_text("[variables]\nplay = 0.3\n" + PIN + "\n[[loads]]\nforce = [1, 2]\n")
    m = jp.load(folder / "main.toml").with_({"joints.J1.clearance.radial": "play"})
    assert m.data.joints["J1"].clearance.radial == 0.3
    assert len(m.data.loads) == len(jp.loads(WHOLE).data.loads) + 1


@pytest.mark.parametrize(
    ("include", "part", "key", "said"),
    [
        ('["rocker.toml"]', PIN.replace("J4", "J1"), "joints.J1", "is given in main.toml and again in rocker.toml"),
        ('["rocker.toml", "again.toml"]', PIN, "joints.J4", "is given in rocker.toml and again in again.toml"),
        ('["rocker.toml"]', 'title = "x"\n' + PIN, "title", "is given in main.toml and again in rocker.toml"),
        ('["../rocker.toml"]', PIN, "include.0", "is not the name of a file in the same folder"),
        ('["/etc/passwd"]', PIN, "include.0", "is not the name of a file in the same folder"),
        ('["a\\\\b.toml"]', PIN, "include.0", "is not the name of a file in the same folder"),
        ('[".."]', PIN, "include.0", "is not the name of a file in the same folder"),
        ('[""]', PIN, "include.0", "is not the name of a file in the same folder"),
        ('["main.toml"]', PIN, "include.0", "is not another file"),
        ('["rocker.toml", "rocker.toml"]', PIN, "include.1", "named once"),
        ('["roker.toml"]', PIN, "include.0", 'there is no file "roker.toml" in the same folder'),
        ('["rocker.toml"]', "gravity = [0]\n" + PIN, "gravity", "is given in main.toml and again in rocker.toml"),
        ('["rocker.toml"]', "format = true\n" + PIN, "format", "true in rocker.toml, but 1 in main.toml"),
        ('"rocker.toml"', PIN, "include", "names of files are needed"),
        ("[1]", PIN, "include", "names of files are needed"),
        ('["rocker.toml"]', 'include = ["again.toml"]\n' + PIN, "include", "includes no other"),
        ('["rocker.toml"]', "[joints.J4\n", "", "is not TOML"),
        ('["rocker.toml"]', "\0", "", "is a binary file"),
    ],
)
def test_what_cannot_join_is_named_with_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, include: str, part: str, key: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    included = f"include = {include}\n" + (GRAVITY if "gravity" in part else "")
    Path("main.toml").write_text(MAIN.replace('include = ["rocker.toml"]\n', included))
    Path("rocker.toml").write_text(part)
    Path("again.toml").write_text(PIN)
    with pytest.raises(jp.InputError) as refused:
        jp.load("main.toml")
    assert refused.value.key == key
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "file", "key"),
    [
        ("clearance = {", "clearence = {", "rocker.toml", "joints.J4"),
        ("rocker = [0, 0]", "rocker = [0]", "rocker.toml", "joints.J4.on.rocker"),
        ("radial = 1.0", "radial = 1e6", "rocker.toml", "joints.J4.clearance"),
        ("rocker = [0, 0]", "roker = [0, 0]", "rocker.toml", "joints.J4"),
        ("[joints.J4]", "[[loads]]\nforce = [1]\n\n[joints.J4]", "rocker.toml", "loads.0.force"),
        ("[joints.J4]", '[variables]\na = "1 +"\n\n[joints.J4]', "rocker.toml", "variables.a"),
        ("[joints.J4]", "[joints.J5]", "", ""),
    ],
)
def test_a_mistake_in_a_part_names_the_part(
    folder: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, file: str, key: str
) -> None:
    """It named the file that includes the part, in which the key cannot be found."""
    monkeypatch.chdir(folder)
    part = Path("rocker.toml")
    assert old in PIN
    part.write_text(PIN.replace(old, new, 1))
    if not file:
        jp.load("main.toml")
        return
    with pytest.raises(jp.InputError) as refused:
        jp.load("main.toml")
    assert (refused.value.file, refused.value.key) == (file, key)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes")
def test_a_pipe_is_no_part(folder: Path) -> None:
    """Reading it would wait for ever."""
    (folder / "rocker.toml").unlink()
    os.mkfifo(folder / "rocker.toml")
    with pytest.raises(jp.InputError, match="is no file"):
        jp.load(folder / "main.toml")


def test_a_text_has_no_folder() -> None:
    with pytest.raises(jp.InputError, match="not in a text or a change"):
        jp.loads(MAIN)


def test_the_command_reads_parts(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(folder / "main.toml")]) == 0
    assert "J4" in capsys.readouterr().out
    (folder / "rocker.toml").unlink()
    assert run(["check", str(folder / "main.toml")]) == 2
    assert 'there is no file "rocker.toml"' in capsys.readouterr().err
