"""Numbers that make no sense beside the others are refused, and those that do are taken."""

import itertools
import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jointplay as jp
from helpers.answers import EXAMPLES, OVER_CONSTRAINED, example
from jointplay.cli import run


@pytest.mark.parametrize(
    ("name", "key", "value", "said"),
    [
        # 42 s, and "76 degrees of freedom"
        ("four-legged-platform", "joints.top1.at", [-2e8, -1.5e8, 3e8], "joints.top1: lies 3.905e+08 mm from"),
        ("serial-6r", "dimensions.*.tolerance", 5e7, "by up to 5e+07 mm, more than the size of the mechanism, 687."),
        ("serial-6r", "joints.elbow.clearance.radial", 5e7, "joints.elbow.clearance: is off by up to 5e+07 mm"),
        ("five-bar", "drives.left.error", {"sigma": 1e7}, "drives.left.error: is off by up to 3e+07 deg"),
        ("antenna-support", "dimensions.AB.deviation", -1e6, "dimensions.AB: is off by up to 1e+06 mm"),
        ("antenna-support", "joints.A.angle.tolerance", 400, "joints.A.angle: is off by up to 400 deg"),
    ],
)  # fmt: skip
def test_what_is_larger_than_the_mechanism_is_refused(name: str, key: str, value: Any, said: str) -> None:
    with pytest.raises(jp.InputError) as refusal:
        example(name).with_({key: value})
    assert said in str(refusal.value)
    assert refusal.value.file == f"{name}.toml"


@pytest.mark.parametrize("name", [*EXAMPLES, *OVER_CONSTRAINED])
def test_any_size_is_taken(name: str) -> None:
    """From micromechanics to cranes: what counts is one length beside another."""
    text = jp.examples.text(name)
    # A fit is one of ISO 286, which ends at half a metre.
    text = re.sub(r'\{ fit = "[^"]+", diameter = \d+ \}', "{ radial = 0.02 }", text)
    for unit in ("um", "m"):
        if f'length = "{unit}"' not in text:
            jp.loads(text.replace('length = "mm"', f'length = "{unit}"'))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_a_clearance_as_large_as_the_mechanism_is_taken(share: float) -> None:
    m = example("four-bar")
    size = 150.0
    assert jp.check(m.with_({"joints.*.clearance.radial": share * size})).attrs["assembled"] == 1


def test_drives_are_commanded_to_many_turns() -> None:
    m = example("slider-crank")
    values = np.arange(30.0, 30.0 + 360 * 50, 120.0)
    found = jp.worst(m.with_({"drives.theta": {"joint": "main", "error": 0.05, "values": values}}), starts=4)
    assert found.worst_position[-3].item() == pytest.approx(found.worst_position[0].item(), rel=1e-6)


def test_short_links_beside_long_ones_are_taken() -> None:
    """A body of a tenth of a millimetre in a mechanism of a hundred metres has its degrees of freedom."""
    short, long = 0.1, 1e5
    text = f"""
        format = 1
        units = {{ length = "mm", angle = "deg", force = "N" }}
        joints.A = {{ type = "revolute", on = {{ ground = [0, 0], crank = [0, 0] }} }}
        joints.B = {{ type = "revolute", on = {{ crank = [{short}, 0], rod = [0, 0] }} }}
        joints.D = {{ type = "prismatic", bodies = ["ground", "slide"], at = [0, 0], axis = [1, 0] }}
        drives.theta = {{ joint = "A", values = [90] }}
        output = {{ body = "slide", at = [0, 0] }}
        start.slide = {{ x = {long}, y = 0 }}
        start.crank = {{ angle = 90 }}
        [joints.C]
        type = "revolute"
        on = {{ rod = [{long}, 0], slide = [0, 0] }}
        clearance = {{ radial = 0.01 }}
    """
    m = jp.loads(text)
    assert jp.check(m).attrs["determinate"] == 1
    assert jp.worst(m).worst_position.item() == pytest.approx(0.01, rel=1e-3)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(["four-bar", "five-bar", "slider-crank"]), st.floats(5e-324, 1e-290))
