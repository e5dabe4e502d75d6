"""Configurations whose joints are a quarter of a turn from those of the first."""

import numpy as np

import jointplay as jp
from jointplay.analyses.nominal import nominal


def test_they_are_solved_on_lanes_like_all_others() -> None:
    """At 90 degrees a pivot vanished that had been chosen at 0: every climb and specimen went to the plain solver,
    which took twenty times as long."""
    m = jp.loads(jp.examples.text("arm-with-gearboxes"))
    m = m.with_({f"drives.q{k}.stiffness": None for k in range(1, 7)})
    at = nominal(m)
    assert np.ptp(at.drives, axis=0).max() >= np.pi / 2
    assert not m.core.worst(at.drives, at.poses, 4)["fallbacks"].any()
    for loaded in (False, True):
        found = m.core.random(at.drives, at.poses, 64, 1, np.array([0.5]), loaded=loaded)
        assert not found["fallbacks"].any()
    # Which configurations are asked beside it makes no difference but rounding.
    together, alone = (m.core.worst(at.drives[k], at.poses[k], 4) for k in (slice(None), slice(3, None)))
    np.testing.assert_allclose(together["position"][3:], alone["position"], rtol=1e-9)
    np.testing.assert_allclose(together["component"][3:], alone["component"], rtol=1e-9)
