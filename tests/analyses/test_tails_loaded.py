"""Rare specimens where the load decides the offsets, on maps, and of several outputs and load cases."""

import copy
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import integrate, stats

import jointplay as jp
from helpers.answers import example
from helpers.arms import PLAYED
from helpers.oracles.rare import PRESSED, case
from jointplay.analyses import subset, tails
from jointplay.analyses.nominal import nominal
from jointplay.cli import run
from jointplay.errors import InputError
from jointplay.result import from_dataset
from jointplay.result.verdict import verdict
from verify_rare import find

FEW = 2**10
#: the pin of the arm is pressed along x, by 0.1 mm
PUSH = PLAYED.with_({"loads": [{"body": "rod", "at": [50, 0], "force": [10, 0]}]})
#: the same, both ways
CASES = PLAYED.with_(
    {
        f"load_cases.{name}": [{"body": "rod", "at": [50, 0], "force": [force, 0]}]
        for name, force in (("pull", -10), ("push", 10))
    }
)


def at_share(share: float) -> float:
    """What a pressed arm exceeds along x with this probability, mm."""
    return float(0.1 + 0.01 * stats.norm.isf(share))


def ask(m: jp.Mechanism, limits: dict[str, Any], **options: Any) -> Any:
    return jp.random(m.with_({"limits": limits}), samples=FEW, rare=True, **options).isel(configuration=0)


@pytest.mark.parametrize("share", [1e-4, 1e-7])
def test_a_pressed_pin_has_the_tail_of_the_length_that_scatters(share: float) -> None:
    found = ask(PUSH, {"x": {"high": at_share(share)}}, contact="loaded")
    assert found.outside_method == tails.SEARCHED
    assert found.outside_low < share < found.outside_high
    assert abs(float(found.outside) - share) < 4.0 * float(found.outside_standard_error) < 0.8 * share


def test_the_load_presses_every_specimen_within_its_own_play() -> None:
    """The bore scatters: the error along x is half of the play, which is uniform, and the length, which is normal."""
    bore = {"hole": {"diameter": 10.2, "tolerance": 0.06, "law": "uniform"}, "pin": {"diameter": 10}}
    high = at_share(1e-7)

    def outside(half: float) -> float:
        return float(stats.norm.sf((high - half) / 0.01)) / 0.06

    share, _ = integrate.quad(outside, 0.07, 0.13)
    found = ask(PUSH.with_({"joints.pivot.clearance": bore}), {"x": {"high": high}}, contact="loaded")
    assert found.outside_low < share < found.outside_high


def test_intervals_hold_the_share_of_a_random_pressed_chain() -> None:
    """Part of `verify_rare.py`."""
    found = find(case(10, PRESSED), 10)
    assert found.holds.all()
    assert not found.overlooks
    assert not found.contradicts


def test_both_contacts_are_searched_where_both_count() -> None:
    """Under the load the shares were counted, and a file with some ppm outside had less than 225 ppm."""
    m = PUSH.with_({"limits": {"x": {"high": at_share(1e-5)}}})
    result = jp.random(m, FEW, rare=True)
    found, alone = (one.isel(configuration=0) for one in (result, jp.random(m, FEW, contact="loaded", rare=True)))
    for end in ("", "_low", "_high", "_method"):
        assert found[f"outside_loaded{end}"] == alone[f"outside{end}"]
    assert found.outside_loaded_low < 1e-5 < found.outside_loaded_high
    assert 0.0 < found.outside < 1e-7
    text = " ".join(verdict(from_dataset(result)).sentences)
    assert re.search(r"Outside the limits where the load decides the offsets: (9|1\d)\.?\d* ppm .*by subset", text)
    assert re.search(r"Outside the limits where offsets scatter: \d+(\.\d+)? ppb .*by subset", text)


