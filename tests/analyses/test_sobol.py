"""Random specimens by scrambled Sobol points: the same laws, standard errors that hold, and less to wait for."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.processes import digests
from helpers.strategies import mechanism
from jointplay.analyses.nominal import nominal

FOUR_BAR = jp.examples.text("four-bar")
TOLERANCES = """
[dimensions.crank]
body = "crank"
between = ["J1", "J2"]
tolerance = 0.05

[dimensions.coupler]
body = "coupler"
between = ["J2", "J3"]
tolerance = { sigma = 0.02 }
"""


def one(samples: int, seed: int, sampling: str, text: str = FOUR_BAR, **options: Any) -> Any:
    m = jp.loads(text).with_({"drives.theta1.values": [60.0]})
    return jp.random(m, samples=samples, seed=seed, sampling=sampling, **options).isel(configuration=0)


def test_plain_samples_are_those_of_earlier_versions() -> None:
    """Bit for bit: what was drawn before there were other points, by the same seed."""
    expected = [
        "0x1.50550e77f06f5p-11",
        "0x1.85437f115cbeap-11",
        "0x1.46831a85982c3p-11",
        "-0x1.b5eb11aa0d472p-12",
        "0x1.0046d905add71p-11",
        "0x1.4a1e00c9389c5p-11",
        "0x1.655eb57d94f73p-12",
        "-0x1.07b0b821727aep-11",
    ]
    drawn = jp.loads(FOUR_BAR).core.specimens(3, 7, None, "plain")
    assert [x.hex() for x in drawn[1, :8].tolist()] == expected


@pytest.mark.parametrize("sampling", ["sobol", "plain"])
@pytest.mark.parametrize("samples", [2000, 8192])
def test_standard_errors_are_how_far_results_of_other_seeds_lie_apart(sampling: str, samples: int) -> None:
    """Over 80 seeds the spread of every figure is what the standard errors say."""
    runs = [one(samples, seed, sampling) for seed in range(80)]
    for name in ("error_mean", "error_std", "error_quantile"):
        values = np.stack([run[name].values for run in runs])
        said = np.sqrt(np.mean([run[f"{name}_standard_error"].values ** 2 for run in runs], axis=0))
        ratio = values.std(axis=0, ddof=1) / said
        if name == "error_quantile":
            # Beyond the quantiles of 99 % and 99.9 % are so few samples that their spread does not describe them.
            ratio = ratio[:3]
        # The spread over 80 seeds is known within 8 %, standard errors of 16 replicates together within 2 %. Quantiles
        # of few samples are known better than said: what lies between two samples is counted as unknown.
        assert ((ratio > 0.65) & (ratio < 1.25)).all(), (name, ratio)


def test_sobol_points_know_the_scatter_much_better_than_as_many_plain_samples() -> None:
    """The figures on which the default rests."""
    spread = {}
    for sampling in ("sobol", "plain"):
        runs = [one(32_768, seed, sampling) for seed in range(12)]
        spread[sampling] = {
            "std": np.std([run.error_std.values for run in runs], axis=0),
            "quantile": np.std([run.error_quantile.sel(probability=0.95).values for run in runs], axis=0),
        }
    assert (spread["plain"]["std"] / spread["sobol"]["std"]).min() > 10
    assert np.median(spread["plain"]["quantile"] / spread["sobol"]["quantile"]) > 1.5


@pytest.fixture(scope="module")
def many() -> Any:
    return one(200_000, 2, "sobol")


@pytest.mark.parametrize("samples", [2, 3, 15, 16, 17, 63, 1000, 8191, 131_073])
@pytest.mark.parametrize("sampling", ["sobol", "plain"])
def test_any_number_of_samples_is_drawn(samples: int, sampling: str, many: Any) -> None:
    result = one(samples, 1, sampling)
    assert int(result.failures.sum()) == samples
    assert np.isfinite(result.error_std.values).all()
    assert np.isfinite(result.error_std_standard_error.values).all()
    # Five standard errors of a normal law, and what few samples do not see of theirs.
    assert (abs(result.error_std - many.error_std) <= 5 * many.error_std / np.sqrt(2 * (samples - 1))).all()


def test_specimens_are_those_that_random_solves() -> None:
    m = jp.loads(FOUR_BAR + TOLERANCES)
    at = nominal(m)
    for sampling in ("sobol", "plain"):
        found = m.core.random(at.drives[:1], at.poses[:1], 20_000, 3, np.array([0.5]), keep=True, sampling=sampling)
        drawn = m.core.specimens(20_000, 3, None, sampling)
        assert (found["kept_parameters"] == drawn).all()


def test_bit_identical_for_any_number_of_threads_and_width_of_registers() -> None:
    assert len(digests(mechanism("stephenson", 2), 150_000)) == 1


def test_the_result_says_which_points_it_used() -> None:
    assert one(131_072, 0, "sobol").attrs["sampling"] == "scrambled Sobol points, 16 independent replicates of 8,192"
    assert one(100, 0, "sobol").attrs["sampling"] == "scrambled Sobol points, 16 independent replicates of 6 or 7"
    assert one(100, 0, "plain").attrs["sampling"] == "pseudo-random"
    # Normal numbers that are truncated together in a ball are drawn by rejection.
    balls = jp.random(jp.loads(jp.examples.text("rssr")), samples=64, law="normal").attrs["sampling"]
    assert "; pseudo-random: " in balls


def test_another_sampling_is_refused() -> None:
    with pytest.raises(jp.InputError, match="sampling: 'halton' is not a sampling"):
        one(100, 0, "halton")


def test_over_constrained_mechanisms_take_sobol_points_for_their_deviations() -> None:
    """The shares of outcomes are the same within their errors, and deviations are what Sobol points give."""
    m = jp.loads(jp.examples.text("four-legged-platform"))
    found = {s: jp.random(m, samples=4096, seed=1, sampling=s).isel(configuration=0) for s in ("sobol", "plain")}
    for outcome in ("ok", "not_assemblable"):
        share = {s: float(r.failures.sel(outcome=outcome)) / 4096 for s, r in found.items()}
        error = np.sqrt(share["plain"] * (1 - share["plain"]) / 4096) + 1 / 4096
        assert abs(share["sobol"] - share["plain"]) < 5 * error
    assert found["sobol"].attrs["sampling"].startswith("scrambled Sobol points")


@pytest.mark.parametrize("name", ["four-bar", "six-bar", "rssr", "serial-6r"])
def test_quantiles_with_the_first_order_as_a_control_are_those_of_many_plain_samples(name: str) -> None:
    """Without bias, and several times nearer to the truth than those of as many plain samples."""
    m = jp.loads(jp.examples.text(name))
    at = nominal(m).first(1)
    levels = np.array([0.1, 0.5, 0.9, 0.95])

    def quantiles(samples: int, seed: int, sampling: str) -> tuple[Any, Any, Any]:
        found = m.core.random(at.drives, at.poses, samples, seed, levels, sampling=sampling)
        names = ("quantile", "quantile_standard_error", "quantile_resolution")
        return tuple(found[name][0] for name in names)  # type: ignore[literal-required]

    truth, truth_error, resolution = quantiles(1 << 22, 12_345, "plain")
    runs = {sampling: [quantiles(16_384, seed, sampling)[0] for seed in range(24)] for sampling in ("plain", "sobol")}
    spread = {sampling: np.std(values, axis=0, ddof=1) for sampling, values in runs.items()}
    # Quantiles are interpolated within bins, of which a tenth is more than what that misses.
    error = np.sqrt(spread["sobol"] ** 2 / 24 + truth_error**2 + (0.1 * resolution) ** 2)
    far = np.abs(np.mean(runs["sobol"], axis=0) - truth)
    # Largest of twenty: 4.5 standard errors.
    assert (far <= 4.5 * error).all(), far / error
    # By the same measure, whatever the draw: what varies by less than a tenth of a bin is not compared.
    varies = spread["plain"] > 0.1 * resolution
    assert varies.sum() >= 8
    assert np.median((spread["plain"] / np.maximum(spread["sobol"], 1e-300))[varies]) > 3
