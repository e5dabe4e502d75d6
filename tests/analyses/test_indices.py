"""Sobol' indices: against closed forms, nested Monte Carlo, and the first order where it is exact."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import jointplay as jp
from jointplay import examples
from jointplay.analyses import random as random_module
from jointplay.analyses.indices import REPLICATES, Indices, _PartDraws, estimate, groups
from jointplay.analyses.nominal import nominal
from jointplay.analyses.yields import with_sizes
from jointplay.cli.commands import program
from jointplay.result import from_dataset
from jointplay.result.table.indices import notes

Floats = NDArray[np.float64]

FITS = {"drives.theta1.values": [25.0]}
#: a four-bar with a transition fit: some pairs have interference, and their offsets no room
PRESSED = FITS | {"joints.J1.clearance": {"fit": "H7/k6", "diameter": 12}, "joints.J3.clearance.fit": "H11/c11"}


def found_of(f: Callable[[Floats], Floats], a: Floats, b: Floats) -> Indices:
    mixed = [f(np.where(np.arange(a.shape[1]) == k, b, a)) for k in range(a.shape[1])]
    return estimate(f(a), f(b), np.stack(mixed), REPLICATES)


def ishigami(x: Floats) -> Floats:
    """Ishigami and Homma (1990), a = 7, b = 0.1."""
    return (np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None]


def ishigami_indices() -> tuple[Floats, Floats]:
    """The closed forms of first and total indices."""
    a, b, pi = 7.0, 0.1, np.pi
    variance = a**2 / 8 + b * pi**4 / 5 + b**2 * pi**8 / 18 + 0.5
    one, two = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8
    both = b**2 * pi**8 * (1 / 18 - 1 / 50)
    return np.array([one, two, 0.0]) / variance, np.array([one + both, two, both]) / variance


def test_ishigami_function() -> None:
    """Its third variable has no share alone, and a quarter of the variance together with the first one."""
    a, b = np.random.default_rng(3).uniform(-np.pi, np.pi, (2, 2**17, 3))
    found = found_of(ishigami, a, b)
    first, total = ishigami_indices()
    np.testing.assert_allclose(total, [0.5576, 0.4424, 0.2437], atol=1e-4)
    assert (np.abs(found.first[:, 0] - first) < 4.0 * found.first_error[:, 0] + 1e-3).all()
    assert (np.abs(found.total[:, 0] - total) < 4.0 * found.total_error[:, 0]).all()
    assert (found.total_error < 0.01).all()
    assert found.left_out == 0.0


def test_the_standard_errors_are_the_scatter_over_seeds() -> None:
    runs = []
    for seed in range(60):
        a, b = np.random.default_rng(seed).uniform(-np.pi, np.pi, (2, 2048, 3))
        runs.append(found_of(ishigami, a, b))
    for name in ("first", "total"):
        values = np.array([getattr(run, name)[:, 0] for run in runs])
        errors = np.array([getattr(run, f"{name}_error")[:, 0] for run in runs])
        # A standard deviation of 60 runs is known to 9 %.
        np.testing.assert_allclose(values.std(axis=0, ddof=1), np.sqrt((errors**2).mean(axis=0)), rtol=0.3)


def test_points_without_a_value_are_counted_and_change_nothing_else() -> None:
    a, b = np.random.default_rng(5).uniform(-np.pi, np.pi, (2, 2**12, 3))
    values = ishigami(a)
    values[::4] = np.nan
    mixed = np.stack([ishigami(np.where(np.arange(3) == k, b, a)) for k in range(3)])
    found = estimate(values, ishigami(b), mixed, REPLICATES)
    kept = np.arange(len(a)) % 4 != 0
    same = estimate(values[kept], ishigami(b[kept]), mixed[:, kept], REPLICATES)
    assert found.left_out == 0.25
    for name in ("first", "first_error", "total", "total_error"):
        np.testing.assert_allclose(getattr(found, name), getattr(same, name), rtol=1e-12)


def test_what_does_not_scatter_has_no_index() -> None:
    ones = np.ones((64, 1)) + 1e-15 * np.arange(64.0)[:, None]
    found = estimate(ones, ones[::-1], np.stack([ones]), REPLICATES, rounding=1e-12)
    assert np.isnan(found.first).all()
    assert np.isnan(found.total_error).all()


def test_where_the_first_order_is_exact_all_three_are_alike() -> None:
    """Clearances of a thousandth: the closure is linear to that part of it."""
    m = jp.loads(examples.text("four-bar", {"joints.*.clearance.radial": "0.001"})).with_(
        {"drives.theta1.values": [22.7, 60.0], "dimensions.l2.tolerance": 0.002}
    )
    result = jp.random(m, 20_000, indices=True)
    share = (result.contribution / result.error_std_first_order**2).transpose("configuration", "source", "component")
    for name in ("first", "total"):
        index, error = (
            result[f"sobol_{name}{end}"].sel(quantity=result.component.values).values for end in ("", "_standard_error")
        )
        assert (np.abs(index - share.values) < 4.5 * error + 1e-4).all()
        assert error.max() < 0.01
    assert float(share.sel(source="l2").max()) > 0.05
    assert any("the first order is enough" in line for line in notes(from_dataset(result)))


def nested(m: jp.Mechanism, group: int, outer: int, inner: int) -> tuple[Floats, Floats]:
    """First and total index by their definitions: means and variances over the other inputs, one loop in another."""
    at = nominal(m)
    columns = np.isin(m.parameter_source, groups(m)[group])
    fixed, moved = (_PartDraws.of(m, count, seed, None, "plain") for count, seed in ((outer, 11), (outer * inner, 12)))
    held = _PartDraws(*(np.repeat(part, inner, axis=0) for part in (fixed.drawn, fixed.offsets)))

    def values(draws: _PartDraws) -> Floats:
        errors = with_sizes(m, m.core.errors_of(at.drives[:1], at.poses[:1], draws.parameters(m)))
        return errors.reshape(outer, inner, -1)

    free = values(moved)
    variance = free.reshape(outer * inner, -1).var(axis=0)
    total = values(held.mixed(moved, columns)).var(axis=1, ddof=1).mean(axis=0) / variance
    rest = values(held.mixed(moved, ~columns))
    # The variance of a mean of so few has a part of its own.
    first = (rest.mean(axis=1).var(axis=0, ddof=1) - rest.var(axis=1, ddof=1).mean(axis=0) / inner) / variance
    return first, total


@pytest.mark.parametrize(
    ("example", "changes", "source"),
    [
        ("four-bar", {}, "J1"),
        ("four-bar", {}, "J4"),
        ("four-bar-fits", PRESSED, "J1"),
        ("four-bar-fits", PRESSED, "J3.hole"),
    ],
)
def test_against_nested_monte_carlo(example: str, changes: dict[str, object], source: str) -> None:
    """The position error is a distance: its sources act together, and the first order says nothing of that."""
    m = jp.loads(examples.text(example)).with_({"drives.theta1.values": [43.83]} | changes)
    result = jp.random(m, 2**14, indices=True).isel(configuration=0).sel(source=source)
    first, total = nested(m, m.sources.index(source), 1000, 100)
    # A hundred inner draws of a thousand: within a few hundredths.
    assert (np.abs(result.sobol_first.values - first) < 4.0 * result.sobol_first_standard_error.values + 0.02).all()
    assert (np.abs(result.sobol_total.values - total) < 4.0 * result.sobol_total_standard_error.values + 0.03).all()
    if example == "four-bar":
        assert result.sobol_total.sel(quantity="position") > result.sobol_first.sel(quantity="position") + 0.01


def test_offsets_lie_in_the_gap_of_the_sizes_they_are_put_beside() -> None:
    """A pin of one specimen in the hole of another one would be outside of its play."""
    m = jp.loads(examples.text("four-bar-fits")).with_(PRESSED)
    a, b = (_PartDraws.of(m, 4096, seed, None, "sobol") for seed in (1, 2))
    drawn = m.core.specimens(4096, 1)
    np.testing.assert_allclose(a.parameters(m), drawn, rtol=0.0, atol=1e-15)
    hole = m.parameter_source == m.sources.index("J1.hole")
    offset = np.flatnonzero(m.parameter_source == m.sources.index("J1"))
    pin = m.parameter_source == m.sources.index("J1.pin")
    mixed = a.mixed(b, hole).parameters(m)
    ((_, size),) = m.core_spec["sources"][m.sources.index("J1")]["set"].items()
    gap = np.maximum(size["radius"] + 0.5 * mixed[:, hole][:, 0] - 0.5 * mixed[:, pin][:, 0], 0.0)
    distance = np.linalg.norm(mixed[:, offset], axis=1)
    assert (distance <= gap * (1.0 + 1e-9)).all()
    # Where one pair is pressed together and the other is not, the pin lies anywhere in the play there is.
    pressed = np.linalg.norm(drawn[:, offset], axis=1) == 0.0
    assert 0.2 < pressed.mean() < 0.8
    freed = pressed & (gap > 0.0)
    assert freed.any()
    assert np.median(distance[freed] / gap[freed]) == pytest.approx(np.sqrt(0.5), abs=0.05)


def test_correlated_sources_are_one_group() -> None:
    text = examples.text("four-bar-fits")
    together = '\n[[correlations]]\nsources = ["J1.hole", "J3.hole"]\nrank = 0.9\n'
    m = jp.loads(text + together).with_(FITS)
    result = jp.random(m, 4096, indices=True)
    assert result.sobol_group.sel(source="J1.hole").item() == "J1.hole, J3.hole"
    assert result.sobol_group.sel(source="J2").item() == "J2"
    for name in ("sobol_first", "sobol_total", "sobol_total_standard_error"):
        np.testing.assert_array_equal(*(result[name].sel(source=s).values for s in ("J1.hole", "J3.hole")))
    assert any("J1.hole, J3.hole: correlated" in line for line in notes(from_dataset(result)))


def test_a_source_that_the_first_order_does_not_see_is_named() -> None:
    """At a dead point the slider does not follow the crank to first order."""
    m = jp.loads(examples.text("slider-crank")).with_(
        {"drives.theta.values": [0.0], "joints.*.clearance.radial": 0.0001, "drives.theta.error": 2.0}
    )
    result = jp.random(m, 8192, indices=True)
    at = {"configuration": 0, "source": "theta"}
    assert result.contribution.sel(component="x", **at) < 1e-6 * result.sobol_total.sel(quantity="x", **at)
    assert result.sobol_total.sel(quantity="x", **at) > 0.4
    (line,) = [line for line in notes(from_dataset(result)) if "for x and" in line]
    assert re.search(r"not enough for x and theta: the total index of theta is \d+(\.\d+)? % at configuration 0", line)


@pytest.mark.parametrize("samples", [2, 3, 31, 33, 1000])
@pytest.mark.filterwarnings("error")
def test_any_number_of_samples_will_do(samples: int) -> None:
    result = jp.random(jp.loads(examples.text("four-bar")).with_(FITS), samples, indices=True)
    assert np.isfinite(result.sobol_total.sel(source="J1").values).all()
    assert np.isfinite(result.sobol_total_standard_error.sel(source="J1").values).all() == (samples > 3)


def test_the_same_seed_gives_the_same_bits_and_another_one_other_ones() -> None:
    m = jp.loads(examples.text("four-bar")).with_(FITS)
    one = jp.random(m, 512, seed=4, indices=True, threads=1)
    assert one.identical(jp.random(m, 512, seed=4, indices=True, threads=2))
    assert not one.sobol_total.equals(jp.random(m, 512, seed=5, indices=True).sobol_total)
    plain = jp.random(m, 512, seed=4)
    # Their options differ.
    assert plain.drop_attrs(deep=False).identical(
        one[list(plain.data_vars)].drop_vars("sobol_group").drop_attrs(deep=False)
    )


def test_configurations_that_cannot_be_assembled_have_none() -> None:
    m = jp.loads(examples.text("slider-crank")).with_({"drives.theta.values": [30.0, 60.0]})
    at = nominal(m)
    at.poses[1] = np.nan
    found = random_module.compute(m, 256, indices=True, at=at)
    assert np.isfinite(found.get("sobol_total")[0, 0, 0])
    assert np.isnan(found.get("sobol_total")[1]).all()
    assert np.isnan(found.get("sobol_left_out")[1])


@pytest.mark.parametrize(
    ("example", "options", "part"),
    [
        ("redundant-bar", {}, "over-constrained or elastic"),
        ("four-bar", {"contact": "loaded"}, "the load decides where the offsets are"),
    ],
)
def test_what_has_no_independent_inputs_is_refused(example: str, options: dict[str, str], part: str) -> None:
    with pytest.raises(jp.InputError, match=part) as refusal:
        jp.random(jp.loads(examples.text(example)), 100, indices=True, **options)
    assert refusal.value.key == "indices"


def test_every_output_sweeps_and_maps_have_them() -> None:
    several = jp.random(jp.loads(examples.text("slider-crank-cases")), 64, indices=True)
    assert several.sobol_total.dims == ("output", "configuration", "source", "quantity")
    m = jp.loads(examples.text("four-bar")).with_(FITS)
    swept = jp.sweep(m, "joints.*.clearance.radial", [0.1, 0.2], "random", samples=64, indices=True)
    assert np.isfinite(swept.sobol_total.sel(source="J1").values).all()
    grid = {"theta1": [30.0, 40.0]}
    mapped = jp.map(m, "random", grid=grid, samples=64, indices=True)
    assert np.isfinite(mapped.sobol_total.sel(source="J1").values).all()


def test_the_program(tmp_path: Path) -> None:
    file = tmp_path / "four-bar.toml"
    file.write_text(examples.text("four-bar"))
    shown = CliRunner().invoke(program(), ["error", str(file), "-q", "random", "--indices", "--samples", "2000"])
    assert shown.exit_code == 0
    assert "total index" in shown.output
    assert "Sobol' indices" in shown.output
    without = CliRunner().invoke(program(), ["error", str(file), "-q", "random", "--samples", "2000"])
    assert "total index" not in without.output
