"""Clearances whose sizes scatter, as the file gives them: fits, hole and pin, a tolerance, ball bearings."""

import itertools
import json
import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from jsonschema import Draft202012Validator

import jointplay as jp
from helpers.answers import require_refused
from helpers.strategies import mechanism
from jointplay.cli import run
from jointplay.file.schema import json_schema
from jointplay.file.toml import parse

#: a crank with a slider on it: a pin, a slot across which nothing moves without play, in any unit of length
CRANK = """
format = 1
units = { length = "UNIT", angle = "rad" }
[joints.A]
type = "revolute"
on = { ground = [0, 0], crank = [0, 0] }
clearance = CLEARANCE
[drives.d]
joint = "A"
values = [0.3]
[output]
body = "crank"
at = [REACH, 0]
[[loads]]
force = [0, -10]
"""
#: the same in space, with what stands beside the clearance of a pin there
ARM = """
format = 1
space = "spatial"
units = { length = "mm", angle = "rad" }
[joints.A]
type = "KIND"
on = { ground = { at = [0, 0, 0], axis = [0, 0, 1] }, crank = { at = [0, 0, 0], axis = [0, 0, 1] } }
clearance = CLEARANCE
[drives.d]
joint = "A"
values = [0.3]
[output]
body = "crank"
at = [100, 0, 0]
[[loads]]
force = [0, -10, 3]
"""


def crank(clearance: str, unit: str = "mm", reach: float = 100.0) -> jp.Mechanism:
    return jp.loads(CRANK.replace("CLEARANCE", clearance).replace("UNIT", unit).replace("REACH", repr(reach)), "m.toml")


def arm(clearance: str, kind: str = "revolute") -> jp.Mechanism:
    return jp.loads(ARM.replace("CLEARANCE", clearance).replace("KIND", kind), "m.toml")


def gaps(m: jp.Mechanism) -> tuple[float, float, float]:
    """Smallest, middle and largest radius or gap in micrometres, and nothing of what the program made of it."""
    source, *sizes = m.core_spec["sources"]
    ((_, shape),) = source["set"].items()
    middle = next(shape[key] for key in ("radius", "gap", "high") if key in shape)
    half = sum(abs(size["factor"]) * size["set"]["interval"]["high"] for size in sizes)
    return tuple(round(1e6 * gap, 6) for gap in (middle - half, middle, middle + half))  # type: ignore[return-value]


#: what the file says, with the smallest, middle and largest gap by hand, in micrometres
GAPS = {
    '{ fit = "H7/g6", diameter = 12 }': (3.0, 10.25, 17.5),
    '{ fit = "F8/h7", diameter = 30 }': (10.0, 23.5, 37.0),
    '{ fit = "H7/s6", diameter = 12 }': (-19.5, -12.25, -5.0),
    '{ fit = "H7/k6", diameter = 12 }': (-6.0, 1.25, 8.5),
    '{ hole = { diameter = 12, class = "H7" }, pin = { diameter = 12, class = "g6" } }': (3.0, 10.25, 17.5),
    "{ hole = { diameter = 12, plus = 0.018, minus = 0 }, pin = { diameter = 12, plus = -0.006, minus = 0.017 } }": (
        3.0, 10.25, 17.5,
    ),
    "{ hole = { diameter = 12.02, tolerance = 0.01 }, pin = { diameter = 12 } }": (5.0, 10.0, 15.0),
    "{ radial = 0.02, tolerance = 0.005 }": (15.0, 20.0, 25.0),
    "{ diametral = 0.04, tolerance = 0.01 }": (15.0, 20.0, 25.0),
    "{ diametral = 0.04, tolerance = { plus = 0.02, minus = 0.01 } }": (15.0, 22.5, 30.0),
    "{ radial = 0.02, tolerance = { sigma = 0.001 } }": (17.0, 20.0, 23.0),
    '{ bearing = "C3", bore = 25 }': (6.5, 10.25, 14.0),
    '{ bearing = "N", bore = 25, reduction = 0.002 }': (1.5, 5.25, 9.0),
    '{ bearing = "C3", bore = 25, reduction = [0.002, 0.005] }': (4.0, 8.5, 13.0),
}  # fmt: skip


