"""Scatter of over-constrained and elastic mechanisms, against closed forms and brute-force rejection in numpy."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.oracles.truss import Truss, square
from jointplay import _core
from jointplay.cli import run
from jointplay.result import STATUSES

R1, R2 = 0.03, 0.05


def with_tolerances(truss: Truss, tolerance: float, law: str) -> str:
    """The truss's file with a tolerance for the length of every bar."""
    text = truss.text()
    for name, bar in zip(truss.names, truss.bars, strict=True):
        head = f'[dimensions.long_{name}]\nbody = "{name}"\nbetween = ["{bar[0]}", "{bar[1]}"]\n'
        assert head not in text
        text += f"{head}tolerance = {tolerance!r}\n" + (f'law = "{law}"\n' if law else "")
    return text


def bar(tolerance: float = 0.1, law: str = "uniform", stiffness: float | None = None, **more: object) -> jp.Mechanism:
    """A bar on two pins of the ground: one constraint too many, along the bar."""
    truss = Truss(
        {"A": (0.0, 0.0), "B": (100.0, 0.0)},
        ("A", "B"),
        (("A", "B"),),
        {"A": R1, "B": R2},
        stiffness={} if stiffness is None else {"AB": stiffness},
        **more,  # type: ignore[arg-type]
    )
    return jp.loads(with_tolerances(truss, tolerance, law), "bar.toml")


def one(result: xr.Dataset) -> xr.Dataset:
    return result.isel(configuration=0)


def binomial(p: float, n: int) -> float:
    """Five standard errors of a share."""
    return 5 * math.sqrt(p * (1 - p) / n)


def inside(k: float) -> float:
    """Share of a normal law within k sigma."""
    return math.erf(k / math.sqrt(2))


@pytest.mark.parametrize("law", ["uniform", "normal"])
def test_a_redundant_bar_is_not_assemblable_as_often_as_its_misfit_exceeds_both_clearances(law: str) -> None:
    n, tolerance = 40_000, 0.1
    found = one(jp.random(bar(tolerance, law), samples=n, seed=1))
    reach = (R1 + R2) / tolerance
    # A normal law is cut at its tolerance, three sigma.
    share = 1 - reach if law == "uniform" else 1 - inside(3 * reach) / inside(3)
    assert found.not_assemblable.item() == pytest.approx(share, abs=binomial(share, n))
    assert found.failures.sel(outcome="not_assemblable").item() == round(found.not_assemblable.item() * n)
    assert found.failures.sum().item() == n
    assert found.strained.item() == 0.0
    if law == "uniform":
        for p in (0.5, 0.9, 0.99):
            factor = found.clearance_factor_quantile.sel(probability=p).item()
            exact = p * tolerance / (R1 + R2)
            assert factor == pytest.approx(exact, abs=binomial(p, n) * tolerance / (R1 + R2) + 2e-3 * exact)


def test_the_offsets_of_a_bar_are_those_of_rejection() -> None:
    """A bar that fits: its ends lie in discs, and as far apart as it is long."""
    n = 40_000
    found = one(jp.random(bar(1e-9), samples=n, seed=2))
    rng = np.random.default_rng(7)
    a, b = ((r * np.sqrt(rng.random(4_000_000)) * np.exp(2j * np.pi * rng.random(4_000_000))) for r in (R1, R2))
    # The bar's direction is x; a window of the difference along it, narrow beside the clearances.
    kept = np.abs((a - b).real) < 2e-4
    a, b = a[kept], b[kept]
    turn = np.rad2deg((b - a).imag / 100.0)
    assert len(a) > 10_000
    error = 6 * math.sqrt(1 / n + 1 / len(a))
    # The output is the bar's end in A.
    for component, sample in (("x", a.real), ("y", a.imag), ("angle", turn)):
        std = sample.std()
        assert found.error_std.sel(component=component).item() == pytest.approx(std, rel=error)
        assert found.error_mean.sel(component=component).item() == pytest.approx(0.0, abs=error * std)
    # To first order the same, and the sources share it out.
    np.testing.assert_allclose(found.error_std_first_order, found.error_std, rtol=1e-3)
    np.testing.assert_allclose(found.contribution.sum("source"), found.error_std_first_order**2, rtol=1e-9, atol=1e-15)


