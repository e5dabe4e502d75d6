"""Shares outside the limits, capabilities, yields and repeatability, against counts and formulas of their own."""

import math

import numpy as np
import pytest
from scipy import stats

import jointplay as jp
from helpers.answers import example
from helpers.arms import ARM
from jointplay.analyses.nominal import nominal
from jointplay.analyses.yields import with_sizes
from jointplay.basics import confidence
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude
from jointplay.result.table.notes import notes


@pytest.mark.parametrize("samples", [1, 5, 100, 2000, 100_000])
def test_intervals_are_those_of_clopper_and_pearson(samples: int) -> None:
    """Against the beta quantiles of scipy; k = 0 and k = n have one side."""
    counts = np.unique([0, 1, 2, samples // 10, samples // 3, samples // 2, samples - 1, samples])
    counts = counts[(counts >= 0) & (counts <= samples)].astype(float)
    low, high = confidence.of_counts(counts, np.full(len(counts), float(samples)))
    for k, a, b in zip(counts, low, high, strict=True):
        assert a == pytest.approx(stats.beta.ppf(0.025, k, samples - k + 1) if k else 0.0, rel=1e-8)
        assert b == pytest.approx(stats.beta.ppf(0.975, k + 1, samples - k) if k < samples else 1.0, rel=1e-8)


def test_an_interval_covers_the_share_as_often_as_it_says() -> None:
    """By the binomial distribution itself: the intervals of all counts that contain p have at least 95 % of it."""
    for n, p in ((20, 0.1), (100, 0.02), (400, 0.003)):
        counts = np.arange(n + 1.0)
        low, high = confidence.of_counts(counts, np.full(n + 1, float(n)))
        covered = (low <= p) & (p <= high)
        assert stats.binom.pmf(counts[covered], n, p).sum() >= 0.95


def test_intervals_of_replicates_are_those_of_student_and_never_nothing() -> None:
    shares = np.random.default_rng(1).normal(0.3, 0.01, 16)
    low, high = confidence.of_errors(shares.mean(), stats.sem(shares), 16, np.array(16_000))
    expected = stats.t.interval(0.95, 15, shares.mean(), stats.sem(shares))
    np.testing.assert_allclose([low, high], expected, rtol=1e-10)
    low, high = confidence.of_errors(np.zeros(()), np.zeros(()), 16, np.array(16_000))
    assert (float(low), float(high)) == (0.0, pytest.approx(stats.beta.ppf(0.975, 1, 16_000)))


def test_shares_outside_are_those_of_a_count_with_given() -> None:
    """The same specimens closed one by one by `given`, and compared with every limit."""
    m = example("four-bar-fits").with_({"limits": {"position": 0.03, "x": [-0.02, 0.01], "angle": {"high": 0.01}}})
    n = 2000
    result = jp.random(m, samples=n, seed=7, sampling="plain").isel(configuration=2)
    at = nominal(m)
    u = m.core.specimens(n, 7, None, "plain")
    found = m.core.given(np.repeat(at.drives[2:3], n, 0), np.repeat(at.poses[2:3], n, 0), u)
    x, y, angle = found["error"].T
    out = {
        "position": np.hypot(x, y) > 0.03e-3,
        "x": (x < -0.02e-3) | (x > 0.01e-3),
        "angle": angle > math.radians(0.01),
    }
    for quantity, beyond in out.items():
        assert float(result.outside_quantity.sel(quantity=quantity)) == beyond.mean()
    assert np.isnan(result.outside_quantity.sel(quantity=["y", "rotation"])).all()
    outside = np.logical_or.reduce(list(out.values()))
    assert 0 < outside.mean() < 1
    assert float(result.outside) == outside.mean()
    low, high = stats.binomtest(int(outside.sum()), n).proportion_ci(0.95, "exact")
    np.testing.assert_allclose([result.outside_low, result.outside_high], [low, high], rtol=1e-8)


def test_specimens_that_cannot_be_assembled_are_outside() -> None:
    """A yield that only counts what could be built would praise parts that do not fit together."""
    m = jp.loads(jp.examples.text("bennett")).with_({"limits.position": 1000.0})
    result = jp.random(m, samples=300)
    lost = 1.0 - result.failures.sel(outcome=["ok", "strained", "undetermined"]).sum("outcome") / 300
    np.testing.assert_allclose(result.outside, lost, atol=1e-12)


def test_capability_of_a_normal_length() -> None:
    """A length with one normal source: Cp = (U - L) / 6 sigma and Cpk = (U - mean) / 3 sigma, as in closed form."""
    sigma = 0.01
    m = ARM.with_({"limits": {"x": [-0.03, 0.05]}})
    result = jp.random(m, samples=400_000).isel(configuration=0)
    cp, cpk = (float(result[name].sel(quantity="x")) for name in ("cp", "cpk"))
    errors = [float(result[f"{name}_standard_error"].sel(quantity="x")) for name in ("cp", "cpk")]
    assert 0.0 < errors[0] < 0.05 * cp
    # The quantiles of the definition are three standard deviations away, to six digits.
    assert cp == pytest.approx(0.08 / (6 * sigma), abs=4 * errors[0])
    assert cpk == pytest.approx(0.03 / (3 * sigma), abs=4 * errors[1])
    assert np.isnan(result.cp.sel(quantity=["y", "position", "rotation"])).all()


def test_standard_errors_of_capabilities_are_their_scatter() -> None:
    """Of forty seeds; position has its upper side only."""
    m = example("four-bar-fits").with_({"drives.theta1.values": [40]})
    found = [jp.random(m, samples=5_000, seed=seed).isel(configuration=0) for seed in range(40)]
    for name, quantity in (("cp", "y"), ("cpk", "y"), ("cpk", "position")):
        values = np.array([float(r[name].sel(quantity=quantity)) for r in found])
        said = np.mean([float(r[f"{name}_standard_error"].sel(quantity=quantity)) for r in found])
        assert 0.6 < values.std(ddof=1) / said < 1.5


def test_capabilities_of_sobol_points_have_their_own_standard_errors() -> None:
    """By the replicates. They were those of plain samples, a sixth too large for these points."""
    m = example("four-bar-fits").with_({"drives.theta1.values": [40]})
    said = {
        sampling: [
            float(jp.random(m, 16_384, seed, sampling=sampling).cp_standard_error[0].sel(quantity="y"))
            for seed in range(20)
        ]
        for sampling in ("sobol", "plain")
    }
    assert np.mean(said["sobol"]) < 0.95 * np.mean(said["plain"])


def test_few_specimens_have_no_capability() -> None:
    assert np.isnan(jp.random(example("four-bar-fits"), samples=700).cpk).all()


def test_repeatability_is_that_of_iso_9283() -> None:
    """Mean and three standard deviations of the distances to the barycentre, of poses closed by `given`."""
    m = example("serial-2r")
    result = jp.random(m, samples=3000, seed=3)
    at = nominal(m)
    drawn = m.core.specimens(3000, 3, None, "plain")
    clearances = np.array([m.source_kinds[s] == "clearance" for s in m.parameter_source])
    u = np.where(clearances, drawn, m.centre)
    k = 4
    found = m.core.given(np.repeat(at.drives[k : k + 1], 3000, 0), np.repeat(at.poses[k : k + 1], 3000, 0), u)
    places = found["error"][:, :2] / m.units.length
    distances = np.hypot(*(places - places.mean(axis=0)).T)
    expected = distances.mean() + 3.0 * distances.std(ddof=1)
    assert float(result.repeatability[k]) == pytest.approx(expected, rel=1e-6)
    again = [float(jp.random(m, samples=3000, seed=seed).repeatability[k]) for seed in range(30)]
    assert 0.6 < np.std(again, ddof=1) / float(result.repeatability_standard_error[k]) < 1.5


def test_yield_over_the_path_is_a_count_over_configurations() -> None:
    """Independent draws of offsets at every configuration, closed by `given`; sizes stay those of a specimen."""
    m = example("four-bar-fits").with_({"limits": {"position": 0.035}, "drives.theta1.values": [30, 50, 70]})
    n = 1500
    at, inside = nominal(m), np.ones(n, bool)
    sizes = m.core.specimens(n, 11, None, "plain")
    rng = np.random.default_rng(5)
    middle = 0.5 * (16 + 61) / 2 * 1e-6
    for k in range(len(at)):
        u = sizes.copy()
        for j in range(1, 5):
            parts = [m.parameters.index(f"J{j}.{part}.size") for part in ("hole", "pin")]
            gap = middle + (sizes[:, parts[0]] - sizes[:, parts[1]]) / 2.0
            angle, share = rng.uniform(0, 2 * np.pi, n), np.sqrt(rng.uniform(0, 1, n))
            for part, name in ((np.cos(angle), "x"), (np.sin(angle), "y")):
                u[:, m.parameters.index(f"J{j}.{name}")] = gap * share * part
        found = m.core.given(np.repeat(at.drives[k : k + 1], n, 0), np.repeat(at.poses[k : k + 1], n, 0), u)
        inside &= np.hypot(found["error"][:, 0], found["error"][:, 1]) <= 0.035e-3
    result = jp.random(m, samples=20_000)
    share = inside.mean()
    assert float(result.yield_path) == pytest.approx(share, abs=4.5 * math.sqrt(share * (1 - share) / n))
    assert float(result.yield_path) < float(1 - result.outside.max())
    assert float(result.yield_path_low) < float(result.yield_path) < float(result.yield_path_high)


def test_yield_wherever_the_play_lies_is_that_of_the_worst_case_of_every_specimen() -> None:
    """Specimen by specimen against `worst`, with the sizes of the specimen fixed in the file."""
    m = example("four-bar-fits").with_({"limits": {"position": 0.066}, "drives.theta1.values": [30, 70]})
    held = 0
    drawn = m.core.specimens(40, 0, None, "plain")
    for u in drawn:
        changes = {}
        for j in range(1, 5):
            hole, pin = (u[m.parameters.index(f"J{j}.{part}.size")] for part in ("hole", "pin"))
            changes[f"joints.J{j}.clearance"] = {
                "radial": (0.5 * (16 + 61) / 2 * 1e-6 + (hole - pin) / 2.0) / m.units.length
            }
        held += bool(jp.worst(m.with_(changes), starts=6).limit_met.all())
    result = jp.random(m, samples=40)
    assert 0 < held < 40
    assert round(40 * float(result.yield_specimen)) == held


@pytest.mark.parametrize("limit", [1.6, 1.667, 1.669, 1.8])
def test_of_specimens_that_differ_in_their_offsets_only_one_stands_for_all(limit: float) -> None:
    """Its worst play is that of `worst`: all keep to the limit or none, as where a tolerance tells them apart."""
    m = example("four-bar").with_({"limits": {"angle": limit}})
    differing = m.with_({"dimensions.l2.tolerance": 1e-9})
    found = [jp.random(of, samples=60) for of in (m, differing)]
    held = bool(jp.worst(m).limit_met.all())
    assert [float(of.yield_specimen) for of in found] == [held, held]
    assert [float(of.yield_specimen_low) for of in found] == [float(found[0].yield_specimen_low)] * 2


def test_yields_are_of_determinate_mechanisms_with_scattered_offsets() -> None:
    bennett = jp.random(jp.loads(jp.examples.text("bennett")).with_({"limits.position": 1000.0}), samples=50)
    assert "yield_path" not in bennett
    assert "Yields over all configurations are of determinate mechanisms only" in " ".join(notes(from_dataset(bennett)))
    assert "yield_path" not in jp.random(example("four-bar"), samples=50, contact="loaded")
    plain = jp.random(example("four-bar").with_({"limits": {}}), samples=50)
    assert np.isnan(plain.yield_path)
    assert "Yields over" not in " ".join(notes(from_dataset(plain)))
    assert np.isfinite(plain.repeatability).all()


def test_the_table_of_a_scatter_begins_with_what_is_outside_and_never_says_nothing_for_sure() -> None:
    said = [
        s.text
        for s in conclude(
            from_dataset(jp.random(example("four-bar-fits"), samples=5000, contact="scattered"))
        ).sentences
    ]
    assert said[0].startswith("Required yield 99.73 %: met")
    assert "none of the specimens; less than 738 ppm" in said[1]
    assert said[2].startswith("Within the limits at all 6 configurations: 100 %")


def test_a_mechanism_in_which_nothing_is_off_has_no_yields() -> None:
    """Specimens without any parameter made the core panic."""
    m = example("slider-crank")
    raw = {key: value for key, value in m.raw.items() if key not in ("dimensions", "costs", "links", "limits")}
    raw["joints"] = {n: {k: v for k, v in j.items() if k != "clearance"} for n, j in m.raw["joints"].items()}
    raw["drives"] = {n: {k: v for k, v in d.items() if k != "error"} for n, d in m.raw["drives"].items()}
    exact = jp.Mechanism(raw)
    assert exact.parameters == ()
    result = jp.random(exact, samples=100)
    # Rounding of the closure.
    assert (result.error_std < 1e-12).all()
    assert "yield_path" not in result
    assert "repeatability" not in result


@pytest.mark.parametrize("name", ["four-bar", "four-bar-fits"])
def test_specimens_with_offsets_drawn_anew_are_those_that_are_closed_row_by_row(name: str) -> None:
    m, n = example(name), 1000
    at, place = nominal(m), 2
    drives, poses = at.drives[place : place + 1], at.poses[place : place + 1]
    drawn, others = (m.core.specimens(n, seed, None, "plain") for seed in (1, 2))
    errors = with_sizes(m, m.core.errors_of(drives, poses, m.core.with_offsets_of(drawn, others)))
    limits = np.full((errors.shape[1], 2), [-np.inf, np.inf])
    limits[0], limits[-2, 1] = np.quantile(errors[:, 0], [0.1, 0.9]), np.quantile(errors[:, -2], 0.8)
    expected = ((errors >= limits[:, 0]) & (errors <= limits[:, 1])).all(axis=1)
    found = m.core.within_redrawn(drives, poses, drawn, 2, limits)
    assert 0 < expected.sum() < n
    np.testing.assert_array_equal(found, expected)


def test_specimens_that_are_out_everywhere_are_not_looked_at_again() -> None:
    """The second configuration had none to look at."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 1e-9})
    result = jp.random(m, samples=64)
    assert float(result.yield_specimen) == 0.0
