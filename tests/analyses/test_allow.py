"""`allow`: at the allowed size the limits hold, a little beyond it they are missed; in every question and space."""

import itertools
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointplay as jp
from helpers.builders import planar
from helpers.strategies import mechanisms, searching
from jointplay.analyses.allow import compute
from jointplay.analyses.allow import keeps as is_kept
from jointplay.analyses.allow.asked import ASSEMBLY, Asked, Use
from jointplay.analyses.allow.order import _last
from jointplay.analyses.loaded import compute as loaded
from jointplay.analyses.nominal import Interrupted
from jointplay.model.sizing import Sizing, sizings
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.verdict import is_good

TOLERANCE = 1e-4
#: a mechanism whose worst case is a sum: the play of J2 shifts the output, that of J1 as well
CHAIN = planar()
CHAIN.revolute("J1", ground=(0, 0), upper=(0, 0), clearance=jp.radial(0.03))
CHAIN.revolute("J2", upper=(100, 0), lower=(0, 0), clearance=jp.radial(0.02))
CHAIN.drive("a", joint="J1", values=(0, 30, 60))
CHAIN.drive("b", joint="J2", values=[20])
CHAIN.dimension("reach", body="lower", between=["J2", "output"], tolerance=0.01)
CHAIN.output(body="lower", at=(80, 0))
CHAIN.limits(position=0.1)

#: a pin that the load presses down in its hole
LOADED_PIN = planar()
LOADED_PIN.revolute("A", ground=(0, 0), c=(0, 0), clearance=jp.fit("H7/f7", diameter=20))
LOADED_PIN.drive("d", joint="A", values=[0])
LOADED_PIN.output(body="c", at=(50, 0))
LOADED_PIN.load(force=(0, -10))
LOADED_PIN.limits(y=0.025)

SLIDER = planar()
SLIDER.prismatic(
    "guide", ground={"at": (0, 0), "axis": 0}, slider={"at": (0, 0), "axis": 0}, clearance=jp.gap(0.02, length=40)
)
SLIDER.drive("x", joint="guide", values=[10])
SLIDER.output(body="slider", at=(0, 0))


def one(m: jp.Mechanism, name: str) -> Sizing:
    return next(one for one in sizings(m)[1] if one.name == name)


def keeps(m: jp.Mechanism, question: str, **options: Any) -> bool:
    """Whether limits hold, from the public results and the limits as the file has them."""
    limits = m.raw["limits"]
    # An error that is beyond a limit by rounding misses none.
    rounding = dict.fromkeys(("rotation", *m.components), 1.01e-10 / m.units.angle)
    rounding |= dict.fromkeys(("position", *"xyz"), 1.01e-10 * m.length / m.units.length)
    if question == "worst":
        result = jp.worst(m, **options)
        found = {"position": result.worst_position, "rotation": result.worst_rotation}
    else:
        result = jp.loaded(m, **options)
        lengths = [c for c in m.components if c in "xyz"]
        angles = [c for c in m.components if c not in lengths]
        size = abs(result.error) + result.undetermined
        found = {
            "position": np.sqrt((size.sel(component=lengths) ** 2).sum("component")),
            "rotation": np.sqrt((size.sel(component=angles) ** 2).sum("component")),
        }
    for name in set(limits) & set(m.components) if question == "worst" else ():
        low, high = (end + sign * rounding[name] for end, sign in zip(limits[name], (-1.0, 1.0), strict=True))
        ends = result.worst_component.sel(component=name)
        if not ((ends.sel(side="low") >= low).all() and (ends.sel(side="high") <= high).all()):
            return False
    good = result.status.isin(["ok", "undetermined", "strained"]).all()
    return bool(good) and all(
        bool((value <= limits[q] + rounding[q]).all()) for q, value in found.items() if q in limits
    )


def check(m: jp.Mechanism, result: Any, question: str, tolerance: float = TOLERANCE, **options: Any) -> int:
    """Every answer against the question itself; how many have an allowed size."""
    base, _ = sizings(m)
    counted = 0
    for name in result.source.values.tolist():
        here = result.sel(source=name)
        source = one(m, name)
        allowed, status = float(here.allowed), str(here.status.item())
        if status in ("not_enough", "needs_play"):
            assert math.isnan(allowed)
            assert not keeps(base.with_(source.resized(0.0)), question, **options)
            assert keeps(base, question, **options) == (status == "needs_play")
            continue
        assert keeps(base.with_(source.resized(allowed)), question, **options), (name, allowed)
        assert float(here.slack) == pytest.approx(allowed - source.size, abs=1e-12)
        if status == "ok":
            counted += 1
            beyond = allowed * (1.0 + 2.0 * tolerance) or 1e-6
            assert not keeps(base.with_(source.resized(beyond)), question, **options), (name, allowed)
    return counted