RADIAL = {"A": 0.02, "B": 0.03, "C": 0.01, "D": 0.015}


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
def test_a_braced_square_is_not_assemblable_as_often_as_its_self_stress_says(contact: str) -> None:
    n, count, tolerance = 20_000, 200_000, 0.08
    truss = square(radial=RADIAL, load=(30.0, -40.0), loaded="C")
    m = jp.loads(with_tolerances(truss, tolerance, "uniform"))
    found = one(jp.random(m, samples=n, seed=3, contact=contact))
    (stress,) = truss.self_stresses()
    misfit = tolerance * (2 * np.random.default_rng(11).random((count, len(truss.bars))) - 1)
    factor = np.abs(misfit @ stress) / (np.abs(stress) @ truss.loose())
    share = (factor > 1).mean()
    assert 0.05 < share < 0.5
    # The exact closure differs from the linear one by the deviations over the lengths.
    assert found.not_assemblable.item() == pytest.approx(share, abs=binomial(share, n) + 1e-3)
    for p in (0.5, 0.9, 0.99):
        quantile = found.clearance_factor_quantile.sel(probability=p).item()
        low, high = (np.quantile(factor, np.clip(p + s * binomial(p, n), 0, 1)) for s in (-1, 1))
        assert low * 0.997 <= quantile <= high * 1.003


@pytest.mark.parametrize("law", ["uniform", "normal"])
def test_a_braced_square_scatters_like_brute_force(law: str) -> None:
    """Units are drawn, and for each of them offsets again and again until they are compatible."""
    # Normal offsets are rarely near the edge: with less to take up chance finds them, too.
    n, count, tolerance = 40_000, 20_000, 0.02 if law == "uniform" else 0.01
    truss = square(radial=RADIAL, loaded="C")
    m = jp.loads(with_tolerances(truss, tolerance, "uniform"), "square.toml")
    found = one(jp.random(m, samples=n, seed=3, law=law))

    rng = np.random.default_rng(11)
    (stress,) = truss.self_stresses()
    bars = list(zip(truss.names, truss.bars, strict=True))

    def plays(size: int) -> np.ndarray:
        """How much longer the clearances let every bar seem, by law."""
        longer = np.zeros((size, len(bars)))
        for k, (name, bar) in enumerate(bars):
            along = truss.vector(bar) / np.linalg.norm(truss.vector(bar))
            for sign, node in zip((-1, 1), bar, strict=True):
                if truss.carrier(node) == name:
                    continue
                # Uniform in the disc, or Rayleigh cut at three sigma.
                u = rng.random(size)
                radius = np.sqrt(u) if law == "uniform" else np.sqrt(-2 * np.log1p(u * math.expm1(-4.5))) / 3
                turn = 2 * np.pi * rng.random(size)
                offset = RADIAL[node] * radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
                longer[:, k] += sign * offset @ along
        return longer

    misfit = tolerance * (2 * rng.random((count, len(bars))) - 1)
    window = 0.02 * (np.abs(stress) @ truss.loose())
    displaced, left, matrix = np.zeros((count, 2 * len(truss.free))), np.arange(count), truss.compatibility()
    for _ in range(3000):
        total = misfit[left] + plays(len(left))
        fits = np.abs(total @ stress) < window
        displaced[left[fits]] = np.linalg.lstsq(matrix, total[fits].T, rcond=None)[0].T
        left = left[~fits]
    # Hardly any unit is so near to its limit that chance does not find it.
    assert len(left) < 1e-3 * count
    at = 2 * truss.free.index("C")
    sample = np.delete(displaced, left, axis=0)[:, at : at + 2]
    error = 5 * math.sqrt(0.5 / n + 0.5 / len(sample))
    np.testing.assert_allclose(found.error_std[:2], sample.std(axis=0), rtol=error)
    np.testing.assert_allclose(found.error_mean[:2], sample.mean(axis=0), atol=1.5 * error * sample.std(axis=0).max())
    ours = found.error_covariance.values[0, 1] / np.prod(found.error_std.values[:2])
    assert ours == pytest.approx(np.corrcoef(sample.T)[0, 1], abs=1.5 * error)


def test_an_elastic_bar_has_no_force_in_its_dead_band() -> None:
    n, tolerance, stiffness = 20_000, 0.2, 2500.0
    found = one(jp.random(bar(tolerance, "uniform", stiffness), samples=n, seed=4, probabilities=(0.1, 0.25, 0.5, 0.9)))
    share = 1 - (R1 + R2) / tolerance
    assert found.failures.sel(outcome="not_assemblable").item() == 0
    assert found.strained.item() == pytest.approx(share, abs=binomial(share, n))
    assert found.failures.sum().item() == n
    for p in (0.1, 0.25, 0.5, 0.9):
        # The tension grows with the shortness, which is uniform.
        short = tolerance * (2 * p - 1)
        tension = stiffness * math.copysign(max(0.0, abs(short) - R1 - R2), short)
        force = found.member_force_quantile.sel(probability=p, member="AB").item()
        assert force == pytest.approx(
            tension, rel=2e-3, abs=2 * tolerance * stiffness * binomial(p, n) * (tension != 0)
        )


