"""Progress: one bar for what somebody waits for, where somebody looks, and nothing left of it."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from jointplay.analyses import loaded, random
from jointplay.basics import progress

Steps = list[tuple[int, int]]


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[tuple[str, Steps]]]:
    """Every bar that is shown on a terminal, with its steps."""
    found: list[tuple[str, Steps]] = []

    @contextmanager
    def shown(name: str) -> Iterator[Callable[[int, int], None]]:
        found.append((name, []))
        yield lambda done, total: found[-1][1].append((done, total))

    monkeypatch.setattr(progress, "_on_terminal", shown)
    # What pytest captures is put in place again when a test begins.
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=SimpleNamespace(isatty=lambda: True), modules={}))
    yield found
    jp.progress(True)


def test_a_question_shows_one_bar_until_it_is_done(bars: list[tuple[str, Steps]]) -> None:
    m = example("four-bar")
    jp.random(m, samples=64)
    jp.sweep(m, "joints.J1.clearance.radial", [0.5, 1.0], "worst")
    jp.map(m, "worst", grid={"theta1": {"from": 30, "to": 60, "count": 3}})
    assert [name for name, _ in bars] == ["random", "sweep", "map"]
    for name, steps in bars:
        assert steps, name
        # A map says what is done before each chunk.
        assert steps[-1][0] == steps[-1][1] or name == "map"
        assert steps == sorted(steps), name


def built() -> Iterator[tuple[str, Callable[[], object]]]:
    """What is asked of a machine that is loaded, corrected and measured."""
    m = example("five-bar").with_({"loads": None, "load_cases": None})
    as_drawn = jp.solve(m)
    places = {name: as_drawn.nominal.sel(component=name).values for name in ("x", "y")}
    table = {"configuration": [*range(len(places["x"]))], **places}
    limited, sigma = m.with_({"limits.position": 1.0}), {"length": 0.01}
    pushed = m.with_(
        {"load_cases": {"push": [{"force": [300, -500]}], "pull": [{"force": [-300, 500]}]}, "gravity": None}
    )
    both = {"configuration": [*range(5)] * 2, "load_case": ["push"] * 5 + ["pull"] * 5}
    both |= {name: [*places[name][:5]] * 2 for name in ("x", "y")}
    yield "loaded", lambda: jp.loaded(example("four-bar"))
    yield "compensate", lambda: jp.compensate(example("four-bar"))
    yield "compensate", lambda: jp.compensate(example("four-bar"), "worst")
    yield "compensate", lambda: jp.compensate(pushed, one_table=True)
    yield "calibrate", lambda: jp.calibrate(m, table, sigma=sigma)
    yield "plan", lambda: jp.plan(m, 3, columns=["x", "y"], sigma=sigma)
    yield "diagnose", lambda: jp.diagnose(pushed, both, sigma=sigma)
    yield "verify", lambda: jp.verify(limited, table, sigma=sigma)


def test_what_is_asked_of_one_machine_shows_how_far_it_is(bars: list[tuple[str, Steps]]) -> None:
    every = [*built()]
    for number, (name, ask) in enumerate(every, 1):
        ask()
        assert [one for one, _ in bars] == [one for one, _ in every[:number]]
        steps = bars[-1][1]
        assert steps, name
        assert steps == sorted(steps), name
        assert all(0 <= done <= total for done, total in steps), name


@pytest.mark.parametrize("name", ["four-bar-fits", "3-upu", "redundant-bar"])
def test_configurations_are_asked_in_parts_that_change_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    m = example(name)
    whole = loaded.compute(m)
    monkeypatch.setattr(loaded, "BATCH", 1)
    told: Steps = []
    parts = loaded.compute(m, progress=lambda *step: told.append(step))
    for variable, value in whole.data.items():
        found = parts.data[variable].values
        if value.values.dtype.kind == "f":
            # Many at once are rounded as one is but for the last digits; steps end where 1e-10 of a size is left.
            size = np.nanmax(np.abs(value.values), initial=0.0)
            np.testing.assert_allclose(found, value.values, rtol=1e-9, atol=1e-9 * size, err_msg=variable)
        elif variable != "iterations":
            np.testing.assert_array_equal(found, value.values, variable)
    assert told[-1][0] == told[-1][1]


def test_steps_without_a_known_end_never_reach_it() -> None:
    told: Steps = []
    step = progress.counting(lambda *two: told.append(two), 3)
    for _ in range(5):
        step()
    assert told == [(1, 3), (2, 3), (3, 4), (4, 5), (5, 6)]


def test_of_variants_each_is_shown(bars: list[tuple[str, Steps]]) -> None:
    m = example("four-bar")
    jp.compare(m, m, m, "random", samples=64)
    assert [name for name, _ in bars] == ["compare"] * 3


def test_who_does_not_want_it_sees_nothing(bars: list[tuple[str, Steps]], monkeypatch: pytest.MonkeyPatch) -> None:
    m = example("four-bar")
    jp.progress(False)
    jp.random(m, samples=64)
    jp.progress(True)
    # What others ask for is theirs to show.
    random.compute(m, 64)
    told: Steps = []
    random.compute(m, 64, progress=lambda *step: told.append(step))
    assert told
    monkeypatch.setattr(progress.sys.stderr, "isatty", lambda: False)
    jp.random(m, samples=64)
    assert bars == []
    with pytest.raises(TypeError, match="'shown' is True or False"):
        jp.progress("no")


def test_after_an_interrupt_there_is_a_next_bar(bars: list[tuple[str, Steps]]) -> None:
    m = example("four-bar")
    with pytest.raises(KeyboardInterrupt), progress.bar("first"):
        raise KeyboardInterrupt
    jp.random(m, samples=64)
    assert [name for name, _ in bars] == ["first", "random"]


def test_of_two_threads_one_shows_its_bar(bars: list[tuple[str, Steps]]) -> None:
    """Two bars on one terminal raised an error in the second question."""
    m = example("four-bar")
    with progress.bar("outer"):
        other = threading.Thread(target=lambda: jp.random(m, samples=64))
        other.start()
        other.join()
    assert [name for name, _ in bars] == ["outer"]


def test_a_notebook_has_a_line_that_is_empty_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []

    class Handle:
        def update(self, data: dict[str, Any], **_: object) -> None:
            lines.append(data["text/plain"])

    def display(data: dict[str, Any], **_: object) -> Handle:
        lines.append(data["text/plain"])
        return Handle()

    shell = SimpleNamespace(kernel=object())
    fake = SimpleNamespace(get_ipython=lambda: shell, display=SimpleNamespace(display=display))
    monkeypatch.setitem(sys.modules, "IPython", fake)
    monkeypatch.setitem(sys.modules, "IPython.display", fake.display)
    jp.random(example("four-bar"), samples=64)
    # Quiet below a second.
    assert lines == []
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "PAUSE", 0.0)
    jp.random(example("four-bar"), samples=64)
    assert lines[0].startswith("random: 1 of 22, 4 %, ")
    assert lines[-2].startswith("random: 22 of 22, 100 %, ")
    assert lines[-1] == ""


@pytest.mark.filterwarnings("ignore")
def test_a_kernel_shows_one_line_and_outlives_an_interrupt() -> None:
    """Long work in a real notebook: the line is written over and empty in the end, short work has none."""
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    cells = [
        "import os, signal, threading, jointplay as jp; m = jp.loads(jp.examples.text('delta'))",
        "_ = jp.random(m, samples=64)",
        "threading.Timer(2.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()\n"
        "try: jp.random(m, samples=50_000_000)\nexcept KeyboardInterrupt: print('stopped')",
        "print(m.title)",
    ]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(book, timeout=60, kernel_name="python3").execute()
    _, short, long, after = (cell.outputs for cell in book.cells)
    assert short == []
    assert [line.data["text/plain"] for line in long if line.output_type == "display_data"] in ([""], [])
    assert "stopped" in "".join(line.text for line in long if line.output_type == "stream")
    assert after[0].text == "Delta robot with universal joints and balls\n"
