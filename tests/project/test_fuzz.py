"""Some cases of the fuzzers: whatever a file, a command or a map is, the answer is a result or one line, and soon."""

import sys
from collections.abc import Iterator
from contextlib import suppress
from random import Random

import pytest

from helpers.fuzz.__main__ import Worker
from helpers.fuzz.valid import valid
from jointplay.errors import JointplayError
from jointplay.model.mechanism import loads

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits and signals")
#: where the cases begin, how many groups of each kind there are, and how many cases are in a group
SEED = 11_000_000
GROUPS = {"raw": 3, "structured": 3, "valid": 3, "line": 4, "store": 1}
CASES = {"store": 4}
PAIRS = sorted(((kind, g) for kind, count in GROUPS.items() for g in range(count)), key=lambda pair: pair[1])


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    worker = Worker(limit=60)
    yield worker
    worker.close()


@pytest.mark.parametrize(("kind", "group"), PAIRS)
def test_no_traceback_no_crash_no_hang(worker: Worker, kind: str, group: int) -> None:
    """To look into a case: `python -m helpers.fuzz --case KIND NUMBER` in `tests`."""
    first = SEED + 10 * group
    for number in range(first, first + CASES.get(kind, 10)):
        assert not (problem := worker.run(kind, number)), f"--case {kind} {number}: {problem}"


def test_most_files_get_past_the_reader() -> None:
    """Nine of ten ended there, so that questions saw few of them."""
    read = 0
    for number in range(SEED, SEED + 40):
        with suppress(JointplayError):
            loads(valid(Random(f"valid {number}")).decode())
            read += 1
    assert read > 28


def test_a_hang_a_crash_and_a_traceback_are_found() -> None:
    """The fuzzers see what they look for."""
    worker = Worker(limit=0.001)
    assert worker.run("raw", 0).startswith("no answer after 0.001 s of work")
    worker = Worker(limit=60)
    assert worker.run("nothing", 0) == "the process died: 1"
    worker.close()
