"""Properties that hold for every mechanism, over random assembled ones (hypothesis)."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import jointplay as jp
from helpers.oracles import brute
from helpers.oracles.reading import read
from helpers.strategies import given_offsets, mechanisms, searching, turn

SEARCH = searching(10)


@SEARCH
@given(mechanisms())
def test_solve_finds_the_assembly_of_the_file(text: str) -> None:
    """Nominal poses of an independent Newton along the same path; every configuration ok."""
    link, result = read(text), jp.solve(jp.loads(text))
    assert (result.status == "ok").all()
    zero = dict.fromkeys(link.labels, 0.0)
    expected = link.out(link.follow(), zero)
    np.testing.assert_allclose(result.nominal[:, :2], expected[:, :2], rtol=0, atol=1e-10 * link.length)
    np.testing.assert_allclose(turn(result.nominal[:, 2], np.rad2deg(expected[:, 2])), 0, atol=1e-8)


@SEARCH
@given(mechanisms(), st.integers(0, 10_000), st.booleans())
def test_given_is_the_non_linear_closure(text: str, seed: int, boundary: bool) -> None:
    link = read(text)
    u = brute.draw(link, np.random.default_rng(seed), 1, boundary)[0]
    offsets = dict(zip(link.labels, u.tolist(), strict=True))
    result = jp.given(jp.loads(text), given_offsets(link, offsets))
    for k, q in enumerate(link.follow()):
        expected = brute.errors(link, q, link.configurations[k], u[None])[0]
        np.testing.assert_allclose(result.error[k, :2], expected[:2], rtol=0, atol=1e-10 * link.length)
        np.testing.assert_allclose(result.error[k, 2], np.rad2deg(expected[2]), rtol=0, atol=1e-8)


@SEARCH
@given(mechanisms(), st.sampled_from(["uniform", "boundary", "normal"]), st.integers(0, 1000))
def test_no_sample_exceeds_the_exact_worst_case(text: str, law: str, seed: int) -> None:
    """Monte Carlo lies inside the exact extremes, for every quantity; the quantiles follow in order."""
    m = jp.loads(text)
    worst, drawn = jp.worst(m), jp.random(m, samples=20_000, seed=seed, law=law)
    slack = 1e-9
    largest = drawn.largest
    assert (largest.sel(quantity="position") <= worst.worst_position * (1 + slack) + slack).all()
    assert (largest.sel(quantity="rotation") <= worst.worst_rotation * (1 + slack) + slack).all()
    reach = np.abs(worst.worst_component).max("side")
    for component in ("x", "y", "angle"):
        limit = reach.sel(component=component, drop=True)
        assert (np.abs(largest.sel(quantity=component)) <= limit * (1 + slack) + slack).all()
    assert (drawn.error_quantile.diff("probability") >= 0).all()


@SEARCH
@given(mechanisms(), st.integers(0, 10_000))
def test_no_random_play_exceeds_the_exact_worst_case(text: str, seed: int) -> None:
    """The oracle's own samples and corners against the program's exact extremes."""
    link, worst = read(text), jp.worst(jp.loads(text))
    rng = np.random.default_rng(seed)
    u = np.concatenate([brute.draw(link, rng, 400), brute.vertices(link, rng, 400)])
    for k, q in enumerate(link.follow()):
        errors = brute.errors(link, q, link.configurations[k], u)
        assert np.isfinite(errors).all()
        assert np.hypot(errors[:, 0], errors[:, 1]).max() <= worst.worst_position[k].item() + 1e-9 * link.length
        degrees = errors * [1, 1, np.rad2deg(1)]
        spans = worst.worst_component[k].values
        slack = 1e-9 * link.length
        assert (degrees.min(axis=0) >= spans[:, 0] - slack).all()
        assert (degrees.max(axis=0) <= spans[:, 1] + slack).all()


@SEARCH
@given(mechanisms(("five_bar", "three_rrr"), tolerances=False), st.integers(0, 10_000))
def test_as_many_drives_as_components_remove_a_given_error(text: str, seed: int) -> None:
    """Two drives bring the point back, three the pose: the oracle finds the nominal output at these drives."""
    link, m = read(text), jp.loads(text)
    u = brute.draw(link, np.random.default_rng(seed), 1)[0]
    offsets = dict(zip(link.labels, u.tolist(), strict=True))
    result = jp.compensate(m, "given", given_offsets(link, offsets))
    assert result.settled.all()
    kept = 2 if len(link.drives) == 2 else 3
    for k, q in enumerate(link.follow()):
        drives = np.deg2rad(result.drive_corrected[k].values)
        deviated, good = link.solve(q, drives, u)
        assert good
        left = link.out(deviated, u) - link.out(q, dict.fromkeys(link.labels, 0.0))
        assert np.abs(left[:kept]).max() < 1e-9 * link.length
        np.testing.assert_allclose(result.residual[k, :2], left[:2], rtol=0, atol=1e-9 * link.length)


@SEARCH
@given(mechanisms(("four_bar", "slider_crank", "watt", "scotch_yoke"), tolerances=False), st.integers(0, 10_000))
def test_one_drive_brings_the_point_as_near_as_it_can(text: str, seed: int) -> None:
    """No other value of the drive leaves the deviated output nearer to its nominal position."""
    link, m = read(text), jp.loads(text)
    u = brute.draw(link, np.random.default_rng(seed), 1)[0]
    offsets = dict(zip(link.labels, u.tolist(), strict=True))
    result = jp.compensate(m, "given", given_offsets(link, offsets))
    for k, q in enumerate(link.follow()):
        nominal = link.out(q, dict.fromkeys(link.labels, 0.0))
        values = np.deg2rad(result.drive_corrected[k].item()) + np.linspace(-0.01, 0.01, 201)
        poses, good = link.solve(np.broadcast_to(q, (201, q.size)), [values], u)
        distance = np.hypot(*(link.out(poses, u) - nominal)[:, :2].T)
        assert good.all()
        assert result.residual_position[k].item() <= distance.min() + 1e-9 * link.length
        assert abs(distance[100] - result.residual_position[k].item()) < 1e-9 * link.length


@SEARCH
@given(mechanisms(tolerances=False), st.floats(0.1, 50.0))
def test_loaded_depends_on_the_direction_of_the_load_only(text: str, factor: float) -> None:
    """Rigid bodies: all loads scaled alike leave the error as it is and scale the reactions."""
    link = read(text)
    m = jp.loads(text)
    scaled = m.with_(
        {"loads": [{**load, "force": [f * factor for f in load["force"]], "moment": load["moment"] * factor}
                   for load in _loads(text)]}
    )  # fmt: skip
    one, other = jp.loaded(m), jp.loaded(scaled)
    np.testing.assert_allclose(other.error, one.error, rtol=0, atol=1e-8 * link.length)
    np.testing.assert_allclose(other.reaction, one.reaction * factor, rtol=1e-6, atol=1e-6 * factor * link.length)


def _loads(text: str) -> list[dict]:
    import tomllib

    return tomllib.loads(text)["loads"]
