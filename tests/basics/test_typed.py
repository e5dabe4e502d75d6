"""Arguments of the wrong type are refused at the door, by name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import example
from jointplay.basics.typed import typed
from jointplay.result import from_dataset

HUGE = 10**5000
#: things that stand where something else should; huge counts of what takes long are not among them
WRONG: dict[str, Any] = {
    "None": None,
    "text": "text",
    "empty": "",
    "a list": [1, 2],
    "an empty list": [],
    "a list of lists": [[1.0], [2.0, 3.0]],
    "a table": {"a": 1},
    "a table of numbers": {1: 2},
    "nan": float("nan"),
    "inf": float("inf"),
    "1e300": 1e300,
    "-1": -1,
    "0": 0,
    "True": True,
    "an object": object(),
    "many digits": HUGE,
    "2^64": 2**64,
    "complex": 1 + 2j,
    "bytes": b"bytes",
    "a set": {"x"},
    "an array": np.zeros((2, 3, 4)),
    "an array of nothing": np.zeros(0),
    "an array of words": np.array(["a", "b"]),
    "an array of objects": np.array([None, {}], dtype=object),
    "nan's in an array": np.full(3, np.nan),
    "a class": int,
    "a function": len,
}
#: one way to call each of the public functions right
ROOT = Path(__file__).resolve().parents[2]
M = example("four-bar", assembly={"steps": [["crank"], ["coupler", "rocker"]]})
PRESS = example("press")
#: one configuration, no limits: quickly asked everything
SHORT = example("slider-crank").with_({"drives": {"theta": {"joint": "main", "values": [30.0]}}, "limits": None})
#: one unknown, and readings of it
TOLERANT = SHORT.with_({"drives.theta.error": 0.1, "output": {"body": "crank"}, "outputs": None, "loads": None})
READ = {"configuration": [0], "angle": [30.05]}
#: the same of a machine that is pushed and pulled
PUSHED = example("five-bar", load_cases={"push": [{"force": [0, -60]}], "pull": [{"force": [0, 60]}]})
PUSHED_READ = {"configuration": [0, 0], "load_case": ["push", "pull"], "x": [-60.0, -60.1]}
ARM = example("serial-2r")
STRAIGHT = M.with_(target={"line": {"fit": True}})
GRID = {"theta1": [30.0, 40.0]}


def functions() -> Iterator[tuple[str, Callable[..., Any], dict[str, Any]]]:
    worst = jp.worst(M)
    yield "animate", jp.animate, {"m": SHORT, "path": "moving.html", "frames": 2}
    yield "allocate", jp.allocate, {"m": PRESS, "question": "worst"}
    yield "allow", jp.allow, {"m": M, "tolerance": 0.1}
    yield "assemble", jp.assemble, {"m": M, "samples": 10}
    yield "best_order", jp.best_order, {"m": M}
    yield "plan", jp.plan, {"m": TOLERANT, "count": 1, "columns": ["angle"], "sigma": {"angle": 0.1}}
    yield "diagnose", jp.diagnose, {"m": PUSHED, "measured": PUSHED_READ, "sigma": {"length": 0.1}}
    yield "verify", jp.verify, {"m": TOLERANT, "measured": READ, "sigma": {"angle": 0.1}}
    yield "calibrate", jp.calibrate, {"m": TOLERANT, "measured": READ, "sigma": {"angle": 0.1}}
    yield "as_built", jp.as_built, {"m": TOLERANT, "result": jp.calibrate(TOLERANT, READ, sigma={"angle": 0.1})}
    yield "design", jp.design, {"m": M, "vary": {"output.at.0": [149, 150]}, "aim": "size", "evaluations": 2}
    yield "structural", jp.structural, {"m": STRAIGHT}
    yield "check", jp.check, {"m": M}
    yield "compare", jp.compare, {"a": M, "b": M, "question": "loaded"}
    yield "compensate", jp.compensate, {"m": M}
    yield "export", jp.export, {"m": M, "path": "here.dxf"}
    yield "forces", jp.forces, {"m": M, "of": ["joints.J1"]}
    yield "frame", jp.frame, {"result": worst}
    yield "table", jp.table, {"result": worst}
    yield "given", jp.given, {"m": M}
    yield "life", jp.life, {"m": M.with_({"joints.J3.wear": {"growth": 1e-6}}), "tolerance": 0.1}
    yield "load", jp.load, {"path": "none.toml"}
    yield "loads", jp.loads, {"text": jp.examples.text("four-bar")}
    yield "loaded", jp.loaded, {"m": M}
    yield "map", jp.map, {"m": M, "question": "solve", "grid": GRID}
    yield "progress", jp.progress, {"shown": True}
    yield "random", jp.random, {"m": M, "samples": 10}
    yield "read", jp.read, {"path": ROOT / "docs" / "robots" / "arm.urdf"}
    yield "region", jp.region, {"m": M, "directions": 3}
    yield "report", jp.report, {"m": SHORT, "path": "page.html", "samples": 16}
    yield "save", jp.save, {"result": worst, "path": "here.csv"}
    yield "sensitivity", jp.sensitivity, {"m": M}
    yield "singularities", jp.singularities, {"m": M, "path": False}
    yield "solve", jp.solve, {"m": M}
    yield "sweep", jp.sweep, {"m": M, "key": "joints.J1.clearance.radial", "values": [0.1], "question": "solve"}
    yield "view", jp.view, {"m": SHORT}
    yield "workspace", jp.workspace, {"m": ARM, "count": 5}
    yield "worst", jp.worst, {"m": M, "starts": 1}
    yield "Mechanism", jp.Mechanism, {"raw": dict(M.raw)}
    yield "Builder", jp.Builder, {"space": "planar", "units": {}}
    # Their first parameter has no name for the caller, because a key of a clearance may have it.
    yield "backlash", lambda size: jp.backlash(size), {}
    yield "bearing", lambda group: jp.bearing(group), {}
    yield "diametral", lambda size: jp.diametral(size), {}
    yield "fit", lambda classes: jp.fit(classes), {}
    yield "gap", lambda size: jp.gap(size), {}
    yield "radial", lambda size: jp.radial(size), {}
    yield "Mechanism.value", M.value, {"key": "title"}
    yield "Mechanism.with_", M.with_, {"changes": {}}
    yield "examples.title", jp.examples.title, {"name": "four-bar"}
    yield "examples.parameters", jp.examples.parameters, {"name": "four-bar"}
    yield "examples.text", jp.examples.text, {"name": "four-bar"}
    yield "plot.assembly", jp.plot.assembly, {"m": M, "result": jp.assemble(M)}
    yield "plot.blame", jp.plot.blame, {"result": worst}
    yield "plot.check_path", jp.plot.check_path, {"path": Path("here.svg")}
    yield "plot.draw", jp.plot.draw, {"m": M, "results": {"worst": from_dataset(worst)}, "path": Path("here.svg")}
    yield "plot.error", jp.plot.error, {"results": worst}
    yield "plot.histogram", jp.plot.histogram, {"result": jp.random(M, 100)}
    yield "plot.mechanism", jp.plot.mechanism, {"m": M}


CALLS = {name: (function, right) for name, function, right in functions()}
EVERY = [
    (name, parameter)
    for name, (function, _) in CALLS.items()
    for parameter, kind in inspect.signature(function).parameters.items()
    # What a function that is handed in makes of its arguments is its own affair.
    if kind.kind is not inspect.Parameter.VAR_KEYWORD and parameter != "progress"
]


@pytest.mark.parametrize(("name", "parameter"), EVERY, ids=[f"{n}-{p}" for n, p in EVERY])
def test_anything_at_all_is_taken_or_refused_by_name(
    name: str, parameter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``jp.load(None)`` and ``samples="10"`` ended in errors from inside, or went through."""
    monkeypatch.chdir(tmp_path)
    function, right = CALLS[name]
    for what, value in WRONG.items():
        said = ""
        try:
            function(**{**right, parameter: value})
        except TypeError as error:
            said = str(error)
        except jp.InputError:
            continue
        assert not said or f"'{parameter}'" in said, f"{what}: {said}"