def test_numbers_next_to_zero_are_as_good_as_zero(name: str, tiny: float) -> None:
    """Numbers so small that their squares vanish neither hang nor warn."""
    m = example(name).with_({"joints.*.clearance.radial": tiny})
    assert not (np.abs(jp.worst(m).worst_component) >= 1.0).any()
    assert np.abs(jp.given(m).error).max() < 1.0


@pytest.mark.parametrize(
    "arguments",
    [
        "compensate m.toml --target 1e300,0",
        "compensate m.toml --target nan,0",
        "compensate m.toml --offset J1=1e308,1e308",
        "compensate m.toml --weights 1e308,1",
        "error m.toml -q random --samples 1000000000000000000000",
        "error m.toml -q random --seed -1",
        "error m.toml -q random --seed 18446744073709551616",
        "sweep m.toml -s joints.J1.clearance.radial=0:1e300:3",
        "sweep m.toml -s joints.J1.clearance.radial=0:1:1000000",
        "map m.toml -g theta1=0:1:1000000000000",
        "map m.toml -g theta1=1e300,2e300",
        "singularities m.toml --length 1e300",
        "singularities m.toml --length 1e-300",
        "assemble m.toml -q random --samples 1000000000",
        "assemble m.toml -c 1000000000000000000000000",
    ],
)
@pytest.mark.filterwarnings("error")
def test_numbers_of_commands_are_bounded_like_those_of_the_file(
    arguments: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An offset of 1e308 gave warnings of NumPy, and a target of 1e300 was corrected with exit code 0."""
    monkeypatch.chdir(tmp_path)
    steps = '[assembly]\nsteps = [["crank"], ["coupler", "rocker"]]\n'
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar") + steps)
    assert run(arguments.split()) == 2
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err.startswith("error: ")
    assert said.err.count("\n") == 1


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda m: jp.given(m, {"J1": [1e308, 1e308]}), "J1: 1e+308 is too large; numbers go up to 1e+12"),
        (lambda m: jp.given(m, np.full(len(m.parameters), 1e300)), "offsets: 1e+300 is too large"),
        (lambda m: jp.given(m, np.full(len(m.parameters), math.inf)), "offsets: has values that are not finite"),
        (lambda m: jp.given(m, {"J1.x": 10**400}), "J1.x: is too large; numbers go up to 1e+12"),
        (lambda m: jp.compensate(m, target=[1e300, 0.0]), "target: 1e+300 is too large"),
        (lambda m: jp.worst(m, starts=10**6), "starts: 1000000 is not a number of starts; 1 to 10000 are possible"),
        (lambda m: jp.worst(m, starts=0), "starts: 0 is not a number of starts; 1 to 10000 are possible"),
        (
            lambda m: jp.random(m, probabilities=np.full(10**6, 0.5)),
            "probabilities: up to 1000 numbers between 0 and 1",
        ),
        (lambda m: jp.sweep(m, "joints.J1.clearance.radial", itertools.count()), "more than 100000 values"),
        (
            lambda m: jp.map(m, "solve", {"theta1": [0, 1]}, chunk=2**64),
            "chunk: 18446744073709551616 is not a number of nodes; 1 to",
        ),
    ],
)
def test_numbers_of_functions_are_bounded(call: Any, said: str) -> None:
    with pytest.raises(jp.InputError) as refusal:
        call(example("four-bar"))
    assert said in str(refusal.value)


def test_what_is_no_number_is_repeated_in_short() -> None:
    with pytest.raises(jp.InputError, match=r'J1.x: "a{56}... is not a number or an array of numbers$'):
        jp.given(example("four-bar"), {"J1.x": "a" * 3000})


def test_a_grid_of_too_many_nodes_is_refused_with_their_number() -> None:
    axis = {"from": 0, "to": 1, "count": 100_000}
    m = example("five-bar")
    with pytest.raises(jp.InputError, match=r"grid: 1e\+10 nodes; up to 1e\+09 are possible"):
        jp.map(m, "solve", {"x": axis, "y": axis})