def test_serial_chain_may_have_what_the_others_leave_of_the_limit() -> None:
    """The worst case of the chain is the sum of its sizes, the same in every configuration."""
    m = CHAIN.mechanism()
    result = jp.allow(m)
    sizes = {"J1": 0.03, "J2": 0.02, "reach": 0.01}
    for name, size in sizes.items():
        expected = 0.1 - (sum(sizes.values()) - size)
        assert float(result.allowed.sel(source=name)) == pytest.approx(expected, rel=2 * TOLERANCE)
        assert float(result.used_without.sel(source=name)) == pytest.approx((sum(sizes.values()) - size) / 0.1)
    assert float(result.used) == pytest.approx(0.6)
    assert float(result.allowed_factor) == pytest.approx(0.1 / 0.06, rel=2 * TOLERANCE)
    assert (result.status == "ok").all()
    assert (result.binding_quantity == "position").all()


def test_slider_turns_as_far_as_its_guide_lets_it() -> None:
    """Rotation and shift share the gap: |y| + (length / 2) |angle| <= gap."""
    m = SLIDER.mechanism().with_({"limits.rotation": 0.1})
    result = jp.allow(m)
    assert float(result.allowed.sel(source="guide")) == pytest.approx(20 * math.radians(0.1), rel=2 * TOLERANCE)
    result = jp.allow(m.with_({"limits": {"y": [-0.03, 0.05]}}))
    assert float(result.allowed.sel(source="guide")) == pytest.approx(0.03, rel=2 * TOLERANCE)
    assert result.binding_quantity.item() == "y"


