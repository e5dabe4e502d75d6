"""`allow` with a yield: what it says of sizes that jam, of loads that decide where clearances are, of unknown poses."""

import math
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.analyses.allocate import compute as allocate
from jointplay.analyses.allow import compute, keeps
from jointplay.analyses.allow.asked import Use
from jointplay.analyses.allow.search import AllowSearch
from jointplay.cli import run
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.table.allow import overview

ARM = planar()
ARM.revolute("J1", ground=(0, 0), arm=(0, 0), clearance=jp.radial(0.05))
ARM.drive("a", joint="J1", values=[0])
ARM.dimension("reach", body="arm", between=["J1", "output"], tolerance=0.001)
ARM.output(body="arm", at=(100, 0))
ARM.load(force=(0, -10))
ARM.limits(y=0.045, probability=0.9)


def meshing(backlash: float) -> jp.Mechanism:
    """Two gears whose runout can take the backlash; the pins have no play."""
    m = jp.loads(jp.examples.text("geared-five-bar"))
    pins = {f"joints.{name}.clearance": None for name in "ABCDE"}
    drive = {**dict.fromkeys(("from", "to", "count", "error")), "values": [20]}
    m = m.with_({**pins, **{f"drives.motor.{key}": value for key, value in drive.items()}, "limits.position": 1.5})
    m = m.with_({"joints.mesh.ratio_error": None, "joints.mesh.runout": {"right": 0.015}, "loads": None})
    return m.with_({"joints.mesh.clearance.backlash": backlash})


def test_teeth_that_jam_are_told_as_such_and_not_as_an_error_that_is_too_large():
    """Allowed was zero and the slack negative, beyond y, under the sentence that the limits hold."""
    result = compute(meshing(0.1), "random", samples=1000, tolerance=0.01)
    k = result.labels("source").index("mesh")
    own, allowed, smallest, jammed = (result.get(name)[k] for name in ("size", "allowed", "smallest", "too_small"))
    assert smallest <= own <= allowed
    assert 0.0 < jammed < smallest
    lost = jp.random(meshing(float(jammed)), samples=1000).failures
    assert float(result.get("too_small_not_assembled")[k]) == pytest.approx(1.0 - lost.sel(outcome="ok").item() / 1000)
    notes = " ".join(overview(result)[0].notes)
    assert "of the specimens cannot be assembled at" in notes
    assert conclude(result).sentences[0].text.startswith("The limits hold: ")
    # The same where the size in the file is one of those that jam.
    result = compute(meshing(0.005), "random", samples=1000, tolerance=0.01)
    sentence = conclude(result).sentences[0]
    assert sentence.is_alarm
    assert "of the specimens cannot be assembled" in sentence.text
    assert float(result.get("allowed")[k]) == pytest.approx(float(allowed), rel=0.03)


def test_what_a_larger_size_misses_is_named_not_what_others_miss_at_any_size():
    """At zero degrees the error of the drive moves y alone, yet x was named, which the reach misses more often."""
    b = planar(angle="rad")
    b.revolute("J1", ground=(0, 0), arm=(0, 0))
    b.drive("a", joint="J1", values=[0], error=5e-5)
    b.dimension("reach", body="arm", between=["J1", "output"], tolerance=0.01, law="uniform")
    b.output(body="arm", at=(100, 0))
    b.limits(x=0.0093, y=0.01, probability=0.9)
    result = jp.allow(b.mechanism(), "random", samples=20_000)
    # 7 % of the specimens miss x; with a largest error e of the drive 1 - 0.0001 / e of all miss y.
    assert float(result.allowed.sel(source="a")) == pytest.approx(1e-4 * 0.93 / 0.9, rel=0.01)
    assert result.binding_quantity.sel(source="a").item() == "y"
    assert result.binding_quantity.sel(source="reach").item() == "x"


