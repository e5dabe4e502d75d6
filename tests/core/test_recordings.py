"""Recorded programs are kept for mechanisms of the same structure; answers do not depend on what is kept."""

import hashlib
import json
import multiprocessing
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import example
from jointplay import _core

#: enough configurations for the programs of `solve` and `loaded`
MANY = np.linspace(22.7, 76.39, 80).tolist()
#: bounds of what is kept: recordings, bytes
MOST, LARGEST = 256, 64 << 20


def answers(m: jp.Mechanism) -> dict[str, str]:
    """A digest of every question's answer."""
    found: dict[str, xr.Dataset] = {
        "solve": jp.solve(m),
        "random": jp.random(m, samples=300),
        "worst": jp.worst(m, starts=2),
        "loaded": jp.loaded(m),
        "first order": jp.loaded(m, exact=False),
    }

    def digest(answer: xr.Dataset) -> str:
        values = hashlib.sha1()
        for name in sorted(map(str, answer.variables)):
            values.update(name.encode() + np.ascontiguousarray(answer[name].values).tobytes())
        return values.hexdigest()

    return {question: digest(answer) for question, answer in found.items()}


def four_bar(**changes: Any) -> jp.Mechanism:
    """All lengths differ: equal numbers are shared, so that it is a matter of structure which of them are equal."""
    lengths = {"joints__J2__on__crank": [70, 0], "drives__theta1__values": MANY, "dimensions__l2__tolerance": 0.05}
    return example("four-bar", **{**lengths, **changes})


NUMBERS = {
    "nothing": {},
    "length": {"joints__J2__on__crank": [71, 0]},
    "place on the ground": {"joints__J4__on__ground": [-98, 0]},
    "clearance": {"joints__J3__clearance__radial": 0.4},
    "load": {"loads": [{"force": [0, -25], "moment": 0}]},
    "law": {"joints__J1__clearance__law": "boundary"},
    "drive values": {"drives__theta1__values": MANY[:70]},
    "deviation": {"dimensions__l2__deviation": 0.03},
    "error of the drive": {"drives__theta1__error": 0.01},
}

STRUCTURES = {
    "coordinate from zero": {"joints__J2__on__crank": [70, 3]},
    "equal lengths": {"joints__J2__on__crank": [75, 0]},
    "output elsewhere": {"output__at": [150, 20]},
    "direction of the load": {"loads": [{"force": [4, -10], "moment": 0}]},
}
#: two structures, the first of which has two sets of numbers
FEW = ["nothing", "length", "coordinate from zero", "direction of the load"]


COUNTED = """
import json, sys
from test_recordings import NUMBERS, STRUCTURES, answers, four_bar
from jointplay import _core

def count(changes):
    before = _core.recordings()[0]
    found = answers(four_bar(**changes))
    return _core.recordings()[0] - before, found

print(json.dumps({name: count(changes) for name, changes in ({"first": {}} | NUMBERS | STRUCTURES | NUMBERS).items()}))
"""

BOUNDED = """
import json
from itertools import islice, product
from test_recordings import four_bar
import jointplay as jp
from jointplay import _core

found = []
for a, b, c, d, e, f, g, h in islice(product((0, 0.25), repeat=8), 200):
    jp.random(four_bar(
        joints__J1__on={"ground": [a, b], "crank": [0, 0]},
        joints__J2__on={"crank": [70, c], "coupler": [d, e]},
        joints__J3__on={"coupler": [75, f], "rocker": [150, g]},
        output__at=[150, h],
        drives__theta1__values=[50.0],
    ), samples=2)
    found.append(_core.recordings())
print(json.dumps(found))
"""


def fresh(program: str, *arguments: str) -> Any:
    """What a new interpreter prints."""
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.append({str(here.parent)!r})\n{program}", *arguments],
        cwd=here,
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def counted() -> dict[str, Any]:
    """Programs recorded, and answers, one mechanism after the other."""
    return dict(fresh(COUNTED))