def test_every_public_function_is_called() -> None:
    there = {name for name in jp.__all__ if callable(getattr(jp, name)) and not name.endswith("Error")}
    assert there <= set(CALLS)


@pytest.mark.parametrize("name", ["sweep", "compare", "map"])
@pytest.mark.parametrize(
    ("options", "part"),
    [
        (
            {"foo": 1},
            "'foo' is not an option of random: samples, seed, law, contact, sampling, probabilities, indices, threads",
        ),
        ({"at": None}, "'at' is not an option of random"),
        ({"samples": "10"}, "random(): 'samples' is a whole number, not of type str"),
        ({"law": 3}, "random(): 'law' is text or None, not of type int"),
    ],
)
def test_options_of_a_question_are_checked_as_the_question_does(name: str, options: dict[str, Any], part: str) -> None:
    """An unknown option was an error of a function that nobody had called."""
    function, right = CALLS[name]
    with pytest.raises(TypeError) as refusal:
        function(**{**right, "question": "random", **options})
    assert part in str(refusal.value)


def is_same(some: xr.Dataset, other: xr.Dataset) -> bool:
    """Whether two results are the same, however the options were written."""
    return bool(some.assign_attrs(options="").identical(other.assign_attrs(options="")))


def test_numbers_of_numpy_are_numbers() -> None:
    m = example("four-bar")
    plain = jp.random(m, 1000, 3, probabilities=[0.5])
    assert is_same(plain, jp.random(m, np.int32(1000), np.uint64(3), probabilities=np.array([0.5])))
    plain = jp.compensate(m, weights=(1.0, 50.0), target=[0.1, 0.2])
    assert is_same(plain, jp.compensate(m, weights=(np.float32(1.0), np.int8(50)), target=np.array([0.1, 0.2])))


def test_one_component_may_stand_by_itself() -> None:
    m = example("3-rrr")
    assert is_same(jp.singularities(m, components="x", path=False), jp.singularities(m, components=["x"], path=False))


def test_signature_and_documentation_stay() -> None:
    def plain(m: int, *, word: str | None = None) -> str:
        """What it does."""
        return f"{m}{word}"

    door = typed(plain)
    assert inspect.signature(door) == inspect.signature(plain)
    assert (door.__doc__, door.__name__, door.__wrapped__) == (plain.__doc__, "plain", plain)  # type: ignore[attr-defined]
    assert door(3, word="s") == "3s"
    for wrong in ({}, {"m": 1, "n": 2}):
        with pytest.raises(TypeError) as refusal:
            door(**wrong)
        with pytest.raises(TypeError) as own:
            plain(**wrong)
        assert str(refusal.value) == str(own.value)
