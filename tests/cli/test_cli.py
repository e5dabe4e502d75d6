"""The command: what it prints, writes, refuses, and with which exit code it leaves."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer.main
import xarray as xr

import jointplay as jp
from helpers.processes import COMMAND, worked, working
from jointplay.cli import run
from jointplay.cli.arguments import assignments, numbers, only_set, swept, value
from jointplay.cli.commands import HOMES, program


class Said(str):
    """What a command printed."""

    code: int
    error: str


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Run a command line in a folder of its own, which has all examples."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)
    for name in jp.examples.names():
        Path(f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")

    def command(line: str, *more: str) -> Said:
        code = run([*line.split(), *more])
        out, err = capsys.readouterr()
        said = Said(out)
        said.code, said.error = code, err
        return said

    return command


def column(text: str, header: str, table: str) -> list[str]:
    """Cells of the column under a header, in the table after a title."""
    lines = text[text.index(f"\n{table}") :].splitlines()
    rule = next(k for k, line in enumerate(lines) if line.strip().startswith("─"))
    # Above the units stands the last line of the names.
    names = next(line for line in reversed(lines[: rule - 1]) if re.search(rf"(?<!\S){re.escape(header)}(?!\S)", line))
    end = names.index(header) + len(header)
    body = [*lines[rule + 1 :], ""]
    rows = body[: next(k for k, line in enumerate(body) if not line.strip())]
    return [row[:end].split()[-1] for row in rows]


# --- what is printed -------------------------------------------------------------------------------------------------


class TestError:
    def test_answers_all_four_questions_of_the_four_bar(self, say) -> None:
        said = say("error four-bar.toml --samples 5000 -q all -q given")
        assert said.code == 0
        assert said.error == ""
        worst = column(said, "position", "Worst case")
        assert [float(worst[k]) for k in (0, 5, 10)] == [3.245, 3.297, 3.848]
        assert [float(column(said, "rotation", "Worst case")[k]) for k in (0, 5, 10)] == [1.532, 1.541, 1.668]
        assert [float(column(said, "y", "Loaded")[k]) for k in (0, 5, 10)] == [-3.103, -2.691, -2.248]
        # What is given by the worst case reproduces it.
        assert column(said, "distance", "Given offsets") == worst
        assert len(column(said, "95 %", "Random")) == 11

    def test_names_the_joint_to_blame_with_its_share(self, say) -> None:
        said = say("error four-bar.toml -q worst --set joints.J3.clearance.radial=5")
        m = jp.load("four-bar.toml").with_({"joints.J3.clearance.radial": 5})
        parts = jp.worst(m).contribution.sel(extreme="position")
        share = 100 * parts.sel(source="J3") / parts.sum("source")
        assert f"J3 {share[0].item():.0f} %" in said

    def test_every_row_has_the_same_decimals(self, say) -> None:
        said = say("error slider-crank.toml -q loaded -q worst")
        for title, header in (("Loaded", "x"), ("Loaded", "distance"), ("Worst case", "position")):
            cells = column(said, header, title)
            assert len({len(cell.partition(".")[2]) for cell in cells}) == 1
            digits = max(len(cell.lstrip("-0.").replace(".", "")) for cell in cells)
            assert digits == 4

    def test_status_is_shown_only_when_something_is_not_ok(self, say) -> None:
        assert "status" not in say("error four-bar.toml -q worst")
        said = say("error four-bar.toml -q worst", "--set", "drives.theta1.values=[22.7, 180]")
        assert said.code == 1
        assert "not assembled: the links cannot reach the commanded pose" in said
        assert re.search(r"1 +180\.0 +– .*not assembled", said)

    def test_given_offsets_are_those_on_the_line(self, say) -> None:
        said = say("error four-bar.toml --question given --offset J1=0.5,-0.25 --offset l2=0.1")
        expected = jp.given(jp.load("four-bar.toml"), {"J1": [0.5, -0.25], "l2": 0.1}).error
        cells = column(said, "x", "Given offsets")
        np.testing.assert_allclose([float(c) for c in cells], expected.sel(component="x"), rtol=0, atol=6e-5)
        assert "l2: the offset is larger than the file allows" in said

    def test_seed_and_samples_count(self, say) -> None:
        lines = [f"error four-bar.toml -q random --samples {n} --seed {s}" for n, s in ((500, 1), (500, 1), (500, 2))]
        one, same, other = (say(line) for line in lines)
        assert one == same
        assert one != other
        assert "500 specimens per configuration, seed 1" in one
        assert "clearances boundary" in say(lines[0] + " --law boundary")

    def test_what_does_not_apply_is_left_out_or_refused(self, say) -> None:
        said = say("error four-bar.toml --samples 100 --set", "loads=[]")
        assert said.code == 0
        assert "Loaded" not in said
        said = say("error four-bar.toml -q loaded --set", "loads=[]")
        assert said.code == 2
        assert "nothing loads the mechanism" in said.error

    def test_a_narrow_terminal_gets_what_matters(self, say, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("COLUMNS", "72")
        said = say("error five-bar.toml --samples 100 -q worst -q random")
        assert max(len(line) for line in said.splitlines()) <= 72
        assert "Not shown: left, right, " in said
        assert len(column(said, "position", "Worst case")) == 9

    def test_long_motions_are_thinned_and_keep_the_worst(self, say) -> None:
        said = say("error four-bar.toml -q worst", "--set", "drives.theta1={ joint='J1', from=20, to=80, count=500 }")
        rows = column(said, "position", "Worst case")
        assert len(rows) == 12
        m = jp.load("four-bar.toml").with_({"drives.theta1": {"joint": "J1", "from": 20, "to": 80, "count": 500}})
        assert max(map(float, rows)) == pytest.approx(jp.worst(m).worst_position.max().item(), abs=6e-4)
        assert "Not shown: 488 of 500 rows; " in said or "Not shown: 488 of 500 rows." in said


def test_solve_prints_path_and_drives(say) -> None:
    said = say("solve five-bar.toml")
    assert said.code == 0
    assert [float(c) for c in column(said, "x", "Nominal")] == list(range(-60, 61, 15))
    assert "Zero in all rows: x off path, y off path." in said


def test_a_singular_configuration_is_named_with_what_moves(say) -> None:
    change = ["--set", "drives.theta1.values=[90.0]"]
    near = jp.solve(jp.load("four-bar.toml").with_({"drives.theta1.values": [90.0]})).singular_value.item()
    said = say("solve four-bar.toml", *change, "--set", f"limits.singular_value={1.1 * near}")
    assert said.code == 1
    assert re.search(r"Configuration 0: singular: .*what moves: .*rocker", " ".join(said.split()))


def test_compensate_prints_corrected_drives(say) -> None:
    said = say("compensate four-bar.toml")
    expected = jp.compensate(jp.load("four-bar.toml"))
    cells = [float(c) for c in column(said, "theta1 corrected", "Compensation")]
    np.testing.assert_allclose(cells, expected.drive_corrected[:, 0], rtol=0, atol=6e-4)
    assert "corrected for position;" in said


def test_compensate_minds_target_weights_and_offsets(say) -> None:
    m = jp.load("four-bar.toml")
    for line, expected in (
        ("-q given --target 2,0", jp.compensate(m, "given", target=[2, 0])),
        ("--weights 0,100", jp.compensate(m, weights=(0, 100))),
        ("--offset J2=0.5,0.5", jp.compensate(m, "given", {"J2": [0.5, 0.5]})),
    ):
        cells = [float(c) for c in column(say(f"compensate four-bar.toml {line}"), "change", "Compensation")]
        np.testing.assert_allclose(cells, expected.correction[:, 0], rtol=0, atol=6e-4)


def test_compare_prints_both_side_by_side(say) -> None:
    said = say("compare four-bar.toml p3r.toml")
    assert said.code == 0
    assert "four-bar" in said
    expected = jp.compare(jp.load("four-bar.toml"), jp.load("p3r.toml"))
    ratio = (expected.worst_position[1] / expected.worst_position[0]).values
    assert f"{ratio[0]:.2f}" in said
    assert "leaves the path" not in said
    far = say("compare four-bar.toml slider-crank.toml")
    assert "slider-crank leaves the path by up to" in far


def test_two_structures_without_drives_are_compared_in_a_table_as_well(say) -> None:
    said = say("compare x-braced-square.toml redundant-bar.toml")
    assert said.code == 1
    assert "strained" in said
    worst = jp.worst(jp.load("x-braced-square.toml"))
    assert f"{worst.worst_position[0].item():.3f}" in said


def test_what_a_star_reaches_is_said_on_stderr(say) -> None:
    """One clearance is written as a diameter; it was passed over without a word."""
    said = say("error four-bar.toml -q worst --set joints.J2.clearance.diametral=1 --set joints.*.clearance.radial=0.2")
    assert said.error == "joints.*.clearance.radial: 4 of 4 joints; 1 converted from diametral\n"
    m = jp.load("four-bar.toml").with_({"joints.*.clearance.radial": 0.2})
    assert f"{jp.worst(m).worst_position.max().item():.3f}" in said
    assert say("sweep four-bar.toml --set joints.*.clearance.diametral=0.2,0.4").error == (
        "joints.*.clearance.diametral: 4 of 4 joints; 4 converted from radial\n"
    )
    nothing = say("sweep four-bar.toml --set joints.*.clearance.radail=0.2,0.4")
    assert nothing.code == 2
    assert "did you mean 'radial'?" in nothing.error


def test_sweep_prints_a_row_per_value(say) -> None:
    said = say("sweep four-bar.toml --set joints.*.clearance.radial=0:1:5 --set drives.theta1.error=0.1")
    assert column(said, "radial", "Worst case") == ["0.00", "0.25", "0.50", "0.75", "1.00"]
    m = jp.load("four-bar.toml").with_({"drives.theta1.error": 0.1})
    expected = jp.sweep(m, "joints.*.clearance.radial", [0.25]).worst_position.max().item()
    assert f"{expected:.3f}" in said
    assert "random" in str(
        say("sweep four-bar.toml -q random --samples 100 --set joints.*.clearance.radial=0.1,1").lower()
    )


def test_check_prints_what_there_is(say) -> None:
    said = say("check slider-crank.toml")
    assert said.code == 0
    assert re.search(r"guide +prismatic +ground +slider", said)
    assert "1 degree of freedom, 1 drive" in said
    loose = say("check four-bar.toml --set", "drives={}")
    assert loose.code == 1
    assert "too few drives" in loose


class TestNew:
    def test_lists_the_examples(self, say) -> None:
        said = say("new")
        for name in jp.examples.names():
            title = re.escape(jp.examples.title(name)).replace(r"\ ", r"\s+")
            assert re.search(rf"^{name} +{title}$", said, re.MULTILINE)
        assert max(map(len, said.splitlines())) <= 80

    def test_writes_one_with_changes(self, say) -> None:
        said = say("new four-bar -o mine.toml --set joints.*.clearance.radial=0.2 --set", "title='My own'")
        assert said.code == 0
        m = jp.load("mine.toml")
        assert m.title == "My own"
        assert m.value("joints.*.clearance.radial") == 0.2

    def test_replaces_nothing_unasked(self, say) -> None:
        Path("four-bar.toml").write_text("mine")
        said = say("new four-bar")
        assert said.code == 2
        assert said.error == "error: four-bar.toml: exists already; --force replaces it\n"
        assert Path("four-bar.toml").read_text() == "mine"
        assert say("new four-bar --force").code == 0
        assert tomllib.loads(Path("four-bar.toml").read_text())["format"] == 1


def test_schema_is_json(say) -> None:
    assert json.loads(say("schema"))["type"] == "object"
    assert say("schema -o schema.json").code == 0
    assert json.loads(Path("schema.json").read_text()) == json.loads(say("schema"))


def test_version_and_help(say) -> None:
    assert say("--version") == f"jointplay {jp.__version__}\n"
    for command in (
        "",
        "new",
        "check",
        "solve",
        "error",
        "compensate",
        "sweep",
        "forces",
        "allow",
        "life",
        "allocate",
        "compare",
        "schema",
    ):
        said = say(f"{command} --help")
        assert said.code == 0
        assert "Usage" in said
    assert "Usage" in say("")


# --- what is written -------------------------------------------------------------------------------------------------


class TestOutput:
    def test_the_file_holds_what_the_function_gives(self, say) -> None:
        assert say("error four-bar.toml -q worst -o w.nc") == ""
        with xr.open_dataset("w.nc", engine="h5netcdf") as back:
            assert (
                back.worst_position.values.tolist() == jp.worst(jp.load("four-bar.toml")).worst_position.values.tolist()
            )

    def test_several_questions_share_a_file(self, say) -> None:
        assert say("error four-bar.toml --samples 500 -o all.json").code == 0
        content = json.loads(Path("all.json").read_text())
        assert {"loaded_error", "worst_position", "random_error_quantile"} <= set(content["data_vars"])
        assert "given_error" not in content["data_vars"]

    def test_a_sweep_is_a_table(self, say) -> None:
        assert say("sweep four-bar.toml --set joints.*.clearance.radial=0.1,0.2 -o s.csv").code == 0
        lines = Path("s.csv").read_text().splitlines()
        assert lines[0].startswith("variable,radial,configuration,theta1,")
        assert sum(line.startswith("worst_position,") for line in lines) == 2 * 11

    def test_a_drawing_is_drawn(self, say) -> None:
        pytest.importorskip("matplotlib")
        assert say("error four-bar.toml --samples 500 --plot e.svg").code == 0
        assert "<svg" in Path("e.svg").read_text()
        for line in (
            "solve slider-crank.toml --plot s.png",
            "compensate five-bar.toml --plot c.png",
            "sweep four-bar.toml --set joints.*.clearance.radial=0.1,0.2 --plot w.png",
            "compare four-bar.toml p3r.toml --plot k.png",
            "error serial-2r.toml -q loaded --plot l.png",
        ):
            assert say(line).code == 0
            assert Path(line.split()[-1]).read_bytes().startswith(b"\x89PNG")


# --- what is refused -------------------------------------------------------------------------------------------------

REFUSED = [
    ("error nowhere.toml", "nowhere.toml: there is no such file"),
    ("error .", ".: this is a folder"),
    ("error four-bar.toml -o r.txt", "r.txt: '.txt' is not an extension"),
    ("error four-bar.toml -o nowhere/r.nc", "there is no folder 'nowhere'"),
    ("error four-bar.toml --plot r.bmp", "drawings are written as .png, .svg, .pdf"),
    ("error four-bar.toml --set joints.J1", '"joints.J1" is not KEY=VALUE'),
    ("error four-bar.toml --set joints.J1.clearance.radius=1", "did you mean 'radial'?"),
    ("error four-bar.toml --set joints.J1.clearance.radial=-1", "joints.J1.clearance.radial"),
    ("error four-bar.toml --offset J1", '"J1" is not KEY=VALUE'),
    ("error four-bar.toml --offset J1=far", '"far" is not a number'),
    ("error four-bar.toml --offset J1=1", "2 numbers (J1.x, J1.y)"),
    ("error four-bar.toml --offset J7=1", "'J7' is not a source or a parameter"),
    ("error four-bar.toml --samples 0 -q random", "0 is not a number of samples"),
    ("error four-bar.toml --samples many", "--samples"),
    ("error four-bar.toml -q wrost", "wrost"),
    ("error four-bar.toml --nonsense", "--nonsense"),
    ("error", "FILE"),
    ("nonsense", "nonsense"),
    ("sweep four-bar.toml", "say what is swept"),
    ("sweep four-bar.toml --set a.b=0:1", '"0:1" is not from:to:count'),
    ("sweep four-bar.toml --set a.b=0:1:1", "1 values; 2 to"),
    ("sweep four-bar.toml --set a=1,2 --set b=1,3", "share them"),
    ("compensate four-bar.toml --weights 1", "needs 2 numbers"),
    ("compensate four-bar.toml -q loaded --offset J1=1,0", "ask for the question 'given'"),
    ("compare four-bar.toml p3r.toml --components x,z", "'z' is not a component"),
    ("new six-legs", "'six-legs' is not an example"),
    ("new four-bar -o nowhere/four.toml", "there is no folder 'nowhere'"),
]


@pytest.mark.parametrize(("line", "part"), REFUSED)
def test_bad_input_is_one_line_and_exit_code_2(say, line: str, part: str) -> None:
    said = say(line)
    assert said.code == 2
    assert said == ""
    assert said.error.startswith("error: ")
    assert said.error.count("\n") == 1
    assert part in said.error


def test_nothing_is_computed_for_a_result_that_cannot_be_written(say, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("asked all the same")

    monkeypatch.setattr("jointplay.analyses.worst.compute", never)
    assert say("error four-bar.toml -q worst -o r.txt").code == 2


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_a_folder_that_cannot_be_written_to(say, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    said = say("solve four-bar.toml -o locked/r.csv")
    assert said.code == 2
    assert "cannot be written" in said.error


# --- values on the line ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", 1),
        ("0.5", 0.5),
        ("true", True),
        ("[1, 2]", [1, 2]),
        ("'a b'", "a b"),
        ("normal", "normal"),
        ("1\nb=2", "1\nb=2"),
    ],
)
def test_values_are_toml_or_words(text: str, expected: object) -> None:
    assert value(text) == expected


def test_swept_values() -> None:
    settings = {"a": "0:0.3:4", "b": "[1, 2]", "c": "'10:13'", "d": "0:0.3:4", "e": "atan2(3, 4)"}
    keys, steps = swept(settings)
    assert keys == ["a", "d"]
    assert steps == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert steps[-1] == 0.3
    assert only_set(settings) == {"b": "[1, 2]", "c": "'10:13'", "e": "atan2(3, 4)"}
    assert swept({"lean": "0.1,atan2(3, 4),a / 2"})[1] == [0.1, "atan2(3, 4)", "a / 2"]
    assert swept({"law": "uniform,normal"})[1] == ["uniform", "normal"]


def test_assignments_split_at_the_first_sign() -> None:
    assert assignments(["title=a=b", " x = 1 "], "--set") == {"title": "a=b", "x": "1"}
    with pytest.raises(jp.InputError, match="given twice"):
        assignments(["a=1", "a=2"], "--set")
    assert numbers("1", "-x") == 1.0
    assert numbers("1,2", "-x") == (1.0, 2.0)


# --- processes -------------------------------------------------------------------------------------------------------


def test_exit_codes_reach_the_shell(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    for more, code in (([], 0), (["--set", "drives.theta1.values=[180]"], 1), (["--set", "a=1"], 2)):
        done = subprocess.run([*COMMAND, "solve", "m.toml", *more], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == code
        assert "Traceback" not in done.stderr


def modules_after(code: str, folder: Path) -> set[str]:
    """What a fresh interpreter has imported after the code."""
    code += "; import sys; print('MODULES', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()[1:])


def test_tables_need_no_library_of_the_results(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    found = modules_after(
        "from jointplay.cli import run; run(['error', 'm.toml', '--samples', '100', '-o', 'r.csv']);"
        "run(['error', 'm.toml', '--samples', '100']); run(['compensate', 'm.toml']); run(['check', 'm.toml']);"
        "run(['solve', 'm.toml']); run(['allow', 'm.toml'])",
        tmp_path,
    )
    assert "jointplay.result.table" in found
    assert not found & {"xarray", "pandas", "matplotlib", "h5netcdf", "scipy", "numpy.ma", "asyncio", "tomlkit"}


def test_a_command_makes_no_other(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    found = modules_after("from jointplay.cli import run; run(['solve', 'm.toml'])", tmp_path)
    made = {f"jointplay.cli.{home.partition('.')[0]}" for home in HOMES.values()} & found
    assert made == {"jointplay.cli.solving"}
    assert list(typer.main.get_command(program("solve")).commands) == ["solve"]
    assert list(typer.main.get_command(program()).commands) == list(HOMES)


def test_the_interpreter_leaves_objects_where_they_are(tmp_path: Path) -> None:
    code = (
        "import atexit, gc, sys; atexit.register(lambda: print('FROZEN', gc.get_freeze_count()));"
        "sys.argv = ['jointplay', 'new']; from jointplay.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert int(done.stdout.split("FROZEN")[1]) > 10_000


def test_a_reader_that_leaves_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    line = f"'{sys.executable}' -m jointplay schema | head -n 1"
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == "{\n"
    assert done.stderr == ""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """A sweep that would take minutes is stopped: exit code 130, a whole file with the steps that were done."""
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    line = shlex.split("sweep m.toml -q random --samples 10000 --set joints.*.clearance.radial=0.001:1:20000 -o s.csv")
    with working(line, tmp_path) as process:
        worked(process, 4.0)  # two of them for its start
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    lines = (tmp_path / "s.csv").read_text().splitlines()
    rows = [line for line in lines if line.startswith("status,")]
    assert 0 < len(rows) < 20000 * 11
    assert len(rows) % 11 == 0
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_within_the_first_configuration(tmp_path: Path) -> None:
    """It was heard only when the configuration was done, and then nothing was said."""
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    line = shlex.split("error m.toml -q random --samples 10000000000 -o s.csv")
    with working(line, tmp_path) as process:
        worked(process, 3.0)  # started for sure, and seconds from the end of the first configuration
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    if (tmp_path / "s.csv").exists():
        assert err == "interrupted; what is done is written\n"
        lines = (tmp_path / "s.csv").read_text().splitlines()
        assert sum(line.startswith("status,") for line in lines) == 1
    else:  # a machine so busy that not even a sample was drawn
        assert err == "interrupted before there was anything to report\n"


@pytest.mark.parametrize("option", ["--sizes", "--question", "--law", "--contact"])
def test_a_value_that_an_option_does_not_have_gets_a_plain_message(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The messages began with the words of a library: "Value error, 'x' is not one of"."""
    file = tmp_path / "m.toml"
    file.write_text(jp.examples.text("four-bar"))
    assert run(["error", str(file), option, "x"]) == 2
    assert re.search(r": 'x' is not one of '[a-z]+', '", capsys.readouterr().err)


def test_a_sweep_of_one_configuration_counts_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "m.toml"
    file.write_text(jp.examples.text("four-bar"))
    values = ["-s", "drives.theta1.values=[30]", "-s", "joints.J1.clearance.radial=0.1,0.2"]
    assert run(["sweep", str(file), *values]) == 0
    assert "over 1 configuration, by" in " ".join(capsys.readouterr().out.split())