def test_allowed_size_is_where_a_sweep_of_the_size_crosses_the_limit() -> None:
    """Brute force: the four-bar's worst case at many sizes of one clearance."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits": {"position": 4.0}})
    sizes = np.linspace(0.0, 2.0, 101)
    for name in ("J3", "J4"):
        swept = jp.sweep(m, f"joints.{name}.clearance.radial", sizes.tolist())
        holds = (swept.worst_position <= 4.0).all("configuration").values
        last = sizes[np.flatnonzero(~holds)[0] - 1]
        allowed = float(jp.allow(m).allowed.sel(source=name))
        assert last <= allowed <= last + sizes[1]


SEARCH = searching(6)


@SEARCH
@given(mechanisms(), st.floats(0.3, 3.0), st.booleans())
def test_limits_hold_at_allowed_sizes_and_not_beyond(text: str, share: float, two: bool) -> None:
    """Random planar mechanisms, limits above and below what is used."""
    m = jp.loads(text)
    worst = jp.worst(m)
    limits: dict[str, Any] = {"position": share * float(worst.worst_position.max())}
    if two:
        x = worst.worst_component.sel(component="x")
        limits["x"] = [share * float(x.sel(side="low").min()), 0.9 * share * float(x.sel(side="high").max())]
    m = m.with_({"limits": limits})
    result = jp.allow(m)
    check(m, result, "worst")
    factor = float(result.allowed_factor)
    if str(result.factor_status.item()) == "ok":
        for times, expected in ((factor, True), (factor * (1.0 + 2.0 * TOLERANCE), False)):
            base, sources = sizings(m)
            changes = {k: v for s in sources if s.size for k, v in s.resized(times * s.size).items()}
            assert keeps(base.with_(changes), "worst") == expected


def arm_in_space(rng: np.random.Generator) -> jp.Mechanism:
    """Three pins with axes in any direction, one after the other."""
    bodies = ["ground", "shoulder", "elbow", "hand"]
    places = np.cumsum(rng.uniform(-100.0, 100.0, (4, 3)), axis=0).tolist()
    joints = {
        f"J{k}": {
            "type": "revolute", "bodies": bodies[k : k + 2], "at": places[k], "axis": rng.normal(size=3).tolist(),
            "clearance": {"radial": rng.uniform(0.01, 0.05), "axial": rng.uniform(0.0, 0.05), "length": 30.0},
        }
        for k in range(3)
    }  # fmt: skip
    drives = {f"q{k}": {"joint": f"J{k}", "values": rng.uniform(-60.0, 60.0, 2).tolist()} for k in range(3)}
    drives["q1"]["error"] = 0.02
    return jp.Mechanism(
        {
            "format": 1,
            "space": "spatial",
            "units": {"length": "mm", "angle": "deg", "force": "N"},
            "joints": joints,
            "drives": drives,
            "output": {"body": "hand", "at": places[3]},
        }
    )


def linkage_in_space(rng: np.random.Generator) -> jp.Mechanism:
    """The bundled RSSR with other sizes and plays."""
    pins = {
        f"joints.{name}.clearance": {"radial": rng.uniform(0.01, 0.05), "axial": rng.uniform(0.0, 0.05), "length": 30.0}
        for name in ("crank", "hook", "rocker")
    }
    crank, rocker = 30.0 * rng.uniform(0.6, 1.2), 100.0 * rng.uniform(0.95, 1.1)
    return jp.loads(jp.examples.text("rssr")).with_(
        {
            **dict.fromkeys(f"drives.theta.{key}" for key in ("from", "to", "count")),
            "drives.theta.values": rng.uniform(0.0, 360.0, 2).tolist(),
            "joints.hook.on.crank.at": [crank, 0.0, 5.0 * rng.normal()],
            "joints.ball.on.rocker": [0.0, 0.0, rocker],
            "joints.ball.clearance.radial": rng.uniform(0.01, 0.05),
            "dimensions.coupler.tolerance": rng.uniform(0.01, 0.1),
            **pins,
        }
    )


@pytest.mark.parametrize("make", [arm_in_space, linkage_in_space])
@pytest.mark.parametrize("seed", range(3))
def test_limits_hold_at_allowed_sizes_of_random_mechanisms_in_space(make: Any, seed: int) -> None:
    """A component to both sides, unequally, beside position or rotation; above and below what is used."""
    rng = np.random.default_rng(seed)
    m = make(rng)
    worst = jp.worst(m)
    assert (worst.status == "ok").all()
    size, name = str(rng.choice(["position", "rotation"])), str(rng.choice(m.components))
    ends = worst.worst_component.sel(component=name)
    limits: dict[str, Any] = {size: rng.uniform(0.9, 2.0) * float(worst[f"worst_{size}"].max())}
    sides = float(ends.sel(side="low").min()), float(ends.sel(side="high").max())
    limits[name] = [float(rng.uniform(0.9, 2.0)) * end for end in sides]
    m = m.with_({"limits": limits})
    assert check(m, jp.allow(m, tolerance=1e-3), "worst", 1e-3) > 0


@SEARCH
@given(mechanisms(), st.floats(0.5, 2.0))
def test_loaded_limits_hold_at_every_step_up_to_allowed(text: str, share: float) -> None:
    m = jp.loads(text)
    if not m.has_loads:
        return
    error = jp.loaded(m)
    largest = float(np.sqrt((error.error[:, :2] ** 2).sum("component")).max())
    m = m.with_({"limits": {"position": share * largest}})
    result = jp.allow(m, "loaded")
    check(m, result, "loaded")
    base, _ = sizings(m)
    for name in result.source.values[result.status.values == "ok"][:2].tolist():
        allowed = float(result.allowed.sel(source=name))
        for part in (0.21, 0.55, 0.86):
            assert keeps(base.with_(one(m, name).resized(part * allowed)), "loaded")


@pytest.mark.parametrize("name", ["rssr", "slider-crank-cases", "excavator", "3-upu"])
def test_limits_hold_at_allowed_sizes_of_bundled_mechanisms(name: str) -> None:
    """In space, with fits, patterns, several outputs and load cases."""
    m = jp.loads(jp.examples.text(name))
    m = m.only(m.outputs[0] if m.outputs else None, m.load_cases[0] if m.load_cases else None)
    # Two configurations where a file has more.
    drives = {"excavator": "patterns.cylinder.drives", "rssr": "drives", "slider-crank-cases": "drives"}
    changes: dict[str, object] = {f"{drives[name]}.*.count": 2} if name in drives else {}
    m = m.with_({**changes, "limits": None})
    used = float(jp.worst(m).worst_position.max())
    m = m.with_({"limits.position": 1.3 * used})
    if m.data.outputs:
        # Limits of an output stand in it.
        m = m.with_({f"outputs.{m.of[0]}.limits": None})
    assert check(m, jp.allow(m, tolerance=1e-3), "worst", 1e-3) > 0


@pytest.mark.parametrize("name", ["redundant-bar", "x-braced-square", "bennett"])
def test_over_constrained_mechanisms_keep_their_limits(name: str) -> None:
    m = jp.loads(jp.examples.text(name)).with_({"limits": {"position": 1.5}})
    result = jp.allow(m, tolerance=1e-3)
    assert check(m, result, "worst", 1e-3) > 0
    assert "needed" in result


def test_what_needs_no_play_has_no_column_of_zeros() -> None:
    """Beside a worm whose teeth jam with little backlash it said that none is needed."""
    m = jp.loads(jp.examples.text("arm-with-gearboxes"))
    m = m.with_({f"drives.{name}.values": [drive["values"][0]] for name, drive in m.raw["drives"].items()})
    result = compute(m, tolerance=1e-2)
    assert np.nanmax(result.get("needed")) == 0.0
    (table,) = tables(result)
    assert "needed" not in [column.name for column in table.columns]
    assert not any("without strain" in note for note in table.notes)


def test_needed_clearance_of_a_bar_that_is_there_twice() -> None:
    """Two pins a distance apart, and a bar that is up to `tolerance` too long: both plays together have to take it."""
    m = jp.loads(jp.examples.text("redundant-bar")).with_({"limits.position": 1.0})
    tolerance = float(m.value("dimensions.length.tolerance"))
    result = jp.allow(m)
    sizes = result["size"].sel(source=["P", "Q"])
    expected = tolerance - sizes.values[::-1]
    bodies = result.needed.sel(source=["P", "Q"]).values
    deviation = float(m.raw["dimensions"]["length"].get("deviation", 0.0))
    assert bodies == pytest.approx(expected + deviation, rel=2 * TOLERANCE)


def test_specimens_keep_to_the_limits_at_allowed_sizes() -> None:
    """`random`: the share of the specimens outside is met at `allowed`, and missed beyond its error."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits": {"position": 3.0, "probability": 0.95}})
    m = m.with_({"drives.theta1.values": [22.7, 48.98, 76.39]})
    result = jp.allow(m, "random", samples=5_000, contact="scattered")
    base, _ = sizings(m)
    for name in ("J1", "J4"):
        allowed = float(result.allowed.sel(source=name))
        error = float(result.allowed_standard_error.sel(source=name))
        assert 0.0 < error < 0.2 * allowed
        for size, expected in ((allowed, True), (allowed * 1.0002, False)):
            copy = base.with_(one(m, name).resized(size))
            outside = jp.random(copy, samples=5_000).outside
            assert bool((outside <= 0.05 + 1e-12).all()) == expected
        # Other specimens agree within the error.
        other = jp.allow(m, "random", samples=5_000, seed=1, contact="scattered").allowed.sel(source=name)
        assert float(other) == pytest.approx(allowed, abs=6 * error)


