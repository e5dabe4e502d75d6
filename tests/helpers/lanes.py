"""Many configurations and specimens at once, by recorded programs, beside the same one by one."""

from typing import Any

import numpy as np

from helpers.couplings import OK


def require_lanes_as_one_by_one(core: Any, drives: np.ndarray, poses: np.ndarray) -> None:
    """Load, samples and worst case are those of the plain solver, to which nothing is left."""
    for exact in (True, False):
        together = core.loaded(drives, poses, exact=exact)
        assert together["fallbacks"] == 0
        for k in (0, len(drives) // 2, len(drives) - 1):
            alone = core.loaded(drives[k : k + 1], poses[k : k + 1], exact=exact)
            for name in ("error", "error_first_order", "offset", "contribution"):
                np.testing.assert_allclose(together[name][k], alone[name][0], atol=1e-12, err_msg=name)
            np.testing.assert_allclose(together["reaction"][k], alone["reaction"][0], rtol=1e-9, atol=1e-9)
            assert together["status"][k] == alone["status"][0] == OK
    drawn = core.random(drives[:1], poses[:1], 640, 7, np.array([0.5]), keep=True)
    assert drawn["fallbacks"][0] == 0
    given = core.given(np.repeat(drives[:1], 640, 0), np.repeat(poses[:1], 640, 0), drawn["kept_parameters"])
    np.testing.assert_allclose(drawn["kept_errors"], given["error"], atol=1e-12)
    worst, plain = core.worst(drives[:1], poses[:1]), core.worst(drives[:1], poses[:1], lanes=False)
    for name in ("position", "component"):
        np.testing.assert_allclose(worst[name], plain[name], atol=1e-12)
    # No sample is beyond the worst case.
    lengths = given["error"][:, : 2 if poses.shape[-1] == 3 else 3]
    assert np.linalg.norm(lengths, axis=1).max() <= worst["position"][0] * (1 + 1e-9)
