"""Work in further processes: the same answers in the same order, whatever becomes of the processes."""

import math
import operator
from collections.abc import Iterator

import pytest

from jointplay.analyses.processes import Processes


@pytest.fixture
def adding() -> Iterator[Processes]:
    found = Processes(operator.add, (1.0,), 2)
    yield found
    found.close()


def test_answers_have_the_order_of_the_items(adding: Processes) -> None:
    assert adding.each([5.0, 1.0, 3.0]) == [6.0, 2.0, 4.0]
    assert len(adding._running) == 2
    assert adding.each([]) == []
    assert adding.each([0.5] * 7) == [1.5] * 7


def test_a_process_that_ends_is_no_loss(adding: Processes) -> None:
    adding.each([1.0, 2.0])
    adding._running[1].kill()
    adding._running[1].wait()
    for _ in range(2):
        assert adding.each([1.0, 2.0, 3.0]) == [2.0, 3.0, 4.0]
    assert adding._running == []


def test_what_fails_there_fails_here() -> None:
    roots = Processes(math.sqrt, (), 2)
    with pytest.raises(ValueError, match="math domain error"):
        roots.each([4.0, -1.0, 9.0])
    assert roots.each([4.0, 9.0]) == [2.0, 3.0]
    roots.close()
    assert roots._running == []