def test_a_share_of_nearly_all_specimens_allows_less_than_a_share_of_half() -> None:
    m = CHAIN.mechanism().with_({"limits.position": 0.04})
    half, most = (jp.allow(m, "random", probability=p, samples=4000).allowed_factor.item() for p in (0.5, 0.99))
    worst = jp.allow(m).allowed_factor.item()
    assert worst < most < half


def test_several_outputs_and_load_cases_hold_at_once() -> None:
    """All outputs have to keep to their limits: the smallest of what each one alone allows."""
    changes: dict[str, object] = {
        "output": None,
        "outputs": {"pin": {"body": "rocker", "at": [150, 0]}, "mid": {"body": "coupler", "at": [40, 10]}},
        "loads": [{"body": "rocker", "at": [150, 0], "force": [0, -10]}],
        "limits": {"position": 4.0},
        "outputs.mid.limits": {"position": 3.1},
        "load_cases": {"up": [{"body": "rocker", "force": [0, 30]}], "side": [{"body": "rocker", "force": [30, 0]}]},
    }
    m = jp.loads(jp.examples.text("four-bar")).with_({**changes, "drives.theta1.values": [22.7, 48.98, 76.39]})
    for question in ("worst", "loaded"):
        both = jp.allow(m, question)
        alone = [jp.allow(m.only(output=name), question).allowed.values for name in m.outputs]
        finite = both.status.values == "ok"
        assert both.allowed.values[finite] == pytest.approx(np.min(alone, axis=0)[finite], rel=4 * TOLERANCE)
        assert set(both.binding_output.values[finite].tolist()) <= {"pin", "mid"}
    assert set(both.binding_load_case.values[finite].tolist()) <= {"up", "side"}