def test_the_load_case_with_the_largest_share_is_told_with_how_it_was_found() -> None:
    """Pushed 10 ppm are above, pulled 1 ppm below."""
    m = CASES.with_({"limits": {"x": {"low": -at_share(1e-6), "high": at_share(1e-5)}}})
    found = jp.random(m, FEW, rare=True).isel(configuration=0)
    assert found.outside_loaded_case == "push"
    assert found.outside_loaded_method == tails.SEARCHED
    assert found.outside_loaded_low < 1e-5 < found.outside_loaded_high


def test_every_load_case_is_searched_by_the_command(tmp_path: Path) -> None:
    file, out = tmp_path / "cases.toml", tmp_path / "found.nc"
    CASES.with_({"limits.x": {"low": -at_share(1e-6), "high": at_share(1e-5)}}).write(file)
    command = ["error", str(file), "-q", "random", "--samples", str(FEW), "--rare", "--contact", "loaded"]
    assert run([*command, "-o", str(out)]) == 0
    each = xr.open_dataset(out, engine="h5netcdf").isel(configuration=0)
    for name, share in (("pull", 1e-6), ("push", 1e-5)):
        one = each.sel(load_case=name)
        assert one.outside_low < share < one.outside_high
        assert one.outside_method == tails.SEARCHED


def test_nothing_scatters_where_a_load_decides_all_that_is_off() -> None:
    """The pin may be anywhere within 0.1 mm, and is at 0.1 mm, in all specimens."""
    for high, share in ((0.11, 0.0), (0.09, 1.0)):
        m = PUSH.with_({"dimensions": None, "limits": {"x": high, "y": 0.05}})
        result = jp.random(m, samples=16, contact="loaded", rare=True)
        found = result.isel(configuration=0)
        assert float(found.outside_low) == float(found.outside) == float(found.outside_high) == share
        assert share or verdict(from_dataset(result)).sentences[0].endswith("none of the specimens; nothing scatters.")


def test_the_worst_case_excludes_what_no_load_can_do() -> None:
    m = PUSH.with_({"dimensions.size.tolerance": 0.01})
    found = ask(m, {"x": 0.12}, contact="loaded")
    assert found.outside_method == tails.EXCLUDED
    assert float(found.outside_high) == 0.0


#: a slider-crank at a dead centre on which the load pushes: its crank goes to an end of its backlash
DEAD = jp.Builder(space="planar", units={"length": "mm", "angle": "deg"})
DEAD.revolute("J1", ground=(0, 0), crank=(0, 0))
DEAD.revolute("J2", crank=(50, 0), rod=(0, 0), position={"crank": {"x": 0.02}})
DEAD.revolute("J3", rod=(150, 0), ram=(0, 0))
DEAD.prismatic("J4", ground={"at": (0, 0), "axis": 0}, ram={"at": (0, 0), "axis": 0})
DEAD.start("ram", x=150)
DEAD.drive("q", joint="J1", values=[0], backlash=4)
DEAD.output(body="ram")
DEAD.load(force=(-100, 0))


def moved_and_counted(m: jp.Mechanism) -> list[np.ndarray]:
    """Errors of the same specimens, drawn one way and the other."""
    at = nominal(m).with_errors
    case, count = (at.drives[:1], at.poses[:1]), 256
    own = m.at_rest_under(0)
    kept = own.core.random(*case, count, 1, np.array([0.5]), loaded=True, keep=True, sampling="plain")["kept_errors"]
    moved = subset.Specimens(own, *case, None, True)
    return [moved.errors(own.core.specimens(count, 1, None, "plain")), kept]


@pytest.mark.parametrize("name", ["four-bar-fits", "slider-crank", "press", "excavator", "geared-five-bar", "rssr"])
def test_specimens_that_are_moved_are_pressed_as_counted_ones_are(name: str) -> None:
    """The same numbers drawn: errors specimen by specimen."""
    found, kept = moved_and_counted(example(name))
    np.testing.assert_allclose(found, kept, rtol=0, atol=1e-12 * np.abs(kept).max())
    assert np.ptp(found, axis=0).max() > 0.0


