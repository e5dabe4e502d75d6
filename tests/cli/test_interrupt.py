"""Ctrl-C is heard within a second wherever the time goes, and what is done until then is told."""

import gc
import signal
import sys
import threading
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.processes import worked, working
from jointplay.analyses.nominal import Interrupted
from jointplay.cli import run

#: seconds within which Ctrl-C is to be heard, of the processor: a busy machine may take longer
HEARD = 1.0


@contextmanager
def ctrl_c(after: float) -> Iterator[dict[str, float]]:
    """Ctrl-C after some seconds, by an alarm; tells how much of the processor's time went by until it was heard."""
    spent: dict[str, float] = {}

    def handler(*_: object) -> None:
        spent["since"] = time.process_time()
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, handler)
    # Python swallows what is raised within a callback of the garbage collector, and Hypothesis installs one.
    gc.disable()
    signal.setitimer(signal.ITIMER_REAL, after)
    try:
        yield spent
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        gc.enable()
        signal.signal(signal.SIGALRM, before)
        spent["cpu"] = time.process_time() - spent.get("since", time.process_time())


def platform(legs: int) -> jp.Mechanism:
    """The platform on four elastic legs with as many as asked, for a search as long as wanted."""
    data: dict[str, Any] = tomllib.loads(jp.examples.text("four-legged-platform"))
    data["joints"] = {name: data["joints"][name] for name in ("slide", "gimbal")}
    data["bodies"], data["dimensions"] = {}, {}
    for k, turn in enumerate(np.linspace(0, 2 * np.pi, legs, endpoint=False)):
        x, y = 200 * np.cos(turn), 150 * np.sin(turn)
        foot = {"type": "universal", "bodies": ["ground", f"leg{k}"], "axes": [[1, 0, 0], [0, 1, 0]]}
        top = {"type": "spherical", "bodies": [f"leg{k}", "platform"], "clearance": {"radial": 0.02}}
        data["joints"] |= {f"foot{k}": foot | {"at": [x, y, 0]}, f"top{k}": top | {"at": [x, y, 300]}}
        data["bodies"][f"leg{k}"] = {"E": 210000, "area": 60}
        data["dimensions"][f"leg{k}"] = {"body": f"leg{k}", "between": [f"foot{k}", f"top{k}"], "tolerance": 0.02}
    return jp.Mechanism(data)


@pytest.mark.parametrize(
    ("question", "name", "after", "options"),
    [
        ("random", "four-bar", 1.0, {"samples": 10**10}),
        ("random", "delta", 1.0, {"samples": 10**8, "contact": "loaded"}),
        ("random", "four-legged-platform", 1.0, {"samples": 10**8}),
        # While starts are made, and while they are climbed: eleven seconds if nobody interrupts.
        ("worst", "stewart-gough", 0.2, {"starts": 10_000}),
        ("worst", "stewart-gough", 2.0, {"starts": 10_000}),
        ("worst", "platform on 40 legs", 0.3, {}),
    ],
)
def test_a_question_is_interrupted_within_a_configuration(
    question: str, name: str, after: float, options: dict[str, Any]
) -> None:
    """``random --samples 1000000000`` and ``delta --contact loaded`` did not listen for more than a minute."""
    m = platform(40) if name == "platform on 40 legs" else example(name)
    jp.check(m)
    with ctrl_c(after) as spent, pytest.raises(KeyboardInterrupt):
        getattr(jp, question)(m, **options)
    assert spent["cpu"] < HEARD


def test_samples_until_the_interruption_are_told_with_their_number() -> None:
    m = example("four-bar")
    with ctrl_c(1.5), pytest.raises(KeyboardInterrupt) as stopped:
        jp.random(m, samples=10**10)
    assert isinstance(stopped.value, Interrupted)
    partial = stopped.value.partial
    (drawn,) = partial.get("failures").sum(axis=1).tolist()
    assert 1000 < drawn < 10**10
    assert partial.attrs["incomplete"] == (
        f"interrupted after 1 of 11 configurations, the last with {drawn:,} of 10,000,000,000 samples"
    )
    # They are samples like any: the first ones of the same units.
    whole = jp.random(m, samples=100_000)
    np.testing.assert_allclose(partial.get("error_std")[0], whole["error_std"][0], rtol=0.02)
    assert (partial.get("histogram").sum(axis=-1) == drawn).all()


def test_configurations_until_the_interruption_are_those_of_an_undisturbed_run() -> None:
    m = example("four-bar").with_({"drives.theta1.values": np.linspace(20.0, 100.0, 20_000)})
    with ctrl_c(4.0), pytest.raises(KeyboardInterrupt) as stopped:
        jp.worst(m, starts=300)
    assert isinstance(stopped.value, Interrupted)
    partial = stopped.value.partial
    done = len(partial.get("status"))
    assert 0 < done < 20_000
    assert partial.attrs["incomplete"] == f"interrupted after {done} of 20000 configurations"


def test_what_nobody_interrupts_goes_on_when_another_thread_was() -> None:
    """The main thread alone hears Ctrl-C; work of other threads goes on to its end."""
    m = example("delta")
    found: list[Any] = []
    other = threading.Thread(target=lambda: found.append(jp.random(m, samples=1_000_000)))
    other.start()
    with ctrl_c(0.5), pytest.raises(KeyboardInterrupt):
        jp.random(m, samples=10**10)
    other.join()
    assert (found[0].failures.sum("outcome") == 1_000_000).all()


