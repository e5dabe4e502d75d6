"""Every source of every bundled mechanism has a size, and a copy that is resized has the size that was asked."""

import numpy as np
import pytest

import jointplay as jp
from jointplay.model.gaps import travel
from jointplay.model.sizing import sizings


def sets(m: jp.Mechanism) -> list[dict[str, float]]:
    """The sets of all sources of a mechanism, SI, by the order of results."""
    return [next(iter(source["set"].values())) for source in m.core_spec["sources"]]


#: what of a set is no size of play
SHAPES = ("half_length", "half_width", "half_height", "half_normal", "half_side")


def play(m: jp.Mechanism, name: str) -> np.ndarray:
    """The numbers of a source that its size scales; with those of the sizes that make it."""
    index = m.sources.index(name)
    limits = travel(m, index)
    size = {key: value for key, value in sets(m)[index].items() if key not in SHAPES}
    numbers = [size[key] for key in sorted(size)] if limits is None else [*limits, size.get("axial", 0.0)]
    return np.array(numbers)


@pytest.mark.parametrize("name", list(jp.examples.names()))
def test_size_of_every_source_of_the_bundled_mechanisms_is_scaled(name: str) -> None:
    m = jp.loads(jp.examples.text(name))
    base, sources = sizings(m)
    assert base.sources == m.sources
    parts = {s for s, kind in zip(m.sources, m.source_kinds, strict=True) if kind == "size"}
    assert [s for one in sources for s in one.sources] == [s for s in m.sources if s not in parts]
    for one in sources:
        for factor in (0.3, 1.0, 1.7):
            size = one.size * factor if one.size else factor * 1e-3
            copy = base.with_(one.resized(size))
            assert {s.name: s.size for s in sizings(copy)[1]}[one.name] == pytest.approx(size, rel=1e-12)
            for source in base.sources:
                changed = source in one.sources or source in parts
                if not changed:
                    assert play(copy, source) == pytest.approx(play(base, source), rel=1e-12)
            if one.size:
                for source in one.sources:
                    # Hole and pin are given as whole diameters, whose rounding is that of their difference.
                    assert play(copy, source) == pytest.approx(factor * play(base, source), rel=1e-12, abs=1e-15)


CLEARANCES = (
    {"diametral": 0.1, "tolerance": 0.02},
    {"radial": 0.1, "tolerance": {"plus": 0.02, "minus": 0.01}, "size_law": {"pert": 0.01}},
    {"radial": 0.1, "tolerance": {"sigma": 0.01}, "diameter": 10},
    {"fit": "H7/g6", "diameter": 12},
    {"fit": "H7/k6", "diameter": 12, "size_law": "uniform"},
    {"hole": {"diameter": 12.05, "tolerance": 0.01}, "pin": {"diameter": 12, "class": "g6", "law": "triangular"}},
    {"hole": {"diameter": 12, "plus": 0.02, "minus": -0.01, "deviation": 0.018}, "pin": {"diameter": 11.98}},
    {"bearing": "C3", "bore": 25},
    {"bearing": "C4", "bore": 25, "reduction": [0.002, 0.006], "size_law": "uniform"},
    {"radial": 0.0},
)


@pytest.mark.parametrize("clearance", CLEARANCES, ids=str)
@pytest.mark.parametrize("factor", [0.4, 1.0, 2.5])
def test_clearance_keeps_its_shape_and_its_laws_at_another_size(clearance: dict[str, object], factor: float) -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"joints.J2.clearance": clearance})
    base, sources = sizings(m)
    one = next(one for one in sources if one.name == "J2")
    copy = base.with_(one.resized(factor * one.size if one.size else factor))
    again = next(one for one in sizings(copy)[1] if one.name == "J2")
    assert again.size == pytest.approx(factor * one.size if one.size else factor, rel=1e-12)
    expected = factor * play(base, "J2") if one.size else np.array([factor * 1e-3])
    assert play(copy, "J2") == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert [s for s in copy.sources if not s.startswith("J2.")] == [s for s in m.sources if not s.startswith("J2.")]


@pytest.mark.parametrize(
    "law", ["uniform", {"pert": 0.01}, {"normal": {"sigma": 0.01, "shift": 0.2}}, {"measured": [0.0, 0.01, -0.015]}]
)
def test_law_is_scaled_with_its_tolerance(law: object) -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"dimensions.l2.tolerance": 0.02, "dimensions.l2.law": law})
    m = m.with_({"drives.theta1.error": 0.02, "drives.theta1.law": law})
    base, sources = sizings(m)
    for name in ("l2", "theta1"):
        one = next(one for one in sources if one.name == name)
        assert one.size == 0.02
        copy = base.with_(one.resized(0.01))
        before, after = (mm.core_spec["sources"][m.sources.index(name)] for mm in (m, copy))
        assert numbers(after["set"]) == pytest.approx([0.5 * x for x in numbers(before["set"])])
        expected = [x if key == "drift" else 0.5 * x for key, x in keyed(before["law"])]
        # A beta law is between its limits whatever they are.
        expected = numbers(before["law"]) if "beta" in before["law"] else expected
        assert numbers(after["law"]) == pytest.approx(expected)


def keyed(value: object, key: str = "") -> list[tuple[str, float]]:
    """All numbers below a value, with their keys."""
    if isinstance(value, dict):
        return [pair for name, one in value.items() for pair in keyed(one, name)]
    if isinstance(value, list):
        return [pair for one in value for pair in keyed(one, key)]
    return [(key, float(value))] if isinstance(value, int | float) and not isinstance(value, bool) else []


def numbers(value: object) -> list[float]:
    return [number for _, number in keyed(value)]


def test_copies_of_a_pattern_have_sizes_of_their_own() -> None:
    m = jp.loads(jp.examples.text("delta-by-hand"))
    assert "patterns" in m.raw
    base, sources = sizings(m)
    assert "patterns" not in base.raw
    one = next(one for one in sources if one.name.endswith("_2"))
    copy = base.with_(one.resized(2.0 * one.size))
    changed = [a for a, b, name in zip(sets(base), sets(copy), m.sources, strict=True) if a != b]
    assert len(changed) == len(one.sources) == 1


def test_bodies_on_one_pin_have_one_size() -> None:
    changes = {
        "joints.J3.on.spare": [0, 0],
        "joints.J5": {"type": "revolute", "on": {"spare": [60, 0], "ground": [-40, 90]}, "clearance": {"radial": 0.1}},
    }
    m = jp.loads(jp.examples.text("four-bar")).with_(changes)
    _, sources = sizings(m)
    one = next(one for one in sources if one.name == "J3")
    assert one.sources == ("J3/rocker", "J3/spare")


def test_preferred_fits_are_in_the_order_of_their_largest_play() -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"joints.J2.clearance": {"fit": "H7/g6", "diameter": 12}})
    base, sources = sizings(m)
    one = next(one for one in sources if one.name == "J2")
    plays = [travel(base.with_(one.of_fit(fit)), base.sources.index("J2"))[1] for fit in one.fits(base)]
    assert plays == sorted(plays)
    # H7: 0 to 18 micrometres; g6: -17 to -6; the radius is half of the difference of the diameters
    assert plays[one.fits(base).index("H7/g6")] == pytest.approx(35e-6 / 2)
