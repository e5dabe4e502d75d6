"""The batch engine against the plain solver: same numbers on every width of vector registers, for any
number of threads."""

import numpy as np
import pytest

from jointplay import _core, examples, model

WIDTHS = ["plain", "avx2", "avx512"]
WITH_DRIVES = [name for name in examples.names() if model.loads(examples.text(name, {}), name).drive_values is not None]


@pytest.fixture(autouse=True)
def _widest_again():
    yield
    _core.simd("avx512")


def _dense_path(mechanism, count):
    """The example's drive values, filled in between."""
    values = mechanism.drive_values
    at = np.linspace(0, len(values) - 1, count)
    return np.column_stack([np.interp(at, np.arange(len(values)), column) for column in values.T])


@pytest.mark.parametrize("name", WITH_DRIVES)
def test_samples_equal_the_plain_solver_on_every_width(name):
    mechanism = model.loads(examples.text(name, {}), name)
    core, drives = mechanism.core, mechanism.drive_values[:1]
    poses = core.solve(drives)["poses"]
    count = 1000  # not a whole number of blocks

    def draw(threads):
        return core.random(drives, poses, count, 3, np.array([0.5]), np.nan, np.nan, threads=threads, keep=True)

    results = []
    for width in WIDTHS:
        _core.simd(width)
        results += [draw(1), draw(2)]
    first = results[0]
    for other in results[1:]:
        for key, value in first.items():
            assert np.array_equal(value, other[key], equal_nan=True), key
    assert first["fallbacks"].sum() == 0
    given = core.given(np.repeat(drives, count, 0), np.repeat(poses, count, 0), first["kept_parameters"])
    # Relative to the size of the mechanism: rounding of positions does not shrink with the clearances.
    difference = np.abs(given["error"] - first["kept_errors"]) / [mechanism.length, mechanism.length, 1.0]
    assert difference.max() < 1e-13


@pytest.mark.parametrize("name", WITH_DRIVES)
def test_loaded_equals_the_plain_solver_on_every_width(name):
    mechanism = model.loads(examples.text(name, {}), name)
    if not mechanism.has_loads:
        pytest.skip("no load")
    core, drives = mechanism.core, _dense_path(mechanism, 130)
    poses = core.solve(drives)["poses"]
    results = []
    for width in WIDTHS:
        _core.simd(width)
        results.append(core.loaded(drives, poses))
    for other in results[1:]:
        for key, value in results[0].items():
            assert np.array_equal(value, other[key], equal_nan=True), key
    # Few configurations at a time are solved plainly.
    parts = [core.loaded(drives[i : i + 1], poses[i : i + 1]) for i in range(len(drives))]
    scales = {
        "error": [mechanism.length, mechanism.length, 1.0],
        "error_first_order": [mechanism.length, mechanism.length, 1.0],
    }
    for key in ("error", "error_first_order", "undetermined", "reaction", "offset", "contribution", "status"):
        plain = np.concatenate([part[key] for part in parts])
        scale = scales.get(key, max(float(np.max(np.abs(plain))), 1e-300))
        assert np.max(np.abs(plain - results[0][key]) / scale) < 1e-12, key


@pytest.mark.parametrize("name", WITH_DRIVES)
def test_traced_poses_equal_the_plain_path(name):
    mechanism = model.loads(examples.text(name, {}), name)
    core, drives = mechanism.core, _dense_path(mechanism, 400)
    traced = core.trace(drives)
    # Fewer rows than a block are followed one by one; full turns in between are not lost.
    parts = [core.solve(np.vstack([drives[:1], drives[i : i + 40]]))["poses"][1:] for i in range(0, 400, 40)]
    difference = np.abs(traced["poses"] - np.concatenate(parts)) / [mechanism.length, mechanism.length, 1.0]
    assert difference.max() < 1e-13
    assert np.array_equal(traced["poses"], core.solve(drives)["poses"])
