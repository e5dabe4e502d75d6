"""`allow` where a size can be too small as well: jammed teeth, bars that do not fit, strained members; or no effect."""

import math
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from jointplay.analyses.allow.asked import Use
from jointplay.analyses.allow.search import AllowSearch

TOLERANCE = 1e-4


def rigid_bar(deviation: float) -> jp.Mechanism:
    """A rigid bar between two pins of a frame, whose fits are too tight for it where it is too long."""
    length = {"body": "bar", "between": ["P", "Q"], "tolerance": 0.02, "deviation": deviation}
    pins = {f"joints.{name}.clearance": {"fit": fit, "diameter": 10} for name, fit in (("P", "H8/f7"), ("Q", "H7/g6"))}
    changes = {"bodies.bar": None, "limits.position": 0.5, "dimensions.length": length, **pins}
    return jp.loads(jp.examples.text("redundant-bar")).with_(changes)


def test_size_without_effect_is_allowed_up_to_the_largest_that_was_tried() -> None:
    """In the worst case allowed was zero and the slack negative, and no fit was named."""
    m = rigid_bar(0.03)
    result = jp.allow(m).sel(source=["P", "length"])
    assert (result.status == "no_effect").all()
    assert result.allowed.values == pytest.approx(m.length / m.units.length)
    assert result.fit.sel(source="P").item() == "H11/c11"


def test_size_that_decides_whether_a_mechanism_can_be_assembled_has_an_effect() -> None:
    m = rigid_bar(0.04)
    assert jp.worst(m.with_({"dimensions.length.tolerance": 0.0})).status.item() == "not_assemblable"
    assert jp.allow(m).status.sel(source="length").item() == "unlimited"


def test_fits_that_are_too_tight_to_be_assembled_are_passed_over() -> None:
    """The bar does not fit with H7/g6 in both pins; H11/c11 in one of them is enough, and keeps to the limit."""
    m = rigid_bar(0.04)
    assert jp.loaded(m).status.item() == "not_assemblable"
    result = jp.allow(m, "loaded")
    for name in ("P", "Q"):
        assert result.fit.sel(source=name).item() == "H11/c11"
        assert jp.loaded(m.with_({f"joints.{name}.clearance.fit": "H11/c11"})).limit_met.all()


def test_teeth_that_jam_need_more_backlash() -> None:
    """Allowed was zero for a gear pair whose runout takes its backlash, as if more of it made things worse."""
    m = jp.loads(jp.examples.text("geared-five-bar"))
    pins = {f"joints.{name}.clearance": None for name in "ABCDE"}
    drive = {**dict.fromkeys(("from", "to", "count", "error")), "values": [20]}
    m = m.with_({**pins, **{f"drives.motor.{key}": value for key, value in drive.items()}, "limits.position": 0.35})
    m = m.with_({"joints.mesh.ratio_error": None, "joints.mesh.runout": {"right": 0.015}})
    jammed = m.with_({"joints.mesh.clearance.backlash": 0.005})
    assert jp.worst(jammed).status.item() == "singular"
    expected = float(jp.allow(m).allowed.sel(source="mesh"))
    result = jp.allow(jammed).sel(source="mesh")
    assert float(result.allowed) == pytest.approx(expected, rel=2 * TOLERANCE)
    assert (str(result.status.item()), str(result.binding_quantity.item())) == ("ok", "position")


@pytest.mark.parametrize("zero", [True, False])
@pytest.mark.parametrize("is_monotone", [True, False])
@pytest.mark.parametrize("size", [0.0, 0.02, 0.95, 3.0])
def test_sizes_between_too_small_and_too_large_are_found(zero: bool, is_monotone: bool, size: float) -> None:
    """A window that neither halves nor false position hit by themselves; with zero nothing may be there to jam."""

    def use(new: float, near: Any) -> Use:
        if 0.0 < new < 0.9 or (new == 0.0 and not zero):
            return Use(math.inf, "assembly", 0)
        return Use(new, "position", 0)

    found = AllowSearch(use, size, use(size, None), 1000.0, 3.0, tolerance=TOLERANCE, is_monotone=is_monotone).found()
    assert found.status == "ok"
    assert found.allowed == pytest.approx(1.0, rel=2 * TOLERANCE)
    assert found.use.quantity == "position"


def test_play_that_a_strained_mechanism_needs_is_not_called_too_large() -> None:
    """The limit holds as it is; without the play of one pin the strained square misses it."""
    m = jp.loads(jp.examples.text("x-braced-square"))
    error = jp.loaded(m).error.sel(component=["x", "y"])
    m = m.with_({"limits": {"position": 1.05 * float(np.sqrt((error**2).sum("component")).max())}})
    result = jp.allow(m, "loaded")
    assert float(result.used) < 1.0 < float(result.used_without.sel(source="C"))
    assert result.status.sel(source="C").item() == "needs_play"
    assert math.isnan(result.allowed.sel(source="C").item())
