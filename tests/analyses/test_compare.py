"""Two mechanisms on one path: the second one is where the first one's drives have it, not where it passes once more."""

from __future__ import annotations

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.nominal import follow, nominal


@pytest.mark.parametrize("name", ["slider-crank", "press", "six-bar", "rssr", "geared-five-bar", "five-bar", "3-upu"])
def test_a_mechanism_beside_itself_has_the_same_errors(name: str) -> None:
    """Some pass a dead centre, behind which another pose has the output at the same place."""
    m = example(name)
    found = jp.compare(m, m, "worst", exact=False).worst_position_first_order.values
    assert np.isfinite(found).all()
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_with_other_lengths_it_stays_beside_the_drives_of_the_first() -> None:
    m = example("slider-crank")
    other = m.with_({"joints.wristpin.on.rod": [161, 0]})
    first = nominal(m)
    # The stroke is the same; only its ends may be out of reach.
    targets = first.output.copy()
    targets[:, 0] += 1e-3
    second = follow(other, targets, ("x",), first.drives)
    reached = second.status == 0
    assert reached.sum() > 0.9 * len(reached)
    assert np.abs(second.drives - first.drives)[reached].max() < 0.05
