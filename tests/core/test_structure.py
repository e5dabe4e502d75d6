"""A structure without drives is a mechanism, too: two equal bars on pins, loaded at their apex."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar


def _bars(radial: float) -> jp.Mechanism:
    b, play = planar(title="two bars"), jp.radial(radial)
    b.revolute("A", ground=(0, 0), left=(0, 0), clearance=play)
    b.revolute("B", ground=(100, 0), right=(0, 0), clearance=play)
    b.revolute("C", left=(80, 0), right=(80, 0), clearance=play)
    b.start("left", angle=50)
    b.start("right", angle=130)
    b.output(body="left", at="C")
    b.load(force=(0, -10))
    return b.mechanism()


def test_the_load_does_the_work_of_every_reaction_over_its_play() -> None:
    """By hand: each bar and so each pin carries N = P / (2 sin a), and P times the sag is the sum of r N."""
    result = jp.loaded(_bars(0.1))
    bar = 5.0 / math.sin(math.acos(50 / 80))
    assert result.status.values.tolist() == ["ok"]
    reactions = result.reaction.isel(configuration=0).values[:, :2]
    np.testing.assert_allclose(
        np.hypot(*reactions.T), bar, rtol=5e-3
    )  # at the pose that the play, 0.3 % of the span, allows
    sag = result.error_first_order.sel(component="y").item()
    assert sag == pytest.approx(-3 * 0.1 * bar / 10, rel=1e-12)


def test_all_questions_answer() -> None:
    m = _bars(0.1)
    path = jp.solve(m)
    assert path.sizes["configuration"] == 1
    assert path.nominal.sel(component="y").item() == pytest.approx(math.sqrt(80**2 - 50**2), abs=1e-9)
    worst, random = jp.worst(m), jp.random(m, samples=2000)
    assert random.failures.sel(outcome="ok").item() == 2000
    exact = worst.worst_position.item()
    # The apex is held by two rings of width 0.2 and 0.3 about the pins: their farthest common corner.
    corners = []
    for left in (79.9, 80.1):
        for right in (79.8, 80.2):
            x = (left**2 - right**2 + 100**2) / 200
            corners.append(math.hypot(x - 50, math.sqrt(left**2 - x**2) - math.sqrt(80**2 - 50**2)))
    assert exact == pytest.approx(max(corners), abs=1e-9)
