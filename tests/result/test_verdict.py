"""Whether errors keep to the limits of the file: margins, sentences, marks, exit codes."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from helpers.dead_centre import at_dead_centre
from helpers.several import together
from helpers.strategies import mechanisms, searching
from jointplay.analyses import allow, loaded, worst
from jointplay.analyses import given as of_given
from jointplay.cli import run
from jointplay.result import blame, from_dataset
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, outcome, percent, verdict

SEARCH = searching(15)
FITS = jp.examples.text("four-bar-fits")


def ask(question: str, m: jp.Mechanism) -> Any:
    if question == "given":
        return jp.given(m, dict.fromkeys((name for name in m.parameters if name.endswith(".x")), 0.01))
    return {"worst": jp.worst, "loaded": jp.loaded}[question](m)


def values_of(result: Any, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value of a quantity, number by number."""
    if quantity in ("position", "rotation"):
        if f"worst_{quantity}" in result:
            high = result[f"worst_{quantity}"].values
        else:
            names = [c for c in result.component.values if (c in "xyz") == (quantity == "position")]
            far = abs(result.error.sel(component=names))
            if "undetermined" in result:
                far = far + result.undetermined.sel(component=names)
            high = np.array([math.hypot(*row) for row in far.values])
        return np.zeros_like(high), high
    if "worst_component" in result:
        both = result.worst_component.sel(component=quantity)
        return both.sel(side="low").values, both.sel(side="high").values
    error = result.error.sel(component=quantity).values
    half = result.undetermined.sel(component=quantity).values if "undetermined" in result else 0.0 * error
    return error - half, error + half


def with_limits(text: str, rng: np.random.Generator) -> jp.Mechanism:
    """The mechanism with limits about as large as its errors, of some quantities, on one side or on both."""
    m = jp.loads(text)
    worst = jp.worst(m, starts=4)
    limits: dict[str, Any] = {}
    for quantity in worst["quantity"].values.tolist():
        low, high = (float(np.nanmax(np.abs(end))) for end in values_of(worst, quantity))
        around = [rng.uniform(0.2, 1.4) * high, -rng.uniform(0.2, 1.4) * low]
        if quantity in ("position", "rotation"):
            choices: list[Any] = [None, around[0]]
        else:
            choices = [None, around[0], [around[1], around[0]], {"high": around[0]}, {"low": around[1]}]
        if (chosen := choices[rng.integers(len(choices))]) is not None:
            limits[quantity] = chosen
    return m.with_({f"limits.{name}": value for name, value in limits.items()})


@SEARCH
@given(mechanisms(), st.integers(0, 1000), st.sampled_from(["worst", "loaded", "given"]))
def test_the_verdict_is_that_of_every_single_number(text: str, seed: int, question: str) -> None:
    """Against a comparison of every value of the result with every limit of the file, one by one."""
    m = with_limits(text, np.random.default_rng(seed))
    result = ask(question, m)
    given_limits = m.raw.get("limits", {})
    known = np.isin(result.status.values, ["ok", "undetermined", "strained"])
    missed = []
    for quantity in result["quantity"].values.tolist():
        low, high = values_of(result, quantity)
        limit = given_limits.get(quantity)
        bounds = (
            (-math.inf, math.inf) if limit is None
            else (limit.get("low", -math.inf), limit.get("high", math.inf)) if isinstance(limit, dict)
            else tuple(limit) if isinstance(limit, list)
            else (-limit, limit)
        )  # fmt: skip
        shown = result.limit.sel(quantity=quantity).values
        np.testing.assert_allclose(np.nan_to_num(shown, nan=math.inf)[1], bounds[1], rtol=1e-12)
        for k in range(len(low)):
            room = min(bounds[1] - high[k], low[k] - bounds[0])
            margin, met = (float(result[name].sel(quantity=quantity)[k]) for name in ("margin", "limit_met"))
            if math.isinf(room):
                assert math.isnan(margin)
                assert met
                continue
            assert margin == pytest.approx(room, rel=1e-9, abs=1e-9 * (abs(high[k]) + abs(low[k])), nan_ok=True)
            assert bool(met) == (room >= -1e-9 * abs(high[k])) or abs(room) < 1e-7
            # What a singular pose gives is no number to rely on.
            if room < 0 and known[k]:
                missed.append((k, quantity))
    found = verdict(from_dataset(result))
    expected = MISSED if missed else HELD if known.all() else NOT_SHOWN
    assert found.outcome == outcome(from_dataset(result)) == (expected if given_limits else "")
    assert [(k, name) for k, mark in enumerate(found.marks) for name in mark.split(", ") if name] == sorted(
        missed, key=lambda miss: (miss[0], result["quantity"].values.tolist().index(miss[1]))
    )
    assert bool(found.sentences) == bool(given_limits)


