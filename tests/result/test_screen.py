"""What a new user sees: the answer first, tables that fit, nothing said twice, what is left out, colours, help, Tab."""

import inspect
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from jointplay.cli import run
from jointplay.cli.help import LINES
from jointplay.questions import QUESTIONS
from jointplay.result import from_dataset
from jointplay.result.conclusions import Sentence, conclude
from jointplay.result.table import Answer, Column, Console, ResultTable, numbers, show, tables
from jointplay.result.table.fit import MOST_ROWS, chosen_rows, fitted
from jointplay.result.verdict import verdict

ANSI = re.compile(r"\x1b\[[0-9;]*m")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the file of every example, and a terminal of 80 characters."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    for name in jp.examples.names():
        Path(f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")
    for name in (
        "robots/arm.urdf",
        "drawings/coupler.dxf",
        "cad/pump.FCStd",
        "readings/readings.csv",
        "readings/pushed.toml",
        "readings/pushed.csv",
    ):
        shutil.copy(Path(__file__).resolve().parents[2] / "docs" / name, Path(name).name)
    return tmp_path


def say(capsys: pytest.CaptureFixture[str], line: str) -> str:
    capsys.readouterr()
    assert run(shlex.split(line)) in (0, 1)
    return capsys.readouterr().out


# --- the answer ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", jp.examples.names())
def test_every_example_fits_into_eighty_columns_and_begins_with_its_answer(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for line in (
        f"check {name}.toml",
        f"solve {name}.toml",
        f"error {name}.toml --samples 64 -q worst -q random --all",
    ):
        said = say(capsys, line).splitlines()
        assert max(map(len, said)) <= 80, line
        # The title, an empty line, then sentences.
        answer = next(text for text in said[1:] if text)
        assert answer.startswith("  "), line
        assert len(answer.split()) > 3, line


@pytest.mark.parametrize("name", ["four-bar", "3-rrr", "excavator", "3-upu", "rssr", "sarrus"])
def test_the_answer_names_the_largest_error_its_configuration_and_a_source_with_the_largest_share(name: str) -> None:
    """Compared with the numbers of the result, without limits and with one that is missed."""
    for limits in (None, {"position": 1e-4}):
        worst = jp.worst(example(name).with_({"limits": limits}))
        first = conclude(from_dataset(worst)).sentences[0]
        sizes = worst.worst_position.values
        k = int((sizes >= sizes.max() * (1 - 1e-9)).argmax())
        assert f"{worst.worst_position.values[k]:.4g} mm" in first.text
        assert len(worst.configuration) == 1 or f"configuration {k}" in first.text
        parts = worst.contribution.sel(extreme="position").isel(configuration=k)
        share = parts / parts.sum()
        top = [str(source) for source in share.source.values[share.values > share.values.max() - 1e-3]]
        assert top[0] in first.text
        assert f"{100 * share.values.max():.0f} %" in first.text
        assert first.is_alarm == (limits is not None)


def test_of_several_outputs_and_load_cases_the_worst_is_named() -> None:
    """The one that uses most of a limit, by the margins of every one of them."""
    found = jp.loaded(jp.loads(jp.examples.text("slider-crank-cases")))
    used = 1.0 - (found.margin / found.limit.sel(side="high")).min(["configuration", "quantity"])
    where = max(((o, c) for o in used.output.values for c in used.load_case.values), key=lambda at: used.loc[at].item())
    first = conclude(from_dataset(found)).sentences[0].text
    assert first.startswith(f"Output {where[0]}, load case {where[1]}, the worst of 6 by their limits: ")


def test_a_sweep_says_where_the_error_is_least_and_largest() -> None:
    found = jp.sweep(example("four-bar"), "joints.*.clearance.radial", [1.0, 0.2, 0.6])
    tops = found.worst_position.max("configuration").values
    text = " ".join(sentence.text for sentence in conclude(from_dataset(found)).sentences)
    assert f"{tops.min():.4g} mm with radial = 0.2 mm, {tops.max():.4g} mm with radial = 1 mm" in text


def test_what_a_swept_load_does_not_change_is_said_so(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = say(capsys, "sweep four-bar.toml -s loads.0.force.1=-10,-40")
    assert "Largest position error: 3.848 mm whatever loads.0.force.1 is, at configuration 10" in " ".join(said.split())
    # The table has the key that was typed, too.
    assert any(line.split()[:2] == ["loads.0.force.1", "largest"] for line in said.splitlines())
    assert "whatever" not in say(capsys, "sweep four-bar.toml -q loaded -s loads.0.force.0=-10,10")


def test_what_the_drives_remove_is_that_of_the_result() -> None:
    found = jp.compensate(example("four-bar"))
    before = np.hypot(*(found.error.sel(component=c) for c in "xy")).max().item()
    after = found.residual_position.max().item()
    first, second, *_ = (sentence.text for sentence in conclude(from_dataset(found)).sentences)
    assert first.startswith(f"Limits hold after the correction: position {after:.4g} mm of 4 mm")
    assert f"{before:.4g} mm before and {after:.4g} mm after the correction" in second


def test_joints_that_no_force_pushes_are_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Those whose part of the indeterminacy is not nothing, in the configuration that the load leaves open."""
    found = jp.loaded(example("3-upu"))
    bad = (found.status == "undetermined").values
    parts = found.undetermined_contribution.values[bad].max(axis=(0, 2))
    names = [str(name) for name, part in zip(found.source.values, parts, strict=True) if part > 1e-6]
    assert names
    said = " ".join(say(capsys, "error 3-upu.toml -q loaded").split())
    assert f"no force pushes {', '.join(names)} to one side" in said
    largest = found.undetermined.sel(component="x").max().item()
    assert f"The load leaves open at most: x ±{largest:.4g} mm" in said


def test_error_asks_three_questions_and_given_with_an_offset(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = say(capsys, "error four-bar.toml --samples 64")
    assert [line.split()[0] for line in said.splitlines()[2:] if re.match(r"  (loaded|worst|random|given) ", line)] == [
        "loaded",
        "worst",
        "random",
    ]
    assert "Given offsets" not in said
    assert "Given offsets" in say(capsys, "error four-bar.toml --samples 64 --offset J1=0.5,0")


def answers_of(said: str) -> dict[str, str]:
    """The answer to every question, in one line each, from what `error` prints first."""
    found: dict[str, str] = {}
    for line in said.split("\n\n")[1].splitlines():
        label = line[2:8].strip()
        if label:
            found[label] = ""
        found[[*found][-1]] += f"{line[8:].strip()} "
    return found


def test_questions_with_the_same_number_each_have_their_answer(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The load pushes the pin of the bar as far as it can be pushed: both errors are the clearance of 0.1 mm."""
    found = answers_of(say(capsys, "error redundant-bar.toml --samples 64"))
    assert found["loaded"].startswith("Largest position error: 0.1 mm; to blame: Q 100 %.")
    assert found["worst"].startswith("Largest position error: 0.1 mm; to blame: Q 100 %.")
    # What holds for all of them is said once.
    assert [("strained" in text) for text in found.values()] == [True, False, False]
    missed = answers_of(say(capsys, "error redundant-bar.toml --samples 64 -s 'limits={ position = 0.05 }'"))
    assert missed["loaded"].startswith("Limit missed: position 0.1 mm")
    assert missed["worst"].startswith("Limit missed: position 0.1 mm")


def test_the_answer_of_random_has_a_size_and_a_place_with_limits_too(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = answers_of(say(capsys, "error four-bar.toml --samples 1024"))
    result = jp.random(example("four-bar"), samples=1024)
    quantiles = result.error_quantile.sel(quantity="position", probability=0.95)
    k = int(quantiles.values.argmax())
    said = f"95 % of the specimens have a position error below {quantiles[k].item():.4g} mm at configuration {k} "
    assert found["random"].startswith("Outside the limits where offsets scatter: none")
    assert "Outside the limits where the load decides the offsets: none" in found["random"]
    assert said in found["random"]
    assert "of the variance" in found["random"]


def test_a_comparison_says_what_is_to_blame_in_both(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each has sources that the other one does not have."""
    for question in ("worst", "loaded", "random"):
        compared = jp.compare(
            example("four-bar"), example("p3r"), question, **({"samples": 64} if question == "random" else {})
        )
        sizes = [s.text for s in conclude(from_dataset(compared)).sentences if s.text.startswith("Largest")]
        assert sizes[0].count("of the variance" if question == "random" else "to blame") == 2


def test_small_shares_are_written_without_an_exponent(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = say(capsys, "error four-bar.toml -q random --samples 4096")
    assert "95 % confidence 0 to 900 ppm" in " ".join(said.split())


def test_no_column_is_without_a_name(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = " ".join(say(capsys, "allocate press.toml --curve 0.5:1.5:2").split())
    assert "in all rows: ." not in said
    assert "infeasible" in say(capsys, "allocate press.toml --curve 0.25,1")


# --- tables that fit -------------------------------------------------------------------------------------------------


def column(name: str, cells: str, **more: object) -> Column:
    return Column(name, "mm", tuple(cells.split()), **more)  # type: ignore[arg-type]


def test_what_is_the_same_in_all_rows_is_a_note() -> None:
    table = ResultTable(
        "t", (column("#", "0 1", is_key=True), column("x", "0.00 0.00"), column("y", "3.1 3.1"), column("z", "1 2"))
    )
    fit = fitted(table, 80)
    assert [c.name for c in fit.blocks[0]] == ["#", "z"]
    assert fit.notes == ("Zero in all rows: x.", "The same in all rows: y 3.1 mm.")


def test_a_table_of_which_nothing_would_be_left_stays() -> None:
    table = ResultTable("t", (column("#", "0 1", is_key=True), column("x", "3 3")))
    assert [c.name for c in fitted(table, 80).blocks[0]] == ["#", "x"]


def test_the_least_needed_columns_go_first_and_all_shows_them_in_blocks() -> None:
    wide = [column(f"column_{k}", "11111111111 2", spare=k) for k in range(10)]
    table = ResultTable("t", (column("#", "0 1", is_key=True), *wide))
    fit = fitted(table, 60)
    assert [c.name for c in fit.blocks[0]][1:] == [f"column_{k}" for k in range(4)]
    assert fit.notes[-1].startswith("Not shown: column_4, column_5")
    every = fitted(table, 60, every=True)
    assert [c.name for block in every.blocks for c in block if c.name != "#"] == [c.name for c in wide]
    assert all(block[0].name == "#" for block in every.blocks)
    assert not every.notes


def test_names_that_tell_rows_apart_are_not_cut_to_the_same() -> None:
    names = [f"a_very_long_name_of_a_leg_{k}_of_the_platform" for k in range(3)]
    table = ResultTable("t", (Column("source", "", tuple(names), left=True, is_key=True), column("size", "1 2 3")))
    assert len(set(fitted(table, 30).blocks[0][0].cells)) == 3


def test_long_paths_keep_their_ends_and_the_rows_around_every_extreme() -> None:
    rng = np.random.default_rng(0)
    for count in (17, 40, 500):
        figures = [rng.normal(size=count) for _ in range(2)]
        marks = ["" if k != count // 3 else "singular" for k in range(count)]
        rows = chosen_rows(count, figures, marks)
        assert len(rows) == len(set(rows)) == MOST_ROWS
        assert {0, count - 1, count // 3} <= set(rows)
        for figure in figures:
            top = int(figure.argmax())
            assert {max(top - 1, 0), top, min(top + 1, count - 1)} <= set(rows)


def test_all_prints_every_row(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = "error four-bar.toml -q worst -s 'drives.theta1={ joint = \"J1\", from = 20, to = 80, count = 40 }'"
    rows = [re.findall(r"^ +(\d+) +\d+\.\d", say(capsys, line + more), re.MULTILINE) for more in ("", " --all")]
    assert [len(found) for found in rows] == [MOST_ROWS, 40]
    assert "Not shown: 28 of 40 rows" in say(capsys, line)


@pytest.mark.parametrize("name", ["four-bar", "3-upu", "stewart-gough", "slider-crank-cases"])
def test_no_two_columns_have_one_name(name: str) -> None:
    m = example(name)
    for result in (jp.worst(m), jp.random(m, samples=64), jp.loaded(m), jp.compensate(m), jp.solve(m), jp.check(m)):
        for table in tables(from_dataset(result)):
            names = [(c.name, c.unit) for c in table.columns]
            assert len(set(names)) == len(names)


def test_a_pipe_is_eighty_wide_and_columns_is_minded(folder: Path) -> None:
    environment = {key: text for key, text in os.environ.items() if key != "COLUMNS"}
    line = [sys.executable, "-m", "jointplay", "solve", "stewart-gough.toml"]
    widths = [
        max(map(len, subprocess.run(line, env=environment | more, capture_output=True, text=True).stdout.splitlines()))
        for more in ({}, {"COLUMNS": "60"}, {"COLUMNS": "200"})
    ]
    assert widths[0] <= 80
    assert widths[1] <= 60
    assert 80 < widths[2] <= 200


# --- colours ---------------------------------------------------------------------------------------------------------


def printed(monkeypatch: pytest.MonkeyPatch, no_color: str | None = None, *, terminal: bool = True) -> str:
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color is not None:
        monkeypatch.setenv("NO_COLOR", no_color)
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=terminal, color_system="truecolor" if terminal else None, width=80)
    status = Column("status", "", ("ok", "singular"), left=True, alarms=(1,))
    table = ResultTable("t", (column("#", "0 1", is_key=True), numbers("x", "mm", [1.0, 2.0]), status))
    answer = Answer("", (Sentence("Limit missed.", is_alarm=True), Sentence("All else is well.")))
    show("Title", [answer], [table], console)
    return stream.getvalue()


def test_what_is_not_ok_has_a_colour_where_there_are_some(monkeypatch: pytest.MonkeyPatch) -> None:
    """The words are the same with and without."""
    plain, coloured = printed(monkeypatch, terminal=False), printed(monkeypatch)
    assert "\x1b" not in plain
    assert ANSI.sub("", coloured) == plain
    vermilion = "38;2;213;94;0"
    assert [ANSI.sub("", line).split()[-1] for line in coloured.splitlines() if vermilion in line] == [
        "missed.",
        "singular",
    ]
    assert vermilion not in printed(monkeypatch, "1")


# --- figures ---------------------------------------------------------------------------------------------------------


def test_the_figure_is_complete_where_the_reader_of_the_tables_leaves(folder: Path) -> None:
    pytest.importorskip("matplotlib")
    line = f"{sys.executable} -m jointplay error four-bar.toml -q worst --plot a.svg | head -1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert len(done.stdout.splitlines()) == 1
    assert Path("a.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")


def test_figures_are_drawn_before_tables_are_printed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    before: list[str] = []
    monkeypatch.setattr("jointplay.plot.draw", lambda *_: before.append(capsys.readouterr().out))
    assert "Worst case" in say(capsys, "error four-bar.toml -q worst --plot a.svg")
    assert before == [""]


# --- help and Tab ----------------------------------------------------------------------------------------------------


def test_summaries_of_the_commands_are_whole(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    listed = say(capsys, "--help").partition("Commands:")[2]
    assert set(re.findall(r"^  (\S+)", listed, re.MULTILINE)) == {*LINES}
    assert "..." not in listed
    assert max(map(len, listed.splitlines())) <= 80


@pytest.mark.whole
@pytest.mark.parametrize("command", LINES)
def test_examples_in_the_help_of_a_command_work(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A server would go on until Ctrl-C.
    monkeypatch.setattr("jointplay.show.serving.server.Server.serve_forever", lambda _: None)
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    text = say(capsys, f"{command} --help").partition("Examples:")[2]
    assert max(map(len, text.splitlines())) <= 80
    for line in LINES[command]:
        assert f"  {line}" in text
        Path("four-bar.toml").unlink() if line == "jointplay new four-bar" else None
        say(capsys, line.removeprefix("jointplay "))


def offered(line: str, shell: str = "bash") -> list[str]:
    """What the shell offers at the end of a line."""
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1), "_TYPER_COMPLETE_ARGS": line}
    environment = {**os.environ, **words, "_JOINTPLAY_COMPLETE": f"complete_{shell}"}
    done = subprocess.run([sys.executable, "-m", "jointplay"], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_tab_completes_commands_files_examples_keys_and_sources(folder: Path) -> None:
    Path("sub").mkdir()
    Path("four-bar.toml").rename("sub/deep.toml")
    assert offered("jointplay sing") == ["singularities"]
    assert offered("jointplay error four") == ["four-bar-fits.toml", "four-legged-platform.toml"]
    assert offered("jointplay error ./sub/") == ["./sub/deep.toml"]
    assert offered("jointplay compare sub/deep.toml se") == ["serial-2r.toml", "serial-6r.toml"]
    assert offered("jointplay import ") == ["arm.urdf", "coupler.dxf", "pump.FCStd"]
    assert offered("jointplay new slider") == ["slider-crank", "slider-crank-cases"]
    assert "joints.J1.clearance.radial=" in offered("jointplay error sub/deep.toml --set joints.J1")
    assert offered("jointplay error sub/deep.toml --offset J1.") == ["J1.x=", "J1.y="]
    assert offered("jointplay error nowhere.toml --offset J") == []


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_are_told_how_to_complete(shell: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from jointplay.cli import main; main()", "--show-completion", shell],
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"_JOINTPLAY_COMPLETE=complete_{shell}" in done.stdout


# --- Python ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("question", sorted(QUESTIONS))
def test_a_question_that_is_asked_of_a_file_says_what_to_do(question: str) -> None:
    """A text, a path, and the content of a file."""
    ask = getattr(jp, question)
    more = {"compare": [example("p3r")], "sweep": ["title", ["a", "b"]], "plan": [2]}.get(question, [])
    more = [{}] if question in ("calibrate", "diagnose", "verify") else more
    for file in ("arm.toml", Path("arm.toml")):
        with pytest.raises(TypeError, match=r"is a Mechanism, .*; read the file first: jointplay\.load\('arm\.toml'\)"):
            ask(file, *more)
    with pytest.raises(TypeError, match=r"read the text first: jointplay\.loads\(text\)"):
        ask("format = 1\n", *more)


def test_dir_shows_what_the_manual_has() -> None:
    manual = Path(__file__).resolve().parents[2].joinpath("docs", "api.md").read_text(encoding="utf-8")
    assert dir(jp) == sorted(jp.__all__)
    assert dir(jp.examples) == ["names", "parameters", "text", "title"]
    assert all(f"jointplay.examples.{name}" in manual for name in dir(jp.examples))
    assert all(re.search(rf"^::: jointplay\.plot\.\S+\.{name}$", manual, re.MULTILINE) for name in dir(jp.plot))
    documented = str(inspect.getdoc(jp.Mechanism)).partition("Attributes")[2].partition("Raises")[0]
    attributes = re.findall(r"^(\w[\w, ]*) :", documented, re.MULTILINE)
    members = re.search(r"members: \[(.*)\]", manual[manual.index("jointplay.model.mechanism.Mechanism") :])
    assert members is not None
    names = {name for line in (*attributes, members[1]) for name in line.split(", ")}
    assert set(dir(example("four-bar"))) == names
    assert all(hasattr(example("four-bar"), name) for name in names)


def test_configurations_are_selected_by_the_only_drive_and_by_number() -> None:
    worst = jp.worst(example("four-bar"))
    at = worst.sel(theta1=40, method="nearest")
    assert at.configuration.item() == int(abs(worst.theta1.values - 40).argmin())
    assert worst.sel(configuration=3).theta1.item() == worst.theta1.values[3]
    # Results at other drive values, such as corrected ones, can still be compared.
    corrected = jp.worst(example("four-bar").with_({"drives.theta1.values": (worst.theta1.values + 0.3).tolist()}))
    assert (corrected.worst_position - worst.worst_position).sizes == {"configuration": 11}


SYMMETRIC = """
format = 1
units = { length = "mm", angle = "deg", force = "N" }
joints.A = { type = "revolute", on = { ground = [0, 0], arm = [0, 0] }, clearance = { radial = 0.05 } }
drives.turn = { joint = "A", values = [10, 47, 130, 211, 300], error = 0.1 }
output = { body = "arm", at = [100, 0] }
limits.position = 0.2
"""


def test_of_maxima_that_are_equal_to_rounding_every_part_names_the_first() -> None:
    """An arm errs as much wherever it points; the verdict named configuration 3 and the conclusion configuration 0."""
    found = jp.worst(jp.loads(SYMMETRIC))
    sizes = found.worst_position.values
    assert sizes.argmax() != 0
    np.testing.assert_allclose(sizes, sizes[0], rtol=1e-12)
    (sentence,) = verdict(from_dataset(found)).sentences
    assert "at configuration 0" in sentence
