"""Threads: of a forked process, none at all, too many."""

import multiprocessing
import os
import subprocess
import sys
from typing import Any

import pytest

import jointplay as jp
from helpers.answers import example

#: as another user, for whom the system's limit of threads counts
WITHOUT_THREADS = """
import os, resource, signal, sys, threading
import numpy, xarray
import jointplay as jp
from jointplay import _core
from jointplay.result.build import version
jp.random, jp.worst, jp.examples
# Loads what it loads when it is first used, from places that the other user cannot read.
xarray.Dataset({"x": ("x", [1.0])})
version()
m = jp.loads(jp.examples.text("delta"))
os.setgid(12345)
os.setuid(12345)
resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
try:
    threading.Thread(target=print).start()
    print("a thread was started")
except RuntimeError:
    pass
for threads in (0, 3, 1024):
    print(repr(jp.random(m, samples=20_000, threads=threads)["error_std"][0, 0].item()))
print(repr(jp.worst(m).worst_position[0].item()))
signal.signal(signal.SIGALRM, signal.default_int_handler)
signal.setitimer(signal.ITIMER_REAL, 0.5)
try:
    jp.random(m, samples=10**9)
except KeyboardInterrupt:
    print("heard")
"""


def asked(threads: int) -> tuple[Any, ...]:
    """Some answers, by work on threads."""
    m = example("delta")
    scatter = jp.random(m, samples=20_000, threads=threads)
    return (scatter["error_std"].values.tolist(), jp.worst(m).worst_position.values.tolist())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    """Workers of multiprocessing, which forked by default, waited for ever for the threads of their parent."""
    before = [asked(threads) for threads in (0, 1, 3)]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        after = pool.map_async(asked, (0, 1, 3)).get(timeout=60)
        again = pool.map_async(asked, (0, 1, 3)).get(timeout=60)
    assert before == after == again
    assert asked(0) == before[0]


@pytest.mark.skipif(not hasattr(os, "setuid") or os.getuid() != 0, reason="only root becomes another user")
def test_where_no_thread_can_be_started_the_caller_works_alone() -> None:
    """A batch system that limits threads ended the process with a panic."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", WITHOUT_THREADS], env=environment, capture_output=True, text=True, timeout=60
    )
    assert run.stderr == ""
    m = example("delta")
    std = repr(jp.random(m, samples=20_000)["error_std"][0, 0].item())
    assert run.stdout.split() == [std, std, std, repr(jp.worst(m).worst_position[0].item()), "heard"]


@pytest.mark.parametrize(
    "threads", [-1, 1025, 2**63, 2**64, 10**5000], ids=["minus", "1025", "2^63", "2^64", "many digits"]
)
def test_a_number_of_threads_that_no_machine_has_is_refused(threads: int) -> None:
    """``threads=2**63`` started threads until the machine stood still."""
    with pytest.raises(jp.InputError, match=r"threads: .* is not a number of threads; 0 to 1024 are possible"):
        jp.random(example("four-bar"), samples=1000, threads=threads)


@pytest.mark.parametrize("threads", [True, 1.0, "2", None])
def test_a_number_of_threads_is_a_whole_number(threads: object) -> None:
    with pytest.raises(TypeError, match=r"random\(\): 'threads' is a whole number"):
        jp.random(example("four-bar"), samples=1000, threads=threads)  # type: ignore[arg-type]


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
@pytest.mark.parametrize("threads", [1, 5])
def test_the_environment_limits_the_threads(threads: int) -> None:
    """RAYON_NUM_THREADS once changed nothing, so that tests with other numbers of threads all ran with the same."""
    script = """
import os
import jointplay as jp
m = jp.loads(jp.examples.text("four-bar"))
before = len(os.listdir("/proc/self/task"))
jp.worst(m)
print(len(os.listdir("/proc/self/task")) - before)
"""
    environment = os.environ | {"RAYON_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    # One more looks for signals meanwhile.
    assert threads <= int(run.stdout) <= threads + 1