def test_what_is_missed_most_comes_first_with_its_source() -> None:
    result = jp.worst(jp.loads(FITS))
    first, *others = verdict(from_dataset(result)).sentences
    y = result.worst_component.sel(component="y", side="high").values
    k = int(y.argmax())
    assert first.startswith(
        f"Limit missed: y {y[k]:.4g} mm, {y[k] - 0.06:.4g} mm above 0.06 mm, at configuration {k} ("
    )
    shares = result.contribution.sel(extreme="y high")[k]
    most = shares.source.values[int(shares.values.argmax())]
    assert f"to tighten first: {most}" in first
    assert [line.split(" ")[2] for line in others] == ["position", "angle"]


def test_a_limit_that_is_reached_exactly_is_met() -> None:
    m = example("slider-crank", limits=None)
    worst = jp.worst(m)
    exactly = m.with_({"limits.position": float(worst.worst_position.max())})
    assert jp.worst(exactly).limit_met.all()
    assert not jp.worst(exactly.with_({"limits.position": 0.999 * float(worst.worst_position.max())})).limit_met.all()


def test_a_component_that_cannot_move_keeps_to_a_limit_of_zero() -> None:
    """Rounding is no error: under its load the arm does not turn."""
    m = example("serial-2r").with_({"limits.angle": 0.0})
    result = jp.loaded(m)
    assert abs(result.error.sel(component="angle")).max() < 1e-9
    assert result.limit_met.sel(quantity="angle").all()