def test_fit_is_the_loosest_that_holds() -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits": {"position": 0.12}, "joints.*.clearance.radial": 0.02})
    m = m.with_({"joints.J2.clearance": {"fit": "H7/g6", "diameter": 12}})
    m = m.with_({"joints.J3.clearance": {"bearing": "CN", "bore": 25}, "joints.J4.clearance.diameter": 16})
    result = jp.allow(m)
    base, _ = sizings(m)
    for name in ("J2", "J4"):
        fit = str(result.fit.sel(source=name).item())
        names = one(m, name).fits(base)
        looser = names[names.index(fit) + 1]
        assert keeps(base.with_(one(m, name).of_fit(fit)), "worst")
        assert not keeps(base.with_(one(m, name).of_fit(looser)), "worst")
    group = str(result.fit.sel(source="J3").item())
    assert keeps(base.with_(one(m, "J3").of_bearing(group)), "worst")
    assert result.fit.sel(source="J1").item() == ""


@pytest.mark.parametrize("is_monotone", [True, False])
def test_fits_are_looked_at_as_few_times_as_needed(is_monotone: bool) -> None:
    """The last of the names that holds, of every number of names too tight, held and missed; by halves if it can be."""
    for tight, held, missed in itertools.product(range(4), repeat=3):
        uses = [Use(np.inf, ASSEMBLY, 0)] * tight + [Use(0.5, "x", 0)] * held + [Use(2.0, "x", 0)] * missed
        asked: list[int] = []

        def use(changes: dict[str, int], uses: list[Use] = uses, asked: list[int] = asked) -> Use:
            asked.append(changes["fit"])
            return uses[changes["fit"]]

        names = [str(k) for k in range(len(uses))]
        looker: Any = SimpleNamespace(is_monotone=is_monotone, use=use)
        found = _last(looker, names, lambda name: {"fit": int(name)})
        assert found == (names[tight + held - 1] if held else "")
        assert len(asked) <= (len(names).bit_length() if is_monotone else tight + held + 1)


def test_where_nothing_is_strained_members_that_give_way_cost_no_more_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an arm with the stiffness of its gearboxes sizes were tried in 16 steps each, which took ten seconds."""
    looks = 0
    own = Asked.use

    def use(*args: Any) -> Use:
        nonlocal looks
        looks += 1
        return own(*args)

    monkeypatch.setattr(Asked, "use", use)
    rigid = jp.loads(jp.examples.text("serial-2r")).with_({"limits": {"position": 1.0}, "loads": None})
    expected, of_rigid = jp.allow(rigid), looks
    result = jp.allow(rigid.with_({f"drives.{name}.stiffness": 1e5 for name in rigid.drives}))
    # The search is for the same numbers up to rounding, and may end a step sooner or later.
    assert looks - of_rigid <= of_rigid + len(result.source)
    np.testing.assert_allclose(result.allowed, expected.allowed, rtol=2.0 * TOLERANCE)
    np.testing.assert_allclose(result.allowed_factor, expected.allowed_factor, rtol=2.0 * TOLERANCE)


def test_loaded_limits_hold_with_every_size_of_a_fit() -> None:
    """An allowed fit was one whose largest play `error` said to miss the limit: only the middle size was asked."""
    m = LOADED_PIN.mechanism()
    result = jp.allow(m, "loaded")
    # The load moves the pin by all of its play: 0.041 + 0.021 mm in diameter.
    assert float(result.used) == pytest.approx(0.031 / 0.025, rel=1e-6)
    assert result.allowed.item() == pytest.approx(0.025, rel=2 * TOLERANCE)
    assert not is_good(loaded(m))
    assert conclude(compute(m, "loaded")).sentences[0].text.startswith("The limits are missed: y uses 124 %")
    fit = result.fit.item()
    names = one(m, "A").fits(m)
    for name, holds in ((fit, True), (names[names.index(fit) + 1], False)):
        ordered = m.with_(one(m, "A").of_fit(name))
        assert is_good(loaded(ordered)) == is_kept(compute(ordered, "loaded")) == holds
    for changed, sizes, basis in (
        (m.with_(one(m, "A").of_fit(fit)), "middle", "with clearances of any size in their limits"),
        (m, "smallest", "with the smallest play"),
    ):
        said = conclude(compute(changed, "loaded", sizes=sizes)).sentences[0].text
        assert said.startswith(f"The limits hold {basis}: y uses")


def test_why_no_fit_is_named() -> None:
    """One who had given H7/p6 and a diameter was told that the diameter is needed."""
    pin = LOADED_PIN.mechanism().with_({"limits": {"position": 0.01}})
    for clearance, status, words in (
        ({"fit": "H7/p6", "diameter": 20}, "no_fit_holds", "with the tightest of the preferred clearance fits"),
        ({"radial": 0.02}, "no_diameter", "it needs the diameter"),
        ({"radial": 0.02, "diameter": 9000}, "not_in_standard", "the standard has none"),
        ({"bearing": "CN", "bore": 200}, "no_group_holds", "with the tightest group of bearings"),
        ({"fit": "H7/g6", "diameter": 2}, "", ""),
    ):
        result = compute(pin.with_({"joints.A.clearance": clearance}))
        assert result.get("without_fit").tolist() == [status]
        (table,) = tables(result)
        said = " ".join(note for note in table.notes if note.startswith("No fit is named for A"))
        assert bool(said) == bool(status)
        assert words in said


def test_source_that_matters_to_nothing_has_no_effect() -> None:
    """A tolerance has no direction under a load; the file's limit says nothing of it."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 4.0})
    result = jp.allow(m, "loaded")
    assert result.status.sel(source="l2").item() == "no_effect"