@pytest.mark.parametrize("change", NUMBERS)
def test_a_copy_with_other_numbers_records_nothing(counted: dict[str, Any], change: str) -> None:
    """A sweep over a length, a clearance or a load recorded and compiled the same programs for every value."""
    assert counted["first"][0] > 5
    assert counted[change][0] == 0


@pytest.mark.parametrize("change", STRUCTURES)
def test_a_copy_of_another_structure_is_recorded(counted: dict[str, Any], change: str) -> None:
    assert counted[change][0] > 0


@pytest.mark.parametrize("change", ["length", "equal lengths", "clearance", "coordinate from zero"])
def test_answers_are_those_of_a_fresh_interpreter(counted: dict[str, Any], change: str) -> None:
    """To the last bit, whatever was recorded before and in whatever order."""
    program = (
        "import json, sys, test_recordings as t; print(json.dumps(t.answers(t.four_bar(**json.loads(sys.argv[1])))))"
    )
    assert fresh(program, json.dumps((NUMBERS | STRUCTURES)[change])) == counted[change][1]


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("3-upu", {"joints.*.clearance.radial": 0.02}),
        ("redundant-bar", {"joints.*.clearance.radial": 0.07}),
        ("x-braced-square", {"joints.*.clearance.radial": 0.3}),
        ("rssr", {"joints.*.clearance.radial": 0.02}),
    ],
)
def test_repeated_questions_record_nothing(name: str, change: dict[str, Any]) -> None:
    m = example(name)
    jp.random(m, samples=200)
    before = _core.recordings()[0]
    jp.random(m.with_(change), samples=200)
    again = jp.random(m, samples=200)
    assert _core.recordings()[0] == before
    program = "import sys, test_recordings as t; print(t.repeated(sys.argv[1]))"
    assert fresh(program, name) == repeated(name) == json.loads(json.dumps(again["error_std"].values.tolist()))


def repeated(name: str) -> list[Any]:
    return list(jp.random(example(name), samples=200)["error_std"].values.tolist())


#: radii at which a leg of a robot in space stands
RADII = [301.3 + 1.3 * k for k in range(9)]

SWEPT = """
import json, sys
from test_recordings import RADII, swept
from jointplay import _core
found = []
for radius in (RADII if len(sys.argv) < 2 else [float(sys.argv[1])]):
    before = _core.recordings()[0]
    found.append((swept(radius), _core.recordings()[0] - before))
print(json.dumps(found))
"""


def swept(radius: float) -> list[Any]:
    """The scatter with a leg there."""
    m = example("3-upu", joints__base1__at=[radius, 1.7, 2.1])
    return list(jp.random(m, samples=200)["error_std"].values.tolist())


def test_a_sweep_over_a_length_in_space_records_once() -> None:
    """Constants that are equal in theory were equal to the last bit or not, as luck had it, and every length recorded.

    The order of elimination follows the sizes of the pivots: one of the lengths may ask for another order.
    """
    found = fresh(SWEPT)
    assert found[0][1] > 0
    assert sum(recorded > 0 for _, recorded in found[1:]) <= 1


def test_an_answer_of_a_sweep_in_space_is_that_of_a_fresh_interpreter() -> None:
    assert fresh(SWEPT, str(RADII[4]))[0][0] == fresh(SWEPT)[4][0]


def test_what_is_kept_is_bounded() -> None:
    """Of 200 structures, the recordings used last are kept."""
    found = fresh(BOUNDED)
    assert found[-1][0] >= 400
    assert max(kept for _, kept, _ in found) == MOST
    assert max(size for _, _, size in found) <= LARGEST


def test_threads_share_what_is_recorded() -> None:
    expected = [_found(change) for change in FEW]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(_found, FEW * 2)) == expected * 2


def _found(change: str) -> dict[str, str]:
    return answers(four_bar(**(NUMBERS | STRUCTURES)[change]))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_goes_on_with_what_is_kept() -> None:
    expected = [_found(change) for change in FEW]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(_found, FEW).get(timeout=60) == expected