def test_other_signals_raise_what_their_handler_raises() -> None:
    def handler(*_: object) -> None:
        raise TimeoutError("too long")

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(TimeoutError, match="too long"):
            jp.random(example("four-bar"), samples=10**10)
    finally:
        signal.signal(signal.SIGALRM, before)
    # And nothing is left of it.
    assert jp.random(example("four-bar"), samples=1000).failures.sum() == 11_000


def test_a_handler_may_ask_a_question_itself() -> None:
    found: list[float] = []
    m = example("four-bar")
    before = signal.signal(signal.SIGALRM, lambda *_: found.append(jp.worst(m).worst_position[0].item()))
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        jp.random(m, samples=5_000_000)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert found == [jp.worst(m).worst_position[0].item()]


def test_the_command_tells_what_is_done(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(jp.examples.text("four-bar"))
    with working(["error", str(path), "-q", "random", "--samples", "10000000000"]) as process:
        worked(process, 3.0)  # started for sure
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err == "interrupted; what is done:\n"
    assert "Interrupted after 1 of 11 configurations, the last with" in " ".join(out.split())
    assert "Traceback" not in err


def test_the_command_says_when_nothing_is_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended with exit code 130 and without a word."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("jointplay.cli.answer.mechanism", interrupted)
    for command in ("check", "error", "assemble", "singularities"):
        assert run([command, "four-bar.toml"]) == 130
        assert capsys.readouterr() == ("", "interrupted before there was anything to report\n")


@pytest.mark.parametrize(
    ("parts", "words", "sizes"),
    [
        (0.3, "interrupted after 3 of 8 configurations, load case {0}, output {1}", (1, 1, 3)),
        (2.3, "interrupted after 2 of 3 load cases, output {1}", (1, 2, 8)),
        (3.3, "interrupted after 1 of 2 outputs", (1, 3, 8)),
    ],
)
def test_what_is_done_of_several_outputs_and_load_cases_is_kept(
    parts: float, words: str, sizes: tuple[int, int, int]
) -> None:
    """Ctrl-C in the first of several outputs kept nothing, although its configurations were done."""
    from jointplay.analyses.random import compute
    from jointplay.result.table import tables

    m = jp.loads(jp.examples.text("slider-crank-cases"))
    assert len(m.outputs) == 2
    assert len(m.load_cases) == 3

    def stop(done: int, total: int) -> None:
        if done >= parts * total / 6:
            raise KeyboardInterrupt

    options: dict[str, Any] = {"samples": 300, "contact": "loaded", "progress": stop}
    with pytest.raises(Interrupted) as stopped:
        compute(m, **options)
    partial = stopped.value.partial
    assert partial.attrs["incomplete"] == words.format(m.load_cases[0], m.outputs[0])
    assert tuple(partial.sizes[dim] for dim in ("output", "load_case", "configuration")) == sizes
    whole = jp.random(m, samples=300, contact="loaded")
    known = partial.get("error_mean")
    np.testing.assert_array_equal(known, whole.error_mean.values[: sizes[0], : sizes[1], : sizes[2]])
    assert tables(partial)


#: commands that ask a question again and again, which have nothing to tell before the first answer of their own
ASKING = {
    "allow": ["allow", "m.toml", "-q", "random", "--samples", "100000000"],
    "life": ["life", "m.toml", "-q", "random", "--samples", "100000000", "-s", "joints.J3.wear.growth=1e-6"],
    "sweep": ["sweep", "m.toml", "-s", "drives.theta1.error=0.1,0.2", "-q", "random", "--samples", "1000000000"],
    "compare": ["compare", "m.toml", "m.toml", "-q", "random", "--samples", "1000000000"],
    "map": ["map", "m.toml", "-g", "theta1=20:60:3", "-q", "random", "--samples", "1000000000"],
}


@pytest.mark.parametrize("name", ASKING)
def test_part_of_a_question_that_another_asks_is_not_its_answer(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``allow -q random`` printed what the first of its many questions had, and ended in a traceback: exit code 1."""
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("four-bar", {"limits.position": "4"}))
    with ctrl_c(0.7):
        assert run(ASKING[name]) == 130
    assert capsys.readouterr() == ("", "interrupted before there was anything to report\n")


def test_the_worst_case_that_given_begins_with_is_not_its_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("stewart-gough"))
    monkeypatch.setattr("jointplay.analyses.worst.compute", partly(jp.examples.text("stewart-gough")))
    assert run(["error", "m.toml", "-q", "given"]) == 130
    assert capsys.readouterr() == ("", "interrupted before there was anything to report\n")


def partly(text: str) -> Any:
    """A question that is interrupted when it has a part of its answer."""
    from jointplay.analyses.worst import compute

    part = compute(jp.loads(text))

    def interrupted(*_: Any, **__: Any) -> Any:
        raise Interrupted(part)

    return interrupted


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("SIGTERM", ["animate", "m.toml", "-o", "a.gif", "--frames", "2000"], "before there was anything to report\n"),
        ("SIGTERM", [*ASKING["allow"][:4], "--samples", "100000000", "-o", "r.nc"], "anything to report\n"),
        ("SIGHUP", ["error", "m.toml", "-q", "random", "--samples", "10000000000", "-o", "r.nc"], "done is written\n"),
    ],
)
def test_whoever_asks_for_an_end_leaves_nothing_half_written(
    name: str, words: list[str], said: str, tmp_path: Path
) -> None:
    """SIGTERM, as a batch system sends it, left an empty ``.jointplay-XXXX`` behind, and nothing of what was done."""
    number = getattr(signal, name)
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    with working(words, tmp_path) as process:
        worked(process, 2.0)
        process.send_signal(number)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number
    assert err.endswith(said)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.toml", *(["r.nc"] if "written" in said else [])]