def test_no_size_is_small_enough_where_the_others_miss_the_limit() -> None:
    m = CHAIN.mechanism().with_({"limits.position": 0.02})
    result = jp.allow(m)
    assert (result.status == "not_enough").all()
    assert float(result.allowed_factor) == pytest.approx(1.0 / 3.0, rel=2 * TOLERANCE)
    result = jp.allow(m.with_({"limits.position": 0.0}))
    assert float(result.allowed_factor) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        ({"limits": None}, {}, "[limits] with one of position, rotation, x, y, angle"),
        ({}, {"question": "given"}, "loaded, worst, random"),
        ({}, {"probability": 0.9}, "random"),
        ({}, {"question": "random", "probability": 1.5}, "between 0 and 1"),
        ({}, {"question": "random", "samples": 370}, "at least 371 are needed"),
        ({}, {"tolerance": 0.0}, "tolerance"),
        ({}, {"question": "loaded"}, "nothing loads"),
        ({"joints.*.clearance": None, "dimensions": None}, {}, "nothing is off"),
    ],
)
def test_bad_input_is_refused_by_name(changes: dict[str, object], options: dict[str, Any], words: str) -> None:
    m = jp.loads(CHAIN.text(), "chain.toml").with_(changes)
    with pytest.raises(jp.InputError) as caught:
        jp.allow(m, **options)
    assert words in str(caught.value)


def test_interrupted_search_keeps_the_sources_that_are_done() -> None:
    calls = 0

    def progress(done: int, total: int) -> None:
        nonlocal calls
        calls += 1
        assert total == 4
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as caught:
        compute(CHAIN.mechanism(), progress=progress)
    assert caught.value.partial.labels("source") == ["J1", "J2"]
    assert caught.value.partial.attrs["incomplete"] == "interrupted after 2 of 3 sources"


def test_command_writes_and_draws(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from jointplay.cli.commands import program

    path = tmp_path / "chain.toml"
    path.write_text(CHAIN.text(), encoding="utf-8")
    done = CliRunner().invoke(program(), ["allow", str(path), "--plot", str(tmp_path / "a.svg")], standalone_mode=False)
    assert done.return_value == 0
    assert "The limits hold: the position error uses 60 % of its limit" in done.output
    assert (tmp_path / "a.svg").stat().st_size > 1000
    for kind in ("csv", "json", "nc"):
        CliRunner().invoke(program(), ["allow", str(path), "-o", str(tmp_path / f"a.{kind}")], standalone_mode=False)
    rows = (tmp_path / "a.csv").read_text().splitlines()
    assert rows[0].startswith("variable,source,")
    assert sum(row.startswith("allowed,") for row in rows) == 3
    missed = CliRunner().invoke(program(), ["allow", str(path), "-s", "limits.position=0.02"], standalone_mode=False)
    assert missed.return_value == 1


@pytest.mark.parametrize("limits", [{"position": 0.05}, {"rotation": 0.001}])
@pytest.mark.parametrize("question", ["worst", "random"])
def test_where_nothing_is_used_it_is_of_what_has_a_limit(limits: dict[str, float], question: str) -> None:
    """It was x that used 0 % of its limit, and x had none."""
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0), clearance={"radial": 1e-13})
    b.drive("q", joint="pivot", values=[0, 45])
    b.output(body="arm", at=(200, 0))
    b.limits(**limits)
    assert str(jp.allow(b.mechanism(), question).used_quantity.item()) == next(iter(limits))