@pytest.mark.parametrize("seed", range(40))
def test_a_size_that_holds_is_never_more_than_what_is_allowed(seed):
    """Limits that are missed at smaller sizes, at larger ones, at both, in windows anywhere."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.uniform(0.0, 3.0, 4))
    what = [str(name) for name in rng.choice(["position", "assembly"], 3)]

    def use(new: float, near: Any) -> Use:
        place = int(np.searchsorted(edges, new))
        if place in (1, 3):
            return Use(1.0 + abs(new - edges[place - 1]), what[place // 2], 0)
        return Use(0.5, "position", 0) if place < 4 else Use(2.0 + new, what[2], 0)

    size = float(rng.uniform(0.0, 3.0))
    found = AllowSearch(use, size, use(size, None), 100.0, 1.0, tolerance=1e-4, is_monotone=False).found()
    if use(size, None).holds and found.status in ("ok", "unlimited", "no_effect"):
        assert found.allowed >= size
        assert found.smallest <= size
    if math.isfinite(found.smallest) and math.isfinite(found.too_small):
        assert use(found.smallest, None).holds
        assert not use(found.too_small, None).holds
        assert found.too_small < found.smallest <= found.allowed


def test_a_pin_is_as_large_as_both_assumptions_leave_it():
    """Play of 0.05 scatters within 0.045 for most arms; the load takes every one of them to 0.05."""
    m = ARM.mechanism()
    found = {c: jp.allow(m, "random", samples=2000, contact=c).sel(source="J1") for c in ("scattered", "loaded")}
    both = jp.allow(m, "random", samples=2000).sel(source="J1")
    assert float(found["scattered"].used) < 1.0 < float(both.used)
    assert float(both.allowed) == pytest.approx(min(float(one.allowed) for one in found.values()), rel=1e-3)
    assert float(both.allowed) == pytest.approx(0.045, rel=0.01)
    assert both.used_contact == "loaded"
    text = [conclude(compute(m, "random", samples=2000, **o)).sentences[0].text for o in ({}, {"contact": "scattered"})]
    assert text[0].startswith("The limits are missed with offsets that scatter and with offsets that the load decides:")
    assert text[0].endswith("with offsets that the load decides, at configuration 0.")
    assert text[1].startswith("The limits hold with offsets that scatter:")
    # Without a load there is nothing to say.
    alone = conclude(compute(m.with_({"loads": None}), "random", samples=2000)).sentences[0].text
    assert alone.startswith("The limits hold: ")


def test_limits_are_not_shown_where_a_configuration_has_no_pose(tmp_path, capsys):
    """The limits held, it said, of a crank that cannot turn so far."""
    text = jp.examples.text("slider-crank")
    m = jp.loads(text)
    drive = next(iter(m.raw["drives"]))
    values = {f"drives.{drive}.{key}": None for key in ("from", "to", "count")} | {f"drives.{drive}.values": [10, 90]}
    m = m.with_({**values, "joints.wristpin.on.rod": [45, 0], "limits": {"y": 99}})
    m = m.with_({"dimensions": None, f"drives.{drive}.error": None, "joints.crankpin.clearance": None})
    m = m.with_({"joints.wristpin.clearance": None, "joints.guide.clearance": None})
    assert jp.solve(m).status.values.tolist() == ["ok", "not_assembled"]
    for question, options in (("worst", {}), ("random", {"samples": 400, "contact": "scattered"})):
        result = compute(m, question, tolerance=0.05, **options)
        first = conclude(result).sentences[0]
        assert first.is_alarm
        assert first.text.startswith("Not shown: whether the limits hold")
        assert not keeps(result)
    path = tmp_path / "m.toml"
    m.write(path)
    assert run(["allow", str(path)]) == 1
    assert "Not shown: whether the limits hold; configuration 1 cannot be assembled." in " ".join(
        capsys.readouterr().out.split()
    )


def test_a_share_of_specimens_is_said_to_be_of_one_output():
    """Each of two arms missed its limit with 0.5 % of the specimens, which were called all that are outside."""
    b = planar()
    for k, (name, value) in enumerate((("U", 30), ("V", 60))):
        b.revolute(f"J{name}", ground=(300 * k, 0), **{name.lower(): (0, 0)})
        b.drive(f"q{name}", joint=f"J{name}", values=[value], error={"sigma": 0.02})
        b.output(name, body=name.lower(), at=(100, 0), limits={"position": 0.098})
        b.cost(f"q{name}", model="reciprocal", b=1, from_=0.005, to=0.1)
    b.limits(probability=0.98)
    m = b.mechanism()
    result = compute(m, "random", samples=2000, tolerance=0.05)
    texts = [sentence.text for sentence in conclude(result).sentences]
    worst = str(result.get("used_output"))
    assert worst in m.outputs
    assert f"% of the specimens are outside the limits of output {worst}, 2 % may be" in texts[0]
    assert f"position of output {result.get('factor_binding_output')} at" in texts[1]
    cheapest = allocate(m, "random", samples=2000)
    for table in (overview(result)[0], tables(cheapest)[0]):
        assert any(note.startswith("Each output is judged by itself") for note in table.notes)
    (yielded,) = (line for line in jp.check(m).attrs["limits"].split("\n") if "%" in line)
    assert yielded.endswith("of each output by itself")
