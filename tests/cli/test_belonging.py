"""An option that no question heard was dropped without a word: who typed --certify read a result without bounds."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.analyses.questions import options_of
from jointplay.cli import run
from jointplay.questions import asked_by

ARM = planar()
ARM.revolute("J1", ground=(0, 0), arm=(0, 0), clearance=jp.radial(0.05))
ARM.drive("q", joint="J1", values=[10])
ARM.output(body="arm", at=(200, 0))
ARM.target(dwell={"of": "y"})
ARM.load(force=(0, -20))
#: options with a value, and the argument of a question that hears them
OPTIONS = {
    ("--certify",): "certify",
    ("--certify", "--parts", "3"): "parts",
    ("--samples", "16"): "samples",
    ("--seed", "1"): "seed",
    ("--law", "boundary"): "law",
    ("--sampling", "plain"): "sampling",
    ("--contact", "loaded"): "contact",
    ("--offset", "J1=0.01,0"): "offsets",
    ("--sizes", "largest"): "sizes",
    ("--first-order",): "exact",
    ("--no-details",): "details",
    ("--corrects", "given"): "corrects",
    ("--target", "0.1,0.1"): "target",
}
COMMANDS = {
    "error": [],
    "map": ["-g", "q=0:10:2"],
    "sweep": ["-s", "joints.J1.clearance.radial=0.1:0.2:2"],
    "compare": ["arm.toml"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_is_heard_or_refused(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(ARM.text())
    for question in asked_by(command):
        known = options_of(question)
        for option, argument in OPTIONS.items():
            code = run([command, "arm.toml", *COMMANDS[command], "-q", question, *option])
            said = capsys.readouterr().err
            if "No such option" in said:
                continue
            # With offsets `error` asks for the errors that they give as well.
            heard = argument in known or (command == "error" and argument == "offsets")
            assert (code != 2) == heard, (question, option, said)
            assert heard or f"{option[0].replace('--no-', '--')}: is an option of " in said


def test_an_option_that_counts_with_another_one_is_refused_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Who typed --parts without --certify got no bounds and no word."""
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(ARM.text())
    for typed, said in {
        "error arm.toml -q worst --parts 5": "--parts: goes with --certify",
        "map arm.toml -g q=0:10:2 -q worst --parts 5": "--parts: goes with --certify",
        "map arm.toml -g q=0:10:2 --overwrite": "--overwrite: says what may be replaced; -o says where",
    }.items():
        assert run(typed.split()) == 2
        assert said in capsys.readouterr().err
    m = jp.load("arm.toml")
    asks: dict[str, Callable[[], object]] = {
        "parts: goes with certify=True": lambda: jp.worst(m, parts=5),
        "starts: goes with exact=True": lambda: jp.worst(m, exact=False, starts=5),
        "seed: goes with question='random'": lambda: jp.allocate(m, seed=5),
        "law: goes with question='random'": lambda: jp.assemble(m, law="normal"),
        "overwrite: goes with a path": lambda: jp.map(m, "worst", {"q": [0, 10]}, overwrite=True),
        "csv_dialect: goes with a path": lambda: jp.save(jp.solve(m), "a.json", csv_dialect="semicolon"),
    }
    for said, ask in asks.items():
        with pytest.raises(jp.InputError, match=said):
            ask()
    for ask_through in (jp.allow, partial(jp.compare, m), partial(jp.map, grid={"q": [0, 10]})):
        with pytest.raises(jp.InputError, match="parts: goes with certify=True"):
            ask_through(m, question="worst", parts=5)


def test_a_specimen_of_an_assembly_has_no_seed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(ARM.text())
    assert run(["assemble", str(path), "--seed", "3"]) == 2
    assert "--seed: is an option of random; asked: unit" in capsys.readouterr().err