def test_specimens_leave_a_dead_centre_whichever_way_they_are_drawn() -> None:
    found, kept = moved_and_counted(DEAD.mechanism())
    # In metres: errors in the square of the play are those of rounding in the lengths.
    np.testing.assert_allclose(found, kept, rtol=0, atol=1e-15)
    assert found[:, 0].min() < np.median(found[:, 0]) == pytest.approx(-40.6e-6, abs=3e-6)


#: a slider of which a map is made: more of it is outside the farther it is, as it tilts
TILT = jp.Builder(space="planar", units={"length": "mm", "angle": "deg"})
TILT.prismatic("P", ground={"at": (0, 0), "axis": 0}, slide={"at": (0, 0), "axis": 0})
TILT.revolute("R", slide=(0, 0), arm=(0, 0))
TILT.drive("reach", joint="P", values=[100], error={"sigma": 0.01})
TILT.drive("turn", joint="R", values=[90], error={"sigma": 0.1})
TILT.output(body="arm", at=(10, 0))
TILT.limits(x={"high": 0.03})
TILT.grid(turn={"values": (90, 45, 0)}, reach=100)


def test_maps_say_how_each_share_was_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Chunks after a counted one had "by subs" in place of "by subset simulation"."""
    m = TILT.mechanism()
    along = {"drives.turn.values": [90, 45, 0], "drives.reach.values": [100] * 3}
    at_nodes = jp.random(m.with_(along), samples=2**14, rare=True)
    assert at_nodes.outside_method.values.tolist() == [tails.COUNTED, tails.SEARCHED, tails.SEARCHED]
    file, out = tmp_path / "tilt.toml", tmp_path / "map.zarr"
    file.write_text(TILT.text())
    command = ["map", str(file), "-q", "random", "--samples", str(2**14), "--rare", "--chunk", "1"]
    assert run([*command, "-o", str(out)]) == 0
    for found in (jp.map(m, "random", chunk=1, samples=2**14, rare=True), xr.open_zarr(out, chunks=None)):
        assert found.outside_method.values.tolist() == at_nodes.outside_method.values.tolist()
        np.testing.assert_array_equal(found.outside, at_nodes.outside)
        # At 0 degrees the error along x is that of the slider.
        assert found.outside_low[2] < stats.norm.sf(3.0) < found.outside_high[2]
    assert run([*command[:3], "worst", "--rare"]) == 2
    assert "--rare: is an option of random; asked: worst" in capsys.readouterr().err


def test_outputs_without_limits_are_left_out() -> None:
    """A file with limits at one of its outputs was told that it has none."""
    raw = copy.deepcopy(dict(PUSH.raw))
    limits = {"x": {"high": at_share(1e-5)}}
    raw["outputs"] = {"arm": {"body": "arm", "at": [0, 0]}, "rod": {**raw.pop("output"), "limits": limits}}
    raw["dimensions"]["size"]["between"] = ["guide", "rod"]
    found = jp.random(jp.Mechanism(raw), FEW, rare=True, contact="scattered").isel(configuration=0)
    assert found.outside_method.sel(output="arm") == ""
    assert math.isnan(found.outside.sel(output="arm"))
    assert 0.0 < found.outside.sel(output="rod") < 1e-7
    assert found.outside_method.sel(output="rod") == tails.SEARCHED


@pytest.mark.parametrize("contact", [None, "scattered", "loaded"])
def test_what_cannot_be_searched_is_refused_before_the_work(contact: str | None) -> None:
    over = example("planetary-gear").with_({"limits": {"rotation": 1}})
    with pytest.raises(InputError, match="over-constrained"):
        jp.random(over, rare=True, contact=contact)
    with pytest.raises(InputError, match="over-constrained"):
        jp.map(over, "random", {"sun": [0, 10]}, rare=True, contact=contact)
    with pytest.raises(InputError, match="the file has none"):
        jp.random(PUSH, rare=True, contact=contact)
