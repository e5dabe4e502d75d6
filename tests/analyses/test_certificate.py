"""Bounds of the worst case: closed forms, brute force and random mechanisms lie below them, and near them."""

import itertools
import math
import re

import numpy as np
import pytest

import jointplay as jp
from helpers.bounds import bounded, of_spec
from helpers.oracles import loops
from helpers.oracles.rotatability import pin_boundary, rotation_range
from helpers.strategies import four_bar_text, paper_text, random_four_bar
from helpers.wide import KINDS, mechanism
from jointplay.analyses.nominal import nominal
from jointplay.cli import run

#: what is asked of the bounds of the paper's four-bar, by its radial clearance in mm
ASKED = {1.0: 1e-3, 0.3: 1e-3, 0.1: 1e-4, 0.02: 1e-4}
#: a bound is not made closer than this part of the largest error of its kind
CLOSE = 1.01e-5
#: `verify_certificate.py` has more
PLANAR, SPATIAL = 60, 8


@pytest.mark.parametrize("radial", ASKED)
def test_bounds_of_the_4r_are_close(radial: float) -> None:
    result = jp.worst(jp.loads(paper_text(radial)), certify=True)
    assert result.certified.all()
    assert result.certified_assembly.all()
    assert (result.certified_reason == "").all()
    for name in ("position", "rotation"):
        value, bound = result[f"worst_{name}"], result[f"worst_{name}_certified"]
        assert (bound >= value).all()
        assert (result[f"worst_{name}_gap"] <= ASKED[radial]).all()
        np.testing.assert_allclose(result[f"worst_{name}_gap"], bound / value - 1, rtol=0, atol=1e-15)
    outside = (result.worst_component_certified - result.worst_component) * [-1, 1]
    assert (outside >= 0).all()


@pytest.mark.parametrize("seed", range(20))
def test_the_rotatability_bound_and_the_arcs_are_below(seed: int) -> None:
    """Closed forms of four-bars with four unlike clearances: the rocker's turn, and the region of its pin."""
    fb, theta = random_four_bar(seed)
    radii = tuple(np.random.default_rng(seed).uniform(0.05, 1.2, 4))
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    text = four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], radii, start=start)
    result = jp.worst(jp.loads(text), certify=True).isel(configuration=0)
    assert bool(result.certified), str(result.certified_reason.item())
    low, high = (math.degrees(a) for a in rotation_range(fb, theta, sum(radii)))
    angle = result.worst_component_certified.sel(component="angle").values
    turn = max(-low, high)
    assert low - CLOSE * turn <= angle[0] <= low + 1e-12 * turn
    assert high - 1e-12 * turn <= angle[1] <= high + CLOSE * turn
    moved = pin_boundary(fb, theta, radii) - complex(fb.rocker_pin(theta))
    # Both ends of an arc are among its points, so that nothing but their number is between largest and bound.
    largest = np.abs(moved).max()
    assert largest * (1 - 1e-12) <= result.worst_position_certified.item() <= largest * (1 + CLOSE + 1e-7)


