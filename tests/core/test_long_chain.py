"""Chains of many loops stay on the batch engine, and give what circles give one loop after the other."""

import sys
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp

LOOPS = 1000
CRANK, COUPLER, PITCH = 0.05, 0.1, 0.1


@pytest.fixture(scope="module")
def mechanism() -> jp.Mechanism:
    benchmarks = str(Path(__file__).resolve().parents[2] / "benchmarks")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [benchmarks, *sys.path])
        from w5_chain import chain
    return jp.loads(chain(LOOPS))


def along(angle: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def last_crank(m: jp.Mechanism, offsets: np.ndarray, angle: float) -> np.ndarray:
    """Place of the last crank's end and its angle, the drive at `angle`, from the offsets of all pins (sample, xy)."""

    def pin(name: str) -> np.ndarray:
        return offsets[:, [m.parameters.index(f"{name}.{axis}") for axis in "xy"]]

    theta = np.full(len(offsets), angle)
    pivot = pin("G0")
    for k in range(LOOPS):
        coupler = pivot + CRANK * along(theta) + pin(f"A{k}")
        pivot = np.array([PITCH * (k + 1), 0.0]) + pin(f"G{k + 1}")
        # The end of the next crank: on its circle around the pivot, and on that of the coupler, moved by the last pin.
        to = coupler + pin(f"B{k}") - pivot
        far = np.hypot(*to.T)
        theta = np.arctan2(*to.T[::-1]) - np.arccos((far**2 + CRANK**2 - COUPLER**2) / (2 * CRANK * far))
    return np.column_stack([pivot + CRANK * along(theta), theta])


def test_samples_close_loop_by_loop(mechanism: jp.Mechanism) -> None:
    core, drives = mechanism.core, mechanism.drive_values[:1]
    poses = core.trace(drives)["poses"]
    found = core.random(drives, poses, 200, 5, np.array([0.5]), None, keep=True)
    assert found["fallbacks"].sum() == 0
    offsets = np.vstack([np.zeros((1, len(mechanism.parameters))), found["kept_parameters"].reshape(200, -1)])
    closed = last_crank(mechanism, offsets, float(drives[0, 0]))
    errors = found["kept_errors"].reshape(200, -1)
    # Places are known to some units of the last place of 100 m, and the angles of a thousand loops add up.
    np.testing.assert_allclose(errors, closed[1:] - closed[0], rtol=0, atol=1e-9 * np.abs(errors).max())


def test_a_load_that_turns_the_end_far_is_followed_on_lanes(mechanism: jp.Mechanism) -> None:
    core, drives = mechanism.core, mechanism.drive_values
    poses = core.trace(drives)["poses"]
    found = core.loaded(drives, poses)
    assert found["fallbacks"] == 0
    # More than the batch engine takes in one step.
    assert np.abs(found["error"][:, 2]).max() > 0.5
    closed = last_crank(
        mechanism, np.vstack([found["offset"][:1], np.zeros((1, len(mechanism.parameters)))]), drives[0, 0]
    )
    np.testing.assert_allclose(found["error"][0], closed[0] - closed[1], rtol=1e-9)
    # A single configuration is solved plainly.
    plain = core.loaded(drives[-1:], poses[-1:])
    for key in ("error", "offset", "reaction"):
        np.testing.assert_allclose(found[key][-1:], plain[key], rtol=0, atol=1e-9 * np.abs(plain[key]).max())
