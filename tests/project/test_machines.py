"""What holds here holds on other machines: a sample of what `make test-machines` runs in full."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MACHINES = re.findall(r'^  "([^"]*)"', (ROOT / "Makefile").read_text(), re.MULTILINE)
SAMPLE = (
    # An optimiser's word on its end was once taken here, which the last bits of another processor changed.
    "analyses/test_load_optimiser.py::test_loaded_is_the_pose_of_largest_work[stephenson-3]",
    "core/test_near_singular.py::test_loaded_is_the_pose_of_largest_work[stephenson-4-0.001]",
    "core/test_near_singular.py::test_samples_equal_the_plain_solver_on_every_width[watt-3-0.005]",
    "core/test_cones.py",
)


@pytest.mark.parametrize("machine", MACHINES)
def test_a_sample_holds_on_another_machine(machine: str) -> None:
    environment = os.environ | dict(pair.split("=", 1) for pair in machine.split())
    sample = [f"tests/{name}" for name in SAMPLE]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *sample],
        env=environment, cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-4000:] + run.stderr[-1000:]


def test_the_width_of_registers_is_taken_from_the_environment() -> None:
    show = [sys.executable, "-c", "from jointplay import _core; print(_core.simd())"]
    plain = subprocess.run(
        show, env=os.environ | {"JOINTPLAY_WIDTH": "plain"}, capture_output=True, text=True, check=True
    )
    assert plain.stdout.strip() == "plain"
    wrong = subprocess.run(
        show, env=os.environ | {"JOINTPLAY_WIDTH": "sse"}, capture_output=True, text=True, check=False
    )
    assert "unknown width 'sse': plain, avx2 or avx512" in wrong.stderr


#: the kernel of Linux refuses from now on to make memory executable that was writable
REFUSED = "import ctypes; refused = ctypes.CDLL(None).prctl(65, 1, 0, 0, 0) == 0; "
ASKED = """
import hashlib, pathlib
import jointplay as jp
result = jp.random(jp.loads(jp.examples.text("four-bar")), samples=30_000, seed=3)
maps = [line.split() for line in pathlib.Path("/proc/self/maps").read_text().splitlines()]
compiled = any(len(entry) == 5 and entry[1] == "r-xp" for entry in maps)
print(compiled, hashlib.sha256(repr(result.to_dict()["data_vars"]).encode()).hexdigest())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can be asked to refuse executable memory")
def test_where_memory_may_not_be_made_executable_programs_are_interpreted() -> None:
    def run(before: str) -> list[str]:
        call = [sys.executable, "-c", before + ASKED]
        return subprocess.run(call, capture_output=True, text=True, check=True).stdout.split()

    probe = subprocess.run([sys.executable, "-c", REFUSED + "raise SystemExit(not refused)"], check=False)
    if probe.returncode:
        pytest.skip("this kernel cannot refuse executable memory; Linux 6.3 and later can")
    freely, refused = run(""), run(REFUSED)
    width = [sys.executable, "-c", "from jointplay import _core; print(_core.simd())"]
    plain = subprocess.run(width, capture_output=True, text=True, check=True).stdout.strip() == "plain"
    assert freely[0] == str(not plain)
    assert refused == ["False", freely[1]]