def test_units_of_one_loop_do_not_feel_the_strain_of_another() -> None:
    """Two bars on four pins of the ground: whether one of them is strained says nothing of the other's play."""
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "E": (0.0, 50.0), "F": (100.0, 50.0)}
    radial = {"A": R1, "B": R2, "E": R1, "F": R2}
    truss = Truss(
        nodes, tuple(nodes), (("A", "B"), ("E", "F")), radial, stiffness={"AB": 2500.0, "EF": 2500.0}, loaded="A"
    )
    text = with_tolerances(truss, 0.06, "uniform")
    n = 20_000
    calm = one(jp.random(jp.loads(text), samples=n, seed=5))
    # The other bar is now always strained.
    strained = one(jp.random(jp.loads(text).with_({"dimensions.long_EF.deviation": 0.3}), samples=n, seed=5))
    assert calm.strained.item() == 0.0
    assert strained.strained.item() == 1.0
    error = 6 * math.sqrt(2 / n)
    np.testing.assert_allclose(strained.error_std, calm.error_std, rtol=error)
    np.testing.assert_allclose(strained.error_mean, calm.error_mean, atol=error * calm.error_std.max().item())


def test_a_brace_with_much_play_is_as_good_as_none() -> None:
    n = 20_000
    radial = {"A": 0.02, "B": 0.02, "C": 0.02, "D": 0.02}
    bars = (("A", "D"), ("D", "C"), ("B", "C"), ("A", "C"))
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "C": (100.0, 90.0), "D": (0.0, 100.0)}
    simple = Truss(nodes, ("A", "B"), bars, radial, loaded="C")
    # The brace ends on a pin of its own with thirty times the play of the others.
    apart = {**nodes, "E": (100.0, 0.0)}
    braced = Truss(apart, ("A", "B", "E"), (*bars, ("E", "D")), {**radial, "E": 0.6}, loaded="C")
    one_more, less = (
        one(jp.random(jp.loads(with_tolerances(t, 0.02, "uniform")), samples=n, seed=6)) for t in (braced, simple)
    )
    assert one_more.not_assemblable.item() == 0.0
    np.testing.assert_allclose(one_more.error_std, less.error_std, rtol=0.03)


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
def test_seeds_and_threads(contact: str) -> None:
    m = bar(0.1, "uniform", 2500.0, load=(3.0, -1.0), loaded="A")
    results = [
        jp.random(m, samples=9000, seed=seed, threads=threads, contact=contact)
        for seed, threads in ((1, 1), (1, 2), (2, 1))
    ]
    xr.testing.assert_identical(results[0], results[1])
    assert not results[0].error_mean.equals(results[2].error_mean)
    assert (results[0].failures.sum("outcome") == 9000).all()


def test_a_load_pushes_every_unit_to_its_end() -> None:
    """A rigid bar that is g too long is pushed along itself until one of its ends touches: min(r1, r2 - g)."""
    n, tolerance = 10_000, 0.06
    m = bar(tolerance, "uniform", load=(5.0, 0.0), loaded="A")
    found = one(jp.random(m, samples=n, seed=8, contact="loaded", probabilities=(0.2, 0.6)))
    assert found.attrs["contact"] == "loaded"
    assert found.not_assemblable.item() == 0.0
    g = np.linspace(-tolerance, tolerance, 200_001)
    x = np.minimum(R1, R2 - g)
    assert found.error_mean.sel(component="x").item() == pytest.approx(x.mean(), abs=5 * x.std() / math.sqrt(n))
    assert found.error_std.sel(component="x").item() == pytest.approx(x.std(), rel=0.05)
    # Below r1, as far as the bar's own length leaves it.
    quantile = found.error_quantile.sel(probability=0.2, quantity="x").item()
    assert quantile == pytest.approx(np.quantile(x, 0.2), abs=2 * tolerance * binomial(0.2, n) + 1e-4)