@pytest.mark.parametrize("text", GAPS)
def test_the_gaps_are_those_of_the_hand_calculation(text: str) -> None:
    """Half of the difference of hole and pin; a bearing's clearance is its whole travel."""
    assert gaps(crank(text)) == GAPS[text]
    assert gaps(arm(text[:-1] + ", axial = 0.01, length = 20 }")) == GAPS[text]
    if "bearing" not in text:
        assert gaps(arm(text[:-1] + ", length = 20 }", "cylindrical")) == GAPS[text]


@pytest.mark.parametrize(
    ("kind", "beside"), [("prismatic", ", length = 40, width = 20"), ("planar", ", size = [40, 30]")]
)
def test_gaps_of_guides_and_plates(kind: str, beside: str) -> None:
    text = ARM.replace("KIND", kind).replace('[drives.d]\njoint = "A"\nvalues = [0.3]\n', "")
    for given, expected in {
        '{ fit = "H9/d9", nominal = 20': (32.5, 58.5, 84.5),
        '{ slot = { width = 20, class = "H9" }, slider = { width = 20, class = "d9" }': (32.5, 58.5, 84.5),
        "{ gap = 0.02, tolerance = 0.005": (15.0, 20.0, 25.0),
    }.items():
        m = jp.loads(text.replace("CLEARANCE", f"{given}{beside} }}"))
        assert gaps(m) == expected
        assert set(m.sources) <= {"A", "A.slot", "A.slider", "A.size"}


@pytest.mark.parametrize(("unit", "size"), [("mm", 1.0), ("m", 1e-3), ("um", 1e3), ("cm", 0.1), ("in", 1 / 25.4)])
def test_standards_are_converted_to_the_units_of_the_file(unit: str, size: float) -> None:
    """Also at the ends of the steps, where rounding of the unit took the next step."""
    for diameter in (3.0, 18.0, 30.0, 120.0, 315.0):
        expected = gaps(crank(f'{{ fit = "M6/h5", diameter = {diameter} }}', reach=400.0))
        found = gaps(crank(f'{{ fit = "M6/h5", diameter = {diameter * size!r} }}', unit, 400.0 * size))
        assert found == pytest.approx(expected, abs=1e-6)
    expected = gaps(crank('{ bearing = "C4", bore = 50 }'))
    assert gaps(crank(f'{{ bearing = "C4", bore = {50 * size!r} }}', unit, 400.0 * size)) == expected


def fixed(radius: float, text: str = "crank") -> jp.Mechanism:
    plain = f"{{ radial = {radius!r} }}"
    return crank(plain) if text == "crank" else arm(plain[:-1] + ", axial = 0.01, length = 20 }")


@pytest.mark.parametrize("space", ["crank", "arm"])
def test_the_questions_are_those_of_a_fixed_clearance(space: str) -> None:
    """`loaded` and `worst` of a fit are those of the file with the middle, the largest, the smallest radius."""
    text = '{ fit = "H7/g6", diameter = 12 }'
    m = crank(text) if space == "crank" else arm(text[:-1] + ", axial = 0.01, length = 20 }")
    small, middle, large = (1e-3 * gap for gap in GAPS[text])
    for sizes, radius in (("smallest", small), ("middle", middle), ("largest", large)):
        mine, plain = jp.loaded(m, sizes=sizes), jp.loaded(fixed(radius, space))
        np.testing.assert_allclose(mine.error, plain.error, rtol=1e-9, atol=1e-12)
        assert mine.attrs["sizes"] == sizes
    worst, plain_worst = jp.worst(m), jp.worst(fixed(large, space))
    np.testing.assert_allclose(worst.worst_position, plain_worst.worst_position, rtol=1e-9)
    np.testing.assert_allclose(worst.worst_component, plain_worst.worst_component, rtol=1e-9, atol=1e-12)
    # The sizes have what they add to the middle, and `given` reproduces the extreme within the largest clearance.
    np.testing.assert_allclose(worst.contribution.sum("source"), worst_first_order(worst), rtol=1e-9, atol=1e-12)
    parts = worst.contribution.sel(extreme="position").squeeze()
    assert float(parts.sel(source="A.hole") / parts.sel(source="A.pin")) == pytest.approx(18 / 11)
    again = jp.given(m, worst.worst_offset.sel(extreme="position"))
    assert bool(again.admissible.all())
    error = again.error.sel(component=["x", "y"] if space == "crank" else ["x", "y", "z"])
    np.testing.assert_allclose(np.linalg.norm(error, axis=1), worst.worst_position, rtol=1e-6)
    assert jp.compensate(m).residual_position.item() == pytest.approx(
        jp.compensate(fixed(middle, space)).residual_position.item(), rel=1e-9, abs=1e-15
    )


