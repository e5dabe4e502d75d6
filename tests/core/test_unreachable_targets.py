"""Targets of a path that the links cannot reach are answered within a bound of work, and the others all the same."""

import time

import jointplay as jp


def test_a_delta_whose_elbow_was_moved() -> None:
    """A typing error, 40 for 341.6: two targets are out of reach, and saying so took 13 s each.

    Step after step towards them ended at the edge of what can be assembled, each after a continuation of its own.
    """
    text = jp.examples.text("delta")
    moved = text.replace("[341.621886948181, -40,", "[40, -40,")
    assert moved != text
    begin = time.process_time()
    found = jp.solve(jp.loads(moved))
    assert time.process_time() - begin < 10
    assert found.status.values.tolist() == ["ok", "not_assembled", "not_assembled", "ok"]