def test_a_load_along_an_elastic_bar_strains_units_as_equilibrium_says() -> None:
    """The end in A is pushed along the bar, towards B; what is g too long is squeezed between the two pins.

    With the tension N the pin in A takes F + N, and the one in B the rest. As long as A is held by its pin and B is
    loose, N = 0 and A is at r1. B comes to its end at g = r2 - r1, and the bar is squeezed by k (r1 + g - r2) until it
    carries all of F; then A leaves its pin, and comes to the other side of it, where both pins hold.
    """
    n, tolerance, stiffness, force = 20_000, 0.3, 2500.0, 60.0
    m = bar(tolerance, "uniform", stiffness, load=(force, 0.0), loaded="A")
    levels = (0.03, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 0.97)
    found = one(jp.random(m, samples=n, seed=9, contact="loaded", probabilities=levels))

    def held(g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tension, and where the end in A is."""
        squeezed = np.minimum(0.0, stiffness * (R2 - R1 - g))
        pulled = np.maximum(0.0, stiffness * (-R2 - R1 - g))
        tension = np.maximum(squeezed, -force) + pulled
        at = np.where(squeezed < -force, R2 - g + force / stiffness, R1)
        tension = np.where(at < -R1, stiffness * (R2 + R1 - g), tension)
        return tension, np.maximum(at, -R1)

    tension, at = held(np.linspace(-tolerance, tolerance, 400_001))
    for p in levels:
        low, high = (np.quantile(tension, np.clip(p + s * binomial(p, n), 0, 1)) for s in (-1, 1))
        size = 2e-3 * abs(high - low) + 1e-9 * force
        quantile = found.member_force_quantile.sel(probability=p, member="AB").item()
        # Tensions are known within 0.1 %.
        assert low - size - 2e-3 * abs(low) <= quantile <= high + size + 2e-3 * abs(high), p
    x = found.sel(component="x")
    assert x.error_mean.item() == pytest.approx(at.mean(), abs=5 * at.std() / math.sqrt(n))
    assert x.error_std.item() == pytest.approx(at.std(), rel=0.03)
    share = 1 - (R1 + R2) / tolerance
    assert found.strained.item() == pytest.approx(share, abs=binomial(share, n))


@pytest.mark.parametrize("stiffness", [None, 2500.0])
def test_units_are_undetermined_as_often_as_the_pin_that_nothing_pushes_is_loose(stiffness: float | None) -> None:
    """The end in B is pushed across the bar, so that only its pin bears.

    A bar that is g too long or too short keeps B at the bottom of its hole as long as A gives way by g, |g| < r1: then
    A is loose across the bar, which may turn. A longer or a shorter one presses on the pin in A, too.
    """
    n, tolerance = 20_000, 0.06
    m = bar(tolerance, "uniform", stiffness, load=(0.0, -10.0), loaded="B")
    found = one(jp.random(m, samples=n, seed=10, contact="loaded"))
    undetermined = found.failures.sel(outcome="undetermined").item() / n
    share = R1 / tolerance
    # That the bar comes down by r2 makes it shorter by r2^2 / 200 mm.
    assert undetermined == pytest.approx(share, abs=binomial(share, n) + R2**2 / 200 / tolerance)
    assert found.failures.sel(outcome="ok").item() == n - round(undetermined * n)
    # They are in the figures, with what is open in its middle.
    assert np.isfinite(found.error_std).all()
    assert found.histogram.sum("bin").isel(quantity=0).item() == n


def drawn(m: jp.Mechanism, parameters: np.ndarray) -> _core.Mechanism:
    """The mechanism with the deviations of one unit in place of its tolerances."""
    spec, first = m.spec(), 0
    for source in spec["sources"]:
        last = first + len(source["centre"])
        if source["kind"] != "clearance":
            source["centre"] = parameters[first:last].tolist()
        first = last
    return _core.Mechanism(json.dumps(spec))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("x-braced-square", {}),
        ("four-legged-platform", {}),
        ("redundant-bar", {}),
        ("sarrus", {}),
        ("antenna-support", {"dimensions.DF.tolerance": 8.0, "dimensions.DI.tolerance": 8.0}),
    ],
)
def test_loaded_specimens_are_where_loaded_puts_them_one_by_one(name: str, changes: dict[str, float]) -> None:
    """Every unit asked by itself: status, offsets, error."""
    m = jp.loads(jp.examples.text(name)).with_(changes)
    assert m.drive_values is not None
    n, drives, poses = 60, m.drive_values[:1], m.core.trace(m.drive_values)["poses"][:1]
    found = m.core.random(drives, poses, n, 5, np.array([0.5]), None, None, 1, keep=True, loaded=True)
    play = max(size.get("radius", 0.0) for source in m.core_spec["sources"] for size in source["set"].values())
    lengths = 2 if m.core_spec["space"] == "planar" else 3
    strained = 0
    for status, u, error in zip(found["kept_status"], found["kept_parameters"], found["kept_errors"], strict=True):
        alone = drawn(m, u).loaded(drives, poses, True, True, True)
        factor = alone["clearance_factor"][0]
        strained += factor > 1
        # There the factor is that of the exact closure.
        if abs(factor - 1) > 1e-3:
            assert STATUSES[status] == STATUSES[alone["status"][0]]
        # Where the energy is flat, the programs know an offset in a round hole to some 1e-6 of its radius, and a
        # sequence that hesitates, of which there are two, ends when its steps are a millionth of all displacements.
        apart = max(1e-5 * play, 2e-6 * np.abs(u).max())
        np.testing.assert_allclose(error[:lengths], alone["error"][0, :lengths], rtol=0, atol=apart)
        np.testing.assert_allclose(u, alone["offset"][0], rtol=0, atol=apart)
    if name != "sarrus":
        assert 0 < strained < n


def test_a_load_leaves_a_determinate_mechanism_no_play() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    pushed, found = jp.loaded(m), jp.random(m, samples=100, contact="loaded")
    np.testing.assert_allclose(found.error_mean, pushed.error, rtol=1e-9, atol=1e-9)
    assert found.error_std.max().item() < 1e-9


def test_a_clearance_cannot_be_at_its_boundary_and_compatible() -> None:
    with pytest.raises(jp.InputError, match=r"bar.toml: law: law 'boundary' is not possible for A.*uniform, normal"):
        jp.random(bar(), samples=10, law="boundary")
    with pytest.raises(jp.InputError, match="contact"):
        jp.random(bar(), samples=10, contact="pushed")


@pytest.mark.parametrize("name", ["x-braced-square", "four-legged-platform", "bennett"])
def test_every_unit_closes_for_the_offsets_that_it_is_said_to_have(name: str) -> None:
    """Its offsets and deviations, given to the closure of all constraints."""
    m = jp.loads(jp.examples.text(name))
    assert m.drive_values is not None
    drives, poses = m.drive_values[:1], m.core.trace(m.drive_values)["poses"][:1]
    found = m.core.random(drives, poses, 300, 0, np.array([0.5]), None, "uniform", 1, keep=True)
    status = found["kept_status"]
    ok, strained = (status == STATUSES.tolist().index(name) for name in ("ok", "strained"))
    assert ok.sum() > 30
    assert (np.bincount(status, minlength=len(STATUSES)) == found["failures"][0]).all()
    posed = ok | strained
    u = found["kept_parameters"][posed]
    given = m.core.given(np.repeat(drives, len(u), axis=0), np.repeat(poses, len(u), axis=0), u)
    # One of 200 specimens is so near to the edge of what fits without strain that rounding (6e-13 m, 1e-5 N) decides.
    at_edge = ok[posed] & (np.abs(given["prestress"]).reshape(len(u), -1).max(axis=1) < 1e-4)
    assert at_edge[given["status"] != status[posed]].all()
    np.testing.assert_allclose(found["kept_errors"][posed], given["error"], rtol=0, atol=1e-10)
    assert np.isnan(found["kept_errors"][~posed]).all()
    # The clearances are not left: corrections are of the second order.
    for s, source in enumerate(m.core_spec["sources"]):
        ((shape, size),) = source["set"].items()
        if shape == "disc":
            places = np.flatnonzero(m.parameter_source == s)
            assert np.hypot(*u[:, places].T).max() < 1.01 * size["radius"]


def test_the_command_line_tells_what_becomes_of_the_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bar.toml"
    truss = Truss(
        {"A": (0.0, 0.0), "B": (100.0, 0.0)}, ("A", "B"), (("A", "B"),), {"A": R1, "B": R2}, load=(5.0, 0.0), loaded="A"
    )
    path.write_text(with_tolerances(truss, 0.18, "uniform"))
    assert run(["error", str(path), "-q", "random", "--samples", "2000"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "not assemblable" in told
    assert re.search(r"\d+ were not assemblable, 5\d(\.\d+)? %; not included in the results", told)
    assert "99.9 % of the specimens can be assembled without strain with the clearances multiplied by 2.2" in told
    assert run(["error", str(path), "-q", "random", "--samples", "200", "--contact", "loaded"]) == 0
    assert "clearances where the load pushes them" in " ".join(capsys.readouterr().out.split())
    assert run(["error", str(path), "-q", "random", "--law", "boundary"]) == 2
    assert "uniform, normal" in " ".join(capsys.readouterr().err.split())