def worst_first_order(worst: xr.Dataset) -> Any:
    both = [worst.worst_position_first_order, worst.worst_rotation_first_order]
    return np.concatenate([np.stack(both, 1), worst.worst_component_first_order.values.reshape(1, -1)], axis=1)


def test_random_specimens_have_sizes_of_their_own() -> None:
    """The offset is uniform in a disc of radius R, which scatters: E x^2 = E R^2 / 4, with R normal, cut at 3 sigma."""
    m = crank('{ fit = "H7/g6", diameter = 12 }')
    found = jp.random(m, samples=400_000)
    cut = 0.9733  # variance of a normal number that is cut at three sigma, as a share of sigma^2
    spread = cut * ((9e-3 / 2 / 3) ** 2 + (5.5e-3 / 2 / 3) ** 2)
    expected = (10.25e-3**2 + spread) / 4
    # The crank turns by nothing: its output moves as its pin does.
    assert found.error_std.sel(component="x").item() ** 2 == pytest.approx(expected, rel=0.005)
    assert found.interference.sum().item() == 0.0
    shares = jp.random(crank('{ fit = "H7/k6", diameter = 12 }'), samples=100_000).interference
    assert 0.0 < shares.sel(source="A").item() < 0.5
    everything = jp.random(crank('{ fit = "H7/s6", diameter = 12 }'), samples=1000)
    assert everything.interference.sel(source="A").item() == 1.0
    assert everything.largest.max().item() < 1e-15  # rounding of the reach


def test_an_offset_counts_within_the_clearance_of_its_sizes() -> None:
    m = crank('{ fit = "H7/g6", diameter = 12 }')
    x = 0.015
    for sizes, inside in (("smallest", False), ("middle", False), ("largest", True)):
        assert jp.given(m, {"A": [x, 0]}, sizes=sizes).admissible.sel(source="A").item() is inside
    assert jp.given(m, {"A": [x, 0], "A.hole": 0.009, "A.pin": -0.0055}).admissible.values.all()
    assert not jp.given(m, {"A.hole": 0.0091}).admissible.sel(source="A.hole").item()
    with pytest.raises(jp.InputError, match=r"'big' is not a choice of sizes; .*largest"):
        jp.given(m, sizes="big")
    with pytest.raises(jp.InputError, match="sizes"):
        jp.loaded(m, sizes="small")