def test_no_random_planar_mechanism_has_a_value_above_its_bound() -> None:
    """Clearances up to 1 % of the size, and, for every other one, up to 10 %, where fewer have bounds."""
    with_bounds = 0
    for number in range(PLANAR):
        most = 0.01 if number % 2 else 0.1
        m = jp.loads(mechanism(KINDS[number % len(KINDS)], number // len(KINDS), most=most))
        at = nominal(m)
        found = bounded(m.core, at.drives, at.poses, 10)
        assert not found.excluded, number
        with_bounds += int(found.certified.sum())
    assert with_bounds >= 0.5 * PLANAR


def test_no_random_spatial_mechanism_has_a_value_above_its_bound() -> None:
    found = [of_spec(loops.loop(seed, 1e-5, lost=seed % 2 == 1), 3, 2) for seed in range(SPATIAL)]
    assert not any(one.excluded for one in found)
    assert sum(int(one.certified.sum()) for one in found) >= 0.5 * SPATIAL


@pytest.mark.parametrize("name", ["slider-crank", "rssr"])
def test_no_sample_on_the_boundary_is_above_a_bound(name: str) -> None:
    """Guides, pins in space and balls: the far ends of all sets, drawn at random."""
    m = jp.loads(jp.examples.text(name))
    worst = jp.worst(m, certify=True, parts=20)
    drawn = jp.random(m, samples=20_000, law="boundary").largest
    assert worst.certified.all()
    for name in ("position", "rotation"):
        assert (drawn.sel(quantity=name) <= worst[f"worst_{name}_certified"]).all()


def test_more_parts_never_make_a_bound_worse() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    gaps = [jp.worst(m, certify=True, parts=n).worst_position_gap.values for n in (1, 4, 16, 64)]
    for some, more in itertools.pairwise(gaps):
        assert (more <= some * (1 + 1e-9)).all()
    assert (gaps[0] < 0.2).all()


def test_bounds_are_the_same_for_every_configuration_by_itself() -> None:
    """What is computed beside a configuration, on which thread, does not matter."""
    m = jp.loads(jp.examples.text("five-bar"))
    at = nominal(m)
    together = bounded(m.core, at.drives[:4], at.poses[:4])
    for k in range(4):
        alone = bounded(m.core, at.drives[k : k + 1], at.poses[k : k + 1])
        np.testing.assert_array_equal(alone.bounds[0], together.bounds[k])


def test_large_clearances_are_bounded_in_slabs() -> None:
    """A twentieth of the links: over all of the sets at once the bound is half of the error and more above it."""
    m = jp.loads(jp.examples.text("four-bar").replace("radial = 1.0", "radial = 4.0"))
    worst = jp.worst(m, certify=True).isel(configuration=slice(0, 9))
    assert (worst.worst_position_gap < 0.35).all()
    drawn = jp.random(m, samples=5_000, law="boundary").largest.isel(configuration=slice(0, 9))
    assert (drawn.sel(quantity="position") <= worst.worst_position_certified).all()


def test_eight_times_the_clearances_of_a_loop_in_space_are_bounded_closely() -> None:
    """With what is linear at the nominal pose in place of that at each part the gaps are 42 and 2 %."""
    text = re.sub(r"((?:radial|axial|gap) = )([0-9.]+)", lambda m: f"{m[1]}{8 * float(m[2])}", jp.examples.text("rssr"))
    m = jp.loads(text)
    at = nominal(m)
    found = bounded(m.core, at.drives[9:11], at.poses[9:11])
    assert found.certified.all()
    assert not found.excluded
    assert (found.gaps < 0.01).all()


@pytest.mark.parametrize("name", ["rssr", "3-rrr-spherical"])
def test_one_expansion_bounds_a_mechanism_in_space_within_a_hundredth(name: str) -> None:
    """Parts were expanded for every bound until it was within 0.001 %: 220 to 370 of them in each configuration."""
    worst = jp.worst(jp.loads(jp.examples.text(name)), certify=True)
    assert worst.certified.all()
    assert (worst.worst_position_gap <= 0.01).all()
    assert (worst.worst_rotation_gap <= 0.01).all()
    assert worst.certified_parts.sum() <= worst.sizes["configuration"]


def test_parts_of_balls_are_bounded_in_the_whole_ball() -> None:
    """In balls around what is left of them some bounds of this mechanism stay 0.08 % above the value."""
    worst = jp.worst(jp.loads(jp.examples.text("geared-five-bar")), certify=True)
    assert (worst.worst_position_gap <= CLOSE).all()


def test_clearances_of_no_size_do_not_trouble_slabs(tmp_path, monkeypatch) -> None:
    """They are columns of zeros among the motions; the singular values of such a matrix were not a number once."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spherical.toml").write_text(jp.examples.text("3-rrr-spherical"))
    none = [f"joints.*.clearance.{kind}=0" for kind in ("radial", "axial")]
    settings = [word for setting in (*none, "joints.top1.clearance.radial=0.08") for word in ("-s", setting)]
    command = ["error", "spherical.toml", "-q", "worst", "--certify", "--parts", "5", "-o", "found.json", *settings]
    assert run(command) in (0, 1)
    assert (tmp_path / "found.json").exists()


def test_sets_that_are_too_large_have_no_bound() -> None:
    """Clearances of an eighth of the links."""
    text = jp.examples.text("four-bar").replace("radial = 1.0", "radial = 12.0")
    result = jp.worst(jp.loads(text), certify=True)
    assert not result.certified.all()
    lacking = result.isel(configuration=np.flatnonzero(~result.certified.values))
    assert (lacking.certified_reason != "").all()
    assert lacking.worst_position_certified.isnull().all()
    assert lacking.worst_component_certified.isnull().all()


def test_over_constrained_mechanisms_are_refused_with_the_reason() -> None:
    result = jp.worst(jp.loads(jp.examples.text("x-braced-square")), certify=True)
    assert not result.certified.any()
    assert not result.certified_assembly.any()
    assert set(result.certified_reason.values.tolist()) == {"the mechanism is over-constrained or elastic"}


def test_flanks_that_would_meet_are_refused() -> None:
    """Joint clearances larger than the backlash close it: part of the sets cannot be assembled."""
    m = jp.loads(jp.examples.text("rack-slider"))
    narrow = jp.worst(m.with_({"joints.mesh.clearance.backlash": 1e-4}), certify=True)
    assert not narrow.certified.any()
    assert (narrow.certified_reason == "flanks would have to pass through each other in a part of the sets").all()
    wide = jp.worst(m, certify=True)
    assert wide.certified.all()
    assert (wide.worst_position_gap <= CLOSE).all()


def test_bounds_to_first_order_are_not_given() -> None:
    with pytest.raises(jp.InputError, match="certify needs exact"):
        jp.worst(jp.loads(paper_text()), certify=True, exact=False)
    with pytest.raises(jp.InputError, match="0 is not a number of parts"):
        jp.worst(jp.loads(paper_text()), certify=True, parts=0)


def test_the_command_prints_value_bound_and_gap(tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "four-bar.toml").write_text(paper_text(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["error", "four-bar.toml", "-q", "worst", "--certify"]) == 0
    out = capsys.readouterr().out
    assert "Proved: no offsets within the sets make a position error above 3.84" in out
    assert "bound" in out
    assert "gap" in out
    assert run(["error", "four-bar.toml", "-q", "worst"]) == 0
    assert "Proved" not in capsys.readouterr().out


def test_what_does_not_move_has_no_gap() -> None:
    """Without clearances values and bounds are rounding; their quotients were gaps of -4702 % and 42884 %."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"joints.*.clearance.radial": 0.0})
    result = jp.worst(m, certify=True)
    for name in ("position", "rotation"):
        assert (result[f"worst_{name}_certified"] >= result[f"worst_{name}"]).all()
        assert (result[f"worst_{name}_gap"] == 0.0).all()


def test_a_bound_of_what_is_not_attained_has_no_gap(tmp_path, monkeypatch, capsys) -> None:
    """The coupler of a parallelogram only shifts. A quotient by its rotation ended the command with an error."""
    links = {"start": (60.0, 0.0, 60.0), "body": "coupler", "at": "J3", "drive_error": 3.0}
    text = four_bar_text(50.0, 100.0, 50.0, 100.0, [60.0, 90.0], **links)
    result = jp.worst(jp.loads(text), certify=True, parts=1)
    assert (result.worst_rotation < 1e-10).all()
    assert (result.worst_rotation_certified > 1e-4).all()
    assert result.worst_rotation_gap.isnull().all()
    assert (result.worst_position_gap > 0).all()
    (tmp_path / "parallelogram.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    assert run(["error", "parallelogram.toml", "-q", "worst", "--certify", "--parts", "1"]) == 0
    assert "deg (nothing is attained)." in capsys.readouterr().out


def test_tolerances_without_limits_are_bounded_at_three_sigma() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    result = jp.worst(m.with_({"dimensions.l2.tolerance": {"sigma": 0.02}}), certify=True)
    assert result.attrs["bounded_at_three_sigma"] == "l2"
    wider = jp.worst(m.with_({"dimensions.l2.tolerance": 0.06}), certify=True)
    np.testing.assert_allclose(result.worst_position_certified, wider.worst_position_certified, rtol=1e-9)
    assert "bounded_at_three_sigma" not in wider.attrs


def test_maps_have_bounds_and_say_where_there_are_none(tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "five-bar.toml").write_text(jp.examples.text("five-bar"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    asked = ["map", "five-bar.toml", "-g", "x=-60:60:2", "-g", "y=120:200:2", "-q", "worst", "--certify"]
    assert run(asked) == 0
    out = capsys.readouterr().out
    assert "Proved: no offsets within the sets make a position error above 0.2" in out
    assert "Largest position error: 0.2" in out
    run([*asked, "--parts", "1", "--set", "joints.*.clearance.radial=6"])
    out = capsys.readouterr().out
    assert "Proved at 2 of 4 nodes: " in out
    assert "2 nodes without a bound: the poses could not be enclosed" in out
    line = ["map", "five-bar.toml", "-g", "x=-60:60:4", "-g", "y=120", "-q", "worst", "--certify", "--parts", "1"]
    run([*line, "--set", "joints.*.clearance.radial=8"])
    out = capsys.readouterr().out
    assert "nodes without a bound" in out
    assert "Configuration" not in out
