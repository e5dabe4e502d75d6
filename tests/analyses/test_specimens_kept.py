"""Specimens that are kept: `given` reproduces them, they are the ones that were counted, those outside are outside."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import jointplay as jp
from jointplay.analyses.nominal import nominal
from jointplay.analyses.subset import LOOSE
from jointplay.cli import run

NAMES = ("four-bar", "slider-crank", "delta-by-hand")


def example(name, **limits):
    m = jp.loads(jp.examples.text(name))
    return m.with_({f"limits.{key}": value for key, value in limits.items()}) if limits else m


@pytest.mark.parametrize("name", NAMES)
def test_given_reproduces_the_errors(name):
    m = example(name)
    result = jp.random(m, samples=64, keep=5, seed=4)
    for n in range(5):
        offsets = result.specimen_offset.sel(specimen=n)
        found = jp.given(m, offsets)
        assert_allclose(found.error, result.specimen_error.sel(specimen=n), atol=1e-9 * float(result.length))
    assert_array_equal(result.specimen_number, np.tile(np.arange(5), (result.sizes["configuration"], 1)))
    assert (result.specimen_status == "ok").all()
    again = jp.random(m, samples=64, keep=9, seed=4)
    assert_array_equal(again.specimen_error[:, :5], result.specimen_error)


def test_all_of_them_have_the_moments_of_the_result():
    result = jp.random(example("four-bar"), samples=256, keep=256)
    assert_allclose(result.specimen_error.mean("specimen"), result.error_mean, atol=1e-12)
    # Replicates of Sobol points have a denominator of their own.
    assert_allclose(result.specimen_error.std("specimen"), result.error_std, rtol=1e-3)


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
def test_those_outside_are_beyond_a_limit(contact):
    m = example("slider-crank", position=0.06)
    result = jp.random(m, samples=512, keep=512, keep_outside=True, contact=contact)
    every = jp.random(m, samples=512, keep=512, contact=contact)
    sizes = np.hypot(*every.specimen_error.sel(component=["x", "y"]).transpose("component", ...).values)
    beyond = sizes > 0.06
    assert beyond.any()
    assert_allclose(beyond.mean(axis=1), result.outside, atol=1e-12)
    for k, row in enumerate(beyond):
        numbers = result.specimen_number[k].values
        assert_array_equal(numbers[numbers >= 0], np.flatnonzero(row))
        assert_array_equal(result.specimen_error[k, : row.sum()], every.specimen_error[k].values[row])
        assert np.isnan(result.specimen_error[k, row.sum() :]).all()


@pytest.mark.parametrize("name", ["six-bar", "slider-crank-cases"])
def test_the_load_presses_them_side_by_side_where_it_presses_single_ones(name):
    m = example(name).first
    at = nominal(m).at(1)
    m = m.running_under(1, at.drives, at.poses)
    limits, options = m.limits.bounds(m.quantities), {"loaded": True, "partly": True, "sampling": "plain", "keep": True}
    # Two blocks of lanes, the second of them not full.
    found = m.core.random(at.drives, at.poses, 13, 5, np.array([0.5]), limits, None, 1, **options)
    parameters = found["kept_parameters"].reshape(13, -1)
    is_offset = np.array([m.source_kinds[s] in LOOSE for s, _ in m.core.parameters], dtype=bool)
    for u, error in zip(parameters, found["kept_errors"].reshape(13, -1), strict=True):
        known = np.where(is_offset, m.centre, u)[None]
        assert_allclose(m.core.loaded_specimens(at.drives, at.poses, known)["offset"][0], u, rtol=1e-9, atol=1e-15)
        assert_allclose(m.core.errors_of(at.drives, at.poses, u[None])[0], error, rtol=1e-9, atol=1e-12)
    assert len(np.unique(parameters, axis=0)) == 13


def test_an_over_constrained_mechanism():
    result = jp.random(example("redundant-bar"), samples=64, keep=64)
    shares = (result.specimen_status == "ok").mean("specimen")
    failures = result.failures.sel(outcome="ok") / 64
    assert_allclose(shares, failures)


def test_command_writes_them(tmp_path):
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    path = tmp_path / "specimens.csv"
    assert (
        run(["error", str(tmp_path / "m.toml"), "-q", "random", "--keep", "3", "--samples", "32", "-o", str(path)]) == 0
    )
    rows = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("specimen_error,")]
    assert len(rows) == 11 * 3 * 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"keep": -1}, "keep: "),
        ({"keep": 65}, "keep: "),
        ({"keep_outside": True}, "keep_outside: says which specimens are kept; keep says how many"),
        ({"keep": 2, "keep_outside": True}, "keep_outside: there is no limit to be outside of"),
        ({"keep": 2, "samples": 2**30}, "samples: 1073741824 is not a number of samples of which some are kept"),
    ],
)
def test_refused(options, words):
    m = jp.loads(jp.examples.text("p3r"))
    with pytest.raises(jp.InputError, match=words):
        jp.random(m, **{"samples": 64, **options})