def test_what_a_load_leaves_open_counts() -> None:
    """Where nothing presses a slider to either side it may be at both, and the farther one has to keep to the limit."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits.x": 5.0, "limits.position": 5.0})
    result = jp.loaded(m.with_({"loads.0.force": [0, 0], "loads.0.moment": 1e-30}))
    open_ = result.undetermined.sel(component="x")
    margin = 5.0 - abs(result.error.sel(component="x")) - open_
    np.testing.assert_allclose(result.margin.sel(quantity="x"), margin, rtol=1e-9)


def test_several_outputs_have_verdicts_of_their_own() -> None:
    raw = json.loads(json.dumps(dict(jp.loads(FITS).raw)))
    raw["loads"][0] |= {"body": "rocker", "at": [150, 0]}
    other = {"body": "rocker", "at": [75, 0], "limits": {"position": 1.0, "y": 1.0, "angle": 1.0}}
    m = jp.Mechanism(together(raw, {"tip": raw["output"], "middle": other}))
    result = jp.worst(m)
    for name in m.outputs:
        alone = jp.worst(m.only(output=name))
        for variable in ("limit", "margin", "limit_met"):
            np.testing.assert_array_equal(result[variable].sel(output=name), alone[variable])
    assert outcome(from_dataset(result)) == MISSED
    assert outcome(from_dataset(result.sel(output="middle").drop_vars("output"))) == HELD


def test_the_tables_begin_with_the_verdict_and_mark_the_rows() -> None:
    missed = from_dataset(jp.worst(jp.loads(FITS)))
    table = tables(missed)[0]
    sentences = conclude(missed).sentences
    assert sentences[0].text.startswith("Limit missed: y")
    assert [sentence.is_alarm for sentence in sentences[:3]] == [True] * 3
    marks = next(column for column in table.columns if column.name == "beyond limit")
    assert set(marks.cells) == {"y, angle, position"}
    assert marks.alarms == tuple(range(len(marks.cells)))
    held = from_dataset(jp.worst(jp.loads(FITS).with_({"joints.*.clearance.fit": "H7/g6"})))
    first = conclude(held).sentences[0]
    assert first.text.startswith("Limits hold: y")
    assert not first.is_alarm
    assert "beyond limit" not in [column.name for column in tables(held)[0].columns]


@pytest.mark.parametrize("question", ["worst", "loaded", "given"])
def test_a_limit_that_is_missed_ends_with_exit_code_1(
    question: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bar.toml"
    file.write_text(FITS)
    keep = ["-s", "limits.position=1", "-s", "limits.y=1", "-s", "limits.angle=1"]
    assert run(["error", str(file), "-q", question, *keep]) == 0
    assert "Limits hold" in capsys.readouterr().out
    assert run(["error", str(file), "-q", question, *keep[2:], "-s", "limits.position=0.01"]) == 1
    sizes = " with clearances of middle size" if question == "loaded" else ""
    assert f"Limit missed{sizes}: position" in " ".join(capsys.readouterr().out.split())


def test_a_scatter_ends_with_exit_code_1_only_where_a_yield_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bar.toml"
    file.write_text(FITS)
    tight = ["error", str(file), "-q", "random", "--samples", "2000", "-s", "limits.position=0.03"]
    scattered = ["-s", "limits.contact=scattered"]
    assert run([*tight, *scattered, "-s", "limits.probability=0.5"]) == 0
    assert "Required yield 50 %: met" in capsys.readouterr().out
    assert run([*tight, "-s", "limits.probability=0.99"]) == 1
    assert "Required yield 99 %: missed" in capsys.readouterr().out
    text = file.read_text()
    file.write_text(re.sub("probability = .*", "", text))
    assert run(tight) == 0
    assert "Outside the limits" in capsys.readouterr().out


def test_sweeps_and_comparisons_do_not_judge(tmp_path: Path) -> None:
    file = tmp_path / "bar.toml"
    file.write_text(FITS)
    assert run(["sweep", str(file), "-s", "limits.position=0.01,0.02"]) == 0
    assert run(["compare", str(file), str(file)]) == 0


@pytest.mark.parametrize("name", jp.examples.names())
def test_bundled_files_hold_their_limits_apart_from_the_one_that_shows_a_miss(name: str) -> None:
    m = jp.loads(jp.examples.text(name))
    if not any(part.limits.errors for part in m.every_part):
        return
    questions = [jp.worst, *([jp.loaded] if m.has_loads else [])]
    missed = any(outcome(from_dataset(question(m))) == MISSED for question in questions)
    assert missed == (name == "four-bar-fits")


def test_shares_have_the_digits_that_matter() -> None:
    told = [percent(share) for share in (0.5, 0.0123456, 1e-6, 0.999, 0.99999)]
    assert told == ["50 %", "1.23 %", "1 ppm", "99.9 %", "99.999 %"]


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (
            {"probability": 0.99},
            "limits.probability is the share of the specimens within limits: give one of x, y, angle",
        ),
        ({"position": 1, "probability": 1.5}, "limits.probability: must be less than 1: 1.5"),
        ({"x": [0.1, 0.2]}, "low <= 0 <= high is needed"),
        ({"x": {}}, "give low, high or both"),
        ({"z": 0.1}, "limits: 'z'"),
        ({"rx": 0.1}, "limits: 'rx'"),
        ({"y": -0.1}, "must be 0 or more, for both sides"),
        ({"angle": "wide"}, "limits.angle"),
    ],
)
def test_limits_that_mean_nothing_are_refused(limits: dict[str, Any], said: str) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    with pytest.raises(jp.InputError) as refused:
        m.with_({"limits": limits})
    assert said in str(refused.value)


def test_check_names_the_limits() -> None:
    said = jp.check(jp.loads(FITS)).attrs["limits"].splitlines()
    assert said == [
        "y from -0.07 to 0.06 mm or angle from -0.035 to 0.035 deg or position 0.08 mm",
        "99.73 % of the specimens have to keep to them at every configuration",
    ]
    several = jp.check(jp.loads(jp.examples.text("slider-crank-cases"))).attrs["limits"].splitlines()
    assert [line.partition(":")[0] for line in several] == ["face", "pin"]
    assert "limits" not in jp.check(example("five-bar").with_({"limits": None})).attrs


def test_plots_draw_the_limits() -> None:
    from jointplay import plot

    m = jp.loads(FITS)
    random = jp.random(m, samples=500)
    axes = plot.error({"worst": jp.worst(m), "random": random}).axes[0]
    (limit,) = [line for line in axes.lines if line.get_label() == "limit"]
    assert set(limit.get_ydata()) == {0.08}
    axes = plot.histogram(random, "y").axes[0]
    drawn = {float(line.get_xdata()[0]) for line in axes.lines}
    assert {-0.07, 0.06} <= drawn
    assert axes.get_xlim()[0] <= -0.07
    assert axes.get_xlim()[1] >= 0.06
    swept = jp.sweep(m, "joints.*.clearance.diameter", [12.0, 14.0])
    assert any(set(line.get_ydata()) == {0.08} for line in plot.sweep(swept).axes[0].lines)
    plain = plot.error(jp.worst(example("four-bar").with_({"limits": None}), starts=2)).axes[0]
    assert "limit" not in [line.get_label() for line in plain.lines]


def test_sweeps_comparisons_and_maps_mark_what_is_missed() -> None:
    m = jp.loads(FITS)
    sweep = tables(from_dataset(jp.sweep(m, "joints.*.clearance.fit", ["H7/g6", "H8/f7"])))[0]
    assert next(column for column in sweep.columns if column.name == "beyond limit").cells == ("0", "6")
    tight = m.with_({"joints.*.clearance.fit": "H7/g6"})
    compare = tables(from_dataset(jp.compare(m, tight, names=("loose", "tight"))))[0]
    marks = {column.name: set(column.cells) for column in compare.columns if "beyond" in column.name}
    assert marks == {"loose\nbeyond limit": {"y, angle, position"}, "tight\nbeyond limit": {"–"}}
    mapped = jp.map(m, "worst", grid={"theta1": [30, 50, 70]})
    notes = tables(from_dataset(mapped))[0].notes
    assert "At 3 nodes the position is beyond its limit." in notes
    assert outcome(from_dataset(mapped)) == ""


def test_what_is_rounding_is_nothing_in_sentences() -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    [sentence, *_] = verdict(from_dataset(jp.given(m, {"J1.x": 1e-16}))).sentences
    assert sentence.startswith("Limits hold: position 0 mm of 4 mm")
    assert "blame" not in sentence


def test_what_a_load_leaves_open_is_not_called_nothing() -> None:
    result = from_dataset(jp.loaded(jp.loads(jp.examples.text("press"))))
    assert not result.get("error")[:, -1].any()
    assert result.get("undetermined")[:, -1].any()
    assert "No rotation" not in " ".join(sentence.text for sentence in conclude(result).sentences)


def test_what_a_load_leaves_open_is_said_beside_the_largest_error() -> None:
    """A guide that nothing pushes sideways: 0.02 mm along, and y = gap + gap / half length * 50 mm either way."""
    b = planar()
    b.revolute("A", ground=(0, 0), arm=(0, 0), clearance=jp.radial(0.02))
    guide = {"at": (0, 0), "axis": (1, 0)}
    b.prismatic("S", arm={**guide, "at": (100, 0)}, rod=guide, clearance=jp.gap(0.02, length=30))
    b.drive("q", joint="A", values=[0])
    b.drive("s", joint="S", values=[10])
    b.output(body="rod", at=(50, 0))
    b.load(force=(-10, 0))
    far = math.hypot(0.02, 0.02 / 15 * 50)
    first, *_ = conclude(from_dataset(jp.loaded(b.mechanism()))).sentences
    assert first.text.startswith(f"Largest position error: 0.02 mm, up to {far:.4g} mm with what the load leaves open")


def test_no_source_is_blamed_for_what_first_order_does_not_tell(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """At its dead centre a slider goes by the square of the drive's error, and by its pin's clearance beside it."""
    m = at_dead_centre(1, 0.0, "limits.x = 0.1").with_({"joints.B.clearance": {"radial": 0.01}})
    found = from_dataset(jp.worst(m))
    causes, share = blame(found).largest("position", 0) or ([], 0.0)
    assert causes == ["higher order"]
    assert share == pytest.approx(1.0 - 0.01 / 0.2953, abs=1e-3)
    file = tmp_path / "m.toml"
    file.write_text(m.complete_text, encoding="utf-8")
    run(["error", str(file), "-q", "worst"])
    said = " ".join(capsys.readouterr().out.split())
    assert "first order explains only 3 % of it" in said
    assert "B 100 %" not in said


@pytest.mark.parametrize("question", ["worst", "given", "loaded"])
def test_a_known_deviation_is_to_be_corrected_and_not_to_be_tightened(question: str) -> None:
    """It has no tolerance: "to tighten first: q1 95 %" asked for the impossible."""
    b = planar()
    b.revolute("a", ground=(0, 0), u=(0, 0), clearance={"radial": 0.02})
    b.drive("q1", joint="a", values=[0], deviation=0.1)
    b.output(body="u", at=(200, 0))
    b.load(force=(0, 10))
    b.limits(position=0.1)
    m = b.mechanism()
    asked = {"worst": worst.compute, "loaded": loaded.compute, "given": of_given.compute}[question]
    first = conclude(asked(m)).sentences[0].text
    assert "; to correct first: q1 " in first
    assert "tighten" not in first
    # A tolerance beside it can be tightened.
    assert "to tighten first: q1" in conclude(asked(m.with_({"drives.q1.error": 0.01}))).sentences[0].text
    factor = conclude(allow.compute(m, "worst")).sentences[1].text
    assert factor.endswith("; q1: known and without a tolerance, to be corrected first.")