def test_a_measured_specimen_has_its_sizes() -> None:
    """`deviation` is measured minus nominal: 12.010 in a hole and 11.99 of a pin make a radius of 10 micrometres."""
    m = crank("{ hole = { diameter = 12, deviation = 0.01 }, pin = { diameter = 12, deviation = -0.01 } }")
    np.testing.assert_allclose(jp.loaded(m).error, jp.loaded(fixed(0.01)).error, rtol=1e-9, atol=1e-12)
    scattering = crank(
        '{ hole = { diameter = 12, class = "H7", deviation = 0.010 }, pin = { diameter = 12, deviation = -0.01 } }'
    )
    np.testing.assert_allclose(jp.loaded(scattering).error, jp.loaded(fixed(0.01)).error, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("clearance", "key", "said"),
    [
        ('{ fit = "H7/q6", diameter = 12 }', ".fit", "q is no shaft of ISO 286-1; known: a, b, c, cd"),
        ('{ fit = "H7/g6", diameter = 501 }', ".fit", "up to 500 mm, not for 501 mm"),
        ('{ fit = "H7/g6" }', "", "'diameter' is missing"),
        ('{ fit = "g6/H7", diameter = 12 }', ".fit", "the hole, in upper case, comes first"),
        ('{ fit = "H7", diameter = 12 }', ".fit", '"H7" is not a fit'),
        ("{ fit = 7, diameter = 12 }", ".fit", "a text in quotes is needed, not 7"),
        ("{ diameter = 12 }", "", "say which clearance is meant"),
        ('{ fit = "H7/g6", diameter = 12, radial = 0.1 }', "", "give radial or fit, not both"),
        ('{ fit = "H7/g6", diameter = 12, tolerance = 0.1 }', "", "'tolerance' goes with radial or diametral"),
        ("{ radial = 0.1, size_law = 'normal' }", "", "'size_law' says how sizes scatter"),
        ("{ radial = 0.1, tolerance = { sigma = 0.01 }, size_law = 'normal' }", "", "sigma already says"),
        ('{ hole = { diameter = 12, class = "H7" } }', "", "'pin' is missing"),
        ('{ hole = { class = "H7" }, pin = { diameter = 12 } }', ".hole", "'diameter' is missing"),
        (
            '{ hole = { diameter = 12, class = "h7" }, pin = { diameter = 12 } }',
            ".hole.class",
            "upper case, such as H7",
        ),
        ('{ hole = { diameter = 12, class = "J8" }, pin = { diameter = 12, class = "j8" } }', ".pin.class", "12 mm"),
        (
            "{ hole = { diameter = 12, plus = 0.1 }, pin = { diameter = 12 } }",
            ".hole",
            "plus and minus belong together",
        ),
        (
            "{ hole = { diameter = 12, plus = -0.1, minus = 0.05 }, pin = { diameter = 11 } }",
            ".hole",
            "the upper limit, plus = -0.1, is below",
        ),
        ('{ hole = { diameter = 12, class = "H7", tolerance = 1 }, pin = { diameter = 12 } }', ".hole", "limits once"),
        (
            "{ hole = { diameter = 12 }, pin = { diameter = 12.1, tolerance = 0.01 } }",
            "",
            "no pin has play in its hole",
        ),
        ('{ bearing = "C6", bore = 25 }', ".bearing", "known: C2, CN, N, C3, C4, C5"),
        ('{ bearing = "C3" }', "", "'bore' is missing"),
        ('{ bearing = "C3", bore = 300 }', ".bearing", "up to 200 mm, not for 300 mm"),
        ('{ bearing = "C3", bore = 25, reduction = [0.2, 0.1] }', "", "reduction is [least, most]"),
        ("{ radial = 0.1, reduction = 0.1 }", "", "'reduction' goes with bearing"),
        ('{ fit = "H7/a11", diameter = 400 }', "", "is off by up to"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(clearance: str, key: str, said: str) -> None:
    for variables in ("", "[variables]\nH7 = 1\ng6 = 2\n"):
        text = CRANK.replace("CLEARANCE", clearance).replace("UNIT", "mm").replace("REACH", "0.5")
        require_refused(text, "[joints.A]", f"{variables}[joints.A]", f"joints.A.clearance{key}", said)


def test_in_space_nothing_is_guessed_of_a_bearing() -> None:
    with pytest.raises(jp.InputError, match="'axial' is missing"):
        arm('{ bearing = "C3", bore = 25, length = 8 }')
    with pytest.raises(jp.InputError, match="'length' is missing"):
        arm('{ bearing = "C3", bore = 25, axial = 0 }')
    with pytest.raises(jp.InputError, match="'bearing' is not a key here"):
        arm('{ bearing = "C3", bore = 25, length = 8 }', "cylindrical")
    with pytest.raises(jp.InputError, match="'length' is missing"):
        arm('{ fit = "H7/g6", diameter = 12 }')


def test_expressions_stand_in_the_numbers_of_sizes() -> None:
    text = CRANK.replace("CLEARANCE", '{ fit = "H7/g6", diameter = "2 * H7" }').replace("UNIT", "mm")
    m = jp.loads(text.replace("REACH", "100").replace("[joints.A]", "[variables]\nH7 = 6\n[joints.A]"))
    assert gaps(m) == GAPS['{ fit = "H7/g6", diameter = 12 }']


def test_a_value_replaces_what_says_the_same() -> None:
    m = crank('{ fit = "H7/g6", diameter = 12 }')
    key = "joints.A.clearance"
    assert m.with_({"joints.*.clearance.radial": 0.02}).value(key) == {"radial": 0.02}
    assert m.with_({f"{key}.bearing": "C3", f"{key}.bore": 20}).value(key) == {"bearing": "C3", "bore": 20}
    tolerant = crank("{ diametral = 0.04, tolerance = { plus = 0.02, minus = 0.01 } }")
    changed = tolerant.with_({f"{key}.radial": 0.02})
    assert gaps(changed) == gaps(tolerant)
    assert tolerant.with_({f"{key}.fit": "H7/g6", f"{key}.diameter": 12}) == m
    pair = {"hole": {"diameter": 12, "class": "H7"}, "pin": {"diameter": 12, "class": "g6"}}
    both = m.with_({f"{key}.hole": pair["hole"], f"{key}.pin": pair["pin"]})
    assert both.value(key) == pair
    assert both.with_({f"{key}.hole.plus": 0.01, f"{key}.hole.minus": 0}).value(f"{key}.hole.diameter") == 12


def test_fits_are_swept_by_their_names() -> None:
    m = crank('{ fit = "H7/g6", diameter = 12 }')
    swept = jp.sweep(m, "joints.A.clearance.fit", ["H7/g6", "H7/k6", "H7/s6"])
    np.testing.assert_allclose(swept.worst_position.squeeze(), [0.0175, 0.0085, 0.0], rtol=1e-9, atol=1e-12)
    loaded = jp.sweep(m, "joints.A.clearance.diameter", [12, 20], "loaded", sizes="largest")
    np.testing.assert_allclose(np.abs(loaded.error.sel(component="y")).squeeze(), [0.0175, 0.0205], rtol=1e-9)


def test_check_lists_the_plays_from_side_to_side() -> None:
    found = jp.check(crank('{ fit = "H7/g6", diameter = 12 }'))
    np.testing.assert_allclose(found.play, [[0.006, 0.035]], rtol=1e-12)
    assert found.play_given.values.tolist() == ["H7/g6 of 12"]
    tight = jp.check(crank('{ fit = "H7/k6", diameter = 12 }'))
    np.testing.assert_allclose(tight.play, [[-0.012, 0.017]], rtol=1e-12)
    assert "play" not in jp.check(crank("{ radial = 0.1 }"))


def test_the_command_line_says_which_sizes_it_took(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.toml"
    path.write_text(
        CRANK.replace("CLEARANCE", '{ fit = "H7/k6", diameter = 12 }').replace("UNIT", "mm").replace("REACH", "100")
    )
    assert run(["check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "H7/k6 of 12" in said
    assert "Pairs with interference have no play: A." in said
    assert run(["error", str(path), "--samples", "1000"]) == 0
    said = capsys.readouterr().out
    assert "in the middle of their limits" in said
    assert "some or all pairs have interference" in said
    assert "% of the pairs have interference" in said
    path.write_text(path.read_text().replace("H7/k6", "H7/u6"))
    assert run(["error", str(path), "-q", "random", "--samples", "1000"]) == 0
    # It was 1e+02 %.
    assert "A: all of the pairs have interference" in capsys.readouterr().out
    path.write_text(path.read_text().replace("H7/u6", "H7/k6"))
    assert run(["error", str(path), "-q", "loaded", "--sizes", "largest"]) == 0
    assert "those of the largest play" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("fits = 'k6'", "given as reduction = 0.005"),
        # Micrometres in a file in millimetres.
        ("reduction = 5", "clearance.reduction: takes away all of the clearance, which is at most 0.028 mm: 5"),
    ],
)
def test_what_mounting_takes_away_is_a_reduction_that_leaves_something(keys: str, words: str) -> None:
    with pytest.raises(jp.InputError, match=re.escape(words)):
        crank(f'{{ bearing = "C3", bore = 25, {keys} }}')


@pytest.mark.parametrize(
    "clearance", [*GAPS, '{ fit = "H7/g6" }', "{ hole = { diameter = 12 } }", '{ bearing = "C3" }']
)
def test_the_json_schema_takes_what_the_program_takes(clearance: str) -> None:
    raw = parse(CRANK.replace("CLEARANCE", clearance).replace("UNIT", "mm").replace("REACH", "100"), file="m")
    assert Draft202012Validator(json_schema()).is_valid(json.loads(json.dumps(raw))) is (clearance in GAPS)


EVERYTHING = jp.Builder(space="planar", units={"length": "mm"})
EVERYTHING.revolute("A", ground=(0, 0), crank=(0, 0), clearance=jp.fit("H7/f7", diameter=16))
EVERYTHING.revolute("B", crank=(40, 0), rod=(0, 0), clearance=jp.fit("H7/k6", diameter=12))
EVERYTHING.revolute("C", rod=(120, 0), slider=(0, 0), clearance=jp.bearing("C3", bore=10, reduction=(0.002, 0.005)))
EVERYTHING.prismatic(
    "D",
    ground={"at": (0, 0), "axis": (1, 0)},
    slider={"at": (0, 0), "axis": (1, 0)},
    clearance=jp.gap(0.03, tolerance=0.01, length=60),
)
EVERYTHING.start("slider", x=113)
EVERYTHING.drive("theta", joint="A", values=(10, 90), error=0.01)
EVERYTHING.dimension("rod", body="rod", between=["B", "C"], tolerance=0.01)
EVERYTHING.output(body="slider", at="C")
EVERYTHING.assembly(steps=[["crank"], ["rod"], ["slider"]])
EVERYTHING.grid(theta={"from": 10, "to": 90, "count": 3})
EVERYTHING.load(force=(-100, 20))


def test_every_question_takes_sizes() -> None:
    """A slider-crank whose four joints scatter is that with four fixed clearances, question by question.

    Beside a dimension and an error of the drive, which have no joint, `check` and `given` ended in a traceback.
    """
    assert len(jp.check(EVERYTHING.mechanism()).clearance) == 4
    assert jp.given(EVERYTHING.mechanism(), {"rod": 0.005}).admissible.values.all()
    m = EVERYTHING.mechanism()
    middle = {
        "joints.A.clearance.radial": 17e-3,
        "joints.B.clearance.radial": 1.25e-3,
        "joints.C.clearance.radial": 6e-3,
        "joints.D.clearance": {"gap": 0.03, "length": 60},
    }
    plain = m.with_(middle)
    np.testing.assert_allclose(jp.map(m, "loaded").error, jp.map(plain, "loaded").error, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(jp.compensate(m).residual, jp.compensate(plain).residual, rtol=1e-6, atol=1e-9)
    both = [jp.compare(x, x, "loaded").error for x in (m, plain)]
    np.testing.assert_allclose(both[0], both[1], rtol=1e-9, atol=1e-12)
    largest = m.with_({**middle, "joints.A.clearance.radial": 26e-3, "joints.B.clearance.radial": 8.5e-3})
    largest = largest.with_({"joints.C.clearance.radial": 10.5e-3, "joints.D.clearance.gap": 0.04})
    np.testing.assert_allclose(jp.worst(m).worst_position, jp.worst(largest).worst_position, rtol=1e-7)
    np.testing.assert_allclose(jp.map(m, "worst").worst_position, jp.map(largest, "worst").worst_position, rtol=1e-7)
    for question in ("unit", "worst", "random"):
        options = {"samples": 200} if question == "random" else {}
        assert jp.assemble(m, question, **options).sizes
    steps = [jp.assemble(x).error for x in (m, plain)]
    np.testing.assert_allclose(steps[0], steps[1], rtol=1e-7, atol=1e-10)
    assert jp.worst(m).attrs["some_without_play"] == "B"
    for law, contact in itertools.product((None, "uniform"), ("scattered", "loaded")):
        found = jp.random(m, samples=500, law=law, contact=contact)
        assert float(found.contribution.sel(source=["A.hole", "D.size"]).min()) > -1e-18


@pytest.mark.parametrize("seed", [0, 1])
def test_several_bodies_have_one_pin_in_common(seed: int) -> None:
    """Each had a pin of its own, so that a large pin made the play of one of them small and not that of the other."""
    raw = dict(jp.loads(mechanism("triple_pin", seed)).raw)
    name = next(name for name, joint in raw["joints"].items() if len(joint["on"]) == 3)
    reach = jp.loads(mechanism("triple_pin", seed)).length
    pin = {"diameter": 12, "tolerance": 1e-4 * reach}
    raw["joints"][name]["clearance"] = {"hole": {"diameter": 12 + 1e-3 * reach, "tolerance": 1e-4 * reach}, "pin": pin}
    m = jp.Mechanism(raw)
    riders = [joint for joint in m.joints if joint.startswith(f"{name}/")]
    assert [s for s, kind in zip(m.sources, m.source_kinds, strict=True) if kind == "size"] == [
        f"{riders[0]}.hole", f"{name}.pin", f"{riders[1]}.hole",
    ]  # fmt: skip
    assert np.allclose(jp.check(m).play, [[8e-4 * reach, 1.2e-3 * reach]] * 2)
    largest = m.with_({f"joints.{name}.clearance.radial": 6e-4 * reach})
    np.testing.assert_allclose(jp.worst(m).worst_position, jp.worst(largest).worst_position, rtol=1e-7)
    inside = {f"{rider}": [5.5e-4 * reach, 0.0] for rider in riders}
    small_pin = jp.given(m, {**inside, f"{name}.pin": -1e-4 * reach}).admissible
    assert small_pin.sel(source=riders).values.all()
    assert not jp.given(m, inside).admissible.sel(source=riders).values.any()
